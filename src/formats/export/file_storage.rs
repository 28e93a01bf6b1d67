//! OpenCV's FileStorage, YAML, with the names of its own stereo example: `M1 D1 M2 D2 R T`. Lengths in mm.

use nalgebra::{Matrix3, Vector3};

use super::scan::{list, number};
use super::{ExportedFile, camera, numbers};
use crate::formats::checked;
use crate::geometry::rotation_matrix;
use crate::stereo::Rig;

/// One file for the rig.
pub fn files(rig: &Rig) -> Vec<ExportedFile> {
    let matrix = |name: &str, rows: usize, columns: usize, data: &[f64]| {
        format!(
            "{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {} ]\n",
            numbers(data.iter().copied())
        )
    };
    let mut text = String::from("%YAML:1.0\n---\n");
    text.push_str(&format!("image_width: {}\nimage_height: {}\n", rig.left.width, rig.left.height));
    text.push_str(&format!("right_image_width: {}\nright_image_height: {}\n", rig.right.width, rig.right.height));
    for (i, camera) in [(1, &rig.left), (2, &rig.right)] {
        // nalgebra stores by columns, OpenCV by rows.
        text.push_str(&matrix(&format!("M{i}"), 3, 3, camera.matrix().transpose().as_slice()));
        let n = camera.lens.vector_length();
        text.push_str(&matrix(&format!("D{i}"), 1, n, &camera.distortion[..n]));
    }
    text.push_str(&matrix("R", 3, 3, rotation_matrix(&rig.right_from_left).transpose().as_slice()));
    text.push_str(&matrix("T", 3, 1, rig.right_from_left.translation.vector.as_slice()));
    vec![ExportedFile { name: "stereo_opencv.yml", text }]
}

/// Reads the same back.
pub fn read(text: &str) -> Result<Rig, String> {
    let size = (number(text, "image_width")?, number(text, "image_height")?);
    let right_size = match (number(text, "right_image_width"), number(text, "right_image_height")) {
        (Ok(width), Ok(height)) => (width, height),
        _ => size,
    };
    let one = |size, matrix: &str, distortion: &str| {
        let m = list(text, matrix, Some(9))?;
        camera(size, &[m[0], m[4], m[2], m[5]], &list(text, distortion, None)?)
    };
    let rotation = Matrix3::from_row_slice(&list(text, "R", Some(9))?);
    let translation = Vector3::from_row_slice(&list(text, "T", Some(3))?);
    checked::rig((one(size, "M1", "D1")?, one(right_size, "M2", "D2")?), ("R", rotation), translation, None)
}
