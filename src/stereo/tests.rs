//! The calibration as a whole against known truth: recovery, predicted scatter, symmetry, and what must be refused.

use nalgebra::{Matrix2, Matrix4, Point2, Vector2, Vector3, Vector4, Vector6};

use crate::geometry::transform;
use crate::imaging::{Corners, PairCorners};
use crate::simulate::draws::{Draws, Purpose};
use crate::stereo::calibrate::{Calibration, calibrate};
use crate::stereo::data::view::View;
use crate::stereo::judge::assessment::{Demand, Judged};
use crate::stereo::judge::held_out;
use crate::stereo::judge::verdict::{LengthError, Verdict};
use crate::stereo::model::parameters::Shared;
use crate::stereo::select::lens_ladder::Options;
use crate::stereo::synthetic::World;
use crate::stereo::target::series::{self, Knowledge, Seen};
use crate::stereo::triangulate::{RigCovariance, common, triangulate};
use crate::stereo::{Error, Lens};

const BROWN4: Options = Options { lens: Some(Lens::Brown4), shape: Some(false) };

fn swapped(corners: &Corners) -> Corners {
    let mut swapped = corners.clone();
    std::mem::swap(&mut swapped.left_size, &mut swapped.right_size);
    for PairCorners { left, right, .. } in &mut swapped.pairs {
        std::mem::swap(left, right);
    }
    swapped
}

/// Deviations of the shared numbers from the truth, in the coordinates of the covariance.
fn deviations(calibration: &Calibration, world: &World) -> Vec<f64> {
    let layout = calibration.layout;
    let truth = Shared { rig: world.rig.clone(), shape_mm: [world.bow_mm[0], world.bow_mm[1], world.twist_mm] };
    let found = layout.numbers(&calibration.values.shared);
    let mut off: Vec<f64> = found.iter().zip(layout.numbers(&truth)).map(|(a, b)| a - b).collect();
    // A rotation's covariance is that of the small turn on its left.
    let turn = calibration.rig().right_from_left.rotation * world.rig.right_from_left.rotation.inverse();
    off[layout.transform_start()..][..3].copy_from_slice(turn.scaled_axis().as_slice());
    off
}

#[test]
fn exact_corners_give_the_exact_rig() {
    let mut world = World::new(8, 1);
    world.sigma_px = 0.0;
    let mut corners = world.corners(1);
    for corner in corners.pairs.iter_mut().flat_map(|p| p.left.iter_mut().chain(&mut p.right)) {
        corner.covariance_px2 = None;
    }
    let found = calibrate(&corners, &BROWN4).unwrap();
    // Rounding of pixels near 1000 px, magnified by the geometry.
    assert!((found.rig().left.fx - world.rig.left.fx).abs() < 1e-6, "{}", found.rig().left.fx);
    assert!((found.rig().baseline_mm() - world.rig.baseline_mm()).abs() < 1e-7);
}

#[test]
fn swapping_the_cameras_inverts_the_rig() {
    let corners = World::new(9, 2).corners(3);
    let straight = calibrate(&corners, &BROWN4).unwrap();
    let crossed = calibrate(&swapped(&corners), &BROWN4).unwrap();
    let back = crossed.rig().right_from_left.inverse();
    let off = (straight.rig().right_from_left.to_matrix() - back.to_matrix()).amax();
    assert!(off < 1e-6, "the rigs differ by {off}");
    assert!((straight.rig().left.fx - crossed.rig().right.fx).abs() < 1e-5);
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let corners = World::new(9, 2).corners(3);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| calibrate(&corners, &Options::default()).unwrap())
    };
    assert_eq!(with(1), with(3));
}

/// Noise as fits in windows of whole squares have it: across each edge, half of a corner's noise is that of the edge's other end.
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
    let (mut squares, mut predicted, runs) = (0.0, 0.0, 30);
    for run in 0..runs {
        let corners = with_noise_of_shared_edges(&exact.corners(0), 0.05, run);
        let found = calibrate(&corners, &BROWN4).unwrap();
        let neighbours = found.neighbours;
        // One half between the two ends of an edge, none along it; 11 x 8 corners have 1.78 neighbours each to the right or below.
        assert!((neighbours.across - 0.5).abs() < 0.08 && neighbours.along.abs() < 0.08, "{neighbours:?}");
        assert!((neighbours.inflation() - 1.9).abs() < 0.25, "{neighbours:?}");
        assert!(crate::stereo::judge::residual_correlation::check(&found).white());
        for (i, off) in deviations(&found, &exact).iter().enumerate() {
            let variance = found.uncertainty.shared[(i, i)];
            squares += off * off / variance;
            predicted += 1.0;
        }
    }
    // Without the allowance this ratio is near 0.7. 30 runs of correlated numbers know it to some 8 %.
    let ratio = (predicted / squares).sqrt();
    assert!((0.85..1.2).contains(&ratio), "predicted / true sigma {ratio:.3}");
}

