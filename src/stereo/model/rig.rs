//! Two cameras and where they stand to each other.

use nalgebra::{DMatrix, Point2, Point3};

use crate::geometry::Transform;
use crate::imaging::{Corners, Side};
use crate::stereo::{Camera, Error, Lens};

/// A calibrated pair of cameras.
#[derive(Debug, Clone, PartialEq)]
pub struct Rig {
    /// The left camera, the reference frame of every point.
    pub left: Camera,
    /// The right camera.
    pub right: Camera,
    /// Maps the left camera's frame to the right camera's.
    pub right_from_left: Transform,
    /// Joint covariance of the rig's parameters, where known.
    pub covariance: Option<Covariance>,
}

impl Camera {
    /// Pictures of this side that have another size (px) than the camera's.
    pub fn check_picture_size(&self, side: Side, (found_width, found_height): (u32, u32)) -> Result<(), Error> {
        let Camera { width, height, .. } = *self;
        if (found_width, found_height) == (width, height) {
            return Ok(());
        }
        Err(Error::PictureSize { side, found_width, found_height, width, height })
    }
}

/// A covariance matrix with names: `left.fx`, `right.k1`, `right_from_left.rx_rad`, ...
#[derive(Debug, Clone, PartialEq)]
pub struct Covariance {
    /// Names of rows and columns.
    pub order: Vec<String>,
    /// The matrix, in the squares of the parameters' units.
    pub matrix: DMatrix<f64>,
}

impl Covariance {
    /// That of some numbers, in their order. `None` where one of them is not in it.
    pub fn part(&self, names: &[impl AsRef<str>]) -> Option<DMatrix<f64>> {
        let place = |name: &str| self.order.iter().position(|own| own == name);
        let places = names.iter().map(|name| place(name.as_ref())).collect::<Option<Vec<usize>>>()?;
        Some(DMatrix::from_fn(places.len(), places.len(), |i, j| self.matrix[(places[i], places[j])]))
    }
}

impl Rig {
    /// The camera of a side.
    pub fn camera(&self, side: Side) -> &Camera {
        match side {
            Side::Left => &self.left,
            Side::Right => &self.right,
        }
    }

    /// The same, to be changed.
    pub fn camera_mut(&mut self, side: Side) -> &mut Camera {
        match side {
            Side::Left => &mut self.left,
            Side::Right => &mut self.right,
        }
    }

    /// Whether a plate of these half sides (mm), in its own x-y plane, is wholly inside both pictures; `border` is what
    /// stays clear at the edge, as a share of a picture's width.
    pub fn sees_plate(&self, left_from_plate: &Transform, (w, h): (f64, f64), border: f64) -> bool {
        [(-w, -h), (w, -h), (w, h), (-w, h)].iter().all(|&(x, y)| {
            let point = left_from_plate * Point3::new(x, y, 0.0);
            if point.z <= 0.0 || (self.right_from_left * point).z <= 0.0 {
                return false;
            }
            let (left, right) = self.project(&point);
            [(left, &self.left), (right, &self.right)].iter().all(|(px, camera)| {
                let (width, height) = (f64::from(camera.width), f64::from(camera.height));
                let border = border * width;
                px.x > border && px.x < width - 1.0 - border && px.y > border && px.y < height - 1.0 - border
            })
        })
    }

    /// Distance of the two cameras' centres, mm.
    pub fn baseline_mm(&self) -> f64 {
        self.right_from_left.translation.vector.norm()
    }

    /// What is unusual in the rig and may be meant, for a person.
    pub fn unusual(&self) -> Vec<String> {
        self.unusual_place().into_iter().chain(self.unusual_tilt()).chain(self.unusual_centre()).collect()
    }

    /// What is unusual in how the cameras stand, where something is: the left one on the right side, or one rolled
    /// against the other. Both may be meant, and no residual tells: a rig whose folders are exchanged, or with all
    /// pictures of one side turned, is a rig.
    fn unusual_place(&self) -> Option<String> {
        let rotation = crate::geometry::rotation_matrix(&self.right_from_left);
        let roll_deg = rotation[(1, 0)].atan2(rotation[(1, 1)]).to_degrees();
        if roll_deg.abs() > 45.0 {
            return Some(format!(
                "the right camera is rolled by {:.0} degrees against the left one: were the pictures of one side turned? \
                 Use the files as the cameras wrote them; if the cameras stand so, all is well",
                roll_deg.abs()
            ));
        }
        let right_mm = self.right_from_left.inverse().translation.vector;
        (self.is_left_to_the_left() == Some(false)).then(|| {
            format!(
                "the left camera stands {:.1} mm to the right of the right one: are left and right exchanged, are the pictures of both cameras \
                 mirrored as webcams show them, or do both hang upside down? Exchange the folders in the first case; in the second take \
                 pictures in which writing can be read, for mirrored ones give mirrored (left-handed) coordinates; of a rig that hangs, or \
                 of cameras that are only named so, all is well",
                -right_mm.x
            )
        })
    }

