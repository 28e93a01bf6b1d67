//! One corner fitted to raw pixels, at the limit that noise allows.
//!
//! Model round the corner c, where two blurred edges cross (p a pixel, u_k its distance from edge k, n_k the edge's
//! normal):
//!
//! ```text
//! I(p) = m + g.(p - p0) + (A/2 + h.(p - p0)) erf(u_1 / (sqrt2 s_1)) erf(u_2 / (sqrt2 s_2))
//! u_k  = n_k.(p - c) + kappa_k/2 (t_k.(p - c))^2
//! ```
//!
//! with lighting gradients g and h about the fixed start p0, a blur s_k for each edge, and the edges' bend kappa_k (lens
//! distortion), which is given, not fitted. Twelve parameters, Levenberg-Marquardt (Marquardt 1963), analytic
//! derivatives. In: pixels and a start good to a few blurs. Out: place, covariance (residual variance times inverse
//! normal matrix), blur, contrast, residual. The product of two error functions is exact for perpendicular edges; for
//! oblique ones it stays unbiased by symmetry. Goes wrong: too few pixels, no contrast, an edge that is not there; all end in `None`.

use nalgebra::{Matrix2, Point2, SMatrix, SVector, Vector2};

use super::special::{erf_from, exp_negative};

/// Number of parameters: c (2), edge angles (2), blurs (2), m, g (2), A, h (2).
const N: usize = 12;
/// Pixels that are worked on side by side.
const LANES: usize = 4;
/// Steps after which a fit that still moves is given up; a good start needs four to eight.
const MAX_STEPS: usize = 40;
/// Least blur, px: that of the box of a pixel alone, 1/sqrt(12). Sharpened pictures would fit less, with a slope that no pixel sees.
const LEAST_BLUR_PX: f64 = 0.3;

/// Pixels of a window, relative to its start.
#[derive(Debug, Clone, Default)]
pub struct Window {
    /// x - x0, y - y0 and grey value, in groups that are padded with `weight` zero.
    groups: Vec<Group>,
    /// Number of pixels.
    pub count: usize,
    /// Number of pixels that were left out as saturated.
    pub saturated: usize,
}

#[derive(Debug, Clone, Copy)]
struct Group {
    x: [f64; LANES],
    y: [f64; LANES],
    grey: [f64; LANES],
    weight: [f64; LANES],
}

impl Window {
    /// Forgets all pixels, keeps the memory.
    pub fn clear(&mut self) {
        self.groups.clear();
        (self.count, self.saturated) = (0, 0);
    }

    /// Adds a pixel by its place relative to the start.
    pub fn push(&mut self, x: f64, y: f64, grey: f64) {
        let lane = self.count % LANES;
        if lane == 0 {
            let zero = [0.0; LANES];
            self.groups.push(Group { x: zero, y: zero, grey: zero, weight: zero });
        }
        if let Some(group) = self.groups.last_mut() {
            (group.x[lane], group.y[lane], group.grey[lane], group.weight[lane]) = (x, y, grey, 1.0);
        }
        self.count += 1;
    }
}

/// The corner as a function of the pixel; places relative to the window's start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model {
    /// The corner, px.
    pub corner: Vector2<f64>,
    /// Directions of the two edges, rad.
    pub angles_rad: [f64; 2],
    /// Blur across the two edges (standard deviation), px.
    pub blur_px: [f64; 2],
    /// Mean of light and dark at the start.
    pub level: f64,
    /// Its gradient, per px.
    pub level_slope: Vector2<f64>,
    /// Half of light minus dark at the start; negative where the quadrant between both normals is the dark one.
    pub half_contrast: f64,
    /// Its gradient, per px.
    pub contrast_slope: Vector2<f64>,
    /// Bend of the two edges, 1/px.
    pub bend: [f64; 2],
}

/// What a fit found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// The parameters.
    pub model: Model,
    /// Covariance of the corner's place, px^2.
    pub covariance_px2: Matrix2<f64>,
    /// Standard deviation of the residuals, grey values.
    pub residual: f64,
    /// Number of pixels.
    pub pixels: usize,
}

type Normal = SMatrix<f64, N, N>;
type Column = SVector<f64, N>;

impl Model {
    fn add(&self, d: &Column) -> Model {
        Model {
            corner: self.corner + Vector2::new(d[0], d[1]),
            angles_rad: [self.angles_rad[0] + d[2], self.angles_rad[1] + d[3]],
            blur_px: [(self.blur_px[0] + d[4]).max(LEAST_BLUR_PX), (self.blur_px[1] + d[5]).max(LEAST_BLUR_PX)],
            level: self.level + d[6],
            level_slope: self.level_slope + Vector2::new(d[7], d[8]),
            half_contrast: self.half_contrast + d[9],
            contrast_slope: self.contrast_slope + Vector2::new(d[10], d[11]),
            bend: self.bend,
        }
    }

