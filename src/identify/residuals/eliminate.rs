//! Residuals of one placement of the sensor, with the placement's own unknowns solved for inside.
//!
//! In: the target's places in the base frame. Out: white residuals and their derivatives, from which the unknowns of
//! the placement (a rigid transform, the wire's anchor and zero, touched points) are eliminated: variable projection
//! (Golub and Pereyra, 1973) with Kaufman's derivative. A model without such unknowns is the special case. What goes
//! wrong: poses on one line leave the transform's turn about it free; the pseudo-inverse leaves it where it is.

use nalgebra::{DMatrix, DVector, Vector3};

use super::distances::Distances;
use super::normal::Normal;
use super::pairwise::Pairs;
use super::points::Points;
use super::state::State;
use super::touch::Touch;
use crate::geometry::Transform;
use crate::identify::sensor::Raw;
use crate::linear_algebra::{solution, without};

/// Steps of the inner problem at the most; it is nearly linear and mostly needs two or three.
const INNER_STEPS: usize = 50;

/// The inner problem is solved when its step's predicted gain falls below this fraction of its cost.
const INNER_GAIN: f64 = 1e-14;

/// The same where the cost alone is asked for, which a step predicts: what it misses goes by the square of that.
pub(super) const COST_GAIN: f64 = 1e-7;

/// What one block measures.
#[derive(Debug, Clone)]
pub enum Block {
    /// Distances to the group's centre: eq. (7) to (10), the centre computed anew with the same parameters; or to a
    /// fixed point that is unknown.
    Distances(Distances),
    /// Touches of fixed points that are unknown, some of them at known distances.
    Touch(Touch),
    /// Points, with a free rigid transform; orientations too where they are used.
    Points(Points),
    /// All distances within a group, whitened for the poses they share.
    Pairwise(Pairs),
}

/// The unknowns of a placement.
#[derive(Debug, Clone, PartialEq)]
pub enum Unknowns {
    Nothing,
    /// The point of distances, base frame, and a wire's reading at length zero, mm.
    Anchor(Vector3<f64>, f64),
    /// Touched points, base frame, mm.
    Sockets(Vec<Vector3<f64>>),
    /// `sensor_from_base`
    Frame(Transform),
}

/// White residuals with derivatives as they are, nothing eliminated.
#[derive(Debug, Clone)]
pub struct Linear {
    /// White residuals.
    pub residuals: DVector<f64>,
    /// A column a parameter of the robot, then a column an extra unknown.
    pub jacobian: DMatrix<f64>,
    /// A column an unknown of the placement.
    pub design: DMatrix<f64>,
}

impl Block {
    /// Number of unknowns of its own.
    pub fn unknown_count(&self) -> usize {
        match self {
            Block::Distances(distances) => distances.unknown_count(),
            Block::Pairwise(_) => 0,
            Block::Touch(touch) => 3 * touch.sockets.len(),
            Block::Points(_) => 6,
        }
    }

    pub fn row_count(&self) -> usize {
        self.row_poses().len()
    }

    /// Numbers that were measured with some weight, less the unknowns.
    pub fn count(&self) -> usize {
        let counted = |weights: &mut dyn Iterator<Item = f64>| weights.filter(|w| *w > 0.0).count();
        let numbers = match self {
            Block::Distances(distances) => counted(&mut distances.lengths.iter().map(|l| l.weight)),
            Block::Touch(touch) => 3 * counted(&mut touch.contacts.iter().map(|c| c.weight)) + touch.known.len(),
            Block::Points(points) => points.count(),
            Block::Pairwise(pairs) => pairs.count(),
        };
        numbers.saturating_sub(self.unknown_count())
    }

    /// Index among the places of the pose that each residual belongs to; `None` for what belongs to no pose.
    pub fn row_poses(&self) -> Vec<Option<usize>> {
        match self {
            Block::Distances(distances) => distances.lengths.iter().map(|l| Some(l.pose)).collect(),
            Block::Touch(touch) => touch.row_poses(),
            Block::Points(points) => {
                let rows = points.rows_a_spot();
                points.spots.iter().flat_map(|s| std::iter::repeat_n(Some(s.pose), rows)).collect()
            }
            Block::Pairwise(pairs) => vec![None; pairs.row_count()],
        }
    }

