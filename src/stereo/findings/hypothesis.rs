//! What may have happened to a rig while it was photographed: each cause as a direction of the shared numbers.

use nalgebra::{DVector, Vector3};

use crate::stereo::model::parameters::Layout;
use crate::stereo::pairs::Cause;
use crate::stereo::{Rig, Side};

/// A cause with its direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Hypothesis {
    /// The cause.
    pub cause: Cause,
    /// For a person: what changed.
    pub words: String,
    /// How the shared numbers change by one unit of it, in the layout's order.
    pub direction: DVector<f64>,
    /// The unit.
    pub unit: &'static str,
}

/// All causes of one number each.
pub fn all(layout: &Layout, rig: &Rig) -> Vec<Hypothesis> {
    let at = layout.transform_start();
    let translation = rig.right_from_left.translation.vector;
    let vector = |set: &dyn Fn(&mut DVector<f64>)| {
        let mut direction = DVector::zeros(layout.count());
        set(&mut direction);
        direction
    };
    // The right camera turns about its own centre: points in its frame turn, and with them the translation.
    let turn = |axis: Vector3<f64>| {
        let per_deg = axis * 1f64.to_radians();
        vector(&|d| {
            d.rows_mut(at, 3).copy_from(&per_deg);
            d.rows_mut(at + 3, 3).copy_from(&per_deg.cross(&translation));
        })
    };
    let focal = |sides: &[Side]| {
        vector(&|d| {
            for side in sides {
                let camera = rig.camera(*side);
                let start = layout.camera_start(*side);
                (d[start], d[start + 1]) = (0.01 * camera.fx, 0.01 * camera.fy);
            }
        })
    };
    let along = translation / translation.norm().max(f64::MIN_POSITIVE);
    let longer = vector(&|d| d.rows_mut(at + 3, 3).copy_from(&along));
    // Larger squares make everything seem nearer, the baseline too; one unit is a per cent.
    let larger = vector(&|d| d.rows_mut(at + 3, 3).copy_from(&(-0.01 * translation)));
    let shifted = |axis: usize| vector(&|d| d[at + 3 + axis] = 1.0);
    let of = |cause, words: &str, direction, unit| Hypothesis { cause, words: words.to_owned(), direction, unit };
    vec![
        of(Cause::Yaw, "the right camera turned about its vertical axis", turn(Vector3::y()), "deg"),
        of(Cause::Pitch, "the right camera turned about its horizontal axis", turn(Vector3::x()), "deg"),
        of(Cause::Roll, "the right camera turned about its line of sight", turn(Vector3::z()), "deg"),
        of(Cause::Baseline, "the baseline changed", longer, "mm"),
        of(Cause::CameraMoved, "the right camera moved along its line of sight", shifted(2), "mm"),
        of(Cause::CameraMoved, "the right camera moved up or down", shifted(1), "mm"),
        of(Cause::Focus, "the left camera's focal length changed", focal(&[Side::Left]), "%"),
        of(Cause::Focus, "the right camera's focal length changed", focal(&[Side::Right]), "%"),
        of(Cause::Focus, "both focal lengths changed", focal(&Side::BOTH), "%"),
        of(Cause::OtherBoard, "the board's squares have another size", larger, "%"),
    ]
}

/// The six directions of any other place of the right camera.
pub fn any_place(layout: &Layout) -> Vec<DVector<f64>> {
    let at = layout.transform_start();
    (0..6).map(|k| DVector::from_fn(layout.count(), |i, _| f64::from(i == at + k))).collect()
}
