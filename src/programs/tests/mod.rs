//! Programs as people have them.

use super::*;

mod doubt;
mod led;
mod motions;
mod written;

fn read(language: Language, text: &str) -> Program {
    Program::read(language, text, Joints { slides: &[false; 6], pulses_per_deg: &[] }).unwrap()
}

/// What each motion moves by: names of targets, or the cause.
fn said(language: Language, text: &str) -> Vec<String> {
    let program = read(language, text);
    let name = |k: &usize| program.targets[*k].name.clone();
    let one = |m: &Instruction| match &m.moves_by {
        Ok(found) => format!("{} {}: {}", m.line, m.word, found.iter().map(name).collect::<Vec<_>>().join(" ")),
        Err(_) => m.to_string(),
    };
    program.motions.iter().map(one).collect()
}
