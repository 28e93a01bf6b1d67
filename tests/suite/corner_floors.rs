//! Corners against the simulator's truth: how far off they may be, on copies reduced by 1, 2 and 5, under what cameras
//! and benches do to pictures. No corner may be off by many of its sigmas, whatever was done: a missing corner is
//! better than a shifted one.

use image::codecs::jpeg::JpegEncoder;
use stereocal::imaging::image::{Image, Picture, decode};
use stereocal::simulate::draws::{Draws, Purpose};

use crate::shot::{Deviations, Setup, Shot};

/// Sides of the pictures: detection looks at copies reduced by 1, 2 and 5.
const SIZES: [u32; 3] = [1280, 2200, 5120];
/// Largest deviation in sigmas. Of 1200 corners with normal deviations the largest is off by 4; blur that is no
/// Gaussian adds some.
const MOST_SIGMAS: f64 = 7.0;

fn shot(size: u32, squares: &'static str, square_mm: f64) -> Shot {
    Setup { size, squares, square_mm, ..Setup::default() }.take()
}

fn deviations(shot: &Shot, picture: &Picture, what: &str) -> Deviations {
    let corners = shot.corners(picture).unwrap_or_else(|reason| panic!("{what}: {reason}"));
    let best = shot.deviations(&corners);
    println!(
        "{what}: {} of {} corners, {:.5} px RMS an axis, largest {:.1} sigmas, chi-squared {:.2}",
        best.used,
        shot.truth.len(),
        best.rms_px,
        best.most_sigmas,
        best.chi2
    );
    best
}

/// Discs before the board, each of a grey of its own: they hide squares in part.
fn with_discs(shot: &Shot) -> Picture {
    let mut draws = Draws::new(5, Purpose::Clutter, 0);
    let size = shot.image.width as f64;
    let discs: Vec<(f64, f64, f64, u8)> = (0..16)
        .map(|_| {
            let place = (draws.uniform(0.1, 0.9) * size, draws.uniform(0.1, 0.9) * size);
            (place.0, place.1, draws.uniform(0.006, 0.02) * size, draws.uniform(30.0, 200.0) as u8)
        })
        .collect();
    shot.changed(|x, y, value| {
        let hides = |d: &&(f64, f64, f64, u8)| (x as f64 - d.0).hypot(y as f64 - d.1) < d.2;
        // The last one is before the others; the noise of what is behind goes on.
        discs.iter().rev().find(hides).map_or(value, |d| d.3 + value % 4)
    })
}

fn jpeg(shot: &Shot, quality: u8) -> Picture {
    let grey = shot.eight();
    let image = image::GrayImage::from_raw(grey.width as u32, grey.height as u32, grey.pixels).unwrap();
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, quality).encode_image(&image).unwrap();
    decode(&bytes, "a.jpg".into(), None).unwrap()
}

/// What is asked of the corners of a picture.
struct Floor {
    /// Largest RMS deviation of a coordinate, px.
    rms_px: f64,
    /// Largest deviation in the corner's own sigmas.
    sigmas: f64,
    /// Least share of the corners that is used.
    used: f64,
}

/// Adds what falls short of the floor to `short`, so that one run tells of all of them.
fn holds(short: &mut Vec<String>, shot: &Shot, picture: &Picture, what: &str, floor: &Floor) {
    let found = deviations(shot, picture, what);
    let within = found.rms_px <= floor.rms_px && found.most_sigmas <= floor.sigmas;
    if !within || (found.used as f64) < floor.used * shot.truth.len() as f64 {
        short.push(format!("{what}: {:.5} px, {:.1} sigmas, {} corners", found.rms_px, found.most_sigmas, found.used));
    }
}

/// All that is done to one picture. `floor_px` is that of the picture as it is.
fn all_faults(size: u32, floor_px: f64) {
    let shot = shot(size, "20x20", 10.0);
    let mut short = Vec::new();
    let mut check = |picture: &Picture, what: &str, floors: f64, sigmas: f64, used: f64| {
        let floor = Floor { rms_px: floors * floor_px, sigmas, used };
        holds(&mut short, &shot, picture, &format!("{size} px, {what}"), &floor);
    };
    let clean = Picture::from(shot.eight());
    check(&clean, "as it is", 1.0, MOST_SIGMAS, 1.0);
    // Hidden corners are missing; their neighbours are measured in smaller windows.
    check(&with_discs(&shot), "partly hidden", 2.0, MOST_SIGMAS, 0.6);
    check(&shot.changed(|_, _, v| v.min(150)), "clipped at 150", 2.0, MOST_SIGMAS, 0.95);
    check(&shot.changed(|_, _, v| 255 - v), "inverted", 1.2, MOST_SIGMAS, 1.0);
    // One pixel in 20 000 is stuck, and four columns are too bright.
    let stuck = |x: usize, y: usize, v: u8| match (x * 7919 + y * 104_729) % 20_011 {
        0 => 220,
        _ if x % (size as usize / 4) == 77 => v.saturating_add(60),
        _ => v,
    };
    check(&shot.changed(stuck), "hot pixels and columns", 2.5, MOST_SIGMAS, 0.7);
    let twelve = shot.image.pixels.iter().map(|&v| v >> 4);
    let twelve: Vec<u16> = twelve.enumerate().map(|(k, v)| if k == 4711 { 65_535 } else { v }).collect();
    let twelve = Picture::from(Image { width: shot.image.width, height: shot.image.height, pixels: twelve });
    check(&twelve, "12 bits in 16, one hot pixel", 1.2, MOST_SIGMAS, 1.0);
    for quality in [90, 40] {
        check(&jpeg(&shot, quality), &format!("JPEG {quality}"), 6.0, MOST_SIGMAS, 0.98);
    }
    assert!(short.is_empty(), "{short:#?}");
    let chi2 = deviations(&shot, &clean, "as it is").chi2;
    // 361 corners tell chi-squared to 5 %; a blur that is no Gaussian adds to it.
    assert!((0.8..1.3).contains(&chi2), "{size}: chi-squared {chi2}");
}

#[test]
fn full_size() {
    all_faults(SIZES[0], 0.0045);
}

#[test]
fn reduced_by_two() {
    all_faults(SIZES[1], 0.0032);
}

#[test]
fn reduced_by_five() {
    all_faults(SIZES[2], 0.0022);
}

#[test]
fn few_and_many_squares() {
    for size in SIZES {
        for (squares, square_mm, floor_px) in [("5x5", 30.0, 0.005), ("40x30", 6.0, 0.008)] {
            let shot = shot(size, squares, square_mm);
            let floor = Floor { rms_px: floor_px, sigmas: MOST_SIGMAS, used: 0.97 };
            let mut short = Vec::new();
            holds(&mut short, &shot, &shot.eight().into(), &format!("{size} px, {squares} squares"), &floor);
            assert!(short.is_empty(), "{short:?}");
        }
    }
}
