//! Points and joint angles that do not belong together: from some row on each point is of another row's pose, as after
//! a picture that failed, or a line of joint angles that was lost.
//!
//! In: points in the order of the file, and the nominal robot. Out: the set with each reading at the row that it is of,
//! from which row on, and by how many rows. Where readings are not all far nearer to their own rows than the next rows
//! are, every row and every shift by up to `MOST` is tried with the links of the file, placements and the target's
//! place fitted (least sum of distances, by reweighting). A shift is named where the rows behind it come nearer by a
//! factor, the likelihood of all rows pays for the search, and another placement of these rows does not explain them as
//! well. Name, group and role of a row are those of its joint angles where pictures failed, and those of its point
//! where joint angles were lost: where a group ends both are tried, and where neither is likelier by far these rows are
//! left out. Points at equal joint angles that no instrument reads at one place are looked at as rows of their own.
//! What goes wrong: groups of three rows or so, whose placements take up what is wrong; neighbouring poses that are
//! nearer to each other than the nominal robot is to the readings; fewer than `FEWEST` rows behind the shift; rows that
//! were left out between count as none; readings that were repeated at most poses of a table that is shifted count as
//! rows of their own.

mod rows;

use rayon::prelude::*;

pub(super) use self::rows::Rows;
use self::rows::{Hypothesis, Left, Side};
use crate::identify::data::dataset::Dataset;
use crate::identify::finding::Finding;
use crate::robot::Robot;
use crate::statistics::median;

/// Rows by which readings may be off.
const MOST: isize = 3;

/// Fewest rows behind a shift.
const FEWEST: usize = 4;

/// A shift explains what is wrong when it brings the rows behind it nearer by this factor.
pub(super) const EXPLAINS: f64 = 4.0;

/// And by this factor nearer than another placement of these rows brings them.
const BEATS: f64 = 2.0;

/// Logarithm of the likelihood that a shift must bring beyond the number of those tried: 150 to 1.
const EVIDENCE: f64 = 5.0;

/// First rows of a shift that are tried at once, before those between the best.
const GRID: usize = 24;

/// A reading stays at its row when it is nearer there by this factor than the one that the shift brings there.
const STAYS: f64 = 2.0;

/// Readings from a row on that are of the poses of other rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shift {
    /// Index of the first of them.
    pub from: usize,
    /// How many rows further down in the file their poses stand.
    pub by: isize,
    /// With which column names, groups and roles belong; `None` where rows of different groups do not tell.
    pub side: Option<Side>,
    /// Median distance of these readings from the nominal robot as they stand, and as they belong, mm.
    pub before_mm: f64,
    /// With the shift undone.
    pub after_mm: f64,
}

impl Shift {
    /// What was found.
    pub fn statement(&self, set: &Dataset) -> String {
        let rows = self.by.unsigned_abs();
        format!(
            "from pose {} on (row {} of {}) points and joint angles do not belong together: each point is of the pose {rows} {} {} in the file \
             (the nominal robot's errors there fall from {:.1} to {:.2} mm)",
            set.poses[self.from].name,
            self.from + 1,
            set.poses.len(),
            if rows == 1 { "row" } else { "rows" },
            if self.by > 0 { "further down" } else { "further up" },
            self.before_mm,
            self.after_mm
        )
    }
}

/// The set with readings at the rows that they are of, and what was wrong.
pub fn examine(set: &Dataset, robot: &Robot) -> (Dataset, Option<Finding>) {
    let as_one = Dataset { apart: None, ..set.clone() };
    let Some((of, shift)) = found(set, robot) else { return (as_one, None) };
    let of = Dataset { known: as_one.known, files: as_one.files, typed_unit: as_one.typed_unit, ..of.clone() };
    let of = Dataset { apart: None, ..of };
    let (mended, unsure) = mended(&of, robot, &shift);
    let left_out = if unsure.is_empty() { "" } else { "; rows that may be of either of two groups are left out" };
    let cause = match shift.side {
        Some(Side::Joints) => ": look for a picture that failed or was taken twice there",
        Some(Side::Points) => {
            ", with each point in its own group: look for joint angles that were lost or are twice there"
        }
        None => ": look for a picture or joint angles that were lost or are twice there",
    };
    let action =
        format!("mended for this run{cause}, and mend the file (`examine = false` in [identify] takes it as it is)");
    let finding = Finding::new(shift.statement(&of) + left_out, action);
    (mended, Some(finding.about(unsure)))
}

/// A shift, and the set with the rows that it counts: this one, or the one with points at equal joints apart.
pub fn found<'a>(set: &'a Dataset, robot: &Robot) -> Option<(&'a Dataset, Shift)> {
    let sets = set.apart.as_deref().into_iter().chain([set]);
    sets.filter_map(|set| Some((set, find(set, robot)?))).next()
}

