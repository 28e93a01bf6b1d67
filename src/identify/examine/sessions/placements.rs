//! Placements that changed by so much along the rows of a group that no linear model holds.
//!
//! In: points in the order of measurement, and the robot of the file. Out: the set with each group cut where another
//! placement begins, or nothing. Method: for each number of placements the cuts with which the file's robot leaves the
//! least squares, each stretch of rows with a rigid placement of its own (dynamic programming: Bellman, 1961), the
//! target's place solved with them, rows that are off by themselves left out. They are steps where each stands out:
//! with one placement the rows beside it leave more than with two, by far more than beside any row that is none, which
//! errors that are smooth along the rows do not; and the links that are fitted then leave far less. What goes wrong:
//! stretches of fewer than twice [`SHORTEST`] rows, if all are so short; a robot file that is off by as much as the
//! placements.

use nalgebra::{DMatrix, Point3};

use crate::geometry::fitted_frame;
use crate::identify::data::dataset::{Dataset, Group, Kind};
use crate::identify::examine::misfit::{EXPLAINS, ROWS};
use crate::identify::examine::shifted;
use crate::identify::sensor::REPEATABILITY_MM;
use crate::identify::settings::Settings;
use crate::identify::solve::robust::Loss;
use crate::identify::solve::task::Task;
use crate::robot::Robot;
use crate::statistics::median;

/// Fewest fitted rows of a session: twice its own unknowns.
pub const SHORTEST: usize = 8;

/// Robust standard deviations from which on a row counts no more the farther it is off: a few that are off by metres
/// would hide a step.
pub(super) const GROSS: f64 = 8.0;

/// Rounds in which the target's place is found beside the placements.
const PLACING_ROUNDS: usize = 20;

/// The set with its groups cut where another placement begins, where links that are fitted then leave far less than
/// they did, mm.
pub(super) fn parted(set: &Dataset, robot: &Robot, settings: &Settings, left_mm: f64) -> Option<Dataset> {
    if set.kind != Kind::Positions || set.poses.iter().any(|pose| pose.on_body_mm.is_some()) {
        return None;
    }
    let (mut cut, rows) = (set.clone(), set.fit_rows());
    for group in 0..set.groups.len() {
        let cuts = cuts(set, robot, &set.of_group(&rows, group)).unwrap_or_default();
        cuts.into_iter().for_each(|row| split(&mut cut, row));
    }
    if cut.groups.len() == set.groups.len() {
        return None;
    }
    let parameters = robot.mdh_parameters();
    let fit = Task::plain(&cut, robot, &parameters, &rows, settings).robust(Loss::Absolute).ok()?;
    (EXPLAINS * fit.scatter.point_mm < left_mm).then_some(cut)
}

/// The rows of a group at which another placement begins.
fn cuts(set: &Dataset, robot: &Robot, rows: &[usize]) -> Option<Vec<usize>> {
    let rows = &without_lone(set, robot, rows)?;
    let step = rows.len().div_ceil(ROWS).max(1);
    let some: Vec<usize> = rows.iter().copied().step_by(step).collect();
    let others: Vec<usize> = (0..set.poses.len()).filter(|row| !some.contains(row)).collect();
    let part = set.clone().without(&others, "");
    let squares = Stretch::new(&part, robot)?.all_squares();
    let found = |count: usize| {
        // The target may stand elsewhere than in the file.
        let mut placed = part.clone();
        cuts_of(&squares, count).into_iter().for_each(|at| split(&mut placed, at));
        let tool_mm = shifted::Rows::new(&placed, robot)?.tool_mm(PLACING_ROUNDS);
        let robot = Robot { tool_mm, ..robot.clone() };
        let stretch = Stretch::new(&part, &robot)?;
        let cuts = cuts_of(&stretch.all_squares(), count);
        stretch.stand_out(&cuts).then_some((cuts, robot))
    };
    let (cuts, robot) = (2..=some.len() / SHORTEST).find_map(found)?;
    // Between the rows that were looked at, too.
    let others: Vec<usize> = (0..set.poses.len()).filter(|row| !rows.contains(row)).collect();
    let all = Stretch::new(&set.clone().without(&others, ""), &robot)?;
    let ends: Vec<usize> = [0].into_iter().chain(cuts.iter().map(|at| at * step)).chain([rows.len()]).collect();
    let best = |ends: &[usize]| {
        let left = |at: &usize| all.squares(ends[0], *at) + all.squares(*at, ends[2]);
        (ends[1] + 1 - step..=ends[1]).min_by(|a, b| left(a).total_cmp(&left(b)))
    };
    ends.windows(3).map(|ends| best(ends).map(|at| rows[at])).collect()
}

