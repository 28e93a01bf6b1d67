//! Everything this program asks of OpenCV. No other file names the bindings.
//!
//! OpenCV starts threads of its own; inside rayon's that would be one pool a worker, so it is held to one thread.

use std::sync::Once;

use nalgebra::{Matrix3, Matrix3x4, Matrix4, Point2};
use opencv::core::{Mat, Point2f, Size, Vector};
use opencv::prelude::{MatTraitConst, MatTraitConstManual};
use opencv::{calib3d, core, imgproc};

use crate::geometry::rotation_matrix;
use crate::imaging::image::raster::{Raster, Samples};
use crate::imaging::image::{Grey8, Image};
use crate::stereo::model::rectification::{Matrices, Scaling};
use crate::stereo::{Camera, Rig};

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

/// OpenCV's number for "both principal points are the same".
pub const ZERO_DISPARITY: i32 = calib3d::CALIB_ZERO_DISPARITY;

/// OpenCV's `stereoRectify` (Bouguet's method) for pictures of the left camera's size.
pub fn stereo_rectify(rig: &Rig, scaling: Scaling) -> Result<Matrices, Failure> {
    hold_to_one_thread();
    let (m1, d1) = matrix_and_distortion(&rig.left)?;
    let (m2, d2) = matrix_and_distortion(&rig.right)?;
    let r = matrix(&rotation_matrix(&rig.right_from_left))?;
    let t = Mat::from_slice(rig.right_from_left.translation.vector.as_slice())?.reshape(1, 3)?.clone_pointee();
    let size = Size::new(rig.left.width as i32, rig.left.height as i32);
    let [mut r1, mut r2, mut p1, mut p2, mut q] = [(); 5].map(|()| Mat::default());
    calib3d::stereo_rectify(
        &m1,
        &d1,
        &m2,
        &d2,
        size,
        &r,
        &t,
        &mut r1,
        &mut r2,
        &mut p1,
        &mut p2,
        &mut q,
        scaling.flags(),
        scaling.alpha,
        size,
        None,
        None,
    )?;
    Ok(Matrices {
        rotations: [Matrix3::from_row_slice(r1.data_typed()?), Matrix3::from_row_slice(r2.data_typed()?)],
        projections: [Matrix3x4::from_row_slice(p1.data_typed()?), Matrix3x4::from_row_slice(p2.data_typed()?)],
        disparity_to_depth: Matrix4::from_row_slice(q.data_typed()?),
    })
}

/// Where each pixel of a rectified picture lies in the raw one, px: OpenCV's `initUndistortRectifyMap`.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    x: Image<f32>,
    y: Image<f32>,
}

impl Map {
    /// Share of its pixels that lie within a raw picture of this size.
    pub fn coverage(&self, (width, height): (u32, u32)) -> f64 {
        let inside = |(x, y): (&f32, &f32)| {
            (0.0..=f64::from(width) - 1.0).contains(&f64::from(*x))
                && (0.0..=f64::from(height) - 1.0).contains(&f64::from(*y))
        };
        let count = self.x.pixels.iter().zip(&self.y.pixels).filter(|&place| inside(place)).count();
        count as f64 / self.x.pixels.len().max(1) as f64
    }
}

/// The map of a camera that is turned by `rotation` and given the matrix `projection` (3 x 3).
pub fn undistort_rectify_map(
    camera: &Camera,
    rotation: &Matrix3<f64>,
    projection: &Matrix3<f64>,
    (width, height): (u32, u32),
) -> Result<Map, Failure> {
    /// Sides that `remap` takes, px.
    const MOST: u32 = 32_766;
    hold_to_one_thread();
    if width.max(height).max(camera.width).max(camera.height) > MOST {
        return Err(Failure(format!("pictures of {width}x{height} px; `remap` takes at most {MOST} px a side")));
    }
    let (m, d) = matrix_and_distortion(camera)?;
    let (r, p) = (matrix(rotation)?, matrix(projection)?);
    let [mut x, mut y] = [(); 2].map(|()| Mat::default());
    let size = Size::new(width as i32, height as i32);
    calib3d::init_undistort_rectify_map(&m, &d, &r, &p, size, core::CV_32FC1, &mut x, &mut y)?;
    let image = |m: &Mat| -> Result<Image<f32>, Failure> {
        Ok(Image { width: width as usize, height: height as usize, pixels: m.data_typed::<f32>()?.to_vec() })
    };
    Ok(Map { x: image(&x)?, y: image(&y)? })
}

