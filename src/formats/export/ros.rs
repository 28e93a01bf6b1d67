//! ROS camera_info, one file a camera, rectified so that the rows of both cameras agree. Lengths in metres.
//!
//! Rectification (Bouguet): each camera takes half of the rotation between them, then both turn so that x lies along
//! the baseline. `P` of the right camera holds `-f b` in its fourth column.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::cameras::pinhole;
use super::scan::{list, number, word};
use super::written::{ExportedFile, METRE, camera, numbers, within};
use crate::formats::checked;
use crate::stereo::{Camera, Error, Lens, Rig};

/// Two files. Refused beyond eight distortion coefficients, which `camera_info` has no name for.
pub fn files(rig: &Rig) -> Result<Vec<ExportedFile>, Error> {
    for camera in [&rig.left, &rig.right] {
        within("ros", camera, Lens::Rational8)?;
    }
    let half = UnitQuaternion::from_scaled_axis(rig.right_from_left.rotation.scaled_axis() / 2.0);
    // In the frame halfway between the cameras the baseline points from the right camera's centre to the left's.
    let t = half.inverse() * rig.right_from_left.translation.vector;
    let x = if t.x > 0.0 { t.normalize() } else { -t.normalize() };
    let y = Vector3::z().cross(&x).normalize();
    let z = x.cross(&y);
    let turn = Matrix3::from_rows(&[x.transpose(), y.transpose(), z.transpose()]);
    let left = turn * half.to_rotation_matrix().into_inner();
    let right = turn * half.inverse().to_rotation_matrix().into_inner();
    let shift_m = (right * rig.right_from_left.translation.vector).x * METRE;
    let f = rig.left.fy.min(rig.right.fy);
    let middle = [f64::midpoint(rig.left.cx, rig.right.cx), f64::midpoint(rig.left.cy, rig.right.cy)];
    let projection = |shift_m: f64| vec![f, 0.0, middle[0], f * shift_m, 0.0, f, middle[1], 0.0, 0.0, 0.0, 1.0, 0.0];
    Ok(vec![
        ExportedFile { name: "left.yaml", text: text("left", &rig.left, &left, projection(0.0)) },
        ExportedFile { name: "right.yaml", text: text("right", &rig.right, &right, projection(shift_m)) },
    ])
}

fn text(name: &str, camera: &Camera, rectification: &Matrix3<f64>, projection: Vec<f64>) -> String {
    let (model, n) = if camera.lens > Lens::Brown5 { ("rational_polynomial", 8) } else { ("plumb_bob", 5) };
    let matrix = |name: &str, rows: usize, columns: usize, data: Vec<f64>| {
        format!("{name}:\n  rows: {rows}\n  cols: {columns}\n  data: [{}]\n", numbers(data))
    };
    let mut text = format!("image_width: {}\nimage_height: {}\ncamera_name: {name}\n", camera.width, camera.height);
    text.push_str(&matrix("camera_matrix", 3, 3, camera.matrix().transpose().as_slice().to_vec()));
    text.push_str(&format!("distortion_model: {model}\n"));
    text.push_str(&matrix("distortion_coefficients", 1, n, camera.distortion[..n].to_vec()));
    text.push_str(&matrix("rectification_matrix", 3, 3, rectification.transpose().as_slice().to_vec()));
    text.push_str(&matrix("projection_matrix", 3, 4, projection));
    text
}

pub fn read_camera(text: &str) -> Result<Camera, String> {
    let m = list(text, "camera_matrix", Some(9))?;
    let size = (number(text, "image_width")?, number(text, "image_height")?);
    let count = match word(text, "distortion_model")? {
        "plumb_bob" => 5,
        "rational_polynomial" => 8,
        other => return Err(format!("distortion_model is `{other}`; plumb_bob and rational_polynomial are read")),
    };
    camera(size, &pinhole("camera_matrix", &m)?, &list(text, "distortion_coefficients", Some(count))?)
}

/// Reads the same back: the rig from both rectifications and the right projection.
pub fn read(left: &str, right: &str) -> Result<Rig, String> {
    let rectification = |text: &str| {
        let rows = list(text, "rectification_matrix", Some(9))?;
        checked::rotation("rectification_matrix", Matrix3::from_row_slice(&rows))
    };
    let (left_turn, right_turn) = (rectification(left)?, rectification(right)?);
    let p = list(right, "projection_matrix", Some(12))?;
    if p[3] == 0.0 || p[0] == 0.0 {
        return Err("projection_matrix of the right camera has no baseline".to_owned());
    }
    let shift_mm = p[3] / p[0] / METRE;
    let rotation = right_turn.transpose() * left_turn;
    let translation = right_turn.transpose() * Vector3::new(shift_mm, 0.0, 0.0);
    let rotation = ("the product of the rectifications", rotation);
    checked::rig((read_camera(left)?, read_camera(right)?), rotation, translation, None)
}
