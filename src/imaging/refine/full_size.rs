//! Fits at full size: one corner in one window.
//!
//! In: a corner's surroundings and what its fit starts from. Out: the fit, or none where it is not plausible. Three
//! windows: a near one, just large enough to hold an arm on each side of the crossing; the full one, as large as the
//! squares and the picture's light allow; and what lies between.

use std::cell::RefCell;

use nalgebra::Vector2;

use super::Measured;
use super::acceptance::{ALL_LIGHT, Board, MOST_LIGHT_CHANGE, plausible};
use super::cell::Cell;
use super::light::veil;
use super::outlying_pixels::{Explained, few};
use super::saddle_fit::window::{Below, Frame, Keep, Sample, Window};
use super::saddle_fit::{Beside, Model, fit};
use super::windows::Windows;
use crate::imaging::detect::Detected;
use crate::imaging::image::Image;

/// Pixels farther than this many blurs from both edges tell only the two grey levels.
const BAND_BLURS: f64 = 3.5;
/// The next edge's blur reaches this many blurs into the square.
const MARGIN_BLURS: f64 = 3.0;

/// Half of the largest window, px. The gain goes with the root of the window, the time with the window; at this size
/// the bend of the edges, known from the board's other corners, is still known well enough.
const MOST_HALF_PX: f64 = 250.0;
/// The same where light is clipped: what the edges then miss of it does not fall with the window.
const MOST_CLIPPED_HALF_PX: f64 = 80.0;
/// What a window leaves of each edge at least, as a share of it. Edges bend at crossings that are off their places;
/// from windows that reach from crossing to crossing nobody could tell which crossing it is.
const LEAST_MARGIN: f64 = 0.15;
/// How many times farther than the picture's border a window beside markers reaches at the most.
const MOST_CUT: f64 = 2.0;
/// Half of the near window, px and in blurs: the least that holds an arm on each side of the crossing.
const NEAR_HALF_PX: f64 = 10.0;
const NEAR_HALF_BLURS: f64 = 7.0;
/// Half of the window that is tried where the full one is not free, as a multiple of the near one's.
const BETWEEN: f64 = 2.8;
/// The same of one that stays within what is left of squares that are cut or hidden.
const SMALLEST: f64 = 0.5;
/// A near window that is not smaller than this share of the full one would tell nothing of its own.
const NEAR_SHARE: f64 = 0.7;

/// By how many blurs a window's own bend may take the ends of its edges from where they were thought to be, beyond
/// which another fit starts from there, and in how many rounds: within it the edges' profiles are as good as straight
/// lines.
const MOST_BENT_BLURS: f64 = 0.3;
const MOST_ROUNDS: usize = 6;
/// By how much wider than it was thought to be a blur may be for what its window leaves out to be right.
const MOST_WIDER: f64 = 1.03;

/// The picture at full size.
pub(super) struct Full<'a, T> {
    image: &'a Image<T>,
    clip_level: f64,
    /// The grey value from which light counts; the fits see what is above it.
    veil: f64,
    /// Variance of the slope of stray light, (grey values per px)^2, where there is some.
    stray: Option<f64>,
    /// Share of the light that may change over a square.
    most_light_change: f64,
    /// Filled anew for each fit.
    pub(super) window: &'a RefCell<Window>,
}

