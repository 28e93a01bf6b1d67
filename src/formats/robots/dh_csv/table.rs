//! The rows of a table as numbers.

use std::ops::Range;

use super::names::{HINT, NAMES};
use crate::files::Result;
use crate::formats::robots::dh_text::{Known, Said, indexed};
use crate::formats::robots::dh_words::Words;
use crate::robot::catalogue::Row;
use crate::tables::expression::{self, Value};
use crate::tables::names::Unit;
use crate::tables::{Fields, Grid};

/// Rows with what their names, cells and words mean.
pub(super) struct Table<'a> {
    pub grid: &'a Grid,
    pub rows: &'a [(u64, Fields)],
    pub names: Option<&'a [String]>,
    /// The names that a flag gave.
    pub given: Option<&'a [String]>,
    pub known: &'a Known,
    pub words: Words,
    /// Rows that are none of joints by their names.
    pub still: &'a [bool],
    /// What lists beside the table say of the joints.
    pub joints: Option<&'a Said>,
    /// What a flag says of angles and lengths.
    pub units: [Option<Unit>; 2],
}

/// The letter that joints' variables have beside the usual ones: KUKA's axes, and d of a joint that slides.
fn own_letter(slides: bool) -> char {
    if slides { 'd' } else { 'A' }
}

impl Table<'_> {
    /// What a cell says: a number, or a formula.
    pub fn value(&self, cell: &str) -> Option<Value> {
        let known = |name: &str| self.known.get(name).copied();
        let cell = &indexed(cell);
        expression::evaluate(cell, &known).or_else(|| expression::counted_back(cell, &known))
    }

    /// The same in the place of the joint's own variable, which `A3`, or `d3` where it slides, may stand for.
    fn own(&self, cell: &str, slides: bool) -> Option<Value> {
        let of_reading = || self.value(&expression::of_reading(cell, own_letter(slides))).filter(|v| v.variable);
        self.value(cell).or_else(of_reading)
    }

    /// What a cell says in the place of theta.
    pub fn theta(&self, cell: &str) -> Option<Value> {
        self.own(cell, false)
    }

    /// Which rows are of joints that count the other way by the variable in their cell.
    pub fn flipped(&self, columns: [usize; 4]) -> Result<Vec<bool>> {
        let slides = self.sliding()?;
        let of_row = |((_, row), slides): (&(u64, Fields), bool)| {
            let cell = &row[columns[if slides { 3 } else { 2 }]];
            let known = |name: &str| self.known.get(name).copied();
            let is_back = |cell: &str| expression::counted_back(&indexed(cell), &known).is_some();
            is_back(cell) || is_back(&expression::of_reading(cell, own_letter(slides)))
        };
        Ok(self.rows.iter().zip(slides).map(of_row).collect())
    }

    /// Whether a column counts the rows, from 0 or from 1.
    pub fn counts(&self, column: usize) -> bool {
        let from = |first: usize| (first..).zip(self.rows).all(|(n, (_, row))| row[column].parse() == Ok(n));
        from(0) || from(1)
    }

    pub fn number(&self, line: u64, row: &Fields, column: usize) -> Result<Value> {
        let refuse = || self.grid.refuse(line, format!("`{}` is not a number", &row[column]), Some(HINT));
        self.value(&row[column]).filter(|value| value.number.is_finite()).ok_or_else(refuse)
    }

    /// Whether a row is none of a joint by its name, or by the word of its kind.
    fn is_still(&self, at: usize) -> bool {
        self.still.get(at) == Some(&true) || self.is_fixed(at)
    }

    /// Whether a row names a joint's variable in any of its cells.
    pub fn has_variable(&self, at: usize) -> bool {
        self.rows[at].1.iter().any(|cell| self.value(cell).is_some_and(|v| v.variable))
    }

    /// The rows of joints: where some have the joint's variable for theta, rows at the end without one are the flange
    /// and rows before the first the base; so are rows that hold still by their names.
    pub fn turning(&self, columns: [usize; 4]) -> Result<Range<usize>> {
        let (theta, count) = (columns[2], self.rows.len());
        let turns = |at: usize| self.theta(&self.rows[at].1[theta]).is_some_and(|v| v.variable);
        // What is no number, or slides, is said of the cell.
        let slides = self.sliding()?;
        let value = |at: usize, which: usize| self.theta(&self.rows[at].1[columns[which]]);
        let stands = |at: usize| {
            self.is_still(at) || !slides[at] && (0..4).all(|which| value(at, which).is_some_and(|v| !v.variable))
        };
        let any = (0..count).any(turns);
        let moves = |at: &usize| !self.is_still(*at) && (!any || turns(*at) || slides[*at]);
        let last = (0..count).rev().find(moves);
        let (Some(first), Some(last)) = ((0..count).find(moves), last) else { return Ok(0..count) };
        let number = expression::number_of_variable(&indexed(&self.rows[first].1[theta]));
        // A first variable of another number than the least is no first joint's.
        let is_base = (0..first).all(|at| self.is_still(at)) || number.is_some_and(|n| n < 2);
        let from = if is_base { first } else { 0 };
        if let Some(at) = (from..last).find(|at| !moves(at) && stands(*at)) {
            let (line, row) = &self.rows[at];
            let message = match self.is_still(at) {
                true => format!("row {} holds still by its name, but stands among rows of joints", at + 1),
                false => format!(
                    "theta is `{}`, but other rows have their joint's variable there: this one does not turn",
                    &row[theta]
                ),
            };
            return Err(self.grid.refuse(
                *line,
                message,
                Some("a row a joint; add what stands still to the row before"),
            ));
        }
        let behind = (last + 1..count).all(stands);
        let before = (0..first).all(stands);
        Ok(if before { from } else { 0 }..if behind { last + 1 } else { count })
    }

    /// Alpha, a, theta and d of all rows as they stand, and whether angles are written with pi.
    pub fn numbers(&self, columns: [usize; 4]) -> Result<(Vec<Row>, bool)> {
        let mut numbers: Vec<Row> = Vec::with_capacity(self.rows.len());
        let mut radians = false;
        let slides = self.sliding()?;
        for ((line, row), slides) in self.rows.iter().zip(slides) {
            let mut of_row = [0.0; 4];
            for (which, (slot, &column)) in of_row.iter_mut().zip(&columns).enumerate() {
                let own = match which {
                    2 => self.own(&row[column], false),
                    3 if slides => self.own(&row[column], true),
                    _ => None,
                };
                let value = own.map_or_else(|| self.number(*line, row, column), Ok)?;
                if value.variable && which != 2 && !(slides && which == 3) {
                    let message =
                        format!("`{}`: the joint's variable is {}, so the joint slides", &row[column], NAMES[which]);
                    let hint =
                        "write its offset there, and a column `type` that says revolute or prismatic of each joint";
                    return Err(self.grid.refuse(*line, message, Some(hint)));
                }
                radians |= value.radians && matches!(which, 0 | 2);
                *slot = value.number;
            }
            numbers.push(of_row);
        }
        Ok((numbers, radians))
    }
}
