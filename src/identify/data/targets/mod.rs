//! Several targets at each pose, told apart by the column `target`, made one: a point and an orientation.
//!
//! In: rows with the names of their targets. Out: one row a pose, its mark point the mean of all targets, its orientation that of the body
//! that they make, and what was found wrong at poses where the targets do not stand to each other as elsewhere. Targets on a line, or
//! two, tell no turn about it: then there is the mean alone, of poses that show all of them.
//! What a robot does wrong at a pose, all its targets share; as rows of their own they would count it several times.
//! What goes wrong: targets that are no rigid body, or that no pose shows together; both are errors.

mod body;
mod moved;

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Point3, Vector3};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

use super::doctor::Finding;
use crate::geometry::rotation_vector;
use crate::identify::Error;
use crate::measurements::{Measurement, Observed};
use crate::statistics::{chi_square_quantile, median};
use body::{Body, Sighting};
use moved::Moved;

/// Of clean sets, the share in which a pose is taken for one with a gross error.
const FALSE_ALARMS: f64 = 1e-3;

/// Scatter of the targets against each other, as a share of their extent, that no rigid body has.
const RIGID: f64 = 0.05;

/// Scatter that the numbers of a file have at the least, as a share of the targets' extent.
const LEAST_SCATTER: f64 = 1e-7;

/// Variance that a stated covariance has in each direction at the least, as a share of its largest.
const LEAST_VARIANCE: f64 = 1e-6;

/// The targets of a set.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Targets {
    /// Their names, in order of appearance.
    pub names: Vec<String>,
    /// Root mean square of a coordinate's residual against the body, mm.
    pub scatter_mm: f64,
    /// Where they stand in a frame of their own, whose origin is the mark point, mm; `null` for one that no pose joins to the others.
    pub places_mm: Vec<Option<[f64; 3]>>,
    /// Whether they tell an orientation.
    pub oriented: bool,
    /// What was wrong at single poses.
    #[serde(skip)]
    pub findings: Vec<Finding>,
}

impl Targets {
    /// For the terminal and the page.
    pub fn sentence(&self) -> String {
        format!(
            "{} targets a pose ({}) agree within {:.4} mm a coordinate; the mark point is their mean{}",
            self.names.len(),
            self.names.join(", "),
            self.scatter_mm,
            if self.oriented { "" } else { ", without an orientation, for they stand on a line" }
        )
    }
}

/// All rows of one pose.
struct Shown<'a> {
    first: &'a Measurement,
    sightings: Vec<Sighting>,
    /// Why there are none.
    reason: Option<&'a str>,
}

/// What a pose's targets tell.
enum Judged {
    /// The mark point, its covariance where readings state theirs, and the orientation.
    Taken { observed: Observed, left_out: Option<usize>, exchanged: Option<(usize, usize)> },
    /// Not to be had, and whether that is because the targets don't stand as elsewhere.
    Refused { reason: String, misfit: bool },
}

/// One row a pose. `None` where no pose has several targets by name.
pub fn as_one(rows: &[Measurement]) -> Result<Option<(Vec<Measurement>, Targets)>, Error> {
    let mut names: Vec<String> = Vec::new();
    for row in rows {
        if !names.contains(&row.target) {
            names.push(row.target.clone());
        }
    }
    if names.len() < 2 {
        return Ok(None);
    }
    if rows.iter().any(|r| matches!(r.observed, Observed::Distance { .. })) {
        return Err(Error::Targets {
            message: format!("distances of {} targets ({})", names.len(), names.join(", ")),
            hint: "several targets a pose are measured as points; identify with one target's distances at a time",
        });
    }
    let stated = rows.iter().all(|r| !matches!(r.observed, Observed::Position { covariance_mm2: None, .. }));
    let mut poses = shown(rows, &names, stated);
    let moved = told_apart(&mut poses, &mut names);
    let seen: Vec<Vec<Sighting>> = poses.iter().map(|p| p.sightings.clone()).collect();
    let body = Body::new(&seen, names.len()).ok_or_else(|| Error::Targets {
        message: format!("the rows are of {} targets ({}), but no pose shows two of them", names.len(), names.join(", ")),
        hint: "the rows of one pose have the same `pose`; targets that are never seen together are identified one at a time",
    })?;
    let sorter = Sorter::new(body, &seen, stated).refined(&seen);
    let scatter_mm = sorter.scatter_mm(&seen);
    sorter.check_rigid(scatter_mm, &names)?;
    let judged: Vec<Judged> = poses.iter().map(|pose| sorter.judge(pose)).collect();
    let findings = findings(&poses, &judged, &moved, &names, &sorter);
    let targets = Targets {
        scatter_mm,
        places_mm: sorter.body.places_mm.iter().map(|p| p.map(Into::into)).collect(),
        oriented: !sorter.body.is_line(),
        names,
        findings,
    };
    let one = |(pose, judged): (&Shown, Judged)| {
        let observed = match judged {
            Judged::Taken { observed, .. } => observed,
            Judged::Refused { reason, .. } => Observed::Missing { reason },
        };
        Measurement { at: pose.first.at.clone(), target: String::new(), observed }
    };
    Ok(Some((poses.iter().zip(judged).map(one).collect(), targets)))
}

