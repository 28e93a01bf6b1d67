//! Single corners against the bound: angle of the edges, blur and noise.

use nalgebra::{Matrix2, Point2, Vector2};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use stereocal::imaging::detect::Detected;
use stereocal::imaging::image::pyramid::Level;
use stereocal::imaging::image::{Grey8, Picture};
use stereocal::imaging::lattice::Lattice;
use stereocal::imaging::refine::light::illumination;
use stereocal::imaging::refine::{self, Measured};

use super::corner_patch::{Spread, draw};
use super::sub_pix::corner_sub_pix;

/// Light and dark, grey values.
const LEVEL: f64 = 120.0;
const HALF_CONTRAST: f64 = 80.0;
/// Side of the drawn patch, px, and of the squares round the corner: the window follows the squares.
const PATCH: i32 = 61;
const SQUARE_PX: f64 = 24.0;
/// Pictures of each case: places of the corner within a pixel times noise.
const PLACES: usize = 12;
const NOISES: usize = 25;

struct Spot {
    fit: Vec<Vector2<f64>>,
    chi2: Vec<f64>,
    sub_pix: Vec<Vector2<f64>>,
    bound: f64,
    lost: usize,
}

/// Prints RMS over bound for every angle, blur and noise.
pub fn table() {
    println!("single corners, squares of {SQUARE_PX} px, {} pictures a row; px", PLACES * NOISES);
    println!("angle  blur noise |   bound  fit rms  ratio   bias | chi2  in95% | cornerSubPix(11)  lost");
    let (mut gains, mut chi2) = (Vec::new(), Vec::new());
    for angle in [90.0_f64, 75.0, 60.0, 45.0] {
        for blur in [0.6, 1.0, 1.6, 2.5] {
            for noise in [1.0, 2.0, 5.0] {
                let spot = measure(angle.to_radians(), Spread::Gaussian(blur), noise);
                gains.push(print(&format!("{angle:5} {blur:5.1} {noise:5.0}"), &spot));
                chi2.extend(spot.chi2);
            }
        }
    }
    println!("all rows: chi2 {:.3}, in95% {:.1}", mean_chi2(&chi2), inside_95(&chi2));
    gains.sort_by(f64::total_cmp);
    println!("cornerSubPix(11) over fit, median: {:.1}", gains[gains.len() / 2]);
}

/// Prints the same for a defocused lens.
pub fn defocus() {
    println!("disc defocus of 2 px radius");
    for angle in [90.0_f64, 60.0, 45.0] {
        print(&format!("{angle:5}  disc {:5.0}", 2.0), &measure(angle.to_radians(), Spread::Disc(2.0), 2.0));
    }
}

fn rms(values: &[Vector2<f64>]) -> f64 {
    (values.iter().map(Vector2::norm_squared).sum::<f64>() / (2 * values.len()) as f64).sqrt()
}

/// Mean square of a deviation in sigmas; each has two coordinates.
fn mean_chi2(chi2: &[f64]) -> f64 {
    chi2.iter().sum::<f64>() / (2 * chi2.len()) as f64
}

/// Share of deviations inside their 95 % ellipse, percent.
fn inside_95(chi2: &[f64]) -> f64 {
    /// The 95 % point of chi-squared with two degrees of freedom.
    const LIMIT: f64 = 5.991;
    100.0 * chi2.iter().filter(|&&q| q < LIMIT).count() as f64 / chi2.len() as f64
}

fn print(name: &str, spot: &Spot) -> f64 {
    let mean = spot.fit.iter().sum::<Vector2<f64>>() / spot.fit.len() as f64;
    let (chi2, inside) = (mean_chi2(&spot.chi2), inside_95(&spot.chi2));
    let (fit, sub_pix) = (rms(&spot.fit), rms(&spot.sub_pix));
    println!(
        "{name} | {:.5} {fit:.5} {:6.2} {:.5} | {chi2:.2} {inside:6.1} | {sub_pix:.5} {:6}",
        spot.bound,
        fit / spot.bound,
        mean.amax(),
        spot.lost
    );
    sub_pix / fit
}

