//! What the pixels of a window make of a model: the sums of the derivatives' products that a least-squares step needs.
//!
//! Each kind of pixel has them from the fewest columns that span its derivatives, and a linear map takes those to the
//! model's parameters.

use nalgebra::{Matrix2, Matrix4, Matrix4x2, SMatrix, SVector, Vector2, Vector4};

use super::crossing::Crossing;
use super::model::{COLUMNS, Edge, Light, Model, N};
use super::products::Products;
use super::window::{Group, Groups, LANES, Lanes, Window};
use crate::widest::widest;

/// What the derivatives along an arm are made of: see [`along`].
const ARM: usize = 8;
/// The same where stray light is looked for, too, whose slopes along x and y have columns of their own after all
/// others.
pub const STRAY_COLUMNS: usize = COLUMNS + 2;
const STRAY_ARM: usize = ARM + 2;

/// What all pixels of a window make of a model, by `C` columns: the parameters' derivatives, the residual, and perhaps
/// those of stray light.
pub struct Evaluation<const C: usize> {
    /// Sums of the columns' products over all pixels.
    pub sums: SMatrix<f64, C, C>,
    /// Sum of squared residuals over the pixels that see an edge.
    pub near_cost: f64,
    /// For each edge, on either side of the crossing.
    pub arms: [[Arm<C>; 2]; 2],
}

/// The normal matrix of a least-squares step, and its gradient.
pub type Normal = SMatrix<f64, N, N>;
pub type Column = SVector<f64, N>;

impl<const C: usize> Evaluation<C> {
    /// Sum of squared residuals.
    pub fn cost(&self) -> f64 {
        self.sums[(N, N)]
    }

    /// The equations of a step.
    pub fn equations(&self) -> (Normal, Column) {
        (self.sums.fixed_view::<N, N>(0, 0).into_owned(), self.sums.fixed_view::<N, 1>(0, N).into_owned())
    }
}

/// A chi-squared, and what it is in the mean where residuals are noise and nothing else.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Misfit {
    /// Sum of squares over the residuals' variance.
    pub chi_square: f64,
    /// Its mean under noise.
    pub freedom: f64,
}

/// What an arm tells by itself: where its edge would lie and run, a step aside and a turn, if it were free of the
/// common model.
#[derive(Debug, Clone, Copy)]
pub struct Arm<const C: usize> {
    /// Normal matrix of step and turn.
    pub(super) normal: Matrix2<f64>,
    /// Its inverse; zero where the arm does not determine them.
    inverse: Matrix2<f64>,
    /// Sums of the products of the derivatives by step and turn with all columns.
    pub(super) by_columns: SMatrix<f64, 2, C>,
}

impl<const C: usize> Arm<C> {
    /// By how much less the sum of squared residuals would be, after the columns of `parameters` had taken a step.
    pub fn gain(&self, parameters: &[usize], step: &[f64]) -> f64 {
        let gradient = self.gradient(parameters, step);
        gradient.dot(&(self.inverse * gradient))
    }

    /// Its gradient by step and turn then.
    pub(super) fn gradient(&self, parameters: &[usize], step: &[f64]) -> Vector2<f64> {
        let taken = parameters.iter().zip(step).map(|(&at, by)| self.by_columns.column(at) * *by);
        taken.fold(self.by_columns.column(N).into_owned(), |left, taken| left - taken)
    }
}

/// The least of an arm's turn that its step does not explain, as a share: a thousand times the rounding of sums of
/// seven digits.
const LEAST_APART: f64 = 1e-4;

