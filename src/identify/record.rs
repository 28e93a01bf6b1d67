//! `identification.json`: what was found, in numbers for other programs.

use nalgebra::DMatrix;
use serde::Serialize;

use super::data::dataset::{Dataset, Reading, Skipped};
use super::data::doctor::{self, Finding};
use super::data::repeats::Repeats;
use super::data::sessions::{Along, Session};
use super::data::targets::Targets;
use super::judge::choose::{Candidate, Identification};
use super::judge::climb::{self, Certainty, Judged};
use super::judge::errors::{Judge, RowError, Spread};
use super::judge::held_out::Against;
use super::judge::scale::CommonScale;
use super::model::base::Observability;
use super::model::prior::Tolerance;
use super::model::uncertainty::{Covariance, Expected};
use super::residuals::smooth::SmoothError;
use super::residuals::weights::Extra;
use super::settings::Settings;
use super::solve::formulation::Formulation;
use super::solve::problem::{Problem, Solution, Stop};
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
    /// Of touches: distance of the predicted points of a group to their mean.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub consistency: Option<Spread>,
    /// Of touches: predicted less known distances between groups.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distortion: Option<Spread>,
}

impl PointSpread {
    /// Whether there is no figure at all.
    pub fn is_empty(&self) -> bool {
        let others = [&self.point, &self.consistency, &self.distortion];
        self.distance.count == 0 && others.into_iter().flatten().all(|spread| spread.count == 0)
    }
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
    pub cost_mm2: Option<f64>,
    /// Iterations.
    pub iterations: usize,
    /// Evaluations.
    pub evaluations: usize,
    /// Why it stopped.
    pub stop: Option<Stop>,
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
/// A robot that was `fitted` is judged on rows that its fit was without.
pub fn quality(
    set: &Dataset,
    robot: &Robot,
    fitted: bool,
    found: &Identification,
    settings: &Settings,
) -> (Quality, Vec<RowError>) {
    // Points and distances as they were read, as `verify` takes them, which knows nothing of the sensor's errors.
    let of_sensor = found.extras.iter().copied().filter(|(e, _)| matches!(e, Extra::Target(_)));
    let (extras, values): (Vec<Extra>, Vec<f64>) = of_sensor.unzip();
    let judge = Judge { extras: &extras, values: &values, ..Judge::plain(set, &found.fitted, settings.wire_offset) };
    let (fit, verify) = (judge.errors(robot, &found.fitted), found.held_out_errors(&judge, robot, fitted));
    let quality = Quality {
        fit: spread(&judge, robot, &fit, &found.fitted),
        verify: spread(&judge, robot, &verify, &found.judged_rows(set)),
    };
    (quality, verify)
}

/// The largest turn of the nominal flange between two poses of a group (one of them the group's first), deg.
fn tilt_deg(set: &Dataset, nominal: &Robot, rows: &[usize]) -> f64 {
    let rotation = |i: usize| nominal.base_from_flange(&set.poses[i].joints_rad).rotation;
    let mut first = vec![None; set.groups.len()];
    let turn = |&i: &usize| first[set.poses[i].group].get_or_insert_with(|| rotation(i)).angle_to(&rotation(i));
    rows.iter().map(turn).fold(0.0, f64::max).to_degrees()
}

/// The figures of a list of errors of these rows.
pub fn spread(judge: &Judge, robot: &Robot, errors: &[RowError], rows: &[usize]) -> PointSpread {
    let touches = rows.iter().any(|&r| judge.set.touches(r));
    let points: Vec<f64> = errors.iter().filter_map(|e| e.point_mm.map(|p| p.norm())).collect();
    let some = |errors: Vec<f64>| (!errors.is_empty()).then(|| Spread::new(errors));
    PointSpread {
        distance: Spread::new(errors.iter().filter_map(|e| e.distance_mm)),
        point: some(if touches { Vec::new() } else { points.clone() }),
        consistency: some(if touches { points } else { Vec::new() }),
        distortion: some(judge.distortion_mm(robot, rows)),
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
        doctor: Vec<Finding>,
        settings: &Settings,
        seed: u64,
    ) -> Record {
        let chosen = &found.candidates[found.chosen];
        // Nominal has nothing to say about what the poses determine; the fit that it was kept against has.
        let fitted = chosen.found.as_ref().or(found.candidates.first().and_then(|c| c.found.as_ref()));
        let identifiability = fitted.map_or_else(Identifiability::nothing, |(f, _)| identifiability(f));
        let names = |rows: &[usize]| rows.iter().map(|&i| set.poses[i].name.clone()).collect::<Vec<_>>();
        let methods: Vec<MethodRecord> = found
            .candidates
            .iter()
            .map(|c| method_record(c, quality(set, &c.robot, c.found.is_some(), found, settings).0))
            .collect();
        let before = quality(set, nominal, false, found, settings).0;
        let mut record = Record {
            seed,
            chosen: format!("{}/{}", chosen.name, chosen.model.name()),
            terms: found.terms.name(),
            before,
            methods,
            identifiability,
            warnings: Vec::new(),
            outliers: names(&found.outliers),
            sessions: along.sessions.clone(),
            skipped: set.skipped.clone(),
            judged: found.judged.clone(),
            smooth: Smooth::new(found),
            scatter_mm: found.scatter.point_mm,
            prior: fitted.filter(|(f, _)| f.held).map(|(f, _)| f.tolerance),
            doctor,
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
        let against = found.against_nominal(set, nominal, settings);
        record.warnings = record.warnings(set, nominal, found, against);
        record
    }

    /// The method that was chosen.
    pub fn chosen_method(&self) -> Option<&MethodRecord> {
        self.methods.iter().find(|m| self.chosen == format!("{}/{}", m.name, m.model))
    }

    fn warnings(&self, set: &Dataset, nominal: &Robot, found: &Identification, against: Against) -> Vec<String> {
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
                "the poses see only the combinations {}: each shares its correction out by tolerance",
                shortened(&i.dependent)
            ));
        }
        if !i.weak.is_empty() {
            list.push(format!(
                "the data say next to nothing about {}: their values come from the manufacturing tolerance alone",
                i.weak.join(", ")
            ));
        }
        let chosen = found.candidates[found.chosen].found.as_ref();
        let widened = chosen.map_or(&[][..], |(f, _)| &f.widened);
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
        let zero_mm = chosen.and_then(|(f, _)| f.zero_sigma_mm()).unwrap_or(0.0);
        let promised_mm = self.expected.as_ref().map_or(f64::INFINITY, |e| e.of_robot_mm);
        if zero_mm > promised_mm && doctor::zero(found).is_none() {
            list.push(format!(
                "the distances are too much alike to tell a zero of the readings that is off from a robot of another size: the data know \
                 it to {zero_mm:.2} mm only; measure at distances that differ, or set `wire_offset = false` where the zero is right"
            ));
        }
        for finding in &self.doctor {
            list.push(finding.sentence());
        }
        if !self.skipped.is_empty() {
            list.push(format!(
                "{} rows have no usable reading, first {} ({})",
                self.skipped.len(),
                self.skipped[0].pose,
                self.skipped[0].reason
            ));
        }
        // The tool is a free number, and usually unknown: what is left once it is solved says whether the chain is implausible.
        let before = match self.tool_mm {
            Some((_, left)) => Some(left),
            None => self.before.verify.distance.mean_abs_mm,
        };
        if let Some(before) = before.filter(|&mean| mean > IMPLAUSIBLE_MM) {
            list.push(format!(
                "the nominal robot is off by {before:.0} mm on the mean, which no built robot is: see whether the lengths are mm and \
                 the angles deg, and whether this is the robot that was measured"
            ));
        }
        list.extend(self.worse(against));
        if found.vetoed {
            list.push(
                "on the verify rows the robot that was found is worse than the nominal one, by more than another draw of rows would let \
                 expect: nominal is kept"
                    .to_owned(),
            );
        } else if chosen.is_none() {
            list.push(self.not_proved());
        }
        list
    }

    /// Where rows that took no part in the fit find the chosen robot worse than the nominal one.
    fn worse(&self, against: Against) -> Option<String> {
        let chosen = self.chosen_method()?;
        let pair = |before: &Spread, after: &Spread| Some((before.mean_abs_mm?, after.mean_abs_mm?));
        let of_points = || pair(self.before.verify.point.as_ref()?, chosen.verify.point.as_ref()?);
        let figures = of_points().or_else(|| pair(&self.before.verify.distance, &chosen.verify.distance));
        let figures =
            figures.map_or_else(String::new, |(before, after)| format!(" ({after:.3} against {before:.3} mm)"));
        let rows = if self.folded { "rows that were left out of the fit" } else { "the verify rows" };
        match against {
            Against::NotWorse => None,
            Against::Perhaps => Some(format!(
                "on {rows} the identified robot is no better than the nominal one{figures}; another draw of rows may find it better, \
                 these don't: measure more of them before you use it"
            )),
            Against::Worse => {
                Some(format!("on {rows} the identified robot is worse than the nominal one{figures}: don't use it"))
            }
        }
    }

    /// Why the nominal robot was kept, with what the best of the others has on the same rows.
    fn not_proved(&self) -> String {
        let nominal = self.judged.iter().find(|j| j.terms == self.terms).and_then(|j| j.held_out_mm);
        let others = self.judged.iter().filter(|j| j.terms != self.terms);
        let best = others.filter_map(|j| Some((j.held_out_mm?, &j.terms))).min_by(|a, b| a.0.total_cmp(&b.0));
        match (nominal, best) {
            (Some(nominal), Some((best, terms))) if best < nominal => format!(
                "nominal is kept: the best other model, {terms}, has {best:.4} mm on samples held out against {nominal:.4} mm, which is not \
                 more than chance; the lines of the table are for comparison"
            ),
            _ => "no model predicts samples that were held out better than the nominal robot does: nominal is kept"
                .to_owned(),
        }
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

/// A list of which the first are said.
fn shortened(list: &[String]) -> String {
    const SAID: usize = 6;
    match list.len() {
        0..=SAID => list.join("; "),
        n => format!("{}; and {} more", list[..SAID].join("; "), n - SAID),
    }
}

impl Identifiability {
    fn nothing() -> Identifiability {
        Identifiability {
            rank: 0,
            parameters: 0,
            zero: Vec::new(),
            dependent: Vec::new(),
            condition: None,
            observability: None,
            weak: Vec::new(),
        }
    }
}

fn identifiability(formulation: &Formulation) -> Identifiability {
    let base = &formulation.base;
    let names: Vec<String> = formulation.parameters().iter().map(|p| p.name()).collect();
    let pick = |list: &[usize]| list.iter().map(|&i| names[i].clone()).collect::<Vec<_>>();
    Identifiability {
        rank: base.rank(),
        parameters: names.len(),
        zero: pick(&base.zero),
        dependent: base.groups(&names),
        condition: base.condition(),
        observability: base.observability(formulation.rows.rows.len()),
        weak: pick(&formulation.unmoved()),
    }
}

fn method_record(candidate: &Candidate, quality: Quality) -> MethodRecord {
    let solution = candidate.found.as_ref().map(|(_, s)| s);
    MethodRecord {
        name: candidate.name,
        model: candidate.model.name(),
        parameters: candidate.found.as_ref().map_or_else(Vec::new, |(f, s)| parameter_records(f, s)),
        fit: quality.fit,
        verify: quality.verify,
        held_out_mm: candidate.held_out_mm,
        cost_mm2: solution.map(|s| s.cost),
        iterations: solution.map_or(0, |s| s.iterations),
        evaluations: solution.map_or(0, |s| s.evaluations),
        stop: solution.map(|s| s.stop),
        history: solution.map_or_else(Vec::new, |s| s.history.clone()),
        history_evaluations: solution.map_or_else(Vec::new, |s| s.history_evaluations.clone()),
    }
}

fn parameter_records(formulation: &Formulation, solution: &Solution) -> Vec<ParameterRecord> {
    let fit = formulation.fit();
    let covariance: DMatrix<f64> = formulation.robot_covariance();
    let offsets = fit.offsets(&solution.x);
    let record = |(i, &parameter): (usize, &Parameter)| {
        let (unit, factor) = file_unit(parameter);
        let free = formulation.base.free.iter().position(|&f| f == i);
        let determined = !formulation.base.zero.contains(&i);
        let wall = |k: usize| {
            let (low, high, x) = (fit.lower()[k], fit.upper()[k], solution.x[k]);
            x - low < AT_WALL * (high - low) || high - x < AT_WALL * (high - low)
        };
        ParameterRecord {
            name: parameter.name(),
            unit,
            nominal: factor * formulation.rows.kinematics.nominal().value(parameter),
            delta: factor * offsets[i],
            sigma: determined.then(|| factor * covariance[(i, i)].max(0.0).sqrt()),
            identifiable: free.is_some(),
            at_bound: free.is_some_and(wall),
        }
    };
    formulation.parameters().iter().enumerate().map(record).collect()
}

/// Unit in files, and what to multiply mm or mrad by.
pub fn file_unit(parameter: Parameter) -> (&'static str, f64) {
    match (parameter, parameter.unit()) {
        (_, Unit::Mm) => ("mm", 1.0),
        (Parameter::Gravity(..) | Parameter::Bending(..), _) => ("mrad/m", 1.0),
        (Parameter::Harmonic(..) | Parameter::Wobble(..), _) => ("mrad", 1.0),
        (Parameter::Coupling(..), _) => ("1e-3", 1.0),
        _ => ("deg", (1e-3f64).to_degrees()),
    }
}
