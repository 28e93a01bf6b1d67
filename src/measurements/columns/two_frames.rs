//! One point beside itself in another frame: where the robot was sent, and what a sensor saw that stands parallel to the
//! robot.
//!
//! In: the way that a table is read, and the nominal robot. Out: two of its targets that no body carries. What lies
//! between two targets of a body turns with the flange; between one point in two frames it is the same in every row. Goes
//! wrong: where the flange hardly turns nothing tells them apart, and they stay targets.

use nalgebra::Vector3;

use super::judge::Way;
use super::layout::{RIGID, are_readings, point};
use super::part::{At, Part};
use crate::geometry::Transform;
use crate::robot::Robot;
use crate::statistics::median;

/// How many times more a body must leave than two frames: of noise alone, drawn for each by itself, one table of five
/// rows in a thousand comes to that, one of six in five thousand, and none of twelve in 33 000 that were drawn.
const CLEAR: f64 = 4.0;

/// The first target and one that is it in another frame.
pub(in crate::measurements) fn of_way(parts: &[Part], way: &Way, robot: &Robot) -> Option<[[At; 3]; 2]> {
    let [(_, first), others @ ..] = &way.picked.points[..] else { return None };
    if others.is_empty() || are_readings(parts, &way.picked) {
        return None;
    }
    let sensor_from_flange = way.sensor_from_flange(parts, robot)?;
    let is_other_frame = |(_, second): &&(String, [At; 3])| {
        let apart = |(row, flange): &(usize, Transform)| {
            let apart = point(parts, *row, second)? - point(parts, *row, first)?;
            Some((apart, flange.inverse_transform_vector(&apart)))
        };
        let (in_sensor, in_flange): (Vec<_>, Vec<_>) = sensor_from_flange.iter().filter_map(apart).unzip();
        let (of_frames, of_body) = (scatter(&in_sensor), scatter(&in_flange));
        let wide = median(in_sensor.iter().map(Vector3::norm));
        let (Some(of_frames), Some(of_body), Some(wide)) = (of_frames, of_body, wide) else { return false };
        // A nominal flange is turned wrongly by thousandths of a radian: that is no turn.
        CLEAR * of_frames < of_body && RIGID * wide < of_body
    };
    others.iter().find(is_other_frame).map(|(_, second)| [*first, *second])
}

/// How far these are from their middle, in the middle.
fn scatter(all: &[Vector3<f64>]) -> Option<f64> {
    let [x, y, z] = [0, 1, 2].map(|axis| median(all.iter().map(|v| v[axis])));
    let middle = Vector3::new(x?, y?, z?);
    median(all.iter().map(|v| (v - middle).norm()))
}
