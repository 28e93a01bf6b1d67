//! mrcal's cameramodel, one file a camera; the left camera is the reference. Lengths in metres.

use nalgebra::Vector3;

use super::scan::{list, word};
use super::written::{ExportedFile, METRE, camera, numbers, within};
use crate::formats::checked;
use crate::geometry::{Transform, rotation_matrix, rotation_vector, transform};
use crate::stereo::{Camera, Error, Lens, Rig};

/// Two files. Refused for a tilted sensor, which mrcal has no model for.
pub fn files(rig: &Rig) -> Result<Vec<ExportedFile>, Error> {
    Ok(vec![
        ExportedFile { name: "left.cameramodel", text: text(&rig.left, &Transform::identity())? },
        ExportedFile { name: "right.cameramodel", text: text(&rig.right, &rig.right_from_left)? },
    ])
}

fn text(camera: &Camera, camera_from_left: &Transform) -> Result<String, Error> {
    within("mrcal", camera, Lens::ThinPrism12)?;
    let n = camera.lens.vector_length();
    let intrinsics =
        [camera.fx, camera.fy, camera.cx, camera.cy].into_iter().chain(camera.distortion[..n].iter().copied());
    let (r, t) = (rotation_vector(camera_from_left), camera_from_left.translation.vector * METRE);
    Ok(format!(
        "# Written by stereocal. The left camera is the reference; lengths are metres.\n{{\n    'lensmodel':  'LENSMODEL_OPENCV{n}',\n\n    \
         # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....\n    'intrinsics': [ {}],\n\n    \
         # extrinsics are rt_fromref\n    'extrinsics': [ {}],\n\n    'imagersize': [ {}, {},]\n}}\n",
        numbers(intrinsics),
        numbers([r.x, r.y, r.z, t.x, t.y, t.z]),
        camera.width,
        camera.height
    ))
}

/// Reads the same back.
pub fn read(left: &str, right: &str) -> Result<Rig, String> {
    let (left, left_from_reference) = one(left)?;
    let (right, right_from_reference) = one(right)?;
    let right_from_left = right_from_reference * left_from_reference.inverse();
    let rotation = ("the rotation in extrinsics", rotation_matrix(&right_from_left));
    checked::rig((left, right), rotation, right_from_left.translation.vector, None)
}

pub fn read_camera(text: &str) -> Result<Camera, String> {
    Ok(one(text)?.0)
}

fn one(text: &str) -> Result<(Camera, Transform), String> {
    let model = word(text, "lensmodel")?;
    let count = match model.strip_prefix("LENSMODEL_") {
        Some("PINHOLE") => 0,
        Some("OPENCV4") => 4,
        Some("OPENCV5") => 5,
        Some("OPENCV8") => 8,
        Some("OPENCV12") => 12,
        _ => {
            return Err(format!(
                "lens model {model}: only LENSMODEL_PINHOLE and LENSMODEL_OPENCV4, 5, 8 and 12 are read"
            ));
        }
    };
    let intrinsics = list(text, "intrinsics", None)?;
    let size = list(text, "imagersize", Some(2))?;
    let pose = list(text, "extrinsics", Some(6))?;
    if intrinsics.len() != 4 + count {
        return Err(format!("{} intrinsics; {model} has {}", intrinsics.len(), 4 + count));
    }
    let camera = camera((size[0], size[1]), &intrinsics[..4], &intrinsics[4..])?;
    let from_reference =
        transform(Vector3::new(pose[0], pose[1], pose[2]), Vector3::new(pose[3], pose[4], pose[5]) / METRE);
    Ok((camera, from_reference))
}
