//! A load that hung on the flange in some of the rows, and bent the joints there.
//!
//! In: the fitted rows, and the robot of the file. Out: which rows are under the load, where they come in any order.
//! Method: each joint turns by a compliance of its own times the torque that a weight at the target has about it. The
//! rows whose errors have most of that are under the load at first, and then those that it brings nearer, until no row
//! changes. One robot with the load in these rows is held against one with the load in all of them and in none, by
//! Fisher's test and by what is left, as of robots, and against one with any term beyond its links. Goes wrong: loads
//! that move the target by less than about three times what the readings scatter by; two states by anything else that
//! yields along gravity, as a brake or the air in a cylinder. The zero of one joint, which stands elsewhere in some
//! rows for the play of its gear, is held against the load by likelihood.

use nalgebra::Vector3;

use super::fit::{Left, Points};
use super::{BEATS, CHANCE, MUCH_LARGER, SHORTEST, Table, by_chance};
use crate::difference::TOLD_APART;
use crate::identify::data::dataset::Dataset;
use crate::identify::examine::conventions::IMPLAUSIBLE_MM;
use crate::identify::finding::Finding;
use crate::identify::sensor::REPEATABILITY_MM;
use crate::robot::corrections::LoadPoint;
use crate::robot::{Parameter, Robot};

/// Rounds in which rows change between the states.
const ROUNDS: usize = 20;

impl Points {
    /// The same with the weight of a load at the target on each joint that turns, in these rows.
    pub(super) fn with_load(&self, loaded: Vec<bool>) -> Points {
        let turning = (0..self.robot.joints.len()).filter(|&joint| !self.robot.joints[joint].slides);
        let of_load = turning.map(|joint| Parameter::Gravity(joint, LoadPoint::Tool));
        Points { loaded, ..self.with_terms(of_load) }
    }
}

/// What is said of rows of which some are under a load, in any order.
pub(in crate::identify::examine) fn find(set: &Dataset, robot: &Robot) -> Option<Finding> {
    let table = Table::new(set, robot)?;
    let points = &table.points;
    let rows: Vec<usize> = (0..table.rows.len()).collect();
    let least_of = |weights: &[f64]| {
        let (always, along) = points.with_load(Vec::new()).under_load(&rows, weights);
        let never = points.together(std::slice::from_ref(&rows), weights);
        let start = by_amount(&never.errors_mm, &along);
        (if always.scatter_mm() < never.scatter_mm() { always } else { never }, start)
    };
    // A gross error for one state may be of the other: they are left out once there are two.
    let mut weights = vec![1.0; rows.len()];
    let (least, start) = least_of(&weights);
    let rough = settled(points, &weights, start, BEATS.recip() * least.scatter_mm())?;
    rough.left.leave_out_gross(&rows, &mut weights);
    let (least, _) = least_of(&weights);
    let States { loaded, left, moved_mm } = settled(points, &weights, rough.loaded, f64::INFINITY)?;
    let apart_mm = left.scatter_mm();
    let is_told = smaller(&loaded).len() >= SHORTEST
        && least.scatter_mm() > (MUCH_LARGER * apart_mm).max(REPEATABILITY_MM)
        && apart_mm < IMPLAUSIBLE_MM
        && by_chance(&left, &least)? * (rows.len() as f64) < CHANCE
        && !table.is_one_beyond_links(std::slice::from_ref(&rows), apart_mm);
    if !is_told {
        return None;
    }
    let by = moved_mm.iter().map(Vector3::norm).fold(0.0, f64::max);
    let what = format!("with and without a load that moves the target by up to {by:.2} mm");
    let never = points.together(std::slice::from_ref(&rows), &weights);
    let load = Cause { what, there: loaded, free: left.taken - never.taken, left };
    let zeros = (0..points.robot.joints.len()).filter_map(|joint| elsewhere(points, joint, &weights, &never));
    let zero = zeros.min_by(|a, b| a.left.squares.total_cmp(&b.left.squares));
    let mut causes: Vec<Cause> = zero.into_iter().chain([load]).collect();
    causes.sort_by(|a, b| b.likelihood().total_cmp(&a.likelihood()));
    let likeliest = &causes[0];
    let alike = causes.iter().take_while(|cause| likeliest.likelihood() - cause.likelihood() < TOLD_APART);
    let what = alike.map(|cause| cause.what.as_str()).collect::<Vec<_>>().join(", or ");
    let other = smaller(&likeliest.there);
    let finding = format!(
        "{} of {} rows are in another state than the others, as {what}: one state leaves {:.3} mm a coordinate, two leave {:.3} mm",
        other.len(),
        rows.len(),
        least.scatter_mm(),
        likeliest.left.scatter_mm()
    );
    let action = "identify the rows of each state by themselves, or measure again with the load that the robot works with, each joint coming from the \
                  same side";
    let names = set.names(&other.iter().map(|&i| table.rows[i]).collect::<Vec<usize>>());
    Some(Finding::new(finding, action).about(names))
}

