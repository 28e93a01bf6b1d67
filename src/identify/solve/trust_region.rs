//! Trust-region Levenberg-Marquardt in a box.
//!
//! Source: the exact step of J. J. More, "The Levenberg-Marquardt algorithm: implementation and theory" (1978), with
//! scaling by the largest column norms seen; bounds by an active set in the manner of Lin and More, "Newton's method
//! for large bound-constrained problems" (1999): variables that the gradient presses against their bound are held, a
//! step that leaves the box is cut at the wall and computed anew for the rest. The step comes from a singular value
//! decomposition of R (J = QR), so that the condition number is not squared. What goes wrong: a local minimum is as
//! good as any; the caller sees the stop reason.

use nalgebra::{DMatrix, DVector};

use crate::identify::settings::DescentSettings;
use crate::identify::solve::problem::{Problem, Solution, Stop};

/// A step is accepted when it brings this fraction of the predicted reduction (More, 1978).
const ACCEPT: f64 = 1e-4;

/// Minimises from `start` (moved into the box where it lies outside).
pub fn solve(problem: &dyn Problem, start: &[f64], settings: &DescentSettings) -> Solution {
    let (lower, upper) = (problem.lower(), problem.upper());
    let n = problem.dimension();
    let mut x: Vec<f64> = (0..n).map(|i| start[i].clamp(lower[i], upper[i])).collect();
    let (mut residuals, mut jacobian) = problem.linearised(&x);
    let mut cost = 0.5 * residuals.norm_squared();
    let mut run = Solution {
        x: x.clone(),
        cost,
        iterations: 0,
        evaluations: 1 + n,
        history: vec![cost],
        history_evaluations: vec![1 + n],
        stop: Stop::IterationLimit,
    };
    if !cost.is_finite() {
        run.stop = Stop::NotFinite;
        return run;
    }
    let mut scale: Vec<f64> = column_norms(&jacobian).iter().map(|&s| if s > 0.0 { s } else { 1.0 }).collect();
    let mut radius = settings.radius * scaled_norm(&x, &scale).max(1.0);
    while run.iterations < settings.iterations {
        run.iterations += 1;
        let gradient = jacobian.tr_mul(&residuals);
        let local =
            Local { problem, residuals: &residuals, jacobian: &jacobian, gradient: &gradient, scale: &scale, cost };
        if local.is_optimal(&x, settings.gradient) {
            run.stop = Stop::SmallGradient;
            break;
        }
        let stop;
        (cost, stop) = local.step(&mut x, &mut radius, &mut run.evaluations, settings);
        run.stop = stop.unwrap_or(Stop::IterationLimit);
        let goes_on = stop.is_none() && run.iterations < settings.iterations;
        if goes_on {
            (residuals, jacobian) = problem.linearised(&x);
            run.evaluations += 1 + n;
            cost = 0.5 * residuals.norm_squared();
            for (s, norm) in scale.iter_mut().zip(column_norms(&jacobian)) {
                *s = s.max(norm);
            }
        }
        run.history.push(cost);
        run.history_evaluations.push(run.evaluations);
        if !goes_on {
            break;
        }
    }
    run.x = x;
    run.cost = cost;
    run
}

/// The problem as it is linearised at a place.
struct Local<'a> {
    problem: &'a dyn Problem,
    residuals: &'a DVector<f64>,
    jacobian: &'a DMatrix<f64>,
    gradient: &'a DVector<f64>,
    scale: &'a [f64],
    cost: f64,
}

