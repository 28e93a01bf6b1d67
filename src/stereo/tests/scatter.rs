//! Predicted scatter against the scatter there is.

use nalgebra::{DVector, Matrix2, Point2, Vector2};

use super::*;
use crate::simulate::draws::{Draws, Purpose};
use crate::stereo::board_pose::pair_excess::pair_excess;
use crate::stereo::judge::verdict::{LengthError, Verdict};

/// Noise as fits in windows of whole squares have it: across each edge, half of a corner's noise is that of the edge's
/// other end.
fn with_noise_of_shared_edges(exact: &Corners, sigma_px: f64, seed: u64) -> Corners {
    let mut corners = exact.clone();
    let mut draws = Draws::new(seed, Purpose::Points, 1);
    let (columns, rows) = (corners.board.columns(), corners.board.rows());
    for list in corners.pairs.iter_mut().flat_map(|p| [&mut p.left, &mut p.right]) {
        let mut edges = |lines: usize, pieces: usize| -> Vec<Vec<f64>> {
            (0..lines).map(|_| (0..=pieces).map(|_| draws.normal() * sigma_px / 2.0_f64.sqrt()).collect()).collect()
        };
        let (along_rows, along_columns) = (edges(rows, columns), edges(columns, rows));
        let places: Vec<(usize, usize, Point2<f64>)> = list.iter().map(|c| (c.col, c.row, c.px)).collect();
        let at = |col: usize, row: usize| places.iter().find(|p| (p.0, p.1) == (col, row)).map(|p| p.2);
        for corner in list.iter_mut() {
            let (col, row) = (corner.col, corner.row);
            let next = |there: Option<Point2<f64>>, back: Option<Point2<f64>>| -> Vector2<f64> {
                let t = there.or(back).map_or(Vector2::x(), |p| p - corner.px).normalize();
                Vector2::new(-t.y, t.x)
            };
            let across_row = next(at(col + 1, row), col.checked_sub(1).and_then(|c| at(c, row)));
            let across_column = next(at(col, row + 1), row.checked_sub(1).and_then(|r| at(col, r)));
            let normals = Matrix2::from_rows(&[across_row.transpose(), across_column.transpose()]);
            let inverse = normals.try_inverse().unwrap();
            let piece = |line: &[f64], i: usize| line[i] + line[i + 1];
            // A normal may point either way; that of an edge's both ends must agree in sign, so it is fixed here.
            let sign = |n: &Vector2<f64>| if n.y.abs() > n.x.abs() { n.y.signum() } else { n.x.signum() };
            let offsets = Vector2::new(
                sign(&across_row) * piece(&along_rows[row], col),
                sign(&across_column) * piece(&along_columns[col], row),
            );
            corner.px += inverse * offsets;
            corner.covariance_px2 = Some(inverse * inverse.transpose() * sigma_px * sigma_px);
        }
    }
    corners
}

#[test]
fn corners_that_share_edges_are_worth_less_and_no_fault() {
    let exact = World { sigma_px: 0.0, ..World::new(10, 5) };
    let (mut squares, mut predicted, runs) = (0.0, 0.0, 12);
    for run in 0..runs {
        let corners = with_noise_of_shared_edges(&exact.corners(0), 0.05, run);
        let found = calibrate(&corners, &BROWN4).unwrap();
        let neighbours = found.neighbours;
        // One half between the two ends of an edge, none along it; 11 x 8 corners have 1.78 neighbours each to the
        // right or below.
        assert!((neighbours.across - 0.5).abs() < 0.08 && neighbours.along.abs() < 0.08, "{neighbours:?}");
        assert!((neighbours.inflation() - 1.9).abs() < 0.25, "{neighbours:?}");
        assert!(crate::stereo::judge::residual_correlation::check(&found).white());
        for (i, off) in deviations(&found, &exact).iter().enumerate() {
            let variance = found.covariance[(i, i)];
            squares += off * off / variance;
            predicted += 1.0;
        }
    }
    // Without the allowance this ratio is near 0.7. 12 runs of correlated numbers know it to some 12 %; `cargo bench
    // --bench calibration -- coverage` has each number's.
    let ratio = (predicted / squares).sqrt();
    assert!((0.82..1.25).contains(&ratio), "predicted / true sigma {ratio:.3}");
}

#[test]
fn independent_corners_share_nothing() {
    let found = calibrate(&World::new(10, 5).corners(6), &BROWN4).unwrap();
    assert_eq!(found.neighbours.inflation(), 1.0);
}

