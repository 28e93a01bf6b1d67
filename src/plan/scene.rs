//! What the cameras see: the field of a calibrated rig, the target in it, and where the cameras are assumed to stand.

use nalgebra::{Matrix3, Point3, Vector3};

use super::error::{Error, Result};
use super::settings::Settings;
use crate::geometry::{Transform, facing, rotation_matrix, transform, transform_from_matrix};
use crate::imaging::Board;
use crate::robot::{Robot, inverse};
use crate::statistics::RP_OVER_SIGMA;
use crate::stereo::Rig;
use crate::stereo::data::observation::{Observation, Side};
use crate::stereo::triangulate::triangulate;

/// Axes of two cameras that meet at a smaller angle than this do not say where the field's middle is, rad.
const PARALLEL_RAD: f64 = 0.02;

/// Clear border that the target keeps to a picture's edge, as a share of its width.
const BORDER: f64 = 0.02;

/// Starts for the posture at a sphere's middle.
const STARTS: usize = 200;

/// The paper's start points, mm.
const PAPER_CENTERS_MM: [[f64; 3]; 4] =
    [[200.0, 0.0, 379.0], [-200.0, 0.0, 379.0], [0.0, 200.0, 379.0], [0.0, -230.0, 379.0]];

/// Azimuth of the flange in the paper's plan as `simulate` reads it, deg: level, and 30 degrees off the line of the
/// first two points.
const PAPER_AZIMUTH_DEG: f64 = -30.0;

/// A rig with the target before it.
#[derive(Debug, Clone)]
pub struct Scene {
    pub rig: Rig,
    /// The middle of the field: a target with the identity there faces both cameras.
    pub left_from_field: Transform,
    pub board: Board,
    /// Standard deviation of a corner's coordinate, px.
    pub corner_px: f64,
    /// Largest angle between the target's normal and the field's axis, rad.
    pub tilt_rad: f64,
    /// Largest distance of the mark point from the field's middle along its axis, mm.
    pub depth_mm: f64,
    /// How far off its place the target may be and still be seen whole, mm.
    pub margin_mm: f64,
}

/// One placement of the cameras: a group.
#[derive(Debug, Clone, PartialEq)]
pub struct Placement {
    pub name: String,
    /// Middle of the sphere, base frame, mm.
    pub center_mm: Vector3<f64>,
    /// The field's frame in the base's.
    pub base_from_field: Transform,
    /// `cam_from_base`
    pub left_from_base: Transform,
}

/// What a measured point scatters by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseNoise {
    /// Standard deviation of a coordinate, mm, instead of the rig's.
    pub given_mm: Option<f64>,
    /// Pose repeatability RP, mm.
    pub repeatability_mm: f64,
}

impl Scene {
    /// Finds the field of a rig. An error where the target is never wholly in both pictures.
    pub fn new(rig: Rig, board: Board, corner_px: f64, tilt_rad: f64, depth_mm: f64, margin_mm: f64) -> Result<Scene> {
        let left_from_right = rig.right_from_left.inverse();
        let (a, b) = (Vector3::z(), left_from_right.rotation * Vector3::z());
        let (right, sine) = (left_from_right.translation.vector, a.cross(&b).norm());
        let axis = (a + b).normalize();
        let size = 2.0 * half_plate(&board).0;
        // Both cameras see a target that is a third of the picture wide.
        let focal_share = rig.left.fx / f64::from(rig.left.width);
        let mut middle = right / 2.0 + axis * (3.0 * size * focal_share);
        if sine > PARALLEL_RAD {
            let normal = a.cross(&b);
            let along_a = right.cross(&b).dot(&normal) / (sine * sine);
            let along_b = right.cross(&a).dot(&normal) / (sine * sine);
            if along_a > 0.0 && along_b > 0.0 {
                middle = (a * along_a + right + b * along_b) / 2.0;
            }
        }
        let x = (Vector3::x() - axis * axis.x).normalize();
        let rotation = Matrix3::from_columns(&[x, axis.cross(&x), axis]);
        let left_from_field = transform_from_matrix(rotation, middle);
        let scene = Scene { rig, left_from_field, board, corner_px, tilt_rad, depth_mm, margin_mm };
        if !scene.sees(&left_from_field, 0.0) {
            let (w, h) = half_plate(&board);
            let distance_mm = middle.norm();
            let field_mm = distance_mm * f64::from(scene.rig.left.width) / scene.rig.left.fx;
            return Err(Error::NeverSeen { width_mm: 2.0 * w, height_mm: 2.0 * h, field_mm, distance_mm });
        }
        Ok(scene)
    }

    /// Whether the whole plate is in both pictures, the plate so much larger on all sides, mm.
    pub fn sees(&self, left_from_target: &Transform, margin_mm: f64) -> bool {
        let (w, h) = half_plate(&self.board);
        self.rig.sees_plate(left_from_target, (w + margin_mm, h + margin_mm), BORDER)
    }

    /// Whether the pose is one to plan: wholly seen, its printed side to the cameras, in the depth of field, not too
    /// oblique.
    pub fn accepts(&self, field_from_target: &Transform) -> bool {
        let normal = field_from_target.rotation * Vector3::z();
        normal.angle(&Vector3::z()) <= self.tilt_rad
            && field_from_target.translation.vector.z.abs() <= self.depth_mm
            && self.sees(&(self.left_from_field * field_from_target), self.margin_mm)
    }

    /// Width that both cameras see at the field's middle, mm.
    pub fn width_mm(&self) -> f64 {
        let share = |camera: &crate::stereo::Camera| f64::from(camera.width) / camera.fx;
        self.left_from_field.translation.vector.norm() * share(&self.rig.left).min(share(&self.rig.right))
    }

