//! The least-squares problem linearised: what sessions, gross errors, folds and smooth errors ask without fitting anew.
//!
//! In: rows, and the offsets (parameters of the robot, then extra unknowns of the sensor) at which they are linear.
//! Out: for each placement its white residuals with the columns of the shared unknowns and of its own, from which
//! follow: normal matrices of any selection of its rows with more columns where wanted, the shared unknowns' normal
//! matrix with the placement's own eliminated, and what fresh columns (another placement from some row on, an even
//! drift) would gain. What goes wrong: where the shared unknowns move the residuals by so much that a linear model does
//! not hold, all of it is only as good as that.

use std::ops::Range;
use std::rc::Rc;

use nalgebra::{DMatrix, DVector};

use crate::identify::model::kinematics::Place;
use crate::identify::residuals::eliminate::{Block, Linear};
use crate::identify::residuals::rows::Rows;
use crate::linear_algebra::{Eliminated, product, pseudo_inverse};

/// All placements, linearised at one point.
#[derive(Debug, Clone)]
pub struct Linearised {
    /// In the order of the rows' blocks.
    pub placements: Vec<Placement>,
    /// The robot's places there.
    pub places: Vec<Place>,
    /// Number of shared unknowns.
    pub shared: usize,
}

/// One placement of the sensor, linearised.
#[derive(Debug, Clone)]
pub struct Placement {
    /// White residuals and derivatives.
    pub linear: Rc<Linear>,
    /// White residuals at offset zero.
    pub at_zero: DVector<f64>,
    /// Index among the places of the pose that each residual belongs to; `None` for what belongs to no pose.
    pub poses: Vec<Option<usize>>,
}

impl Linearised {
    /// The rows at these offsets, the placements' own unknowns at their best.
    pub fn new(rows: &Rows, offsets: &[f64]) -> Linearised {
        let state = rows.state(offsets, true);
        let of_block = |block: &Block| {
            let linear = block.linear(&state);
            let at_zero = &linear.residuals - &linear.jacobian * DVector::from_column_slice(offsets);
            Placement { linear: Rc::new(linear), at_zero, poses: block.row_poses() }
        };
        let placements = rows.blocks.iter().map(of_block).collect();
        Linearised { placements, places: state.places, shared: offsets.len() }
    }
}

impl Placement {
    /// The residuals of each pose, by its index among the places; they stand beside each other.
    pub fn by_pose(&self) -> impl Iterator<Item = (usize, Range<usize>)> + '_ {
        let mut start = 0;
        let chunks = self.poses.chunk_by(|a, b| a == b);
        chunks.filter_map(move |chunk| {
            start += chunk.len();
            Some((chunk[0]?, start - chunk.len()..start))
        })
    }

    /// Product of [shared unknowns, residual at offset zero, own unknowns, `more`] with itself, of these residuals.
    pub fn normal(&self, rows: &[usize], more: Option<&DMatrix<f64>>) -> DMatrix<f64> {
        let (shared, own) = (self.linear.jacobian.ncols(), self.linear.design.ncols());
        let before = shared + 1 + own;
        let all = DMatrix::from_fn(rows.len(), before + more.map_or(0, DMatrix::ncols), |r, c| match c {
            _ if c < shared => self.linear.jacobian[(rows[r], c)],
            _ if c == shared => self.at_zero[rows[r]],
            _ if c < before => self.linear.design[(rows[r], c - shared - 1)],
            _ => more.map_or(0.0, |more| more[(rows[r], c - before)]),
        });
        product(&all, &all)
    }

    /// Product of [shared unknowns, own unknowns] with itself; `others` is what the other placements add to the shared
    /// ones.
    pub fn with_others(&self, others: &DMatrix<f64>) -> DMatrix<f64> {
        let Linear { jacobian, design, .. } = &*self.linear;
        let (shared, own) = (jacobian.ncols(), design.ncols());
        let mut whole = DMatrix::zeros(shared + own, shared + own);
        whole.view_mut((0, 0), (shared, shared)).copy_from(&(others + product(jacobian, jacobian)));
        let cross = product(jacobian, design);
        whole.view_mut((0, shared), (shared, own)).copy_from(&cross);
        whole.view_mut((shared, 0), (own, shared)).copy_from(&cross.transpose());
        whole.view_mut((shared, shared), (own, own)).copy_from(&product(design, design));
        whole
    }

    /// The shared unknowns with the placement's own eliminated.
    pub fn eliminated(&self) -> Eliminated {
        let shared = self.linear.jacobian.ncols();
        Eliminated::new(&self.with_others(&DMatrix::zeros(shared, shared)), shared)
    }
}

/// Columns of further unknowns of a placement, and what they would gain on top of all that there are.
#[derive(Debug, Clone)]
pub struct Fresh {
    /// Residuals and columns that there are.
    pub linear: Rc<Linear>,
    /// The further ones.
    pub columns: DMatrix<f64>,
    /// Inverse normal matrix of the shared unknowns and the placement's own, the other placements' eliminated.
    pub inverse: Rc<DMatrix<f64>>,
}

/// Products of fresh columns with the residuals, with themselves, and with all columns that there are.
#[derive(Debug, Clone)]
pub struct Products {
    pull: DVector<f64>,
    own: DMatrix<f64>,
    all: DMatrix<f64>,
}

impl Fresh {
    /// Of no rows.
    pub fn nothing(&self) -> Products {
        let (fresh, all) = (self.columns.ncols(), self.inverse.nrows());
        Products { pull: DVector::zeros(fresh), own: DMatrix::zeros(fresh, fresh), all: DMatrix::zeros(fresh, all) }
    }

    /// Adds the rows from `at.start` to `at.end`, the fresh columns times `by`.
    pub fn add(&self, to: &mut Products, at: &Range<usize>, by: f64) {
        let rows = |m: &DMatrix<f64>| m.rows(at.start, at.len()).into_owned();
        let (fresh, design, jacobian) = (rows(&self.columns), rows(&self.linear.design), rows(&self.linear.jacobian));
        let shared = jacobian.ncols();
        to.pull += by * fresh.tr_mul(&self.linear.residuals.rows(at.start, at.len()));
        to.own += by * by * fresh.tr_mul(&fresh);
        let mut of_shared = to.all.columns_mut(0, shared);
        of_shared += by * fresh.tr_mul(&jacobian);
        let mut of_own = to.all.columns_mut(shared, design.ncols());
        of_own += by * fresh.tr_mul(&design);
    }

    /// By how much the white sum of squares falls with these columns.
    pub fn gain(&self, products: &Products) -> f64 {
        -products.pull.dot(&self.amounts(products))
    }

    /// The unknowns of these columns where the sum of squares is least.
    pub fn amounts(&self, Products { pull, own, all }: &Products) -> DVector<f64> {
        let left = own - all * &*self.inverse * all.transpose();
        -(pseudo_inverse(left) * pull)
    }
}
