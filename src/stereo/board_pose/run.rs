//! A run of poses while it is worked on: the starts, which poses take part, and what is found on the way.

use nalgebra::Vector3;

use crate::geometry::Transform;
use crate::imaging::{Board, Corner, PairCorners, Side};
use crate::measurements::RobotPose;
use crate::statistics::median;
use crate::stereo::Rig;
use crate::stereo::board_pose::answer::{MeasuredPose, POSE_LIMIT, Refusal, Series};
use crate::stereo::board_pose::rig_change::cause::{Cause, Explanation, stretch};
use crate::stereo::board_pose::rig_change::consistency::{self, Along};
use crate::stereo::board_pose::rig_change::elsewhere;
use crate::stereo::board_pose::rig_change::judge::{Changed, scaled};
use crate::stereo::board_pose::rig_change::judgement::Judgement;
use crate::stereo::board_pose::solve::alone::Known;
use crate::stereo::board_pose::solve::bundle::{Bundle, Values};
use crate::stereo::board_pose::solve::estimate::{Estimate, Usual, estimate};
use crate::stereo::board_pose::solve::prior::{RigPrior, ShapePrior};
use crate::stereo::board_pose::start::{Start, baseline_ratio, starts};
use crate::stereo::board_pose::turns;
use crate::stereo::data::{Noise, View};
use crate::stereo::pairs::candidates;
use crate::stereo::pairs::flip::Flip;
use crate::stereo::volume::Volume;

/// Poses that stray this far beyond the limit in relation to the worst are left out together with it.
const TOGETHER: f64 = 0.2;

/// Rounds of leaving poses out.
const ROUNDS: usize = 8;

/// Corners that the rig misses by more than this share of the picture's width belong to another rig, or to another
/// target.
const GROSS_SHARE: f64 = 1e-3;

/// Corners that miss the rig this many times as far as usual are looked at in pictures that are exchanged or the other
/// way round.
const UNUSUAL_MISFIT: f64 = 3.0;

/// A size of the target is no cause where another place of the right camera leaves less than this share of what it
/// leaves.
const BY_PLACE: f64 = 0.5;

/// The pictures of one pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    pub at: RobotPose,
    pub corners: Result<PairCorners, Refusal>,
}

/// What is known before, and what counts as too much.
#[derive(Debug, Clone, PartialEq)]
pub struct Knowledge {
    /// The rig as calibrated.
    pub rig: Rig,
    /// How its corners scattered, where that is known.
    pub noise: Option<Noise>,
    /// How far its pairs scattered about it beyond their corners' scatter, as [`Series::excess`], where that is known.
    pub pair_excess: Option<f64>,
    /// How far the pair disagreed that did most, as chi-square of six numbers beside that, where it is known.
    pub farthest_pair: Option<f64>,
    /// Where the boards were at the calibration, where that is known.
    pub volume: Option<Volume>,
    /// The target as drawn.
    pub board: Board,
    /// Standard deviation of a crossing against the drawing, by the certificate, mm.
    pub crossing_mm: f64,
    /// Points that are wrong by more than this are of no use, mm.
    pub tolerance_mm: f64,
}

impl Knowledge {
    pub(super) fn usual(&self) -> Usual {
        Usual { noise: self.noise, excess: self.pair_excess.unwrap_or(1.0) }
    }
}

/// Of two poses with the same picture, the one whose pictures miss the rig by more than this many times what is usual
/// has the other's.
const TWIN_MISFIT: f64 = 10.0;

pub(super) struct Run<'a> {
    pub(super) known: &'a Knowledge,
    pub(super) at: Vec<RobotPose>,
    pub(super) refusals: Vec<Option<Refusal>>,
    pub(super) starts: Vec<Start>,
    /// Poses that take part in the bundle.
    pub(super) taking_part: Vec<bool>,
    pub(super) moved: Option<Judgement>,
    /// A change along the run that the points' uncertainty allows.
    pub(super) along: Option<Along>,
    pub(super) notes: Vec<String>,
    /// The corners as they were found.
    pairs: Vec<PairCorners>,
}

