//! The comparison itself.

use super::comparison::{Comparison, Stood};
use super::found::{Before, Recheck};
use super::strays;
use super::suspects::zero;
use crate::identify::Error;
use crate::identify::data::dataset::Dataset;
use crate::identify::judge::locate::FEWEST_POSES;
use crate::robot::{Parameter, Robot};

/// Compares. A few rows that fit far worse than the rest are named and left out where the rest is then of one piece.
pub fn recheck(set: &Dataset, robot: &Robot, before: &Before, stood: Stood) -> Result<Recheck, Error> {
    let used = set.placing_rows(FEWEST_POSES)?;
    let mut parameters = before.parameters.clone();
    let others = (0..robot.joints.len()).map(zero(robot)).chain((0..3).map(Parameter::V));
    parameters.extend(others.filter(|p| !before.parameters.contains(p)));
    let oriented = set.has_rotations() && before.trust.rotation_rad.is_some();
    let comparison = Comparison { set, robot, before, stood, parameters, oriented };
    let whole = comparison.said(&used)?;
    Ok(strays::left_out(&comparison, &used, &whole).unwrap_or(whole.recheck))
}
