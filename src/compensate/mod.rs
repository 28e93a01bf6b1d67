//! What to tell the robot so that it goes where it was meant to go.
//!
//! In: the nominal robot, for which targets were written, the identified one, and targets: readings or poses of the
//! tool. Out: readings that bring the real tool there, or why there are none. Method: numeric inverse kinematics on the
//! identified model with all of its terms, started from the given readings, so that the posture is kept. A target that
//! is out of reach, needs a joint beyond its limits or lies at a singular posture (where the small correction is a
//! large turn) is refused and nothing about it changes. An arm of fewer than six joints cannot undo a tilt of its tool:
//! the tool's place is corrected, and the orientation as far as the arm turns that way.

mod refusal;

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::geometry::{Transform, transform};
use crate::robot::inverse::Approach;
use crate::robot::{Joint, Robot, inverse};

pub use refusal::Refusal;

/// Largest turn of a joint that is still a correction, rad: more of it is another posture, or the side of a singular
/// one.
const MOST_TURN_RAD: f64 = std::f64::consts::FRAC_PI_4;

/// Joints by which a tool is turned every way.
const ALL_WAYS: usize = 6;

/// What an arm of fewer joints may leave of an orientation, rad: more than robots are built off, and a target that is
/// not one of this arm.
const MOST_TILT_RAD: f64 = 0.05;

/// How far a joint turns of which no file has the limits, rad: two turns, as the wrists of arms that turn farthest do.
const MOST_TURNS_RAD: f64 = 2.0 * std::f64::consts::TAU;

/// Rounding of a reading at a limit, rad or mm.
const ROUNDING: f64 = 1e-9;

/// Rows that are looked at to find a posture where none is given.
const POSTURE_ROWS: usize = 20;

/// Starts that a posture is looked for from, and those of a row that the common posture does not reach.
const POSTURE_STARTS: usize = 64;
const ROW_STARTS: usize = 8;

/// Starts that a row has within the ranges that the robot was identified in.
const KNOWN_STARTS: usize = 24;

/// A target as it was written for the nominal robot.
#[derive(Debug, Clone, PartialEq)]
pub enum Target {
    /// Readings, rad (mm where a joint slides).
    Readings(Vec<f64>),
    /// Where the tool is to be, and readings near which, where known.
    Pose {
        /// `root_from_tool`, the tool's frame being the last one moved to the tool.
        root_from_tool: Transform,
        /// Readings that say the posture, rad.
        near_rad: Option<Vec<f64>>,
    },
}

/// A target with its outcome.
#[derive(Debug, Clone, PartialEq)]
pub struct Compensated {
    /// Readings for the real robot, rad (mm), or why there are none.
    pub readings: Result<Vec<f64>, Refusal>,
    /// How far the real tool would have been off with the given readings, mm; `None` where there were none.
    pub miss_mm: Option<f64>,
    /// What an arm of fewer than six joints leaves of the tool's orientation, rad; `None` for others.
    pub left_rad: Option<f64>,
}

/// The two robots.
#[derive(Debug, Clone)]
pub struct Compensator {
    nominal: Robot,
    identified: Robot,
    /// The identified robot with joints that go anywhere.
    unlimited: Robot,
    /// The same with joints that stay where it was identified, where that is known.
    known: Option<Robot>,
    /// The tools in the last frames. Weights hang where the files say, whichever tool is compensated.
    nominal_tool: Transform,
    identified_tool: Transform,
    reach_mm: f64,
    /// Whether readings were given in radians.
    radians: bool,
}

impl Compensator {
    /// Both have the same joints; a tool (mm, last frame) replaces those of their files. The identified robot's limits
    /// count, or the nominal one's where it has none.
    pub fn new(nominal: &Robot, identified: &Robot, tool_mm: Option<Vector3<f64>>) -> Compensator {
        let (nominal, mut identified) = (nominal.clone(), identified.clone());
        let tool = |robot: &Robot| Transform::from(tool_mm.unwrap_or(robot.tool_mm));
        let (nominal_tool, identified_tool) = (tool(&nominal), tool(&identified));
        for (joint, drawn) in identified.joints.iter_mut().zip(&nominal.joints) {
            joint.limits_rad = joint.limits_rad.or(drawn.limits_rad);
        }
        let mut unlimited = identified.clone();
        unlimited.joints.iter_mut().for_each(|joint| joint.limits_rad = None);
        let slides = identified.joints.iter().any(|j| j.slides);
        let reach_mm = if slides { f64::INFINITY } else { identified.reach_mm() };
        Compensator {
            nominal,
            identified,
            unlimited,
            known: None,
            nominal_tool,
            identified_tool,
            reach_mm,
            radians: false,
        }
    }

