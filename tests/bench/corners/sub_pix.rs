//! The peer of single corners: OpenCV's `cornerSubPix`.

use nalgebra::Point2;
use opencv::core::{self, Mat, Point2f, Size, TermCriteria, Vector};
use opencv::imgproc;
use stereocal::imaging::image::Grey8;

/// OpenCV's `cornerSubPix` with a window of `2 half + 1` px.
pub fn corner_sub_pix(picture: &Grey8, start: &[Point2<f64>], half: i32) -> opencv::Result<Vec<Point2<f64>>> {
    core::set_num_threads(1)?;
    let image = Mat::new_rows_cols_with_data(picture.height as i32, picture.width as i32, &picture.pixels)?;
    let mut corners: Vector<Point2f> = start.iter().map(|p| Point2f::new(p.x as f32, p.y as f32)).collect();
    let stop = TermCriteria::new(core::TermCriteria_COUNT + core::TermCriteria_EPS, 100, 1e-4)?;
    imgproc::corner_sub_pix(&image, &mut corners, Size::new(half, half), Size::new(-1, -1), stop)?;
    Ok(corners.iter().map(|p| Point2::new(f64::from(p.x), f64::from(p.y))).collect())
}
