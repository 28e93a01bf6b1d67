//! Lists of stops written as programs that move, wait, trigger and log.

use super::dialect;
use super::language::{Joints, Language, Motion, Stop, Written, number};

/// Files of a program that visits the stops: name and text.
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
    dialect::program(language, name, &stops, motion, pulses)
}

/// A name that stands in a comment or a string of every language.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || "_-.".contains(c) { c } else { '_' }).collect()
}
