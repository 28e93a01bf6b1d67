//! Everything this program asks of OpenCV. No other file names the bindings.
//!
//! OpenCV starts threads of its own; inside rayon's that would be one pool a worker, so it is held to one thread.

use std::sync::Once;

use nalgebra::Point2;
use opencv::core::{Mat, Point2f, Size, TermCriteria, Vector};
use opencv::{calib3d, core, imgproc};

use crate::imaging::image::Grey8;

/// What OpenCV said where it could not work at all (not: where it found nothing).
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("OpenCV: {0}")]
pub struct Failure(String);

impl From<opencv::Error> for Failure {
    fn from(e: opencv::Error) -> Failure {
        Failure(e.message)
    }
}

/// Looks for a board with `columns` x `rows` inner corners by sectors (Duda and Frese 2018): slow, holds against blur and noise. Gives all
/// corners row by row, to about half a pixel, in a direction of OpenCV's choosing; `None` where the whole board was not found.
/// At least three corners each way.
pub fn find_board(picture: &Grey8, columns: usize, rows: usize) -> Result<Option<Vec<Point2<f64>>>, Failure> {
    hold_to_one_thread();
    if columns < 3 || rows < 3 {
        return Ok(None);
    }
    let image = Mat::new_rows_cols_with_data(picture.height as i32, picture.width as i32, &picture.pixels)?;
    let size = Size::new(columns as i32, rows as i32);
    let mut corners = Vector::<Point2f>::new();
    let found = calib3d::find_chessboard_corners_sb(&image, size, &mut corners, calib3d::CALIB_CB_EXHAUSTIVE)?;
    if !found || corners.len() != columns * rows {
        return Ok(None);
    }
    Ok(Some(corners.iter().map(|p| Point2::new(f64::from(p.x), f64::from(p.y))).collect()))
}

/// OpenCV's `cornerSubPix` with a window of `2 half + 1` px: the yardstick of the corner benchmark, not used to measure.
pub fn corner_sub_pix(picture: &Grey8, start: &[Point2<f64>], half: i32) -> Result<Vec<Point2<f64>>, Failure> {
    hold_to_one_thread();
    let image = Mat::new_rows_cols_with_data(picture.height as i32, picture.width as i32, &picture.pixels)?;
    let mut corners: Vector<Point2f> = start.iter().map(|p| Point2f::new(p.x as f32, p.y as f32)).collect();
    let stop = TermCriteria::new(core::TermCriteria_COUNT + core::TermCriteria_EPS, 100, 1e-4)?;
    imgproc::corner_sub_pix(&image, &mut corners, Size::new(half, half), Size::new(-1, -1), stop)?;
    Ok(corners.iter().map(|p| Point2::new(f64::from(p.x), f64::from(p.y))).collect())
}

fn hold_to_one_thread() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // Where it refuses, OpenCV only runs with more threads than is good.
        let _ = core::set_num_threads(1);
    });
}

/// OpenCV's own projection of points in a camera's frame, px: the oracle for [`crate::stereo::Camera::project`].
#[cfg(test)]
pub fn project_points(
    camera: &crate::stereo::Camera,
    points: &[nalgebra::Point3<f64>],
) -> opencv::Result<Vec<nalgebra::Point2<f64>>> {
    use opencv::core::{Mat, Point2d, Point3d, Vector, no_array};
    let points: Vector<Point3d> = points.iter().map(|p| Point3d::new(p.x, p.y, p.z)).collect();
    let zero = Mat::from_slice(&[0.0, 0.0, 0.0])?.clone_pointee();
    let matrix = Mat::from_slice_2d(&[[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]])?;
    let distortion = Mat::from_slice(&camera.distortion[..camera.lens.vector_length()])?.clone_pointee();
    let mut px: Vector<Point2d> = Vector::new();
    opencv::calib3d::project_points(&points, &zero, &zero, &matrix, &distortion, &mut px, &mut no_array(), 0.0)?;
    Ok(px.iter().map(|p| nalgebra::Point2::new(p.x, p.y)).collect())
}

/// A camera matrix (row by row) and distortion as OpenCV's FileStorage reads them from a text.
#[cfg(test)]
pub fn read_camera(text: &str, matrix: &str, distortion: &str) -> opencv::Result<(Vec<f64>, Vec<f64>)> {
    use opencv::core::{FileStorage, FileStorage_MEMORY, FileStorage_READ};
    use opencv::prelude::{FileNodeTraitConst, FileStorageTraitConst, MatTraitConstManual};
    let storage = FileStorage::new(text, FileStorage_READ | FileStorage_MEMORY, "")?;
    let read = |name: &str| storage.get(name)?.mat()?.data_typed::<f64>().map(<[f64]>::to_vec);
    Ok((read(matrix)?, read(distortion)?))
}

/// OpenCV's `calibrateCamera` and `stereoCalibrate` on complete boards, four distortion terms: RMS, px, and baseline, mm.
/// The yardstick of the calibration benchmark, not used to calibrate.
pub fn stereo_calibrate(corners: &crate::imaging::Corners) -> Result<(f64, f64), Failure> {
    use opencv::core::{Mat, Point2f, Point3f, Size, TermCriteria, Vector};
    let (mut objects, mut images) =
        (Vector::<Vector<Point3f>>::new(), [(); 2].map(|()| Vector::<Vector<Point2f>>::new()));
    let all = corners.board.corner_count();
    for pair in corners.pairs.iter().filter(|p| p.left.len() == all && p.right.len() == all) {
        let place = |c: &crate::imaging::Corner| corners.board.corner_mm(c.col, c.row).cast::<f32>();
        objects.push(pair.left.iter().map(place).map(|p| Point3f::new(p.x, p.y, p.z)).collect());
        for (image, list) in images.iter_mut().zip([&pair.left, &pair.right]) {
            image.push(list.iter().map(|c| c.px.cast::<f32>()).map(|p| Point2f::new(p.x, p.y)).collect());
        }
    }
    let size = Size::new(corners.left_size.0 as i32, corners.left_size.1 as i32);
    let criteria = TermCriteria::new(3, 100, 1e-9)?;
    let flags = calib3d::CALIB_FIX_K3;
    let mut cameras = [(); 2].map(|()| (Mat::default(), Mat::default()));
    for ((matrix, distortion), image) in cameras.iter_mut().zip(&images) {
        let (mut r, mut t) = (Mat::default(), Mat::default());
        calib3d::calibrate_camera(&objects, image, size, matrix, distortion, &mut r, &mut t, flags, criteria)?;
    }
    let [(m1, d1), (m2, d2)] = &mut cameras;
    let [mut r, mut t, mut e, mut f] = [(); 4].map(|()| Mat::default());
    let rms = calib3d::stereo_calibrate(
        &objects,
        &images[0],
        &images[1],
        m1,
        d1,
        m2,
        d2,
        size,
        &mut r,
        &mut t,
        &mut e,
        &mut f,
        flags | calib3d::CALIB_USE_INTRINSIC_GUESS,
        criteria,
    )?;
    use opencv::prelude::MatTraitConstManual;
    let baseline = t.data_typed::<f64>()?.iter().map(|v| v * v).sum::<f64>().sqrt();
    Ok((rms, baseline))
}
