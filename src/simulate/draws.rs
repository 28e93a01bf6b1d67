//! Random draws of the simulator: every one comes from the seed, and each purpose has a stream of its own, so that
//! adding a draw in one place changes nothing in another and no order of threads matters.

use nalgebra::Vector3;
use rand::Rng;
use rand_pcg::Pcg64;

/// What a stream of draws is for. The number is part of the stream's name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Deviations of the robot's parameters from nominal.
    RobotErrors = 1,
    /// Where each corner of a board really is.
    BoardPitch = 2,
    /// Poses of the check board.
    CheckPoses = 3,
    /// Where the cameras stand, and where the robot goes.
    RobotPoses = 4,
    /// What stands behind the board.
    Clutter = 6,
    /// Photon and read noise.
    Pixels = 7,
    /// Light that falls differently on each camera.
    Lighting = 8,
    /// Noise of measurements that are made without pictures.
    Points = 9,
    /// Gear harmonics, gravity and parallel axes.
    Effects = 10,
    /// Roughness of what stands behind.
    Texture = 11,
    /// What happens to a picture after the lens.
    PictureFaults = 12,
}

/// A stream of draws.
#[derive(Debug, Clone)]
pub struct Draws {
    rng: Pcg64,
}

impl Draws {
    /// The stream of a seed, a purpose and an index (a picture, a group, a tile).
    pub fn new(seed: u64, purpose: Purpose, index: u64) -> Draws {
        let state = u128::from(mixed(seed)) << 64 | u128::from(mixed(seed ^ mixed(purpose as u64)));
        let stream = u128::from(mixed(index.wrapping_add((purpose as u64) << 56)));
        Draws { rng: Pcg64::new(state, stream) }
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.rng.next_u64()
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * 2f64.powi(-53)
    }

    /// Uniform in [low, high).
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Standard normal (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.unit()).cos()
    }

    /// Three independent standard normals.
    pub fn normal3(&mut self) -> Vector3<f64> {
        Vector3::new(self.normal(), self.normal(), self.normal())
    }

    /// A direction, uniform on the sphere.
    pub fn direction(&mut self) -> Vector3<f64> {
        let z = self.uniform(-1.0, 1.0);
        let (sin, cos) = self.uniform(0.0, std::f64::consts::TAU).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vector3::new(r * cos, r * sin, z)
    }
}

/// Spreads neighbouring numbers over all 64 bits (the finaliser of splitmix64).
fn mixed(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Standard normal deviates from 32 random bits by the inverse distribution function in a table: pictures need
/// millions.
#[derive(Debug, Clone)]
pub struct NormalTable {
    deviates: Vec<f32>,
}

/// log2 of the table's length. With 4096 cells the largest deviate is 3.7.
const TABLE_BITS: u32 = 12;

impl NormalTable {
    /// Tabulates the mean deviate of 4096 equally likely intervals, scaled to unit variance.
    pub fn new() -> NormalTable {
        let count = 1usize << TABLE_BITS;
        // Cumulative sum of the density on a fine grid, inverted at the middle of each interval.
        let steps = 400_000usize;
        let (low, width) = (-6.0f64, 12.0 / steps as f64);
        let norm = (2.0 * std::f64::consts::PI).sqrt().recip() * width;
        let mut deviates = Vec::with_capacity(count);
        let mut cumulated = 0.0;
        let mut step = 0usize;
        for k in 0..count {
            let wanted = (k as f64 + 0.5) / count as f64;
            while cumulated < wanted && step < steps {
                let x = low + (step as f64 + 0.5) * width;
                cumulated += norm * (-0.5 * x * x).exp();
                step += 1;
            }
            deviates.push(low + step as f64 * width);
        }
        let mean = deviates.iter().sum::<f64>() / count as f64;
        let variance = deviates.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / count as f64;
        let scale = variance.sqrt().recip();
        NormalTable { deviates: deviates.iter().map(|d| ((d - mean) * scale) as f32).collect() }
    }

    /// The deviate that belongs to random bits (the lowest 12 are used).
    #[inline]
    pub fn deviate(&self, bits: u64) -> f32 {
        self.deviates[(bits & ((1 << TABLE_BITS) - 1)) as usize]
    }
}

impl Default for NormalTable {
    fn default() -> NormalTable {
        NormalTable::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_are_their_own_and_repeatable() {
        let first = |seed, purpose, index| Draws::new(seed, purpose, index).bits();
        assert_eq!(first(1, Purpose::Pixels, 0), first(1, Purpose::Pixels, 0));
        assert_ne!(first(1, Purpose::Pixels, 0), first(1, Purpose::Pixels, 1));
        assert_ne!(first(1, Purpose::Pixels, 0), first(2, Purpose::Pixels, 0));
        assert_ne!(first(1, Purpose::Pixels, 0), first(1, Purpose::Clutter, 0));
    }

    #[test]
    fn normals_have_the_moments_of_a_normal() {
        let mut draws = Draws::new(5, Purpose::Pixels, 0);
        let table = NormalTable::new();
        let n = 200_000;
        for from_table in [false, true] {
            let mut sums = [0.0; 4];
            for _ in 0..n {
                let x = if from_table { f64::from(table.deviate(draws.bits())) } else { draws.normal() };
                sums = [sums[0] + x, sums[1] + x * x, sums[2] + x * x * x, sums[3] + x * x * x * x];
            }
            let m = sums.map(|s| s / f64::from(n));
            // Four standard errors of each moment at this sample size; the table's cut tail takes 0.02 off the fourth.
            assert!(m[0].abs() < 0.009 && (m[1] - 1.0).abs() < 0.013, "{m:?}");
            assert!(m[2].abs() < 0.036 && (m[3] - 3.0).abs() < 0.11, "{m:?}");
        }
    }
}
