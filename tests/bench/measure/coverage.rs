//! Whether the intervals hold what they promise: points, orientations and distances to the centre against the truth,
//! over many rigs.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use stereocal::measurements::Role;
use stereocal::stereo::board_pose::Series;
use stereocal::stereo::board_pose::TargetPose;
use stereocal::stereo::board_pose::series::measure;

use crate::worlds::{knowledge, run as poses_of, world};

/// Rigs for each line: what all poses of a rig share is one draw a rig.
const RIGS: u64 = 96;

/// Of a Gaussian within its 95 % interval.
const WIDTH: f64 = 1.96;

#[derive(Default)]
pub struct Tally {
    count: f64,
    squares: f64,
    chi: f64,
    inside: f64,
}

impl Tally {
    pub fn add(&mut self, off: f64, sigma: f64) {
        self.count += 1.0;
        self.squares += off * off;
        self.chi += (off / sigma).powi(2);
        self.inside += f64::from(u8::from(off.abs() <= WIDTH * sigma));
    }

    pub fn merge(mut self, other: Tally) -> Tally {
        self.count += other.count;
        self.squares += other.squares;
        self.chi += other.chi;
        self.inside += other.inside;
        self
    }

    pub fn show(&self, unit: f64) -> String {
        let n = self.count.max(1.0);
        format!("{:8.3} {:6.2} {:5.1} %", (self.squares / n).sqrt() * unit, self.chi / n, 100.0 * self.inside / n)
    }
}

/// Points, orientations, distances.
type Tallies = [Tally; 3];

fn run_all(size_px: u32, target_um: f64, samples: usize) -> (Tallies, usize) {
    let each: Vec<(Tallies, usize)> = (0..RIGS)
        .into_par_iter()
        .map(|seed| {
            let world = world(size_px, target_um, samples, 100 + seed);
            let series = measure(&knowledge(&world), poses_of(&world));
            let alarms = usize::from(series.judgement.describe(&world.rig, &world.target.drawing).is_some())
                + series.poses.iter().filter(|pose| pose.target.is_err()).count();
            let truth: Vec<_> = world.poses.iter().map(|pose| pose.left_from_target).collect();
            let roles: Vec<(usize, Role)> = world.poses.iter().map(|pose| (pose.group, pose.commanded.role)).collect();
            (tally(&series, &truth, &roles), alarms)
        })
        .collect();
    let empty = || std::array::from_fn(|_| Tally::default());
    each.into_iter().fold((empty(), 0), |(sum, alarms), (one, more)| {
        let mut one = one.into_iter();
        (sum.map(|tally| tally.merge(one.next().unwrap())), alarms + more)
    })
}

fn tally(series: &Series, truth: &[nalgebra::Isometry3<f64>], roles: &[(usize, Role)]) -> Tallies {
    let mut tallies: Tallies = std::array::from_fn(|_| Tally::default());
    let Some(shared) = &series.shared else { return tallies };
    let found: Vec<Option<&TargetPose>> = series.poses.iter().map(|pose| pose.target.as_ref().ok()).collect();
    let at = |i: usize| found[i].map(|t| t.cam_from_board.translation.vector);
    for i in 0..found.len() {
        let Some(target) = found[i] else { continue };
        let off = target.cam_from_board.translation.vector - truth[i].translation.vector;
        let turn = (target.cam_from_board.rotation * truth[i].rotation.inverse()).scaled_axis();
        for k in 0..3 {
            tallies[0].add(off[k], target.covariance[(3 + k, 3 + k)].sqrt());
            tallies[1].add(turn[k], target.covariance[(k, k)].sqrt());
        }
        let center = (0..found.len()).find(|&j| roles[j] == (roles[i].0, Role::Center));
        let Some(j) = center.filter(|&j| j != i && found[j].is_some()) else { continue };
        let (Some(here), Some(there), Some(middle)) = (at(i), at(j), found[j]) else { continue };
        let way: Vector3<f64> = here - there;
        let true_way = truth[i].translation.vector - truth[j].translation.vector;
        let own: Matrix3<f64> = (target.own_covariance + middle.own_covariance).fixed_view::<3, 3>(3, 3).into_owned();
        let by_shared = &target.sensitivity - &middle.sensitivity;
        let through = &by_shared * &shared.covariance * by_shared.transpose();
        let spread = own + through.fixed_view::<3, 3>(3, 3);
        let along = way.normalize();
        tallies[2].add(way.norm() - true_way.norm(), along.dot(&(spread * along)).sqrt());
    }
    tallies
}

pub fn run() {
    println!(
        "coverage: {RIGS} rigs a line, each calibrated from 16 noisy pairs; RMS, chi-square a number, within the 95 % interval"
    );
    println!("  px  target poses | point um            | orientation urad    | distance um         | alarms");
    for (size_px, target_um, samples) in [
        (1280, 0.0, 96),
        (1280, 10.0, 96),
        (5120, 0.0, 96),
        (5120, 10.0, 96),
        (1280, 0.0, 6),
        (1280, 10.0, 6),
        (5120, 10.0, 6),
    ] {
        let ([points, turns, distances], alarms) = run_all(size_px, target_um, samples);
        let poses = samples + 4;
        println!(
            "{size_px:5} {target_um:5.0} um {poses:4} | {} | {} | {} | {alarms}",
            points.show(1e3),
            turns.show(1e6),
            distances.show(1e3)
        );
    }
}
