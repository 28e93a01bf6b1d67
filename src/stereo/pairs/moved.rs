//! What happened to pairs in which nothing was mixed up and that miss the rig of the others by far.
//!
//! In: a series with its rig, and those pairs. Out: a cause a pair, with figures. Method: a board whose squares are
//! larger by a share is taken for nearer by each camera along its own rays: the two places that the cameras give it are
//! apart along the baseline, by that share of it. One number explains such a pair; a board or a camera that moved
//! between the two pictures takes six. A board that moved along the baseline looks the same, and a baseline that
//! changed: all are told, what is commonest first, that the board moved; where others show the same other size, and,
//! where others moved, three do, that it is a board. Goes wrong: several boards of one other size that all moved alike.

use nalgebra::Vector3;

use crate::geometry::rotation_vector;
use crate::stereo::data::View;
use crate::stereo::init::board_pose;
use crate::stereo::model::Shared;
use crate::stereo::pairs::mixups::Series;
use crate::stereo::pairs::numbering::renumbered;
use crate::stereo::pairs::{Cause, DiscardedPair, Missed};

/// Shares that differ by no more than this part of them are of one board.
const ONE_SIZE: f64 = 0.1;

/// Others of one size beside which a pair is of a board even where boards moved: two that moved alike are found among
/// any dozen.
const ENOUGH_OF_MOVED: usize = 2;

/// How the two pictures of a pair disagree.
struct Apart {
    /// From where the left picture has the board to where the right one has it, mm.
    way_mm: Vector3<f64>,
    turned_rad: f64,
    /// By what share larger squares would explain it.
    larger: Option<f64>,
}

/// What happened to each of these pairs; with each comes by how much it misses the rig, px, where it has a pose on it.
/// `missed` is how far the pairs miss it usually.
pub fn explain(series: &Series, strays: &[(usize, Option<f64>)], usual_px: f64, missed: Missed) -> Vec<DiscardedPair> {
    let apart: Vec<Option<Apart>> = strays.iter().map(|&(i, px)| apart(series, i, px)).collect();
    let others_moved = missed.is_of_two_moments() || apart.iter().flatten().any(|apart| apart.larger.is_none());
    let baseline_mm = series.shared.rig.baseline_mm();
    let explained = |(k, &(i, missed_px)): (usize, &(usize, Option<f64>))| {
        let pair = series.views[i].pair.as_str();
        let Some(Apart { way_mm, turned_rad, larger }) = &apart[k] else {
            let reason = "its corners form no board on one of the cameras".to_owned();
            return DiscardedPair::new(pair, Cause::Unknown, reason);
        };
        let missed = missed_px.map_or(String::new(), |px| {
            format!(" (its corners miss the rig by {px:.2} px, those of others by {usual_px:.2} px)")
        });
        let same = |other: &Apart| {
            larger.zip(other.larger).is_some_and(|(own, other)| (own - other).abs() <= ONE_SIZE * own.abs())
        };
        let again = apart.iter().enumerate().filter(|(other, a)| *other != k && a.as_ref().is_some_and(same)).count();
        let shown_again = again >= if others_moved { ENOUGH_OF_MOVED } else { 1 };
        let (or, way, or_board): (&'static [Cause], String, String) = match larger {
            Some(share) if shown_again => {
                let reason = format!("it shows {}{missed}", other_board(*share, baseline_mm));
                return DiscardedPair { or: &[Cause::Baseline], ..DiscardedPair::new(pair, Cause::OtherBoard, reason) };
            }
            Some(share) => (
                &[Cause::OtherBoard, Cause::Baseline],
                format!("{:.2} mm along the line between the cameras", share.abs() * baseline_mm),
                format!("; or it shows {}", other_board(*share, baseline_mm)),
            ),
            None => (&[], format!("{:.1} mm and {:.1} deg", way_mm.norm(), turned_rad.to_degrees()), String::new()),
        };
        let reason = format!(
            "its pictures were not taken at one moment: between them the board (or a camera) moved by about {way}{missed}{or_board}. Clamp \
             the board and trigger both cameras at once"
        );
        DiscardedPair { or, ..DiscardedPair::new(pair, Cause::NotSimultaneous, reason) }
    };
    strays.iter().enumerate().map(explained).collect()
}

/// A board with other squares, and what no picture tells from it.
fn other_board(share: f64, baseline_mm: f64) -> String {
    let (size, length) = if share > 0.0 { ("larger", "shorter") } else { ("smaller", "longer") };
    format!(
        "another board, its squares {:.2} % {size} than those in the other pairs, or the baseline was {:.2} mm {length}",
        100.0 * share.abs(),
        share.abs() * baseline_mm
    )
}

