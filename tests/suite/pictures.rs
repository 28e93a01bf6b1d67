//! Tests of the renderer against rays, and of the true corners against what can be seen in a picture.
//!
//! The rays share nothing with the renderer but the scene: each goes from a place in the picture back through the lens
//! (`undistort`), meets the board's surface, and asks which square is there.
#![allow(clippy::unwrap_used, reason = "a test ends where its world is not as it should be")]

use nalgebra::{Matrix3, Point2, Vector3};

use stereocal::geometry::{Transform, transform};
use stereocal::imaging::image::{Image, Picture};
use stereocal::imaging::{detect, refine};
use stereocal::simulate::draws::NormalTable;
use stereocal::simulate::physical_board::{PhysicalBoard, Workmanship};
use stereocal::simulate::picture::backdrop::Backdrop;
use stereocal::simulate::picture::psf::{Defocus, Optics};
use stereocal::simulate::picture::render::Renderer;
use stereocal::simulate::picture::scene::{Print, Scene};
use stereocal::simulate::picture::sensor::{Lighting, Sensor};
use stereocal::simulate::rig::{left_from_field, true_rig};
use stereocal::simulate::settings::Settings;
use stereocal::stereo::Camera;

/// Rays a pixel, each way.
const RAYS: usize = 32;

/// Largest deviation from the rays, RMS over a crop, in numbers of an 8-bit picture: below what a camera's noise hides.
const RAYS_RMS_DN: f64 = 0.3;

/// Even light, so that what is compared is geometry.
const EVEN: Lighting = Lighting { gradient: (0.0, 0.0), vignetting: 0.0, exposure: 0.8 };

fn board(workmanship: Workmanship) -> PhysicalBoard {
    PhysicalBoard::new(Settings::small().check_board, workmanship, 7, 0)
}

fn tilted() -> Transform {
    left_from_field() * transform(Vector3::new(0.35, -0.28, 0.17), Vector3::new(4.0, -3.0, 20.0))
}

fn scene<'a>(
    camera: Camera,
    board: &'a PhysicalBoard,
    backdrop: &'a Backdrop,
    optics: Optics,
    camera_from_board: Transform,
) -> Scene<'a> {
    Scene {
        camera,
        optics,
        board,
        camera_from_board,
        print: Print { white: 1.0, black: 0.07, rim: 0.45, rim_mm: 1.0 },
        holder: &[],
        backdrop,
        lighting: EVEN,
        sensor: Sensor { bits: 8, full_well_e: f64::INFINITY, read_noise_e: 0.0, dark: 0.0 },
        seed: 1,
        picture: 0,
    }
}

/// Reflectance that a ray through a picture point meets.
fn ray(scene: &Scene, board_from_camera: &Transform, px: &Point2<f64>) -> f64 {
    let background = || f64::from(scene.backdrop.at(px.x, px.y));
    let Some(n) = scene.camera.undistort(px) else { return background() };
    let origin = board_from_camera.translation.vector;
    let direction = board_from_camera.rotation * Vector3::new(n.x, n.y, 1.0);
    let board = scene.board;
    let (mut x, mut y, mut z) = (0.0, 0.0, 0.0);
    for _ in 0..4 {
        let t = (z - origin.z) / direction.z;
        (x, y) = (origin.x + t * direction.x, origin.y + t * direction.y);
        z = board.height_mm(x, y);
    }
    let (w, h) = board.plate_half_mm();
    let rim = scene.print.rim_mm;
    if x.abs() > w + rim || y.abs() > h + rim {
        background()
    } else if x.abs() > w || y.abs() > h {
        scene.print.rim
    } else if is_black(board, x, y) {
        scene.print.black
    } else {
        scene.print.white
    }
}

fn is_black(board: &PhysicalBoard, x: f64, y: f64) -> bool {
    let squares = board.drawing.squares;
    let index = |v: f64, count: usize| (v / board.drawing.square_mm + count as f64 / 2.0).floor() as isize;
    let (i, j) = (index(x, squares.columns), index(y, squares.rows));
    let inside = |corners: [Point2<f64>; 4]| {
        (0..4).all(|k| {
            let (a, b) = (corners[k], corners[(k + 1) % 4]);
            (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x) >= 0.0
        })
    };
    // Ink and pitch move an edge by far less than a square: only neighbours can own the place.
    (-1..=1).flat_map(|dj| (-1..=1).map(move |di| (i + di, j + dj))).any(|(i, j)| {
        let on_board = (0..squares.columns as isize).contains(&i) && (0..squares.rows as isize).contains(&j);
        on_board && board.is_black(i as usize, j as usize) && inside(board.square_mm(i as usize, j as usize))
    })
}

