//! `identification.json`: what was found, in numbers for other programs.

use serde::Serialize;

use super::base::Observability;
use super::choose::{Candidate, Identification, Judged};
use super::dataset::{Dataset, Skipped};
use super::estimate::Fit;
use super::prior::Tolerance;
use super::problem::{Problem, Stop};
use super::sessions::Session;
use super::settings::Settings;
use super::verify::{RowError, Spread, errors};
use crate::robot::{Parameter, Robot, Unit};

/// A box's wall counts as reached within this fraction of its width.
const AT_WALL: f64 = 1e-3;

/// Orientations within this are one: a robot keeps an orientation to far less, and so small a turn shows nothing.
const ONE_ORIENTATION_DEG: f64 = 1.0;

/// Mean distance error of a nominal robot, mm, beyond which units or robots are mixed up: built robots are off by a few mm.
const IMPLAUSIBLE_MM: f64 = 20.0;

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
    /// In plain words.
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
    /// Scatter of a point coordinate beyond the measurement's covariance, mm.
    pub scatter_mm: f64,
    /// The prior's standard deviations, where one was used.
    pub prior: Option<Tolerance>,
}

/// Errors of a robot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quality {
    /// On the rows that were fitted.
    pub fit: PointSpread,
    /// On the rows that were not.
    pub verify: PointSpread,
}

/// Distance errors, and with positions point errors.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointSpread {
    /// Of distances.
    #[serde(flatten)]
    pub distance: Spread,
    /// Of points after the groups' rigid transforms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point: Option<Spread>,
}

/// One method on one model.
#[derive(Debug, Clone, Serialize)]
pub struct MethodRecord {
    /// Method.
    pub name: &'static str,
    /// Model.
    pub model: &'static str,
    /// All parameters.
    pub parameters: Vec<ParameterRecord>,
    /// On the rows that were fitted.
    pub fit: PointSpread,
    /// On the rows that were not.
    pub verify: PointSpread,
    /// Root mean square held-out error that the choice went by, mm.
    pub held_out_mm: Option<f64>,
    /// Least cost, mm^2.
    pub cost_mm2: f64,
    /// Iterations.
    pub iterations: usize,
    /// Evaluations.
    pub evaluations: usize,
    /// Why it stopped.
    pub stop: Stop,
    /// Best cost after each iteration, mm^2.
    pub history: Vec<f64>,
    /// Evaluations used by then.
    pub history_evaluations: Vec<usize>,
}

/// One parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterRecord {
    /// Its name.
    pub name: String,
    /// `mm`, `deg`, `mrad` (harmonics) or `mrad/m` (gravity).
    pub unit: &'static str,
    /// In the nominal robot.
    pub nominal: f64,
    /// What was added.
    pub delta: f64,
    /// Standard deviation of `delta`; none for what stays nominal.
    pub sigma: Option<f64>,
    /// Whether the poses determine it (alone or standing for its group).
    pub identifiable: bool,
    /// Whether it ended at the wall of the box.
    pub at_bound: bool,
}

/// What the poses determine.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Identifiability {
    /// Number of base parameters.
    pub rank: usize,
    /// Number of parameters.
    pub parameters: usize,
    /// Parameters that move nothing that was measured.
    pub zero: Vec<String>,
    /// Parameters that act together; the first of each group stands for it.
    pub dependent: Vec<String>,
    /// Largest over smallest singular value.
    pub condition: Option<f64>,
    /// O1 to O5.
    pub observability: Option<Observability>,
    /// Base parameters that the data leave as uncertain as the prior.
    pub weak: Vec<String>,
}

/// Errors of rows under a robot, as they go into tables and figures.
pub fn quality(set: &Dataset, robot: &Robot, found: &Identification, settings: &Settings) -> (Quality, Vec<RowError>) {
    let of = |rows: &[usize]| errors(set, robot, &found.fitted, rows, found.scatter, settings.wire_offset);
    let (fit, verify) = (of(&found.fitted), of(&set.verify_rows()));
    (Quality { fit: spread(&fit), verify: spread(&verify) }, verify)
}

