//! Starting values: each camera alone, then where they stand to each other.
//!
//! In: views. Out: two cameras, `right_from_left`, a pose a pair, and each picture's own residual. Method: Zhang's focal length from
//! the homographies, a bundle of one camera with a robust loss, the relative pose that most pairs agree with.
//! Goes wrong: no picture tells the focal length (fronto-parallel boards only); then a few usual focal lengths are tried and
//! the best fit is kept, and the covariance at the end says what it is worth.

use nalgebra::{Matrix3, Point2};

use super::bundle::{self, Search, Values};
use super::homography::{focal_lengths, homography, pixel_pairs, pose};
use super::layout::{Layout, Shared};
use super::noise::Noise;
use super::observations::{Side, View};
use super::residuals;
use super::robust::Loss;
use super::screening::median_px;
use super::{Camera, Lens, Rig};
use crate::geometry::{Transform, rotation_vector};
use crate::median::median;

/// Width of the robust loss in standard deviations: 95 % efficient for Gaussian noise (Holland & Welsch 1977).
pub const CAUCHY_WIDTH: f64 = 2.385;

/// Lens of the first fit: distortion that any picture determines.
const FIRST_LENS: Lens = Lens::Radial2;

/// Usual focal lengths as shares of the picture's longer side, for views that do not tell.
const USUAL_FOCAL_SHARES: [f64; 4] = [0.6, 1.0, 2.0, 4.0];

/// One camera, calibrated by itself.
#[derive(Debug, Clone, PartialEq)]
pub struct OneCamera {
    /// The camera.
    pub camera: Camera,
    /// `camera_from_board` of every view; `None` where the picture's corners are no board.
    pub poses: Vec<Option<Transform>>,
    /// Median length of the residuals of every view, px.
    pub median_px: Vec<Option<f64>>,
}

/// Calibrates one camera from its pictures alone. `None` where no start leads anywhere.
pub fn one_camera(views: &[View], side: Side, size: (u32, u32)) -> Option<OneCamera> {
    // Seen by itself, either camera is the left one of a rig without a right one.
    let pictures: Vec<View> = views.iter().map(|view| as_left(view, side)).collect();
    let center = Point2::new((f64::from(size.0) - 1.0) / 2.0, (f64::from(size.1) - 1.0) / 2.0);
    let homographies: Vec<Option<(Matrix3<f64>, f64)>> =
        pictures.iter().map(|view| homography(&pixel_pairs(view.active(Side::Left)))).collect();
    let good = well_formed(&homographies);
    let chosen: Vec<Matrix3<f64>> = good.iter().filter_map(|&i| homographies[i].map(|(h, _)| h)).collect();
    let longer = f64::from(size.0.max(size.1));
    let mut focals: Vec<(f64, f64)> = focal_lengths(&chosen, &center).into_iter().collect();
    if !focals.iter().any(|(fx, fy)| (0.2..50.0).contains(&(fx / longer)) && (0.5..2.0).contains(&(fx / fy))) {
        focals.extend(USUAL_FOCAL_SHARES.map(|share| (share * longer, share * longer)));
    }
    focals
        .into_iter()
        .filter_map(|(fx, fy)| {
            let mut camera = Camera::pinhole(size.0, size.1, fx);
            camera.fy = fy;
            camera.lens = FIRST_LENS;
            from_focal_length(&pictures, &homographies, &good, camera)
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, one)| one)
}

fn as_left(view: &View, side: Side) -> View {
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
) -> Option<(f64, OneCamera)> {
    let inverse = camera.matrix().try_inverse()?;
    let start_of = |i: usize| homographies[i].and_then(|(h, _)| pose(&(inverse * h)));
    let chosen: Vec<(usize, Transform)> = good.iter().filter_map(|&i| Some((i, start_of(i)?))).collect();
    let mut views: Vec<View> = chosen.iter().map(|&(i, _)| pictures[i].clone()).collect();
    let rig = Rig { left: camera, right: camera, right_from_left: Transform::identity(), covariance: None };
    let poses = chosen.iter().map(|(_, pose)| *pose).collect();
    let mut values = Values { shared: Shared { rig, shape_mm: [0.0; 2] }, poses };
    let mut cost = f64::INFINITY;
    for lens in [FIRST_LENS, FIRST_LENS, Lens::Brown4] {
        values.shared.rig.left.lens = lens;
        let noise = Noise::from_median(&residuals::active(&views, &values)?);
        noise.apply(&mut views);
        let loss = Loss::Cauchy(CAUCHY_WIDTH);
        values = bundle::solve(&views, &Layout::one_camera(lens), values, loss, Search::ROUGH).values;
        cost = residuals::active(&views, &values).map(|r| Noise::from_median(&r).added_px)?;
    }
    let camera = values.shared.rig.left;
    let mut poses = vec![None; pictures.len()];
    for ((i, _), pose) in chosen.iter().zip(&values.poses) {
        poses[*i] = Some(*pose);
    }
    let median_px = (0..pictures.len())
        .map(|i| poses[i].and_then(|pose| median_px(&values.shared, &pose, &pictures[i], Side::Left)))
        .collect();
    Some((cost, OneCamera { camera, poses, median_px }))
}

/// How far two rigs are apart: the angle between the rotations plus the distance of the translations in units of the
/// boards' distance.
pub fn deviation(a: &Transform, b: &Transform, distance_mm: f64) -> f64 {
    rotation_vector(&(a.inverse() * b)).norm()
        + (a.translation.vector - b.translation.vector).norm() / distance_mm.max(f64::MIN_POSITIVE)
}

/// The `right_from_left` that the pairs agree on: the one whose deviation from all pairs is smallest in the median. A pair may
/// offer several (a board that looks the same after a half turn); its nearest counts.
pub fn agreed_transform(choices: &[Vec<Transform>], distance_mm: f64) -> Option<Transform> {
    let median = |a: &Transform| {
        let nearest = |pair: &Vec<Transform>| {
            pair.iter().map(|b| deviation(a, b, distance_mm)).min_by(f64::total_cmp).unwrap_or(f64::INFINITY)
        };
        let mut all: Vec<f64> = choices.iter().map(nearest).collect();
        all.sort_by(f64::total_cmp);
        // Boards that are all seen alike leave two equal answers: cameras side by side are rolled less than a half turn.
        all[all.len() / 2] + 1e-3 * rotation_vector(a).norm()
    };
    choices.iter().flatten().min_by(|a, b| median(a).total_cmp(&median(b))).copied()
}
