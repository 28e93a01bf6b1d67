//! A plan, step by step.

use nalgebra::{UnitQuaternion, Vector3};

use super::after;
use super::choose::{self, Information};
use super::error::{Error, Result};
use super::order::{self, Planned};
use super::pool::{self, Candidate, Pool};
use super::predict::{Accuracy, Problem};
use super::scene::{self, Placement, Scene};
use super::settings::{COUNTS, PAPER_SAMPLES, Settings};
use crate::measurements::Measurement;
use crate::robot::Robot;

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

/// Rows of earlier poses, and the file they come from.
pub type Measured<'a> = Option<(&'a [Measurement], &'a str)>;

/// Plans.
pub fn plan(robot: &Robot, scene: &Scene, settings: &Settings, measured: Measured) -> Result<Plan> {
    planned(robot, scene, settings, measured).map_err(|mut error| {
        // Where cameras stand already, another sphere is none that they see.
        if let (Error::TooFew { group, reached_mm: nearest, .. }, None) = (&mut error, measured) {
            *nearest = reached_mm(robot, scene, settings, group);
        }
        error
    })
}

/// The nearest middle of a sphere in place of a group's, mm, about which the arm reaches enough places: nearer to the
/// base's axis, and turned about it, by itself. `None` where there is none.
fn reached_mm(robot: &Robot, scene: &Scene, settings: &Settings, group: &str) -> Option<[f64; 3]> {
    const SHARES: [f64; 6] = [1.0, 0.9, 0.8, 0.7, 0.6, 0.5];
    const MOST_TRIED: usize = 40;
    const LEAST_IN_VIEW: f64 = 0.1;
    let all = scene::placements(robot, scene, settings).ok()?;
    let center_mm = all.iter().find(|placement| placement.name == group)?.center_mm;
    let turned = |deg: f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), deg.to_radians()) * center_mm;
    let turns = (-5..=6).map(|k| turned(30.0 * f64::from(k)));
    let mut centers: Vec<Vector3<f64>> = turns.flat_map(|center| SHARES.map(|share| center * share)).collect();
    centers.retain(|center| (center - center_mm).norm() > 1.0);
    centers.sort_by(|a, b| (a - center_mm).norm().total_cmp(&(b - center_mm).norm()));
    centers.truncate(MOST_TRIED);
    let noise = scene::PoseNoise { given_mm: settings.noise_mm, repeatability_mm: settings.repeatability_mm };
    // A sphere that is larger than the field is not seen anywhere.
    if (Pool { robot, scene, settings, placements: &all, noise }).share_in_view() < LEAST_IN_VIEW {
        return None;
    }
    let reaches = |center: &&Vector3<f64>| {
        // As it will be typed.
        let settings = Settings { centers_mm: vec![center.map(f64::round)], ..settings.clone() };
        scene::placements(robot, scene, &settings).is_ok_and(|placements| {
            let pool = Pool { robot, scene, settings: &settings, placements: &placements, noise };
            pool.candidates(pool::Kind::Fresh).and(pool.candidates(pool::Kind::Center)).is_ok()
        })
    };
    centers.iter().find(reaches).map(|center| center.map(f64::round).into())
}

fn planned(robot: &Robot, scene: &Scene, settings: &Settings, measured: Measured) -> Result<Plan> {
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
    let of_paper = settings.first.is_none().then(|| candidates(pool::Kind::Paper(PAPER_SAMPLES)).ok()).flatten();
    let paper = of_paper.map(|all| of_paper_plan(&problem, &centers, &all));
    chosen.iter().for_each(|c| information.add(&problem.rows(c)));
    let used: Vec<Candidate> = earlier.iter().chain(&centers).chain(&chosen).cloned().collect();
    let verify = if settings.first.is_some() { 0 } else { settings.verify };
    let held_out = candidates(pool::Kind::Verify(verify))?;
    warnings.extend(assumed(&placements, &earlier, settings, measured.map(|m| m.1)));
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

/// That nobody measured where the cameras stand in some of the groups; `rows` is the file of the earlier poses.
fn assumed(placements: &[Placement], earlier: &[Candidate], settings: &Settings, rows: Option<&str>) -> Option<String> {
    let is_seen = |group: usize| earlier.iter().any(|pose| pose.group == group);
    let unseen = placements.iter().enumerate().filter(|(group, _)| !is_seen(*group));
    let names: Vec<&str> = unseen.map(|(_, placement)| placement.name.as_str()).collect();
    match rows {
        _ if settings.first.is_some() || names.is_empty() => None,
        None => Some(
            "where the cameras stand is only assumed: place them as the table of plan.html says, or `--first` and then `--after` find out"
                .to_owned(),
        ),
        Some(rows) => Some(format!(
            "where the cameras stand in {} is only assumed, as {rows} has no three poses there: place them as the table of plan.html says, or measure three \
             poses in each and plan with these, too",
            names.join(", ")
        )),
    }
}

/// What the paper's poses determine, and their accuracy by the number of samples.
fn of_paper_plan(problem: &Problem, centers: &[Candidate], all: &[Candidate]) -> (Accuracy, Vec<(usize, f64)>) {
    let counts = [&COUNTS[..], &[PAPER_SAMPLES]].concat();
    let mut start = Information::new(problem);
    centers.iter().for_each(|c| start.add(&problem.rows(c)));
    let curve = start.curve(problem, all, &counts);
    let used: Vec<Candidate> = centers.iter().chain(all).cloned().collect();
    (problem.accuracy(&used), curve)
}
