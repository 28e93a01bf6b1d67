use super::*;
use crate::robot::catalogue;
use crate::robot::corrections::{GravityTerm, HarmonicTerm, LoadPoint, Wave};

/// The contract's round trip.
const SAME_MM: f64 = 1e-3;
const SAME_RAD: f64 = 1e-6;

const BENT: [f64; 6] = [0.3, -1.2, 1.4, -0.9, -1.3, 0.4];

/// An arm that is off as machines are, with every kind of term.
fn real(nominal: &Robot) -> Robot {
    let mut robot = nominal.clone();
    for (k, joint) in robot.joints.iter_mut().enumerate() {
        let s = (1.7 * k as f64).sin();
        joint.alpha_rad += 2e-3 * s;
        joint.beta_rad += 1e-3 * (1.0 - s);
        joint.a_mm += 0.6 * s;
        joint.theta_rad -= 4e-3 * s;
        joint.d_mm += 0.4;
    }
    robot.tool_mm += Vector3::new(0.3, -0.2, 0.5);
    robot.corrections.gravity = vec![GravityTerm { joint: 1, point: LoadPoint::Origin(2), k_rad_per_m: 1e-3 }];
    robot.corrections.harmonics = vec![HarmonicTerm { joint: 2, wave: Wave::Cos2, amplitude_rad: 5e-4 }];
    robot
}

fn named(name: &str) -> Robot {
    let mut robot = catalogue::robot(name).unwrap();
    robot.tool_mm = Vector3::new(10.0, -20.0, 80.0);
    robot
}

#[test]
fn the_real_tool_goes_where_the_nominal_one_was_meant_to_be() {
    for name in ["ur5e", "abb-irb120", "kuka-iiwa14", "fanuc-lrmate200id", "paper"] {
        let nominal = named(name);
        let identified = real(&nominal);
        let targets: Vec<Target> = (0..200)
            .map(|k| inverse::spread_start(&nominal, k))
            .filter(|q| inverse::freedom_mm(&nominal, q) > 15.0)
            .map(Target::Readings)
            .collect();
        let compensator = Compensator::new(&nominal, &identified, None);
        let compensated = compensator.compensate(&targets);
        let mut done = 0;
        for (target, found) in targets.iter().zip(&compensated) {
            let Target::Readings(given) = target else { continue };
            let Ok(readings) = &found.readings else { continue };
            done += 1;
            let off = compensator.meant(given).inverse() * compensator.reached(readings);
            assert!(off.translation.vector.norm() < SAME_MM && off.rotation.angle() < SAME_RAD);
            assert!(found.miss_mm.unwrap() > 0.1);
            assert!(readings.iter().zip(given).all(|(a, b)| (a - b).abs() < MOST_TURN_RAD));
        }
        assert!(done > targets.len() * 9 / 10 && done > 50, "{name}: {done} of {}", targets.len());
    }
}

#[test]
fn poses_find_their_posture_and_the_posture_that_is_named_is_kept() {
    let nominal = named("ur5e");
    let identified = real(&nominal);
    let compensator = Compensator::new(&nominal, &identified, None);
    let root_from_tool = compensator.reached(&BENT);
    let near_rad = Some(BENT.map(|v| v + 0.1).to_vec());
    let named = compensator.compensate(&[Target::Pose { root_from_tool, near_rad }]);
    let readings = named[0].readings.as_ref().unwrap();
    assert!(readings.iter().zip(&BENT).all(|(a, b)| (a - b).abs() < 1e-6));
    let free = compensator.compensate(&[Target::Pose { root_from_tool, near_rad: None }]);
    let there = compensator.reached(free[0].readings.as_ref().unwrap());
    assert!((there.translation.vector - root_from_tool.translation.vector).norm() < SAME_MM);
}