/// The largest turn of the nominal flange between two poses of a group (one of them the group's first), deg.
fn tilt_deg(set: &Dataset, nominal: &Robot, rows: &[usize]) -> f64 {
    let rotation = |i: usize| nominal.base_from_flange(&set.poses[i].joints_rad).rotation;
    let mut first = vec![None; set.groups.len()];
    let turn = |&i: &usize| first[set.poses[i].group].get_or_insert_with(|| rotation(i)).angle_to(&rotation(i));
    rows.iter().map(turn).fold(0.0, f64::max).to_degrees()
}

fn spread(errors: &[RowError]) -> PointSpread {
    let points: Vec<f64> = errors.iter().filter_map(|e| e.point_mm.map(|p| p.norm())).collect();
    PointSpread {
        distance: Spread::new(errors.iter().filter_map(|e| e.distance_mm)),
        point: (!points.is_empty()).then(|| Spread::new(points)),
    }
}

impl Record {
    /// Gathers everything.
    pub fn new(
        set: &Dataset,
        nominal: &Robot,
        found: &Identification,
        sessions: &[Session],
        settings: &Settings,
        seed: u64,
    ) -> Record {
        let chosen = &found.candidates[found.chosen];
        let identifiability = identifiability(chosen);
        let names = |rows: &[usize]| rows.iter().map(|&i| set.poses[i].name.clone()).collect::<Vec<_>>();
        let methods: Vec<MethodRecord> =
            found.candidates.iter().map(|c| method_record(c, quality(set, &c.robot, found, settings).0)).collect();
        let before = quality(set, nominal, found, settings).0;
        let mut record = Record {
            seed,
            chosen: format!("{}/{}", chosen.method.name(), chosen.model.name()),
            terms: found.terms.name(),
            before,
            methods,
            identifiability,
            warnings: Vec::new(),
            outliers: names(&found.outliers),
            sessions: sessions.to_vec(),
            skipped: set.skipped.clone(),
            judged: found.judged.clone(),
            scatter_mm: chosen.prepared.estimate.scatter.point_mm,
            prior: chosen.prepared.tolerance,
        };
        record.warnings = record.warnings(set, nominal, found);
        record
    }

    /// The method that was chosen.
    pub fn chosen_method(&self) -> Option<&MethodRecord> {
        self.methods.iter().find(|m| self.chosen == format!("{}/{}", m.name, m.model))
    }

    fn warnings(&self, set: &Dataset, nominal: &Robot, found: &Identification) -> Vec<String> {
        let mut list = Vec::new();
        if tilt_deg(set, nominal, &found.fitted) < ONE_ORIENTATION_DEG {
            list.push(
                "the flange keeps one orientation within each group: such poses cannot tell the tool and parts of the wrist \
                 from other parameters, and the identified robot is right for that orientation only; \
                 vary it by 20 deg or more between poses"
                    .to_owned(),
            );
        }
        let i = &self.identifiability;
        if !i.zero.is_empty() {
            list.push(format!("the poses cannot see {}: these stay nominal", i.zero.join(", ")));
        }
        if !i.dependent.is_empty() {
            list.push(format!(
                "the poses see only the combinations {}: the first of each takes the whole correction, the others stay nominal",
                i.dependent.join("; ")
            ));
        }
        if !i.weak.is_empty() {
            list.push(format!(
                "the data say next to nothing about {}: their values come from the manufacturing tolerance alone",
                i.weak.join(", ")
            ));
        }
        let widened = &found.candidates[found.chosen].prepared.widened;
        if !widened.is_empty() {
            list.push(format!("the box was widened for {}: the nominal values are far off there", widened.join(", ")));
        }
        let at_bound: Vec<&str> = self
            .chosen_method()
            .map(|m| m.parameters.iter().filter(|p| p.at_bound).map(|p| p.name.as_str()).collect())
            .unwrap_or_default();
        if !at_bound.is_empty() {
            list.push(format!("{} ended at the wall of the box and would have gone on", at_bound.join(", ")));
        }
        if !self.outliers.is_empty() {
            list.push(format!("left out because they fit far worse than the rest: {}", self.outliers.join(", ")));
        }
        if !self.sessions.is_empty() {
            list.push(format!(
                "the rows fall into {} sessions, between which the wire's anchor or its zero moved: {}",
                self.sessions.len(),
                self.sessions.iter().map(|s| format!("{}..{}", s.first, s.last)).collect::<Vec<_>>().join(", ")
            ));
        }
        if !self.skipped.is_empty() {
            list.push(format!(
                "{} rows have no usable reading, first {} ({})",
                self.skipped.len(),
                self.skipped[0].pose,
                self.skipped[0].reason
            ));
        }
        if set.split_here {
            list.push(
                "the file has no verify rows: a fifth of the samples, drawn from the seed, was held out".to_owned(),
            );
        }
        if let Some(before) = self.before.verify.distance.mean_abs_mm.filter(|&mean| mean > IMPLAUSIBLE_MM) {
            list.push(format!(
                "the nominal robot is off by {before:.0} mm on the mean, which no built robot is: see whether the lengths are mm and \
                 the angles deg, and whether this is the robot that was measured"
            ));
        }
        let worse = |before: &Spread, after: &Spread| match (before.mean_abs_mm, after.mean_abs_mm) {
            (Some(before), Some(after)) if after > before => Some((before, after)),
            _ => None,
        };
        if let Some(chosen) = self.chosen_method()
            && let Some((before, after)) = worse(&self.before.verify.distance, &chosen.verify.distance)
        {
            list.push(format!(
                "on the verify rows the identified robot is worse than the nominal one ({after:.3} against {before:.3} mm): don't use it"
            ));
        }
        list
    }
}

