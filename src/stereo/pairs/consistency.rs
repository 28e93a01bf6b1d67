//! Which pairs have one rig: a test of each pair's own relative pose against the others', and a search for changes along the series.
//!
//! In: every pair linearised with a place of the right camera of its own. Out: which pairs share a rig. Method: near the solution of each
//! camera alone, chi-squared of a pair is a quadratic in the numbers of both cameras and in how far the common `right_from_left` lies from
//! the pair's own. Sums of these quadratics give, without another search, the chi-squared of any grouping of the pairs, with the
//! covariance of every corner, of the boards' poses and of the cameras. From one rig for all, the pair that is let go or the place at which
//! the series is cut in two that lowers chi-squared most is accepted as long as an F test (six numbers against the scatter of the
//! remaining pairs) calls it no chance; pairs and pieces that fit again are taken back. The scatter is the median over the
//! pairs, so that what a lens model lacks widens the limit for all instead of condemning some. Goes wrong: more than half of the pairs
//! contradict each other.

use nalgebra::{DMatrix, DVector, Matrix6, Vector6};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::geometry::Transform;
use crate::statistics::median;
use crate::stereo::data::view::View;
use crate::stereo::model::parameters::{Layout, Shared};
use crate::stereo::solve::normal_equations::{block, inverse6};
use crate::stereo::solve::robust_loss::Loss;

/// Numbers of a relative pose.
pub const POSE: usize = 6;

/// Chance that a series of one rig loses a pair or is cut.
pub const FALSE_ALARM: f64 = 1e-5;

/// A pair is let go only where it adds more than this to chi-squared a coordinate: what misses the common rig by less than three times the
/// corners' scatter is an uncertainty to be reported, not a wrong pair. Cuts need no such limit: many pairs do not move together by chance.
const MATERIAL: f64 = 9.0;

/// Median of chi-squared with six degrees of freedom.
const MEDIAN_CHI_SQUARED_6: f64 = 5.348;

/// What a pair with its own relative pose says about both cameras and the common one.
#[derive(Debug, Clone)]
pub struct Linearised {
    /// The pair's own `right_from_left`, as small turn and shift from the reference.
    pub own: Vector6<f64>,
    /// Information on the cameras' numbers, those numbers with the relative pose, the relative pose.
    cameras: DMatrix<f64>,
    mixed: DMatrix<f64>,
    pose: Matrix6<f64>,
    /// Half the slope of chi-squared.
    cameras_gradient: DVector<f64>,
    pose_gradient: Vector6<f64>,
    /// Coordinates of corners that it rests on.
    coordinates: f64,
}

impl Linearised {
    /// Linearises a pair at its own relative pose in `own`. `None` where its corners do not determine that pose.
    pub fn new(
        own: &Shared,
        layout: &Layout,
        left_from_board: &Transform,
        view: &View,
        reference: &Transform,
    ) -> Option<Linearised> {
        let (matrix, gradient) = block(own, layout, left_from_board, view, Loss::Squared)?.reduced(0.0)?;
        let at = layout.transform_start();
        let others: Vec<usize> = (0..layout.count()).filter(|i| !(at..at + POSE).contains(i)).collect();
        let pose = Matrix6::from_fn(|i, j| matrix[(at + i, at + j)]);
        inverse6(&pose)?;
        Some(Linearised {
            own: difference(&own.rig.right_from_left, reference),
            cameras: DMatrix::from_fn(others.len(), others.len(), |i, j| matrix[(others[i], others[j])]),
            mixed: DMatrix::from_fn(others.len(), POSE, |i, j| matrix[(others[i], at + j)]),
            pose,
            cameras_gradient: DVector::from_fn(others.len(), |i, _| gradient[others[i]]),
            pose_gradient: Vector6::from_fn(|i, _| gradient[at + i]),
            coordinates: 2.0 * view.observations.iter().filter(|o| o.active).count() as f64,
        })
    }
}

/// The small turn (rad) and shift (mm) from a reference to a transform.
pub fn difference(transform: &Transform, reference: &Transform) -> Vector6<f64> {
    let turn = (transform.rotation * reference.rotation.inverse()).scaled_axis();
    let shift = transform.translation.vector - reference.translation.vector;
    Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
}

/// Which pairs share a rig: a number for each rig, counted in the order of the pairs; `None` for a pair that fits none.
pub type Grouping = Vec<Option<usize>>;

/// One number more for some of the pairs: how a step of one changes both cameras and the relative pose.
pub struct Extra<'a> {
    /// The pairs.
    pub pairs: &'a [usize],
    /// Change of the cameras' numbers.
    pub cameras: DVector<f64>,
    /// Change of the relative pose.
    pub pose: Vector6<f64>,
}

