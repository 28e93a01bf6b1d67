//! Whether the parameters that were found are those of a built robot.

use rayon::prelude::*;

use crate::difference::TOLD_APART;
use crate::identify::data::dataset::Dataset;
use crate::identify::examine::in_hand::{FEWEST, most_points};
use crate::identify::examine::misfit::{ALIKE, EXPLAINS};
use crate::identify::finding::Finding;
use crate::identify::model::base::NEGLIGIBLE;
use crate::identify::run::Identification;
use crate::robot::catalogue::{self, ARMS, Arm};
use crate::robot::tool_fit::Start;
use crate::robot::{Parameter, Robot, Unit};
use crate::statistics::median;

/// Links that are farther from the file's than they are built.
pub fn of_another_robot(found: &Identification) -> Option<Finding> {
    let far = far(found, &link_limit, FAR_SIGMAS, 0.0)?;
    Some(Finding::new(
        format!(
            "the links found are far from the nominal ones ({far}), farther than robots are built: the robot file may be of another robot"
        ),
        "check that the robot file is the right one",
    ))
}

/// Arms of the catalogue that the points are near, the nearest first, where they are far from the file's robot: the
/// sensor and the tool anywhere, middle errors in mm.
pub fn of_catalogue(set: &Dataset, nominal: &Robot) -> Vec<(&'static str, f64)> {
    let (joints, points) = most_points(set);
    let fitted_mm = |robot: &Robot| Some(robot.fit_tool(&joints, &points, Start::Around)?.left_mm);
    let Some(now_mm) = fitted_mm(nominal).filter(|_| points.len() >= FEWEST) else { return Vec::new() };
    let slides = |robot: &Robot| robot.joints.iter().map(|joint| joint.slides).collect::<Vec<bool>>();
    let left_mm = |arm: &Arm| {
        let robot = catalogue::robot(arm.name).filter(|robot| slides(robot) == slides(nominal))?;
        Some((arm.name, fitted_mm(&robot)?))
    };
    let mut arms: Vec<(&str, f64)> = ARMS.par_iter().filter_map(left_mm).collect();
    arms.sort_by(|a, b| a.1.total_cmp(&b.1));
    let least_mm = arms.first().map_or(f64::INFINITY, |arm| arm.1);
    // A built robot is off by no more than its links are, which another one is by times as much.
    let is_near = least_mm < NOBODYS_MM && EXPLAINS * least_mm < now_mm;
    arms.into_iter().filter(|arm| is_near && arm.1 < ALIKE * least_mm).collect()
}

/// Whether no link is farther from the file's than robots are built, be it known well or badly.
pub fn are_of_the_file(found: &Identification) -> bool {
    far(found, &link_limit, 0.0, 0.0).is_none()
}

/// Whether no link is farther off than robots are built once all of the file's are longer by this share.
pub fn is_explained_by(share: f64, found: &Identification) -> bool {
    far(found, &link_limit, FAR_SIGMAS, share).is_none()
}

/// Links that are farther from the file's than makers build them, though no other robot's: many times what the other
/// lengths are off by, or more than any maker's.
pub fn of_links(found: &Identification) -> Option<Finding> {
    let each = sums(found, &|parameter| is_length(parameter).then_some(1.0), 0.0);
    let usual_mm = median(each.iter().map(|sum| sum.amount.abs() / sum.limit))?;
    let length_mm = (MANY * usual_mm).clamp(COARSE_MM, NOBODYS_MM);
    let limit = |parameter: Parameter| match parameter {
        _ if is_length(parameter) => Some(length_mm),
        Parameter::Alpha(_) => Some(COARSE_MRAD),
        _ => link_limit(parameter),
    };
    let far = far(found, &limit, FAR_SIGMAS, 0.0)?;
    Some(Finding::new(
        format!(
            "links are found farther from the robot file's than makers build them ({far}; half of the lengths are within {usual_mm:.1} mm)"
        ),
        "compare the robot file with the pendant or the data sheet (theta_i and d_i are of its i-th [[joint]], alpha_i and a_i of the one after): where \
         the controller has what was found, mend the file and identify again, for targets that are compensated from a wrong file become worse",
    ))
}

/// Lengths of links that are off the file's by more than makers build them, all together, though none is known well
/// enough to be named: readings of little that varies, as of one wire, fit the links of many robots.
pub fn of_all_lengths(found: &Identification) -> Option<Finding> {
    let formulation = found.formulation().filter(|formulation| formulation.scale_seen)?;
    let odds = formulation.odds_of_lengths_beyond(COARSE_MM);
    (formulation.tolerance.lengths_mm > NOBODYS_MM && odds > TOLD_APART).then(|| {
        Finding::new(
            format!(
                "the lengths of the links come out farther from the robot file's than makers build them, by {} mm as a rule, though none is known well",
                formulation.tolerance.lengths_mm
            ),
            "the robot file may be of another robot, or a column, a sign or a unit of the table wrong: compare both, and do not correct targets with \
             the robot that was found until then",
        )
    })
}

