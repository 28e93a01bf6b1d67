//! Which parameters the poses can determine: base parameters by rank-revealing QR, and the paper's elimination.
//!
//! In: the Jacobian, a column a parameter in mm and mrad (not normalised: a column's length is what the parameter can
//! do to the data). Zero columns go first. Of the rest, Householder QR with column pivoting keeps the columns that
//! stand for themselves; each other one is a combination of those, and they are named together, as in `d_2 + d_3 +
//! d_4`. Source of the observability indices: Sun and Hollerbach, "Observability index selection for robot calibration"
//! (2008).

use nalgebra::{DMatrix, DVector};

use crate::robot::Parameter;

/// Coefficients below this are not written into a group's name.
const NAMED: f64 = 1e-3;

/// Those below this share no correction that matters.
pub const NEGLIGIBLE: f64 = 0.02;

/// Columns within this of the longest count as equally long, and the first of them is taken: names don't depend on
/// rounding.
const TIE: f64 = 1e-9;

/// The parameters that a Jacobian determines.
#[derive(Debug, Clone, PartialEq)]
pub struct Base {
    /// Indices of the base parameters, ascending.
    pub free: Vec<usize>,
    /// Indices of the parameters that move nothing.
    pub zero: Vec<usize>,
    /// Indices of the parameters that act as combinations of base parameters.
    pub dependent: Vec<usize>,
    /// `J_dependent = J_free * coefficients`.
    pub coefficients: DMatrix<f64>,
    /// Singular values of the base columns, descending.
    pub singular_values: Vec<f64>,
}

/// How well the base parameters are seen.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Observability {
    /// Geometric mean of the singular values over the root of the number of poses.
    #[serde(rename = "O1")]
    pub o1: f64,
    /// Smallest over largest singular value.
    #[serde(rename = "O2")]
    pub o2: f64,
    /// Smallest singular value.
    #[serde(rename = "O3")]
    pub o3: f64,
    /// Its square over the largest.
    #[serde(rename = "O4")]
    pub o4: f64,
    /// Inverse of the sum of the inverses.
    #[serde(rename = "O5")]
    pub o5: f64,
}

/// A sum of [`Base::sum`] in words.
pub fn sum_name(sum: &[(usize, f64)], names: &[String]) -> String {
    let mut text = String::new();
    for &(parameter, coefficient) in sum {
        if !text.is_empty() {
            text.push_str(if coefficient < 0.0 { " - " } else { " + " });
        }
        if (coefficient.abs() - 1.0).abs() >= NAMED {
            text.push_str(&format!("{:.3} ", coefficient.abs()));
        }
        text.push_str(&names[parameter]);
    }
    text
}

