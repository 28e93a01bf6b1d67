//! How far black has spread on a grid of separate tags, whose corners it moves outwards from each tag.
//!
//! In: pairs at the minimum for the spread that their board's places hold. Out: the change that fits best, its standard
//! deviation, and what it does to the rig. Method: one step of Gauss-Newton with the rig and the poses eliminated; tags
//! that grow on the spot are next to nothing that these could take up, so that the step ends where it must. Where two
//! black squares meet at a corner, as on every other board, nothing moves.

use nalgebra::{DMatrix, DVector};

use crate::imaging::Board;
use crate::stereo::model::Layout;
use crate::stereo::solve::normal_equations::eliminate;
use crate::stereo::solve::{Problem, uncertainty};

/// The spread of black as pairs tell it.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// By how much it is more than the board's places hold, mm.
    pub change_mm: f64,
    /// Standard deviation by the corners' weights alone, mm.
    pub sigma_mm: f64,
    /// How the shared numbers change with it, a mm.
    pub by_mm: DVector<f64>,
}

/// A step over which the equations are straight, mm.
const SMALL_MM: f64 = 1e-3;

impl Spread {
    /// What the pairs tell; `None` where they do not.
    pub fn of(problem: &Problem, layout: &Layout) -> Option<Spread> {
        let at = |by_mm: f64| {
            let equations = spread(problem, by_mm).equations(layout)?;
            let cost = equations.cost() - 0.5 * uncertainty::expected_decrease(&equations)?;
            Some((cost, eliminate(&equations, 0.0)?))
        };
        let [below, here, above] = [at(-SMALL_MM)?, at(0.0)?, at(SMALL_MM)?];
        let slope = 0.5 * (above.0 - below.0) / SMALL_MM;
        let curvature = (above.0 - 2.0 * here.0 + below.0) / (SMALL_MM * SMALL_MM);
        let (matrix, _) = here.1;
        let by_gradient = (above.1.1 - below.1.1) / (2.0 * SMALL_MM);
        let by_mm = -(uncertainty::invert(&matrix)? * by_gradient);
        (curvature > 0.0).then(|| Spread { change_mm: -slope / curvature, sigma_mm: curvature.sqrt().recip(), by_mm })
    }

    /// What not knowing it better adds to the covariance of the shared numbers, where the weights promise too little by
    /// a factor.
    pub fn covariance(&self, inflation: f64) -> DMatrix<f64> {
        &self.by_mm * self.by_mm.transpose() * (self.sigma_mm * self.sigma_mm * inflation)
    }
}

/// The pairs of a board on which black has spread farther.
fn spread(problem: &Problem, by_mm: f64) -> Problem {
    let mut problem = problem.clone();
    for o in problem.views.iter_mut().flat_map(|view| &mut view.observations) {
        let [right, down] = Board::outwards(o.col, o.row);
        o.board_mm.x += by_mm * right;
        o.board_mm.y += by_mm * down;
    }
    problem
}