    /// Covariance of the measured mark point, left camera's frame, mm^2: corners and repeatability. `None` where no ray
    /// meets.
    pub fn covariance_mm2(&self, left_from_target: &Transform, noise: &PoseNoise) -> Option<Matrix3<f64>> {
        if let Some(sigma) = noise.given_mm {
            return Some(Matrix3::identity() * sigma * sigma);
        }
        let mark = left_from_target * Point3::origin();
        let (left, right) = self.rig.project(&mark);
        let seen = |side, px| Observation::of_point(side, px, self.corner_px);
        let point = triangulate(&self.rig, &seen(Side::Left, left), &seen(Side::Right, right))?;
        let sigma = noise.repeatability_mm / RP_OVER_SIGMA;
        // The mark is the mean of the corners.
        Some(point.covariance_mm2 / self.board.corner_count() as f64 + Matrix3::identity() * sigma * sigma)
    }
}

/// Half the plate, mm: the squares and one more half square all round.
fn half_plate(board: &Board) -> (f64, f64) {
    let [width, height] = board.extent_mm().map(|mm| (mm + 1.2 * board.square_mm) / 2.0);
    (width, height)
}

/// The target's printed side looks along the flange's z: its own z points back.
pub fn flange_from_target(robot: &Robot) -> Transform {
    transform(Vector3::x() * std::f64::consts::PI, robot.tool_mm)
}

/// Directions of the flange, the paper's first: level, then lower and lower, all round.
fn directions() -> Vec<Vector3<f64>> {
    let elevations = [0.0, -30.0, -60.0, -90.0f64];
    let all = elevations.iter().flat_map(|e| (0..12).map(move |k| (PAPER_AZIMUTH_DEG + 30.0 * f64::from(k), *e)));
    let direction = |(azimuth, elevation): (f64, f64)| {
        let (sin, cos) = azimuth.to_radians().sin_cos();
        let (up, level) = elevation.to_radians().sin_cos();
        Vector3::new(level * cos, level * sin, up)
    };
    all.map(direction).collect()
}

/// The flange pose at a sphere's middle.
pub fn base_from_flange(robot: &Robot, base_from_target: &Transform) -> Transform {
    base_from_target * flange_from_target(robot).inverse()
}

/// The placements: one direction of the flange for all spheres as in the paper, the first that all of them can have; a
/// sphere of its own direction where there is none.
pub fn placements(robot: &Robot, scene: &Scene, settings: &Settings) -> Result<Vec<Placement>> {
    // The paper's spheres are scaled by the reach.
    let scale = robot.reach_mm() / Robot::paper().reach_mm();
    let paper = || PAPER_CENTERS_MM.iter().map(|c| Vector3::from(*c) * scale).collect();
    let centers: Vec<Vector3<f64>> = if settings.centers_mm.is_empty() { paper() } else { settings.centers_mm.clone() };
    let field = |center: &Vector3<f64>, direction: &Vector3<f64>| {
        let rotation = facing(direction) * flange_from_target(robot).rotation;
        transform(rotation.scaled_axis(), *center)
    };
    let reached = |base_from_field: &Transform, starts| {
        inverse::best_posture(robot, &base_from_flange(robot, base_from_field), starts).filter(|q| safe(robot, q))
    };
    let directions = directions();
    let all = |d: &&Vector3<f64>| centers.iter().all(|c| reached(&field(c, d), STARTS / 4).is_some());
    let common = directions.iter().find(all);
    let mut placements = Vec::with_capacity(centers.len());
    for (k, center) in centers.iter().enumerate() {
        let own = || directions.iter().find(|d| reached(&field(center, d), STARTS).is_some());
        let Some(direction) = common.or_else(own) else {
            let inward = (1..20).map(|step| center * (1.0 - 0.05 * f64::from(step)));
            let near = |c: &Vector3<f64>| directions.iter().any(|d| reached(&field(c, d), STARTS / 8).is_some());
            let nearest_mm = inward.into_iter().find(near).map(Into::into);
            let group = (k + 1).to_string();
            return Err(Error::Unreachable { group, point_mm: (*center).into(), nearest_mm });
        };
        let base_from_field = field(center, direction);
        let left_from_base = scene.left_from_field * base_from_field.inverse();
        placements.push(Placement { name: (k + 1).to_string(), center_mm: *center, base_from_field, left_from_base });
    }
    Ok(placements)
}

impl Placement {
    /// Moves the cameras: the field's frame follows.
    pub fn put(&mut self, scene: &Scene, left_from_base: Transform) {
        self.left_from_base = left_from_base;
        self.base_from_field = left_from_base.inverse() * scene.left_from_field;
    }

    /// A covariance of the left camera's frame in the base's.
    pub fn in_base(&self, covariance_mm2: &Matrix3<f64>) -> Matrix3<f64> {
        let base_from_left = rotation_matrix(&self.left_from_base).transpose();
        base_from_left * covariance_mm2 * base_from_left.transpose()
    }
}

/// Flange poses with less freedom are too near a singular posture, mm a rad.
const LEAST_FREEDOM_MM: f64 = 15.0;

/// Way that every joint keeps to its limits, rad.
const ROOM_RAD: f64 = 0.035;

/// Whether a posture is one to plan: away from singular ones and from the joints' limits.
pub fn safe(robot: &Robot, joints_rad: &[f64]) -> bool {
    inverse::freedom_mm(robot, joints_rad) > LEAST_FREEDOM_MM && inverse::room_rad(robot, joints_rad) > ROOM_RAD
}