/// What the two arms of an edge miss the common model by, as `[bent, apart]`: the one how they run through the crossing
/// aside of it and turn against each other, the other how far they are apart there and turn alike. Each is free of the
/// other; chi-squared in units of the residuals' variance times it, and what that is in the mean where residuals are
/// noise and nothing else: two, less what the common fit of `parameters` has taken, whose covariance over that variance
/// `inverse` is. `None` where one arm does not determine its edge.
pub fn misfits<const C: usize, const P: usize>(
    arms: &[Arm<C>; 2],
    (parameters, step): (&[usize; P], &[f64]),
    inverse: &SMatrix<f64, P, P>,
) -> Option<[Misfit; 2]> {
    if arms.iter().any(|arm| arm.inverse == Matrix2::zeros()) {
        return None;
    }
    // Step and turn of either arm.
    let bent = Matrix4x2::new(1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, -1.0);
    let apart = Matrix4x2::new(1.0, 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 1.0);
    let mut normal = Matrix4::zeros();
    let mut inverses = Matrix4::zeros();
    let mut gradient = Vector4::zeros();
    let mut by = SMatrix::<f64, 4, P>::zeros();
    for (k, arm) in arms.iter().enumerate() {
        normal.fixed_view_mut::<2, 2>(2 * k, 2 * k).copy_from(&arm.normal);
        inverses.fixed_view_mut::<2, 2>(2 * k, 2 * k).copy_from(&arm.inverse);
        gradient.fixed_rows_mut::<2>(2 * k).copy_from(&arm.gradient(parameters, step));
        for i in 0..2 {
            (0..P).for_each(|p| by[(2 * k + i, p)] = arm.by_columns[(i, parameters[p])]);
        }
    }
    let taken = by * inverse * by.transpose();
    let without = |other: Matrix4x2<f64>| {
        let left = inverses - other * (other.transpose() * normal * other).try_inverse()? * other.transpose();
        Some(Misfit { chi_square: gradient.dot(&(left * gradient)), freedom: 2.0 - (left * taken).trace() })
    };
    Some([without(apart)?, without(bent)?])
}

impl Model {
    /// Sums of products over all pixels of the window.
    pub fn evaluate(&self, window: &Window) -> Evaluation<COLUMNS> {
        widest(
            #[inline(always)]
            || self.evaluate_lanes::<COLUMNS, ARM>(window),
        )
    }

    /// The same with the slopes of stray light, which is none yet.
    pub fn evaluate_with_stray(&self, window: &Window) -> Evaluation<STRAY_COLUMNS> {
        widest(
            #[inline(always)]
            || self.evaluate_lanes::<STRAY_COLUMNS, STRAY_ARM>(window),
        )
    }

    #[inline(always)]
    fn evaluate_lanes<const C: usize, const A: usize>(&self, window: &Window) -> Evaluation<C> {
        let mut total = self.at_crossing::<C>(&window.crossing);
        let none = Arm { normal: Matrix2::zeros(), inverse: Matrix2::zeros(), by_columns: SMatrix::zeros() };
        let mut arms = [[none; 2]; 2];
        for (k, both) in window.arms.iter().enumerate() {
            let (edge, light) = (Edge::of(self, k), Light::of(self));
            let map = self.arm_to_parameters(k);
            let map = &map[..map.len() + C - STRAY_COLUMNS];
            let mut sum = SMatrix::zeros();
            for ((groups, side), arm) in both.iter().zip([-1.0, 1.0]).zip(&mut arms[k]) {
                let mut products = Products::<A>::new();
                // No closure: one that is not inlined would be compiled for the narrowest registers.
                for group in &groups.groups {
                    along(&edge, &light, side, group, &mut products);
                }
                let sums = products.sums();
                *arm = by_itself(map, &sums);
                sum += sums;
            }
            add_mapped(&mut total, map, &sum);
        }
        let near_cost = total[(N, N)];
        for (sums, alike) in window.flat.iter().zip([-1.0, 1.0]) {
            let map = self.flat_to_parameters(alike);
            add_mapped(&mut total, &map[..map.len() + C - STRAY_COLUMNS], sums);
        }
        Evaluation { sums: total, near_cost, arms }
    }

    #[inline(always)]
    fn at_crossing<const C: usize>(&self, groups: &Groups) -> SMatrix<f64, C, C> {
        let crossing = Crossing::new(self);
        let mut products = Products::<C>::new();
        let mut columns = [[0.0; LANES]; C];
        for group in &groups.groups {
            if let Some((first, stray)) = columns.split_first_chunk_mut::<COLUMNS>() {
                crossing.columns(group, first);
                stray_columns(group, stray);
            }
            products.add(&columns);
        }
        products.sums()
    }

    /// The parameters' derivatives from the columns of [`along`].
    fn arm_to_parameters(&self, k: usize) -> [Share; 13] {
        let (sin, cos) = self.angles_rad[k].sin_cos();
        let bend = self.bend[k];
        [
            (0, 0, sin),
            (0, 1, -bend * cos),
            (1, 0, -cos),
            (1, 1, -bend * sin),
            (2 + k, 1, -1.0),
            (4 + k, 2, -1.0),
            (6, 3, 1.0),
            (7, 4, 1.0),
            (8, 5, 1.0),
            (9, 6, 1.0),
            (N, 7, 1.0),
            (COLUMNS, ARM, 1.0),
            (COLUMNS + 1, ARM + 1, 1.0),
        ]
    }

