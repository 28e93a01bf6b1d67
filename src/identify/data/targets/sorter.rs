//! Which poses show the targets standing to each other as at the others, and what those tell.
//!
//! In: the body that the targets make, and a pose's sightings. Out: the mark point and the orientation, with two names
//! exchanged or one target left out where that alone makes them fit, or why they are not to be had. A pose is held
//! against the median pose, and its limit is one that one clean set in a thousand exceeds somewhere. Goes wrong: an
//! exchange that leaves the lengths between the targets alike is not seen.

use nalgebra::{Matrix3, Point3, Vector3};
use statrs::distribution::{ContinuousCDF, Normal};

use super::body::{Body, LEAST_SCATTER, Sighting};
use crate::geometry::rotation_vector;
use crate::identify::Error;
use crate::measurements::{Measurement, Observed};
use crate::statistics::{chi_square_quantile, median};

/// Of clean sets, the share in which a pose is taken for one with a gross error.
const FALSE_ALARMS: f64 = 1e-3;

/// Scatter of the targets against each other, as a share of their extent, that no rigid body has.
const RIGID: f64 = 0.05;

/// All rows of one pose.
pub(super) struct Shown<'a> {
    pub(super) first: &'a Measurement,
    pub(super) sightings: Vec<Sighting>,
    /// Why there are none.
    pub(super) reason: Option<&'a str>,
}

/// What a pose's targets tell.
pub(super) enum Judged {
    /// The mark point, its covariance where readings state theirs, and the orientation.
    Taken { observed: Observed, left_out: Option<usize>, exchanged: Option<(usize, usize)> },
    /// The mean of these targets, which tell no turn, and where that stands on the body.
    Part { observed: Observed, targets: Vec<usize>, place_mm: Vector3<f64> },
    /// Not to be had, and whether that is because the targets don't stand as elsewhere.
    Refused { reason: String, misfit: bool },
}

/// Tells poses at which the targets stand to each other as elsewhere from those at which they don't.
pub(super) struct Sorter {
    pub(super) body: Body,
    /// Factor between the precisions and what the residuals show; a variance in mm^2 where no covariance is stated.
    variance: f64,
    /// Quantile of the normal distribution for one pose.
    normal: f64,
    stated: bool,
}

impl Sorter {
    pub(super) fn new(body: Body, poses: &[Vec<Sighting>], stated: bool) -> Sorter {
        let one = 1.0 - FALSE_ALARMS / poses.len().max(1) as f64;
        let normal = Normal::standard().inverse_cdf(one);
        let mut sorter = Sorter { body, variance: 1.0, normal, stated };
        sorter.variance = sorter.shown_variance(poses);
        sorter
    }

    /// The body from the poses that fit, by least squares, and the scatter with it.
    pub(super) fn refined(self, poses: &[Vec<Sighting>]) -> Sorter {
        let good: Vec<Vec<Sighting>> = poses.iter().filter(|pose| self.fits(pose)).cloned().collect();
        let body = self.body.by_means(&good);
        let mut sorter = Sorter { body, ..self };
        sorter.variance = sorter.shown_variance(poses);
        sorter
    }

    /// Chi-squared of a pose and its degrees of freedom: of all six numbers of a pose, or on a line of the distances
    /// along it.
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

    /// Chi-squared that one clean pose in very many exceeds. Where nothing says how the noise is spread over the
    /// directions, it may all lie in one.
    fn limit(&self, freedom: usize) -> f64 {
        let at = |freedom: f64| chi_square_quantile(freedom, self.normal);
        let middle = |freedom: f64| chi_square_quantile(freedom, 0.0);
        let freedom = freedom as f64;
        self.variance * if self.stated { at(freedom) } else { middle(freedom) * at(1.0) / middle(1.0) }
    }

    /// Root mean square of a coordinate's residual over the poses that fit, mm, the freedom that the poses' fits used
    /// taken into account.
    pub(super) fn scatter_mm(&self, poses: &[Vec<Sighting>]) -> f64 {
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

    pub(super) fn check_rigid(&self, scatter_mm: f64, names: &[String]) -> Result<(), Error> {
        let extent_mm = self.body.extent_mm();
        if extent_mm > 0.0 && scatter_mm <= RIGID * extent_mm {
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

    pub(super) fn judge(&self, pose: &Shown) -> Judged {
        let sightings: Vec<Sighting> =
            pose.sightings.iter().filter(|s| self.body.places_mm[s.target].is_some()).copied().collect();
        if sightings.is_empty() {
            let reason = pose.reason.unwrap_or("none of the targets").to_owned();
            return Judged::Refused { reason, misfit: false };
        }
        let whole =
            if self.body.is_line() { sightings.len() == self.body.count() } else { self.body.tells_turn(&sightings) };
        if !whole {
            return self.part(&sightings);
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
        found.unwrap_or_else(|| self.misfit(self.chi_square(&sightings)))
    }

    fn misfit(&self, chi_square: Option<(f64, usize)>) -> Judged {
        let times =
            chi_square.map_or(0.0, |(chi_square, freedom)| (chi_square / (self.variance * freedom as f64)).sqrt());
        let reason = format!(
            "the targets do not stand to each other as at the other poses: {times:.0} times their usual scatter"
        );
        Judged::Refused { reason, misfit: true }
    }

    /// Too few targets for a turn: their mean, as a point of the body, where the distances between them are right.
    fn part(&self, sightings: &[Sighting]) -> Judged {
        let along = self.chi_square_along(sightings);
        if along.is_some_and(|(chi_square, freedom)| chi_square > self.limit(freedom)) {
            return self.misfit(along);
        }
        let places: Vec<Vector3<f64>> = sightings.iter().filter_map(|s| self.body.places_mm[s.target]).collect();
        let place_mm = places.iter().sum::<Vector3<f64>>() / places.len().max(1) as f64;
        Judged::Part { observed: self.mean(sightings), targets: sightings.iter().map(|s| s.target).collect(), place_mm }
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
            return Some(self.mean(pose));
        }
        let placed = self.body.placed(pose)?;
        Some(Observed::Position {
            point_mm: Point3::from(placed.sensor_from_body.translation.vector),
            covariance_mm2: self.stated.then_some(placed.covariance_mm2),
            rotation_rad: Some(rotation_vector(&placed.sensor_from_body)),
        })
    }

    /// The mean of targets, without an orientation.
    fn mean(&self, pose: &[Sighting]) -> Observed {
        let count = pose.len() as f64;
        let mean = pose.iter().map(|s| s.point_mm.coords).sum::<Vector3<f64>>() / count;
        let covariance = pose.iter().filter_map(|s| s.precision.try_inverse()).sum::<Matrix3<f64>>() / (count * count);
        Observed::Position {
            point_mm: Point3::from(mean),
            covariance_mm2: self.stated.then_some(covariance),
            rotation_rad: None,
        }
    }
}
