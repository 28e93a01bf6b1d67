//! What a joint may have beside its parameters: `beta_deg`, and limits.

use super::names::plain;
use super::table::Table;
use super::units::TWO_TURNS;
use crate::files::Result;
use crate::tables::names::{self, Unit};

/// The least and the largest angle of a joint.
pub(super) type Limits = (f64, f64);

pub(super) struct Beside {
    pub beta_deg: Vec<Option<f64>>,
    pub limits_deg: Vec<Option<Limits>>,
    /// Columns with numbers that nothing was read of.
    pub left_out: Vec<String>,
}

/// Limits in degrees: in radians where they say so, or none is beyond two turns.
pub(super) fn in_deg(limits: &mut [Option<Limits>], stated: Option<Unit>) {
    let largest = limits.iter().flatten().map(|(low, high)| low.abs().max(high.abs())).fold(0.0, f64::max);
    if stated.map_or(largest <= TWO_TURNS, |unit| unit == Unit::Rad) {
        limits.iter_mut().flatten().for_each(|(low, high)| (*low, *high) = (low.to_degrees(), high.to_degrees()));
    }
}

/// Whether a column is that of a limit: -1 the least, 1 the largest angle.
fn side(name: &str) -> Option<i32> {
    const BESIDE: &str = "q theta \u{3b8} joint angle limit limits lim range position pos deg rad degree degrees j i";
    let words = names::words(name).0;
    let of = |word: &str| match word {
        "min" | "lower" | "low" | "minimum" => Some(-1),
        "max" | "upper" | "high" | "maximum" => Some(1),
        _ => None,
    };
    let mut sides = words.iter().filter_map(|word| of(word));
    let known = words.iter().all(|word| of(word).is_some() || BESIDE.split(' ').any(|beside| beside == word));
    match (sides.next(), sides.next()) {
        (Some(side), None) if known => Some(side),
        _ => None,
    }
}

impl Table<'_> {
    /// Columns beside the parameters, of a table with names.
    pub(super) fn beside(&self, columns: [usize; 4]) -> Result<Beside> {
        let names = self.names.unwrap_or_default();
        let only = |wanted: &dyn Fn(&str) -> bool| {
            let mut found = (0..names.len()).filter(|&c| wanted(&names[c]));
            found.next().filter(|_| found.next().is_none())
        };
        let beta = only(&|name| name.eq_ignore_ascii_case("beta_deg"));
        let bounds = only(&|name| side(name) == Some(-1)).zip(only(&|name| side(name) == Some(1)));
        let (mut beta_deg, mut limits_deg) = (Vec::new(), Vec::new());
        for (line, row) in self.rows {
            let of = |column: Option<usize>| match column.filter(|&c| !row[c].is_empty()) {
                Some(column) => self.number(*line, row, column).map(|v| Some(v.number)),
                None => Ok(None),
            };
            beta_deg.push(of(beta)?);
            limits_deg.push(match (of(bounds.map(|b| b.0))?, of(bounds.map(|b| b.1))?, bounds) {
                (Some(low), Some(high), Some((of_low, of_high))) if low >= high => {
                    let message = format!("{} {low} is not below {} {high}", names[of_low], names[of_high]);
                    return Err(self.grid.refuse(*line, message, None));
                }
                (Some(low), Some(high), _) => Some((low, high)),
                _ => None,
            });
        }
        in_deg(&mut limits_deg, bounds.and_then(|(low, _)| plain(&names[low]).1));
        let read = |c: usize| columns.contains(&c) || beta == Some(c) || bounds.is_some_and(|b| b.0 == c || b.1 == c);
        let numbers = |c: usize| {
            let is_number =
                |cell: &str| cell.contains(|c: char| c.is_ascii_digit()) && !cell.contains(|c: char| c.is_alphabetic());
            !self.counts(c) && self.rows.iter().all(|(_, row)| is_number(&row[c]))
        };
        let left_out = (0..names.len()).filter(|&c| !read(c) && !names[c].is_empty() && names[c] != "-" && numbers(c));
        let left_out = left_out.map(|c| names[c].clone()).collect();
        Ok(Beside { beta_deg, limits_deg, left_out })
    }
}
