//! Two measured points by their names, of which one is what a reference instrument saw: a controller's "actual" point is
//! computed from its encoders, and people call the instrument's the reference or the truth.
//!
//! In: the names of a table's columns. Out: two points that only the table's owner can choose from. A point of an
//! instrument that the names call so is never one of them.

use super::part::{At, Part};
use super::pick::groups;
use crate::tables::names::{Name, What};

/// What only an instrument's points are called.
const INSTRUMENT: [&str; 15] = [
    "laser",
    "tracker",
    "lt",
    "leica",
    "faro",
    "smr",
    "camera",
    "vicon",
    "ndi",
    "mocap",
    "cmm",
    "marker",
    "reflector",
    "激光",
    "跟踪仪",
];

/// What is true beside anything that is measured.
const TRUTH: [&str; 4] = ["gt", "truth", "groundtruth", "true"];

/// What is an instrument's, or where the robot was sent, beside a controller's.
const REFERENCE: [&str; 2] = ["ref", "reference"];
const CONTROLLER: [&str; 3] = ["act", "actual", "real"];

/// The first point that calls itself measured with one that may be the better one, in the order of the columns.
pub(in crate::measurements) fn beside_measured(parts: &[Part]) -> Option<[[At; 3]; 2]> {
    let axis = |name: &Name| if let What::Coordinate(axis) = name.what { Some(axis) } else { None };
    let of_group = |group: super::pick::Group| {
        let at = |axis: usize| group.columns.iter().find(|(a, _)| *a == axis).map(|(_, at)| *at);
        Some((group.name.clone(), [at(0)?, at(1)?, at(2)?]))
    };
    let all: Vec<(Name, [At; 3])> = groups(parts, axis).into_iter().filter_map(of_group).collect();
    let says = |name: &Name, list: &[&str]| name.key.iter().any(|word| list.contains(&word.as_str()));
    let measured = |(name, _): &&(Name, [At; 3])| name.measured == Some(true) && !says(name, &INSTRUMENT);
    let better = |than: &Name, name: &Name| {
        !says(than, &TRUTH) && says(name, &TRUTH) || says(than, &CONTROLLER) && says(name, &REFERENCE)
    };
    let pair = |(name, at): &(Name, [At; 3])| {
        all.iter().find(|(other, _)| better(name, other)).map(|(_, other)| [*at.min(other), *at.max(other)])
    };
    let instrument = all.iter().any(|(name, _)| says(name, &INSTRUMENT));
    all.iter().filter(measured).filter(|_| !instrument).find_map(pair)
}
