//! Whether the values of settings are in their ranges.

use std::fmt::Display;
use std::ops::RangeInclusive;

/// Tolerances and uncertainties of lengths, mm.
pub const TOLERANCES_MM: RangeInclusive<f64> = 1e-6..=1e4;

/// Notes a problem unless the value is in its range.
pub fn within<T: PartialOrd + Display>(problems: &mut Vec<String>, name: &str, value: T, range: RangeInclusive<T>) {
    if !range.contains(&value) {
        let (least, most) = range.into_inner();
        problems.push(format!("{name} is {value}; it must be from {least} to {most}"));
    }
}

/// Notes a problem unless the value is above zero, and not beyond all use.
pub fn positive(problems: &mut Vec<String>, name: &str, value: f64) {
    const RANGE: RangeInclusive<f64> = 1e-9..=1e9;
    if !RANGE.contains(&value) {
        problems.push(format!(
            "{name} is {value}; it must be above zero, from {:e} to {:e}",
            RANGE.start(),
            RANGE.end()
        ));
    }
}
