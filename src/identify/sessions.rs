//! Sessions along the rows of a wire's group: the anchor or the zero was moved, and nobody wrote it down.
//!
//! In: a set of distances to unknown points, in the order of measurement. Out: the same set with each group cut where a
//! new anchor and zero explain the rest of its rows better. Cuts are made one at a time at the row of greatest gain (binary
//! segmentation: Vostrikova, 1981) as long as the Bayesian information criterion (Schwarz, 1978) pays for the cut's five unknowns.
//! A verify row belongs to the session of the fitted row before it in the file; before all, to the first.
//! What goes wrong: sessions shorter than [`SHORTEST`] rows are not seen.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::Error;
use super::blocks::Block;
use super::dataset::{Dataset, Group, Kind};
use super::prepare::Prepared;
use super::settings::{Model, Settings};
use crate::measurements::Role;
use crate::robot::Robot;

/// Fewest fitted rows of a session: twice its own unknowns.
pub const SHORTEST: usize = 8;

/// What a cut adds: an anchor, a zero and the place of the cut.
const CUT_UNKNOWNS: f64 = 5.0;

/// Most cuts; data that want more are no sessions.
const MOST_CUTS: usize = 30;

/// One session.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Session {
    /// Its group in the file.
    pub group: String,
    /// First fitted pose.
    pub first: String,
    /// Last fitted pose.
    pub last: String,
    /// Fitted poses.
    pub count: usize,
}

/// Cuts the groups of `set` into sessions. The list is empty where none was cut.
pub fn find(set: &Dataset, robot: &Robot, settings: &Settings) -> Result<(Dataset, Vec<Session>), Error> {
    let mut cut = set.clone();
    if set.kind != Kind::Distances || set.groups.iter().all(|g| g.center.is_some()) {
        return Ok((cut, Vec::new()));
    }
    let parameters = robot.mdh_parameters();
    let mut cuts = 0;
    while cuts < MOST_CUTS {
        let rows = cut.fit_rows();
        let Ok(prepared) = Prepared::new(&cut, robot, &parameters, &rows, Model::CenterDistance, settings) else {
            break;
        };
        let Some(row) = best_cut(&prepared) else { break };
        split(&mut cut, row);
        cuts += 1;
    }
    let sessions = if cuts == 0 { Vec::new() } else { list(&cut) };
    Ok((cut, sessions))
}

/// The row of the set at which a new session pays most, if any does.
fn best_cut(prepared: &Prepared) -> Option<usize> {
    let fit = prepared.fit();
    let offsets = fit.offsets(&prepared.free_fit.x);
    let estimate = &prepared.estimate;
    let places = estimate.kinematics.places(&offsets, true);
    let prior = prepared.prior();
    let (residuals, jacobian) = estimate.evaluate(&offsets, true);
    let measured = residuals.len();
    let total = measured + prior.nrows();
    let mut all = residuals.resize_vertically(total, 0.0);
    all.rows_mut(measured, prior.nrows()).copy_from(&(&prior * DVector::from_column_slice(&prepared.free_fit.x)));
    let base = &prepared.base.free;
    let mut columns = DMatrix::zeros(total, base.len());
    for (c, &i) in base.iter().enumerate() {
        columns.view_mut((0, c), (measured, 1)).copy_from(&jacobian.column(i));
    }
    columns.rows_mut(measured, prior.nrows()).copy_from(&prior);
    let mut designs = Vec::new();
    let mut start = 0;
    for block in &estimate.blocks {
        let count = block.row_count();
        if let Block::Wire { lengths, .. } = block {
            let design = block.design(&places, &estimate.scatter);
            let mut placed = DMatrix::zeros(total, design.ncols());
            placed.rows_mut(start, count).copy_from(&design);
            designs.push((start, lengths.iter().map(|l| estimate.rows[l.pose]).collect::<Vec<_>>(), placed));
        }
        start += count;
    }
    let known = designs.iter().fold(columns, |all, (_, _, d)| stacked(&all, d));
    let q = known.qr().q();
    let left = &all - &q * q.tr_mul(&all);
    let rss = left.norm_squared();
    let mut best: Option<(f64, usize)> = None;
    for (start, rows, design) in &designs {
        let last = (rows.len() + 1).saturating_sub(SHORTEST);
        for (k, &row) in rows.iter().enumerate().take(last).skip(SHORTEST) {
            let mut late = design.clone();
            late.rows_mut(*start, k).fill(0.0);
            let fresh = &late - &q * q.tr_mul(&late);
            let gain = fresh.qr().q().tr_mul(&left).norm_squared();
            if best.is_none_or(|(g, _)| gain > g) {
                best = Some((gain, row));
            }
        }
    }
    let (gain, row) = best?;
    let n = measured as f64;
    let pays = n * (rss / (rss - gain).max(f64::MIN_POSITIVE)).ln() > CUT_UNKNOWNS * n.ln();
    pays.then_some(row)
}