    /// Whether the left camera stands to the left of the right one, as it sees that; `None` of cameras one above the
    /// other, or one behind the other, of which neither is the left one, and where one is upside down.
    pub fn is_left_to_the_left(&self) -> Option<bool> {
        let right_mm = self.right_from_left.inverse().translation.vector;
        let is_upright = crate::geometry::rotation_matrix(&self.right_from_left)[(1, 1)] > 0.0;
        (is_upright && right_mm.x.abs() > right_mm.y.abs().max(right_mm.z.abs())).then_some(right_mm.x > 0.0)
    }

    /// A principal point far from the picture's middle, where lenses have it.
    fn unusual_centre(&self) -> Option<String> {
        /// A share of the picture's width and height.
        const MOST_OFF: f64 = 0.25;
        let off = |centre: f64, size: u32| (centre / f64::from(size) - 0.5).abs() > MOST_OFF;
        let is_off = |camera: &Camera| off(camera.cx, camera.width) || off(camera.cy, camera.height);
        let side = Side::BOTH.into_iter().find(|side| is_off(self.camera(*side)))?;
        let Camera { cx, cy, width, height, .. } = self.camera(side);
        Some(format!(
            "the {} camera's principal point comes out at ({cx:.0}, {cy:.0}) of {width}x{height} px: either its pictures are cut out of larger ones, or \
             the views do not tell it: tilt the board more",
            side.name()
        ))
    }

    /// A sensor that is tilted by more than sensors are that are not meant to be. Where a lens bends little, a tilt is
    /// exchanged for the picture's centre and the camera's axis: then lengths hold, and neither of the three is what a
    /// person could measure on the camera.
    fn unusual_tilt(&self) -> Option<String> {
        const MOST_DEG: f64 = 3.0;
        let tilt_deg = |side: Side| {
            let camera = self.camera(side);
            let [x, y] = [camera.distortion[12], camera.distortion[13]];
            if camera.lens == Lens::Tilted14 { x.hypot(y).to_degrees() } else { 0.0 }
        };
        let side = Side::BOTH.into_iter().find(|side| tilt_deg(*side) > MOST_DEG)?;
        Some(format!(
            "the {} camera's sensor comes out tilted by {:.1} deg, more than sensors are unless they are meant to be: centres and axes of these cameras \
             may not be theirs; `--lens brown5` calibrates without a tilt: compare its held-out lengths with these",
            side.name(),
            tilt_deg(side)
        ))
    }

    /// Pictures of another size than the calibration's were binned, cut or taken by other cameras.
    pub fn check_size(&self, corners: &Corners) -> Result<(), Error> {
        self.left.check_picture_size(Side::Left, corners.left_size)?;
        self.right.check_picture_size(Side::Right, corners.right_size)
    }

    /// Raw picture points, left and right, of a point in the left camera's frame, px.
    pub fn project(&self, point_mm: &Point3<f64>) -> (Point2<f64>, Point2<f64>) {
        (self.left.project(point_mm), self.right.project(&(self.right_from_left * point_mm)))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::geometry::transform;

    fn unusual(turn: Vector3<f64>, right_mm: Vector3<f64>) -> Option<String> {
        let camera = Camera::pinhole(640, 480, 800.0);
        let left_from_right = transform(turn, right_mm);
        Rig { left: camera, right: camera, right_from_left: left_from_right.inverse(), covariance: None }
            .unusual()
            .pop()
    }

    #[test]
    fn a_sensor_that_is_tilted_by_degrees_is_unusual() {
        let mut camera = Camera::pinhole(640, 480, 500.0);
        camera.distortion[13] = 4f64.to_radians();
        let rig = |right: Camera| Rig {
            left: Camera::pinhole(640, 480, 500.0),
            right,
            right_from_left: transform(Vector3::zeros(), Vector3::new(-120.0, 0.0, 0.0)),
            covariance: None,
        };
        assert!(rig(camera).unusual().is_empty());
        camera.lens = Lens::Tilted14;
        assert!(rig(camera).unusual()[0].contains("right camera's sensor comes out tilted by 4.0 deg"));
        camera.distortion[13] = 1f64.to_radians();
        assert!(rig(camera).unusual().is_empty());
    }

    #[test]
    fn exchanged_and_rolled_rigs_are_said_and_others_are_not() {
        let inward = Vector3::new(0.02, -0.6, 0.05);
        assert_eq!(unusual(inward, Vector3::new(200.0, 5.0, 60.0)), None);
        assert!(unusual(-inward, Vector3::new(-200.0, 5.0, 60.0)).is_some_and(|w| w.contains("exchanged")));
        // One above the other, and one that looks over the other's shoulder.
        assert_eq!(unusual(Vector3::zeros(), Vector3::new(-20.0, 90.0, 0.0)), None);
        assert_eq!(unusual(Vector3::zeros(), Vector3::new(-20.0, 0.0, -90.0)), None);
        for roll in [1.6, -1.5, 3.1] {
            let rolled = unusual(Vector3::new(0.0, 0.0, roll), Vector3::new(-200.0, 0.0, 0.0));
            assert!(rolled.is_some_and(|w| w.contains("rolled")));
        }
    }
}
