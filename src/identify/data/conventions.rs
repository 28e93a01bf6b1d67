//! Hypotheses about what is wrong with the data before anything is identified: units, exchanged or negated joints, another convention.
//!
//! In: a data set and the nominal robot. Out: both as the best hypothesis has them, and its name. A good robot fits to well below a
//! millimetre whatever its errors of manufacture are; where a robust fit leaves more, each hypothesis is tried on its own, and the one
//! that makes the errors vanish is taken and named. Nothing is mended that the residuals do not prove.
//! What goes wrong: two faults at once are found one after the other only where each alone brings an improvement.

use rayon::prelude::*;

use super::dataset::{Dataset, Kind, Reading};
use super::doctor::Finding;
use crate::identify::settings::Settings;
use crate::identify::solve::robust::Loss;
use crate::identify::solve::task::Task;
use crate::robot::Robot;

/// Robust scatter of a coordinate, mm, that no built robot has after a fit.
const IMPLAUSIBLE_MM: f64 = 0.8;

/// A hypothesis explains what is wrong when it brings the scatter down by this factor.
const EXPLAINS: f64 = 4.0;

/// Faults that are looked for one after the other.
const FAULTS: usize = 3;

/// Rows that are enough to tell hypotheses apart.
const ROWS: usize = 120;

