//! Coarse corners to measured ones: a fit of the blurred corner to the raw pixels at full size, for each corner.
//!
//! In: the picture and the board as detected. Out: corners with covariance. First each corner is fitted on the reduced
//! copy in a small window (`coarse`); then at full size in a small window (near), and in the largest that stays inside
//! the four squares round it (full), along edges that bend as the lens bends the board's lines (`curvature`): as the
//! near windows show them, and at last as the full ones do. Where some of the full windows tell that edges bend much
//! from crossing to crossing, all are cut down. Where the larger window does not agree with the smaller one, or the
//! four arms of a corner not with each other (`acceptance`), something hides a part of it, and the largest window that
//! is free of it is kept. Stray light that adds to dark and bright alike is fitted where the board shows it. Last,
//! corners get the covariances that they have by what their arms tell (`scatter`), also those that no window shows
//! well, and share what they know of the light, which counts from the picture's veil (`light`). Goes wrong: a corner
//! without contrast, hidden, or cut off by the border; it is dropped, the others stay.

use std::cell::RefCell;

use nalgebra::{Matrix2, Vector2};

use super::cell::Cell;
use super::coarse::{coarse, enlarged};
use super::curvature::{Bend, Point, Rule, bends};
use super::full_size::Full;
use super::light::illumination;
use super::light::stray::{self, Slope};
use super::saddle_fit::window::Sample;
use super::saddle_fit::{Measured, Model};
use super::scatter::Scatter;
use super::windows::{Windows, bends_by, usual};
use super::{acceptance, full_size, scatter};
use crate::imaging::Corner;
use crate::imaging::detect::Detected;
use crate::imaging::image::{Grey, Picture};
use crate::imaging::lattice::{Lattice, Places};

/// How good places on the copy are at least, px.
const GOOD_PX: f64 = 0.1;
/// One corner of so many is tried in its full window to see how much edges bend, and so many at the least.
const TRIED: usize = 3;
const LEAST_TRIED: usize = 9;

/// Measures all corners of a board.
pub fn refine(picture: &Picture, detected: &Detected) -> Lattice<Corner> {
    let measured = measure(picture, detected);
    Lattice::from_fn(measured.columns, measured.rows, |col, row| {
        if let Some(m) = measured.get(col, row) {
            let [a, b] = m.fit.model.blur_px;
            let blur_px = Some((0.5 * (a * a + b * b)).sqrt());
            // Symmetric to the last bit, so that three numbers hold it.
            let s = &m.fit.covariance_px2;
            let across = 0.5 * (s[(0, 1)] + s[(1, 0)]);
            let covariance_px2 = Some(Matrix2::new(s[(0, 0)], across, across, s[(1, 1)]));
            return Some(Corner { col, row, px: m.px, covariance_px2, blur_px, reach: Some(m.reach), used: true });
        }
        // Kept where it was seen roughly, so that a picture in which nothing could be measured can still be judged.
        let px = detected.level.to_picture(detected.corners.get(col, row)?);
        Some(Corner { used: false, ..Corner::at(col, row, px) })
    })
}

/// Measures all corners of a board, with what else the fits tell.
pub fn measure(picture: &Picture, detected: &Detected) -> Lattice<Measured> {
    let (clip_level, window) = (picture.clip_level(), RefCell::default());
    match &picture.grey {
        Grey::Eight(image) => Full::of(image, clip_level, detected, &window).measure(detected),
        Grey::Sixteen(image) => Full::of(image, clip_level, detected, &window).measure(detected),
    }
}

/// What a board's windows told, what is usual in them, and the corners that they show well.
struct Seen {
    windows: Lattice<Windows>,
    board: acceptance::Board,
    measured: Lattice<Measured>,
}

