//! Everything this program asks of OpenCV. No other file names the bindings.
//!
//! OpenCV starts threads of its own; inside rayon's that would be one pool a worker, so it is held to one thread.

use std::sync::Once;

use nalgebra::{Matrix3, Matrix3x4, Matrix4, Point2, Vector3};
use opencv::core::{DataType, Mat, Point2f, Size, Vector};
use opencv::prelude::{MatTraitConst, MatTraitConstManual};
use opencv::{calib3d, core, imgproc};

/// What OpenCV said where it could not work at all (not: where it found nothing).
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("OpenCV: {0}")]
pub struct Failure(String);

impl From<opencv::Error> for Failure {
    fn from(e: opencv::Error) -> Failure {
        Failure(e.message)
    }
}

/// Looks for a board with `columns` x `rows` inner corners by sectors (Duda and Frese 2018): slow, holds against blur
/// and noise. Gives all corners row by row, to about half a pixel, in a direction of OpenCV's choosing; `None` where
/// the whole board was not found. At least three corners each way. `grey` holds the picture's lines of `width` pixels
/// one after the other.
pub fn find_board(
    grey: &[u8],
    width: usize,
    (columns, rows): (usize, usize),
) -> Result<Option<Vec<Point2<f64>>>, Failure> {
    hold_to_one_thread();
    if columns < 3 || rows < 3 {
        return Ok(None);
    }
    let height = grey.len() / width.max(1);
    let image = Mat::new_rows_cols_with_data(height as i32, width as i32, grey)?;
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

/// A camera as OpenCV takes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Lens<'a> {
    /// Focal lengths and centre, px.
    pub matrix: Matrix3<f64>,
    /// Terms of the distortion in OpenCV's order: 4, 5, 8, 12 or 14.
    pub distortion: &'a [f64],
    /// Width and height of its pictures, px.
    pub size: (u32, u32),
}

/// What `stereoRectify` gives: `R1` and `R2`, `P1` and `P2`, `Q`.
pub type Rectified = ([Matrix3<f64>; 2], [Matrix3x4<f64>; 2], Matrix4<f64>);

/// OpenCV's `stereoRectify` (Bouguet's method) for pictures of the first camera's size: `rotation` and `translation`
/// (mm) take points from the first camera's frame to the second's.
pub fn stereo_rectify(
    [first, second]: [Lens; 2],
    rotation: &Matrix3<f64>,
    translation: &Vector3<f64>,
    (flags, alpha): (i32, f64),
) -> Result<Rectified, Failure> {
    hold_to_one_thread();
    let (m1, d1) = first.mats()?;
    let (m2, d2) = second.mats()?;
    let r = matrix(rotation)?;
    let t = Mat::from_slice(translation.as_slice())?.reshape(1, 3)?.clone_pointee();
    let size = Size::new(first.size.0 as i32, first.size.1 as i32);
    let [mut r1, mut r2, mut p1, mut p2, mut q] = [(); 5].map(|()| Mat::default());
    calib3d::stereo_rectify(
        &m1, &d1, &m2, &d2, size, &r, &t, &mut r1, &mut r2, &mut p1, &mut p2, &mut q, flags, alpha, size, None, None,
    )?;
    Ok((
        [Matrix3::from_row_slice(r1.data_typed()?), Matrix3::from_row_slice(r2.data_typed()?)],
        [Matrix3x4::from_row_slice(p1.data_typed()?), Matrix3x4::from_row_slice(p2.data_typed()?)],
        Matrix4::from_row_slice(q.data_typed()?),
    ))
}

