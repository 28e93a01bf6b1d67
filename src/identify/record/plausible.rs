//! Whether the parameters that were found are those of a built robot.

use crate::identify::finding::Finding;
use crate::identify::run::Identification;
use crate::robot::Parameter;

/// Links that are farther from the file's than they are built.
pub fn of_another_robot(found: &Identification) -> Option<Finding> {
    let far = far(found, &link_limit)?;
    Some(Finding::new(
        format!(
            "the links found are far from the nominal ones ({far}), farther than robots are built: the robot file may be of another robot"
        ),
        "check that the robot file is the right one",
    ))
}

/// Terms that are larger than those of built robots.
pub fn of_terms(found: &Identification) -> Option<Finding> {
    let far = far(found, &term_limit)?;
    Some(Finding::new(
        format!(
            "terms found are implausibly large for gears, bearings and encoders ({far}): they may compensate another error, such as wrong \
             joints or conventions"
        ),
        "the robot that was found holds where it was measured only, until the reason is known",
    ))
}

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

/// The size beyond which a term is no gear's, bearing's or encoder's any more: mrad, mrad a metre of lever, or thousandths. Those of the
/// real robots of the README's table are less than a third of this.
fn term_limit(parameter: Parameter) -> Option<f64> {
    match parameter {
        Parameter::Harmonic(..) | Parameter::Wobble(..) | Parameter::Coupling(..) => Some(10.0),
        Parameter::Gravity(..) | Parameter::Bending(..) => Some(50.0),
        _ => None,
    }
}

/// The determined parameters whose correction is beyond its limit, for a sentence.
fn far(found: &Identification, limit: &dyn Fn(Parameter) -> Option<f64>) -> Option<String> {
    let candidate = &found.candidates[found.chosen];
    let (formulation, _) = candidate.found.as_ref()?;
    let (covariance, nominal) = (formulation.robot_covariance(), formulation.rows.kinematics.nominal());
    let parameters = formulation.parameters();
    let moved = |p: Parameter| candidate.robot.value(p) - nominal.value(p);
    let is_far = |i: &usize| {
        let size = moved(parameters[*i]).abs();
        let sigma = covariance[(*i, *i)].max(0.0).sqrt();
        limit(parameters[*i]).is_some_and(|limit| size > limit) && size > FAR_SIGMAS * sigma
    };
    let name = |i: &usize| {
        let (unit, factor) = parameters[*i].file_unit();
        format!("{} {:+.1} {unit}", parameters[*i].name(), factor * moved(parameters[*i]))
    };
    // What a link shares with others may be theirs; terms are nothing else's.
    let shared = |i: &usize| link_limit(parameters[*i]).is_some() && formulation.base.in_group(*i);
    let list: Vec<String> = formulation.base.free.iter().filter(|i| is_far(i) && !shared(i)).map(name).collect();
    (!list.is_empty()).then(|| list.join(", "))
}
