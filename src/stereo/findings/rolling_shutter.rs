//! Rows that were not taken at one moment: a board that moved in all pairs in one direction while its pictures were
//! read out.
//!
//! In: a calibration. Out: the motion that all pairs have in common, and what it does to a length. A rolling shutter
//! takes the rows of a picture one after the other: a board that moves meanwhile is seen higher, sheared, or larger
//! towards its end. At one distance a lens does the same whose focal lengths along x and y differ, but a nearer board
//! is displaced farther, and that no lens does. Method: the way of the board as three numbers beyond those of the rig
//! ([`Linear`]), an F test against the pairs' scatter, and the likelihood against what leaves much the same in
//! pictures: a board that is sheared or too wide, sensors that are skew or tilted. Goes wrong: boards that are all
//! equally far away tell nothing, nor do pairs that miss the rig so far that each camera alone tells its lens: the
//! motion is in that.

use nalgebra::{DMatrix, DVector, Matrix2, Vector2, Vector3};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::series::{Change, Linear};
use super::{FEWEST, Finding, Kind};
use crate::difference::TOLD_APART;
use crate::geometry::Transform;
use crate::imaging::Side;
use crate::stereo::calibrate::Calibration;
use crate::stereo::data::residuals::residual_px;
use crate::stereo::data::{Observation, View};
use crate::stereo::model::{Layout, Shared};
use crate::stereo::pairs::Cause;
use crate::stereo::solve::Loss;
use crate::stereo::solve::jacobian::Way;
use crate::stereo::solve::normal_equations::{self, Block};
use crate::stereo::volume::lengths::VolumeLengths;

/// Probability of five standard deviations: what a lens lacks is alike in all pairs, so that their scatter says nothing
/// of it, and makes a little of such a motion out of nothing.
const CHANCE: f64 = 5.7e-7;

/// Numbers beyond the rig's: the board's way while a picture is read out along x, y and z, mm; its own width against
/// its height and its shear; each sensor's skew and tilt towards its rows.
const NUMBERS: usize = 9;
const WAY: std::ops::Range<usize> = 0..3;

/// What else leaves much the same as the board's way does.
const OTHERS: [std::ops::Range<usize>; 2] = [3..5, 5..NUMBERS];

/// The motion that the pairs share, where there is one, and the step from the rig that is calibrated to the one without
/// it.
pub fn look(
    calibration: &Calibration,
    lengths: impl Fn(&Calibration) -> VolumeLengths,
) -> Option<(Finding, DVector<f64>)> {
    let (problem, layout) = (calibration.problem(), &calibration.layout);
    let (pairs, known) = (problem.views.len(), layout.count());
    if pairs < FEWEST || known == 0 {
        return None;
    }
    let shared = &problem.values.shared;
    let equations = problem.equations(layout)?;
    let blocks = problem.views.iter().zip(&problem.values.poses).zip(equations.blocks);
    let beyond = |((view, pose), block)| extended((shared, layout), block, view, pose);
    let blocks = blocks.map(beyond).collect::<Option<Vec<Block>>>()?;
    let linear = Linear::of(&blocks, &equations.prior.matrix, &problem)?;
    let direction = |k: usize| DVector::from_fn(known + NUMBERS, |i, _| f64::from(i == known + k));
    let change =
        |numbers: std::ops::Range<usize>| linear.change(&numbers.map(direction).collect::<Vec<_>>(), &vec![1.0; pairs]);
    let way = change(WAY)?;
    let freedom = (WAY.len() * (pairs - 2)) as f64;
    let f = way.gain / WAY.len() as f64 / way.scatter.max(1.0);
    let others: Vec<Change> = OTHERS.into_iter().filter_map(change).collect();
    // The scatter of the one that explains most is what the others are judged by.
    let scatter = others.iter().map(|c| c.scatter).fold(way.scatter, f64::min).max(1.0);
    let evidence = |c: &Change| 0.5 * (c.gain / scatter - c.amounts.len() as f64 * (pairs as f64).ln());
    let told_apart = others.iter().all(|other| evidence(&way) - evidence(other) > TOLD_APART);
    if !told_apart || FisherSnedecor::new(WAY.len() as f64, freedom).map_or(1.0, |d| d.sf(f)) >= CHANCE {
        return None;
    }
    let step = -way.common.rows(0, known);
    let effect_mm = lengths(calibration).most_changed_mm(layout, &step);
    Some((finding(calibration, &Vector3::from_column_slice(way.amounts.as_slice()), effect_mm), step))
}

