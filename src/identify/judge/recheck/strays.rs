//! Rows that fit far worse than the rest: a reading that was misread, joints of another row.
//!
//! In: rows that contradict the old robot, and what they say together. Out: what the others say without the strays, and
//! who these are. Method: the rows whose absence leaves least, one after the other, each by more than chance, until
//! what is left agrees with the old robot or is explained by one cause. A single cause that explains all rows is
//! believed before a stray is, unless the stray is much likelier. Goes wrong: two causes at once that few rows see.

use super::comparison::{Comparison, Said};
use super::found::{FALSE_ALARM, Recheck};
use super::looks::price;
use crate::difference::TOLD_APART;
use crate::identify::judge::locate::FEWEST_POSES;

/// One row in so many may be a stray.
const SHARE: usize = 5;

/// Rows of which each is left out in turn: more than a check of some ten poses has.
const LOOKED_AT: usize = 16;

/// What the rows say without the strays among them; `None` where there are none.
pub(super) fn left_out(comparison: &Comparison, used: &[usize], whole: &Said) -> Option<Recheck> {
    if !whole.recheck.changed {
        return None;
    }
    let (numbers, chance) = (if comparison.oriented { 6 } else { 3 }, FALSE_ALARM / used.len() as f64);
    let (mut rest, mut strays) = (used.to_vec(), Vec::new());
    let mut left = whole.difference.chi_square();
    for _ in 0..used.len() / SHARE {
        let (without, row) = farthest(comparison, &rest)?;
        if left - without < whole.difference.limit(numbers, chance) {
            return None;
        }
        if strays.is_empty()
            && whole.likelihood.is_some_and(|cause| {
                let stray = whole.difference.log_likelihood(without) - price(whole.difference.off.len(), numbers);
                stray - cause < TOLD_APART
            })
        {
            return None;
        }
        left = without;
        rest.retain(|&other| other != row);
        strays.push(row);
        if let Some(recheck) = of_one_piece(comparison, &rest) {
            return Some(only_strays(comparison, rest, strays, recheck));
        }
    }
    None
}

/// What rows say that agree with the old robot, or that one cause explains.
fn of_one_piece(comparison: &Comparison, rows: &[usize]) -> Option<Recheck> {
    let said = comparison.said(rows).ok()?;
    (!said.recheck.changed || said.likelihood.is_some()).then_some(said.recheck)
}

/// Takes back rows that were left out before the worst one was: beside it, they only seemed to be far off.
fn only_strays(comparison: &Comparison, mut rest: Vec<usize>, mut strays: Vec<usize>, mut recheck: Recheck) -> Recheck {
    for row in strays.clone() {
        let mut with = rest.clone();
        with.push(row);
        with.sort_unstable();
        let same = |again: &Recheck| strays.len() > 1 && again.changed == recheck.changed;
        if let Some(again) = of_one_piece(comparison, &with).filter(same) {
            strays.retain(|&other| other != row);
            (rest, recheck) = (with, again);
        }
    }
    strays.sort_unstable();
    Recheck { strays: comparison.set.names(&strays), ..recheck }
}

/// The row whose absence leaves the least squared residuals, and how much. Of many rows, those that do so where all is
/// linear are looked at alone.
fn farthest(comparison: &Comparison, rows: &[usize]) -> Option<(f64, usize)> {
    let group = |row: usize| comparison.set.poses[row].group;
    let is_spare = |row: &usize| rows.iter().filter(|&&other| group(other) == group(*row)).count() > FEWEST_POSES;
    let mut spare: Vec<usize> = rows.iter().copied().filter(is_spare).collect();
    if spare.len() > LOOKED_AT {
        let mut gains = comparison.gains(rows);
        gains.retain(|(row, _)| spare.contains(row));
        gains.sort_by(|a, b| b.1.total_cmp(&a.1));
        spare = gains.into_iter().take(LOOKED_AT).map(|(row, _)| row).collect();
        spare.sort_unstable();
    }
    let left = |row: usize| {
        let others: Vec<usize> = rows.iter().copied().filter(|&other| other != row).collect();
        Some((comparison.look(&others)?.difference.chi_square(), row))
    };
    spare.into_iter().filter_map(left).min_by(|a, b| a.0.total_cmp(&b.0))
}
