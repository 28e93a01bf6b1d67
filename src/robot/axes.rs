//! From the joints' axes in space to modified Denavit-Hartenberg parameters.
//!
//! In: each joint's axis (a line, root frame, all readings zero) and the flange's pose there, as a URDF gives them.
//! Out: a [`Robot`] with the same flange poses at all readings, whose constant transforms at both ends take what the
//! parameters can't. Method: common normals (Craig, "Introduction to Robotics"); for nearly parallel axes, whose common
//! normal runs away, the plane perpendicular to the first axis and a rotation about y (Hayati, 1983). Exact up to
//! rounding: by the product of exponentials (Brockett, 1984) the axes and the flange at zero readings say all about a
//! chain.

use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};

use super::parameters::PARALLEL_SIN;
use super::{Corrections, Ends, Joint, Robot};
use crate::geometry::{Transform, transform_from_matrix};

/// Offset of a nearly parallel axis below which its direction is left open, mm: what is dropped is far below a
/// nanometre.
const COINCIDENT_MM: f64 = 1e-11;

/// The flange's z counts as along the last axis up to this sine: a billionth of a mm at a metre.
const ALIGNED: f64 = 1e-12;

/// A joint's axis at reading zero, root frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    pub point_mm: Point3<f64>,
    /// Its direction, of unit length; the joint turns right-handed about it.
    pub direction: Vector3<f64>,
    /// Range of the reading, rad (mm where it slides), where known.
    pub limits_rad: Option<(f64, f64)>,
    /// Whether the joint slides along it instead of turning about it.
    pub slides: bool,
}

/// A frame on an axis: its z is the axis.
struct OnAxis {
    origin: Point3<f64>,
    x: Vector3<f64>,
    z: Vector3<f64>,
}

impl OnAxis {
    fn transform(&self) -> Transform {
        let y = self.z.cross(&self.x);
        transform_from_matrix(Matrix3::from_columns(&[self.x, y, self.z]), self.origin.coords)
    }

    /// Angle from this frame's x to a perpendicular of the axis, rad.
    fn angle_to(&self, x: &Vector3<f64>) -> f64 {
        self.x.cross(x).dot(&self.z).atan2(self.x.dot(x))
    }

    /// `x` or its opposite, whichever is within a right angle of this frame's x, and the factor.
    fn nearer(&self, x: Vector3<f64>) -> (Vector3<f64>, f64) {
        let sign = if self.x.dot(&x) < -1e-9 { -1.0 } else { 1.0 };
        (x * sign, sign)
    }
}

/// The robot whose joints have these axes. Gravity is taken along the root frame's -z.
pub fn robot(name: &str, axes: &[Axis], root_from_flange: &Transform) -> Robot {
    robot_with(name, axes, root_from_flange, PARALLEL_SIN)
}

/// The same with another sine up to which neighbouring axes count as parallel.
pub fn robot_with(name: &str, axes: &[Axis], root_from_flange: &Transform, parallel_sin: f64) -> Robot {
    let (root_from_frame0, mut before, mut frame) = base(axes.first());
    let mut joints = Vec::with_capacity(axes.len());
    for (axis, next) in axes.iter().zip(axes.iter().skip(1).map(Some).chain([None])) {
        frame.z = axis.direction;
        let leave = match next {
            Some(next) => leave_towards(&frame, next, parallel_sin),
            None => leave_at_flange(&frame, root_from_flange),
        };
        before.theta_rad = frame.angle_to(&leave.x) + 0.0;
        before.d_mm = (leave.origin - frame.origin).dot(&frame.z) + 0.0;
        (before.limits_rad, before.slides) = (axis.limits_rad, axis.slides);
        joints.push(before);
        (before, frame) = (leave.next, leave.arrives);
    }
    let last_frame_from_flange = clean(frame.transform().inverse() * root_from_flange);
    let corrections =
        Corrections { gravity_direction: root_from_frame0.inverse() * -Vector3::z(), ..Corrections::default() };
    let ends = Ends { root_from_frame0, last_frame_from_flange };
    let tool_mm = last_frame_from_flange.translation.vector;
    Robot { name: name.to_owned(), joints, tool_mm, corrections, ends }
}

/// The identity where only rounding stands between.
fn clean(a_from_b: Transform) -> Transform {
    let small = a_from_b.translation.vector.norm() < COINCIDENT_MM && a_from_b.rotation.angle() < ALIGNED;
    if small { Transform::identity() } else { a_from_b }
}

