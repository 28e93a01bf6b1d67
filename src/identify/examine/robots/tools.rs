//! A tool that was moved, turned or exchanged between parts of the rows.
//!
//! In: the fitted rows, and the robot of the file. Out: from which row on, or between which files, the target stands elsewhere on the flange, and by
//! how much. Method: one robot for all rows with a tool of each part's own is held against one tool for all of them, both with placements of each
//! part's own, so that a sensor that was moved is none. Fisher's test, and the same rows cut along any joint, as of robots. Goes wrong: parts that
//! turn the flange too little for their tool to be told.

use nalgebra::Vector3;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::fit::{Left, Points};
use super::{BEATS, CHANCE, GRID, MUCH_LARGER, ROWS, SHORTEST, Table, UNTOLD, are_alike, named};
use crate::identify::data::dataset::Dataset;
use crate::identify::finding::Finding;
use crate::identify::judge::locate::REPEATABILITY_MM;
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
            let sensor = if tools.is_placed() { ", or the sensor moved," } else { "" };
            format!("the tool moved on the flange by {}{sensor} from row {first} on", moved(&tools.off_mm[0]))
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

impl Tools {
    fn is_placed(&self) -> bool {
        self.placed.scatter_mm() < BEATS * self.apart.scatter_mm()
    }
}

impl Table {
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
        let further = tools.apart.taken - tools.together.taken;
        let gain =
            ((tools.together.squares - tools.apart.squares) / further) / (tools.apart.squares / tools.apart.freedom());
        let fisher = FisherSnedecor::new(further.max(1.0), tools.apart.freedom()).ok()?;
        let apart_mm = tools.apart.scatter_mm();
        let is_larger = tools.together.scatter_mm() > (MUCH_LARGER * apart_mm).max(REPEATABILITY_MM);
        let is_sensor = BEATS * tools.placed.scatter_mm() < apart_mm;
        if !is_larger || is_sensor || fisher.sf(gain.max(0.0)) * tried as f64 > CHANCE {
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
        let weights = rough.weights(&all, self.rows.len());
        let (apart, off_mm) = of_tools.with_tools(all.clone(), &weights);
        let whole = std::slice::from_ref(&all);
        let placed = Points { groups, ..self.points.clone() }.together(whole, &weights);
        let together = self.points.together(whole, &weights);
        apart.scatter_mm().is_finite().then(|| Tools { parts: parts.to_vec(), apart, placed, together, off_mm })
    }
}
