use super::*;
use crate::identify::synthetic::{World, planned, point};
use crate::measurements::{Measurement, Observed};

/// One sphere with tilts of so many degrees, by an arm that is off by what a good one is off.
fn one_sphere(tilt_deg: f64, seed: u64) -> (World, Vec<Measurement>) {
    let world = planned(240, 20, tilt_deg, 0.02, seed, &|robot| {
        let tool_mm = robot.tool_mm;
        *robot = Robot::paper();
        robot.tool_mm = tool_mm;
        for (i, joint) in robot.joints.iter_mut().enumerate() {
            joint.theta_rad += 3e-4 * (1.0 + i as f64).sin();
            joint.a_mm += 0.2 * (2.0 + i as f64).cos();
        }
    });
    let group = world.rows[0].at.group.clone();
    let rows = world.rows.iter().filter(|row| row.at.group == group).cloned().collect();
    (world, rows)
}

fn said(rows: &[Measurement], robot: &Robot) -> Vec<String> {
    let set = Dataset::new(rows).unwrap();
    let Mended { findings, unexplained_mm, .. } = examine(&set, robot, &Settings::default());
    findings.into_iter().chain(unexplained_mm.map(unexplained)).map(|f| f.finding).collect()
}

fn joints(rows: &[Measurement], change: impl Fn(&mut Vec<f64>)) -> Vec<Measurement> {
    let mut rows = rows.to_vec();
    rows.iter_mut().for_each(|row| change(&mut row.at.joints_deg));
    rows
}

fn shifted(rows: &[Measurement], by: impl Fn(usize) -> f64) -> Vec<Measurement> {
    let mut rows = rows.to_vec();
    for (i, row) in rows.iter_mut().enumerate() {
        point(row).x += by(i);
    }
    rows
}

#[test]
fn what_a_fit_swallows_where_joints_move_little_is_named() {
    for seed in 1..4 {
        let (world, rows) = one_sphere(8.0, seed);
        let robot = &world.nominal;
        assert_eq!(said(&rows, robot), [""; 0], "clean, seed {seed}");
        let late: Vec<Measurement> = rows
            .iter()
            .enumerate()
            .map(|(i, row)| {
                let mut row = row.clone();
                row.at.joints_deg.clone_from(&rows[i.saturating_sub(1)].at.joints_deg);
                row
            })
            .collect();
        for (wrong, word) in [
            (joints(&rows, |q| q.swap(4, 5)), "joints 5 and 6 are exchanged"),
            (joints(&rows, |q| q.swap(3, 5)), "joints 4 and 6 are exchanged"),
            (joints(&rows, |q| q[3] = -q[3]), "joint 4 is counted the other way round"),
            (joints(&rows, |q| q[4] = -q[4]), "joint 5 is counted the other way round"),
            (joints(&rows, |q| q[4] -= 90.0), "joint 5 is offset by 90"),
            (joints(&rows, |q| q[3] += 180.0), "joint 4 is offset by"),
            (late, "the joints lag 1 row"),
        ] {
            let said = said(&wrong, robot);
            assert!(said.len() == 1 && said[0].contains(word), "{word}, seed {seed}: {said:?}");
        }
    }
}

#[test]
fn sessions_a_target_elsewhere_and_gross_errors_are_no_convention() {
    let (world, rows) = one_sphere(8.0, 1);
    for step_mm in [0.5, 3.0, 10.0, 50.0] {
        let moved = shifted(&rows, |i| if i > rows.len() / 2 { step_mm } else { 0.0 });
        assert_eq!(said(&moved, &world.nominal), [""; 0], "a step of {step_mm} mm");
    }
    let gross = shifted(&rows, |i| if i % 5 == 3 { 4.0 + i as f64 } else { 0.0 });
    assert_eq!(said(&gross, &world.nominal), [""; 0]);
    for by in [5.0, 50.0, 150.0] {
        let mut elsewhere = world.nominal.clone();
        elsewhere.tool_mm += nalgebra::Vector3::new(by, -by, 0.5 * by);
        assert_eq!(said(&rows, &elsewhere), [""; 0], "a target elsewhere by {by} mm");
    }
}

#[test]
fn a_row_whose_joints_are_lost_is_left_out() {
    let (world, rows) = one_sphere(25.0, 2);
    let mut late = rows.clone();
    for i in 1..rows.len() {
        late[i].at.joints_deg.clone_from(&rows[i - 1].at.joints_deg);
    }
    let set = Dataset::new(&late).unwrap();
    let Mended { set: mended, .. } = examine(&set, &world.nominal, &Settings::default());
    assert_eq!(mended.poses.len(), set.poses.len() - 1);
    assert_eq!(mended.skipped.len(), 1);
    for (pose, row) in mended.poses.iter().zip(&rows) {
        assert_eq!(pose.joints_rad, row.at.joints_rad(), "{}", pose.name);
    }
}

#[test]
fn micrometres_are_named_and_nothing_else_is_called_so() {
    let (world, rows) = one_sphere(25.0, 3);
    let mut fine = rows.clone();
    for row in &mut fine {
        if let Observed::Position { point_mm, covariance_mm2, .. } = &mut row.observed {
            point_mm.coords *= 1000.0;
            *covariance_mm2 = None;
        }
    }
    assert!(said(&fine, &world.nominal)[0].contains("the readings are in um"));
    let wrong = said(&joints(&rows, |q| q[2] -= 90.0), &world.nominal);
    assert!(wrong.len() == 1 && wrong[0].contains("joint 3 is offset by 90"), "{wrong:?}");
}
