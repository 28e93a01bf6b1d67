//! The poses that tell most: those that make the mean variance of the target's place over the spheres least
//! (I-optimality, Fedorov).
//!
//! In: white rows of the candidates. Out: which ones, and the accuracy by their number. Method: greedily one after the
//! other, then exchanges of each for a better one until none is. A pose changes the covariance by a term of rank three
//! (Woodbury), so that a candidate costs two quadratic forms; gains that were once small mostly stay small, so that
//! only the head of the list is reckoned anew (lazy evaluation, Minoux 1978).

use nalgebra::{DMatrix, Matrix3, Vector3};
use rayon::prelude::*;

use super::pool::Candidate;
use super::predict::{FRAME, Problem, Rows};
use super::settings::COUNTS;
use crate::linear_algebra::to_unit_diagonal;

/// Poses that every placement gets before the others are shared out: its own transform needs three.
const LEAST_A_GROUP: usize = 4;

/// Candidates whose gains are reckoned anew at a time.
const HEAD: usize = 256;

/// Candidates that a chosen pose may be exchanged for.
const SHORTLIST: usize = 1500;

/// Rounds of exchanges, and the relative gain below which they end.
const ROUNDS: usize = 4;
const ROUND_GAIN: f64 = 2e-3;

/// What is known of the robot's parameters and the placements after some poses: the inverse of their covariance.
#[derive(Debug, Clone)]
pub struct Information {
    normal: DMatrix<f64>,
    count: usize,
}

impl Information {
    /// Before any pose.
    pub fn new(problem: &Problem) -> Information {
        let inverse: Vec<f64> = problem.prior().into_iter().map(|variance| 1.0 / variance).collect();
        Information { normal: DMatrix::from_diagonal(&inverse.into()), count: problem.count() }
    }

    /// Adds a pose.
    pub fn add(&mut self, rows: &Rows) {
        self.update(rows, 1.0);
    }

    fn update(&mut self, rows: &Rows, sign: f64) {
        let width = self.count + FRAME;
        let index = |k: usize| if k < self.count { k } else { k + FRAME * rows.group };
        for row in rows.values.chunks_exact(width) {
            for (a, va) in row.iter().enumerate() {
                for (b, vb) in row.iter().enumerate() {
                    self.normal[(index(a), index(b))] += sign * va * vb;
                }
            }
        }
    }

    /// Covariance of all unknowns.
    pub(super) fn covariance(&self) -> DMatrix<f64> {
        let n = self.normal.nrows();
        // Units differ by orders of magnitude.
        let unit = to_unit_diagonal(&self.normal);
        let inverse = unit.and_then(|(scaled, scale)| Some((scaled.cholesky()?.inverse(), scale)));
        let Some((inverse, scale)) = inverse else { return DMatrix::zeros(n, n) };
        DMatrix::from_fn(n, n, |r, c| inverse[(r, c)] * scale[r] * scale[c])
    }

    /// Covariance of the robot's parameters.
    fn of_parameters(&self) -> DMatrix<f64> {
        self.covariance().resize(self.count, self.count, 0.0)
    }

    /// Expected error over the fresh poses, root mean square, mm.
    pub fn rms_mm(&self, problem: &Problem) -> f64 {
        problem.weight.component_mul(&self.of_parameters()).sum().max(0.0).sqrt()
    }

    /// Expected error at each fresh pose: place, mm.
    pub fn map(&self, problem: &Problem) -> Vec<(Vector3<f64>, f64)> {
        let covariance = self.of_parameters();
        let at = |(place, columns): &(Vector3<f64>, DMatrix<f64>)| {
            (*place, (columns * &covariance * columns.transpose()).trace().max(0.0).sqrt())
        };
        problem.fresh.iter().map(at).collect()
    }

