//! Rigs without some of the pairs, a step from the minimum of all of them.
//!
//! In: a problem at its minimum and the fold of every pair. Out: for each fold the shared numbers that the other pairs
//! alone would give, and their covariance. Method: each pair's share of the normal equations, its pose eliminated, is
//! taken off the sum, and one step of Gauss-Newton follows; from the minimum of all pairs that step is a fraction of a
//! standard deviation, over which the equations are straight. Pairs with nearly the same pose are held out together
//! ([`groups`], [`folds`]): one of two twins is no test of the other. Goes wrong: pairs that alone held a number of the
//! rig; then the others do not determine it, and there is no rig.

use nalgebra::{DMatrix, DVector, Point3};

use crate::geometry::Transform;
use crate::stereo::data::View;
use crate::stereo::model::{Layout, Shared};
use crate::stereo::solve::normal_equations::{self, Equations};
use crate::stereo::solve::uncertainty::{self, worst_focal_sigma};

/// Folds over the pairs; with fewer pairs each is a fold of its own.
const FOLDS: usize = 10;

/// Poses whose corners lie closer together than this share of the board's diagonal (root mean square) are one pose:
/// between them the perspective changes by less than corners scatter.
const SAME_POSE: f64 = 0.03;

/// The group of every pair: pairs with nearly the same pose are one group, numbered in the order of their first pairs.
pub fn groups(views: &[View], poses: &[Transform]) -> Vec<usize> {
    let (distances, limit_mm) = distances_mm(views, poses);
    merge(&distances, |_, _, distance_mm| distance_mm < limit_mm, 1)
}

/// The fold of every pair, at most `FOLDS` of them: blocks of similar poses, no fold with more than about twice its
/// share of the pairs.
pub fn folds(views: &[View], poses: &[Transform]) -> Vec<usize> {
    let count = poses.len();
    let largest = 2 * count.div_ceil(FOLDS);
    let (distances, limit_mm) = distances_mm(views, poses);
    // More than a quarter of the pairs is no fold: what is left would be another calibration.
    let twins = |a: usize, b: usize, distance_mm: f64| distance_mm < limit_mm && 4 * (a + b) <= count;
    let fits = |a: usize, b: usize, distance_mm: f64| twins(a, b, distance_mm) || a + b <= largest;
    if count <= FOLDS { merge(&distances, twins, 1) } else { merge(&distances, fits, FOLDS) }
}

/// Joins the nearest two clusters (complete linkage) that `may` be joined, by their sizes and distance, until `enough`
/// are left. Where clusters are asked down to one, only `may` ends it.
fn merge(distances: &DMatrix<f64>, may: impl Fn(usize, usize, f64) -> bool, enough: usize) -> Vec<usize> {
    let count = distances.nrows();
    let mut clusters: Vec<Vec<usize>> = (0..count).map(|i| vec![i]).collect();
    while clusters.len() > enough {
        let mut nearest: Option<(f64, usize, usize)> = None;
        for b in 1..clusters.len() {
            for a in 0..b {
                let all = clusters[a].iter().flat_map(|&i| clusters[b].iter().map(move |&j| distances[(i, j)]));
                let distance = all.fold(0.0, f64::max);
                if may(clusters[a].len(), clusters[b].len(), distance) && nearest.is_none_or(|n| distance < n.0) {
                    nearest = Some((distance, a, b));
                }
            }
        }
        let Some((_, a, b)) = nearest else { break };
        let joined = clusters.remove(b);
        clusters[a].extend(joined);
    }
    let mut of = vec![0; count];
    for (cluster, members) in clusters.iter().enumerate() {
        members.iter().for_each(|&i| of[i] = cluster);
    }
    of
}

/// Root mean square distance between any two poses of the outermost corners that were seen, mm, and that up to which
/// two are one pose.
fn distances_mm(views: &[View], poses: &[Transform]) -> (DMatrix<f64>, f64) {
    let all = views.iter().flat_map(|view| &view.observations);
    let [x, y] = all.fold([0.0, 0.0], |[x, y]: [f64; 2], o| [x.max(o.board_mm.x.abs()), y.max(o.board_mm.y.abs())]);
    let outer = [(-x, -y), (x, -y), (-x, y), (x, y)].map(|(x, y)| Point3::new(x, y, 0.0));
    let distances = DMatrix::from_fn(poses.len(), poses.len(), |i, j| {
        let squares = outer.iter().map(|at| (poses[i] * at - poses[j] * at).norm_squared()).sum::<f64>();
        (squares / outer.len() as f64).sqrt()
    });
    (distances, 2.0 * SAME_POSE * x.hypot(y))
}

/// How many folds an assignment has.
pub fn count(fold_of: &[usize]) -> usize {
    fold_of.iter().max().map_or(0, |last| last + 1)
}