impl<T: Sample> Full<'_, T> {
    fn measure(&self, detected: &Detected) -> Lattice<Measured> {
        let mut seen = self.look(detected);
        // Where corners are as noise makes them there is nothing to look for.
        if scatter::miss_the_model(&seen.measured)
            && let Some(stray) = self.stray_light(&seen.windows)
        {
            let with_stray = self.with_stray(stray).look(detected);
            if !is_more_uneven(&with_stray.measured, &seen.measured) {
                seen = with_stray;
            }
        }
        let scatter = Scatter::of(&seen.measured);
        scatter.carry(&mut seen.measured);
        let Seen { windows, board, mut measured } = seen;
        illumination::tie(&mut measured);
        let usual_px2 = acceptance::usual_variance(measured.iter().map(|(_, _, m)| m));
        Lattice::from_fn(measured.columns, measured.rows, |col, row| {
            let well = measured.get(col, row).copied();
            well.or_else(|| {
                let seen = windows.get(col, row)?;
                let known = self.windows_left(seen, &board);
                let known = known.into_iter().map(|corner| scatter.alone(seen.with_lines(corner)));
                known.filter(|corner| acceptance::is_of_use(corner, usual_px2)).min_by(by_variance)
            })
        })
    }

    /// Variance of the slope of stray light by the near windows, in each of which it is fitted without a bound.
    fn stray_light(&self, seen: &Lattice<Windows>) -> Option<f64> {
        let unbound = self.with_stray(stray::UNBOUND);
        let mut fits = seen.filter_map(|_, _, windows| {
            let near = windows.near.or(windows.full)?;
            unbound.fit_from(&near, full_size::near_half_px(&windows.start), windows)
        });
        Scatter::of(&fits).carry(&mut fits);
        let slope = |fit: &Measured| fit.fit.stray.map(|(slope, own)| Slope { px: fit.px, slope, own });
        stray::variance(&fits.iter().filter_map(|(_, _, fit)| slope(fit)).collect::<Vec<_>>())
    }

    /// What the board's windows tell, from the first fits on.
    fn look(&self, detected: &Detected) -> Seen {
        let coarse = coarse(detected, &mut self.window.borrow_mut());
        let columns = coarse.columns;
        let at = |bends: &[[Option<Bend>; 2]], col: usize, row: usize| bends[row * columns + col];
        let on_copy = |m: &Measured| {
            let covariance_px2 = m.fit.covariance_px2 * detected.level.scale().powi(2);
            Point { px: detected.level.to_picture(&m.px), counts: true, covariance_px2 }
        };
        let coarse_bends = bends(&coarse.map(on_copy), Rule { good_px: GOOD_PX, in_part: detected.print.is_some() });
        // A neighbour that could not be measured still says how far the squares reach.
        let places: Places = Lattice::from_fn(columns, coarse.rows, |col, row| {
            let px = coarse.get(col, row).map_or(detected.corners.get(col, row), |m| Some(&m.px))?;
            Some(detected.level.to_picture(px))
        });
        let scale = detected.level.scale();
        let near = coarse.filter_map(|col, row, from| {
            let bends = at(&coarse_bends, col, row);
            let cell = Cell::of(&places, col, row)?.with_markers(&places, (col, row), detected.print);
            // An edge that ends at the corner does not tell its bend from its turn.
            let cell = Cell { own_bends: bends.map(|bend| bend.is_none() && cell.dark.is_none()), ..cell };
            let start = Model {
                corner: Vector2::zeros(),
                bend: bends.map(|bend| bend.map_or(0.0, |bend| bend.per_px)),
                // The copy's grey values are not those above the veil: without contrast the fit finds levels of its
                // own.
                half_contrast: 0.0,
                ..enlarged(&from.fit.model, scale)
            };
            // On a copy of full size the first fit is a measurement already.
            let first = (scale == 1.0)
                .then_some(*from)
                .filter(|from| from.fit.model.blur_px.iter().all(|blur_px| cell.stands_alone(*blur_px)));
            let near = self.near(cell, start, first);
            Some(Windows { bends, ..near })
        });
        // A bend as the copy shows it is good enough for small windows only; as small windows show it, to start large
        // ones from.
        let near_only: Vec<Measured> = near.iter().filter_map(|(_, _, windows)| windows.near).collect();
        let board = acceptance::Board::of(&near_only, &[]);
        let near_bends = bends_by(&near, &places, |windows| windows.near.filter(|near| board.accepts(near)));
        let near = near.filter_map(|col, row, windows| Some(windows.clone().rebent(at(&near_bends, col, row))));
        let (windows, board) = self.large(&near, &places);
        let measured = windows.filter_map(|_, _, seen| Some(seen.with_lines(self.largest_free(seen, &board)?)));
        Seen { windows, board, measured }
    }

    /// The fits in full windows, or where edges bend too much for these in smaller ones, along edges that bend as these
    /// windows show it; with what is usual in them.
    fn large(&self, near: &Lattice<Windows>, places: &Places) -> (Lattice<Windows>, acceptance::Board) {
        // How much edges bend is seen on some of the corners as well: where full windows are of no use, most need not
        // be looked at.
        let few = near.count() < LEAST_TRIED * TRIED;
        let tried = near.filter_map(|col, row, seen| {
            (few || (col + row).is_multiple_of(TRIED)).then(|| self.full(seen.clone(), 1.0))
        });
        let within = |share: f64| {
            let seen = near.filter_map(|col, row, from| {
                let known = tried.get(col, row).filter(|_| share == 1.0).cloned();
                known.or_else(|| Some(self.full(from.clone(), share)))
            });
            let board = usual(&seen);
            let bends = bends_by(&seen, places, |windows| windows.free(&board).copied());
            let rebent = |col: usize, row: usize| bends[row * near.columns + col];
            let seen = seen.filter_map(|col, row, windows| Some(windows.clone().rebent(rebent(col, row))));
            let board = usual(&seen);
            (seen, board)
        };
        let share = usual(&tried).straight_share();
        let (seen, board) = within(share);
        let smaller = board.straight_share();
        if share == 1.0 && smaller < 1.0 { within(smaller) } else { (seen, board) }
    }
}

