//! Whole boards from the simulator's renderer: time, memory and deviation from the truth.

use nalgebra::{Point2, Vector3};
use stereocal::geometry::{Transform, transform};
use stereocal::imaging::image::{Grey8, Image, Picture};
use stereocal::imaging::{Board, detect, refine};
use stereocal::opencv;
use stereocal::simulate::draws::NormalTable;
use stereocal::simulate::physical_board::{PhysicalBoard, Workmanship};
use stereocal::simulate::picture::backdrop::Backdrop;
use stereocal::simulate::picture::psf::Optics;
use stereocal::simulate::picture::render::Renderer;
use stereocal::simulate::picture::scene::{Print, Scene};
use stereocal::simulate::picture::sensor::{Lighting, Sensor};
use stereocal::simulate::rig::true_rig;

/// Boards of the ceramic kind at several sizes of picture.
pub fn table() {
    println!("whole boards of 20x20 squares; px; per-axis RMS (largest in brackets); seconds of one core");
    for (size, detector) in [(1280, true), (2560, true), (5120, false)] {
        row(size, detector);
    }
}

fn rms(found: &[Point2<f64>], truth: &[Point2<f64>]) -> String {
    let half_turn: Vec<Point2<f64>> = truth.iter().rev().copied().collect();
    let distances =
        |truth: &[Point2<f64>]| -> Vec<f64> { found.iter().zip(truth).map(|(a, b)| (a - b).norm()).collect() };
    let sum = |d: &[f64]| d.iter().map(|v| v * v).sum::<f64>();
    let (a, b) = (distances(truth), distances(&half_turn));
    let d = if sum(&a) < sum(&b) { a } else { b };
    format!("{:.5} ({:.4})", (sum(&d) / (2 * d.len()) as f64).sqrt(), d.iter().copied().fold(0.0, f64::max))
}

/// Seconds that this thread has had on a core: unlike the wall clock, the same on a busy machine.
fn core_s() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).map_or(f64::NAN, |ns| ns * 1e-9)
}

fn row(size: u32, sectors_too: bool) {
    let drawing = Board::checker("20x20".parse().expect("a board"), 10.0);
    let workmanship =
        Workmanship { pitch_um: 0.0, bow_um: (0.0, 0.0), ink_spread_um: 0.0, scale_ppm: 0.0, margin_mm: 10.0 };
    let board = PhysicalBoard::new(drawing, workmanship, 1, 0);
    let rig = true_rig(size);
    let backdrop = Backdrop::plain(0.3);
    let scene = Scene {
        camera: rig.left,
        optics: Optics { gaussian_px: 1.2, defocus: None, coma_px: 0.0 },
        board: &board,
        camera_from_board: tilted(),
        print: Print { white: 0.85, black: 0.08, rim: 0.3, rim_mm: 3.0 },
        holder: &[],
        backdrop: &backdrop,
        lighting: Lighting { gradient: (0.1, -0.05), vignetting: 0.1, exposure: 0.75 },
        sensor: Sensor { bits: 8, full_well_e: 10_000.0, read_noise_e: 10.0, dark: 0.02 },
        seed: 1,
        picture: 0,
    };
    let truth = scene.corners_px();
    let rendered = Renderer::new(&scene).picture(&NormalTable::new());
    let pixels: Vec<u8> = rendered.samples.iter().map(|&v| v as u8).collect();
    let grey = Image { width: rendered.width, height: rendered.height, pixels };
    let picture = Picture::from(grey.clone());
    let clock = core_s();
    let detected = detect::detect(&picture, drawing).expect("the board is in view");
    let detect_s = core_s() - clock;
    let clock = core_s();
    let fits = refine::measure(&picture, &detected);
    let refine_s = core_s() - clock;
    let found: Vec<Point2<f64>> = fits.iter().map(|(_, _, fit)| fit.px).collect();
    let predicted = fits.iter().map(|(_, _, f)| f.fit.covariance_px2.trace() / 2.0).sum::<f64>() / fits.count() as f64;
    println!("{size} px: detect {detect_s:.3} s, refine {refine_s:.3} s, {} corners", fits.count());
    let mean = |of: &dyn Fn(&refine::Measured) -> usize| {
        fits.iter().map(|(_, _, m)| of(m) as f64).sum::<f64>() / fits.count() as f64
    };
    let (observations, steps) = (mean(&|m| m.fit.pixels), mean(&|m| m.fit.steps));
    println!("   {observations:.0} observations a corner, {steps:.1} steps at full size");
    println!("   fit {} predicted {:.5}", rms(&found, &truth), predicted.sqrt());
    let start: Vec<Point2<f64>> = detected.corners.iter().map(|(_, _, p)| detected.level.to_picture(p)).collect();
    let clock = core_s();
    let sub_pix = super::sub_pix::corner_sub_pix(&grey, &start, 5).expect("OpenCV works");
    println!("   cornerSubPix(11) {} in {:.3} s", rms(&sub_pix, &truth), core_s() - clock);
    peer(&grey, &truth);
    if sectors_too {
        let clock = core_s();
        let found = opencv::find_board(&grey.pixels, grey.width, (19, 19)).expect("OpenCV works");
        let text = found.map_or("not found".to_owned(), |f| rms(&f, &truth));
        println!("   findChessboardCornersSB {text} in {:.3} s", core_s() - clock);
    }
}

/// The crate `chess-corners` with its best refiner: it finds single corners, of which those nearest to the truth are
/// judged.
fn peer(grey: &Grey8, truth: &[Point2<f64>]) {
    use chess_corners::{Detector, DetectorConfig, ImageRefiner};
    /// A corner farther from the truth is another one, px.
    const NEAR_PX: f64 = 1.5;
    let clock = core_s();
    let config = DetectorConfig::chess_multiscale().with_refiner(ImageRefiner::saddle_point());
    let found = Detector::new(config)
        .and_then(|mut detector| detector.detect_u8(&grey.pixels, grey.width as u32, grey.height as u32));
    let seconds = core_s() - clock;
    let Ok(found) = found else { return println!("   chess-corners refused the picture") };
    let places: Vec<Point2<f64>> = found.iter().map(|c| Point2::new(f64::from(c.x), f64::from(c.y))).collect();
    let nearest = |t: &Point2<f64>| {
        places
            .iter()
            .copied()
            .min_by(|a, b| (a - t).norm().total_cmp(&(b - t).norm()))
            .filter(|p| (p - t).norm() < NEAR_PX)
    };
    let (near, theirs): (Vec<_>, Vec<_>) = truth.iter().filter_map(|t| Some((nearest(t)?, *t))).unzip();
    println!("   chess-corners {} for {} corners in {seconds:.3} s", rms(&near, &theirs), near.len());
}

fn tilted() -> Transform {
    transform(Vector3::new(0.25, -0.2, 0.07), Vector3::new(2.0, -3.0, 560.0))
}
