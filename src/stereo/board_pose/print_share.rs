//! What the calibration board's own print does to the calibration.
//!
//! A crossing that is off its drawing is off in every pair, so that more pairs do not average it away; a bundle that
//! takes every corner for independent says a covariance that is too small. In: a calibration's views and values. Out:
//! how far the board's crossings deviate, and the covariance of the shared numbers with that in it. Method: the score
//! of each crossing's place at the minimum, in units of what the corners say of it, exceeds chance by the print (a
//! variance component by moments); the print then goes through the normal equations to the shared numbers. Windows see
//! a part of each crossing's deviation and of its neighbours' (`window`): what is smooth over the board reaches the
//! lens and the rig whole, though crossings are seen to scatter less than they do.

use nalgebra::{DMatrix, DVector, Matrix2, Point3, Vector2, Vector3};

use crate::geometry::Transform;
use crate::imaging::Board;
use crate::stereo::board_pose::solve::pose_block::{CrossingSums, Eliminated, PoseBlock, Scene};
use crate::stereo::board_pose::solve::totals::Totals;
use crate::stereo::board_pose::solve::window::{SeenShares, Window};
use crate::stereo::data::{Noise, View, in_use};
use crate::stereo::model::board_shape::{height_mm, lift};
use crate::stereo::model::{Layout, Values};
use crate::stereo::solve::uncertainty::invert;
use crate::stereo::solve::{Loss, Problem, Solved};
use crate::stereo::triangulate::{RIG_NUMBERS, rig_number};

/// The print of a calibration board, and what it does.
#[derive(Debug, Clone, PartialEq)]
pub struct PrintShare {
    /// The corners' own noise, without the print.
    pub own_noise: Noise,
    /// Covariance of the shared numbers, in the layout's order: the corners' own noise and the print.
    pub covariance: DMatrix<f64>,
    /// Variance of the shared numbers over what it were if all scatter were the corners' own, the mean over them; at
    /// least one.
    pub excess: f64,
}

/// Which of the rig's numbers each shared number that comes first in the layout is.
pub(super) fn rig_basis(layout: &Layout) -> DMatrix<f64> {
    let numbers: Vec<usize> = layout.names().iter().filter_map(|name| rig_number(name)).collect();
    DMatrix::from_fn(RIG_NUMBERS, numbers.len(), |number, column| f64::from(numbers[column] == number))
}

/// Sums over the pairs of a calibration, whose crossings are where its board's shape puts them; `each` gets every
/// pair's parts. `basis`: see [`rig_basis`].
pub(super) fn totals_of_pairs(
    views: &[View],
    values: &Values,
    board: &Board,
    basis: &DMatrix<f64>,
    mut each: impl FnMut(PoseBlock, Eliminated),
) -> Option<Totals> {
    let shape = &values.shared.shape_mm;
    let height = |at: Point3<f64>| Vector3::new(0.0, 0.0, height_mm(&lift(board, &at), shape));
    let scene = Scene::new(values.shared.rig.clone(), board, &board.corners_mm().map(height).collect::<Vec<_>>());
    let pairs: Vec<_> = views.iter().zip(&values.poses).collect();
    let block = |&(view, pose): &(&View, &Transform)| PoseBlock::of(&scene, pose, view, Loss::Squared);
    Totals::of(&pairs, (basis, scene.crossings.len()), block, |_, block, part| each(block, part))
}