    /// The parameters' derivatives where E is `alike`, from `(1, x, y, grey)`.
    fn flat_to_parameters(&self, alike: f64) -> [Share; 14] {
        let reflected = self.level + self.half_contrast * alike;
        let (x, y) = (self.light_slope.x, self.light_slope.y);
        [
            (6, 0, 1.0),
            (6, 1, x),
            (6, 2, y),
            (7, 0, alike),
            (7, 1, alike * x),
            (7, 2, alike * y),
            (8, 1, reflected),
            (9, 2, reflected),
            (N, 0, -reflected),
            (N, 1, -reflected * x),
            (N, 2, -reflected * y),
            (N, 3, 1.0),
            (COLUMNS, 1, 1.0),
            (COLUMNS + 1, 2, 1.0),
        ]
    }
}

/// A parameter, a column, and how much of the column the derivative by the parameter holds.
type Share = (usize, usize, f64);

/// Adds the sums of the derivatives' products, from those of the columns that they are made of. Most shares are none,
/// so they are listed.
fn add_mapped<const C: usize, const A: usize>(to: &mut SMatrix<f64, C, C>, map: &[Share], sums: &SMatrix<f64, A, A>) {
    for &(row, a, share) in map {
        for &(column, b, other) in map {
            to[(row, column)] += share * other * sums[(a, b)];
        }
    }
}

/// On an arm of an edge, E is `side` times the edge's erf, and every derivative is a combination of: the derivative by
/// u, the same times the place along the edge, the same in blurs from it; light; light times E; x and y times what is
/// reflected; the residual.
#[inline(always)]
fn along<const A: usize>(edge: &Edge, light: &Light, side: f32, group: &Group, products: &mut Products<A>) {
    let across = edge.across(group);
    let Light { level, half_contrast, slope } = *light;
    let mut columns = [[0.0; LANES]; A];
    let Some((first, stray)) = columns.split_first_chunk_mut::<ARM>() else { return };
    let [by_u, by_angle, by_blur, lit, by_contrast, by_slope_x, by_slope_y, residual] = first;
    for l in 0..LANES {
        let (x, y, weight) = (group.x[l], group.y[l], group.weight[l]);
        lit[l] = weight * (1.0 + slope[0] * x + slope[1] * y);
        let pattern = side * across.value[l];
        let reflected = level + half_contrast * pattern;
        by_contrast[l] = lit[l] * pattern;
        by_slope_x[l] = weight * x * reflected;
        by_slope_y[l] = weight * y * reflected;
        residual[l] = weight * group.grey[l] - lit[l] * reflected;
    }
    for l in 0..LANES {
        by_u[l] = lit[l] * (half_contrast * side) * across.slope[l];
        by_angle[l] = by_u[l] * across.along[l];
        by_blur[l] = by_u[l] * across.z[l];
    }
    stray_columns(group, stray);
    products.add(&columns);
}

/// The columns of stray light that grows along x and along y, where there are any.
#[inline(always)]
fn stray_columns(group: &Group, columns: &mut [Lanes]) {
    if let [by_x, by_y] = columns {
        for l in 0..LANES {
            (by_x[l], by_y[l]) = (group.weight[l] * group.x[l], group.weight[l] * group.y[l]);
        }
    }
}

/// An arm by the products of [`along`]'s columns, of which the first two are the derivatives by its step and its turn.
/// One of a pixel or two, or of pixels that all lie as far from the crossing, does not tell the two apart: what is left
/// of their products is rounding.
fn by_itself<const C: usize, const A: usize>(map: &[Share], sums: &SMatrix<f64, A, A>) -> Arm<C> {
    let normal = sums.fixed_view::<2, 2>(0, 0).into_owned();
    let apart = 1.0 - normal.m12 * normal.m21 / (normal.m11 * normal.m22);
    let known = normal.cholesky().filter(|_| apart > LEAST_APART);
    let inverse = known.map_or(Matrix2::zeros(), |c| c.inverse());
    let mut by_columns = SMatrix::zeros();
    for &(to, column, share) in map {
        for i in 0..2 {
            by_columns[(i, to)] += share * sums[(i, column)];
        }
    }
    Arm { normal, inverse, by_columns }
}

