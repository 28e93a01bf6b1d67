//! Outlines of flat or curved shapes as a camera with lens distortion sees them.
//!
//! In: corners of a shape and the surface they lie on. Out: a closed chain of short straight pieces in raw pixels, fine
//! enough that no piece leaves the true curve by more than 5e-5 px.

use nalgebra::{Point2, Point3};

use crate::stereo::Camera;

/// How far a straight piece may be from the curve it stands for, px: well under what the tests of the renderer see
/// (1e-4 px).
const SAGITTA_PX: f64 = 5e-5;

/// Halvings of one edge at most; 1024 pieces bend any edge that crosses a picture.
const MAX_DEPTH: u32 = 10;

/// Nearest a point may come to the camera, mm; a shape that comes nearer is left out.
const NEAREST_MM: f64 = 1.0;

/// A closed chain of points in a picture, clockwise on the screen.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    pub points: Vec<Point2<f64>>,
    /// Smallest x and y, px.
    pub low: Point2<f64>,
    /// Largest x and y, px.
    pub high: Point2<f64>,
    /// 1 to add its area, -1 to take it away.
    pub sign: f64,
}

/// Projects the closed shape with the given `corners` (in the shape's own plane, mm). `in_camera` maps a place in that
/// plane to the camera's frame, mm. `None` when part of the shape is behind the camera.
pub fn project(
    camera: &Camera,
    corners: &[Point2<f64>],
    in_camera: &dyn Fn(Point2<f64>) -> Point3<f64>,
) -> Option<Outline> {
    let image = |p: Point2<f64>| {
        let q = in_camera(p);
        (q.z >= NEAREST_MM).then(|| camera.project(&q))
    };
    let mut points = Vec::with_capacity(corners.len() * 8);
    for (k, &a) in corners.iter().enumerate() {
        let b = corners[(k + 1) % corners.len()];
        let (at_a, at_b) = (image(a)?, image(b)?);
        points.push(at_a);
        bend(&image, (a, at_a), (b, at_b), 0, &mut points)?;
    }
    if points.iter().any(|p| !(p.x.is_finite() && p.y.is_finite())) {
        return None;
    }
    let doubled_area: f64 = points.iter().zip(points.iter().cycle().skip(1)).map(|(a, b)| a.x * b.y - b.x * a.y).sum();
    if doubled_area < 0.0 {
        points.reverse();
    }
    let low = points.iter().fold(Point2::new(f64::MAX, f64::MAX), |m, p| Point2::new(m.x.min(p.x), m.y.min(p.y)));
    let high = points.iter().fold(Point2::new(f64::MIN, f64::MIN), |m, p| Point2::new(m.x.max(p.x), m.y.max(p.y)));
    Some(Outline { points, low, high, sign: 1.0 })
}

type Placed = (Point2<f64>, Point2<f64>);

/// Adds the points between two ends (place, image) until the pieces are straight.
fn bend(
    image: &dyn Fn(Point2<f64>) -> Option<Point2<f64>>,
    from: Placed,
    to: Placed,
    depth: u32,
    points: &mut Vec<Point2<f64>>,
) -> Option<()> {
    let middle = nalgebra::center(&from.0, &to.0);
    let at_middle = image(middle)?;
    let chord = to.1 - from.1;
    let to_middle = at_middle - from.1;
    let off = (chord.x * to_middle.y - chord.y * to_middle.x).abs() / chord.norm().max(1e-9);
    // An S-shaped edge has its middle on the chord: the first halving is always made.
    if (off <= SAGITTA_PX && depth > 0) || depth == MAX_DEPTH {
        return Some(());
    }
    bend(image, from, (middle, at_middle), depth + 1, points)?;
    points.push(at_middle);
    bend(image, (middle, at_middle), to, depth + 1, points)
}

impl Outline {
    /// True where a picture point lies inside (crossings of a ray to the right).
    pub fn contains(&self, px: &Point2<f64>) -> bool {
        if px.x < self.low.x || px.x > self.high.x || px.y < self.low.y || px.y > self.high.y {
            return false;
        }
        let mut inside = false;
        for (a, b) in self.points.iter().zip(self.points.iter().cycle().skip(1)) {
            if (a.y > px.y) != (b.y > px.y) && px.x < a.x + (px.y - a.y) / (b.y - a.y) * (b.x - a.x) {
                inside = !inside;
            }
        }
        inside
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_stay_on_the_curve_of_a_distorting_lens() {
        let mut camera = Camera::pinhole(1280, 1280, 2500.0);
        camera.distortion[0] = -0.3;
        let lift = |p: Point2<f64>| Point3::new(p.x, p.y, 525.0);
        let corners =
            [(-120.0, -120.0), (120.0, -120.0), (120.0, 120.0), (-120.0, 120.0)].map(|(x, y)| Point2::new(x, y));
        let outline = project(&camera, &corners, &lift).unwrap();
        for (a, b) in outline.points.iter().zip(outline.points.iter().cycle().skip(1)) {
            let ray = camera.undistort(&nalgebra::center(a, b)).unwrap();
            let across = (ray.x.abs().max(ray.y.abs()) * 525.0 - 120.0).abs();
            assert!(across * 2500.0 / 525.0 < 2.0 * SAGITTA_PX, "{across}");
        }
        assert!(outline.contains(&Point2::new(100.0, 640.0)) && !outline.contains(&Point2::new(-100.0, 640.0)));
    }

    #[test]
    fn a_shape_behind_the_camera_is_left_out() {
        let camera = Camera::pinhole(100, 100, 100.0);
        let corners = [Point2::new(0.0, 0.0), Point2::new(1.0, 0.0), Point2::new(1.0, 9.0)];
        assert_eq!(project(&camera, &corners, &|p| Point3::new(p.x, 0.0, 5.0 - p.y)), None);
    }
}