/// These rows without those that are off by themselves: of no placement they are as far from the rows around them as
/// the robot has it.
fn without_lone(set: &Dataset, robot: &Robot, rows: &[usize]) -> Option<Vec<usize>> {
    let target = |row: usize| robot.target_mm(&set.poses[row].joints_rad);
    let point = |row: usize| set.poses[row].reading.point_mm();
    let off = |at: usize| {
        let around = at.saturating_sub(SHORTEST / 2)..(at + SHORTEST / 2 + 1).min(rows.len());
        let apart = around.filter(|other| *other != at).map(|other| (rows[at], rows[other]));
        let off = |(a, b)| Some(((point(a)? - point(b)?).norm() - (target(a) - target(b)).norm()).abs());
        let mut off: Vec<f64> = apart.map(off).collect::<Option<_>>()?;
        // Beside a cut half of the others are of another placement, and some of the rest may be off themselves.
        off.sort_by(f64::total_cmp);
        off.get(SHORTEST / 4).copied()
    };
    let off: Vec<f64> = (0..rows.len()).map(off).collect::<Option<_>>()?;
    let limit_mm = GROSS * median(off.iter().copied())?.max(REPEATABILITY_MM);
    Some(rows.iter().zip(off).filter(|(_, off)| *off <= limit_mm).map(|(row, _)| *row).collect())
}

/// Where all but the first of so many placements begin that leave the least squares, of those of all stretches.
fn cuts_of(squares: &DMatrix<f64>, count: usize) -> Vec<usize> {
    let rows = squares.nrows() - 1;
    // Of each number of placements: what they leave of the rows before a place, and where the last of them begins.
    let mut least: Vec<Vec<(f64, usize)>> = vec![(0..=rows).map(|end| (squares[(0, end)], 0)).collect()];
    for _ in 1..count {
        let before = &least[least.len() - 1];
        let best = |end: usize| {
            let left = (0..end).map(|at| (before[at].0 + squares[(at, end)], at));
            left.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::INFINITY, 0))
        };
        least.push((0..=rows).map(best).collect());
    }
    let mut cuts = Vec::new();
    for of_count in least[1..].iter().rev() {
        cuts.push(of_count[cuts.last().copied().unwrap_or(rows)].1);
    }
    cuts.reverse();
    cuts
}

/// Rows in their order: where the robot has the target, and where it was read.
struct Stretch {
    targets: Vec<Point3<f64>>,
    points: Vec<Point3<f64>>,
}

impl Stretch {
    fn new(set: &Dataset, robot: &Robot) -> Option<Stretch> {
        let targets = set.poses.iter().map(|pose| robot.target_mm(&pose.joints_rad)).collect();
        let points = set.poses.iter().map(|pose| pose.reading.point_mm()).collect::<Option<_>>()?;
        Some(Stretch { targets, points })
    }

    /// What one placement leaves of the rows from the first to before the last, mm^2.
    fn squares(&self, first: usize, last: usize) -> f64 {
        let pairs = || self.targets[first..last].iter().zip(&self.points[first..last]);
        let frame = fitted_frame(pairs().map(|(target, point)| (*target, *point, 1.0)));
        pairs().map(|(target, point)| (frame * target - point).norm_squared()).sum()
    }

    /// The same of all stretches that are long enough.
    fn all_squares(&self) -> DMatrix<f64> {
        let rows = self.points.len();
        let of = |first: usize, last: usize| match last < first + SHORTEST {
            true => f64::INFINITY,
            false => self.squares(first, last),
        };
        DMatrix::from_fn(rows + 1, rows + 1, of)
    }

    /// By what factor one placement leaves more squares than two of the rows beside a place.
    fn step(&self, at: usize) -> f64 {
        let floor = 2.0 * SHORTEST as f64 * REPEATABILITY_MM.powi(2);
        let apart = self.squares(at - SHORTEST, at) + self.squares(at, at + SHORTEST);
        self.squares(at - SHORTEST, at + SHORTEST) / apart.max(floor)
    }

    /// Whether at each of these places there is far more of a step than where no cut is near.
    fn stand_out(&self, cuts: &[usize]) -> bool {
        let places = SHORTEST..=self.points.len().saturating_sub(SHORTEST);
        let clean = places.filter(|at| cuts.iter().all(|cut| cut.abs_diff(*at) >= SHORTEST));
        let usual = clean.map(|at| self.step(at)).reduce(f64::max);
        usual.is_some_and(|usual| cuts.iter().all(|cut| self.step(*cut) > EXPLAINS.powi(2) * usual))
    }
}

