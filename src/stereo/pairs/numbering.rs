//! How a board's corners are numbered: the turns that leave it looking the same, and which of them a picture needs.
//!
//! In: a board, and the poses that pictures give it. Out: quarter turns of the numbering. A board whose outline or
//! colours are the same after a turn in its plane can be numbered from several corners, and a picture alone does not
//! say from which. Two pictures of one pair must agree, and the place of the cameras to each other decides: turns
//! differ by at least 90 degrees, poses from single pictures by a few. That holds for any roll of one camera against
//! the other. Which way a pair as a whole is numbered stays open. Goes wrong: no pose from one of the pictures.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;

use crate::geometry::{Transform, rotation_vector, transform};
use crate::imaging::{Board, PairCorners};
use crate::statistics::median;
use crate::stereo::Side;
use crate::stereo::data::{Noise, View};
use crate::stereo::init::board_pose;
use crate::stereo::init::homography::FEWEST_CORNERS;
use crate::stereo::model::Shared;

/// What a board's pose is multiplied with when its corners are renumbered by [`View::turn_right`].
pub fn renumbered(quarters: usize) -> Transform {
    transform(Vector3::z() * (-FRAC_PI_2 * quarters as f64), Vector3::zeros())
}

/// The turn of the right picture's numbering after which both pictures of a pair show one board on a rig that is known.
/// `None` where one of the pictures gives no pose.
pub fn on_rig(shared: &Shared, board: &Board, view: &View) -> Option<usize> {
    let [left, right] = Side::BOTH.map(|side| board_pose::of_picture(shared, view, side));
    let (left, right) = (left?, right?);
    let angle = |quarters: usize| rotation_vector(&(right * renumbered(quarters) * left.inverse())).norm();
    board.turns_left_open().into_iter().min_by(|a, b| angle(*a).total_cmp(&angle(*b)))
}

/// A pair's corners, weighed by their noise where it is known, and numbered as a rig has it: how the cameras stand
/// decides between numberings that the pictures leave open.
pub fn seen_on_rig(shared: &Shared, board: &Board, pair: &PairCorners, noise: Option<&Noise>) -> View {
    let mut view = View::new(board, pair, FEWEST_CORNERS);
    if let Some(noise) = noise {
        noise.apply(std::slice::from_mut(&mut view));
    }
    view.turn_right(board, on_rig(shared, board, &view).unwrap_or(0));
    view
}

/// Where the right camera stands as most pairs have it, and the turn of each pair's right numbering that agrees with
/// it. `poses` are `left_from_board` and `right_from_board` of every pair, each from its own picture.
pub fn agreed(
    turns: &[usize],
    poses: &[Option<(Transform, Transform)>],
    distance_mm: f64,
) -> Option<(Transform, Vec<usize>)> {
    let choice =
        |(left, right): &(Transform, Transform), quarters: usize| right * renumbered(quarters) * left.inverse();
    let choices: Vec<Vec<Transform>> =
        poses.iter().flatten().map(|pair| turns.iter().map(|&q| choice(pair, q)).collect()).collect();
    let right_from_left = agreed_transform(&choices, distance_mm)?;
    let nearest = |pair: &(Transform, Transform)| {
        let off = |quarters: usize| deviation(&choice(pair, quarters), &right_from_left, distance_mm);
        turns.iter().copied().min_by(|a, b| off(*a).total_cmp(&off(*b)))
    };
    let of_pairs = poses.iter().map(|pair| pair.as_ref().and_then(nearest).unwrap_or(0)).collect();
    Some((right_from_left, of_pairs))
}

/// How far two rigs are apart: the angle between the rotations plus the distance of the translations in units of the
/// boards' distance.
pub(super) fn deviation(a: &Transform, b: &Transform, distance_mm: f64) -> f64 {
    rotation_vector(&(a.inverse() * b)).norm()
        + (a.translation.vector - b.translation.vector).norm() / distance_mm.max(f64::MIN_POSITIVE)
}

/// The `right_from_left` that the pairs agree on: the one whose deviation from all pairs is smallest in the median. A
/// pair may offer several (a board that looks the same after a half turn); its nearest counts.
fn agreed_transform(choices: &[Vec<Transform>], distance_mm: f64) -> Option<Transform> {
    let off = |a: &Transform| {
        let nearest = |pair: &Vec<Transform>| {
            pair.iter().map(|b| deviation(a, b, distance_mm)).min_by(f64::total_cmp).unwrap_or(f64::INFINITY)
        };
        // Boards that are all seen alike leave two equal answers: cameras side by side are rolled less than a half
        // turn.
        median(choices.iter().map(nearest)).unwrap_or(f64::INFINITY) + 1e-3 * rotation_vector(a).norm()
    };
    choices.iter().flatten().min_by(|a, b| off(a).total_cmp(&off(b))).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::Squares;
    use crate::stereo::synthetic::World;

    #[test]
    fn any_roll_of_a_camera_and_any_numbering_of_its_picture_is_undone() {
        // Square boards of an odd number of squares look the same after every quarter turn.
        for (columns, rows, step) in [(9, 9, 1), (8, 8, 2), (9, 7, 2)] {
            for roll_deg in [0.0_f64, 45.0, 90.0, 180.0, -60.0] {
                let mut world = World::new(3, 5);
                world.board.squares = Squares { columns, rows };
                let roll = transform(Vector3::z() * roll_deg.to_radians(), Vector3::zeros());
                world.rig.right_from_left = roll * world.rig.right_from_left;
                // A board in the middle of both pictures stays there when one is rolled.
                world.poses.iter_mut().for_each(|pose| pose.translation.vector *= 1.4);
                let shared = Shared { rig: world.rig.clone(), shape_mm: Default::default() };
                for pair in &world.corners(6).pairs {
                    for wrong in (0..4).step_by(step) {
                        let mut view = View::new(&world.board, pair, 0);
                        view.turn_right(&world.board, wrong);
                        let found = on_rig(&shared, &world.board, &view).unwrap();
                        assert_eq!((found + wrong) % 4, 0, "{columns}x{rows}, rolled by {roll_deg}, turned by {wrong}");
                    }
                }
            }
        }
    }
}
