//! Where misprinted crossings are, behind the bent edges that their corners were measured on.
//!
//! In: where the corners were found, and what their windows see (`window`). Out: the crossings themselves and, for each
//! corner, by how much what it sees lies off its crossing. Goes wrong: windows cut at one side, or edges that are not
//! straight between crossings; what remains is found as scatter of that crossing's corners.

use nalgebra::{Matrix2, Vector3};

use crate::imaging::{Board, Side};
use crate::stereo::Rig;
use crate::stereo::board_pose::solve::bundle::{Bundle, Values};
use crate::stereo::board_pose::solve::pose_block::OUTLIER;
use crate::stereo::board_pose::solve::window::{Window, crossing_means};
use crate::stereo::data::{Noise, Observation};

/// Standard deviations by which the corners of a crossing must scatter beyond their noise.
const TELLING: f64 = 4.0;

/// Steps from what windows see to the crossings; each leaves at most the windows' mean reach of what is missing.
const STEPS: usize = 60;

/// The part of the deviations that is a straight line in both places on the board.
fn straight_part(board: &Board, deviations_mm: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let all = || board.corners_mm().zip(deviations_mm);
    // The board's frame is in its middle, so that x, y and one are at right angles.
    let mean = all().map(|(_, d)| d).sum::<Vector3<f64>>() / deviations_mm.len() as f64;
    let slope = |axis: usize| {
        let square: f64 = all().map(|(p, _)| p[axis] * p[axis]).sum();
        all().map(|(p, d)| d * p[axis]).sum::<Vector3<f64>>() / square.max(f64::MIN_POSITIVE)
    };
    let (by_x, by_y) = (slope(0), slope(1));
    all().map(|(p, _)| mean + by_x * p.x + by_y * p.y).collect()
}

impl Bundle<'_> {
    /// Sets the crossings to what their corners, each through its own window, show on the whole; and with it what each
    /// corner sees. `told` is how much of a change of what is seen a crossing follows, between none and one: of what a
    /// window hardly sees, corners that are known badly would else make any deviation.
    pub fn unbend(&mut self, values: &mut Values, told: &[Vector3<f64>]) {
        let board = self.board;
        let windows = Window::means(board, &self.views);
        let off = crossing_means(board, &self.views, |o| o.seen_off_mm);
        let seen: Vec<Vector3<f64>> = values.deviations_mm.iter().zip(&off).map(|(d, off)| d + off).collect();
        // A board that is larger, or sheared, has straight edges.
        let straight = straight_part(board, &seen);
        let bent: Vec<Vector3<f64>> = seen.iter().zip(&straight).map(|(d, s)| d - s).collect();
        let mut deviations = bent.clone();
        for _ in 0..STEPS {
            let of = |k: usize| bent[k] - off[k] + told[k].component_mul(&(off[k] - windows[k].seen_off(&deviations)));
            deviations = (0..bent.len()).map(of).collect();
        }
        for o in self.views.iter_mut().flat_map(|view| &mut view.observations) {
            o.seen_off_mm = Window::of(board, o).seen_off(&deviations);
        }
        values.deviations_mm = deviations.iter().zip(&straight).map(|(d, s)| d + s).collect();
    }

    /// A corner with what its crossing's edges add to its covariance.
    pub fn with_edge_bend(&self, rig: &Rig, depth_mm: f64, o: &Observation) -> Observation {
        let bend_px = self.edge_bends_mm[self.board.index(o.col, o.row)] * px_per_mm(rig, o.side, depth_mm);
        let mut o = *o;
        o.covariance_px2 += Matrix2::identity() * (bend_px * bend_px);
        o
    }
}

/// Pixels a millimetre of the target at this distance.
fn px_per_mm(rig: &Rig, side: Side, depth_mm: f64) -> f64 {
    rig.camera(side).fx / depth_mm
}

/// Standard deviation of what bent edges add to a corner along x and along y beyond its noise, mm, by crossing.
pub fn edge_bends_mm(bundle: &Bundle<'_>, values: &Values, noise: &Noise) -> Vec<f64> {
    let scene = bundle.scene(values);
    let mut sums = vec![Sums::default(); scene.crossings.len()];
    for (view, pose) in bundle.views.iter().zip(&values.poses) {
        let Some(pose) = pose else { continue };
        for o in &view.observations {
            let k = bundle.board.index(o.col, o.row);
            let Some(miss) = scene.residual(pose, o) else { continue };
            let scale = px_per_mm(&scene.rig, o.side, (pose * scene.crossing(o)).z);
            let variance = noise.covariance(o).trace() / 2.0;
            // What is farther off is no bend of edges.
            let most_px = values.deviations_mm[k].xy().norm() * scale + OUTLIER * variance.sqrt();
            if miss.norm() <= most_px {
                sums[k].add(miss.norm_squared() / 2.0, variance, scale);
            }
        }
    }
    sums.iter().map(Sums::bend_mm).collect()
}

#[derive(Clone, Default)]
struct Sums {
    count: f64,
    chi_square: f64,
    excess_mm2: f64,
}