/// The rows by pose, in order of appearance.
fn shown<'a>(rows: &'a [Measurement], names: &[String], stated: bool) -> Vec<Shown<'a>> {
    let mut poses: Vec<Shown> = Vec::new();
    let mut at: BTreeMap<&str, usize> = BTreeMap::new();
    for row in rows {
        let index = *at.entry(&row.at.pose).or_insert(poses.len());
        if index == poses.len() {
            poses.push(Shown { first: row, sightings: Vec::new(), reason: None });
        }
        match &row.observed {
            Observed::Position { point_mm, covariance_mm2, .. } => {
                let precision = covariance_mm2.filter(|_| stated).map_or(Matrix3::identity(), |c| inverse(&c));
                let target = names.iter().position(|name| *name == row.target).unwrap_or(0);
                poses[index].sightings.push(Sighting { target, point_mm: *point_mm, precision });
            }
            Observed::Missing { reason } => poses[index].reason = Some(reason),
            Observed::Distance { .. } => {}
        }
    }
    poses
}

/// Makes targets that moved others from there on; each with the index that it has from there on.
fn told_apart(poses: &mut [Shown], names: &mut Vec<String>) -> Vec<(Moved, usize)> {
    let mut list = Vec::new();
    let most = names.len();
    while list.len() < most {
        let seen: Vec<Vec<Sighting>> = poses.iter().map(|p| p.sightings.clone()).collect();
        let Some(moved) = moved::next(&seen, names.len()) else { break };
        let new = names.len();
        names.push(format!("{} from {} on", names[moved.target], poses[moved.from].first.at.pose));
        let later = poses[moved.from..].iter_mut().flat_map(|pose| &mut pose.sightings);
        later.filter(|s| s.target == moved.target).for_each(|s| s.target = new);
        list.push((moved, new));
    }
    list
}

/// Of a covariance that may be singular.
fn inverse(covariance: &Matrix3<f64>) -> Matrix3<f64> {
    let eigen = covariance.symmetric_eigen();
    let least = (LEAST_VARIANCE * eigen.eigenvalues.max()).max(super::dataset::FLOOR_MM2);
    let inverse = eigen.eigenvalues.map(|v| 1.0 / v.max(least));
    eigen.eigenvectors * Matrix3::from_diagonal(&inverse) * eigen.eigenvectors.transpose()
}

/// Tells poses at which the targets stand to each other as elsewhere from those at which they don't.
struct Sorter {
    body: Body,
    /// Factor between the precisions and what the residuals show; a variance in mm^2 where no covariance is stated.
    variance: f64,
    /// Quantile of the normal distribution for one pose.
    normal: f64,
    stated: bool,
}

impl Sorter {
    fn new(body: Body, poses: &[Vec<Sighting>], stated: bool) -> Sorter {
        let one = 1.0 - FALSE_ALARMS / poses.len().max(1) as f64;
        let normal = Normal::standard().inverse_cdf(one);
        let mut sorter = Sorter { body, variance: 1.0, normal, stated };
        sorter.variance = sorter.shown_variance(poses);
        sorter
    }

    /// The body from the poses that fit, by least squares, and the scatter with it.
    fn refined(self, poses: &[Vec<Sighting>]) -> Sorter {
        let good: Vec<Vec<Sighting>> = poses.iter().filter(|pose| self.fits(pose)).cloned().collect();
        let body = self.body.by_means(&good);
        let mut sorter = Sorter { body, ..self };
        sorter.variance = sorter.shown_variance(poses);
        sorter
    }

    /// Chi-squared of a pose and its degrees of freedom: of all six numbers of a pose, or on a line of the distances along it.
    fn chi_square(&self, pose: &[Sighting]) -> Option<(f64, usize)> {
        if self.body.is_line() {
            return self.chi_square_along(pose);
        }
        self.body.placed(pose).filter(|p| p.freedom > 0).map(|p| (p.chi_square, p.freedom))
    }

    /// Of the distances from the first target that a pose shows.
    fn chi_square_along(&self, pose: &[Sighting]) -> Option<(f64, usize)> {
        let place = |s: &Sighting| self.body.places_mm[s.target];
        let (first, rest) = pose.split_first()?;
        let mut sum = 0.0;
        for other in rest {
            let way = other.point_mm - first.point_mm;
            let along = way.try_normalize(0.0)?;
            let variance: f64 =
                [first, other].iter().filter_map(|s| Some(along.dot(&(s.precision.try_inverse()? * along)))).sum();
            sum += (way.norm() - (place(other)? - place(first)?).norm()).powi(2) / variance;
        }
        (!rest.is_empty()).then_some((sum, rest.len()))
    }

