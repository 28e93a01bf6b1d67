//! What is known of lenses, picture centres and boards before any picture: weak, so that it decides only where pictures
//! do not.
//!
//! In: a rig to start from, and the size of the board. Out: expectations, each a sum of the shared numbers with a value
//! and a standard deviation, and their share of the normal equations. Hand-held pictures often leave two or three terms
//! of a lens open; without an expectation these run off and spoil what lies beside the boards. The widths are generous
//! for built cameras (27 public sets of webcams and phones keep within them), and next to nothing beside corners that
//! are measured well.

use nalgebra::{DMatrix, DVector};

use crate::imaging::Side;
use crate::stereo::model::board_shape;
use crate::stereo::model::{KnownLenses, Layout, Shared};
use crate::stereo::{Camera, Lens, Rig};

/// What distortion does at the corner of the picture, as shares of the corner's distance from the middle: k1, k2, k3.
const RADIAL_AT_CORNER: [f64; 3] = [0.2, 0.1, 0.05];
/// What the rational terms do there, k4, k5, k6: these and the radial ones are exchanged for each other, so that one of
/// the two is held.
const RATIONAL_AT_CORNER: [f64; 3] = [1.0, 1.0, 1.0];
/// Tangential distortion, p1 and p2.
const TANGENTIAL: f64 = 1e-3;
/// What a thin prism does, s1 to s4: as much as a lens off its axis.
const PRISM: f64 = 2e-3;
/// By how much a sensor is tilted, rad: more than any that is not meant to be.
const TILT_RAD: f64 = 0.05;
/// Focal lengths as shares of the picture's longer side, and by what factor most differ from it: 25 degrees across to
/// 80. So wide that it holds nothing that pictures tell; it keeps boards that all lie alike from a camera that has no
/// focal length at all.
const FOCAL_SHARE: f64 = 1.2;
const FOCAL_FACTOR: f64 = 2.0;
/// How far the picture's centre lies from its middle, as a share of the width.
const CENTRE_SHARE: f64 = 0.015;
/// By how much fx and fy differ; pixels whose sides differ by more than the second number are not meant to be square.
const ASPECT: f64 = 0.005;
const NOT_SQUARE: f64 = 0.03;
/// By how much two cameras of one make differ in focal length; cameras that differ by more than the second number are
/// of two makes.
const ALIKE: f64 = 0.01;
const TWO_MAKES: f64 = 0.05;
/// By how much a board bends, as a share of its diagonal.
pub const BOW_SHARE: f64 = 0.003;

/// A sum of shared numbers that is expected to have some value.
#[derive(Debug, Clone, PartialEq)]
struct Expectation {
    terms: Vec<(Number, f64)>,
    value: f64,
    sigma: f64,
    /// Whether it is the sum's logarithm that is expected, and its value and deviation are logarithms.
    logarithm: bool,
    /// Whether it counts beside the rational terms, too: what is known of a lens, not what lenses usually are.
    known: bool,
}

impl Expectation {
    /// What lenses and boards usually are, of a sum itself.
    fn usual(terms: Vec<(Number, f64)>, value: f64, sigma: f64) -> Expectation {
        Expectation { terms, value, sigma, logarithm: false, known: false }
    }
}

/// One of the shared numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Number {
    Camera(Side, usize),
    Shape(usize),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Priors {
    all: Vec<Expectation>,
    /// What the usual values of the terms of richer lenses weigh; see [`Priors::beside`].
    weight: f64,
    /// Whether the rational terms are held at zero, so that a lens has those after them only.
    rational_held: bool,
}

/// Their share of the normal equations, as that of a pair.
#[derive(Debug, Clone, PartialEq)]
pub struct Information {
    /// Shared by shared.
    pub matrix: DMatrix<f64>,
    /// Gradient of half the sum of squares.
    pub gradient: DVector<f64>,
    /// Half the sum of squares.
    pub cost: f64,
}

impl Priors {
    /// Nothing is expected.
    pub const NONE: Priors = Priors { all: Vec::new(), weight: 1.0, rational_held: false };

    /// What is expected of both cameras and a board with this diagonal.
    pub fn of_rig(start: &Rig, diagonal_mm: f64) -> Priors {
        let mut priors = Priors::NONE;
        priors.of_camera(Side::Left, &start.left);
        priors.of_camera(Side::Right, &start.right);
        let [left, right] = [&start.left, &start.right].map(|camera| (camera.fx * camera.fy).sqrt());
        if (left / right).ln().abs() < TWO_MAKES {
            let terms = vec![(Number::Camera(Side::Left, 0), 1.0), (Number::Camera(Side::Right, 0), -1.0)];
            priors.all.push(Expectation::usual(terms, 0.0, ALIKE * (left * right).sqrt()));
        }
        priors.of_board(diagonal_mm);
        priors
    }

    /// What is expected of one camera alone, as the left one, and a board with this diagonal.
    pub fn of_one_camera(start: &Camera, diagonal_mm: f64) -> Priors {
        let mut priors = Priors::NONE;
        priors.of_camera(Side::Left, start);
        priors.of_board(diagonal_mm);
        priors
    }