/// Whether corners follow each other along the board's lines less evenly than other fits of them, beyond what their
/// covariances and chance allow. Overshoot of a sharpened edge may look like stray light, with the corner beside its
/// place, to another side at each.
fn is_more_uneven(corners: &Lattice<Measured>, others: &Lattice<Measured>) -> bool {
    /// Standard errors of a share of one half; differences overlap, hence more than for independent ones.
    const BEYOND_CHANCE: f64 = 4.0;
    let pairs = third_differences(corners).zip(third_differences(others));
    let more: Vec<bool> = pairs.filter_map(|(own, other)| Some(own? > other?)).collect();
    let beyond_half = more.iter().filter(|more| **more).count() as f64 - 0.5 * more.len() as f64;
    beyond_half > BEYOND_CHANCE * 0.5 * (more.len() as f64).sqrt()
}

/// Third differences of the corners' places along the board's lines, which are next to nothing of a board that a lens
/// shows, in units of what the corners' covariances say of them; `None` where a corner is missing.
fn third_differences(corners: &Lattice<Measured>) -> impl Iterator<Item = Option<f64>> {
    const STEPS: [[usize; 2]; 2] = [[1, 0], [0, 1]];
    const WEIGHTS: [f64; 4] = [-1.0, 3.0, -3.0, 1.0];
    let starts = (0..corners.rows).flat_map(|row| (0..corners.columns).map(move |col| (col, row)));
    starts.flat_map(|start| STEPS.map(|step| (start, step))).map(|((col, row), step)| {
        let (mut sum, mut variance) = (Vector2::zeros(), 0.0);
        for (k, weight) in WEIGHTS.iter().enumerate() {
            let corner = corners.get(col + k * step[0], row + k * step[1])?;
            sum += corner.px.coords * *weight;
            variance += corner.fit.covariance_px2.trace() * weight * weight;
        }
        Some(sum.norm() / variance.sqrt())
    })
}

