//! Sums of the products of columns, many pixels at a time.

use nalgebra::SMatrix;

use super::window::Lanes;

/// Sums that are kept side by side, so that the compiler makes vector loops of them.
const WIDTH: usize = 8;

/// The sums of products of `C` columns so far.
pub struct Products<const C: usize> {
    sums: [[[f64; WIDTH]; C]; C],
}

impl<const C: usize> Products<C> {
    /// Nothing yet.
    pub fn new() -> Products<C> {
        Products { sums: [[[0.0; WIDTH]; C]; C] }
    }

    /// Adds a group of pixels.
    #[inline(always)]
    pub fn add(&mut self, columns: &[Lanes; C]) {
        for a in 0..C {
            for b in 0..=a {
                // A group's own sum first: the sum so far is fetched and stored once.
                let mut sum = [0.0; WIDTH];
                for (va, vb) in columns[a].chunks_exact(WIDTH).zip(columns[b].chunks_exact(WIDTH)) {
                    for ((sum, va), vb) in sum.iter_mut().zip(va).zip(vb) {
                        *sum += va * vb;
                    }
                }
                for (total, sum) in self.sums[a][b].iter_mut().zip(sum) {
                    *total += sum;
                }
            }
        }
    }

    /// The sums as a symmetric matrix.
    pub fn sums(&self) -> SMatrix<f64, C, C> {
        SMatrix::from_fn(|a, b| self.sums[a.max(b)][a.min(b)].iter().sum())
    }
}

#[cfg(test)]
mod tests {
    use super::super::window::LANES;
    use super::*;

    #[test]
    fn sums_are_those_of_the_matrix() {
        let column = |c: usize| -> Lanes { std::array::from_fn(|l| (c * 7 + l * l) as f64 % 11.0 - 5.0) };
        let columns: [Lanes; 3] = std::array::from_fn(column);
        let mut products = Products::new();
        products.add(&columns);
        products.add(&columns);
        let matrix = SMatrix::<f64, LANES, 3>::from_fn(|l, c| columns[c][l]);
        // Whole numbers: the sums are exact in any order.
        assert_eq!(products.sums(), 2.0 * matrix.transpose() * matrix);
    }
}
