//! How the edges of one window bend, by its own pixels.
//!
//! In: the end of a fit whose edges had given bends, and which of these nothing else tells. Out: the same with these
//! bends found. Method: a further parameter of a linear problem is one step of elimination. An arm's normal matrix of
//! step and turn says where along the edge its pixels lie, and so what step and turn a bend is for it. Goes wrong: a
//! bend that takes the edge's ends out of their blur needs another fit from where this one ended.

use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

use super::end::End;
use super::evaluation::Arm;
use super::model::N;

impl<const C: usize> Arm<C> {
    /// The step (px) and the turn (rad) that a bend of one is for this arm; `None` where the arm tells of no turn.
    fn of_bend(&self) -> Option<Vector2<f64>> {
        let sum = self.normal[(0, 0)];
        let mean = self.normal[(0, 1)] / sum;
        let variance = self.normal[(1, 1)] / sum - mean * mean;
        // Pixels lie evenly along an arm, so that the square of the place about its middle has no slope.
        let bend = Vector2::new((variance - mean * mean) / 2.0, mean);
        (variance > 0.0 && bend.iter().all(|v| v.is_finite())).then_some(bend)
    }

    /// The same arm about an edge that bends more.
    fn bent(mut self, bend: f64) -> Arm<C> {
        if let Some(by_bend) = self.of_bend() {
            let residual = self.by_columns.column(N) - self.normal * by_bend * bend;
            self.by_columns.set_column(N, &residual);
        }
        self
    }
}

impl<const C: usize, const P: usize> End<C, P> {
    /// The same with the bends of some of the edges free; `None` where the pixels do not tell one of them.
    pub(super) fn with_own_bends(self, own: [bool; 2]) -> Option<Self> {
        if own == [false; 2] {
            return Some(self);
        }
        let mut columns = [SVector::<f64, P>::zeros(); 2];
        let (mut normal, mut gradient) = (Matrix2::identity(), Vector2::zeros());
        for k in [0, 1].into_iter().filter(|&k| own[k]) {
            normal[(k, k)] = 0.0;
            for arm in &self.arms[k] {
                let Some(by_bend) = arm.of_bend() else { continue };
                normal[(k, k)] += by_bend.dot(&(arm.normal * by_bend));
                gradient[k] += by_bend.dot(&arm.gradient(&self.parameters, self.step.as_slice()));
                columns[k] += SVector::from_fn(|p, _| by_bend.dot(&arm.by_columns.column(self.parameters[p])));
            }
        }
        let columns = SMatrix::<f64, P, 2>::from_columns(&columns);
        let by_bends = self.inverse * columns;
        let left = (normal - columns.transpose() * by_bends).cholesky()?.inverse();
        let bends = left * gradient;
        Some(End {
            cost: self.cost - bends.dot(&gradient),
            freedom: self.freedom - own.iter().filter(|own| **own).count() as f64,
            arms: [0, 1].map(|k| self.arms[k].map(|arm| arm.bent(bends[k]))),
            step: self.step - by_bends * bends,
            inverse: self.inverse + by_bends * left * by_bends.transpose(),
            bends: [0, 1].map(|k| own[k].then_some(bends[k])),
            ..self
        })
    }
}