#[test]
fn poses_without_readings_stay_where_the_robot_was_identified() {
    let nominal = named("ur5e");
    let identified = real(&nominal);
    let free = Compensator::new(&nominal, &identified, None);
    let root_from_tool = free.reached(&BENT);
    let pose = |root_from_tool| Target::Pose { root_from_tool, near_rad: None };
    let taken = free.compensate(&[pose(root_from_tool)])[0].readings.clone().unwrap();
    // Another posture of the same pose, around which the robot was identified.
    let wanted = free.base_from_flange(&root_from_tool);
    let other = |start: Vec<f64>| {
        let found = inverse::from_start(&identified, &wanted, &start)?;
        found.iter().zip(&taken).any(|(a, b)| (a - b).abs() > 1.0).then_some(found)
    };
    let around = (0..POSTURE_STARTS).find_map(|k| other(inverse::spread_start(&identified, k))).unwrap();
    let ranges: Vec<(f64, f64)> = around.iter().map(|q| (q - 0.4, q + 0.4)).collect();
    // One beside it, for which no posture there is known.
    let turned = free.reached(&[BENT[0] + 2.0, BENT[1], BENT[2], BENT[3], BENT[4], BENT[5]]);
    let known = free.clone().identified_over(&ranges).compensate(&[pose(root_from_tool), pose(turned)]);
    let readings = known[0].readings.as_ref().unwrap();
    assert!(readings.iter().zip(&ranges).all(|(q, (low, high))| (*low..=*high).contains(q)), "{readings:?}");
    for (found, wanted) in known.iter().zip([root_from_tool, turned]) {
        let there = free.reached(found.readings.as_ref().unwrap());
        assert!((there.translation.vector - wanted.translation.vector).norm() < SAME_MM);
    }
    // Ranges that the joints' limits leave nothing of are none.
    let nowhere = vec![(50.0, 51.0); 6];
    let limited = Compensator::new(&nominal, &identified.within(&[(-3.1, 3.1); 6]), None).identified_over(&nowhere);
    assert!(limited.compensate(&[pose(root_from_tool)])[0].readings.is_ok());
}

#[test]
fn what_is_in_the_way_is_named() {
    let nominal = named("ur5e");
    let mut identified = real(&nominal);
    let said = |identified: &Robot, target: Target| {
        Compensator::new(&nominal, identified, None).compensate(&[target])[0].readings.clone().unwrap_err()
    };
    let far = transform(Vector3::zeros(), Vector3::new(5000.0, 0.0, 0.0));
    let there = said(&identified, Target::Pose { root_from_tool: far, near_rad: None });
    assert!(matches!(there, Refusal::OutOfReach { short_mm } if short_mm > 1000.0), "{there}");
    let stretched = said(&identified, Target::Readings(vec![0.3, -1.2, 0.0, -0.9, -1.3, 0.4]));
    assert!(matches!(stretched, Refusal::OutOfReach { .. } | Refusal::Singular { .. }), "{stretched}");
    identified.joints[3].limits_rad = Some((-0.5, 0.5));
    let limited = said(&identified, Target::Readings(BENT.to_vec()));
    assert!(matches!(limited, Refusal::Outside { joint: 4, .. }), "{limited}");
    // A target that the nominal robot reaches and the real one only beyond a limit.
    identified.joints[3].limits_rad = Some((-1.5, -0.899));
    let limited = said(&identified, Target::Readings(BENT.to_vec()));
    assert!(matches!(limited, Refusal::Limit { joint: 4, .. }), "{limited}");
}

/// A tool of its own replaces both; without it each file's own counts.
#[test]
fn one_tool_for_both() {
    let nominal = named("ur5e");
    let identified = real(&nominal);
    let tool_mm = Vector3::new(0.0, 0.0, 150.0);
    let compensator = Compensator::new(&nominal, &identified, Some(tool_mm));
    let readings = compensator.compensate(&[Target::Readings(BENT.to_vec())])[0].readings.clone().unwrap();
    let tool = Transform::from(tool_mm);
    let at = |robot: &Robot, q: &[f64]| robot.base_from_flange(q) * tool;
    let off = at(&nominal, &BENT).inverse() * at(&identified, &readings);
    assert!(off.translation.vector.norm() < SAME_MM && off.rotation.angle() < SAME_RAD);
}
