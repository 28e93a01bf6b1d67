//! A robot in words: the common arms, a chain as a person would describe it, a pose to hold against the pendant.

use std::fmt::Write as _;

use nalgebra::Vector3;

use super::table::{self, Table};
use crate::formats::robots::urdf::roll_pitch_yaw;
use crate::geometry::{Transform, rotation_vector};
use crate::robot::catalogue::{ARMS, Arm, PAPER};
use crate::robot::corrections::{LoadPoint, Wave};
use crate::robot::{Joint, Robot};

/// Angles that count as none, rad, and lengths, mm: a table's last digits.
const NO_ANGLE_RAD: f64 = 1e-9;
const NO_LENGTH_MM: f64 = 1e-6;

/// All names with makers and sources.
pub fn list() -> String {
    let width = ARMS.iter().map(|a| a.name.len()).max().unwrap_or(0);
    let mut text = String::new();
    for arm in ARMS {
        let _ = writeln!(text, "{:width$}  {}, {} joints; {}", arm.name, arm.title, arm.joints.len(), arm.source);
    }
    let _ = writeln!(text, "{PAPER:width$}  the robot of Table 1 of the paper, 6 joints; limits of a common arm");
    text
}

/// Where an arm's numbers come from, and what to know about them.
pub fn provenance(arm: &Arm) -> String {
    let note = if arm.note.is_empty() { String::new() } else { format!("note: {}\n", arm.note) };
    format!(
        "source: {}\n{note}check: `stereocal robot show` at a few angles against the pendant, before anything is measured\n",
        arm.source
    )
}

/// The chain joint by joint.
pub fn chain(robot: &Robot) -> String {
    let mut text = format!("{}: {} joints\n", robot.name, robot.joints.len());
    let mut table = Table::new(["joint", "alpha deg", "a mm", "beta deg", "theta deg", "d mm", "range deg"]);
    let number = |v: f64| table::number(Some(v), 4);
    for (i, j) in robot.joints.iter().enumerate() {
        let range = j.limits_rad.map_or("any".to_owned(), |(low, high)| match j.slides {
            true => format!("{low:.1} to {high:.1} mm"),
            false => format!("{:.1} to {:.1}", low.to_degrees(), high.to_degrees()),
        });
        let [alpha, beta, theta] = [j.alpha_rad, j.beta_rad, j.theta_rad].map(|a| number(a.to_degrees()));
        table.row([format!("{}", i + 1), alpha, number(j.a_mm), beta, theta, number(j.d_mm), range]);
    }
    let _ = write!(text, "{table}");
    for (i, j) in robot.joints.iter().enumerate() {
        let _ = writeln!(text, "joint {}: {}", i + 1, sentence(i, j));
    }
    corrections(robot).iter().for_each(|line| _ = writeln!(text, "{line}"));
    let constant = |what: &str, t: &Transform| {
        let place = t.translation.vector;
        let turn = rotation_vector(t) * 1.0f64.to_degrees();
        format!("{what}: ({:.4}, {:.4}, {:.4}) mm, turned by {:.4} deg\n", place.x, place.y, place.z, turn.norm())
    };
    if robot.ends.root_from_frame0 != Transform::identity() {
        text += &constant("base (frame 0 in the root frame)", &robot.ends.root_from_frame0);
    }
    if robot.ends.last_frame_from_flange != Transform::identity() {
        text += &constant("flange (in the last joint's frame)", &robot.ends.last_frame_from_flange);
    }
    text
}

/// What the joints do beyond the commanded angle, a line a term.
fn corrections(robot: &Robot) -> Vec<String> {
    let (terms, number) = (&robot.corrections, |v: f64| format!("{:.4}", 1000.0 * v + 0.0));
    let at = |point: LoadPoint| match point {
        LoadPoint::Origin(joint) => format!("joint {}", joint + 1),
        LoadPoint::Tool => "the target".to_owned(),
    };
    let sag = terms.gravity.iter().map(|t| {
        let (joint, k, at) = (t.joint + 1, number(t.k_rad_per_m), at(t.point));
        format!("sag: joint {joint} turns {k} mrad a metre of lever of a weight at {at}")
    });
    let bending = terms.bending.iter().map(|t| {
        let (joint, k, at) = (t.joint + 1, number(t.k_rad_per_m), at(t.point));
        format!("bending: across its axis joint {joint} yields {k} mrad a metre of lever of a weight at {at}")
    });
    let wave = |wave: Wave| match wave {
        Wave::Sin => "sin q",
        Wave::Cos => "cos q",
        Wave::Sin2 => "sin 2q",
        Wave::Cos2 => "cos 2q",
    };
    let harmonics = terms.harmonics.iter().map(|t| {
        let (amplitude, wave, joint) = (number(t.amplitude_rad), wave(t.wave), t.joint + 1);
        format!("harmonic: {amplitude} mrad {wave} is added to joint {joint}'s reading")
    });
    let wobble = terms.wobble.iter().map(|t| {
        format!("wobble: the axis of joint {} tilts by {} mrad {}", t.joint + 1, number(t.amplitude_rad), wave(t.wave))
    });
    let couplings = terms.couplings.iter().map(|c| {
        format!("coupling: {} times joint {}'s reading is added to joint {}'s", c.ratio, c.of + 1, c.joint + 1)
    });
    sag.chain(bending).chain(harmonics).chain(wobble).chain(couplings).collect()
}

