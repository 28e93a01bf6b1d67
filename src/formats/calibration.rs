//! `calibration.json`: a rig as a file.

mod check;

use camino::{Utf8Path, Utf8PathBuf};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3, Vector6};
use serde::{Deserialize, Serialize};

pub use self::check::Check;
use super::{checked, export};
use crate::files::{self, Result};
use crate::geometry::rotation_matrix;
use crate::imaging::Board;
use crate::linear_algebra::rows;
use crate::progress;
use crate::stereo::board_pose::pair_excess::{farthest_pair, pair_excess};
use crate::stereo::calibrate::Calibration;
use crate::stereo::data::corner_noise::Noise;
use crate::stereo::judge::assessment::Judged;
use crate::stereo::judge::moves::KnownMove;
use crate::stereo::model::rig::{Covariance, Rig};
use crate::stereo::recheck::again::{self, Ends};
use crate::stereo::volume::Volume;
use crate::stereo::{Camera, Lens};

/// Version of the format that this program writes.
const VERSION: u32 = 1;

/// What files made elsewhere call a lens whose model the number of its coefficients tells.
const BY_LENGTH: &str = "opencv";

/// A rig in the file's words.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct CalibrationFile {
    version: u32,
    left: CameraRecord,
    right: CameraRecord,
    right_from_left: RigRecord,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    covariance: Option<CovarianceRecord>,
    /// How corners scattered at the calibration: what pictures that the rig measures later are compared with.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    corner_noise: Option<NoiseRecord>,
    /// Where the boards stood: what the rig was checked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    boards: Option<BoardsRecord>,
    /// The volume that the verdict was for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    volume: Option<Volume>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    check: Option<Check>,
    /// The board that calibrated, by its name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    board: Option<String>,
    /// How far black has spread on it, where that moves its corners.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    board_spread: Option<SpreadRecord>,
    /// Where each pair that was used had the first and the last corner of its pictures.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    ends_px: Vec<Ends>,
    /// Whether the last pairs confirmed the rig; empty where they did.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    unconfirmed: Vec<String>,
    /// How the rig had changed at the last pair since the moment for which it and its covariance are, each change in
    /// the covariance's order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    changes_since: Vec<Vec<f64>>,
    /// Slides of the board by known lengths, and what they say of the scale.
    #[serde(skip_deserializing, skip_serializing_if = "Vec::is_empty")]
    known_moves: Vec<KnownMove>,
}

/// By how much each side of a tag is printed farther out than it is drawn, with its expanded uncertainty (k = 2).
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct SpreadRecord {
    mm: f64,
    uncertainty_mm: f64,
}

/// Distances of the boards' corners from the left camera along its axis.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct BoardsRecord {
    nearest_mm: f64,
    farthest_mm: f64,
}

/// A rig and what its calibration says beside it; files made elsewhere do not say that.
#[derive(Debug, Clone)]
pub struct Calibrated {
    pub rig: Rig,
    pub noise: Option<Noise>,
    /// How far pairs scattered about the rig beyond that, as a variance.
    pub pair_excess: Option<f64>,
    /// How far the pair disagreed that did most, as chi-square of six numbers beside that.
    pub farthest_pair: Option<f64>,
    /// How many pairs with poses of their own made the rig.
    pub pairs: Option<usize>,
    /// Variances of the six numbers of `right_from_left` from pair to pair, rad^2 and mm^2.
    pub pair_motion: Option<Vector6<f64>>,
    /// The volume that the verdict was for.
    pub volume: Option<Volume>,
    pub check: Option<Check>,
    pub board: Option<Board>,
    /// Where each pair that was used had the first and the last corner of its pictures.
    pub ends_px: Vec<Ends>,
    /// The calibration's last pairs, where they contradict the rig.
    pub unconfirmed: Vec<String>,
}

impl Calibrated {
    /// Whether the check of its lengths ended with FAIL.
    pub fn has_failed(&self) -> bool {
        self.check.is_some_and(|check| check.has_failed())
    }

    /// What lengths can be trusted to by its own calibration, mm.
    pub fn trusted_mm(&self) -> Option<f64> {
        self.check?.trusted_mm()
    }

    /// What its own calibration says against the rig, for those who use it.
    pub fn doubts(&self) -> Vec<String> {
        let changed = self.unconfirmed.first().map(|last| {
            format!("the calibration's last pairs contradict it (from pair {last} on): the rig may have changed since. Calibrate it as it is now")
        });
        changed.into_iter().chain(self.check.and_then(|check| check.doubt())).collect()
    }
}

/// `factor` times the covariance that the refinement gives a corner, plus the square of `added_px` on both axes.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct NoiseRecord {
    factor: f64,
    added_px: f64,
    /// How far pairs scattered about the rig beyond that, as a variance; one where they did not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pair_excess: Option<f64>,
    /// How far the pair disagrees with the rig that does most, as chi-square of six numbers beside that excess.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    farthest_pair: Option<f64>,
    /// How many pairs with poses of their own say so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pairs: Option<usize>,
    /// Standard deviations of the six numbers of `right_from_left` from pair to pair, in the covariance's order: rad
    /// and mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pair_motion: Option<[f64; 6]>,
}