impl Local<'_> {
    /// Takes the first step that lowers the cost as predicted, from ever smaller radii; the cost there, and why the
    /// search ends there, where it does.
    fn step(
        &self,
        x: &mut Vec<f64>,
        radius: &mut f64,
        evaluations: &mut usize,
        settings: &DescentSettings,
    ) -> (f64, Option<Stop>) {
        let Local { problem, residuals, jacobian, scale, cost, .. } = *self;
        let (lower, upper) = (problem.lower(), problem.upper());
        loop {
            let step = self.step_in_box(x, *radius);
            let candidate: Vec<f64> = (0..x.len()).map(|i| (x[i] + step[i]).clamp(lower[i], upper[i])).collect();
            let taken = DVector::from_fn(x.len(), |i, _| candidate[i] - x[i]);
            let predicted = cost - 0.5 * (residuals + jacobian * &taken).norm_squared();
            let length = scaled_norm(taken.as_slice(), scale);
            // Not `linearised`: a faster way to the cost may round differently, and reductions near rounding decide the
            // end.
            let new_cost = 0.5 * problem.residuals(&candidate).norm_squared();
            *evaluations += 1;
            let actual = cost - new_cost;
            let ratio = if predicted > 0.0 && new_cost.is_finite() { actual / predicted } else { -1.0 };
            if ratio < 0.25 {
                *radius = 0.25 * length.min(*radius);
            } else if ratio > 0.75 {
                *radius = radius.max(2.0 * length);
            }
            if ratio >= ACCEPT && actual > 0.0 {
                *x = candidate;
                let ends = actual <= settings.reduction * cost && predicted <= settings.reduction * cost;
                return (new_cost, ends.then_some(Stop::SmallReduction));
            }
            // A step cut at a wall may predict a rise; that asks for a smaller radius, not for the end.
            if predicted >= 0.0 && predicted <= settings.reduction * cost {
                return (cost, Some(Stop::SmallReduction));
            }
            if *radius <= settings.step * scaled_norm(x, scale).max(1e-3) {
                return (cost, Some(Stop::SmallStep));
            }
        }
    }

    /// The variables that do not sit at a bound that descent would cross.
    fn free(&self, x: &[f64]) -> Vec<usize> {
        let (lower, upper, gradient) = (self.problem.lower(), self.problem.upper(), self.gradient);
        let held = |i: usize| (x[i] <= lower[i] && gradient[i] >= 0.0) || (x[i] >= upper[i] && gradient[i] <= 0.0);
        (0..x.len()).filter(|&i| !held(i)).collect()
    }

    fn is_optimal(&self, x: &[f64], tolerance: f64) -> bool {
        let norm = self.residuals.norm();
        self.free(x).into_iter().all(|i| {
            let column = self.jacobian.column(i).norm();
            column == 0.0 || self.gradient[i].abs() <= tolerance * column * norm
        })
    }

    /// The step that minimises the linear model within the radius and the box, by successive fixing of what hits a
    /// wall.
    fn step_in_box(&self, x: &[f64], radius: f64) -> DVector<f64> {
        let Local { problem, residuals, jacobian, scale, .. } = *self;
        let (lower, upper) = (problem.lower(), problem.upper());
        let mut free = self.free(x);
        let mut step = DVector::zeros(x.len());
        while !free.is_empty() {
            let fixed_part = residuals + jacobian * &step;
            let used = scaled_norm(step.as_slice(), scale);
            let left = (radius * radius - used * used).max(0.0).sqrt();
            let scaled = DMatrix::from_fn(jacobian.nrows(), free.len(), |r, c| jacobian[(r, free[c])] / scale[free[c]]);
            let solution = more_step(scaled, &fixed_part, left);
            let mut trial = step.clone();
            for (k, &i) in free.iter().enumerate() {
                trial[i] = solution[k] / scale[i];
            }
            let is_outside = |&i: &usize| x[i] + trial[i] < lower[i] || x[i] + trial[i] > upper[i];
            let (outside, inside): (Vec<usize>, Vec<usize>) = free.into_iter().partition(is_outside);
            if outside.is_empty() {
                return trial;
            }
            for i in outside {
                step[i] = (x[i] + trial[i]).clamp(lower[i], upper[i]) - x[i];
            }
            // Cut walls may leave more than the radius; the shortened step still descends.
            let used = scaled_norm(step.as_slice(), scale);
            if used >= radius {
                step *= radius / used;
                return step;
            }
            free = inside;
        }
        step
    }
}

fn column_norms(jacobian: &DMatrix<f64>) -> Vec<f64> {
    jacobian.column_iter().map(|c| c.norm()).collect()
}

fn scaled_norm(x: &[f64], scale: &[f64]) -> f64 {
    x.iter().zip(scale).map(|(x, s)| (x * s).powi(2)).sum::<f64>().sqrt()
}

