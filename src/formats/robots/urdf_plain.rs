//! A URDF built from the chain alone: a link a joint, frames at the joints, no shapes.

use std::fmt::Write as _;

use super::ExportedRobot;
use crate::formats::robots::urdf::origin_element;
use crate::geometry::Transform;
use crate::robot::{Joint, Robot};

/// URDF wants a largest effort and speed of every joint with limits; the table has none.
const EFFORT: f64 = 1000.0;
const VELOCITY: f64 = std::f64::consts::PI;

/// Builds the description. The robot has no corrections ([`Robot::without_corrections`]).
pub fn build(robot: &Robot) -> ExportedRobot {
    let mut text = format!("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n", escaped(&robot.name));
    let mut link = "base_link".to_owned();
    let _ = writeln!(text, "  <link name=\"{link}\"/>");
    let fixed = |text: &mut String, name: &str, parent: &str, child: &str, origin: &Transform| {
        let _ = writeln!(
            text,
            "  <joint name=\"{name}\" type=\"fixed\">\n    <parent link=\"{parent}\"/>\n    <child link=\"{child}\"/>\n    {}\n  </joint>\n  <link name=\"{child}\"/>",
            origin_element(origin)
        );
    };
    if robot.ends.root_from_frame0 != Transform::identity() {
        fixed(&mut text, "base_joint", &link, "frame_0", &robot.ends.root_from_frame0);
        link = "frame_0".to_owned();
    }
    for (k, joint) in robot.joints.iter().enumerate() {
        let child = format!("link_{}", k + 1);
        let kind = match (joint.slides, joint.limits_rad) {
            (true, _) => "prismatic",
            (false, Some(_)) => "revolute",
            (false, None) => "continuous",
        };
        let _ = writeln!(
            text,
            "  <joint name=\"joint_{}\" type=\"{kind}\">\n    <parent link=\"{link}\"/>\n    <child link=\"{child}\"/>\n    {}\n    <axis xyz=\"0 0 {}\"/>\n    {}\n  </joint>\n  <link name=\"{child}\"/>",
            k + 1,
            origin_element(&joint.previous_from_this(0.0)),
            joint.sign,
            limit(joint)
        );
        link = child;
    }
    fixed(&mut text, "flange_joint", &link, "flange", &robot.ends.last_frame_from_flange);
    text.push_str("</robot>\n");
    let tool = robot.tool_mm;
    let notes = vec![format!(
        "the link `flange` ends the chain; the target point ({:.4}, {:.4}, {:.4}) mm in `{link}` is not in the file",
        tool.x, tool.y, tool.z
    )];
    ExportedRobot { name: "robot.urdf", text, carried: robot.clone(), notes }
}

fn limit(joint: &Joint) -> String {
    let Some((low, high)) = joint.limits_rad else {
        let metre = if joint.slides { " lower=\"-1000\" upper=\"1000\"" } else { "" };
        return format!("<limit{metre} effort=\"{EFFORT}\" velocity=\"{VELOCITY}\"/>");
    };
    let unit = if joint.slides { 1e-3 } else { 1.0 };
    format!("<limit lower=\"{}\" upper=\"{}\" effort=\"{EFFORT}\" velocity=\"{VELOCITY}\"/>", low * unit, high * unit)
}

fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('"', "&quot;").replace('<', "&lt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::robots::urdf::Urdf;
    use crate::robot::refit::Residual;
    use crate::robot::{Corrections, catalogue};
    use camino::Utf8Path;

    #[test]
    fn every_arm_comes_back_from_its_description() {
        for arm in catalogue::ARMS {
            let mut robot = arm.robot();
            robot.corrections = Corrections::default();
            robot.joints[1].beta_rad = 1e-3;
            robot.joints[2].sign = -1.0;
            robot.ends.root_from_frame0 = crate::compensate::pose(&[10.0, -20.0, 30.0, 0.3, -0.2, 1.1]);
            let text = build(&robot).text;
            let urdf = Urdf::parse(text, Utf8Path::new("robot.urdf")).unwrap();
            let back = urdf.chain(None).unwrap().robot("back");
            let off = Residual::between(&robot, &back);
            assert!(off.max_mm < 1e-9 && off.max_rad < 1e-12, "{}: {off:?}", arm.name);
            for (a, b) in robot.joints.iter().zip(&back.joints) {
                assert_eq!(a.limits_rad.is_some(), b.limits_rad.is_some());
            }
        }
    }
}
