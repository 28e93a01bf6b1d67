//! How uncertain a length is wherever and however it lies in the working volume, seen there or not.
//!
//! In: a calibrated rig with its covariance. Out: lengths in nine directions on a lattice through the volume that the boards filled, with
//! their standard deviations from the corners' scatter at both ends and from the calibration they share, and by how much another rig
//! would measure them otherwise. Boards that were never tilted say nothing of lengths along the line of sight: here they count as well.

use nalgebra::{DVector, Point3, Vector3};
use rayon::prelude::*;

use crate::imaging::Side;
use crate::stereo::Rig;
use crate::stereo::calibrate::Calibration;
use crate::stereo::data::observation::Observation;
use crate::stereo::judge::field_of_corners::Hull;
use crate::stereo::judge::verdict::{COVERAGE, Expansion};
use crate::stereo::model::parameters::Layout;
use crate::stereo::triangulate::{RigCovariance, SpacePoint, rig_number, triangulate};

/// Places along x and y, and along z.
const PLACES: [usize; 3] = [7, 7, 5];

/// Directions: the axes of the left camera and halfway between each two of them.
const DIRECTIONS: [[f64; 3]; 9] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 1.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, 0.0, 1.0],
    [1.0, 0.0, -1.0],
    [0.0, 1.0, 1.0],
    [0.0, 1.0, -1.0],
];

/// A length at a place of the volume.
#[derive(Debug, Clone, PartialEq)]
pub struct VolumeLength {
    /// Its middle in the left camera's frame, mm.
    pub at_mm: Point3<f64>,
    /// Unit vector along it.
    pub direction: Vector3<f64>,
    /// Standard deviation through the corners at both ends, mm.
    pub corners_mm: f64,
    /// Through the calibration, mm.
    pub calibration_mm: f64,
    ends: [End; 2],
}

/// An end as both cameras would see it.
#[derive(Debug, Clone, PartialEq)]
struct End {
    left: Observation,
    right: Observation,
    point: SpacePoint,
}

impl VolumeLength {
    /// Standard deviation of the length, mm.
    pub fn sigma_mm(&self) -> f64 {
        self.corners_mm.hypot(self.calibration_mm)
    }

    /// Expanded uncertainty of the length, the board's certificate left out, mm.
    pub fn expanded_mm(&self, expansion: &Expansion) -> f64 {
        (COVERAGE * self.corners_mm).hypot(expansion.calibration * self.calibration_mm)
    }

    /// Derivative of the length by a number of the rig.
    fn slope(&self, number: usize) -> f64 {
        self.direction.dot(&(self.ends[1].point.by_rig[number] - self.ends[0].point.by_rig[number]))
    }

    /// As another rig measures it, mm. `None` where that rig has no rays there.
    fn measured_by(&self, rig: &Rig) -> Option<f64> {
        let [a, b] = &self.ends;
        let end = |end: &End| Some(triangulate(rig, &end.left, &end.right)?.point_mm);
        Some((end(b)? - end(a)?).norm())
    }

    /// How it lies, for a person.
    pub fn lies(&self) -> &'static str {
        match self.direction.z.abs() {
            z if z > 0.9 => "along the line of sight",
            z if z > 0.1 => "tilted by 45 degrees",
            _ => "across the line of sight",
        }
    }
}

/// Lengths over the working volume.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Volume {
    /// How long they are, mm.
    pub length_mm: f64,
    /// Those whose ends both cameras see within the field that corners reached.
    pub lengths: Vec<VolumeLength>,
}

