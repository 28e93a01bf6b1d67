//! Do the views differ enough to tell the cameras, and what should be photographed next?
//!
//! In: a calibration. Out: advice, nothing where nothing is missing. Tilt separates the focal length from the distance; corners near
//! the borders determine the lens; different distances separate the lens from the focal length.

use nalgebra::Vector3;

use super::calibrate::Calibration;
use super::observations::Side;
use super::whiteness::{CELLS, Whiteness};

/// Tilts between the boards below this leave the focal length to the distortion, deg.
const LEAST_TILT_DEG: f64 = 15.0;

/// Distances that differ by less than this share are one distance.
const LEAST_DEPTH_SHARE: f64 = 0.05;

/// Share of the cells of a picture that should have seen a corner.
const LEAST_COVERAGE: f64 = 0.6;

/// Corners in a cell that make it seen.
const SEEN: usize = 3;

/// Pairs below which a calibration's own uncertainty rests on too little: a fold then leaves out a tenth or more of all views.
const ENOUGH_PAIRS: usize = 10;

/// What should be photographed next; empty where the views suffice.
pub fn advise(calibration: &Calibration, whiteness: &Whiteness) -> Vec<String> {
    let mut advice = Vec::new();
    let pairs = calibration.views.len();
    if pairs < ENOUGH_PAIRS {
        advice.push(format!(
            "only {pairs} pairs could be used: {} more make the held-out figures reliable",
            ENOUGH_PAIRS - pairs
        ));
    }
    let poses = &calibration.values.poses;
    let normals: Vec<Vector3<f64>> = poses.iter().map(|pose| pose.rotation * Vector3::z()).collect();
    for (name, axis) in [("horizontal", 1usize), ("vertical", 0)] {
        let tilts = normals.iter().map(|n| n[axis].atan2(n.z).to_degrees());
        let (low, high) = tilts.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), t| (l.min(t), h.max(t)));
        if high - low < LEAST_TILT_DEG {
            advice.push(format!(
                "the boards' tilts about the {name} axis differ by {:.0} degrees only: add pairs tilted by 20 to 45 degrees both ways",
                high - low
            ));
        }
    }
    let mut depths: Vec<f64> = poses.iter().map(|pose| pose.translation.vector.z).collect();
    depths.sort_by(f64::total_cmp);
    if let (Some(near), Some(far)) = (depths.first(), depths.last())
        && far - near < LEAST_DEPTH_SHARE * far
    {
        advice.push(format!("all boards stand {near:.0} to {far:.0} mm away: add pairs nearer and farther by a tenth"));
    }
    for (side, field) in Side::BOTH.into_iter().zip(&whiteness.fields) {
        let seen = field.cells.iter().filter(|c| c.corners >= SEEN).count();
        let share = seen as f64 / field.cells.len().max(1) as f64;
        if share < LEAST_COVERAGE {
            advice.push(format!(
                "corners reach {:.0} % of the {} picture: add pairs with the board {}",
                100.0 * share,
                side.name(),
                empty_region(field)
            ));
        }
    }
    advice
}

/// Where most of the empty cells lie.
fn empty_region(field: &super::whiteness::Field) -> &'static str {
    let empty = |inside: fn(usize, usize) -> bool| {
        field.cells.iter().enumerate().filter(|(i, cell)| inside(i % CELLS, i / CELLS) && cell.corners < SEEN).count()
    };
    let regions: [(&'static str, usize); 4] = [
        ("at the left border", empty(|x, _| 3 * x < CELLS)),
        ("at the right border", empty(|x, _| 3 * (CELLS - 1 - x) < CELLS)),
        ("at the upper border", empty(|_, y| 3 * y < CELLS)),
        ("at the lower border", empty(|_, y| 3 * (CELLS - 1 - y) < CELLS)),
    ];
    regions.into_iter().max_by_key(|(_, count)| *count).map_or("at the borders", |(name, _)| name)
}