/// A crop by rays: a grid of `RAYS` a pixel, spread by `spot` (weights at ray offsets), a Gaussian, and the pixel.
fn crop_by_rays(scene: &Scene, at: (usize, usize), size: usize, spot: &[(isize, isize, f64)]) -> Vec<f64> {
    let spot_reach = spot.iter().map(|s| s.0.unsigned_abs().max(s.1.unsigned_abs())).max().unwrap_or(0);
    let sigma = scene.optics.gaussian_px * RAYS as f64;
    let reach = (5.0 * sigma).ceil() as usize;
    let apron = reach + spot_reach;
    let side = size * RAYS + 2 * apron;
    let board_from_camera = scene.camera_from_board.inverse();
    let place = |k: usize, start: usize| start as f64 - 0.5 + (k as f64 + 0.5 - apron as f64) / RAYS as f64;
    let rays: Vec<f64> = (0..side * side)
        .map(|k| ray(scene, &board_from_camera, &Point2::new(place(k % side, at.0), place(k / side, at.1))))
        .collect();
    let inner = side - 2 * spot_reach;
    let spread: Vec<f64> = (0..inner * inner)
        .map(|k| {
            let (x, y) = ((k % inner + spot_reach) as isize, (k / inner + spot_reach) as isize);
            let source = |s: &(isize, isize, f64)| s.2 * rays[(y - s.1) as usize * side + (x - s.0) as usize];
            if spot.is_empty() { rays[k] } else { spot.iter().map(source).sum() }
        })
        .collect();
    // One weight for each ray of a row or column that reaches a pixel: the pixel's rays spread by the Gaussian.
    let mut weights = vec![0.0; RAYS + 2 * reach];
    for i in 0..RAYS {
        for k in 0..=2 * reach {
            weights[i + k] += (-0.5 * ((k as f64 - reach as f64) / sigma).powi(2)).exp();
        }
    }
    let total: f64 = weights.iter().sum();
    let weigh =
        |values: &dyn Fn(usize) -> f64| weights.iter().enumerate().map(|(k, w)| w * values(k)).sum::<f64>() / total;
    let rows: Vec<f64> =
        (0..inner * size).map(|k| weigh(&|i| spread[(k / size) * inner + (k % size) * RAYS + i])).collect();
    (0..size * size).map(|k| weigh(&|j| rows[((k / size) * RAYS + j) * size + k % size])).collect()
}

fn rms_dn(scene: &Scene, at: (usize, usize), size: usize, spot: &[(isize, isize, f64)]) -> f64 {
    let rendered = Renderer::new(scene).light_in(at.0, at.1, size, size);
    let by_rays = crop_by_rays(scene, at, size, spot);
    let contrast = by_rays.iter().fold(0.0f64, |m, v| m.max(*v)) - by_rays.iter().fold(1.0f64, |m, v| m.min(*v));
    assert!(contrast > 0.5, "a crop without an edge shows nothing");
    let sum: f64 = rendered.iter().zip(&by_rays).map(|(a, b)| (a - b * EVEN.exposure).powi(2) * 255.0 * 255.0).sum();
    (sum / rendered.len() as f64).sqrt()
}

#[test]
fn pictures_agree_with_rays() {
    let workmanship =
        Workmanship { pitch_um: 10.0, bow_um: (80.0, -30.0), ink_spread_um: 40.0, scale_ppm: 50.0, margin_mm: 8.0 };
    let (board, backdrop) = (board(workmanship), Backdrop::plain(0.3));
    let optics = Optics { gaussian_px: 0.7, defocus: None, coma_px: 0.0 };
    for (camera, camera_from_left) in
        [(true_rig(1280).left, Transform::identity()), (true_rig(1280).right, true_rig(1280).right_from_left)]
    {
        let scene = scene(camera, &board, &backdrop, optics, camera_from_left * tilted());
        let corners = scene.corners_px();
        // A corner in the middle, one at the picture's side where the lens bends most, and the plate's edge.
        let plate = camera.project(&(scene.camera_from_board * board.on_surface(-108.0, -60.0)));
        for px in [corners[9 * 19 + 9], corners[18 * 19 + 18], plate] {
            let at = ((px.x - 6.0) as usize, (px.y - 6.0) as usize);
            let rms = rms_dn(&scene, at, 12, &[]);
            println!("crop at {at:?}: {rms:.4} DN RMS from {RAYS}x{RAYS} rays a pixel");
            assert!(rms < RAYS_RMS_DN, "{at:?}: {rms}");
        }
    }
}

