//! Rows that were left out because of what a joint did in them: they are the ones that tell of it, and no gross errors.
//!
//! In: the rows that were fitted and those that were left out, with the errors that the robot has in these. Out: the
//! joint, and the finding. Method: four looks. A column that stands some rows off in them. Rows in which a joint is not
//! where it is in most of them, and rows that fill a part of its range: how likely it is that so many of them are among
//! those left out by chance (the hypergeometric distribution). Errors along which a joint moves the target: gross
//! errors go anywhere, so that the cosine to any direction is as often of one size as of another, and the cosines
//! together are tested (Fisher's method). A joint that stands elsewhere is told from one that a load bends by the
//! amounts: alike, or as the torque about it; else both are named. Each times the joints and ways that were looked at.
//! Goes wrong: a joint that moves in every row; few rows whose errors share a direction in the sensor's frame, which is
//! then no joint's.

mod shifted_column;

use nalgebra::{Matrix3, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::difference::TOLD_APART;
use crate::identify::data::dataset::Dataset;
use crate::identify::finding::Finding;
use crate::identify::judge::errors::RowError;
use crate::robot::corrections::LoadPoint;
use crate::robot::{Parameter, Robot};
use crate::statistics::median;

/// Share of a joint's way within which it is where it was.
const SAME: f64 = 1e-3;

/// Share of the rows in which a joint moves, or is in a part of its range, that must be left out.
const NEARLY_ALL: f64 = 0.8;

/// Chance with which rows left out are those of one joint by accident.
const CHANCE: f64 = 1e-3;

/// Share of all rows from which on those left out are more than a few that the sensor saw badly, and than what errors
/// below which nineteen of twenty stay may leave out.
const MANY: f64 = 0.05;

/// Share of the errors' squares along a joint's motion that explains them; of errors that go anywhere it is a third.
const EXPLAINED: f64 = 0.8;

/// By how much a joint is turned to see where it moves the target, rad (of a sliding joint mm).
const TURN: f64 = 1e-4;

/// The joint whose rows were left out, if they are one joint's. `errors` are the robot's in those rows, of the set with
/// their joints as they are or moved.
pub fn of_a_joint(
    set: &Dataset,
    robot: &Robot,
    fitted: &[usize],
    outliers: &[usize],
    errors: &dyn Fn(&Dataset) -> Vec<RowError>,
) -> Option<Finding> {
    let (rows, joints) = (Rows { set, robot, fitted, outliers }, set.joint_count());
    let first = |look: &dyn Fn(usize) -> Option<(f64, Finding)>| {
        (0..joints).filter_map(look).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, finding)| finding)
    };
    let shifted = shifted_column::find(set, outliers, errors).map(|(joint, by)| shifted(&rows, joint, by));
    let moving = || first(&|joint| moves(&rows, joint));
    shifted.or_else(moving).or_else(|| first(&|joint| within(&rows, joint))).or_else(|| along(&rows, errors))
}

/// The rows that were fitted and those that were left out.
struct Rows<'a> {
    set: &'a Dataset,
    robot: &'a Robot,
    fitted: &'a [usize],
    outliers: &'a [usize],
}