impl<'a> Run<'a> {
    pub(super) fn new(known: &'a Knowledge, seen: Vec<Seen>) -> Run<'a> {
        let mut refusals: Vec<Option<Refusal>> = seen.iter().map(|s| s.corners.as_ref().err().cloned()).collect();
        let empty = |at: &RobotPose| PairCorners { pair: at.pose.clone(), ..PairCorners::default() };
        let pairs: Vec<PairCorners> = seen.iter().map(|s| s.corners.clone().unwrap_or_else(|_| empty(&s.at))).collect();
        let at: Vec<RobotPose> = seen.into_iter().map(|s| s.at).collect();
        let mut starts = starts(&known.rig, &known.board, &pairs);
        let usual = median(starts.iter().filter(|s| s.pose.is_some()).map(|s| s.misfit_px)).unwrap_or(0.0);
        let fits = |i: usize| starts[i].pose.is_some() && starts[i].misfit_px <= TWIN_MISFIT * usual;
        for (i, refusal) in refusals.iter_mut().enumerate() {
            let twin =
                (0..pairs.len()).find(|&j| j != i && !pairs[i].left.is_empty() && same_pictures(&pairs[i], &pairs[j]));
            // Where one of the two fits the rig and the other does not, the picture is that one's.
            if let Some(j) = twin.filter(|&j| refusal.is_none() && (!fits(i) || fits(j))) {
                let reason =
                    format!("a picture is the same as at pose {}: one of the two poses has the other's", at[j].pose);
                *refusal = Some(Refusal { status: "another pose's pictures", reason });
            }
        }
        let mut views: Vec<View> = starts.iter().map(|s| s.view.clone()).collect();
        let mut poses: Vec<Option<Transform>> =
            starts.iter().zip(&refusals).map(|(s, refusal)| s.pose.filter(|_| refusal.is_none())).collect();
        let rows: Vec<&RobotPose> = at.iter().collect();
        let notes = turns::settle(&known.board, &rows, &mut views, &mut poses);
        let taking_part = poses.iter().map(Option::is_some).collect();
        for ((start, view), pose) in starts.iter_mut().zip(views).zip(poses) {
            (start.view, start.pose) = (view, pose);
        }
        Run { known, at, refusals, starts, taking_part, moved: None, along: None, notes, pairs }
    }

    pub(super) fn present(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.starts.len()).filter(|&i| self.starts[i].pose.is_some())
    }

    pub(super) fn misfit_px(&self) -> f64 {
        median(self.present().map(|i| self.starts[i].misfit_px)).unwrap_or(0.0)
    }

