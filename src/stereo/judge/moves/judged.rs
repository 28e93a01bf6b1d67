//! What known moves say of the scale.

use serde::Serialize;

use super::slide::{Places, Slide};
use super::stated::StatedMove;
use crate::difference::SEEN;
use crate::stereo::findings::{Finding, Kind};
use crate::stereo::judge::verdict::{COVERAGE, Verdict};
use crate::stereo::pairs::Cause;

/// Standard deviations beyond which a move contradicts the scale: one in a hundred that are as stated does.
const CONTRADICTS: f64 = 2.5758;

/// A move that was measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KnownMove {
    /// The pairs before and after it.
    pub pairs: [String; 2],
    pub stated_mm: f64,
    /// Expanded uncertainty (k = 2) of that, mm.
    pub stated_uncertainty_mm: f64,
    pub measured_mm: f64,
    pub measured_sigma_mm: f64,
    /// By how much the board turned, deg.
    pub turn_deg: f64,
    /// Whether that is more than chance.
    pub turned: bool,
    /// How far the board's corners moved, the least and the most, mm.
    pub corners_mm: [f64; 2],
    /// Measured over stated, minus one.
    pub scale_error: f64,
    /// Standard deviation of that: the stated move, the measured one, and where on a board that turned the move was
    /// meant.
    pub scale_sigma: f64,
    /// The side of a square with which the scale would be as the move says, mm.
    pub square_mm: f64,
}

/// The moves that were asked for.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct KnownMoves {
    pub measured: Vec<KnownMove>,
    /// Why others were not.
    pub missing: Vec<String>,
}

impl KnownMove {
    pub(super) fn new(stated: &StatedMove, places: &Places, slide: &Slide) -> KnownMove {
        let length_mm = stated.length_mm;
        let scale_error = slide.length_mm / length_mm - 1.0;
        // A move that is stated for any point of the board is off by any of these lengths: an even distribution (GUM,
        // 4.3.7).
        let where_mm = slide.half_range_mm() / 3.0_f64.sqrt();
        let sigma_mm = slide.sigma_mm.hypot(where_mm).hypot(stated.uncertainty_mm / COVERAGE);
        KnownMove {
            pairs: places.names(slide.ends),
            stated_mm: length_mm,
            stated_uncertainty_mm: stated.uncertainty_mm,
            measured_mm: slide.length_mm,
            measured_sigma_mm: slide.sigma_mm,
            turn_deg: slide.turn_rad.to_degrees(),
            turned: slide.is_turned,
            corners_mm: slide.corners_mm,
            scale_error,
            scale_sigma: sigma_mm / length_mm,
            square_mm: places.calibration.board.square_mm / (1.0 + scale_error),
        }
    }

    /// Expanded uncertainty (k = 2) of the scale error.
    pub fn expanded(&self) -> f64 {
        COVERAGE * self.scale_sigma
    }

    /// The scale error that nineteen of twenty such moves show.
    pub fn seen(&self) -> f64 {
        (CONTRADICTS + SEEN) * self.scale_sigma
    }

    /// Whether the scale is off by more than chance.
    pub fn contradicts(&self) -> bool {
        self.scale_error.abs() > CONTRADICTS * self.scale_sigma
    }

    /// The verdict on a length that may be off by so much.
    pub(in crate::stereo::judge) fn verdict(&self, length_mm: f64, tolerance_mm: f64) -> Verdict {
        let (error, expanded) = (self.scale_error.abs(), self.expanded());
        if self.contradicts() && (error - expanded) * length_mm > tolerance_mm {
            return Verdict::Fail;
        }
        Verdict::within((error + expanded) * length_mm, tolerance_mm)
    }

