//! Columns and units held against the nominal robot: the right ones leave what a built robot is off by, wrong ones what
//! the points are apart.
//!
//! In: ways to read a table. Out: the one that is taken, and how sure it is. The tool and the sensor's place are solved
//! for each (see [`Robot::fit_tool`]); what is left is judged as a share of the spread of the predicted or the measured
//! points, whichever is less. A way is taken where it is near, no choice of other columns is, and other units leave
//! several times as much. What goes wrong: poses that hardly vary, and a robot file with other conventions, decide
//! nothing; the sizes of the numbers do then, where they can.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

use super::layout::point;
use super::part::{At, Part};
use super::pick::{self, Picked};
use crate::geometry::Transform;
use crate::robot::tool_fit::{Start, ToolFit, middle_spread};
use crate::robot::{Joint, Robot};
use crate::tables::names::{Unit, What};

/// What is left as a share of the points' spread at the most where columns and units are right and the robot's file is
/// of this robot: a robot of a metre's reach that is off by five hundredths of it is none that was built. Points that
/// have nothing to do with the joints leave a share whose square is distributed as Beta(f / 2, 9 / 2), f = 3 n - 9
/// numbers of n rows being left beside placement and tool: less than this with a probability of 4e-7 for five rows, and
/// with 1e-3 for four, which is too much where a thousand choices of columns are tried.
pub(in crate::measurements) const NEAR: f64 = 0.05;

/// Rows from which on chance does not come near.
const FEWEST: usize = 5;

/// How many times more another unit must leave: the ratio of two mean squares of f = 6 numbers, those of five rows,
/// exceeds the square of it by chance in one of five hundred.
const CLEAR: f64 = 4.0;

/// How many times more a unit that a name states must leave than another for the name to be wrong: the square of it is
/// exceeded by chance in one of a hundred thousand for five rows, and a name is worth more than a guess.
const WRONG: f64 = 10.0;

/// A nominal robot that predicts points to this, mm, has computed them: no instrument reads points of a moving arm to a
/// micrometre.
const COMPUTED_MM: f64 = 1e-3;

/// Points beyond this are in no metres.
const METRES: f64 = 10.0;

/// Rows that are looked at.
const ROWS: usize = 60;

/// A way to read a table.
#[derive(Debug, Clone)]
pub(in crate::measurements) struct Way {
    pub picked: Picked,
    pub joints: Unit,
    /// Unit of points or distances.
    pub lengths: Unit,
    /// Share of the points' spread that is left; `None` where nothing can be said.
    pub left: Option<f64>,
    /// The same in mm.
    pub left_mm: f64,
}

impl Way {
    fn unjudged(picked: &Picked, joints: Unit, lengths: Unit) -> Way {
        Way { picked: picked.clone(), joints, lengths, left: None, left_mm: f64::INFINITY }
    }

    /// With what the nominal robot leaves of these columns in these units; of rows that name their placement or their
    /// target those of the one that has most.
    fn judged(mut self, parts: &[Part], robot: &Robot) -> Way {
        if let Some((left, left_mm)) = self.left_of(parts, robot, &some(parts, &self.picked)) {
            (self.left, self.left_mm) = (Some(left), left_mm);
        }
        self
    }

    /// The same with a tool that may be anywhere.
    fn judged_with_any_tool(mut self, parts: &[Part], robot: &Robot) -> Way {
        let fit = self.fit(parts, robot, &some(parts, &self.picked), Start::Around);
        if let Some((fit, _)) = fit.filter(|(fit, _)| fit.spread_mm > 0.0) {
            (self.left, self.left_mm) = (Some(fit.left_mm / fit.spread_mm), fit.left_mm);
        }
        self
    }