    /// By how much the residuals exceed the precisions, from the median pose, so that gross errors don't count.
    fn shown_variance(&self, poses: &[Vec<Sighting>]) -> f64 {
        let of_pose = |(chi_square, freedom): (f64, usize)| chi_square / chi_square_quantile(freedom as f64, 0.0);
        let shown = median(poses.iter().filter_map(|pose| self.chi_square(pose)).map(of_pose)).unwrap_or(1.0);
        match self.stated {
            true => shown.max(1.0),
            false => shown.max((LEAST_SCATTER * self.body.extent_mm()).powi(2)).max(f64::MIN_POSITIVE),
        }
    }

    fn fits(&self, pose: &[Sighting]) -> bool {
        self.chi_square(pose).is_some_and(|(chi_square, freedom)| chi_square <= self.limit(freedom))
    }

    /// Chi-squared that one clean pose in very many exceeds. Where nothing says how the noise is spread over the directions, it may all lie in
    /// one.
    fn limit(&self, freedom: usize) -> f64 {
        let quantile = |freedom: f64, normal: f64| chi_square_quantile(freedom, normal);
        let freedom = freedom as f64;
        match self.stated {
            true => self.variance * quantile(freedom, self.normal),
            false => self.variance * quantile(freedom, 0.0) * quantile(1.0, self.normal) / quantile(1.0, 0.0),
        }
    }

    /// Root mean square of a coordinate's residual over the poses that fit, mm, the freedom that the poses' fits used taken into account.
    fn scatter_mm(&self, poses: &[Vec<Sighting>]) -> f64 {
        let plain = |pose: &Vec<Sighting>| -> Vec<Sighting> {
            pose.iter().map(|s| Sighting { precision: Matrix3::identity(), ..*s }).collect()
        };
        let of_pose = |pose: &Vec<Sighting>| self.chi_square(&plain(pose));
        let (sum, freedom) = poses
            .iter()
            .filter(|pose| self.fits(pose))
            .filter_map(of_pose)
            .fold((0.0, 0), |(s, f), (c, n)| (s + c, f + n));
        (sum / freedom.max(1) as f64).sqrt()
    }

    fn check_rigid(&self, scatter_mm: f64, names: &[String]) -> Result<(), Error> {
        let extent_mm = self.body.extent_mm();
        if scatter_mm <= RIGID * extent_mm {
            return Ok(());
        }
        Err(Error::Targets {
            message: format!(
                "the {} targets of a pose ({}) are no rigid body: a coordinate of their places to each other scatters by {scatter_mm:.3} mm, and they are {extent_mm:.1} mm from their mean",
                names.len(),
                names.join(", ")
            ),
            hint: "a name in `target` is the same target at all poses; is the column right, and are the targets fixed to the flange?",
        })
    }

    fn judge(&self, pose: &Shown) -> Judged {
        let sightings: Vec<Sighting> =
            pose.sightings.iter().filter(|s| self.body.places_mm[s.target].is_some()).copied().collect();
        let refused = |reason: String| Judged::Refused { reason, misfit: false };
        if sightings.is_empty() {
            return refused(pose.reason.unwrap_or("none of the targets").to_owned());
        }
        let enough =
            if self.body.is_line() { sightings.len() == self.body.count() } else { self.body.tells_turn(&sightings) };
        if !enough {
            let needed = if self.body.is_line() { "all of them" } else { "three off a line" };
            return refused(format!("{} of {} targets; {needed} are needed", sightings.len(), self.body.count()));
        }
        let taken = |sightings: &[Sighting], left_out, exchanged| {
            self.observed(sightings).map(|observed| Judged::Taken { observed, left_out, exchanged })
        };
        let found = if self.fits(&sightings) {
            taken(&sightings, None, None)
        } else if let Some((a, b, exchanged)) = self.exchanged(&sightings) {
            taken(&exchanged, None, Some((a, b)))
        } else {
            self.without_one(&sightings).and_then(|(out, rest)| taken(&rest, Some(out), None))
        };
        found.unwrap_or_else(|| {
            let freedom = self
                .chi_square(&sightings)
                .map_or(0.0, |(chi_square, freedom)| (chi_square / (self.variance * freedom as f64)).sqrt());
            let reason = format!(
                "the targets do not stand to each other as at the other poses: {freedom:.0} times their usual scatter"
            );
            Judged::Refused { reason, misfit: true }
        })
    }