/// The picture at the places of a map, by OpenCV's `remap`, bicubic; black where the map leaves the picture.
pub fn remap(raster: &Raster, map: &Map) -> Result<Raster, Failure> {
    hold_to_one_thread();
    let (channels, rows) = (raster.channels as i32, raster.height as i32);
    let (columns, size) = (raster.width as i32 * channels, (map.x.width, map.x.height));
    let samples = match &raster.samples {
        Samples::Eight(v) => {
            let to = remapped(&Mat::new_rows_cols_with_data(rows, columns, v)?.reshape(channels, rows)?, map)?;
            Samples::Eight(to.reshape(1, 0)?.data_typed::<u8>()?.to_vec())
        }
        Samples::Sixteen(v) => {
            let to = remapped(&Mat::new_rows_cols_with_data(rows, columns, v)?.reshape(channels, rows)?, map)?;
            Samples::Sixteen(to.reshape(1, 0)?.data_typed::<u16>()?.to_vec())
        }
    };
    Ok(Raster { width: size.0, height: size.1, channels: raster.channels, samples })
}

fn remapped(from: &impl core::ToInputArray, map: &Map) -> Result<Mat, Failure> {
    let (width, height, mut to) = (map.x.width as i32, map.x.height as i32, Mat::default());
    let x = Mat::new_rows_cols_with_data(height, width, &map.x.pixels)?;
    let y = Mat::new_rows_cols_with_data(height, width, &map.y.pixels)?;
    let black = core::Scalar::all(0.0);
    imgproc::remap(from, &mut to, &x, &y, imgproc::INTER_CUBIC, core::BORDER_CONSTANT, black)?;
    Ok(to)
}

fn matrix(m: &Matrix3<f64>) -> Result<Mat, Failure> {
    // nalgebra stores by columns, OpenCV by rows.
    Ok(Mat::from_slice(m.transpose().as_slice())?.reshape(1, 3)?.clone_pointee())
}

fn matrix_and_distortion(camera: &Camera) -> Result<(Mat, Mat), Failure> {
    let distortion = Mat::from_slice(&camera.distortion[..camera.lens.vector_length()])?.clone_pointee();
    Ok((matrix(&camera.matrix())?, distortion))
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
) -> Result<Vec<nalgebra::Point2<f64>>, Failure> {
    use opencv::core::{Mat, Point2d, Point3d, Vector, no_array};
    let points: Vector<Point3d> = points.iter().map(|p| Point3d::new(p.x, p.y, p.z)).collect();
    let zero = Mat::from_slice(&[0.0, 0.0, 0.0])?.clone_pointee();
    let (matrix, distortion) = matrix_and_distortion(camera)?;
    let mut px: Vector<Point2d> = Vector::new();
    opencv::calib3d::project_points(&points, &zero, &zero, &matrix, &distortion, &mut px, &mut no_array(), 0.0)?;
    Ok(px.iter().map(|p| nalgebra::Point2::new(p.x, p.y)).collect())
}

/// A matrix, row by row, as OpenCV's FileStorage reads it from a text.
#[cfg(test)]
pub fn read_matrix(text: &str, name: &str) -> opencv::Result<Vec<f64>> {
    use opencv::core::{FileStorage, FileStorage_MEMORY, FileStorage_READ};
    use opencv::prelude::{FileNodeTraitConst, FileStorageTraitConst};
    let storage = FileStorage::new(text, FileStorage_READ | FileStorage_MEMORY, "")?;
    storage.get(name)?.mat()?.data_typed::<f64>().map(<[f64]>::to_vec)
}