    /// What is left of these rows, as a share of the spread of the points and in mm.
    pub(in crate::measurements) fn left_of(&self, parts: &[Part], robot: &Robot, rows: &[usize]) -> Option<(f64, f64)> {
        let from = if self.picked.is_sure(parts) { Start::Around } else { Start::File };
        let (fit, predicted) = self.fit(parts, robot, rows, from)?;
        // Tiny motions under a tool that all but cancels them would come near to points that are small by a wrong unit.
        let least = middle_spread(&predicted)?.min(fit.spread_mm);
        (least > 0.0).then(|| (fit.left_mm / least, fit.left_mm))
    }

    /// How the flange stands in the frame of the first target's points, at some rows.
    pub(super) fn sensor_from_flange(&self, parts: &[Part], robot: &Robot) -> Option<Vec<(usize, Transform)>> {
        let rows = some(parts, &self.picked);
        let (fit, _) = self.fit(parts, robot, &rows, Start::Around)?;
        let at = |row: usize| {
            Some((row, fit.sensor_from_base * robot.base_from_flange(&self.joints_at(parts, robot, row)?)))
        };
        Some(rows.into_iter().filter_map(at).collect())
    }

    /// The robot's joints in a row, rad or mm.
    fn joints_at(&self, parts: &[Part], robot: &Robot, row: usize) -> Option<Vec<f64>> {
        let reading = |(at, joint): (&At, &Joint)| {
            let value = parts[at.part].optional(row, at.column).ok().flatten()?;
            let reading = pick::reading(parts, at, joint, value, self.joints, self.lengths);
            Some(if joint.slides { reading } else { reading.to_radians() })
        };
        self.picked.joints.iter().zip(&robot.joints).map(reading).collect()
    }

    /// The nominal robot with the tool that these rows ask for, and where it has its target with that of its file.
    fn fit(&self, parts: &[Part], robot: &Robot, rows: &[usize], from: Start) -> Option<(ToolFit, Vec<Vector3<f64>>)> {
        let (_, at) = self.picked.points.first()?;
        let (mut readings, mut points) = (Vec::new(), Vec::<Point3<f64>>::new());
        for &row in rows {
            if let (Some(angles), Some(point)) = (self.joints_at(parts, robot, row), point(parts, row, at)) {
                readings.push(angles);
                points.push(point.map(|v| self.lengths.converted(v)));
            }
        }
        let fit = robot.fit_tool(&readings, &points, from).filter(|_| readings.len() >= FEWEST)?;
        Some((fit, readings.iter().map(|q| robot.target_mm(q).coords).collect()))
    }

    /// Whether the points are the nominal robot's own.
    pub fn is_computed(&self) -> bool {
        self.left.is_some() && self.left_mm < COMPUTED_MM
    }
}

/// How a way was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::measurements) enum Basis {
    /// Names or flags say it.
    Stated,
    /// The nominal robot does.
    Robot,
    /// The sizes of the numbers do.
    Sizes,
}

pub(in crate::measurements) enum Verdict {
    /// This way.
    Taken(Way, Basis),
    /// A name states a unit that another one is much nearer than.
    WrongUnit { stated: Way, better: Way },
    /// Two ways that would do.
    Open(Way, Way),
    /// Nothing says which unit one of them is in.
    NoUnit { joints: Option<Unit>, lengths: Option<Unit> },
    /// No way is near.
    None,
}

/// Units that flags state, which nothing doubts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(in crate::measurements) struct Forced {
    pub joints: Option<Unit>,
    pub lengths: Option<Unit>,
}

