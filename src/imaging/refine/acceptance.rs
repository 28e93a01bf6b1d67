//! Every gate that a corner passes before it counts, with its unit and its reason.
//!
//! A corner that is off by many of its sigmas is worse than a missing one. Three kinds of gates: what no corner does
//! ([`plausible`]), what a larger window must tell as a smaller one does, and what the four arms of a corner must
//! tell alike, both measured by the board's other corners ([`Board`]).

use super::Measured;
use super::cell::Cell;
use super::saddle_fit::{Fit, Model};
use crate::statistics::median;

/// Farthest a fit may go from its start, px, and as a share of a square: the start is better than that.
const MOST_MOVE_PX: f64 = 3.0;
const MOST_MOVE_SQUARES: f64 = 0.4;
/// Most by which an edge may turn from where the neighbours say it runs, rad (20 degrees): more is another edge.
const MOST_TURN_RAD: f64 = 0.35;
/// Widest blur, as a share of a square: beyond it no square has a level of its own.
const MOST_BLUR_SQUARES: f64 = 0.5;
/// Share of the light that may change over a square. Light does not; a fit that says so has taken a neighbour's edge
/// for its gradient.
pub(super) const MOST_LIGHT_CHANGE: f64 = 0.3;
/// The same for a corner that is known by no window otherwise, in the edge of a highlight: all of it.
pub(super) const ALL_LIGHT: f64 = 1.0;
/// Largest variance (both axes together) of a corner, px^2: half a pixel is what the eye sees.
const MOST_VARIANCE_PX2: f64 = 0.25;

/// Sigmas of the smaller window's place that two windows may differ by, and what blurs that are no Gaussian add, px.
const AGREE_SIGMAS: f64 = 5.0;
const AGREE_PX: f64 = 0.02;
/// How many times larger the residual of the larger window may be, and by what share of the contrast (one grey value of
/// 8 bits): light and dark away from the edges are noisier than the edges by this much at most.
const AGREE_RESIDUAL: f64 = 1.4;
const AGREE_CONTRAST: f64 = 0.007;

/// How many times the variance by noise places in two windows must differ by before it is the edges that bend: of
/// thirty corners half exceed it by less, but for chance.
const MORE_THAN_NOISE: f64 = 1.8;
/// By how many of a corner's standard deviations bent edges may move it in a large window: how much of them a window
/// sees is known to a few hundredths.
const MOST_BENT: f64 = 10.0;

/// Chi-squared (two degrees of freedom) of one arm against the common model, in units of what is usual on the board.
/// Among the 4000 arms of the largest boards the largest by chance is 17; something that hides a tenth of an arm makes
/// hundreds.
const MOST_ARM_MISFIT: f64 = 30.0;
/// How many times less certain than the board's usual corner one may be, in standard deviations. The smallest window
/// costs a factor of four; what is left of a corner behind something has no contrast of its own.
const MOST_SIGMAS: f64 = 10.0;
/// How many times the board's usual residual (as a share of the contrast) a corner may have that was measured in a
/// smaller window for want of a better.
const MOST_ROUGHNESS: f64 = 1.5;
/// The same for a corner in whose window pixels may be that do not belong: noise alone scatters less.
const ROUGH: f64 = 1.15;

/// False for a fit that wandered off, turned away, or found no contrast, or a light that changes by more than a share
/// of it over a square.
pub(super) fn plausible(fit: &Fit, start: &Model, cell: &Cell, most_light_change: f64) -> bool {
    let turned = (0..2).map(|k| (fit.model.angles_rad[k] - start.angles_rad[k]).abs()).fold(0.0, f64::max);
    fit.model.corner.norm() < (MOST_MOVE_SQUARES * cell.side()).min(MOST_MOVE_PX)
        && turned < MOST_TURN_RAD
        && fit.model.blur_px.iter().all(|&s| s < MOST_BLUR_SQUARES * cell.side())
        && fit.model.half_contrast.abs() > fit.residual
        && fit.model.light_slope.norm() * cell.side() < most_light_change
        && fit.covariance_px2.trace() < MOST_VARIANCE_PX2
}

/// The usual variance (both axes together) of corners, px^2.
pub(super) fn usual_variance<'a>(corners: impl Iterator<Item = &'a Measured>) -> f64 {
    median(corners.map(|m| m.fit.covariance_px2.trace())).unwrap_or(f64::INFINITY)
}

