//! What a laboratory has behind a board: a wall, a table, boxes, bars, cables; and what carries the board.

use nalgebra::{Point2, Vector3};

use super::draws::{Draws, Purpose};
use super::physical_board::PhysicalBoard;
use super::picture::patch::{Patch, Tone};
use super::rig::left_from_field;
use crate::geometry::transform;

/// Shapes in front of the wall.
const SHAPES: usize = 70;

/// Sides of a polygon that passes for a disc.
const DISC_SIDES: usize = 48;

/// What stands behind at one placement of the cameras, in the left camera's frame, from far to near.
pub fn behind(seed: u64, placement: u64) -> Vec<Patch> {
    let mut draws = Draws::new(seed, Purpose::Clutter, placement);
    let wall = rectangle(1200.0, 1200.0);
    let tone = Tone { value: draws.uniform(0.25, 0.4), slope: (draws.uniform(-0.5, 0.5), draws.uniform(-0.5, 0.5)) };
    let field = left_from_field();
    let mut patches = vec![Patch {
        parent_from_patch: field * transform(Vector3::zeros(), Vector3::z() * 420.0),
        corners_mm: wall,
        tone,
    }];
    for k in 0..SHAPES {
        let depth = 400.0 - 230.0 * k as f64 / SHAPES as f64;
        let place = Vector3::new(draws.uniform(-330.0, 330.0), draws.uniform(-330.0, 330.0), depth);
        let lean = draws.direction() * draws.uniform(0.0, 0.3) + Vector3::z() * draws.uniform(-1.5, 1.5);
        let corners_mm = match draws.bits() % 5 {
            0 => disc(draws.uniform(6.0, 40.0)),
            1 => rectangle(draws.uniform(100.0, 500.0), draws.uniform(2.0, 9.0)),
            2 => irregular(&mut draws),
            _ => rectangle(draws.uniform(15.0, 110.0), draws.uniform(15.0, 110.0)),
        };
        let tone =
            Tone { value: draws.uniform(0.04, 0.75), slope: (draws.uniform(-0.4, 0.4), draws.uniform(-0.4, 0.4)) };
        patches.push(Patch { parent_from_patch: field * transform(lean, place), corners_mm, tone });
    }
    patches
}

/// What holds the check board: a plate and a post behind it, in the board's frame.
pub fn stand(board: &PhysicalBoard) -> Vec<Patch> {
    let (w, h) = board.plate_half_mm();
    vec![
        upright([0.0, h + 150.0, 40.0], rectangle(36.0, 340.0), 0.16, (0.7, 0.0)),
        upright([0.0, h - 4.0, 12.0], rectangle(w * 0.6, 26.0), 0.1, (0.2, 0.3)),
    ]
}

/// What holds the target: the flange behind it and the arm behind that, in the target's frame.
pub fn arm(target: &PhysicalBoard) -> Vec<Patch> {
    let (w, h) = target.plate_half_mm();
    vec![
        upright([0.35 * w, h + 60.0, 95.0], rectangle(84.0, 260.0), 0.55, (-0.6, 0.1)),
        upright([-12.0, 8.0, 30.0], disc(52.0), 0.3, (0.5, 0.3)),
        upright([-12.0, 8.0, 22.0], disc(44.0), 0.12, (-0.4, 0.3)),
    ]
}

/// A patch at a place, parallel to its parent's x-y plane.
fn upright(at_mm: [f64; 3], corners_mm: Vec<Point2<f64>>, value: f64, slope: (f64, f64)) -> Patch {
    Patch { parent_from_patch: transform(Vector3::zeros(), at_mm.into()), corners_mm, tone: Tone { value, slope } }
}

fn rectangle(width: f64, height: f64) -> Vec<Point2<f64>> {
    let (w, h) = (width / 2.0, height / 2.0);
    vec![Point2::new(-w, -h), Point2::new(w, -h), Point2::new(w, h), Point2::new(-w, h)]
}

fn disc(radius: f64) -> Vec<Point2<f64>> {
    let turns = (0..DISC_SIDES).map(|k| (k as f64 / DISC_SIDES as f64 * std::f64::consts::TAU).sin_cos());
    turns.map(|(sin, cos)| Point2::new(radius * cos, radius * sin)).collect()
}

fn irregular(draws: &mut Draws) -> Vec<Point2<f64>> {
    let sides = 3 + draws.bits() % 5;
    let corner = |k: u64| {
        let (sin, cos) = ((k as f64 + draws.uniform(-0.3, 0.3)) / sides as f64 * std::f64::consts::TAU).sin_cos();
        let radius = draws.uniform(20.0, 80.0);
        Point2::new(radius * cos, radius * sin)
    };
    (0..sides).map(corner).collect()
}
