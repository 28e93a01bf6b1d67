//! Rows that are not of one robot: files of two arms in one run, or a table whose last part was measured on another
//! arm, or after the robot was hit, repaired or mastered anew.
//!
//! In: points, and the nominal robot. Out: the parts that are each well explained by a robot of their own and not by
//! one together, or nothing. Parts are the files of a run, or stretches of rows that are looked for. One robot with a
//! tool and placements of its own in every part is held against a robot a part. Fisher's test says whether what that
//! gains is beyond chance and the further unknowns (the Chow test: Chow, 1960), with the number of places that were
//! tried counted in; what is left must fall to half at the least; and the same rows cut along any of their joints must
//! leave more, for a model that lacks something fits better in every smaller region. One robot with any term beyond its
//! links must leave twice as much as well. Rows that are far off by themselves are errors of their own and no part of a
//! state: they are left out first. Goes wrong: arms that differ by less than the model lacks; a sensor whose own errors
//! changed between parts, which looks like another robot; a change along the rows that a term follows, as where a joint
//! only turned one way while it happened.

pub(super) mod alternating;
mod fit;
pub(super) mod loads;
pub(super) mod tools;

use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use self::fit::{Left, Points};
use crate::identify::data::dataset::{Dataset, Kind};
use crate::identify::examine::hypothesis::still;
use crate::identify::examine::{sessions, shifted};
use crate::identify::finding::Finding;
use crate::identify::model::ladder::{Chain, Terms};
use crate::identify::sensor::REPEATABILITY_MM;
use crate::identify::settings::{Extensions, Settings};
use crate::robot::Robot;
use crate::statistics::median;

/// Fewest rows of a part: they are more numbers than its tool and placement.
const SHORTEST: usize = 8;

/// Joints that must move.
const FEWEST_MOVING: usize = 3;

/// Most stretches that one table is cut into.
const MOST_PARTS: usize = 4;

/// Places that are tried at once, before those between the best; rows that are enough to try them with.
const GRID: usize = 24;
const ROWS: usize = 120;

/// Chance with which rows of one robot may seem to be of several.
const CHANCE: f64 = 1e-3;

/// What one robot leaves, over what robots of their own do: three quarters of its squares are then theirs to explain.
const MUCH_LARGER: f64 = 2.0;

/// Times as much that the same rows cut along any joint must leave.
const BEATS: f64 = 1.3;

/// Cuts of which each part shares so much with a part of the other are one cut.
const NEARLY_ALL: f64 = 0.8;

/// Parts that are a cut along a joint have no such rival: what a model lacks hardly falls by this factor.
const UNTOLD: f64 = 4.0;

/// Sessions that leave within this factor of what robots of their own leave are the simpler reason.
const AS_GOOD: f64 = 1.2;

/// Rows that are not of one robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Robots {
    /// Each with what a robot of its own leaves a coordinate.
    pub parts: Vec<Part>,
    /// What one robot leaves a coordinate, mm.
    pub together_mm: f64,
}

/// A part of the rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    pub name: String,
    /// Its fitted rows of the data set.
    pub rows: Vec<usize>,
    pub alone_mm: f64,
}

impl Robots {
    /// What was found.
    pub fn finding(&self) -> Finding {
        Finding::new(
            format!(
                "the rows are not of one robot, or not of one state of it: a robot of its own leaves in {} a coordinate, one robot for all of \
                 them {:.3} mm, although each part had a tool and a placement of its own",
                alone(&self.parts),
                self.together_mm
            ),
            "identify each part by itself; where it was one robot, look for what was done to it between them",
        )
    }

    /// The set with the placements of the parts apart.
    pub fn parted(&self, set: &Dataset) -> Dataset {
        let mut parted = set.clone();
        for part in &self.parts[1..] {
            // In files of their own the groups are apart already.
            let (first, last) = (part.rows[0], part.rows[part.rows.len() - 1]);
            for group in 0..set.groups.len() {
                let is_before = |row: &usize| set.poses[*row].group == group && *row < first;
                if let (Some(row), true) = (
                    (first..=last).find(|row| parted.poses[*row].group == group),
                    (0..first).any(|row| is_before(&row)),
                ) {
                    sessions::split(&mut parted, row);
                }
            }
        }
        parted
    }
}