    /// The expected error after so many of these poses in their order, spread over the list.
    pub fn curve(mut self, problem: &Problem, poses: &[Candidate], counts: &[usize]) -> Vec<(usize, f64)> {
        // The list goes placement by placement; a part of it takes from all.
        let spread: Vec<usize> = (0..poses.len()).map(|k| (k * stride(poses.len())) % poses.len().max(1)).collect();
        let mut sorted: Vec<usize> = counts.iter().copied().filter(|n| *n <= poses.len()).collect();
        sorted.sort_unstable();
        sorted.dedup();
        let (mut done, mut curve) = (0, Vec::new());
        for count in sorted {
            spread[done..count].iter().for_each(|&k| self.add(&problem.rows(&poses[k])));
            done = count;
            curve.push((count, self.rms_mm(problem)));
        }
        curve
    }
}

/// A step through a list of this length that meets every place: near the golden section of it, and without a common
/// divisor.
fn stride(length: usize) -> usize {
    let divisor = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let start = ((length as f64 * 0.618) as usize).max(1);
    (start..).find(|s| divisor(*s, length) == 1).unwrap_or(1)
}

/// What the gain of a candidate is reckoned from: covariance and its product with the weight, a placement's block each.
struct Blocks {
    covariance: Vec<Vec<f64>>,
    weighed: Vec<Vec<f64>>,
    width: usize,
}

impl Blocks {
    fn new(problem: &Problem, information: &Information) -> Blocks {
        let (count, width) = (problem.count(), problem.count() + FRAME);
        let covariance = information.covariance();
        let tall = covariance.columns(0, count);
        let weighed = tall * &problem.weight * tall.transpose();
        let block = |matrix: &DMatrix<f64>, group: usize| {
            let index = |k: usize| if k < count { k } else { k + FRAME * group };
            (0..width)
                .flat_map(|r| (0..width).map(move |c| (r, c)))
                .map(|(r, c)| matrix[(index(r), index(c))])
                .collect()
        };
        let of = |matrix: &DMatrix<f64>| (0..problem.groups()).map(|g| block(matrix, g)).collect();
        Blocks { covariance: of(&covariance), weighed: of(&weighed), width }
    }

    /// By how much the mean square error falls with this pose, mm^2.
    fn gain(&self, rows: &Rows) -> f64 {
        let form = |matrix: &[f64]| {
            let mut form = Matrix3::zeros();
            let mut seen = vec![0.0; self.width];
            for a in 0..3 {
                seen.fill(0.0);
                for (value, line) in self.row(rows, a).iter().zip(matrix.chunks_exact(self.width)) {
                    seen.iter_mut().zip(line).for_each(|(s, m)| *s += value * m);
                }
                for b in a..3 {
                    let product: f64 = seen.iter().zip(self.row(rows, b)).map(|(s, v)| s * v).sum();
                    (form[(a, b)], form[(b, a)]) = (product, product);
                }
            }
            form
        };
        let inner = Matrix3::identity() + form(&self.covariance[rows.group]);
        inner.try_inverse().map_or(0.0, |inverse| (inverse * form(&self.weighed[rows.group])).trace())
    }

    fn row<'r>(&self, rows: &'r Rows, row: usize) -> &'r [f64] {
        &rows.values[row * self.width..(row + 1) * self.width]
    }

    fn gains(&self, rows: &[Rows], which: &[usize]) -> Vec<f64> {
        which.par_iter().map(|&k| self.gain(&rows[k])).collect()
    }
}

/// Chooses `wanted` of the pool, and says the accuracy by the number of poses.
pub fn choose(
    problem: &Problem,
    start: &Information,
    pool: &[Candidate],
    wanted: usize,
) -> (Vec<usize>, Vec<(usize, f64)>) {
    let rows: Vec<Rows> = pool.par_iter().map(|c| problem.rows(c)).collect();
    let most = wanted.max(COUNTS.into_iter().max().unwrap_or(0)).min(pool.len());
    let greedy = greedily(problem, start.clone(), &rows, most);
    let mut chosen: Vec<usize> = greedy[..wanted.min(most)].to_vec();
    let rms_mm = exchange(problem, start, &rows, &mut chosen);
    let mut expected = Vec::new();
    let mut information = start.clone();
    for (k, &index) in greedy.iter().enumerate() {
        information.add(&rows[index]);
        if COUNTS.contains(&(k + 1)) && k + 1 != wanted {
            expected.push((k + 1, information.rms_mm(problem)));
        }
    }
    expected.push((chosen.len(), rms_mm));
    expected.sort_by_key(|e| e.0);
    (chosen, expected)
}

