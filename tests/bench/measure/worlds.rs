//! Worlds at the level of corners: a rig calibrated from noisy corners, and a run of noisy poses.

use nalgebra::{Matrix2, Vector2};
use stereocal::imaging::Corners;
use stereocal::simulate::draws::{Draws, Purpose};
use stereocal::simulate::settings::Settings;
use stereocal::simulate::world::World;
use stereocal::stereo::Lens;
use stereocal::stereo::board_pose::pair_excess::{farthest_pair, pair_excess};
use stereocal::stereo::board_pose::{Knowledge, Seen};
use stereocal::stereo::calibrate::calibrate;
use stereocal::stereo::select::options::Options;

/// Standard deviation of a corner's coordinate at 1280 px, as rendered pictures give it; at 5120 px the same corner is
/// as sharp.
pub const SIGMA_PX: f64 = 0.002;

/// A world of a size, with a target whose crossings are off by so much.
pub fn world(size_px: u32, target_um: f64, samples: usize, seed: u64) -> World {
    let mut settings = Settings { size_px, samples, verify: 0, seed, ..Settings::small() };
    settings.target_workmanship.pitch_um = target_um;
    World::new(settings, None).expect("the preset is possible")
}

/// The same with a robot that repeats exactly.
pub fn still_world(size_px: u32, target_um: f64, samples: usize, seed: u64) -> World {
    let mut settings = Settings { size_px, samples, verify: 0, seed, ..Settings::small() };
    settings.target_workmanship.pitch_um = target_um;
    settings.robot.repeatability_mm = 0.0;
    World::new(settings, None).expect("the preset is possible")
}

/// What the calibration of a world's check pairs leaves `measure` with.
pub fn knowledge(world: &World) -> Knowledge {
    known_from(world, &noisy(world.check_corners(), 2 * world.settings.seed)).expect("a calibration")
}

fn known_from(world: &World, corners: &Corners) -> Option<Knowledge> {
    let forced = Options { lens: Some(Lens::Brown4), shape: Some(false), known: None };
    let found = calibrate(corners, &forced).ok()?;
    Some(Knowledge {
        rig: found.rig().clone(),
        noise: Some(found.own_noise),
        pair_excess: Some(pair_excess(&found)),
        farthest_pair: farthest_pair(&found),
        volume: None,
        board: world.target.drawing,
        crossing_mm: 0.01,
        tolerance_mm: 0.05,
    })
}

/// The run of a world's poses.
pub fn run(world: &World) -> Vec<Seen> {
    let corners = noisy(world.pose_corners(), 2 * world.settings.seed + 1);
    let poses = world.poses.iter().zip(corners.pairs);
    poses.map(|(pose, pair)| Seen { at: pose.commanded.clone(), corners: Ok(pair) }).collect()
}

/// The run where the world is another at each pose, as `change` makes it.
pub fn changing_run(world: &World, change: impl Fn(usize, &mut World)) -> Vec<Seen> {
    let mut corners = world.pose_corners();
    for (i, pair) in corners.pairs.iter_mut().enumerate() {
        let mut other = world.clone();
        change(i, &mut other);
        other.poses = vec![world.poses[i].clone()];
        *pair = other.pose_corners().pairs.remove(0);
    }
    let corners = noisy(corners, 2 * world.settings.seed + 1);
    let poses = world.poses.iter().zip(corners.pairs);
    poses.map(|(pose, pair)| Seen { at: pose.commanded.clone(), corners: Ok(pair) }).collect()
}

/// What a calibration leaves `measure` with whose pictures were as little simultaneous as `change` makes them.
pub fn changing_knowledge(world: &World, change: impl Fn(usize, &mut World)) -> Option<Knowledge> {
    let mut corners = world.check_corners();
    for (i, pair) in corners.pairs.iter_mut().enumerate() {
        let mut other = world.clone();
        change(i, &mut other);
        other.check_poses = vec![world.check_poses[i]];
        *pair = other.check_corners().pairs.remove(0);
    }
    known_from(world, &noisy(corners, 2 * world.settings.seed))
}

fn noisy(mut corners: Corners, seed: u64) -> Corners {
    let mut draws = Draws::new(seed, Purpose::Points, 7);
    for pair in &mut corners.pairs {
        for corner in pair.left.iter_mut().chain(&mut pair.right) {
            corner.px += Vector2::new(draws.normal(), draws.normal()) * SIGMA_PX;
            corner.covariance_px2 = Some(Matrix2::identity() * SIGMA_PX * SIGMA_PX);
        }
    }
    corners
}