/// The calibration without a fold.
#[derive(Debug, Clone, PartialEq)]
pub struct Without {
    /// The step from the shared numbers of all pairs.
    pub step: DVector<f64>,
    /// Covariance of the shared numbers, with unit variance of the whitened residuals.
    pub covariance: DMatrix<f64>,
    pub shared: Shared,
}

/// The calibration without each fold. `None` for a fold without which the others do not determine both focal lengths to
/// the share `focal_sigma` of them. The gradients change by `curvature`: the equations themselves, or those of a loss
/// whose weights change with the residuals.
pub fn leave_out(
    curvature: &Equations,
    equations: &Equations,
    layout: &Layout,
    shared: &Shared,
    fold_of: &[usize],
    focal_sigma: f64,
) -> Vec<Option<Without>> {
    let pairs = curvature.blocks.iter().zip(&equations.blocks);
    let reduced: Option<Vec<(DMatrix<f64>, DVector<f64>)>> =
        pairs.map(|(curved, block)| Some((curved.reduced(0.0)?.0, block.reduced(0.0)?.1))).collect();
    let Some(reduced) = reduced else { return vec![None; count(fold_of)] };
    let without = |fold: usize| {
        let (mut matrix, mut gradient) = (equations.prior.matrix.clone(), equations.prior.gradient.clone());
        for ((own, own_gradient), _) in reduced.iter().zip(fold_of).filter(|(_, of)| **of != fold) {
            matrix += own;
            gradient += own_gradient;
        }
        let covariance = uncertainty::invert(&matrix)?;
        let step = -normal_equations::solve_scaled(&matrix, &gradient)?;
        let is_told = worst_focal_sigma(&covariance, layout, &shared.rig) <= focal_sigma;
        is_told.then(|| Without { shared: layout.step(shared, step.as_slice()), step, covariance })
    };
    (0..count(fold_of)).map(without).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::geometry::transform;
    use crate::stereo::Lens;
    use crate::stereo::calibrate::calibrate;
    use crate::stereo::select::options::Options;
    use crate::stereo::solve::uncertainty::WORST_FOCAL_SIGMA;
    use crate::stereo::synthetic::World;

    #[test]
    fn a_step_without_a_fold_ends_where_its_own_search_does() {
        let options = Options { lens: Some(Lens::Brown5), shape: Some(true), known: None };
        // With five pairs a fifth of all that is known goes with each.
        for pairs in [5, 9] {
            let found = calibrate(&World::new(pairs, 2).corners(3), &options).unwrap();
            let layout = found.layout;
            let fold_of: Vec<usize> = (0..pairs).collect();
            let problem = found.problem();
            let equations = problem.equations(&layout).unwrap();
            let all = leave_out(&equations, &equations, &layout, &found.values.shared, &fold_of, WORST_FOCAL_SIGMA);
            for (fold, without) in all.iter().enumerate() {
                let without = without.as_ref().unwrap();
                let mut others = found.problem();
                others.views.remove(fold);
                others.values.poses.remove(fold);
                let searched = others.refit(&layout).unwrap();
                let (step, search) = (layout.numbers(&without.shared), layout.numbers(&searched.shared));
                for (i, name) in layout.names().iter().enumerate() {
                    let sigma = without.covariance[(i, i)].sqrt();
                    // What a step leaves is of second order: a twentieth of what chance leaves.
                    let off = (step[i] - search[i]).abs();
                    assert!(off < 0.05 * sigma, "{name} without {fold} of {pairs}: {} {}", step[i], search[i]);
                }
            }
        }
    }

    #[test]
    fn twins_are_held_out_together_and_no_fold_is_too_large() {
        let world = World::new(8, 3);
        let views = |world: &World| -> Vec<View> {
            world.corners(1).pairs.iter().map(|pair| View::new(&world.board, pair, 0)).collect()
        };
        let seen = views(&world);
        let nudged = |pose: &Transform| transform(Vector3::new(0.003, 0.0, 0.0), Vector3::new(0.5, 0.0, 1.0)) * pose;
        let mut poses = world.poses.clone();
        poses.insert(3, nudged(&world.poses[6]));
        let of = groups(&seen, &poses);
        // The seventh moved up by one.
        assert_eq!(of[3], of[7]);
        assert_eq!(count(&of), 8);
        assert_eq!(folds(&seen, &poses), of);
        // All alike: a fold of more than a quarter would leave another calibration.
        let same = vec![world.poses[0]; 12];
        let of = folds(&seen, &same);
        let size = |fold| of.iter().filter(|f| **f == fold).count();
        assert!((0..count(&of)).all(|fold| (1..=3).contains(&size(fold))), "{of:?}");
        assert_eq!(count(&groups(&seen, &same)), 1);
        let many = World::new(35, 4);
        let of = folds(&views(&many), &many.poses);
        let size = |fold| of.iter().filter(|f| **f == fold).count();
        assert_eq!(count(&of), FOLDS);
        assert!((0..FOLDS).all(|fold| (1..=8).contains(&size(fold))), "{of:?}");
    }
}
