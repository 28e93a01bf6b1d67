//! What ends a run, or a part of it: a change along the run, and a rig that is another from pose to pose.
//!
//! A change ends the run where it moves points by more than their own uncertainty allows, not where it is significant:
//! what it moves by less is added to the points' covariance.

use nalgebra::Vector3;

use crate::geometry::perturb;
use crate::statistics::median;
use crate::stereo::Rig;
use crate::stereo::board_pose::answer::{POSE_LIMIT, Refusal};
use crate::stereo::board_pose::rig_change::consistency::{self, Along, Change, MEDIAN_CHI_SQUARE_6};
use crate::stereo::board_pose::rig_change::judge::ALLOWED;
use crate::stereo::board_pose::rig_change::judgement::Judgement;
use crate::stereo::board_pose::run::Run;
use crate::stereo::board_pose::solve::estimate::{Estimate, TELLING_POSES, estimate};

/// The same for a change from one pose on, which is looked for at every pose.
const MOVED_LIMIT: f64 = 60.0;

/// The least that a pose after a change contributes to its score where the calibration holds no covariance.
const EACH_POSE: f64 = 20.0;

impl<'a> Run<'a> {
    /// Poses that scatter about the common rig so far that the usual one would not be believed where poses scatter as
    /// the pairs of the calibration, and whose points are therefore of no use.
    pub(in crate::stereo::board_pose) fn loose(&self, found: &Estimate<'_>) -> Option<Judgement> {
        self.known.pair_excess?;
        let times = found.excess / self.known.usual().excess_here(&found.noise, &found.bundle.views);
        let sigma_mm = median((0..self.at.len()).filter_map(|i| found.own_sigma_mm(i)))?;
        (MEDIAN_CHI_SQUARE_6 * times > POSE_LIMIT && sigma_mm > self.known.tolerance_mm)
            .then(|| Judgement::Loose { times: times.sqrt(), sigma_mm })
    }

    /// Leaves the poses from a change along the run on out, where it moves points by more than their uncertainty
    /// allows. `worst` is the score of the worst pose by itself.
    pub(in crate::stereo::board_pose) fn ends_early(&mut self, found: &Estimate<'a>, worst: f64) -> bool {
        self.along = None;
        let Some(along) = consistency::along(&found.normal, &found.covariance) else { return false };
        let after = (along.from..self.taking_part.len()).filter(|&i| self.taking_part[i]).count();
        // A calibration that does not say how well it is known is a little wrong everywhere, which many poses together
        // would show: then every pose after the change must show it.
        let each = if self.known.rig.covariance.is_none() { EACH_POSE * after as f64 } else { 0.0 };
        if after < 2 || along.evidence <= MOVED_LIMIT || along.gain <= each || along.change.fall <= 1.5 * worst {
            return false;
        }
        let beyond = self.beyond(found, &along);
        match along.shares.iter().position(|share| share * share * beyond > ALLOWED) {
            Some(k) => {
                self.end_at(k, &along);
                true
            }
            None => {
                self.along = Some(along);
                false
            }
        }
    }

    /// By how much a whole change exceeds the points' uncertainty, as chi-square with three degrees of freedom. The
    /// uncertainty is that of poses on one side of the change: the common minimum takes it for noise.
    fn beyond(&self, found: &Estimate<'a>, along: &Along) -> f64 {
        let present: Vec<usize> = (0..self.taking_part.len()).filter(|&i| self.taking_part[i]).collect();
        let before = present.iter().filter(|&&i| i < along.from).count();
        let side = match () {
            () if along.creeps => &present[..(present.len() / 4).max(TELLING_POSES).min(present.len())],
            () if before >= TELLING_POSES.min(present.len() - before) => &present[..before],
            () => &present[before..],
        };
        let (mut bundle, mut values) = (self.bundle(), found.values.clone());
        values.rig.fill(0.0);
        (0..values.poses.len()).filter(|i| !side.contains(i)).for_each(|i| values.poses[i] = None);
        bundle.edge_bends_mm.clone_from(&found.bundle.edge_bends_mm);
        let alone = estimate(bundle, values, self.known.usual(), None);
        let one_side = alone.as_ref().unwrap_or(found);
        let shift_mm = |i: usize| {
            let by_change = one_side.normal.poses[i].as_ref()?.by_change();
            Some((by_change * along.change.change).fixed_rows::<3>(3).into_owned())
        };
        median(side.iter().filter_map(|&i| one_side.beyond(one_side, i, &shift_mm(i)?))).unwrap_or(f64::INFINITY)
    }

    /// The rig moved before pose `k`: nothing from there on counts.
    fn end_at(&mut self, k: usize, along: &Along) {
        let since = self.at[k].pose.clone();
        let [turned_deg, moved_mm] = size_of(&along.change, &self.known.rig);
        let judgement = Judgement::Moved { since, creeps: along.creeps, turned_deg, moved_mm };
        let reason = judgement.describe(&self.known.rig, &self.known.board).unwrap_or_default();
        for i in k..self.at.len() {
            self.taking_part[i] = false;
            if self.refusals[i].is_none() {
                self.refusals[i] = Some(Refusal { status: "rig moved", reason: reason.clone() });
            }
        }
        self.moved = Some(judgement);
    }
}

/// Turn of the right camera, deg, and way of its centre, mm.
fn size_of(change: &Change, rig: &Rig) -> [f64; 2] {
    let c = &change.change;
    let moved = perturb(&rig.right_from_left, c.as_slice());
    let way = moved.inverse().translation.vector - rig.right_from_left.inverse().translation.vector;
    [Vector3::new(c[0], c[1], c[2]).norm().to_degrees(), way.norm()]
}