    /// Takes a blur at its bound out of the equations where they would push it below.
    fn hold_least_blur(&self, matrix: &mut Normal, gradient: &mut Column) {
        for k in [0, 1] {
            if self.blur_px[k] <= LEAST_BLUR_PX && gradient[4 + k] <= 0.0 {
                matrix.fill_row(4 + k, 0.0);
                matrix.fill_column(4 + k, 0.0);
                matrix[(4 + k, 4 + k)] = 1.0;
                gradient[4 + k] = 0.0;
            }
        }
    }

    /// Grey values and their derivatives for a group of pixels.
    #[inline(always)]
    fn evaluate(&self, group: &Group) -> ([f64; LANES], [[f64; LANES]; N]) {
        let sin_cos = self.angles_rad.map(f64::sin_cos);
        let mut grey = [0.0; LANES];
        let mut j = [[0.0; LANES]; N];
        for l in 0..LANES {
            let (x, y) = (group.x[l], group.y[l]);
            let (dx, dy) = (x - self.corner.x, y - self.corner.y);
            let mut value = [0.0; 2];
            let mut slope = [0.0; 2];
            let mut across = [0.0; 2];
            let mut along = [0.0; 2];
            for k in 0..2 {
                let (sin, cos) = sin_cos[k];
                let v = cos * dx + sin * dy;
                let u = cos * dy - sin * dx + 0.5 * self.bend[k] * v * v;
                let s = 1.0 / self.blur_px[k];
                let z = u * s * std::f64::consts::FRAC_1_SQRT_2;
                let e = exp_negative(-z * z);
                value[k] = erf_from(z, e);
                // d erf / du
                slope[k] = e * s * (std::f64::consts::FRAC_2_SQRT_PI * std::f64::consts::FRAC_1_SQRT_2);
                (across[k], along[k]) = (u, v);
            }
            let product = value[0] * value[1];
            let half = self.half_contrast + self.contrast_slope.x * x + self.contrast_slope.y * y;
            grey[l] = self.level + self.level_slope.x * x + self.level_slope.y * y + half * product;
            for k in 0..2 {
                let (sin, cos) = sin_cos[k];
                let by_u = half * slope[k] * value[1 - k];
                let bend = self.bend[k] * along[k];
                j[0][l] += by_u * (sin - bend * cos);
                j[1][l] += by_u * (-cos - bend * sin);
                j[2 + k][l] = -by_u * along[k];
                j[4 + k][l] = -by_u * across[k] / self.blur_px[k];
            }
            j[6][l] = 1.0;
            j[7][l] = x;
            j[8][l] = y;
            j[9][l] = product;
            j[10][l] = x * product;
            j[11][l] = y * product;
        }
        (grey, j)
    }

    /// Sum of squared residuals, normal matrix and gradient.
    fn normal(&self, window: &Window) -> (f64, Normal, Column) {
        let mut cost = [0.0; LANES];
        let mut upper = [[0.0; LANES]; N * (N + 1) / 2];
        let mut gradient = [[0.0; LANES]; N];
        for group in &window.groups {
            let (grey, mut j) = self.evaluate(group);
            let mut r = [0.0; LANES];
            for l in 0..LANES {
                r[l] = (group.grey[l] - grey[l]) * group.weight[l];
                cost[l] += r[l] * r[l];
            }
            let mut at = 0;
            for a in 0..N {
                for l in 0..LANES {
                    j[a][l] *= group.weight[l];
                    gradient[a][l] += j[a][l] * r[l];
                }
                for b in 0..=a {
                    for l in 0..LANES {
                        upper[at][l] += j[a][l] * j[b][l];
                    }
                    at += 1;
                }
            }
        }
        let total = |lanes: [f64; LANES]| lanes.iter().sum::<f64>();
        let place = |a: usize, b: usize| a.max(b) * (a.max(b) + 1) / 2 + a.min(b);
        let matrix = Normal::from_fn(|a, b| total(upper[place(a, b)]));
        (total(cost), matrix, Column::from_fn(|a, _| total(gradient[a])))
    }
}

/// Solves for the linear part of the model (levels, contrast, gradients) with corner, edges and blur as they are.
/// `None` where the pixels don't determine it.
pub fn with_levels(start: &Model, window: &Window) -> Option<Model> {
    let flat = Model {
        level: 0.0,
        level_slope: Vector2::zeros(),
        half_contrast: 0.0,
        contrast_slope: Vector2::zeros(),
        ..*start
    };
    let (_, matrix, gradient) = flat.normal(window);
    let linear = matrix.fixed_view::<6, 6>(6, 6).into_owned();
    let d = linear.cholesky()?.solve(&gradient.fixed_rows::<6>(6).into_owned());
    let mut column = Column::zeros();
    column.fixed_rows_mut::<6>(6).copy_from(&d);
    Some(flat.add(&column))
}

