//! Distances: to a group's centre pose, or to a fixed point that is unknown (a draw wire's anchor).

use nalgebra::{DMatrix, DVector, Matrix3xX, Vector3};

use crate::geometry::direction;
use crate::identify::model::kinematics::{Place, column_count};
use crate::identify::sensor::{Length, Raw, Scatter};

/// Distances to the group's centre pose.
#[derive(Debug, Clone)]
pub struct Center {
    /// Index of the centre among the places.
    pub center: usize,
    pub lengths: Vec<Length>,
}

/// Distances to a fixed point that is unknown.
#[derive(Debug, Clone)]
pub struct Wire {
    pub lengths: Vec<Length>,
    /// Where the search for the point starts, base frame, mm.
    pub anchor_mm: Vector3<f64>,
    /// Whether the wire's zero is unknown too.
    pub offset: bool,
}

/// A length as a vector, and how it moves with the unknowns.
type Along = (Vector3<f64>, Matrix3xX<f64>);

/// White derivatives of lengths in which the scatter enters so many times.
fn outer(
    lengths: &[Length],
    columns: usize,
    scatter: &Scatter,
    times: f64,
    along: &dyn Fn(&Length) -> Along,
) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(lengths.len(), columns);
    for (i, l) in lengths.iter().enumerate() {
        let (vector, moves) = along(l);
        let by = l.weight / scatter.sd(l, times);
        let row = (direction(&vector).0 * by).transpose() * moves;
        jacobian.view_mut((i, 0), (1, row.ncols())).copy_from(&row);
        jacobian.view_mut((i, columns - l.extra.len()), (1, l.extra.len())).copy_from(&(&l.extra * by));
    }
    jacobian
}

impl Center {
    fn residual(&self, places: &[Place], extras: &[f64], l: &Length) -> f64 {
        (places[l.pose].point_mm - places[self.center].point_mm).norm() - l.length_mm + l.gained(extras)
    }

    pub(super) fn inner(&self, places: &[Place], extras: &[f64], scatter: &Scatter) -> (DVector<f64>, DMatrix<f64>) {
        let n = self.lengths.len();
        let white = |l: &Length| l.weight * self.residual(places, extras, l) / scatter.sd(l, 2.0);
        (DVector::from_iterator(n, self.lengths.iter().map(white)), DMatrix::zeros(n, 0))
    }

    pub(super) fn outer(&self, places: &[Place], extras: usize, scatter: &Scatter) -> DMatrix<f64> {
        let center = &places[self.center];
        outer(&self.lengths, column_count(places) + extras, scatter, 2.0, &|l| {
            let place = &places[l.pose];
            (place.point_mm - center.point_mm, &place.point_columns - &center.point_columns)
        })
    }

    /// White derivatives of the residuals with respect to the centre, where it is another point than the one that was measured: three columns.
    pub fn of_center(&self, places: &[Place], scatter: &Scatter) -> DMatrix<f64> {
        let center = &places[self.center].point_mm;
        let mut columns = DMatrix::zeros(self.lengths.len(), 3);
        for (i, l) in self.lengths.iter().enumerate() {
            let by = -l.weight / scatter.sd(l, 2.0);
            let u = direction(&(places[l.pose].point_mm - center)).0 * by;
            columns.fixed_view_mut::<1, 3>(i, 0).copy_from(&u.transpose());
        }
        columns
    }

    pub(super) fn raw(&self, places: &[Place], extras: &[f64]) -> Vec<(usize, f64, Raw)> {
        let raw = |l: &Length| (l.pose, l.weight, Raw::Length(self.residual(places, extras, l), l.variance_mm2, 2.0));
        self.lengths.iter().map(raw).collect()
    }
}

impl Wire {
    pub(super) fn unknown_count(&self) -> usize {
        3 + usize::from(self.offset)
    }

    pub(super) fn inner(
        &self,
        places: &[Place],
        extras: &[f64],
        scatter: &Scatter,
        anchor_mm: &Vector3<f64>,
        zero_mm: f64,
    ) -> (DVector<f64>, DMatrix<f64>) {
        let mut design = DMatrix::zeros(self.lengths.len(), self.unknown_count());
        let mut residuals = DVector::zeros(self.lengths.len());
        for (i, l) in self.lengths.iter().enumerate() {
            let (u, distance) = direction(&(places[l.pose].point_mm.coords - anchor_mm));
            let by = l.weight / scatter.sd(l, 1.0);
            residuals[i] = (distance + zero_mm - l.length_mm + l.gained(extras)) * by;
            design.fixed_view_mut::<1, 3>(i, 0).copy_from(&(-u.transpose() * by));
            if self.offset {
                design[(i, 3)] = by;
            }
        }
        (residuals, design)
    }

    pub(super) fn outer(
        &self,
        places: &[Place],
        extras: usize,
        scatter: &Scatter,
        anchor_mm: &Vector3<f64>,
    ) -> DMatrix<f64> {
        outer(&self.lengths, column_count(places) + extras, scatter, 1.0, &|l| {
            let place = &places[l.pose];
            (place.point_mm.coords - anchor_mm, place.point_columns.clone())
        })
    }

    pub(super) fn raw(
        &self,
        places: &[Place],
        extras: &[f64],
        anchor_mm: &Vector3<f64>,
        zero_mm: f64,
    ) -> Vec<(usize, f64, Raw)> {
        let raw = |l: &Length| {
            let distance = (places[l.pose].point_mm.coords - anchor_mm).norm();
            let residual = distance + zero_mm - l.length_mm + l.gained(extras);
            (l.pose, l.weight, Raw::Length(residual, l.variance_mm2, 1.0))
        };
        self.lengths.iter().map(raw).collect()
    }
}
