//! The lenses of a rig whose pictures were not taken at one moment, from each camera's own pictures.
//!
//! In: the pairs at their start, how far each camera misses its own pictures and how far the pairs miss their rig. Out: both lenses with their
//! covariance. Method: what moved between the two pictures of a pair says nothing of either lens, and each picture by itself is as good as
//! ever; so each camera is solved alone, its board bent or flat. In the bundle of the pairs, whose corners then weigh by how far the pairs miss the
//! rig, the same corners count once more by the square of both misseds' ratio; by so much less the lenses are known. Goes wrong: boards that
//! do not tell one of the cameras by itself; then no lens is known.

use nalgebra::DMatrix;

use crate::imaging::{Board, Side};
use crate::stereo::data::View;
use crate::stereo::init::board_pose;
use crate::stereo::init::single_camera::as_left;
use crate::stereo::model::board_shape::FLAT;
use crate::stereo::model::{Covariance, KnownLenses, Layout, Shared, Values};
use crate::stereo::pairs::series::Missed;
use crate::stereo::select::stated_uncertainty;
use crate::stereo::solve::{Priors, Problem};
use crate::stereo::{Camera, Lens, Rig};

/// Both cameras with this lens, as their own pictures tell it. `None` where these do not.
pub fn lenses(start: &Problem, board: &Board, lens: Lens, missed: Missed) -> Option<KnownLenses> {
    let once_more = (missed.alone_px / missed.paired_px).powi(2);
    let [(left, of_left), (right, of_right)] =
        [one(start, board, lens, Side::Left)?, one(start, board, lens, Side::Right)?];
    let layout = Layout { transform: false, ..Layout::rig(lens, false) };
    let (n, at) = (of_left.nrows(), layout.camera_start(Side::Right));
    let mut matrix = DMatrix::zeros(layout.count(), layout.count());
    matrix.view_mut((0, 0), (n, n)).copy_from(&of_left);
    matrix.view_mut((at, at), (n, n)).copy_from(&of_right);
    let covariance = Some(Covariance { order: layout.names(), matrix: matrix / (1.0 - once_more) });
    let rig = Rig { left, right, covariance, ..start.values.shared.rig.clone() };
    Some(KnownLenses::of_rig(&rig, &Side::BOTH))
}

/// One camera by its own pictures, and the covariance of its numbers with how the pictures scatter in it.
fn one(start: &Problem, board: &Board, lens: Lens, side: Side) -> Option<(Camera, DMatrix<f64>)> {
    let camera = *start.values.shared.rig.camera(side);
    let shared = Shared { rig: Rig { left: camera, ..start.values.shared.rig.clone() }, shape_mm: FLAT };
    let pictures = start.views.iter().map(|view| as_left(view, side));
    let (views, poses): (Vec<View>, Vec<_>) = pictures
        .filter_map(|picture| Some((board_pose::fit(&shared, &picture)?, picture)))
        .map(|(pose, view)| (view, pose))
        .unzip();
    let priors = Priors::of_one_camera(&camera, board.diagonal_mm());
    let problem = Problem { views, values: Values { shared, poses }, priors };
    let alone = |shape| Layout { shape, ..Layout::one_camera(lens) };
    let (solved, layout) = problem.solve_bent_or_flat(None, alone).ok()?;
    let scatter = stated_uncertainty::excess_scatter(&solved, &layout, board);
    let count = layout.camera_count(Side::Left);
    let covariance = solved.uncertainty(&layout).ok()?.shared.view((0, 0), (count, count)) * scatter;
    Some((solved.shared().rig.left, covariance))
}
