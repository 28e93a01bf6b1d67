//! The peer of the bundle: OpenCV's functions on the same corners.

use opencv::calib3d;
use opencv::core::{Mat, Point2f, Point3f, Size, TermCriteria, Vector};
use opencv::prelude::MatTraitConstManual;
use stereocal::imaging::{Corner, Corners};

/// OpenCV's `calibrateCamera` and `stereoCalibrate` on complete boards, four distortion terms: RMS, px, and baseline,
/// mm.
pub fn stereo_calibrate(corners: &Corners) -> opencv::Result<(f64, f64)> {
    let (mut objects, mut images) =
        (Vector::<Vector<Point3f>>::new(), [(); 2].map(|()| Vector::<Vector<Point2f>>::new()));
    let all = corners.board.corner_count();
    for pair in corners.pairs.iter().filter(|p| p.left.len() == all && p.right.len() == all) {
        let place = |c: &Corner| corners.board.corner_mm(c.col, c.row).cast::<f32>();
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
    let baseline = t.data_typed::<f64>()?.iter().map(|v| v * v).sum::<f64>().sqrt();
    Ok((rms, baseline))
}
