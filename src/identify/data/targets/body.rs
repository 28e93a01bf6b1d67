//! The rigid body that several targets make: where they stand to each other, and where it is at a pose.
//!
//! In: what each pose showed of the targets. Out: their places in a frame of the body, and for a pose the transform
//! into the sensor's frame with its covariance and chi-squared. The first places come from the medians of the distances
//! between targets (classical scaling, Torgerson 1952), so that gross errors at a minority of poses don't count; then
//! poses and places are fitted in turn.

use nalgebra::{DMatrix, Matrix3, Matrix6, Point3, SymmetricEigen, Vector3, Vector6};

use crate::geometry::{Transform, fitted_frame, perturb, rigid_columns, rotation_matrix};
use crate::statistics::median;

/// Scatter that the numbers of a file have at the least, as a share of the targets' extent.
pub const LEAST_SCATTER: f64 = 1e-7;

/// Targets that stand nearer to a line than this share of their extent tell no turn about it.
const LINE: f64 = 0.03;

/// Rounds of fitting poses and places in turn.
const ROUNDS: usize = 20;

/// Steps of a pose's fit; it starts within the noise of its end.
const STEPS: usize = 10;

/// One target as a pose showed it.
#[derive(Debug, Clone, Copy)]
pub struct Sighting {
    pub target: usize,
    /// Sensor's frame, mm.
    pub point_mm: Point3<f64>,
    /// Inverse of its covariance, 1/mm^2; the identity where none is stated.
    pub precision: Matrix3<f64>,
}

/// Places of targets in a frame of their own, whose origin is their mean.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// One a target, mm; `None` for a target that no pose joins to the others.
    pub places_mm: Vec<Option<Vector3<f64>>>,
}

/// A body at a pose.
#[derive(Debug, Clone, Copy)]
pub struct Placed {
    pub sensor_from_body: Transform,
    /// Covariance of the body's origin, mm^2, where the precisions are those of the readings.
    pub covariance_mm2: Matrix3<f64>,
    /// Sum of squares of the whitened residuals.
    pub chi_square: f64,
    /// Numbers beyond the six of the pose.
    pub freedom: usize,
}

/// The distance of two targets at the poses that show both, by the index of the pose, mm.
pub fn distances(poses: &[Vec<Sighting>], a: usize, b: usize) -> Vec<(usize, f64)> {
    let point = |pose: &[Sighting], target: usize| pose.iter().find(|s| s.target == target).map(|s| s.point_mm);
    let apart = |(index, pose): (usize, &Vec<Sighting>)| Some((index, (point(pose, a)? - point(pose, b)?).norm()));
    poses.iter().enumerate().filter_map(apart).collect()
}

/// Coordinate by coordinate the median.
pub fn middle(points: &[Vector3<f64>]) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| median(points.iter().map(|p| p[axis])).unwrap_or(0.0))
}

impl Body {
    /// Of so many targets, from what the poses showed. `None` where no pose shows two of them.
    pub fn new(poses: &[Vec<Sighting>], targets: usize) -> Option<Body> {
        let apart = |a: usize, b: usize| median(distances(poses, a, b).into_iter().map(|(_, apart)| apart));
        let distances = DMatrix::from_fn(targets, targets, |a, b| if a == b { Some(0.0) } else { apart(a, b) });
        let shown = |t: usize| poses.iter().flatten().filter(|s| s.target == t).count();
        let joined = largest_joined(&distances, &(0..targets).map(shown).collect::<Vec<_>>());
        if joined.len() < 2 {
            return None;
        }
        let mut places_mm = vec![None; targets];
        for (&target, place) in joined.iter().zip(scaled(&distances, &joined)) {
            places_mm[target] = Some(place);
        }
        let body = Body { places_mm };
        let mirrored =
            Body { places_mm: body.places_mm.iter().map(|p| p.map(|p| Vector3::new(p.x, p.y, -p.z))).collect() };
        let many: Vec<&Vec<Sighting>> = poses.iter().filter(|pose| pose.len() > 3).collect();
        let votes = many.iter().filter(|pose| mirrored.misfit(pose) < body.misfit(pose)).count();
        let body = if 2 * votes > many.len() { mirrored } else { body };
        Some(body.refined(poses, &middle))
    }