fn is_length(parameter: Parameter) -> bool {
    matches!(parameter, Parameter::A(_) | Parameter::D(_))
}

/// Terms that are larger than those of built robots.
pub fn of_terms(found: &Identification) -> Option<Finding> {
    let far = far(found, &term_limit, FAR_SIGMAS, 0.0)?;
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

/// Times the median of what the lengths are off by beyond which one is not as the others: of a normal distribution five
/// standard deviations.
const MANY: f64 = 7.4;

/// What the coarsest common tolerance of workshops allows of lengths of one to two metres (ISO 2768-c), and what none
/// does, mm; of real robots the largest length that is known well is 0.7 mm off. A twist of real ones is up to 12 mrad
/// off.
const COARSE_MM: f64 = 3.0;
const NOBODYS_MM: f64 = 5.0;
const COARSE_MRAD: f64 = 30.0;

/// The correction, mm or mrad, beyond which a link is not the one of the robot's file.
fn link_limit(parameter: Parameter) -> Option<f64> {
    match parameter {
        Parameter::A(_) | Parameter::D(_) => Some(10.0),
        Parameter::Alpha(_) | Parameter::Theta(_) => Some(60.0),
        _ => None,
    }
}

/// The links of two robots of the same joints that are farther apart than those of one robot are built, and joints that
/// are counted the other way round, for a sentence.
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

/// The size beyond which a term is no gear's, bearing's or encoder's any more: mrad, mrad a metre of lever, or
/// thousandths. Those of the real robots of the README's table are less than a third of this. Gears have whole ratios:
/// what a joint turns too far by is a bent or eccentric one's, and in no range as much as half a per cent.
fn term_limit(parameter: Parameter) -> Option<f64> {
    match parameter {
        Parameter::Harmonic(..) | Parameter::Wobble(..) => Some(10.0),
        Parameter::Coupling(..) => Some(5.0),
        Parameter::Gravity(..) | Parameter::Bending(..) => Some(50.0),
        _ => None,
    }
}

/// The determined parameters whose correction is beyond its limit, and is so many standard deviations, for a sentence.
/// Of lengths it is the correction of the file's longer by this share.
fn far(found: &Identification, limit: &dyn Fn(Parameter) -> Option<f64>, sigmas: f64, share: f64) -> Option<String> {
    let is_far = |sum: &Sum| sum.amount.abs() > sum.limit && sum.amount.abs() > sigmas * sum.sigma;
    let list: Vec<String> = sums(found, limit, share).into_iter().filter(is_far).map(|sum| sum.said).collect();
    (!list.is_empty()).then(|| list.join(", "))
}

/// What poses determine: a parameter's correction, or one of several that act alike.
struct Sum {
    /// Its name with the amount in the file's unit.
    said: String,
    /// mm or mrad, with the standard deviation, and the size beyond which it is far.
    amount: f64,
    sigma: f64,
    limit: f64,
}

/// Those of which each part has a limit: a sum with the tool's place in it is the tool's.
fn sums(found: &Identification, limit: &dyn Fn(Parameter) -> Option<f64>, share: f64) -> Vec<Sum> {
    let Some(formulation) = found.formulation() else { return Vec::new() };
    let (covariance, nominal) = (formulation.robot_covariance(), &formulation.rows.kinematics.nominal);
    let (parameters, base) = (formulation.parameters(), &formulation.base);
    let moved = |i: usize| {
        let scale = if is_length(parameters[i]) { 1.0 + share } else { 1.0 };
        found.robot().value(parameters[i]) - scale * nominal.value(parameters[i])
    };
    // What poses determine of a link is the sum of it and what acts like it; terms are nothing else's.
    let sum = |row: usize| {
        let is_link = link_limit(parameters[base.free[row]]).is_some();
        let least = if is_link { NEGLIGIBLE } else { f64::INFINITY };
        let parts = base.sum(row, least);
        let of = |f: &dyn Fn(usize) -> f64| parts.iter().map(|&(i, c)| c * f(i)).sum::<f64>();
        // Each may be off by its limit, and they are off independently.
        let limits = parts.iter().map(|&(i, c)| Some((c * limit(parameters[i])?).powi(2)));
        let limit = limits.sum::<Option<f64>>()?.sqrt();
        let (amount, variance) = (of(&moved), of(&|i| of(&|j| covariance[(i, j)])));
        let said = base.said(row, least, parameters, amount);
        Some(Sum { said, amount, sigma: variance.max(0.0).sqrt(), limit })
    };
    (0..base.free.len()).filter_map(sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::examine::sessions::Along;
    use crate::identify::record::{Findings, Record};
    use crate::identify::synthetic::{self, identified, planned, settings, to_first};
    use crate::measurements::Role;
    use crate::robot::Advice;

    /// What is said of a robot whose parameter is off by so much more than it is built to, mm or mrad.
    fn judged(parameter: Parameter, by: f64) -> Record {
        let world = planned(60, 30, 25.0, 0.02, 5, &|robot| robot.add(parameter, by));
        let (set, found) = world.identified(&world.rows);
        let along = Along::default();
        let findings = Findings::new(Vec::new(), (Vec::new(), None), Vec::new(), &along, &set, &found);
        Record::new(&set, &world.nominal, &found, &along, findings, &settings(), 1)
    }

    #[test]
    fn a_length_of_the_file_that_nobody_builds_so_is_named_with_its_amount() {
        // Lengths of up to a millimetre, as built, are nobody's mistake; a tool is the user's.
        for (parameter, by) in [(Parameter::A(2), 0.0), (Parameter::A(2), 1.0), (Parameter::V(2), 9.0)] {
            let record = judged(parameter, by);
            assert_eq!((record.advice, record.is_beyond), (Advice::Use, false), "{by}: {:?}", record.warnings);
        }
        for (parameter, by, named) in [(Parameter::A(2), -8.0, "a_2 -"), (Parameter::D(3), 6.0, "d_4 +6.")] {
            let record = judged(parameter, by);
            assert_eq!((record.advice, record.is_beyond), (Advice::Check, true), "{by}: {:?}", record.warnings);
            assert!(record.reason.contains(named), "{}", record.reason);
        }
        // Farther, and it is another robot's, not that of readings of another scale.
        for parameter in [Parameter::A(2), Parameter::D(4)] {
            let record = judged(parameter, 20.0);
            assert_eq!(record.advice, Advice::DoNotUse, "{:?}", record.warnings);
            assert!(record.reason.contains("another robot"), "{}", record.reason);
            assert!(!record.warnings.iter().any(|said| said.contains("all links")), "{:?}", record.warnings);
        }
    }

    /// Whether all lengths are said to be off, by distances to one point with noise of 0.3 mm, of poses of nearly one
    /// orientation, where every length of the truth is off the file's by so much, one longer and the next shorter.
    fn all_are_off(by_mm: f64) -> bool {
        let signs = [1.0, -1.0].into_iter().cycle();
        let lengths = (2..7).flat_map(|joint| [Parameter::A(joint), Parameter::D(joint)]).zip(signs);
        let off: Vec<(Parameter, f64)> = lengths.map(|(length, sign)| (length, sign * by_mm)).collect();
        let world = planned(60, 8, 2.0, 0.0, 6, &|robot| off.iter().for_each(|&(length, by)| robot.add(length, by)));
        let noise = |i: usize| 0.3 * (1.7 * i as f64).sin() * 2f64.sqrt();
        let set = to_first(&world, |i, place, from| (place - from).norm() + noise(i));
        of_all_lengths(&identified(&set, &world.nominal)).is_some()
    }

    #[test]
    fn lengths_that_are_all_off_are_told_whether_one_is_known_or_not() {
        assert!([-0.5, 0.0, 0.5, 1.0].into_iter().all(|by_mm| !all_are_off(by_mm)));
        assert!([-40.0, -20.0, 20.0, 40.0].into_iter().all(all_are_off));
    }

    /// What the catalogue says of points of one arm beside the file of another.
    #[test]
    fn an_arm_of_the_catalogue_is_named_where_the_points_are_its_and_not_the_files() {
        let (paper, ur5e, irb) =
            (Robot::paper(), catalogue::robot("ur5e").unwrap(), catalogue::robot("abb-irb120").unwrap());
        let said = |of: &Robot, by: &Robot| {
            let mut real = of.clone();
            real.tool_mm = nalgebra::Vector3::new(20.0, -40.0, 90.0);
            real.joints.iter_mut().for_each(|joint| joint.a_mm += 0.3);
            let row = |k: usize| {
                let joints_rad = crate::robot::inverse::spread_start(of, k);
                let joints_deg = joints_rad.iter().map(|angle| angle.to_degrees()).collect();
                let seen = synthetic::seen_at(real.target_mm(&joints_rad));
                synthetic::row(k.to_string(), "one", Role::Sample, joints_deg, seen)
            };
            let set = Dataset::new(&(0..40).map(row).collect::<Vec<_>>()).unwrap();
            of_catalogue(&set, by).into_iter().map(|(name, _)| name).collect::<Vec<_>>()
        };
        assert_eq!(said(&irb, &ur5e), ["abb-irb120"]);
        assert_eq!(said(&ur5e, &irb), ["ur5e"]);
        assert_eq!(said(&irb, &irb), [""; 0]);
        assert_eq!(said(&paper, &irb), [""; 0], "an arm that is not in the catalogue");
    }

    #[test]
    fn a_joint_that_turns_a_per_cent_too_far_is_no_gears() {
        for (by, is_named) in [(2.0, false), (10.0, true), (-10.0, true)] {
            let record = judged(Parameter::Coupling(3, 3), by);
            assert_eq!(record.reason.contains("scale_4"), is_named, "{by}: {:?}", record.warnings);
            assert_eq!(record.advice == Advice::Check, is_named, "{by}: {:?}", record.warnings);
        }
    }
}