/// The candidates in all units that may be, the one nearest to the robot first.
fn in_all_units(parts: &[Part], candidates: &[Picked], robot: &Robot, forced: Forced) -> Vec<Way> {
    let mut ways: Vec<Way> = Vec::new();
    for picked in candidates {
        for joints in [Unit::Deg, Unit::Rad].into_iter().filter(|u| forced.joints.is_none_or(|f| f == *u)) {
            for lengths in [Unit::Mm, Unit::M, Unit::Um, Unit::Cm, Unit::Inch] {
                let stated = forced.lengths.or(picked.length_unit);
                // Nobody writes others without saying so.
                let usual = matches!(lengths, Unit::Mm | Unit::M);
                if stated.map_or(usual, |s| s == lengths || forced.lengths.is_none() && usual) {
                    ways.push(Way::unjudged(picked, joints, lengths).judged(parts, robot));
                }
            }
        }
    }
    ways.sort_by(|a, b| a.left.unwrap_or(f64::INFINITY).total_cmp(&b.left.unwrap_or(f64::INFINITY)));
    ways
}

/// The candidates in the units that nobody need say, or in those that are stated, unjudged.
pub(in crate::measurements) fn usual(candidates: &[Picked], forced: Forced) -> Vec<Way> {
    let units = [(Unit::Deg, Unit::Mm), (Unit::Deg, Unit::M), (Unit::Rad, Unit::Mm), (Unit::Rad, Unit::M)];
    let way = |picked: &Picked, (joints, lengths): (Unit, Unit)| {
        let joints = forced.joints.or(picked.joint_unit).unwrap_or(joints);
        Way::unjudged(picked, joints, forced.lengths.or(picked.length_unit).unwrap_or(lengths))
    };
    candidates.iter().flat_map(|picked| units.map(|units| way(picked, units))).collect()
}

pub(in crate::measurements) fn decide(parts: &[Part], candidates: &[Picked], robot: &Robot, forced: Forced) -> Verdict {
    let unknown = |at: &At| parts[at.part].spare().contains(&at.column);
    let guessed = |p: &Picked| p.columns().any(|at| unknown(&at));
    let free = |at: &At| !parts[at.part].is_named() || unknown(at);
    let given = candidates;
    let in_units = |picked: &Picked| in_all_units(parts, std::slice::from_ref(picked), robot, forced);
    let points_alone = |picked: &Picked| points_that_fit(picked, &in_units, &free);
    let candidates: &[Picked] = &candidates.iter().map(points_alone).collect::<Vec<_>>();
    let ways = in_all_units(parts, candidates, robot, forced);
    let Some(best) = ways.first().cloned() else { return Verdict::None };
    let near = |way: &Way| way.left.is_some_and(|left| left < NEAR);
    // Of the same columns in other units.
    let rival = |way: &&Way| {
        let differs = way.picked == best.picked && (way.joints != best.joints || way.lengths != best.lengths);
        differs && way.left.is_some_and(|left| left < CLEAR * best.left.unwrap_or(f64::INFINITY))
    };
    let is_stated = |way: &Way| {
        way.picked.joint_unit.or(forced.joints).is_none_or(|u| u == way.joints)
            && way.picked.length_unit.or(forced.lengths).is_none_or(|u| u == way.lengths)
    };
    // Columns whose names are not known are taken on the robot's word alone.
    let only = candidates.len() == 1 && !guessed(&candidates[0]);
    let says_all = |p: &Picked| p.joint_unit.or(forced.joints).is_some() && p.length_unit.or(forced.lengths).is_some();
    if only && says_all(&candidates[0]) {
        let Some(stated) = nearest_stated(&ways, &best, &is_stated) else { return Verdict::None };
        let wrong =
            near(&best) && !is_stated(&best) && stated.left.is_some_and(|s| best.left.is_some_and(|b| s > WRONG * b));
        return match wrong {
            true => Verdict::WrongUnit { stated, better: best },
            false => Verdict::Taken(stated, Basis::Stated),
        };
    }
    if near(&best) {
        // Points that were commanded or computed are nearer to the nominal robot than those that were measured: two
        // that are near are asked about.
        let others: Vec<&Way> = ways.iter().filter(|way| way.picked != best.picked && near(way)).collect();
        if let Some(other) = others.first() {
            let (first, second) = apart(&best, &others).unwrap_or((best.clone(), (*other).clone()));
            return Verdict::Open(first, second);
        }
        if let Some((computed, measured)) = computed_beside_measured(parts, &best, robot) {
            return Verdict::Open(computed, measured);
        }
        if !ways.iter().any(|way| rival(&way)) {
            if is_stated(&best) {
                return Verdict::Taken(best, Basis::Robot);
            }
            if let Some(stated) = nearest_stated(&ways, &best, &is_stated) {
                return Verdict::WrongUnit { stated, better: best };
            }
        }
    }
    if !only {
        let of_wrist = with_any_tool(parts, given, robot, forced, &free);
        return of_wrist.map_or(Verdict::None, |ways| by_sizes(parts, &ways[0].picked, forced, &ways));
    }
    by_sizes(parts, &candidates[0], forced, &ways)
}

