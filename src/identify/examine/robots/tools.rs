//! A tool that was moved, turned or exchanged between parts of the rows.
//!
//! In: the fitted rows, and the robot of the file. Out: from which row on, or between which files, the target stands
//! elsewhere on the flange, and by how much. Method: one robot for all rows with a tool of each part's own is held
//! against one tool for all of them, both with placements of each part's own, so that a sensor that was moved is none.
//! Fisher's test, and the same rows cut along any joint, as of robots. Where the rows were cut into sessions, tools and
//! placements are compared there by their likelihood. Goes wrong: parts that turn the flange too little for their tool
//! to be told.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::fit::{Left, PLACEMENT, Points, TARGET};
use super::{BEATS, CHANCE, GRID, MUCH_LARGER, ROWS, SHORTEST, Table, UNTOLD, are_alike, by_chance, named};
use crate::difference::TOLD_APART;
use crate::identify::data::dataset::Dataset;
use crate::identify::examine::conventions::IMPLAUSIBLE_MM;
use crate::identify::finding::Finding;
use crate::identify::sensor::REPEATABILITY_MM;
use crate::robot::Robot;

/// Tools of parts of the rows.
struct Tools {
    parts: Vec<Vec<usize>>,
    /// What one robot leaves with a tool a part, with placements of each part's own instead, and with neither.
    apart: Left,
    placed: Left,
    together: Left,
    /// Where the tools of the further parts stand from that of the first, mm in the last frame.
    off_mm: Vec<Vector3<f64>>,
    /// Of all rows of the table, gross errors without.
    weights: Vec<f64>,
}

impl Tools {
    /// Whether a sensor that was moved explains the rows as well.
    fn is_placed(&self) -> bool {
        self.placed.scatter_mm() < BEATS * self.apart.scatter_mm()
    }
}

/// A tool that moved.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::identify::examine) struct Moved {
    pub(in crate::identify::examine) finding: Finding,
    /// Whether a sensor that was moved explains the rows as well.
    pub(in crate::identify::examine) is_placed: bool,
}

/// What is said of a tool that moved.
pub(in crate::identify::examine) fn find(set: &Dataset, robot: &Robot) -> Option<Moved> {
    let table = Table::new(set, robot)?;
    let files = table.files(set);
    let of_files = (files.len() > 1).then(|| table.tools(files, 1)).flatten();
    let is_of_files = of_files.is_some();
    let tools = of_files.or_else(|| table.tools_of_stretches())?;
    let rows = |part: &Vec<usize>| part.iter().map(|&i| table.rows[i]).collect::<Vec<usize>>();
    let moved = |off: &Vector3<f64>| format!("{:.1} mm", off.norm());
    let said = match is_of_files {
        true => {
            let list = tools.parts[1..].iter().zip(&tools.off_mm);
            let list: Vec<String> =
                list.map(|(part, tool)| format!("{} by {}", named(set, &rows(part)), moved(tool))).collect();
            format!(
                "the tool stands elsewhere on the flange than in {}: in {}",
                named(set, &rows(&tools.parts[0])),
                list.join(", in ")
            )
        }
        false => {
            let first = &set.poses[rows(&tools.parts[1])[0]].name;
            let sensor = tools.is_placed().then(|| "the sensor moved".to_owned());
            let others: Vec<String> = table.zero_as_likely(&tools).into_iter().chain(sensor).collect();
            let others = if others.is_empty() { String::new() } else { format!(", or {},", others.join(", or ")) };
            format!("the tool moved on the flange by {}{others} from row {first} on", moved(&tools.off_mm[0]))
        }
    };
    let finding = Finding::new(
        format!(
            "{said}: one tool leaves {:.3} mm a coordinate, a tool of each part's own {:.3} mm",
            tools.together.scatter_mm(),
            tools.apart.scatter_mm()
        ),
        "identify each part by itself, or measure again with one tool",
    );
    Some(Moved { finding, is_placed: tools.is_placed() })
}

/// What is said of rows that were cut into sessions where something else than a sensor that moved is likelier, or not
/// told from it: a tool, or the zero of a joint. `None` where the sensor is likelier.
pub(in crate::identify::examine) fn of_sessions(set: &Dataset, cut: &Dataset, robot: &Robot) -> Option<Finding> {
    let table = Table::new(set, robot)?;
    let parts = table.sessions(set, cut);
    if parts.len() < 2 {
        return None;
    }
    let told = table.told(&parts)?;
    if told.iter().all(|cause| cause.is == Is::Sensor) {
        return None;
    }
    let action = "each session got a placement of its own, as if the sensor had moved: identify each by itself, or measure again without the change";
    Some(Finding::new(table.said(set, &parts, &told), action))
}

