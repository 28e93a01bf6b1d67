//! Kalibr's camchain: pinhole with `radtan` (`k1 k2 p1 p2`). Lengths in metres.

use nalgebra::{Matrix3, Vector3};

use super::scan::{list, word};
use super::written::{ExportedFile, METRE, camera, numbers, within};
use crate::formats::checked;
use crate::geometry::rotation_matrix;
use crate::stereo::{Camera, Error, Lens, Rig};

/// One file for the rig. Refused where the lens has more than four terms.
pub fn files(rig: &Rig) -> Result<Vec<ExportedFile>, Error> {
    let mut text = String::new();
    for (i, camera) in [&rig.left, &rig.right].into_iter().enumerate() {
        within("kalibr", camera, Lens::Brown4)?;
        text.push_str(&format!("cam{i}:\n"));
        if i == 1 {
            let r = rotation_matrix(&rig.right_from_left);
            let t = rig.right_from_left.translation.vector * METRE;
            text.push_str("  T_cn_cnm1:\n");
            for row in 0..3 {
                text.push_str(&format!("  - [{}]\n", numbers([r[(row, 0)], r[(row, 1)], r[(row, 2)], t[row]])));
            }
            text.push_str("  - [0.0, 0.0, 0.0, 1.0]\n");
        }
        text.push_str("  camera_model: pinhole\n");
        text.push_str(&format!("  intrinsics: [{}]\n", numbers([camera.fx, camera.fy, camera.cx, camera.cy])));
        text.push_str("  distortion_model: radtan\n");
        text.push_str(&format!("  distortion_coeffs: [{}]\n", numbers(camera.distortion[..4].iter().copied())));
        text.push_str(&format!("  resolution: [{}, {}]\n", camera.width, camera.height));
        text.push_str(&format!("  rostopic: /cam{i}/image_raw\n"));
    }
    Ok(vec![ExportedFile { name: "camchain.yaml", text }])
}

/// The camera of a chain, or of a chain's part, that holds one.
pub fn read_camera(part: &str) -> Result<Camera, String> {
    for (key, known) in [("camera_model", "pinhole"), ("distortion_model", "radtan")] {
        let found = word(part, key)?;
        if found != known {
            return Err(format!("{key} is `{found}`; only `{known}` is read"));
        }
    }
    let size = list(part, "resolution", Some(2))?;
    camera((size[0], size[1]), &list(part, "intrinsics", Some(4))?, &list(part, "distortion_coeffs", Some(4))?)
}

/// Reads the same back.
pub fn read(text: &str) -> Result<Rig, String> {
    let (left, right) = text.split_once("cam1:").ok_or("no cam1")?;
    if right.contains("\ncam2:") {
        return Err("the chain has more than two cameras".to_owned());
    }
    let t = list(right, "T_cn_cnm1", Some(16))?;
    let rotation = Matrix3::new(t[0], t[1], t[2], t[4], t[5], t[6], t[8], t[9], t[10]);
    let translation = Vector3::new(t[3], t[7], t[11]) / METRE;
    if t[12..] != [0.0, 0.0, 0.0, 1.0] {
        return Err("the last row of T_cn_cnm1 is not 0, 0, 0, 1".to_owned());
    }
    checked::rig((read_camera(left)?, read_camera(right)?), ("T_cn_cnm1", rotation), translation, None)
}
