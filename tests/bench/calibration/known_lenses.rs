//! Lenses that are known: lengths against what any method could reach with the same corners and the same knowledge of
//! the lenses, and lenses that are not those of the pictures.

use rayon::prelude::*;
use stereocal::imaging::Side;
use stereocal::simulate::draws::{Draws, Purpose};
use stereocal::simulate::world::World;
use stereocal::stereo::Lens;
use stereocal::stereo::calibrate::{Calibration, calibrate};
use stereocal::stereo::model::known_lenses::KnownLenses;
use stereocal::stereo::model::rig::Covariance;
use stereocal::stereo::pairs::Cause;
use stereocal::stereo::select::options::Options;
use stereocal::stereo::solve::problem::Problem;
use stereocal::stereo::solve::uncertainty;

use crate::coverage::{Noise, Tally, lengths, noisy, world};

/// Rigs a line.
const RIGS: u64 = 30;

/// Pictures and their corners: 26 Mpx as rendered pictures give them, and 1.6 Mpx. The print is exact: what it does to
/// lengths is no matter of the lenses, and would hide it.
const CAMERAS: [Noise; 2] = [
    Noise { size_px: 5120, sigma_px: 0.002, print_um: Some(0.0) },
    Noise { size_px: 1280, sigma_px: 0.01, print_um: Some(0.0) },
];

/// Pairs of the day on which the lenses were calibrated: lenses that are known well, and badly.
const KNOWN: [(&str, usize); 2] = [("tight", 40), ("loose", 6)];

/// What the lenses of the pictures are.
#[derive(Clone, Copy, PartialEq)]
enum Lenses {
    Right,
    Focus,
    Other,
    Swapped,
}

impl Lenses {
    const ALL: [(&str, Lenses, Option<Cause>); 4] = [
        ("right", Lenses::Right, None),
        ("left focused by 0.1 %", Lenses::Focus, Some(Cause::Focus)),
        ("another left camera", Lenses::Other, Some(Cause::OtherCamera)),
        ("swapped", Lenses::Swapped, Some(Cause::Exchanged)),
    ];

    /// The world in which the known lenses are wrong by so much.
    fn changed(self, mut world: World, seed: u64) -> World {
        let mut draws = Draws::new(seed, Purpose::Points, 9);
        let left = &mut world.rig.left;
        match self {
            Lenses::Focus => {
                left.fx *= 1.001;
                left.fy *= 1.001;
            }
            // As two lenses of one kind differ: 1 % of focal length and picture, a tenth of the distortion.
            Lenses::Other => {
                let mut share = || 0.01 * if draws.normal() > 0.0 { 1.0 } else { -1.0 };
                let (focal, x, y) = (share(), share(), share());
                left.fx *= 1.0 + focal;
                left.fy *= 1.0 + focal;
                left.cx += x * f64::from(left.width);
                left.cy += y * f64::from(left.height);
                left.distortion[0] *= 0.9;
            }
            Lenses::Right | Lenses::Swapped => {}
        }
        world
    }
}

/// The lenses as a file of another day has them.
fn known(seed: u64, pairs: usize, noise: Noise) -> Option<KnownLenses> {
    let options = Options { lens: Some(Lens::Brown4), shape: Some(false), known: None };
    let corners = noisy(world(5000 + seed, pairs, 0.0, noise).check_corners(), 5000 + seed, noise.sigma_px);
    let found = calibrate(&corners, &options).ok()?;
    let mut known = KnownLenses::of_rig(found.rig(), &Side::BOTH);
    known.pairs = Some(found.pair_scatter.groups);
    known.noise = Some(found.own_noise);
    known.pair_motion = found.pair_motion().map(|[variances, _]| variances);
    Some(known)
}

/// The same calibration with the least covariance that corners of this noise and lenses known so well allow (Cramer and
/// Rao).
fn at_bound(found: &Calibration, known: &KnownLenses, noise: Noise) -> Option<Calibration> {
    let problem = found.problem();
    let problem = Problem { priors: problem.priors.knowing(known), ..problem };
    let equations = problem.equations(&found.layout)?;
    let typical = found.noise.typical_px(&found.views);
    let mut bound = found.clone();
    let matrix = uncertainty::covariance(&equations)? * (noise.sigma_px / typical).powi(2);
    bound.values.shared.rig.covariance = Some(Covariance { order: found.layout.names(), matrix });
    Some(bound)
}