/// The minimum of chi-squared under a grouping.
pub struct Fit {
    /// There.
    pub chi_squared: f64,
    /// The relative pose of each group, as small turn and shift from the reference.
    pub poses: Vec<Vector6<f64>>,
    /// The number that was added, where one was.
    pub extra: Option<f64>,
    /// How much each pair with a rig loses by having no relative pose of its own.
    of_pairs: Vec<Option<f64>>,
}

impl Fit {
    /// Scatter of the pairs in units of what their corners let expect, at least one.
    pub fn scatter(&self, grouping: &Grouping) -> f64 {
        let members = self.of_pairs.iter().flatten().count() as f64;
        let freedom = (members - groups(grouping) as f64).max(0.5);
        median(self.of_pairs.iter().flatten().copied())
            .map_or(1.0, |m| (m / MEDIAN_CHI_SQUARED_6 * members / freedom).max(1.0))
    }

    /// Degrees of freedom that the scatter is known with: the six numbers of a pair are not independent where a lens model lacks something.
    pub fn freedom(&self, grouping: &Grouping) -> f64 {
        3.0 * (self.of_pairs.iter().flatten().count() as f64 - groups(grouping) as f64).max(0.5)
    }
}

/// How many groups there are.
pub fn groups(grouping: &Grouping) -> usize {
    grouping.iter().flatten().max().map_or(0, |last| last + 1)
}

/// A group of one pair is no rig: nothing confirms it.
pub fn dissolve_single(grouping: &mut Grouping) {
    let single: Vec<usize> =
        (0..groups(grouping)).filter(|g| grouping.iter().flatten().filter(|of| *of == g).count() < 2).collect();
    for of in grouping.iter_mut() {
        *of = of.filter(|g| !single.contains(g)).map(|g| g - single.iter().filter(|s| **s < g).count());
    }
}

/// Finds the pairs that share a rig. Pairs that could not be linearised are in none.
pub fn group(pairs: &[Option<Linearised>]) -> Grouping {
    let mut grouping: Grouping = pairs.iter().map(|p| p.as_ref().map(|_| 0)).collect();
    let Some(mut fit) = solve(pairs, &grouping, None) else { return grouping };
    loop {
        let mut moves = refinements(&grouping);
        moves.extend(without_the_outlying(pairs, &grouping));
        let chance = FALSE_ALARM / moves.len().max(1) as f64;
        let best = moves
            .into_iter()
            .filter_map(|next| {
                let after = solve(pairs, &next, None)?;
                let numbers = POSE * freed(&grouping, &next);
                let f = (fit.chi_squared - after.chi_squared) / numbers as f64 / after.scatter(&next);
                let material = fit.chi_squared - after.chi_squared > MATERIAL * let_go(pairs, &grouping, &next);
                let surprise = if material { tail(f, numbers, after.freedom(&next)) } else { 1.0 };
                Some((f, surprise, next, after))
            })
            .filter(|(_, surprise, ..)| *surprise < chance)
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, _, next, after)) = best else { break };
        (grouping, fit) = (next, after);
    }
    take_back(pairs, grouping, fit)
}

/// Coordinates of the corners in the pairs that one grouping has and another has not.
fn let_go(pairs: &[Option<Linearised>], before: &Grouping, after: &Grouping) -> f64 {
    let of = |((pair, before), after): ((&Option<Linearised>, &Option<usize>), &Option<usize>)| {
        pair.as_ref().filter(|_| before.is_some() && after.is_none()).map_or(0.0, |pair| pair.coordinates)
    };
    pairs.iter().zip(before).zip(after).map(of).sum()
}

/// How many relative poses one grouping has more than another.
fn freed(before: &Grouping, after: &Grouping) -> usize {
    let own = |grouping: &Grouping| grouping.iter().filter(|of| of.is_none()).count() + groups(grouping);
    own(after).saturating_sub(own(before)).max(1)
}

/// Chance that F with so many numbers and degrees of freedom is at least this large.
pub fn tail(f: f64, numbers: usize, freedom: f64) -> f64 {
    FisherSnedecor::new(numbers as f64, freedom).map_or(1.0, |distribution| distribution.sf(f.max(0.0)))
}

/// Every grouping with one pair less, or with one group cut in two at one place.
fn refinements(grouping: &Grouping) -> Vec<Grouping> {
    let mut all = Vec::new();
    for group in 0..groups(grouping) {
        let members: Vec<usize> = (0..grouping.len()).filter(|&i| grouping[i] == Some(group)).collect();
        if members.len() < 2 {
            continue;
        }
        for &i in &members {
            let mut next = grouping.clone();
            next[i] = None;
            all.push(next);
        }
        for &first in members.iter().skip(2).take(members.len().saturating_sub(3)) {
            let mut next = grouping.clone();
            let new = groups(grouping);
            members.iter().filter(|&&i| i >= first).for_each(|&i| next[i] = Some(new));
            all.push(next);
        }
    }
    all
}