fn by_variance(a: &Measured, b: &Measured) -> std::cmp::Ordering {
    a.fit.covariance_px2.trace().total_cmp(&b.fit.covariance_px2.trace())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::image::Image;
    use crate::imaging::{Board, detect};
    use statrs::function::erf::erf;

    const SIDE_PX: f64 = 60.0;
    const BLUR_PX: f64 = 0.9;

    /// Light minus dark across the nearest of lines 0 to `lines`, which are a `side` apart, in the signs of the
    /// squares.
    fn across(px: f64, lines: f64, side: f64) -> f64 {
        let nearest = (px / side).round().clamp(0.0, lines);
        let sign = if nearest.rem_euclid(2.0) == 0.0 { 1.0 } else { -1.0 };
        sign * erf((px - nearest * side) / (BLUR_PX * 2f64.sqrt()))
    }

    /// A board of 8x7 squares whose every other row of crossings is off by `zigzag_px` along the rows, with noise of 2
    /// grey levels.
    fn zigzag_board(zigzag_px: f64) -> Picture {
        let grey = |x: f64, y: f64| {
            let y = y - 60.3;
            let x = x - 60.7 - zigzag_px * ((y / SIDE_PX).rem_euclid(2.0) - 1.0).abs();
            let inside = (0.0..8.0 * SIDE_PX).contains(&x) && (0.0..7.0 * SIDE_PX).contains(&y);
            if inside { 120.0 - 80.0 * across(x, 8.0, SIDE_PX) * across(y, 7.0, SIDE_PX) } else { 200.0 }
        };
        noisy(600, 540, 11, grey)
    }

    /// A picture of these grey values with noise of 2 grey levels.
    fn noisy(width: usize, height: usize, seed: u64, grey: impl Fn(f64, f64) -> f64) -> Picture {
        let mut state = seed;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / f64::from(1u32 << 24) - 0.5
        };
        let pixel = |x: usize, y: usize| {
            let noise = 2.0 * 12f64.sqrt() * uniform();
            (grey(x as f64, y as f64) + noise).round().clamp(0.0, 255.0) as u8
        };
        Image::from_fn(width, height, pixel).into()
    }

    #[test]
    fn bent_edges_are_seen_in_windows_that_are_alike_and_small_where_they_bend_much() {
        let board = Board::checker("8x7".parse().unwrap(), 10.0);
        let mean_reach = |zigzag_px: f64| {
            let picture = zigzag_board(zigzag_px);
            let measured = measure(&picture, &detect::detect(&picture, board).unwrap());
            assert_eq!(measured.count(), 42);
            let reach = measured.iter().map(|(_, _, m)| m.reach[1]).sum::<f64>() / 42.0;
            for (_, _, m) in measured.iter() {
                assert!((m.reach[1] - reach).abs() < 0.02, "{zigzag_px}: {:?}", m.reach);
                // Crossings of even lines are off by the zigzag, those between are not.
                let row = ((m.px.y - 60.3) / SIDE_PX).round();
                let column = ((m.px.x - 60.7) / SIDE_PX).round();
                let sign = if row.rem_euclid(2.0) == 0.0 { 1.0 } else { -1.0 };
                let seen = 60.7 + column * SIDE_PX + 0.5 * zigzag_px * (1.0 + sign * (1.0 - reach));
                let sigma = m.fit.covariance_px2.m11.sqrt();
                assert!(
                    (m.px.x - seen).abs() < 5.0 * sigma + 0.03 * zigzag_px,
                    "{zigzag_px}: {} {seen} {sigma}",
                    m.px.x
                );
            }
            reach
        };
        let (straight, bent, bent_much) = (mean_reach(0.0), mean_reach(0.1), mean_reach(0.8));
        assert!((straight - 0.85).abs() < 0.02 && (bent - straight).abs() < 1e-3, "{straight} {bent}");
        assert!(bent_much < 0.3, "{bent_much}");
    }

    #[test]
    fn haze_that_grows_over_a_slanted_board_moves_no_corner() {
        const SIDE: f64 = 40.0;
        const SLANT: f64 = 0.45;
        let board = Board::checker("10x7".parse().unwrap(), 10.0);
        for seed in 0..4 {
            let stretch = (1.0 + SLANT * SLANT).sqrt();
            let (x0, y0) = (50.3 + 0.13 * seed as f64, 60.7);
            let grey = |x: f64, y: f64| {
                let (u, v) = ((x - x0 - SLANT * (y - y0)) / stretch, y - y0);
                let inside = (0.0..10.0 * SIDE).contains(&u) && (0.0..7.0 * SIDE).contains(&v);
                let board = if inside { 90.0 - 50.0 * across(u, 10.0, SIDE) * across(v, 7.0, SIDE) } else { 140.0 };
                board + 0.12 * x
            };
            let picture = noisy(700, 400, seed, grey);
            let measured = measure(&picture, &detect::detect(&picture, board).unwrap());
            assert_eq!(measured.count(), 54);
            let (mut off, mut variance) = (0.0, 0.0);
            for (_, _, m) in measured.iter() {
                let u = (m.px.x - x0 - SLANT * (m.px.y - y0)) / stretch;
                off += (u - (u / SIDE).round() * SIDE) / 54.0;
                variance += m.fit.covariance_px2.m11 / 54f64.powi(2);
            }
            assert!(off.abs() < 4.0 * variance.sqrt(), "{seed}: {off} px, {}", variance.sqrt());
        }
    }

    /// An upright board of 9x7 squares of 25 px, its edges as sharp as pixels are, with `overshoot` (a share of the
    /// contrast) beside them as a camera's sharpening leaves it, and stray light whose slope is up to `stray` grey
    /// values per px.
    fn sharpened_board(overshoot: f64, stray: f64) -> Picture {
        let (width, height, side) = (280, 230, 25.2);
        let grey = |x: f64, y: f64| {
            let (x, y) = (x - 26.1 - 0.012 * (y - 100.0), y - 27.4 + 0.006 * (x - 100.0));
            let (i, j) = ((x / side).floor(), (y / side).floor());
            let is_dark = (0.0..9.0).contains(&i) && (0.0..7.0).contains(&j) && (i + j).rem_euclid(2.0) == 0.0;
            (if is_dark { 50.0 } else { 176.0 }) + stray * (x * 0.05).sin() / 0.05
        };
        const PARTS: usize = 8;
        let pixel = |x: usize, y: usize| {
            let part = |at: usize, k: usize| at as f64 - 0.5 + (k as f64 + 0.5) / PARTS as f64;
            let all = (0..PARTS * PARTS).map(|k| grey(part(x, k % PARTS), part(y, k / PARTS)));
            all.sum::<f64>() / (PARTS * PARTS) as f64
        };
        let plain = Image::from_fn(width, height, pixel).pixels;
        let pixel = |x: usize, y: usize| {
            let k = y * width + x;
            let beside = [(1, 0), (-1, 0), (0, 1), (0, -1)].map(|(dx, dy): (isize, isize)| {
                let (x, y) = (x.saturating_add_signed(dx).min(width - 1), y.saturating_add_signed(dy).min(height - 1));
                plain[y * width + x]
            });
            let sharp = plain[k] + overshoot * (4.0 * plain[k] - beside.iter().sum::<f64>());
            (sharp + ((k * 7919) % 5) as f64 - 2.0).round().clamp(0.0, 255.0) as u8
        };
        Image::from_fn(width, height, pixel).into()
    }

    #[test]
    fn neither_overshoot_nor_stray_light_takes_sharp_corners_off_their_lines() {
        let board = Board::checker("9x7".parse().unwrap(), 10.0);
        for (overshoot, stray) in [(0.0, 0.0), (0.1, 0.0), (0.3, 0.0), (0.5, 0.3), (0.0, 0.6), (0.8, 0.6)] {
            let picture = sharpened_board(overshoot, stray);
            let measured = measure(&picture, &detect::detect(&picture, board).unwrap());
            assert_eq!(measured.count(), 48);
            for (_, _, m) in measured.iter() {
                let on_board =
                    Vector2::new(m.px.x - 26.1 - 0.012 * (m.px.y - 100.0), m.px.y - 27.4 + 0.006 * (m.px.x - 100.0));
                let off = on_board.map(|at| at - (at / 25.2).round() * 25.2);
                let sigma = m.fit.covariance_px2.trace().sqrt();
                assert!(off.amax() < 2.0 * sigma, "{overshoot} {stray}: {off:?} {sigma}");
            }
        }
    }
}
