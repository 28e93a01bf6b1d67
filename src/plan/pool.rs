//! Candidates: places and turns of the target in the field of a placement, with the readings that bring it there.
//!
//! Draws come from Weyl's sequence, shifted by the seed: the same candidates whatever the number of threads. Inverse
//! kinematics starts from the postures found at the placement's middle, so that each candidate is near one of them.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::error::{Error, Result};
use super::scene::{self, Placement, PoseNoise, Scene, safe};
use super::settings::Settings;
use crate::geometry::{Transform, transform};
use crate::robot::{Robot, inverse};

/// Draws a candidate that is wanted, at the most.
const DRAWS: usize = 12;

/// Draws as for so many candidates, where fewer are wanted.
const LEAST_DRAWN: usize = 24;

/// Starts that postures at a middle are looked for from.
const STARTS: usize = 200;

/// Tilt and turn of fresh poses, rad: as `simulate` varies them.
const FRESH_RAD: f64 = 25.0 * std::f64::consts::PI / 180.0;

/// Fresh poses a group, at which the accuracy is said; and fewest of them, where the arm reaches a part of the sphere.
const FRESH: usize = 50;
const LEAST_FRESH: usize = 10;

/// Turn about the flange's axis of candidates, rad.
const SPIN_RAD: f64 = std::f64::consts::PI;

/// A pose that could be planned.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Index of its placement.
    pub group: usize,
    /// Readings, rad (mm).
    pub joints_rad: Vec<f64>,
    pub left_from_target: Transform,
    /// Covariance of the measured point, base frame, mm^2.
    pub covariance_mm2: Matrix3<f64>,
}

/// What kind of candidates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The spheres' middles.
    Center,
    /// The paper's: on the sphere, one orientation; so many in all.
    Paper(usize),
    /// A handful round the middle, a group.
    First(usize),
    /// All over the field, at all turns; so many in all.
    Pool(usize),
    /// On the sphere, tilted and turned; so many in all.
    Verify(usize),
    /// The same, other ones, for judging.
    Fresh,
}

/// What candidates are drawn from.
pub struct Pool<'a> {
    pub robot: &'a Robot,
    pub scene: &'a Scene,
    pub settings: &'a Settings,
    pub placements: &'a [Placement],
    pub noise: PoseNoise,
}

/// A draw's numbers in [0, 1).
struct Draw {
    number: usize,
    shift: f64,
}

impl Draw {
    fn at(&self, dimension: usize) -> f64 {
        const PRIMES: [f64; 6] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0];
        let root = PRIMES[dimension % PRIMES.len()].sqrt();
        ((self.number + 1) as f64 * root + self.shift * (1.0 + root)).fract()
    }

    fn between(&self, dimension: usize, low: f64, high: f64) -> f64 {
        low + (high - low) * self.at(dimension)
    }

    /// A direction, uniform on the sphere.
    fn direction(&self) -> Vector3<f64> {
        let z = self.between(0, -1.0, 1.0);
        let (sin, cos) = (std::f64::consts::TAU * self.at(1)).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vector3::new(r * cos, r * sin, z)
    }

    /// A tilt of up to so much any way (even over the area), then a turn of up to so much either way.
    fn turn(&self, tilt_rad: f64, spin_rad: f64) -> UnitQuaternion<f64> {
        let (sin, cos) = (std::f64::consts::TAU * self.at(3)).sin_cos();
        let tilt = Vector3::new(cos, sin, 0.0) * (tilt_rad * self.at(4).sqrt());
        let spin = Vector3::z() * self.between(5, -spin_rad, spin_rad);
        UnitQuaternion::from_scaled_axis(tilt) * UnitQuaternion::from_scaled_axis(spin)
    }
}

