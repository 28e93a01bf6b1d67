//! Sums of the products of columns, many pixels at a time.

use nalgebra::SMatrix;

use super::window::Lanes;

/// Sums that are kept side by side, so that the compiler makes vector loops of them.
const WIDTH: usize = 8;
/// Groups of pixels that are added up with seven digits: a total of so few is rounded hardly more than its terms are.
const GROUPS: usize = 8;

/// The sums of products of `C` columns so far.
pub struct Products<const C: usize> {
    sums: SMatrix<f64, C, C>,
    /// Of the last groups, below the diagonal and on it.
    latest: [[[f32; WIDTH]; C]; C],
    groups: usize,
}

impl<const C: usize> Products<C> {
    pub fn new() -> Products<C> {
        Products { sums: SMatrix::zeros(), latest: [[[0.0; WIDTH]; C]; C], groups: 0 }
    }

    /// Adds a group of pixels.
    #[inline(always)]
    pub fn add(&mut self, columns: &[Lanes; C]) {
        if self.groups == GROUPS {
            self.add_latest();
        }
        self.groups += 1;
        for a in 0..C {
            for b in 0..=a {
                // A group's own sum first: the sum so far is fetched and stored once.
                let mut sum = [0.0; WIDTH];
                for (va, vb) in columns[a].as_chunks::<WIDTH>().0.iter().zip(columns[b].as_chunks::<WIDTH>().0) {
                    for l in 0..WIDTH {
                        sum[l] += va[l] * vb[l];
                    }
                }
                for (latest, sum) in self.latest[a][b].iter_mut().zip(sum) {
                    *latest += sum;
                }
            }
        }
    }

    #[inline(always)]
    fn add_latest(&mut self) {
        for a in 0..C {
            for b in 0..=a {
                let [a0, a1, a2, a3, a4, a5, a6, a7] = std::mem::take(&mut self.latest[a][b]);
                self.sums[(a, b)] += f64::from(((a0 + a4) + (a1 + a5)) + ((a2 + a6) + (a3 + a7)));
            }
        }
        self.groups = 0;
    }

    /// The sums as a symmetric matrix.
    #[inline(always)]
    pub fn sums(mut self) -> SMatrix<f64, C, C> {
        self.add_latest();
        self.sums.fill_upper_triangle_with_lower_triangle();
        self.sums
    }
}

#[cfg(test)]
mod tests {
    use super::super::window::LANES;
    use super::*;

    #[test]
    fn sums_are_those_of_the_matrix() {
        let column = |c: usize| -> Lanes { std::array::from_fn(|l| (c * 7 + l * l) as f32 % 11.0 - 5.0) };
        let columns: [Lanes; 3] = std::array::from_fn(column);
        let mut products = Products::new();
        let groups = 2 * GROUPS + 3;
        (0..groups).for_each(|_| products.add(&columns));
        let matrix = SMatrix::<f64, LANES, 3>::from_fn(|l, c| columns[c][l].into());
        // Whole numbers: the sums are exact in any order.
        assert_eq!(products.sums(), groups as f64 * matrix.transpose() * matrix);
    }
}
