//! Readings that do not follow the robot: one point to the last digit at places that are far apart.
//!
//! An instrument that lost its target, or a program that writes zeros where nothing was read, gives the same point
//! again and again. In: rows, and the nominal robot. Out: the same rows, those readings taken away, and why. What goes
//! wrong: the first of such readings may be a true one, after which the instrument stood still; it goes with the
//! others. A single failed reading is left to the fit, which finds it far off, but for a row of zeros: joints that are
//! as wrong as the point draw the fit there.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::{Measurement, Observed, Role};
use crate::robot::Robot;

/// The robot moved where its flange and its target both did by this, mm: built robots are off by less.
const MOVED_MM: f64 = 10.0;

/// Places with one point from which on it was not read there. Zeros are what programs write for nothing.
const PLACES: usize = 3;
const PLACES_OF_ZERO: usize = 2;

/// Points of their own that a table must have for others to be none.
const OWN: usize = 3;

/// The rows without readings that do not follow the robot.
pub(super) fn taken_away(mut rows: Vec<Measurement>, robot: &Robot) -> Vec<Measurement> {
    let mut of_point: BTreeMap<[u64; 3], Vec<usize>> = BTreeMap::new();
    let mut points = 0;
    for (i, row) in rows.iter().enumerate().filter(|(_, row)| row.at.joints_deg.len() == robot.joints.len()) {
        if let Observed::Position { point_mm, .. } = &row.observed {
            points += 1;
            // No zero has a sign.
            of_point.entry([0, 1, 2].map(|k| (point_mm[k] + 0.0).to_bits())).or_default().push(i);
        }
    }
    of_point.retain(|point, of| {
        let least = if *point == [0; 3] { PLACES_OF_ZERO } else { PLACES };
        of.len() >= least && places(of.iter().map(|&i| &rows[i]), robot, least) >= least
    });
    for row in rows.iter_mut().filter(|row| is_empty(row)) {
        row.observed =
            Observed::Missing { reason: "0 in all joints and coordinates: the row was left empty".to_owned() };
    }
    let stuck: usize = of_point.values().map(Vec::len).sum();
    // Points that were touched again and again in other postures, and are known from elsewhere, are most of their
    // table.
    if points - stuck < OWN || of_point.len() > 1 && 2 * stuck > points {
        return rows;
    }
    for (point, of) in of_point {
        let [x, y, z] = point.map(f64::from_bits);
        let count = of.len();
        let reason = match point == [0; 3] {
            true => format!("0, 0, 0 mm in {count} rows between which the robot moved: nothing was measured"),
            false => format!(
                "one point, {x}, {y}, {z} mm, in {count} rows between which the robot moved: the reading stood still"
            ),
        };
        of.iter().for_each(|&i| rows[i].observed = Observed::Missing { reason: reason.clone() });
    }
    rows
}

/// Whether nothing but zeros stands in it; at a centre there may be.
fn is_empty(row: &Measurement) -> bool {
    let at_zero = matches!(&row.observed, Observed::Position { point_mm, .. } if *point_mm == Point3::origin());
    at_zero && row.at.role != Role::Center && row.at.joints_deg.iter().all(|joint| *joint == 0.0)
}

