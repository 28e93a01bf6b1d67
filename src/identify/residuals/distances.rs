//! Distances: to a group's centre pose, or to a fixed point that is unknown (a draw wire's anchor).

use nalgebra::{DMatrix, DVector, Vector3};

use super::state::State;
use crate::geometry::direction;
use crate::identify::model::kinematics::Place;
use crate::identify::sensor::{Length, Raw, Scatter};

/// Distances of poses to one point.
#[derive(Debug, Clone)]
pub struct Distances {
    pub lengths: Vec<Length>,
    pub from: Origin,
}

/// The point that distances are measured from.
#[derive(Debug, Clone, Copy)]
pub enum Origin {
    /// The centre pose, by its index among the places.
    Center(usize),
    /// A fixed point that is unknown: where the search for it starts, base frame, mm, and whether the wire's zero is
    /// unknown too.
    Anchor(Vector3<f64>, bool),
}

impl Distances {
    /// How many times the scatter enters a length: at each end that the robot takes.
    pub fn times(&self) -> f64 {
        if matches!(self.from, Origin::Center(_)) { 2.0 } else { 1.0 }
    }

    pub(super) fn unknown_count(&self) -> usize {
        if let Origin::Anchor(_, offset) = self.from { 3 + usize::from(offset) } else { 0 }
    }

    /// The point where it is known, or where the search for it starts.
    pub(super) fn start(&self, places: &[Place]) -> Vector3<f64> {
        match self.from {
            Origin::Center(center) => places[center].point_mm.coords,
            Origin::Anchor(start_mm, _) => start_mm,
        }
    }

    pub(super) fn inner(&self, state: &State, from_mm: &Vector3<f64>, zero_mm: f64) -> (DVector<f64>, DMatrix<f64>) {
        let State { places, extras, scatter } = state;
        let mut design = DMatrix::zeros(self.lengths.len(), self.unknown_count());
        let mut residuals = DVector::zeros(self.lengths.len());
        for (i, l) in self.lengths.iter().enumerate() {
            let Origin::Anchor(_, offset) = self.from else {
                let residual = self.residual(state, from_mm, zero_mm, l);
                residuals[i] = l.weight * residual / scatter.sd(l, 2.0);
                continue;
            };
            let (u, distance) = direction(&(places[l.pose].point_mm.coords - from_mm));
            let by = l.weight / scatter.sd(l, 1.0);
            residuals[i] = (distance + zero_mm - l.length_mm + l.gained(extras)) * by;
            design.fixed_view_mut::<1, 3>(i, 0).copy_from(&(-u.transpose() * by));
            if offset {
                design[(i, 3)] = by;
            }
        }
        (residuals, design)
    }

    pub(super) fn outer(&self, state: &State, from_mm: &Vector3<f64>) -> DMatrix<f64> {
        let (places, columns) = (&state.places, state.columns());
        let mut jacobian = DMatrix::zeros(self.lengths.len(), columns);
        for (i, l) in self.lengths.iter().enumerate() {
            let (place, by) = (&places[l.pose], l.weight / state.scatter.sd(l, self.times()));
            let u = (direction(&(place.point_mm.coords - from_mm)).0 * by).transpose();
            let row = match self.from {
                Origin::Center(center) => u * (&place.point_columns - &places[center].point_columns),
                Origin::Anchor(..) => u * &place.point_columns,
            };
            jacobian.view_mut((i, 0), (1, row.ncols())).copy_from(&row);
            jacobian.view_mut((i, columns - l.extra.len()), (1, l.extra.len())).copy_from(&(&l.extra * by));
        }
        jacobian
    }

    /// White derivatives of the residuals with respect to the point, where it is another one than was measured: three
    /// columns.
    pub fn of_origin(&self, places: &[Place], scatter: &Scatter) -> DMatrix<f64> {
        let from_mm = self.start(places);
        let mut columns = DMatrix::zeros(self.lengths.len(), 3);
        for (i, l) in self.lengths.iter().enumerate() {
            let by = -l.weight / scatter.sd(l, self.times());
            let u = direction(&(places[l.pose].point_mm.coords - from_mm)).0 * by;
            columns.fixed_view_mut::<1, 3>(i, 0).copy_from(&u.transpose());
        }
        columns
    }

    pub(super) fn raw(&self, state: &State, from_mm: &Vector3<f64>, zero_mm: f64) -> Vec<(usize, f64, Raw)> {
        let residual = |l: &Length| self.residual(state, from_mm, zero_mm, l);
        let raw = |l: &Length| (l.pose, l.weight, Raw::Length(residual(l), l.variance_mm2, self.times()));
        self.lengths.iter().map(raw).collect()
    }

    fn residual(&self, state: &State, from_mm: &Vector3<f64>, zero_mm: f64, l: &Length) -> f64 {
        let distance = (state.places[l.pose].point_mm.coords - from_mm).norm();
        distance + zero_mm - l.length_mm + l.gained(state.extras)
    }
}
