//! A picture that was cut out of the sensor's otherwise than those of the other pairs.
//!
//! In: a series with its rig, and a pair that misses it by far. Out: by how many px everything in one of its pictures lies beside where the others have
//! it. Method: two numbers, the centre of that picture, are fitted to the pair with its pose. A cut is by whole px, and nothing that moves in front of a
//! camera moves all corners of a tilted board by the same px. Goes wrong: a camera that turned by just as many px, which is said as well.

use nalgebra::Vector2;

use crate::imaging::Side;
use crate::stereo::init::board_pose;
use crate::stereo::model::{Layout, Shared, Values};
use crate::stereo::pairs::mixups::Series;
use crate::stereo::solve::{Priors, Problem};

pub const REMEDY: &str = "Use the pictures as the cameras wrote them, all of one cut";

/// Rounds in which the centre settles: the pose and the centre are nearly linear in each other.
const ROUNDS: usize = 6;

/// How near to whole px a cut is found, and the share of it that the corners may be off.
const WHOLE_PX: f64 = 0.1;
const BESIDE: f64 = 0.02;

/// A cut of one picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    side: Side,
    by_px: Vector2<f64>,
    turned_deg: f64,
}

impl Cut {
    pub fn statement(&self) -> String {
        let Cut { side, by_px, turned_deg } = self;
        format!(
            "its {} picture shows everything {:+.0} px across and {:+.0} px down from where those of the other pairs have it, and fits the rig then: it was cut \
             or padded otherwise, or this camera was turned by {turned_deg:.2} deg",
            side.name(),
            by_px.x,
            by_px.y
        )
    }
}

/// The cut that explains a pair, where one does: of either side the one that fits best.
pub fn find(series: &Series, i: usize) -> Option<Cut> {
    let of = |side: Side| centred(series, i, side);
    let found = Side::BOTH.into_iter().filter_map(of).min_by(|a, b| a.0.total_cmp(&b.0));
    found.filter(|(px, _)| *px <= series.limit_px).map(|(_, cut)| cut)
}

/// By how much the pair misses the rig with the centre of that picture where it fits best, px, and the cut that this is, where it is one.
fn centred(series: &Series, i: usize, side: Side) -> Option<(f64, Cut)> {
    let (view, before) = (&series.views[i], *series.shared.rig.camera(side));
    let lens = |of: Side| (of == side).then_some(before.lens);
    let layout = Layout { left: lens(Side::Left), right: lens(Side::Right), ..Layout::POSES_ONLY };
    // Behind the focal lengths.
    let at = layout.camera_start(side) + 2;
    let mut shared: Shared = series.shared.clone();
    let mut pose = board_pose::of_each_alone(&shared, view)[side.other() as usize]?;
    for _ in 0..ROUNDS {
        pose = board_pose::follow(&shared, view, pose)?;
        let values = Values { shared: shared.clone(), poses: vec![pose] };
        let alone = Problem { views: vec![view.clone()], values, priors: Priors::NONE };
        let (matrix, gradient) = alone.equations(&layout)?.blocks.first()?.reduced(0.0)?;
        let step = matrix.fixed_view::<2, 2>(at, at).try_inverse()? * gradient.fixed_rows::<2>(at);
        let camera = shared.rig.camera_mut(side);
        (camera.cx, camera.cy) = (camera.cx - step.x, camera.cy - step.y);
    }
    let after = shared.rig.camera(side);
    let by_px = Vector2::new(after.cx - before.cx, after.cy - before.cy);
    let is_whole = by_px.iter().all(|px| (px - px.round()).abs() <= WHOLE_PX);
    let turned_deg = (by_px.x / before.fx).hypot(by_px.y / before.fy).atan().to_degrees();
    let missed_px = board_pose::misfit_px(&shared, view)?.0;
    (is_whole && series.limit_px < BESIDE * by_px.norm()).then_some((missed_px, Cut { side, by_px, turned_deg }))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use crate::stereo::calibrate::calibrate;
    use crate::stereo::pairs::{Cause, DiscardedPair};
    use crate::stereo::synthetic::{BROWN4, World};

    fn left_out(world: &World, change: impl Fn(&mut crate::imaging::PairCorners)) -> DiscardedPair {
        let mut corners = world.corners(7);
        change(&mut corners.pairs[4]);
        let [pair] = &calibrate(&corners, &BROWN4).unwrap().discarded.pairs[..] else { panic!("not one") };
        pair.clone()
    }

    #[test]
    fn a_picture_that_was_cut_otherwise_is_no_board_that_moved() {
        let world = World::new(14, 7);
        for left in [false, true] {
            let pair = left_out(&world, |pair| {
                let list = if left { &mut pair.left } else { &mut pair.right };
                list.iter_mut()
                    .for_each(|corner| (corner.px.x, corner.px.y) = (corner.px.x - 30.0, corner.px.y - 20.0));
            });
            let side = if left { "left" } else { "right" };
            let said = format!("its {side} picture shows everything -30 px across and -20 px down");
            assert!(pair.reason.starts_with(&said), "{}", pair.reason);
            assert_eq!(pair.cause, Cause::Unknown);
        }
        // A board that moved across the picture by about as much.
        let mut moved = world.clone();
        moved.poses[4].translation.vector += Vector3::new(-8.0, -5.5, 0.0);
        let moved = moved.corners(7);
        let pair = left_out(&world, |pair| pair.right = moved.pairs[4].right.clone());
        assert_eq!(pair.cause, Cause::NotSimultaneous, "{}", pair.reason);
        assert!(!pair.reason.contains("cut"), "{}", pair.reason);
    }
}