fn apart(series: &Series, i: usize, missed_px: Option<f64>) -> Option<Apart> {
    let view = &series.views[i];
    let [left, right] = board_pose::of_each_alone(series.shared, view);
    let (left, right) = left.zip(right)?;
    let way_mm = right.translation.vector - left.translation.vector;
    let centre = series.shared.rig.right_from_left.inverse().translation.vector;
    let (larger, share) = of_best_size(series.shared, view, way_mm.dot(&centre) / centre.norm_squared());
    let fits = missed_px.is_some() && board_pose::fits_within(series.shared, &larger, series.limit_px);
    let turn = |quarters| rotation_vector(&(right * renumbered(quarters) * left.inverse())).norm();
    let turned_rad = series.board.turns_of_outline().into_iter().map(turn).fold(f64::INFINITY, f64::min);
    Some(Apart { way_mm, turned_rad, larger: fits.then_some(share) })
}

/// The pair as one of a board that is larger by the share that fits best, and that share; the start is some parts of it
/// off.
fn of_best_size(shared: &Shared, view: &View, start: f64) -> (View, f64) {
    let sized = |share: f64| {
        let mut sized = view.clone();
        sized.observations.iter_mut().for_each(|o| o.board_mm *= 1.0 + share);
        sized
    };
    let cost = |share: f64| board_pose::least_cost(shared, &sized(share)).unwrap_or(f64::INFINITY);
    let (mut share, mut width) = (start, 0.5 * start.abs());
    // Near its minimum the cost is a parabola in the share.
    for _ in 0..5 {
        let [below, here, above] = [cost(share - width), cost(share), cost(share + width)];
        let bend = below - 2.0 * here + above;
        let step = 0.5 * width * (below - above) / bend;
        if !(bend > 0.0 && step.is_finite()) {
            break;
        }
        share += step.clamp(-2.0 * width, 2.0 * width);
        width *= 0.2;
    }
    (sized(share), share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::transform;
    use crate::imaging::Corners;
    use crate::stereo::calibrate::calibrate;
    use crate::stereo::synthetic::{BROWN4, World};

    /// What is said of the pairs that are left out.
    fn said(corners: &Corners) -> Vec<(String, Cause, String)> {
        let pairs = calibrate(corners, &BROWN4).unwrap().discarded.pairs;
        pairs.into_iter().map(|d| (d.pair, d.cause, d.reason)).collect()
    }

    /// The board was pushed along the baseline between the two pictures of these pairs, each by so many mm.
    fn pushed(world: &World, corners: &mut Corners, seed: u64, pushes: &[(usize, f64)]) {
        let baseline = world.rig.right_from_left.inverse().translation.vector.normalize();
        for &(pair, mm) in pushes {
            let mut moved = world.clone();
            moved.poses[pair] = transform(Vector3::zeros(), baseline * mm) * moved.poses[pair];
            corners.pairs[pair].right = moved.corners(seed).pairs[pair].right.clone();
        }
    }

    #[test]
    fn one_that_moved_along_the_baseline_among_others_that_moved_is_no_other_board() {
        let seed = 7;
        let world = World::new(14, seed);
        let mut corners = world.corners_by_hand(seed, 0.03);
        pushed(&world, &mut corners, seed, &[(4, 6.0)]);
        // Nor are two that moved by about as much.
        for others in [&[][..], &[(9, 6.2)]] {
            pushed(&world, &mut corners, seed, others);
            let told = said(&corners);
            assert_eq!(told.len(), 1 + others.len(), "{told:?}");
            for (_, cause, reason) in &told {
                assert_eq!(*cause, Cause::NotSimultaneous, "{reason}");
                let both = reason.contains("along the line between the cameras") && reason.contains("another board");
                assert!(both, "{reason}");
            }
        }
    }

    #[test]
    fn what_moved_alone_among_pairs_that_did_not_may_be_another_board() {
        let world = World::new(14, 7);
        let mut corners = world.corners(7);
        pushed(&world, &mut corners, 7, &[(4, 6.0)]);
        let pairs = calibrate(&corners, &BROWN4).unwrap().discarded.pairs;
        let [pair] = &pairs[..] else { panic!("{pairs:?}") };
        // What is commonest first, and all that explains it.
        assert_eq!((pair.pair.as_str(), pair.causes().as_str()), ("04", "not-simultaneous|other-board|baseline"));
        let reason = &pair.reason;
        assert!(reason.contains("the board (or a camera) moved") && reason.contains("or it shows another"), "{reason}");
        // Two of one size are of a board; two of two sizes may both have moved.
        pushed(&world, &mut corners, 7, &[(9, 6.0)]);
        let both = said(&corners);
        assert!(both.len() == 2 && both.iter().all(|(_, cause, _)| *cause == Cause::OtherBoard), "{both:?}");
        assert!(both.iter().all(|(_, _, reason)| !reason.contains("moved")), "{both:?}");
    }
}
