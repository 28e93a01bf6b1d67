//! The languages of the makers' controllers, a module each: where joint targets stand, what moves the robot, and
//! programs in it.

mod fanuc;
mod krl;
mod rapid;
mod urscript;
mod yaskawa;

use crate::programs::instruction::Instruction;
use crate::programs::language::{Joints, Language, Motion, Stop, Target, Written, number};

/// Files of a program that visits the stops, whose numbers may be pulses: name and text.
type Program = fn(name: &str, stops: &[Written], motion: &Motion, pulses: bool) -> Vec<(String, String)>;

/// What is known of a language.
pub(super) struct Dialect {
    /// Every list of joint values, in the order of the text, as it stands there.
    pub targets: fn(text: &str, count: usize) -> Vec<Target>,
    /// Every instruction that moves the robot, in the order of the text.
    pub motions: fn(text: &str, targets: &[Target]) -> Vec<Instruction>,
    program: Program,
}

pub(super) fn of(language: Language) -> Dialect {
    match language {
        Language::UrScript => {
            Dialect { targets: urscript::targets, motions: urscript::motions, program: urscript::program }
        }
        Language::Rapid => Dialect { targets: rapid::targets, motions: rapid::motions, program: rapid::program },
        Language::Krl => Dialect { targets: krl::targets, motions: krl::motions, program: krl::program },
        Language::FanucLs => Dialect { targets: fanuc::targets, motions: fanuc::motions, program: fanuc::program },
        Language::Jbi => Dialect { targets: yaskawa::targets, motions: yaskawa::motions, program: yaskawa::program },
    }
}

/// A number in place of `before`, in its form where the language has several.
pub(super) fn written(language: Language, before: &str, number: String, value: f64) -> String {
    match language {
        Language::UrScript => urscript::written(before, number, value),
        _ => number,
    }
}

/// Files of a program that moves to the stops, waits, triggers and logs: name and text.
pub fn program(
    language: Language,
    name: &str,
    stops: &[Stop],
    motion: &Motion,
    joints: Joints,
) -> Vec<(String, String)> {
    let pulses = !joints.pulses_per_deg.is_empty();
    let list = |readings: &[f64]| -> Vec<String> {
        let value = |(joint, r): (usize, &f64)| r * joints.factor(language, pulses, joint);
        readings.iter().enumerate().map(value).map(|v| number(language, pulses, v)).collect()
    };
    let stops: Vec<Written> = stops
        .iter()
        .map(|s| Written { name: plain(&s.name), readings: list(&s.readings), approach: list(&s.approach) })
        .collect();
    (of(language).program)(name, &stops, motion, pulses)
}

/// A name that stands in a comment or a string of every language.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || "_-.".contains(c) { c } else { '_' }).collect()
}
