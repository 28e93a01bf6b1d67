//! Measurements sorted for identification: by group and role, with what could not be used and why.
//!
//! In: rows of `measurements.csv`. Out: poses with joint angles in rad and one kind of reading for all of them. A group
//! without a centre row takes the used pose nearest to the centroid of its points as its reference; its distances are
//! to a fixed point that is unknown. Readings that follow each other at one pose are one (see [`super::repeats`]).

use nalgebra::{Matrix3, Matrix3xX, Point3, Vector3};

use super::repeats::{self, Repeats};
use super::targets::{self, Targets};
use crate::identify::Error;
use crate::identify::sensor::{Extra, FLOOR_MM2};
use crate::measurements::{Measurement, Observed, Role};
use crate::robot::Robot;
use crate::tables::names::Unit;

/// What all readings of a set are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Kind {
    /// Points in the group's own frame.
    #[default]
    Positions,
    /// Distances to the group's centre, or to a fixed point that is unknown.
    Distances,
}

/// What was read at a pose.
#[derive(Debug, Clone, PartialEq)]
pub enum Reading {
    /// The mark point, and more where known.
    Position {
        /// In the group's frame, mm.
        point_mm: Point3<f64>,
        covariance_mm2: Option<Matrix3<f64>>,
        /// `sensor_from_target` as a rotation vector.
        rotation_rad: Option<Vector3<f64>>,
    },
    Distance {
        distance_mm: f64,
        /// Its standard deviation, mm.
        sigma_mm: Option<f64>,
    },
    /// The centre of a group of distances: the place itself, with nothing to read.
    Reference,
}

impl Reading {
    /// The point; `None` of distances.
    pub fn point_mm(&self) -> Option<Point3<f64>> {
        if let Reading::Position { point_mm, .. } = self { Some(*point_mm) } else { None }
    }

    pub fn covariance_mm2(&self) -> Option<Matrix3<f64>> {
        if let Reading::Position { covariance_mm2, .. } = self { *covariance_mm2 } else { None }
    }

    /// `sensor_from_target` as a rotation vector.
    pub fn rotation_rad(&self) -> Option<Vector3<f64>> {
        if let Reading::Position { rotation_rad, .. } = self { *rotation_rad } else { None }
    }

    /// Mean variance of a coordinate, or of the distance, that it states, mm^2.
    pub fn variance_mm2(&self) -> Option<f64> {
        match self {
            Reading::Position { covariance_mm2: Some(c), .. } => Some(c.trace() / 3.0),
            Reading::Distance { sigma_mm: Some(s), .. } => Some(s * s),
            _ => None,
        }
    }
}

/// A pose that can be used.
#[derive(Debug, Clone, PartialEq)]
pub struct Pose {
    pub name: String,
    /// Index of its group.
    pub group: usize,
    /// What it is for.
    pub role: Role,
    /// Commanded angles, rad.
    pub joints_rad: Vec<f64>,
    pub reading: Reading,
    /// Where on a body of several targets the point stands, from its mark point and in the body's frame, mm.
    /// `None` for the mark point itself.
    pub on_body_mm: Option<Vector3<f64>>,
}

/// One placement of the sensor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Group {
    pub name: String,
    /// Index of its centre pose, where it has a row.
    pub center: Option<usize>,
}

/// A row that was left out.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Skipped {
    pub pose: String,
    /// Why.
    pub reason: String,
}