fn identifiability(candidate: &Candidate) -> Identifiability {
    let base = &candidate.prepared.base;
    let names: Vec<String> = candidate.prepared.parameters().iter().map(|p| p.name()).collect();
    let pick = |list: &[usize]| list.iter().map(|&i| names[i].clone()).collect::<Vec<_>>();
    Identifiability {
        rank: base.rank(),
        parameters: names.len(),
        zero: pick(&base.zero),
        dependent: base.groups(&names),
        condition: base.condition(),
        observability: base.observability(candidate.prepared.estimate.rows.len()),
        weak: pick(&candidate.prepared.unmoved(&candidate.solution.x)),
    }
}

fn method_record(candidate: &Candidate, quality: Quality) -> MethodRecord {
    let fit = candidate.prepared.fit();
    MethodRecord {
        name: candidate.method.name(),
        model: candidate.model.name(),
        parameters: parameter_records(candidate, &fit),
        fit: quality.fit,
        verify: quality.verify,
        held_out_mm: candidate.held_out_mm,
        cost_mm2: candidate.solution.cost,
        iterations: candidate.solution.iterations,
        evaluations: candidate.solution.evaluations,
        stop: candidate.solution.stop,
        history: candidate.solution.history.clone(),
        history_evaluations: candidate.solution.history_evaluations.clone(),
    }
}

fn parameter_records(candidate: &Candidate, fit: &Fit) -> Vec<ParameterRecord> {
    let prepared = &candidate.prepared;
    let sigmas = prepared.sigmas(&candidate.solution.x);
    let record = |(i, &parameter): (usize, &Parameter)| {
        let (unit, factor) = file_unit(parameter);
        let free = prepared.base.free.iter().position(|&f| f == i);
        let delta = free.map_or(0.0, |k| candidate.solution.x[k]);
        let wall = |k: usize| {
            let (low, high) = (fit.lower()[k], fit.upper()[k]);
            delta - low < AT_WALL * (high - low) || high - delta < AT_WALL * (high - low)
        };
        ParameterRecord {
            name: parameter.name(),
            unit,
            nominal: factor * prepared.estimate.kinematics.nominal().value(parameter),
            delta: factor * delta,
            sigma: free.map(|k| factor * sigmas[k]),
            identifiable: free.is_some(),
            at_bound: free.is_some_and(wall),
        }
    };
    prepared.parameters().iter().enumerate().map(record).collect()
}

/// Unit in files, and what to multiply mm or mrad by.
fn file_unit(parameter: Parameter) -> (&'static str, f64) {
    match (parameter, parameter.unit()) {
        (_, Unit::Mm) => ("mm", 1.0),
        (Parameter::Gravity(..), _) => ("mrad/m", 1.0),
        (Parameter::Harmonic(..), _) => ("mrad", 1.0),
        _ => ("deg", (1e-3f64).to_degrees()),
    }
}