/// What is said of a joint whose zero steps at a row where a tool that moved there is likelier, or not told from it.
pub(in crate::identify::examine) fn of_step(set: &Dataset, from: &str, robot: &Robot) -> Option<Finding> {
    let table = Table::new(set, robot)?;
    let at = table.rows.iter().position(|&row| set.poses[row].name == from)?;
    let parts = [(0..at).collect::<Vec<usize>>(), (at..table.rows.len()).collect()];
    let told = if parts.iter().all(|part| part.len() >= SHORTEST) { table.told(&parts)? } else { return None };
    told.iter().any(|cause| cause.is == Is::Tool).then(|| {
        let action = "identify each part by itself, or measure again without the change";
        Finding::new(table.said(set, &parts, &told), action)
    })
}

/// What a cause is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Is {
    Sensor,
    Tool,
    Other,
}

/// What may have changed between sessions.
struct Cause {
    what: String,
    is: Is,
    /// Scatter of a coordinate that it leaves, mm.
    left_mm: f64,
    /// Logarithm of its likelihood, but for a constant.
    likelihood: f64,
}

impl Table {
    /// The causes of a change between these parts that are not told apart, the likeliest among them.
    fn told(&self, parts: &[Vec<usize>]) -> Option<Vec<Cause>> {
        let causes = self.causes(parts)?;
        let likeliest = causes.iter().map(|cause| cause.likelihood).fold(f64::NEG_INFINITY, f64::max);
        Some(causes.into_iter().filter(|cause| likeliest - cause.likelihood < TOLD_APART).collect())
    }

    /// The same in words.
    fn said(&self, set: &Dataset, parts: &[Vec<usize>], told: &[Cause]) -> String {
        let begins: Vec<String> = parts[1..].iter().map(|part| set.poses[self.rows[part[0]]].name.clone()).collect();
        let what = told.iter().map(|cause| cause.what.as_str()).collect::<Vec<_>>().join(", or ");
        let left = told.iter().map(|cause| format!("{:.3}", cause.left_mm)).collect::<Vec<_>>().join(", ");
        let apart = if told.len() > 1 { ", which the rows do not tell apart" } else { "" };
        format!("from row {} on {what}{apart}: with that are left {left} mm a coordinate", begins.join(" and "))
    }

    /// The rows by session: a session begins where a group was cut.
    fn sessions(&self, set: &Dataset, cut: &Dataset) -> Vec<Vec<usize>> {
        let mut parts: Vec<Vec<usize>> = vec![Vec::new()];
        let mut begun = Vec::new();
        for (i, &row) in self.rows.iter().enumerate() {
            let group = cut.poses[row].group;
            if group >= set.groups.len() && !begun.contains(&group) {
                begun.push(group);
                parts.push(Vec::new());
            }
            parts.last_mut().into_iter().for_each(|part| part.push(i));
        }
        parts.retain(|part| !part.is_empty());
        parts
    }

    /// The sensor, the tool and, between two sessions, the zero of the joint that explains most, and a load. A first
    /// joint that stands elsewhere is a sensor that turned.
    fn causes(&self, parts: &[Vec<usize>]) -> Option<Vec<Cause>> {
        let tools = self.with_tools(parts)?;
        let most_mm = tools.off_mm.iter().map(Vector3::norm).fold(0.0, f64::max);
        let cause = |what: String, left: &Left, free: f64| self.cause(parts, what, left, free);
        let sensor = cause("the sensor or the robot's base moved".to_owned(), &tools.placed, PLACEMENT as f64);
        let tool = cause(format!("the tool moved on the flange by {most_mm:.2} mm"), &tools.apart, TARGET as f64);
        let zero = self.zero(parts, &tools);
        let load = (parts.len() == 2).then(|| {
            let loaded = (0..self.rows.len()).map(|row| parts[1].contains(&row)).collect();
            let (left, moved_mm) = self.points.with_load(loaded).under_load(&parts.concat(), &tools.weights);
            let by = moved_mm.iter().map(Vector3::norm).fold(0.0, f64::max);
            let free = left.taken - tools.together.taken;
            cause(format!("a load was put on or taken off, which moves the target by up to {by:.2} mm"), &left, free)
        });
        let named = [Cause { is: Is::Sensor, ..sensor }, Cause { is: Is::Tool, ..tool }];
        Some(named.into_iter().chain(zero).chain(load).collect())
    }

    fn cause(&self, parts: &[Vec<usize>], what: String, left: &Left, free: f64) -> Cause {
        let likelihood = left.likelihood(self.rows.len(), (parts.len() as f64 - 1.0) * free);
        Cause { what, is: Is::Other, left_mm: left.scatter_mm(), likelihood }
    }

    /// Between two parts the zero of the joint that explains most.
    fn zero(&self, parts: &[Vec<usize>], tools: &Tools) -> Option<Cause> {
        let [_, there] = parts else { return None };
        let rows = parts.concat();
        let of = |joint| self.points.elsewhere(joint, there, (&rows, &tools.weights), &tools.together);
        let zeros = (1..self.points.robot.joints.len()).filter_map(|joint| Some((joint, of(joint)?)));
        let (joint, (left, off)) = zeros.min_by(|a, b| a.1.0.squares.total_cmp(&b.1.0.squares))?;
        // How the joint is counted is how its zero is.
        let by = self.points.zero_said(joint, self.points.robot.joints[joint].sign * off);
        Some(self.cause(parts, format!("the zero of joint {} moved by {by}", joint + 1), &left, 1.0))
    }

