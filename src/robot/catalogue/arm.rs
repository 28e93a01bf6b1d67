//! An arm by its table of Denavit-Hartenberg parameters, classic or modified.

use nalgebra::Vector3;

use crate::geometry::{Transform, transform};
use crate::robot::corrections::{Corrections, CouplingTerm};
use crate::robot::{Ends, Joint, Robot};

/// How the rows of an arm are to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Convention {
    /// alpha and a of the link behind the joint (Denavit and Hartenberg, Paul).
    Classic,
    /// alpha and a of the link before the joint (Craig).
    Modified,
}

impl Convention {
    /// For a sentence, and as `--dh` has it.
    pub fn name(self) -> &'static str {
        if self == Convention::Classic { "classic" } else { "modified" }
    }
}

/// A row of a table: alpha (deg), a (mm), theta (deg), d (mm).
pub type Row = [f64; 4];

/// An arm with its table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arm {
    /// What `robot new` calls it.
    pub name: &'static str,
    /// Its maker's name for it.
    pub title: &'static str,
    /// Where the numbers come from.
    pub source: &'static str,
    /// What a user must know about its angles; may be empty.
    pub note: &'static str,
    /// How the rows are to be read.
    pub convention: Convention,
    /// A row a joint, and its range, deg.
    pub joints: &'static [(Row, [f64; 2])],
    /// The flange against the last frame: turns about x, y and z in this order, deg.
    pub flange_deg: [f64; 3],
    /// Joints (from 0) whose readings count from the level: the reading of the second must be added to the first.
    pub coupled: &'static [(usize, usize)],
}

impl Arm {
    pub fn robot(&self) -> Robot {
        let rows: Vec<Row> = self.joints.iter().map(|(row, _)| *row).collect();
        let mut robot = from_rows(self.title, self.convention, &rows);
        for (joint, (_, [low, high])) in robot.joints.iter_mut().zip(self.joints) {
            joint.limits_rad = Some((low.to_radians(), high.to_radians()));
        }
        let turn = |axis: Vector3<f64>, deg: f64| transform(axis * deg.to_radians(), Vector3::zeros());
        let [x, y, z] = self.flange_deg;
        if self.flange_deg != [0.0; 3] {
            let turned = turn(Vector3::x(), x) * turn(Vector3::y(), y) * turn(Vector3::z(), z);
            robot.ends.last_frame_from_flange *= turned;
        }
        let coupling = |&(joint, of): &(usize, usize)| CouplingTerm { joint, of, ratio: 1.0 };
        robot.corrections.couplings = self.coupled.iter().map(coupling).collect();
        robot
    }
}

/// The robot of a table, without limits.
pub fn from_rows(name: &str, convention: Convention, rows: &[Row]) -> Robot {
    let mut ends = Ends::default();
    let mut before = [0.0, 0.0];
    let joint = |&[alpha_deg, a_mm, theta_deg, d_mm]: &Row| {
        let [alpha, a_mm] = match convention {
            Convention::Modified => [alpha_deg, a_mm],
            Convention::Classic => std::mem::replace(&mut before, [alpha_deg, a_mm]),
        };
        let (alpha_rad, theta_rad) = (alpha.to_radians(), theta_deg.to_radians());
        Joint { alpha_rad, a_mm, theta_rad, d_mm, ..Joint::default() }
    };
    let joints = rows.iter().map(joint).collect();
    if convention == Convention::Classic && before != [0.0, 0.0] {
        let along: Transform = Transform::translation(before[1], 0.0, 0.0);
        ends.last_frame_from_flange = along * transform(Vector3::x() * before[0].to_radians(), Vector3::zeros());
    }
    let tool_mm = ends.last_frame_from_flange.translation.vector;
    Robot { name: name.to_owned(), joints, tool_mm, corrections: Corrections::default(), ends }
}