impl Pool<'_> {
    /// Candidates of a kind, in their order.
    pub fn candidates(&self, kind: Kind) -> Result<Vec<Candidate>> {
        let groups = self.placements.len();
        let share = |total: usize, group: usize| total / groups + usize::from(group < total % groups);
        let mut all = Vec::new();
        for (group, placement) in self.placements.iter().enumerate() {
            let wanted = match kind {
                Kind::Center => 1,
                Kind::First(count) => count,
                Kind::Fresh => FRESH,
                Kind::Paper(total) | Kind::Pool(total) | Kind::Verify(total) => share(total, group),
            };
            let postures = self.postures(group)?;
            // The best posture, where it reaches enough of the field; after so many draws the others too.
            let alone = if matches!(kind, Kind::Pool(_) | Kind::Center) { 0 } else { DRAWS * wanted.max(LEAST_DRAWN) };
            let most = alone + DRAWS * wanted.max(LEAST_DRAWN);
            let tries: Vec<usize> = (0..most).collect();
            // In slices of the number wanted, so that no more is searched than needed; the order decides what is kept.
            let mut found: Vec<Candidate> = Vec::new();
            for slice in tries.chunks(wanted.max(LEAST_DRAWN)) {
                let postures = |k: usize| if k < alone { &postures[..1] } else { &postures[..] };
                let drawn: Vec<Candidate> =
                    slice.par_iter().filter_map(|&k| self.candidate(kind, group, k, postures(k))).collect();
                found.extend(drawn.into_iter().take(wanted - found.len()));
                if found.len() == wanted {
                    break;
                }
            }
            let needed = match kind {
                Kind::Pool(_) => (2 * share(self.settings.samples, group)).min(wanted),
                Kind::Fresh => LEAST_FRESH,
                _ => wanted,
            };
            if found.len() < needed {
                return Err(Error::TooFew {
                    group: placement.name.clone(),
                    found: found.len(),
                    tried: most,
                    needed,
                    asked: !matches!(kind, Kind::Center | Kind::Fresh),
                    reached_mm: None,
                });
            }
            all.extend(found);
        }
        Ok(all)
    }

    /// Postures at the placement's middle, or as near to it as there is one, the best first.
    fn postures(&self, group: usize) -> Result<Vec<Vec<f64>>> {
        let placement = &self.placements[group];
        for k in 0..=CENTER_DRAWS {
            let found = self.postures_at(&(placement.base_from_field * self.drawn(Kind::Center, k, group)));
            if !found.is_empty() {
                return Ok(found);
            }
        }
        let group = placement.name.clone();
        Err(Error::TooFew { group, found: 0, tried: STARTS, needed: 1, asked: false, reached_mm: None })
    }

    /// Share of a sphere's places at which the cameras see the target wholly, whatever the arm reaches.
    pub fn share_in_view(&self) -> f64 {
        let seen = (0..FRESH).filter(|&k| self.scene.accepts(&self.drawn(Kind::Fresh, k, 0)));
        seen.count() as f64 / FRESH as f64
    }

    /// Postures with the target there, the best first.
    fn postures_at(&self, base_from_target: &Transform) -> Vec<Vec<f64>> {
        let wanted = scene::base_from_flange(self.robot, base_from_target);
        let mut found: Vec<(f64, Vec<f64>)> = Vec::new();
        for k in 0..STARTS {
            let start = inverse::spread_start(self.robot, k);
            let Some(q) = inverse::from_start(self.robot, &wanted, &start) else { continue };
            let known = |other: &(f64, Vec<f64>)| other.1.iter().zip(&q).all(|(a, b)| (a - b).abs() < 0.1);
            if !found.iter().any(known) && safe(self.robot, &q) {
                found.push((inverse::merit(self.robot, &q), q));
            }
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        found.truncate(MOST_POSTURES);
        found.into_iter().map(|(_, q)| q).collect()
    }

    fn candidate(&self, kind: Kind, group: usize, k: usize, postures: &[Vec<f64>]) -> Option<Candidate> {
        let placement = &self.placements[group];
        let field_from_target = self.drawn(kind, k, group);
        if (kind != Kind::Center || k > 0) && !self.scene.accepts(&field_from_target) {
            return None;
        }
        let wanted = scene::base_from_flange(self.robot, &(placement.base_from_field * field_from_target));
        let joints_rad = inverse::from_start(self.robot, &wanted, &postures[k % postures.len()])?;
        if !safe(self.robot, &joints_rad) {
            return None;
        }
        let left_from_target = self.scene.left_from_field * field_from_target;
        let covariance = self.scene.covariance_mm2(&left_from_target, &self.noise)?;
        Some(Candidate { group, joints_rad, left_from_target, covariance_mm2: placement.in_base(&covariance) })
    }

    /// `field_from_target` of a draw.
    fn drawn(&self, kind: Kind, k: usize, group: usize) -> Transform {
        let stream = match kind {
            Kind::Center | Kind::First(_) => 0,
            Kind::Pool(_) => 1,
            Kind::Paper(_) => 2,
            Kind::Verify(_) => 3,
            Kind::Fresh => 4,
        };
        let shift = (self.settings.seed % 1_000_003) as f64 * 0.618_033_988_749_895;
        let draw = Draw { number: k, shift: (shift + 0.137 * (5 * group + stream) as f64).fract() };
        let radius = self.settings.radius_mm;
        let at = |turn: UnitQuaternion<f64>, place: Vector3<f64>| transform(turn.scaled_axis(), place);
        match kind {
            // Upright in the middle of the field, or as near to that as the arm can: cameras stand where they can, too.
            Kind::Center => {
                let share = (k as f64 / UPRIGHT_DRAWS).min(1.0);
                let beyond = ((k as f64 - UPRIGHT_DRAWS) / (CENTER_DRAWS as f64 - UPRIGHT_DRAWS)).clamp(0.0, 1.0);
                let wider = |most: f64| share * FRESH_RAD + beyond * (most - FRESH_RAD).max(0.0);
                let turn = draw.turn(wider(self.scene.tilt_rad), wider(SPIN_RAD));
                at(turn, draw.direction() * (share * CENTER_SHARE * radius))
            }
            Kind::Paper(_) => at(UnitQuaternion::identity(), draw.direction() * radius),
            Kind::Verify(_) | Kind::Fresh => at(draw.turn(FRESH_RAD, FRESH_RAD), draw.direction() * radius),
            Kind::First(_) => {
                let reach = 0.5 * radius;
                at(draw.turn(0.5 * FRESH_RAD, 0.5 * FRESH_RAD), draw.direction() * reach)
            }
            Kind::Pool(_) => {
                let half = self.scene.width_mm() / 2.0;
                let depth = self.scene.depth_mm;
                let place = Vector3::new(
                    draw.between(0, -half, half),
                    draw.between(1, -half, half),
                    draw.between(2, -depth, depth),
                );
                at(draw.turn(self.scene.tilt_rad, SPIN_RAD), place)
            }
        }
    }
}

/// Draws over which a center is tilted and shifted more and more, where the arm cannot hold it upright in the middle:
/// as far as fresh poses are. From there to the last draw it is tilted as far as the cameras see it and turned any way.
const UPRIGHT_DRAWS: f64 = 50.0;
const CENTER_DRAWS: usize = 250;

/// Farthest a center may be from the middle, as a share of the sphere's radius.
const CENTER_SHARE: f64 = 0.8;

/// Postures of the arm that candidates are taken from: all of a six-axis arm.
const MOST_POSTURES: usize = 8;