#[test]
fn independent_corners_share_nothing() {
    let found = calibrate(&World::new(10, 5).corners(6), &BROWN4).unwrap();
    assert_eq!(found.neighbours.inflation(), 1.0);
}

/// Spread over calibrations of fresh noise against the predicted standard deviations.
struct Spread {
    /// The shared numbers' names, and predicted over true standard deviation of each.
    names: Vec<String>,
    ratios: Vec<f64>,
    /// Share of the 95 % intervals that hold the truth.
    inside: f64,
    /// The same ratio for lengths of 70 mm on boards that calibrated nothing: in all, and the calibration's share alone.
    lengths: f64,
    lengths_by_calibration: f64,
}

fn monte_carlo(runs: u64, options: &Options) -> Spread {
    let world = World::new(10, 5);
    let (mut squares, mut predicted, mut inside, mut names) = (Vec::new(), Vec::new(), 0usize, Vec::new());
    let (mut lengths, mut by_calibration) = (Ratio::default(), Ratio::default());
    for run in 0..runs {
        let found = calibrate(&world.corners(1000 + run), options).unwrap();
        let off = deviations(&found, &world);
        squares.resize(off.len(), 0.0);
        predicted.resize(off.len(), 0.0);
        for (i, off) in off.iter().enumerate() {
            let variance = found.uncertainty.shared[(i, i)];
            squares[i] += off * off;
            predicted[i] += variance;
            inside += usize::from(off.abs() <= 1.96 * variance.sqrt());
        }
        names = found.layout.names();
        lengths_of_70_mm(&found, &world, 5000 + run, &mut lengths);
        lengths_of_70_mm(&found, &World { sigma_px: 1e-9, ..world.clone() }, 0, &mut by_calibration);
    }
    let ratios = squares.iter().zip(&predicted).map(|(s, p): (&f64, &f64)| (p / s).sqrt()).collect::<Vec<f64>>();
    let total = ratios.len() as f64 * runs as f64;
    let inside = inside as f64 / total;
    Spread { names, ratios, inside, lengths: lengths.root(), lengths_by_calibration: by_calibration.root() }
}

#[derive(Default)]
struct Ratio {
    predicted: f64,
    squares: f64,
}

impl Ratio {
    fn root(&self) -> f64 {
        (self.predicted / self.squares).sqrt()
    }
}