impl Base {
    /// Of a Jacobian; `tolerance` is relative to its longest column.
    pub fn new(jacobian: &DMatrix<f64>, tolerance: f64) -> Base {
        let n = jacobian.ncols();
        let norms: Vec<f64> = jacobian.column_iter().map(|c| c.norm()).collect();
        let threshold = tolerance * norms.iter().copied().fold(0.0, f64::max);
        let (zero, alive): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| norms[i] <= threshold);
        let mut work = jacobian.select_columns(&alive);
        let (order, rank) = pivoted(&mut work, threshold);
        let mut free: Vec<usize> = order[..rank].iter().map(|&c| alive[c]).collect();
        free.sort_unstable();
        Base::of_free(jacobian, free, zero)
    }

    /// With these base parameters.
    fn of_free(jacobian: &DMatrix<f64>, free: Vec<usize>, zero: Vec<usize>) -> Base {
        let is_dependent = |i: &usize| !free.contains(i) && !zero.contains(i);
        let dependent: Vec<usize> = (0..jacobian.ncols()).filter(is_dependent).collect();
        let coefficients = combinations(jacobian, &free, &dependent);
        let singular_values = singular_values(jacobian, &free);
        Base { free, zero, dependent, coefficients, singular_values }
    }

    /// The paper's way (section 3.1): zero columns go, then, while two columns are as good as parallel or the rest
    /// lacks rank, the one with the largest correlation with another; of a pair the later goes. It cannot see a
    /// dependence of three columns before the last two of it correlate, so it may drop more than it must.
    pub fn by_correlation(jacobian: &DMatrix<f64>, tolerance: f64) -> Base {
        let reference = Base::new(jacobian, tolerance);
        let rank = reference.free.len();
        let mut kept: Vec<usize> = (0..jacobian.ncols()).filter(|i| !reference.zero.contains(i)).collect();
        while kept.len() > rank {
            let mut worst = (0.0, kept.len() - 1);
            for a in 0..kept.len() {
                for b in a + 1..kept.len() {
                    let (u, v) = (jacobian.column(kept[a]), jacobian.column(kept[b]));
                    let correlation = u.dot(&v).abs() / (u.norm() * v.norm());
                    if correlation > worst.0 + TIE {
                        worst = (correlation, b);
                    }
                }
            }
            kept.remove(worst.1);
        }
        Base::of_free(jacobian, kept, reference.zero)
    }

    /// The base parameters of a robot whose parameters are off by these.
    pub fn coordinates(&self, offsets: &[f64]) -> Vec<f64> {
        let of_others = |row: usize| -> f64 {
            self.dependent.iter().enumerate().map(|(c, &i)| self.coefficients[(row, c)] * offsets[i]).sum()
        };
        self.free.iter().enumerate().map(|(row, &i)| offsets[i] + of_others(row)).collect()
    }

    /// Number of base parameters.
    pub fn rank(&self) -> usize {
        self.free.len()
    }

    /// Largest over smallest singular value of the base columns; `None` without columns.
    pub fn condition(&self) -> Option<f64> {
        Some(self.singular_values.first()? / self.singular_values.last()?)
    }

    /// A base parameter by its place among them, and the parameters that act like it by at least such a share: what is
    /// determined is the sum of their corrections, each times its coefficient.
    pub fn sum(&self, row: usize, least: f64) -> Vec<(usize, f64)> {
        let others =
            self.dependent.iter().enumerate().map(|(column, &other)| (other, self.coefficients[(row, column)]));
        std::iter::once((self.free[row], 1.0)).chain(others.filter(|(_, c)| c.abs() >= least)).collect()
    }

    /// A correction of such a sum in words and the file's unit: `d_2 + d_3 + d_4 +20.4 mm`.
    pub fn said(&self, row: usize, least: f64, parameters: &[Parameter], amount: f64) -> String {
        let names: Vec<String> = parameters.iter().map(|p| p.name()).collect();
        let (unit, factor) = parameters[self.free[row]].file_unit();
        format!("{} {:+.1} {unit}", sum_name(&self.sum(row, least), &names), factor * amount)
    }

    /// Each base parameter that stands for others too, with them: `d_2 + d_3 + d_4`, `theta_6 - 2.5 v_x`.
    pub fn groups(&self, names: &[String]) -> Vec<String> {
        let sums = (0..self.free.len()).map(|row| self.sum(row, NAMED)).filter(|sum| sum.len() > 1);
        sums.map(|sum| sum_name(&sum, names)).collect()
    }

    /// O1 to O5 for so many poses; `None` without columns.
    pub fn observability(&self, poses: usize) -> Option<Observability> {
        let s = &self.singular_values;
        let (largest, smallest) = (*s.first()?, *s.last()?);
        let mean_log = s.iter().map(|v| v.ln()).sum::<f64>() / s.len() as f64;
        Some(Observability {
            o1: mean_log.exp() / (poses.max(1) as f64).sqrt(),
            o2: smallest / largest,
            o3: smallest,
            o4: smallest * smallest / largest,
            o5: 1.0 / s.iter().map(|v| 1.0 / v).sum::<f64>(),
        })
    }
}