struct One {
    lengths: Tally,
    bound: Tally,
    contradicted: bool,
    causes: Vec<Cause>,
    seen: f64,
}

fn one(seed: u64, pairs: usize, known: &KnownLenses, lenses: Lenses, noise: Noise) -> Option<One> {
    let known = if lenses == Lenses::Swapped { known.exchanged() } else { known.clone() };
    let world = lenses.changed(world(seed, pairs, 0.0, noise), seed);
    let options = Options { known: Some(known.clone()), ..Options::default() };
    let found = calibrate(&noisy(world.check_corners(), seed, noise.sigma_px), &options).ok()?;
    let check = found.lens_check.clone()?;
    let (mut of_lengths, mut bound) = (Tally::default(), Tally::default());
    if lenses == Lenses::Right {
        of_lengths = lengths(&found, seed, noise, true);
        bound = lengths(&at_bound(&found, &known, noise)?, seed, noise, true);
    }
    let contradicted = check.contradicts();
    let seen = check.focus_seen[0].unwrap_or(f64::NAN);
    Some(One { lengths: of_lengths, bound, contradicted, causes: check.causes, seen })
}

/// What 30 rigs say, as the rest of a line.
fn told(each: &[Option<One>], cause: Option<Cause>) -> String {
    let rigs: Vec<&One> = each.iter().flatten().collect();
    let count = |of: &dyn Fn(&One) -> bool| rigs.iter().filter(|one| of(one)).count();
    let named = |one: &One| cause.is_some_and(|cause| one.causes.contains(&cause));
    let mut seen: Vec<f64> = rigs.iter().map(|one| 100.0 * one.seen).collect();
    seen.sort_by(f64::total_cmp);
    let (mut lengths, mut bound) = (Tally::default(), Tally::default());
    rigs.iter().for_each(|one| lengths.merge(&one.lengths));
    rigs.iter().for_each(|one| bound.merge(&one.bound));
    let of_lengths = if lengths.count > 0.0 {
        let rms_um = 1e3 * (lengths.squares / lengths.count).sqrt();
        let over = (bound.squares / bound.variances).sqrt();
        format!("{rms_um:8.3} {over:11.3} {:12.1}", 100.0 * lengths.inside / lengths.count)
    } else {
        String::new()
    };
    format!(
        "{:12}  {:5}  {:5}  {:7} | {:12.4} | {of_lengths}",
        count(&|one| one.contradicted),
        count(&named),
        count(&|one| named(one) && one.causes.len() == 1),
        each.len() - rigs.len(),
        seen.get(seen.len() / 2).copied().unwrap_or(f64::NAN)
    )
}

/// With cameras of so many pixels alone, where it is said.
pub fn run(size_px: Option<u64>) {
    println!(
        "\n{RIGS} rigs a line, lenses of another day (brown4, tight: of {} pairs, loose: of {}): how many are contradicted, named by their cause, \
         and by it alone; the change of focus said to be seen; the rig's share of the error of 70 mm on fresh boards, RMS, also over what the \
         bound allows",
        KNOWN[0].1, KNOWN[1].1
    );
    println!(
        "px    corners px  lenses  pairs  they are              | contradicted  named  alone  refused | focus seen % | 70 mm um  over bound  within 95 %"
    );
    for noise in CAMERAS.into_iter().filter(|noise| size_px.is_none_or(|px| noise.size_px as u64 == px)) {
        for (how, known_pairs) in KNOWN {
            let of_day = |seed| known(seed, known_pairs, noise);
            let all: Vec<Option<KnownLenses>> = (0..RIGS).into_par_iter().map(of_day).collect();
            for pairs in [3, 5, 12] {
                for (name, lenses, cause) in Lenses::ALL {
                    let of = |(seed, known): (usize, &Option<KnownLenses>)| {
                        one(seed as u64, pairs, known.as_ref()?, lenses, noise)
                    };
                    let each: Vec<Option<One>> = all.par_iter().enumerate().map(of).collect();
                    let Noise { size_px, sigma_px, .. } = noise;
                    println!("{size_px:<5} {sigma_px:<11} {how:<7} {pairs:<6} {name:<21} | {}", told(&each, cause));
                }
            }
        }
    }
}