/// Finds the print. `None` where the views do not determine the shared numbers.
pub fn print_share(solved: &Solved, board: &Board, layout: &Layout) -> Option<PrintShare> {
    let Problem { views, values, priors } = &solved.problem;
    let (noise, inflation) = (&solved.noise, solved.inflation());
    let names = layout.names();
    let basis = rig_basis(layout);
    let rig_count = basis.ncols();
    let seen: Vec<[SeenShares; 2]> =
        Window::means(board, views).iter().map(|window| [0, 1].map(|axis| window.shares(axis))).collect();
    // What the corners say of their crossings' places in the plane, summed; and how many numbers they are.
    let mut told = 0.0;
    let in_plane = |c: &CrossingSums| c.own[(0, 0)] + c.own[(1, 1)];
    let add = |block: PoseBlock, _| told += block.shared.crossings.iter().map(in_plane).sum::<f64>();
    let totals = totals_of_pairs(views, values, board, &basis, add)?;
    told *= usual_variance(&seen);
    let numbers = 2.0 * in_use(views).count() as f64;
    let variance = print_variance(&totals, &seen, rig_count, told / numbers.max(1.0));
    // The difference of two large numbers where the print is most of it; but pixels scatter corners as much as the
    // refinement says.
    let stated = noise.stated_share(views);
    let own_share = (1.0 - variance * told / numbers).max(stated);
    // The board's paraboloids are heights of its crossings.
    let mut to_shared = DMatrix::zeros(totals.gradient.len(), names.len());
    for i in 0..rig_count {
        to_shared[(i, i)] = 1.0;
    }
    for (k, at) in board.corners_mm().enumerate() {
        for (column, by) in (rig_count..names.len()).zip(lift(board, &at)) {
            to_shared[(rig_count + 3 * k + 2, column)] = by;
        }
    }
    let by_all = to_shared.tr_mul(&totals.matrix);
    let inverse = invert(&(&by_all * &to_shared + priors.information(layout, &values.shared).matrix))?;
    let by_print = &inverse * &by_all;
    let mut covariance = &inverse * (own_share * inflation);
    let add = |column: DVector<f64>| covariance.ger(variance, &column, &column, 1.0);
    by_deviations(&by_print, &seen, rig_count).into_iter().for_each(add);
    let excess = (&by_all * to_shared).component_mul(&covariance).sum() / (inflation * names.len() as f64);
    let own_noise = noise.of_share(own_share, stated);
    Some(PrintShare { own_noise, covariance, excess: excess.max(1.0) })
}

/// Mean variance of what windows see of a crossing's coordinate, for a unit variance of the deviations.
fn usual_variance(seen: &[[SeenShares; 2]]) -> f64 {
    let of = |shares: &SeenShares| shares.iter().map(|(_, share)| share * share).sum::<f64>();
    seen.iter().flatten().map(of).sum::<f64>() / (2 * seen.len()) as f64
}

/// A matrix with a column for each coordinate of each crossing, from `first` on and three a crossing, as columns for
/// each independent deviation in the plane: those of the crossings, then those at the rim. `seen` is what windows see
/// of them, for each crossing, in x and y.
fn by_deviations(matrix: &DMatrix<f64>, seen: &[[SeenShares; 2]], first: usize) -> Vec<DVector<f64>> {
    let mut columns = vec![DVector::zeros(matrix.nrows()); 2 * seen.len()];
    for (k, of_crossing) in seen.iter().enumerate() {
        for (axis, shares) in of_crossing.iter().enumerate() {
            let column = matrix.column(first + 3 * k + axis);
            for (from, share) in shares.iter().filter(|(_, share)| *share != 0.0) {
                match from {
                    Some(j) => columns[2 * j + axis].axpy(*share, &column, 1.0),
                    None => columns.push(column * *share),
                }
            }
        }
    }
    columns
}

/// Variance of a crossing's coordinate, mm^2. The expected sum of squared scores is a straight line in it; `chance` is
/// what the corners say of what is seen of their crossings, a number, the mean.
fn print_variance(totals: &Totals, seen: &[[SeenShares; 2]], rig_count: usize, chance: f64) -> f64 {
    let (mut scores, mut slope, mut count) = (0.0, 0.0, 0.0);
    let columns = by_deviations(&totals.matrix, seen, rig_count);
    for k in 0..seen.len() {
        let at = rig_count + 3 * k;
        let own = Matrix2::from_fn(|i, j| totals.matrix[(at + i, at + j)]);
        let Some(inverse) = own.try_inverse().filter(|i| i.iter().all(|v| v.is_finite())) else { continue };
        let gradient = Vector2::new(totals.gradient[at], totals.gradient[at + 1]);
        scores += gradient.dot(&(inverse * gradient));
        let through = columns.iter().fold(Matrix2::zeros(), |sum: Matrix2<f64>, column| {
            let here = Vector2::new(column[at], column[at + 1]);
            sum + here * here.transpose()
        });
        slope += (inverse * through).trace();
        count += 2.0;
    }
    let variance = (scores - count) / (slope - count * chance);
    if variance.is_finite() { variance.clamp(0.0, 0.999 / chance) } else { 0.0 }
}
