//! The calibration as a whole against known truth: recovery, predicted scatter, symmetry, and what must be refused.

mod known_lenses;
mod models;
mod open_numbers;
mod partial;
mod recovery;
mod refusals;
mod scatter;
mod target;

use nalgebra::{DMatrix, DVector};

use crate::imaging::Corners;
use crate::stereo::calibrate::{Calibration, calibrate};
use crate::stereo::judge::assessment::Judged;
use crate::stereo::judge::ledger::Standards;
use crate::stereo::judge::lengths::held_out;
use crate::stereo::model::Shared;
use crate::stereo::select::options::Options;
use crate::stereo::synthetic::{self, BROWN4, World};

fn judged(corners: &Corners, options: &Options, tolerance_mm: f64) -> Judged {
    synthetic::judged(&calibrate(corners, options).unwrap(), Vec::new(), Standards::default(), tolerance_mm)
}

/// The stated covariance of some numbers.
fn covariance_of(calibration: &Calibration, names: &[&str]) -> DMatrix<f64> {
    calibration.rig().covariance.as_ref().unwrap().part(names).unwrap()
}

/// Deviations of the shared numbers from the truth, in the coordinates of the covariance.
fn deviations(calibration: &Calibration, world: &World) -> DVector<f64> {
    let truth = Shared { rig: world.rig.clone(), shape_mm: [world.bow_mm[0], world.bow_mm[1], world.twist_mm] };
    calibration.layout.between(&truth, &calibration.values.shared)
}