    pub(super) fn bundle(&self) -> Bundle<'a> {
        let crossing = self.known.crossing_mm;
        let shape =
            ShapePrior { in_plane_mm: crossing, out_of_plane_mm: crossing, bent_mm: crossing, stretch_mm: crossing };
        let views = self.starts.iter().map(|s| s.view.clone()).collect();
        let edge_bends_mm = vec![0.0; self.known.board.corner_count()];
        Bundle { board: &self.known.board, views, rig: RigPrior::new(&self.known.rig), shape, edge_bends_mm }
    }

    fn values(&self, bundle: &Bundle<'_>) -> Values {
        let poses = self.starts.iter().zip(&self.taking_part).map(|(s, part)| s.pose.filter(|_| *part)).collect();
        let rig = nalgebra::DVector::zeros(bundle.rig.basis.ncols());
        Values { rig, deviations_mm: vec![Vector3::zeros(); self.known.board.corner_count()], poses }
    }

    /// Faults so large that no pose can be measured: exchanged pictures, another size of squares, another unit of the
    /// baseline.
    pub(super) fn gross(&self) -> Option<Judgement> {
        let limit = GROSS_SHARE * f64::from(self.known.rig.left.width);
        let misfit_px = self.misfit_px();
        let views: Vec<View> = self.starts.iter().map(|s| s.view.clone()).collect();
        let usual_px = self.known.noise.map_or(f64::INFINITY, |noise| noise.typical_px(&views));
        if misfit_px <= limit.min(UNUSUAL_MISFIT * usual_px) {
            return None;
        }
        let better = |px: f64| px < 0.3 * misfit_px;
        let misfit_px_of = |flip: Flip| {
            let Knowledge { rig, board, .. } = self.known;
            let pairs: Vec<PairCorners> = self.pairs.iter().map(|pair| flip.of_pair(board, rig, pair)).collect();
            let others = starts(rig, board, &pairs);
            median(others.iter().map(|s| s.misfit_px)).unwrap_or(f64::INFINITY)
        };
        // A rig that is nearly its own mirror image fits both ways.
        let others = Flip::ALL.map(|flip| (misfit_px_of(flip), flip)).into_iter().filter(|(px, _)| better(*px));
        if let Some((_, flip)) = others.min_by(|a, b| a.0.total_cmp(&b.0)) {
            return Some(Judgement::OtherWayRound(flip));
        }
        if misfit_px <= limit {
            return None;
        }
        let present: Vec<usize> = self.present().collect();
        let views: Vec<View> = present.iter().map(|&i| self.starts[i].view.clone()).collect();
        let factor = 1.0 / baseline_ratio(&self.known.rig, &views)?;
        let mut bundle = self.bundle();
        bundle.shape.stretch_mm = f64::INFINITY;
        let start = scaled(&self.values(&bundle), &bundle, factor);
        let found = estimate(bundle, start, self.known.usual(), None)?;
        let left = Known::new(&found);
        let misfits = present.iter().filter_map(|&i| {
            left.fit(&found.bundle.views[i], found.values.poses[i].as_ref()?).map(|alone| alone.rms_px)
        });
        let with_pitch_px = median(misfits).unwrap_or(f64::INFINITY);
        // Another place of the right camera, of which a size is one number, leaves as much where it is the size.
        let elsewhere_px = || elsewhere::misfit_px(&self.known.rig, &found.bundle.views, &self.starts);
        if !better(with_pitch_px) || elsewhere_px().is_some_and(|px| px < BY_PLACE * with_pitch_px) {
            return None;
        }
        let [amount, sigma] = stretch(&found);
        let moves = present.iter().filter_map(|&i| {
            Some((found.values.poses[i]?.translation.vector - self.starts[i].pose?.translation.vector).norm())
        });
        let share = (amount / (1.0 + amount)).abs();
        let if_scaled = present.iter().filter_map(|&i| Some(share * found.values.poses[i]?.translation.vector.norm()));
        let explanation = Explanation { cause: Cause::Pitch, amount, sigma, fall: f64::INFINITY, grows: false };
        let moves_mm = median(moves).unwrap_or(0.0);
        let (explanations, scaled_mm) = (vec![explanation], median(if_scaled));
        Some(Judgement::Contradicts(Changed { explanations, moves_mm, beyond: f64::INFINITY, scaled_mm }))
    }

    /// The bundle over the poses that fit together; the others are left out, and a rig that moved ends the run before
    /// it.
    pub(super) fn consistent(&mut self) -> Option<Estimate<'a>> {
        for _ in 0..ROUNDS {
            let found = self.estimated()?;
            // The estimate does without poses of which too few corners fit.
            for (part, pose) in self.taking_part.iter_mut().zip(&found.values.poses) {
                *part = *part && pose.is_some();
            }
            let each = consistency::at_each(&found.normal, &found.covariance);
            let worst = each.iter().flatten().map(|c| c.fall).fold(0.0, f64::max);
            if self.ends_early(&found, worst) {
                continue;
            }
            let limit = POSE_LIMIT.max(TOGETHER * worst);
            let strays: Vec<usize> = (0..each.len()).filter(|&i| each[i].is_some_and(|c| c.fall > limit)).collect();
            let remain = self.taking_part.iter().filter(|part| **part).count() - strays.len();
            if strays.is_empty() || remain == 0 {
                return Some(found);
            }
            strays.iter().for_each(|&i| self.taking_part[i] = false);
        }
        self.estimated()
    }

    /// The bundle over the poses that take part now.
    fn estimated(&self) -> Option<Estimate<'a>> {
        let bundle = self.bundle();
        let values = self.values(&bundle);
        estimate(bundle, values, self.known.usual(), None)
    }

    /// No pose is measured.
    pub(super) fn nothing(self, judgement: Judgement) -> Series {
        let status = "rig changed";
        let reason = judgement.describe(&self.known.rig, &self.known.board);
        let too_few = |start: &Start| {
            let [left, right] = Side::BOTH.map(|side| start.view.active(side).count());
            Refusal { status: "too few corners", reason: format!("too few corners: {left} left, {right} right") }
        };
        let poses = self.at.into_iter().zip(self.refusals).zip(&self.starts).map(|((at, refusal), start)| {
            let refusal = refusal.unwrap_or_else(|| match &reason {
                Some(reason) if start.pose.is_some() => Refusal { status, reason: reason.clone() },
                _ => too_few(start),
            });
            MeasuredPose { at, target: Err(refusal) }
        });
        let poses = poses.collect();
        Series { poses, judgement, excess: 1.0, usual_excess: 1.0, notes: self.notes, ..Series::default() }
    }
}

fn same_pictures(a: &PairCorners, b: &PairCorners) -> bool {
    let seen_twice = |a: &[Corner], b: &[Corner]| !a.is_empty() && candidates::same(a, b);
    seen_twice(&a.left, &b.left) || seen_twice(&a.right, &b.right)
}