impl Volume {
    /// Lengths of `length_mm` over the volume in which the boards stood, as far as corners reached. Empty where the rig has no covariance.
    pub fn new(calibration: &Calibration, length_mm: f64) -> Volume {
        let rig = calibration.rig();
        let Some(covariance) = rig.covariance.as_ref().map(RigCovariance::new) else { return Volume::default() };
        let sigma_px = calibration.noise.typical_px(&calibration.views);
        let places = places(calibration);
        let reached =
            Side::BOTH.map(|side| Hull::of(calibration.views.iter().flat_map(|view| view.active(side).map(|o| o.px))));
        let of_place = |at: &Point3<f64>| -> Vec<VolumeLength> {
            let lengths = DIRECTIONS.iter().map(|d| Vector3::from(*d).normalize());
            lengths
                .filter_map(|direction| length(rig, &covariance, at, direction * length_mm, sigma_px, &reached))
                .collect()
        };
        Volume { length_mm, lengths: places.par_iter().flat_map_iter(of_place).collect() }
    }

    /// The length for which this is largest, with its value.
    pub fn worst(&self, of: impl Fn(&VolumeLength) -> f64) -> Option<(f64, &VolumeLength)> {
        self.lengths.iter().map(|length| (of(length), length)).max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Each length as another rig measures it in the same pixels, mm; `None` where it has no rays.
    pub fn measured_by(&self, rig: &Rig) -> Vec<Option<f64>> {
        self.lengths.par_iter().map(|length| length.measured_by(rig)).collect()
    }

    /// By how much a step of the shared numbers changes each length, mm.
    pub fn changes_by_step_mm(&self, layout: &Layout, step: &DVector<f64>) -> Vec<f64> {
        let numbers: Vec<(usize, usize)> =
            layout.names().iter().enumerate().filter_map(|(at, name)| Some((at, rig_number(name)?))).collect();
        let change = |length: &VolumeLength| numbers.iter().map(|&(at, number)| length.slope(number) * step[at]).sum();
        self.lengths.iter().map(change).collect()
    }
}

/// A lattice through the box in the left camera's frame that the boards' corners filled.
fn places(calibration: &Calibration) -> Vec<Point3<f64>> {
    let points = calibration
        .views
        .iter()
        .zip(&calibration.values.poses)
        .flat_map(|(view, pose)| view.active(Side::Left).map(move |o| pose * o.board_mm));
    let (low, high) = points
        .fold((Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)), |(low, high), p| {
            (low.inf(&p.coords), high.sup(&p.coords))
        });
    let share = |i: usize, of: usize| i as f64 / (of - 1) as f64;
    let mut places = Vec::new();
    for iz in 0..PLACES[2] {
        for iy in 0..PLACES[1] {
            for ix in 0..PLACES[0] {
                let shares = Vector3::new(share(ix, PLACES[0]), share(iy, PLACES[1]), share(iz, PLACES[2]));
                places.push(Point3::from(low + (high - low).component_mul(&shares)));
            }
        }
    }
    places
}

fn length(
    rig: &Rig,
    covariance: &RigCovariance,
    at: &Point3<f64>,
    along: Vector3<f64>,
    sigma_px: f64,
    reached: &[Hull; 2],
) -> Option<VolumeLength> {
    let ends = [end(rig, &(at - along / 2.0), sigma_px, reached)?, end(rig, &(at + along / 2.0), sigma_px, reached)?];
    let [a, b] = [&ends[0].point, &ends[1].point];
    Some(VolumeLength {
        at_mm: *at,
        direction: along.normalize(),
        corners_mm: a.corner_variance_mm2(b).max(0.0).sqrt(),
        calibration_mm: covariance.length_variance_mm2(a, b).max(0.0).sqrt(),
        ends,
    })
}

/// A point as both cameras would see it; `None` where that is not within the field that corners reached.
fn end(rig: &Rig, at: &Point3<f64>, sigma_px: f64, reached: &[Hull; 2]) -> Option<End> {
    let in_front = at.z > 0.0 && (rig.right_from_left * at).z > 0.0;
    if !in_front {
        return None;
    }
    let (left, right) = rig.project(at);
    if !reached[0].contains(&left) || !reached[1].contains(&right) {
        return None;
    }
    let left = Observation::of_point(Side::Left, left, sigma_px);
    let right = Observation::of_point(Side::Right, right, sigma_px);
    let point = triangulate(rig, &left, &right)?;
    Some(End { left, right, point })
}