/// Frame 0, the link to the first joint, and its frame before its own turn. A first axis that is vertical leaves frame
/// 0 parallel to the root.
fn base(first: Option<&Axis>) -> (Transform, Joint, OnAxis) {
    let at = |origin, x| OnAxis { origin, x, z: Vector3::z() };
    let Some(axis) = first else {
        return (Transform::identity(), Joint::default(), at(Point3::origin(), Vector3::x()));
    };
    let u = axis.direction;
    if u.x == 0.0 && u.y == 0.0 {
        let origin = Point3::new(axis.point_mm.x, axis.point_mm.y, 0.0);
        let alpha_rad = if u.z > 0.0 { 0.0 } else { std::f64::consts::PI };
        let link = Joint { alpha_rad, ..Joint::default() };
        return (Transform::translation(origin.x, origin.y, 0.0), link, at(origin, Vector3::x()));
    }
    let turn = turn_from_z(&u);
    // The point of the axis nearest to the root's origin.
    let origin = axis.point_mm - u * axis.point_mm.coords.dot(&u);
    let root_from_frame0 = Transform::from_parts(origin.coords.into(), turn);
    (root_from_frame0, Joint::default(), at(origin, turn * Vector3::x()))
}

/// The shortest turn from z to a direction; by half-angle sums, which keep all digits of a small one.
fn turn_from_z(direction: &Vector3<f64>) -> UnitQuaternion<f64> {
    let half = Vector3::z().cross(direction);
    let cosine = 1.0 + direction.z;
    if cosine < 1e-6 {
        let flip = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        return turn_from_z(&-direction) * flip;
    }
    UnitQuaternion::from_quaternion(nalgebra::Quaternion::from_parts(cosine, half))
}

/// Where a joint's frame ends on its axis, the link to the next joint, and where that arrives.
struct Leave {
    origin: Point3<f64>,
    x: Vector3<f64>,
    next: Joint,
    arrives: OnAxis,
}

fn leave_towards(frame: &OnAxis, next: &Axis, parallel_sin: f64) -> Leave {
    let (u, v) = (frame.z, next.direction);
    let normal = u.cross(&v);
    let sine = normal.norm();
    if sine <= parallel_sin {
        return leave_parallel(frame, next);
    }
    let (x, sign) = frame.nearer(normal / sine);
    let apart = next.point_mm - frame.origin;
    // Feet of the common normal: frame.origin + s u and next.point + t v.
    let (along_u, along_v, cosine) = (apart.dot(&u), apart.dot(&v), u.dot(&v));
    let s = (along_u - cosine * along_v) / (sine * sine);
    let t = (cosine * along_u - along_v) / (sine * sine);
    let (origin, arrives) = (frame.origin + u * s, next.point_mm + v * t);
    let link = Joint { alpha_rad: (sign * sine).atan2(cosine), a_mm: apart.dot(&x) + 0.0, ..Joint::default() };
    Leave { origin, x, next: link, arrives: OnAxis { origin: arrives, x, z: v } }
}

/// The next axis is met in the plane perpendicular to this one, where the link before ended.
fn leave_parallel(frame: &OnAxis, next: &Axis) -> Leave {
    let (u, v) = (frame.z, next.direction);
    let t = (frame.origin - next.point_mm).dot(&u) / v.dot(&u);
    let met = next.point_mm + v * t;
    let apart = met - frame.origin;
    let length = apart.norm();
    let (x, a_mm) = if length > COINCIDENT_MM {
        let (x, sign) = frame.nearer(apart / length);
        (x, sign * length)
    } else {
        (frame.x, 0.0)
    };
    // In this frame the next axis points along (sin beta, -sin alpha cos beta, cos alpha cos beta).
    let seen = Vector3::new(v.dot(&x), v.dot(&u.cross(&x)), v.dot(&u));
    let link = Joint {
        alpha_rad: (-seen.y).atan2(seen.z) + 0.0,
        a_mm,
        beta_rad: seen.x.atan2(seen.y.hypot(seen.z)) + 0.0,
        ..Joint::default()
    };
    // x after Rx(alpha) and Ry(beta): perpendicular to the next axis, in the plane of x and that axis.
    let arrives = (x - v * x.dot(&v)).normalize();
    Leave { origin: frame.origin, x, next: link, arrives: OnAxis { origin: met, x: arrives, z: v } }
}

/// The last frame: at the flange's height on the axis, turned like the flange where both look the same way.
fn leave_at_flange(frame: &OnAxis, root_from_flange: &Transform) -> Leave {
    let flange = root_from_flange.rotation.to_rotation_matrix();
    let (x, z): (Vector3<f64>, Vector3<f64>) = (flange.matrix().column(0).into(), flange.matrix().column(2).into());
    let aligned = z.cross(&frame.z).norm() < ALIGNED && z.dot(&frame.z) > 0.0;
    let x = if aligned { (x - frame.z * x.dot(&frame.z)).normalize() } else { frame.x };
    let height = (Point3::from(root_from_flange.translation.vector) - frame.origin).dot(&frame.z);
    let origin = frame.origin + frame.z * height;
    Leave { origin, x, next: Joint::default(), arrives: OnAxis { origin, x, z: frame.z } }
}