    fn start(&self, state: &State) -> Unknowns {
        match self {
            Block::Distances(distances) => Unknowns::Anchor(distances.start(&state.places), 0.0),
            Block::Pairwise(_) => Unknowns::Nothing,
            Block::Touch(touch) => Unknowns::Sockets(touch.sockets.clone()),
            Block::Points(points) => Unknowns::Frame(points.start(state)),
        }
    }

    /// White residuals and their derivatives with respect to the block's own unknowns.
    fn inner(&self, state: &State, at: &Unknowns) -> (DVector<f64>, DMatrix<f64>) {
        match (self, at) {
            (Block::Distances(distances), Unknowns::Anchor(point, zero)) => distances.inner(state, point, *zero),
            (Block::Touch(touch), Unknowns::Sockets(sockets)) => touch.inner(state, sockets),
            (Block::Points(points), Unknowns::Frame(frame)) => points.inner(state, frame),
            (Block::Pairwise(pairs), _) => (pairs.residuals(&state.places), DMatrix::zeros(pairs.row_count(), 0)),
            _ => (DVector::zeros(0), DMatrix::zeros(0, 0)),
        }
    }

    /// White derivatives with respect to the robot's parameters and the extra unknowns, the block's own held.
    fn outer(&self, state: &State, at: &Unknowns) -> DMatrix<f64> {
        match (self, at) {
            (Block::Distances(distances), Unknowns::Anchor(point, _)) => distances.outer(state, point),
            (Block::Touch(touch), _) => touch.outer(state),
            (Block::Points(points), Unknowns::Frame(frame)) => points.outer(state, frame),
            (Block::Pairwise(pairs), _) => pairs.derivatives(state).resize_horizontally(state.columns(), 0.0),
            _ => DMatrix::zeros(0, state.columns()),
        }
    }

    /// Squares and products of the residuals and of their derivatives with respect to the block's own unknowns.
    fn normal(&self, state: &State, at: &Unknowns) -> Normal {
        match (self, at) {
            (Block::Points(points), Unknowns::Frame(frame)) => points.normal(state, frame),
            _ => Normal::new(self.inner(state, at)),
        }
    }

    /// The unknowns at their best.
    pub(super) fn best(&self, state: &State) -> Unknowns {
        if self.start_is_best() { self.start(state) } else { self.descended(state, INNER_GAIN).0 }
    }

    /// The sum of the squares of the white residuals with the unknowns at their best.
    pub fn cost(&self, state: &State) -> f64 {
        match self.start_is_best() {
            true => self.normal(state, &self.start(state)).cost,
            false => self.descended(state, COST_GAIN).1,
        }
    }

    fn start_is_best(&self) -> bool {
        self.unknown_count() == 0 || matches!(self, Block::Points(points) if points.start_is_best())
    }

    /// The unknowns where a step would lower the sum of squares by no more than this share, and that sum after it.
    fn descended(&self, state: &State, least_gain: f64) -> (Unknowns, f64) {
        let mut at = self.start(state);
        let mut normal = self.normal(state, &at);
        for _ in 0..INNER_STEPS {
            let step = -solution(&normal.matrix, &normal.gradient);
            let gain = -normal.gradient.dot(&step);
            if gain.is_nan() {
                break;
            }
            if gain <= least_gain * normal.cost {
                return (at, normal.cost - gain);
            }
            // Halved until the cost falls; where it does not, the place is as good as it gets.
            let moved = (0..8).find_map(|halvings| {
                let trial = at.moved(&(0.5f64.powi(halvings) * &step));
                let there = self.normal(state, &trial);
                (there.cost <= normal.cost).then_some((trial, there))
            });
            let Some(moved) = moved else { break };
            (at, normal) = moved;
        }
        (at, normal.cost)
    }

    /// The unknowns at their best, and there white residuals and their derivatives with respect to them.
    pub fn solve(&self, state: &State) -> (Unknowns, DVector<f64>, DMatrix<f64>) {
        let at = self.best(state);
        let (residuals, design) = self.inner(state, &at);
        (at, residuals, design)
    }