    /// What it says, in a sentence.
    pub fn statement(&self) -> String {
        let [from, to] = &self.pairs;
        let turned = if self.turned {
            let [least, most] = self.corners_mm;
            format!(
                "; the board turned by {:.3} deg on the way, so that its corners moved by {least:.3} to {most:.3} mm: it must only slide",
                self.turn_deg
            )
        } else {
            String::new()
        };
        format!(
            "the move of {} +- {} mm from pair {from} to {to} is measured as {:.4} +- {:.4} mm: it {} the scale, which is off by \
             {:+.3} +- {:.3} % (an error of {:.3} % would show in nineteen of twenty such moves){turned}",
            self.stated_mm,
            self.stated_uncertainty_mm,
            self.measured_mm,
            COVERAGE * self.measured_sigma_mm,
            if self.contradicts() { "contradicts" } else { "agrees with" },
            100.0 * self.scale_error,
            100.0 * self.expanded(),
            100.0 * self.seen()
        )
    }
}

impl KnownMoves {
    /// What explains moves that contradict the scale; empty where none does. A pitch of the board that is wrong is one
    /// scale of all lengths, a move that is stated wrong by some mm shows less in a longer one; one move, or several of
    /// one length, do not tell.
    pub fn causes(&self) -> Vec<Cause> {
        if !self.measured.iter().any(KnownMove::contradicts) {
            return Vec::new();
        }
        let scale = |m: &KnownMove| (m.scale_error, m.scale_sigma);
        let offset = |m: &KnownMove| (m.measured_mm - m.stated_mm, m.scale_sigma * m.stated_mm);
        let by_scale = agree(self.measured.iter().map(scale));
        let by_offset = agree(self.measured.iter().map(offset));
        let causes = [(Cause::OtherBoard, by_scale), (Cause::KnownMove, by_offset || !by_scale)];
        causes.into_iter().filter(|(_, explains)| *explains).map(|(cause, _)| cause).collect()
    }

    /// The move whose scale error is farthest beyond chance.
    fn surest(&self) -> Option<&KnownMove> {
        let beyond = |m: &&KnownMove| m.scale_error.abs() / m.scale_sigma;
        self.measured.iter().max_by(|a, b| beyond(a).total_cmp(&beyond(b)))
    }

    /// What explains moves that contradict the scale, and what to do, for a person.
    pub fn why(&self) -> Option<String> {
        let board = format!("sides of {:.4} mm would agree with it", self.surest()?.square_mm);
        match self.causes()[..] {
            [] => None,
            [Cause::OtherBoard] => Some(format!("all moves show one scale: the board's pitch is not as said; {board}")),
            [Cause::KnownMove] => {
                Some("the moves show no common scale: one of them at least is not as stated".to_owned())
            }
            _ => Some(format!(
                "the board's pitch is not as said ({board}), or the move is not: a move of another length tells which"
            )),
        }
    }

    /// The finding where moves contradict the scale; a length of so many mm tells its effect.
    pub fn finding(&self, length_mm: f64) -> Option<Finding> {
        let (causes, surest, why) = (self.causes(), self.surest()?, self.why()?);
        let of = |m: &&KnownMove| m.contradicts();
        Some(Finding {
            cause: Cause::words(causes.into_iter()),
            kind: Kind::Pair,
            pairs: self.measured.iter().filter(of).flat_map(|m| m.pairs.clone()).collect(),
            size: Some(100.0 * surest.scale_error),
            unit: "%",
            effect_mm: Some(surest.scale_error.abs() * length_mm),
            action: format!("{}: {why}", surest.statement()),
            ..Finding::default()
        })
    }
}

/// Whether values with standard deviations are one value but for chance.
fn agree(values: impl Iterator<Item = (f64, f64)>) -> bool {
    let values: Vec<(f64, f64)> = values.collect();
    let weight = |sigma: f64| 1.0 / (sigma * sigma);
    let sum: f64 = values.iter().map(|(_, sigma)| weight(*sigma)).sum();
    let mean = values.iter().map(|(value, sigma)| value * weight(*sigma)).sum::<f64>() / sum;
    values.iter().all(|(value, sigma)| (value - mean).abs() <= CONTRADICTS * sigma)
}
