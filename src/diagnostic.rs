//! How an error is told, and which exit status it ends in. Imports nothing of this crate.
//!
//! Each stage has an error enum of its own whose variants carry the numbers; [`crate::commands::Error`] gathers them.
//! A message says what was found and what was needed; [`Explain`] adds where, and what to try.

use camino::Utf8PathBuf;

/// Exit status of the program, as the contract has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    /// Done, and within tolerance where there is one.
    Done = 0,
    /// Done, but out of tolerance.
    OutOfTolerance = 1,
    /// Bad usage or bad input.
    BadInput = 2,
    /// A computation did not converge, or the data cannot determine the answer.
    Undetermined = 3,
}

impl Status {
    /// The number the process ends with.
    pub fn code(self) -> u8 {
        self as u8
    }

    /// The graver of two.
    #[must_use]
    pub fn or_worse(self, other: Status) -> Status {
        self.max(other)
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
    /// What a reader of the results folder must know.
    fn note(&self) -> Option<String> {
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
    if let Some(note) = error.note() {
        text.push_str(&format!("  note: {note}\n"));
    }
    text
}

/// `1 picture`, `2 pictures`.
pub fn count(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

/// Letters that are wrong, missing or too many in a word, where it is most likely the other: at most one in three, as
/// more make another word.
pub fn slips(typed: &str, word: &str) -> Option<usize> {
    let [typed, word] = [typed, word].map(|w| w.trim_start_matches('-').chars().collect::<Vec<char>>());
    let mut before: Vec<usize> = (0..=word.len()).collect();
    for (i, a) in typed.iter().enumerate() {
        let mut row = vec![i + 1];
        for (j, b) in word.iter().enumerate() {
            row.push((before[j] + usize::from(a != b)).min(before[j + 1] + 1).min(row[j] + 1));
        }
        before = row;
    }
    let longest = typed.len().max(word.len());
    Some(before[word.len()]).filter(|&wrong| wrong < longest && wrong <= (longest / 3).max(1))
}

/// A sentence with its first letter as a capital.
pub fn capital(sentence: &str) -> String {
    let mut chars = sentence.chars();
    chars.next().map_or_else(String::new, |first| first.to_uppercase().chain(chars).collect())
}

/// An error or an uncertainty as it is stated, with two significant digits: `0.0061`, `1.6`, `245`. Nothing finer than
/// a nanometre (of mm) is told from zero; a value that is none is "n/a".
pub fn two_digits(value: f64) -> String {
    fixed(value, decimals_of(value))
}

/// A number as a person would write it, with seven significant digits at the most: `29.61111`, `25`.
pub fn short(value: f64) -> String {
    format!("{value:.6e}").parse().unwrap_or(value).to_string()
}

/// Values of one kind below each other with the same decimals: two digits of those that are a tenth as large as the
/// largest.
pub fn aligned(values: &[Option<f64>]) -> Vec<String> {
    let largest = values.iter().flatten().filter(|v| v.is_finite()).fold(0.0_f64, |most, v| most.max(v.abs()));
    let decimals = if largest > 0.0 { (decimals_of(largest) + 1).min(FINEST) } else { 0 };
    values.iter().map(|value| fixed(value.unwrap_or(f64::NAN), decimals)).collect()
}

/// What something is at most, rounded up to three digits, and to more where these would put it beyond a limit that it
/// is within. Two digits would say up to a tenth more than is known, beside a sum that says less.
pub fn at_most(value: f64, limit: f64) -> String {
    let all = (decimals_of(value) + 1).min(FINEST)..FINEST;
    let decimals = all.into_iter().find(|&d| value > limit || rounded_up(value, d) <= limit).unwrap_or(FINEST);
    fixed(rounded_up(value, decimals), decimals)
}

/// Rounded up to so many decimals; what is a number of these but for the last bits of a double stays that.
fn rounded_up(value: f64, decimals: usize) -> f64 {
    let steps = 10f64.powi(decimals as i32);
    (value * steps - 1e-6).ceil() / steps
}

/// Two lengths and their sum, which is rounded up, with the same decimals and so that what is written adds up: `[a, b,
/// a + b]`.
pub fn summed(a: f64, b: f64) -> [String; 3] {
    let sum = a + b;
    if !sum.is_finite() {
        return ["n/a"; 3].map(str::to_owned);
    }
    let (less, more) = (a.abs().min(b.abs()), a.abs().max(b.abs()));
    let decimals = if less > 0.0 { decimals_of(less) } else { 0 }.max(decimals_of(more) + 1).min(FINEST);
    let rounded = |v: f64| format!("{v:.decimals$}").parse::<f64>().unwrap_or(v);
    let sum = rounded_up(sum, decimals);
    // The last digit of the second gives way.
    [a, sum - rounded(a), sum].map(|v| format!("{v:.decimals$}"))
}

/// Most decimals of a length in mm.
const FINEST: usize = 6;

/// Decimals that leave two significant digits.
fn decimals_of(value: f64) -> usize {
    // Rounded first: 0.0996 is 0.10.
    let exponent = format!("{value:.1e}").split_once('e').and_then(|(_, power)| power.parse::<i32>().ok());
    (1 - exponent.unwrap_or(0)).clamp(0, FINEST as i32) as usize
}

/// With so many decimals; what rounds to zero is a bare zero.
fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return "n/a".to_owned();
    }
    let text = format!("{value:.decimals$}");
    if text.chars().all(|c| matches!(c, '0' | '.' | '-')) { "0".to_owned() } else { text }
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
        match self.reason.is_empty() {
            true => self.text.clone(),
            false => format!("{}. {}", self.text, capital(&self.reason)),
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
    fn two_digits_are_kept_whatever_the_size() {
        for (value, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (1e-9, "0"),
            (0.000_012, "0.000012"),
            (0.00557, "0.0056"),
            (0.0996, "0.10"),
            (-0.0444, "-0.044"),
            (1.5673, "1.6"),
            (9.96, "10"),
            (244.88, "245"),
            (f64::INFINITY, "n/a"),
        ] {
            assert_eq!(two_digits(value), text);
        }
    }

    #[test]
    fn short_numbers_have_few_digits() {
        assert_eq!(
            [29.611_111_111, 149.999_999_999, 25.0, 0.001, 10.000_12].map(short),
            ["29.61111", "150", "25", "0.001", "10.00012"]
        );
    }

    #[test]
    fn a_column_has_the_decimals_of_its_largest_value() {
        let column = aligned(&[Some(1.5673), Some(-0.2104), None, Some(0.001)]);
        assert_eq!(column, ["1.57", "-0.21", "n/a", "0"]);
        assert_eq!(aligned(&[Some(0.0), None]), ["0", "n/a"]);
    }

    #[test]
    fn a_bound_is_rounded_up_and_not_beyond_its_limit() {
        for (value, limit, text) in [
            (2.1383, 2.5, "2.14"),
            (2.1383, 2.1385, "2.1383"),
            (0.0061, 0.05, "0.00610"),
            (0.006_001, 0.05, "0.00601"),
            (0.049_96, 0.05, "0.0500"),
            (3.8018, 2.12, "3.81"),
            (0.3, 0.3, "0.300"),
        ] {
            assert_eq!(at_most(value, limit), text);
        }
        assert_eq!(at_most(f64::INFINITY, 1.0), "n/a");
    }

    #[test]
    fn what_is_written_of_a_sum_adds_up() {
        assert_eq!(summed(1.0408, 1.2469), ["1.04", "1.25", "2.29"]);
        assert_eq!(summed(3.152, 0.6498), ["3.15", "0.66", "3.81"]);
        assert_eq!(summed(0.005_565, 0.000_494), ["0.00556", "0.00050", "0.00606"]);
        // 0.0144 and 0.0144 are 0.0288.
        assert_eq!(summed(0.0144, 0.0144), ["0.0144", "0.0144", "0.0288"]);
        for (a, b) in [(1.0449, 1.0449), (0.1, 0.033_35), (2.0, 0.0), (0.004_449, 0.004_449)] {
            let texts = summed(a, b);
            let [x, y, sum] = [0, 1, 2].map(|k| texts[k].parse::<f64>().unwrap());
            assert!((x + y - sum).abs() < 1e-9, "{texts:?}");
        }
        assert_eq!(summed(1.0, f64::NAN)[2], "n/a");
    }
}
