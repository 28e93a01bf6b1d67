//! Pictures as two cameras side by side would have taken them: corresponding points on one row.
//!
//! In: a rig. Out: what OpenCV's `stereoRectify` says of it (Bouguet's method: each camera takes half of the turn
//! between them, then both turn until x lies along the baseline), where a raw point falls, and how far the rows of
//! measured points differ. Goes wrong: cameras that look at each other, or one that stands in front of the other, have
//! no common rows.

use nalgebra::{Matrix3, Matrix3x4, Matrix4, Point2, Point3, Vector3, Vector4};
use serde::Serialize;

use crate::geometry::{cross_covariance, rotation_matrix};
use crate::imaging::{Board, Corner, PairCorners};
use crate::opencv::{Failure, Lens, ZERO_DISPARITY, stereo_rectify, undistort_points};
use crate::statistics::median;
use crate::stereo::data::residuals::root_mean_square;
use crate::stereo::{Camera, Rig, Side};

/// How much of the raw pictures is kept, in OpenCV's words.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scaling {
    /// 0: only pixels that both lenses saw; 1: every raw pixel; -1: OpenCV's own choice, which neither cuts nor shrinks
    /// much.
    pub alpha: f64,
    /// True: both principal points are the same, so that points at infinity have no disparity. Cameras that look at one
    /// near place then lose it from view.
    pub zero_disparity: bool,
}

impl Scaling {
    /// `stereoRectify`'s own defaults.
    pub const OPENCV: Scaling = Scaling { alpha: -1.0, zero_disparity: true };

    /// `stereoRectify`'s `flags`.
    pub fn flags(self) -> i32 {
        if self.zero_disparity { ZERO_DISPARITY } else { 0 }
    }
}

/// Four terms of a lens that does not distort.
const NO_DISTORTION: [f64; 4] = [0.0; 4];

/// Whether OpenCV finds the places of a picture's corners and of the middles of its sides without their distortion.
fn holds_at_borders(camera: &Camera) -> Result<bool, Failure> {
    /// Five steps of its iteration leave some pixels of a wide lens, and diverge where the model folds; a share of the
    /// picture's width.
    const NEAR: f64 = 0.05;
    let [right, bottom] = [camera.width, camera.height].map(|size| f64::from(size) - 1.0);
    let along = |end: f64| [0.0, 0.5 * end, end];
    let border: Vec<Point2<f64>> =
        along(right).into_iter().flat_map(|x| along(bottom).map(|y| Point2::new(x, y))).collect();
    let found = undistort_points(&camera.for_opencv(), &border)?;
    let raw = |place: &Point2<f64>| camera.project(&Point3::new(place.x, place.y, 1.0));
    Ok(found.iter().zip(&border).all(|(place, px)| (raw(place) - px).norm() < NEAR * f64::from(camera.width)))
}

/// What `stereoRectify` gives. The left camera is the first.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrices {
    /// `R1`, `R2`: `rectified_from_camera`.
    pub rotations: [Matrix3<f64>; 2],
    /// `P1`, `P2`: projections of points in the rectified left camera's frame (mm) to rectified pixels.
    pub projections: [Matrix3x4<f64>; 2],
    /// `Q`: maps `(x, y, disparity, 1)` to a point in the rectified left camera's frame, times its weight.
    pub disparity_to_depth: Matrix4<f64>,
}

impl Matrices {
    /// Asks OpenCV. It scales and centres the rectified pictures by where the raw ones' borders lie undistorted; where
    /// it does not find that, for a lens model that holds no longer there, by cameras without distortion.
    pub fn new(rig: &Rig, scaling: Scaling) -> Result<Matrices, Failure> {
        let cameras = [&rig.left, &rig.right];
        let holds = cameras.into_iter().map(holds_at_borders).collect::<Result<Vec<bool>, Failure>>()?;
        let cameras = cameras.map(Camera::for_opencv).map(|lens| match holds.contains(&false) {
            true => Lens { distortion: &NO_DISTORTION, ..lens },
            false => lens,
        });
        let (rotation, translation) = (rotation_matrix(&rig.right_from_left), &rig.right_from_left.translation.vector);
        let (rotations, projections, disparity_to_depth) =
            stereo_rectify(cameras, &rotation, translation, (scaling.flags(), scaling.alpha))?;
        Ok(Matrices { rotations, projections, disparity_to_depth })
    }

    /// `R1`, `P1` for the left side, `R2`, `P2` for the right one.
    pub fn of(&self, side: Side) -> (&Matrix3<f64>, &Matrix3x4<f64>) {
        (&self.rotations[side as usize], &self.projections[side as usize])
    }

