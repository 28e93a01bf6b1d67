//! What poses leave on a rig whose right camera stands anywhere else.

use crate::geometry::Transform;
use crate::statistics::median;
use crate::stereo::board_pose::start::Start;
use crate::stereo::data::View;
use crate::stereo::data::residuals::rms_px;
use crate::stereo::model::board_shape::FLAT;
use crate::stereo::model::{Layout, Shared, Values};
use crate::stereo::solve::{Priors, Problem};
use crate::stereo::{Rig, Side};

/// Fewest poses: two hardly contradict any place.
const FEWEST: usize = 3;

/// Median over the poses of the root mean square length of what is left in the worse picture, px. `None` of too few
/// poses.
pub(in crate::stereo::board_pose) fn misfit_px(rig: &Rig, views: &[View], starts: &[Start]) -> Option<f64> {
    const PLACE: Layout = Layout { left: None, right: None, transform: true, shape: false };
    let with_pose = views.iter().zip(starts).filter_map(|(view, start)| Some((view.clone(), start.pose?)));
    let (views, poses): (Vec<View>, Vec<_>) = with_pose.unzip();
    if views.len() < FEWEST {
        return None;
    }
    let shared = Shared { rig: rig.clone(), shape_mm: FLAT };
    let mut found = Problem { views, values: Values { shared, poses }, priors: Priors::NONE };
    found.search_roughly(&PLACE)?;
    let Values { shared, poses } = &found.values;
    let left = |(view, pose): (&View, &Transform)| {
        let each = Side::BOTH.into_iter().filter_map(|side| rms_px(shared, pose, view, side));
        each.reduce(f64::max)
    };
    median(found.views.iter().zip(poses).filter_map(left))
}
