//! The maker's URDF with corrected joint origins: links, meshes, names, limits and axes stay as they are.
//!
//! A chain is its axes and its flange at reading zero (Brockett's product of exponentials), wherever the links' frames
//! stand on those axes. So each moving joint's frame is turned by the shortest way until its axis has the identified
//! direction, and set on the identified axis where it was nearest; the last one is set so that the flange, which hangs
//! rigidly on it, is right.

use nalgebra::UnitQuaternion;

use super::ExportedRobot;
use crate::formats::robots::urdf::{Chain, Kind, Urdf};
use crate::geometry::Transform;
use crate::robot::Robot;

/// An identified axis this far from the description's belongs to another joint or another zero position, rad.
const MOST_TURN_RAD: f64 = 0.35;

/// The same for its distance, mm.
const MOST_SHIFT_MM: f64 = 100.0;

/// Corrects the description. The robot has no corrections; an error says why the chain is not this robot's.
pub fn correct(urdf: &Urdf, chain: &Chain, robot: &Robot) -> Result<ExportedRobot, String> {
    let axes = robot.axes();
    let moving = chain.moving().count();
    if moving != axes.len() {
        return Err(format!(
            "{moving} joints move in the description's chain to `{}`, the robot has {}",
            chain.tip,
            axes.len()
        ));
    }
    let frames = chain.frames();
    let tip = frames.last().copied().unwrap_or_else(Transform::identity);
    let root_from_flange = robot.root_from_flange(&vec![0.0; axes.len()]);
    let last = chain.joints.iter().rposition(|j| j.kind != Kind::Fixed).unwrap_or(0);
    let (mut origins, mut number) = (Vec::new(), 0);
    // Where the corrected link before is, root frame.
    let mut root_from_parent = Transform::identity();
    for (place, (joint, frame)) in chain.joints.iter().zip(&frames).enumerate() {
        if joint.kind == Kind::Fixed {
            root_from_parent *= joint.parent_from_joint;
            continue;
        }
        let axis = &axes[number];
        number += 1;
        if axis.slides != (joint.kind == Kind::Prismatic) {
            return Err(format!("joint `{}` is {}, joint {number} of the robot is not", joint.name, joint.word));
        }
        let direction = frame.rotation * joint.axis;
        let turn = UnitQuaternion::rotation_between(&direction, &axis.direction)
            .filter(|turn| turn.angle() < MOST_TURN_RAD)
            .ok_or_else(|| {
                let angle = direction.angle(&axis.direction).to_degrees();
                format!("the axis of joint `{}` is {angle:.1} deg off joint {number}'s of the robot", joint.name)
            })?;
        let apart = axis.point_mm.coords - frame.translation.vector;
        let foot = apart - axis.direction * apart.dot(&axis.direction);
        let shift = if axis.slides { nalgebra::Vector3::zeros() } else { foot };
        if shift.norm() > MOST_SHIFT_MM {
            let far = shift.norm();
            return Err(format!("the axis of joint `{}` is {far:.1} mm off joint {number}'s of the robot", joint.name));
        }
        let corrected = if place == last {
            root_from_flange * (frame.inverse() * tip).inverse()
        } else {
            Transform::from_parts((frame.translation.vector + shift).into(), turn * frame.rotation)
        };
        origins.push((*joint, root_from_parent.inverse() * corrected));
        root_from_parent = corrected;
    }
    let text = urdf.with_origins(&origins);
    let carried = Urdf::parse(text.clone(), camino::Utf8Path::new("robot.urdf"))
        .and_then(|urdf| Ok(urdf.chain(Some(&chain.tip))?.robot(&robot.name)))
        .map_err(|e| e.to_string())?;
    let notes =
        vec![format!("{} joint origins of `{}` changed, the chain ends at `{}`", origins.len(), urdf.name, chain.tip)];
    Ok(ExportedRobot { name: "robot.urdf", text, carried, notes })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::robots::urdf_plain;
    use crate::robot::refit::Residual;
    use crate::robot::{Corrections, catalogue};
    use camino::Utf8Path;

    /// With a tool link, fixed joints between moving ones, an axis that is not z, and what must stay as it is.
    fn description(robot: &Robot) -> String {
        let text = urdf_plain::build(robot).text;
        let text = text.replace("<link name=\"link_2\"/>", "<link name=\"link_2\">\n    <!-- keep me --><visual><geometry><mesh filename=\"a.stl\"/></geometry></visual>\n  </link>");
        let hand = "  <link name=\"hand\"/>\n  <joint name=\"hand_joint\" type=\"fixed\">\n    <parent link=\"flange\"/>\n    <child link=\"hand\"/>\n    <origin xyz=\"0 0.01 0.1\" rpy=\"0.1 0 0.3\"/>\n  </joint>\n</robot>";
        text.replace("</robot>", hand)
    }

    #[test]
    fn the_corrected_description_is_the_identified_robot() {
        for arm in catalogue::ARMS {
            let mut drawn = arm.robot();
            drawn.corrections = Corrections::default();
            drawn.joints[2].sign = -1.0;
            let urdf = Urdf::parse(description(&drawn), Utf8Path::new("robot.urdf")).unwrap();
            let chain = urdf.chain(Some("hand")).unwrap();
            let nominal = chain.robot("nominal");
            let mut real = nominal.clone();
            for (k, joint) in real.joints.iter_mut().enumerate() {
                let s = (1.3 * k as f64).cos();
                (joint.alpha_rad, joint.beta_rad) = (joint.alpha_rad + 3e-3 * s, joint.beta_rad + 1e-3);
                (joint.a_mm, joint.d_mm) = (joint.a_mm - 0.7 * s, joint.d_mm + 0.3);
                joint.theta_rad += 5e-3 * s;
            }
            let corrected = correct(&urdf, &chain, &real).unwrap();
            assert!(corrected.text.contains("<!-- keep me -->") && corrected.text.contains("a.stl"));
            let off = Residual::between(&real, &corrected.carried);
            assert!(off.max_mm < 1e-9 && off.max_rad < 1e-11, "{}: {off:?}", arm.name);
            let before = Residual::between(&real, &nominal);
            assert!(before.mean_mm > 0.1, "the test would not see a file that is only copied: {before:?}");
        }
    }

    #[test]
    fn another_chain_is_refused() {
        let mut drawn = catalogue::robot("ur5e").unwrap();
        drawn.corrections = Corrections::default();
        let urdf = Urdf::parse(description(&drawn), Utf8Path::new("robot.urdf")).unwrap();
        let chain = urdf.chain(Some("hand")).unwrap();
        let mut other = chain.robot("other");
        other.joints[1].theta_rad += 1.5;
        let said = correct(&urdf, &chain, &other).unwrap_err();
        assert!(said.contains("deg off") || said.contains("mm off"), "{said}");
        other.joints.pop();
        assert!(correct(&urdf, &chain, &other).unwrap_err().contains("the robot has 5"));
    }
}