/// Looks for parts of the rows that are of different robots.
pub fn find(set: &Dataset, robot: &Robot, settings: &Settings) -> Option<Robots> {
    let table = Table::new(set, robot)?;
    let files = table.files(set);
    let of_files = (files.len() > 1).then(|| table.judged(files, 1.0, Table::compared)).flatten();
    let (parts, compared) = of_files.or_else(|| table.stretches())?;
    // A sensor that was moved several times is no robot.
    let (cut, along) = sessions::find(set, robot, settings);
    if !along.sessions.is_empty() {
        let whole = Table::new(&cut, robot)?;
        let rows: Vec<Vec<usize>> = vec![(0..whole.rows.len()).collect()];
        let left = whole.points.together(&rows, &whole.points.without_gross(&rows));
        if left.scatter_mm() < AS_GOOD * compared.apart.scatter_mm() {
            return None;
        }
    }
    // Nor is a robot of which the links alone say too little.
    if settings.extensions == Extensions::Auto && table.is_one_beyond_links(&parts, compared.apart.scatter_mm()) {
        return None;
    }
    Some(Robots { parts: table.parts(set, &parts, &compared), together_mm: compared.together.scatter_mm() })
}

/// What is said of files of which each has far less error by itself than with the others, though no tool and no
/// placement tells them apart.
pub(super) fn of_files(set: &Dataset, robot: &Robot) -> Option<Finding> {
    let mut table = Table::new(set, robot)?;
    let files = Some(table.files(set)).filter(|files| files.len() > 1)?;
    // What the links lack of a load, every robot has of its own.
    table.points = table.points.with_load(Vec::new());
    let (parts, compared) = table.judged(files, 1.0, Table::compared_as_one)?;
    let parts = table.parts(set, &parts, &compared);
    Some(Finding::new(
        format!(
            "the files are not of one state of the robot, as where it carried other loads: a robot of its own leaves in {} a coordinate, one robot \
             for all of them {:.3} mm",
            alone(&parts),
            compared.together.scatter_mm()
        ),
        "identify each file by itself, or measure all of them with the load that the robot works with",
    ))
}

/// What robots of their own leave.
fn alone(parts: &[Part]) -> String {
    parts.iter().map(|p| format!("{} {:.3} mm", p.name, p.alone_mm)).collect::<Vec<_>>().join(", in ")
}

/// Times the median that rows which are errors of their own are off at the least, and rounds in which the target's
/// place is found: errors of a robot vary with the posture by some times their median.
const FAR: f64 = 12.0;
const PLACING_ROUNDS: usize = 20;

/// These rows without those that are far from the nominal links while most rows around them are not.
fn without_lone(set: &Dataset, robot: &Robot, rows: Vec<usize>) -> Vec<usize> {
    let Some(errors_mm) = shifted::Rows::new(set, robot).map(|rows| rows.errors_mm(PLACING_ROUNDS)) else {
        return rows;
    };
    let limit_mm = FAR * median(errors_mm.iter().copied()).unwrap_or(f64::INFINITY).max(REPEATABILITY_MM);
    let is_far: Vec<bool> = rows.iter().map(|&row| errors_mm[row] > limit_mm).collect();
    let is_lone = |i: usize| {
        let first = i.saturating_sub(SHORTEST / 2).min(rows.len().saturating_sub(SHORTEST));
        let around = &is_far[first..(first + SHORTEST).min(rows.len())];
        is_far[i] && 2 * around.iter().filter(|far| **far).count() < around.len()
    };
    rows.iter().enumerate().filter(|(i, _)| !is_lone(*i)).map(|(_, &row)| row).collect()
}

/// The file of a run of several that a row stands in, by the number before its name.
fn file_of(set: &Dataset, row: usize) -> Option<usize> {
    let number = set.poses[row].name.split_once(':')?.0.parse::<usize>().ok()?;
    number.checked_sub(1).filter(|file| *file < set.files.len())
}

/// The name of a part: its file, or its first and last row.
fn named(set: &Dataset, rows: &[usize]) -> String {
    let (first, last) = (rows[0], rows[rows.len() - 1]);
    let of_file =
        |file: usize| set.fit_rows().into_iter().filter(|&row| file_of(set, row) == Some(file)).collect::<Vec<_>>();
    match file_of(set, first).filter(|&file| of_file(file) == rows) {
        Some(file) => set.files[file].clone(),
        None => format!("rows {} to {}", set.poses[first].name, set.poses[last].name),
    }
}

/// How parts are compared.
type Comparing = fn(&Table, &[Vec<usize>]) -> Option<Compared>;

/// Parts by their rows of the table, with what robots leave in them.
type Judged = (Vec<Vec<usize>>, Compared);