impl Robot {
    /// Axes of the joints at reading zero, root frame: what a chain is whatever its parameters are called.
    pub fn axes(&self) -> Vec<Axis> {
        let mut root_from_joint = self.ends.root_from_frame0;
        let axis = |joint: &Joint| {
            root_from_joint *= joint.previous_from_this(0.0);
            Axis {
                point_mm: Point3::from(root_from_joint.translation.vector),
                direction: root_from_joint.rotation * Vector3::z() * joint.sign,
                limits_rad: joint.limits_rad,
                slides: joint.slides,
            }
        };
        self.joints.iter().map(axis).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::transform;
    use proptest::prelude::*;

    /// Rounding of a chain of a metre or two.
    const SAME_MM: f64 = 1e-9;
    const SAME_RAD: f64 = 1e-12;

    fn turning(point_mm: Point3<f64>, direction: Vector3<f64>) -> Axis {
        Axis { point_mm, direction, limits_rad: None, slides: false }
    }

    fn assert_same(axes: &[Axis], root_from_flange: &Transform, q: &[f64]) {
        let robot = robot("r", axes, root_from_flange);
        let mut expected = Transform::identity();
        for (axis, q) in axes.iter().zip(q) {
            let there = Transform::translation(axis.point_mm.x, axis.point_mm.y, axis.point_mm.z);
            let moved = match axis.slides {
                true => transform(Vector3::zeros(), axis.direction * (*q * 100.0)),
                false => transform(axis.direction * *q, Vector3::zeros()),
            };
            expected *= there * moved * there.inverse();
        }
        let q: Vec<f64> = axes.iter().zip(q).map(|(axis, q)| if axis.slides { 100.0 * q } else { *q }).collect();
        let off = (expected * root_from_flange).inverse() * robot.root_from_flange(&q);
        assert!(off.translation.vector.norm() < SAME_MM, "{}", off.translation.vector.norm());
        assert!(off.rotation.angle() < SAME_RAD, "{}", off.rotation.angle());
        assert!(robot.joints.iter().all(|j| j.d_mm.abs() < 1e5 && j.a_mm.abs() < 1e5), "{robot:?}");
    }

    proptest! {
        #[test]
        fn any_axes_give_the_same_flange(
            numbers in prop::collection::vec(-1.0f64..1.0, 7 * 6),
            parallel in prop::collection::vec(0usize..4, 7),
            q in prop::collection::vec(-3.0f64..3.0, 7),
        ) {
            let mut axes: Vec<Axis> = Vec::new();
            for (n, kind) in numbers.chunks_exact(6).zip(parallel) {
                let mut direction = Vector3::new(n[0], n[1], n[2] + 1.5).normalize();
                let mut point_mm = Point3::new(n[3], n[4], n[5]) * 800.0;
                // Parallel, nearly parallel, coincident: what drawings are full of.
                if let Some(last) = axes.last() {
                    match kind {
                        0 => direction = last.direction,
                        1 => direction = (last.direction + direction * 1e-4).normalize(),
                        2 => (direction, point_mm) = (-last.direction, last.point_mm),
                        _ => point_mm = last.point_mm,
                    }
                }
                axes.push(Axis { point_mm, direction, limits_rad: None, slides: n[5] > 0.6 });
            }
            let flange = transform(Vector3::new(0.3, -1.0, 2.0), Vector3::new(500.0, -300.0, 800.0));
            assert_same(&axes, &flange, &q);
        }
    }

    #[test]
    fn a_vertical_first_axis_needs_no_base() {
        for z in [1.0, -1.0] {
            let first = turning(Point3::new(0.0, 0.0, 100.0), Vector3::z() * z);
            let axes = [first, turning(Point3::new(25.0, 0.0, 400.0), Vector3::y())];
            let flange = transform(Vector3::zeros(), Vector3::new(300.0, 0.0, 400.0));
            assert_eq!(robot("r", &axes, &flange).ends.root_from_frame0, Transform::identity());
            assert_same(&axes, &flange, &[0.3, -0.7]);
        }
    }

    #[test]
    fn a_first_axis_that_is_nearly_vertical_keeps_its_digits() {
        for lean in [1e-12, 1e-9, 1e-4, -1e-9] {
            for z in [1.0, -1.0] {
                let direction = Vector3::new(lean, -lean, z).normalize();
                let first = turning(Point3::new(1.0, 2.0, 300.0), direction);
                let second = turning(Point3::new(1.0, 2.0, 500.0), Vector3::y());
                let flange = transform(Vector3::zeros(), Vector3::new(800.0, 0.0, 400.0));
                assert_same(&[first, second], &flange, &[2.0, -0.7]);
            }
        }
    }

    #[test]
    fn the_papers_robot_comes_back_from_its_axes() {
        let paper = Robot::paper();
        let q = [0.4, -0.6, 1.1, 0.3, -0.9, 0.7];
        let back = robot("r", &paper.axes(), &paper.root_from_flange(&[0.0; 6]));
        let off = back.root_from_flange(&q).inverse() * paper.root_from_flange(&q);
        assert!(off.translation.vector.norm() < SAME_MM && off.rotation.angle() < SAME_RAD);
    }
}
