//! `calibration.json`: a rig as a file.

use camino::Utf8Path;
use nalgebra::{DMatrix, Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::rig::{Covariance, Rig};
use super::{Camera, Lens};
use crate::error::{Place, Result};
use crate::files;
use crate::geometry::{rotation_matrix, transform_from_matrix};

/// Version of the format that this program writes.
const VERSION: u32 = 1;

/// How far the rows of a rotation in a file may be from orthonormal: files made elsewhere carry 6 digits or so.
const ORTHONORMAL: f64 = 1e-4;

/// A rig in the file's words.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct CalibrationFile {
    version: u32,
    left: CameraRecord,
    right: CameraRecord,
    right_from_left: RigRecord,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    covariance: Option<CovarianceRecord>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
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

#[derive(Debug, Clone, Serialize, Deserialize)]
struct RigRecord {
    rotation: [[f64; 3]; 3],
    translation_mm: [f64; 3],
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
    fn camera(&self) -> std::result::Result<Camera, String> {
        let finite = [self.fx, self.fy, self.cx, self.cy].iter().chain(&self.distortion).all(|v| v.is_finite());
        if !finite || self.fx <= 0.0 || self.fy <= 0.0 {
            return Err("fx and fy must be positive, and every number finite".to_owned());
        }
        if self.width == 0 || self.height == 0 {
            return Err("width and height must be positive".to_owned());
        }
        let by_length = match self.distortion.len() {
            0 | 2 => Lens::Radial2,
            4 => Lens::Brown4,
            5 => Lens::Brown5,
            8 => Lens::Rational8,
            12 => Lens::ThinPrism12,
            14 => Lens::Tilted14,
            n => return Err(format!("distortion has {n} numbers; OpenCV's order has 4, 5, 8, 12 or 14")),
        };
        // Files made elsewhere name the model in their own way; the length of the vector decides, except that
        // two free terms are written as four numbers.
        let lens = match Lens::from_name(&self.model) {
            Some(lens) if lens.vector_length() == self.distortion.len() => lens,
            _ => by_length,
        };
        let mut distortion = [0.0; 14];
        distortion[..self.distortion.len()].copy_from_slice(&self.distortion);
        Ok(Camera {
            width: self.width,
            height: self.height,
            fx: self.fx,
            fy: self.fy,
            cx: self.cx,
            cy: self.cy,
            lens,
            distortion,
        })
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
            right_from_left: RigRecord {
                rotation: [0, 1, 2].map(|i| [r[(i, 0)], r[(i, 1)], r[(i, 2)]]),
                translation_mm: [t.x, t.y, t.z],
            },
            covariance: rig.covariance.as_ref().map(|c| CovarianceRecord {
                order: c.order.clone(),
                matrix: c.matrix.row_iter().map(|row| row.iter().copied().collect()).collect(),
            }),
        }
    }
}

impl CalibrationFile {
    fn rig(&self) -> std::result::Result<Rig, String> {
        if self.version != VERSION {
            return Err(format!("version {} of the format; this program reads version {VERSION}", self.version));
        }
        let left = self.left.camera().map_err(|e| format!("left camera: {e}"))?;
        let right = self.right.camera().map_err(|e| format!("right camera: {e}"))?;
        let rows = self.right_from_left.rotation;
        let rotation = Matrix3::from_fn(|i, j| rows[i][j]);
        let off = (rotation * rotation.transpose() - Matrix3::identity()).amax();
        // A comparison with NaN is false, so this way round it is refused as well.
        let orthonormal = off <= ORTHONORMAL && rotation.determinant() > 0.0;
        if !orthonormal {
            return Err(format!("right_from_left.rotation is not a rotation (rows off orthonormal by {off:.1e})"));
        }
        let t = Vector3::from(self.right_from_left.translation_mm);
        if !t.iter().all(|v| v.is_finite()) || t.norm() == 0.0 {
            return Err("right_from_left.translation_mm must be finite and not zero".to_owned());
        }
        let covariance = self.covariance.as_ref().map(|c| c.covariance()).transpose()?;
        Ok(Rig { left, right, right_from_left: transform_from_matrix(rotation, t), covariance })
    }
}

impl CovarianceRecord {
    fn covariance(&self) -> std::result::Result<Covariance, String> {
        let n = self.order.len();
        if self.matrix.len() != n || self.matrix.iter().any(|row| row.len() != n) {
            return Err(format!("covariance.matrix is not {n} by {n}, the length of covariance.order"));
        }
        Ok(Covariance { order: self.order.clone(), matrix: DMatrix::from_fn(n, n, |i, j| self.matrix[i][j]) })
    }
}

/// Reads `calibration.json`, or one of the formats that [`super::export`] writes.
pub fn read(path: &Utf8Path) -> Result<Rig> {
    const WHAT: &str = "the stereo calibration";
    let hint = "`stereocal camera-check IMAGES` writes out/calibration.json; `--calibration FILE` names another";
    let text = files::read_text(path, WHAT, Some(hint))?;
    let rig = match super::export::read(path, &text) {
        Some(rig) => rig,
        None => files::read_json::<CalibrationFile>(path, WHAT, Some(hint))?.rig(),
    };
    rig.map_err(|message| {
        files::Error::Format { message, place: Place { path: path.to_owned(), line: None }, hint: None }.into()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::transform;

    #[test]
    fn a_rig_survives_the_file() {
        let mut left = Camera::pinhole(640, 480, 500.0);
        left.distortion[0] = -0.25;
        let mut right = left;
        right.lens = Lens::Brown5;
        right.distortion[4] = 0.125;
        let rig = Rig {
            left,
            right,
            right_from_left: transform(Vector3::new(0.01, -0.3, 0.02), Vector3::new(-120.0, 1.0, 20.0)),
            covariance: Some(Covariance { order: vec!["left.fx".into()], matrix: DMatrix::from_element(1, 1, 0.5) }),
        };
        let text = files::to_json(&CalibrationFile::from(&rig));
        let back = serde_json::from_str::<CalibrationFile>(&text).unwrap().rig().unwrap();
        assert_eq!(back.left, rig.left);
        assert_eq!(back.right, rig.right);
        assert_eq!(back.covariance, rig.covariance);
        assert!((back.right_from_left.to_matrix() - rig.right_from_left.to_matrix()).amax() < 1e-15);
    }
}