/// Fits the model to the window's pixels. `None` where the pixels don't determine it or the fit does not settle.
pub fn fit(start: &Model, window: &Window) -> Option<Fit> {
    /// A step this small against the noise's own uncertainty (about 0.003 px at best) changes nothing.
    const SETTLED_PX: f64 = 2e-5;
    if window.count < 2 * N {
        return None;
    }
    let mut model = with_levels(start, window)?;
    let (mut cost, mut matrix, mut gradient) = model.normal(window);
    let mut damping = 1e-3;
    let mut settled = false;
    for _ in 0..MAX_STEPS {
        let mut damped = matrix;
        model.hold_least_blur(&mut damped, &mut gradient);
        for i in 0..N {
            damped[(i, i)] *= 1.0 + damping;
        }
        let step = damped.cholesky()?.solve(&gradient);
        if !step.iter().all(|v| v.is_finite()) {
            return None;
        }
        let small = step[0].hypot(step[1]) < SETTLED_PX;
        let next = model.add(&step);
        let (next_cost, next_matrix, next_gradient) = next.normal(window);
        if next_cost <= cost {
            (model, cost, matrix, gradient) = (next, next_cost, next_matrix, next_gradient);
            damping = (damping * 0.1).max(1e-9);
        } else if !small {
            damping *= 10.0;
        }
        if small {
            settled = true;
            break;
        }
        if damping > 1e9 {
            break;
        }
    }
    if !settled {
        return None;
    }
    // Rounding to whole grey values alone leaves 1/12.
    let variance = (cost / (window.count - N) as f64).max(1.0 / 12.0);
    model.hold_least_blur(&mut matrix, &mut gradient);
    let inverse = matrix.cholesky()?.inverse();
    let covariance_px2 = inverse.fixed_view::<2, 2>(0, 0) * variance;
    let fit = Fit { model, covariance_px2, residual: variance.sqrt(), pixels: window.count };
    (fit.covariance_px2.iter().all(|v| v.is_finite()) && cost.is_finite()).then_some(fit)
}

impl Fit {
    /// The corner in the picture whose window started at `start`, px.
    pub fn place(&self, start: &Point2<f64>) -> Point2<f64> {
        start + self.model.corner
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model() -> Model {
        Model {
            corner: Vector2::new(0.3, -0.2),
            angles_rad: [0.1, 1.5],
            blur_px: [0.9, 1.3],
            level: 120.0,
            level_slope: Vector2::new(0.3, -0.1),
            half_contrast: 70.0,
            contrast_slope: Vector2::new(-0.2, 0.15),
            bend: [1e-3, -2e-3],
        }
    }

    fn window(model: &Model, half: i32) -> Window {
        let mut window = Window::default();
        for y in -half..=half {
            for x in -half..=half {
                let at = Group {
                    x: [f64::from(x); LANES],
                    y: [f64::from(y); LANES],
                    grey: [0.0; LANES],
                    weight: [1.0; LANES],
                };
                window.push(f64::from(x), f64::from(y), model.evaluate(&at).0[0]);
            }
        }
        window
    }

    #[test]
    fn derivatives_match_central_differences() {
        let model = model();
        for (x, y) in [(0.0, 0.0), (1.0, 0.5), (-2.0, 1.0), (0.4, -3.0)] {
            let at = Group { x: [x; LANES], y: [y; LANES], grey: [0.0; LANES], weight: [1.0; LANES] };
            let (_, j) = model.evaluate(&at);
            for (i, column) in j.iter().enumerate() {
                let h = 1e-4;
                let mut d = Column::zeros();
                d[i] = h;
                let (up, down) = (model.add(&d).evaluate(&at).0[0], model.add(&-d).evaluate(&at).0[0]);
                let numeric = (up - down) / (2.0 * h);
                // The approximation of erf is good to 1.5e-7 of 70 grey values, over a step of 1e-4; the second-order
                // part of a bend's turn is left out of the derivative by angle.
                assert!(
                    (numeric - column[0]).abs() < 0.15 + 5e-3 * numeric.abs(),
                    "{i} at {x},{y}: {numeric} {}",
                    column[0]
                );
            }
        }
    }

    #[test]
    fn a_fit_without_noise_recovers_the_model() {
        let truth = model();
        let window = window(&truth, 12);
        let start = Model { corner: Vector2::new(-1.0, 1.2), angles_rad: [0.0, 1.6], blur_px: [2.0, 2.0], ..truth };
        let fit = fit(&start, &window).unwrap();
        // Limited by the stop rule, not by the pixels.
        assert!((fit.model.corner - truth.corner).norm() < 1e-5, "{:?}", fit.model);
        assert!((fit.model.blur_px[1] - 1.3).abs() < 1e-4 && (fit.model.angles_rad[0] - 0.1).abs() < 1e-4);
    }

    #[test]
    fn a_flat_or_empty_window_has_no_corner() {
        let start = model();
        assert_eq!(fit(&start, &Window::default()), None);
        let mut flat = Window::default();
        (0..400).for_each(|i| flat.push(f64::from(i % 20) - 10.0, f64::from(i / 20) - 10.0, 100.0));
        assert!(fit(&start, &flat).is_none_or(|f| f.covariance_px2[(0, 0)] > 1.0));
    }
}