impl Rows<'_> {
    /// All rows and those left out, by a joint's reading.
    fn readings(&self, joint: usize) -> Vec<(f64, bool, usize)> {
        let of = |list: &[usize], out: bool| {
            list.iter().map(|&row| (self.set.poses[row].joints_rad[joint], out, row)).collect::<Vec<_>>()
        };
        let mut all = [of(self.fitted, false), of(self.outliers, true)].concat();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all
    }

    /// A joint's reading as people count it.
    fn shown(&self, joint: usize, q: f64) -> (f64, &'static str) {
        if self.set.is_sliding(joint) { (q, "mm") } else { (q.to_degrees(), "deg") }
    }

    /// The way of a joint over its readings; a cell that lost its decimal point takes no arm round a hundred times.
    fn way(&self, joint: usize, readings: &[(f64, bool, usize)]) -> f64 {
        let way = readings.last().zip(readings.first()).map_or(0.0, |(last, first)| last.0 - first.0);
        if self.set.is_sliding(joint) { way } else { way.min(std::f64::consts::TAU) }
    }

    /// Whether a joint was read at one and the same place in nearly all of these rows: then its reading stood still,
    /// and nothing is said of the robot.
    fn is_stuck(&self, joint: usize, rows: &[usize]) -> bool {
        let of = |row: &usize| self.set.poses[*row].joints_rad[joint];
        let Some(at) = median(rows.iter().map(of)) else { return false };
        let most = SAME * self.way(joint, &self.readings(joint));
        let same = rows.iter().filter(|row| (of(row) - at).abs() <= most).count();
        same as f64 >= NEARLY_ALL * rows.len() as f64
    }

    /// What turns a joint by these amounts in the rows that were left out, each with its weight.
    fn cause(&self, joint: usize, amounts: &[(f64, f64)]) -> String {
        let number = joint + 1;
        let (elsewhere, bent) = (format!("joint {number} stood elsewhere"), format!("a load bent joint {number}"));
        if self.set.is_sliding(joint) {
            return elsewhere;
        }
        let moved = |parameter: Parameter, q: &[f64]| {
            self.robot.shifted(&[parameter], &[1.0]).target_mm(q) - self.robot.target_mm(q)
        };
        let torque = |&row: &usize| {
            let q = &self.set.poses[row].joints_rad;
            let (turn, load) =
                (moved(Parameter::Theta(joint), q), moved(Parameter::Gravity(joint, LoadPoint::Tool), q));
            turn.dot(&load) / turn.norm_squared().max(f64::MIN_POSITIVE)
        };
        let torques: Vec<f64> = self.outliers.iter().map(torque).collect();
        // Squares that are left where amounts are a multiple of these numbers.
        let left = |of: &dyn Fn(usize) -> f64| {
            let sum = |f: &dyn Fn(usize) -> f64| (0..amounts.len()).map(|k| amounts[k].1 * f(k)).sum::<f64>();
            let [both, own] = [sum(&|k| amounts[k].0 * of(k)), sum(&|k| of(k).powi(2))];
            sum(&|k| amounts[k].0.powi(2)) - both * both / own.max(f64::MIN_POSITIVE)
        };
        let [alike, as_torques] = [left(&|_| 1.0), left(&|k| torques[k])].map(|left| left.max(f64::MIN_POSITIVE));
        let likelier = 0.5 * amounts.len() as f64 * (alike / as_torques).ln();
        match likelier {
            _ if likelier < -TOLD_APART => elsewhere,
            _ if likelier > TOLD_APART => bent,
            _ => format!("{elsewhere}, or {bent}, which they do not tell apart,"),
        }
    }

    fn are_many(&self, rows: usize) -> bool {
        rows > 0 && rows as f64 >= MANY * (self.fitted.len() + self.outliers.len()) as f64
    }
}

/// A joint's readings stand so many rows further down, in the rows that were left out.
fn shifted(of: &Rows, joint: usize, by: isize) -> Finding {
    let count = by.unsigned_abs();
    let said = format!(
        "{} of {} rows were left out, and would fit if the column of joint {} stood {count} {} further {} in them: cells of it were lost, or are \
         there twice",
        of.outliers.len(),
        of.fitted.len() + of.outliers.len(),
        joint + 1,
        if count == 1 { "row" } else { "rows" },
        if by > 0 { "up" } else { "down" },
    );
    Finding::new(said, format!("mend the column of joint {} from the first of them on", joint + 1))
        .about(of.set.names(of.outliers))
}

/// Where a joint stands in most rows, the rows in which it does not are left out.
fn moves(of: &Rows, joint: usize) -> Option<(f64, Finding)> {
    let all = of.readings(joint);
    let rest = all.get(all.len() / 2)?.0;
    let way = of.way(joint, &all);
    let moved: Vec<&(f64, bool, usize)> = all.iter().filter(|(q, ..)| (q - rest).abs() > SAME * way).collect();
    let rows: Vec<usize> = moved.iter().filter(|(_, out, _)| *out).map(|(.., row)| *row).collect();
    let tests = 3 * of.set.joint_count();
    let chance = tests as f64 * by_chance(all.len(), moved.len(), of.outliers.len(), rows.len());
    if rows.is_empty() || (rows.len() as f64) < NEARLY_ALL * moved.len() as f64 || chance > CHANCE {
        return None;
    }
    let said = format!(
        "{} in which joint {} moves was left out ({}): what is left does not show how it moves, and such rows are no gross errors; its \
         readings may be of another column, in another unit, counted the other way round or together with another joint's",
        every(rows.len(), moved.len()),
        joint + 1,
        among(rows.len(), moved.len()),
    );
    Some((chance, finding(of.set, said, joint, rows)))
}