/// Starts a new group at `row`: it and all later rows of its group move there.
pub fn split(set: &mut Dataset, row: usize) {
    let group = set.poses[row].group;
    let name = set.groups[group].name.clone();
    set.groups.push(Group { name, center: None });
    let fresh = set.groups.len() - 1;
    for pose in set.poses.iter_mut().skip(row).filter(|p| p.group == group) {
        pose.group = fresh;
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::identify::synthetic::{self, World, planned};
    use crate::measurements::Role;

    /// Rows of so many spheres, one after the other and each seen from a placement of its own, so many of each, as one
    /// group; with a tool that stands so far from the file's.
    fn in_blocks(blocks: usize, each: usize, tool_mm: f64, seed: u64) -> (World, Dataset) {
        let off_mm = tool_mm * Vector3::new(0.6, -0.5, 0.6);
        let mut world = planned(4 * each, 0, 25.0, 0.02, seed, &|robot| robot.tool_mm += off_mm);
        let of_block = |block: usize| {
            let name = format!("g{block}");
            world.rows.iter().filter(move |row| row.at.group == name).take(each).cloned().collect::<Vec<_>>()
        };
        world.rows = (0..blocks).flat_map(of_block).collect();
        for row in &mut world.rows {
            (row.at.group, row.at.role) = ("one".to_owned(), Role::Sample);
        }
        let set = Dataset::new(&world.rows).unwrap();
        (world, set)
    }

    fn begins(world: &World, set: &Dataset) -> Vec<usize> {
        cuts(set, &world.nominal, &set.fit_rows()).unwrap_or_default()
    }

    #[test]
    fn placements_begin_where_they_do_whatever_the_tool_is() {
        for (blocks, each) in [(2, 19), (3, 19), (4, 19), (4, 50), (2, 90)] {
            for (tool_mm, seed) in [(0.0, 1), (3.0, 2), (60.0, 3)] {
                let (world, set) = in_blocks(blocks, each, tool_mm, seed);
                let right: Vec<usize> = (1..blocks).map(|block| block * each).collect();
                assert_eq!(begins(&world, &set), right, "{blocks} of {each}, tool {tool_mm} mm off");
                let (cut, along) = super::super::find(&set, &world.nominal, &Settings::default());
                assert_eq!((cut.groups.len(), along.sessions.len()), (blocks, blocks), "{along:?}");
                assert!(along.drifting.is_empty() && along.instead.is_none(), "{along:?}");
            }
        }
    }

    /// Neither of one placement nor of a robot that is another, be its rows in any order or along a joint.
    #[test]
    fn one_placement_is_not_cut() {
        for seed in 0..4 {
            let (mut world, set) = in_blocks(1, 60, 0.0, seed);
            assert_eq!(begins(&world, &set), [0; 0], "{seed}");
            for (i, joint) in world.nominal.joints.iter_mut().enumerate() {
                joint.a_mm += 150.0 * (1.0 + 2.0 * i as f64 + seed as f64).sin();
                joint.alpha_rad += 0.5 * (2.0 + i as f64).cos();
            }
            assert_eq!(begins(&world, &set), [0; 0], "another robot, {seed}");
            for joint in 0..6 {
                world.rows.sort_by(|a, b| a.at.joints_deg[joint].total_cmp(&b.at.joints_deg[joint]));
                let sorted = Dataset::new(&world.rows).unwrap();
                assert_eq!(begins(&world, &sorted), [0; 0], "along joint {}, {seed}", joint + 1);
            }
        }
    }

    #[test]
    fn rows_that_were_misread_hide_no_placement() {
        for off_mm in [3.0, 30.0, 300.0, 3000.0] {
            let (mut world, _) = in_blocks(3, 25, 3.0, 4);
            for (k, row) in [2, 23, 27, 40, 66].into_iter().enumerate() {
                let way = Vector3::new((k as f64).sin(), (k as f64).cos(), 0.5);
                *synthetic::point(&mut world.rows[row]) += off_mm * way;
            }
            let set = Dataset::new(&world.rows).unwrap();
            assert_eq!(begins(&world, &set), [25, 50], "{off_mm} mm");
        }
    }

    #[test]
    fn rows_that_are_thinned_are_cut_at_their_own() {
        let (world, set) = in_blocks(3, 70, 0.0, 5);
        assert_eq!(begins(&world, &set), [70, 140]);
    }
}
