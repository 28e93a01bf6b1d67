//! Lenses and boards that are not as simple as they are drawn.

use nalgebra::Vector3;

use super::*;
use crate::geometry::transform;
use crate::imaging::{Board, Squares};
use crate::stereo::Lens;
use crate::stereo::{Camera, Rig};

#[test]
fn a_bowed_board_is_seen_and_corrected() {
    let world = World { bow_mm: [0.05, 0.03], ..World::new(14, 7) };
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
    for twist_mm in [0.05, -0.2] {
        let world = World { twist_mm, ..World::paper(12, 47) };
        let found = calibrate(&world.corners(48), &Options::default()).unwrap();
        assert!(found.layout.shape, "a twist of {twist_mm} mm was not noticed");
        let worst = worst_point_mm(&found, &world);
        let [kx, ky, kxy] = found.values.shared.shape_mm;
        assert!(
            (kxy - twist_mm).abs() < 0.005 && kx.abs().max(ky.abs()) < 0.01 && worst < 0.015,
            "{kx} {ky} {kxy} {worst}"
        );
    }
}

#[test]
fn a_lens_model_that_the_corners_refute_is_no_witness() {
    // Without the tangential terms the principal points move by hundreds of their sigmas, and chi-squared with them.
    let judged = judged(&World::new(14, 19).corners(20), &Options::default(), 1.0);
    assert_eq!(judged.facts.disagreements, []);
}

#[test]
fn a_lens_term_too_weak_to_be_chosen_is_a_spread_of_lengths() {
    // A pixel at the border of the picture, 0.3 of the distance.
    let world = World::new(14, 19).with_lens(Lens::Brown5, |d| d[4] = 1.0 / 2000.0 / 0.3_f64.powi(7));
    let corners = world.corners(20);
    let judged = judged(&corners, &BROWN4, 1.0);
    let spread =
        judged.facts.disagreements.iter().find(|d| d.other == "brown5").expect("brown5 measures other lengths");
    assert!(spread.chi_square_fall > spread.chance && spread.length_change_mm > 0.01, "{spread:?}");
    let line = judged.evidence.iter().find(|line| line.what == "spread of admissible models").unwrap();
    assert!(line.value.is_some_and(|mm| mm >= spread.length_change_mm), "{line:?}");
}

/// Largest deviation of points in the working volume, mm, measured from exact pixels.
fn worst_point_mm(calibration: &Calibration, world: &World) -> f64 {
    let measured = world.measured_exactly(calibration.rig());
    measured.iter().flatten().map(|[truth, found]| (found - truth).norm()).fold(0.0, f64::max)
}

#[test]
fn the_papers_rig_measures_to_two_micrometres() {
    let world = World::paper(12, 41);
    let found = calibrate(&world.corners(42), &Options::default()).unwrap();
    let accuracy = held_out::hold_out(&found, None).unwrap();
    let to_70 = accuracy.ranges.iter().filter(|r| r.nominal_mm <= 70.0).map(|r| r.max_abs_error_mm).fold(0.0, f64::max);
    // Corners of 0.005 px scatter by 0.4 um across and 1 um in depth; the worst of 60 000 lengths lies at five sigmas.
    assert!(to_70 < 0.006, "{to_70}");
    assert!(worst_point_mm(&found, &world) < 0.005);
}

#[test]
fn a_board_bowed_by_50_micrometres_costs_little_once_its_shape_is_free() {
    let world = World { bow_mm: [0.05, 0.0], ..World::paper(12, 43) };
    let found = calibrate(&world.corners(44), &Options::default()).unwrap();
    let flat = calibrate(&world.corners(44), &Options { shape: Some(false), ..Options::default() }).unwrap();
    let (bowed, flat) = (worst_point_mm(&found, &world), worst_point_mm(&flat, &world));
    assert!(found.layout.shape && bowed < 0.015 && flat > bowed, "{bowed} {flat}");
}

