//! What is found of the rig as a whole, and how it is said.

use crate::diagnostic::two_digits;
use crate::imaging::Board;
use crate::stereo::Rig;
use crate::stereo::board_pose::rig_change::cause::{Cause, Explanation};
use crate::stereo::board_pose::rig_change::judge::Changed;
use crate::stereo::pairs::flip::Flip;

#[derive(Debug, Clone, Default, PartialEq)]
pub enum Judgement {
    /// It agrees with its calibration.
    #[default]
    Agrees,
    /// It changed by less than the tolerance; covariances allow for it.
    Allowed(Changed),
    /// It is not the rig that was calibrated, or the target is not the one described.
    Contradicts(Changed),
    /// All pairs are the other way round.
    OtherWayRound(Flip),
    /// It moved during the run.
    Moved {
        /// First pose after it.
        since: String,
        /// True where it went on moving from pose to pose.
        creeps: bool,
        /// By how much the right camera turned, deg, and how far it went, mm, in all.
        turned_deg: f64,
        moved_mm: f64,
    },
    /// It is another from pose to pose.
    Loose {
        /// How many times as far as the pairs of the calibration the poses scatter about it.
        times: f64,
        /// Standard deviation of a point for it, mm.
        sigma_mm: f64,
    },
    /// Nothing that is known of explains the pictures.
    Unexplained {
        /// Median over the poses of what is left, px.
        misfit_px: f64,
    },
}

impl Judgement {
    /// True where the poses cannot be used.
    pub fn ends_the_run(&self) -> bool {
        !matches!(self, Judgement::Agrees | Judgement::Allowed(_))
    }

    /// True where points may be off by more than this, mm, and their covariances do not say so.
    pub fn leaves_open(&self, tolerance_mm: f64) -> bool {
        matches!(self, Judgement::Allowed(Changed { scaled_mm: Some(mm), .. }) if *mm > tolerance_mm)
    }

    /// What is wrong, for a person; `None` where nothing is.
    pub fn describe(&self, rig: &Rig, board: &Board) -> Option<String> {
        Some(match self {
            Judgement::Agrees => return None,
            Judgement::Allowed(changed) => format!(
                "{}: {}; the points move by {:.4} mm with it, and their covariance allows for that{}",
                match changed.explanations.as_slice() {
                    [Explanation { cause: Cause::Pitch, .. }, ..] =>
                        "the target is not quite as it was said to be, or the rig is not quite the one that was calibrated",
                    _ => "the rig is not quite the one that was calibrated",
                },
                causes(changed, rig, board),
                changed.moves_mm,
                changed.scaled_mm.map_or(String::new(), |mm| format!(
                    "; but if the target is as was said, the rig is scaled and the points are off by {mm:.3} mm: measure the squares of both \
                     boards; the target's go to `--square-mm`, the check board's to `camera-check IMAGES --square-mm MM`"
                ))
            ),
            Judgement::Contradicts(changed) => format!(
                "the calibration does not suit these pictures: {}; the points are off by {:.3} mm with it{}",
                causes(changed, rig, board),
                changed.moves_mm,
                changed.scaled_mm.map_or(String::new(), |mm| format!(
                    ", or by {mm:.3} mm if the target is as was said and the rig is scaled"
                ))
            ),
            Judgement::OtherWayRound(flip) => {
                format!("{}: they fit this rig the other way round", flip.describe())
            }
            Judgement::Moved { since, creeps, turned_deg, moved_mm } => {
                let (turned_deg, moved_mm) = (two_digits(*turned_deg), two_digits(*moved_mm));
                let change =
                    format!("the right camera turned by {turned_deg} deg and moved by {moved_mm} mm against the left");
                match creeps {
                    true => format!(
                        "the rig drifts: during the run {change}; from pose {since} on that is more than the points' uncertainty allows"
                    ),
                    false => format!("the rig moved before pose {since}: {change}"),
                }
            }
            Judgement::Loose { times, sigma_mm } => format!(
                "the rig changes from pose to pose: the poses disagree with one rig {times:.1} times as far as the pairs of the calibration \
                 did, and their points are known to {sigma_mm:.3} mm only; a camera is loose, or left and right are not of one moment"
            ),
            Judgement::Unexplained { misfit_px } => format!(
                "the calibration does not suit these pictures: the target's corners miss it by {misfit_px:.2} px, and no single change of \
                 the rig or of the target explains that"
            ),
        })
    }

    /// What speaks against points that are given for all that, for whoever uses them: where they may be off by more than
    /// this, mm.
    pub fn doubt(&self, rig: &Rig, board: &Board, tolerance_mm: f64) -> Option<String> {
        match self {
            Judgement::Allowed(changed) if self.leaves_open(tolerance_mm) => Some(format!(
                "the points are off by {:.3} mm if the target is as was said: {}",
                changed.scaled_mm?,
                causes(changed, rig, board)
            )),
            _ => None,
        }
    }

    pub fn hint(&self, rig: &Rig) -> Option<&'static str> {
        match self {
            Judgement::Agrees | Judgement::Allowed(_) => None,
            Judgement::Contradicts(changed) if changed.explanations.iter().any(|e| unit_of(e, rig).is_some()) => Some(
                "calibrate again with the side of that board's squares in mm: `stereocal camera-check IMAGES --square-mm MM`; or it is the target's \
                 `--square-mm` that is not in mm",
            ),
            Judgement::Contradicts(changed) if changed.explanations.iter().any(|e| e.cause == Cause::Pitch) => Some(
                "check `--square-mm` and `--squares` against the target; if they are right, the rig changed, or its own board's squares were not as was said: \
                 `stereocal camera-check IMAGES --square-mm MM`",
            ),
            Judgement::OtherWayRound(flip) => Some(flip.remedy()),
            Judgement::Moved { .. } | Judgement::Loose { .. } => Some(
                "clamp the cameras, calibrate again with `stereocal camera-check IMAGES`, and take the poses from there on again",
            ),
            _ => Some(
                "calibrate again with `stereocal camera-check IMAGES`; `--calibration FILE` names another calibration",
            ),
        }
    }
}

fn causes(changed: &Changed, rig: &Rig, board: &Board) -> String {
    let one = |e: &Explanation| unit_of(e, rig).unwrap_or_else(|| e.describe(rig, board));
    let all: Vec<String> = changed.explanations.iter().map(one).collect();
    all.join(", or ")
}

/// A size that is off by the ratio of two units of length: not the target's squares, but the baseline's number.
fn unit_of(e: &Explanation, rig: &Rig) -> Option<String> {
    /// Shares by which a ratio may miss a unit's.
    const NEAR: f64 = 0.03;
    const UNITS: [(f64, &str); 4] = [(1000.0, "m"), (10.0, "cm"), (25.4, "inches"), (1e-3, "um")];
    if e.cause != Cause::Pitch {
        return None;
    }
    let (_, unit) = UNITS.iter().find(|(mm, _)| ((1.0 + e.amount) * mm - 1.0).abs() < NEAR)?;
    Some(format!("the baseline of {:.4} mm seems to be in {unit}, not in mm", rig.baseline_mm()))
}
