//! The rig of one moment of a series over which it drifted, as if it had stood still.
//!
//! In: a calibration from all pairs, their corners, and the drift that was found. Out: the calibration of the same
//! corners, each moved by what the drift did to it since that moment. Without this the drift would count as scatter of
//! the pairs, although it is known, and the rig's covariance would be several times too large. The corners of the
//! result are those that were seen, and the boards lie as the rig sees them: neither residuals nor what is held out are
//! smoothed by the finding. Goes wrong: pairs that are chosen otherwise without the drift; then there is no result.

use nalgebra::{Point2, Vector2};

use crate::imaging::{Corner, Corners, Side};
use crate::stereo::calibrate::{Calibration, calibrate};
use crate::stereo::data::residuals::residual_px;
use crate::stereo::findings::Along;
use crate::stereo::init::board_pose;
use crate::stereo::select::options::Options;

/// The rig at a share of the drift; its lens may have fewer terms, where some only took up the drift. `None` where the
/// same pairs are not the choice for it.
pub fn at_share(
    found: &Calibration,
    corners: &Corners,
    options: &Options,
    along: &Along,
    share: f64,
) -> Option<Calibration> {
    let mut moved = corners.clone();
    let mut shifts: Vec<Vec<Shift>> = Vec::new();
    for (i, view) in found.views.iter().enumerate() {
        let shared = |share: f64| found.layout.step(&found.values.shared, along.to(share).as_slice());
        let (own, common) = (shared(along.by_pair[i]), shared(share));
        let pose = board_pose::follow(&own, view, found.values.poses[i])?;
        let of_corner = |o| {
            let by: Vector2<f64> = residual_px(&common, &pose, o)? - residual_px(&own, &pose, o)?;
            Some(Shift { side: o.side, seen: o.px, moved: o.px + by })
        };
        let of_pair = view.observations.iter().map(of_corner).collect::<Option<Vec<Shift>>>()?;
        let pair = moved.pairs.iter_mut().find(|pair| pair.pair == view.pair)?;
        move_corners(&mut pair.left, Side::Left, &of_pair);
        move_corners(&mut pair.right, Side::Right, &of_pair);
        shifts.push(of_pair);
    }
    let mut still = calibrate(&moved, options).ok()?;
    if still.pair_names() != found.pair_names() {
        return None;
    }
    for ((view, shifts), pose) in still.views.iter_mut().zip(&shifts).zip(&mut still.values.poses) {
        for o in &mut view.observations {
            let shift = shifts.iter().find(|shift| shift.side == o.side && shift.moved == o.px)?;
            o.px = shift.seen;
        }
        // The board's place takes up what it can of the drift, as it does where this rig measures.
        *pose = board_pose::follow(&still.values.shared, view, *pose)?;
    }
    let Calibration { alone_px, skipped, discarded, standing, .. } = found.clone();
    Some(Calibration { alone_px, skipped, discarded, standing, ..still })
}

/// A corner where it was seen, and where it would have been seen at the moment.
struct Shift {
    side: Side,
    seen: Point2<f64>,
    moved: Point2<f64>,
}

fn move_corners(corners: &mut [Corner], side: Side, shifts: &[Shift]) {
    for corner in corners {
        if let Some(shift) = shifts.iter().find(|shift| shift.side == side && shift.seen == corner.px) {
            corner.px = shift.moved;
        }
    }
}