/// The four sides of a square of 70 mm in six poses, measured by a calibrated rig in corners as noisy as the world's.
fn lengths_of_70_mm(calibration: &Calibration, world: &World, seed: u64, ratio: &mut Ratio) {
    let board = crate::imaging::Board { squares: "9x9".parse().unwrap(), square_mm: 10.0 };
    let world = World { board, poses: World::new(6, 77).poses, ..world.clone() };
    let covariance = RigCovariance::new(calibration.rig().covariance.as_ref().unwrap());
    for pair in &world.corners(seed).pairs {
        let mut view = View::new(&board, pair, 0);
        // Each world's own noise: what the corners say of themselves.
        for o in &mut view.observations {
            o.whitener = nalgebra::Matrix2::identity() / world.sigma_px;
        }
        let seen = common(&view);
        let point = |col: usize, row: usize| {
            let (left, right) = seen.iter().find(|(l, _)| (l.col, l.row) == (col, row))?;
            triangulate(calibration.rig(), left, right)
        };
        for (a, b) in [((0, 0), (7, 0)), ((0, 7), (7, 7)), ((0, 0), (0, 7)), ((7, 0), (7, 7))] {
            let (Some(a), Some(b)) = (point(a.0, a.1), point(b.0, b.1)) else { continue };
            let off = (b.point_mm - a.point_mm).norm() - 70.0;
            ratio.squares += off * off;
            ratio.predicted += a.corner_variance_mm2(&b) + covariance.length_variance_mm2(&a, &b);
        }
    }
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

/// Calibrations of a Monte Carlo; more where the environment says so, with the limits that so many allow.
fn monte_carlo_runs() -> u64 {
    std::env::var("STEREOCAL_MONTE_CARLO").ok().and_then(|n| n.parse().ok()).unwrap_or(40)
}

#[test]
fn predicted_sigmas_are_the_true_ones() {
    let runs = monte_carlo_runs();
    for shape in [false, true] {
        let spread = monte_carlo(runs, &Options { lens: Some(Lens::Brown4), shape: Some(shape) });
        let Spread { names, ratios, inside, lengths, lengths_by_calibration } = &spread;
        // So many runs know a standard deviation to 1 / sqrt(2 runs); the numbers are correlated, so their median is hardly better.
        let known_to = 1.0 / (2.0 * runs as f64).sqrt();
        let table: Vec<String> = names.iter().zip(ratios).map(|(name, ratio)| format!("{name} {ratio:.3}")).collect();
        let said = format!(
            "{runs} runs, shape free: {shape}; predicted / true sigma: median {:.3}, 95 % intervals hold {:.1} %, \
             70 mm lengths {lengths:.3}, their calibration's share {lengths_by_calibration:.3}\n{}",
            median(ratios),
            100.0 * inside,
            table.join("\n")
        );
        println!("{said}");
        assert!((median(ratios) - 1.0).abs() < 2.2 * known_to, "{said}");
        assert!(ratios.iter().all(|r| (r - 1.0).abs() < 4.5 * known_to), "{said}");
        assert!((0.91..0.985).contains(inside), "{said}");
        // 24 lengths a run with corners of their own: known better than any number of the rig.
        assert!((lengths - 1.0).abs() < 0.1, "{said}");
        assert!((lengths_by_calibration - 1.0).abs() < 4.0 * known_to, "{said}");
    }
}

#[test]
fn a_bowed_board_is_seen_and_corrected() {
    let mut world = World::new(14, 7);
    world.bow_mm = [0.05, 0.03];
    let corners = world.corners(8);
    let found = calibrate(&corners, &Options::default()).unwrap();
    assert!(found.layout.shape, "the bow was not noticed");
    for (found, truth) in found.values.shared.shape_mm.iter().zip(world.bow_mm) {
        // About four of its standard deviations here.
        assert!((found - truth).abs() < 0.01, "{found} for {truth}");
    }
    assert!(!calibrate(&World::new(14, 7).corners(8), &Options::default()).unwrap().layout.shape);
}

#[test]
fn a_twisted_board_is_seen_and_corrected() {
    for twist_mm in [0.05, 0.2, -0.2] {
        let mut world = World::paper(12, 47);
        world.twist_mm = twist_mm;
        let found = calibrate(&world.corners(48), &Options::default()).unwrap();
        assert!(found.layout.shape, "a twist of {twist_mm} mm was not noticed");
        let worst = worst_point_mm(&found, &world);
        let [kx, ky, kxy] = found.values.shared.shape_mm;
        println!("twist {twist_mm} mm found as {kx:.4} {ky:.4} {kxy:.4}, worst point {worst:.4} mm");
        assert!(
            (kxy - twist_mm).abs() < 0.005 && kx.abs().max(ky.abs()) < 0.01 && worst < 0.015,
            "{kx} {ky} {kxy} {worst}"
        );
    }
}

#[test]
fn a_pair_that_was_not_taken_at_once_is_named_and_left_out() {
    let world = World::new(9, 11);
    let mut corners = world.corners(12);
    let mut moved = world.clone();
    moved.poses[4] = transform(Vector3::new(0.05, 0.1, 0.0), Vector3::new(4.0, -6.0, 10.0)) * moved.poses[4];
    corners.pairs[4].right = moved.corners(12).pairs[4].right.clone();
    let found = calibrate(&corners, &Options::default()).unwrap();
    assert_eq!(found.skipped.len(), 1);
    assert!(found.skipped[0].pair == "04" && found.skipped[0].reason.contains("same time"), "{:?}", found.skipped);
    assert!((found.rig().baseline_mm() - world.rig.baseline_mm()).abs() < 0.1);
}

#[test]
fn a_gross_corner_is_an_outlier_and_changes_nothing() {
    let world = World::new(9, 11);
    let mut corners = world.corners(12);
    let clean = calibrate(&corners, &BROWN4).unwrap();
    corners.pairs[2].left[17].px.x += 40.0;
    let found = calibrate(&corners, &BROWN4).unwrap();
    let view = found.views.iter().find(|view| view.pair == "02").unwrap();
    let moved = view.observations.iter().find(|o| o.px == corners.pairs[2].left[17].px).unwrap();
    assert!(!moved.active);
    let outliers = found.views.iter().flat_map(|v| &v.observations).filter(|o| !o.active).count();
    // One in a million Gaussian corners lies beyond the limit; there are 1584.
    assert!(outliers <= 2, "{outliers}");
    assert!((found.rig().baseline_mm() - clean.rig().baseline_mm()).abs() < 0.02);
}

#[test]
fn pairs_of_nothing_in_common_are_refused_by_name() {
    let world = World::new(8, 13);
    let mut corners = world.corners(14);
    // Every right picture belongs to another left one.
    let mut rights: Vec<_> = corners.pairs.iter().map(|p| p.right.clone()).collect();
    rights.rotate_left(3);
    for (pair, right) in corners.pairs.iter_mut().zip(rights) {
        pair.right = right;
    }
    match calibrate(&corners, &Options::default()) {
        Err(Error::Contradiction { agreeing, total, bad }) => assert!(agreeing <= 4 && total == 8 && bad.len() >= 4),
        other => panic!("{:?}", other.map(|c| c.rms_px)),
    }
}

#[test]
fn three_pairs_are_too_few() {
    let corners = World::new(3, 1).corners(1);
    assert!(matches!(calibrate(&corners, &Options::default()), Err(Error::TooFewPairs { found: 3, total: 3, .. })));
}

#[test]
fn boards_that_are_never_tilted_do_not_tell_the_cameras() {
    let mut world = World::new(8, 1);
    // Side by side and square to the board, so that neither camera sees it from the side.
    world.rig.right_from_left = transform(Vector3::zeros(), Vector3::new(-40.0, 0.0, 0.0));
    for (i, pose) in world.poses.iter_mut().enumerate() {
        *pose = transform(Vector3::new(0.0, 0.0, 0.1 * i as f64), Vector3::new(i as f64, -(i as f64), 550.0));
    }
    let refused = calibrate(&world.corners(1), &Options::default());
    let told = |c: Calibration| (c.rig().left.fx, c.uncertainty.shared[(0, 0)].sqrt(), c.layout);
    assert!(matches!(refused, Err(Error::Undetermined { .. })), "{:?}", refused.map(told));
}

#[test]
fn held_out_lengths_are_as_wrong_as_the_corners_make_them() {
    let world = World::new(12, 17);
    let found = calibrate(&world.corners(18), &BROWN4).unwrap();
    let accuracy = held_out::hold_out(&found, None).unwrap();
    assert_eq!(accuracy.pairs.len(), 12);
    assert_eq!(accuracy.ranges.len(), 10 + 7);
    // 0.05 px is 0.056 mm of depth at 550 mm; boards tilted by 35 degrees turn it into 0.045 mm of length; the worst of 30 000
    // lies at four to six sigmas.
    let extremes = accuracy.extremes;
    assert!((0.1..0.4).contains(&extremes.max_abs_error_mm), "{}", extremes.max_abs_error_mm);
    assert_eq!(accuracy.verdict(1.0), Verdict::Pass);
    assert_eq!(accuracy.verdict(0.01), Verdict::Fail);
    // The error itself as the tolerance leaves no room for any uncertainty.
    assert_eq!(accuracy.verdict(extremes.max_abs_error_mm), Verdict::Undecided);
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
    assert_eq!(certified.verdict(1.0), Verdict::Undecided);
}

#[test]
fn a_board_whose_print_scatters_is_told_from_corners_that_do() {
    let mut world = World::new(12, 17);
    world.sigma_px = 0.01;
    world.print_mm = 0.03;
    let found = calibrate(&world.corners(18), &BROWN4).unwrap();
    let accuracy = held_out::hold_out(&found, None).unwrap();
    // 0.02 mm (root mean square) is 0.07 px here, seven times the corners' own scatter.
    assert!(accuracy.rays_chi_square < 0.1, "{}", accuracy.rays_chi_square);
    let demand = Demand { tolerance_mm: 0.05, board_uncertainty_mm: None };
    let judged = Judged::new(&found, accuracy, None, &demand);
    assert!(judged.warnings.iter().any(|w| w.contains("places of the corners on the board")), "{:?}", judged.warnings);
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
            let off = Vector4::new(
                found.rig().left.fx - world.rig.left.fx,
                found.rig().left.cx - world.rig.left.cx,
                found.rig().right.fx - world.rig.right.fx,
                found.rig().right.cx - world.rig.right.cx,
            );
            let names = ["left.fx", "left.cx", "right.fx", "right.cx"];
            let order = &found.rig().covariance.as_ref().unwrap().order;
            let at = names.map(|name| order.iter().position(|n| n == name).unwrap());
            let covariance = Matrix4::from_fn(|i, j| found.uncertainty.shared[(at[i], at[j])]);
            off.dot(&(covariance.try_inverse().unwrap() * off)) / 4.0
        };
        (0..30).map(of).sum::<f64>() / 30.0
    };
    let known = chi_square(true);
    assert!((0.6..1.4).contains(&known), "{known}");
    // As if each corner were its crossing's own: what is smooth over the board is then taken for less than it is.
    let unknown = chi_square(false);
    assert!(unknown > 1.3 * known, "{known} {unknown}");
}

