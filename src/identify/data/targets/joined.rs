//! Several targets of which no pose shows two: each row is a point of one body, and the robot alone joins them.
//!
//! In: rows with the names of their targets, and the nominal robot. Out: the same rows as points of a body, where its
//! targets stand as the nominal robot tells, and for each row what a target that stands elsewhere would move. The
//! places are as good as that robot; what they are off by is solved with its parameters, by unknowns that all rows of a
//! target share. What goes wrong: a target with few rows says little; a placement of the sensor that shows only some of
//! the targets joins none of them.

use std::collections::BTreeMap;

use nalgebra::{Matrix3xX, Point3, Vector3};

use super::body::middle;
use super::merge::{Part, Targets};
use crate::geometry::{Transform, fitted_frame};
use crate::measurements::{Measurement, Observed};
use crate::robot::Robot;
use crate::robot::tool_fit::Start;

/// Rows of the target that has most, in the placement that shows it most often: three numbers each against placement
/// and tool.
const FEWEST: usize = 6;

/// Rows of it in any other placement, where the tool is known.
const FEWEST_PLACED: usize = 4;

/// Rows of any other target: as many numbers as its place has, and more.
const FEWEST_OF_OTHER: usize = 2;

/// Standard deviation of a place's coordinate, as a multiple of what the nominal robot is off by in the middle of the
/// rows, and mm at the least.
const SIGMA_OVER_ROBOT: f64 = 3.0;
const LEAST_SIGMA_MM: f64 = 0.5;

/// Targets that the nominal robot joins.
pub struct Joined {
    /// The rows; those of the target that has most are the mark point's, the others are of parts of the body.
    pub rows: Vec<Measurement>,
    pub targets: Targets,
    /// Where the base stands at the sensor, by group.
    sensor_from_base: BTreeMap<String, Transform>,
    /// Standard deviation of a place's coordinate, mm.
    sigma_mm: f64,
}

/// A row and the point that it shows.
type Seen<'a> = (&'a Measurement, Point3<f64>);

impl Joined {
    /// `None` where there is one target, where a pose shows several, or where the rows are too few.
    pub fn new(rows: &[Measurement], nominal: &Robot) -> Option<Joined> {
        let of_target = by_target(rows)?;
        let most = of_target.values().map(Vec::len).max()?;
        let (reference, seen) = of_target.iter().find(|(_, rows)| rows.len() == most)?;
        let (sensor_from_base, off_mm) = placements(seen, nominal)?;
        if rows.iter().any(|row| !sensor_from_base.contains_key(&row.at.group)) {
            return None;
        }
        let tool = |seen: &[Seen]| {
            let on_flange = |(row, point): &Seen| {
                let flange = nominal.base_from_flange(&row.at.joints_rad());
                ((sensor_from_base[&row.at.group] * flange).inverse() * point).coords
            };
            middle(&seen.iter().map(on_flange).collect::<Vec<_>>())
        };
        let origin = tool(seen);
        let part = |(name, seen): (&String, &Vec<Seen>)| {
            (name.clone(), Part { place_mm: (tool(seen) - origin).into(), poses: seen.len() })
        };
        let parts: BTreeMap<String, Part> = of_target.iter().filter(|(name, _)| *name != reference).map(part).collect();
        let place_of = |name: &String| parts.get(name).map_or([0.0; 3], |part| part.place_mm);
        let names: Vec<String> = of_target.keys().cloned().collect();
        let places_mm = names.iter().map(|name| Some(place_of(name))).collect();
        let of_body = |row: &Measurement| Measurement {
            target: if row.target == *reference { String::new() } else { row.target.clone() },
            ..row.clone()
        };
        let sigma_mm = (SIGMA_OVER_ROBOT * off_mm).max(LEAST_SIGMA_MM);
        let targets = Targets { names, places_mm, place_sigma_mm: Some(sigma_mm), parts, ..Targets::default() };
        Some(Joined { rows: rows.iter().map(of_body).collect(), targets, sensor_from_base, sigma_mm })
    }

    /// What the point of a pose of this group gains, mm, from each coordinate of each part's place that is off by a
    /// standard deviation, the pose showing the part that stands there on the body.
    pub fn columns(
        &self,
        group: &str,
        joints_rad: &[f64],
        on_body_mm: Option<Vector3<f64>>,
        nominal: &Robot,
    ) -> Matrix3xX<f64> {
        let mut columns = Matrix3xX::zeros(3 * self.targets.parts.len());
        let own = self.targets.parts.values().position(|part| on_body_mm == Some(part.place_mm.into()));
        if let Some(part) = own {
            let turn = (self.sensor_from_base[group] * nominal.base_from_flange(joints_rad)).rotation;
            let moved = turn.to_rotation_matrix().into_inner() * self.sigma_mm;
            columns.fixed_columns_mut::<3>(3 * part).copy_from(&moved);
        }
        columns
    }
}