    /// Fitted to these poses by least squares, all of them alike.
    pub fn by_means(&self, poses: &[Vec<Sighting>]) -> Body {
        self.clone().refined(poses, &|samples| samples.iter().sum::<Vector3<f64>>() / samples.len() as f64)
    }

    /// Poses and places in turn; `middle` is a target's place from what the poses say of it.
    fn refined(mut self, poses: &[Vec<Sighting>], middle: &dyn Fn(&[Vector3<f64>]) -> Vector3<f64>) -> Body {
        if self.is_line() {
            return self.centred();
        }
        for _ in 0..ROUNDS {
            let mut samples = vec![Vec::new(); self.places_mm.len()];
            for pose in poses.iter().filter(|pose| self.tells_turn(pose)) {
                let body_from_sensor = self.rough(pose).inverse();
                for sighting in pose {
                    samples[sighting.target].push((body_from_sensor * sighting.point_mm).coords);
                }
            }
            for (place, samples) in self.places_mm.iter_mut().zip(&samples) {
                if !samples.is_empty() {
                    *place = Some(middle(samples));
                }
            }
            self = self.centred();
        }
        self
    }

    /// The origin at the mean of all places.
    fn centred(mut self) -> Body {
        let known: Vec<Vector3<f64>> = self.places_mm.iter().flatten().copied().collect();
        let mean = known.iter().sum::<Vector3<f64>>() / known.len().max(1) as f64;
        self.places_mm.iter_mut().flatten().for_each(|place| *place -= mean);
        self
    }

    /// Number of targets whose place is known.
    pub fn count(&self) -> usize {
        self.places_mm.iter().flatten().count()
    }

    /// Root mean square distance of the targets from their mean, mm.
    pub fn extent_mm(&self) -> f64 {
        let square: f64 = self.places_mm.iter().flatten().map(Vector3::norm_squared).sum();
        (square / self.count().max(1) as f64).sqrt()
    }

    /// Whether the targets stand on a line.
    pub fn is_line(&self) -> bool {
        are_on_a_line(self.places_mm.iter().flatten())
    }

    /// Whether a pose shows enough targets off a line.
    pub fn tells_turn(&self, pose: &[Sighting]) -> bool {
        let known: Vec<Vector3<f64>> = pose.iter().filter_map(|s| self.places_mm[s.target]).collect();
        known.len() >= 3 && !are_on_a_line(known.iter())
    }

    fn pairs<'a>(&'a self, pose: &'a [Sighting]) -> impl Iterator<Item = (Point3<f64>, &'a Sighting)> {
        pose.iter().filter_map(|s| Some((Point3::from(self.places_mm[s.target]?), s)))
    }

    fn rough(&self, pose: &[Sighting]) -> Transform {
        fitted_frame(self.pairs(pose).map(|(place, s)| (place, s.point_mm, 1.0)))
    }

    fn misfit(&self, pose: &[Sighting]) -> f64 {
        let frame = self.rough(pose);
        self.pairs(pose).map(|(place, s)| (frame * place - s.point_mm).norm_squared()).sum()
    }

    /// Where the body is at a pose; `None` where that shows too few targets.
    pub fn placed(&self, pose: &[Sighting]) -> Option<Placed> {
        if !self.tells_turn(pose) {
            return None;
        }
        let mut frame = self.rough(pose);
        let mut at = self.equations(pose, &frame);
        for _ in 0..STEPS {
            let step = at.normal.cholesky()?.solve(&at.gradient);
            let next = perturb(&frame, step.as_slice());
            let there = self.equations(pose, &next);
            if there.cost >= at.cost {
                break;
            }
            (frame, at) = (next, there);
        }
        let covariance = at.normal.cholesky()?.inverse();
        Some(Placed {
            sensor_from_body: frame,
            covariance_mm2: covariance.fixed_view::<3, 3>(3, 3).into(),
            chi_square: at.cost,
            freedom: 3 * self.pairs(pose).count() - 6,
        })
    }

    /// Turn in rows 0 to 2, shift in rows 3 to 5.
    fn equations(&self, pose: &[Sighting], frame: &Transform) -> Equations {
        let rotation = rotation_matrix(frame);
        let mut equations = Equations { normal: Matrix6::zeros(), gradient: Vector6::zeros(), cost: 0.0 };
        for (place, sighting) in self.pairs(pose) {
            let turned = rotation * place.coords;
            let residual = sighting.point_mm - frame * place;
            let design = rigid_columns(&turned);
            let weighted = design.transpose() * sighting.precision;
            equations.normal += weighted * design;
            equations.gradient += weighted * residual;
            equations.cost += residual.dot(&(sighting.precision * residual));
        }
        equations
    }
}

