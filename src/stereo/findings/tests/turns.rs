//! A right camera that turns about an axis that is none of its own.

use nalgebra::Vector3;

use super::{one_of, shown_by, standing};
use crate::stereo::findings::Kind;
use crate::stereo::init::board_pose;

#[test]
fn a_camera_that_sags_and_swings_at_once_is_told_by_its_turn() {
    for (w, (size_deg, axis)) in
        [(0.03_f64, [1.0, -1.0, 0.0]), (0.03, [1.0, 1.0, 0.5]), (0.06, [1.0, -1.0, 0.0])].into_iter().enumerate()
    {
        let world = one_of(w, 16, 51 + w as u64);
        let turn = Vector3::from(axis).normalize() * size_deg.to_radians();
        let mut corners = world.corners(52);
        for i in 0..16 {
            let turned = world.with_camera_moved(turn * (i as f64 / 15.0), Vector3::zeros());
            corners = shown_by(corners, &turned, 52, i..=i);
        }
        let (found, told) = standing(&corners);
        let [drift] = told.as_slice() else { panic!("{axis:?} in world {w}: {told:?}") };
        assert!(drift.cause == "camera-moved" && drift.kind == Kind::Drift, "{axis:?} in world {w}: {drift:?}");
        assert!((drift.size.unwrap() / size_deg - 1.0).abs() < 0.1, "{axis:?} in world {w}: {drift:?}");
        assert!(drift.remedy.as_deref().is_some_and(|remedy| remedy.starts_with("clamp both cameras")), "{drift:?}");
        // Each board lies as the rig of the middle sees it.
        let mut laid = found.clone();
        for (view, pose) in found.views.iter().zip(&mut laid.values.poses) {
            *pose = board_pose::follow(&found.values.shared, view, *pose).unwrap();
        }
        assert!(found.rms_px() < 1.001 * laid.rms_px(), "{} {} px in world {w}", found.rms_px(), laid.rms_px());
    }
}
