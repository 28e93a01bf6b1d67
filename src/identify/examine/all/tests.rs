use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::super::hypothesis::{Hypothesis, hypotheses};
use super::*;
use crate::identify::synthetic::{self, planned, point, row, seen_at};
use crate::measurements::{Measurement, Role};
use crate::tables::names::Unit;

/// What is said of these rows, and whether anything is left unexplained.
fn said(rows: &[Measurement], robot: &Robot) -> (Vec<String>, bool) {
    let examined = examine(&Dataset::new(rows).unwrap(), robot, &Settings::default(), &|_| {});
    let all = examined.findings.into_iter().chain(examined.against);
    (all.map(|finding| finding.finding).collect(), examined.unexplained.is_some())
}

/// Sixty poses all over the workspace, as the robot takes them; the sensor moves to another place after half of them.
fn of_two_placements(seed: u64) -> (Robot, Vec<Measurement>) {
    let nominal = Robot { tool_mm: Vector3::new(40.0, -20.0, 60.0), ..Robot::paper() };
    let (truth, mut random) = (nominal.clone().with_table_2(), Pcg64Mcg::seed_from_u64(seed));
    let read = |k: usize| {
        let joints: Vec<f64> = truth.joints.iter().map(|_| 2.4 * random.random::<f64>() - 1.2).collect();
        let place = synthetic::sensor(k / 30) * truth.target_mm(&joints) + 0.02 * synthetic::normal(&mut random);
        let joints_deg = joints.iter().map(|q| q.to_degrees()).collect();
        row(format!("p{k}"), "one", Role::Sample, joints_deg, seen_at(place))
    };
    let rows = (0..60).map(read).collect();
    (nominal, rows)
}

#[test]
fn a_coordinate_in_another_unit_is_named() {
    let world = planned(60, 0, 25.0, 0.02, 1, &|_| {});
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        for (mm, unit) in [(1000.0, "m"), (25.4, "inches")] {
            let mut rows = world.rows.clone();
            rows.iter_mut().for_each(|row| point(row)[axis] /= mm);
            let (said, is_open) = said(&rows, &world.nominal);
            let wanted = format!("{name} of the points is in {unit}, the other coordinates are in mm");
            assert!(!is_open && said.iter().any(|said| said.starts_with(&wanted)), "{wanted}: {said:?}");
        }
    }
}

#[test]
fn a_way_in_another_unit_is_named() {
    let mut robot = Robot::paper();
    robot.joints[2].slides = true;
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let mut rows: Vec<Measurement> = Vec::new();
    for k in 0..40 {
        // In m where it slides, in rad elsewhere.
        let joints: Vec<f64> = robot.joints.iter().map(|_| 1.6 * random.random::<f64>() - 0.8).collect();
        let mut moved = joints.clone();
        moved[2] *= 1000.0;
        let mut read: Vec<f64> = joints.iter().map(|q| q.to_degrees()).collect();
        read[2] = joints[2];
        let place = synthetic::sensor(0) * robot.target_mm(&moved);
        let mut read_at = row(format!("p{k}"), "one", Role::Sample, read, seen_at(place));
        read_at.at.slides = robot.joints.iter().map(|joint| joint.slides).collect();
        rows.push(read_at);
    }
    let (said, is_open) = said(&rows, &robot);
    let wanted = "the readings of joint 3, which slides, are in m, not in mm";
    assert!(!is_open && said.iter().any(|said| said.starts_with(wanted)), "{said:?}");
}

#[test]
fn a_column_that_is_wrong_is_named_beside_a_sensor_that_was_moved() {
    let (nominal, rows) = of_two_placements(2);
    let (clean, is_open) = said(&rows, &nominal);
    assert!(!is_open && clean.is_empty(), "{clean:?}");
    let changed = |change: fn(&mut Measurement), wanted: &str| {
        let mut wrong = rows.clone();
        wrong.iter_mut().for_each(change);
        let (said, is_open) = said(&wrong, &nominal);
        assert!(!is_open && said.iter().any(|said| said.starts_with(wanted)), "{wanted}: {said:?}");
    };
    changed(|row| row.at.joints_deg[1] = -row.at.joints_deg[1], "joint 2 is counted the other way round");
    changed(|row| row.at.joints_deg[4] = row.at.joints_deg[4].to_radians(), "the angles of joint 5 are in radians");
    changed(|row| point(row).y *= -1.0, "the coordinates are mirrored");
}

/// A robot that hardly moves touches everything where it is: angles are degrees that were read as radians where no
/// joint turns so far.
#[test]
fn touches_make_no_radians_of_degrees() {
    let (world, _) = synthetic::touched(0.0, 1);
    let is_tried = |rows: &[Measurement]| {
        let list = hypotheses(&Dataset::new(rows).unwrap(), &world.nominal);
        list.contains(&Hypothesis::Angles(Unit::Rad, Unit::Deg))
    };
    assert!(!is_tried(&world.rows));
    let mut other = world.nominal.clone();
    other.joints.iter_mut().for_each(|joint| joint.a_mm = 1.4 * joint.a_mm + 30.0);
    other.tool_mm += Vector3::new(40.0, 0.0, 60.0);
    let (said, _) = said(&world.rows, &other);
    assert!(said.iter().all(|said| !said.contains("not in radians")), "{said:?}");
    let mut read_as_radians = world.rows.clone();
    read_as_radians.iter_mut().flat_map(|row| &mut row.at.joints_deg).for_each(|q| *q = q.to_degrees());
    assert!(is_tried(&read_as_radians));
}
