//! Rows that are copies of others to the last digit: an instrument hardly ever reads a point twice alike, so copies say
//! nothing of how well a robot repeats.
//!
//! In: rows. Out: the rows without the copies, and a sentence that names them; rows to verify that are copies of rows
//! to fit are kept without their reading. What goes wrong: readings that are rounded to hundredths of a millimetre or
//! more, and some among others at the same joints that differ, may be alike without being copies; these are kept.

use std::collections::{BTreeMap, BTreeSet};

use super::{Measurement, Observed, Role};

/// Rounded to this, mm, or more coarsely, two readings of one point may be alike: instruments and robots repeat to no
/// less.
const ROUNDED_MM: f64 = 0.01;

/// A multiple of a step is off by this share of it at the most, from rounding.
const EXACT: f64 = 1e-6;

/// Of the readings at joints that were read before, this share are copies where any are.
const NEARLY_ALL: f64 = 0.9;

fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|v| v.to_bits()).collect()
}

fn is_rounded(v: &f64) -> bool {
    (v / ROUNDED_MM - (v / ROUNDED_MM).round()).abs() < EXACT
}

/// The rows without copies, and what is said of them.
pub(super) fn counted_once(rows: Vec<Measurement>) -> (Vec<Measurement>, Vec<String>) {
    let point = |row: &Measurement| match &row.observed {
        Observed::Position { point_mm, .. } => Some(*point_mm),
        _ => None,
    };
    if rows.iter().filter_map(point).all(|p| p.iter().all(is_rounded)) {
        return (rows, Vec::new());
    }
    let mut first: BTreeMap<Vec<u64>, usize> = BTreeMap::new();
    let (mut joints, mut measured) = (BTreeSet::new(), 0);
    let mut copies: Vec<(usize, usize)> = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        let Some(point) = point(row) else { continue };
        measured += 1;
        joints.insert((&row.at.group, &row.target, bits(&row.at.joints_deg)));
        let numbers = [bits(&row.at.joints_deg), bits(point.coords.as_slice())].concat();
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

/// The rows, those to verify without a reading that are copies of rows to fit: the robot was fitted to their numbers.
pub(super) fn verifying_nothing(mut rows: Vec<Measurement>) -> Vec<Measurement> {
    let numbers = |row: &Measurement| Some([bits(&row.at.joints_deg), bits(&row.observed.read()?)].concat());
    let (mut fitted, mut places) = (BTreeSet::new(), BTreeSet::new());
    for row in rows.iter().filter(|row| row.at.role != Role::Verify) {
        fitted.extend(numbers(row).map(|numbers| (row.target.clone(), numbers)));
        places.insert(bits(&row.at.joints_deg));
    }
    let of_verify = |row: &Measurement| row.at.role == Role::Verify && places.contains(&bits(&row.at.joints_deg));
    let is_again = |i: &usize| of_verify(&rows[*i]) && rows[*i].observed.read().is_some();
    let again: Vec<usize> = (0..rows.len()).filter(is_again).collect();
    let is_copy = |i: &usize| numbers(&rows[*i]).is_some_and(|n| fitted.contains(&(rows[*i].target.clone(), n)));
    let copies: Vec<usize> = again.iter().copied().filter(is_copy).collect();
    let rounded = copies.iter().filter_map(|&i| rows[i].observed.read()).all(|read| read.iter().all(is_rounded));
    if rounded && (copies.len() as f64) < NEARLY_ALL * again.len() as f64 {
        return rows;
    }
    for i in copies {
        let reason = "copies of fitted rows to the last digit, by which nothing is verified".to_owned();
        rows[i].observed = Observed::Missing { reason };
    }
    rows
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::identify::synthetic::{self, seen_at};

    fn row(k: usize, role: Role, observed: Observed) -> Measurement {
        synthetic::row(format!("{}{k}", role.name()), "g", role, vec![k as f64, 30.0], observed)
    }

    fn point(k: usize, off_mm: f64) -> Observed {
        seen_at(Point3::new(1000.1234 + 50.0 * k as f64 + off_mm, 20.0, 30.0))
    }

    fn distance(k: usize, off_mm: f64) -> Observed {
        Observed::Distance { distance_mm: 500.25 + 3.0 * k as f64 + off_mm, sigma_mm: None }
    }

    /// How many of ten verify rows are without a reading, of which so many copy a fitted row and others came back to
    /// one.
    fn left_out(read: impl Fn(usize, f64) -> Observed, copies: usize, again: usize) -> usize {
        let mut rows: Vec<Measurement> = (0..12).map(|k| row(k, Role::Sample, read(k, 0.0))).collect();
        let verify = |k: usize| match k {
            _ if k < copies => (k, 0.0),
            _ if k < copies + again => (k, 0.02),
            _ => (k + 20, 0.0),
        };
        rows.extend((0..10).map(verify).map(|(k, off_mm)| row(k, Role::Verify, read(k, off_mm))));
        let rows = verifying_nothing(rows);
        assert!(rows.len() == 22 && rows[..12].iter().all(|row| !matches!(row.observed, Observed::Missing { .. })));
        rows.iter().filter(|row| matches!(row.observed, Observed::Missing { .. })).count()
    }

    #[test]
    fn rows_that_copy_fitted_ones_verify_nothing() {
        for copies in [0, 1, 4, 10] {
            assert_eq!(left_out(point, copies, 0), copies);
            assert_eq!(left_out(distance, copies, 0), copies);
        }
        // The robot came back to a pose: what it reads then is a reading; of rounded ones some are alike.
        assert_eq!((left_out(point, 0, 4), left_out(point, 2, 4)), (0, 2));
        assert_eq!((left_out(distance, 0, 4), left_out(distance, 3, 4)), (0, 0));
    }
}
