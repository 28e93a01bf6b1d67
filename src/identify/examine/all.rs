//! All that is asked of the data before anything is identified, in its order.

use super::conventions::Mended;
use super::robots::tools::Moved;
use super::sessions::{self, Along};
use super::{conventions, covariances, known, orientations, robots, shifted};
use crate::identify::data::dataset::Dataset;
use crate::identify::data::repeats::Repeats;
use crate::identify::finding::Finding;
use crate::identify::settings::{Model, Settings};
use crate::robot::Robot;

/// A data set and a nominal robot as they are to be used.
#[derive(Debug, Clone)]
pub struct Examined {
    /// The measurements, mended, and cut into sessions.
    pub set: Dataset,
    pub robot: Robot,
    /// Sessions and drifts.
    pub along: Along,
    /// What was wrong, and what was done.
    pub findings: Vec<Finding>,
    /// Those of them by which readings or joints are not taken as they are written.
    pub mended: Vec<Finding>,
    /// What was mended and yet speaks against the file.
    pub against: Vec<Finding>,
    /// Errors that nothing explained so far.
    pub unexplained: Option<Finding>,
}

/// Looks for what is wrong before anything is identified. `step` hears what is being done.
pub fn examine(set: &Dataset, robot: &Robot, settings: &Settings, step: &dyn Fn(&str)) -> Examined {
    step("units, signs and conventions");
    let (mut set, mut robot, mut findings, mut against) = (set.clone(), robot.clone(), Vec::new(), Vec::new());
    let (mut unexplained_mm, mut mended, mut is_open) = (None, Vec::new(), false);
    let of_targets = set.targets.as_ref().map_or_else(Vec::new, |targets| targets.findings.clone());
    if settings.examine {
        let (of_rows, open, of_orientations, of_known);
        (set, of_rows) = shifted::examine(&set, &robot);
        Mended { set, robot, findings, against, open, unexplained_mm, is_open } =
            conventions::examine(&set, &robot, settings);
        findings.splice(0..0, of_rows);
        mended.clone_from(&findings);
        (set, of_orientations) = orientations::examine(&set, &robot, settings.model == Some(Model::Pose));
        (set, of_known) = known::examine(&set, &robot, settings);
        findings.extend(open);
        findings.extend(of_orientations);
        findings.extend(of_known);
    }
    step("sessions along the rows");
    let robots = if settings.examine { robots::find(&set, &robot, settings) } else { None };
    let tool = if settings.examine && robots.is_none() { robots::tools::find(&set, &robot) } else { None };
    let uncut = set;
    let (mut set, mut along) = match &robots {
        Some(robots) => (robots.parted(&uncut), Along { robots: Some(robots.finding()), ..Along::default() }),
        None => sessions::find(&uncut, &robot, settings),
    };
    if is_open && !along.sessions.is_empty() {
        (set, robot, unexplained_mm) =
            within_sessions(set, robot, settings, unexplained_mm, &mut mended, &mut findings);
    }
    if settings.examine && !along.sessions.is_empty() && along.drifting.is_empty() {
        along.instead = robots::tools::of_sessions(&uncut, &set, &robot);
    }
    // What looks like the step of a joint may be the tool's.
    let of_step = along.step.as_ref().filter(|_| settings.examine);
    if let Some(of_tool) = of_step.and_then(|from| robots::tools::of_step(&uncut, from, &robot)) {
        along.instead = Some(of_tool);
    }
    // Sessions have placements of their own: a sensor that was moved does no harm there.
    let is_harmless = |tool: &Moved| tool.is_placed && !along.sessions.is_empty();
    against.extend(tool.filter(|tool| !is_harmless(tool)).map(|tool| tool.finding));
    against.extend(uncut.repeats.as_ref().and_then(Repeats::of_two_points));
    if settings.examine && against.is_empty() && robots.is_none() {
        against.extend(robots::of_files(&uncut, &robot).or_else(|| robots::alternating::find(&uncut, &robot)));
    }
    if settings.examine && against.is_empty() && along == Along::default() {
        against.extend(robots::loads::find(&uncut, &robot));
    }
    if settings.examine {
        let of_covariances;
        (set, of_covariances) = covariances::examine(&set, &robot, settings);
        findings.extend(of_covariances);
    }
    findings.splice(0..0, of_targets);
    let of_links = |left_mm| conventions::unexplained(&set, "the best fit of links near the file's", left_mm);
    let unexplained = unexplained_mm.filter(|_| robots.is_none()).map(of_links);
    Examined { set, robot, along, findings, mended, against, unexplained }
}

/// A sensor that was moved hides a column that is wrong, too: what no change of all rows explains is looked at once more
/// in sessions with placements of their own. The rows, the robot, and what is not explained then.
fn within_sessions(
    set: Dataset,
    robot: Robot,
    settings: &Settings,
    unexplained_mm: Option<f64>,
    mended: &mut Vec<Finding>,
    findings: &mut Vec<Finding>,
) -> (Dataset, Robot, Option<f64>) {
    let again = conventions::examine(&set, &robot, settings);
    if again.is_open || !again.against.is_empty() {
        return (set, robot, unexplained_mm);
    }
    mended.extend(again.findings.iter().cloned());
    findings.extend(again.findings);
    (again.set, again.robot, None)
}

#[cfg(test)]
mod tests;
