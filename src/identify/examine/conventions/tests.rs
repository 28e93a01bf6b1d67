use super::*;
use crate::identify::synthetic::{World, planned, point};
use crate::measurements::{Measurement, Observed, Role};
use crate::tables::names::Unit;

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
    findings
        .into_iter()
        .chain(unexplained_mm.map(|mm| unexplained(&set, "the best fit", mm)))
        .map(|f| f.finding)
        .collect()
}

fn joints(rows: &[Measurement], change: impl Fn(&mut Vec<f64>)) -> Vec<Measurement> {
    let mut rows = rows.to_vec();
    rows.iter_mut().for_each(|row| change(&mut row.at.joints_deg));
    rows
}

/// The rows with the joints of those before.
fn late(rows: &[Measurement]) -> Vec<Measurement> {
    let mut late = rows.to_vec();
    late.iter_mut().skip(1).zip(rows).for_each(|(row, before)| row.at.joints_deg.clone_from(&before.at.joints_deg));
    late
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
    let seed = 1;
    let (world, rows) = one_sphere(8.0, seed);
    let robot = &world.nominal;
    assert_eq!(said(&rows, robot), [""; 0], "clean, seed {seed}");
    for (wrong, word) in [
        (joints(&rows, |q| q.swap(4, 5)), "joints 5 and 6 are exchanged"),
        (joints(&rows, |q| q.swap(3, 5)), "joints 4 and 6 are exchanged"),
        (joints(&rows, |q| q[3] = -q[3]), "joint 4 is counted the other way round"),
        (joints(&rows, |q| q[4] = -q[4]), "joint 5 is counted the other way round"),
        (joints(&rows, |q| q[4] -= 90.0), "joint 5 is offset by 90"),
        (joints(&rows, |q| q[3] += 180.0), "joint 4 is offset by"),
        (late(&rows), "the joints lag 1 row"),
    ] {
        let said = said(&wrong, robot);
        assert!(said.len() == 1 && said[0].contains(word), "{word}, seed {seed}: {said:?}");
    }
}

#[test]
fn what_is_to_be_mended_is_named_with_its_file() {
    let (world, rows) = one_sphere(8.0, 1);
    let found =
        |rows: &[Measurement]| examine(&Dataset::new(rows).unwrap(), &world.nominal, &Settings::default()).findings;
    assert!(found(&rows).is_empty());
    let negated = found(&joints(&rows, |q| q[3] = -q[3]));
    assert!(negated[0].of_joints && negated[0].action.contains("`sign` of joint 4 in the robot file"), "{negated:?}");
    let lagging = found(&late(&rows));
    assert!(!lagging[0].of_joints && lagging[0].action.contains("mend the table"), "{lagging:?}");
}

#[test]
fn sessions_a_target_elsewhere_and_gross_errors_are_no_convention() {
    let (world, rows) = one_sphere(8.0, 1);
    for step_mm in [0.5, 10.0] {
        let moved = shifted(&rows, |i| if i > rows.len() / 2 { step_mm } else { 0.0 });
        assert_eq!(said(&moved, &world.nominal), [""; 0], "a step of {step_mm} mm");
    }
    let gross = shifted(&rows, |i| if i % 5 == 3 { 4.0 + i as f64 } else { 0.0 });
    assert_eq!(said(&gross, &world.nominal), [""; 0]);
    for by in [5.0, 150.0] {
        let mut elsewhere = world.nominal.clone();
        elsewhere.tool_mm += nalgebra::Vector3::new(by, -by, 0.5 * by);
        assert_eq!(said(&rows, &elsewhere), [""; 0], "a target elsewhere by {by} mm");
    }
}

