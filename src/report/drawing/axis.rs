//! Ranges and labels of axes.

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

/// A power of ten as a label.
pub(super) fn power_of_ten(exponent: f64) -> String {
    let value = 10f64.powf(exponent);
    let decimals = (-exponent).ceil().max(0.0) as usize;
    if (1e-3..1e4).contains(&value) { format!("{value:.decimals$}") } else { format!("{value:.0e}") }
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
        assert_eq!(power_of_ten(-6.0), "1e-6");
        assert_eq!(power_of_ten(-2.0), "0.01");
        assert_eq!(power_of_ten(1.0), "10");
    }
}
