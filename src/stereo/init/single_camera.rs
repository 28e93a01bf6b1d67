//! Starting values: each camera alone.
//!
//! In: the views of one side. Out: its camera, a pose a picture, and each picture's own residual. Method: Zhang's focal
//! length from the homographies, a bundle of one camera with a robust loss. Goes wrong: no picture tells the focal
//! length (fronto-parallel boards only); then a few usual focal lengths are tried and the best fit is kept, and the
//! covariance at the end says what it is worth.

use nalgebra::{Matrix3, Point2};

use crate::geometry::Transform;
use crate::imaging::Side;
use crate::statistics::median;
use crate::stereo::data::residuals::{self, median_px};
use crate::stereo::data::{Noise, View};
use crate::stereo::init::board_pose;
use crate::stereo::init::homography::{self, focal_lengths, pose};
use crate::stereo::model::board_shape::FLAT;
use crate::stereo::model::{Layout, Shared, Values};
use crate::stereo::solve::{Priors, Problem};
use crate::stereo::{Camera, Lens, Rig};

/// Lens of the first fit: distortion that any picture determines.
const FIRST_LENS: Lens = Lens::Radial2;

/// Usual focal lengths as shares of the picture's longer side, for views that do not tell.
const USUAL_FOCAL_SHARES: [f64; 4] = [0.6, 1.0, 2.0, 4.0];

/// One camera, calibrated by itself.
#[derive(Debug, Clone, PartialEq)]
pub struct OneCamera {
    pub camera: Camera,
    /// `camera_from_board` of every view; `None` where the picture's corners are no board.
    pub poses: Vec<Option<Transform>>,
    /// Median length of the residuals of every view, px.
    pub median_px: Vec<Option<f64>>,
}

/// Calibrates one camera from its pictures alone. `None` where no start leads anywhere.
pub fn one_camera(views: &[View], side: Side, size: (u32, u32), diagonal_mm: f64) -> Option<OneCamera> {
    // Seen by itself, either camera is the left one of a rig without a right one.
    let pictures: Vec<View> = views.iter().map(|view| as_left(view, side)).collect();
    let center = Point2::new((f64::from(size.0) - 1.0) / 2.0, (f64::from(size.1) - 1.0) / 2.0);
    let homographies: Vec<Option<(Matrix3<f64>, f64)>> =
        pictures.iter().map(|view| homography::of_picture(view, Side::Left)).collect();
    let good = well_formed(&homographies);
    let chosen: Vec<Matrix3<f64>> = good.iter().filter_map(|&i| homographies[i].map(|(h, _)| h)).collect();
    let longer = f64::from(size.0.max(size.1));
    let mut focals: Vec<(f64, f64)> = focal_lengths(&chosen, &center).into_iter().collect();
    if !focals.iter().any(|(fx, fy)| (0.2..50.0).contains(&(fx / longer)) && (0.5..2.0).contains(&(fx / fy))) {
        focals.extend(USUAL_FOCAL_SHARES.map(|share| (share * longer, share * longer)));
    }
    let of_focal = |(fx, fy): (f64, f64)| {
        let camera = Camera { fy, lens: FIRST_LENS, ..Camera::pinhole(size.0, size.1, fx) };
        from_focal_length(&pictures, &homographies, &good, camera, diagonal_mm)
    };
    let best = focals.into_iter().filter_map(of_focal).min_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, one)| one)
}

/// A camera whose lens is known, with the boards' poses in its pictures.
pub fn known_camera(views: &[View], side: Side, camera: Camera) -> OneCamera {
    let rig = Rig { left: camera, right: camera, right_from_left: Transform::identity(), covariance: None };
    let shared = Shared { rig, shape_mm: FLAT };
    let pictures = views.iter().map(|view| as_left(view, side));
    let poses_and_px = pictures.map(|picture| {
        let pose = board_pose::fit(&shared, &picture)?;
        Some((pose, median_px(&shared, &pose, &picture, Side::Left)))
    });
    let (poses, median_px) = poses_and_px.map(|found| (found.map(|f| f.0), found.and_then(|f| f.1))).unzip();
    OneCamera { camera, poses, median_px }
}