#[test]
fn a_row_whose_joints_are_lost_is_left_out() {
    let (world, rows) = one_sphere(25.0, 2);
    let set = Dataset::new(&late(&rows)).unwrap();
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

#[test]
fn what_is_said_of_joints_that_stand_still_is_not_what_a_tool_elsewhere_does() {
    // One joint turns; the encoders of the others read a little.
    let (world, mut rows) = one_sphere(8.0, 2);
    let first = rows[0].at.joints_deg.clone();
    for (i, row) in rows.iter_mut().enumerate() {
        row.at.joints_deg = first.iter().enumerate().map(|(j, q)| q + 1e-3 * ((i * (j + 3)) as f64).sin()).collect();
        row.at.joints_deg[0] = first[0] - 60.0 + 120.0 * i as f64 / 60.0;
        let at = world.nominal.target_mm(&row.at.joints_rad());
        *point(row) = at;
    }
    for by in [0.0, 40.0, 150.0] {
        let mut elsewhere = world.nominal.clone();
        elsewhere.tool_mm += nalgebra::Vector3::new(by, -0.5 * by, by);
        assert_eq!(said(&rows, &elsewhere), [""; 0], "a target elsewhere by {by} mm");
    }
}

#[test]
fn joints_that_are_counted_together_and_one_in_radians_are_named() {
    let (world, rows) = one_sphere(25.0, 4);
    for (wrong, word) in [
        (
            joints(&rows, |q| q[2] += q[1]),
            "joint 3 is counted together with joint 2: the angle between its links is j3 - j2",
        ),
        (joints(&rows, |q| q[2] -= q[1]), "from the horizontal): the angle between its links is j3 + j2"),
        (joints(&rows, |q| q[4] = q[4].to_radians()), "the angles of joint 5 are in radians"),
    ] {
        let said = said(&wrong, &world.nominal);
        assert!(said.len() == 1 && said[0].contains(word), "{word}: {said:?}");
    }
}

#[test]
fn errors_of_readings_in_metres_are_said_in_millimetres() {
    let (world, rows) = one_sphere(25.0, 5);
    let mut metres = rows.clone();
    metres.iter_mut().for_each(|row| point(row).coords /= 1000.0);
    let said = said(&metres, &world.nominal);
    let left: f64 = said[0].split(" to ").nth(1).and_then(|text| text.split(' ').next()).unwrap().parse().unwrap();
    assert!(said[0].contains("the readings are in m, not in mm") && (0.01..0.1).contains(&left), "{said:?}");
}

#[test]
fn rows_in_metres_among_others_are_named_and_speak_against_the_file() {
    let (world, rows) = one_sphere(25.0, 6);
    for (share, of) in [(3, "m"), (5, "inches"), (2, "cm")] {
        let factor = [("m", 1000.0), ("inches", 25.4), ("cm", 10.0)].iter().find(|unit| unit.0 == of).unwrap().1;
        let mut mixed = rows.clone();
        mixed.iter_mut().step_by(share).for_each(|row| point(row).coords /= factor);
        let set = Dataset::new(&mixed).unwrap();
        let Mended { set: mended, findings, against, .. } = examine(&set, &world.nominal, &Settings::default());
        assert!(findings.is_empty() && against.len() == 1, "{of}: {findings:?} {against:?}");
        assert!(against[0].finding.contains(&format!("a part of the readings is in {of}")), "{against:?}");
        assert_eq!(against[0].rows.len(), rows.len().div_ceil(share));
        let right = Dataset::new(&rows).unwrap();
        for (pose, right) in mended.poses.iter().zip(&right.poses) {
            let (a, b) = (pose.reading.point_mm().unwrap(), right.reading.point_mm().unwrap());
            assert!((a - b).norm() < 1e-6);
        }
    }
}

#[test]
fn a_unit_that_was_typed_is_named_with_the_one_that_it_would_have_to_be() {
    let (world, rows) = one_sphere(25.0, 5);
    for (typed, is, factor) in
        [(Unit::M, Unit::Cm, 100.0), (Unit::M, Unit::Mm, 1000.0), (Unit::Mm, Unit::M, 1e-3), (Unit::Cm, Unit::M, 0.01)]
    {
        let mut read = rows.clone();
        read.iter_mut().for_each(|row| point(row).coords *= factor);
        let mut set = Dataset::new(&read).unwrap();
        set.typed_unit = Some(typed);
        let Mended { findings, against, .. } = examine(&set, &world.nominal, &Settings::default());
        assert!(findings.is_empty() && against.len() == 1, "{findings:?} {against:?}");
        let named =
            format!("the readings are in {}, not in {} as `--units {}` says (", is.word(), typed.word(), typed.flag());
        assert!(against[0].finding.starts_with(&named), "{against:?}");
    }
}

#[test]
fn a_unit_of_angles_that_was_typed_is_named_with_the_flag_that_is_right() {
    let (world, rows) = one_sphere(25.0, 5);
    for (is, read_as, times) in [(Unit::Deg, Unit::Rad, 1f64.to_degrees()), (Unit::Rad, Unit::Deg, 1f64.to_radians())] {
        for lengths in [None, Some(Unit::M)] {
            let read = joints(&rows, |q| q.iter_mut().for_each(|angle| *angle *= times));
            let mut set = Dataset::new(&read).unwrap();
            (set.typed_angle, set.typed_unit) = (Some(read_as), lengths);
            let Mended { findings, against, unexplained_mm, .. } = examine(&set, &world.nominal, &Settings::default());
            assert!(findings.len() == 1 && against.is_empty() && unexplained_mm.is_none(), "{findings:?} {against:?}");
            let (word, not, flag) = (is.word(), read_as.word(), read_as.flag());
            let named = format!("the joint angles are in {word}, not in {not} as `--units {flag}` says (");
            assert!(findings[0].finding.starts_with(&named), "{findings:?}");
            let flags = if lengths.is_some() { format!("{},m", is.flag()) } else { is.flag().to_owned() };
            assert!(findings[0].action.contains(&format!("`--units {flags}` says so")), "{findings:?}");
        }
    }
}

/// Nor is the robot file to blame.
#[test]
fn rows_of_placements_far_apart_are_of_no_other_convention() {
    let world = planned(160, 0, 25.0, 0.02, 7, &|_| {});
    let of = |block: &str| world.rows.iter().filter(|row| row.at.group == block).take(30).cloned().collect::<Vec<_>>();
    let mut rows = [of("g0"), of("g2")].concat();
    rows.iter_mut().for_each(|row| (row.at.group, row.at.role) = ("one".to_owned(), Role::Sample));
    assert_eq!(said(&rows, &world.nominal), [""; 0]);
}

#[test]
fn what_makes_no_error_fall_is_not_told_of_another_arm() {
    let (_, rows) = one_sphere(25.0, 6);
    for (seed, factor) in [(0, 1.0), (1, 0.3)] {
        let mut robot = Robot::paper();
        for (i, joint) in robot.joints.iter_mut().enumerate() {
            joint.a_mm += 150.0 * (1.0 + 2.0 * i as f64 + f64::from(seed)).sin();
            joint.d_mm *= factor;
            joint.alpha_rad += 0.5 * (2.0 + i as f64).cos();
        }
        for finding in said(&rows, &robot) {
            let Some(errors) = finding.split("fall from ").nth(1) else { continue };
            let mut numbers = errors.split([' ', ')']).filter_map(|word| word.parse::<f64>().ok());
            assert!(numbers.next().unwrap() > numbers.next().unwrap(), "{finding}");
        }
    }
}

/// An arm that is off by what a good one is off, with a target this far off its last axis.
fn near_the_axis(off_mm: f64) -> (World, Vec<Measurement>) {
    let world = planned(40, 20, 25.0, 0.02, 7, &|robot| {
        robot.tool_mm = nalgebra::Vector3::new(off_mm, 0.0, 120.0);
        for (i, joint) in robot.joints.iter_mut().enumerate() {
            joint.theta_rad += 1e-3 * (1.0 + i as f64).sin();
            joint.a_mm += 0.3 * (2.0 + i as f64).cos();
        }
    });
    let rows = world.rows.clone();
    (world, rows)
}

#[test]
fn what_the_last_joint_reads_is_named_though_it_moves_the_target_little() {
    let spoilt = |rows: &[Measurement]| {
        let one_late = {
            let mut late = rows.to_vec();
            late.iter_mut().skip(1).zip(rows).for_each(|(row, before)| row.at.joints_deg[5] = before.at.joints_deg[5]);
            late
        };
        [
            (joints(rows, |q| q[5] = -q[5]), "joint 6 is counted the other way round"),
            (joints(rows, |q| q[5] = q[5].to_radians()), "the angles of joint 6 are in radians"),
            (one_late, "joint 6 lags 1 row"),
        ]
    };
    for off_mm in [0.5, 4.0] {
        let (world, rows) = near_the_axis(off_mm);
        assert_eq!(said(&rows, &world.nominal), [""; 0], "clean, {off_mm} mm off the axis");
        for (wrong, word) in spoilt(&rows) {
            let said = said(&wrong, &world.nominal);
            assert!(said.len() == 1 && said[0].contains(word), "{word}, {off_mm} mm off the axis: {said:?}");
        }
    }
    // On the axis nothing tells, and nothing is lost.
    let (world, rows) = near_the_axis(0.0);
    for (wrong, word) in spoilt(&rows) {
        assert_eq!(said(&wrong, &world.nominal), [""; 0], "{word}");
    }
}

#[test]
fn points_of_two_days_are_no_column_of_the_last_joint() {
    for (off_mm, seed) in [(0.0, 1), (0.0, 2), (0.1, 3)] {
        let (world, rows) = near_the_axis(off_mm);
        for by_mm in [0.3, 1.0] {
            let moved = shifted(&rows, |i| if (i * i + seed * i) % 3 == 0 { by_mm } else { 0.0 });
            assert_eq!(said(&moved, &world.nominal), [""; 0], "{off_mm} mm off the axis, {by_mm} mm in x");
        }
    }
}

#[test]
fn of_two_robots_that_explain_about_as_well_neither_is_the_cause() {
    let misfit = |nominal, left| Misfit { nominal, target: 0.5, fitted: left, left, free: 100 };
    let mut tried = vec![
        (misfit(1.0, 0.2), Hypothesis::Twisted(1)),
        (misfit(1.01, 0.2), Hypothesis::Negated(0)),
        (misfit(5.0, 0.2), Hypothesis::Negated(3)),
    ];
    let best = Likeliest::of(&tried).unwrap();
    assert_eq!((best.hypothesis, best.rivals.len()), (Hypothesis::Negated(0), 0));
    assert_eq!(best.like, [Hypothesis::Twisted(1)]);
    // One that is worse in all is none; one whose links are nearer is.
    tried.push((misfit(1.5, 0.3), Hypothesis::Coupled(1, 1.0)));
    assert!(Likeliest::of(&tried).unwrap().rivals.is_empty());
    tried.push((Misfit { target: 0.4, ..misfit(1.5, 0.3) }, Hypothesis::Coupled(2, 1.0)));
    let best = Likeliest::of(&tried).unwrap();
    assert_eq!(best.rivals, [Hypothesis::Coupled(2, 1.0)]);
    assert!(best.open().finding.contains("joint 1 is counted the other way round"));
}

#[test]
fn several_joints_that_are_counted_otherwise_at_once_are_named() {
    let (world, rows) = near_the_axis(30.0);
    let negated = |q: &mut Vec<f64>, which: &[usize]| which.iter().for_each(|joint| q[*joint] = -q[*joint]);
    for (wrong, words) in [
        // As KUKA counts, beside a textbook's table.
        (joints(&rows, |q| negated(q, &[0, 3, 5])), &["joints 1, 4, 6 are counted the other way round"][..]),
        (joints(&rows, |q| negated(q, &[1, 2, 4])), &["joints 2, 3, 5 are counted the other way round"]),
        // As Fanuc does.
        (
            joints(&rows, |q| {
                negated(q, &[2, 3, 4, 5]);
                q[2] -= q[1];
            }),
            &["joints 3, 4, 5, 6 are counted the other way round", "joint 3 is counted together with joint 2"],
        ),
    ] {
        let said = said(&wrong, &world.nominal);
        assert!(said.len() == 1 && words.iter().all(|word| said[0].contains(word)), "{words:?}: {said:?}");
    }
    // What a twist of the wrong sign does as well is named beside it.
    for pair in [[1, 2], [4, 5]] {
        let said = said(&joints(&rows, |q| negated(q, &pair)), &world.nominal);
        let words = format!("joints {}, {} are counted the other way round", pair[0] + 1, pair[1] + 1);
        assert!(said.len() == 1 && said[0].contains(&words), "{said:?}");
    }
    // Of a joint that hardly moves the target nothing is said.
    let (world, rows) = near_the_axis(0.02);
    let said = said(&joints(&rows, |q| negated(q, &[2, 4])), &world.nominal);
    assert!(said.len() == 1 && said[0].starts_with("joints 3, 5 are counted"), "{said:?}");
    assert!(!said[0].contains("which these readings do not tell apart"), "{said:?}");
    // Another arm is not counted so.
    let mut robot = Robot::paper();
    for (i, joint) in robot.joints.iter_mut().enumerate() {
        joint.a_mm += 150.0 * (1.0 + 2.0 * i as f64).sin();
        joint.alpha_rad += 0.5 * (2.0 + i as f64).cos();
    }
    let of_another = super::examine(&Dataset::new(&rows).unwrap(), &robot, &Settings::default()).findings;
    assert!(of_another.iter().all(|found| !found.finding.contains("counted")), "{of_another:?}");
}
