//! The lenses of a rig whose pictures were not taken at one moment, from each camera's own pictures.
//!
//! In: the pairs at their start, how far each camera misses its own pictures and how far the pairs miss their rig. Out:
//! both lenses with their covariance. Method: what moved between the two pictures of a pair says nothing of either
//! lens, and each picture by itself is as good as ever; so each camera is solved alone, its board bent or flat. In the
//! bundle of the pairs, whose corners then weigh by how far the pairs miss the rig, the same corners count once more by
//! the square of the ratio of the two; by so much less the lenses are known. Goes wrong: boards that do not tell one of
//! the cameras by itself; then no lens is known.

use nalgebra::DMatrix;

use crate::imaging::{Board, Side};
use crate::stereo::data::View;
use crate::stereo::init::board_pose;
use crate::stereo::init::single_camera::as_left;
use crate::stereo::model::board_shape::FLAT;
use crate::stereo::model::{Covariance, KnownLenses, Layout, Shared, Values};
use crate::stereo::pairs::Missed;
use crate::stereo::select::stated_uncertainty;
use crate::stereo::solve::{Priors, Problem, Solved};
use crate::stereo::{Camera, Lens, Rig};

/// Both cameras with this lens, as their own pictures tell it. `None` where these do not, or where the pairs, `paired`
/// with the same lens, tell more than they; `missed` is what is known where the pairs tell no rig.
pub fn lenses(
    start: &Problem,
    board: &Board,
    lens: Lens,
    paired: Option<&Solved>,
    missed: Missed,
) -> Option<KnownLenses> {
    let near = paired.map_or(&start.values, |paired| &paired.problem.values);
    let [left, right] = [one(start, near, board, lens, Side::Left)?, one(start, near, board, lens, Side::Right)?];
    // By the lens that was chosen: what a simpler one lacks is not lost in the pairs.
    let alone_px = (0.5 * (left.scatter_px.powi(2) + right.scatter_px.powi(2))).sqrt();
    let missed = paired.map_or(missed, |paired| Missed { times: scatter_px(paired) / alone_px });
    if !missed.is_better_alone() {
        return None;
    }
    let once_more = missed.times.powi(-2);
    let layout = Layout { transform: false, ..Layout::rig(lens, false) };
    let (n, at) = (left.covariance.nrows(), layout.camera_start(Side::Right));
    let mut matrix = DMatrix::zeros(layout.count(), layout.count());
    matrix.view_mut((0, 0), (n, n)).copy_from(&left.covariance);
    matrix.view_mut((at, at), (n, n)).copy_from(&right.covariance);
    let covariance = Some(Covariance { order: layout.names(), matrix: matrix / (1.0 - once_more) });
    let rig = Rig { left: left.camera, right: right.camera, covariance, ..start.values.shared.rig.clone() };
    Some(KnownLenses::of_rig(&rig, &Side::BOTH))
}

/// What one coordinate of a corner scatters by.
fn scatter_px(solved: &Solved) -> f64 {
    solved.noise.typical_px(&solved.problem.views)
}

/// A camera by itself.
struct Alone {
    camera: Camera,
    /// Of its numbers, with how its pictures scatter in it.
    covariance: DMatrix<f64>,
    scatter_px: f64,
}

/// One camera by its own pictures, from the one that the pairs give.
fn one(start: &Problem, near: &Values, board: &Board, lens: Lens, side: Side) -> Option<Alone> {
    let camera = *near.shared.rig.camera(side);
    let shared = Shared { rig: Rig { left: camera, ..near.shared.rig.clone() }, shape_mm: FLAT };
    let pictures = start.views.iter().map(|view| as_left(view, side));
    let (views, poses): (Vec<View>, Vec<_>) = pictures
        .filter_map(|picture| Some((board_pose::fit(&shared, &picture)?, picture)))
        .map(|(pose, view)| (view, pose))
        .unzip();
    let priors = Priors::of_one_camera(&camera, board.diagonal_mm());
    let problem = Problem { views, values: Values { shared, poses }, priors };
    let alone = |shape| Layout { shape, ..Layout::one_camera(lens) };
    let (solved, layout) = problem.solve_bent_or_flat(None, alone).ok()?;
    let scatter = stated_uncertainty::excess_scatter(&solved, &layout);
    let count = layout.camera_count(Side::Left);
    let covariance = solved.covariance(&layout).ok()?.view((0, 0), (count, count)) * scatter;
    Some(Alone { camera: solved.shared().rig.left, covariance, scatter_px: scatter_px(&solved) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stereo::calibrate::calibrate;
    use crate::stereo::select::options::Options;
    use crate::stereo::synthetic::World;

    #[test]
    fn pictures_of_two_moments_tell_their_lenses() {
        const WORLDS: u64 = 2;
        let options = Options { lens: Some(Lens::Brown5), shape: Some(false), known: None };
        let (mut off, mut count, mut link) = (0.0, 0.0, 0.0);
        for turn_deg in [0.02, 0.1] {
            for seed in 1..=WORLDS {
                let world = World::new(10, seed);
                let found = calibrate(&world.corners_by_hand(seed, turn_deg), &options).unwrap();
                let (rig, at) = (found.rig().right_from_left, found.layout.transform_start());
                let truth = world.rig.right_from_left;
                let turn = (rig.rotation * truth.rotation.inverse()).scaled_axis();
                let shift = rig.translation.vector - truth.translation.vector;
                link += (0..3).map(|k| turn[k].powi(2) / found.covariance[(at + k, at + k)]).sum::<f64>();
                link += (3..6).map(|k| shift[k - 3].powi(2) / found.covariance[(at + k, at + k)]).sum::<f64>();
                for (at, [found_px, true_px]) in [
                    (0, [found.rig().left.fx, world.rig.left.fx]),
                    (found.layout.camera_start(Side::Right), [found.rig().right.fx, world.rig.right.fx]),
                ] {
                    let sigma_px = found.covariance[(at, at)].sqrt();
                    // Corners of 0.05 px tell 2000 px to about 1.5, however far the pairs miss their rig.
                    assert!(sigma_px < 4.0, "{turn_deg} deg, {seed}: {sigma_px}");
                    off += ((found_px - true_px) / sigma_px).powi(2);
                    count += 1.0;
                }
            }
        }
        assert!((0.4..1.6).contains(&(off / count)), "{}", off / count);
        // What moved is counted once: as each pair's own motion, and not as corners that scatter as well.
        let link = link / (6 * 2 * WORLDS) as f64;
        assert!((0.6..1.4).contains(&link), "{link}");
    }

    #[test]
    fn of_pictures_of_one_moment_nothing_is_lost_in_the_pairs() {
        for seed in 1..=3 {
            let mut world = World::new(9, seed);
            for bow_mm in [0.0, 0.4] {
                world.bow_mm[0] = bow_mm;
                let found = calibrate(&world.corners(seed), &Options::default()).unwrap();
                assert!(!found.priors.know_lenses(), "{seed} {bow_mm}");
            }
        }
    }
}