/// Weights at ray offsets of a disc and a flare, from the formula of `psf::Spot` over a pupil of its own.
fn spot_by_rays(disc_px: f64, flare_px: (f64, f64)) -> Vec<(isize, isize, f64)> {
    let mut spot = std::collections::BTreeMap::new();
    let rings = 200;
    for ring in 0..rings {
        let rho = ((f64::from(ring) + 0.5) / f64::from(rings)).sqrt();
        for k in 0..720 {
            let t = (f64::from(k) + 0.5) * std::f64::consts::TAU / 720.0;
            let (fx, fy) = (flare_px.0 / 3.0 * rho * rho, flare_px.1 / 3.0 * rho * rho);
            let (along, across) = (2.0 + (2.0 * t).cos(), (2.0 * t).sin());
            let x = disc_px * rho * t.cos() + fx * along - fy * across;
            let y = disc_px * rho * t.sin() + fy * along + fx * across;
            let at = |v: f64| (v * RAYS as f64).round() as isize;
            *spot.entry((at(x), at(y))).or_insert(0.0) += 1.0 / (720.0 * f64::from(rings));
        }
    }
    spot.into_iter().map(|((x, y), weight)| (x, y, weight)).collect()
}

#[test]
fn defocus_and_coma_agree_with_rays() {
    let backdrop = Backdrop::plain(0.3);
    let board = board(Settings::small().check_workmanship);
    let camera = true_rig(1280).left;
    let defocus = Some(Defocus { pupil_mm: 3.0, focus_mm: 450.0 });
    for (defocus, coma_px) in [(defocus, 0.0), (None, 1.2), (defocus, 1.2)] {
        let optics = Optics { gaussian_px: 0.5, defocus, coma_px };
        let scene = scene(camera, &board, &backdrop, optics, tilted());
        let px = scene.corners_px()[2 * 19 + 16];
        let at = ((px.x - 4.0) as usize, (px.y - 4.0) as usize);
        let (disc, flare) = scene.spot_at(&px);
        let rms = rms_dn(&scene, at, 8, &spot_by_rays(disc, flare));
        println!("disc {disc:.2} px, flare {:.2} px: {rms:.4} DN RMS", flare.0.hypot(flare.1));
        assert!(rms < RAYS_RMS_DN, "{optics:?}: {rms}");
    }
}

#[test]
fn rays_through_true_corners_meet_them() {
    let workmanship =
        Workmanship { pitch_um: 10.0, bow_um: (80.0, -30.0), ink_spread_um: 0.0, scale_ppm: 0.0, margin_mm: 8.0 };
    let (board, backdrop) = (board(workmanship), Backdrop::plain(0.3));
    let optics = Optics { gaussian_px: 0.7, defocus: None, coma_px: 0.0 };
    let scene = scene(true_rig(5120).left, &board, &backdrop, optics, tilted());
    let board_from_camera = scene.camera_from_board.inverse();
    for (k, px) in scene.corners_px().iter().enumerate() {
        let n = scene.camera.undistort(px).unwrap();
        let direction = board_from_camera.rotation * Vector3::new(n.x, n.y, 1.0);
        let origin = board_from_camera.translation.vector;
        let corner = board.corner_mm(k % 19, k / 19);
        let t = (corner.z - origin.z) / direction.z;
        let miss_mm = (origin + direction * t - corner.coords).norm();
        // 10 000 px of focal length at 525 mm: 19 px a mm.
        assert!(miss_mm * 19.0 < 1e-4, "corner {k} is {miss_mm} mm off");
    }
}

/// Where an edge crosses a line of pixels, from the light along the line alone: light that a symmetric spread takes
/// from one side of an edge it gives to the other, so the sum over a window knows the edge whatever the spread.
fn crossing(light: &dyn Fn(isize) -> f64, near: f64) -> f64 {
    let (first, last) = ((near.round() as isize) - 6, (near.round() as isize) + 6);
    let (a, b) = (light(first), light(last));
    let sum: f64 = (first..=last).map(light).sum();
    (sum - b * (last as f64 + 0.5) + a * (first as f64 - 0.5)) / (a - b)
}

/// The parabola through points by least squares: value, slope, curvature at zero.
fn parabola(points: &[(f64, f64)]) -> Vector3<f64> {
    let mut normal = Matrix3::zeros();
    let mut right = Vector3::zeros();
    for &(t, v) in points {
        let basis = Vector3::new(1.0, t, t * t);
        normal += basis * basis.transpose();
        right += basis * v;
    }
    normal.lu().solve(&right).unwrap()
}

