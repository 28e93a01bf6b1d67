//! Two measured points by their names, of which one is what a reference instrument saw: a controller's "actual" point is
//! computed from its encoders, and people call the instrument's the reference or the truth.
//!
//! In: the names of a table's columns. Out: two points that only the table's owner can choose from. A point of an
//! instrument that the names call so is never one of them.

use super::part::{At, Part};
use super::pick::{Group, groups};
use crate::tables::names::{Name, What};
use crate::tables::vocabulary::{CONTROLLER, INSTRUMENT, REFERENCE, TRUTH, is_in};

/// The first point that calls itself measured with one that may be the better one, in the order of the columns.
pub(in crate::measurements) fn beside_measured(parts: &[Part]) -> Option<[[At; 3]; 2]> {
    let axis = |name: &Name| if let What::Coordinate(axis) = name.what { Some(axis) } else { None };
    let of_group = |group: Group| {
        let at = |axis: usize| group.columns.iter().find(|(a, _)| *a == axis).map(|(_, at)| *at);
        Some((group.name.clone(), [at(0)?, at(1)?, at(2)?]))
    };
    let all: Vec<(Name, [At; 3])> = groups(parts, axis).into_iter().filter_map(of_group).collect();
    let says = |name: &Name, list: &str| name.key.iter().any(|word| is_in(list, word));
    if all.iter().any(|(name, _)| says(name, INSTRUMENT)) {
        return None;
    }
    let better = |than: &Name, name: &Name| {
        !says(than, TRUTH) && says(name, TRUTH) || says(than, CONTROLLER) && says(name, REFERENCE)
    };
    let pair = |(name, at): &(Name, [At; 3])| {
        all.iter().find(|(other, _)| better(name, other)).map(|(_, other)| [*at.min(other), *at.max(other)])
    };
    all.iter().filter(|(name, _)| name.measured == Some(true)).find_map(pair)
}
