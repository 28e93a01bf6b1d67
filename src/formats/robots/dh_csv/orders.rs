//! A table whose columns have no names, in every order that could be.

use super::reading::{Reading, reading};
use super::table::Table;
use crate::files::Result;

/// Orders in which tables without names are written.
const ORDERS: [[usize; 4]; 4] = [[0, 1, 3, 2], [0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 1, 0]];

/// Every order that the columns of a table without names may have.
pub(super) fn without_names(table: &Table) -> Result<Vec<Reading>> {
    let rows = table.rows;
    // Columns of words and of the joint's number are no parameters.
    let is_number = |c: usize| rows.iter().all(|(_, r)| table.value(&r[c]).is_some());
    let free: Vec<usize> =
        (0..rows[0].1.len()).filter(|&c| is_number(c) && !(table.counts(c) && rows.len() > 2)).collect();
    let [w, x, y, z] = free[..] else {
        let message = format!("{} columns of numbers without names; four are needed", free.len());
        let hint = format!(
            "`--columns NAME,NAME,...` names all {} in their order, of them alpha, a, d and theta; `-` skips one",
            rows[0].1.len()
        );
        return Err(table.grid.refuse(rows[0].0, message, Some(&hint)));
    };
    let columns = [w, x, y, z];
    let in_order = |order: &[usize; 4]| {
        let mut of_row = [0; 4];
        order.iter().zip(columns).for_each(|(&which, column)| of_row[which] = column);
        of_row
    };
    // Lengths in the place of angles are no multiples of a quarter turn.
    let (mut readings, mut wrong) = (Vec::new(), None);
    for order in &ORDERS {
        match reading(table, in_order(order)) {
            Ok(found) => readings.push(found),
            Err(e) => wrong = wrong.or(Some(e)),
        }
    }
    if let Some(wrong) = wrong.filter(|_| readings.is_empty()) {
        return Err(wrong);
    }
    let regular = |r: &&Reading| r.rows.iter().all(|row| row[0].abs() <= 180.0 && row[2].abs() <= 360.0);
    let likely: Vec<Reading> = readings.iter().filter(regular).cloned().collect();
    Ok(if likely.is_empty() { readings } else { likely })
}