/// OpenCV's `undistortPoints` of raw pixels, to places at distance one. It takes five steps of an iteration that need
/// not arrive.
pub fn undistort_points(camera: &Lens, px: &[Point2<f64>]) -> Result<Vec<Point2<f64>>, Failure> {
    hold_to_one_thread();
    let (m, d) = camera.mats()?;
    let from: Vector<core::Point2d> = px.iter().map(|p| core::Point2d::new(p.x, p.y)).collect();
    let mut to = Vector::<core::Point2d>::new();
    let none = core::no_array();
    calib3d::undistort_points(&from, &mut to, &m, &d, &none, &none)?;
    Ok(to.iter().map(|p| Point2::new(p.x, p.y)).collect())
}

/// Where each pixel of a rectified picture lies in the raw one, px: OpenCV's `initUndistortRectifyMap`.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    width: usize,
    x: Vec<f32>,
    y: Vec<f32>,
}

impl Map {
    /// Share of its pixels that lie within a raw picture of this size.
    pub fn coverage(&self, (width, height): (u32, u32)) -> f64 {
        let inside = |(x, y): (&f32, &f32)| {
            (0.0..=f64::from(width) - 1.0).contains(&f64::from(*x))
                && (0.0..=f64::from(height) - 1.0).contains(&f64::from(*y))
        };
        let count = self.x.iter().zip(&self.y).filter(|&place| inside(place)).count();
        count as f64 / self.x.len().max(1) as f64
    }

    /// Empties what a lens model that folds shows a second time: all beyond the line where the map turns back, seen
    /// from the pixel that lies nearest to `centre_px` of the raw picture. The share of the pixels within a raw picture
    /// of this size that this takes.
    pub fn empty_folds(&mut self, centre_px: &Point2<f64>, (width, height): (u32, u32)) -> f64 {
        /// Outside of any picture.
        const NOWHERE: f32 = -1e6;
        let (columns, rows) = self.size();
        let place = |i: usize| nalgebra::Vector2::new(f64::from(self.x[i]), f64::from(self.y[i]));
        let from_centre = |i: &usize| (place(*i) - centre_px.coords).norm_squared();
        let Some(start) = (0..self.x.len()).min_by(|a, b| from_centre(a).total_cmp(&from_centre(b))) else {
            return 0.0;
        };
        // Of one pixel to the next on the right and below.
        let keeps_hand = |i: usize| {
            let (column, row) = (i % columns, i / columns);
            let right = if column + 1 < columns { place(i + 1) - place(i) } else { place(i) - place(i - 1) };
            let down = if row + 1 < rows { place(i + columns) - place(i) } else { place(i) - place(i - columns) };
            right.perp(&down) > 0.0
        };
        let mut reached = vec![false; self.x.len()];
        let mut open = vec![start];
        reached[start] = true;
        while let Some(i) = open.pop() {
            let (column, row) = (i % columns, i / columns);
            let beside = [
                (column > 0, i.wrapping_sub(1)),
                (column + 1 < columns, i + 1),
                (row > 0, i.wrapping_sub(columns)),
                (row + 1 < rows, i + columns),
            ];
            for (_, next) in beside.into_iter().filter(|(is_there, _)| *is_there) {
                if !reached[next] && keeps_hand(next) {
                    reached[next] = true;
                    open.push(next);
                }
            }
        }
        let before = self.coverage((width, height));
        for i in (0..self.x.len()).filter(|&i| !reached[i]) {
            (self.x[i], self.y[i]) = (NOWHERE, NOWHERE);
        }
        before - self.coverage((width, height))
    }

    /// Width and height of the rectified picture, px.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.x.len() / self.width.max(1))
    }
}