/// Looks for a shift.
pub fn find(set: &Dataset, robot: &Robot) -> Option<Shift> {
    let rows = Rows::new(set, robot)?;
    let count = rows.count();
    let before = rows.as_written();
    if rows.stand(&before, MOST.unsigned_abs()) {
        return None;
    }
    let last = count - FEWEST;
    let step = (count / GRID).max(1);
    let sides = if rows.has_groups() { &[Side::Joints, Side::Points][..] } else { &[Side::Joints] };
    let best_of = |starts: Vec<(usize, isize)>| {
        let of = |(from, by)| sides.iter().map(move |&side| Hypothesis { from, by, side });
        let all: Vec<Hypothesis> = starts.into_iter().flat_map(of).collect();
        let left: Vec<_> = all.into_par_iter().map(|of| (rows.left(&of), of)).collect();
        left.into_iter().min_by(|a, b| a.0.mean.total_cmp(&b.0.mean))
    };
    let shifts = || (-MOST..=MOST).filter(|by| *by != 0);
    let starts = (0..=last).step_by(step);
    let (_, near) = best_of(starts.flat_map(|from| shifts().map(move |by| (from, by))).collect())?;
    let between = near.from.saturating_sub(step)..=(near.from + step).min(last);
    let (after, of) = best_of(between.map(|from| (from, near.by)).collect())?;
    let behind =
        |left: &Left| median((of.from..count).filter(|&i| after.errors[i].is_some()).filter_map(|i| left.errors[i]));
    let (before_mm, after_mm) = (behind(&before)?, behind(&after)?);
    let tried = (count * 2 * MOST.unsigned_abs() * sides.len()) as f64;
    let told = after.errors[of.from..].iter().flatten().count() >= FEWEST
        && after_mm * EXPLAINS < before_mm
        && gain(count, &before, &after) > EVIDENCE + tried.ln()
        && rows.placed_anew(of.from, &after.tool_mm)? > BEATS * after_mm;
    told.then(|| Shift { from: of.from, by: of.by, side: told_side(&rows, &of, &after), before_mm, after_mm })
}

/// Logarithm of how much likelier so many readings are after than before.
fn gain(count: usize, before: &Left, after: &Left) -> f64 {
    3.0 * count as f64 * (before.mean / after.mean.max(f64::MIN_POSITIVE)).ln()
}

/// The side of the best hypothesis, where it is told from the other one; rows of one group have nothing to tell.
fn told_side(rows: &Rows, best: &Hypothesis, after: &Left) -> Option<Side> {
    if !rows.crosses(best) {
        return Some(Side::Joints);
    }
    let side = if best.side == Side::Joints { Side::Points } else { Side::Joints };
    let other = rows.left(&Hypothesis { side, ..*best });
    (gain(rows.count(), &other, after) > EVIDENCE).then_some(best.side)
}

/// Each reading at the row that it is of, and the names of those whose group is not determined. What belongs to nothing
/// is left out.
fn mended(set: &Dataset, robot: &Robot, shift: &Shift) -> (Dataset, Vec<String>) {
    let side = shift.side.unwrap_or(Side::Joints);
    let of = Hypothesis { from: shift.from, by: shift.by, side };
    let Some(rows) = Rows::new(set, robot) else { return (set.clone(), Vec::new()) };
    let of_row = readings(&of, &rows.left(&of));
    let mut mended = set.clone();
    let mut alone: Vec<bool> = vec![true; of_row.len()];
    for (row, reading) in of_row.iter().enumerate() {
        let Some(reading) = *reading else { continue };
        let (to, from) = if side == Side::Joints { (row, reading) } else { (reading, row) };
        alone[to] = false;
        if side == Side::Points {
            mended.poses[to].joints_rad.clone_from(&set.poses[from].joints_rad);
            continue;
        }
        mended.poses[to].reading = set.poses[from].reading.clone();
        mended.poses[to].on_body_mm = set.poses[from].on_body_mm;
        if let (Some(to), Some(from)) = (mended.shared.get_mut(to), set.shared.get(from)) {
            to.clone_from(from);
        }
    }
    let is_crossing = |row: &usize| {
        let reading = of_row[*row];
        reading.is_some_and(|reading| set.poses[*row].group != set.poses[reading].group)
    };
    let crossing: Vec<usize> = (0..of_row.len()).filter(is_crossing).collect();
    // Of rows that all stand in another group too few would be left.
    let is_few = 2 * crossing.len() < of_row.len();
    let unsure = if shift.side.is_none() && is_few { crossing } else { Vec::new() };
    let names = set.names(&unsure);
    let before = |row: usize| unsure.iter().filter(|&&unsure| unsure < row).count();
    let alone: Vec<usize> = (0..alone.len()).filter(|&row| alone[row]).map(|row| row - before(row)).collect();
    let what = if side == Side::Joints { "reading belongs" } else { "joint angles belong" };
    let reason = format!("no {what} to it: points and joint angles are shifted");
    let sure = mended.without(&unsure, "it may be of either of two groups: points and joint angles are shifted");
    (sure.without(&alone, &reason), names)
}

/// The reading of each row: of two the one that the shift brings there, unless the other one is nearer by far.
fn readings(of: &Hypothesis, left: &Left) -> Vec<Option<usize>> {
    let count = left.errors.len();
    let mut of_row: Vec<Option<usize>> = vec![None; count];
    for reading in 0..count {
        let Some(row) = of.row(reading, count) else { continue };
        let error = |reading: usize| left.errors[reading].unwrap_or(f64::INFINITY);
        if of_row[row].is_none_or(|own| STAYS * error(own) >= error(reading)) {
            of_row[row] = Some(reading);
        }
    }
    of_row
}

#[cfg(test)]
mod tests;