/// How many places that are apart from each other the robot was at in these rows; no more than `enough` are looked for.
fn places<'a>(rows: impl Iterator<Item = &'a Measurement>, robot: &Robot, enough: usize) -> usize {
    let mut places: Vec<(Vector3<f64>, Point3<f64>)> = Vec::new();
    for row in rows {
        let joints = row.at.joints_rad();
        let (flange, target) = (robot.base_from_flange(&joints).translation.vector, robot.target_mm(&joints));
        let is_apart =
            |(f, t): &(Vector3<f64>, Point3<f64>)| (f - flange).norm() > MOVED_MM && (t - target).norm() > MOVED_MM;
        if places.iter().all(is_apart) {
            places.push((flange, target));
        }
        if places.len() == enough {
            break;
        }
    }
    places.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::synthetic::{self, seen_at};

    /// Rows of the paper's robot, as read from two metres away.
    fn rows(count: usize) -> Vec<Measurement> {
        let row = |k: usize| {
            let t = k as f64;
            let [a, b, c] = [40.0 * t.sin(), 20.0 * (1.3 * t).cos(), 15.0 * (0.7 * t).sin()];
            let joints_deg = vec![a, b, c, 5.0 * t % 60.0, 30.0, 9.0 * t % 50.0];
            let joints_rad: Vec<f64> = joints_deg.iter().map(|q: &f64| q.to_radians()).collect();
            let point_mm = Robot::paper().target_mm(&joints_rad) + Vector3::new(2000.0, 0.0, 0.0);
            let role = if k.is_multiple_of(5) { Role::Verify } else { Role::Sample };
            synthetic::row(format!("p{k}"), &(k % 2).to_string(), role, joints_deg, seen_at(point_mm))
        };
        (0..count).map(row).collect()
    }

    fn point(row: &mut Measurement) -> &mut Point3<f64> {
        let Observed::Position { point_mm, .. } = &mut row.observed else { panic!("no point") };
        point_mm
    }

    /// The rows that are without a reading then, and the first one's reason.
    fn taken(rows: Vec<Measurement>) -> (Vec<usize>, String) {
        let rows = taken_away(rows, &Robot::paper());
        let none = |(i, row): (usize, &Measurement)| match &row.observed {
            Observed::Missing { reason } => Some((i, reason.clone())),
            _ => None,
        };
        let (list, reasons): (Vec<usize>, Vec<String>) = rows.iter().enumerate().filter_map(none).unzip();
        (list, reasons.into_iter().next().unwrap_or_default())
    }

    #[test]
    fn a_row_of_zeros_is_none_and_joints_at_zero_or_a_point_at_the_origin_are() {
        let zeros = |joints: bool, of_point: bool, role: Role| {
            let mut all = rows(40);
            if joints {
                all[7].at.joints_deg.fill(0.0);
            }
            if of_point {
                *point(&mut all[7]) = Point3::origin();
            }
            all[7].at.role = role;
            taken(all)
        };
        let (rows, reason) = zeros(true, true, Role::Sample);
        assert!(rows == [7] && reason.contains("left empty"), "{rows:?} {reason}");
        for (joints, of_point, role) in
            [(true, false, Role::Sample), (false, true, Role::Sample), (true, true, Role::Center)]
        {
            assert!(zeros(joints, of_point, role).0.is_empty());
        }
    }

    #[test]
    fn readings_that_stand_still_while_the_robot_moves_are_none() {
        assert_eq!(taken(rows(40)).0, Vec::<usize>::new());
        // Zeros in one, a few and most rows; a single one is the fit's to find.
        for count in [1, 2, 4, 8, 30] {
            let mut spoilt = rows(40);
            spoilt[5..5 + count].iter_mut().for_each(|row| *point(row) = Point3::origin());
            let (list, reason) = taken(spoilt);
            assert_eq!(list, if count > 1 { (5..5 + count).collect() } else { vec![] }, "{count}");
            assert!(count == 1 || reason.starts_with(&format!("0, 0, 0 mm in {count} rows")), "{reason}");
        }
        for count in [2, 3, 10] {
            let mut spoilt = rows(40);
            let stood = *point(&mut spoilt[5]);
            spoilt[5..5 + count].iter_mut().for_each(|row| *point(row) = stood);
            let (list, reason) = taken(spoilt);
            assert_eq!(list, if count > 2 { (5..5 + count).collect() } else { vec![] }, "{count}");
            assert!(count == 2 || reason.ends_with("the reading stood still"), "{reason}");
        }
    }

    #[test]
    fn points_that_were_read_again_are_readings() {
        // At one place; at the last joint's own axis; and known points that were touched in other postures, with
        // another tool than the file's.
        let mut again = rows(40);
        for k in 1..6 {
            (again[k].at.joints_deg, again[k].observed) = (again[0].at.joints_deg.clone(), again[0].observed.clone());
            again[k].at.joints_deg[0] += 1e-3 * k as f64;
        }
        assert_eq!(taken(again).0, Vec::<usize>::new());
        let mut turned = rows(40);
        for k in 1..6 {
            (turned[k].at.joints_deg, turned[k].observed) =
                (turned[0].at.joints_deg.clone(), turned[0].observed.clone());
            turned[k].at.joints_deg[5] += 40.0 * k as f64;
        }
        assert_eq!(taken(turned).0, Vec::<usize>::new());
        let mut touched = rows(40);
        touched.iter_mut().enumerate().for_each(|(k, row)| *point(row) = Point3::new(100.0 * (k % 4) as f64, 0.0, 0.0));
        assert_eq!(taken(touched).0, Vec::<usize>::new());
    }
}