#[test]
fn held_out_lengths_are_as_wrong_as_the_corners_make_them() {
    let world = World::new(12, 17);
    let found = calibrate(&world.corners(18), &BROWN4).unwrap();
    let accuracy = held_out::hold_out(&found, None).unwrap();
    assert_eq!(accuracy.pairs.len(), 12);
    assert_eq!(accuracy.ranges.len(), 10 + 7);
    // 0.05 px is 0.056 mm of depth at 550 mm; boards tilted by 35 degrees turn it into 0.045 mm of length; the worst of
    // 30 000 lies at four to six sigmas.
    let extremes = accuracy.extremes;
    assert!((0.1..0.4).contains(&extremes.max_abs_error_mm), "{}", extremes.max_abs_error_mm);
    assert_eq!(extremes.verdict(1.0), Verdict::Pass);
    assert_eq!(extremes.verdict(0.01), Verdict::Fail);
    // The error itself as the tolerance leaves no room for any uncertainty.
    assert_eq!(extremes.verdict(extremes.max_abs_error_mm), Verdict::Undecided);
    // Corners of 0.05 px leave what was said above; the calibration by twelve pairs a fraction of it.
    let LengthError { corners_mm, calibration_mm, .. } = extremes.largest;
    assert!((0.01..0.1).contains(&corners_mm) && (0.001..corners_mm).contains(&calibration_mm), "{extremes:?}");
    // Each length has its own uncertainty: the one that may be most wrong need not be the one that came out most wrong.
    assert!(extremes.largest.at_most_mm() >= extremes.max_abs_error_mm);
    // Some hundreds of points with corners that scatter independently know the mean to a tenth.
    assert!((accuracy.rays_chi_square - 1.0).abs() < 0.2, "{}", accuracy.rays_chi_square);
    // A certificate of 30 mm uncertainty decides nothing.
    let certified = held_out::hold_out(&found, Some(30.0)).unwrap();
    assert!(certified.extremes.largest.expanded_uncertainty_mm() > 30.0);
    assert_eq!(certified.extremes.verdict(1.0), Verdict::Undecided);
}

#[test]
fn a_board_whose_print_scatters_is_told_from_corners_that_do() {
    let mut world = World::new(12, 17);
    world.sigma_px = 0.01;
    world.print_mm = 0.03;
    let found = calibrate(&world.corners(18), &BROWN4).unwrap();
    let judged = synthetic::judged(&found, Vec::new(), Standards::default(), 0.05);
    // 0.02 mm (root mean square) is 0.07 px here, seven times the corners' own scatter.
    assert!(judged.facts.accuracy.rays_chi_square < 0.1, "{}", judged.facts.accuracy.rays_chi_square);
    assert!(judged.warnings.iter().any(|w| w.text.contains("corners' places on the board")), "{:?}", judged.warnings);
}

#[test]
fn the_rigs_covariance_holds_for_print_that_is_seen_through_windows() {
    // Squared distance from the truth in units of the covariance, a number, the mean over rigs.
    let chi_square = |windows_known: bool| {
        let of = |seed: u64| {
            let mut world = World::new(10, seed);
            (world.sigma_px, world.print_mm, world.print_seed, world.reach) = (0.01, 0.02, seed, 0.8);
            let mut corners = world.corners(100 + seed);
            if !windows_known {
                let pairs = corners.pairs.iter_mut();
                pairs.flat_map(|p| p.left.iter_mut().chain(&mut p.right)).for_each(|corner| corner.reach = None);
            }
            let found = calibrate(&corners, &BROWN4).unwrap();
            let [found_at, truth_at] = [found.rig(), &world.rig]
                .map(|rig| DVector::from_vec(vec![rig.left.fx, rig.left.cx, rig.right.fx, rig.right.cx]));
            let covariance = covariance_of(&found, &["left.fx", "left.cx", "right.fx", "right.cx"]);
            let off = found_at - truth_at;
            off.dot(&(covariance.try_inverse().unwrap() * &off)) / 4.0
        };
        (0..30).map(of).sum::<f64>() / 30.0
    };
    let known = chi_square(true);
    assert!((0.6..1.4).contains(&known), "{known}");
    // As if each corner were its crossing's own: what is smooth over the board is then taken for less than it is.
    let unknown = chi_square(false);
    assert!(unknown > 1.3 * known, "{known} {unknown}");
}

/// Few pairs go after the rig's own numbers; how far they scatter about it is told no smaller for that.
#[test]
fn four_pairs_scatter_about_their_rig_as_far_as_many_do() {
    let excess = |pairs: usize, turn_deg: f64| {
        const WORLDS: u64 = 3;
        let of =
            |seed| pair_excess(&calibrate(&World::new(pairs, seed).corners_by_hand(seed, turn_deg), &BROWN4).unwrap());
        (700..700 + WORLDS).map(|seed| of(seed).ln()).sum::<f64>() / WORLDS as f64
    };
    let (few, many) = (excess(4, 0.03).exp(), excess(20, 0.03).exp());
    assert!(many > 2.0 && few > 0.95 * many && few < 2.5 * many, "{few} {many}");
    assert!(excess(4, 0.0).exp() < 1.3);
}
