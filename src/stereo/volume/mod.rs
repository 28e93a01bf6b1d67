//! The volume that a verdict is for: where the boards were.
//!
//! In: a calibration. Out: the part of both pictures that corners reached, a range of depth and of tilts, and lengths
//! through it as the boards lay there. Beyond it the lens is extrapolated and nothing was checked: a rig says nothing
//! of places and directions that no board showed it.

pub mod lengths;
pub mod outline;

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::imaging::Side;
use crate::stereo::Rig;
use crate::stereo::calibrate::Calibration;
use crate::stereo::data::View;
use crate::stereo::model::Values;
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

impl Extent {
    /// What it holds, for a person.
    pub fn said(self) -> String {
        match self {
            Extent::Boards => "the volume where the boards were and in the directions that they took there".to_owned(),
            Extent::All => "all that both cameras see at the boards' depths, in all directions".to_owned(),
            Extent::Box([x0, y0, z0, x1, y1, z1]) => {
                format!("the box from {x0}, {y0}, {z0} to {x1}, {y1}, {z1} mm, in all directions")
            }
        }
    }
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
    /// Where boards were, by their poses.
    pub fn of_boards(values: &Values, views: &[View]) -> Volume {
        let seen = |side: Side| Hull::of(views.iter().flat_map(|view| view.active(side).map(|o| o.px)));
        Volume {
            left_px: seen(Side::Left),
            right_px: seen(Side::Right),
            depth_mm: range(views.iter().zip(&values.poses).flat_map(|(view, pose)| {
                view.active(Side::Left).map(move |o| (pose * o.board_point(&values.shared.shape_mm)).z)
            })),
            tilt_deg: tilts_deg(values),
        }
    }

    /// Where the boards of a calibration were, or what was asked for instead.
    pub fn of(calibration: &Calibration, extent: Extent) -> Volume {
        let Calibration { views, values, .. } = calibration;
        let rig = calibration.rig();
        let boards = Volume::of_boards(values, views);
        let whole = |side: Side| {
            let camera = rig.camera(side);
            let (right, below) = (f64::from(camera.width) - 1.0, f64::from(camera.height) - 1.0);
            Hull::of([(0.0, 0.0), (right, 0.0), (right, below), (0.0, below)].map(|(x, y)| nalgebra::Point2::new(x, y)))
        };
        let depth_mm = match extent {
            Extent::Boards => return boards,
            Extent::All => boards.depth_mm,
            Extent::Box([_, _, near, _, _, far]) => [near, far],
        };
        Volume { left_px: whole(Side::Left), right_px: whole(Side::Right), depth_mm, ..boards }
    }

    /// The box in the left camera's frame that holds its left outline at its depths, mm: lowest and highest corner.
    pub fn bounding_box_mm(&self, rig: &Rig) -> [Vector3<f64>; 2] {
        let rays = self.left_px.corners().iter().filter_map(|px| rig.left.undistort(px));
        bounds(rays.flat_map(|ray| self.depth_mm.map(|z| Vector3::new(ray.x * z, ray.y * z, z))))
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

/// Tilts of the boards in the left camera's frame, deg: about x the least and the most, about y the same.
pub fn tilts_deg(values: &Values) -> [f64; 4] {
    let normals: Vec<Vector3<f64>> = values.poses.iter().map(|pose| pose.rotation * Vector3::z()).collect();
    let about = |axis: usize| range(normals.iter().map(|n| n[axis].atan2(n.z).to_degrees()));
    let ([x_least, x_most], [y_least, y_most]) = (about(1), about(0));
    [x_least, x_most, y_least, y_most]
}

/// The least and the largest.
pub fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
}

/// Lowest and highest corner of the box about some points.
fn bounds(points: impl Iterator<Item = Vector3<f64>>) -> [Vector3<f64>; 2] {
    let none = [Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)];
    points.fold(none, |[low, high], p| [low.inf(&p), high.sup(&p)])
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
