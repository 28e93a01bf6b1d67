//! One pose with everything shared held: the poses that the bundle did without, and the figures of those that it had.

use nalgebra::Vector2;

use crate::geometry::{Transform, perturb};
use crate::stereo::board_pose::solve::bundle::Promise;
use crate::stereo::board_pose::solve::estimate::{Estimate, leave_outliers_out};
use crate::stereo::board_pose::solve::pose_block::{Eliminated, PoseBlock, PoseSums, Scene};
use crate::stereo::board_pose::start::enough;
use crate::stereo::data::residuals::root_mean_square;
use crate::stereo::data::{Observation, View};
use crate::stereo::solve::Loss;
use crate::stereo::triangulate::{common, triangulate};

/// Steps of the search; the start is within a pixel.
const STEPS: usize = 20;

/// Rounds of leaving outliers out.
const ROUNDS: usize = 3;

/// The shared values as a pose sees them.
pub struct Known<'a> {
    scene: Scene<'a>,
    found: &'a Estimate<'a>,
}

pub struct Alone {
    /// `left_from_board`.
    pub pose: Transform,
    /// Its corners; outliers are inactive.
    pub view: View,
    /// Its part of the normal equations.
    pub part: Eliminated,
    /// Chi-square of the active corners over its degrees of freedom.
    pub chi_square: f64,
    pub freedom: f64,
    /// Root mean square of the length of the 2-D residuals, px.
    pub rms_px: f64,
    /// Root mean square distance of the triangulated corners from the target, mm; `None` where no corner is in use in
    /// both pictures.
    pub fit_rms_mm: Option<f64>,
}

impl<'a> Known<'a> {
    pub fn new(found: &'a Estimate<'_>) -> Known<'a> {
        Known { scene: found.bundle.scene(&found.values), found }
    }

    /// Fits a pose. The whiteners are the estimate's. `None` where the corners do not determine it or most of them are
    /// outliers.
    pub fn fit(&self, view: &View, start: &Transform) -> Option<Alone> {
        let mut view = view.clone();
        view.observations.iter_mut().for_each(|o| o.active = true);
        let mut pose = self.search(&view, *start, Loss::Cauchy, Promise::ROUGH)?;
        for _ in 0..ROUNDS {
            let miss =
                |o: &Observation| Some(o.whiten(self.scene.residual(&pose, o)?).norm() * self.found.inflation.sqrt());
            leave_outliers_out(&mut view, miss, self.found.excess);
            if !enough(&view) {
                return None;
            }
            pose = self.search(&view, pose, Loss::Squared, Promise::RESULT)?;
        }
        let part = PoseBlock::of(&self.scene, &pose, &view, Loss::Squared)?.eliminate(&self.found.bundle.rig.basis)?;
        let active = view.observations.iter().filter(|o| o.active);
        let active: Vec<(&Observation, Vector2<f64>)> =
            active.filter_map(|o| Some((o, self.scene.residual(&pose, o)?))).collect();
        let freedom = 2.0 * active.len() as f64 - 6.0;
        let sum: f64 = active.iter().map(|(o, r)| o.whiten(*r).norm_squared()).sum();
        Some(Alone {
            part,
            chi_square: sum * self.found.inflation / freedom.max(1.0),
            freedom,
            rms_px: root_mean_square(active.iter().map(|(_, r)| r.norm_squared()))?,
            fit_rms_mm: fit_rms_mm(&self.scene, &view, &pose),
            pose,
            view,
        })
    }

    /// Gauss-Newton with halved steps.
    fn search(&self, view: &View, start: Transform, loss: Loss, least: Promise) -> Option<Transform> {
        let mut pose = start;
        let mut at = PoseSums::of(&self.scene, &pose, view, loss)?;
        for _ in 0..STEPS {
            let (step, promise) = at.step()?;
            let mut share = 1.0;
            let better = loop {
                let trial = perturb(&pose, (step * share).as_slice());
                match PoseSums::of(&self.scene, &trial, view, loss) {
                    Some(next) if next.cost <= at.cost => break Some((trial, next)),
                    _ if share < 1e-3 => break None,
                    _ => share *= 0.5,
                }
            };
            let Some((trial, next)) = better else { break };
            (pose, at) = (trial, next);
            if promise < least.0 {
                break;
            }
        }
        Some(pose)
    }
}

fn fit_rms_mm(scene: &Scene<'_>, view: &View, pose: &Transform) -> Option<f64> {
    root_mean_square(common(view).into_iter().filter_map(|(l, r)| {
        // Both pictures see the crossing through windows of their own.
        let seen_off_mm = 0.5 * (l.seen_off_mm + r.seen_off_mm);
        let place = pose * (scene.crossing(l) + seen_off_mm);
        Some((triangulate(&scene.rig, l, r)?.point_mm - place).norm_squared())
    }))
}
