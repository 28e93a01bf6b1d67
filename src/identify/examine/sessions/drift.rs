//! What moves along the rows of a group without a placement of its own, in words.
//!
//! In: the causes that explain it alike, as the search of sessions found them: what moves evenly, and the zero of a
//! joint that steps at a row. Out: a finding where a joint is among them. Goes wrong: a joint that creeps by a degree,
//! of which all causes are linear: a sensor that moves has more unknowns to follow the rest.

use crate::identify::data::dataset::Dataset;
use crate::identify::finding::Finding;
use crate::identify::judge::recheck::zero;
use crate::robot::Robot;

/// What moves along the rows of a group: the likeliest first, and what is not told from it.
pub(super) struct Drift {
    pub(super) group: String,
    pub(super) causes: Vec<Moves>,
}

/// The zero of a joint, by so much in all, mrad or mm; or the sensor. Evenly, or at once from a row on.
pub(super) struct Moves {
    pub(super) joint: Option<usize>,
    pub(super) amount: f64,
    pub(super) from: Option<String>,
}

impl Moves {
    /// Whether it moves by so little that its effect is linear: the zero of a joint that hardly moves the target would
    /// have to turn by tens of degrees.
    pub(super) fn is_small(&self, set: &Dataset) -> bool {
        /// Six degrees, whose sine and cosine are an angle and one to half a per cent.
        const LINEAR_MRAD: f64 = 100.0;
        self.joint.is_none_or(|joint| set.is_sliding(joint) || self.amount.abs() < LINEAR_MRAD)
    }
}

/// The row from which on the zero of a joint steps, where one does.
pub(super) fn step(drifts: &[Drift]) -> Option<String> {
    let causes = drifts.iter().flat_map(|drift| &drift.causes).filter(|cause| cause.joint.is_some());
    causes.filter_map(|cause| cause.from.clone()).next()
}

/// What is said of drifts where a joint that moves is as likely as a sensor. One that the zero of the first joint
/// explains is a sensor's as well. Groups are named where there are `several`.
pub(super) fn of_joints(drifts: &[Drift], robot: &Robot, several: bool) -> Option<Finding> {
    let drift = drifts.iter().find(|drift| drift.causes.iter().any(|cause| cause.joint.is_some()))?;
    let of_joint = |cause: &Moves| {
        let joint = cause.joint?;
        let (unit, factor) = zero(robot)(joint).file_unit();
        let (number, amount) = (joint + 1, (factor * cause.amount).abs());
        Some(match &cause.from {
            None => format!("the zero of joint {number} creeps evenly by {amount:.3} {unit}"),
            Some(row) => format!("the zero of joint {number} steps by {amount:.3} {unit} from row {row} on"),
        })
    };
    let joints: Vec<String> = drift.causes.iter().filter_map(of_joint).collect();
    let of_sensor = drift.causes.iter().find(|cause| cause.joint.is_none_or(|joint| joint == 0));
    let sensor = of_sensor.map(|cause| {
        let how = if cause.from.is_none() { " evenly" } else { "" };
        format!("the sensor or the robot's base moves{how}")
    });
    let causes: Vec<String> = joints.into_iter().chain(sensor).collect();
    let untold = if causes.len() > 1 { ", which the rows do not tell apart" } else { "" };
    let groups: Vec<&str> = drifts.iter().map(|drift| drift.group.as_str()).collect();
    let groups = if several { format!(" of group {}", groups.join(", ")) } else { String::new() };
    Some(Finding::new(
        format!("along the rows{groups} {}{untold}", causes.join(", or ")),
        "look for an encoder, a brake or a gear that slips or a joint that warms up, and measure again: what moved meanwhile is in the result",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::synthetic;

    #[test]
    fn a_zero_that_would_turn_by_tens_of_degrees_is_no_cause() {
        let set = Dataset::new(&synthetic::planned(40, 0, 25.0, 0.02, 1, &|_| {}).rows).unwrap();
        let small = |joint: Option<usize>, amount: f64| Moves { joint, amount, from: None }.is_small(&set);
        assert!(small(Some(5), -5.0) && small(Some(5), 90.0) && small(None, 5000.0));
        assert!(!small(Some(5), 830.0) && !small(Some(0), -110.0));
    }
}
