//! How uncertain a length is wherever it lies in the volume, and in the directions that boards took there.
//!
//! In: a calibrated rig with its covariance, and the volume that is asked for. Out: lengths through a lattice of
//! places, with their standard deviations from the corners' scatter at both ends and from the calibration they share,
//! and by how much another rig would measure them otherwise. Boards that were all parallel say nothing of lengths along
//! the line of sight; these stand beside the others and decide only where they are asked for.

use nalgebra::{DVector, Point3, Vector3};
use rayon::prelude::*;

use crate::imaging::{Board, Side};
use crate::stereo::calibrate::Calibration;
use crate::stereo::data::Observation;
use crate::stereo::model::Layout;
use crate::stereo::triangulate::{RigCovariance, SpacePoint, rig_number, triangulate};
use crate::stereo::volume::{Extent, Volume, bounds};
use crate::stereo::{Error, Rig};

/// Squares of the lengths that a rig is judged by: 70 mm on the paper's board.
pub const LONG_SQUARES: usize = 7;

/// Such a length on a board, or the longest that it has, mm.
pub fn long_mm(board: &Board) -> f64 {
    board.spans_mm(LONG_SQUARES.min(board.columns() - 1))[0]
}

/// Places along x and y, and along z.
const PLACES: [usize; 3] = [7, 7, 5];

/// Boards whose directions are taken, those that differ most; the others lie nearly as one of them.
const BOARDS: usize = 8;

/// Parts of a length that are looked for in a volume that is not deep enough for the whole.
const PARTS: [f64; 4] = [1.0, 0.5, 0.25, 0.125];

/// Directions of a box that is asked for: the axes of the left camera and halfway between each two of them.
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

#[derive(Debug, Clone, PartialEq, Default)]
pub struct VolumeLengths {
    pub volume: Volume,
    /// What it was asked for as.
    pub extent: Extent,
    pub length_mm: f64,
    /// Those whose ends lie in the volume, as the boards lay in it.
    pub lengths: Vec<VolumeLength>,
    /// The same along the line of sight, where no board lay.
    pub along_sight: Vec<VolumeLength>,
    /// Largest standard deviation of one of them by the calibration alone, mm; of a volume that is less deep, that of
    /// the part that it holds, as it would be over the whole. `None` of a volume without a depth.
    pub along_sight_mm: Option<f64>,
}

impl VolumeLengths {
    /// Lengths of `length_mm` through the volume. `share` of the corners' variance is what the pictures disagree by;
    /// the rest both see alike, and it moves no point. Empty where the rig has no covariance.
    pub fn new(calibration: &Calibration, extent: Extent, length_mm: f64, share: f64) -> VolumeLengths {
        let volume = Volume::of(calibration, extent);
        let rig = calibration.rig();
        let Some(covariance) = calibration.covariance_now().as_ref().map(RigCovariance::new) else {
            return VolumeLengths { volume, extent, length_mm, ..VolumeLengths::default() };
        };
        let sigma_px = calibration.noise.typical_px(&calibration.views) * share.sqrt();
        let directions = match extent {
            Extent::Boards => directions_of_boards(calibration),
            _ => DIRECTIONS.iter().map(|d| Vector3::from(*d).normalize()).collect(),
        };
        let places = places(calibration, extent);
        VolumeLengths {
            extent,
            ..VolumeLengths::through(rig, &covariance, volume, &places, &directions, length_mm, sigma_px)
        }
    }

    /// The same through a volume that a file describes, in the directions of boards with its tilts; corners scatter by
    /// one px.
    pub fn of_volume(rig: &Rig, volume: &Volume, length_mm: f64) -> VolumeLengths {
        let Some(covariance) = rig.covariance.as_ref().map(RigCovariance::new) else {
            return VolumeLengths { volume: volume.clone(), length_mm, ..VolumeLengths::default() };
        };
        let box_mm = volume.bounding_box_mm(rig);
        let directions = directions_of_tilts(volume.tilt_deg);
        VolumeLengths::through(rig, &covariance, volume.clone(), &lattice(box_mm), &directions, length_mm, 1.0)
    }

    fn through(
        rig: &Rig,
        covariance: &RigCovariance,
        volume: Volume,
        places: &[Point3<f64>],
        directions: &[Vector3<f64>],
        length_mm: f64,
        sigma_px: f64,
    ) -> VolumeLengths {
        let through = |directions: &[Vector3<f64>]| -> Vec<VolumeLength> {
            let length = |at, along| length(rig, covariance, at, along, sigma_px, &volume);
            let of_place = |at| directions.iter().filter_map(move |d| length(at, d * length_mm));
            places.par_iter().flat_map_iter(of_place).collect()
        };
        let (lengths, along_sight) = (through(directions), through(&[Vector3::z()]));
        let along_sight_mm = PARTS.into_iter().find_map(|part| {
            let of = |length: VolumeLength| length.calibration_mm / part;
            through(&[Vector3::z() * part]).into_iter().map(of).reduce(f64::max)
        });
        VolumeLengths { length_mm, lengths, along_sight, along_sight_mm, volume, extent: Extent::Boards }
    }

