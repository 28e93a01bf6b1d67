//! Whether the parameters that were found are those of a built robot.

use crate::identify::finding::Finding;
use crate::identify::model::base::sum_name;
use crate::identify::run::Identification;
use crate::robot::{Parameter, Robot, Unit};

/// Links that are farther from the file's than they are built.
pub fn of_another_robot(found: &Identification) -> Option<Finding> {
    let far = far(found, &link_limit, FAR_SIGMAS)?;
    Some(Finding::new(
        format!(
            "the links found are far from the nominal ones ({far}), farther than robots are built: the robot file may be of another robot"
        ),
        "check that the robot file is the right one",
    ))
}

/// Whether no link is farther from the file's than robots are built, be it known well or badly.
pub fn are_of_the_file(found: &Identification) -> bool {
    far(found, &link_limit, 0.0).is_none()
}

/// Terms that are larger than those of built robots.
pub fn of_terms(found: &Identification) -> Option<Finding> {
    let far = far(found, &term_limit, FAR_SIGMAS)?;
    Some(Finding::new(
        format!(
            "terms found are implausibly large for gears, bearings and encoders ({far}): they may compensate another error, such as wrong \
             joints or conventions"
        ),
        "the robot that was found holds where it was measured only, until the reason is known",
    ))
}

/// Coefficients below this share no correction that matters.
const NEGLIGIBLE: f64 = 0.02;

/// How many standard deviations a correction must have to be far from nominal.
const FAR_SIGMAS: f64 = 5.0;

/// The correction, mm or mrad, beyond which a link is not the one of the robot's file.
fn link_limit(parameter: Parameter) -> Option<f64> {
    match parameter {
        Parameter::A(_) | Parameter::D(_) => Some(10.0),
        Parameter::Alpha(_) | Parameter::Theta(_) => Some(60.0),
        _ => None,
    }
}

/// The links of two robots of the same joints that are farther apart than those of one robot are built, and joints that are counted the other way
/// round, for a sentence.
pub fn links_apart(nominal: &Robot, other: &Robot) -> Option<String> {
    const WHOLE_TURN: f64 = 1000.0 * std::f64::consts::TAU;
    let apart = |parameter: Parameter| {
        let mut off = other.value(parameter) - nominal.value(parameter);
        if parameter.unit() == Unit::Mrad {
            off -= WHOLE_TURN * (off / WHOLE_TURN).round();
        }
        let (unit, factor) = parameter.file_unit();
        (off.abs() > link_limit(parameter)?).then(|| format!("{} {:+.1} {unit}", parameter.name(), factor * off))
    };
    let mut list: Vec<String> = nominal.mdh_parameters().into_iter().filter_map(apart).collect();
    let joints = nominal.joints.iter().zip(&other.joints).enumerate();
    let turned = joints.filter(|(_, (a, b))| a.sign != b.sign);
    list.extend(turned.map(|(j, _)| format!("joint {} is counted the other way round", j + 1)));
    (!list.is_empty()).then(|| list.join(", "))
}

/// The size beyond which a term is no gear's, bearing's or encoder's any more: mrad, mrad a metre of lever, or thousandths. Those of the
/// real robots of the README's table are less than a third of this.
fn term_limit(parameter: Parameter) -> Option<f64> {
    match parameter {
        Parameter::Harmonic(..) | Parameter::Wobble(..) | Parameter::Coupling(..) => Some(10.0),
        Parameter::Gravity(..) | Parameter::Bending(..) => Some(50.0),
        _ => None,
    }
}

/// The determined parameters whose correction is beyond its limit, and is so many standard deviations, for a sentence.
fn far(found: &Identification, limit: &dyn Fn(Parameter) -> Option<f64>, sigmas: f64) -> Option<String> {
    let formulation = found.formulation()?;
    let (covariance, nominal) = (formulation.robot_covariance(), &formulation.rows.kinematics.nominal);
    let parameters = formulation.parameters();
    let moved = |p: Parameter| found.robot().value(p) - nominal.value(p);
    let base = &formulation.base;
    // What poses determine of a link is the sum of it and what acts like it; terms are nothing else's.
    let sum = |row: usize| {
        let is_link = link_limit(parameters[base.free[row]]).is_some();
        base.sum(row, if is_link { NEGLIGIBLE } else { f64::INFINITY })
    };
    let is_far = |sum: &Vec<(usize, f64)>| {
        let of = |f: &dyn Fn(usize) -> f64| sum.iter().map(|&(i, c)| c * f(i)).sum::<f64>();
        // Each may be off by its limit, and they are off independently; a sum with the tool's place in it is the tool's.
        let limits: Option<Vec<f64>> = sum.iter().map(|&(i, c)| Some(c * limit(parameters[i])?)).collect();
        let variance = of(&|i| of(&|j| covariance[(i, j)]));
        let size = of(&|i| moved(parameters[i])).abs();
        limits.is_some_and(|limits| size > limits.iter().map(|l| l * l).sum::<f64>().sqrt())
            && size > sigmas * variance.max(0.0).sqrt()
    };
    let names: Vec<String> = parameters.iter().map(|p| p.name()).collect();
    let name = |sum: Vec<(usize, f64)>| {
        let (unit, factor) = parameters[sum[0].0].file_unit();
        let amount = factor * sum.iter().map(|&(i, c)| c * moved(parameters[i])).sum::<f64>();
        format!("{} {amount:+.1} {unit}", sum_name(&sum, &names))
    };
    let list: Vec<String> = (0..base.free.len()).map(sum).filter(is_far).map(name).collect();
    (!list.is_empty()).then(|| list.join(", "))
}
