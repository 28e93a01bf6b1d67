//! How large residuals are: the size of a row as that of one normal number, and the scatter that explains them.
//!
//! In: residuals before whitening. Out: sizes of rows, their robust standard deviation, the scatter at which the white sum of squares
//! equals the degrees of freedom.

use crate::identify::residuals::eliminate::Raw;
use crate::identify::residuals::rows::Rows;
use crate::identify::residuals::weights::Scatter;

/// Least scatter, mm and rad: far below any instrument; keeps weights finite for exact data.
pub(super) const LEAST_MM: f64 = 1e-7;
const LEAST_RAD: f64 = 1e-10;

/// Stated covariances count as too large where the residuals ask for less than this share of them.
const OVERSTATED: f64 = 0.7;

/// White size of each row's residual, brought to the size of one normal number; zero for rows without one.
pub fn sizes(raw: &[(usize, f64, Raw)], scatter: &Scatter, count: usize) -> Vec<f64> {
    let mut squares = vec![0.0; count];
    for (row, _, raw) in raw {
        let square = match raw {
            Raw::Length(r, variance, times) => {
                r * r / (variance * scatter.stated + times * scatter.point_mm * scatter.point_mm)
            }
            Raw::Point(r, covariance) => as_one_number(whitened(r, covariance, scatter)),
            Raw::Turn(_) => continue,
        };
        squares[*row] = f64::max(squares[*row], square);
    }
    squares.into_iter().map(f64::sqrt).collect()
}

fn whitened(r: &nalgebra::Vector3<f64>, covariance: &nalgebra::Matrix3<f64>, scatter: &Scatter) -> f64 {
    scatter.total(covariance).cholesky().map_or(f64::INFINITY, |c| r.dot(&c.solve(r)))
}

/// A chi-squared of three degrees of freedom as one of a single degree that is exceeded as often (Wilson and Hilferty, 1931).
pub(super) fn as_one_number(square: f64) -> f64 {
    let (three, one) = (2.0 / 27.0, 2.0 / 9.0);
    let z = ((square / 3.0).cbrt() - (1.0 - three)) / f64::sqrt(three);
    // Not zero: a residual that is very small is still one.
    (1.0 - one + z * f64::sqrt(one)).max(1e-3).powi(3)
}

/// Robust standard deviation of the sizes of these rows: their median over that of a normal number's absolute value.
pub fn median_size(sizes: &[f64], rows: &[usize]) -> f64 {
    let mut sorted: Vec<f64> = rows.iter().map(|&r| sizes[r]).filter(|s| *s > 0.0).collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0) / 0.6745
}

/// The scatter at which the white sum of squares equals the degrees of freedom (Pearson's equation); for points and orientations
/// apart. Covariances that are larger than what was seen are taken down.
pub(super) fn estimate_scatter(rows: &Rows, offsets: &[f64], effective: f64, before: Scatter) -> Scatter {
    let raw = rows.raw(offsets);
    let turns: Vec<f64> =
        raw.iter().filter_map(|(_, _, r)| if let Raw::Turn(t) = r { Some(t.norm_squared()) } else { None }).collect();
    let total: f64 = raw.iter().map(|(_, _, r)| if matches!(r, Raw::Length(..)) { 1.0 } else { 3.0 }).sum();
    // Each number loses the same share to parameters and placements.
    let share = ((rows.count() as f64 - effective) / total.max(1.0)).max(1.0 / total.max(1.0));
    let sum = |scatter: &Scatter| -> f64 {
        raw.iter()
            .map(|(_, w, raw)| match raw {
                Raw::Length(r, variance, times) => {
                    w * w * r * r / (variance * scatter.stated + times * scatter.point_mm * scatter.point_mm)
                }
                Raw::Point(r, covariance) => w * w * whitened(r, covariance, scatter),
                Raw::Turn(_) => 0.0,
            })
            .sum()
    };
    let wanted = share * (total - 3.0 * turns.len() as f64);
    let turn_square = turns.iter().sum::<f64>() / (3.0 * share * turns.len().max(1) as f64);
    let mut scatter = Scatter {
        point_mm: LEAST_MM,
        rotation_rad: if turns.is_empty() { before.rotation_rad } else { turn_square.sqrt().max(LEAST_RAD) },
        stated: 1.0,
    };
    let least = sum(&scatter);
    if least <= wanted {
        if least < OVERSTATED * wanted {
            scatter.stated = (least / wanted).max(1e-12);
        }
        return scatter;
    }
    let (mut low, mut high) = (LEAST_MM, 1e5);
    for _ in 0..80 {
        scatter.point_mm = f64::sqrt(low * high);
        if sum(&scatter) > wanted { low = scatter.point_mm } else { high = scatter.point_mm }
    }
    scatter
}