    /// The same with the rational terms held at zero: what a lens needs of the terms after these shows without them,
    /// where all together are not told apart.
    pub fn holding_rational(&self) -> Priors {
        Priors { rational_held: true, ..self.clone() }
    }

    /// The same beside corners that count so many times as much as the pairs bear out, as a variance: pairs that
    /// scatter by more than their corners do tell of the terms of richer lenses as much less, and what these usually
    /// are decides as much more; a sensor would else be tilted by five degrees to take up a hand that moved. The terms
    /// that all lenses have, the pairs tell for all that.
    pub fn beside(&self, scatter: f64) -> Priors {
        Priors { weight: scatter.max(1.0), ..self.clone() }
    }

    /// The same with what is known of some lenses in place of what lenses usually are.
    pub fn knowing(&self, known: &KnownLenses) -> Priors {
        let is_known = |(number, _): &(Number, f64)| match number {
            Number::Camera(side, _) => known.camera(*side).is_some(),
            Number::Shape(_) => false,
        };
        let mut priors = self.clone();
        priors.all.retain(|expectation| !expectation.terms.iter().all(is_known));
        let (numbers, whitener) = (known.numbers(), known.whitener());
        let values = &whitener * known.values();
        priors.all.extend((0..numbers.len()).map(|row| {
            let term =
                |(column, (side, at)): (usize, &(Side, usize))| (Number::Camera(*side, *at), whitener[(row, column)]);
            let terms = numbers.iter().enumerate().map(term).filter(|(_, by)| *by != 0.0).collect();
            Expectation { known: true, ..Expectation::usual(terms, values[row], 1.0) }
        }));
        priors
    }

    /// Whether lenses are known, not what lenses usually are.
    pub fn know_lenses(&self) -> bool {
        self.all.iter().any(|expectation| expectation.known)
    }

    /// Sum of the logarithms of the standard deviations of those numbers that a richer layout has and a simpler one has
    /// not.
    pub fn log_width(&self, richer: &Layout, simpler: &Layout) -> f64 {
        let free = |layout: &Layout, expectation: &&Expectation| {
            expectation.terms.iter().all(|(number, _)| self.place(layout, *number, expectation.known).is_some())
        };
        let added = self.all.iter().filter(|e| free(richer, e) && !free(simpler, e));
        added.map(|expectation| expectation.sigma.ln()).sum()
    }

    fn of_camera(&mut self, side: Side, camera: &Camera) {
        let (width, height) = (f64::from(camera.width), f64::from(camera.height));
        let focal = (camera.fx * camera.fy).sqrt();
        let corner = (0.5 * width / camera.fx).hypot(0.5 * height / camera.fy);
        let mut one = |at: usize, value: f64, sigma: f64| {
            self.all.push(Expectation::usual(vec![(Number::Camera(side, at), 1.0)], value, sigma));
        };
        one(2, 0.5 * (width - 1.0), CENTRE_SHARE * width);
        one(3, 0.5 * (height - 1.0), CENTRE_SHARE * width);
        for (places, shares) in [([4, 5, 8], RADIAL_AT_CORNER), ([9, 10, 11], RATIONAL_AT_CORNER)] {
            for ((at, power), share) in places.into_iter().zip([2, 4, 6]).zip(shares) {
                one(at, 0.0, share / corner.powi(power));
            }
        }
        one(6, 0.0, TANGENTIAL);
        one(7, 0.0, TANGENTIAL);
        (12..16).for_each(|at| one(at, 0.0, PRISM));
        (16..18).for_each(|at| one(at, 0.0, TILT_RAD));
        let (usual, factor) = ((FOCAL_SHARE * width.max(height)).ln(), FOCAL_FACTOR.ln());
        let terms = vec![(Number::Camera(side, 0), 1.0)];
        self.all.push(Expectation { logarithm: true, ..Expectation::usual(terms, usual, factor) });
        if (camera.fx / camera.fy).ln().abs() < NOT_SQUARE {
            let terms = vec![(Number::Camera(side, 0), 1.0), (Number::Camera(side, 1), -1.0)];
            self.all.push(Expectation::usual(terms, 0.0, ASPECT * focal));
        }
    }

    fn of_board(&mut self, diagonal_mm: f64) {
        let flat = |k| Expectation::usual(vec![(Number::Shape(k), 1.0)], 0.0, BOW_SHARE * diagonal_mm);
        self.all.extend((0..board_shape::NUMBERS).map(flat));
    }