/// All that can be used, in the order of the file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Dataset {
    pub kind: Kind,
    /// Placements, in order of appearance.
    pub groups: Vec<Group>,
    pub poses: Vec<Pose>,
    /// Rows without a usable reading.
    pub skipped: Vec<Skipped>,
    /// Readings that were repeated at one pose, where there were any.
    pub repeats: Option<Repeats>,
    /// The same with points at equal joints as rows of their own where an instrument does not read one place so.
    pub apart: Option<Box<Dataset>>,
    /// What each pose's point moves by with each shared error of the sensor, mm a standard deviation; or empty.
    pub shared: Vec<Matrix3xX<f64>>,
    /// Standard deviation of the scale of cameras about which nothing is stated, where `shared` is that scale alone.
    pub supposed_scale: Option<f64>,
    /// Which joints slide; empty where none does.
    pub slides: Vec<bool>,
    /// Rows whose covariance was singular and got a floor, by pose.
    pub floored: Vec<String>,
    /// Known distances between touched points.
    pub known: Vec<KnownDistance>,
    /// The targets whose rows were made one a pose, where there were several.
    pub targets: Option<Targets>,
    /// Names of the files of a run of several, by whose number the poses' names begin (`2:17`); empty of one.
    pub files: Vec<String>,
    /// The unit of lengths that was typed, where one was.
    pub typed_unit: Option<Unit>,
    /// That of angles.
    pub typed_angle: Option<Unit>,
    /// Whether x of the points is negated against the file, whose frame is left-handed.
    pub mirrored: bool,
}

/// A known distance between the points that two groups touched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownDistance {
    /// Index of one group.
    pub a: usize,
    /// Index of the other.
    pub b: usize,
    pub distance_mm: f64,
    /// Its standard deviation, where it comes with one.
    pub stated_sigma_mm: Option<f64>,
}

impl Dataset {
    /// Sorts the rows, several targets of a pose and repeated readings made one.
    pub fn new(rows: &[Measurement]) -> Result<Dataset, Error> {
        let (of_targets, targets) = targets::as_one(rows)?.unzip();
        Dataset::of_rows(of_targets.as_deref().unwrap_or(rows), targets)
    }

    /// The same where the nominal robot is known: it joins targets of which no pose shows two.
    pub fn of_robot(rows: &[Measurement], nominal: &Robot) -> Result<Dataset, Error> {
        let Some(joined) = targets::Joined::new(rows, nominal) else { return Dataset::new(rows) };
        let mut set = Dataset::of_rows(&joined.rows, Some(joined.targets.clone()))?;
        let columns = |p: &Pose| joined.columns(&set.groups[p.group].name, &p.joints_rad, p.on_body_mm, nominal);
        set.shared = set.poses.iter().map(columns).collect();
        Ok(set)
    }

    /// Of one row a pose, whose targets are these.
    pub fn of_rows(rows: &[Measurement], targets: Option<Targets>) -> Result<Dataset, Error> {
        let apart = if targets.is_none() { repeats::apart(rows) } else { None };
        let mut set = Dataset::of_poses(repeats::as_one(rows), targets)?;
        set.apart = apart.map(|apart| Dataset::of_poses(apart, None)).transpose()?.map(Box::new);
        Ok(set)
    }

    /// Of rows that were made one a pose.
    fn of_poses((rows, repeats): repeats::AsOne, targets: Option<Targets>) -> Result<Dataset, Error> {
        let positions = rows.iter().any(|r| matches!(r.observed, Observed::Position { .. }));
        let kind = if positions { Kind::Positions } else { Kind::Distances };
        let slides = rows.first().map_or_else(Vec::new, |r| r.at.slides.clone());
        let mut set = Dataset { kind, repeats, slides, targets, ..Dataset::default() };
        for row in &rows {
            let group = set.group(&row.at.group);
            if let Observed::Position { covariance_mm2: Some(c), .. } = &row.observed
                && is_singular(c)
            {
                set.floored.push(row.at.pose.clone());
            }
            match reading(kind, row) {
                Ok(reading) => {
                    if row.at.role == Role::Center {
                        set.groups[group].center = Some(set.poses.len());
                    }
                    set.poses.push(Pose {
                        name: row.at.pose.clone(),
                        group,
                        role: row.at.role,
                        joints_rad: row.at.joints_rad(),
                        reading,
                        on_body_mm: set.targets.as_ref().and_then(|t| t.part_mm(&row.target)),
                    });
                }
                Err(reason) => set.skipped.push(Skipped { pose: row.at.pose.clone(), reason }),
            }
        }
        let samples = set.poses.iter().filter(|p| p.role == Role::Sample).count();
        if samples == 0 {
            let reason = set.skipped.first().map(|skipped| format!("{}, {}", skipped.pose, skipped.reason));
            return Err(Error::NoSamples { rows: rows.len(), skipped: set.skipped.len(), reason });
        }
        Ok(set)
    }

