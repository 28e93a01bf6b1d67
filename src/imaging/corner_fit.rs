//! One corner fitted to raw pixels, at the limit that noise allows.
//!
//! Model round the corner c, where two blurred edges cross (p a pixel, u_k its distance from edge k, n_k and t_k the
//! edge's normal and direction):
//!
//! ```text
//! I(p) = (1 + g.(p - p0)) (m + A/2 E(u_1 / s_1, u_2 / s_2))
//! u_k  = n_k.(p - c) + kappa_k/2 (t_k.(p - c))^2
//! E(a, b) = erf(a/sqrt2) erf(b/sqrt2) + 4 (bivariate - product of normal integrals, correlation n_1.n_2)
//! ```
//!
//! with a lighting gradient g about the fixed start p0, a blur s_k for each edge, and the edges' bend kappa_k (lens
//! distortion), which is given, not fitted. E is the sign pattern of two crossing lines under a Gaussian blur: the
//! normal integral's dependence on the correlation is that of Drezner and Wesolowsky (1990). Ten parameters,
//! Levenberg-Marquardt (Marquardt 1963), analytic derivatives. In: pixels and a start good to a few blurs. Out: place,
//! covariance (residual variance times inverse normal matrix), blur, contrast, residual.
//! Goes wrong: too few pixels, no contrast, an edge that is not there; all end in `None`.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_2_SQRT_PI, TAU};

use nalgebra::{Matrix2, Point2, SMatrix, SVector, Vector2};

use super::special::{erf_from, exp_negative};
use super::window::{Group, LANES, Window};

/// Number of parameters: c (2), edge angles (2), blurs (2), m, A/2, g (2).
const N: usize = 10;
/// The parameters' derivatives and the residual.
const COLUMNS: usize = N + 1;
/// Steps after which a fit that still moves is given up; a good start needs three to six.
const MAX_STEPS: usize = 40;
/// Least blur, px: that of the box of a pixel alone, 1/sqrt(12). Sharpened pictures would fit less, with a slope that no pixel sees.
const LEAST_BLUR_PX: f64 = 0.3;
/// Beyond this many blurs from the crossing the two edges know nothing of each other: exp(-4.5^2/2) is 4e-5.
const CROSSING_BLURS: f64 = 4.5;

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
    /// Half of light minus dark at the start; negative where the quadrant between both normals is the dark one.
    pub half_contrast: f64,
    /// Change of the light, as a share per px.
    pub light_slope: Vector2<f64>,
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
    /// Number of observations.
    pub pixels: usize,
    /// Number of pixels that were left out as saturated.
    pub saturated: usize,
    /// Number of steps to the end.
    pub steps: usize,
}

/// A number for each pixel of a group.
type Lanes = [f64; LANES];
type Normal = SMatrix<f64, N, N>;
type Column = SVector<f64, N>;

/// What all pixels share in one evaluation.
struct Shared {
    sin: [f64; 2],
    cos: [f64; 2],
    per_blur: [f64; 2],
    /// n_1.n_2 and its change by the first angle (the second's is the opposite).
    correlation: f64,
    correlation_slope: f64,
    /// 1 / sqrt(1 - correlation^2).
    stretch: f64,
    crossing: Crossing,
}

/// What [`Shared::cross`] needs of the correlation alone.
struct Crossing {
    /// sin of each node, -1 / (2 cos^2) of it, and the node's weight times 4 arcsin(correlation) / tau.
    nodes: [(f64, f64, f64); 6],
    /// The same for the correlation itself, with 4 / (tau cos).
    top: (f64, f64, f64),
}