/// Rows of one target each as points of a body, whose targets' places on the flange an earlier identification joined;
/// `None` where there is one target, or one that it does not know.
pub fn of_places(
    rows: &[Measurement],
    places_mm: &BTreeMap<String, Vector3<f64>>,
) -> Option<(Vec<Measurement>, Targets)> {
    let mut parts: BTreeMap<String, Part> = BTreeMap::new();
    let mut of_body = rows.to_vec();
    for row in &mut of_body {
        let place = places_mm.get(&row.target)?;
        parts.entry(row.target.clone()).or_insert(Part { place_mm: (*place).into(), poses: 0 }).poses += 1;
        if place.norm() == 0.0 {
            row.target.clear();
        }
    }
    let names: Vec<String> = parts.keys().cloned().collect();
    let places_mm = parts.values().map(|part| Some(part.place_mm)).collect();
    let is_several = names.len() > 1;
    parts.retain(|_, part| part.place_mm != [0.0; 3]);
    // They are not solved anew.
    let targets = Targets { names, places_mm, place_sigma_mm: Some(0.0), parts, ..Targets::default() };
    is_several.then_some((of_body, targets))
}

/// Where the base stands at the sensor, by group, from what one target shows, and what the nominal robot is off by in
/// the middle of the rows, mm.
fn placements(seen: &[Seen], nominal: &Robot) -> Option<(BTreeMap<String, Transform>, f64)> {
    let mut groups: BTreeMap<&str, Vec<&Seen>> = BTreeMap::new();
    for row in seen {
        groups.entry(&row.0.at.group).or_default().push(row);
    }
    let most = groups.values().max_by_key(|rows| rows.len()).filter(|rows| rows.len() >= FEWEST)?;
    let (joints, points): (Vec<_>, Vec<_>) = most.iter().map(|(row, point)| (row.at.joints_rad(), *point)).unzip();
    let fit = nominal.fit_tool(&joints, &points, Start::Around)?;
    let place = |(group, rows): (&&str, &Vec<&Seen>)| {
        let predicted = rows.iter().map(|(row, point)| {
            (nominal.base_from_flange(&row.at.joints_rad()) * Point3::from(fit.tool_mm), *point, 1.0)
        });
        ((*group).to_owned(), fitted_frame(predicted))
    };
    let placed = groups.iter().filter(|(_, rows)| rows.len() >= FEWEST_PLACED).map(place).collect();
    Some((placed, fit.left_mm))
}

/// The points by the names of their targets; `None` where there is one, or a pose shows two, or a target has too few.
fn by_target(rows: &[Measurement]) -> Option<BTreeMap<String, Vec<Seen<'_>>>> {
    let mut of_target: BTreeMap<String, Vec<Seen>> = BTreeMap::new();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::synthetic;

    #[test]
    fn rows_of_places_that_are_known_are_counted_by_target() {
        let places =
            [("mark", Vector3::zeros()), ("a", Vector3::new(60.0, 0.0, 20.0)), ("b", Vector3::new(0.0, -50.0, 9.0))];
        let world = synthetic::planned(20, 0, 25.0, 0.0, 3, &|_| {});
        let mut rows = synthetic::of_targets(&world, &places, 0.0, 3);
        // One target a pose, the second at one in four only.
        let shown = |pose: usize| if pose.is_multiple_of(4) { "b" } else { ["mark", "a"][pose % 2] };
        let mut index = 0..;
        rows.retain(|row| index.next().is_some_and(|k: usize| row.target == shown(k / places.len())));
        let known = places.iter().map(|(name, place)| ((*name).to_owned(), *place)).collect();
        let (of_body, targets) = of_places(&rows, &known).unwrap();
        let counts: Vec<(&str, usize)> = targets.parts.iter().map(|(name, part)| (name.as_str(), part.poses)).collect();
        assert_eq!(counts, [("a", 12), ("b", 6)]);
        assert_eq!(of_body.iter().filter(|row| row.target.is_empty()).count(), rows.len() - 18);
        assert!(of_places(&rows, &BTreeMap::from([("a".to_owned(), Vector3::x())])).is_none());
    }
}
