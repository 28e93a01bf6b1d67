//! What may have changed on a robot, as columns of the offsets of its parameters.

use crate::robot::{Parameter, Robot};

/// One thing that may have changed: columns of the offsets, in units of the file.
pub(super) struct Suspect {
    pub(super) word: String,
    pub(super) words: String,
    pub(super) unit: &'static str,
    /// Index of the column, and what one unit of the file is in it.
    pub(super) columns: Vec<(usize, f64)>,
    /// Times that the variance of readings along it is larger than alike in all directions.
    pub(super) variance: f64,
}

fn suspect(word: &str, words: &str, unit: &'static str, columns: Vec<(usize, f64)>) -> Suspect {
    Suspect { word: word.to_owned(), words: words.to_owned(), unit, columns, variance: 1.0 }
}

/// The zero of a joint.
pub fn zero(robot: &Robot) -> impl Fn(usize) -> Parameter + '_ {
    |joint| if robot.joints[joint].slides { Parameter::D(joint) } else { Parameter::Theta(joint) }
}

/// The zeros of the joints, the tool along each axis, the scale of the readings, and the tool as a whole.
pub(super) fn suspects(robot: &Robot, parameters: &[Parameter]) -> Vec<Suspect> {
    let at = |p: Parameter| parameters.iter().position(|q| *q == p).unwrap_or(0);
    let of_joint = |joint: usize| {
        let parameter = zero(robot)(joint);
        let (unit, factor) = parameter.file_unit();
        let (word, words) = (format!("joint-{}", joint + 1), format!("the zero of joint {}", joint + 1));
        suspect(&word, &words, unit, vec![(at(parameter), 1.0 / factor)])
    };
    let tool = |axis: usize| (at(Parameter::V(axis)), 1.0);
    let of_tool = |axis: usize| {
        let name = ["x", "y", "z"][axis];
        suspect(&format!("tool-{name}"), &format!("the tool along {name}"), "mm", vec![tool(axis)])
    };
    // Its offset takes off what the readings have too much.
    let scale = suspect("scale", "the scale of the readings", "per mille", vec![(parameters.len(), -1.0)]);
    let whole = suspect("tool", "the tool", "mm", (0..3).map(tool).collect());
    (0..robot.joints.len()).map(of_joint).chain((0..3).map(of_tool)).chain([scale, whole]).collect()
}

impl Suspect {
    /// What changed, for a person.
    pub(super) fn by(&self, amounts: &[f64]) -> String {
        let amounts: Vec<String> = amounts.iter().map(|a| format!("{a:.4}")).collect();
        format!("{} by {} {}", self.words, amounts.join(", "), self.unit)
    }
}