fn judged(corners: &Corners, options: &Options, tolerance_mm: f64) -> Judged {
    let found = calibrate(corners, options).unwrap();
    let accuracy = held_out::hold_out(&found, None).unwrap();
    Judged::new(&found, accuracy, None, &Demand { tolerance_mm, board_uncertainty_mm: None })
}

#[test]
fn a_lens_model_that_the_corners_refute_is_no_witness() {
    // Without the tangential terms the principal points move by hundreds of their sigmas, and chi-squared with them.
    let judged = judged(&World::new(14, 19).corners(20), &Options::default(), 1.0);
    assert_eq!(judged.disagreements, []);
}

#[test]
fn a_lens_term_too_weak_to_be_chosen_is_a_spread_of_lengths() {
    let mut world = World::new(14, 19);
    for camera in [&mut world.rig.left, &mut world.rig.right] {
        camera.lens = Lens::Brown5;
        // A pixel at the border of the picture, 0.3 of the distance.
        camera.distortion[4] = 1.0 / 2000.0 / 0.3_f64.powi(7);
    }
    let corners = world.corners(20);
    let judged = judged(&corners, &BROWN4, 1.0);
    let spread = judged.disagreements.iter().find(|d| d.other == "brown5").expect("brown5 measures other lengths");
    assert!(spread.chi_square_fall > spread.chance && spread.length_change_mm > 0.01, "{spread:?}");
    let line = judged.evidence.iter().find(|line| line.what == "spread of admissible models").unwrap();
    assert!(line.value.is_some_and(|mm| mm >= spread.length_change_mm), "{line:?}");
}