/// The map of a camera that is turned by `rotation` and given the matrix `projection` (3 x 3).
pub fn undistort_rectify_map(
    camera: &Lens,
    rotation: &Matrix3<f64>,
    projection: &Matrix3<f64>,
    (width, height): (u32, u32),
) -> Result<Map, Failure> {
    /// Sides that `remap` takes, px.
    const MOST: u32 = 32_766;
    hold_to_one_thread();
    if width.max(height).max(camera.size.0).max(camera.size.1) > MOST {
        return Err(Failure(format!("pictures of {width}x{height} px; `remap` takes at most {MOST} px a side")));
    }
    let (m, d) = camera.mats()?;
    let (r, p) = (matrix(rotation)?, matrix(projection)?);
    let [mut x, mut y] = [(); 2].map(|()| Mat::default());
    let size = Size::new(width as i32, height as i32);
    calib3d::init_undistort_rectify_map(&m, &d, &r, &p, size, core::CV_32FC1, &mut x, &mut y)?;
    Ok(Map { width: width as usize, x: x.data_typed()?.to_vec(), y: y.data_typed()?.to_vec() })
}

/// The picture at the places of a map, by OpenCV's `remap`, bicubic; black where the map leaves the picture. `samples`
/// holds its lines of `width` pixels one after the other, each pixel's channels together.
pub fn remap<T: DataType>(samples: &[T], width: usize, channels: usize, map: &Map) -> Result<Vec<T>, Failure> {
    hold_to_one_thread();
    let (columns, depth) = (width * channels, channels as i32);
    let rows = (samples.len() / columns.max(1)) as i32;
    let from = Mat::new_rows_cols_with_data(rows, columns as i32, samples)?;
    let from = from.reshape(depth, rows)?;
    let (width, height) = map.size();
    let x = Mat::new_rows_cols_with_data(height as i32, width as i32, &map.x)?;
    let y = Mat::new_rows_cols_with_data(height as i32, width as i32, &map.y)?;
    let black = core::Scalar::all(0.0);
    let mut to = Mat::default();
    imgproc::remap(&from, &mut to, &x, &y, imgproc::INTER_CUBIC, core::BORDER_CONSTANT, black)?;
    Ok(to.reshape(1, 0)?.data_typed::<T>()?.to_vec())
}

fn matrix(m: &Matrix3<f64>) -> Result<Mat, Failure> {
    // nalgebra stores by columns, OpenCV by rows.
    Ok(Mat::from_slice(m.transpose().as_slice())?.reshape(1, 3)?.clone_pointee())
}

impl Lens<'_> {
    fn mats(&self) -> Result<(Mat, Mat), Failure> {
        Ok((matrix(&self.matrix)?, Mat::from_slice(self.distortion)?.clone_pointee()))
    }
}

fn hold_to_one_thread() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // Where it refuses, OpenCV only runs with more threads than is good.
        let _ = core::set_num_threads(1);
    });
}

/// OpenCV's own projection of points in a camera's frame, px: the oracle for the program's.
#[cfg(test)]
pub fn project_points(camera: &Lens, points: &[nalgebra::Point3<f64>]) -> Result<Vec<Point2<f64>>, Failure> {
    use opencv::core::{Point2d, Point3d, no_array};
    let points: Vector<Point3d> = points.iter().map(|p| Point3d::new(p.x, p.y, p.z)).collect();
    let zero = Mat::from_slice(&[0.0, 0.0, 0.0])?.clone_pointee();
    let (matrix, distortion) = camera.mats()?;
    let mut px: Vector<Point2d> = Vector::new();
    calib3d::project_points(&points, &zero, &zero, &matrix, &distortion, &mut px, &mut no_array(), 0.0)?;
    Ok(px.iter().map(|p| Point2::new(p.x, p.y)).collect())
}

/// A matrix, row by row, as OpenCV's FileStorage reads it from a text.
#[cfg(test)]
pub fn read_matrix(text: &str, name: &str) -> opencv::Result<Vec<f64>> {
    use opencv::core::{FileStorage, FileStorage_MEMORY, FileStorage_READ};
    use opencv::prelude::{FileNodeTraitConst, FileStorageTraitConst};
    let storage = FileStorage::new(text, FileStorage_READ | FileStorage_MEMORY, "")?;
    storage.get(name)?.mat()?.data_typed::<f64>().map(<[f64]>::to_vec)
}
