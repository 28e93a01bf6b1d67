//! Cameras on the hand that look at a target which stands still: another problem than the one that is solved here.
//!
//! In: points, and the nominal robot. Out: an error where the points move as they would then. Method: seen from the
//! flange the target moves as the robot backwards. The placement with most poses is fitted with the links of the file,
//! as it is and with every pose inverted, the target and the cameras anywhere; backwards must leave far less. Goes
//! wrong: points of so few poses that either way round fits.

use nalgebra::Point3;

use super::shifted::EXPLAINS;
use crate::identify::Error;
use crate::identify::data::dataset::Dataset;
use crate::robot::Robot;
use crate::robot::tool_fit::Start;

/// Fewest poses: nine unknowns are held against 24 numbers.
pub const FEWEST: usize = 8;

/// Refuses points of cameras on the hand.
pub fn refuse(set: &Dataset, robot: &Robot) -> Result<(), Error> {
    let (joints, points) = most_points(set);
    let fits = (robot.fit_tool(&joints, &points, Start::Around), robot.fit_backwards(&joints, &points));
    match fits {
        (Some(as_is), Some(backwards)) if points.len() >= FEWEST && backwards.left_mm * EXPLAINS < as_is.left_mm => {
            Err(Error::CamerasOnHand { as_is_mm: as_is.left_mm, backwards_mm: backwards.left_mm })
        }
        _ => Ok(()),
    }
}

/// Joints, rad, and points of the placement with most rows, but for those that stand on a body.
pub fn most_points(set: &Dataset) -> (Vec<Vec<f64>>, Vec<Point3<f64>>) {
    let of_group = |group: usize| set.rows(|pose| pose.group == group && pose.on_body_mm.is_none());
    let rows = (0..set.groups.len()).map(of_group).max_by_key(Vec::len).unwrap_or_default();
    let point = |row: &usize| Some((set.poses[*row].joints_rad.clone(), set.poses[*row].reading.point_mm()?));
    rows.iter().filter_map(point).unzip()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::geometry::transform;
    use crate::identify::synthetic;

    #[test]
    fn cameras_on_the_hand_are_told_from_cameras_that_stand() {
        let hand = transform(Vector3::new(0.2, -0.4, 0.1), Vector3::new(30.0, -60.0, 80.0));
        for seed in 0..12 {
            let count = [16, 60, 40][seed as usize % 3];
            let mut world = synthetic::planned(count, 0, 25.0, [0.1, 1.0][seed as usize % 2], seed, &|_| {});
            let set = Dataset::new(&world.rows).unwrap();
            assert!(refuse(&set, &world.nominal).is_ok(), "{seed}");
            if count == 40 {
                world.rows.truncate(10);
            }
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