    fn group(&mut self, name: &str) -> usize {
        self.groups.iter().position(|g| g.name == name).unwrap_or_else(|| {
            self.groups.push(Group { name: name.to_owned(), center: None });
            self.groups.len() - 1
        })
    }

    /// Without these rows, for this reason.
    pub fn without(mut self, rows: &[usize], reason: &str) -> Dataset {
        let left_out: Vec<bool> = (0..self.poses.len()).map(|row| rows.contains(&row)).collect();
        let before = |row: usize| left_out[..row].iter().filter(|out| **out).count();
        for group in &mut self.groups {
            group.center = group.center.filter(|&c| !left_out[c]).map(|c| c - before(c));
        }
        let skipped = |row: &usize| Skipped { pose: self.poses[*row].name.clone(), reason: reason.to_owned() };
        self.skipped.extend(rows.iter().map(skipped));
        let mut kept = left_out.iter().map(|out| !out);
        self.poses.retain(|_| kept.next().unwrap_or(true));
        let mut kept = left_out.iter().map(|out| !out);
        self.shared.retain(|_| kept.next().unwrap_or(true));
        self
    }

    /// Indices of the poses that `keep` likes.
    pub fn rows(&self, keep: impl Fn(&Pose) -> bool) -> Vec<usize> {
        (0..self.poses.len()).filter(|&i| keep(&self.poses[i])).collect()
    }

    /// Those of these rows that are of a group.
    pub fn of_group(&self, rows: &[usize], group: usize) -> Vec<usize> {
        rows.iter().copied().filter(|&row| self.poses[row].group == group).collect()
    }

    pub fn joint_count(&self) -> usize {
        self.poses.first().map_or(0, |pose| pose.joints_rad.len())
    }

    /// Whether a joint slides, by its index.
    pub fn is_sliding(&self, joint: usize) -> bool {
        self.slides.get(joint) == Some(&true)
    }

    /// Their names.
    pub fn names(&self, rows: &[usize]) -> Vec<String> {
        rows.iter().map(|&row| self.poses[row].name.clone()).collect()
    }

    /// Rows with a point, so many of each group at the least; an error where distances were measured, or of fewer.
    pub fn placing_rows(&self, fewest: usize) -> Result<Vec<usize>, Error> {
        if self.kind != Kind::Positions {
            return Err(Error::ModelNeeds { model: "position", needed: "positions (x_mm, y_mm, z_mm)" });
        }
        let rows = self.rows(|pose| pose.reading.point_mm().is_some());
        for (index, group) in self.groups.iter().enumerate() {
            let found = self.of_group(&rows, index).len();
            if found < fewest {
                return Err(Error::TooFewToPlace { group: group.name.clone(), found, needed: fewest });
            }
        }
        Ok(rows)
    }

    /// Rows that may be fitted: centres and samples.
    pub fn fit_rows(&self) -> Vec<usize> {
        self.rows(|p| p.role != Role::Verify)
    }

    /// Rows kept for verification.
    pub fn verify_rows(&self) -> Vec<usize> {
        self.rows(|p| p.role == Role::Verify)
    }

    /// The pose that a group's verification distances are measured from: its centre, or of the fitted rows the one
    /// nearest to the centroid of their points. A centre that is not fitted, being a gross error, is no reference where
    /// other rows of its group are. `None` where no row of the group is fitted, and for wire lengths.
    pub fn reference(&self, group: usize, fitted: &[usize]) -> Option<usize> {
        if let Some(center) = self.groups[group].center
            && (fitted.contains(&center) || !fitted.iter().any(|&i| self.poses[i].group == group))
        {
            return Some(center);
        }
        let points: Vec<(usize, Point3<f64>)> = fitted
            .iter()
            .filter(|&&i| self.poses[i].group == group && self.poses[i].on_body_mm.is_none())
            .filter_map(|&i| Some((i, self.poses[i].reading.point_mm()?)))
            .collect();
        let count = points.len().max(1) as f64;
        let centroid = points.iter().fold(Vector3::zeros(), |sum, (_, p)| sum + p.coords) / count;
        let nearest = points.iter().min_by(|(_, a), (_, b)| {
            (a.coords - centroid).norm_squared().total_cmp(&(b.coords - centroid).norm_squared())
        });
        nearest.map(|&(i, _)| i)
    }

