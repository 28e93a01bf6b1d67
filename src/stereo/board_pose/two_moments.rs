//! Poses that miss the rig as no pair did that the calibration used.
//!
//! In: a run's poses, and how far the pairs of the calibration missed its rig, px. Out: the poses whose two pictures were not taken at one moment. Method:
//! the calibration leaves a pair out that misses the rig by several times what pairs usually do; so is a pose left out, where it misses it farther than
//! every pair that was used, and each picture by itself shows the target well. Where pairs scatter by more than their corners, a score in units of
//! that scatter does not tell this. Goes wrong: half of the poses or more.

use rayon::prelude::*;

use crate::statistics::median;
use crate::stereo::board_pose::run::Run;
use crate::stereo::data::View;
use crate::stereo::init::board_pose::{as_two_boards, misfit_px, times_alone};
use crate::stereo::model::Shared;
use crate::stereo::model::board_shape::FLAT;
use crate::stereo::pairs::TIMES;
use crate::stereo::pairs::series::SEVERAL;

/// The target need not be the board that calibrated, and corners elsewhere in the picture scatter a little otherwise.
const OVER_FARTHEST: f64 = 1.2;

impl Run<'_> {
    /// Which poses do; none where the calibration does not say how far its pairs missed it.
    pub(super) fn of_two_moments(&self) -> Vec<bool> {
        let mut views: Vec<View> = self.starts.iter().map(|start| start.view.clone()).collect();
        let Some(farthest_px) = self.known.farthest_px else { return vec![false; views.len()] };
        if let Some(noise) = &self.known.noise {
            noise.apply(&mut views);
        }
        let shared = Shared { rig: self.known.rig.clone(), shape_mm: FLAT };
        let missed = |view: &View| misfit_px(&shared, view).map(|(px, _)| px);
        let missed: Vec<Option<f64>> = views.par_iter().map(missed).collect();
        let usual_px = median(missed.iter().flatten().copied()).unwrap_or(f64::INFINITY);
        let limit_px = (SEVERAL * usual_px).max(OVER_FARTHEST * farthest_px);
        let alone_px = |view: &View| times_alone(&shared, view, [1.0; 2], as_two_boards);
        let is_apart = |(view, px): (&View, &Option<f64>)| {
            px.is_some_and(|px| px > limit_px && alone_px(view).is_some_and(|alone| TIMES * alone < px))
        };
        views.iter().zip(&missed).map(is_apart).collect()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::imaging::Corners;
    use crate::measurements::{RobotPose, Role};
    use crate::stereo::board_pose::pair_excess::{farthest_pair, farthest_px, pair_excess};
    use crate::stereo::board_pose::run::{Knowledge, Seen};
    use crate::stereo::calibrate::calibrate;
    use crate::stereo::synthetic::{BROWN4, World};

    fn seen(corners: Corners) -> Vec<Seen> {
        let at = |pose: &str| RobotPose {
            pose: pose.to_owned(),
            group: "1".to_owned(),
            role: Role::Sample,
            joints_deg: vec![0.0],
            slides: Vec::new(),
        };
        corners.pairs.into_iter().map(|pair| Seen { at: at(&pair.pair), corners: Ok(pair) }).collect()
    }

    #[test]
    fn a_pose_that_misses_the_rig_as_no_pair_did_is_of_two_moments_and_a_blurred_one_is_not() {
        let world = World::new(16, 61);
        let clean = world.corners_by_hand(61, 0.02);
        let found = calibrate(&clean, &BROWN4).unwrap();
        let known = Knowledge {
            rig: found.rig().clone(),
            noise: Some(found.own_noise),
            pair_excess: Some(pair_excess(&found)),
            farthest_pair: farthest_pair(&found),
            farthest_px: farthest_px(&found),
            volume: None,
            board: world.board,
            crossing_mm: 0.01,
            tolerance_mm: 0.05,
        };
        let apart = |known: &Knowledge, corners: &Corners| {
            let flags = Run::new(known, seen(corners.clone())).of_two_moments();
            (0..flags.len()).filter(|i| flags[*i]).collect::<Vec<usize>>()
        };
        // Every pair that calibrated is a pose.
        assert!(apart(&known, &clean).is_empty());
        let mut corners = clean.clone();
        let turn = Vector3::x() * 0.4_f64.to_radians();
        corners.pairs[3] = world.with_camera_moved(turn, Vector3::zeros()).corners(62).pairs.swap_remove(3);
        assert_eq!(apart(&known, &corners), [3]);
        // A pair that did the same and was used, and a calibration that does not say.
        for farthest_px in [Some(20.0), None] {
            assert!(apart(&Knowledge { farthest_px, ..known.clone() }, &corners).is_empty(), "{farthest_px:?}");
        }
        let blurred = World { sigma_px: 5.0, ..world };
        corners.pairs[3] = blurred.corners(63).pairs.swap_remove(3);
        assert!(apart(&known, &corners).is_empty());
    }
}
