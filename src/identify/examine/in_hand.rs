//! Cameras on the hand that look at a target which stands still: another problem than the one that is solved here.
//!
//! In: points, and the nominal robot. Out: an error where the points move as they would then. Method: seen from the flange the target moves as
//! the robot backwards, so that the fit of [`super::shifted`] with every pose inverted tells; it must leave far less than the fit as it is.
//! Goes wrong: points of so few poses that either way round fits.

use super::shifted::{EXPLAINS, Rows};
use crate::identify::Error;
use crate::identify::data::dataset::Dataset;
use crate::robot::Robot;

/// Rounds from a target anywhere: it stands some hundred mm off, and comes nearer by a factor in each.
const ROUNDS: usize = 200;

/// Refuses points of cameras on the hand.
pub fn refuse(set: &Dataset, robot: &Robot) -> Result<(), Error> {
    let as_is = Rows::new(set, robot, false).map(|rows| rows.median_mm(ROUNDS));
    let backwards = Rows::new(set, robot, true).map(|rows| rows.median_mm(ROUNDS));
    match (as_is, backwards) {
        (Some(as_is_mm), Some(backwards_mm)) if backwards_mm * EXPLAINS < as_is_mm => {
            Err(Error::CamerasOnHand { as_is_mm, backwards_mm })
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;
    use crate::geometry::transform;
    use crate::identify::synthetic;

    #[test]
    fn cameras_on_the_hand_are_told_from_cameras_that_stand() {
        let hand = transform(Vector3::new(0.2, -0.4, 0.1), Vector3::new(30.0, -60.0, 80.0));
        for seed in 0..10 {
            let mut world = synthetic::planned([16, 60][seed as usize % 2], 0, 25.0, 0.1, seed, &|_| {});
            let set = Dataset::new(&world.rows).unwrap();
            assert!(refuse(&set, &world.nominal).is_ok(), "{seed}");
            for row in &mut world.rows {
                row.at.group = "g0".into();
                row.at.role = crate::measurements::Role::Sample;
                let camera = world.truth.base_from_flange(&row.at.joints_rad()) * hand;
                *synthetic::point(row) = camera.inverse() * Point3::new(420.0, -150.0, 20.0);
            }
            let refused = refuse(&Dataset::new(&world.rows).unwrap(), &world.nominal);
            assert!(matches!(refused, Err(Error::CamerasOnHand { .. })), "{seed}: {refused:?}");
        }
    }
}
