//! What is planted in a series, by how much, and what may be said of it.

use std::sync::Arc;

use nalgebra::Vector3;
use stereocal::geometry::{Transform, transform};
use stereocal::simulate::draws::{Draws, Purpose};
use stereocal::simulate::physical_board::PhysicalBoard;

use super::super::set::Set;
use super::limit::Spread;

/// Plants a fault of a size.
pub type Plant = fn(&mut Set, f64);

/// A fault at several sizes.
pub struct Line {
    pub name: &'static str,
    pub unit: &'static str,
    pub sizes: &'static [f64],
    pub plant: Plant,
    pub spread: Spread,
    pub due: Due,
}

/// What may be said of a fault.
pub struct Due {
    /// Causes that are the reason.
    pub right: &'static [&'static str],
    /// Causes that hold it among others, or do the same to these pairs.
    pub equals: &'static [&'static str],
    pub kind: &'static str,
    /// The pairs that a step begins with or that something happened to; empty for all.
    pub pairs: fn(usize) -> Vec<usize>,
}

impl Line {
    pub fn full_name(&self) -> String {
        format!("reason/{}", self.name)
    }
}

/// Pairs that are taken at another moment, or with another board.
const TWO: [usize; 2] = [3, 7];

/// Speed of a board that is held by hand, mm and deg in a second.
const HAND_MM: f64 = 20.0;
const HAND_DEG: f64 = 3.0;

const YAW: Due = Due { right: &["yaw"], equals: &["camera-moved"], kind: "drift", pairs: all };
const FOCUS: Due = Due { right: &["focus"], equals: &[], kind: "drift", pairs: all };
const BASELINE: Due = Due { right: &["baseline"], equals: &["other-board", "camera-moved"], kind: "drift", pairs: all };
const LATE: Due = Due { right: &["not-simultaneous"], equals: &[], kind: "pair", pairs: all };

fn all(_: usize) -> Vec<usize> {
    Vec::new()
}

/// All of them.
pub fn lines() -> Vec<Line> {
    let step = |name, plant: Plant, pairs| Line {
        name,
        unit: "deg",
        sizes: &[0.005, 0.05],
        plant,
        spread: Spread::Series,
        due: Due { kind: "step", pairs, ..YAW },
    };
    let series = |name, unit, sizes, plant: Plant, due| Line { name, unit, sizes, plant, spread: Spread::Series, due };
    let pairs = |name, unit, sizes, plant: Plant, due| Line { name, unit, sizes, plant, spread: Spread::Pairs, due };
    vec![
        series(
            "focal drift",
            "ppm",
            &[20.0, 100.0, 500.0],
            |set, ppm| along(set, |set, k, share| focus(set, k, ppm * share)),
            FOCUS,
        ),
        series(
            "baseline creep",
            "um",
            &[10.0, 50.0],
            |set, um| along(set, |set, k, share| longer(set, k, um * share)),
            BASELINE,
        ),
        series(
            "yaw drift",
            "deg",
            &[0.002, 0.005, 0.01],
            |set, deg| along(set, |set, k, share| yaw(set, k, deg * share)),
            YAW,
        ),
        pairs("random yaw", "deg", &[0.002, 0.005, 0.01], random_yaw, Due { equals: &["yaw", "camera-moved"], ..LATE }),
        step(
            "step at a third",
            |set, deg| (set.pairs.len() / 3..set.pairs.len()).for_each(|k| yaw(set, k, deg)),
            |n| vec![n / 3],
        ),
        step(
            "step at half",
            |set, deg| (set.pairs.len() / 2..set.pairs.len()).for_each(|k| yaw(set, k, deg)),
            |n| vec![n / 2],
        ),
        step(
            "step, last two pairs",
            |set, deg| (set.pairs.len() - 2..set.pairs.len()).for_each(|k| yaw(set, k, deg)),
            |n| vec![n - 2],
        ),
        pairs(
            "another board in two pairs",
            "%",
            &[0.1, 1.0],
            other_board,
            Due { right: &["other-board"], equals: &["baseline"], kind: "pair", pairs: |_| TWO.to_vec() },
        ),
        pairs(
            "two pairs not simultaneous",
            "ms",
            &[5.0, 50.0],
            |set, ms| TWO.into_iter().for_each(|k| late(set, k, ms)),
            Due { pairs: |_| TWO.to_vec(), ..LATE },
        ),
        pairs(
            "all not simultaneous",
            "ms",
            &[5.0, 50.0],
            |set, ms| (0..set.pairs.len()).for_each(|k| late(set, k, ms)),
            LATE,
        ),
    ]
}

fn along(set: &mut Set, change: impl Fn(&mut Set, usize, f64)) {
    let last = set.pairs.len() - 1;
    (0..=last).for_each(|k| change(set, k, k as f64 / last as f64));
}

/// The right camera stands elsewhere for a pair; for the last pair it is the rig that stands.
pub fn right_moves(set: &mut Set, k: usize, moved_from_right: Transform) {
    let side = &mut set.pairs[k].sides[1];
    side.camera_from_board = moved_from_right * side.camera_from_board;
    if k + 1 == set.pairs.len() {
        set.rig.right_from_left = moved_from_right * set.rig.right_from_left;
    }
}

pub fn yaw(set: &mut Set, k: usize, deg: f64) {
    right_moves(set, k, transform(Vector3::y() * deg.to_radians(), Vector3::zeros()));
}

pub fn longer(set: &mut Set, k: usize, um: f64) {
    let along = set.pairs[k].sides[1].camera_from_board * set.pairs[k].sides[0].camera_from_board.inverse();
    right_moves(set, k, transform(Vector3::zeros(), along.translation.vector.normalize() * um * 1e-3));
}

pub fn focus(set: &mut Set, k: usize, ppm: f64) {
    let camera = &mut set.pairs[k].sides[1].camera;
    (camera.fx, camera.fy) = (camera.fx * (1.0 + ppm * 1e-6), camera.fy * (1.0 + ppm * 1e-6));
    if k + 1 == set.pairs.len() {
        set.rig.right = set.pairs[k].sides[1].camera;
    }
}

/// Turned at random for each pair; the rig that counts is the one in the middle of them.
pub fn random_yaw(set: &mut Set, deg: f64) {
    let rig = set.rig.clone();
    for k in 0..set.pairs.len() {
        let mut draws = Draws::new(set.plan.settings.seed, Purpose::Points, 300 + k as u64);
        yaw(set, k, deg * draws.normal());
    }
    set.rig = rig;
}

/// The board moves between the left and the right picture, as a hand does.
pub fn late(set: &mut Set, k: usize, ms: f64) {
    let mut draws = Draws::new(set.plan.settings.seed, Purpose::Points, 400 + k as u64);
    let shift = draws.direction() * HAND_MM * ms * 1e-3;
    let turn = draws.direction() * (HAND_DEG * ms * 1e-3).to_radians();
    let side = &mut set.pairs[k].sides[1];
    let from_left = set.rig.right_from_left;
    let at = from_left.inverse() * side.camera_from_board;
    let mut moved = transform(turn, Vector3::zeros()) * at;
    moved.translation.vector = at.translation.vector + shift;
    side.camera_from_board = from_left * moved;
}

fn other_board(set: &mut Set, percent: f64) {
    for k in TWO {
        let of = &set.pairs[k].sides[0].board;
        let mut workmanship = of.workmanship;
        workmanship.scale_ppm += 1e4 * percent;
        let board = Arc::new(PhysicalBoard::new(of.drawing, workmanship, set.plan.settings.seed, 9));
        set.pairs[k].sides.iter_mut().for_each(|side| side.board = board.clone());
    }
}
