//! What may have happened to a rig while it was photographed: each cause as a direction of the shared numbers.

use nalgebra::{DVector, Vector3};

use crate::stereo::model::Layout;
use crate::stereo::pairs::Cause;
use crate::stereo::{Rig, Side};

#[derive(Debug, Clone, PartialEq)]
pub struct Hypothesis {
    pub cause: Cause,
    /// For a person: what changed.
    pub words: &'static str,
    /// How the shared numbers change by one unit of it, in the layout's order.
    pub direction: DVector<f64>,
    pub unit: &'static str,
}

/// All causes of one number each.
pub fn all(layout: &Layout, rig: &Rig) -> Vec<Hypothesis> {
    let translation = rig.right_from_left.translation.vector;
    let [about_x, about_y, about_z] = any_axis(layout, rig);
    let focal = |sides: &[Side]| refocused(layout, rig, sides, 0.01);
    let longer = moved(layout, translation / translation.norm().max(f64::MIN_POSITIVE));
    // Larger squares make everything seem nearer, the baseline too; one unit is a per cent.
    let larger = moved(layout, -0.01 * translation);
    let of = |cause, words, direction, unit| Hypothesis { cause, words, direction, unit };
    vec![
        of(Cause::Yaw, "the right camera turned about its vertical axis", about_y, "deg"),
        of(Cause::Pitch, "the right camera turned about its horizontal axis", about_x, "deg"),
        of(Cause::Roll, "the right camera turned about its line of sight", about_z, "deg"),
        of(Cause::Baseline, "the baseline changed", longer, "mm"),
        of(Cause::CameraMoved, "the right camera moved along its line of sight", moved(layout, Vector3::z()), "mm"),
        of(Cause::CameraMoved, "the right camera moved up or down", moved(layout, Vector3::y()), "mm"),
        of(Cause::Focus, "the left camera's focal length changed", focal(&[Side::Left]), "%"),
        of(Cause::Focus, "the right camera's focal length changed", focal(&[Side::Right]), "%"),
        of(Cause::Focus, "both focal lengths changed", focal(&Side::BOTH), "%"),
        of(Cause::OtherBoard, "the board's squares have another size", larger, "%"),
    ]
}

/// The right camera turns about its own centre, by a rotation vector, rad: points in its frame turn, and with them the
/// translation.
pub fn turned(layout: &Layout, rig: &Rig, about: Vector3<f64>) -> DVector<f64> {
    let mut direction = moved(layout, about.cross(&rig.right_from_left.translation.vector));
    direction.rows_mut(layout.transform_start(), 3).copy_from(&about);
    direction
}

/// The right camera is pushed by so much in its own frame, mm.
pub fn moved(layout: &Layout, way_mm: Vector3<f64>) -> DVector<f64> {
    let mut direction = DVector::zeros(layout.count());
    direction.rows_mut(layout.transform_start() + 3, 3).copy_from(&way_mm);
    direction
}

/// Focal lengths change by a share of them.
pub fn refocused(layout: &Layout, rig: &Rig, sides: &[Side], share: f64) -> DVector<f64> {
    let mut direction = DVector::zeros(layout.count());
    for side in sides {
        let (camera, start) = (rig.camera(*side), layout.camera_start(*side));
        (direction[start], direction[start + 1]) = (share * camera.fx, share * camera.fy);
    }
    direction
}

/// The two directions in which the picture of a side may lie elsewhere, by a px each.
pub fn centred(layout: &Layout, side: Side) -> [DVector<f64>; 2] {
    let at = layout.camera_start(side) + 2;
    [at, at + 1].map(|at| DVector::from_fn(layout.count(), |i, _| f64::from(i == at)))
}

/// The three directions of any turn of the right camera about its own centre, by a degree each.
pub fn any_axis(layout: &Layout, rig: &Rig) -> [DVector<f64>; 3] {
    [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| turned(layout, rig, axis * 1f64.to_radians()))
}

/// The six directions of any other place of the right camera.
pub fn any_place(layout: &Layout) -> Vec<DVector<f64>> {
    let at = layout.transform_start();
    (0..6).map(|k| DVector::from_fn(layout.count(), |i, _| f64::from(i == at + k))).collect()
}