impl Model {
    fn add(&self, d: &Column) -> Model {
        Model {
            corner: self.corner + Vector2::new(d[0], d[1]),
            angles_rad: [self.angles_rad[0] + d[2], self.angles_rad[1] + d[3]],
            blur_px: [(self.blur_px[0] + d[4]).max(LEAST_BLUR_PX), (self.blur_px[1] + d[5]).max(LEAST_BLUR_PX)],
            level: self.level + d[6],
            half_contrast: self.half_contrast + d[7],
            light_slope: self.light_slope + Vector2::new(d[8], d[9]),
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

    fn shared(&self) -> Shared {
        let sin_cos = self.angles_rad.map(f64::sin_cos);
        let turn = self.angles_rad[0] - self.angles_rad[1];
        // Edges that nearly coincide are no corner; the bound only keeps the numbers finite until that is noticed.
        let correlation = turn.cos().clamp(-0.99, 0.99);
        Shared {
            sin: sin_cos.map(|s| s.0),
            cos: sin_cos.map(|s| s.1),
            per_blur: self.blur_px.map(|s| 1.0 / s),
            correlation,
            correlation_slope: -turn.sin(),
            stretch: 1.0 / (1.0 - correlation * correlation).sqrt(),
            crossing: Crossing::new(correlation),
        }
    }

    /// Grey values and their derivatives for a group of pixels.
    #[inline(always)]
    fn evaluate(&self, shared: &Shared, group: &Group, grey: &mut Lanes, j: &mut [Lanes; COLUMNS]) {
        let zero = [[0.0; LANES]; 2];
        let (mut z, mut along, mut value, mut slope, mut other) = (zero, zero, zero, zero, zero);
        for k in 0..2 {
            let (sin, cos, per_blur, bend) = (shared.sin[k], shared.cos[k], shared.per_blur[k], self.bend[k]);
            for l in 0..LANES {
                let (dx, dy) = (group.x[l] - self.corner.x, group.y[l] - self.corner.y);
                let v = cos * dx + sin * dy;
                along[k][l] = v;
                z[k][l] = (cos * dy - sin * dx + 0.5 * bend * v * v) * per_blur;
            }
            for l in 0..LANES {
                slope[k][l] = exp_negative(-0.5 * z[k][l] * z[k][l]);
            }
            for l in 0..LANES {
                value[k][l] = erf_from(z[k][l] * FRAC_1_SQRT_2, slope[k][l]);
                slope[k][l] *= per_blur * (FRAC_2_SQRT_PI * FRAC_1_SQRT_2);
            }
        }
        (other[0], other[1]) = (value[1], value[0]);
        let mut pattern = [0.0; LANES];
        for l in 0..LANES {
            pattern[l] = value[0][l] * value[1][l];
        }
        let mut by_correlation = [0.0; LANES];
        shared.cross(&z, &mut pattern, &mut by_correlation, &mut other);
        let mut half = [0.0; LANES];
        for l in 0..LANES {
            let (x, y, weight) = (group.x[l], group.y[l], group.weight[l]);
            let light = weight * (1.0 + self.light_slope.x * x + self.light_slope.y * y);
            let reflected = self.level + self.half_contrast * pattern[l];
            grey[l] = light * reflected;
            half[l] = light * self.half_contrast;
            j[6][l] = light;
            j[7][l] = light * pattern[l];
            j[8][l] = weight * x * reflected;
            j[9][l] = weight * y * reflected;
        }
        for k in 0..2 {
            let turn = if k == 0 { shared.correlation_slope } else { -shared.correlation_slope };
            for l in 0..LANES {
                let by_u = half[l] * slope[k][l] * other[k][l];
                let bent = self.bend[k] * along[k][l];
                slope[k][l] = by_u * (shared.sin[k] - bent * shared.cos[k]);
                other[k][l] = by_u * (-shared.cos[k] - bent * shared.sin[k]);
                j[2 + k][l] = half[l] * by_correlation[l] * turn - by_u * along[k][l];
                j[4 + k][l] = -by_u * z[k][l];
            }
        }
        for l in 0..LANES {
            j[0][l] = slope[0][l] + slope[1][l];
            j[1][l] = other[0][l] + other[1][l];
        }
    }

    /// Sum of squared residuals, normal matrix and gradient.
    fn normal(&self, window: &Window) -> (f64, Normal, Column) {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has just said that it knows these instructions.
            return unsafe { self.normal_avx2(window) };
        }
        self.normal_lanes(window)
    }

    /// The same arithmetic, hence the same bits, with wider registers.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn normal_avx2(&self, window: &Window) -> (f64, Normal, Column) {
        self.normal_lanes(window)
    }

