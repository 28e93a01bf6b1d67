//! Where to send the robot so that its parameters are determined best.
//!
//! In: the nominal robot, the calibrated rig, the spheres to work on, what was measured before. Out: poses with their roles, what they
//! determine, and the accuracy to expect. Method: a pool of inverse-kinematics solutions that both cameras see ([`pool`]); of these
//! the ones that make the mean variance of the target's place over the spheres least ([`choose`]), by the information that `identify`
//! itself uses: the points' residuals with a free transform a placement. What goes wrong: a place that the robot does not reach, a rig
//! that does not see it; collisions of the arm with itself, the cameras or the cell are not checked.

pub mod after;
pub mod choose;
pub mod order;
pub mod pool;
pub mod predict;
pub mod scene;
#[cfg(test)]
mod tests;

use nalgebra::Vector3;

use crate::diagnostic::{Explain, Status};
use crate::geometry::Transform;
use crate::measurements::{Measurement, RobotPose, Role};
use crate::robot::Robot;
use choose::Information;
use pool::{Candidate, Pool};
use predict::{Accuracy, Problem};
use scene::{Placement, Scene};

/// Result of planning.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What to plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Poses to identify from, over all groups.
    pub samples: usize,
    /// Poses to verify with, over all groups.
    pub verify: usize,
    /// The paper's layout instead of the best one.
    pub paper: bool,
    /// Only poses that find out where the cameras stand, a group.
    pub first: Option<usize>,
    /// Candidates.
    pub pool: usize,
    /// Seed of the candidates.
    pub seed: u64,
    /// Middles of the spheres, base frame, mm; empty for the paper's, scaled by the robot's reach.
    pub centers_mm: Vec<Vector3<f64>>,
    /// Radius of the spheres, mm.
    pub radius_mm: f64,
    /// Standard deviation of a coordinate of the measured point, mm, instead of the rig's and the robot's.
    pub noise_mm: Option<f64>,
    /// Pose repeatability RP (ISO 9283), mm.
    pub repeatability_mm: f64,
}

/// Numbers of poses that the accuracy is always said for.
pub const COUNTS: [usize; 4] = [10, 20, 40, 80];

/// The paper's samples.
pub const PAPER_SAMPLES: usize = 262;

/// What can go wrong in planning.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The middle of a sphere.
    #[error(
        "group {group}: the robot does not reach ({:.0}, {:.0}, {:.0}) mm with its flange level or pointing down, within its limits",
        point_mm[0], point_mm[1], point_mm[2]
    )]
    Unreachable {
        /// The group.
        group: String,
        /// The point, mm.
        point_mm: [f64; 3],
        /// The nearest point of that line from the base that it reaches, mm.
        nearest_mm: Option<[f64; 3]>,
    },
    /// The rig's field is too small for the target.
    #[error(
        "the rig never sees a target of {width_mm:.0} x {height_mm:.0} mm wholly in both pictures; its field is about {field_mm:.0} mm at {distance_mm:.0} mm"
    )]
    NeverSeen {
        /// The target's plate.
        width_mm: f64,
        /// The target's plate.
        height_mm: f64,
        /// Width that both cameras see.
        field_mm: f64,
        /// Distance of the field's middle.
        distance_mm: f64,
    },
    /// Too few candidates.
    #[error(
        "group {group}: {found} of {tried} places in view can be reached within the joints' limits; {needed} poses are needed"
    )]
    TooFew {
        /// The group.
        group: String,
        /// Candidates found.
        found: usize,
        /// Tried.
        tried: usize,
        /// Asked for.
        needed: usize,
    },
    /// The measurements are of other groups, or of nothing.
    #[error("{message}")]
    Measured {
        /// What is wrong.
        message: String,
        /// The file.
        place: String,
    },
}

impl Explain for Error {
    fn status(&self) -> Status {
        match self {
            Error::TooFew { .. } => Status::Undetermined,
            _ => Status::BadInput,
        }
    }
    fn place(&self) -> Option<String> {
        match self {
            Error::Measured { place, .. } => Some(place.clone()),
            _ => None,
        }
    }
    fn hint(&self) -> Option<String> {
        Some(match self {
            Error::Unreachable { nearest_mm: Some([x, y, z]), .. } => {
                format!("`--center {x:.0},{y:.0},{z:.0}` is reached; repeat --center for more spheres")
            }
            Error::Unreachable { .. } => {
                "`stereocal robot show` gives the pose at joint angles: is the robot file right?".to_owned()
            }
            Error::NeverSeen { .. } => {
                "a smaller target (`--squares`, `--square-mm`), or cameras that look at one place".to_owned()
            }
            Error::TooFew { .. } => {
                "fewer poses (`--poses`), another place (`--center X,Y,Z`), or wider limits_deg in the robot file"
                    .to_owned()
            }
            Error::Measured { .. } => {
                "`--after` takes the measurements.csv of poses that `stereocal plan --first` made".to_owned()
            }
        })
    }
}

/// A planned pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Planned {
    /// As poses.csv has it.
    pub at: RobotPose,
    /// Index of its group.
    pub group: usize,
    /// Where the target should be seen.
    pub left_from_target: Transform,
}