impl NoiseRecord {
    fn pair_motion(&self) -> Option<Vector6<f64>> {
        let sigmas = self.pair_motion.filter(|sigmas| sigmas.iter().all(|s| s.is_finite() && *s > 0.0))?;
        Some(Vector6::from(sigmas.map(|sigma| sigma * sigma)))
    }
}

#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct CameraRecord {
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    model: String,
    distortion: Vec<f64>,
}

#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct RigRecord {
    rotation: Vec<Vec<f64>>,
    translation_mm: Vec<f64>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct CovarianceRecord {
    order: Vec<String>,
    matrix: Vec<Vec<f64>>,
}

impl From<&Camera> for CameraRecord {
    fn from(camera: &Camera) -> CameraRecord {
        CameraRecord {
            width: camera.width,
            height: camera.height,
            fx: camera.fx,
            fy: camera.fy,
            cx: camera.cx,
            cy: camera.cy,
            model: camera.lens.name().to_owned(),
            distortion: camera.distortion[..camera.lens.vector_length()].to_vec(),
        }
    }
}

impl CameraRecord {
    fn camera(&self) -> Result<Camera, String> {
        let lens = match Lens::from_name(&self.model) {
            Some(lens) => lens,
            None if self.model == BY_LENGTH => checked::lens_of_length(self.distortion.len())?,
            None => {
                let names = Lens::LADDER.map(Lens::name).join(", ");
                return Err(format!("model is \"{}\"; it is one of {names}, or {BY_LENGTH}", self.model));
            }
        };
        let count = self.distortion.len();
        if count != lens.vector_length() && count != lens.free_count() {
            let needed = lens.vector_length();
            return Err(format!("distortion has {count} numbers; the {} model has {needed}", lens.name()));
        }
        let size = (f64::from(self.width), f64::from(self.height));
        checked::camera(size, &[self.fx, self.fy, self.cx, self.cy], lens, &self.distortion)
    }
}

impl From<&Rig> for CalibrationFile {
    fn from(rig: &Rig) -> CalibrationFile {
        let r = rotation_matrix(&rig.right_from_left);
        let t = rig.right_from_left.translation.vector;
        CalibrationFile {
            version: VERSION,
            left: (&rig.left).into(),
            right: (&rig.right).into(),
            right_from_left: RigRecord { rotation: rows(&r), translation_mm: vec![t.x, t.y, t.z] },
            covariance: rig
                .covariance
                .as_ref()
                .map(|c| CovarianceRecord { order: c.order.clone(), matrix: rows(&c.matrix) }),
            ..CalibrationFile::default()
        }
    }
}

impl CalibrationFile {
    /// The same with how corners scattered, between which depths the boards' corners were, the verdict and the volume
    /// that it was for, the last pairs where they contradict the rig, and how it changed since the moment that it is
    /// that of.
    pub fn with_check(mut self, calibration: &Calibration, judged: &Judged) -> CalibrationFile {
        let noise = &calibration.own_noise;
        let facts = &judged.facts;
        let [nearest_mm, farthest_mm] = facts.coverage.corner_depths_mm;
        let (verdict, tolerance_mm) = (judged.verdict, facts.tolerance_mm);
        self.check = Some(Check {
            verdict,
            tolerance_mm,
            trusted_mm: judged.trusted_mm(),
            length_mm: Some(facts.volume.length_mm),
        });
        self.volume = Some(facts.volume.volume.clone());
        self.ends_px = calibration.views.iter().map(again::of_view).collect();
        self.unconfirmed = calibration.standing.unconfirmed.clone();
        self.changes_since = calibration.since_moment.iter().map(|step| step.as_slice().to_vec()).collect();
        self.corner_noise = Some(NoiseRecord {
            factor: noise.factor,
            added_px: noise.added_px,
            pair_excess: Some(pair_excess(calibration)),
            farthest_pair: farthest_pair(calibration),
            pairs: Some(calibration.pair_scatter.groups),
            pair_motion: calibration.pair_motion().map(|[variances, _]| variances.map(f64::sqrt).into()),
        });
        self.boards = Some(BoardsRecord { nearest_mm, farthest_mm });
        self.board = Some(calibration.board.to_string());
        self.board_spread = calibration.spread_mm().map(|[mm, uncertainty_mm]| SpreadRecord { mm, uncertainty_mm });
        self.known_moves = facts.standards.moves.measured.clone();
        self
    }

    fn noise(&self) -> Option<Noise> {
        let noise =
            self.corner_noise.filter(|n| n.factor >= 0.0 && n.added_px >= 0.0 && n.factor + n.added_px > 0.0)?;
        Some(Noise { factor: noise.factor, added_px: noise.added_px, reduced_chi_square: None })
    }