impl<T: Sample> Full<'_, T> {
    pub(super) fn of<'a>(
        image: &'a Image<T>,
        clip_level: f64,
        detected: &Detected,
        window: &'a RefCell<Window>,
    ) -> Full<'a, T> {
        let places = detected.corners.map(|px| detected.level.to_picture(px));
        Full {
            image,
            clip_level,
            // The middles of squares with markers are neither light nor dark.
            veil: if detected.print.is_none() { veil::level(image, clip_level, &places) } else { 0.0 },
            stray: None,
            most_light_change: MOST_LIGHT_CHANGE,
            window,
        }
    }

    /// The same picture with stray light whose slope has this variance.
    pub(super) fn with_stray(&self, variance: f64) -> Self {
        Full { stray: Some(variance), ..*self }
    }

    /// A fit in the near window, where the full one is enough larger to tell more; otherwise what the copy told, if
    /// that is of full size.
    pub(super) fn near(&self, cell: Cell, start: Model, coarse: Option<Measured>) -> Windows {
        let full_px = half_px(cell.side(), margin_px(&start, &cell));
        let near_px = near_half_px(&start);
        let alone = near_px > NEAR_SHARE * full_px;
        let near = if alone { coarse } else { self.fit_within(near_px, &cell, &start) };
        Windows { cell, start, bends: [None; 2], alone, most_half_px: MOST_HALF_PX, near, full: None }
    }

    /// A fit in the full window or in a share of it, started where the one in the near window ended: most steps are
    /// taken where they are cheap, and the blur is that of the picture, not of the copy, so fewer pixels count as near
    /// an edge.
    pub(super) fn full(&self, seen: Windows, share: f64) -> Windows {
        let within = |half_px: f64| match seen.near.filter(|_| !seen.alone) {
            Some(near) => self.fit_from(&near, half_px, &seen),
            // Squares that are not alike all over show in a small window as a light that changes, and in a large one
            // hardly.
            None => self.fit_within(half_px, &seen.cell, &seen.start),
        };
        // What is hardly larger than the near window is not made smaller.
        let share_px = share * half_px(seen.cell.side(), margin_px(&seen.start, &seen.cell));
        let most_half_px = if seen.alone || share == 1.0 { MOST_HALF_PX } else { share_px };
        let full = within(most_half_px);
        let reach_px = |full: &Measured| full.reach[0] * seen.cell.edges[0].norm();
        // What a reflection adds to clipped squares nobody sees, and over a large window it is no slope.
        let between_px = BETWEEN * near_half_px(&seen.start);
        let clipped_px = if self.stray.is_some() { between_px.min(MOST_CLIPPED_HALF_PX) } else { MOST_CLIPPED_HALF_PX };
        let clips = full.is_some_and(|full| full.fit.left_out > 0 && reach_px(&full) > clipped_px);
        if clips {
            return Windows { full: within(clipped_px), most_half_px: clipped_px, ..seen };
        }
        Windows { full, most_half_px, ..seen }
    }

    /// A corner whose pixels lie farther from the model than is usual on the board, fitted again without those that it
    /// cannot explain, where they are few.
    fn without_outlying(&self, first: &Measured, most_half_px: f64, cell: &Cell, board: &Board) -> Measured {
        let clips = first.fit.left_out > 0;
        if !clips && !board.is_rough(first) {
            return *first;
        }
        let mut best = *first;
        // The first fit was pulled by what the second one leaves out: a third one sees that, too.
        for _ in 0..2 {
            let keep = Explained::by(&best, board.roughness, self.clip_level - self.veil, clips);
            let start = Model { corner: Vector2::zeros(), ..best.fit.model };
            let again = self.fit_kept(most_half_px, &Cell { place: best.px, ..*cell }, &start, &keep);
            let dropped = |again: &Measured| again.fit.left_out.saturating_sub(first.fit.left_out);
            match again {
                Some(again) if clips || few(dropped(&again), again.fit.pixels) => best = again,
                _ => break,
            }
        }
        best
    }

    /// The largest window that nothing reaches into: the full one, one between, the near one, or none.
    pub(super) fn largest_free(&self, seen: &Windows, board: &Board) -> Option<Measured> {
        let seen = Windows {
            near: seen.near.map(|near| self.without_outlying(&near, near_half_px(&seen.start), &seen.cell, board)),
            full: seen.full.map(|full| self.without_outlying(&full, seen.most_half_px, &seen.cell, board)),
            ..*seen
        };
        if let Some(full) = seen.free(board) {
            return Some(*full);
        }
        let near = seen.near.as_ref()?;
        let between = self.between(near, &seen);
        let between = between.filter(|between| board.agrees(near, between) && board.holds_in_small_window(between));
        between.or_else(|| board.holds_in_small_window(near).then_some(*near))
    }

    /// What the windows of a corner tell that none of them shows well, and one that is smaller still, without outlying
    /// pixels.
    pub(super) fn windows_left(&self, seen: &Windows, board: &Board) -> Vec<Measured> {
        let any = Full { most_light_change: ALL_LIGHT, ..*self };
        let near_px = near_half_px(&seen.start);
        let small_px = SMALLEST * near_px;
        let near = seen.near.or_else(|| any.fit_within(near_px, &seen.cell, &seen.start));
        let small = any.fit_within(small_px, &seen.cell, &seen.start);
        let between = near.and_then(|near| any.between(&near, seen));
        let all = [(small, small_px), (near, near_px), (between, BETWEEN * near_px), (seen.full, seen.most_half_px)];
        let cleaned =
            |(fit, half_px): (Option<Measured>, f64)| Some(any.without_outlying(&fit?, half_px, &seen.cell, board));
        all.into_iter().filter_map(cleaned).collect()
    }

    fn between(&self, near: &Measured, seen: &Windows) -> Option<Measured> {
        self.fit_from(near, BETWEEN * near_half_px(&seen.start), seen)
    }

    /// A fit in a larger window, from what a smaller one told.
    pub(super) fn fit_from(&self, near: &Measured, most_half_px: f64, seen: &Windows) -> Option<Measured> {
        // A window in the middle of which the corner is: what the light's gradient adds on one side it takes on the
        // other.
        let bend = [0, 1].map(|k| if seen.cell.own_bends[k] { near.fit.model.bend[k] } else { seen.start.bend[k] });
        let start = Model { corner: Vector2::zeros(), bend, ..near.fit.model };
        self.fit_within(most_half_px, &Cell { place: near.px, ..seen.cell }, &start)
    }

    /// A fit in a window that reaches up to `most_half_px` along each edge.
    fn fit_within(&self, most_half_px: f64, cell: &Cell, start: &Model) -> Option<Measured> {
        self.fit_kept(most_half_px, cell, start, &Below(self.clip_level - self.veil))
    }

    /// A window beside markers, of which the picture's border cuts off no more than half on one side: where the markers
    /// beyond it begin only corners tell that are on this side, and parts of boards reach the border everywhere. Of 600
    /// corners near it, rendered, chi-squared is 1.03 in windows that are not cut, 1.05 in these, and 1.25 in whole ones.
    fn inside(&self, cell: &Cell, halves: [Vector2<f64>; 2]) -> [Vector2<f64>; 2] {
        if !cell.has_markers() {
            return halves;
        }
        let room = |at: f64, size: usize| MOST_CUT * (at + 0.5).min(size as f64 - 0.5 - at).max(0.0);
        let room_px = [room(cell.place.x, self.image.width), room(cell.place.y, self.image.height)];
        let [a, b] = shares_inside(&halves, room_px);
        [halves[0] * a, halves[1] * b]
    }

    /// The same with the pixels that are to be kept.
    fn fit_kept(&self, most_half_px: f64, cell: &Cell, start: &Model, keep: &impl Keep) -> Option<Measured> {
        let mut start = *start;
        let mut window = self.window.borrow_mut();
        let beside = Beside { stray: self.stray, bends: cell.own_bends };
        for round in 1.. {
            let blur = start.blur_px[0].max(start.blur_px[1]);
            let margin = margin_px(&start, cell);
            let halves = cell.edges.map(|e| e.normalize() * half_px(e.norm(), margin).min(most_half_px));
            let halves = self.inside(cell, halves);
            let band_px = BAND_BLURS * blur + 1.0;
            let hidden = cell.hidden(blur)?;
            let frame = Frame { start: cell.place, halves, band_px, hidden, dark: cell.dark };
            window.collect(self.image, self.veil, keep, &frame);
            let found = fit(&start, &window, beside)?;
            let wider = found.model.blur_px[0].max(found.model.blur_px[1]);
            // The copy may have hidden how wide the blur is; the band must hold the whole edge.
            let in_band = BAND_BLURS * wider <= 1.2 * band_px;
            let bent_px = |k: usize| (found.model.bend[k] - start.bend[k]).abs() * halves[k].norm_squared() / 2.0;
            if in_band && round < MOST_ROUNDS && bent_px(0).max(bent_px(1)) > MOST_BENT_BLURS * blur {
                start = Model { bend: found.model.bend, ..start };
                continue;
            }
            // Without a second tag opposite, what is seen of a tag's bits moves the corner.
            if in_band && cell.dark.is_some() && wider > MOST_WIDER * blur && round < MOST_ROUNDS {
                start = Model { blur_px: found.model.blur_px, ..start };
                continue;
            }
            if in_band {
                // Of a blur that came out wider, what is beside the edges may be too near.
                let is_clear = cell.hidden(wider).is_some();
                let fits = is_clear && plausible(&found, &start, cell, self.most_light_change);
                return fits.then(|| Measured { px: found.place(&cell.place), fit: found, reach: cell.reach(&halves) });
            }
            if wider > 0.5 * cell.side() {
                return None;
            }
            start = Model { blur_px: found.model.blur_px, ..start };
        }
        None
    }
}

