//! `identification.json`: what was found, in numbers for other programs.

mod advice;
mod parameters;
mod quality;

use serde::Serialize;

use super::data::dataset::{Dataset, Reading, Skipped};
use super::data::repeats::Repeats;
use super::data::sessions::{Along, Session};
use super::data::targets::Targets;
use super::finding::Finding;
use super::judge::choose::Identification;
use super::judge::climb::{self, Certainty, Judged};
use super::judge::scale::CommonScale;
use super::judge::uncertainty::{Covariance, Expected};
use super::model::prior::Tolerance;
use super::sensor::Extra;
use super::sensor::SmoothError;
use super::settings::Settings;
use crate::robot::Robot;

pub use self::advice::{Advice, Findings};
pub use self::parameters::{Identifiability, MethodRecord, ParameterRecord};
pub use self::quality::{PointSpread, Quality, quality, spread};

/// The file.
#[derive(Debug, Clone, Serialize)]
pub struct Record {
    /// Of every random draw.
    pub seed: u64,
    /// `name/model` of one of `methods`.
    pub chosen: String,
    /// Terms of the robot's model.
    pub terms: String,
    /// The nominal robot.
    pub before: Quality,
    /// All that was run.
    pub methods: Vec<MethodRecord>,
    /// What the poses determine.
    pub identifiability: Identifiability,
    /// Whether to use the robot that was found.
    pub advice: Advice,
    /// Why, in one sentence.
    pub reason: String,
    /// In plain words, the gravest first.
    pub warnings: Vec<String>,
    /// Poses that fit far worse than the rest and were left out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outliers: Vec<String>,
    /// Sessions found along the rows.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sessions: Vec<Session>,
    /// Rows without a usable reading.
    pub skipped: Vec<Skipped>,
    /// Held-out errors of models and terms.
    pub judged: Vec<Judged>,
    /// What is wrong with the data, and what was done about it.
    pub doctor: Vec<Finding>,
    /// Of the chosen method's identified parameters; `None` where nominal was kept.
    pub covariance: Option<Covariance>,
    /// The position error to expect of the chosen robot; `None` where nominal was kept.
    pub expected: Option<Expected>,
    /// A scale of the readings, as far as the links' tolerance tells it from the robot's size; `None` where the links were not fitted.
    pub scale: Option<CommonScale>,
    /// The targets of each pose, where there are several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub targets: Option<Targets>,
    /// Readings that were repeated at one pose.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeats: Option<Repeats>,
    /// How sure the choice of terms is.
    pub certainty: Vec<Certainty>,
    /// Whether `verify` has all rows, each in fits that it was left out of, because the file has none to verify.
    pub folded: bool,
    /// The tool that the nominal chain asks for and the middle error that is left with it, mm, where that is far less than with the tool of the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tool_mm: Option<([f64; 3], f64)>,
    /// Unknowns of the sensor that were found beside the robot: name and value (mm, thousandths, mrad, standard deviations).
    pub sensor: Vec<(String, f64)>,
    /// A smooth error that the points of each placement share.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smooth: Option<Smooth>,
    /// Scatter of a point coordinate beyond the measurement's covariance, mm.
    pub scatter_mm: f64,
    /// Parameters whose search limits were widened.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub widened: Vec<String>,
    /// The prior's standard deviations, where one was used.
    pub prior: Option<Tolerance>,
}

/// A smooth error that the points of each placement share.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Smooth {
    /// How large and how smooth.
    #[serde(flatten)]
    pub error: SmoothError,
    /// Root mean square of a coordinate that is left of it after a rigid fit to each placement, mm.
    pub left_mm: f64,
}

impl Smooth {
    /// Of the chosen fit.
    pub fn new(found: &Identification) -> Option<Smooth> {
        let (formulation, _) = found.candidates[found.chosen].found.as_ref()?;
        let error = formulation.rows.scatter.smooth?;
        Some(Smooth { error, left_mm: formulation.rows.left_by_smooth_mm2().sqrt() })
    }
}