/// A plan.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The placements that it is made for.
    pub placements: Vec<Placement>,
    /// Poses in the order of the run.
    pub poses: Vec<Planned>,
    /// What they determine, and how well.
    pub accuracy: Accuracy,
    /// Accuracy by the number of samples, and of this plan.
    pub expected: Vec<(usize, f64)>,
    /// The paper's plan: what it determines, and its accuracy by the number of samples.
    pub paper: Option<(Accuracy, Vec<(usize, f64)>)>,
    /// Standard deviation of a coordinate that was reckoned with, mm.
    pub noise_mm: f64,
    /// Expected error at places of the spheres, base frame: place, mm.
    pub map: Vec<(Vector3<f64>, f64)>,
    /// Candidates that were to choose from.
    pub pool: usize,
    /// What the user must know.
    pub warnings: Vec<String>,
}

/// What every plan's user must know.
pub const COLLISIONS: &str = "collisions of the arm with itself, the cameras and the cell are not checked: run the program slowly, hand on the stop";

/// Plans. `measured` are rows of earlier poses, and the file they come from.
pub fn plan(
    robot: &Robot,
    scene: &Scene,
    settings: &Settings,
    measured: Option<(&[Measurement], &str)>,
) -> Result<Plan> {
    let mut placements = scene::placements(robot, scene, settings)?;
    let mut warnings = vec![COLLISIONS.to_owned()];
    let earlier = match measured {
        Some((rows, place)) => after::place(robot, scene, &mut placements, rows, place)?,
        None => Vec::new(),
    };
    let noise = scene::PoseNoise { given_mm: settings.noise_mm, repeatability_mm: settings.repeatability_mm };
    let candidates = |kind| Pool { robot, scene, settings, placements: &placements, noise }.candidates(kind);
    let problem = Problem::new(robot, &placements, candidates(pool::Kind::Fresh)?);
    let centers = candidates(pool::Kind::Center)?;
    let mut information = Information::new(&problem);
    earlier.iter().chain(&centers).for_each(|c| information.add(&problem.rows(c)));
    let (chosen, expected, pool_size) = if let Some(count) = settings.first {
        (candidates(pool::Kind::First(count))?, Vec::new(), 0)
    } else if settings.paper {
        let all = candidates(pool::Kind::Paper(settings.samples))?;
        let expected = information.clone().curve(&problem, &all, &[&COUNTS[..], &[settings.samples]].concat());
        (all, expected, 0)
    } else {
        let pool = candidates(pool::Kind::Pool(settings.pool))?;
        let (chosen, expected) = choose::choose(&problem, &information, &pool, settings.samples);
        (chosen.iter().map(|&k| pool[k].clone()).collect(), expected, pool.len())
    };
    let paper = if settings.first.is_none() {
        let of_paper = candidates(pool::Kind::Paper(PAPER_SAMPLES)).ok();
        of_paper.map(|all| {
            let counts = [&COUNTS[..], &[PAPER_SAMPLES]].concat();
            let mut start = Information::new(&problem);
            centers.iter().for_each(|c| start.add(&problem.rows(c)));
            let curve = start.curve(&problem, &all, &counts);
            let used: Vec<Candidate> = centers.iter().chain(&all).cloned().collect();
            (problem.accuracy(&used), curve)
        })
    } else {
        None
    };
    chosen.iter().for_each(|c| information.add(&problem.rows(c)));
    let used: Vec<Candidate> = earlier.iter().chain(&centers).chain(&chosen).cloned().collect();
    let verify = if settings.first.is_some() { 0 } else { settings.verify };
    let held_out = candidates(pool::Kind::Verify(verify))?;
    if measured.is_none() && settings.first.is_none() {
        warnings.push(
            "where the cameras stand is only assumed: place them as plan.json says, or `--first` and then `--after` find out".to_owned(),
        );
    }
    let poses = order::poses(robot, &placements, &centers, &chosen, &held_out, measured.map(|m| m.0));
    Ok(Plan {
        accuracy: problem.accuracy(&used),
        expected,
        paper,
        noise_mm: problem.noise_mm(&used),
        map: information.map(&problem),
        pool: pool_size,
        warnings,
        poses,
        placements,
    })
}

/// A row of poses.csv: readings rounded as a controller takes them.
fn robot_pose(robot: &Robot, name: String, group: &str, role: Role, joints_rad: &[f64]) -> RobotPose {
    let slides: Vec<bool> = robot.joints.iter().map(|j| j.slides).collect();
    let reading = |(q, slides): (&f64, &bool)| rounded(if *slides { *q } else { q.to_degrees() });
    let joints_deg = joints_rad.iter().zip(&slides).map(reading).collect();
    let slides = if slides.contains(&true) { slides } else { Vec::new() };
    RobotPose { pose: name, group: group.to_owned(), role, joints_deg, slides }
}

/// Four digits behind the point, and no minus before a zero.
fn rounded(value: f64) -> f64 {
    format!("{value:.4}").parse().unwrap_or(value) + 0.0
}
