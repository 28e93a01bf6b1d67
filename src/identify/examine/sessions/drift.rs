//! What moves evenly along the rows of a group, in words.
//!
//! In: the causes that explain it alike, as the search of sessions found them. Out: a finding where a joint is among them. Goes wrong: a joint that
//! creeps by a degree, of which all causes are linear: a sensor that moves has more unknowns to follow the rest.

use crate::identify::finding::Finding;
use crate::identify::judge::recheck::zero;
use crate::robot::Robot;

/// What moves evenly along the rows of a group: the likeliest first, and what is not told from it.
pub(super) struct Drift {
    pub(super) group: String,
    pub(super) causes: Vec<Creeps>,
}

/// The zero of a joint, by so much in all, mrad or mm; or the sensor.
pub(super) struct Creeps {
    pub(super) joint: Option<usize>,
    pub(super) amount: f64,
}

/// What is said of drifts where a joint that creeps is as likely as a sensor. One that the zero of the first joint explains is a sensor's as well.
pub(super) fn of_joints(drifts: &[Drift], robot: &Robot) -> Option<Finding> {
    let drift = drifts.iter().find(|drift| drift.causes.iter().any(|cause| cause.joint.is_some()))?;
    let of_joint = |cause: &Creeps| {
        let joint = cause.joint?;
        let (unit, factor) = zero(robot)(joint).file_unit();
        Some(format!("the zero of joint {} creeps by {:.3} {unit}", joint + 1, (factor * cause.amount).abs()))
    };
    let joints: Vec<String> = drift.causes.iter().filter_map(of_joint).collect();
    let is_sensors = drift.causes.iter().any(|cause| cause.joint.is_none_or(|joint| joint == 0));
    let sensor = is_sensors.then(|| "the sensor or the robot's base moves".to_owned());
    let causes: Vec<String> = joints.into_iter().chain(sensor).collect();
    let untold = if causes.len() > 1 { ", which the rows do not tell apart" } else { "" };
    let groups = drifts.iter().map(|drift| drift.group.clone()).collect();
    Some(
        Finding::new(
            format!("evenly along the rows of a group {}{untold}", causes.join(", or ")),
            "look for an encoder, a brake or a gear that slips or a joint that warms up, and measure again: what moved meanwhile is in the result",
        )
        .about(groups),
    )
}