/// Name and value of an unknown of the sensor; a supposed scale in thousandths.
fn of_sensor(set: &Dataset, extra: Extra, value: f64) -> (String, f64) {
    match set.supposed_scale {
        Some(sd) if extra == Extra::Shared(0) => ("sensor_scale".to_owned(), 1000.0 * sd * value),
        _ => (extra.name(), value),
    }
}

impl Record {
    /// Gathers everything.
    pub fn new(
        set: &Dataset,
        nominal: &Robot,
        found: &Identification,
        along: &Along,
        findings: Findings,
        settings: &Settings,
        seed: u64,
    ) -> Record {
        let chosen = &found.candidates[found.chosen];
        // Nominal has nothing to say about what the poses determine; the fit that it was kept against has.
        let fitted = chosen.found.as_ref().or(found.candidates.first().and_then(|c| c.found.as_ref()));
        let identifiability = fitted.map_or_else(Identifiability::nothing, |(f, _)| parameters::identifiability(f));
        let names = |rows: &[usize]| rows.iter().map(|&i| set.poses[i].name.clone()).collect::<Vec<_>>();
        let methods: Vec<MethodRecord> = found
            .candidates
            .iter()
            .map(|c| parameters::method_record(c, quality(set, &c.robot, c.found.is_some(), found, settings).0))
            .collect();
        let before = quality(set, nominal, false, found, settings).0;
        let mut record = Record {
            seed,
            chosen: format!("{}/{}", chosen.name, chosen.model.name()),
            terms: found.terms.name(),
            before,
            methods,
            identifiability,
            advice: Advice::Use,
            reason: String::new(),
            warnings: Vec::new(),
            outliers: names(&found.outliers),
            sessions: along.sessions.clone(),
            skipped: set.skipped.clone(),
            judged: found.judged.clone(),
            smooth: Smooth::new(found),
            scatter_mm: found.scatter.point_mm,
            widened: chosen.found.as_ref().map_or_else(Vec::new, |(f, _)| f.widened.clone()),
            prior: fitted.filter(|(f, _)| f.held).map(|(f, _)| f.tolerance),
            doctor: findings.all(),
            covariance: chosen.found.as_ref().map(|(f, _)| Covariance::new(f)),
            expected: chosen.found.as_ref().map(|(f, _)| Expected::new(f, set, &found.fitted)),
            scale: CommonScale::new(set, found),
            targets: set.targets.clone(),
            repeats: set.repeats,
            certainty: climb::certainty(&found.judged, &found.terms),
            folded: !found.deletions.is_empty(),
            tool_mm: tool(set, nominal),
            sensor: found.extras.iter().map(|(extra, value)| of_sensor(set, *extra, *value)).collect(),
        };
        record.advise(set, nominal, found, &findings, found.against_nominal(set, nominal, settings));
        record
    }

    /// The method that was chosen.
    pub fn chosen_method(&self) -> Option<&MethodRecord> {
        self.methods.iter().find(|m| self.chosen == format!("{}/{}", m.name, m.model))
    }
}

/// The tool that the nominal chain asks for, where it makes it far nearer to the points; of the placement with most rows.
fn tool(set: &Dataset, nominal: &Robot) -> Option<([f64; 3], f64)> {
    /// Times that the chain must come nearer by a tool of its own.
    const FAR_NEARER: f64 = 3.0;
    let of_group = |g: usize| set.rows(|p| p.group == g && p.on_body_mm.is_none());
    let rows = (0..set.groups.len()).map(of_group).max_by_key(Vec::len)?;
    let point = |&r: &usize| match set.poses[r].reading {
        Reading::Position { point_mm, .. } => Some((set.poses[r].joints_rad.clone(), point_mm)),
        _ => None,
    };
    let (joints, points): (Vec<_>, Vec<_>) = rows.iter().filter_map(point).unzip();
    let (before, after) = (nominal.left_mm(&joints, &points)?, nominal.fit_tool(&joints, &points)?);
    (after.left_mm * FAR_NEARER < before).then(|| (after.tool_mm.into(), after.left_mm))
}
