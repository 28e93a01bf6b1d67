//! OpenCV's FileStorage, YAML, with the names of its own stereo example: `M1 D1 M2 D2 R T`. Lengths in mm.
//!
//! What follows from them stands there too, for programs that read it: `E F` as `stereoCalibrate` gives them, and `R1
//! R2 P1 P2 Q` as `stereoRectify` gives them with its own defaults (`rectify_flags` 1024 is `CALIB_ZERO_DISPARITY`,
//! `rectify_alpha` -1) for pictures of `image_width` x `image_height`. It is written, not read back.

use nalgebra::{Matrix3, Vector3};

use super::cameras;
use super::scan::list;
use super::written::{ExportedFile, matrix};
use crate::formats::checked;
use crate::geometry::rotation_matrix;
use crate::stereo::model::rectification::{Matrices, Scaling, essential, fundamental};
use crate::stereo::{Error, Rig};

/// One file for the rig. An error where OpenCV cannot rectify it.
pub fn files(rig: &Rig) -> Result<Vec<ExportedFile>, Error> {
    let mut text = String::from("%YAML:1.0\n---\n");
    text.push_str(&format!("image_width: {}\nimage_height: {}\n", rig.left.width, rig.left.height));
    text.push_str(&format!("right_image_width: {}\nright_image_height: {}\n", rig.right.width, rig.right.height));
    for (i, camera) in [(1, &rig.left), (2, &rig.right)] {
        text.push_str(&matrix(&format!("M{i}"), 3, 3, camera.matrix().transpose().as_slice()));
        let n = camera.lens.vector_length();
        text.push_str(&matrix(&format!("D{i}"), 1, n, &camera.distortion[..n]));
    }
    text.push_str(&matrix("R", 3, 3, rotation_matrix(&rig.right_from_left).transpose().as_slice()));
    text.push_str(&matrix("T", 3, 1, rig.right_from_left.translation.vector.as_slice()));
    text.push_str(&matrix("E", 3, 3, essential(rig).transpose().as_slice()));
    if let Some(f) = fundamental(rig) {
        text.push_str(&matrix("F", 3, 3, f.transpose().as_slice()));
    }
    let scaling = Scaling::OPENCV;
    let rectified = Matrices::new(rig, scaling)?;
    for (i, r) in rectified.rotations.iter().enumerate() {
        text.push_str(&matrix(&format!("R{}", i + 1), 3, 3, r.transpose().as_slice()));
    }
    for (i, p) in rectified.projections.iter().enumerate() {
        text.push_str(&matrix(&format!("P{}", i + 1), 3, 4, p.transpose().as_slice()));
    }
    text.push_str(&matrix("Q", 4, 4, rectified.disparity_to_depth.transpose().as_slice()));
    text.push_str(&format!("rectify_flags: {}\nrectify_alpha: {:?}\n", scaling.flags(), scaling.alpha));
    Ok(vec![ExportedFile { name: "stereo_opencv.yml", text }])
}

/// Reads the same back.
pub fn read(text: &str) -> Result<Rig, String> {
    let [left, right] =
        cameras::two(text).ok_or("no two cameras by names that are read: `M1 D1 M2 D2`, with `R` and `T`")??;
    if left.width == 0 {
        return Err("no `image_width` and `image_height`: add both lines, the size of the pictures".to_owned());
    }
    let rotation = Matrix3::from_row_slice(&list(text, "R", Some(9))?);
    let translation = Vector3::from_row_slice(&list(text, "T", Some(3))?);
    checked::rig((left, right), ("R", rotation), translation, None)
}
