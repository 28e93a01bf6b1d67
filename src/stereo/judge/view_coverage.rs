//! Do the views differ enough to tell the cameras, and what should be photographed next?
//!
//! In: a calibration. Out: how the views are spread, and advice where something is missing. Tilt separates the focal
//! length from the distance; corners near the borders determine the lens; different distances separate the lens from
//! the focal length.

use nalgebra::{Point2, Point3, Vector2};

use crate::diagnostic::count;
use crate::imaging::Side;
use crate::stereo::Rig;
use crate::stereo::calibrate::Calibration;
use crate::stereo::data::{Observation, View};
use crate::stereo::judge::residual_correlation::{CELLS, Field, ResidualPattern};
use crate::stereo::volume::{range, tilts_deg};

/// Tilts between the boards below this leave the focal length to the distortion, deg.
const LEAST_TILT_DEG: f64 = 15.0;

/// Distances that differ by less than this share are one distance.
const LEAST_DEPTH_SHARE: f64 = 0.05;

/// Share of the cells of a picture that should have seen a corner.
const LEAST_COVERAGE: f64 = 0.5;

/// Corners in a cell that make it seen.
const SEEN: usize = 3;

/// Pairs below which a calibration's own uncertainty rests on too little: a fold then leaves out a tenth or more of all
/// views.
pub const ENOUGH_PAIRS: usize = 10;

/// How the views are spread.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage {
    /// Pairs that were used.
    pub pairs: usize,
    /// Whether both lenses were known before, so that the views need not tell them.
    pub lenses_known: bool,
    /// Range of the boards' tilts about the horizontal and the vertical axis, deg.
    pub tilts_deg: [f64; 2],
    /// Nearest and farthest board, mm.
    pub depths_mm: [f64; 2],
    /// Nearest and farthest corner of a board, mm.
    pub corner_depths_mm: [f64; 2],
    /// Share that corners reached of what each picture has in common with the other, left and right.
    pub field_shares: [f64; 2],
    /// Where most of each picture's empty cells lie.
    empty: [&'static str; 2],
}

impl Coverage {
    pub fn of(calibration: &Calibration, residual_pattern: &ResidualPattern) -> Coverage {
        let poses = &calibration.values.poses;
        let [x_least, x_most, y_least, y_most] = tilts_deg(&calibration.values);
        let fields = [&residual_pattern.fields[0], &residual_pattern.fields[1]];
        let depths_mm = range(poses.iter().map(|pose| pose.translation.vector.z));
        let corner_depths_mm = range(calibration.views.iter().zip(poses).flat_map(|(view, pose)| {
            view.observations.iter().filter(|o| o.active).map(move |o| (pose * o.board_mm).z)
        }));
        let rig = calibration.rig();
        let from_right =
            range(poses.iter().map(|pose| (rig.right_from_left * Point3::from(pose.translation.vector)).z));
        // Where a board could have been seen by both cameras at the distances that were worked at.
        let common = [(Side::Left, depths_mm), (Side::Right, from_right)].map(|(side, depths)| {
            let cells = fields[side as usize].cells.iter();
            cells
                .map(|c| c.corners >= SEEN || is_common(rig, side, Point2::new(c.x_px, c.y_px), depths))
                .collect::<Vec<bool>>()
        });
        let field_shares = [0, 1].map(|side| {
            let seen = fields[side].cells.iter().filter(|c| c.corners >= SEEN).count();
            seen as f64 / common[side].iter().filter(|common| **common).count().max(1) as f64
        });
        let empty = [0, 1].map(|side| empty_region(fields[side], &common[side]));
        let tilts_deg = [x_most - x_least, y_most - y_least];
        let (pairs, lenses_known) = (calibration.views.len(), calibration.known_sides == [true; 2]);
        Coverage { pairs, lenses_known, tilts_deg, depths_mm, corner_depths_mm, field_shares, empty }
    }

