//! From the common minimum to an answer a pose: covariances in two parts, and the reason where there is no answer.

use std::ops::AddAssign;

use nalgebra::{DMatrix, DVector, Matrix6, Matrix6xX, Vector3, Vector6};
use rayon::prelude::*;

use crate::geometry::Transform;
use crate::imaging::Side;
use crate::stereo::board_pose::answer::{MeasuredPose, POSE_LIMIT, Refusal, Series, Shape, Shared, TargetPose};
use crate::stereo::board_pose::pair_excess::stray_limit;
use crate::stereo::board_pose::rig_change::cause::{named, stretch};
use crate::stereo::board_pose::rig_change::consistency::{self, Change};
use crate::stereo::board_pose::rig_change::judgement::Judgement;
use crate::stereo::board_pose::run::Run;
use crate::stereo::board_pose::solve::alone::{Alone, Known};
use crate::stereo::board_pose::solve::bundle::Bundle;
use crate::stereo::board_pose::solve::estimate::Estimate;
use crate::stereo::board_pose::solve::prior::frame_modes;
use crate::stereo::board_pose::solve::window::Window;
use crate::stereo::board_pose::start::{FEWEST_CORNERS, Start, enough};
use crate::stereo::data::View;

/// Standard deviations by which a pose's own chi-square may exceed one before its covariance grows.
const POSE_SIGMAS: f64 = 3.0;

/// Chi-square a number above which a pose that takes no part in the common minimum is not believed.
const OUTSIDER_LIMIT: f64 = 4.0;

/// Chi-square a number up to which two pictures belong together.
const PARTNER_LIMIT: f64 = 2.0;

impl Run<'_> {
    /// Every pose on the common values.
    pub(super) fn finish(self, found: &Estimate<'_>, judgement: Judgement) -> Series {
        let known = Known::new(found);
        let each = consistency::at_each(&found.normal, &found.covariance);
        let names = named(found);
        let shared_covariance = with_rim(found);
        let covariance = &names * &shared_covariance * names.transpose();
        let alone_at = |(i, start): (usize, &Start)| {
            known.fit(&found.bundle.views[i], found.values.poses[i].as_ref().or(start.pose.as_ref())?)
        };
        let alone: Vec<Option<Alone>> = self.starts.par_iter().enumerate().map(alone_at).collect();
        let ended = match &judgement {
            Judgement::Contradicts(_) | Judgement::Loose { .. } | Judgement::Unexplained { .. } => {
                judgement.describe(&self.known.rig, &self.known.board)
            }
            _ => None,
        };
        let finisher =
            Finisher { run: &self, found, shared_covariance: &shared_covariance, known: &known, alone: &alone };
        let targets: Vec<Result<TargetPose, Refusal>> = (0..self.at.len())
            .into_par_iter()
            .map(|i| match (&self.refusals[i], &ended) {
                (Some(refusal), _) => Err(refusal.clone()),
                (None, Some(reason)) => Err(Refusal { status: "rig changed", reason: reason.clone() }),
                (None, None) => finisher.pose(i, each[i].as_ref()),
            })
            .collect();
        let taking_part = alone.iter().zip(&self.taking_part).filter_map(|(a, part)| a.as_ref().filter(|_| *part));
        let (sum, freedom) =
            taking_part.fold((0.0, 0.0), |s: (f64, f64), a| (s.0 + a.chi_square * a.freedom, s.1 + a.freedom));
        let noise_px = found.noise.typical_px(&found.bundle.views);
        let usual_px = self.known.noise.map(|noise| noise.typical_px(&found.bundle.views));
        let against = usual_px.map_or(1.0, |usual| (noise_px / usual).powi(2));
        let poses = self.at.iter().cloned().zip(targets).map(|(at, target)| MeasuredPose { at, target }).collect();
        Series {
            poses,
            shape: Some(shape(found, &shared_covariance)),
            shared: Some(shared(found, &names, covariance)),
            judgement,
            noise_px: Some(noise_px),
            usual_px,
            prior_chi_square: Some(prior_chi_square(found)),
            chi_square: Some(sum / freedom.max(1.0) * against),
            excess: found.excess,
            usual_excess: self.known.usual().excess_here(&found.noise, &found.bundle.views).max(1.0),
            notes: self.notes,
        }
    }
}

/// What turns a pose into an answer.
struct Finisher<'a> {
    run: &'a Run<'a>,
    found: &'a Estimate<'a>,
    /// Of what all poses share.
    shared_covariance: &'a DMatrix<f64>,
    known: &'a Known<'a>,
    alone: &'a [Option<Alone>],
}

