//! What an identification ends with, how rows that took no part in the fit find it, and where the sensor stands.
//!
//! Errors are of the rows to verify, or without any of every row in the fits that it was left out of; they find the
//! robot worse than the nominal one by more than another draw of rows would let expect or not (Student's test of the
//! rows' differences).

use std::collections::BTreeSet;

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::forward_selection::Judged;
use crate::identify::Error;
use crate::identify::data::dataset::{Dataset, Kind};
use crate::identify::judge::errors::{Judge, RowError};
use crate::identify::judge::placement::{Placed, is_held};
use crate::identify::judge::scale::CommonScale;
use crate::identify::judge::{folds, smooth};
use crate::identify::model::ladder::Terms;
use crate::identify::sensor::{Extra, Scatter};
use crate::identify::settings::{Model, Settings};
use crate::identify::solve::formulation::Formulation;
use crate::identify::solve::problem::Solution;
use crate::identify::solve::task::Task;
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
    /// Root mean square held-out error of a number, mm, of the model where this ends at its least cost; `None` where it
    /// does not, or was not judged.
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

/// Chance with which rows find a robot worse that is not.
const CHANCE: f64 = 0.05;

/// How the verify rows, or rows left out of a fit, find the chosen robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Against {
    /// Not worse than the nominal one.
    NotWorse,
    /// Worse, by no more than another draw of rows might.
    Perhaps,
    Worse,
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

    /// Rows by which robots are judged: those to verify, with too few of them all that were fitted.
    pub fn judged_rows(&self, set: &Dataset) -> Vec<usize> {
        if self.deletions.is_empty() {
            return set.verify_rows();
        }
        let rows: BTreeSet<usize> = self.deletions.iter().flat_map(|d| d.rows.iter().copied()).collect();
        rows.into_iter().collect()
    }

    /// Rows to verify that fit far worse than the rest and by which nothing is judged: one, or a tenth of them. More
    /// than that are no strays.
    pub fn strays(&self, set: &Dataset) -> &[usize] {
        let most = (set.verify_rows().len() / 10).max(1);
        if self.verify_outliers.len() <= most { &self.verify_outliers } else { &[] }
    }

    /// Errors of a robot on rows that took no part in its fit: the rows to verify, or every row in the fits that it was
    /// left out of. A robot that was `fitted` changes as the chosen one does where rows are left out; the nominal one
    /// does not. `judge` is for all fitted rows; rows to verify that are `strays` are in no error, not even by the
    /// place that the others are judged from.
    pub fn held_out_errors(&self, judge: &Judge, robot: &Robot, fitted: bool, strays: &[usize]) -> Vec<RowError> {
        if self.deletions.is_empty() {
            let mut rows = judge.set.verify_rows();
            rows.retain(|row| !strays.contains(row));
            return judge.errors(robot, &rows);
        }
        let part = |Deletion { rows, change }: &Deletion| {
            if !fitted {
                return folds::without(judge, robot, rows);
            }
            let (of_robot, of_sensor) = change.split_at(self.deleted_parameters.len());
            let changed = |&(extra, value): &(Extra, f64)| {
                let at = self.extras.iter().position(|(e, _)| *e == extra);
                (extra, value + at.and_then(|at| of_sensor.get(at)).unwrap_or(&0.0))
            };
            let extras: Vec<(Extra, f64)> = judge.extras.iter().map(changed).collect();
            let judge = Judge { extras: &extras, ..judge.clone() };
            folds::without(&judge, &robot.shifted(&self.deleted_parameters, of_robot), rows)
        };
        folds::one_a_row(judge.set, self.deletions.iter().flat_map(part))
    }

    /// How rows that took no part in the fit find the chosen robot against the nominal one: by points where there are
    /// any, in units of what they are known to; by distances otherwise. Distances of points share the point that they
    /// start at, which is one draw.
    pub fn against_nominal(&self, set: &Dataset, nominal: &Robot, settings: &Settings) -> Against {
        if self.formulation().is_none() {
            return Against::NotWorse;
        }
        let judge = Judge { extras: &self.extras, ..Judge::plain(set, &self.fitted, settings.wire_offset) };
        let [chosen, before] = [(self.robot(), true), (nominal, false)]
            .map(|(robot, fitted)| self.held_out_errors(&judge, robot, fitted, &self.verify_outliers));
        let points = chosen.iter().any(|e| e.point_mm.is_some());
        let size = |e: &RowError| match points {
            true => e.score(&self.scatter),
            false => e.distance_mm.map(f64::abs),
        };
        let more: Vec<f64> = chosen.iter().zip(&before).filter_map(|(c, b)| Some(size(c)? - size(b)?)).collect();
        let count = more.len() as f64;
        let mean = more.iter().sum::<f64>() / count;
        if more.is_empty() || mean <= 0.0 {
            return Against::NotWorse;
        }
        let spread = (more.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0) / count).sqrt();
        let limit = match StudentsT::new(0.0, 1.0, count - 1.0) {
            Ok(student) if more.len() > 1 => student.inverse_cdf(1.0 - CHANCE) * spread,
            _ => f64::INFINITY,
        };
        if mean > limit { Against::Worse } else { Against::Perhaps }
    }

    /// The placements of the chosen robot. A robot that was found by distances, or kept nominal, is placed by a fit of
    /// points to it; `None` of readings that are no points.
    pub fn placed(&self, set: &Dataset, nominal: &Robot, settings: &Settings) -> Result<Option<Placed>, Error> {
        if set.kind != Kind::Positions {
            return Ok(None);
        }
        let found = self.candidates[self.chosen].found.as_ref();
        let of_points = found.filter(|(f, _)| matches!(f.model, Model::Position | Model::Pose));
        let anew;
        let (formulation, of_robot) = match (of_points, found) {
            (Some((f, solution)), _) => (f, f.offsets_at(&solution.x)),
            (None, found) => {
                anew = self.by_points(set, nominal, settings)?;
                (&anew, found.map_or(Vec::new(), |(f, solution)| f.offsets_at(&solution.x)))
            }
        };
        let count = formulation.parameters().len();
        let joints = nominal.joints.len();
        let shared = formulation.offsets_covariance(&|parameter| is_held(parameter, joints));
        // A placement is for readings as they are read: the sensor's own errors stay in them. Where targets stand is
        // none of these.
        let (mut offsets, mut sensor) = (of_robot[..count].to_vec(), vec![0.0; count]);
        for (extra, value) in formulation.rows.extras.iter().zip(formulation.extras()) {
            let of_target = match extra {
                Extra::Target(_) => true,
                Extra::Shared(_) => set.are_on_flange(),
                Extra::Zero | Extra::Warp(_) => false,
            };
            offsets.push(if of_target { *value } else { 0.0 });
            sensor.push(if of_target { 0.0 } else { *value });
        }
        let parameters = formulation.parameters();
        let load_chain = nominal.shifted(parameters, &offsets[..count]);
        let plain = Task::plain(set, nominal, parameters, &self.fitted, settings);
        let task = Task { extras: &formulation.rows.extras, model: formulation.model, ..plain };
        let rows = task.rows_at(formulation.rows.scatter, &load_chain);
        Ok(Placed::new(set, &rows, &offsets, &sensor, &shared, formulation.common))
    }

    /// The chosen terms with the points of all groups in frames of their own.
    fn by_points(&self, set: &Dataset, nominal: &Robot, settings: &Settings) -> Result<Formulation, Error> {
        let oriented = set.has_rotations() && settings.model.is_none();
        let turned = set.target_unknowns(oriented);
        let mut extras: Vec<Extra> = self.extras.iter().map(|(extra, _)| *extra).collect();
        extras.extend(turned.iter().filter(|t| !self.extras.iter().any(|(e, _)| e == *t)));
        let parameters = self.terms.parameters(nominal);
        let plain = Task::plain(set, nominal, &parameters, &self.fitted, settings);
        let (model, smooth) =
            (if oriented { Model::Pose } else { Model::Position }, self.smooth.map(|told| told.error));
        Formulation::new(&Task { extras: &extras, model, smooth, ..plain })
    }
}

impl Candidate {
    /// What its method minimised; infinite of the nominal robot.
    pub(super) fn cost(&self) -> f64 {
        self.found.as_ref().map_or(f64::INFINITY, |(_, solution)| solution.cost)
    }
}

#[cfg(test)]
mod tests;