/// Householder QR with column pivoting, in place. Returns the order of the columns and how many stand for themselves.
fn pivoted(work: &mut DMatrix<f64>, threshold: f64) -> (Vec<usize>, usize) {
    let (m, n) = work.shape();
    let mut order: Vec<usize> = (0..n).collect();
    for k in 0..n.min(m) {
        let norms: Vec<f64> = (k..n).map(|c| work.view((k, c), (m - k, 1)).norm()).collect();
        let longest = norms.iter().copied().fold(0.0, f64::max);
        if longest <= threshold {
            return (order, k);
        }
        // Among equals the parameter that comes first in the robot's own order.
        let pivot = (k..n).filter(|&c| norms[c - k] >= longest * (1.0 - TIE)).min_by_key(|&c| order[c]).unwrap_or(k);
        work.swap_columns(k, pivot);
        order.swap(k, pivot);
        let mut axis: DVector<f64> = work.view((k, k), (m - k, 1)).column(0).into_owned();
        axis[0] += if axis[0] < 0.0 { -axis.norm() } else { axis.norm() };
        let square = axis.norm_squared();
        for c in k..n {
            let factor = 2.0 * axis.dot(&work.view((k, c), (m - k, 1)).column(0)) / square;
            for r in 0..m - k {
                work[(k + r, c)] -= factor * axis[r];
            }
        }
    }
    (order, n.min(m))
}

fn combinations(jacobian: &DMatrix<f64>, free: &[usize], dependent: &[usize]) -> DMatrix<f64> {
    if free.is_empty() || dependent.is_empty() {
        return DMatrix::zeros(free.len(), dependent.len());
    }
    let qr = jacobian.select_columns(free).qr();
    let mut rhs = jacobian.select_columns(dependent);
    qr.q_tr_mul(&mut rhs);
    let top = rhs.rows(0, free.len()).into_owned();
    qr.r().solve_upper_triangular(&top).unwrap_or_else(|| DMatrix::zeros(free.len(), dependent.len()))
}

fn singular_values(jacobian: &DMatrix<f64>, free: &[usize]) -> Vec<f64> {
    if free.is_empty() {
        return Vec::new();
    }
    let reduced = jacobian.select_columns(free).qr().r();
    let mut values: Vec<f64> = reduced.singular_values().iter().copied().collect();
    values.sort_by(|a, b| b.total_cmp(a));
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(n: usize) -> Vec<String> {
        (0..n).map(|i| format!("x{i}")).collect()
    }

    #[test]
    fn equal_columns_are_one_group_under_the_first_name() {
        let jacobian = DMatrix::from_row_slice(3, 4, &[0.0, 1.0, 2.0, 1.0, 0.0, 3.0, 1.0, 3.0, 0.0, 1.0, -1.0, 1.0]);
        let base = Base::new(&jacobian, 1e-9);
        assert_eq!((base.free.as_slice(), base.zero.as_slice()), ([1, 2].as_slice(), [0].as_slice()));
        assert_eq!(base.groups(&names(4)), ["x1 + x3"]);
        let paper = Base::by_correlation(&jacobian, 1e-9);
        assert_eq!((paper.free, paper.dependent), (vec![1, 2], vec![3]));
    }

    #[test]
    fn a_combination_of_two_names_both() {
        let jacobian = DMatrix::from_row_slice(3, 3, &[4.0, 0.0, 2.0, 0.0, 3.0, -3.0, 0.0, 0.0, 0.0]);
        let base = Base::new(&jacobian, 1e-9);
        assert_eq!(base.groups(&names(3)), ["x0 + 0.500 x2", "x1 - x2"]);
    }

    #[test]
    fn indices_of_a_diagonal_are_its_entries() {
        let base = Base::new(&DMatrix::from_diagonal(&DVector::from_vec(vec![4.0, 1.0])), 1e-9);
        let o = base.observability(4).unwrap();
        assert!((o.o1 - 1.0).abs() < 1e-12 && (o.o2 - 0.25).abs() < 1e-12 && (o.o3 - 1.0).abs() < 1e-12);
        assert!((o.o4 - 0.25).abs() < 1e-12 && (o.o5 - 0.8).abs() < 1e-12);
        assert_eq!(Base::new(&DMatrix::zeros(3, 2), 1e-9).rank(), 0);
    }
}