/// The shares of both halves of a window that stays within so many px of its middle along x and y: those by which the
/// corner is known best. How well it is known across an edge goes with the root of how long that edge is.
fn shares_inside(halves: &[Vector2<f64>; 2], room_px: [f64; 2]) -> [f64; 2] {
    /// Of a third less a step.
    const STEPS: usize = 40;
    let left = |axis: usize, first: f64| (room_px[axis] - first * halves[0][axis].abs()) / halves[1][axis].abs();
    let second = |first: f64| left(0, first).min(left(1, first)).clamp(0.0, 1.0);
    if second(1.0) >= 1.0 {
        return [1.0; 2];
    }
    // The sum of both variances is convex.
    let variance = |first: f64| 1.0 / first + 1.0 / second(first);
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..STEPS {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if variance(a) <= variance(b) { high = b } else { low = a }
    }
    let first = 0.5 * (low + high);
    [first, second(first)]
}

/// Half of the largest window along an edge of this length, px.
fn half_px(edge_px: f64, margin_px: f64) -> f64 {
    (edge_px - margin_px.max(LEAST_MARGIN * edge_px)).max(0.5 * edge_px).min(MOST_HALF_PX)
}

/// How far a window stays off the next edges, px. Oblique edges come nearer to each other.
fn margin_px(start: &Model, cell: &Cell) -> f64 {
    (MARGIN_BLURS * start.blur_px[0].max(start.blur_px[1]) + cell.next_px()) / cell.skew()
}

pub(super) fn near_half_px(start: &Model) -> f64 {
    NEAR_HALF_PX.max(NEAR_HALF_BLURS * start.blur_px[0].max(start.blur_px[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_border_cuts_only_the_half_that_meets_it() {
        let halves = [Vector2::new(40.0, 0.0), Vector2::new(0.0, 40.0)];
        assert_eq!(shares_inside(&halves, [40.0, 50.0]), [1.0; 2]);
        for (room, expected) in [([10.0, 50.0], [0.25, 1.0]), ([50.0, 20.0], [1.0, 0.5]), ([8.0, 12.0], [0.2, 0.3])] {
            let shares = shares_inside(&halves, room);
            assert!((0..2).all(|k| (shares[k] - expected[k]).abs() < 1e-6), "{room:?}: {shares:?}");
        }
        // Of edges that meet it alike both are cut alike.
        let shares = shares_inside(&[Vector2::new(30.0, 30.0), Vector2::new(30.0, -30.0)], [30.0, 100.0]);
        assert!(shares.iter().all(|share| (share - 0.5).abs() < 1e-6), "{shares:?}");
        assert!(shares_inside(&halves, [0.0, 10.0]).iter().all(|share| share.is_finite()));
    }
}
