//! The volume that a verdict is for: where the boards were.
//!
//! In: a calibration. Out: the part of both pictures that corners reached, a range of depth and of tilts, and lengths through it as the boards lay
//! there. Beyond it the lens is extrapolated and nothing was checked: a rig says nothing of places and directions that no board showed it.

pub mod lengths;
pub mod outline;

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::imaging::Side;
use crate::stereo::Rig;
use crate::stereo::calibrate::Calibration;
use crate::stereo::volume::outline::Hull;

/// What a verdict is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Extent {
    /// Where the boards were.
    #[default]
    Boards,
    /// What both cameras see at the boards' depths, in all directions.
    All,
    /// A box in the left camera's frame, in all directions: lowest x, y, z, then highest, mm.
    Box([f64; 6]),
}

impl std::str::FromStr for Extent {
    type Err = String;

    fn from_str(text: &str) -> Result<Extent, String> {
        if text == "all" {
            return Ok(Extent::All);
        }
        let numbers: Vec<f64> = text.split(',').filter_map(|n| n.trim().parse().ok()).collect();
        let sides: [f64; 6] = numbers
            .try_into()
            .map_err(|_| format!("`{text}` is neither `all` nor six numbers X0,Y0,Z0,X1,Y1,Z1 in mm"))?;
        let ordered = (0..3).all(|k| sides[k] < sides[k + 3]) && sides.iter().all(|v| v.is_finite());
        if ordered && sides[2] > 0.0 {
            Ok(Extent::Box(sides))
        } else {
            Err(format!("`{text}`: each of X0,Y0,Z0 must be smaller than its X1,Y1,Z1, and Z0 larger than 0"))
        }
    }
}

/// The volume, as files hold it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Volume {
    /// Outline of the corners in the left picture, px.
    pub left_px: Hull,
    /// In the right picture.
    pub right_px: Hull,
    /// Nearest and farthest corner along the left camera's axis, mm.
    pub depth_mm: [f64; 2],
    /// Tilts of the boards in the left camera's frame: about x the least and the most, about y the same, deg.
    pub tilt_deg: [f64; 4],
}

impl Volume {
    /// Where the boards of a calibration were, or what was asked for instead.
    pub fn of(calibration: &Calibration, extent: Extent) -> Volume {
        let Calibration { views, values, .. } = calibration;
        let rig = calibration.rig();
        let seen = |side: Side| Hull::of(views.iter().flat_map(|view| view.active(side).map(|o| o.px)));
        let whole = |side: Side| {
            let camera = rig.camera(side);
            let (right, below) = (f64::from(camera.width) - 1.0, f64::from(camera.height) - 1.0);
            Hull::of([(0.0, 0.0), (right, 0.0), (right, below), (0.0, below)].map(|(x, y)| nalgebra::Point2::new(x, y)))
        };
        let hull = |side: Side| if extent == Extent::Boards { seen(side) } else { whole(side) };
        let corners = views.iter().zip(&values.poses).flat_map(|(view, pose)| {
            view.active(Side::Left).map(move |o| (pose * o.board_point(&values.shared.shape_mm)).z)
        });
        let depth_mm = match extent {
            Extent::Box(sides) => [sides[2], sides[5]],
            _ => range(corners),
        };
        let normals: Vec<Vector3<f64>> = values.poses.iter().map(|pose| pose.rotation * Vector3::z()).collect();
        let about = |axis: usize| range(normals.iter().map(|n| n[axis].atan2(n.z).to_degrees()));
        let ([about_x, about_y], [about_x_most, about_y_most]) = {
            let (x, y) = (about(1), about(0));
            ([x[0], y[0]], [x[1], y[1]])
        };
        Volume {
            left_px: hull(Side::Left),
            right_px: hull(Side::Right),
            depth_mm,
            tilt_deg: [about_x, about_x_most, about_y, about_y_most],
        }
    }

    /// Whether a point in the left camera's frame lies in it.
    pub fn holds(&self, rig: &Rig, at: &Point3<f64>) -> bool {
        let [near, far] = self.depth_mm;
        let in_front = at.z > 0.0 && (rig.right_from_left * at).z > 0.0;
        if !(in_front && (near..=far).contains(&at.z)) {
            return false;
        }
        let (left, right) = rig.project(at);
        self.left_px.contains(&left) && self.right_px.contains(&right)
    }
}

fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_asked_for_is_read_or_refused() {
        assert_eq!("all".parse(), Ok(Extent::All));
        assert_eq!("-10,-20,400,10,20,500".parse(), Ok(Extent::Box([-10.0, -20.0, 400.0, 10.0, 20.0, 500.0])));
        for wrong in ["", "boards", "1,2,3", "10,-20,400,-10,20,500", "-10,-20,0,10,20,500", "a,b,c,d,e,f"] {
            assert!(wrong.parse::<Extent>().is_err(), "{wrong}");
        }
    }
}