impl Finisher<'_> {
    fn pose(&self, i: usize, change: Option<&Change>) -> Result<TargetPose, Refusal> {
        let start = &self.run.starts[i];
        let Some(alone) = &self.alone[i] else {
            return Err(self.no_pose(i, start));
        };
        let outside = || consistency::of_outsider(&alone.part, &self.found.covariance);
        let change = change.copied().or_else(outside);
        let own = alone.chi_square.clamp(1.0, OUTSIDER_LIMIT);
        if let Some(change) = change.filter(|c| c.fall > stray_limit(self.run.known.farthest_pair) * own) {
            return Err(self.two_moments(i, alone, &change));
        }
        if !self.run.taking_part[i] && alone.chi_square > OUTSIDER_LIMIT * self.found.excess {
            let times = alone.chi_square.sqrt();
            return Err(Refusal {
                status: "does not fit",
                reason: format!("its corners miss the common rig and target {times:.1} times as far as at other poses"),
            });
        }
        // As far as a pair went that the calibration used, but beyond chance: its own disagreement is what it is known
        // to.
        let disagrees = change.map(|c| c.fall / own).filter(|fall| *fall > POSE_LIMIT);
        Ok(self.answer(i, alone, disagrees.map_or(1.0, |fall| fall / consistency::NUMBERS)))
    }

    /// The answer, its own covariance so many times as large as usual.
    fn answer(&self, i: usize, alone: &Alone, times: f64) -> TargetPose {
        let by_shared = alone.part.by_shared();
        let through = &by_shared * self.shared_covariance * by_shared.transpose();
        let chance = 1.0 + POSE_SIGMAS * (2.0 / alone.freedom.max(1.0)).sqrt();
        let grown = if alone.chi_square > chance { alone.chi_square } else { 1.0 };
        let mut own_covariance = alone.part.own_covariance(self.found.excess) * grown * times;
        if let Some(along) = &self.run.along {
            // Whether the common rig is the one before or the one after is not known.
            let moved = alone.part.by_change() * along.change.change * along.shares[i].max(1.0 - along.shares[i]);
            own_covariance += moved * moved.transpose();
        }
        let sensitivity = self.sensitivity(alone);
        let (change, gradient) = (&alone.part.change, &alone.part.change_gradient);
        let t = self.run.known.rig.right_from_left.translation.vector;
        let turn = |axis: Vector3<f64>| {
            let moved = axis.cross(&t);
            let d = Vector6::new(axis.x, axis.y, axis.z, moved.x, moved.y, moved.z);
            let curvature = d.dot(&(change * d));
            [-d.dot(gradient) / curvature, 1.0 / curvature.sqrt()]
        };
        TargetPose {
            cam_from_board: alone.pose,
            covariance: own_covariance + Matrix6::from_fn(|i, j| 0.5 * (through[(i, j)] + through[(j, i)])),
            own_covariance,
            sensitivity,
            fit_rms_mm: alone.fit_rms_mm,
            rms_px: alone.rms_px,
            corners: alone.view.observations.iter().filter(|o| o.active).count(),
            outliers: alone.view.observations.iter().filter(|o| !o.active).count(),
            chi_square: alone.chi_square,
            pitch_rad: turn(Vector3::x()),
            yaw_rad: turn(Vector3::y()),
        }
    }

    /// By the rig's named numbers and the crossings.
    fn sensitivity(&self, alone: &Alone) -> Matrix6xX<f64> {
        let n = self.found.values.rig.len();
        let places = &self.found.bundle.rig.places;
        let crossings = alone.part.mixed.rows_range(n..);
        let mut mixed = DMatrix::zeros(places.len() + crossings.nrows(), 6);
        for (row, &place) in places.iter().enumerate() {
            mixed.row_mut(row).copy_from(&alone.part.rig_mixed.row(place));
        }
        mixed.rows_mut(places.len(), crossings.nrows()).copy_from(&crossings);
        -(alone.part.pose_inverse * mixed.transpose())
    }

    fn no_pose(&self, i: usize, start: &Start) -> Refusal {
        let [left, right] = Side::BOTH.map(|side| start.view.only(side).observations.len());
        if start.pose.is_none() && !enough(&start.view) {
            let reason = format!("too few corners: {left} left, {right} right, at least {} each", FEWEST_CORNERS);
            return Refusal { status: "too few corners", reason };
        }
        self.partner(i).unwrap_or_else(|| Refusal {
            status: "two moments",
            reason:
                "left and right do not show the same target at the same place: most corners miss the rig's prediction; \
                     taken at two moments, or a picture of another pose"
                    .to_owned(),
        })
    }

    fn two_moments(&self, i: usize, alone: &Alone, change: &Change) -> Refusal {
        if let Some(partner) = self.partner(i) {
            return partner;
        }
        let seen = self.run.known.rig.right_from_left * alone.pose.translation.vector;
        let c = &change.change;
        let moved = Vector3::new(c[0], c[1], c[2]).cross(&seen) + Vector3::new(c[3], c[4], c[5]);
        let reason = format!(
            "the two pictures do not belong to one moment: between them the target moved by about {:.3} mm against the cameras",
            moved.norm()
        );
        Refusal { status: "two moments", reason }
    }

    /// The pose that one of the pictures belongs to.
    fn partner(&self, i: usize) -> Option<Refusal> {
        let view = &self.found.bundle.views[i];
        let fits = |mixed: View, pose: &Transform| {
            let alone = self.known.fit(&mixed, pose);
            alone.is_some_and(|a| {
                a.chi_square < PARTNER_LIMIT * self.found.excess
                    && 2 * mixed.observations.len() < 3 * a.view.observations.iter().filter(|o| o.active).count()
            })
        };
        (0..self.alone.len()).filter(|&j| j != i).find_map(|j| {
            let other = &self.found.bundle.views[j];
            let pose = self.run.starts[j].pose?;
            let mine = self.run.starts[i].pose.unwrap_or(pose);
            for pose in [pose, mine] {
                if fits(view.paired(Side::Left, other), &pose) {
                    return Some(self.mixed_up("left", "right", j));
                }
                if fits(other.paired(Side::Left, view), &pose) {
                    return Some(self.mixed_up("right", "left", j));
                }
            }
            None
        })
    }

    fn mixed_up(&self, mine: &str, other: &str, j: usize) -> Refusal {
        let pose = &self.run.at[j].pose;
        let reason = format!("its {mine} picture belongs to the {other} one of pose {pose}");
        Refusal { status: "another pose's pictures", reason }
    }
}

