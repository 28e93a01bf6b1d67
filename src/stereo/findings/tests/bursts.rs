//! Bursts and frames of a video: several pictures of one pose of the board.

use crate::imaging::{Corners, PairCorners};
use crate::stereo::findings::standing::calibrate_standing;
use crate::stereo::select::options::Options;
use crate::stereo::synthetic::World;

use super::asked;

/// What moved a board that is held by hand between its two pictures is alike in the pictures of a burst.
#[test]
fn bursts_are_no_more_evidence_of_a_change_than_one_picture_of_each() {
    for seed in 1..=6 {
        let world = World { sigma_px: 0.02, ..World::new(14, seed) };
        let single = world.corners_by_hand(seed, 0.03);
        let again = |pair: &PairCorners, k: usize| {
            let mut again = pair.clone();
            again.pair = format!("{}_{k}", pair.pair);
            for corner in again.left.iter_mut().chain(&mut again.right) {
                corner.px.x += 0.01 * ((3 * corner.col + 7 * corner.row + k) as f64).sin();
            }
            again
        };
        let pairs = single.pairs.iter().flat_map(|pair| (0..3).map(move |k| again(pair, k))).collect();
        let burst = Corners { pairs, ..single.clone() };
        let changes = |corners: &Corners| {
            let (found, told) = calibrate_standing(corners, &asked(Options::default())).unwrap();
            let told = told.into_iter().filter(|told| told.along.is_some()).map(|told| told.action);
            (found.standing.since, told.collect::<Vec<String>>())
        };
        assert_eq!(changes(&burst), (None, Vec::new()), "{seed}, and of one of each: {:?}", changes(&single));
    }
}
