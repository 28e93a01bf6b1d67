//! mrcal's cameramodel, one file a camera; the left camera is the reference. Lengths in metres.

use nalgebra::Vector3;

use super::scan::{behind, list};
use super::{ExportedFile, METRE, camera, numbers, refuse};
use crate::geometry::{Transform, rotation_vector, transform};
use crate::stereo::{Camera, Error, Lens, Rig};

/// Two files. Refused for a tilted sensor, which mrcal has no model for.
pub fn files(rig: &Rig) -> Result<Vec<ExportedFile>, Error> {
    Ok(vec![
        ExportedFile { name: "left.cameramodel", text: text(&rig.left, &Transform::identity())? },
        ExportedFile { name: "right.cameramodel", text: text(&rig.right, &rig.right_from_left)? },
    ])
}

fn text(camera: &Camera, camera_from_left: &Transform) -> Result<String, Error> {
    if camera.lens > Lens::ThinPrism12 {
        return Err(refuse("mrcal", camera.lens, Lens::ThinPrism12));
    }
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
    Ok(Rig { left, right, right_from_left, covariance: None })
}

fn one(text: &str) -> Result<(Camera, Transform), String> {
    let model = behind(text, "lensmodel").and_then(|rest| rest.lines().next()).unwrap_or_default();
    if !model.contains("LENSMODEL_OPENCV") && !model.contains("LENSMODEL_PINHOLE") {
        return Err(format!(
            "lens model{}: only LENSMODEL_PINHOLE and LENSMODEL_OPENCV4, 5, 8 and 12 are read",
            model.trim_end_matches(',')
        ));
    }
    let intrinsics = list(text, "intrinsics", None)?;
    let size = list(text, "imagersize", Some(2))?;
    let pose = list(text, "extrinsics", Some(6))?;
    if intrinsics.len() < 4 {
        return Err(format!("{} intrinsics; fx, fy, cx, cy come first", intrinsics.len()));
    }
    let camera = camera((size[0], size[1]), &intrinsics[..4], &intrinsics[4..])?;
    let from_reference =
        transform(Vector3::new(pose[0], pose[1], pose[2]), Vector3::new(pose[3], pose[4], pose[5]) / METRE);
    Ok((camera, from_reference))
}