/// A corner from the light round it, with no model of the blur: crossings of both edges beyond the corner's own blur,
/// a parabola through each edge's crossings, and where the two meet.
fn corner_from_light(
    light: &dyn Fn(isize, isize) -> f64,
    near: Point2<f64>,
    right: Point2<f64>,
    below: Point2<f64>,
) -> Point2<f64> {
    let (cx, cy) = (near.x.round() as isize, near.y.round() as isize);
    let steep = (below.x - near.x) / (below.y - near.y);
    let flat = (right.y - near.y) / (right.x - near.x);
    let offsets: Vec<isize> = (6..=13).flat_map(|d| [-d, d]).collect();
    let upright: Vec<(f64, f64)> = offsets
        .iter()
        .map(|&d| (d as f64, crossing(&|x| light(x, cy + d), near.x + steep * ((cy + d) as f64 - near.y)) - cx as f64))
        .collect();
    let level: Vec<(f64, f64)> = offsets
        .iter()
        .map(|&d| (d as f64, crossing(&|y| light(cx + d, y), near.y + flat * ((cx + d) as f64 - near.x)) - cy as f64))
        .collect();
    let (u, l) = (parabola(&upright), parabola(&level));
    let (mut x, mut y) = (0.0, 0.0);
    for _ in 0..20 {
        x = u[0] + u[1] * y + u[2] * y * y;
        y = l[0] + l[1] * x + l[2] * x * x;
    }
    Point2::new(cx as f64 + x, cy as f64 + y)
}

#[test]
fn corners_without_a_model_of_blur_are_where_the_truth_says() {
    let (board, backdrop) = (board(Settings::small().check_workmanship), Backdrop::plain(0.3));
    for (name, gaussian_px, defocus) in
        [("Gaussian", 0.7, None), ("disc", 0.45, Some(Defocus { pupil_mm: 2.0, focus_mm: 450.0 }))]
    {
        let optics = Optics { gaussian_px, defocus, coma_px: 0.0 };
        let scene = scene(true_rig(1280).left, &board, &backdrop, optics, tilted());
        let truth = scene.corners_px();
        let all = Renderer::new(&scene).light_in(0, 0, 1280, 1280);
        let light = |x: isize, y: isize| all[y as usize * 1280 + x as usize];
        let misses: Vec<_> = (0..18 * 18)
            .map(|k| (k / 18) * 19 + k % 18)
            .take(200)
            .map(|k| corner_from_light(&light, truth[k], truth[k + 1], truth[k + 19]) - truth[k])
            .collect();
        let mean = misses.iter().sum::<nalgebra::Vector2<f64>>() / misses.len() as f64;
        let rms = (misses.iter().map(|m| m.norm_squared()).sum::<f64>() / misses.len() as f64 / 2.0).sqrt();
        println!("{name}: {} corners, mean ({:+.6}, {:+.6}) px, RMS {rms:.6} px an axis", misses.len(), mean.x, mean.y);
        assert!(misses.len() == 200 && mean.amax() < 0.001, "{name}: {mean}");
        // Each corner too: the sum is exact but for the curvature of edges and single precision.
        assert!(rms < 0.002, "{name}: {rms}");
    }
}

#[test]
fn more_bits_see_the_same_corners() {
    let (board, backdrop) = (board(Settings::small().check_workmanship), Backdrop::plain(0.3));
    let optics = Optics { gaussian_px: 0.7, defocus: None, coma_px: 0.0 };
    let scene = scene(true_rig(640).left, &board, &backdrop, optics, tilted());
    let corners = |bits: u8| -> Vec<Point2<f64>> {
        let sensor = Sensor { bits, full_well_e: 10_000.0, read_noise_e: 3.0, dark: 0.008 };
        let rendered = Renderer::new(&Scene { sensor, ..scene }).picture(&NormalTable::new());
        let (width, height) = (rendered.width, rendered.height);
        let picture = match bits {
            8 => Picture::from(Image { width, height, pixels: rendered.samples.iter().map(|&v| v as u8).collect() }),
            _ => Picture::from(Image { width, height, pixels: rendered.samples }),
        };
        let detected = detect::detect(&picture, board.drawing).unwrap();
        refine::measure(&picture, &detected).iter().map(|(_, _, found)| found.px).collect()
    };
    let eight = corners(8);
    assert_eq!(eight.len(), 19 * 19);
    for bits in [12, 16] {
        let more = corners(bits);
        let sum: f64 = eight.iter().zip(&more).map(|(a, b)| (a - b).norm_squared()).sum();
        let rms = (sum / (2 * eight.len()) as f64).sqrt();
        // The noise is the same; rounding to 8 bits adds a tenth of it, and it moves a corner by some 0.005 px.
        assert!(more.len() == eight.len() && rms < 0.002, "{bits} bits: {} corners, {rms} px", more.len());
    }
}