#[test]
fn a_lens_term_of_half_a_pixel_is_found_by_the_ladder() {
    // 0.5 px at the border of the field, 0.26 of the distance.
    let world = World::paper(14, 45).with_lens(Lens::Brown5, |d| d[4] = 0.5 / 10_000.0 / 0.256_f64.powi(7));
    let corners = world.corners(46);
    let found = calibrate(&corners, &Options::default()).unwrap();
    let lens = found.layout.left.unwrap();
    assert!(lens >= Lens::Brown5 && worst_point_mm(&found, &world) < 0.015, "{lens:?}");
    let forced = calibrate(&corners, &BROWN4).unwrap();
    assert!(!crate::stereo::judge::residual_correlation::check(&forced).white(), "{:?}", forced.neighbours);
}

#[test]
fn the_borders_of_a_wide_picture_are_no_outliers() {
    let mut camera = Camera::pinhole(1280, 960, 617.0);
    camera.lens = Lens::Rational8;
    camera.distortion[..8].copy_from_slice(&[0.37, -0.18, -1e-4, 2e-4, 0.003, 0.74, -0.18, -0.02]);
    let right = Camera { fx: 615.0, cx: 645.0, ..camera };
    let between = transform(Vector3::new(0.01, 0.02, -0.005), Vector3::new(-67.0, 0.3, 1.0));
    let mut world = World::new(10, 5);
    world.rig = Rig { left: camera, right, right_from_left: between, covariance: None };
    for (i, pose) in world.poses.iter_mut().enumerate() {
        // One pair in three reaches to a border on the left, where 200 px are missing of what a lens without distortion
        // shows.
        let aside = if i % 3 == 0 { -120.0 } else { 8.0 * i as f64 };
        let turn = Vector3::new(0.3 - 0.07 * i as f64, 0.1 * (i as f64 - 4.0), 0.05 * i as f64);
        *pose = transform(turn, Vector3::new(aside, 5.0 * i as f64 - 20.0, 170.0 + 6.0 * i as f64));
    }
    let found = calibrate(&world.corners(6), &Options::default()).unwrap();
    let lens = found.layout.left.unwrap();
    let px = |found: &Calibration| found.noise.typical_px(&found.views);
    assert!(lens >= Lens::Rational8 && px(&found) < 1.2 * world.sigma_px, "{lens:?} {}", px(&found));
    assert!((found.rig().left.fx - 617.0).abs() < 1.0, "{}", found.rig().left.fx);
    // With the simplest lens they are, and nothing says so but how far off they lie.
    let simple = calibrate(&world.corners(6), &Options { lens: Some(Lens::Brown5), ..BROWN4 }).unwrap();
    assert!(px(&simple) > 1.5 * world.sigma_px && simple.rms_px() > 10.0 * px(&simple), "{}", px(&simple));
}

#[test]
fn a_prism_needs_no_rational_terms() {
    let board = Board::checker(Squares { columns: 20, rows: 20 }, 10.0);
    let world = World { board, sigma_px: 0.006, print_mm: 0.001, ..World::new(16, 0) };
    // 1.5 px at the corners of the picture.
    let world = world.with_lens(Lens::ThinPrism12, |d| (d[8], d[10]) = (4.5e-3, -3e-3));
    let corners = world.corners(50);
    for asked in [None, Some(Lens::ThinPrism12)] {
        let found = calibrate(&corners, &Options { lens: asked, ..Options::default() }).unwrap();
        assert!(found.layout.left >= Some(Lens::ThinPrism12), "{:?}", found.layout.left);
        assert!(found.rms_px() < 0.015, "asked for {asked:?}: {} px", found.rms_px());
        // Free ones would run along the valley where they are exchanged for the radial terms.
        let rational = found.rig().left.distortion[5].abs();
        assert!(asked.is_some() || rational < 1e-3, "k4 {rational}");
    }
}

#[test]
fn what_a_simple_lens_lacks_is_no_scatter_of_the_pairs() {
    // Rational terms and a prism of a pixel: either alone explains little of what is left, and what the simplest lens
    // leaves scatters the pairs.
    let world = World { sigma_px: 0.002, print_mm: 0.001, ..World::paper(16, 0) };
    let distortion = [0.25, 0.12, 2e-4, -3e-4, 0.02, 0.35, 0.18, 0.03, 1.5e-3, 0.0, -1e-3];
    let world = world.with_lens(Lens::ThinPrism12, |d| d[..11].copy_from_slice(&distortion));
    let found = calibrate(&world.corners(60), &Options::default()).unwrap();
    assert!(found.layout.left >= Some(Lens::ThinPrism12), "{:?}", found.layout.left);
}
