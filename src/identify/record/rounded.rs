//! Joint angles that were rounded: what the rounding alone scatters points by.

use crate::identify::data::dataset::{Dataset, Kind};
use crate::identify::finding::Finding;
use crate::identify::run::Identification;

/// Steps that angles are rounded to, deg, coarse ones first.
const STEPS_DEG: [f64; 4] = [1.0, 0.5, 0.1, 0.05];

/// Readings within this of a multiple of a step are one, in steps.
const ON_STEP: f64 = 1e-6;

/// Share of the scatter that rounding must account for, and times it that it may be: angles that were commanded as whole numbers scatter by far less.
const EXPLAINS: f64 = 0.5;
const MOST: f64 = 1.25;

/// A turn by which the way of the point is seen, rad.
const SMALL_RAD: f64 = 1e-6;

/// Rounded angles where they account for what the fit leaves.
pub fn of_joints(set: &Dataset, found: &Identification) -> Option<Finding> {
    let slides = |joint: usize| set.slides.get(joint).copied().unwrap_or(false);
    let on = |step: f64| {
        let is_on = |q: f64| ((q.to_degrees() / step).round() - q.to_degrees() / step).abs() < ON_STEP;
        let turns = |joints: &[f64]| joints.iter().enumerate().all(|(j, &q)| slides(j) || is_on(q));
        set.poses.iter().all(|pose| turns(&pose.joints_rad))
    };
    let step_deg = STEPS_DEG.into_iter().find(|step| set.kind == Kind::Positions && on(*step))?;
    let robot = &found.candidates[found.chosen].robot;
    let of_row = |&row: &usize| {
        let q = &set.poses[row].joints_rad;
        let at = robot.target_mm(q);
        let square = |joint: usize| {
            let mut turned = q.clone();
            turned[joint] += SMALL_RAD;
            ((robot.target_mm(&turned) - at).norm() / SMALL_RAD).powi(2)
        };
        (0..q.len()).filter(|&joint| !slides(joint)).map(square).sum::<f64>()
    };
    let squares = found.fitted.iter().map(of_row).sum::<f64>() / found.fitted.len().max(1) as f64;
    // A uniform error of a step, over three coordinates.
    let alone_mm = step_deg.to_radians() / 12f64.sqrt() * (squares / 3.0).sqrt();
    let left_mm = found.scatter.point_mm;
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