/// What robots of their own leave in each part and in all, and what one leaves.
struct Compared {
    each: Vec<Left>,
    apart: Left,
    together: Left,
}

/// The fitted rows.
struct Table {
    /// Rows of the data set.
    rows: Vec<usize>,
    points: Points,
}

impl Table {
    /// `None` of sets of anything but whole points, and where so few joints move that links say nothing.
    fn new(set: &Dataset, robot: &Robot) -> Option<Table> {
        let whole = set.poses.iter().all(|pose| pose.on_body_mm.is_none());
        let moving = robot.joints.len() - still(set).len().min(robot.joints.len());
        if set.kind != Kind::Positions || !whole || moving < FEWEST_MOVING {
            return None;
        }
        let rows = without_lone(set, robot, set.fit_rows());
        let point = |row: &usize| set.poses[*row].reading.point_mm();
        let points = Points {
            robot: robot.clone(),
            parameters: robot.mdh_parameters(),
            joints_rad: rows.iter().map(|&row| set.poses[row].joints_rad.clone()).collect(),
            points_mm: rows.iter().map(point).collect::<Option<Vec<_>>>()?,
            groups: rows.iter().map(|&row| set.poses[row].group).collect(),
            tools: Vec::new(),
            loaded: Vec::new(),
        };
        Some(Table { rows, points })
    }

    /// The rows of each file that has enough.
    fn files(&self, set: &Dataset) -> Vec<Vec<usize>> {
        let of = |file: usize| -> Vec<usize> {
            (0..self.rows.len()).filter(|&i| file_of(set, self.rows[i]) == Some(file)).collect()
        };
        (0..set.files.len()).map(of).filter(|rows| rows.len() >= SHORTEST).collect()
    }

    /// The stretches of rows that are of different robots.
    fn stretches(&self) -> Option<Judged> {
        let mut parts: Vec<Vec<usize>> = vec![(0..self.rows.len()).collect()];
        // What one robot leaves of all rows is more than in any parts: where that is little no cut is judged.
        if self.points.together(&parts, &self.points.without_gross(&parts)).scatter_mm() < REPEATABILITY_MM {
            return None;
        }
        let mut tried = 1.0;
        while parts.len() < MOST_PARTS {
            let cuts = parts.iter().enumerate().filter_map(|(p, part)| Some((p, self.best_cut(part)?)));
            let cut = cuts.max_by(|a, b| a.1.1.total_cmp(&b.1.1));
            let Some((p, (at, _))) = cut else { break };
            let late = parts[p].split_off(at);
            parts.insert(p + 1, late);
            // Each cut is the best of all places, beside each place of those before.
            tried *= self.rows.len() as f64;
            if let Some(judged) = self.judged(parts.clone(), tried, Table::compared) {
                return Some(judged);
            }
        }
        None
    }

    /// Where a part is cut best, and the logarithm of how much likelier that makes its rows.
    fn best_cut(&self, part: &[usize]) -> Option<(usize, f64)> {
        let count = part.len();
        if count < 2 * SHORTEST {
            return None;
        }
        let thinned = |rows: &[usize]| rows.iter().copied().step_by(count.div_ceil(ROWS)).collect::<Vec<usize>>();
        let (whole, near) = self.points.bounded(&thinned(part), None);
        let left = |at: usize| {
            let [early, late] =
                [&part[..at], &part[at..]].map(|rows| self.points.bounded(&thinned(rows), Some(&near)).0);
            (early.and(late).scatter_mm(), at)
        };
        let best_of = |places: Vec<usize>| places.into_par_iter().map(left).min_by(|a, b| a.0.total_cmp(&b.0));
        let (first, last) = (SHORTEST, count - SHORTEST);
        let step = ((last - first) / GRID).max(1);
        let (_, middle) = best_of((first..=last).step_by(step).collect())?;
        let (apart_mm, at) = best_of((middle.saturating_sub(step).max(first)..=(middle + step).min(last)).collect())?;
        Some((at, count as f64 * (whole.scatter_mm() / apart_mm).ln()))
    }