/// The minimiser of |J s + r| with |s| <= radius.
fn more_step(jacobian: DMatrix<f64>, residuals: &DVector<f64>, radius: f64) -> DVector<f64> {
    let n = jacobian.ncols();
    let (reduced, rhs) = if jacobian.nrows() > n {
        let qr = jacobian.qr();
        let mut rotated = DMatrix::from_column_slice(residuals.len(), 1, residuals.as_slice());
        qr.q_tr_mul(&mut rotated);
        (qr.r(), DVector::from_fn(n, |i, _| rotated[(i, 0)]))
    } else {
        (jacobian, residuals.clone())
    };
    let svd = reduced.svd(true, true);
    let (Some(u), Some(v_t)) = (&svd.u, &svd.v_t) else { return DVector::zeros(n) };
    let s = &svd.singular_values;
    let projected = u.tr_mul(&rhs);
    let threshold = s.max() * f64::EPSILON * n as f64;
    let coefficients =
        |lambda: f64| {
            DVector::from_fn(s.len(), |i, _| {
                if s[i] <= threshold { 0.0 } else { -s[i] * projected[i] / (s[i] * s[i] + lambda) }
            })
        };
    let mut lambda = 0.0;
    let mut y = coefficients(0.0);
    if y.norm() > radius {
        // Newton on 1/|y| - 1/radius, which is nearly linear in lambda; a few steps reach the tenth that More asks for.
        let (mut low, mut high) = (0.0, s.max() * projected.norm() / radius.max(f64::MIN_POSITIVE));
        for _ in 0..50 {
            let length = y.norm();
            if (length - radius).abs() <= 0.01 * radius {
                break;
            }
            if length > radius {
                low = lambda;
            } else {
                high = lambda;
            }
            let slope: f64 = (0..s.len()).map(|i| -y[i] * y[i] / (s[i] * s[i] + lambda).max(f64::MIN_POSITIVE)).sum();
            let newton = lambda - (length / radius - 1.0) * length * length / slope;
            lambda = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            y = coefficients(lambda);
        }
        let length = y.norm();
        if length > radius {
            y *= radius / length;
        }
    }
    v_t.tr_mul(&y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A problem of More, Garbow and Hillstrom, "Testing unconstrained optimization software" (1981): residuals alone;
    /// derivatives by central differences, which are exact enough for these polynomials and exponentials.
    struct Classic {
        residuals: fn(&[f64]) -> Vec<f64>,
        lower: Vec<f64>,
        upper: Vec<f64>,
    }

    impl Problem for Classic {
        fn lower(&self) -> &[f64] {
            &self.lower
        }
        fn upper(&self) -> &[f64] {
            &self.upper
        }
        fn residuals(&self, x: &[f64]) -> DVector<f64> {
            DVector::from_vec((self.residuals)(x))
        }
        fn linearised(&self, x: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
            let r = self.residuals(x);
            let mut jacobian = DMatrix::zeros(r.len(), x.len());
            for i in 0..x.len() {
                let h = 1e-6 * x[i].abs().max(1.0);
                let at = |delta: f64| {
                    let mut y = x.to_vec();
                    y[i] += delta;
                    self.residuals(&y)
                };
                jacobian.set_column(i, &((at(h) - at(-h)) / (2.0 * h)));
            }
            (r, jacobian)
        }
    }

    fn classic(residuals: fn(&[f64]) -> Vec<f64>, n: usize) -> Classic {
        Classic { residuals, lower: vec![f64::NEG_INFINITY; n], upper: vec![f64::INFINITY; n] }
    }

    fn rosenbrock(x: &[f64]) -> Vec<f64> {
        vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]
    }

    fn helical_valley(x: &[f64]) -> Vec<f64> {
        // MINPACK's branch, smooth across the start at (-1, 0, 0).
        let theta = (x[1] / x[0]).atan() / std::f64::consts::TAU + if x[0] < 0.0 { 0.5 } else { 0.0 };
        vec![10.0 * (x[2] - 10.0 * theta), 10.0 * (x[0].hypot(x[1]) - 1.0), x[2]]
    }

    fn powell_singular(x: &[f64]) -> Vec<f64> {
        let (a, b) = (x[1] - 2.0 * x[2], x[0] - x[3]);
        vec![x[0] + 10.0 * x[1], 5.0f64.sqrt() * (x[2] - x[3]), a * a, 10.0f64.sqrt() * b * b]
    }

    fn freudenstein_roth(x: &[f64]) -> Vec<f64> {
        let y = x[1];
        vec![-13.0 + x[0] + ((5.0 - y) * y - 2.0) * y, -29.0 + x[0] + ((y + 1.0) * y - 14.0) * y]
    }

    const BARD: [f64; 15] = [0.14, 0.18, 0.22, 0.25, 0.29, 0.32, 0.35, 0.39, 0.37, 0.58, 0.73, 0.96, 1.34, 2.10, 4.39];

    fn bard(x: &[f64]) -> Vec<f64> {
        let row = |i: usize| {
            let (u, v) = ((i + 1) as f64, (15 - i) as f64);
            BARD[i] - (x[0] + u / (v * x[1] + u.min(v) * x[2]))
        };
        (0..15).map(row).collect()
    }

    fn brown_dennis(x: &[f64]) -> Vec<f64> {
        let row = |i: usize| {
            let t = (i + 1) as f64 / 5.0;
            let (a, b) = (x[0] + t * x[1] - t.exp(), x[2] + x[3] * t.sin() - t.cos());
            a * a + b * b
        };
        (0..20).map(row).collect()
    }

    /// Final norms as printed in MINPACK's own test output (`lmder`, one start each).
    #[test]
    fn minpacks_problems_end_where_minpack_ends() {
        type Case = (&'static str, fn(&[f64]) -> Vec<f64>, &'static [f64], f64, f64);
        let cases: [Case; 6] = [
            ("Rosenbrock", rosenbrock, &[-1.2, 1.0], 0.0, 1e-9),
            ("helical valley", helical_valley, &[-1.0, 0.0, 0.0], 0.0, 1e-9),
            ("Powell singular", powell_singular, &[3.0, -1.0, 0.0, 1.0], 0.0, 1e-9),
            ("Freudenstein and Roth", freudenstein_roth, &[0.5, -2.0], 6.99887517, 1e-6),
            ("Bard", bard, &[1.0, 1.0, 1.0], 0.0906359603, 1e-8),
            ("Brown and Dennis", brown_dennis, &[25.0, 5.0, -5.0, -1.0], 292.954288, 1e-4),
        ];
        for (name, residuals, start, norm, tolerance) in cases {
            // Brown and Dennis' residuals are large: MINPACK too needs hundreds of evaluations.
            let settings = DescentSettings { iterations: 2000, ..DescentSettings::default() };
            let run = solve(&classic(residuals, start.len()), start, &settings);
            let reached = (2.0 * run.cost).sqrt();
            assert!((reached - norm).abs() < tolerance, "{name}: {reached}, {run:?}");
            assert!(run.history.windows(2).all(|w| w[1] <= w[0]), "{name}");
        }
    }

    #[test]
    fn a_bound_in_the_way_is_where_it_ends() {
        // With x <= 0.5 Rosenbrock's least value lies at (0.5, 0.25), cost 0.125.
        let mut problem = classic(rosenbrock, 2);
        problem.upper = vec![0.5, 2.0];
        problem.lower = vec![-2.0, -2.0];
        let run = solve(&problem, &[-1.2, 1.0], &DescentSettings::default());
        assert!((run.cost - 0.125).abs() < 1e-9 && run.x[0] == 0.5 && (run.x[1] - 0.25).abs() < 1e-6, "{run:?}");
    }

    #[test]
    fn a_column_of_zeros_leaves_its_parameter_alone() {
        let run = solve(&classic(|x| vec![x[0] - 3.0], 2), &[0.0, 7.0], &DescentSettings::default());
        assert!((run.x[0] - 3.0).abs() < 1e-12 && run.x[1] == 7.0);
    }

    #[test]
    fn a_start_that_is_no_number_is_said() {
        let run = solve(&classic(|x| vec![x[0].sqrt()], 1), &[-1.0], &DescentSettings::default());
        assert_eq!(run.stop, Stop::NotFinite);
    }
}