    /// The zero of a joint that explains two parts as well as tools of their own: one target moves alike where the last
    /// joint stands elsewhere.
    fn zero_as_likely(&self, tools: &Tools) -> Option<String> {
        let tool = self.cause(&tools.parts, String::new(), &tools.apart, TARGET as f64);
        let zero = self.zero(&tools.parts, tools)?;
        (tool.likelihood - zero.likelihood < TOLD_APART).then_some(zero.what)
    }

    /// The two stretches of rows that are of different tools.
    fn tools_of_stretches(&self) -> Option<Tools> {
        let count = self.rows.len();
        if count < 2 * SHORTEST {
            return None;
        }
        let step = count.div_ceil(ROWS);
        let (first, last) = (SHORTEST, count - SHORTEST);
        let grid = ((last - first) / GRID).max(1);
        let thinned = |row: &usize| row.is_multiple_of(step);
        let (_, rough) = self.best_step((first..=last).step_by(grid), thinned)?;
        let around = |at: usize, by: usize| at.saturating_sub(by).max(first)..=(at + by).min(last);
        let (_, middle) = self.best_step(around(rough, grid).step_by(step), thinned)?;
        // Around the cut every row counts.
        let near = |row: &usize| thinned(row) || row.abs_diff(middle) <= 2 * step;
        let (_, at) = self.best_step(around(middle, step), near)?;
        self.tools(vec![(0..at).collect(), (at..count).collect()], count)
    }

    /// The place of these from which on a tool of its own leaves least of the rows that count, and what that leaves.
    fn best_step(&self, places: impl Iterator<Item = usize>, counts: impl Fn(&usize) -> bool) -> Option<(f64, usize)> {
        let rows: Vec<usize> = (0..self.rows.len()).filter(counts).collect();
        let left = |at: usize| {
            let tools = (0..self.rows.len()).map(|row| usize::from(row >= at)).collect();
            let points = Points { tools, ..self.points.clone() };
            (points.together(std::slice::from_ref(&rows), &vec![1.0; self.rows.len()]).scatter_mm(), at)
        };
        places.collect::<Vec<_>>().into_par_iter().map(left).min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// These parts where they are of different tools; `tried` is the number of such cuts that were looked at.
    fn tools(&self, parts: Vec<Vec<usize>>, tried: usize) -> Option<Tools> {
        let tools = self.with_tools(&parts)?;
        let chance = by_chance(&tools.apart, &tools.together)?;
        let apart_mm = tools.apart.scatter_mm();
        let is_larger = tools.together.scatter_mm() > (MUCH_LARGER * apart_mm).max(REPEATABILITY_MM);
        let is_sensor = BEATS * tools.placed.scatter_mm() < apart_mm;
        // What no built robot is off by no tool explains.
        if !is_larger || is_sensor || apart_mm > IMPLAUSIBLE_MM || chance * tried as f64 > CHANCE {
            return None;
        }
        let share = |tools: &Tools| tools.apart.scatter_mm() / tools.together.scatter_mm();
        let beaten = |joint: usize| {
            let rival = self.along(joint, &parts);
            // What is a cut along a joint must leave far less than what a model lacks does.
            let is_same = are_alike(&parts, &rival) && share(&tools) * UNTOLD < 1.0;
            is_same || self.with_tools(&rival).is_none_or(|rival| share(&rival) > BEATS * share(&tools))
        };
        (0..self.points.robot.joints.len()).all(beaten).then_some(tools)
    }

    /// What one robot leaves with these parts.
    fn with_tools(&self, parts: &[Vec<usize>]) -> Option<Tools> {
        let all = parts.concat();
        let (mut of_row, mut groups) = (vec![0; self.rows.len()], self.points.groups.clone());
        for (p, part) in parts.iter().enumerate() {
            for &row in part {
                (of_row[row], groups[row]) = (p, groups[row] * parts.len() + p);
            }
        }
        let of_tools = Points { tools: of_row, ..self.points.clone() };
        let (rough, _) = of_tools.with_tools(all.clone(), &vec![1.0; self.rows.len()]);
        let mut weights = vec![1.0; self.rows.len()];
        rough.leave_out_gross(&all, &mut weights);
        let (apart, off_mm) = of_tools.with_tools(all.clone(), &weights);
        let whole = std::slice::from_ref(&all);
        let placed = Points { groups, ..self.points.clone() }.together(whole, &weights);
        let together = self.points.together(whole, &weights);
        apart.scatter_mm().is_finite().then(|| Tools {
            parts: parts.to_vec(),
            apart,
            placed,
            together,
            off_mm,
            weights,
        })
    }
}