/// All poses of a world as a robot's run.
fn run_of(corners: crate::imaging::Corners) -> Vec<Seen> {
    let at = |pose: &str| crate::measurements::RobotPose {
        pose: pose.to_owned(),
        group: "1".to_owned(),
        role: crate::measurements::Role::Sample,
        joints_deg: vec![0.0],
        slides: Vec::new(),
    };
    corners.pairs.into_iter().map(|pair| Seen { at: at(&pair.pair), corners: Ok(pair) }).collect()
}

#[test]
fn the_targets_scatter_is_the_predicted_one() {
    let mut world = World::new(60, 23);
    world.board = crate::imaging::Board { squares: "7x6".parse().unwrap(), square_mm: 10.0 };
    let known =
        Knowledge { rig: world.rig.clone(), noise: None, board: world.board, crossing_mm: 0.01, tolerance_mm: 0.05 };
    let mut sums = Vector6::<f64>::zeros();
    let measured = series::measure(&known, run_of(world.corners(24)));
    for (pose, truth) in measured.poses.iter().zip(&world.poses) {
        let pose = pose.target.as_ref().unwrap();
        let turn = (pose.cam_from_board.rotation * truth.rotation.inverse()).scaled_axis();
        let shift = pose.cam_from_board.translation.vector - truth.translation.vector;
        for i in 0..3 {
            sums[i] += turn[i] * turn[i] / pose.covariance[(i, i)];
            sums[3 + i] += shift[i] * shift[i] / pose.covariance[(3 + i, 3 + i)];
        }
    }
    for sum in sums.iter() {
        // 60 poses: chi-square over its freedom is 1 +- 0.18; the target's shape is found as well and shared by all.
        assert!((0.5..1.7).contains(&(sum / 60.0)), "{sums}");
    }
    assert_eq!(measured.judgement, crate::stereo::target::judgement::Judgement::Agrees);
}

