//! Whether a calibration still holds: how often a rig that stands is said to have changed, and changes of each cause at
//! shares of the size that is said to be seen.

use rayon::prelude::*;
use stereocal::geometry::transform;
use stereocal::imaging::Corners;
use stereocal::simulate::draws::{Draws, Purpose};
use stereocal::simulate::world::World;
use stereocal::stereo::Rig;
use stereocal::stereo::board_pose::pair_excess::{farthest_pair, pair_excess};
use stereocal::stereo::calibrate::calibrate;
use stereocal::stereo::findings::hypothesis;
use stereocal::stereo::model::board_shape::FLAT;
use stereocal::stereo::model::parameters::{Layout, Shared};
use stereocal::stereo::recheck::{Before, Recheck, recheck};
use stereocal::stereo::select::options::Options;
use stereocal::stereo::volume::{Extent, Volume};

use crate::coverage::{Noise, noisy, world};

/// Pairs that calibrate.
const PAIRS: usize = 12;
/// Of the size that is said to be seen in nineteen of twenty checks.
const SHARES: [f64; 3] = [0.5, 1.0, 2.0];

/// Cameras, and by how much the right one turns at random from pair to pair, deg: a board in a hand before cameras that
/// nobody triggers looks like that.
const SCENES: [(&str, Noise, f64); 2] = [
    ("1.6 Mpx, triggered", Noise { size_px: 1280, sigma_px: 0.01, print_um: Some(0.0) }, 0.0),
    ("1.6 Mpx, by hand", Noise { size_px: 1280, sigma_px: 0.05, print_um: Some(0.0) }, 0.01),
];

/// The corners of a world in which the right camera turns by so much at random between pairs.
fn corners(world: &World, seed: u64, noise: Noise, loose_deg: f64) -> Corners {
    let mut all = world.check_corners();
    let mut draws = Draws::new(seed, Purpose::Points, 17);
    for i in 0..if loose_deg > 0.0 { all.pairs.len() } else { 0 } {
        let turn = nalgebra::Vector3::from_fn(|_, _| draws.normal()) * loose_deg.to_radians();
        let mut turned = world.clone();
        turned.rig.right_from_left = transform(turn, nalgebra::Vector3::zeros()) * world.rig.right_from_left;
        all.pairs[i] = turned.check_corners().pairs[i].clone();
    }
    noisy(all, seed, noise.sigma_px)
}

fn before(seed: u64, noise: Noise, loose_deg: f64) -> Option<Before> {
    let found =
        calibrate(&corners(&world(seed, PAIRS, 0.0, noise), seed, noise, loose_deg), &Options::default()).ok()?;
    Some(Before {
        rig: found.rig().clone(),
        noise: Some(found.own_noise),
        pair_excess: pair_excess(&found),
        farthest_pair: farthest_pair(&found),
        pairs: Some(found.pair_scatter.groups),
        volume: Some(Volume::of(&found, Extent::Boards)),
    })
}

/// Counts of checks with the same change.
#[derive(Default, Clone, Copy)]
struct Count {
    checks: usize,
    seen: usize,
    named: usize,
    other: usize,
}

impl Count {
    fn add(&mut self, found: &Recheck, word: &str) {
        let cause = found.cause();
        let named = cause.split('|').any(|cause| cause == word);
        self.checks += 1;
        self.seen += usize::from(found.change.is_some());
        self.named += usize::from(named);
        self.other += usize::from(found.change.is_some() && !named && cause != "unknown");
    }
}

/// A rig that stands, then each cause at each share.
fn one(seed: u64, pairs: usize, noise: Noise, loose_deg: f64) -> Option<(Count, Vec<[Count; SHARES.len()]>)> {
    let before = before(7000 + seed, noise, loose_deg)?;
    let today = world(8000 + seed, pairs, 0.0, noise);
    let check = |rig: &Rig| {
        let mut today = today.clone();
        today.rig = rig.clone();
        recheck(&before, &corners(&today, 8000 + seed, noise, loose_deg)).ok()
    };
    let stands = check(&today.rig)?;
    let mut none = Count::default();
    none.add(&stands, "");
    let layout =
        Layout { left: Some(today.rig.left.lens), right: Some(today.rig.right.lens), transform: true, shape: false };
    let causes = hypothesis::all(&layout, &today.rig);
    let counts = causes.iter().zip(&stands.causes).map(|(h, stated)| {
        SHARES.map(|share| {
            let step = &h.direction * (share * stated.seen);
            let shared = Shared { rig: today.rig.clone(), shape_mm: FLAT };
            let mut count = Count::default();
            if let Some(found) = check(&layout.step(&shared, step.as_slice()).rig) {
                count.add(&found, h.cause.word());
            }
            count
        })
    });
    Some((none, counts.collect()))
}

pub fn run(rigs: u64, wanted: &str) {
    println!(
        "\n{rigs} rigs a line, calibrated by {PAIRS} pairs, and other pairs after a change of so many times the size that is said to be seen: \
         seen % (named by the cause %, by another one %; what is left is of unknown cause)"
    );
    for (scene, noise, loose_deg) in SCENES.into_iter().filter(|(scene, ..)| scene.contains(wanted)) {
        for pairs in [3, 5] {
            let each: Vec<_> =
                (0..rigs).into_par_iter().filter_map(|seed| one(seed, pairs, noise, loose_deg)).collect();
            let alarms = each.iter().filter(|(none, _)| none.seen > 0).count();
            println!("{scene}, {pairs} pairs: {alarms} of {} rigs that stand are said to have changed", each.len());
            let layout = Layout { left: None, right: None, transform: true, shape: false };
            let rig = &world(1, 1, 0.0, noise).rig;
            let names =
                hypothesis::all(&Layout { left: Some(rig.left.lens), right: Some(rig.right.lens), ..layout }, rig);
            for (k, h) in names.iter().enumerate() {
                let told = (0..SHARES.len()).map(|s| {
                    let sum = |of: &dyn Fn(&Count) -> usize| each.iter().map(|(_, c)| of(&c[k][s])).sum::<usize>();
                    let percent = |count: usize| 100.0 * count as f64 / sum(&|c| c.checks).max(1) as f64;
                    let [seen, named, other] =
                        [percent(sum(&|c| c.seen)), percent(sum(&|c| c.named)), percent(sum(&|c| c.other))];
                    format!("{:3.1}: {seen:5.1} ({named:5.1}, {other:4.1})", SHARES[s])
                });
                println!("  {:52} {}", h.words, told.collect::<Vec<_>>().join("   "));
            }
        }
    }
}
