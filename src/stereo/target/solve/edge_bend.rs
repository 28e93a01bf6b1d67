//! What a window sees of a misprinted crossing.
//!
//! The edges run straight from crossing to crossing, so that they bend at one that is off, and a corner is measured by fitting straight
//! edges over a window: over a part `h` of each edge it sees `1 - h/2` of the crossing's own deviation across that edge and `h/4` of each
//! neighbour's (the means of `1 - |t|` and of `|t|` over the window). In: the windows' reach and where the corners were found. Out: the crossings
//! themselves and, for each corner, by how much what it sees lies off its crossing. Goes wrong: windows cut at one side, or
//! edges that are not straight between crossings; what remains is found as scatter of that crossing's corners.

use nalgebra::{Matrix2, Vector3};

use crate::imaging::{Board, Side};
use crate::stereo::Rig;
use crate::stereo::data::corner_noise::Noise;
use crate::stereo::data::observation::Observation;
use crate::stereo::target::solve::bundle::{Bundle, Values};
use crate::stereo::target::solve::estimate::OUTLIER;
use crate::stereo::target::solve::pose_block::{crossings, residual};

/// Standard deviations by which the corners of a crossing must scatter beyond their noise.
const TELLING: f64 = 4.0;

/// Steps from what windows see to the crossings; each leaves at most the windows' mean reach of what is missing.
const STEPS: usize = 40;

/// Which crossings' deviations a window sees of a coordinate, with their shares; `None` stands for a crossing at the board's rim.
pub(in crate::stereo::target) type SeenShares = [(Option<usize>, f64); 3];

/// What a window with this reach along rows and columns sees of a coordinate (x, y) of a crossing.
pub(in crate::stereo::target) fn seen_shares(
    board: &Board,
    (col, row): (usize, usize),
    axis: usize,
    reach: [f64; 2],
) -> SeenShares {
    let at = |dc: isize, dr: isize| {
        let (col, row) = (col.checked_add_signed(dc), row.checked_add_signed(dr));
        let inside = col.zip(row).filter(|&(c, r)| c < board.columns() && r < board.rows());
        inside.map(|(c, r)| board.index(c, r))
    };
    // The edge along the row says where the corner is across it, in y; the one along the column in x.
    let (reach, dc, dr) = if axis == 0 { (reach[1], 0, 1) } else { (reach[0], 1, 0) };
    [(at(0, 0), 1.0 - 0.5 * reach), (at(-dc, -dr), 0.25 * reach), (at(dc, dr), 0.25 * reach)]
}

/// What such a window sees of the crossings' deviations, less the crossing's own deviation, mm.
fn seen_off(board: &Board, deviations_mm: &[Vector3<f64>], place: (usize, usize), reach: [f64; 2]) -> Vector3<f64> {
    let own = deviations_mm[board.index(place.0, place.1)];
    let of = |axis: usize| {
        let seen = seen_shares(board, place, axis, reach);
        seen.iter().filter_map(|(from, share)| Some(share * deviations_mm[(*from)?][axis])).sum::<f64>() - own[axis]
    };
    Vector3::new(of(0), of(1), 0.0)
}

