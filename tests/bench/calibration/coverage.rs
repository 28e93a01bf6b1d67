//! Whether the 95 % intervals of the rig's numbers hold, and how well lengths on fresh boards are measured: many rigs
//! calibrated from the simulator's true corners with Gaussian noise, also where the truth has what the model lacks.

use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;
use stereocal::imaging::{Corners, Side};
use stereocal::simulate::draws::{Draws, Purpose};
use stereocal::simulate::settings::Settings;
use stereocal::simulate::world::World;
use stereocal::stereo::calibrate::{Calibration, calibrate};
use stereocal::stereo::data::view::View;
use stereocal::stereo::model::projection::CAMERA_NUMBERS;
use stereocal::stereo::select::options::Options;
use stereocal::stereo::triangulate::{RIG_NUMBERS, RigCovariance, rig_number, triangulate};
use stereocal::stereo::{Lens, Rig};

/// Pictures, and how their corners scatter.
#[derive(Clone, Copy)]
pub struct Noise {
    /// Width and height, px.
    pub size_px: u32,
    /// Standard deviation of a corner's coordinate, px.
    pub sigma_px: f64,
    /// And of a crossing of the board's print, um; `None` as the preset has it.
    pub print_um: Option<f64>,
}

/// 26 Mpx, with corners as rendered pictures give them.
const PAPER: Noise = Noise { size_px: 5120, sigma_px: 0.002, print_um: None };
/// Rigs a line.
const RIGS: u64 = 100;
/// Pairs of each.
const PAIRS: usize = 16;
/// Squares of a length: 70 mm.
const SPAN: usize = 7;
/// Of a Gaussian within its 95 % interval.
const WIDTH: f64 = 1.96;

/// What the truth has, and what the calibration is told.
struct Case {
    name: &'static str,
    bow_um: f64,
    options: Options,
}

/// Errors with their standard deviations.
#[derive(Default)]
pub struct Tally {
    pub count: f64,
    pub inside: f64,
    chi: f64,
    pub squares: f64,
    /// What the standard deviations let expect of the squares.
    pub variances: f64,
    largest: f64,
}

impl Tally {
    fn add(&mut self, off: f64, sigma: f64) {
        self.count += 1.0;
        self.inside += f64::from(u8::from(off.abs() <= WIDTH * sigma));
        self.chi += (off / sigma).powi(2);
        self.squares += off * off;
        self.variances += sigma * sigma;
        self.largest = self.largest.max(off.abs());
    }

    pub fn merge(&mut self, other: &Tally) {
        self.count += other.count;
        self.inside += other.inside;
        self.chi += other.chi;
        self.squares += other.squares;
        self.variances += other.variances;
        self.largest = self.largest.max(other.largest);
    }
}

pub fn world(seed: u64, pairs: usize, bow_um: f64, noise: Noise) -> World {
    let size_px = noise.size_px;
    let mut settings = Settings { size_px, check_pairs: pairs, samples: 4, verify: 0, seed, ..Settings::paper() };
    settings.check_workmanship.bow_um = (bow_um, 0.0);
    settings.check_workmanship.pitch_um = noise.print_um.unwrap_or(settings.check_workmanship.pitch_um);
    World::new(settings, None).expect("the preset is possible")
}

pub fn noisy(mut corners: Corners, seed: u64, sigma_px: f64) -> Corners {
    let mut draws = Draws::new(seed, Purpose::Points, 3);
    for corner in corners.pairs.iter_mut().flat_map(|p| p.left.iter_mut().chain(&mut p.right)) {
        corner.px += Vector2::new(draws.normal(), draws.normal()) * sigma_px;
        corner.covariance_px2 = Some(Matrix2::identity() * sigma_px * sigma_px);
    }
    corners
}

/// True numbers of the rig less those found, in the order of a rig's numbers.
fn off(truth: &Rig, found: &Rig) -> [f64; RIG_NUMBERS] {
    let mut off = [0.0; RIG_NUMBERS];
    for (start, side) in [(0, Side::Left), (CAMERA_NUMBERS, Side::Right)] {
        let (t, f) = (truth.camera(side), found.camera(side));
        let differences = [t.fx - f.fx, t.fy - f.fy, t.cx - f.cx, t.cy - f.cy];
        off[start..start + 4].copy_from_slice(&differences);
        for (k, (t, f)) in t.distortion.iter().zip(&f.distortion).enumerate() {
            off[start + 4 + k] = t - f;
        }
    }
    let turn = (truth.right_from_left.rotation * found.right_from_left.rotation.inverse()).scaled_axis();
    let shift = truth.right_from_left.translation.vector - found.right_from_left.translation.vector;
    off[2 * CAMERA_NUMBERS..2 * CAMERA_NUMBERS + 3].copy_from_slice(turn.as_slice());
    off[2 * CAMERA_NUMBERS + 3..].copy_from_slice(shift.as_slice());
    off
}