    #[inline(always)]
    fn normal_lanes(&self, window: &Window) -> (f64, Normal, Column) {
        let shared = self.shared();
        // One sum a lane: the loops stay plain enough for the compiler to make vector loops of them.
        let mut sums = [[0.0; LANES]; COLUMNS * (COLUMNS + 1) / 2];
        let (mut grey, mut j) = ([0.0; LANES], [[0.0; LANES]; COLUMNS]);
        for group in &window.groups {
            self.evaluate(&shared, group, &mut grey, &mut j);
            for l in 0..LANES {
                j[N][l] = group.grey[l] * group.weight[l] - grey[l];
            }
            let mut at = 0;
            for a in 0..COLUMNS {
                for b in 0..=a {
                    for l in 0..LANES {
                        sums[at][l] += j[a][l] * j[b][l];
                    }
                    at += 1;
                }
            }
        }
        let total = |a: usize, b: usize| sums[a.max(b) * (a.max(b) + 1) / 2 + a.min(b)].iter().sum::<f64>();
        (total(N, N), Normal::from_fn(total), Column::from_fn(|a, _| total(N, a)))
    }
}

impl Crossing {
    fn new(correlation: f64) -> Crossing {
        // Gauss-Legendre on [0, 1], six points: good to 1e-5 down to edges 45 degrees apart.
        const NODES: [(f64, f64); 6] = [
            (0.033_765_242_898_423_99, 0.085_662_246_189_585_17),
            (0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
            (0.380_690_406_958_401_55, 0.233_956_967_286_345_52),
            (0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
            (0.830_604_693_233_132_2, 0.180_380_786_524_069_3),
            (0.966_234_757_101_576, 0.085_662_246_189_585_17),
        ];
        let angle = correlation.asin();
        let at = |sin: f64, weight: f64| (sin, -0.5 / (1.0 - sin * sin), weight);
        let nodes = NODES.map(|(node, weight)| at((node * angle).sin(), weight * angle * 4.0 / TAU));
        Crossing { nodes, top: at(correlation, 4.0 / (TAU * angle.cos())) }
    }
}

impl Shared {
    /// What the edges' correlation changes near their crossing, at places `z` (in blurs from each edge): adds to the product of two
    /// error functions the integral of 4 phi_2(a, b; r) over r from 0 to the correlation, with r = sin t; gives its
    /// derivative by the correlation, and for each edge the integral across the other.
    #[inline(always)]
    fn cross(&self, z: &[Lanes; 2], pattern: &mut Lanes, by_correlation: &mut Lanes, other: &mut [Lanes; 2]) {
        let (mut near, mut count) = ([0; LANES], 0);
        for (l, (a, b)) in z[0].iter().zip(&z[1]).enumerate() {
            near[count] = l;
            count += usize::from(a.abs().max(b.abs()) < CROSSING_BLURS);
        }
        let (mut squares, mut product, mut more, mut by) = ([0.0; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for (i, &l) in near[..count].iter().enumerate() {
            (squares[i], product[i]) = (z[0][l] * z[0][l] + z[1][l] * z[1][l], 2.0 * z[0][l] * z[1][l]);
        }
        for (sin, scale, weight) in self.crossing.nodes {
            for i in 0..count {
                more[i] += weight * exp_negative((squares[i] - product[i] * sin) * scale);
            }
        }
        let (sin, scale, weight) = self.crossing.top;
        for i in 0..count {
            by[i] = weight * exp_negative((squares[i] - product[i] * sin) * scale);
        }
        for (i, &l) in near[..count].iter().enumerate() {
            pattern[l] += more[i];
            by_correlation[l] = by[i];
            for k in 0..2 {
                let b = (z[1 - k][l] - self.correlation * z[k][l]) * self.stretch;
                other[k][l] = erf_from(b * FRAC_1_SQRT_2, exp_negative(-0.5 * b * b));
            }
        }
    }
}

/// Solves for level and contrast, where the start has none, with the rest as it is and even light. `None` where the pixels don't determine them.
fn with_levels(start: &Model, window: &Window) -> Option<Model> {
    if start.half_contrast != 0.0 {
        return Some(*start);
    }
    let even = Model { level: 0.0, half_contrast: 0.0, light_slope: Vector2::zeros(), ..*start };
    let (_, matrix, gradient) = even.normal(window);
    let d = matrix.fixed_view::<2, 2>(6, 6).into_owned().cholesky()?.solve(&gradient.fixed_rows::<2>(6).into_owned());
    Some(Model { level: d[0], half_contrast: d[1], ..even })
}

/// Fits the model to the window's pixels. `None` where the pixels don't determine it or the fit does not settle.
pub fn fit(start: &Model, window: &Window) -> Option<Fit> {
    /// A step that promises less than this share of one pixel's variance moves nothing by more than a tenth of its sigma; it is
    /// still taken, and steps shrink at least tenfold by then, so less than a hundredth is left.
    const SETTLED: f64 = 1e-2;
    if window.count < 3 * N {
        return None;
    }
    let freedom = (window.count - N) as f64;
    let mut model = with_levels(start, window)?;
    let (mut cost, mut matrix, mut gradient) = model.normal(window);
    let mut damping = 1e-3;
    let (mut settled, mut steps) = (false, 0);
    while steps < MAX_STEPS {
        steps += 1;
        let mut damped = matrix;
        model.hold_least_blur(&mut damped, &mut gradient);
        for i in 0..N {
            damped[(i, i)] *= 1.0 + damping;
        }
        let step = damped.cholesky()?.solve(&gradient);
        if !step.iter().all(|v| v.is_finite()) {
            return None;
        }
        let next = model.add(&step);
        if gradient.dot(&step) < SETTLED * (cost / freedom).max(1e-6) {
            // What such a step still changes in cost and curvature is below rounding.
            model = next;
            settled = true;
            break;
        }
        let (next_cost, next_matrix, next_gradient) = next.normal(window);
        if next_cost <= cost {
            (model, cost, matrix, gradient) = (next, next_cost, next_matrix, next_gradient);
            damping = (damping * 0.1).max(1e-9);
        } else {
            damping *= 10.0;
        }
        if damping > 1e9 {
            break;
        }
    }
    if !settled {
        return None;
    }
    // Rounding to whole grey values alone leaves 1/12.
    let variance = (cost / freedom).max(1.0 / 12.0);
    model.hold_least_blur(&mut matrix, &mut gradient);
    let inverse = matrix.cholesky()?.inverse();
    let covariance_px2 = inverse.fixed_view::<2, 2>(0, 0) * variance;
    let (pixels, saturated) = (window.count, window.saturated);
    let fit = Fit { model, covariance_px2, residual: variance.sqrt(), pixels, saturated, steps };
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
            angles_rad: [0.1, 1.3],
            blur_px: [0.9, 1.3],
            level: 120.0,
            half_contrast: 70.0,
            light_slope: Vector2::new(-2e-3, 1.5e-3),
            bend: [1e-3, -2e-3],
        }
    }

    fn at(model: &Model, x: f64, y: f64) -> (f64, [f64; N]) {
        let group = Group { x: [x; LANES], y: [y; LANES], grey: [0.0; LANES], weight: [1.0; LANES] };
        let (mut grey, mut j) = ([0.0; LANES], [[0.0; LANES]; COLUMNS]);
        model.evaluate(&model.shared(), &group, &mut grey, &mut j);
        (grey[0], std::array::from_fn(|i| j[i][0]))
    }

    fn window(model: &Model, half: i32) -> Window {
        let mut window = Window::default();
        for y in -half..=half {
            for x in -half..=half {
                window.push(f64::from(x), f64::from(y), at(model, f64::from(x), f64::from(y)).0, 1.0);
            }
        }
        window
    }

    #[test]
    fn derivatives_match_central_differences() {
        let model = model();
        for (x, y) in [(0.0, 0.0), (1.0, 0.5), (-2.0, 1.0), (0.4, -3.0)] {
            let grey = |m: &Model| at(m, x, y).0;
            let (_, j) = at(&model, x, y);
            for (i, column) in j.iter().enumerate() {
                let h = 1e-4;
                let mut d = Column::zeros();
                d[i] = h;
                let (up, down) = (grey(&model.add(&d)), grey(&model.add(&-d)));
                let numeric = (up - down) / (2.0 * h);
                // The approximation of erf is good to 1.5e-7 of 70 grey values, over a step of 1e-4; the second-order
                // part of a bend's turn is left out of the derivative by angle.
                assert!((numeric - column).abs() < 0.15 + 5e-3 * numeric.abs(), "{i} at {x},{y}: {numeric} {column}");
            }
        }
    }

    #[test]
    fn a_fit_without_noise_recovers_the_model() {
        let truth = model();
        let window = window(&truth, 12);
        let start = Model { corner: Vector2::new(-1.0, 1.2), angles_rad: [0.0, 1.4], blur_px: [2.0, 2.0], ..truth };
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
        (0..400).for_each(|i| flat.push(f64::from(i % 20) - 10.0, f64::from(i / 20) - 10.0, 100.0, 1.0));
        assert!(fit(&start, &flat).is_none_or(|f| f.covariance_px2[(0, 0)] > 1.0));
    }
}
