//! What may have changed on a robot, as columns of the offsets of its parameters; and how much more than in other
//! directions readings scatter along it.
//!
//! In: the fit by which a robot was identified. Out: for each cause that is looked for later, the variance of the
//! residuals along it over what scatter alike in all directions would leave of them there. What a model lacks comes
//! through the joints, and is larger where their levers are long: a mean over poses of what the residuals of each say
//! along the cause ("sandwich": White, Econometrica 48, 1980), against what the fit left of them. Goes wrong: few
//! poses, which tell it to a quarter or so; less than alike is taken for chance.

use nalgebra::DMatrix;

use crate::identify::judge::uncertainty::{Predicted, each_placement};
use crate::identify::settings::Model;
use crate::identify::solve::formulation::Formulation;
use crate::linear_algebra::without;
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

/// Times the variance along each cause, by its word; none of fits that leave some of their columns out.
pub fn variances_along(formulation: &Formulation) -> Vec<(String, f64)> {
    let (robot, parameters) = (&formulation.rows.kinematics.nominal, formulation.parameters());
    let zeros = (0..robot.joints.len()).map(zero(robot));
    let is_whole = zeros.chain((0..3).map(Parameter::V)).all(|needed| parameters.contains(&needed));
    if !is_whole || !matches!(formulation.model, Model::Position | Model::Pose) {
        return Vec::new();
    }
    let suspects = suspects(robot, parameters);
    let length = |p: Parameter| match p {
        Parameter::A(_) | Parameter::D(_) | Parameter::V(_) => 1e-3 * robot.value(p),
        _ => 0.0,
    };
    let mut sums = vec![(0.0, 0.0); parameters.len() + 1];
    for Predicted { placement, roots, rows } in each_placement(formulation) {
        let count = parameters.len();
        let of_robot = placement.linear.jacobian.columns(0, count).into_owned();
        // A scale of the readings is one of all lengths.
        let mut columns = of_robot.clone().insert_column(count, 0.0);
        parameters.iter().enumerate().for_each(|(i, p)| {
            let longer = columns.column(count) + length(*p) * of_robot.column(i);
            columns.set_column(count, &longer);
        });
        let columns = without(&columns, &placement.linear.design);
        for (_, at) in rows {
            let own = roots.rows(at.start, at.len());
            let leverage = own * own.transpose();
            let of_row = columns.rows(at.start, at.len());
            let pulls = of_row.tr_mul(&placement.linear.residuals.rows(at.start, at.len()));
            let left = DMatrix::identity(at.len(), at.len()) - leverage;
            for (k, (square, expected)) in sums.iter_mut().enumerate() {
                *square += pulls[k].powi(2);
                *expected += (of_row.column(k).transpose() * &left * of_row.column(k))[(0, 0)];
            }
        }
    }
    let times = |at: usize| if sums[at].1 > 0.0 { sums[at].0 / sums[at].1 } else { 1.0 };
    let most = |columns: &[(usize, f64)]| columns.iter().map(|(at, _)| times(*at)).fold(1.0, f64::max);
    suspects.iter().map(|suspect| (suspect.word.clone(), most(&suspect.columns))).collect()
}