/// The corners of one picture as those of a left one: seen by itself, either camera is the left one of a rig without a
/// right one.
pub fn as_left(view: &View, side: Side) -> View {
    let mut picture = view.only(side);
    for o in &mut picture.observations {
        o.side = Side::Left;
    }
    picture
}

/// Pictures whose corners look like a board: those whose homography leaves no more than a few times the median.
/// Lens distortion leaves something in all of them; corners in a wrong order leave tens of times more.
fn well_formed(homographies: &[Option<(Matrix3<f64>, f64)>]) -> Vec<usize> {
    let limit = median(homographies.iter().flatten().map(|(_, rms)| *rms)).map_or(0.0, |usual| 5.0 * usual);
    (0..homographies.len()).filter(|&i| homographies[i].is_some_and(|(_, rms)| rms <= limit)).collect()
}

/// The bundle of one camera from this start; with its cost, to compare starts.
fn from_focal_length(
    pictures: &[View],
    homographies: &[Option<(Matrix3<f64>, f64)>],
    good: &[usize],
    camera: Camera,
    diagonal_mm: f64,
) -> Option<(f64, OneCamera)> {
    let inverse = camera.matrix().try_inverse()?;
    let start_of = |i: usize| homographies[i].and_then(|(h, _)| pose(&(inverse * h)));
    let (mut chosen, poses): (Vec<usize>, Vec<Transform>) =
        good.iter().filter_map(|&i| Some((i, start_of(i)?))).unzip();
    let rig = Rig { left: camera, right: camera, right_from_left: Transform::identity(), covariance: None };
    let mut problem = Problem {
        views: chosen.iter().map(|&i| pictures[i].clone()).collect(),
        values: Values { shared: Shared { rig, shape_mm: FLAT }, poses },
        priors: Priors::of_one_camera(&camera, diagonal_mm),
    };
    for lens in [FIRST_LENS, Lens::Brown5] {
        problem.values.shared.rig.left.lens = lens;
        problem.search_roughly(&Layout::one_camera(lens))?;
    }
    let scatter_px = |problem: &Problem| {
        residuals::active(&problem.views, &problem.values).map(|left| Noise::from_median(&left).added_px)
    };
    let first_px = scatter_px(&problem)?;
    add_the_others(pictures, &mut chosen, &mut problem);
    let cost = scatter_px(&problem).unwrap_or(first_px);
    let values = problem.values;
    let camera = values.shared.rig.left;
    let mut poses = vec![None; pictures.len()];
    for (i, pose) in chosen.iter().zip(&values.poses) {
        poses[*i] = Some(*pose);
    }
    let median_px = (0..pictures.len())
        .map(|i| poses[i].and_then(|pose| median_px(&values.shared, &pose, &pictures[i], Side::Left)))
        .collect();
    Some((cost, OneCamera { camera, poses, median_px }))
}

/// The camera on all pictures: those that bend too much for a homography have one once the lens is known. Nothing is
/// rejected here; the loss is robust.
fn add_the_others(pictures: &[View], chosen: &mut Vec<usize>, problem: &mut Problem) {
    let others: Vec<usize> = (0..pictures.len()).filter(|i| !chosen.contains(i)).collect();
    if others.is_empty() {
        return;
    }
    for i in others {
        if let Some(pose) = board_pose::fit(&problem.values.shared, &pictures[i]) {
            chosen.push(i);
            problem.views.push(pictures[i].clone());
            problem.values.poses.push(pose);
        }
    }
    let layout = Layout::one_camera(problem.values.shared.rig.left.lens);
    // Where a corner comes to lie behind the camera, the values before are the best that there are.
    let _ = problem.search_roughly(&layout);
}