    /// The same that takes, for poses without readings, postures within these ranges, rad (mm), where there are any:
    /// those that the robot was identified in.
    #[must_use]
    pub fn identified_over(mut self, ranges: &[(f64, f64)]) -> Compensator {
        let both = |(joint, &(low, high)): (&Joint, &(f64, f64))| match joint.limits_rad {
            Some((least, most)) if low.max(least) < high.min(most) => (low.max(least), high.min(most)),
            limits => limits.unwrap_or((low, high)),
        };
        let ranges: Vec<(f64, f64)> = self.identified.joints.iter().zip(ranges).map(both).collect();
        self.known = Some(self.identified.within(&ranges));
        self
    }

    /// The same of targets that may have been given in radians: a reading far outside is asked whether it is degrees.
    #[must_use]
    pub fn given_in_radians(self, radians: bool) -> Compensator {
        Compensator { radians, ..self }
    }

    /// Where the nominal robot's tool is, `root_from_tool`.
    fn meant(&self, readings: &[f64]) -> Transform {
        self.nominal.ends.root_from_frame0 * self.nominal.base_from_flange(readings) * self.nominal_tool
    }

    /// Where the real robot's tool is, `root_from_tool`.
    pub fn reached(&self, readings: &[f64]) -> Transform {
        self.identified.ends.root_from_frame0 * self.identified.base_from_flange(readings) * self.identified_tool
    }

    /// All targets, in their order, whatever the number of threads.
    pub fn compensate(&self, targets: &[Target]) -> Vec<Compensated> {
        let posture = self.posture(targets);
        targets.par_iter().map(|target| self.one(target, posture.as_deref())).collect()
    }

    /// The frame that inverse kinematics knows, from the tool's.
    fn base_from_flange(&self, root_from_tool: &Transform) -> Transform {
        self.identified.ends.root_from_frame0.inverse() * root_from_tool * self.identified_tool.inverse()
    }

    /// A posture for poses without any: the best one at the first of them that is reached, where the robot was
    /// identified if one is.
    fn posture(&self, targets: &[Target]) -> Option<Vec<f64>> {
        let poses = targets.iter().filter_map(|target| match target {
            Target::Pose { root_from_tool, near_rad: None } => Some(self.base_from_flange(root_from_tool)),
            _ => None,
        });
        let poses: Vec<Transform> = poses.take(POSTURE_ROWS).collect();
        let best = |robot: &Robot| poses.iter().find_map(|pose| inverse::best_posture(robot, pose, POSTURE_STARTS));
        self.known.as_ref().and_then(best).or_else(|| best(&self.identified))
    }

    fn one(&self, target: &Target, posture: Option<&[f64]>) -> Compensated {
        match target {
            Target::Readings(given) => {
                let meant = self.meant(given);
                let there = self.reached(given);
                let miss_mm = Some((meant.translation.vector - there.translation.vector).norm());
                let radians = self.radians;
                let outside = |joint, given, range| Refusal::Outside { joint, given, range, radians };
                let outside = self.beyond(given, outside);
                let kept = || self.kept(&self.base_from_flange(&meant), given);
                self.with_left(
                    Compensated { readings: outside.map_or_else(kept, Err), miss_mm, left_rad: None },
                    &meant,
                )
            }
            Target::Pose { root_from_tool, near_rad } => {
                let wanted = self.base_from_flange(root_from_tool);
                let near = |near: &Vec<f64>| self.near(&wanted, near);
                let readings = near_rad.as_ref().map_or_else(|| self.anywhere(&wanted, posture), near);
                self.with_left(Compensated { readings, miss_mm: None, left_rad: None }, root_from_tool)
            }
        }
    }

    /// With what is left of the orientation, where the arm has too few joints.
    fn with_left(&self, found: Compensated, root_from_tool: &Transform) -> Compensated {
        let left_rad = |readings: &[f64]| self.reached(readings).rotation.angle_to(&root_from_tool.rotation);
        let joints = self.identified.joints.len();
        let left_rad = found.readings.as_deref().ok().filter(|_| joints < ALL_WAYS).map(left_rad);
        match left_rad.filter(|left| *left > MOST_TILT_RAD) {
            Some(left) => {
                Compensated { readings: Err(Refusal::Tilted { joints, left_deg: left.to_degrees() }), ..found }
            }
            None => Compensated { left_rad, ..found },
        }
    }

    /// As near to the pose as this robot gets from there, the tool's place first where it has too few joints.
    fn approach(&self, robot: &Robot, wanted: &Transform, start: &[f64]) -> Approach {
        match robot.joints.len() < ALL_WAYS {
            true => inverse::approach_place(robot, &(wanted * self.identified_tool), &self.identified_tool, start),
            false => inverse::approach(robot, wanted, start),
        }
    }