    /// These parts where they are of different robots, as `compare` has it; `tried` is the number of such cuts that
    /// were looked at.
    fn judged(&self, parts: Vec<Vec<usize>>, tried: f64, compare: Comparing) -> Option<Judged> {
        let compared = compare(self, &parts)?;
        let Compared { apart, together, .. } = &compared;
        if together.scatter_mm() < (MUCH_LARGER * apart.scatter_mm()).max(REPEATABILITY_MM)
            || by_chance(apart, together)? * tried > CHANCE
        {
            return None;
        }
        let rivals: Vec<Vec<Vec<usize>>> =
            (0..self.points.robot.joints.len()).map(|joint| self.along(joint, &parts)).collect();
        let (same, others): (Vec<_>, Vec<_>) = rivals.into_iter().partition(|rival| are_alike(&parts, rival));
        let is_untold = !same.is_empty() && compared.share() * UNTOLD > 1.0;
        let beaten =
            |rival: &Vec<Vec<usize>>| compare(self, rival).is_none_or(|rival| rival.share() > BEATS * compared.share());
        (!is_untold && others.iter().all(beaten)).then_some((parts, compared))
    }

    /// What robots of their own leave in these parts, and what one leaves.
    fn compared(&self, parts: &[Vec<usize>]) -> Option<Compared> {
        let weights = self.points.without_gross(parts);
        let alone = |part: &Vec<usize>| self.points.together(std::slice::from_ref(part), &weights);
        let each: Vec<Left> = parts.iter().map(alone).collect();
        let apart = each.iter().cloned().reduce(Left::and)?;
        Some(Compared { each, apart, together: self.points.together(parts, &weights) })
    }

    /// Whether one robot with any of the terms that `identify` may keep leaves less in these parts than what is much
    /// larger than several do.
    pub(super) fn is_one_beyond_links(&self, parts: &[Vec<usize>], apart_mm: f64) -> bool {
        let robot = &self.points.robot;
        let links = Terms { chain: Chain::Mdh, ..Terms::NOMINAL };
        let weights = self.points.without_gross(parts);
        // From where the links end: far from there a term that hardly differs from a link's runs away.
        let (_, near) = self.points.solved(parts, &weights);
        links.successors(robot).into_par_iter().any(|terms| {
            let more = terms.parameters(robot).into_iter().filter(|p| !self.points.parameters.contains(p));
            let left = self.points.with_terms(more).together_from(parts, &weights, &near);
            left.scatter_mm() < MUCH_LARGER * apart_mm
        })
    }

    /// The same with what one robot leaves that has one tool for all parts, and the placements of their groups.
    fn compared_as_one(&self, parts: &[Vec<usize>]) -> Option<Compared> {
        let compared = self.compared(parts)?;
        let together = self.points.together(&[parts.concat()], &self.points.without_gross(parts));
        Some(Compared { together, ..compared })
    }

    /// These parts with their names.
    fn parts(&self, set: &Dataset, parts: &[Vec<usize>], compared: &Compared) -> Vec<Part> {
        let part = |(rows, left): (&Vec<usize>, &Left)| {
            let rows: Vec<usize> = rows.iter().map(|&i| self.rows[i]).collect();
            Part { name: named(set, &rows), alone_mm: left.scatter_mm(), rows }
        };
        parts.iter().zip(&compared.each).map(part).collect()
    }

    /// The same rows cut along a joint into parts of the same sizes.
    fn along(&self, joint: usize, parts: &[Vec<usize>]) -> Vec<Vec<usize>> {
        let mut order: Vec<usize> = parts.concat();
        order.sort_by(|a, b| self.points.joints_rad[*a][joint].total_cmp(&self.points.joints_rad[*b][joint]));
        let mut rest = order.as_slice();
        let cut = |part: &Vec<usize>| {
            let (head, tail) = rest.split_at(part.len());
            rest = tail;
            head.to_vec()
        };
        parts.iter().map(cut).collect()
    }
}

impl Compared {
    /// What robots of their own leave of the scatter of one.
    fn share(&self) -> f64 {
        self.apart.scatter_mm() / self.together.scatter_mm()
    }
}

/// Chance that the further unknowns of rows that are taken apart gain as much as they do (Fisher's test).
fn by_chance(apart: &Left, together: &Left) -> Option<f64> {
    let further = apart.taken - together.taken;
    let gain = ((together.squares - apart.squares) / further) / (apart.squares / apart.freedom());
    Some(FisherSnedecor::new(further.max(1.0), apart.freedom()).ok()?.sf(gain.max(0.0)))
}

/// Whether two ways to part rows are nearly one.
fn are_alike(parts: &[Vec<usize>], others: &[Vec<usize>]) -> bool {
    let alike = |part: &Vec<usize>, other: &Vec<usize>| {
        let both = part.iter().filter(|row| other.contains(row)).count();
        both as f64 / (part.len() + other.len() - both) as f64
    };
    parts.iter().all(|part| others.iter().any(|other| alike(part, other) > NEARLY_ALL))
}

#[cfg(test)]
mod tests;
