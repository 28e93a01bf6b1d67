//! Rows that were left out because of where a joint stood in them: they are the ones that tell of it, and no gross errors.
//!
//! In: the rows that were fitted and those that were left out. Out: the joint, and the finding. Method: of all rows, those in which a joint is not
//! where it is in most of them, or those beyond all others in its range; how likely it is that so many of them are among those left out by chance
//! (the hypergeometric distribution), times the joints and ways that were looked at. Goes wrong: a joint that moves in every row.

use crate::identify::data::dataset::Dataset;
use crate::identify::finding::Finding;

/// Share of a joint's way within which it is where it was.
const SAME: f64 = 1e-3;

/// Share of the rows in which a joint moves that must be left out.
const NEARLY_ALL: f64 = 0.8;

/// Chance with which rows left out are those of one joint by accident.
const CHANCE: f64 = 1e-3;

/// Share of all rows from which on those at the end of a joint's way are more than a few that the sensor saw badly.
const MANY: f64 = 0.05;

/// Rows of a joint that were left out.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOut {
    pub finding: Finding,
    /// Whether the rows that are left hardly move the joint.
    pub is_still: bool,
}

/// The joint whose rows were left out, if they are one joint's.
pub fn of_a_joint(set: &Dataset, fitted: &[usize], outliers: &[usize]) -> Option<LeftOut> {
    let (rows, joints) = (Rows { set, fitted, outliers }, set.joint_count());
    let tests = 3 * joints;
    let moving = (0..joints).filter_map(|joint| moves(&rows, joint, tests));
    let at_an_end = || (0..joints).find_map(|joint| beyond(&rows, joint, tests));
    moving.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, left_out)| left_out).or_else(at_an_end)
}

/// The rows that were fitted and those that were left out.
struct Rows<'a> {
    set: &'a Dataset,
    fitted: &'a [usize],
    outliers: &'a [usize],
}

/// All rows and those left out, by a joint's reading.
fn readings(rows: &Rows, joint: usize) -> Vec<(f64, bool, usize)> {
    let of = |list: &[usize], out: bool| {
        list.iter().map(|&row| (rows.set.poses[row].joints_rad[joint], out, row)).collect::<Vec<_>>()
    };
    let mut all = [of(rows.fitted, false), of(rows.outliers, true)].concat();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all
}

/// Where a joint stands in most rows, the rows in which it does not are left out.
fn moves(of: &Rows, joint: usize, tests: usize) -> Option<(f64, LeftOut)> {
    let all = readings(of, joint);
    let rest = all.get(all.len() / 2)?.0;
    let way = all[all.len() - 1].0 - all[0].0;
    let moved: Vec<&(f64, bool, usize)> = all.iter().filter(|(q, ..)| (q - rest).abs() > SAME * way).collect();
    let rows: Vec<usize> = moved.iter().filter(|(_, out, _)| *out).map(|(.., row)| *row).collect();
    let chance = tests as f64 * by_chance(all.len(), moved.len(), of.outliers.len(), rows.len());
    if rows.is_empty() || (rows.len() as f64) < NEARLY_ALL * moved.len() as f64 || chance > CHANCE {
        return None;
    }
    let (every, among) = match rows.len() == moved.len() {
        true => ("every row", String::new()),
        false => ("nearly every row", format!(" of {}", moved.len())),
    };
    let said = format!(
        "{every} in which joint {} moves was left out ({}{among}): what is left does not show how it moves, and such rows are no gross errors; its \
         readings may be of another column, in another unit, counted the other way round or together with another joint's",
        joint + 1,
        rows.len(),
    );
    Some((chance, LeftOut { finding: finding(of.set, said, joint, rows), is_still: true }))
}