/// The part of the deviations that is a straight line in both places on the board.
fn straight_part(board: &Board, deviations_mm: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let place = |k: usize| board.corner_mm(k % board.columns(), k / board.columns());
    let all = || deviations_mm.iter().enumerate().map(|(k, d)| (place(k), d));
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
    /// Sets the crossings to what their corners, each through its own window, show on the whole; and with it what each corner sees.
    pub(in crate::stereo::target) fn unbend(&mut self, values: &mut Values) {
        let board = self.board;
        let windows = self.mean_windows();
        let seen: Vec<Vector3<f64>> = values.deviations_mm.iter().zip(&windows).map(|(d, (_, off))| d + off).collect();
        // A board that is larger, or sheared, has straight edges.
        let straight = straight_part(board, &seen);
        let bent: Vec<Vector3<f64>> = seen.iter().zip(&straight).map(|(d, s)| d - s).collect();
        let mut deviations = bent.clone();
        for _ in 0..STEPS {
            let place = |k: usize| (k % board.columns(), k / board.columns());
            let less = |k: usize| bent[k] - seen_off(board, &deviations, place(k), windows[k].0);
            deviations = (0..bent.len()).map(less).collect();
        }
        for o in self.views.iter_mut().flat_map(|view| &mut view.observations) {
            o.seen_off_mm = seen_off(board, &deviations, (o.col, o.row), o.reach);
        }
        values.deviations_mm = deviations.iter().zip(&straight).map(|(d, s)| d + s).collect();
    }

    /// The mean reach of each crossing's windows, and the mean of what they see less its own deviation, mm.
    fn mean_windows(&self) -> Vec<([f64; 2], Vector3<f64>)> {
        let mut sums = vec![(0.0, [0.0; 2], Vector3::zeros()); self.board.corner_count()];
        for o in self.views.iter().flat_map(|view| &view.observations).filter(|o| o.active) {
            let (number, reach, off) = &mut sums[self.board.index(o.col, o.row)];
            *number += 1.0;
            (0..2).for_each(|i| reach[i] += o.reach[i]);
            *off += o.seen_off_mm;
        }
        let mean = |(number, reach, off): (f64, [f64; 2], Vector3<f64>)| {
            let by = 1.0 / number.max(1.0);
            (reach.map(|r| r * by), off * by)
        };
        sums.into_iter().map(mean).collect()
    }

    /// Variances of the crossings' deviations along x, y and z that come from the crossings at the board's rim, mm^2: those bend edges as the
    /// others do and are never seen.
    pub(in crate::stereo::target) fn rim_variances_mm2(&self) -> Vec<f64> {
        let board = self.board;
        let of = |(k, ([along_rows, along_columns], _)): (usize, ([f64; 2], Vector3<f64>))| {
            let ends = |at: usize, count: usize| f64::from(u8::from(at == 0)) + f64::from(u8::from(at + 1 == count));
            // A neighbour's share of what is seen is taken for the crossing's own, of which less is seen.
            let share = |reach: f64| 0.25 * reach / (1.0 - 0.5 * reach);
            let variance = |reach: f64, ends: f64| ends * (share(reach) * self.shape.in_plane_mm).powi(2);
            let x = variance(along_columns, ends(k / board.columns(), board.rows()));
            let y = variance(along_rows, ends(k % board.columns(), board.columns()));
            [x, y, 0.0]
        };
        self.mean_windows().into_iter().enumerate().flat_map(of).collect()
    }

    /// A corner with what its crossing's edges add to its covariance.
    pub(in crate::stereo::target) fn with_edge_bend(&self, rig: &Rig, depth_mm: f64, o: &Observation) -> Observation {
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
pub(in crate::stereo::target) fn edge_bends_mm(bundle: &Bundle<'_>, values: &Values, noise: &Noise) -> Vec<f64> {
    let rig = bundle.rig_at(values);
    let places = crossings(bundle.board, &values.deviations_mm);
    let mut sums = vec![Sums::default(); places.len()];
    for (view, pose) in bundle.views.iter().zip(&values.poses) {
        let Some(pose) = pose else { continue };
        for o in &view.observations {
            let k = bundle.board.index(o.col, o.row);
            let Some(miss) = residual(&rig, &places, bundle.board, pose, o) else { continue };
            let scale = px_per_mm(&rig, o.side, (pose * places[k]).z);
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
    use crate::stereo::data::view::View;
    use crate::stereo::synthetic::World;
    use crate::stereo::target::solve::prior::{RigPrior, ShapePrior};

    fn board() -> Board {
        Board { squares: Squares { columns: 7, rows: 6 }, square_mm: 10.0 }
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
    fn a_window_sees_as_much_of_straight_lines_as_there_is() {
        for axis in 0..2 {
            for reach in [[0.0, 0.0], [0.3, 0.8]] {
                let shares = seen_shares(&board(), (2, 0), axis, reach);
                assert!((shares.iter().map(|(_, share)| share).sum::<f64>() - 1.0).abs() < 1e-12);
            }
        }
        // The edge along the column of a crossing of the first row begins at the rim.
        assert_eq!(seen_shares(&board(), (2, 0), 0, [0.4, 0.8])[1], (None, 0.2));
        assert_eq!(seen_shares(&board(), (2, 0), 1, [0.4, 0.8])[1], (Some(1), 0.1));
        let slanted: Vec<Vector3<f64>> =
            (0..board().corner_count()).map(|k| board().corner_mm(k % 6, k / 6).coords * 0.2).collect();
        let straight = straight_part(&board(), &slanted);
        assert!(slanted.iter().zip(&straight).all(|(a, b)| (a - b).norm() < 1e-12));
    }

    #[test]
    fn crossings_are_found_through_windows_of_any_reach() {
        let (board, truth) = (board(), deviations());
        let straight = straight_part(&board, &truth);
        let bent: Vec<Vector3<f64>> = truth.iter().zip(&straight).map(|(d, s)| d - s).collect();
        for reach in [0.2, 0.6, 0.8] {
            let observation = |k: usize| {
                let (col, row) = (k % board.columns(), k / board.columns());
                let mut o = Observation::of_point(Side::Left, nalgebra::Point2::origin(), 0.01);
                (o.col, o.row, o.reach) = (col, row, [reach; 2]);
                o
            };
            let view = View { pair: String::new(), observations: (0..truth.len()).map(observation).collect() };
            let mut bundle = Bundle {
                board: &board,
                views: vec![view],
                rig: RigPrior::new(&World::new(1, 1).rig),
                shape: ShapePrior { in_plane_mm: 0.01, out_of_plane_mm: 0.01, stretch_mm: 0.01 },
                edge_bends_mm: vec![0.0; truth.len()],
            };
            let seen = (0..truth.len())
                .map(|k| truth[k] + seen_off(&board, &bent, (k % board.columns(), k / board.columns()), [reach; 2]))
                .collect();
            let mut values = Values { rig: nalgebra::DVector::zeros(0), deviations_mm: seen, poses: Vec::new() };
            bundle.unbend(&mut values);
            let left = |found: &[Vector3<f64>]| {
                found.iter().zip(&truth).map(|(f, t)| (f - t).norm_squared()).sum::<f64>().sqrt()
            };
            assert!(left(&values.deviations_mm) < 0.05 * left(&vec![Vector3::zeros(); truth.len()]), "{reach}");
            // Every corner is told what its window sees: crossing and offset together are what was seen.
            let o = &bundle.views[0].observations[8];
            assert!(
                (values.deviations_mm[8] + o.seen_off_mm - truth[8] - seen_off(&board, &bent, (2, 1), [reach; 2]))
                    .norm()
                    < 1e-4
            );
        }
    }
}
