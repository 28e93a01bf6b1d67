//! The column of a table that is theta, where toolboxes write the joints' zero offsets beside it: theta is the joint's
//! variable there, or not written.
//!
//! What goes wrong: more than the variable in theta, and the offset of a joint that slides, which is a length; refused
//! with the line.

use super::names::{BY_FLAG, named, zero_offsets};
use super::table::Table;
use crate::files::Result;

/// The columns of alpha, a, theta and d.
pub(super) fn columns(table: &Table, names: &[String]) -> Result<[usize; 4]> {
    let mut columns = named(table.grid, names)?;
    let Some(offset) = zero_offsets(names) else { return Ok(columns) };
    let mut moved = [None; 2];
    for ((line, row), slides) in table.rows.iter().zip(table.sliding()?) {
        let moves = |column: usize| -> Result<bool> { Ok(table.number(*line, row, column)?.number != 0.0) };
        let [of_theta, of_offset] = [moves(columns[2])?, moves(offset)?];
        if of_offset && slides {
            let message = format!("the offset `{}` is of a joint that slides, and is a length", &row[offset]);
            return Err(table.grid.refuse(*line, message, Some("add it to d, and leave 0 in its place")));
        }
        moved[0] = moved[0].or(of_theta.then_some(*line));
        moved[1] = moved[1].or(of_offset.then_some(*line));
    }
    if columns[2] == offset {
        return Ok(columns);
    }
    let [of_theta, Some(line)] = moved else { return Ok(columns) };
    // What theta says besides, which rows turn and which way, would be lost.
    let is_plain = table.turning(columns)? == (0..table.rows.len()) && !table.flipped(columns)?.contains(&true);
    if of_theta.is_some() || !is_plain {
        let [theta, offset] = [columns[2], offset].map(|at| &names[at]);
        let message = format!(
            "`{theta}` and `{offset}` both say something of the joints' zeros, and how they go together is not said"
        );
        return Err(table.grid.refuse(line, message, Some(BY_FLAG)));
    }
    columns[2] = offset;
    Ok(columns)
}
