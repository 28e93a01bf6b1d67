//! Numbers that were rounded: what the printed digits alone scatter points by.
//!
//! In: joints and points as they were printed, and what the fit leaves. Out: joint angles so coarse that they account for what is left; and points
//! that agree with the chain of links as closely as the digits go, so that nothing is left for an instrument or for how well an arm comes back.
//! Method: a step of rounding has the variance of a uniform error, that of each joint through its lever; the fit's chi-squared against it. Goes
//! wrong: a display that cuts digits off scatters no more, but shifts; averages of several readings stand on no step.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::identify::data::dataset::{Dataset, Kind};
use crate::identify::finding::Finding;
use crate::identify::judge::locate::REPEATABILITY_MM;
use crate::identify::record::file::Smooth;
use crate::identify::run::Identification;

/// Steps that numbers are rounded to, deg and mm, coarse ones first.
const STEPS: [f64; 9] = [1.0, 0.5, 0.1, 0.05, 0.01, 0.005, 1e-3, 1e-4, 1e-5];

/// Steps of angles, deg, that a joint's display need not be so coarse as.
const COARSE_DEG: f64 = 0.05;

/// Readings within this of a multiple of a step are one, in steps.
const ON_STEP: f64 = 1e-5;

/// Share of the scatter that rounding must account for, and times it that it may be: angles that were commanded as whole numbers scatter by far less.
const EXPLAINS: f64 = 0.5;
const MOST: f64 = 1.25;

/// A turn by which the way of the point is seen, rad.
const SMALL_RAD: f64 = 1e-6;

/// Chance that a fit which leaves rounding alone seems to leave more, or less; and that what is beyond rounding is more than is allowed for.
const CHANCE: f64 = 1e-3;
const BEYOND: f64 = 0.05;

/// Rounded angles where they account for what the fit leaves.
pub fn of_joints(set: &Dataset, found: &Identification) -> Option<Finding> {
    let step_deg = joints_deg(set).filter(|step| set.kind == Kind::Positions && *step >= COARSE_DEG)?;
    let (alone_mm, left_mm) = (of_step_mm(set, found, step_deg), found.scatter.point_mm);
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

/// Points that agree with the robot as closely as the digits of joints and points go. Joints may be rounded, or be commanded to whole steps. An
/// instrument that states covariances has measured.
pub fn as_closely_as_digits(set: &Dataset, found: &Identification) -> Option<String> {
    let is_stated = set.poses.iter().any(|pose| pose.reading.variance_mm2().is_some());
    if set.kind != Kind::Positions || is_stated {
        return None;
    }
    let left_mm = found.scatter.point_mm.hypot(Smooth::new(found).map_or(0.0, |smooth| smooth.left_mm));
    let (joints, points) = (joints_deg(set), points_mm(set));
    let of_points_mm = points.map_or(0.0, |step| step / 12f64.sqrt());
    let of_both_mm = of_points_mm.hypot(joints.map_or(0.0, |step| of_step_mm(set, found, step)));
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
    let digits = |step: Option<f64>, unit: &str| step.map(|step| format!("{step} {unit}"));
    let steps: Vec<String> =
        digits(joints.filter(|_| alone_mm > of_points_mm), "deg").into_iter().chain(digits(points, "mm")).collect();
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

/// The step that all angles stand on, deg.
fn joints_deg(set: &Dataset) -> Option<f64> {
    let turning = (0..set.joint_count()).filter(|&joint| !set.is_sliding(joint));
    let of_joint = |joint: usize| set.poses.iter().map(move |pose| pose.joints_rad[joint].to_degrees());
    step(&turning.flat_map(of_joint).collect::<Vec<f64>>())
}

/// The step that all points stand on, mm.
fn points_mm(set: &Dataset) -> Option<f64> {
    let points = set.poses.iter().filter_map(|pose| pose.reading.point_mm());
    step(&points.flat_map(|point| <[f64; 3]>::from(point.coords)).collect::<Vec<f64>>())
}

fn step(numbers: &[f64]) -> Option<f64> {
    let on = |step: &f64| numbers.iter().all(|n| ((n / step).round() - n / step).abs() < ON_STEP);
    STEPS.into_iter().find(on).filter(|_| !numbers.is_empty())
}

/// What angles rounded to a step alone scatter a coordinate by, mm.
fn of_step_mm(set: &Dataset, found: &Identification, step_deg: f64) -> f64 {
    let robot = found.robot();
    let of_row = |&row: &usize| {
        let q = &set.poses[row].joints_rad;
        let at = robot.target_mm(q);
        let square = |joint: usize| {
            let mut turned = q.clone();
            turned[joint] += SMALL_RAD;
            ((robot.target_mm(&turned) - at).norm() / SMALL_RAD).powi(2)
        };
        (0..q.len()).filter(|&joint| !set.is_sliding(joint)).map(square).sum::<f64>()
    };
    let squares = found.fitted.iter().map(of_row).sum::<f64>() / found.fitted.len().max(1) as f64;
    // A uniform error of a step, over three coordinates.
    step_deg.to_radians() / 12f64.sqrt() * (squares / 3.0).sqrt()
}

#[cfg(test)]
mod tests;
