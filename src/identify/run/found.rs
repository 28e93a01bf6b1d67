//! What an identification ends with.

use super::forward_selection::Judged;
use crate::identify::data::dataset::Dataset;
use crate::identify::judge::scale::CommonScale;
use crate::identify::judge::smooth;
use crate::identify::model::ladder::Terms;
use crate::identify::sensor::{Extra, Scatter};
use crate::identify::settings::Model;
use crate::identify::solve::formulation::Formulation;
use crate::identify::solve::problem::Solution;
use crate::robot::{Parameter, Robot};

/// One method on one model, fitted to all rows that may be fitted.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// How it was found: a method's name, or `nominal`.
    pub name: &'static str,
    /// What was minimised.
    pub model: Model,
    /// What the problem looked like, and what came out; nothing of the nominal robot.
    pub found: Option<(Formulation, Solution)>,
    pub robot: Robot,
    /// Root mean square held-out error of a number, mm, of the model where this ends at its least cost; `None` where it does not, or
    /// was not judged.
    pub held_out_mm: Option<f64>,
}

/// Everything that was found.
#[derive(Debug, Clone)]
pub struct Identification {
    pub candidates: Vec<Candidate>,
    /// Index of the one to use.
    pub chosen: usize,
    /// The rung that was taken.
    pub terms: Terms,
    /// Rungs as they were judged.
    pub judged: Vec<Judged>,
    /// Rows that were left out because they fit far worse than the rest.
    pub outliers: Vec<usize>,
    /// Rows that were fitted and are further off than chance allows.
    pub doubtful: Vec<usize>,
    /// Verify rows that are as far off as those left out; they are still counted.
    pub verify_outliers: Vec<usize>,
    pub fitted: Vec<usize>,
    /// The scatter that is left of the chosen fit.
    pub scatter: Scatter,
    /// A smooth error that the points of each placement share.
    pub smooth: Option<smooth::Detected>,
    /// Unknowns of the sensor, and their values.
    pub extras: Vec<(Extra, f64)>,
    /// Whether the nominal robot was kept because the verify rows found the other one worse.
    pub vetoed: bool,
    /// The fits that rows were left out of, where no row is there to verify.
    pub deletions: Vec<Deletion>,
    /// The parameters that they change.
    pub(super) deleted_parameters: Vec<Parameter>,
}

/// A fit without some of the rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Deletion {
    /// The rows that were left out.
    pub rows: Vec<usize>,
    /// What the parameters change by, mm and mrad, and behind them the unknowns of the sensor.
    pub change: Vec<f64>,
}

impl Identification {
    /// The robot to use.
    pub fn robot(&self) -> &Robot {
        &self.candidates[self.chosen].robot
    }

    /// The problem that it solves; `None` where it is the nominal one.
    pub fn formulation(&self) -> Option<&Formulation> {
        self.candidates[self.chosen].found.as_ref().map(|(formulation, _)| formulation)
    }

    /// A scale of the readings, as the chosen robot has it.
    pub fn scale(&self, set: &Dataset) -> Option<CommonScale> {
        CommonScale::new(set, &self.terms, self.formulation()?)
    }

    pub(super) fn keep_nominal(&mut self, robot: &Robot, model: Model, held_out_mm: Option<f64>) {
        let robot = robot.clone();
        self.candidates.push(Candidate { name: "nominal", model, found: None, robot, held_out_mm });
        self.chosen = self.candidates.len() - 1;
        self.terms = Terms::NOMINAL;
    }
}

impl Candidate {
    /// What its method minimised; infinite of the nominal robot.
    pub(super) fn cost(&self) -> f64 {
        self.found.as_ref().map_or(f64::INFINITY, |(_, solution)| solution.cost)
    }
}
