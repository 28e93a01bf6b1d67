//! A rig in the words of other programs, written and read back.
//!
//! Angles and pixels mean the same in all of them (pixel (0, 0) is the centre of the top-left pixel); lengths are mm in OpenCV's file and
//! metres in the others, as is usual there. A lens that a format cannot say is refused, never approximated.

pub mod file_storage;
pub mod kalibr;
pub mod mrcal;
pub mod ros;
mod scan;

use camino::Utf8Path;

use super::{Camera, Error, Lens, Rig};

/// Metres in a millimetre.
const METRE: f64 = 1e-3;

/// A file to be written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExportedFile {
    /// Its name in the results folder.
    pub name: &'static str,
    /// Its content.
    pub text: String,
}

/// Reads a calibration in one of the formats that are written here; `None` where the text is none of them.
/// Formats with a file a camera are named by the left one; the right one stands beside it.
pub fn read(path: &Utf8Path, text: &str) -> Option<Result<Rig, String>> {
    let beside = || -> Result<String, String> {
        let name = path.file_name().unwrap_or_default();
        let right = path.with_file_name(name.replacen("left", "right", 1));
        if right == path {
            return Err(
                "name the left camera's file; the right camera's stands beside it with `right` for `left`".to_owned()
            );
        }
        std::fs::read_to_string(&right).map_err(|e| format!("the right camera's file {right}: {e}"))
    };
    if text.contains("'lensmodel'") {
        return Some(beside().and_then(|right| mrcal::read(text, &right)));
    }
    if text.contains("camera_matrix:") && text.contains("projection_matrix:") {
        return Some(beside().and_then(|right| ros::read(text, &right)));
    }
    if text.contains("T_cn_cnm1:") {
        return Some(kalibr::read(text));
    }
    text.contains("!!opencv-matrix").then(|| file_storage::read(text))
}

/// Numbers as text that reads back to the same bits.
fn numbers(values: impl IntoIterator<Item = f64>) -> String {
    let all: Vec<String> = values.into_iter().map(|v| format!("{v:?}")).collect();
    all.join(", ")
}

/// A camera from what every format has.
fn camera(size: (f64, f64), pinhole: &[f64], distortion: &[f64]) -> Result<Camera, String> {
    let &[fx, fy, cx, cy] = pinhole else { return Err(format!("{} numbers for fx, fy, cx, cy", pinhole.len())) };
    let lens = match distortion.len() {
        0 | 2 => Lens::Radial2,
        4 => Lens::Brown4,
        5 => Lens::Brown5,
        8 => Lens::Rational8,
        12 => Lens::ThinPrism12,
        14 => Lens::Tilted14,
        n => return Err(format!("{n} distortion coefficients; OpenCV's order has 4, 5, 8, 12 or 14")),
    };
    let finite = pinhole.iter().chain(distortion).all(|v| v.is_finite()) && fx > 0.0 && fy > 0.0;
    if !finite || size.0 < 1.0 || size.1 < 1.0 {
        return Err("sizes and focal lengths must be positive, and every number finite".to_owned());
    }
    let mut all = [0.0; 14];
    all[..distortion.len()].copy_from_slice(distortion);
    Ok(Camera { width: size.0 as u32, height: size.1 as u32, fx, fy, cx, cy, lens, distortion: all })
}

fn refuse(format: &'static str, lens: Lens, most: Lens) -> Error {
    Error::LensNotExportable { format, lens: lens.name(), most: most.name() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::transform;
    use crate::stereo::projection::tests::bent_camera;
    use nalgebra::{Point3, Vector3};

    pub(super) fn rig(lens: Lens) -> Rig {
        let mut right = bent_camera(lens);
        right.fx += 31.25;
        Rig {
            left: bent_camera(lens),
            right,
            right_from_left: transform(Vector3::new(0.02, -0.35, 0.013), Vector3::new(-180.5, 2.25, 33.0)),
            covariance: None,
        }
    }

    /// px; the files keep 17 digits, rotations pass through a matrix or a rotation vector once.
    const ROUND_TRIP: f64 = 1e-8;

    fn assert_same(a: &Rig, b: &Rig) {
        for point in [Point3::new(0.0, 0.0, 600.0), Point3::new(-120.0, 90.0, 550.0), Point3::new(100.0, -80.0, 700.0)]
        {
            let (al, ar) = a.project(&point);
            let (bl, br) = b.project(&point);
            assert!((al - bl).norm() < ROUND_TRIP && (ar - br).norm() < ROUND_TRIP, "{al} {bl} {ar} {br}");
        }
        assert_eq!((a.left.width, a.right.height), (b.left.width, b.right.height));
    }

    #[test]
    fn every_format_reads_back() {
        for lens in Lens::LADDER {
            let rig = rig(lens);
            let mut written = vec![file_storage::files(&rig)];
            written.extend(ros::files(&rig));
            written.extend(kalibr::files(&rig));
            written.extend(mrcal::files(&rig));
            let expected = match lens {
                Lens::Radial2 | Lens::Brown4 => 4,
                Lens::Brown5 | Lens::Rational8 => 3,
                Lens::ThinPrism12 => 2,
                Lens::Tilted14 => 1,
            };
            assert_eq!(written.len(), expected, "{lens:?}");
            for files in written {
                let dir = tempfile::tempdir().unwrap();
                let dir = Utf8Path::from_path(dir.path()).unwrap();
                for file in &files {
                    std::fs::write(dir.join(file.name), &file.text).unwrap();
                }
                let back = super::read(&dir.join(files[0].name), &files[0].text).unwrap().unwrap();
                assert_same(&rig, &back);
            }
        }
    }

    #[test]
    fn opencv_itself_reads_its_file() {
        let rig = rig(Lens::Rational8);
        let text = &file_storage::files(&rig)[0].text;
        let (matrix, distortion) = crate::opencv::read_camera(text, "M1", "D1").unwrap();
        assert_eq!(matrix, rig.left.matrix().transpose().as_slice());
        assert_eq!(distortion, rig.left.distortion[..8]);
    }
}
