//! What was found by each method, parameter by parameter, and what the poses determine.

use nalgebra::DMatrix;
use serde::Serialize;

use crate::identify::model::base::Observability;
use crate::identify::record::quality::Quality;
use crate::identify::run::Candidate;
use crate::identify::solve::formulation::Formulation;
use crate::identify::solve::problem::{Problem, Solution, Stop};
use crate::robot::Parameter;

/// A limit of the search counts as reached within this fraction of its width.
const AT_LIMIT: f64 = 1e-3;

/// One method on one model.
#[derive(Debug, Clone, Serialize)]
pub struct MethodRecord {
    pub name: &'static str,
    pub model: &'static str,
    pub parameters: Vec<ParameterRecord>,
    #[serde(flatten)]
    pub quality: Quality,
    /// Root mean square held-out error that the choice went by, mm.
    pub held_out_mm: Option<f64>,
    /// Least cost, mm^2.
    pub cost_mm2: Option<f64>,
    pub iterations: usize,
    pub evaluations: usize,
    pub stop: Option<Stop>,
    /// Best cost after each iteration, mm^2.
    pub history: Vec<f64>,
    /// Evaluations used by then.
    pub history_evaluations: Vec<usize>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterRecord {
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
    /// Whether it reached the limit of its search.
    pub at_bound: bool,
}

/// What the poses determine.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Identifiability {
    /// Number of base parameters.
    pub rank: usize,
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

pub(super) fn identifiability(formulation: &Formulation) -> Identifiability {
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

pub(super) fn method_record(candidate: &Candidate, quality: Quality) -> MethodRecord {
    let solution = candidate.found.as_ref().map(|(_, s)| s);
    MethodRecord {
        name: candidate.name,
        model: candidate.model.name(),
        parameters: candidate.found.as_ref().map_or_else(Vec::new, |(f, s)| parameter_records(f, s)),
        quality,
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
        let (unit, factor) = parameter.file_unit();
        let free = formulation.base.free.iter().position(|&f| f == i);
        let determined = !formulation.base.zero.contains(&i);
        let at_limit = |k: usize| {
            let (low, high, x) = (fit.lower()[k], fit.upper()[k], solution.x[k]);
            x - low < AT_LIMIT * (high - low) || high - x < AT_LIMIT * (high - low)
        };
        ParameterRecord {
            name: parameter.name(),
            unit,
            nominal: factor * formulation.rows.kinematics.nominal.value(parameter),
            delta: factor * offsets[i],
            sigma: determined.then(|| factor * covariance[(i, i)].max(0.0).sqrt()),
            identifiable: free.is_some(),
            at_bound: free.is_some_and(at_limit),
        }
    };
    formulation.parameters().iter().enumerate().map(record).collect()
}