    fn rig(&self) -> Result<Rig, String> {
        if self.version != VERSION {
            return Err(format!("version {} of the format; this program reads version {VERSION}", self.version));
        }
        let left = self.left.camera().map_err(|e| format!("left camera: {e}"))?;
        let right = self.right.camera().map_err(|e| format!("right camera: {e}"))?;
        let RigRecord { rotation, translation_mm } = &self.right_from_left;
        if rotation.len() != 3 || rotation.iter().any(|row| row.len() != 3) {
            let found: Vec<String> = rotation.iter().map(|row| row.len().to_string()).collect();
            return Err(format!(
                "right_from_left.rotation has {} rows of {} numbers; three rows of three are needed",
                rotation.len(),
                found.join(", ")
            ));
        }
        let t = <[f64; 3]>::try_from(translation_mm.as_slice()).map(Vector3::from).map_err(|_| {
            format!("right_from_left.translation_mm has {} numbers; three are needed", translation_mm.len())
        })?;
        let rotation = ("right_from_left.rotation", Matrix3::from_fn(|i, j| rotation[i][j]));
        let mut covariance = self.covariance.as_ref().map(|c| c.covariance()).transpose()?;
        for change in &self.changes_since {
            let Some(covariance) = covariance.as_mut().filter(|c| c.order.len() == change.len()) else {
                return Err("changes_since has a row that is not as long as covariance.order".to_owned());
            };
            // What is measured later is measured after the change.
            let step = DVector::from_column_slice(change);
            covariance.matrix += &step * step.transpose();
        }
        checked::rig((left, right), rotation, t, covariance)
    }
}

impl CovarianceRecord {
    fn covariance(&self) -> Result<Covariance, String> {
        let n = self.order.len();
        if self.matrix.len() != n || self.matrix.iter().any(|row| row.len() != n) {
            return Err(format!("covariance.matrix is not {n} by {n}, the length of covariance.order"));
        }
        Ok(Covariance { order: self.order.clone(), matrix: DMatrix::from_fn(n, n, |i, j| self.matrix[i][j]) })
    }
}

/// The own format's name in a results folder.
pub const OWN_NAME: &str = "calibration.json";

/// The file that a command reads its rig from: what was named, else `calibration.json` of the results folder, or of the
/// usual one, which is then said. Of a folder, the own file or else the one that another format goes by; an error where
/// there is none, or where it could be either of two.
pub fn file(named: Option<&Utf8Path>, out: &Utf8Path, usual: &Utf8Path) -> Result<Utf8PathBuf> {
    let Some(named) = named else {
        let found = files::or_usual(out, OWN_NAME, usual);
        if found.parent() != Some(out) {
            progress::note(format!(
                "the rig is that of {found}: none stands in {out}; `--calibration FILE` names another"
            ));
        }
        return Ok(found);
    };
    if !named.is_dir() {
        return Ok(named.to_owned());
    }
    let there = |name: &&str| named.join(name).is_file();
    if there(&OWN_NAME) {
        return Ok(named.join(OWN_NAME));
    }
    let found: Vec<&str> = export::NAMES.into_iter().filter(there).collect();
    let message = match found[..] {
        [one] => return Ok(named.join(one)),
        [] => format!("no calibration in this folder: neither {OWN_NAME} nor {}", export::NAMES.join(", ")),
        _ => format!("this folder holds several calibrations: {}", found.join(", ")),
    };
    Err(files::Error::format(named, None, message, Some("name the file: `--calibration FILE`")))
}

/// Reads `calibration.json` with what it says beside the rig, or one of the formats that [`crate::formats::export`]
/// writes.
pub fn read(path: &Utf8Path) -> Result<Calibrated> {
    const WHAT: &str = "calibration file";
    let hint = "`stereocal camera-check IMAGES` writes out/calibration.json; `--calibration FILE` names another";
    let text = files::read_text(path, WHAT, Some(hint))?;
    let refused = |message: String| files::Error::format(path, None, message, None);
    let (file, rig) = match export::read(path, &text) {
        // Of such a rig nothing else is known.
        Some(rig) => rig.map(|rig| (CalibrationFile::from(&rig), rig)),
        None => {
            let file = files::read_json::<CalibrationFile>(path, WHAT, Some(hint))?;
            file.rig().map(|rig| (file, rig))
        }
    }
    .map_err(refused)?;
    Ok(Calibrated {
        rig,
        noise: file.noise(),
        pair_excess: file.corner_noise.and_then(|n| n.pair_excess).filter(|e| *e >= 1.0),
        farthest_pair: file.corner_noise.and_then(|n| n.farthest_pair),
        pairs: file.corner_noise.and_then(|n| n.pairs),
        pair_motion: file.corner_noise.and_then(|n| n.pair_motion()),
        board: file.board.as_ref().and_then(|name| name.parse().ok()),
        volume: file.volume,
        check: file.check,
        ends_px: file.ends_px,
        unconfirmed: file.unconfirmed,
    })
}

#[cfg(test)]
mod tests;