/// All ways to read the only columns that are near with a tool that may be anywhere. Where the wrist alone moved, the
/// place of the file's tool says nothing of the real one's, and points that are small by another unit come as near with
/// a tool that is small as well, so that units are not told.
fn with_any_tool(
    parts: &[Part],
    candidates: &[Picked],
    robot: &Robot,
    forced: Forced,
    unknown: &dyn Fn(&At) -> bool,
) -> Option<Vec<Way>> {
    let ways = |picked: &Picked| {
        let all = usual(std::slice::from_ref(picked), forced).into_iter();
        all.map(|way| way.judged_with_any_tool(parts, robot)).collect::<Vec<Way>>()
    };
    let is_near = |ways: &Vec<Way>| ways.iter().any(|way| way.left.is_some_and(|left| left < NEAR));
    let alone = |picked: &Picked| ways(&points_that_fit(picked, &ways, unknown));
    let mut near = candidates.iter().map(alone).filter(is_near);
    let first = near.next()?;
    near.next().is_none().then_some(first)
}

/// The same without those of several guessed targets that the robot does not carry: three angles beside a point keep
/// about one distance from it, too.
fn points_that_fit(picked: &Picked, ways: &dyn Fn(&Picked) -> Vec<Way>, unknown: &dyn Fn(&At) -> bool) -> Picked {
    if picked.points.len() < 2 || !picked.points.iter().flat_map(|(_, at)| at).any(unknown) {
        return picked.clone();
    }
    let fits = |target: &&(String, [At; 3])| {
        let alone = Picked { points: vec![(*target).clone()], ..picked.clone() };
        ways(&alone).iter().any(|way| way.left.is_some_and(|left| left < NEAR))
    };
    let mut points: Vec<(String, [At; 3])> = picked.points.iter().filter(fits).cloned().collect();
    match &mut points[..] {
        [] => return picked.clone(),
        [(name, _)] => name.clear(),
        _ => {}
    }
    Picked { points, ..picked.clone() }
}

/// Of a way with several targets two, one that the nominal robot computed and one that it did not: these are no two
/// targets of a body.
fn computed_beside_measured(parts: &[Part], best: &Way, robot: &Robot) -> Option<(Way, Way)> {
    let alone = |target: &(String, [At; 3])| {
        let picked = Picked { points: vec![target.clone()], ..best.picked.clone() };
        let way = Way::unjudged(&picked, best.joints, best.lengths).judged(parts, robot);
        Some(way).filter(|way| way.left.is_some())
    };
    let ways: Vec<Way> = best.picked.points.iter().filter(|_| best.picked.points.len() > 1).filter_map(alone).collect();
    let computed = ways.iter().find(|way| way.is_computed())?;
    let measured = ways.iter().find(|way| !way.is_computed())?;
    Some((computed.clone(), measured.clone()))
}

/// The way in the units that are stated, of the best one's columns: that which differs from it in one unit, where there
/// is one.
fn nearest_stated(ways: &[Way], best: &Way, is_stated: &dyn Fn(&Way) -> bool) -> Option<Way> {
    let differences = |way: &Way| usize::from(way.joints != best.joints) + usize::from(way.lengths != best.lengths);
    let of_columns = ways.iter().filter(|way| way.picked == best.picked && is_stated(way));
    of_columns.min_by_key(|way| differences(way)).cloned()
}