struct Equations {
    normal: Matrix6<f64>,
    gradient: Vector6<f64>,
    cost: f64,
}

fn are_on_a_line<'a>(places: impl Iterator<Item = &'a Vector3<f64>> + Clone) -> bool {
    let count = places.clone().count().max(1) as f64;
    let mean = places.clone().sum::<Vector3<f64>>() / count;
    let scatter: Matrix3<f64> = places.map(|p| (p - mean) * (p - mean).transpose()).sum();
    let mut sizes: [f64; 3] = scatter.symmetric_eigenvalues().map(|v| v.max(0.0).sqrt()).into();
    sizes.sort_by(f64::total_cmp);
    sizes[1] <= LINE * sizes[2]
}

/// The targets, from each as a start one after the other, whose distances to all taken before are known; of all starts
/// the most, and of as many those that were seen most often.
fn largest_joined(distances: &DMatrix<Option<f64>>, seen: &[usize]) -> Vec<usize> {
    let count = distances.nrows();
    let from = |start: usize| {
        let mut joined = vec![start];
        for target in (0..count).filter(|&t| t != start) {
            if joined.iter().all(|&other| distances[(target, other)].is_some()) {
                joined.push(target);
            }
        }
        joined
    };
    let size = |list: &[usize]| (list.len(), list.iter().map(|&t| seen[t]).sum::<usize>());
    let better = |best: Vec<usize>, list: Vec<usize>| if size(&list) > size(&best) { list } else { best };
    let mut best = (0..count).map(from).fold(Vec::new(), better);
    best.sort_unstable();
    best
}

/// Places with these distances, up to a rigid motion and a reflection.
fn scaled(distances: &DMatrix<Option<f64>>, of: &[usize]) -> Vec<Vector3<f64>> {
    let n = of.len();
    let square = DMatrix::from_fn(n, n, |a, b| distances[(of[a], of[b])].unwrap_or(0.0).powi(2));
    let centre = DMatrix::from_fn(n, n, |a, b| f64::from(u8::from(a == b)) - 1.0 / n as f64);
    let eigen = SymmetricEigen::new(-0.5 * &centre * square * &centre);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let along = |target: usize, axis: usize| {
        let k = *order.get(axis)?;
        Some(eigen.eigenvectors[(target, k)] * eigen.eigenvalues[k].max(0.0).sqrt())
    };
    (0..n).map(|target| Vector3::from_fn(|axis, _| along(target, axis).unwrap_or(0.0))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(places_mm: &[[f64; 3]]) -> Body {
        Body { places_mm: places_mm.iter().map(|place| Some(Vector3::from(*place))).collect() }
    }

    /// Three targets of a flat body can stand on a line, about which nothing tells the turn.
    #[test]
    fn a_pose_tells_the_turn_by_three_targets_off_a_line() {
        let body = body(&[[-40.0, 0.0, 0.0], [0.0, 0.0, 0.0], [40.0, 0.0, 0.0], [0.0, 50.0, 0.0]]);
        let tells = |targets: &[usize]| {
            let sighting =
                |&target: &usize| Sighting { target, point_mm: Point3::origin(), precision: Matrix3::identity() };
            body.tells_turn(&targets.iter().map(sighting).collect::<Vec<_>>())
        };
        assert!(tells(&[0, 1, 3]) && tells(&[0, 1, 2, 3]));
        assert!(!tells(&[0, 1, 2]) && !tells(&[0, 3]));
    }
}
