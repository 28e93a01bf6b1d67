//! Pictures under the wrong name, on the wrong side, turned or mirrored.

use super::picture_faults::PictureFault;
use nalgebra::Point2;
use stereocal::stereo::Rig;

use super::set::{Plan, Set};
use super::{Case, Right, case};

fn half_turn(px: Point2<f64>, width: f64, height: f64) -> Point2<f64> {
    Point2::new(width - 1.0 - px.x, height - 1.0 - px.y)
}

fn mirror(px: Point2<f64>, width: f64, _: f64) -> Point2<f64> {
    Point2::new(width - 1.0 - px.x, px.y)
}

fn quarter_turn(px: Point2<f64>, _: f64, height: f64) -> Point2<f64> {
    Point2::new(height - 1.0 - px.y, px.x)
}

/// Everything that is left for everything that is right.
fn exchanged(mut set: Set) -> Set {
    set.pairs.iter_mut().for_each(|pair| pair.sides.reverse());
    let Rig { left, right, right_from_left, .. } = set.rig;
    let left_from_field = right_from_left * set.plan.drawing.left_from_field();
    set.rig = Rig { left: right, right: left, right_from_left: right_from_left.inverse(), covariance: None };
    set.field = Some(left_from_field);
    set
}

fn turned(set: Set, pairs: std::ops::Range<usize>, side: usize, fault: PictureFault) -> Set {
    set.pairs_in(pairs, |_, pair| pair.sides[side].faults.push(fault))
}

pub fn cases() -> Vec<Case> {
    let mut list = Vec::new();
    for squares in ["20x20", "12x9"] {
        let plan = move |seed, px| Plan::usual(seed, px).board(squares, if squares == "12x9" { 16.0 } else { 10.0 });
        let add = |name, right, make: fn(Set) -> Set| {
            case("mix-up", name, squares, right, move |seed, px| make(plan(seed, px).set()))
        };
        list.extend([
            add("left and right exchanged, all", Right::Truth, exchanged),
            add("left and right exchanged, pair 5", Right::Pass, |set| {
                set.pairs_in(4..5, |_, pair| pair.sides.reverse())
            }),
            add("right turned by 180, all", Right::Truth, |mut set| {
                set.maps[1] = half_turn;
                turned(set, 0..12, 1, PictureFault::QuarterTurns(2))
            }),
            add("right turned by 180, pairs 3 and 4", Right::Pass, |set| {
                turned(set, 2..4, 1, PictureFault::QuarterTurns(2))
            }),
            add("right turned by 90, all", Right::Truth, |mut set| {
                set.maps[1] = quarter_turn;
                turned(set, 0..12, 1, PictureFault::QuarterTurns(1))
            }),
            add("right turned by 90, pair 3", Right::Pass, |set| turned(set, 2..3, 1, PictureFault::QuarterTurns(1))),
            add("right mirrored, all", Right::Truth, |set| turned(set, 0..12, 1, PictureFault::Mirrored)),
            add("right mirrored, pair 3", Right::Pass, |set| turned(set, 2..3, 1, PictureFault::Mirrored)),
            // A mirrored world is a rig too, whose left camera stands on the right: lengths are what they were.
            add("both mirrored, all", Right::Truth, |mut set| {
                set.maps = [mirror; 2];
                set.lengths_only = true;
                let set = turned(set, 0..12, 0, PictureFault::Mirrored);
                turned(set, 0..12, 1, PictureFault::Mirrored)
            }),
            add("pairs 3 and 4 have each other's right picture", Right::Truth, |set| swapped(set, 2, 3)),
            add("right pictures one off, all", Right::Truth, |mut set| {
                for k in 0..11 {
                    set = swapped(set, k, k + 1);
                }
                set
            }),
        ]);
    }
    list.push(case("mix-up", "squares typed one too few", "", Right::Truth, |seed, px| {
        let mut set = Plan::usual(seed, px).set();
        set.typed.squares = "15x15".parse().expect("a board");
        set
    }));
    list.push(case("mix-up", "twice the pitch typed", "", Right::Truth, |seed, px| {
        // Nothing but the typed number says what a square is: the rig is twice as large by it.
        let mut set = Plan::usual(seed, px).set();
        set.typed.square_mm = 25.4;
        set.scale = 0.5;
        set.arguments = vec!["--tolerance-mm".to_owned(), "0.1".to_owned()];
        set
    }));
    list
}

fn swapped(mut set: Set, a: usize, b: usize) -> Set {
    let other = set.pairs[a].sides[1].clone();
    set.pairs[a].sides[1] = std::mem::replace(&mut set.pairs[b].sides[1], other);
    set
}
