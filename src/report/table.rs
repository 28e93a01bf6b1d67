//! Plain tables for the terminal, and numbers as text.

use crate::diagnostic::two_digits;

/// A table with a header; the first column is aligned left, the others right.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table with these columns.
    pub fn new<S: Into<String>>(header: impl IntoIterator<Item = S>) -> Table {
        Table { rows: vec![header.into_iter().map(Into::into).collect()] }
    }

    /// Adds a row.
    pub fn row<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }
}

impl std::fmt::Display for Table {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let width = |c: usize| self.rows.iter().filter_map(|r| r.get(c)).map(|s| s.chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..columns).map(width).collect();
        for row in &self.rows {
            let mut line = String::new();
            for (c, cell) in row.iter().enumerate() {
                let pad = " ".repeat(widths[c] - cell.chars().count());
                match c {
                    0 => line += &format!("{cell}{pad}"),
                    _ => line += &format!("  {pad}{cell}"),
                }
            }
            writeln!(f, "{}", line.trim_end())?;
        }
        Ok(())
    }
}

/// A number with so many decimals, or "n/a" where there is none or it is not finite.
pub fn number(value: Option<f64>, decimals: usize) -> String {
    match value {
        Some(v) if v.is_finite() => {
            let text = format!("{v:.decimals$}");
            // What rounds to zero has no sign.
            match text.strip_prefix('-') {
                Some(zero) if zero.chars().all(|c| matches!(c, '0' | '.')) => zero.to_owned(),
                _ => text,
            }
        }
        _ => "n/a".to_owned(),
    }
}

/// An error or an uncertainty on a page, as [`two_digits`] writes it; "n/a" where there is none.
pub fn short(value: Option<f64>) -> String {
    two_digits(value.unwrap_or(f64::NAN))
}

/// A value and its standard deviation with two digits of the latter, and the same decimals of the former.
pub fn with_sigma(value: f64, sigma: f64) -> [String; 2] {
    if !(sigma.is_finite() && sigma > 0.0) {
        return [number(Some(value), 6), "n/a".to_owned()];
    }
    let decimals = (1.0 - sigma.log10().floor()).clamp(0.0, 12.0) as usize;
    [number(Some(value), decimals), number(Some(sigma), decimals)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_digits_as_the_sigma_deserves() {
        assert_eq!(with_sigma(2504.98948, 0.0736), ["2504.989", "0.074"]);
        assert_eq!(with_sigma(-0.0799888, 7.44e-5), ["-0.079989", "0.000074"]);
        assert_eq!(with_sigma(1234.5, 123.0), ["1234", "123"]);
        assert_eq!(with_sigma(1.0, f64::NAN)[1], "n/a");
    }

    #[test]
    fn numbers_line_up() {
        let mut table = Table::new(["axis", "mm"]);
        table.row(["x".to_owned(), number(Some(0.12345), 3)]);
        table.row(["µ-long", "n/a"]);
        assert_eq!([number(Some(-0.00004), 4), number(Some(-0.00006), 4)], ["0.0000", "-0.0001"]);
        assert_eq!(table.to_string(), "axis       mm\nx       0.123\nµ-long    n/a\n");
    }
}