/// The rows in a part of a joint's range are left out: the part with most of them.
fn within(of: &Rows, joint: usize) -> Option<(f64, Finding)> {
    let all = of.readings(joint);
    let out: Vec<usize> = (0..all.len()).filter(|&k| all[k].1).collect();
    let parts = (0..out.len()).flat_map(|a| (a..out.len()).map(move |b| (a, b)));
    let nearly_all = |&(a, b): &(usize, usize)| (b - a + 1) as f64 >= NEARLY_ALL * (out[b] - out[a] + 1) as f64;
    let (a, b) = parts.filter(nearly_all).max_by_key(|&(a, b)| (b - a, std::cmp::Reverse(out[b] - out[a])))?;
    let (low, high, count) = (out[a], out[b], b - a + 1);
    let marked = high - low + 1;
    // At an end there are two parts of each size, elsewhere as many as pairs of rows.
    let at_end = low == 0 || high + 1 == all.len();
    let ways = if at_end { 3 } else { 3 + out.len() * (out.len() + 1) / 2 };
    let chance = (of.set.joint_count() * ways) as f64 * by_chance(all.len(), marked, out.len(), count);
    let rows: Vec<usize> = all[low..=high].iter().filter(|(_, out, _)| *out).map(|(.., row)| *row).collect();
    if !of.are_many(count) || chance > CHANCE || of.is_stuck(joint, &rows) {
        return None;
    }
    let shown = |k: usize| of.shown(joint, all[k].0);
    let place = match (low.checked_sub(1), all.get(high + 1)) {
        (_, None) => format!("above {:.1} {}", shown(low.saturating_sub(1)).0, shown(low).1),
        (None, _) => format!("below {:.1} {}", shown(high + 1).0, shown(low).1),
        _ => format!("from {:.1} to {:.1} {}", shown(low).0, shown(high).0, shown(low).1),
    };
    let said = format!(
        "{} in which joint {} is {place} was left out ({}): the robot that was found does not hold there",
        every(count, marked),
        joint + 1,
        among(count, marked),
    );
    Some((chance, finding(of.set, said, joint, rows)))
}

/// The errors of the rows that were left out lie along what a joint moves.
fn along(of: &Rows, errors: &dyn Fn(&Dataset) -> Vec<RowError>) -> Option<Finding> {
    let points = |set: &Dataset| -> Vec<Vector3<f64>> { errors(set).iter().filter_map(|e| e.point_mm).collect() };
    let here = points(of.set);
    if !of.are_many(here.len()) || here.len() != of.outliers.len() || here.iter().any(|e| e.norm() == 0.0) {
        return None;
    }
    let of_joint = |joint: usize| {
        let mut moved = of.set.clone();
        of.outliers.iter().for_each(|&row| moved.poses[row].joints_rad[joint] += TURN);
        let by = |(there, here): (Vector3<f64>, &Vector3<f64>)| (there - here) / TURN;
        let motion: Vec<Vector3<f64>> = points(&moved).into_iter().zip(&here).map(by).collect();
        let share = |(e, d): (&Vector3<f64>, &Vector3<f64>)| {
            (e.dot(d).powi(2) / (e.norm_squared() * d.norm_squared())).min(1.0)
        };
        let shares: Vec<f64> = here.iter().zip(&motion).map(share).filter(|share| share.is_finite()).collect();
        let amounts: Vec<(f64, f64)> =
            here.iter().zip(&motion).map(|(e, d)| (e.dot(d) / d.norm_squared(), d.norm_squared())).collect();
        let explained = shares.iter().sum::<f64>() / shares.len() as f64;
        (shares.len() == here.len()).then(|| (explained, joint, by_cosines(&shares), amounts))
    };
    let joints = of.set.joint_count();
    let best = (0..joints).filter_map(of_joint).max_by(|a, b| a.0.total_cmp(&b.0));
    let (explained, joint, chance, amounts) = best?;
    let amount = median(amounts.iter().map(|(amount, _)| amount.abs()))?;
    // What goes one way in the sensor's frame is the sensor's.
    let of_sensor =
        here.iter().map(|e| e.normalize() * e.normalize().transpose()).sum::<Matrix3<f64>>() / here.len() as f64;
    let is_sensors = explained < of_sensor.symmetric_eigenvalues().max();
    if explained < EXPLAINED || is_sensors || joints as f64 * chance > CHANCE || of.is_stuck(joint, of.outliers) {
        return None;
    }
    let (amount, unit) = of.shown(joint, amount);
    let all = of.fitted.len() + of.outliers.len();
    let said = format!(
        "{} of {all} rows were left out, and their errors are alike: as if {} in them, by {amount:.2} {unit} in the median \
         ({:.0} % of their squares); that is no gross error, and the robot that was found does not hold there",
        here.len(),
        of.cause(joint, &amounts),
        100.0 * explained,
    );
    Some(finding(of.set, said, joint, of.outliers.to_vec()))
}

