//! 40 pairs of 361 corners: the bundle beside OpenCV's `stereoCalibrate` on the same corners, the simulator's true ones
//! with Gaussian noise.

use std::time::Instant;

use stereocal::imaging::Corners;
use stereocal::simulate::draws::{Draws, Purpose};
use stereocal::simulate::settings::Settings;
use stereocal::simulate::world::World;
use stereocal::stereo::Lens;
use stereocal::stereo::calibrate::calibrate;
use stereocal::stereo::judge::lengths::held_out;
use stereocal::stereo::select::options::Options;

const PAIRS: usize = 40;
/// Standard deviation of a corner's coordinate, px.
const SIGMA_PX: f64 = 0.02;
const RUNS: usize = 5;

pub fn run() {
    let settings = Settings { check_pairs: PAIRS, samples: 4, verify: 0, ..Settings::paper() };
    let world = World::new(settings, None).expect("the preset is possible");
    let corners = noisy(world.check_corners());
    let truth = world.rig.baseline_mm();
    let forced = Options { lens: Some(Lens::Brown4), shape: Some(false), known: None };
    let found = calibrate(&corners, &forced).expect("a calibration");

    let (solve, solved) = median_s(|| found.problem().solve(&found.layout).expect("a solution"));
    println!(
        "bundle from its end       {solve:.3} s, RMS {:.4} px (both pictures), {} unknowns shared",
        solved.rms_px,
        found.layout.count()
    );
    let (whole, found) = median_s(|| calibrate(&corners, &forced).expect("a calibration"));
    println!("start, screening, bundle  {whole:.3} s, baseline {:.4} mm (true {truth:.4})", found.rig().baseline_mm());
    let (ladder, found) = median_s(|| calibrate(&corners, &Options::default()).expect("a calibration"));
    println!("the same with the ladder  {ladder:.3} s, lens {:?}", found.layout.left);
    let (held_out, accuracy) = median_s(|| held_out::hold_out(&found, None).expect("an accuracy"));
    println!("held-out accuracy         {held_out:.3} s, worst {:.5} mm", accuracy.extremes.max_abs_error_mm);
    let start = Instant::now();
    let (rms, baseline) = super::peer::stereo_calibrate(&corners).expect("OpenCV works");
    let peer = start.elapsed().as_secs_f64();
    println!("OpenCV, three functions   {peer:.3} s, RMS {rms:.4} px, baseline {baseline:.4} mm");
    println!("OpenCV / stereocal        {:.1} (start, screening, bundle)", peer / whole);
}

fn median_s<T>(work: impl Fn() -> T) -> (f64, T) {
    let mut times = Vec::new();
    let mut last = work();
    for _ in 0..RUNS {
        let start = Instant::now();
        last = work();
        times.push(start.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    (times[RUNS / 2], last)
}

fn noisy(mut corners: Corners) -> Corners {
    let mut draws = Draws::new(1, Purpose::Points, 0);
    for corner in corners.pairs.iter_mut().flat_map(|p| p.left.iter_mut().chain(&mut p.right)) {
        corner.px.x += SIGMA_PX * draws.normal();
        corner.px.y += SIGMA_PX * draws.normal();
    }
    corners
}