    /// White residuals with the placement's unknowns at their best, and (where the places have columns and
    /// `derivatives`) the Jacobian with these eliminated.
    pub fn evaluate(&self, state: &State, derivatives: bool) -> (DVector<f64>, DMatrix<f64>) {
        if !derivatives {
            let residuals = match (self, self.best(state)) {
                (Block::Points(points), Unknowns::Frame(frame)) => points.left(state, &frame),
                (_, at) => self.inner(state, &at).0,
            };
            let rows = residuals.len();
            return (residuals, DMatrix::zeros(rows, 0));
        }
        let Linear { residuals, jacobian, design } = self.linear(state);
        (residuals, if self.unknown_count() > 0 { without(&jacobian, &design) } else { jacobian })
    }

    /// Residuals and all derivatives with the unknowns at their best, nothing eliminated.
    pub fn linear(&self, state: &State) -> Linear {
        let (unknowns, residuals, design) = self.solve(state);
        Linear { residuals, jacobian: self.outer(state, &unknowns), design }
    }

    /// Residuals before whitening, for the estimate of the scatter and for lists of what fits badly; by pose, with the
    /// row's weight.
    pub fn raw(&self, state: &State) -> Vec<(usize, f64, Raw)> {
        match (self, &self.best(state)) {
            (Block::Distances(distances), Unknowns::Anchor(point, zero)) => distances.raw(state, point, *zero),
            (Block::Touch(touch), Unknowns::Sockets(sockets)) => touch.raw(state, sockets),
            (Block::Points(points), Unknowns::Frame(frame)) => points.raw(state, frame),
            (Block::Pairwise(pairs), _) => pairs.raw(&state.places),
            _ => Vec::new(),
        }
    }
}

impl Unknowns {
    /// Moved by a step in the coordinates of the block's design.
    pub fn moved(&self, step: &DVector<f64>) -> Unknowns {
        let three = |at: usize| Vector3::new(step[at], step[at + 1], step[at + 2]);
        match self {
            Unknowns::Nothing => Unknowns::Nothing,
            Unknowns::Anchor(point, zero) => {
                Unknowns::Anchor(point + three(0), zero + if step.len() > 3 { step[3] } else { 0.0 })
            }
            Unknowns::Sockets(sockets) => {
                Unknowns::Sockets(sockets.iter().enumerate().map(|(k, c)| c + three(3 * k)).collect())
            }
            Unknowns::Frame(frame) => Unknowns::Frame(crate::geometry::perturb(frame, step.as_slice())),
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;

    use crate::identify::data::dataset::Dataset;
    use crate::identify::residuals::rows::Rows;
    use crate::identify::sensor::Scatter;
    use crate::identify::settings::{Model, Settings};
    use crate::identify::solve::task::Task;
    use crate::identify::synthetic;

    /// Of every kind of reading, near the best robot and far from it.
    #[test]
    fn the_cost_is_that_of_the_residuals() {
        let mut world = synthetic::world(30, 0.05, 3);
        synthetic::orient(&mut world.rows, &world.truth, 1e-3, &mut Pcg64Mcg::seed_from_u64(5));
        let (touched, _) = synthetic::touched(0.0, 4);
        let from_wire = synthetic::to_first(&world, |i, at, from| (at - from).norm() + 0.1 * (7.0 * i as f64).sin());
        let (points, touches) = (Dataset::new(&world.rows).unwrap(), Dataset::new(&touched.rows).unwrap());
        let (parameters, settings) = (world.nominal.mdh_parameters(), Settings::default());
        for (set, model) in [
            (&points, Model::Pose),
            (&points, Model::Position),
            (&points, Model::CenterDistance),
            (&points, Model::PairwiseDistance),
            (&from_wire, Model::CenterDistance),
            (&touches, Model::CenterDistance),
        ] {
            let (fitted, extras) = (set.fit_rows(), set.target_unknowns(model == Model::Pose));
            let plain = Task::plain(set, &world.nominal, &parameters, &fitted, &settings);
            let scatter = Scatter { rotation_rad: 1e-3, ..Scatter::of_point(0.05) };
            let rows = Rows::new(&Task { model, extras, ..plain }, scatter, &[], &world.nominal);
            assert!(!rows.blocks.is_empty());
            for size in [0.0, 0.1, 3.0] {
                let offsets: Vec<f64> = (0..rows.offset_count()).map(|k| size * (1.9 * k as f64).cos()).collect();
                let expected = rows.evaluate(&offsets, false).0.norm_squared();
                let found = rows.cost(&offsets);
                assert!((found / expected - 1.0).abs() < 1e-9, "{} {size}: {found} for {expected}", model.name());
            }
        }
    }
}
