//! The languages of the makers' controllers, a module each: where joint targets stand, what moves the robot, and programs in it.

mod fanuc;
mod krl;
mod rapid;
mod urscript;
mod yaskawa;

use crate::programs::instruction::Instruction;
use crate::programs::language::{Language, Motion, Target, Written};

/// Every list of joint values, in the order of the text, as it stands there.
pub(super) fn targets(language: Language, text: &str, count: usize) -> Vec<Target> {
    match language {
        Language::UrScript => urscript::targets(text, count),
        Language::Rapid => rapid::targets(text, count),
        Language::Krl => krl::targets(text, count),
        Language::FanucLs => fanuc::targets(text, count),
        Language::Jbi => yaskawa::targets(text, count),
    }
}

/// Every instruction that moves the robot, in the order of the text.
pub(super) fn motions(language: Language, text: &str, targets: &[Target]) -> Vec<Instruction> {
    match language {
        Language::UrScript => urscript::motions(text, targets),
        Language::Rapid => rapid::motions(text, targets),
        Language::Krl => krl::motions(text, targets),
        Language::FanucLs => fanuc::motions(text, targets),
        Language::Jbi => yaskawa::motions(text, targets),
    }
}

/// A number in place of `before`, in its form where the language has several.
pub(super) fn written(language: Language, before: &str, number: String, value: f64) -> String {
    match language {
        Language::UrScript => urscript::written(before, number, value),
        _ => number,
    }
}

/// Files of a program that visits the stops: name and text.
pub(super) fn program(
    language: Language,
    name: &str,
    stops: &[Written],
    motion: &Motion,
    pulses: bool,
) -> Vec<(String, String)> {
    match language {
        Language::UrScript => urscript::program(name, stops, motion),
        Language::Rapid => rapid::program(name, stops, motion),
        Language::Krl => krl::program(name, stops, motion),
        Language::FanucLs => fanuc::program(name, stops, motion),
        Language::Jbi => yaskawa::program(name, stops, motion, pulses),
    }
}
