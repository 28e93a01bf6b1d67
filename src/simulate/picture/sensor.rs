//! From light to numbers: uneven light, vignetting, photon and read noise, quantisation.

use nalgebra::Point2;

use crate::simulate::draws::{Draws, NormalTable, Purpose};
use crate::stereo::Camera;

/// How the light falls. Everything here is smooth over the whole picture and applied after the lens's spread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lighting {
    /// Change of the light from the middle to the right and to the lower edge, as a share.
    pub gradient: (f64, f64),
    /// Loss at the picture's corners, as a share (grows with the square of the distance from the middle).
    pub vignetting: f64,
    /// The board's white in the middle of the picture, as a share of the sensor's range.
    pub exposure: f64,
}

impl Lighting {
    /// Light at a picture point, as a share of the sensor's range for reflectance 1.
    pub fn at(&self, px: &Point2<f64>, camera: &Camera) -> f64 {
        let mut row = [1.0];
        self.shine(&mut row, px.x, px.y, camera);
        f64::from(row[0])
    }

    /// Multiplies reflectances of a row of pixels that starts at `(x, y)` px by the light there.
    pub fn shine(&self, row: &mut [f32], x: f64, y: f64, camera: &Camera) {
        let per_px = 2.0 / f64::from(camera.width);
        let u0 = ((x + 0.5) * per_px - 1.0) as f32;
        let v = (y + 0.5) * 2.0 / f64::from(camera.height) - 1.0;
        let loss = (0.5 * self.vignetting) as f32;
        let at_row = (1.0 - 0.5 * self.vignetting * v * v) as f32;
        let level = (self.exposure * (1.0 + self.gradient.1 * v)) as f32;
        let along = (self.exposure * self.gradient.0) as f32;
        let per_px = per_px as f32;
        for (k, value) in row.iter_mut().enumerate() {
            let u = u0 + k as f32 * per_px;
            *value *= (at_row - loss * u * u) * (level + along * u);
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// Bits a pixel: 8, or 9 to 16 (then stored in 16 bits, the high ones).
    pub bits: u8,
    /// Electrons at the end of its range. Not finite: no photon noise.
    pub full_well_e: f64,
    /// Read noise, electrons.
    pub read_noise_e: f64,
    /// Dark level, as a share of the range.
    pub dark: f64,
}

impl Sensor {
    /// The largest number it gives.
    pub fn top(&self) -> f64 {
        f64::from((1u32 << self.bits) - 1)
    }
}

/// Turns light into numbers, with noise from streams of its own for each picture and tile.
#[derive(Debug)]
pub struct Exposer<'a> {
    sensor: Sensor,
    normals: &'a NormalTable,
    seed: u64,
    picture: u64,
}

impl<'a> Exposer<'a> {
    /// For one picture of a seed.
    pub fn new(sensor: Sensor, normals: &'a NormalTable, seed: u64, picture: u64) -> Exposer<'a> {
        Exposer { sensor, normals, seed, picture }
    }

    /// The sensor's numbers for light given as shares of its range, in the order given; `tile` names the stream.
    pub fn expose(&self, light: &[f32], tile: u64, numbers: &mut [u16]) {
        let top = self.sensor.top() as f32;
        let per_e = if self.sensor.full_well_e.is_finite() { 1.0 / self.sensor.full_well_e } else { 0.0 } as f32;
        let read = (self.sensor.read_noise_e * f64::from(per_e)) as f32;
        let read_variance = read * read;
        let dark = self.sensor.dark as f32;
        // In a file the numbers of more than 8 bits are the high bits of 16.
        let scale = if self.sensor.bits <= 8 { 1 } else { 1 << (16 - self.sensor.bits) };
        let mut draws = Draws::new(self.seed, Purpose::Pixels, self.picture << 32 | tile);
        let mut bits = 0u64;
        for (k, (value, number)) in light.iter().zip(numbers).enumerate() {
            // One draw of 64 bits serves four pixels.
            bits = if k % 4 == 0 { draws.bits() } else { bits >> 16 };
            let sigma = (value.max(0.0) * per_e + read_variance).sqrt();
            let noisy = value + dark + sigma * self.normals.deviate(bits);
            *number = (noisy * top + 0.5).clamp(0.0, top) as u16 * scale;
        }
    }
}