fn parameters(truth: &Rig, found: &Rig) -> Tally {
    let mut tally = Tally::default();
    let Some(covariance) = &found.covariance else { return tally };
    let off = off(truth, found);
    for (k, name) in covariance.order.iter().enumerate() {
        if let Some(number) = rig_number(name) {
            tally.add(off[number], covariance.matrix[(k, k)].sqrt());
        }
    }
    tally
}

/// Lengths along rows and columns of fresh boards, seen with the same noise; or, where they are exact, the rig's share
/// of the errors alone.
pub fn lengths(found: &Calibration, seed: u64, noise: Noise, exact: bool) -> Tally {
    const EXACT_PX: f64 = 1e-6;
    let mut tally = Tally::default();
    let fresh = world(seed + 100_000, 4, 0.0, noise);
    let corners = noisy(fresh.check_corners(), seed + 100_000, if exact { EXACT_PX } else { noise.sigma_px });
    let rig = found.rig();
    let Some(covariance) = rig.covariance.as_ref().map(RigCovariance::new) else { return tally };
    let board = corners.board;
    for pair in &corners.pairs {
        let mut views = [View::new(&board, pair, 0)];
        found.own_noise.apply(&mut views);
        let at = |side, col, row| views[0].active(side).find(|o| (o.col, o.row) == (col, row));
        let point = |col, row| triangulate(rig, at(Side::Left, col, row)?, at(Side::Right, col, row)?);
        for (from, to) in (0..board.corner_count()).flat_map(|k| {
            let (col, row) = board.place(k);
            [((col, row), (col + SPAN, row)), ((col, row), (col, row + SPAN))]
        }) {
            let (Some(a), Some(b)) = (point(from.0, from.1), point(to.0, to.1)) else { continue };
            let true_mm =
                (fresh.check_board.corner_mm(to.0, to.1) - fresh.check_board.corner_mm(from.0, from.1)).norm();
            let of_corners = if exact { 0.0 } else { a.corner_variance_mm2(&b) };
            let variance = of_corners + covariance.length_variance_mm2(&a, &b);
            tally.add((b.point_mm - a.point_mm).norm() - true_mm, variance.sqrt());
        }
    }
    tally
}

pub fn run() {
    let told = |lens, shape| Options { lens, shape, known: None };
    let cases = [
        Case { name: "model true (brown4, flat)", bow_um: 0.0, options: told(Some(Lens::Brown4), Some(false)) },
        Case { name: "shape free", bow_um: 50.0, options: told(Some(Lens::Brown4), Some(true)) },
        Case { name: "chosen by the program", bow_um: 50.0, options: Options::default() },
        Case { name: "50 um of shape missing", bow_um: 50.0, options: told(Some(Lens::Brown4), Some(false)) },
        Case { name: "tangential terms missing", bow_um: 0.0, options: told(Some(Lens::Radial2), Some(false)) },
    ];
    println!(
        "\n{RIGS} rigs a line, {PAIRS} pairs of 26 Mpx, corners {} px: numbers of the rig, and lengths of 70 mm on fresh boards",
        PAPER.sigma_px
    );
    println!(
        "                           |   within 95 %  chi2 |   within 95 %  chi2  RMS um  largest um: median rig, all"
    );
    for case in &cases {
        let each: Vec<Option<(Tally, Tally)>> = (0..RIGS)
            .into_par_iter()
            .map(|seed| {
                let world = world(1000 + seed, PAIRS, case.bow_um, PAPER);
                let found = calibrate(&noisy(world.check_corners(), seed, PAPER.sigma_px), &case.options).ok()?;
                Some((parameters(&world.rig, found.rig()), lengths(&found, seed, PAPER, false)))
            })
            .collect();
        let (mut numbers, mut lengths) = (Tally::default(), Tally::default());
        for (n, l) in each.iter().flatten() {
            numbers.merge(n);
            lengths.merge(l);
        }
        let mut by_rig: Vec<f64> = each.iter().flatten().map(|(_, l)| l.largest).collect();
        by_rig.sort_by(f64::total_cmp);
        let median = by_rig.get(by_rig.len() / 2).copied().unwrap_or(f64::NAN);
        let refused = each.iter().filter(|one| one.is_none()).count();
        let share = |t: &Tally| (100.0 * t.inside / t.count.max(1.0), t.chi / t.count.max(1.0));
        let ((inside, chi), (inside_l, chi_l)) = (share(&numbers), share(&lengths));
        println!(
            "{:26} | {inside:12.1} {chi:6.2} | {inside_l:12.1} {chi_l:6.2} {:6.3} {:6.3} {:6.3}{}",
            case.name,
            1e3 * (lengths.squares / lengths.count.max(1.0)).sqrt(),
            1e3 * median,
            1e3 * lengths.largest,
            if refused > 0 { format!("  ({refused} refused)") } else { String::new() }
        );
    }
}
