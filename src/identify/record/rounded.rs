//! Numbers that were rounded: what the printed digits alone scatter points by.
//!
//! In: joints and points as they were printed, and what the fit leaves. Out: joint angles so coarse that they account
//! for what is left; and points that agree with the chain of links as closely as the digits go, so that nothing is left
//! for an instrument or for how well an arm comes back. Method: a step of rounding, one for each power of ten where the
//! same number of digits was written of all, has the variance of a uniform error, that of each joint through its lever;
//! the fit's chi-squared against it. Goes wrong: a display that cuts digits off scatters no more, but shifts; averages
//! of several readings stand on no step.

use std::collections::BTreeMap;

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::identify::data::dataset::{Dataset, Kind};
use crate::identify::finding::Finding;
use crate::identify::record::file::Smooth;
use crate::identify::run::Identification;
use crate::identify::sensor::REPEATABILITY_MM;

/// Steps that numbers are rounded to, deg and mm, coarse ones first.
const STEPS: [f64; 9] = [1.0, 0.5, 0.1, 0.05, 0.01, 0.005, 1e-3, 1e-4, 1e-5];

/// Steps of angles, deg, that a joint's display need not be so coarse as.
const COARSE_DEG: f64 = 0.05;

/// Numbers of one size that tell on which step they stand: by chance one in five stands on one five times as coarse.
const FEWEST: usize = 8;

/// Readings within this of a multiple of a step are one, in steps.
const ON_STEP: f64 = 1e-5;

/// Share of the scatter that rounding must account for, and times it that it may be: angles that were commanded as
/// whole numbers scatter by far less.
const EXPLAINS: f64 = 0.5;
const MOST: f64 = 1.25;

/// A turn by which the way of the point is seen, rad.
const SMALL_RAD: f64 = 1e-6;

/// Chance that a fit which leaves rounding alone seems to leave more, or less; and that what is beyond rounding is more
/// than is allowed for.
const CHANCE: f64 = 1e-3;
const BEYOND: f64 = 0.05;

/// Rounded angles where they account for what the fit leaves.
pub fn of_joints(set: &Dataset, found: &Identification) -> Option<Finding> {
    let steps = joints_deg(set).filter(|_| set.kind == Kind::Positions)?;
    let step_deg = steps.only().filter(|step| *step >= COARSE_DEG)?;
    let (alone_mm, left_mm) = (of_joints_mm(set, found, &steps), found.scatter.point_mm);
    (alone_mm > EXPLAINS * left_mm && alone_mm < MOST * left_mm).then(|| {
        Finding::new(
            format!(
                "the joint angles are rounded to {step_deg} deg: that alone scatters points by {alone_mm:.2} mm a coordinate, and the fit leaves \
                 {left_mm:.2} mm"
            ),
            "write them with three digits behind the point or more",
        )
    })
}

/// Points that agree with the robot as closely as the digits of joints and points go. Joints may be rounded, or be
/// commanded to whole steps. An instrument that states covariances has measured.
pub fn as_closely_as_digits(set: &Dataset, found: &Identification) -> Option<String> {
    let is_stated = set.poses.iter().any(|pose| pose.reading.variance_mm2().is_some());
    if set.kind != Kind::Positions || is_stated {
        return None;
    }
    let left_mm = found.scatter.point_mm.hypot(Smooth::new(found).map_or(0.0, |smooth| smooth.left_mm));
    let (joints, points) = (joints_deg(set), Steps::of(&coordinates_mm(set), "mm", 1.0));
    let of_points_mm = points.as_ref().map_or(0.0, |steps| of_coordinates_mm(set, steps));
    let of_both_mm = of_points_mm.hypot(joints.as_ref().map_or(0.0, |steps| of_joints_mm(set, found, steps)));
    // What rounds a joint moves the three coordinates of its row at once: a row counts as one number.
    let (formulation, _) = found.candidates.iter().find_map(|candidate| candidate.found.as_ref())?;
    let unknowns = formulation.base.rank() + 6 * set.groups.len();
    let freedom = (3 * found.fitted.len()).checked_sub(unknowns).filter(|free| *free >= 3)? as f64 / 3.0;
    let law = ChiSquared::new(freedom).ok()?;
    let explains = |alone_mm: &f64| {
        let chance = law.cdf(freedom * (left_mm / alone_mm).powi(2));
        *alone_mm > 0.0 && chance > CHANCE && chance < 1.0 - CHANCE
    };
    let alone_mm = [of_both_mm, of_points_mm].into_iter().find(explains)?;
    let most_mm2 = left_mm.powi(2) * freedom / law.inverse_cdf(BEYOND) - alone_mm.powi(2);
    let is_fine = most_mm2.max(0.0).sqrt() < REPEATABILITY_MM;
    let joints = joints.filter(|_| alone_mm > of_points_mm);
    let steps: Vec<String> = [joints, points].into_iter().flatten().map(|steps| steps.words()).collect();
    let told = match is_fine {
        true => {
            ", with nothing left for an instrument or an arm's repeatability: they were computed, by the robot's controller or in a simulation, and not \
             measured; only points that were measured show how a robot was built"
        }
        false => ": they were computed, or have too few digits to show what was measured; write more of them",
    };
    (is_fine || of_joints(set, found).is_none()).then(|| {
        format!(
            "the points agree with the robot's own model as closely as their digits go ({}: that alone scatters a coordinate by {alone_mm:.4} mm, the \
             fit leaves {left_mm:.4} mm){told}",
            steps.join(" and ")
        )
    })
}

