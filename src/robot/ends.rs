//! What stands before the first and behind the last joint's frame: constant transforms that no calibration changes.
//!
//! A drawing's base and flange need not be the frames of the Denavit-Hartenberg chain: `[base]` and `[flange]` of a robot file
//! say where they are, so that an imported chain reaches exactly the flange poses of its source.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::geometry::{Transform, rotation_vector, transform};

/// The constant transforms at both ends of a chain; the identity by default.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ends {
    /// Frame 0 of the chain in the root frame of its source.
    pub root_from_frame0: Transform,
    /// The flange in the last joint's frame.
    pub last_frame_from_flange: Transform,
}

impl Default for Ends {
    fn default() -> Ends {
        Ends { root_from_frame0: Transform::identity(), last_frame_from_flange: Transform::identity() }
    }
}

/// A transform in a robot file.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct PoseRecord {
    x_mm: f64,
    y_mm: f64,
    z_mm: f64,
    rx_rad: f64,
    ry_rad: f64,
    rz_rad: f64,
}

impl PoseRecord {
    /// The transform; `None` where a number is not finite.
    pub(super) fn transform(&self) -> Option<Transform> {
        let (t, r) =
            (Vector3::new(self.x_mm, self.y_mm, self.z_mm), Vector3::new(self.rx_rad, self.ry_rad, self.rz_rad));
        (t.iter().chain(r.iter()).all(|v| v.is_finite())).then(|| transform(r, t))
    }

    /// As it stands in the file; nothing for the identity.
    pub(super) fn of(a_from_b: &Transform) -> Option<PoseRecord> {
        if *a_from_b == Transform::identity() {
            return None;
        }
        let (t, r) = (a_from_b.translation.vector, rotation_vector(a_from_b));
        Some(PoseRecord { x_mm: t.x, y_mm: t.y, z_mm: t.z, rx_rad: r.x, ry_rad: r.y, rz_rad: r.z })
    }
}
