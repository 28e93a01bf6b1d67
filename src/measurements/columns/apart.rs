//! A column that sets rows apart: the number of the reflector that a row was measured at, or of the place where the
//! robot or the sensor stood.
//!
//! In: the way that a table is read, and the nominal robot. Out: a column that is not used, whose values each have a
//! tool and a place of their own: the robot then comes several times nearer to the points than with one tool and one
//! place for all. What goes wrong: a column of few rows a value tells nothing, and whether it is the reflector or the
//! place only the table's owner knows; it is asked.

use std::collections::BTreeMap;

use super::judge::{NEAR, Way};
use super::part::{At, Part};
use super::pick::columns_flag;
use crate::files::Error;
use crate::robot::Robot;
use crate::tables::names::What;

/// Values of a column that counts reflectors or places.
const MOST_VALUES: usize = 20;

/// Ways that are looked at.
const MOST_WAYS: usize = 200;

/// Rows that each value must have: of 8 rows 24 numbers are held against 9 unknowns.
const FEWEST: usize = 8;

/// How many times nearer the robot must come. Nine more unknowns a value reduce what is left of mere noise to 0.79 of
/// it, of eight rows a value.
const CLEAR: f64 = 4.0;

/// What is left is more than a robot's own errors, mm: below it a table is read as it stands.
const LEAST_MM: f64 = 3.0;

/// A column that sets rows apart.
pub(in crate::measurements) struct Apart {
    at: At,
    values: Vec<String>,
    together_mm: f64,
    apart_mm: f64,
    joints: Vec<At>,
    points: Vec<At>,
}

/// The column that sets the rows apart most clearly, if one does, of all these ways to read a table.
pub(in crate::measurements) fn clearest(parts: &[Part], ways: Vec<Way>, robot: &Robot) -> Option<Apart> {
    let found = ways.iter().take(MOST_WAYS).filter_map(|way| of_way(parts, way, robot));
    found.min_by(|a, b| a.apart_mm.total_cmp(&b.apart_mm))
}

fn of_way(parts: &[Part], way: &Way, robot: &Robot) -> Option<Apart> {
    let picked = &way.picked;
    let points = picked.all_points();
    let taken = |at: &At| picked.joints.contains(at) || points.contains(at);
    let is_named = |p: &Part| p.names_any(|w| matches!(w, What::Own("group" | "target")));
    if points.is_empty() || parts.iter().any(is_named) {
        return None;
    }
    let rows = parts[picked.joints[0].part].rows.len();
    let left = |rows: &[usize]| way.left_of(parts, robot, rows);
    let all: Vec<usize> = (0..rows).collect();
    let (_, together_mm) = left(&all).filter(|(_, mm)| *mm > LEAST_MM)?;
    let columns = parts.iter().enumerate().filter(|(_, p)| !p.is_program() && p.rows.len() == rows);
    let columns = columns.flat_map(|(part, p)| (0..p.width()).map(move |column| At { part, column }));
    let judged = |at: At| {
        let mut sets: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
        for row in 0..rows {
            sets.entry(&parts[at.part].rows[row].1[at.column]).or_default().push(row);
            if sets.len() > MOST_VALUES {
                return None;
            }
        }
        let enough = sets.len() > 1 && sets.values().all(|set| set.len() >= FEWEST);
        let near = |set: &Vec<usize>| left(set).filter(|(share, _)| *share < NEAR).map(|(_, mm)| mm);
        let squares: Option<f64> =
            sets.values().filter(|_| enough).map(|set| Some(near(set)?.powi(2) * set.len() as f64)).sum();
        let apart_mm = (squares.filter(|_| enough)? / rows as f64).sqrt();
        let values = sets.into_keys().map(str::to_owned).collect();
        let (joints, points) = (picked.joints.clone(), points.clone());
        (CLEAR * apart_mm < together_mm).then_some(Apart { at, values, together_mm, apart_mm, joints, points })
    };
    columns.filter(|at| !taken(at)).filter_map(judged).min_by(|a, b| a.apart_mm.total_cmp(&b.apart_mm))
}

impl Apart {
    /// The column `pose`, where a name in it has rows of several values.
    fn names_again(&self, parts: &[Part]) -> Option<At> {
        let of_part = |(part, p): (usize, &Part)| {
            let column = p.meanings.as_ref()?.iter().position(|name| name.what == What::Own("pose"))?;
            Some(At { part, column })
        };
        let pose = parts.iter().enumerate().find_map(of_part)?;
        let mut value_of: BTreeMap<&str, &str> = BTreeMap::new();
        let mut rows = parts[pose.part].rows.iter().zip(&parts[self.at.part].rows);
        let is_other = rows.any(|((_, names), (_, values))| {
            let value = &values[self.at.column];
            *value_of.entry(&names[pose.column]).or_insert(value) != value
        });
        is_other.then_some(pose)
    }

    /// That the table's owner must say what the column is.
    pub fn asked(&self, parts: &[Part]) -> Error {
        const SHOWN: usize = 4;
        let part = &parts[self.at.part];
        let more = if self.values.len() > SHOWN { ", ..." } else { "" };
        let message = format!(
            "`{}` ({}{more}) sets the rows apart: with one tool and one place of the robot the nominal one is {:.1} mm off, with others for each of its {} values {:.1} mm",
            part.column_name(self.at.column),
            self.values[..self.values.len().min(SHOWN)].join(", "),
            self.together_mm,
            self.values.len(),
            self.apart_mm
        );
        let flag = |name: &str| {
            let mut named = vec![(self.at, name)];
            // Names that come again at another place are none of poses.
            named.extend(self.names_again(parts).filter(|_| name == "group").map(|pose| (pose, "-")));
            columns_flag(parts, &self.joints, &self.points, &named)
        };
        let hint = format!(
            "`--columns {}` if it says which target was measured, `--columns {}` if it says where the robot or the sensor stood",
            flag("target"),
            flag("group")
        );
        part.refuse(message, Some(&hint))
    }
}