#[test]
fn a_target_of_another_size_and_a_rig_that_turned_are_named() {
    let mut world = World::new(30, 29);
    world.board = crate::imaging::Board { squares: "7x6".parse().unwrap(), square_mm: 10.0 };
    let corners = world.corners(30);
    let judged = |rig: &crate::stereo::Rig, square_mm: f64| {
        let board = crate::imaging::Board { square_mm, ..world.board };
        let known = Knowledge { rig: rig.clone(), noise: None, board, crossing_mm: 0.01, tolerance_mm: 0.05 };
        let judgement = series::measure(&known, run_of(corners.clone())).judgement;
        judgement.describe(rig, square_mm).unwrap_or_default()
    };
    assert_eq!(judged(&world.rig, 10.0), "");
    let pitch = judged(&world.rig, 12.0);
    assert!(pitch.contains("squares are 10.0") || pitch.contains("squares are 9.99"), "{pitch}");
    let mut turned = world.rig.clone();
    turned.right_from_left =
        transform(Vector3::new(0.0, 0.1_f64.to_radians(), 0.0), Vector3::zeros()) * turned.right_from_left;
    let yaw = judged(&turned, 10.0);
    assert!((yaw.contains("-0.10") || yaw.contains("-0.09")) && yaw.contains("yaw"), "{yaw}");
    let exchanged = crate::stereo::Rig {
        left: turned.right,
        right: turned.left,
        right_from_left: world.rig.right_from_left.inverse(),
        covariance: None,
    };
    assert!(judged(&exchanged, 10.0).contains("exchanged"));
}

/// Largest deviation of points in the working volume, mm, measured from exact pixels.
fn worst_point_mm(calibration: &Calibration, world: &World) -> f64 {
    let exact = World { sigma_px: 1e-9, bow_mm: [0.0; 2], twist_mm: 0.0, ..world.clone() };
    let mut worst: f64 = 0.0;
    for (pair, pose) in exact.corners(1).pairs.iter().zip(&exact.poses) {
        let view = View::new(&exact.board, pair, 0);
        for (left, right) in common(&view) {
            let found = triangulate(calibration.rig(), left, right).unwrap();
            worst = worst.max((found.point_mm - pose * left.board_mm).norm());
        }
    }
    worst
}

#[test]
fn the_papers_rig_measures_to_two_micrometres() {
    let world = World::paper(12, 41);
    let found = calibrate(&world.corners(42), &Options::default()).unwrap();
    let accuracy = held_out::hold_out(&found, None).unwrap();
    let to_70 = accuracy.ranges.iter().filter(|r| r.nominal_mm <= 70.0).map(|r| r.max_abs_error_mm).fold(0.0, f64::max);
    println!("held out up to 70 mm {to_70:.5} mm, points {:.5} mm, {:?}", worst_point_mm(&found, &world), found.layout);
    // Corners of 0.005 px scatter by 0.4 um across and 1 um in depth; the worst of 60 000 lengths lies at five sigmas.
    assert!(to_70 < 0.006, "{to_70}");
    assert!(worst_point_mm(&found, &world) < 0.005);
}

#[test]
fn a_board_bowed_by_50_micrometres_costs_little_once_its_shape_is_free() {
    let mut world = World::paper(12, 43);
    world.bow_mm = [0.05, 0.0];
    let found = calibrate(&world.corners(44), &Options::default()).unwrap();
    let flat = calibrate(&world.corners(44), &Options { shape: Some(false), ..Options::default() }).unwrap();
    let (bowed, flat) = (worst_point_mm(&found, &world), worst_point_mm(&flat, &world));
    println!("worst point with the shape free {bowed:.5} mm, taken as flat {flat:.5} mm");
    assert!(found.layout.shape && bowed < 0.015 && flat > bowed, "{bowed} {flat}");
}

#[test]
fn a_lens_term_of_half_a_pixel_is_found_by_the_ladder() {
    let mut world = World::paper(14, 45);
    for camera in [&mut world.rig.left, &mut world.rig.right] {
        camera.lens = Lens::Brown5;
        // 0.5 px at the border of the field, 0.26 of the distance.
        camera.distortion[4] = 0.5 / 10_000.0 / 0.256_f64.powi(7);
    }
    let corners = world.corners(46);
    let found = calibrate(&corners, &Options::default()).unwrap();
    let lens = found.layout.left.unwrap();
    println!("{lens:?}, worst point {:.5} mm", worst_point_mm(&found, &world));
    assert!(lens >= Lens::Brown5 && worst_point_mm(&found, &world) < 0.015, "{lens:?}");
    let forced = calibrate(&corners, &BROWN4).unwrap();
    assert!(!crate::stereo::judge::residual_correlation::check(&forced).white(), "{:?}", forced.neighbours);
}
