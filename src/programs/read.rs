//! Programs read: every instruction that moves the robot, with the joint targets that it moves by, and the text with
//! other readings.

use std::ops::Range;

use super::dialect;
use super::instruction::Instruction;
use super::language::{Joints, Language, Target, number};
use super::scan::Lines;

/// A program's motions and the joint targets that are written in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    /// Every list of joint values, in the order of the text.
    pub targets: Vec<Target>,
    /// Every instruction that moves the robot, in the order of the text.
    pub motions: Vec<Instruction>,
}

impl Program {
    /// Reads a program. An error says what could not be understood.
    pub fn read(language: Language, text: &str, joints: Joints) -> Result<Program, String> {
        let targets = all_targets(language, text, joints)?;
        let lines = Lines::of(text);
        let mut motions = (dialect::of(language).motions)(text, &targets);
        motions.iter_mut().for_each(|motion| motion.line = lines.line(motion.at));
        Ok(Program { targets, motions })
    }

    /// Places in the list of the targets that the program moves by; of a file without motions all whose language gives
    /// joint targets a type.
    pub fn moved_by(&self, language: Language) -> Vec<usize> {
        if self.motions.is_empty() && language != Language::UrScript {
            return (0..self.targets.len()).collect();
        }
        let mut moved: Vec<usize> = self.motions.iter().flat_map(|m| m.moves_by.iter().flatten().copied()).collect();
        moved.sort_unstable();
        moved.dedup();
        moved
    }
}

/// The joint targets of a program, in its order: those that it moves by, and what is plainly one though nothing moves
/// by it.
pub fn targets(language: Language, text: &str, joints: Joints) -> Result<Vec<Target>, String> {
    let program = Program::read(language, text, joints)?;
    if language != Language::UrScript {
        return Ok(program.targets);
    }
    // A list is a joint target where something moves by it, or where its name says so, as PolyScope's do.
    let moved = program.moved_by(language);
    let kept = |(k, t): (usize, Target)| (moved.binary_search(&k).is_ok() || t.name.ends_with('q')).then_some(t);
    Ok(program.targets.into_iter().enumerate().filter_map(kept).collect())
}

/// Every list of joint values, in the order of the text.
fn all_targets(language: Language, text: &str, joints: Joints) -> Result<Vec<Target>, String> {
    let found = (dialect::of(language).targets)(text, joints.count());
    if found.iter().any(|t| t.pulses) && joints.pulses_per_deg.len() != joints.count() {
        return Err(format!(
            "the targets are in pulses; the number of pulses a degree of each of the {} joints is needed",
            joints.count()
        ));
    }
    let lines = Lines::of(text);
    let converted = |mut t: Target| {
        t.line = lines.line(t.places[0].start);
        if t.name.is_empty() {
            t.name = format!("line {}", t.line);
        }
        for (joint, reading) in t.readings.iter_mut().enumerate() {
            *reading /= joints.factor(language, t.pulses, joint);
        }
        t
    };
    Ok(found.into_iter().map(converted).collect())
}

/// The program with other readings (deg, mm) for some of its targets; everything else stays to the byte.
pub fn with_readings(language: Language, text: &str, joints: Joints, changed: &[(&Target, Vec<f64>)]) -> String {
    let mut edits: Vec<(Range<usize>, String)> = Vec::new();
    for (target, readings) in changed {
        for (joint, (place, reading)) in target.places.iter().zip(readings).enumerate() {
            let value = reading * joints.factor(language, target.pulses, joint);
            let written = number(language, target.pulses, value);
            edits.push((place.clone(), dialect::written(language, &text[place.clone()], written, value)));
        }
    }
    edited(text, edits)
}

/// A text with other words in some places.
pub fn edited(text: &str, mut edits: Vec<(Range<usize>, String)>) -> String {
    edits.sort_by_key(|(place, _)| place.start);
    let mut out = String::with_capacity(text.len() + 8 * edits.len());
    let mut done = 0;
    for (place, written) in edits {
        out.push_str(&text[done..place.start]);
        out.push_str(&written);
        done = place.end;
    }
    out + &text[done..]
}