    /// What should be photographed next; empty where the views suffice.
    pub fn advice(&self) -> Vec<String> {
        let mut advice = Vec::new();
        if self.lenses_known {
            return advice;
        }
        let pairs = self.pairs;
        if pairs < ENOUGH_PAIRS {
            advice.push(format!(
                "only {pairs} pairs could be used: {} more make the held-out figures reliable",
                ENOUGH_PAIRS - pairs
            ));
        }
        for (name, tilt) in [("horizontal", self.tilts_deg[0]), ("vertical", self.tilts_deg[1])] {
            if tilt < LEAST_TILT_DEG {
                advice.push(format!(
                    "the boards' tilts about the {name} axis differ by {} only: add pairs tilted by 20 to 45 degrees both ways",
                    count(tilt.round() as usize, "degree")
                ));
            }
        }
        let [near, far] = self.depths_mm;
        if far - near < LEAST_DEPTH_SHARE * far {
            advice.push(format!(
                "all boards stand {near:.0} to {far:.0} mm away at their middles: add pairs nearer and farther by a tenth"
            ));
        }
        for (side, (share, empty)) in Side::BOTH.into_iter().zip(self.field_shares.into_iter().zip(self.empty)) {
            if share < LEAST_COVERAGE {
                advice.push(format!(
                    "corners reach {:.0} % of what the {} picture has in common with the other: add pairs with the board {empty}",
                    100.0 * share,
                    side.name(),
                ));
            }
        }
        advice
    }
}

/// What to photograph where this pair alone reaches farthest out in one of the pictures: nothing checks what it says of
/// the lens there.
pub(super) fn beyond_others(calibration: &Calibration, pair: usize) -> Option<&'static str> {
    Side::BOTH.into_iter().find_map(|side| {
        let camera = calibration.rig().camera(side);
        let from_centre = |o: &Observation| Vector2::new(o.px.x - camera.cx, o.px.y - camera.cy);
        let of_view = |(i, view): (usize, &View)| {
            let seen = view.observations.iter().filter(|o| o.side == side && o.active).map(from_centre);
            Some((i, seen.max_by(|a, b| a.norm().total_cmp(&b.norm()))?))
        };
        let reaches = calibration.views.iter().enumerate().filter_map(of_view);
        let (farthest, at) = reaches.max_by(|a, b| a.1.norm().total_cmp(&b.1.norm()))?;
        let across = at.x.abs() * f64::from(camera.height) > at.y.abs() * f64::from(camera.width);
        let remedy = match (across, at.x < 0.0, at.y < 0.0) {
            (true, true, _) => {
                "add pairs with the board at the left border of the pictures, where one pair alone tells the lens"
            }
            (true, false, _) => {
                "add pairs with the board at the right border of the pictures, where one pair alone tells the lens"
            }
            (false, _, true) => {
                "add pairs with the board at the upper border of the pictures, where one pair alone tells the lens"
            }
            (false, _, false) => {
                "add pairs with the board at the lower border of the pictures, where one pair alone tells the lens"
            }
        };
        (farthest == pair).then_some(remedy)
    })
}

/// Whether the other camera sees what lies behind this pixel at one of these distances.
fn is_common(rig: &Rig, side: Side, px: Point2<f64>, [near, far]: [f64; 2]) -> bool {
    let Some(ray) = rig.camera(side).undistort(&px) else { return false };
    let other = rig.camera(side.other());
    [near, 0.5 * (near + far), far].into_iter().any(|depth| {
        let point = Point3::new(ray.x * depth, ray.y * depth, depth);
        let there = match side {
            Side::Left => rig.right_from_left * point,
            Side::Right => rig.right_from_left.inverse() * point,
        };
        let px = other.project(&there);
        there.z > 0.0 && px.x > 0.0 && px.y > 0.0 && px.x < f64::from(other.width) && px.y < f64::from(other.height)
    })
}

/// Where most of the empty cells lie among those that both cameras see.
fn empty_region(field: &Field, common: &[bool]) -> &'static str {
    let empty = |inside: fn(usize, usize) -> bool| {
        let cells = field.cells.iter().zip(common).enumerate();
        cells.filter(|(i, (cell, common))| inside(i % CELLS, i / CELLS) && **common && cell.corners < SEEN).count()
    };
    let regions: [(&'static str, usize); 4] = [
        ("at the left border", empty(|x, _| 3 * x < CELLS)),
        ("at the right border", empty(|x, _| 3 * (CELLS - 1 - x) < CELLS)),
        ("at the upper border", empty(|_, y| 3 * y < CELLS)),
        ("at the lower border", empty(|_, y| 3 * (CELLS - 1 - y) < CELLS)),
    ];
    regions.into_iter().max_by_key(|(_, count)| *count).map_or("at the borders", |(name, _)| name)
}