/// Groups without several pairs at once: those farthest from the pair to which most are near. Several wrong pairs pull the common relative
/// pose toward themselves, so that none of them stands out alone.
fn without_the_outlying(pairs: &[Option<Linearised>], grouping: &Grouping) -> Vec<Grouping> {
    let mut all = Vec::new();
    for group in 0..groups(grouping) {
        let members: Vec<(usize, &Linearised)> = grouping
            .iter()
            .zip(pairs)
            .enumerate()
            .filter_map(|(i, (of, pair))| Some((i, pair.as_ref().filter(|_| *of == Some(group))?)))
            .collect();
        let distances = |from: &Linearised| -> Vec<(f64, usize)> {
            let mut of: Vec<(f64, usize)> = members
                .iter()
                .map(|(i, pair)| {
                    let off = pair.own - from.own;
                    (off.dot(&(pair.pose * off)), *i)
                })
                .collect();
            of.sort_by(|a, b| a.0.total_cmp(&b.0));
            of
        };
        let middle = |of: &Vec<(f64, usize)>| of[of.len() / 2].0;
        let orders = members.iter().map(|(_, from)| distances(from));
        let Some(order) = orders.min_by(|a, b| middle(a).total_cmp(&middle(b))) else { continue };
        for count in 2..=(members.len().saturating_sub(1) / 2) {
            let mut next = grouping.clone();
            order[members.len() - count..].iter().for_each(|(_, i)| next[*i] = None);
            all.push(next);
        }
    }
    all
}

/// Joins groups that may be one rig, and gives pairs back to a group that they fit; then counts the groups in the order of the pairs.
fn take_back(pairs: &[Option<Linearised>], mut grouping: Grouping, mut fit: Fit) -> Grouping {
    let mut changed = true;
    while changed {
        changed = false;
        let mut moves = Vec::new();
        for (i, of) in grouping.iter().enumerate() {
            if of.is_none() && pairs[i].is_some() {
                moves.extend((0..groups(&grouping)).map(|group| {
                    let mut next = grouping.clone();
                    next[i] = Some(group);
                    next
                }));
            }
        }
        for a in 0..groups(&grouping) {
            for b in a + 1..groups(&grouping) {
                let join = |of: &Option<usize>| {
                    of.map(|g| {
                        if g == b {
                            a
                        } else if g > b {
                            g - 1
                        } else {
                            g
                        }
                    })
                };
                moves.push(grouping.iter().map(join).collect());
            }
        }
        let chance = FALSE_ALARM / moves.len().max(1) as f64;
        let best = moves
            .into_iter()
            .filter_map(|next: Grouping| {
                let after = solve(pairs, &next, None)?;
                let f = (after.chi_squared - fit.chi_squared) / POSE as f64 / fit.scatter(&grouping);
                let material = after.chi_squared - fit.chi_squared > MATERIAL * let_go(pairs, &next, &grouping);
                (!material || tail(f, POSE, fit.freedom(&grouping)) >= chance).then_some((f, next, after))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, next, after)) = best {
            (grouping, fit) = (next, after);
            changed = true;
        }
    }
    let mut order: Vec<usize> = Vec::new();
    for group in grouping.iter().flatten() {
        if !order.contains(group) {
            order.push(*group);
        }
    }
    grouping.iter().map(|of| of.and_then(|g| order.iter().position(|o| *o == g))).collect()
}