fn greedily(problem: &Problem, mut information: Information, rows: &[Rows], most: usize) -> Vec<usize> {
    let all: Vec<usize> = (0..rows.len()).collect();
    let mut gains = Blocks::new(problem, &information).gains(rows, &all);
    let mut chosen = Vec::with_capacity(most);
    let groups = problem.groups();
    while chosen.len() < most {
        let blocks = Blocks::new(problem, &information);
        // The first rounds go from placement to placement.
        let only = (chosen.len() < LEAST_A_GROUP * groups).then_some(chosen.len() % groups);
        let open = |k: &usize| only.is_none_or(|g| rows[*k].group == g) && gains[*k] > f64::NEG_INFINITY;
        let mut order: Vec<usize> = (0..rows.len()).filter(open).collect();
        if order.is_empty() {
            break;
        }
        order.sort_by(|a, b| gains[*b].total_cmp(&gains[*a]));
        let mut best: Option<(f64, usize)> = None;
        for head in order.chunks(HEAD) {
            if best.is_some_and(|(gain, _)| gain >= gains[head[0]]) {
                break;
            }
            for (&k, gain) in head.iter().zip(blocks.gains(rows, head)) {
                gains[k] = gain;
                if best.is_none_or(|(most, _)| gain > most) {
                    best = Some((gain, k));
                }
            }
        }
        let Some((_, k)) = best else { break };
        information.add(&rows[k]);
        gains[k] = f64::NEG_INFINITY;
        chosen.push(k);
    }
    chosen
}

/// Exchanges chosen poses for better ones; the accuracy at the end, mm.
fn exchange(problem: &Problem, start: &Information, rows: &[Rows], chosen: &mut [usize]) -> f64 {
    let fresh = |chosen: &[usize]| {
        let mut information = start.clone();
        chosen.iter().for_each(|&k| information.add(&rows[k]));
        information
    };
    let all: Vec<usize> = (0..rows.len()).collect();
    let mut rms_mm = fresh(chosen).rms_mm(problem);
    for _ in 0..ROUNDS {
        // Anew each round, so that rounding does not gather.
        let mut information = fresh(chosen);
        let gains = Blocks::new(problem, &information).gains(rows, &all);
        let mut shortlist = all.clone();
        shortlist.sort_by(|a, b| gains[*b].total_cmp(&gains[*a]));
        shortlist.truncate(SHORTLIST);
        for i in 0..chosen.len() {
            let old = chosen[i];
            let members = chosen.iter().filter(|&&k| rows[k].group == rows[old].group).count();
            information.update(&rows[old], -1.0);
            let blocks = Blocks::new(problem, &information);
            let stays = blocks.gain(&rows[old]);
            let may = |k: &usize| !chosen.contains(k) && (members > LEAST_A_GROUP || rows[*k].group == rows[old].group);
            let open: Vec<usize> = shortlist.iter().copied().filter(may).collect();
            let found = open
                .iter()
                .zip(blocks.gains(rows, &open))
                .fold((old, stays), |best, (&k, gain)| if gain > best.1 { (k, gain) } else { best });
            chosen[i] = found.0;
            information.add(&rows[found.0]);
        }
        let before = rms_mm;
        rms_mm = fresh(chosen).rms_mm(problem);
        if rms_mm > before * (1.0 - ROUND_GAIN) {
            break;
        }
    }
    rms_mm
}
