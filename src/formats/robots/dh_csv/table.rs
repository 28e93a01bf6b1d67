//! The rows of a table as numbers.

use super::names::{HINT, NAMES};
use crate::files::Result;
use crate::formats::robots::dh_text::Known;
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
    /// What a flag says of angles and lengths.
    pub units: [Option<Unit>; 2],
}

impl Table<'_> {
    /// What a cell says: a number, or a formula.
    pub fn value(&self, cell: &str) -> Option<Value> {
        let known = |name: &str| self.known.get(name).copied();
        expression::evaluate(cell, &known).or_else(|| expression::counted_back(cell, &known))
    }

    /// Which rows are of joints that count the other way by the variable in their cell.
    pub fn flipped(&self, columns: [usize; 4]) -> Result<Vec<bool>> {
        let slides = self.sliding()?;
        let of_row = |((_, row), slides): (&(u64, Fields), bool)| {
            let cell = &row[columns[if slides { 3 } else { 2 }]];
            expression::counted_back(cell, &|name| self.known.get(name).copied()).is_some()
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

    /// How many rows turn: where some have the joint's variable for theta, rows at the end without one are the flange.
    pub fn turning(&self, columns: [usize; 4]) -> Result<usize> {
        let theta = columns[2];
        let turns = |row: &(u64, Fields)| self.value(&row.1[theta]).is_some_and(|v| v.variable);
        // What is no number, or slides, is said of the cell.
        let slides = self.sliding()?;
        let stands = |(row, slides): &(&(u64, Fields), &bool)| {
            !**slides && columns.iter().all(|&c| self.value(&row.1[c]).is_some_and(|v| !v.variable))
        };
        let moves = |at: &usize| turns(&self.rows[*at]) || slides[*at];
        let last = (0..self.rows.len()).rev().find(moves).filter(|_| self.rows.iter().any(turns));
        let Some(last) = last else { return Ok(self.rows.len()) };
        match self.rows[..last].iter().zip(&slides).find(stands) {
            Some(((line, row), _)) => {
                let message = format!(
                    "theta is `{}`, but other rows have their joint's variable there: this one does not turn",
                    &row[theta]
                );
                Err(self.grid.refuse(*line, message, Some("a row a joint; add what stands still to the row before")))
            }
            None if self.rows.iter().zip(&slides).skip(last + 1).all(|row| stands(&row)) => Ok(last + 1),
            None => Ok(self.rows.len()),
        }
    }

    /// Alpha, a, theta and d of all rows as they stand, and whether angles are written with pi.
    pub fn numbers(&self, columns: [usize; 4]) -> Result<(Vec<Row>, bool)> {
        let mut numbers: Vec<Row> = Vec::with_capacity(self.rows.len());
        let mut radians = false;
        let slides = self.sliding()?;
        for ((line, row), slides) in self.rows.iter().zip(slides) {
            let mut of_row = [0.0; 4];
            for (which, (slot, &column)) in of_row.iter_mut().zip(&columns).enumerate() {
                let value = self.number(*line, row, column)?;
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
