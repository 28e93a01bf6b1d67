//! The chosen robot on rows that took no part in its fit, beside the nominal one.
//!
//! In: what was identified. Out: errors of the rows to verify, or without any of every row in the fits that it was left out of, and whether they
//! find the robot worse than the nominal one by more than another draw of rows would let expect (Student's test of the rows' differences).

use std::collections::BTreeSet;

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::found::{Deletion, Identification};
use crate::identify::data::dataset::Dataset;
use crate::identify::judge::errors::{Judge, RowError};
use crate::identify::judge::folds;
use crate::identify::sensor::Extra;
use crate::identify::settings::Settings;
use crate::robot::Robot;

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
    /// Rows by which robots are judged: those to verify, without any all that were fitted.
    pub fn judged_rows(&self, set: &Dataset) -> Vec<usize> {
        if self.deletions.is_empty() {
            return set.verify_rows();
        }
        let rows: BTreeSet<usize> = self.deletions.iter().flat_map(|d| d.rows.iter().copied()).collect();
        rows.into_iter().collect()
    }

    /// Rows to verify that fit far worse than the rest and by which nothing is judged: one, or a tenth of them. More than that are no strays.
    pub fn strays(&self, set: &Dataset) -> &[usize] {
        let most = (set.verify_rows().len() / 10).max(1);
        if self.verify_outliers.len() <= most { &self.verify_outliers } else { &[] }
    }

    /// Errors of a robot on rows that took no part in its fit: the rows to verify, or every row in the fits that it was left out of. A robot
    /// that was `fitted` changes as the chosen one does where rows are left out; the nominal one does not. `judge` is for all fitted rows; rows to
    /// verify that are `strays` are in no error, not even by the place that the others are judged from.
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

    /// How rows that took no part in the fit find the chosen robot against the nominal one: by points where there are any, in units of what
    /// they are known to; by distances otherwise. Distances of points share the point that they start at, which is one draw.
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
}
