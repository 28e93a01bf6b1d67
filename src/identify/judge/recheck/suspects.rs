//! What may have changed on a robot, as columns of the offsets of its parameters.

use crate::robot::{Parameter, Robot};

/// One thing that may have changed: columns of the offsets, in units of the file.
pub(super) struct Suspect {
    pub(super) word: String,
    pub(super) words: String,
    pub(super) unit: &'static str,
    /// Index of the column, and what one unit of the file is in it.
    pub(super) columns: Vec<(usize, f64)>,
}

/// The zero of a joint.
pub(super) fn zero(robot: &Robot) -> impl Fn(usize) -> Parameter + '_ {
    |joint| if robot.joints[joint].slides { Parameter::D(joint) } else { Parameter::Theta(joint) }
}

/// The zeros of the joints, the tool along each axis, the scale of the readings, and the tool as a whole.
pub(super) fn suspects(robot: &Robot, parameters: &[Parameter]) -> Vec<Suspect> {
    let at = |p: Parameter| parameters.iter().position(|q| *q == p).unwrap_or(0);
    let of_joint = |joint: usize| {
        let parameter = zero(robot)(joint);
        let (unit, factor) = parameter.file_unit();
        let words = format!("the zero of joint {}", joint + 1);
        Suspect { word: format!("joint-{}", joint + 1), words, unit, columns: vec![(at(parameter), 1.0 / factor)] }
    };
    let tool = |axis: usize| (at(Parameter::V(axis)), 1.0);
    let of_tool = |axis: usize| {
        let name = ["x", "y", "z"][axis];
        Suspect {
            word: format!("tool-{name}"),
            words: format!("the tool along {name}"),
            unit: "mm",
            columns: vec![tool(axis)],
        }
    };
    let scale = Suspect {
        word: "scale".to_owned(),
        words: "the scale of the readings".to_owned(),
        unit: "per mille",
        // Its offset takes off what the readings have too much.
        columns: vec![(parameters.len(), -1.0)],
    };
    let whole = Suspect {
        word: "tool".to_owned(),
        words: "the tool".to_owned(),
        unit: "mm",
        columns: (0..3).map(tool).collect(),
    };
    (0..robot.joints.len()).map(of_joint).chain((0..3).map(of_tool)).chain([scale, whole]).collect()
}

impl Suspect {
    /// What changed, for a person.
    pub(super) fn by(&self, amounts: &[f64]) -> String {
        let amounts: Vec<String> = amounts.iter().map(|a| format!("{a:.4}")).collect();
        format!("{} by {} {}", self.words, amounts.join(", "), self.unit)
    }
}
