//! Rows that fit far worse than the rest, in words.
//!
//! In: the rows that were left out of the fit, those that are doubtful, and rows to verify that are as far off. Out:
//! findings.

use std::ops::Range;

use crate::identify::data::dataset::Dataset;
use crate::identify::data::still;
use crate::identify::finding::Finding;
use crate::identify::judge::errors::{Judge, RowError};
use crate::identify::run::Identification;

/// Rows one after the other that chance hardly leaves out as one block.
const FEWEST_OF_BLOCK: usize = 4;

/// Standard deviations of a coordinate within which a reading is one that the robot of the other rows has there.
const SAME_SIGMAS: f64 = 5.0;

/// Pairs of exchanged rows that a sentence names.
const PAIRS: usize = 3;

/// Rows that do not fit with the others.
pub(super) fn of_rows(set: &Dataset, found: &Identification) -> Vec<Finding> {
    let out = (!found.outliers.is_empty()).then(|| left_out(set, found));
    let doubtful = (!found.doubtful.is_empty()).then(|| {
        let how = "worse than the rest by more than chance allows";
        fitting(set, &found.doubtful, "", how, "fitted all the same; measure again")
    });
    out.into_iter().chain(doubtful).collect()
}

/// The rows that were left out. Rows that were misread stand anywhere in a table; an unbroken block of them has one
/// cause.
pub(super) fn left_out(set: &Dataset, found: &Identification) -> Finding {
    let (out, name) = (&found.outliers, |row: usize| &set.poses[row].name);
    let share = 100.0 * out.len() as f64 / (found.fitted.len() + out.len()).max(1) as f64;
    let ends = out.iter().min().zip(out.iter().max()).filter(|_| out.len() >= FEWEST_OF_BLOCK);
    let is_block = |(first, last): &(&usize, &usize)| found.fitted.iter().all(|row| row < *first || row > *last);
    let block = ends.filter(is_block).map(|(&first, &last)| (name(first), name(last)));
    let which = block
        .map_or_else(String::new, |(first, last)| format!(", one unbroken block of the table, {first} to {last},"));
    let mut action = "left out of the fit (`outlier_sigmas = 0` in [identify] keeps them)".to_owned();
    if let Some(pairs) = exchanged(set, found) {
        let said: Vec<String> =
            pairs.iter().take(PAIRS).map(|&(row, of)| format!("{} has that of {}", name(row), name(of))).collect();
        let more = if pairs.len() > PAIRS { ", ..." } else { "" };
        action +=
            &format!(": the reading of each is that of another of them ({}{more}); mend their order", said.join(", "));
    } else if block.is_some() {
        action += ": one cause for all of them is likely, something that moved or was changed there; look for it";
    }
    let holds_most = |rows: &Range<usize>| 2 * out.iter().filter(|row| rows.contains(row)).count() > out.len();
    if out.len() >= FEWEST_OF_BLOCK
        && let Some((_, stuck)) = still::stuck_in(set).filter(|(rows, _)| holds_most(rows))
    {
        action += &stuck;
    }
    fitting(set, out, &format!(" ({share:.0} %){which}"), "far worse than the rest", &action)
}

/// Rows left out with the row whose reading each has, where each has that of another of them.
fn exchanged(set: &Dataset, found: &Identification) -> Option<Vec<(usize, usize)>> {
    let judge = Judge { extras: &found.extras, ..Judge::plain(set, &found.fitted, false) };
    let errors = judge.errors(found.robot(), &found.outliers);
    let read = |error: &RowError| set.poses[error.row].reading.point_mm();
    // The row where the robot was when this one's reading was taken.
    let of = |error: &RowError| {
        let place = |there: &RowError| Some(read(there)? + there.point_mm?);
        let score = |there: &RowError| {
            let off = place(there)? - read(error)?;
            let score = RowError { point_mm: Some(off), ..error.clone() }.score(&found.scatter)?;
            (there.row != error.row && score < SAME_SIGMAS).then_some((score, there.row))
        };
        let nearest = errors.iter().filter_map(score).min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some((error.row, nearest.1))
    };
    let pairs: Vec<(usize, usize)> = errors.iter().map(of).collect::<Option<_>>()?;
    (pairs.len() > 1 && pairs.len() == found.outliers.len()).then_some(pairs)
}

