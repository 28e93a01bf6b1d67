//! Several targets of which no pose shows two: each row is a point of one body, and the robot alone joins them.
//!
//! In: rows with the names of their targets, and the nominal robot. Out: the same rows as points of a body, where its targets stand as the
//! nominal robot tells, and for each row what a target that stands elsewhere would move. The places are as good as that robot; what they
//! are off by is solved with its parameters, by unknowns that all rows of a target share.
//! What goes wrong: a target with few rows says little; a placement of the sensor that shows only some of the targets joins none of them.

use std::collections::BTreeMap;

use nalgebra::{Matrix3xX, Point3, Vector3};

use super::merge::{Part, Targets};
use crate::geometry::{Transform, fitted_frame};
use crate::identify::data::dataset::Dataset;
use crate::measurements::{Measurement, Observed};
use crate::robot::Robot;
use crate::robot::tool_fit::Start;
use crate::statistics::median;

/// Rows of the target that has most, in the placement that shows it most often: three numbers each against placement and tool.
const FEWEST: usize = 6;

/// Rows of it in any other placement, where the tool is known.
const FEWEST_PLACED: usize = 4;

/// Rows of any other target: as many numbers as its place has, and more.
const FEWEST_OF_OTHER: usize = 2;

/// How far a place may be off, as a multiple of what the nominal robot is off by in the middle of the rows, and mm at the least.
const DOUBT: f64 = 3.0;
const LEAST_DOUBT_MM: f64 = 0.5;

/// Targets that the nominal robot joins.
pub struct Apart {
    /// The rows; those of the target that has most are the mark point's, the others are of parts of the body.
    pub rows: Vec<Measurement>,
    pub targets: Targets,
    /// Where the base stands at the sensor, by group.
    sensor_from_base: BTreeMap<String, Transform>,
    /// Standard deviation of a coordinate of a place, mm.
    doubt_mm: f64,
}

impl Apart {
    /// `None` where there is one target, where a pose shows several, or where the rows are too few.
    pub fn new(rows: &[Measurement], nominal: &Robot) -> Option<Apart> {
        let of_target = by_target(rows)?;
        let most = of_target.values().map(Vec::len).max()?;
        let (reference, _) = of_target.iter().find(|(_, rows)| rows.len() == most)?;
        let mut groups: BTreeMap<&str, (Vec<Vec<f64>>, Vec<Point3<f64>>)> = BTreeMap::new();
        for (row, point) in &of_target[reference] {
            let (joints, points) = groups.entry(&row.at.group).or_default();
            joints.push(row.at.joints_rad());
            points.push(*point);
        }
        let (joints, points) = groups.values().max_by_key(|(joints, _)| joints.len())?;
        let fit = nominal.fit_tool(joints, points, Start::Around).filter(|_| joints.len() >= FEWEST)?;
        let place = |joints: &[Vec<f64>], points: &[Point3<f64>]| {
            let predicted = joints.iter().map(|q| nominal.base_from_flange(q) * Point3::from(fit.tool_mm));
            fitted_frame(predicted.zip(points).map(|(from, to)| (from, *to, 1.0)))
        };
        let sensor_from_base: BTreeMap<String, Transform> = groups
            .iter()
            .filter(|(_, (joints, _))| joints.len() >= FEWEST_PLACED)
            .map(|(group, (joints, points))| ((*group).to_owned(), place(joints, points)))
            .collect();
        if rows.iter().any(|row| !sensor_from_base.contains_key(&row.at.group)) {
            return None;
        }
        let tool = |rows: &[(&Measurement, Point3<f64>)]| {
            let seen = |(row, point): &(&Measurement, Point3<f64>)| {
                (sensor_from_base[&row.at.group] * nominal.base_from_flange(&row.at.joints_rad())).inverse() * point
            };
            let seen: Vec<Point3<f64>> = rows.iter().map(seen).collect();
            Vector3::from_fn(|axis, _| median(seen.iter().map(|p| p[axis])).unwrap_or(0.0))
        };
        let origin = tool(&of_target[reference]);
        let others = of_target.iter().filter(|(name, _)| *name != reference);
        let part = |(name, rows): (&String, &Vec<(&Measurement, Point3<f64>)>)| {
            (name.clone(), Part { place_mm: (tool(rows) - origin).into(), poses: rows.len() })
        };
        let parts: BTreeMap<String, Part> = others.map(part).collect();
        let place_of = |name: &String| parts.get(name).map_or([0.0; 3], |part| part.place_mm);
        let names: Vec<String> = of_target.keys().cloned().collect();
        let targets = Targets {
            scatter_mm: None,
            places_mm: names.iter().map(|name| Some(place_of(name))).collect(),
            oriented: false,
            names,
            parts,
            findings: Vec::new(),
        };
        let of_body = |row: &Measurement| Measurement {
            target: if row.target == *reference { String::new() } else { row.target.clone() },
            ..row.clone()
        };
        let doubt_mm = (DOUBT * fit.left_mm).max(LEAST_DOUBT_MM);
        Some(Apart { rows: rows.iter().map(of_body).collect(), targets, sensor_from_base, doubt_mm })
    }

    /// What each row's point gains, mm, from each coordinate of each part's place that is off by a standard deviation.
    pub fn columns(&self, set: &Dataset, nominal: &Robot) -> Vec<Matrix3xX<f64>> {
        let parts: Vec<&String> = self.targets.parts.keys().collect();
        let of_pose = |pose: &crate::identify::data::dataset::Pose| {
            let mut columns = Matrix3xX::zeros(3 * parts.len());
            let frame = &self.sensor_from_base[&set.groups[pose.group].name];
            let turn = (frame * nominal.base_from_flange(&pose.joints_rad)).rotation.to_rotation_matrix();
            let own = parts.iter().position(|name| pose.on_body_mm == self.targets.part_mm(name));
            if let Some(part) = own {
                columns.fixed_columns_mut::<3>(3 * part).copy_from(&(turn.matrix() * self.doubt_mm));
            }
            columns
        };
        set.poses.iter().map(of_pose).collect()
    }
}

/// The points by the names of their targets; `None` where there is one, or a pose shows two, or a target has too few.
fn by_target(rows: &[Measurement]) -> Option<BTreeMap<String, Vec<(&Measurement, Point3<f64>)>>> {
    let mut of_target: BTreeMap<String, Vec<(&Measurement, Point3<f64>)>> = BTreeMap::new();
    let mut shown: BTreeMap<&str, &str> = BTreeMap::new();
    for row in rows {
        match &row.observed {
            Observed::Position { point_mm, .. } => {
                if shown.insert(&row.at.pose, &row.target).is_some_and(|other| other != row.target) {
                    return None;
                }
                of_target.entry(row.target.clone()).or_default().push((row, *point_mm));
            }
            Observed::Distance { .. } => return None,
            Observed::Missing { .. } => {}
        }
    }
    let enough = of_target.len() > 1 && of_target.values().all(|rows| rows.len() >= FEWEST_OF_OTHER);
    enough.then_some(of_target)
}