impl Sums {
    fn add(&mut self, square: f64, variance: f64, scale: f64) {
        self.count += 1.0;
        self.chi_square += square / variance;
        self.excess_mm2 += (square - variance) / (scale * scale);
    }

    fn bend_mm(&self) -> f64 {
        let chance = 1.0 + TELLING / self.count.max(1.0).sqrt();
        let tells = self.chi_square > chance * self.count;
        if tells { (self.excess_mm2 / self.count).max(0.0).sqrt() } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::Squares;
    use crate::stereo::board_pose::solve::prior::{RigPrior, ShapePrior};
    use crate::stereo::data::View;
    use crate::stereo::synthetic::World;

    fn board() -> Board {
        Board::checker(Squares { columns: 7, rows: 6 }, 10.0)
    }

    /// Deviations without any at the rim, 0.01 mm, from numbers that no line fits.
    fn deviations() -> Vec<Vector3<f64>> {
        let of = |k: usize| {
            let k = k as f64;
            Vector3::new(0.01 * (3.1 * k).sin(), 0.01 * (1.7 + 5.3 * k).sin(), 0.0)
        };
        (0..board().corner_count()).map(of).collect()
    }

    #[test]
    fn a_sheared_board_is_straight() {
        let slanted: Vec<Vector3<f64>> = board().corners_mm().map(|at| at.coords * 0.2).collect();
        let straight = straight_part(&board(), &slanted);
        assert!(slanted.iter().zip(&straight).all(|(a, b)| (a - b).norm() < 1e-12));
    }

    /// The board with one corner a crossing, each seen through windows of this reach.
    fn bundle(board: &Board, reach: f64) -> Bundle<'_> {
        let observation = |k: usize| {
            let mut o = Observation::of_point(Side::Left, nalgebra::Point2::origin(), 0.01);
            ((o.col, o.row), o.reach) = (board.place(k), [reach; 2]);
            o
        };
        let observations = (0..board.corner_count()).map(observation).collect();
        Bundle {
            board,
            views: vec![View { pair: String::new(), observations }],
            rig: RigPrior::new(&World::new(1, 1).rig),
            shape: ShapePrior { in_plane_mm: 0.01, out_of_plane_mm: 0.01, bent_mm: 0.01, stretch_mm: 0.01 },
            edge_bends_mm: vec![0.0; board.corner_count()],
        }
    }

    fn values(deviations_mm: &[Vector3<f64>]) -> Values {
        Values { rig: nalgebra::DVector::zeros(0), deviations_mm: deviations_mm.to_vec(), poses: Vec::new() }
    }

    fn length_of(d: impl Iterator<Item = Vector3<f64>>) -> f64 {
        d.map(|d| d.norm_squared()).sum::<f64>().sqrt()
    }

    #[test]
    fn crossings_are_found_through_windows_of_any_reach() {
        let (board, truth) = (board(), deviations());
        let straight = straight_part(&board, &truth);
        let bent: Vec<Vector3<f64>> = truth.iter().zip(&straight).map(|(d, s)| d - s).collect();
        for reach in [0.2, 0.6, 0.8] {
            let mut bundle = bundle(&board, reach);
            let seen_off = |k: usize| Window::of(&board, &bundle.views[0].observations[k]).seen_off(&bent);
            let seen: Vec<Vector3<f64>> = (0..truth.len()).map(|k| truth[k] + seen_off(k)).collect();
            let mut values = values(&seen);
            bundle.unbend(&mut values, &vec![Vector3::repeat(1.0); truth.len()]);
            let left = length_of(values.deviations_mm.iter().zip(&truth).map(|(f, t)| f - t));
            assert!(left < 0.05 * length_of(truth.iter().copied()), "{reach}");
            // Every corner is told what its window sees: crossing and offset together are what was seen.
            let o = &bundle.views[0].observations[8];
            assert!((values.deviations_mm[8] + o.seen_off_mm - seen[8]).norm() < 1e-4);
        }
    }

    /// Of a board in few pictures that scatter, crossings keep to what was known of them, and windows as wide as the
    /// squares hardly see that neighbours are off in turn: set to what is seen in full, the crossings would be farther
    /// off each time.
    #[test]
    fn crossings_that_are_known_badly_do_not_run_away() {
        let (board, seen) = (board(), deviations());
        for (reach, told) in [(0.8, 0.1), (0.95, 0.1), (0.95, 0.5), (0.95, 0.02)] {
            let mut bundle = bundle(&board, reach);
            let mut values = values(&vec![Vector3::zeros(); seen.len()]);
            for _ in 0..30 {
                // The least squares with what each corner sees held: a share of what is left goes into its crossing.
                for (k, d) in values.deviations_mm.iter_mut().enumerate() {
                    *d = told * (seen[k] - bundle.views[0].observations[k].seen_off_mm);
                }
                bundle.unbend(&mut values, &vec![Vector3::repeat(told); seen.len()]);
            }
            let most = told / (1.0 - told * reach) * length_of(seen.iter().copied());
            let found = length_of(values.deviations_mm.iter().copied());
            assert!(found > 0.5 * told * most && found < 1.05 * most, "{reach} {told}: {found} of {most}");
        }
    }
}
