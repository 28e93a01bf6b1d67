//! What a joint may have beside its parameters: `beta_deg`, limits, and whether it slides.

use super::names::plain;
use super::table::Table;
use super::units::TWO_TURNS;
use crate::files::Result;
use crate::formats::robots::dh_words::slides;
use crate::tables::Fields;
use crate::tables::names::{self, Unit};

/// The least and the largest angle of a joint.
pub(super) type Limits = (f64, f64);

pub(super) struct Beside {
    pub beta_deg: Vec<Option<f64>>,
    /// Of a joint that slides as they stand there.
    pub limits_deg: Vec<Option<Limits>>,
    pub slides: Vec<bool>,
    /// Columns with numbers that nothing was read of.
    pub left_out: Vec<String>,
}

/// Limits in degrees: in radians where they say so, or none is beyond two turns. Those of joints that slide stay as
/// they are.
fn in_deg(limits: &mut [Option<Limits>], slides: &[bool], stated: Option<Unit>) {
    let mut turning: Vec<&mut Limits> = limits
        .iter_mut()
        .zip(slides)
        .filter(|(_, slides)| !**slides)
        .filter_map(|(limits, _)| limits.as_mut())
        .collect();
    let largest = turning.iter().map(|(low, high)| low.abs().max(high.abs())).fold(0.0, f64::max);
    if stated.map_or(largest <= TWO_TURNS, |unit| unit == Unit::Rad) {
        turning.iter_mut().for_each(|(low, high)| (*low, *high) = (low.to_degrees(), high.to_degrees()));
    }
}

/// Whether a column says of each joint that it turns or slides.
fn is_of_kind(name: &str) -> bool {
    let words = plain(name).0;
    matches!(&words.iter().map(String::as_str).collect::<Vec<_>>()[..], ["type" | "kind" | "sigma" | "jointtype"])
}

/// Whether a column is that of a limit: -1 the least, 1 the largest angle.
fn side(name: &str) -> Option<i32> {
    const BESIDE: &str = "q theta \u{3b8} joint angle limit limits lim range position pos deg rad degree degrees j i";
    let words = names::words(name).0;
    let of = |word: &str| match word {
        "min" | "qmin" | "lower" | "low" | "minimum" => Some(-1),
        "max" | "qmax" | "upper" | "high" | "maximum" => Some(1),
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
        let only = |wanted: &dyn Fn(&str) -> bool| self.only(wanted);
        let beta = only(&|name| name.eq_ignore_ascii_case("beta_deg"));
        let bounds = only(&|name| side(name) == Some(-1)).zip(only(&|name| side(name) == Some(1)));
        let kind = self.kind();
        let slides = self.sliding()?;
        let (mut beta_deg, mut limits_deg) = (Vec::new(), Vec::new());
        for (line, row) in self.rows {
            let number = |column: usize| self.number(*line, row, column).map(|v| v.number);
            let of = |column: Option<usize>| column.filter(|&c| !row[c].is_empty()).map(number).transpose();
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
        in_deg(&mut limits_deg, &slides, bounds.and_then(|(low, _)| plain(&names[low]).1));
        let read = |c: usize| {
            columns.contains(&c) || [beta, kind].contains(&Some(c)) || bounds.is_some_and(|b| b.0 == c || b.1 == c)
        };
        let numbers = |c: usize| {
            let is_number =
                |cell: &str| cell.contains(|c: char| c.is_ascii_digit()) && !cell.contains(|c: char| c.is_alphabetic());
            !self.counts(c) && self.rows.iter().all(|(_, row)| is_number(&row[c]))
        };
        let left_out = (0..names.len()).filter(|&c| !read(c) && !names[c].is_empty() && names[c] != "-" && numbers(c));
        let left_out = left_out.map(|c| names[c].clone()).collect();
        Ok(Beside { beta_deg, limits_deg, slides, left_out })
    }

    /// The one column whose name is so.
    fn only(&self, wanted: &dyn Fn(&str) -> bool) -> Option<usize> {
        let names = self.names.unwrap_or_default();
        let mut found = (0..names.len()).filter(|&c| wanted(&names[c]));
        found.next().filter(|_| found.next().is_none())
    }

    /// The column that says whether a joint turns or slides.
    fn kind(&self) -> Option<usize> {
        self.only(&is_of_kind)
    }

    /// Whether the column of the joints' kinds says that a row holds still.
    pub(super) fn is_fixed(&self, at: usize) -> bool {
        let word = |column: usize| self.rows[at].1[column].trim().trim_matches(['"', '\'']);
        self.kind().is_some_and(|column| word(column).eq_ignore_ascii_case("fixed"))
    }

    /// Which rows are of joints that slide. A column of other words, of motors for one, says nothing of it.
    pub(super) fn sliding(&self) -> Result<Vec<bool>> {
        let kind = self.kind();
        if let Some(said) = self.joints.filter(|_| kind.is_none()) {
            let any = (0..self.rows.len()).any(|at| self.has_variable(at));
            let still: Vec<bool> = (0..self.rows.len())
                .map(|at| self.still.get(at) == Some(&true) || any && !self.has_variable(at))
                .collect();
            let of_list = said.slides(self.rows.len(), &still);
            let hint = Some("a word for each row: revolute (R, 0) or prismatic (P, 1)");
            if let Some(slides) = of_list.map_err(|(line, message)| self.grid.refuse(line, message, hint))? {
                return Ok(slides);
            }
        }
        let of_row = |(at, (_, row)): (usize, &(u64, Fields))| {
            kind.and_then(|column| if self.is_fixed(at) { Some(false) } else { slides(&row[column]) })
        };
        let said: Vec<Option<bool>> = self.rows.iter().enumerate().map(of_row).collect();
        let unknown = said.iter().position(Option::is_none).filter(|_| said.iter().any(Option::is_some));
        if let (Some(at), Some(column)) = (unknown, kind) {
            let (line, row) = &self.rows[at];
            let message = format!("joint {} is `{}`, neither revolute nor prismatic", at + 1, &row[column]);
            return Err(self.grid.refuse(
                *line,
                message,
                Some("a word for each row: revolute (R, 0) or prismatic (P, 1)"),
            ));
        }
        Ok(said.into_iter().map(|slides| slides == Some(true)).collect())
    }
}