#[cfg(test)]
impl Model {
    /// The grey value at a place.
    pub fn grey(&self, (x, y): (f64, f64)) -> f64 {
        let mut columns = [[0.0; LANES]; COLUMNS];
        Crossing::new(self).columns(&tests::group(x, y), &mut columns);
        (-columns[N][0]).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub fn group(x: f64, y: f64) -> Group {
        Group { x: [x as f32; LANES], y: [y as f32; LANES], grey: [0.0; LANES], weight: [1.0; LANES] }
    }

    #[test]
    fn an_arm_of_one_pixel_or_of_equal_ones_tells_nothing_by_itself() {
        let of = |pixels: &[f32]| {
            let mut sums = [0.0_f32; 3];
            for y in pixels {
                let (step, turn) = (0.37_f32, 0.37 * y);
                sums = [sums[0] + step * step, sums[1] + step * turn, sums[2] + turn * turn];
            }
            let [a, b, c] = sums.map(f64::from);
            by_itself::<COLUMNS, 2>(&[], &SMatrix::<f64, 2, 2>::new(a, b, b, c)).inverse
        };
        for k in 0..200 {
            let y = 2.0 + 0.037 * k as f32;
            assert_eq!((of(&[y]), of(&[y; 7])), (Matrix2::zeros(), Matrix2::zeros()), "{y}");
            // Pixels that are one apart tell a turn as far out as windows reach.
            assert!(of(&[y, y + 1.0]) != Matrix2::zeros(), "{y}");
        }
    }

    #[test]
    fn derivatives_match_central_differences() {
        type Change = fn(&mut Model, f64);
        let changes: [Change; N] = [
            |m, h| m.corner.x += h,
            |m, h| m.corner.y += h,
            |m, h| m.angles_rad[0] += h,
            |m, h| m.angles_rad[1] += h,
            |m, h| m.blur_px[0] += h,
            |m, h| m.blur_px[1] += h,
            |m, h| m.level += h,
            |m, h| m.half_contrast += h,
            |m, h| m.light_slope.x += h,
            |m, h| m.light_slope.y += h,
        ];
        for (x, y) in [(0.0, 0.0), (1.0, 0.5), (-2.0, 1.0), (0.4, -3.0)] {
            let mut columns = [[0.0; LANES]; COLUMNS];
            Crossing::new(&Model::example()).columns(&group(x, y), &mut columns);
            for (i, (change, column)) in changes.iter().zip(&columns).enumerate() {
                let h = 1e-3;
                let at = |h: f64| {
                    let mut changed = Model::example();
                    change(&mut changed, h);
                    changed.grey((x, y))
                };
                let numeric = (at(h) - at(-h)) / (2.0 * h);
                // The approximation of erf is good to 4e-7 of 70 grey values, over a step of 1e-3; the second-order
                // part of a bend's turn is left out of the derivative by angle.
                let derivative = f64::from(column[0]);
                assert!((numeric - derivative).abs() < 0.15 + 5e-3 * numeric.abs(), "{i} at {x},{y}: {numeric}");
            }
        }
    }

    #[test]
    fn pixels_far_from_an_edge_give_the_same_sums_by_the_shorter_way() {
        let model = Model::example();
        let places = |from: (f64, f64)| (0..40).map(move |i| (from.0 + f64::from(i % 8), from.1 + f64::from(i / 8)));
        let grey = |(x, y): (f64, f64)| (100.0 + 3.0 * x - y).rem_euclid(50.0);
        let all = |from: (f64, f64)| {
            let mut groups = Groups::default();
            places(from).for_each(|p| groups.push(p.0 as f32, p.1 as f32, grey(p) as f32));
            groups
        };
        let full = |from| model.evaluate(&Window { crossing: all(from), ..Window::default() }).sums;
        // The edges run to the right and down; u_1 grows downwards, u_2 to the left.
        let (mut right, mut up) = (Window::default(), Window::default());
        right.arms[0][0] = all((12.0, -1.0));
        up.arms[1][0] = all((-6.0, -16.0));
        let mut lower_right = Window::default();
        for p in places((15.0, 15.0)) {
            let v = nalgebra::Vector4::new(1.0, p.0, p.1, grey(p));
            lower_right.flat[0] += v * v.transpose();
        }
        for (from, window) in [((12.0, -1.0), right), ((-6.0, -16.0), up), ((15.0, 15.0), lower_right)] {
            let (long, short) = (full(from), model.evaluate(&window).sums);
            for (a, b) in (0..COLUMNS).flat_map(|a| (0..=a).map(move |b| (a, b))) {
                let scale = (long[(a, a)] * long[(b, b)]).sqrt().max(1.0);
                assert!((long[(a, b)] - short[(a, b)]).abs() < 1e-4 * scale, "{from:?} {a} {b}: {long} {short}");
            }
        }
    }
}