    /// True for cameras one above the other: OpenCV then puts corresponding points into one column.
    pub fn in_columns(&self) -> bool {
        let right = &self.projections[1];
        right[(1, 3)].abs() > right[(0, 3)].abs()
    }
}

/// `E = [t]x R` of normalised points, as OpenCV's `stereoCalibrate` gives it, mm.
pub fn essential(rig: &Rig) -> Matrix3<f64> {
    let t: &Vector3<f64> = &rig.right_from_left.translation.vector;
    t.cross_matrix() * rotation_matrix(&rig.right_from_left)
}

/// `F` of undistorted pixels, its last element one, as OpenCV's `stereoCalibrate` gives it. `None` where a matrix of a
/// camera cannot be inverted.
pub fn fundamental(rig: &Rig) -> Option<Matrix3<f64>> {
    let f = rig.right.matrix().try_inverse()?.transpose() * essential(rig) * rig.left.matrix().try_inverse()?;
    let last = f[(2, 2)];
    Some(if last == 0.0 { f } else { f / last })
}

/// How far the rows of corresponding points differ in rectified pictures (columns, where the cameras stand one above
/// the other).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct RowResidual {
    /// Points seen in both pictures.
    pub corners: usize,
    pub rms_px: f64,
    pub max_px: f64,
}

/// Row differences, left minus right, px, of a pair's corners: the place in the left picture and the difference.
pub fn row_differences(pair: &PairCorners, in_columns: bool) -> Vec<(Point2<f64>, f64)> {
    let along = |p: Point2<f64>| if in_columns { p.x } else { p.y };
    in_both(pair).map(|(left, right)| (left.px, along(left.px) - along(right.px))).collect()
}

/// Corners that are used in both pictures.
fn in_both(pair: &PairCorners) -> impl Iterator<Item = (&Corner, &Corner)> {
    let right = |left: &Corner| pair.right.iter().find(|c| (c.col, c.row) == (left.col, left.row) && c.used);
    pair.left.iter().filter(|c| c.used).filter_map(move |left| Some((left, right(left)?)))
}

/// The residual of differences; `None` without any.
pub fn row_residual(differences: &[f64]) -> Option<RowResidual> {
    Some(RowResidual {
        corners: differences.len(),
        rms_px: root_mean_square(differences.iter().map(|d| d * d))?,
        max_px: differences.iter().fold(0.0, |most, d| most.max(d.abs())),
    })
}

/// How large a board of known size comes out of the disparities of its corners: what turns the cameras about the common
/// columns leaves the rows as they are and changes that.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SizeResidual {
    pub pairs: usize,
    /// How many times as large as it is, in the middle one of the pairs.
    pub times: f64,
    /// By how much the disparities are larger than they would be if the board came out as large as it is, px, in the
    /// middle one of the pairs.
    pub disparity_px: f64,
    /// By how much the board's diagonal comes out longer, mm.
    pub diagonal_mm: f64,
    /// What lengths can be trusted to by the rig's own calibration, mm.
    pub trusted_mm: Option<f64>,
}

impl SizeResidual {
    /// Of corners in rectified pictures, beside what lengths can be trusted to, mm; `None` where no pair has enough of
    /// them.
    pub fn of(
        pairs: &[PairCorners],
        board: &Board,
        matrices: &Matrices,
        trusted_mm: Option<f64>,
    ) -> Option<SizeResidual> {
        let each: Vec<(f64, f64)> = pairs.iter().filter_map(|pair| size_of(pair, board, matrices)).collect();
        let times = median(each.iter().map(|(times, _)| *times))?;
        let disparity_px = median(each.iter().map(|(_, off_px)| *off_px))?;
        let diagonal_mm = (times - 1.0) * board.diagonal_mm();
        Some(SizeResidual { pairs: each.len(), times, disparity_px, diagonal_mm, trusted_mm })
    }
}