fn sentence(index: usize, joint: &Joint) -> String {
    let alpha = joint.alpha_rad;
    let before = if index == 0 { "the base's z".to_owned() } else { format!("axis {index}") };
    let lean = match (alpha.sin().abs() < NO_ANGLE_RAD && joint.beta_rad.abs() < NO_ANGLE_RAD, alpha.cos() > 0.0) {
        (true, true) => format!("parallel to {before}"),
        (true, false) => format!("opposite to {before}"),
        (false, _) => {
            let angle = (alpha.cos() * joint.beta_rad.cos()).clamp(-1.0, 1.0).acos().to_degrees();
            let square = (angle - 90.0).abs() < 1e-6;
            if square { format!("square to {before}") } else { format!("{angle:.3} deg from {before}") }
        }
    };
    let (a_mm, d_mm) = (joint.a_mm.abs(), joint.d_mm);
    let offset = if a_mm > NO_LENGTH_MM { format!(", {a_mm:.3} mm off it") } else { String::new() };
    let starts = || format!("; the next part starts {d_mm:.3} mm along it");
    let along = if d_mm.abs() > NO_LENGTH_MM { starts() } else { String::new() };
    let kind = if joint.slides { "slides along an axis" } else { "turns about an axis" };
    let sign = if joint.sign < 0.0 { ", counted against it" } else { "" };
    format!("{kind} {lean}{offset}{sign}{along}")
}

/// Where the flange and the target point are at joint angles in degrees.
pub fn pose(robot: &Robot, joints_deg: &[f64]) -> String {
    let reading = |(joint, value): (&Joint, &f64)| if joint.slides { *value } else { value.to_radians() };
    let joints: Vec<f64> = robot.joints.iter().zip(joints_deg).map(reading).collect();
    let flange = robot.root_from_flange(&joints);
    let tool = robot.ends.root_from_frame0 * robot.base_from_flange(&joints) * nalgebra::Point3::from(robot.tool_mm);
    let angles: Vec<String> = joints_deg.iter().map(|d| format!("{d}")).collect();
    let mut text =
        format!("at joint readings {} (deg; mm where a joint slides), in the root frame:\n", angles.join(", "));
    let place = |v: Vector3<f64>| {
        let [x, y, z] = [v.x, v.y, v.z].map(|mm| table::number(Some(mm), 4));
        format!("x {x}  y {y}  z {z} mm")
    };
    let _ = writeln!(text, "flange   {}", place(flange.translation.vector));
    let r = rotation_vector(&flange);
    let _ = writeln!(text, "  rotation vector      rx {:.6}  ry {:.6}  rz {:.6} rad", r.x + 0.0, r.y + 0.0, r.z + 0.0);
    let [roll, pitch, yaw] = roll_pitch_yaw(&flange.rotation).map(|a| a.to_degrees() + 0.0);
    let _ = writeln!(
        text,
        "  about fixed x, y, z  {roll:.4}, {pitch:.4}, {yaw:.4} deg (KUKA: A {yaw:.4}, B {pitch:.4}, C {roll:.4})"
    );
    let q = flange.rotation.quaternion();
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    let (w, [x, y, z]) = (sign * q.w, [q.i, q.j, q.k].map(|v| sign * v + 0.0));
    let _ = writeln!(text, "  quaternion           w {w:.6}  x {x:.6}  y {y:.6}  z {z:.6}");
    let _ = writeln!(text, "target   {}", place(tool.coords));
    for (i, (joint, q)) in robot.joints.iter().zip(&joints).enumerate() {
        if joint.limits_rad.is_some_and(|(low, high)| *q < low || *q > high) {
            let _ = writeln!(text, "joint {} is outside of its range", i + 1);
        }
    }
    text
}
