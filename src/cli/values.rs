//! Numbers as flags take them.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

use crate::imaging::Squares;
use crate::imaging::board::Error;

/// Squares that are said, or to be counted in the pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AskedSquares {
    /// `auto`.
    Counted,
    /// So many.
    Said(Squares),
}

impl FromStr for AskedSquares {
    type Err = Error;

    fn from_str(text: &str) -> Result<AskedSquares, Error> {
        if text.eq_ignore_ascii_case("auto") { Ok(AskedSquares::Counted) } else { text.parse().map(AskedSquares::Said) }
    }
}

/// Reads a finite number; what else it may be is checked where it is used.
pub(super) fn number(text: &str) -> Result<f64, String> {
    let finite = text.parse().ok().filter(|value: &f64| value.is_finite());
    finite.ok_or_else(|| "a number is needed, with a decimal point".to_owned())
}

/// Reads a whole number.
pub(super) fn whole<T: FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| "a whole number is needed, 0 or more".to_owned())
}

/// Reads a number of a range.
pub(super) fn between(least: f64, most: f64) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| match text.parse::<f64>() {
        Ok(value) if (least..=most).contains(&value) => Ok(value),
        Ok(_) => Err(format!("a number from {least} to {most} is needed")),
        Err(_) => number(text),
    }
}

/// Reads a number of a range of the settings.
pub(super) fn within(range: &RangeInclusive<f64>) -> impl Fn(&str) -> Result<f64, String> + Clone {
    between(*range.start(), *range.end())
}

/// Reads a whole number of a range.
pub(super) fn whole_between<T>(least: T, most: T) -> impl Fn(&str) -> Result<T, String> + Clone
where
    T: FromStr + PartialOrd + Display + Copy,
{
    move |text| match text.parse::<T>() {
        Ok(value) if (least..=most).contains(&value) => Ok(value),
        _ => Err(format!("a whole number from {least} to {most} is needed")),
    }
}
