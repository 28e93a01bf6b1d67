//! What lenses and warped boards do to the places of a flat board: terms, each a displacement that depends on the place.
//!
//! In: a place, as numbers or as numbers that change along a line. Out: the terms' displacements there, in families that belong together:
//! what a change of the homography does; radial terms about the picture's middle, each with what moving that middle does (Brown 1966);
//! polynomials of both coordinates.

use std::ops::{Add, Mul, Sub};

use nalgebra::Point2;

/// Terms that come together.
#[derive(Debug, Clone, Copy)]
pub enum Family {
    /// What a small change of the homography does: eight terms.
    Projective,
    /// Along the radius, by this power of its square.
    Radial(u32),
    /// What a shift of the middle does to the radial term of this power: two terms.
    Shifted(u32),
    /// All powers of both coordinates whose sum is this, in each direction.
    Degree(u32),
}

/// In the order in which they are tried: those of common lenses first.
pub const FAMILIES: [Family; 12] = [
    Family::Projective,
    Family::Radial(1),
    Family::Shifted(1),
    Family::Radial(2),
    Family::Shifted(2),
    Family::Radial(3),
    Family::Degree(2),
    Family::Degree(3),
    Family::Degree(4),
    Family::Degree(5),
    Family::Degree(6),
    Family::Degree(7),
];

/// How many of the families are what a lens does.
pub const LENS: usize = 6;

/// So many terms are those of [`Family::Projective`].
pub const PROJECTIVE: usize = 8;

/// By how much of each term, of the first families, a place is moved in all.
pub fn displacement<V: Value>(shares: &[f64], middle: &Point2<f64>, place: [V; 2]) -> [V; 2] {
    let mut shares = shares.iter();
    let mut sum = [V::constant(0.0); 2];
    for family in FAMILIES {
        if shares.len() == 0 {
            break;
        }
        for (term, &share) in family.at(middle, place).into_iter().zip(&mut shares) {
            sum = [0, 1].map(|k| sum[k] + V::constant(share) * term[k]);
        }
    }
    sum
}

impl Family {
    /// The displacements of its terms at a place, for a lens whose middle is there.
    pub fn at<V: Value>(self, middle: &Point2<f64>, [x, y]: [V; 2]) -> Vec<[V; 2]> {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let (u, v) = (x - V::constant(middle.x), y - V::constant(middle.y));
        let r2 = u * u + v * v;
        match self {
            Family::Projective => {
                let affine = [[one, zero], [zero, one], [x, zero], [zero, x], [y, zero], [zero, y]];
                affine.into_iter().chain([[x * x, x * y], [x * y, y * y]]).collect()
            }
            Family::Radial(n) => vec![[u * power(r2, n), v * power(r2, n)]],
            Family::Shifted(n) => {
                let (radial, slope) = (power(r2, n), V::constant(2.0 * f64::from(n)) * power(r2, n - 1));
                vec![[radial + slope * u * u, slope * u * v], [slope * u * v, radial + slope * v * v]]
            }
            Family::Degree(n) => {
                let powers = (0..=n).map(|j| power(x, n - j) * power(y, j));
                powers.flat_map(|p| [[p, zero], [zero, p]]).collect()
            }
        }
    }
}

fn power<V: Value>(value: V, n: u32) -> V {
    (0..n).fold(V::constant(1.0), |power, _| power * value)
}

/// What terms are made of: a number, or one that changes along a line.
pub trait Value: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// A number that is the same everywhere.
    fn constant(value: f64) -> Self;
}

impl Value for f64 {
    fn constant(value: f64) -> f64 {
        value
    }
}

/// A number that changes along a line, with its derivatives by the place on the line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Along {
    /// The number.
    pub value: f64,
    /// Its first derivative.
    pub first: f64,
    /// Its second derivative.
    pub second: f64,
}

impl Value for Along {
    fn constant(value: f64) -> Along {
        Along { value, first: 0.0, second: 0.0 }
    }
}

impl Add for Along {
    type Output = Along;

    fn add(self, b: Along) -> Along {
        Along { value: self.value + b.value, first: self.first + b.first, second: self.second + b.second }
    }
}

impl Sub for Along {
    type Output = Along;

    fn sub(self, b: Along) -> Along {
        Along { value: self.value - b.value, first: self.first - b.first, second: self.second - b.second }
    }
}

impl Mul for Along {
    type Output = Along;

    fn mul(self, b: Along) -> Along {
        Along {
            value: self.value * b.value,
            first: self.first * b.value + self.value * b.first,
            second: self.second * b.value + 2.0 * self.first * b.first + self.value * b.second,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_along_a_line_are_those_of_the_terms() {
        let (middle, from, t, h) = (Point2::new(0.3, -0.2), [0.4, 0.7], [0.6, -0.8], 1e-4);
        for family in FAMILIES {
            let at = |s: f64| family.at(&middle, [from[0] + s * t[0], from[1] + s * t[1]]);
            let along = family.at(&middle, [0, 1].map(|k| Along { value: from[k], first: t[k], second: 0.0 }));
            for (((before, here), after), found) in at(-h).iter().zip(at(0.0)).zip(at(h)).zip(along) {
                for k in 0..2 {
                    let first = (after[k] - before[k]) / (2.0 * h);
                    let second = (after[k] - 2.0 * here[k] + before[k]) / (h * h);
                    assert_eq!(found[k].value, here[k], "{family:?}");
                    assert!((found[k].first - first).abs() < 1e-5, "{family:?}");
                    assert!((found[k].second - second).abs() < 1e-4, "{family:?}");
                }
            }
        }
    }

    #[test]
    fn a_shifted_middle_is_told_by_its_terms() {
        let (place, d) = ([0.5, -0.3], 1e-4);
        for n in [1, 2] {
            let terms = Family::Shifted(n).at(&Point2::origin(), place);
            for axis in 0..2 {
                let mut middle = Point2::origin();
                middle[axis] -= d;
                let [moved, here] = [middle, Point2::origin()].map(|m| Family::Radial(n).at(&m, place)[0]);
                for k in 0..2 {
                    assert!(((moved[k] - here[k]) / d - terms[axis][k]).abs() < 1e-3);
                }
            }
        }
    }
}