/// True for a corner that is of use with the covariance that it has: not far less certain than is usual.
pub(super) fn is_of_use(corner: &Measured, usual_px2: f64) -> bool {
    corner.fit.covariance_px2.trace() < MOST_VARIANCE_PX2.min(MOST_SIGMAS.powi(2) * usual_px2)
}

/// Variance (both axes together) of the difference between a corner's places in two windows, px^2. The larger window
/// holds the smaller one's pixels, so it is the smaller one's variance less the larger one's.
fn difference_px2(small: &Measured, large: &Measured) -> f64 {
    (small.fit.covariance_px2 - large.fit.covariance_px2).trace().max(0.0)
}

/// Residual as a share of the contrast: the same number for copies of 8 bits and pictures of 16.
fn roughness(fit: &Fit) -> f64 {
    fit.residual / fit.model.half_contrast.abs()
}

/// What is usual on a board.
pub(super) struct Board {
    arm_misfit: f64,
    /// Residual as a share of half the contrast.
    pub(super) roughness: f64,
    variance_px2: f64,
    /// Variance (both axes together) by which places in small and large windows differ beyond their noise, px^2: where
    /// crossings are off their places edges bend, and a larger window sees less of it.
    bent_px2: f64,
}

impl Board {
    /// Of the corners measured in their full windows, and of those that were measured in their near windows, too: the
    /// near one first.
    pub(super) fn of(corners: &[Measured], both: &[(Measured, Measured)]) -> Board {
        // Of two axes the square that half of the corners exceed is the variance times ln 2.
        let apart = both.iter().map(|(near, full)| (full.px - near.px).norm_squared() / std::f64::consts::LN_2);
        let apart_px2 = median(apart).unwrap_or(0.0);
        let by_noise_px2 = median(both.iter().map(|(near, full)| difference_px2(near, full))).unwrap_or(0.0);
        let bent = apart_px2 > MORE_THAN_NOISE * by_noise_px2;
        Board {
            // An arm's two numbers have a chi-squared of two, of which the common model takes a half.
            arm_misfit: median(corners.iter().map(|m| m.fit.arm_misfit.iter().flatten().sum::<f64>() / 4.0))
                .unwrap_or(1.0)
                .max(1.0),
            roughness: median(corners.iter().map(|m| roughness(&m.fit))).unwrap_or(f64::INFINITY),
            variance_px2: usual_variance(corners.iter()),
            bent_px2: if bent { apart_px2 - by_noise_px2 } else { 0.0 },
        }
    }

    /// True where a larger window tells the same as a smaller one: a hidden or unprinted neighbour square shows as a
    /// shift or as misfit.
    pub(super) fn agrees(&self, small: &Measured, large: &Measured) -> bool {
        let variance = difference_px2(small, large) + self.bent_px2;
        (large.px - small.px).norm() < AGREE_SIGMAS * variance.sqrt() + AGREE_PX
            && roughness(&large.fit) < AGREE_RESIDUAL * roughness(&small.fit) + AGREE_CONTRAST
    }

    /// How large windows may be, as a share of the full ones, so that what bent edges do stays in proportion to the
    /// noise: the one grows with the window, the other falls with its root. A power of four, so that it is the same in
    /// nearly all pictures of a board.
    pub(super) fn straight_share(&self) -> f64 {
        let bent = (self.bent_px2 / self.variance_px2).sqrt();
        let share = (MOST_BENT / bent.max(MOST_BENT)).powf(2.0 / 3.0);
        (share.log2() / 2.0).round().exp2().powi(2)
    }

    /// True for a corner whose pixels miss the model by more than is usual.
    pub(super) fn is_rough(&self, corner: &Measured) -> bool {
        roughness(&corner.fit) > ROUGH * self.roughness
    }

    /// True where the four arms of a corner tell the same, and it is not far less certain than the others.
    pub(super) fn accepts(&self, corner: &Measured) -> bool {
        corner.fit.arm_misfit.iter().flatten().all(|&misfit| misfit < MOST_ARM_MISFIT * self.arm_misfit)
            && corner.fit.covariance_px2.trace() < MOST_SIGMAS.powi(2) * self.variance_px2
    }

    /// True for a corner that only a smaller window shows, if what is in that window is as good as elsewhere on the
    /// board.
    pub(super) fn holds_in_small_window(&self, corner: &Measured) -> bool {
        self.accepts(corner) && roughness(&corner.fit) < MOST_ROUGHNESS * self.roughness + AGREE_CONTRAST
    }
}
