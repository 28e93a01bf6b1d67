//! Gathers what stands in `identification.json`.

use super::file::{Record, Smooth};
use super::findings::Findings;
use super::parameters::{self, Identifiability, MethodRecord};
use super::quality::quality;
use super::touched::Touched;
use crate::identify::data::dataset::Dataset;
use crate::identify::examine::in_hand::most_points;
use crate::identify::examine::sessions::Along;
use crate::identify::judge::recheck::variances_along;
use crate::identify::judge::uncertainty::{Covariance, Expected};
use crate::identify::run::{Identification, certainty};
use crate::identify::sensor::Extra;
use crate::identify::settings::{Model, Settings};
use crate::measurements::Given;
use crate::robot::tool_fit::Start;
use crate::robot::{Advice, Robot};

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
        let (chosen, formulation) = (&found.candidates[found.chosen], found.formulation());
        // Nominal has nothing to say about what the poses determine; the fit that it was kept against has.
        let fitted = chosen.found.as_ref().or(found.candidates.first().and_then(|c| c.found.as_ref()));
        let identifiability = fitted.map_or_else(Identifiability::default, |(f, _)| parameters::identifiability(f));
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
            not_run: None,
            identifiability,
            advice: Advice::Use,
            reason: String::new(),
            is_beyond: false,
            is_computed: false,
            of_catalogue: Vec::new(),
            warnings: Vec::new(),
            outliers: set.names(&found.outliers),
            strays: set.names(found.strays(set)),
            sessions: along.sessions.clone(),
            rows: Given::default(),
            skipped: set.skipped.clone(),
            judged: found.judged.clone(),
            smooth: Smooth::new(found),
            scatter_mm: found.scatter.point_mm,
            scatter_rad: (chosen.model == Model::Pose && formulation.is_some()).then_some(found.scatter.rotation_rad),
            widened: formulation.map_or_else(Vec::new, |f| f.widened.clone()),
            prior: fitted.filter(|(f, _)| f.held).map(|(f, _)| f.tolerance),
            doctor: findings.all(),
            covariance: formulation.map(|f| Covariance::new(f, &f.robot_covariance())),
            whole_covariance: formulation.map(|f| Covariance::new(f, &f.whole_covariance())),
            variance_along: formulation.map_or_else(Vec::new, variances_along).into_iter().collect(),
            expected: formulation.map(|f| Expected::new(f, set, &found.fitted, &found.outliers)),
            scale: found.scale(set),
            targets: set.targets.clone().map(|targets| targets.solved(&found.extras)),
            repeats: set.repeats.clone(),
            certainty: certainty(&found.judged, &found.terms),
            folded: !found.deletions.is_empty(),
            tool_mm: asked_tool(set, nominal),
            sensor: found.extras.iter().filter(|_| !set.are_on_flange()).map(|(e, v)| of_sensor(set, *e, *v)).collect(),
        };
        record.advise(set, nominal, found, &findings, found.against_nominal(set, nominal, settings));
        record
    }
}

/// The tool that a chain asks for, mm, and what it leaves with it (mm, median), where it makes it far nearer to the
/// points of the placement with most rows, or brings touches far nearer to each other.
pub fn asked_tool(set: &Dataset, nominal: &Robot) -> Option<([f64; 3], f64)> {
    /// Times that the chain must come nearer by a tool of its own.
    const FAR_NEARER: f64 = 3.0;
    if let Some(touched) = Touched::new(set, nominal) {
        let is_nearer = touched.left_mm * FAR_NEARER < touched.before_mm;
        return is_nearer.then(|| (touched.tool_mm.into(), touched.left_mm));
    }
    let (joints, points) = most_points(set);
    let (before, after) = (nominal.left_mm(&joints, &points)?, nominal.fit_tool(&joints, &points, Start::Around)?);
    (after.left_mm * FAR_NEARER < before).then(|| (after.tool_mm.into(), after.left_mm))
}