/// Two of the ways that have no column in common, the first ones: y and z of one point with x of the next are a point
/// as well, turned.
fn apart(best: &Way, others: &[&Way]) -> Option<(Way, Way)> {
    let start = |way: &Way| way.picked.points.first().map(|(_, at)| at[0]);
    let mut alike: Vec<&Way> = others.iter().copied().filter(|w| w.picked.joints == best.picked.joints).collect();
    alike.push(best);
    alike.sort_by_key(|way| start(way));
    let first = *alike.first()?;
    let taken = first.picked.points.first()?.1;
    let second =
        alike.iter().find(|w| w.picked.points.first().is_some_and(|(_, at)| at.iter().all(|a| !taken.contains(a))))?;
    Some((first.clone(), (*second).clone()))
}

/// Degrees, where a joint is beyond a turn in radians.
pub(in crate::measurements) fn angle_by_size(parts: &[Part], picked: &Picked) -> Option<Unit> {
    (largest(parts, picked.joints.iter().copied()) > TAU).then_some(Unit::Deg)
}

/// The largest number of these columns.
fn largest(parts: &[Part], columns: impl Iterator<Item = At>) -> f64 {
    let number = |at: At, row: usize| parts[at.part].optional(row, at.column).ok().flatten().unwrap_or(0.0).abs();
    columns.flat_map(|at| (0..parts[at.part].rows.len()).map(move |row| number(at, row))).fold(0.0, f64::max)
}

/// Units by the sizes of the numbers, where they leave no choice.
fn by_sizes(parts: &[Part], picked: &Picked, forced: Forced, ways: &[Way]) -> Verdict {
    let joints = forced.joints.or(picked.joint_unit).or_else(|| angle_by_size(parts, picked));
    let measured = picked.points.iter().flat_map(|(_, at)| *at).chain(picked.distance);
    let lengths =
        forced.lengths.or(picked.length_unit).or_else(|| (largest(parts, measured) > METRES).then_some(Unit::Mm));
    match (joints, lengths) {
        (Some(joints), Some(lengths)) => {
            let judged = ways.iter().find(|way| way.joints == joints && way.lengths == lengths).cloned();
            Verdict::Taken(judged.unwrap_or_else(|| Way::unjudged(picked, joints, lengths)), Basis::Sizes)
        }
        (joints, lengths) => Verdict::NoUnit { joints, lengths },
    }
}

/// Some of the rows that are judged, spread over all.
fn some(parts: &[Part], picked: &Picked) -> Vec<usize> {
    let rows = most_alike(parts, picked);
    rows.iter().copied().step_by(rows.len().div_ceil(ROWS).max(1)).collect()
}

/// The rows of the placement and the target, where names say them, that have most rows.
fn most_alike(parts: &[Part], picked: &Picked) -> Vec<usize> {
    let part = &parts[picked.joints[0].part];
    let named = |wanted: &str| {
        parts.iter().find_map(|p| {
            Some((p, p.meanings.as_ref()?.iter().position(|n| matches!(n.what, What::Own(own) if own == wanted))?))
        })
    };
    let (group, target) = (named("group"), named("target"));
    fn cell(of: Option<(&Part, usize)>, row: usize) -> &str {
        of.and_then(|(p, column)| p.rows.get(row).map(|(_, cells)| &cells[column])).unwrap_or("")
    }
    let mut sets: std::collections::BTreeMap<(&str, &str), Vec<usize>> = std::collections::BTreeMap::new();
    for row in 0..part.rows.len() {
        sets.entry((cell(group, row), cell(target, row))).or_default().push(row);
    }
    sets.into_values().max_by_key(Vec::len).unwrap_or_default()
}