/// The minimum over the cameras' numbers, each group's relative pose and one number more where there is one. `None` where it is not finite.
pub fn solve(pairs: &[Option<Linearised>], grouping: &Grouping, extra: Option<&Extra>) -> Option<Fit> {
    let cameras = pairs.iter().flatten().next()?.cameras.nrows();
    let last = cameras + POSE * groups(grouping);
    let size = last + usize::from(extra.is_some());
    let (mut matrix, mut gradient, mut constant) = (DMatrix::zeros(size, size), DVector::zeros(size), 0.0);
    for (i, (pair, group)) in pairs.iter().zip(grouping).enumerate() {
        let Some(p) = pair else { continue };
        let Some(group) = group else {
            constant += p.add_alone(&mut matrix, &mut gradient)?;
            continue;
        };
        let at = cameras + POSE * group;
        constant += p.add_to_group(&mut matrix, &mut gradient, at);
        if let Some(extra) = extra.filter(|extra| extra.pairs.contains(&i)) {
            p.add_extra(&mut matrix, &mut gradient, at, extra);
        }
    }
    let solution = -(pseudo_inverse(&matrix) * &gradient);
    let chi_squared = constant + gradient.dot(&solution);
    let poses: Vec<Vector6<f64>> =
        (0..groups(grouping)).map(|g| Vector6::from_fn(|i, _| solution[cameras + POSE * g + i])).collect();
    let of_pairs = pairs.iter().zip(grouping).map(|(pair, group)| {
        let p = pair.as_ref()?;
        let off = poses[(*group)?] - p.own;
        let slope = p.pose_gradient + p.pose * off + p.mixed.tr_mul(&solution.rows(0, cameras));
        Some(slope.dot(&(inverse6(&p.pose)? * slope)))
    });
    let of_pairs = of_pairs.collect();
    let extra = extra.map(|_| solution[last]);
    chi_squared.is_finite().then_some(Fit { chi_squared, poses, extra, of_pairs })
}

impl Linearised {
    /// Adds a pair that shares its group's relative pose; what its chi-squared is at the origin.
    fn add_to_group(&self, matrix: &mut DMatrix<f64>, gradient: &mut DVector<f64>, at: usize) -> f64 {
        let cameras = self.cameras.nrows();
        add(matrix, (0, 0), &self.cameras);
        add(matrix, (0, at), &self.mixed);
        add(matrix, (at, 0), &self.mixed.transpose());
        add(matrix, (at, at), &self.pose);
        let mut head = gradient.rows_mut(0, cameras);
        head += &self.cameras_gradient - &self.mixed * self.own;
        let mut of_group = gradient.rows_mut(at, POSE);
        of_group += self.pose_gradient - self.pose * self.own;
        (self.pose * self.own - 2.0 * self.pose_gradient).dot(&self.own)
    }

    /// Adds a pair with a relative pose of its own. `None` where its corners do not determine it.
    fn add_alone(&self, matrix: &mut DMatrix<f64>, gradient: &mut DVector<f64>) -> Option<f64> {
        let inverse = inverse6(&self.pose)?;
        let through = &self.mixed * inverse;
        add(matrix, (0, 0), &(&self.cameras - &through * self.mixed.transpose()));
        let mut head = gradient.rows_mut(0, self.cameras.nrows());
        head += &self.cameras_gradient - &through * self.pose_gradient;
        Some(-self.pose_gradient.dot(&(inverse * self.pose_gradient)))
    }

    fn add_extra(&self, matrix: &mut DMatrix<f64>, gradient: &mut DVector<f64>, at: usize, extra: &Extra) {
        let last = matrix.nrows() - 1;
        let by_cameras = &self.cameras * &extra.cameras + &self.mixed * extra.pose;
        let by_pose = self.mixed.tr_mul(&extra.cameras) + self.pose * extra.pose;
        matrix[(last, last)] += extra.cameras.dot(&by_cameras) + extra.pose.dot(&by_pose);
        for (start, slopes) in [(0, by_cameras.as_slice()), (at, by_pose.as_slice())] {
            for (k, slope) in slopes.iter().enumerate() {
                matrix[(last, start + k)] += slope;
                matrix[(start + k, last)] += slope;
            }
        }
        gradient[last] += extra.cameras.dot(&(&self.cameras_gradient - &self.mixed * self.own))
            + extra.pose.dot(&(self.pose_gradient - self.pose * self.own));
    }
}

fn add<R: nalgebra::Dim, C: nalgebra::Dim, S: nalgebra::RawStorage<f64, R, C>>(
    matrix: &mut DMatrix<f64>,
    (row, col): (usize, usize),
    part: &nalgebra::Matrix<f64, R, C, S>,
) {
    for j in 0..part.ncols() {
        for i in 0..part.nrows() {
            matrix[(row + i, col + j)] += part[(i, j)];
        }
    }
}

/// The inverse of a symmetric matrix with rows of different units on what it determines, and zero elsewhere.
fn pseudo_inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    /// Smallest share of the largest scaled eigenvalue that rounding leaves meaningful.
    const SMALLEST: f64 = 1e-12;
    let scale = matrix.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 });
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let eigen = scaled.symmetric_eigen();
    let largest = eigen.eigenvalues.max();
    let inverted = eigen.eigenvalues.map(|v| if v > SMALLEST * largest { 1.0 / v } else { 0.0 });
    let inverse = &eigen.eigenvectors * DMatrix::from_diagonal(&inverted) * eigen.eigenvectors.transpose();
    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| inverse[(i, j)] * scale[i] * scale[j])
}