fn finding(calibration: &Calibration, way_mm: &Vector3<f64>, effect_mm: f64) -> Finding {
    let size_mm = way_mm.norm();
    Finding {
        cause: Cause::NotSimultaneous.word().to_owned(),
        kind: Kind::Pair,
        pairs: calibration.pair_names(),
        size: Some(size_mm),
        unit: "mm",
        effect_mm: Some(effect_mm),
        action: format!(
            "the rows of a picture were not taken at one moment (rolling shutter): while it was read out the board moved by {size_mm:.3} mm, in all \
             pairs by about {:.3} mm to the right, {:.3} mm down and {:.3} mm away, which moves a length by up to {effect_mm:.4} mm",
            way_mm.x, way_mm.y, way_mm.z
        ),
        remedy: Some(
            "hold the board still while the pictures are taken, or take cameras with a global shutter".to_owned(),
        ),
        ..Finding::default()
    }
}

/// A pair's share of the normal equations with the numbers beyond the rig's behind the shared ones. `None` where a
/// corner lies behind its camera.
fn extended((shared, layout): (&Shared, &Layout), block: Block, view: &View, pose: &Transform) -> Option<Block> {
    let known = block.shared_gradient.len();
    let size = known + NUMBERS;
    let by_number: Vec<[Vector2<f64>; NUMBERS]> =
        view.observations.iter().map(|o| by_number(shared, pose, o)).collect::<Option<_>>()?;
    let mut all = Block {
        shared: DMatrix::zeros(size, size),
        mixed: DMatrix::zeros(size, 6),
        shared_gradient: block.shared_gradient.clone().resize_vertically(size, 0.0),
        ..block.clone()
    };
    all.shared.view_mut((0, 0), (known, known)).copy_from(&block.shared);
    all.mixed.rows_mut(0, known).copy_from(&block.mixed);
    for k in 0..NUMBERS {
        // What a unit of it does to the gradients of all others.
        let mut moved = view.clone();
        moved.observations.iter_mut().zip(&by_number).for_each(|(o, by)| o.px -= by[k]);
        let moved = normal_equations::block(shared, layout, pose, &moved, Loss::Squared)?;
        let by_shared = moved.shared_gradient - &block.shared_gradient;
        all.shared.view_mut((known + k, 0), (1, known)).copy_from(&by_shared.transpose());
        all.shared.view_mut((0, known + k), (known, 1)).copy_from(&by_shared);
        all.mixed.row_mut(known + k).copy_from(&(moved.pose_gradient - block.pose_gradient).transpose());
    }
    for (o, by) in view.observations.iter().zip(&by_number).filter(|(o, _)| o.active) {
        let by = by.map(|by| o.whiten(by));
        let left = o.whiten(residual_px(shared, pose, o)?);
        for i in 0..NUMBERS {
            all.shared_gradient[known + i] += by[i].dot(&left);
            (0..NUMBERS).for_each(|j| all.shared[(known + i, known + j)] += by[i].dot(&by[j]));
        }
    }
    Some(all)
}

/// How far a unit of each of the numbers moves a corner in its picture, px.
fn by_number(shared: &Shared, pose: &Transform, o: &Observation) -> Option<[Vector2<f64>; NUMBERS]> {
    let bare = Observation { whitener: Matrix2::identity(), ..*o };
    let way = Way::new(&shared.rig, pose, o.side);
    let predicted = way.predict(&o.board_point(&shared.shape_mm), &bare)?;
    let camera = shared.rig.camera(o.side);
    // From the middle row on, in pictures.
    let late = (o.px.y + 0.5) / f64::from(camera.height) - 0.5;
    let on_board = way.by_board(&predicted);
    let (right, down) = ((o.px.x - camera.cx) / camera.fx, (o.px.y - camera.cy) / camera.fy);
    let mut by = [Vector2::zeros(); NUMBERS];
    for k in WAY {
        by[k] = predicted.by_left.column(k) * late;
    }
    by[3] = on_board.column(0) * (0.5 * o.board_mm.x) - on_board.column(1) * (0.5 * o.board_mm.y);
    by[4] = on_board.column(0) * o.board_mm.y;
    let own = if o.side == Side::Left { 5 } else { 7 };
    by[own] = Vector2::new(camera.fx * down, 0.0);
    by[own + 1] = Vector2::new(camera.fx * right, camera.fy * down) * down;
    Some(by)
}