/// Covariance of the shared unknowns, with what the target's rim, which no corner shows, leaves open: where corners are
/// seen is known all the same, but not where the target's frame lies among them.
fn with_rim(found: &Estimate<'_>) -> DMatrix<f64> {
    let bundle = &found.bundle;
    let modes = DMatrix::from_columns(&frame_modes(bundle.board));
    let windows = Window::means(bundle.board, &bundle.views);
    let variances = windows.iter().flat_map(|window| [window.rim_variance(0), window.rim_variance(1), 0.0]);
    let variances = DMatrix::from_diagonal(&DVector::from_iterator(3 * windows.len(), variances))
        * bundle.shape.in_plane_mm.powi(2);
    let through = &modes * (modes.transpose() * variances * &modes) * modes.transpose();
    let (n, m) = (found.values.rig.len(), modes.nrows());
    let mut covariance = found.covariance.clone();
    covariance.view_mut((n, n), (m, m)).add_assign(&through);
    covariance
}

/// The target as the minimum has it.
fn shape(found: &Estimate<'_>, covariance: &DMatrix<f64>) -> Shape {
    let n = found.values.rig.len();
    let sigma = |k: usize| Vector3::from_fn(|i, _| covariance[(n + 3 * k + i, n + 3 * k + i)].max(0.0).sqrt());
    Shape {
        deviations_mm: found.values.deviations_mm.clone(),
        sigma_mm: (0..found.values.deviations_mm.len()).map(sigma).collect(),
        in_plane_mm: found.bundle.shape.in_plane_mm,
        out_of_plane_mm: found.bundle.shape.out_of_plane_mm,
        stretch: stretch(found),
    }
}

fn shared(found: &Estimate<'_>, names: &DMatrix<f64>, covariance: DMatrix<f64>) -> Shared {
    let board = found.bundle.board;
    let mut parameters = found.bundle.rig.names.clone();
    for i in 0..board.corner_count() {
        let (col, row) = board.place(i);
        let place = format!("target.{col}.{row}");
        parameters.extend(["x_mm", "y_mm", "z_mm"].map(|axis| format!("{place}.{axis}")));
    }
    let change: DVector<f64> = names * Bundle::shared(&found.values);
    Shared { parameters, change: change.as_slice().to_vec(), covariance }
}

/// Chi-square of the calibration and of the target's size, with the degrees of freedom that the pictures tell of them.
fn prior_chi_square(found: &Estimate<'_>) -> [f64; 2] {
    let rig = &found.bundle.rig;
    let (mut chi, mut freedom) = (0.0, 0.0);
    for (i, variance) in rig.variances.iter().enumerate().filter(|(_, v)| v.is_finite()) {
        chi += found.values.rig[i].powi(2) / variance;
        freedom += 1.0 - found.covariance[(i, i)] / variance;
    }
    let [amount, sigma] = stretch(found);
    let before = found.bundle.shape.stretch_mm / super::solve::prior::stretch_length_mm(found.bundle.board);
    if before.is_finite() {
        chi += (amount / before).powi(2);
        freedom += 1.0 - (sigma / before).powi(2);
    }
    [chi, freedom]
}