fn every(left_out: usize, all: usize) -> &'static str {
    if left_out == all { "every row" } else { "nearly every row" }
}

fn among(left_out: usize, all: usize) -> String {
    if left_out == all { left_out.to_string() } else { format!("{left_out} of {all}") }
}

fn finding(set: &Dataset, said: String, joint: usize, mut rows: Vec<usize>) -> Finding {
    rows.sort_unstable();
    Finding::new(said, format!("look at joint {} in these rows", joint + 1)).about(set.names(&rows))
}

/// Chance that vectors that go anywhere are so near to given lines, by their squared cosines.
fn by_cosines(squares: &[f64]) -> f64 {
    let sum: f64 = squares.iter().map(|square| -2.0 * (1.0 - square.sqrt()).max(f64::MIN_POSITIVE).ln()).sum();
    ChiSquared::new(2.0 * squares.len() as f64).map_or(1.0, |chi_squared| chi_squared.sf(sum))
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
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use crate::identify::judge::errors::Judge;
    use crate::identify::synthetic::{self, planned};
    use crate::measurements::{Measurement, Role};

    /// What is said of forty rows, joint 2 moving where `moves` says so alone, of which these were left out.
    fn said(moves: impl Fn(usize) -> bool, outliers: &[usize]) -> Option<Finding> {
        said_where(|row| if moves(row) { 20.0 + row as f64 } else { 5.0 }, outliers)
    }

    fn said_where(joint_deg: impl Fn(usize) -> f64, outliers: &[usize]) -> Option<Finding> {
        let mut world = planned(36, 0, 25.0, 0.0, 1, &|_| {});
        for (row, of) in world.rows.iter_mut().enumerate() {
            of.at.joints_deg[1] = joint_deg(row);
        }
        let set = Dataset::new(&world.rows).unwrap();
        let fitted: Vec<usize> = (0..set.poses.len()).filter(|row| !outliers.contains(row)).collect();
        of_a_joint(&set, &world.nominal, &fitted, outliers, &|_| Vec::new())
    }

    #[test]
    fn a_joint_that_moves_in_all_rows_but_lost_its_decimal_point_in_some() {
        let lost = |row: usize| if (7..13).contains(&row) { 27_631.0 } else { 5.0 * row as f64 - 90.0 };
        let said = said_where(lost, &[7, 8, 9, 10, 11, 12]);
        assert!(said.is_none_or(|said| !said.finding.contains("moves was left out")));
    }

    #[test]
    fn rows_left_out_are_named_by_the_joint_that_moves_in_them_alone() {
        let all = said(|row| (7..13).contains(&row), &[7, 8, 9, 10, 11, 12]).unwrap();
        assert!(all.finding.contains("every row in which joint 2 moves was left out (6)"), "{all:?}");
        assert_eq!(all.rows.len(), 6);
        // Beside another gross error, and but for one.
        assert!(said(|row| (7..13).contains(&row), &[3, 7, 8, 9, 10, 11, 12]).is_some());
        let most = said(|row| (7..13).contains(&row), &[7, 8, 9, 10, 12]).unwrap();
        assert!(most.finding.starts_with("nearly every row in which joint 2 moves"), "{most:?}");
        // Half of them, other rows, and a joint that always moves but is far out in some, or in the middle of its way.
        assert_eq!(said(|row| (7..13).contains(&row), &[7, 9, 11]), None);
        assert_eq!(said(|row| (7..13).contains(&row), &[20, 25, 30]), None);
        let end = said(|_| true, &[36, 37, 38, 39]).unwrap();
        assert!(end.finding.contains("joint 2 is above 55.0 deg was left out (4)"), "{end:?}");
        let middle = said(|_| true, &[14, 15, 16, 17, 18]).unwrap();
        assert!(middle.finding.contains("joint 2 is from 34.0 to 38.0 deg was left out (5)"), "{middle:?}");
        assert_eq!(said(|_| true, &[3, 11, 17, 24, 33]), None);
    }

    /// What is said of sixty rows after this was done to some of them, and how many were left out.
    fn said_of_world(spoil: impl Fn(&mut Measurement, u64)) -> (Option<Finding>, usize) {
        let mut world = synthetic::world(60, 0.02, 3);
        world.rows.iter_mut().zip(0..).for_each(|(row, k)| spoil(row, k));
        let (set, found) = world.identified(&world.rows);
        let errors = |set: &Dataset| Judge::plain(set, &found.fitted, false).errors(found.robot(), &found.outliers);
        (of_a_joint(&set, found.robot(), &found.fitted, &found.outliers, &errors), found.outliers.len())
    }

    /// A weight turns a joint by as much as its torque about it; an arm that does not move far from its load's side
    /// tells no two apart.
    #[test]
    fn a_load_in_some_rows_is_named_and_not_a_joint_alone() {
        let robot = Robot::paper();
        for (joint, size) in [(1, 20.0), (2, 20.0), (2, 60.0)] {
            let (said, count) = said_of_world(|row, k| {
                if row.at.role == Role::Sample && k % 7 == 2 {
                    let q = row.at.joints_rad();
                    let by = |p: Parameter| robot.shifted(&[p], &[1.0]).target_mm(&q) - robot.target_mm(&q);
                    let (turn, load) = (by(Parameter::Theta(joint)), by(Parameter::Gravity(joint, LoadPoint::Tool)));
                    row.at.joints_deg[joint] -= size * (1e-3 * turn.dot(&load) / turn.norm_squared()).to_degrees();
                }
            });
            let said = said.unwrap_or_else(|| panic!("joint {joint}: {count} left out"));
            assert!(said.finding.contains(&format!("a load bent joint {}", joint + 1)), "{said:?}");
        }
    }

    #[test]
    fn errors_of_a_joint_that_stands_elsewhere_are_no_gross_errors() {
        for (joint, deg) in [(1, 0.3), (4, 0.5), (2, 0.2)] {
            // In rows that fill no part of its range.
            let (said, count) = said_of_world(|row, k| {
                if row.at.role == Role::Sample && k % 7 == 2 {
                    row.at.joints_deg[joint] -= deg;
                }
            });
            let said = said.unwrap_or_else(|| panic!("joint {joint}: {count} left out"));
            assert!(said.finding.contains(&format!("joint {} stood elsewhere", joint + 1)), "{said:?}");
        }
        // Its reading stood still, or something else went wrong.
        let (said, count) = said_of_world(|row, k| {
            if (20..29).contains(&k) {
                row.at.joints_deg[3] = 12.0;
            }
        });
        assert!(said.is_none() && count > 4, "{count} left out: {said:?}");
        let (said, count) = said_of_world(|row, k| {
            if row.at.role == Role::Sample && k % 7 == 2 {
                *synthetic::point(row) += 2.0 * synthetic::normal(&mut Pcg64Mcg::seed_from_u64(k));
            }
        });
        assert!(said.is_none() && count > 6, "{count} left out: {said:?}");
        // Errors of one direction in the sensor's frame.
        let (said, count) = said_of_world(|row, k| {
            if row.at.role == Role::Sample && k % 7 == 2 {
                *synthetic::point(row) += Vector3::new(0.1, 0.2, 2.0 + 0.1 * k as f64);
            }
        });
        assert!(said.is_none() && count > 6, "{count} left out: {said:?}");
    }

    #[test]
    fn chances_of_a_draw_are_those_of_a_hand_count() {
        // All three of three among ten: one of 120 draws.
        assert!((by_chance(10, 3, 3, 3) - 1.0 / 120.0).abs() < 1e-12);
        assert!((by_chance(10, 3, 3, 0) - 1.0).abs() < 1e-12);
    }
}