/// The steps that numbers stand on: one, or one for each power of ten where the same number of digits was written of
/// all.
#[derive(Debug, PartialEq)]
struct Steps {
    /// By the power of ten of numbers, in `unit`.
    of_powers: BTreeMap<i32, f64>,
    unit: &'static str,
    /// A unit in degrees or millimetres.
    factor: f64,
}

impl Steps {
    /// Of numbers in degrees or millimetres; `None` where many of a size stand on no step.
    fn of(numbers: &[f64], unit: &'static str, factor: f64) -> Option<Steps> {
        let mut powers: BTreeMap<i32, Vec<f64>> = BTreeMap::new();
        let written = numbers.iter().map(|n| n / factor);
        written.filter(|n| *n != 0.0).for_each(|n| powers.entry(power(n)).or_default().push(n));
        let many = powers.iter().filter(|(_, of_power)| of_power.len() >= FEWEST);
        let of_powers: Option<BTreeMap<i32, f64>> =
            many.map(|(power, of_power)| Some((*power, step(of_power)?))).collect();
        let of_powers = match of_powers? {
            none if none.is_empty() => {
                BTreeMap::from([(0, step(&powers.into_values().flatten().collect::<Vec<f64>>())?)])
            }
            some => some,
        };
        Some(Steps { of_powers, unit, factor })
    }

    fn finest(&self) -> f64 {
        self.of_powers.values().copied().fold(f64::INFINITY, f64::min)
    }

    fn coarsest(&self) -> f64 {
        self.of_powers.values().copied().fold(0.0, f64::max)
    }

    /// The one step that all stand on, in degrees or millimetres.
    fn only(&self) -> Option<f64> {
        (self.finest() == self.coarsest()).then(|| self.finest() * self.factor)
    }

    /// The variance of a number that is rounded so, in degrees or millimetres: that of a uniform error. Sizes of which
    /// there are few are written as finely as any.
    fn variance(&self, number: f64) -> f64 {
        let step = self.of_powers.get(&power(number / self.factor)).copied().unwrap_or(self.finest());
        (step * self.factor).powi(2) / 12.0
    }

    fn words(&self) -> String {
        match self.only() {
            Some(_) => format!("{} {}", self.finest(), self.unit),
            None => format!("{} to {} {}", self.finest(), self.coarsest(), self.unit),
        }
    }
}

fn power(number: f64) -> i32 {
    number.abs().log10().floor() as i32
}

/// The steps that all angles stand on.
fn joints_deg(set: &Dataset) -> Option<Steps> {
    let turning = (0..set.joint_count()).filter(|&joint| !set.is_sliding(joint));
    let of_joint = |joint: usize| set.poses.iter().map(move |pose| pose.joints_rad[joint].to_degrees());
    let angles: Vec<f64> = turning.flat_map(of_joint).collect();
    Steps::of(&angles, "deg", 1.0).or_else(|| Steps::of(&angles, "rad", 1f64.to_degrees()))
}

fn coordinates_mm(set: &Dataset) -> Vec<f64> {
    let points = set.poses.iter().filter_map(|pose| pose.reading.point_mm());
    points.flat_map(|point| <[f64; 3]>::from(point.coords)).collect()
}

fn step(numbers: &[f64]) -> Option<f64> {
    let on = |step: &f64| numbers.iter().all(|n| ((n / step).round() - n / step).abs() < ON_STEP);
    STEPS.into_iter().find(on).filter(|_| !numbers.is_empty())
}

/// What coordinates rounded to these steps scatter by, mm.
fn of_coordinates_mm(set: &Dataset, steps: &Steps) -> f64 {
    let variances: Vec<f64> = coordinates_mm(set).into_iter().map(|x| steps.variance(x)).collect();
    (variances.iter().sum::<f64>() / variances.len().max(1) as f64).sqrt()
}

/// What angles rounded to these steps alone scatter a coordinate by, mm.
fn of_joints_mm(set: &Dataset, found: &Identification, steps: &Steps) -> f64 {
    let robot = found.robot();
    let of_row = |&row: &usize| {
        let q = &set.poses[row].joints_rad;
        let at = robot.target_mm(q);
        let square = |joint: usize| {
            let mut turned = q.clone();
            turned[joint] += SMALL_RAD;
            let lever_mm = (robot.target_mm(&turned) - at).norm() / SMALL_RAD;
            lever_mm.powi(2) * steps.variance(q[joint].to_degrees())
        };
        (0..q.len()).filter(|&joint| !set.is_sliding(joint)).map(square).sum::<f64>()
    };
    let squares = found.fitted.iter().map(of_row).sum::<f64>() / found.fitted.len().max(1) as f64;
    // Over three coordinates.
    1f64.to_radians() * (squares / 3.0).sqrt()
}

#[cfg(test)]
mod tests;
