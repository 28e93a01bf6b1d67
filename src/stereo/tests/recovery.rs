//! Exact corners give the exact rig, whichever camera is the left one and however many threads.

use super::*;
use crate::imaging::PairCorners;
use crate::stereo::solve::Loss;
use crate::stereo::solve::levenberg_marquardt::{Search, Stop};

fn swapped(corners: &Corners) -> Corners {
    let mut swapped = corners.clone();
    std::mem::swap(&mut swapped.left_size, &mut swapped.right_size);
    for PairCorners { left, right, .. } in &mut swapped.pairs {
        std::mem::swap(left, right);
    }
    swapped
}

#[test]
fn exact_corners_give_the_exact_rig() {
    let mut world = World::new(8, 1);
    world.sigma_px = 0.0;
    let mut corners = world.corners(1);
    for corner in corners.pairs.iter_mut().flat_map(|p| p.left.iter_mut().chain(&mut p.right)) {
        corner.covariance_px2 = None;
    }
    let found = calibrate(&corners, &BROWN4).unwrap();
    // Rounding of pixels near 1000 px, magnified by the geometry.
    assert!((found.rig().left.fx - world.rig.left.fx).abs() < 1e-6, "{}", found.rig().left.fx);
    assert!((found.rig().baseline_mm() - world.rig.baseline_mm()).abs() < 1e-7);
}

#[test]
fn swapping_the_cameras_inverts_the_rig() {
    let corners = World::new(9, 2).corners(3);
    let straight = calibrate(&corners, &BROWN4).unwrap();
    let crossed = calibrate(&swapped(&corners), &BROWN4).unwrap();
    let back = crossed.rig().right_from_left.inverse();
    let off = (straight.rig().right_from_left.to_matrix() - back.to_matrix()).amax();
    assert!(off < 1e-6, "the rigs differ by {off}");
    assert!((straight.rig().left.fx - crossed.rig().right.fx).abs() < 1e-5);
}

/// The curvature of the loss is in its steps; by the weights alone it takes half as many more.
#[test]
fn a_robust_search_near_the_minimum_takes_few_steps() {
    let found = calibrate(&World::new(9, 2).corners_by_hand(3, 0.03), &BROWN4).unwrap();
    let mut problem = found.problem();
    problem.values.shared.rig.left.fx *= 1.001;
    let solution = problem.search(&found.layout, Loss::Student(4.0), Search::ROBUST);
    assert!(solution.stop == Stop::Minimum && solution.steps <= 15, "{:?} after {}", solution.stop, solution.steps);
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let corners = World::new(9, 2).corners(3);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| calibrate(&corners, &Options::default()).unwrap())
    };
    assert_eq!(with(1), with(3));
}