/// The rows beyond all others in a joint's range are left out.
fn beyond(of: &Rows, joint: usize, tests: usize) -> Option<LeftOut> {
    let all = readings(of, joint);
    let at_end = |reversed: bool| -> Vec<usize> {
        let at = |k: usize| if reversed { all[all.len() - 1 - k] } else { all[k] };
        (0..all.len()).map(at).take_while(|(_, out, _)| *out).map(|(.., row)| row).collect()
    };
    let (low, high) = (at_end(false), at_end(true));
    let (rows, way) = if low.len() > high.len() { (low, "below") } else { (high, "above") };
    let chance = tests as f64 * by_chance(all.len(), rows.len(), of.outliers.len(), rows.len());
    if (rows.len() as f64) < MANY * all.len() as f64 || rows.is_empty() || chance > CHANCE {
        return None;
    }
    let kept = all.iter().filter(|(_, out, _)| !out).map(|(q, ..)| *q);
    let end = if way == "below" { kept.fold(f64::INFINITY, f64::min) } else { kept.fold(f64::NEG_INFINITY, f64::max) };
    let (end, unit) = if of.set.is_sliding(joint) { (end, "mm") } else { (end.to_degrees(), "deg") };
    let said = format!(
        "every row in which joint {} is {way} {end:.1} {unit} was left out ({}): the robot that was found does not hold there",
        joint + 1,
        rows.len(),
    );
    Some(LeftOut { finding: finding(of.set, said, joint, rows), is_still: false })
}

fn finding(set: &Dataset, said: String, joint: usize, mut rows: Vec<usize>) -> Finding {
    rows.sort_unstable();
    Finding::new(said, format!("look at joint {} in these rows", joint + 1)).about(set.names(&rows))
}

/// Chance that so many or more of the `drawn` rows of `all` are among the `marked`.
fn by_chance(all: usize, marked: usize, drawn: usize, both: usize) -> f64 {
    let ln_factorial = |n: usize| (1..=n).map(|k| (k as f64).ln()).sum::<f64>();
    let choose = |n: usize, k: usize| ln_factorial(n) - ln_factorial(k) - ln_factorial(n - k);
    let chance = |k: usize| (choose(marked, k) + choose(all - marked, drawn - k) - choose(all, drawn)).exp();
    (both..=marked.min(drawn)).filter(|&k| drawn - k <= all - marked).map(chance).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::synthetic::planned;

    /// What is said of forty rows, joint 2 standing still where `moves` says so, of which these were left out.
    fn said(moves: impl Fn(usize) -> bool, outliers: &[usize]) -> Option<LeftOut> {
        let mut world = planned(36, 0, 25.0, 0.0, 1, &|_| {});
        for (row, of) in world.rows.iter_mut().enumerate() {
            of.at.joints_deg[1] = if moves(row) { 20.0 + row as f64 } else { 5.0 };
        }
        let set = Dataset::new(&world.rows).unwrap();
        let fitted: Vec<usize> = (0..set.poses.len()).filter(|row| !outliers.contains(row)).collect();
        of_a_joint(&set, &fitted, outliers)
    }

    #[test]
    fn rows_left_out_are_named_by_the_joint_that_moves_in_them_alone() {
        let all = said(|row| (7..13).contains(&row), &[7, 8, 9, 10, 11, 12]).unwrap();
        assert!(
            all.is_still && all.finding.finding.contains("every row in which joint 2 moves was left out (6)"),
            "{all:?}"
        );
        assert_eq!(all.finding.rows.len(), 6);
        // Beside another gross error, and but for one.
        assert!(said(|row| (7..13).contains(&row), &[3, 7, 8, 9, 10, 11, 12]).is_some_and(|found| found.is_still));
        let most = said(|row| (7..13).contains(&row), &[7, 8, 9, 10, 12]).unwrap();
        assert!(most.is_still && most.finding.finding.starts_with("nearly every row"), "{most:?}");
        // Half of them, other rows, and a joint that always moves but is far out in some.
        assert_eq!(said(|row| (7..13).contains(&row), &[7, 9, 11]), None);
        assert_eq!(said(|row| (7..13).contains(&row), &[20, 25, 30]), None);
        let end = said(|_| true, &[36, 37, 38, 39]).unwrap();
        assert!(!end.is_still && end.finding.finding.contains("joint 2 is above 55.0 deg was left out (4)"), "{end:?}");
    }

    #[test]
    fn chances_of_a_draw_are_those_of_a_hand_count() {
        // All three of three among ten: one of 120 draws.
        assert!((by_chance(10, 3, 3, 3) - 1.0 / 120.0).abs() < 1e-12);
        assert!((by_chance(10, 3, 3, 0) - 1.0).abs() < 1e-12);
    }
}
