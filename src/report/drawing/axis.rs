//! Ranges and labels of axes.

use std::ops::Range;

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::Ranged;

/// An axis with labels at given places.
pub(super) struct Ticked {
    inner: RangedCoordf64,
    ticks: Vec<f64>,
}

impl Ticked {
    /// From the first to the last value of a range; even ticks, or on a logarithmic axis those of [`log_ticks`].
    pub(super) fn new((first, last): (f64, f64), log: bool) -> Ticked {
        const MOST: usize = 7;
        let inner = RangedCoordf64::from(first..last);
        let even = || inner.key_points(MOST);
        let ticks = Some(log_ticks((first, last))).filter(|ticks| log && !ticks.is_empty()).unwrap_or_else(even);
        Ticked { inner, ticks }
    }
}

impl Ranged for Ticked {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        self.inner.map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() { Vec::new() } else { self.ticks.clone() }
    }

    fn range(&self) -> Range<f64> {
        self.inner.range()
    }
}

/// The range of finite values with a margin; something drawable where there is none.
pub(super) fn padded(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return (0.0, 1.0);
    }
    let margin = if high > low { 0.05 * (high - low) } else { 0.5 * low.abs().max(1e-6) };
    (low - margin, high + margin)
}

/// A range of the given length about the middle of another.
pub(super) fn widened(range: (f64, f64), length: f64) -> (f64, f64) {
    let middle = 0.5 * (range.0 + range.1);
    (middle - 0.5 * length, middle + 0.5 * length)
}

/// An axis label with as many decimals as the axis needs.
pub(super) fn tick(value: f64, range: (f64, f64)) -> String {
    let span = (range.1 - range.0).abs();
    if !span.is_finite() || span == 0.0 {
        return format!("{value}");
    }
    if !(1e-4..=1e7).contains(&span) {
        return format!("{value:.1e}");
    }
    // Steps are at least a ninth of the span.
    let decimals = (1.0 - span.log10()).ceil().clamp(0.0, 6.0) as usize;
    let text = format!("{value:.decimals$}");
    // Rounding leaves "-0.00" at the origin.
    if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') {
        text.trim_start_matches('-').to_owned()
    } else {
        text
    }
}

/// Exponents of the ticks of a logarithmic axis: powers of ten, where these are few 2 and 5 between them, where these
/// are few the other digits. Empty where not even two of them lie on the axis.
fn log_ticks((low, high): (f64, f64)) -> Vec<f64> {
    /// Ticks that make a scale, and that stand apart.
    const FEWEST: usize = 3;
    const MOST: usize = 8;
    let exponents = low.floor() as i32..=high.ceil() as i32;
    let within = |digits: &[f64]| -> Vec<f64> {
        let all = exponents.clone().flat_map(|exponent| digits.iter().map(move |d| f64::from(exponent) + d.log10()));
        all.filter(|at| (low..=high).contains(at)).collect()
    };
    let powers = within(&[1.0]);
    let every = powers.len().div_ceil(MOST).max(1);
    let finer = [vec![1.0, 2.0, 5.0], (1..10).map(f64::from).collect::<Vec<f64>>()];
    let scales = std::iter::once(powers.into_iter().step_by(every).collect()).chain(finer.iter().map(|d| within(d)));
    let scales: Vec<Vec<f64>> = scales.collect();
    let enough = scales.iter().position(|ticks| ticks.len() >= FEWEST);
    scales.into_iter().nth(enough.unwrap_or(2)).filter(|ticks| ticks.len() > 1).unwrap_or_default()
}

/// A power of ten as a label, all of an axis in the same notation; between whole exponents with two digits.
pub(super) fn power_of_ten(exponent: f64, (low, high): (f64, f64)) -> String {
    /// Exponents that are written out.
    const PLAIN: std::ops::RangeInclusive<f64> = -3.05..=4.05;
    let value = 10f64.powf(exponent);
    // One digit where it says all: 2e-4, 0.05.
    let digit = value / 10f64.powf((exponent + 1e-9).floor());
    // As many as neighbours need to differ, which stand a ninth of the axis apart.
    let apart = (high - low).abs() * std::f64::consts::LN_10 / 9.0;
    let digits = (-apart.log10()).ceil().clamp(1.0, 6.0) as usize;
    let more = if (digit - digit.round()).abs() > 1e-6 { digits } else { 0 };
    if PLAIN.contains(&low.min(high)) && PLAIN.contains(&low.max(high)) {
        let decimals = (more as f64 - (exponent + 1e-9).floor()).max(0.0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.more$e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axis_labels_have_the_decimals_they_need() {
        assert_eq!(tick(0.05, (0.0, 0.1)), "0.05");
        assert_eq!(tick(-0.0001, (-0.1, 0.1)), "0.00");
        assert_eq!(tick(2.0, (1.0, 17.0)), "2");
        assert_eq!(tick(500.0, (0.0, 1000.0)), "500");
    }

    #[test]
    fn powers_of_an_axis_have_one_notation_and_no_wrong_digit() {
        let labels = |range: (f64, f64), exponents: &[f64]| {
            exponents.iter().map(|e| power_of_ten(*e, range)).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(labels((-6.2, 1.0), &[-6.0, -4.0, -3.0, 0.0, 1.0]), "1e-6 1e-4 1e-3 1e0 1e1");
        assert_eq!(labels((-3.0, 1.2), &[-3.0, -2.0, 0.0, 1.0]), "0.001 0.01 1 10");
        assert_eq!(labels((-1.1, 0.5), &[-0.8, -0.6, -0.2, 0.0, 0.4]), "0.16 0.25 0.63 1 2.5");
        assert_eq!(labels((-5.0, -4.0), &[-4.8, -4.0]), "1.6e-5 1e-4");
        assert_eq!(labels((-0.86, -0.83), &[-0.855, -0.85, -0.845]), "0.1396 0.1413 0.1429");
        assert_eq!(labels((-2.0, 0.0), &[0.02_f64.log10(), 0.5_f64.log10()]), "0.02 0.5");
    }

    #[test]
    fn a_logarithmic_axis_has_round_ticks_that_are_not_too_many() {
        let shown = |low: f64, high: f64| {
            let range = (low.log10(), high.log10());
            log_ticks(range).iter().map(|at| power_of_ten(*at, range)).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(shown(0.0005, 2.0), "1e-3 1e-2 1e-1 1e0");
        assert_eq!(shown(0.02, 1.2), "0.02 0.05 0.1 0.2 0.5 1");
        assert_eq!(shown(0.058, 0.105), "0.06 0.07 0.08 0.09 0.1");
        assert_eq!(shown(1e-12, 10.0).split(' ').count(), 7);
        assert_eq!(shown(0.0511, 0.0555), "");
    }
}
