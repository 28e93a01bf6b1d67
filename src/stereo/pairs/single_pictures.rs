//! Each camera on its own pictures: what they say without a rig.
//!
//! In: views and a first camera of each side. Out: the camera as its own pictures have it, each picture's pose on it, its corners with
//! their weights, and which pictures are no board. Method: the robust bundle of one camera, so that no corner and no picture is judged by
//! where the other camera stands. Goes wrong: pictures that do not determine so rich a lens; a simpler one is taken then.

use crate::geometry::Transform;
use crate::statistics::median;
use crate::stereo::data::corner_noise::Noise;
use crate::stereo::data::residuals;
use crate::stereo::data::view::View;
use crate::stereo::init::single_camera::{OneCamera, as_left};
use crate::stereo::model::board_shape::{self, FLAT};
use crate::stereo::model::parameters::{Layout, Shared, Values};
use crate::stereo::solve::problem::Problem;
use crate::stereo::{Camera, Lens, Rig, Side};

/// A picture that loses more than this share of its corners shows no board of the series: of Gaussian corners one in a million is lost,
/// of a picture taken line by line, in motion, or of numbers in a wrong order nearly all.
const LOST_SHARE: f64 = 0.25;
/// The same where the board itself is the reason, because columns of it are printed off their places: then all pictures lose these.
const LOST_TIMES_USUAL: f64 = 1.5;
const LARGEST_LOST_SHARE: f64 = 0.6;

/// One camera on its own pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct SinglePictures {
    /// The camera.
    pub camera: Camera,
    /// The board's shape as these pictures have it.
    pub shape_mm: [f64; board_shape::NUMBERS],
    /// `camera_from_board` of every picture; `None` where its corners are no board.
    pub poses: Vec<Option<Transform>>,
    /// The corners of every picture with their weights, as those of a left one; corners far from their places are inactive.
    pub pictures: Vec<View>,
}

impl SinglePictures {
    /// Refines a camera on all pictures that have a pose. Where no lens up to `lens` has a minimum the first camera stays.
    pub fn refine(views: &[View], side: Side, first: &OneCamera, lens: Lens) -> SinglePictures {
        let known: Vec<usize> = (0..views.len()).filter(|&i| first.poses[i].is_some()).collect();
        let pictures: Vec<View> = views.iter().map(|view| as_left(view, side)).collect();
        let rig =
            Rig { left: first.camera, right: first.camera, right_from_left: Transform::identity(), covariance: None };
        let values = Values {
            shared: Shared { rig, shape_mm: FLAT },
            poses: known.iter().filter_map(|&i| first.poses[i]).collect(),
        };
        let problem = Problem { views: known.iter().map(|&i| pictures[i].clone()).collect(), values };
        let solved = simpler(lens).into_iter().find_map(|layout| problem.solve(&layout).ok());
        let problem = solved.map_or_else(|| weighted(problem), |solved| solved.problem);
        SinglePictures::of(pictures, &known, problem)
    }

    fn of(mut pictures: Vec<View>, known: &[usize], Problem { views, values }: Problem) -> SinglePictures {
        let mut poses = vec![None; pictures.len()];
        let lost = |view: &View| 1.0 - view.active(Side::Left).count() as f64 / view.observations.len() as f64;
        let usual = median(views.iter().map(lost)).unwrap_or(0.0);
        let limit = LOST_SHARE.max(LOST_TIMES_USUAL * usual).min(LARGEST_LOST_SHARE);
        for ((&i, view), pose) in known.iter().zip(views).zip(values.poses) {
            if lost(&view) <= limit {
                poses[i] = Some(pose);
            }
            pictures[i] = view;
        }
        SinglePictures { camera: values.shared.rig.left, shape_mm: values.shared.shape_mm, poses, pictures }
    }
}

/// The corners weighted by what the first camera leaves of them.
fn weighted(mut problem: Problem) -> Problem {
    if let Some(left) = residuals::active(&problem.views, &problem.values) {
        Noise::from_median(&left).apply(&mut problem.views);
    }
    problem
}

/// The lens that is asked for, on a board that may be bent, then simpler ones.
fn simpler(lens: Lens) -> Vec<Layout> {
    let mut all = vec![Layout { shape: true, ..Layout::one_camera(lens) }, Layout::one_camera(lens)];
    all.extend([Lens::Brown5, Lens::Brown4, Lens::Radial2].into_iter().filter(|l| *l < lens).map(Layout::one_camera));
    all
}