/// How many times as large as it is the board of a pair comes out, and by how much the disparities of its corners are
/// off then, px.
///
/// Method: the similarity that fits the corners to the board's (Umeyama, 1991); a depth goes with one over the
/// disparity.
fn size_of(pair: &PairCorners, board: &Board, matrices: &Matrices) -> Option<(f64, f64)> {
    /// Fewer corners are no board.
    const FEWEST: usize = 4;
    let q = &matrices.disparity_to_depth;
    let along = |px: Point2<f64>| if matrices.in_columns() { px.y } else { px.x };
    let of = |(left, right): (&Corner, &Corner)| {
        let at = q * Vector4::new(left.px.x, left.px.y, along(left.px) - along(right.px), 1.0);
        let place = Point3::from(at.xyz() / at.w);
        place.iter().all(|mm| mm.is_finite()).then_some((board.corner_mm(left.col, left.row), place, at.w / q[(3, 2)]))
    };
    let seen: Vec<(Point3<f64>, Point3<f64>, f64)> = in_both(pair).filter_map(of).collect();
    if seen.len() < FEWEST {
        return None;
    }
    let on_board = || seen.iter().map(|(mm, ..)| (*mm, *mm, 1.0));
    let spread = cross_covariance(on_board()).2.trace();
    let (.., products) = cross_covariance(seen.iter().map(|(mm, place, _)| (*mm, *place, 1.0)));
    let times = products.singular_values().sum() / spread;
    let disparity_px = median(seen.iter().map(|(.., px)| *px))?;
    let as_large_px = q[(3, 2)].signum() * disparity_px.abs() * times;
    (times.is_finite() && times > 0.0).then_some((times, disparity_px - as_large_px))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;
    use crate::geometry::transform;
    use crate::stereo::Lens;
    use crate::stereo::model::projection::tests::bent_camera;

    /// Cameras that look at one place 600 mm away.
    fn rig(lens: Lens, right_mm: Vector3<f64>) -> Rig {
        let mut right = bent_camera(lens);
        right.fx += 31.25;
        let left_from_right = transform(Vector3::new(0.02, -0.3, 0.013), right_mm);
        Rig { left: bent_camera(lens), right, right_from_left: left_from_right.inverse(), covariance: None }
    }

    /// px: rounding, at coordinates of about 1000 px.
    const ROUNDING: f64 = 1e-9;

    fn rectified(rig: &Rig, matrices: &Matrices, point: Point3<f64>) -> [Point2<f64>; 2] {
        let in_right = rig.right_from_left * point;
        [(Side::Left, point), (Side::Right, in_right)].map(|(side, p)| {
            let (r, projection) = matrices.of(side);
            let seen = projection.fixed_view::<3, 3>(0, 0) * (r * p.coords);
            Point2::new(seen.x / seen.z, seen.y / seen.z)
        })
    }

    #[test]
    fn points_fall_on_one_row_and_q_takes_them_back() {
        for lens in Lens::LADDER {
            for (right_mm, in_columns) in
                [(Vector3::new(180.0, 2.0, -5.0), false), (Vector3::new(3.0, 150.0, 4.0), true)]
            {
                for scaling in [Scaling::OPENCV, Scaling { alpha: 0.5, zero_disparity: false }] {
                    let rig = rig(lens, right_mm);
                    let matrices = Matrices::new(&rig, scaling).unwrap();
                    assert_eq!(matrices.in_columns(), in_columns);
                    for point in [Point3::new(0.0, 0.0, 600.0), Point3::new(-70.0, 40.0, 500.0)] {
                        let [left, right] = rectified(&rig, &matrices, point);
                        let (across, along) = (left.y - right.y, left.x - right.x);
                        let (across, along) = if in_columns { (along, across) } else { (across, along) };
                        assert!(across.abs() < ROUNDING, "{lens:?}: {across}");
                        let back = matrices.disparity_to_depth * nalgebra::Vector4::new(left.x, left.y, along, 1.0);
                        let in_left = matrices.rotations[0].transpose() * back.xyz() / back.w;
                        assert!((in_left - point.coords).norm() < 1e-7, "{in_left} {point}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_board_of_another_size_tells_disparities_that_are_off() {
        let board: Board = "checker:10x7:25".parse().unwrap();
        for (right_mm, in_columns) in [(Vector3::new(180.0, 2.0, -5.0), false), (Vector3::new(3.0, 150.0, 4.0), true)] {
            for scaling in [Scaling::OPENCV, Scaling { alpha: 0.5, zero_disparity: false }] {
                let rig = rig(Lens::Brown5, right_mm);
                let matrices = Matrices::new(&rig, scaling).unwrap();
                // The right picture moved along the rows: they agree as before.
                let pair = |tilt_rad: f64, moved_px: f64| {
                    let pose = transform(Vector3::new(0.1, tilt_rad, 0.3), Vector3::new(5.0, -8.0, 600.0));
                    let seen = |col, row| rectified(&rig, &matrices, pose * board.corner_mm(col, row));
                    let along = if in_columns { Vector2::y() } else { Vector2::x() };
                    let step = along * moved_px;
                    let places = (0..board.corner_count()).map(|index| board.place(index));
                    let both = places.map(|(col, row)| {
                        (Corner::at(col, row, seen(col, row)[0]), Corner::at(col, row, seen(col, row)[1] + step))
                    });
                    let (left, right) = both.unzip();
                    PairCorners { pair: "1".to_owned(), left, right }
                };
                let of = |moved_px: f64| {
                    let pairs = [-0.3, 0.0, 0.3].map(|tilt_rad| pair(tilt_rad, moved_px));
                    assert!(
                        pairs
                            .iter()
                            .all(|pair| row_differences(pair, in_columns).iter().all(|(_, d)| d.abs() < ROUNDING))
                    );
                    SizeResidual::of(&pairs, &board, &matrices, None).unwrap()
                };
                let right = of(0.0);
                assert!((right.times - 1.0).abs() < 1e-9 && right.disparity_px.abs() < 1e-6, "{right:?}");
                for moved_px in [-6.0, 3.0] {
                    let off = of(moved_px);
                    assert!((off.disparity_px + moved_px).abs() < 0.15 * f64::abs(moved_px), "{moved_px}: {off:?}");
                    assert!(off.diagonal_mm.signum() == moved_px.signum() * right_mm.sum().signum(), "{off:?}");
                }
            }
        }
        let matrices = Matrices::new(&rig(Lens::Brown5, Vector3::x() * 180.0), Scaling::OPENCV).unwrap();
        assert_eq!(SizeResidual::of(&[PairCorners::default()], &board, &matrices, None), None);
    }

    #[test]
    fn corresponding_points_meet_the_epipolar_constraint() {
        let rig = rig(Lens::Brown5, Vector3::new(180.0, 2.0, -5.0));
        let (e, f) = (essential(&rig), fundamental(&rig).unwrap());
        assert_eq!(f[(2, 2)], 1.0);
        let point = Point3::new(-70.0, 40.0, 500.0);
        let in_right = rig.right_from_left * point;
        let (left, right) = (point.coords / point.z, in_right.coords / in_right.z);
        assert!(right.dot(&(e * left)).abs() < 1e-10);
        let (left_px, right_px) = (rig.left.matrix() * left, rig.right.matrix() * right);
        let line = f * left_px;
        // Distance of the point from its epipolar line, px; a rig whose translation is turned about misses it by far.
        assert!((right_px.dot(&line) / line.xy().norm()).abs() < ROUNDING);
        let swapped = f.transpose() * left_px;
        assert!((right_px.dot(&swapped) / swapped.xy().norm()).abs() > 1.0);
    }

    /// A lens that turns back a little outside of the middle half of its picture: fine where boards stood, and nowhere
    /// else.
    fn folding() -> Camera {
        let mut camera = Camera::pinhole(640, 480, 490.0);
        camera.lens = Lens::Brown5;
        (camera.distortion[0], camera.distortion[1], camera.distortion[4]) = (-0.07, 0.47, -3.0);
        camera
    }

    #[test]
    fn a_lens_that_folds_toward_the_borders_scales_nothing_and_shows_nothing_twice() {
        let folds = Rig {
            left: folding(),
            right: folding(),
            right_from_left: transform(Vector3::zeros(), -60.0 * Vector3::x()),
            covariance: None,
        };
        let plain =
            Rig { left: Camera::pinhole(640, 480, 490.0), right: Camera::pinhole(640, 480, 490.0), ..folds.clone() };
        let [found, expected] = [&folds, &plain].map(|rig| Matrices::new(rig, Scaling::OPENCV).unwrap());
        assert_eq!(found.projections, expected.projections);
        let (r, p) = found.of(Side::Left);
        let map = |rig: &Rig| {
            let p = p.fixed_view::<3, 3>(0, 0).into_owned();
            crate::opencv::undistort_rectify_map(&rig.left.for_opencv(), r, &p, (640, 480)).unwrap()
        };
        let centre = Point2::new(folds.left.cx, folds.left.cy);
        let mut twice = map(&folds);
        let taken = twice.empty_folds(&centre, (640, 480));
        assert!((0.05..0.6).contains(&taken), "{taken}");
        let mut once = map(&plain);
        let before = once.clone();
        assert_eq!(once.empty_folds(&centre, (640, 480)), 0.0);
        assert_eq!(once, before);
    }

    #[test]
    fn residuals_of_rows() {
        assert_eq!(row_residual(&[]), None);
        let found = row_residual(&[3.0, -4.0]).unwrap();
        assert_eq!((found.corners, found.max_px), (2, 4.0));
        assert!((found.rms_px - 12.5_f64.sqrt()).abs() < 1e-15);
    }
}