fn measure(angle: f64, spread: Spread, noise: f64) -> Spot {
    let mut random = Pcg64::seed_from_u64(1);
    let mut uniform = move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let mut spot = Spot { fit: Vec::new(), chi2: Vec::new(), sub_pix: Vec::new(), bound: 0.0, lost: 0 };
    let mut information = 0.0;
    // The pictures stand side by side as the corners of one board, so that they share the light as a board's corners
    // do.
    let (mut board, mut truths) = (Vec::new(), Vec::new());
    for _ in 0..PLACES {
        let corner = (uniform() - 0.5, uniform() - 0.5);
        let turn = uniform() * std::f64::consts::PI;
        let angles = [turn, turn + angle];
        let light = draw(PATCH, corner, angles, spread);
        information += 1.0 / bound(corner, angles, spread, noise).powi(2) / PLACES as f64;
        for _ in 0..NOISES {
            let mut normal = || (-2.0 * (1.0 - uniform()).ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos();
            let pixels: Vec<u8> =
                light.iter().map(|l| (LEVEL + HALF_CONTRAST * l + noise * normal()).round() as u8).collect();
            let middle = f64::from(PATCH / 2);
            let truth = Point2::new(middle + corner.0, middle + corner.1);
            let start = truth + Vector2::new(uniform() - 0.5, uniform() - 0.5);
            let side = PATCH as usize;
            let grey = Grey8 { width: side, height: side, pixels };
            let sub_pix = corner_sub_pix(&grey, &[start], 5).expect("OpenCV works");
            spot.sub_pix.push(sub_pix[0] - truth);
            let picture = Picture::from(grey.clone());
            let along = angles.map(|a| Vector2::new(a.cos(), a.sin()) * SQUARE_PX);
            let corners = Lattice {
                columns: 2,
                rows: 2,
                cells: vec![Some(start), Some(start + along[0]), Some(start + along[1]), None],
            };
            let fits = refine::measure(
                &picture,
                &Detected { corners, copy: grey, level: Level::Reduced(1), print: None, open: None },
            );
            let place = Vector2::new((board.len() % NOISES) as f64, (board.len() / NOISES) as f64) * f64::from(PATCH);
            board.push(fits.get(0, 0).map(|m| Measured { px: m.px + place, ..*m }));
            truths.push(truth + place);
        }
    }
    let mut board = Lattice { columns: NOISES, rows: PLACES, cells: board };
    illumination::tie(&mut board);
    for (measured, truth) in board.cells.iter().zip(&truths) {
        match measured {
            Some(measured) => {
                let d = measured.px - truth;
                spot.fit.push(d);
                let inverse: Matrix2<f64> = measured.fit.covariance_px2.try_inverse().expect("a covariance");
                spot.chi2.push((d.transpose() * inverse * d)[0]);
            }
            None => spot.lost += 1,
        }
    }
    spot.bound = information.powf(-0.5);
    spot
}

/// The Cramer-Rao bound of the place, per axis, when all else is known: from differences of drawn patches over the
/// parallelogram inside the squares, as far as the fit's window may reach. 8-bit rounding adds 1/12.
fn bound(corner: (f64, f64), angles: [f64; 2], spread: Spread, noise: f64) -> f64 {
    let h = 0.1;
    let slope = |dx: f64, dy: f64| -> Vec<f64> {
        let at = |s: f64| draw(PATCH, (corner.0 + s * dx, corner.1 + s * dy), angles, spread);
        at(h).iter().zip(at(-h)).map(|(a, b)| HALF_CONTRAST * (a - b) / (2.0 * h)).collect()
    };
    let (sx, sy) = (slope(1.0, 0.0), slope(0.0, 1.0));
    let blur = match spread {
        Spread::Gaussian(s) => s.hypot(0.3),
        Spread::Disc(r) => r / 2.0,
    };
    let half = SQUARE_PX - (3.0 * blur + 1.0) / (angles[1] - angles[0]).sin();
    let to_edges = Matrix2::new(angles[0].cos(), angles[1].cos(), angles[0].sin(), angles[1].sin())
        .try_inverse()
        .expect("two edges");
    let mut information = Matrix2::zeros();
    for (k, (gx, gy)) in sx.iter().zip(&sy).enumerate() {
        let (x, y) = (k as i32 % PATCH - PATCH / 2, k as i32 / PATCH - PATCH / 2);
        if (to_edges * Vector2::new(f64::from(x) - corner.0, f64::from(y) - corner.1)).amax() <= half {
            information += Matrix2::new(gx * gx, gx * gy, gx * gy, gy * gy);
        }
    }
    let covariance = information.try_inverse().expect("a corner") * (noise * noise + 1.0 / 12.0);
    (covariance.trace() / 2.0).sqrt()
}
