//! Sums of the products of all columns of a tall narrow matrix, `J' J`, rows coming in one after another.
//!
//! In: rows of at most [`WIDEST`] numbers. Out: the upper triangle of `J' J`. Method: four rows at a time, so that each
//! sum is fetched and stored once for four products. The order of summation depends on nothing but the rows, so that
//! the bits do not depend on threads or on the processor.

use crate::widest::widest;

/// Most columns: a camera's 18, the rig's six, the board's three, the pose's six and the residual, rounded up.
pub const WIDEST: usize = 36;

/// Rows that are summed at once.
const DEPTH: usize = 4;

/// The sums so far.
pub struct Products {
    width: usize,
    gathered: usize,
    rows: [[f64; WIDEST]; DEPTH],
    sums: [[f64; WIDEST]; WIDEST],
}

impl Products {
    /// No rows yet, of `width` columns; more than [`WIDEST`] are cut off.
    pub fn new(width: usize) -> Products {
        Products {
            // Whole vectors of four: the columns beyond are zero or unused.
            width: width.next_multiple_of(4).min(WIDEST),
            gathered: 0,
            rows: [[0.0; WIDEST]; DEPTH],
            sums: [[0.0; WIDEST]; WIDEST],
        }
    }

    /// The next two rows, to be filled in full; what stood there before is left in them.
    pub fn next_two(&mut self) -> &mut [[f64; WIDEST]] {
        if self.gathered + 2 > DEPTH {
            self.add();
        }
        self.gathered += 2;
        &mut self.rows[self.gathered - 2..self.gathered]
    }

    /// The element `(i, j)` of `J' J` for `i <= j`, once [`Products::finish`] was called.
    pub fn upper(&self, i: usize, j: usize) -> f64 {
        self.sums[i][j]
    }

    /// Adds the rows that still wait.
    pub fn finish(&mut self) {
        self.rows[self.gathered..].fill([0.0; WIDEST]);
        self.add();
    }

    fn add(&mut self) {
        widest(
            #[inline(always)]
            || self.add_rows(),
        );
    }

    #[inline(always)]
    fn add_rows(&mut self) {
        let [a, b, c, d] = &self.rows;
        for (i, sums) in self.sums[..self.width].iter_mut().enumerate() {
            let columns = i / 4 * 4..self.width;
            let (wa, wb, wc, wd) = (a[i], b[i], c[i], d[i]);
            let (a, b, c, d) = (&a[columns.clone()], &b[columns.clone()], &c[columns.clone()], &d[columns.clone()]);
            for ((((sum, a), b), c), d) in sums[columns].iter_mut().zip(a).zip(b).zip(c).zip(d) {
                *sum += (wa * a + wb * b) + (wc * c + wd * d);
            }
        }
        self.gathered = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_the_rows() {
        let value = |row: usize, column: usize| ((row * 7 + column * 13) % 11) as f64 - 5.0;
        let (width, rows) = (27, 150);
        let mut products = Products::new(width);
        for pair in 0..rows / 2 {
            for (k, row) in products.next_two().iter_mut().enumerate() {
                (0..width).for_each(|column| row[column] = value(2 * pair + k, column));
            }
        }
        products.finish();
        for i in 0..width {
            for j in i..width {
                // Small whole numbers: no rounding.
                assert_eq!(products.upper(i, j), (0..rows).map(|r| value(r, i) * value(r, j)).sum::<f64>());
            }
        }
    }
}