/// The rows of the state with fewer of them.
fn smaller(there: &[bool]) -> Vec<usize> {
    let of_state = |state: bool| (0..there.len()).filter(|&row| there[row] == state).collect::<Vec<usize>>();
    let (with, without) = (of_state(true), of_state(false));
    if with.len() < without.len() { with } else { without }
}

/// What puts some rows into another state.
struct Cause {
    what: String,
    /// The rows that it is there in.
    there: Vec<bool>,
    /// Numbers that it took beyond those of one state.
    free: f64,
    left: Left,
}

impl Cause {
    fn likelihood(&self) -> f64 {
        self.left.likelihood(self.there.len(), self.free)
    }
}

/// Rounds in which rows change between two places of a joint.
const ROUNDS_OF_ZERO: usize = 8;

/// A joint that stands elsewhere in some rows, where no row changes any more; `never` is what one state leaves.
fn elsewhere(points: &Points, joint: usize, weights: &[f64], never: &Left) -> Option<Cause> {
    let rows: Vec<usize> = (0..weights.len()).collect();
    let moved = |off: f64| -> Vec<Vector3<f64>> {
        let of_row = |q: &Vec<f64>| {
            let mut there = q.clone();
            there[joint] += off;
            points.robot.target_mm(&there) - points.robot.target_mm(q)
        };
        points.joints_rad.iter().map(of_row).collect()
    };
    let mut there = by_amount(&never.errors_mm, &moved(points.zero_step(joint)));
    for _ in 0..ROUNDS_OF_ZERO {
        let of_it: Vec<usize> = rows.iter().copied().filter(|&row| there[row]).collect();
        let (left, off) = points.elsewhere(joint, &of_it, (&rows, weights), never)?;
        let next = nearer(&left.errors_mm, &moved(off), &there);
        if next == there {
            let (number, by) = (joint + 1, points.zero_said(joint, off.abs()));
            let what = format!("where joint {number} stands elsewhere by {by}, for play or the side that it came from");
            return Some(Cause { what, there, free: 1.0, left });
        }
        there = next;
    }
    None
}

/// The rows whose errors are smaller where the target is moved so; `there` it is already.
fn nearer(errors_mm: &[Vector3<f64>], moved_mm: &[Vector3<f64>], there: &[bool]) -> Vec<bool> {
    let is_nearer = |row: usize| {
        let free: Vector3<f64> = errors_mm[row] + if there[row] { moved_mm[row] } else { Vector3::zeros() };
        (free - moved_mm[row]).norm() < free.norm()
    };
    (0..there.len()).map(is_nearer).collect()
}

/// Rows whose errors have the larger amounts of how a load in all of them would move the target: of two means of the
/// amounts the larger one's.
fn by_amount(errors_mm: &[Vector3<f64>], along: &[Vector3<f64>]) -> Vec<bool> {
    let amount = |(error, along): (&Vector3<f64>, &Vector3<f64>)| {
        let weight = along.norm_squared();
        (error.dot(along) / weight.max(1e-12), weight)
    };
    let amounts: Vec<(f64, f64)> = errors_mm.iter().zip(along).map(amount).collect();
    let mut order = amounts.clone();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let sum = |part: &[(f64, f64)]| {
        part.iter().fold((0.0, 0.0), |(w, s), (amount, weight)| (w + weight, s + weight * amount))
    };
    let between = |at: usize| {
        let ((less, of_less), (more, of_more)) = (sum(&order[..at]), sum(&order[at..]));
        less * more * (of_more / more - of_less / less).powi(2)
    };
    let at = (1..order.len()).max_by(|a, b| between(*a).total_cmp(&between(*b))).unwrap_or(0);
    let limit = order.get(at).map_or(f64::INFINITY, |(amount, _)| *amount);
    amounts.into_iter().map(|(amount, _)| amount >= limit).collect()
}

/// The rows that are under a load, what one robot leaves with it, and how far it moves each row's target where it is
/// under it.
struct States {
    loaded: Vec<bool>,
    left: Left,
    moved_mm: Vec<Vector3<f64>>,
}

/// The states that no row changes any more; `None` where two rounds leave more than so much, which is what rows that
/// were dealt out by their errors gain by chance.
fn settled(points: &Points, weights: &[f64], mut loaded: Vec<bool>, most_mm: f64) -> Option<States> {
    let rows: Vec<usize> = (0..loaded.len()).collect();
    for round in 0..ROUNDS {
        let (left, moved_mm) = points.with_load(loaded.clone()).under_load(&rows, weights);
        if round > 1 && left.scatter_mm() > most_mm {
            return None;
        }
        let next = nearer(&left.errors_mm, &moved_mm, &loaded);
        if next == loaded {
            return Some(States { loaded, left, moved_mm });
        }
        loaded = next;
    }
    None
}

#[cfg(test)]
mod tests;