fn stacked(left: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    let mut both = left.clone().resize_horizontally(left.ncols() + right.ncols(), 0.0);
    both.columns_mut(left.ncols(), right.ncols()).copy_from(right);
    both
}

/// Starts a new group at `row`: it and all later rows of its group move there.
fn split(set: &mut Dataset, row: usize) {
    let group = set.poses[row].group;
    let name = set.groups[group].name.clone();
    set.groups.push(Group { name, center: None });
    let fresh = set.groups.len() - 1;
    for pose in set.poses.iter_mut().skip(row).filter(|p| p.group == group) {
        pose.group = fresh;
    }
}

fn list(set: &Dataset) -> Vec<Session> {
    let session = |(g, group): (usize, &Group)| {
        let rows = set.rows(|p| p.group == g && p.role != Role::Verify);
        let name = |row: Option<&usize>| row.map(|&r| set.poses[r].name.clone());
        let (first, last) = (name(rows.first())?, name(rows.last())?);
        Some((rows[0], Session { group: group.name.clone(), first, last, count: rows.len() }))
    };
    let mut sessions: Vec<(usize, Session)> = set.groups.iter().enumerate().filter_map(session).collect();
    sessions.sort_by_key(|(row, _)| *row);
    sessions.into_iter().map(|(_, s)| s).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::synthetic;
    use crate::measurements::{Measurement, Observed};

    /// Wire lengths to an anchor that moves by 5 mm after `moved` rows.
    fn wire(moved: usize) -> (synthetic::World, Vec<Measurement>) {
        let world = synthetic::planned(120, 20, 25.0, 0.0, 5, &|_| {});
        let rows: Vec<Measurement> = world
            .rows
            .iter()
            .filter(|r| r.at.role != Role::Center)
            .enumerate()
            .map(|(i, row)| {
                let anchor = nalgebra::Point3::new(600.0, if i < moved { 300.0 } else { 305.0 }, 0.0);
                // A ripple of 0.05 mm stands for noise.
                let distance_mm =
                    (world.truth.target_mm(&row.at.joints_rad()) - anchor).norm() + 0.05 * (1.7 * i as f64).sin();
                let mut at = row.at.clone();
                at.group = "wire".into();
                Measurement { at, observed: Observed::Distance { distance_mm, sigma_mm: None } }
            })
            .collect();
        (world, rows)
    }

    #[test]
    fn an_anchor_that_moved_is_found_where_it_moved() {
        let (world, rows) = wire(70);
        let set = Dataset::new(&rows, 1).unwrap();
        let (cut, sessions) = find(&set, &world.nominal, &Settings::default()).unwrap();
        assert_eq!(sessions.len(), 2, "{sessions:?}");
        assert!(sessions[0].count.abs_diff(70) <= 1, "{sessions:?}");
        assert_eq!(cut.groups.len(), 2);
    }

    #[test]
    fn an_anchor_that_stayed_is_one_session() {
        let (world, rows) = wire(1000);
        let set = Dataset::new(&rows, 1).unwrap();
        assert!(find(&set, &world.nominal, &Settings::default()).unwrap().1.is_empty());
    }
}
