//! Errors of a robot on the rows of a data set, as they go into tables, figures and files.

use serde::Serialize;

use crate::identify::data::dataset::Dataset;
use crate::identify::judge::errors::{Judge, RowError, Spread};
use crate::identify::run::Identification;
use crate::identify::sensor::Extra;
use crate::identify::settings::Settings;
use crate::robot::Robot;

/// Errors of a robot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quality {
    /// On the rows that were fitted.
    pub fit: PointSpread,
    /// On the rows that were not.
    pub verify: PointSpread,
    /// The same without those that fit far worse than the rest, by which nothing is judged; absent without any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verify_without_strays: Option<PointSpread>,
}

impl Quality {
    /// What the robot is judged by.
    pub fn judged(&self) -> &PointSpread {
        self.verify_without_strays.as_ref().unwrap_or(&self.verify)
    }
}

/// Distance errors, and with positions point errors.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointSpread {
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

/// Errors of rows under a robot, as they go into tables and figures.
/// A robot that was `fitted` is judged on rows that its fit was without.
pub fn quality(
    set: &Dataset,
    robot: &Robot,
    fitted: bool,
    found: &Identification,
    settings: &Settings,
) -> (Quality, Vec<RowError>) {
    // Points and distances as they were read, as `verify` takes them, which knows nothing of the sensor's errors; where
    // targets stand is none.
    let of_targets = |extra: &Extra| matches!(extra, Extra::Target(_)) || set.are_on_flange();
    let extras: Vec<(Extra, f64)> = found.extras.iter().copied().filter(|(extra, _)| of_targets(extra)).collect();
    let judge = Judge { extras: &extras, ..Judge::plain(set, &found.fitted, settings.wire_offset) };
    let (fit, verify) = (judge.errors(robot, &found.fitted), found.held_out_errors(&judge, robot, fitted, &[]));
    let strays = found.strays(set);
    let without_strays = || {
        let errors = found.held_out_errors(&judge, robot, fitted, strays);
        let rows: Vec<usize> = found.judged_rows(set).into_iter().filter(|row| !strays.contains(row)).collect();
        spread(&judge, robot, &errors, &rows)
    };
    let quality = Quality {
        fit: spread(&judge, robot, &fit, &found.fitted),
        verify: spread(&judge, robot, &verify, &found.judged_rows(set)),
        verify_without_strays: (!strays.is_empty()).then(without_strays),
    };
    (quality, verify)
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