    /// Their share of the normal equations. Expectations of numbers that are not free say nothing; nor do those of
    /// single distortion terms where the lens has the rational terms that these are exchanged for.
    pub fn information(&self, layout: &Layout, shared: &Shared) -> Information {
        /// Small enough to hold a number, and large enough for the equations.
        const HELD: f64 = 1e-6;
        let count = layout.count();
        let mut sum = Information { matrix: DMatrix::zeros(count, count), gradient: DVector::zeros(count), cost: 0.0 };
        if self.all.is_empty() {
            return sum;
        }
        let numbers = layout.numbers(shared);
        for expectation in &self.all {
            let placed = |(number, by): &(Number, f64)| Some((self.place(layout, *number, expectation.known)?, *by));
            let Some(terms) = expectation.terms.iter().map(placed).collect::<Option<Vec<_>>>() else { continue };
            let sum_of_terms = terms.iter().map(|(at, by)| by * numbers[*at]).sum::<f64>();
            let (said, slope) =
                if expectation.logarithm { (sum_of_terms.ln(), 1.0 / sum_of_terms) } else { (sum_of_terms, 1.0) };
            let off = said - expectation.value;
            // k4, k5 and k6; and all terms beyond the five that nearly all lenses need.
            let is_rational = |(number, _): &(Number, f64)| matches!(number, Number::Camera(_, 9..=11));
            let is_of_richer_lens = |(number, _): &(Number, f64)| matches!(number, Number::Camera(_, 9..));
            let held = self.rational_held && !expectation.known && expectation.terms.iter().any(is_rational);
            let sigma = if held { HELD * expectation.sigma } else { expectation.sigma };
            let of_richer = !expectation.known && expectation.terms.iter().all(is_of_richer_lens);
            let weight = if of_richer { self.weight } else { 1.0 } / (sigma * sigma);
            sum.cost += 0.5 * weight * off * off;
            for (i, a) in &terms {
                sum.gradient[*i] += weight * slope * a * off;
                for (j, b) in &terms {
                    sum.matrix[(*i, *j)] += weight * slope * slope * a * b;
                }
            }
        }
        sum
    }

    /// Where a number stands among those that are free and of which something is expected.
    fn place(&self, layout: &Layout, number: Number, known: bool) -> Option<usize> {
        match number {
            Number::Camera(side, at) => {
                let lens = layout.lens(side)?;
                let told = known || !(4..9).contains(&at) || lens <= Lens::Brown5 || self.rational_held;
                (told && at < layout.camera_count(side)).then(|| layout.camera_start(side) + at)
            }
            Number::Shape(k) => layout.shape.then(|| layout.shape_start() + k),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stereo::synthetic::World;

    #[test]
    fn the_gradient_is_the_slope_of_the_cost() {
        let rig = World::new(1, 1).rig;
        let priors = Priors::of_rig(&rig, 200.0);
        let layout = Layout::rig(Lens::Brown5, true);
        let shared = Shared { rig, shape_mm: [0.1, -0.2, 0.3] };
        let at = priors.information(&layout, &shared);
        for (i, name) in layout.names().iter().enumerate() {
            let cost = |h: f64| {
                let mut step = vec![0.0; layout.count()];
                step[i] = h;
                priors.information(&layout, &layout.step(&shared, &step)).cost
            };
            // Quadratic: central differences are exact but for rounding.
            let slope = (cost(1e-3) - cost(-1e-3)) / 2e-3;
            assert!((slope - at.gradient[i]).abs() < 1e-6 * (1.0 + slope.abs()), "{name}: {slope} {}", at.gradient[i]);
        }
    }

    #[test]
    fn beside_pairs_that_scatter_only_terms_of_richer_lenses_weigh_more() {
        let rig = World::new(1, 1).rig;
        let usual = Priors::of_rig(&rig, 200.0);
        let layout = Layout::rig(Lens::Tilted14, true);
        let shared = Shared { rig, shape_mm: [0.1, -0.2, 0.3] };
        let of = |priors: &Priors| priors.information(&layout, &shared).matrix.diagonal();
        let (once, beside) = (of(&usual), of(&usual.beside(9.0)));
        for (i, name) in layout.names().iter().enumerate().filter(|(i, _)| once[*i] > 0.0) {
            let richer = ["k4", "k5", "k6", "s1", "s2", "s3", "s4", "tau"].iter().any(|term| name.contains(term));
            assert!((beside[i] / once[i] - if richer { 9.0 } else { 1.0 }).abs() < 1e-9, "{name}");
        }
        assert_eq!(of(&usual.beside(0.5)), once);
    }

    #[test]
    fn pixels_that_are_not_square_and_cameras_of_two_makes_are_left_alone() {
        let mut rig = World::new(1, 1).rig;
        let layout = Layout::rig(Lens::Radial2, false);
        let told = |rig: &Rig| {
            let shared = Shared { rig: rig.clone(), shape_mm: [0.0; 3] };
            let matrix = Priors::of_rig(rig, 200.0).information(&layout, &shared).matrix;
            (matrix[(0, 1)] != 0.0, matrix[(0, layout.camera_start(Side::Right))] != 0.0)
        };
        assert_eq!(told(&rig), (true, true));
        rig.left.fy = 1.34 * rig.left.fx;
        rig.right.fx *= 1.4;
        rig.right.fy *= 1.4;
        assert_eq!(told(&rig), (false, false));
    }
}
