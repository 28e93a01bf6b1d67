//! How an error is told, and which exit status it ends in. Imports nothing of this crate.
//!
//! Each stage has an error enum of its own whose variants carry the numbers; [`crate::commands::Error`] gathers them.
//! A message says what was found and what was needed; [`Explain`] adds where, and what to try.

use camino::Utf8PathBuf;

/// Exit status of the program, as the contract has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Done, and within tolerance where there is one.
    Done,
    /// Done, but out of tolerance.
    OutOfTolerance,
    /// Bad usage or bad input.
    BadInput,
    /// A computation did not converge, or the data cannot determine the answer.
    Undetermined,
}

impl Status {
    /// The number the process ends with.
    pub fn code(self) -> u8 {
        match self {
            Status::Done => 0,
            Status::OutOfTolerance => 1,
            Status::BadInput => 2,
            Status::Undetermined => 3,
        }
    }
}

/// What an error adds to its message.
pub trait Explain: std::error::Error {
    /// The exit status it ends in.
    fn status(&self) -> Status {
        Status::BadInput
    }
    /// The file, folder, pose or pair it is about.
    fn place(&self) -> Option<String> {
        None
    }
    /// A command or a change to try.
    fn hint(&self) -> Option<String> {
        None
    }
}

/// The message as a person reads it on stderr: what, where, hint.
pub fn report(error: &impl Explain) -> String {
    let mut text = format!("error: {error}\n");
    let mut source = error.source();
    while let Some(cause) = source {
        // Many messages quote their cause already.
        let said = cause.to_string();
        if !text.contains(&said) {
            text.push_str(&format!("  cause: {said}\n"));
        }
        source = cause.source();
    }
    if let Some(place) = error.place() {
        text.push_str(&format!("  in: {place}\n"));
    }
    if let Some(hint) = error.hint() {
        text.push_str(&format!("  hint: {hint}\n"));
    }
    text
}

/// `1 picture`, `2 pictures`.
pub fn count(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

/// A number with so many digits that count: 0.0012 and 1.2 and 120 with two.
pub fn significant(value: f64, digits: i32) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".to_owned() } else { "n/a".to_owned() };
    }
    let first = |value: f64| value.abs().log10().floor() as i32;
    let decimals = (digits - 1 - first(value)).clamp(0, 12) as usize;
    let text = format!("{value:.decimals$}");
    // 0.0996 is 0.10, and not 0.100.
    match text.parse::<f64>() {
        Ok(rounded) if rounded != 0.0 && first(rounded) > first(value) => {
            format!("{rounded:.*}", decimals.saturating_sub(1))
        }
        _ => text,
    }
}

/// Something a person should know although the command ends well.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// What, where and what to do, for the terminal.
    pub text: String,
    /// What it means and why, for the page and the results; empty where the text says all.
    pub reason: String,
}

impl Warning {
    /// Text and reason.
    pub fn whole(&self) -> String {
        let mut chars = self.reason.chars();
        match chars.next() {
            Some(first) => format!("{}. {}{}", self.text, first.to_uppercase(), chars.as_str()),
            None => self.text.clone(),
        }
    }
}

impl From<String> for Warning {
    fn from(text: String) -> Warning {
        Warning { text, reason: String::new() }
    }
}

/// A line of a text file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub path: Utf8PathBuf,
    /// Its line, counted from 1, where one is to blame.
    pub line: Option<u64>,
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.line {
            Some(line) => write!(f, "{}:{line}", self.path),
            None => write!(f, "{}", self.path),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_that_count() {
        for (value, text) in [
            (0.0, "0"),
            (0.00123, "0.0012"),
            (-0.0996, "-0.10"),
            (0.5, "0.50"),
            (12.34, "12"),
            (9.96, "10"),
            (1234.5, "1234"),
            (f64::NAN, "n/a"),
        ] {
            assert_eq!(significant(value, 2), text);
        }
    }
}