    /// With the names of two targets exchanged, where that makes it fit.
    fn exchanged(&self, pose: &[Sighting]) -> Option<(usize, usize, Vec<Sighting>)> {
        let (mut best, mut least) = (None, f64::INFINITY);
        for i in 0..pose.len() {
            for k in 0..i {
                let mut other = pose.to_vec();
                (other[i].target, other[k].target) = (pose[k].target, pose[i].target);
                let Some((chi_square, _)) = self.chi_square(&other).filter(|_| self.fits(&other)) else { continue };
                if chi_square < least {
                    (best, least) = (Some((pose[k].target, pose[i].target, other)), chi_square);
                }
            }
        }
        best
    }

    /// Without the one target whose absence makes the rest fit.
    fn without_one(&self, pose: &[Sighting]) -> Option<(usize, Vec<Sighting>)> {
        if self.body.is_line() {
            return None;
        }
        let without = |out: usize| {
            let rest: Vec<Sighting> = pose.iter().filter(|s| s.target != out).copied().collect();
            let (chi_square, _) = self.chi_square(&rest).filter(|_| self.fits(&rest))?;
            Some((chi_square, out, rest))
        };
        let fitting = pose.iter().filter_map(|s| without(s.target));
        fitting.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, out, rest)| (out, rest))
    }

    fn observed(&self, pose: &[Sighting]) -> Option<Observed> {
        if self.body.is_line() {
            let count = pose.len() as f64;
            let mean = pose.iter().map(|s| s.point_mm.coords).sum::<Vector3<f64>>() / count;
            let covariance =
                pose.iter().filter_map(|s| s.precision.try_inverse()).sum::<Matrix3<f64>>() / (count * count);
            return Some(Observed::Position {
                point_mm: Point3::from(mean),
                covariance_mm2: self.stated.then_some(covariance),
                rotation_rad: None,
            });
        }
        let placed = self.body.placed(pose)?;
        Some(Observed::Position {
            point_mm: Point3::from(placed.sensor_from_body.translation.vector),
            covariance_mm2: self.stated.then_some(placed.covariance_mm2),
            rotation_rad: Some(rotation_vector(&placed.sensor_from_body)),
        })
    }
}

/// What was wrong at which poses.
fn findings(
    poses: &[Shown],
    judged: &[Judged],
    moved: &[(Moved, usize)],
    names: &[String],
    sorter: &Sorter,
) -> Vec<Finding> {
    let mut list = Vec::new();
    for (Moved { target, from }, new) in moved {
        let joined = [target, new].iter().all(|&&t| sorter.body.places_mm[t].is_some());
        list.push(Finding {
            finding: format!(
                "target {} was moved before {}: its distances to the others are other ones from there on",
                names[*target], poses[*from].first.at.pose
            ),
            rows: Vec::new(),
            action: match joined {
                true => "it counts as another target from there on".to_owned(),
                false => {
                    "the poses on the shorter side show too few other targets and are left out; measure them again"
                        .to_owned()
                }
            },
        });
    }
    let mut add = |finding: String, rows: Vec<String>, action: &str| {
        if !rows.is_empty() {
            list.push(Finding { finding, rows, action: action.to_owned() });
        }
    };
    let rows = |holds: &dyn Fn(&Judged) -> bool| -> Vec<String> {
        let held = poses.iter().zip(judged).filter(|(_, judged)| holds(judged));
        held.map(|(pose, _)| pose.first.at.pose.clone()).collect()
    };
    for (target, name) in names.iter().enumerate() {
        if sorter.body.places_mm[target].is_none() && !moved.iter().any(|(m, new)| [m.target, *new].contains(&target)) {
            let shows = |pose: &&Shown| pose.sightings.iter().any(|s| s.target == target);
            let shown = poses.iter().filter(shows).map(|pose| pose.first.at.pose.clone()).collect();
            add(format!("no pose joins target {name} to the others"), shown, "its readings are left out");
        }
        add(
            format!("target {name} does not stand to the others as at the other poses"),
            rows(&|j| matches!(j, Judged::Taken { left_out: Some(out), .. } if *out == target)),
            "its readings there are left out, the other targets are used",
        );
        for (other, other_name) in names.iter().enumerate().skip(target + 1) {
            let both = [(target, other), (other, target)];
            let exchanged = rows(&|j| matches!(j, Judged::Taken { exchanged: Some(pair), .. } if both.contains(pair)));
            add(
                format!("the names of targets {name} and {other_name} are exchanged"),
                exchanged,
                "mended for this run; mend the file",
            );
        }
    }
    add(
        "the targets do not stand to each other as at the other poses".to_owned(),
        rows(&|j| matches!(j, Judged::Refused { misfit: true, .. })),
        if sorter.body.count() > 3 { "left out" } else { "left out; a fourth target would tell which of them is off" },
    );
    list
}

#[cfg(test)]
mod tests;
