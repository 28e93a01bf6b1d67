use super::*;

#[test]
fn a_robot_survives_the_file() {
    let mut robot = Robot::paper();
    robot.joints[2].beta_rad = 0.001;
    robot.joints[0].limits_rad = Some((-3.0, 3.0));
    robot.tool_mm = Vector3::new(1.5, -2.0, 30.0);
    robot.corrections.gravity = vec![GravityTerm { joint: 1, point: LoadPoint::Origin(4), k_rad_per_m: 0.25 }];
    robot.corrections.bending = vec![GravityTerm { joint: 3, point: LoadPoint::Tool, k_rad_per_m: 0.125 }];
    robot.corrections.harmonics = vec![HarmonicTerm { joint: 5, wave: Wave::Sin2, amplitude_rad: 0.5 }];
    robot.corrections.wobble = vec![HarmonicTerm { joint: 4, wave: Wave::Cos, amplitude_rad: 0.25 }];
    robot.ends.last_frame_from_flange =
        crate::geometry::transform(Vector3::new(0.3, -3.0, 0.5), Vector3::new(1.0, 2.0, 3.0));
    let back = toml::from_str::<RobotRecord>(&to_toml(&robot)).unwrap().robot().unwrap();
    for (a, b) in back.joints.iter().zip(&robot.joints) {
        assert!((a.alpha_rad - b.alpha_rad).abs() < 1e-15 && (a.beta_rad - b.beta_rad).abs() < 1e-15);
    }
    assert_eq!(back.tool_mm, robot.tool_mm);
    assert_eq!(back.corrections, robot.corrections);
    assert_eq!(back.ends.root_from_frame0, robot.ends.root_from_frame0);
    let q = [0.4, -0.6, 1.1, 0.3, -0.9, 0.7];
    let off = back.root_from_flange(&q).inverse() * robot.root_from_flange(&q);
    assert!(off.translation.vector.norm() < 1e-10 && off.rotation.angle() < 1e-12);
}

#[test]
fn joints_turn_or_slide() {
    let screwing = to_toml(&Robot::paper()).replacen("[[joint]]", "[[joint]]\ntype = \"screw\"", 1);
    let message = toml::from_str::<RobotRecord>(&screwing).unwrap().robot().unwrap_err();
    assert!(message.contains("joint 1: type is \"screw\""), "{message}");
    let text = "[[joint]]\ntype = \"prismatic\"\nsign = -1.0\nlimits_mm = [0.0, 300.0]";
    let sliding = to_toml(&Robot::paper()).replacen("[[joint]]", text, 1);
    let robot = toml::from_str::<RobotRecord>(&sliding).unwrap().robot().unwrap();
    assert!(robot.joints[0].slides && robot.joints[0].sign == -1.0);
    assert_eq!(robot.joints[0].limits_rad, Some((0.0, 300.0)));
    let lower = robot.target_mm(&[100.0, 0.0, 0.0, 0.0, 0.0, 0.0]) - robot.target_mm(&[0.0; 6]);
    assert!((lower - Vector3::new(0.0, 0.0, -100.0)).norm() < 1e-9, "{lower}");
    let back = toml::from_str::<RobotRecord>(&to_toml(&robot)).unwrap().robot().unwrap();
    assert_eq!(back.joints, robot.joints);
    let turning = to_toml(&Robot::paper()).replacen("[[joint]]", "[[joint]]\ntype = \"revolute\"", 1);
    assert!(toml::from_str::<RobotRecord>(&turning).unwrap().robot().is_ok());
}

#[test]
fn a_joint_that_the_robot_lacks_is_refused() {
    let text =
        to_toml(&Robot::paper()) + "\n[harmonics]\nterms = [{ joint = 7, wave = \"sin\", amplitude_mrad = 1.0 }]\n";
    let message = toml::from_str::<RobotRecord>(&text).unwrap().robot().unwrap_err();
    assert!(message.contains("joint 7 of a robot with 6"), "{message}");
}

#[test]
fn links_in_metres_are_named_and_an_axis_without_length_is_none() {
    let read = |robot: &Robot| {
        let (_keep, path) = files::temporary("robot.toml", to_toml(robot));
        read(&path)
    };
    let mut robot = Robot::paper();
    for joint in &mut robot.joints {
        (joint.a_mm, joint.d_mm) = (joint.a_mm / 1000.0, joint.d_mm / 1000.0);
    }
    let message = read(&robot).unwrap_err().to_string();
    assert!(message.contains("lengths are in mm here, and these seem to be in m"), "{message}");
    robot.joints.iter_mut().for_each(|joint| joint.slides = true);
    assert!(read(&robot).is_ok());
}