/// One thing that may be wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Hypothesis {
    Radians,
    Lengths(f64, &'static str),
    KnownLengths(f64, &'static str),
    Exchanged(usize, usize),
    Negated(usize),
    Offset(usize, f64),
    Lagging(Option<usize>, isize),
    StandardDh,
    Mirrored,
}

/// The set and the robot as they are to be used, with what was mended or could not be explained.
pub fn examine(set: &Dataset, robot: &Robot, settings: &Settings) -> (Dataset, Robot, Vec<Finding>) {
    let (mut set, mut robot, mut findings) = (set.clone(), robot.clone(), Vec::new());
    let Some(mut scatter) = scatter_mm(&set, &robot, settings) else { return (set, robot, findings) };
    for _ in 0..FAULTS {
        if scatter < IMPLAUSIBLE_MM {
            return (set, robot, findings);
        }
        let tried: Vec<(f64, Hypothesis)> = hypotheses(&set)
            .into_par_iter()
            .filter_map(|h| {
                let (s, r) = h.applied(&set, &robot);
                Some((scatter_mm(&s, &r, settings)? / h.factor(), h))
            })
            .collect();
        let best = tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((left, hypothesis)) = best.filter(|(left, _)| left * EXPLAINS < scatter) else { break };
        (set, robot) = hypothesis.applied(&set, &robot);
        findings.push(Finding {
            finding: format!("{} (the errors fall from {scatter:.2} to {left:.3} mm)", hypothesis.name()),
            rows: Vec::new(),
            action: "mended for this run; mend the file (`examine = false` in [identify] takes it as it is)".to_owned(),
        });
        scatter = left * hypothesis.factor();
    }
    if scatter >= IMPLAUSIBLE_MM {
        findings.push(Finding {
            finding: format!(
                "{scatter:.2} mm a coordinate are left at best, more than any built robot's: the robot file is not of the robot that was \
                 measured, or joints and readings do not belong together"
            ),
            rows: Vec::new(),
            action: "nothing explains it; don't use the result".to_owned(),
        });
    }
    (set, robot, findings)
}

/// Robust scatter that a fit of all MDH parameters leaves, mm; `None` where nothing can be fitted.
fn scatter_mm(set: &Dataset, robot: &Robot, settings: &Settings) -> Option<f64> {
    let all = set.fit_rows();
    let step = all.len().div_ceil(ROWS).max(1);
    let rows: Vec<usize> = all.into_iter().step_by(step).collect();
    let parameters = robot.mdh_parameters();
    let task = Task::plain(set, robot, &parameters, &rows, settings);
    let scatter = task.robust(Loss::Absolute).ok()?.scatter.point_mm;
    scatter.is_finite().then_some(scatter)
}

fn hypotheses(set: &Dataset) -> Vec<Hypothesis> {
    let joints = set.poses.first().map_or(0, |p| p.joints_rad.len());
    let mut list = vec![Hypothesis::Radians, Hypothesis::StandardDh];
    // A touch reads no length.
    let touches = (0..set.poses.len()).any(|row| set.touches(row));
    for (factor, unit) in [(1000.0, "m"), (25.4, "inches"), (10.0, "cm"), (0.001, "um")] {
        match touches {
            false => list.push(Hypothesis::Lengths(factor, unit)),
            true if set.known.is_empty() => {}
            true => list.push(Hypothesis::KnownLengths(factor, unit)),
        }
    }
    if set.kind == Kind::Positions {
        list.push(Hypothesis::Mirrored);
    }
    for i in 0..joints {
        list.push(Hypothesis::Negated(i));
        list.extend((i + 1..joints).map(|j| Hypothesis::Exchanged(i, j)));
        list.extend([90.0, -90.0, 180.0].map(|deg| Hypothesis::Offset(i, deg)));
        list.extend([1, -1].map(|by| Hypothesis::Lagging(Some(i), by)));
    }
    list.extend([1, -1].map(|by| Hypothesis::Lagging(None, by)));
    list
}

impl Hypothesis {
    /// What lengths are multiplied by, so that scatters can be compared.
    fn factor(self) -> f64 {
        if let Hypothesis::Lengths(factor, _) = self { factor.max(1.0) } else { 1.0 }
    }

    fn name(self) -> String {
        match self {
            Hypothesis::Radians => "the joint angles are in radians, not in degrees".to_owned(),
            Hypothesis::Lengths(_, unit) => format!("the readings are in {unit}, not in mm"),
            Hypothesis::KnownLengths(_, unit) => format!("the known distances are in {unit}, not in mm"),
            Hypothesis::Exchanged(i, j) => {
                format!("the columns of joints {} and {} are exchanged (swapped)", i + 1, j + 1)
            }
            Hypothesis::Negated(i) => {
                format!("joint {} is counted the other way round: its sign is flipped (negated)", i + 1)
            }
            Hypothesis::Offset(i, deg) => format!("joint {} is offset by {deg:.0} deg", i + 1),
            Hypothesis::Lagging(None, by) => format!("the joints lag {by} row against the readings"),
            Hypothesis::Lagging(Some(i), by) => format!("joint {} lags {by} row against the others", i + 1),
            Hypothesis::StandardDh => "the robot file holds standard DH parameters, not modified ones (MDH)".to_owned(),
            Hypothesis::Mirrored => "the coordinates are mirrored: a left-handed frame".to_owned(),
        }
    }

    fn applied(self, set: &Dataset, robot: &Robot) -> (Dataset, Robot) {
        let (mut set, mut robot) = (set.clone(), robot.clone());
        match self {
            Hypothesis::Radians => {
                let slides = set.slides.clone();
                for pose in &mut set.poses {
                    for (j, q) in pose.joints_rad.iter_mut().enumerate() {
                        if !slides.get(j).copied().unwrap_or(false) {
                            *q = q.to_degrees();
                        }
                    }
                }
            }
            Hypothesis::Lengths(factor, _) => {
                for pose in &mut set.poses {
                    match &mut pose.reading {
                        Reading::Position { point_mm, covariance_mm2, .. } => {
                            point_mm.coords *= factor;
                            *covariance_mm2 = covariance_mm2.map(|c| c * (factor * factor));
                        }
                        Reading::Distance { distance_mm, sigma_mm } => {
                            *distance_mm *= factor;
                            *sigma_mm = sigma_mm.map(|s| s * factor);
                        }
                        Reading::Reference => {}
                    }
                }
            }
            Hypothesis::KnownLengths(factor, _) => {
                for known in &mut set.known {
                    known.distance_mm *= factor;
                    known.sigma_mm *= factor;
                }
            }
            Hypothesis::Exchanged(i, j) => set.poses.iter_mut().for_each(|p| p.joints_rad.swap(i, j)),
            Hypothesis::Negated(i) => robot.joints[i].sign = -robot.joints[i].sign,
            Hypothesis::Offset(i, deg) => robot.joints[i].theta_rad += deg.to_radians(),
            Hypothesis::Lagging(joint, by) => {
                let before: Vec<Vec<f64>> = set.poses.iter().map(|p| p.joints_rad.clone()).collect();
                let last = before.len() as isize - 1;
                for (i, pose) in set.poses.iter_mut().enumerate() {
                    let from = &before[(i as isize + by).clamp(0, last) as usize];
                    match joint {
                        Some(j) => pose.joints_rad[j] = from[j],
                        None => pose.joints_rad.clone_from(from),
                    }
                }
            }
            Hypothesis::StandardDh => robot = from_standard(&robot),
            Hypothesis::Mirrored => {
                for pose in &mut set.poses {
                    if let Reading::Position { point_mm, covariance_mm2, .. } = &mut pose.reading {
                        point_mm.x = -point_mm.x;
                        if let Some(c) = covariance_mm2 {
                            for k in [1, 2] {
                                c[(0, k)] = -c[(0, k)];
                                c[(k, 0)] = -c[(k, 0)];
                            }
                        }
                    }
                }
            }
        }
        (set, robot)
    }
}

/// A robot whose rows were read as modified but meant as standard DH: alpha and a belong behind their joint.
fn from_standard(robot: &Robot) -> Robot {
    let mut modified = robot.clone();
    for i in 0..modified.joints.len() {
        let before = if i == 0 { (0.0, 0.0) } else { (robot.joints[i - 1].alpha_rad, robot.joints[i - 1].a_mm) };
        (modified.joints[i].alpha_rad, modified.joints[i].a_mm) = before;
    }
    if let Some(last) = robot.joints.last() {
        let turn = nalgebra::Rotation3::from_axis_angle(&nalgebra::Vector3::x_axis(), last.alpha_rad);
        modified.tool_mm = turn * robot.tool_mm + nalgebra::Vector3::new(last.a_mm, 0.0, 0.0);
    }
    modified
}
