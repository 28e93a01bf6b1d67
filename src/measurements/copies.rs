//! Rows that are copies of others to the last digit: an instrument hardly ever reads a point twice alike, so copies say nothing of how well a robot
//! repeats.
//!
//! In: rows. Out: the rows without the copies, and a sentence that names them. What goes wrong: readings that are rounded to hundredths of a
//! millimetre or more, and some among others at the same joints that differ, may be alike without being copies; these are kept.

use std::collections::{BTreeMap, BTreeSet};

use super::{Measurement, Observed};

/// Rounded to this, mm, or more coarsely, two readings of one point may be alike: instruments and robots repeat to no less.
const ROUNDED_MM: f64 = 0.01;

/// A multiple of a step is off by this share of it at the most, from rounding.
const EXACT: f64 = 1e-6;

/// Of the readings at joints that were read before, this share are copies where any are.
const NEARLY_ALL: f64 = 0.9;

/// The rows without copies, and what is said of them.
pub(super) fn counted_once(rows: Vec<Measurement>) -> (Vec<Measurement>, Vec<String>) {
    let point = |row: &Measurement| match &row.observed {
        Observed::Position { point_mm, .. } => Some(*point_mm),
        _ => None,
    };
    let is_rounded = |v: f64| (v / ROUNDED_MM - (v / ROUNDED_MM).round()).abs() < EXACT;
    if rows.iter().filter_map(point).all(|p| p.iter().all(|v| is_rounded(*v))) {
        return (rows, Vec::new());
    }
    let mut first: BTreeMap<Vec<u64>, usize> = BTreeMap::new();
    let (mut joints, mut measured) = (BTreeSet::new(), 0);
    let mut copies: Vec<(usize, usize)> = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        let Some(point) = point(row) else { continue };
        measured += 1;
        joints.insert((&row.at.group, &row.target, row.at.joints_deg.iter().map(|v| v.to_bits()).collect::<Vec<_>>()));
        let numbers = row.at.joints_deg.iter().chain(point.iter()).map(|v| v.to_bits()).collect();
        let before = *first.entry(numbers).or_insert(i);
        let same = |a: &Measurement, b: &Measurement| {
            (&a.at.group, a.at.role, &a.target) == (&b.at.group, b.at.role, &b.target)
        };
        if before < i && same(&rows[before], row) {
            copies.push((i, before));
        }
    }
    // Of readings at one pose some may be alike by chance, but not nearly all.
    let again = measured - joints.len();
    let Some(&(copy, original)) = copies.first().filter(|_| NEARLY_ALL * again as f64 <= copies.len() as f64) else {
        return (rows, Vec::new());
    };
    let said = format!(
        "{} of {} rows are copies of others to the last digit, the first `{}` of `{}`, as readings hardly are: each is counted once",
        copies.len(),
        rows.len(),
        rows[copy].at.pose,
        rows[original].at.pose
    );
    let mut is_copy = vec![false; rows.len()];
    copies.iter().for_each(|(copy, _)| is_copy[*copy] = true);
    let kept = rows.into_iter().zip(is_copy).filter(|(_, is)| !is).map(|(row, _)| row).collect();
    (kept, vec![said])
}
