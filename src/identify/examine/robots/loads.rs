//! A load that hung on the flange in some of the rows, and bent the joints there.
//!
//! In: the fitted rows, and the robot of the file. Out: which rows are under the load, where they come in any order. Method: each joint turns by
//! a compliance of its own times the torque that a weight at the target has about it. The rows whose errors lie along that are under the load at
//! first, and then those that it brings nearer, until no row changes. One robot with the load in these rows is held against one with the load in
//! all of them and in none, by Fisher's test and by what is left, as of robots. Goes wrong: loads that move the target by less than about three
//! times what the readings scatter by; two states by anything else that yields along gravity, as a brake or the air in a cylinder.

use nalgebra::Vector3;

use super::fit::{Points, TARGET};
use super::{BEATS, CHANCE, MUCH_LARGER, SHORTEST, Table, by_chance};
use crate::identify::data::dataset::Dataset;
use crate::identify::examine::conventions::IMPLAUSIBLE_MM;
use crate::identify::finding::Finding;
use crate::identify::judge::locate::REPEATABILITY_MM;
use crate::robot::corrections::LoadPoint;
use crate::robot::{Parameter, Robot};
use crate::statistics::median;

/// Rounds in which rows change between the states.
const ROUNDS: usize = 20;

impl Points {
    /// The same with the weight of a load at the target on each joint that turns, in these rows.
    pub(super) fn with_load(&self, loaded: Vec<bool>) -> Points {
        let mut parameters = self.parameters.clone();
        let turning = (0..self.robot.joints.len()).filter(|&joint| !self.robot.joints[joint].slides);
        let before_target = parameters.len() - TARGET;
        parameters
            .splice(before_target..before_target, turning.map(|joint| Parameter::Gravity(joint, LoadPoint::Tool)));
        Points { parameters, loaded, ..self.clone() }
    }
}

/// What is said of rows of which some are under a load, in any order.
pub(in crate::identify::examine) fn find(set: &Dataset, robot: &Robot) -> Option<Finding> {
    let table = Table::new(set, robot)?;
    let points = &table.points;
    let rows: Vec<usize> = (0..table.rows.len()).collect();
    let weights = points.without_gross(std::slice::from_ref(&rows));
    let (always, along) = points.with_load(vec![true; rows.len()]).under_load(&rows, &weights);
    let never = points.together(std::slice::from_ref(&rows), &weights);
    let least = if always.scatter_mm() < never.scatter_mm() { &always } else { &never };
    let sizes: Vec<f64> = never.errors_mm.iter().zip(&along).map(|(error, along)| error.dot(along)).collect();
    let middle = median(sizes.iter().copied())?;
    let mut loaded: Vec<bool> = sizes.iter().map(|size| *size > middle).collect();
    for _ in 0..ROUNDS {
        let (left, moved_mm) = points.with_load(loaded.clone()).under_load(&rows, &weights);
        // What rows that were dealt out by their errors gain by chance is less.
        if BEATS * left.scatter_mm() > least.scatter_mm() {
            return None;
        }
        let nearer = |row: usize| {
            let free: Vector3<f64> = left.errors_mm[row] + if loaded[row] { moved_mm[row] } else { Vector3::zeros() };
            (free - moved_mm[row]).norm() < free.norm()
        };
        let next: Vec<bool> = rows.iter().map(|&row| nearer(row)).collect();
        if next != loaded {
            loaded = next;
            continue;
        }
        let of_state = |state: bool| rows.iter().copied().filter(|&row| loaded[row] == state).collect::<Vec<usize>>();
        let fewest = [false, true].into_iter().min_by_key(|&state| of_state(state).len())?;
        let other = of_state(fewest);
        let apart_mm = left.scatter_mm();
        let is_told = other.len() >= SHORTEST
            && least.scatter_mm() > (MUCH_LARGER * apart_mm).max(REPEATABILITY_MM)
            && apart_mm < IMPLAUSIBLE_MM
            && by_chance(&left, least)? * (rows.len() as f64) < CHANCE;
        return is_told.then(|| {
            let by = moved_mm.iter().map(Vector3::norm).fold(0.0, f64::max);
            let names = set.names(&other.iter().map(|&i| table.rows[i]).collect::<Vec<usize>>());
            Finding::new(
                format!(
                    "{} of {} rows are in another state than the others, as with and without a load that moves the target by up to {by:.2} mm: one \
                     state leaves {:.3} mm a coordinate, two leave {apart_mm:.3} mm",
                    other.len(),
                    rows.len(),
                    least.scatter_mm()
                ),
                "identify the rows of each state by themselves, or measure again with the load that the robot works with",
            )
            .about(names)
        });
    }
    None
}

#[cfg(test)]
mod tests;