    /// The length for which this is largest, with its value.
    pub fn worst(&self, of: impl Fn(&VolumeLength) -> f64) -> Option<(f64, &VolumeLength)> {
        self.lengths.iter().map(|length| (of(length), length)).max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Each length as another rig measures it in the same pixels, mm; `None` where it has no rays.
    pub fn measured_by(&self, rig: &Rig) -> Vec<Option<f64>> {
        self.lengths.par_iter().map(|length| length.measured_by(rig)).collect()
    }

    /// By how much a step of the shared numbers changes a length at most, mm.
    pub fn most_changed_mm(&self, layout: &Layout, step: &DVector<f64>) -> f64 {
        let numbers: Vec<(usize, usize)> =
            layout.names().iter().enumerate().filter_map(|(at, name)| Some((at, rig_number(name)?))).collect();
        let change =
            |length: &VolumeLength| numbers.iter().map(|&(at, number)| length.slope(number) * step[at]).sum::<f64>();
        self.lengths.iter().map(change).fold(0.0, |most, mm| most.max(mm.abs()))
    }
}

/// The rows' and the columns' directions of the boards that differ most: from the first on, always the one that lies
/// least as those that are taken.
fn directions_of_boards(calibration: &Calibration) -> Vec<Vector3<f64>> {
    let poses = &calibration.values.poses;
    let apart = |a: usize, b: usize| poses[a].rotation.angle_to(&poses[b].rotation);
    let mut taken: Vec<usize> = (0..poses.len().min(1)).collect();
    while taken.len() < BOARDS.min(poses.len()) {
        let least = |i: usize| taken.iter().map(|&j| apart(i, j)).fold(f64::INFINITY, f64::min);
        let Some(next) = (0..poses.len()).max_by(|&a, &b| least(a).total_cmp(&least(b)).then(b.cmp(&a))) else { break };
        taken.push(next);
    }
    taken.iter().flat_map(|&i| [Vector3::x(), Vector3::y()].map(|axis| poses[i].rotation * axis)).collect()
}

/// The rows' and the columns' directions of boards with the least and the most of these tilts, deg: about x, then about
/// y.
fn directions_of_tilts([x_least, x_most, y_least, y_most]: [f64; 4]) -> Vec<Vector3<f64>> {
    let tilts = [(x_least, y_least), (x_least, y_most), (x_most, y_least), (x_most, y_most)];
    let directions = |(x, y): (f64, f64)| {
        let normal = Vector3::new(y.to_radians().tan(), x.to_radians().tan(), 1.0).normalize();
        let row = (Vector3::x() - normal * normal.x).normalize();
        [row, normal.cross(&row)]
    };
    tilts.into_iter().flat_map(directions).collect()
}

/// Refuses a box of which both cameras see nothing.
pub fn check(calibration: &Calibration, extent: Extent) -> Result<(), Error> {
    let volume = Volume::of(calibration, extent);
    let rig = calibration.rig();
    if !matches!(extent, Extent::Box(_)) || places(calibration, extent).iter().any(|at| volume.holds(rig, at)) {
        return Ok(());
    }
    let boards = Volume::of(calibration, Extent::Boards).bounding_box_mm(rig);
    Err(Error::OutOfView { boards_mm: boards.map(|corner| [corner.x, corner.y, corner.z]) })
}

/// A lattice through the box in the left camera's frame that the boards' corners filled, or that is asked for.
fn places(calibration: &Calibration, extent: Extent) -> Vec<Point3<f64>> {
    let pairs = calibration.views.iter().zip(&calibration.values.poses);
    let points = pairs.flat_map(|(view, pose)| view.active(Side::Left).map(move |o| (pose * o.board_mm).coords));
    lattice(match extent {
        Extent::Box([x0, y0, z0, x1, y1, z1]) => [Vector3::new(x0, y0, z0), Vector3::new(x1, y1, z1)],
        _ => bounds(points),
    })
}

/// Places through a box, from its lowest to its highest corner.
fn lattice([low, high]: [Vector3<f64>; 2]) -> Vec<Point3<f64>> {
    let [nx, ny, nz] = PLACES;
    let share = |i: usize, of: usize| i as f64 / (of - 1) as f64;
    let place = |k: usize| {
        let shares = Vector3::new(share(k % nx, nx), share(k / nx % ny, ny), share(k / (nx * ny), nz));
        Point3::from(low + (high - low).component_mul(&shares))
    };
    (0..nx * ny * nz).map(place).collect()
}

fn length(
    rig: &Rig,
    covariance: &RigCovariance,
    at: &Point3<f64>,
    along: Vector3<f64>,
    sigma_px: f64,
    volume: &Volume,
) -> Option<VolumeLength> {
    let ends = [end(rig, &(at - along / 2.0), sigma_px, volume)?, end(rig, &(at + along / 2.0), sigma_px, volume)?];
    let [a, b] = [&ends[0].point, &ends[1].point];
    Some(VolumeLength {
        at_mm: *at,
        direction: along.normalize(),
        corners_mm: a.corner_variance_mm2(b).max(0.0).sqrt(),
        calibration_mm: covariance.length_variance_mm2(a, b).max(0.0).sqrt(),
        ends,
    })
}

/// A point as both cameras would see it; `None` where it is not in the volume.
fn end(rig: &Rig, at: &Point3<f64>, sigma_px: f64, volume: &Volume) -> Option<End> {
    if !volume.holds(rig, at) {
        return None;
    }
    let (left, right) = rig.project(at);
    let left = Observation::of_point(Side::Left, left, sigma_px);
    let right = Observation::of_point(Side::Right, right, sigma_px);
    let point = triangulate(rig, &left, &right)?;
    Some(End { left, right, point })
}