fn fitting(set: &Dataset, rows: &[usize], which: &str, how: &str, action: &str) -> Finding {
    let said = match rows.len() {
        1 => format!("1 row fits {how}"),
        count => format!("{count} rows{which} fit {how}"),
    };
    Finding::new(said, action).about(set.names(rows))
}

/// Verify rows that do not fit with the others.
pub(super) fn of_verify(set: &Dataset, found: &Identification) -> Option<Finding> {
    let rows = &found.verify_outliers;
    let said = match rows.len() {
        0 => return None,
        1 => "1 verify row fits far worse than the rest".to_owned(),
        count if count == set.verify_rows().len() => {
            format!("all {count} verify rows fit far worse than the fitted rows")
        }
        count => format!("{count} verify rows fit far worse than the rest"),
    };
    let action = match (found.strays(set).is_empty(), rows.len()) {
        (true, _) => "they are counted in the figures; measure them again",
        (false, 1) => "the figures are without it; measure it again",
        (false, _) => "the figures are without them; measure them again",
    };
    Some(Finding::new(said, action).about(set.names(rows)))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use crate::identify::examine::sessions::Along;
    use crate::identify::record::Record;
    use crate::identify::record::findings::{Findings, findings};
    use crate::identify::synthetic::{World, planned, point, settings};
    use crate::measurements::Role;
    use crate::robot::Advice;

    fn judged(spoil: impl Fn(&mut World, &[usize])) -> (Record, String) {
        let mut world = planned(240, 0, 25.0, 0.02, 5, &|_| {});
        world.rows.retain(|row| row.at.group == "g1" && row.at.role == Role::Sample);
        // Twelve of sixty rows.
        let rows: Vec<usize> = (24..36).collect();
        spoil(&mut world, &rows);
        let (set, found) = world.identified(&world.rows);
        let along = Along::default();
        let of_fit = findings(&set, &found, &along);
        let findings = Findings::new(Vec::new(), (Vec::new(), None), of_fit, &along, &set, &found);
        let record = Record::new(&set, &world.nominal, &found, &along, findings, &settings(), 1);
        let said = record.warnings.iter().find(|said| said.contains("far worse than the rest"));
        let said = said.cloned().unwrap_or_default();
        (record, said)
    }

    #[test]
    fn many_rows_that_were_left_out_are_to_be_looked_at_and_a_block_of_them_is_one() {
        let (record, said) = judged(|world, rows| {
            rows.iter().for_each(|&row| *point(&mut world.rows[row]) += Vector3::new(0.9, -1.1, 1.3));
        });
        assert_eq!(record.advice, Advice::Check, "{:?}", record.warnings);
        assert!(said.contains("12 rows (20 %), one unbroken block of the table,"), "{said}");
        assert!(said.contains("one cause for all") && !said.contains("has that of"), "{said}");
        // Two of them are errors of their own.
        let (record, said) = judged(|world, rows| {
            [rows[0], rows[7]].iter().for_each(|&row| *point(&mut world.rows[row]) += Vector3::new(3.0, -2.0, 1.0));
        });
        assert!(!record.reason.contains("far worse than the rest"), "{}", record.reason);
        assert!(said.contains("2 rows") && !said.contains("block") && !said.contains("has that of"), "{said}");
    }

    #[test]
    fn readings_in_another_order_are_called_that() {
        let (record, said) = judged(|world, rows| {
            let read: Vec<_> = rows.iter().rev().map(|&row| *point(&mut world.rows[row])).collect();
            rows.iter().zip(read).for_each(|(&row, read)| *point(&mut world.rows[row]) = read);
        });
        assert_eq!(record.advice, Advice::Check, "{:?}", record.warnings);
        assert!(said.contains("the reading of each is that of another of them"), "{said}");
        // The first has the last one's.
        let named = |row: usize| record.outliers[row].clone();
        assert!(said.contains(&format!("{} has that of {}", named(0), named(11))), "{said}");
    }
}