    /// Readings for the pose in the posture of `given`, where the nominal robot is at the pose.
    fn kept(&self, wanted: &Transform, given: &[f64]) -> Result<Vec<f64>, Refusal> {
        let found = self.near(wanted, given)?;
        let joints = self.identified.joints.iter().zip(found.iter().zip(given)).enumerate();
        let turns = joints.filter(|(_, (joint, _))| !joint.slides).map(|(j, (_, (a, b)))| (j, (a - b).abs()));
        let most = turns.reduce(|most, next| if next.1 > most.1 { next } else { most });
        let flipped = inverse::side(&self.identified, &found) != inverse::side(&self.nominal, given);
        match most {
            Some((j, turn)) if flipped || turn > MOST_TURN_RAD => {
                Err(Refusal::Singular { joint: j + 1, turn_deg: turn.to_degrees() })
            }
            _ => Ok(found),
        }
    }

    /// Readings for the pose, searched from `start`.
    fn near(&self, wanted: &Transform, start: &[f64]) -> Result<Vec<f64>, Refusal> {
        let found = self.approach(&self.identified, wanted, start);
        if found.arrived() { Ok(found.joints_rad) } else { Err(self.refusal(wanted, start, found.miss_mm)) }
    }

    fn anywhere(&self, wanted: &Transform, posture: Option<&[f64]>) -> Result<Vec<f64>, Refusal> {
        let beyond = wanted.translation.vector.norm() - self.reach_mm;
        if beyond > 0.0 {
            return Err(Refusal::OutOfReach { short_mm: beyond });
        }
        if let Some(readings) = self.inside(wanted, posture) {
            return Ok(readings);
        }
        let starts = posture.map(<[f64]>::to_vec).into_iter();
        let starts = starts.chain((0..ROW_STARTS).map(|k| inverse::spread_start(&self.identified, k)));
        let mut nearest: Option<(f64, Vec<f64>)> = None;
        for start in starts {
            let found = self.approach(&self.identified, wanted, &start);
            if found.arrived() {
                return Ok(found.joints_rad);
            }
            if nearest.as_ref().is_none_or(|(miss, _)| found.miss_mm < *miss) {
                nearest = Some((found.miss_mm, start));
            }
        }
        let (miss_mm, start) = nearest.unwrap_or((f64::INFINITY, Vec::new()));
        Err(self.refusal(wanted, &start, miss_mm))
    }

    /// Readings where the robot was identified: those that the search reaches from the common posture, else the nearest
    /// to it.
    fn inside(&self, wanted: &Transform, posture: Option<&[f64]>) -> Option<Vec<f64>> {
        let (known, posture) = (self.known.as_ref()?, posture?);
        // An arm of few joints may be at its place with its tool tilted.
        let is_upright = |found: &Approach| {
            self.identified.base_from_flange(&found.joints_rad).rotation.angle_to(&wanted.rotation) < MOST_TILT_RAD
        };
        let arrived = |start: &[f64]| {
            let found = Some(self.approach(known, wanted, start)).filter(|found| found.arrived() && is_upright(found));
            found.map(|found| found.joints_rad)
        };
        let farthest = |readings: &[f64]| readings.iter().zip(posture).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        arrived(posture).or_else(|| {
            let others = (0..KNOWN_STARTS).filter_map(|k| arrived(&inverse::spread_start(known, k)));
            others.min_by(|a, b| farthest(a).total_cmp(&farthest(b)))
        })
    }

    /// What is in the way of the pose: a limit, where the robot would get there without its limits.
    fn refusal(&self, wanted: &Transform, start: &[f64], short_mm: f64) -> Refusal {
        let free = self.approach(&self.unlimited, wanted, start);
        let limit = self.beyond(&free.joints_rad, |joint, needed, range| Refusal::Limit { joint, needed, range });
        limit.filter(|_| free.arrived()).unwrap_or(Refusal::OutOfReach { short_mm })
    }

    /// The first joint that these readings, rad (mm), put beyond its range: its number, the reading and the range, deg
    /// (mm).
    fn beyond(&self, readings: &[f64], refusal: impl Fn(usize, f64, (f64, f64)) -> Refusal) -> Option<Refusal> {
        let mut joints = self.identified.joints.iter().zip(readings).enumerate();
        joints.find_map(|(j, (joint, &q))| {
            let unknown = (!joint.slides).then_some((-MOST_TURNS_RAD, MOST_TURNS_RAD));
            let (low, high) = joint.limits_rad.or(unknown)?;
            let in_file = |v: f64| if joint.slides { v } else { v.to_degrees() };
            let inside = (low - ROUNDING..=high + ROUNDING).contains(&q);
            (!inside).then(|| refusal(j + 1, in_file(q), (in_file(low), in_file(high))))
        })
    }
}

/// The pose of a row `x y z` (mm), `rx ry rz` (rad).
pub fn pose(numbers: &[f64]) -> Transform {
    let [place, turn] = [&numbers[..3], &numbers[3..6]].map(Vector3::from_column_slice);
    transform(turn, place)
}

#[cfg(test)]
mod tests;
