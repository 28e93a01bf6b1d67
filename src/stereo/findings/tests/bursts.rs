//! Bursts and frames of a video: several pictures of one pose of the board.

use nalgebra::Vector3;

use crate::imaging::{Corners, PairCorners};
use crate::stereo::findings::Kind;
use crate::stereo::findings::standing::{Asked, calibrate_standing};
use crate::stereo::select::options::Options;
use crate::stereo::synthetic::World;

use super::asked;

/// Three pictures of each pose, with a noise of their own that is far below what moves a board by hand.
fn burst(single: &Corners) -> Corners {
    let again = |pair: &PairCorners, k: usize| {
        let mut again = pair.clone();
        again.pair = format!("{}_{k}", pair.pair);
        for corner in again.left.iter_mut().chain(&mut again.right) {
            corner.px.x += 0.01 * ((3 * corner.col + 7 * corner.row + k) as f64).sin();
        }
        again
    };
    let pairs = single.pairs.iter().flat_map(|pair| (0..3).map(move |k| again(pair, k))).collect();
    Corners { pairs, ..single.clone() }
}

#[test]
fn a_camera_that_turned_between_two_bursts_is_told_with_the_pairs_since() {
    let world = World { sigma_px: 0.02, ..World::new(14, 4) };
    let mut single = world.corners(4);
    let turned = world.with_camera_moved(Vector3::y() * 3e-4, Vector3::zeros()).corners(4);
    single.pairs[9..].clone_from_slice(&turned.pairs[9..]);
    let corners = burst(&single);
    let asked = Asked { tolerance_mm: 10.0, ..asked(Options::default()) };
    let (found, told) = calibrate_standing(&corners, &asked).unwrap();
    let [told] = &told[..] else { panic!("{told:?}") };
    let since: Vec<&str> = corners.pairs[27..].iter().map(|pair| pair.pair.as_str()).collect();
    assert!(told.kind == Kind::Step && told.cause.contains("yaw") && told.pairs == since, "{told:?}");
    let by_pair = &told.along.as_ref().unwrap().by_pair;
    assert!(by_pair.len() == found.views.len() && by_pair.iter().enumerate().all(|(i, x)| *x == f64::from(i >= 27)));
}

/// What moved a board that is held by hand between its two pictures is alike in the pictures of a burst.
#[test]
fn bursts_are_no_more_evidence_of_a_change_than_one_picture_of_each() {
    for seed in 1..=6 {
        let world = World { sigma_px: 0.02, ..World::new(14, seed) };
        let single = world.corners_by_hand(seed, 0.03);
        let burst = burst(&single);
        let changes = |corners: &Corners| {
            let (found, told) = calibrate_standing(corners, &asked(Options::default())).unwrap();
            let told = told.into_iter().filter(|told| told.along.is_some()).map(|told| told.action);
            (found.standing.since, told.collect::<Vec<String>>())
        };
        assert_eq!(changes(&burst), (None, Vec::new()), "{seed}, and of one of each: {:?}", changes(&single));
    }
}