    /// What stands somewhere at a placement, and may have moved from one to the next.
    pub fn stands(&self) -> &'static str {
        let has_touches = (0..self.poses.len()).any(|row| self.touches(row));
        match self.kind {
            Kind::Distances if has_touches => "the socket",
            Kind::Distances if self.groups.iter().any(|group| group.center.is_none()) => {
                "the wire's anchor or its zero"
            }
            Kind::Distances | Kind::Positions => "the sensor",
        }
    }

    /// Whether a row's distance of zero says that the target was at its group's unknown point.
    pub fn touches(&self, row: usize) -> bool {
        let pose = &self.poses[row];
        self.kind == Kind::Distances
            && self.groups[pose.group].center.is_none()
            && matches!(pose.reading, Reading::Distance { distance_mm, .. } if distance_mm == 0.0)
    }

    /// Whether cameras read it: they state an orientation and a covariance with each point; others at most one.
    pub fn is_of_cameras(&self) -> bool {
        let both = |p: &Pose| p.reading.rotation_rad().is_some() && p.reading.covariance_mm2().is_some();
        !self.shared.is_empty() || self.poses.iter().any(both)
    }

    /// Whether distances are read to centres.
    pub fn to_centers(&self) -> bool {
        self.kind == Kind::Distances && self.groups.iter().any(|g| g.center.is_some())
    }

    /// Whether every pose has an orientation, but for those that show a part of a body of several targets.
    pub fn has_rotations(&self) -> bool {
        let mut whole = self.poses.iter().filter(|p| p.on_body_mm.is_none()).peekable();
        whole.peek().is_some() && whole.all(|p| p.reading.rotation_rad().is_some())
    }

    /// Whether the places of targets are those in the flange's frame: of targets that the robot joined.
    pub fn are_on_flange(&self) -> bool {
        self.targets.as_ref().is_some_and(|targets| targets.place_sigma_mm.is_some())
    }

    /// How the target is turned on the flange, where orientations are used, or where a point cannot be predicted
    /// without it: where poses show a part of a body of several targets.
    pub fn target_unknowns(&self, oriented: bool) -> &'static [Extra] {
        match oriented || !self.are_on_flange() && self.poses.iter().any(|p| p.on_body_mm.is_some()) {
            true => &[Extra::Target(0), Extra::Target(1), Extra::Target(2)],
            false => &[],
        }
    }
}

/// Whether a covariance has a direction without variance: rounded to zero, or a resolution taken for perfection.
fn is_singular(covariance_mm2: &Matrix3<f64>) -> bool {
    let eigen = covariance_mm2.symmetric_eigenvalues();
    eigen.min() <= 1e-9 * eigen.max()
}

fn reading(kind: Kind, row: &Measurement) -> Result<Reading, String> {
    match (&row.observed, kind) {
        (Observed::Position { point_mm, covariance_mm2, rotation_rad }, Kind::Positions) => Ok(Reading::Position {
            point_mm: *point_mm,
            covariance_mm2: covariance_mm2
                .map(|c| if is_singular(&c) { c + Matrix3::identity() * FLOOR_MM2 } else { c }),
            rotation_rad: *rotation_rad,
        }),
        (_, Kind::Distances) if row.at.role == Role::Center => Ok(Reading::Reference),
        (Observed::Distance { distance_mm, sigma_mm }, Kind::Distances) => {
            Ok(Reading::Distance { distance_mm: *distance_mm, sigma_mm: *sigma_mm })
        }
        (Observed::Missing { reason }, _) => Err(reason.clone()),
        (Observed::Distance { .. }, Kind::Positions) => Err("a distance among positions".to_owned()),
        (Observed::Position { .. }, Kind::Distances) => Err("a position among distances".to_owned()),
    }
}

#[cfg(test)]
mod tests;
