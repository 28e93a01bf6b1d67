//! What happens to a picture between the lens and the file: defects of the sensor, stray light, electronics, formats,
//! people.
//!
//! In: the sensor's numbers as shares of its range. Out: a file. Everything works on numbers finer than the file's,
//! which are rounded once.

use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder};

use stereocal::simulate::Error;
use stereocal::simulate::draws::{Draws, Purpose};
use stereocal::simulate::picture::render::Picture;
use stereocal::simulate::world::png;

/// A picture of shares of the range, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Shares {
    /// Width, px.
    pub width: usize,
    /// Height, px.
    pub height: usize,
    /// The numbers.
    pub values: Vec<f32>,
}

/// One thing that happens to a picture. Places and radii are shares of the picture's width and height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PictureFault {
    /// Single pixels at a level, anywhere.
    HotPixels {
        /// How many.
        count: usize,
        /// Their level.
        level: f32,
    },
    /// A column that reads too much.
    HotColumn {
        /// Where.
        at: f64,
        /// How much is added.
        add: f32,
    },
    /// A round patch of stray light with a soft edge.
    Glare {
        /// Its middle.
        at: (f64, f64),
        /// Where it has fallen to 0.6 of its peak.
        radius: f64,
        /// Its peak.
        add: f32,
    },
    /// Light that is missing beyond an edge which runs through a place.
    Shadow {
        /// A place on the edge.
        at: (f64, f64),
        /// The edge's direction, rad.
        along_rad: f64,
        /// Standard deviation of the edge's blur, px.
        soft_px: f64,
        /// The share of light that is missing.
        loss: f32,
    },
    /// Numbers to a power.
    Gamma(f32),
    /// Everything above a level reads as that level.
    ClipAt(f32),
    /// An unsharp mask, as cameras sharpen: what a Gaussian blur takes away is added once more, and clipped at the ends
    /// of the range.
    #[allow(dead_code, reason = "only the tests of corners plant it")]
    Sharpened {
        /// How much of it.
        amount: f32,
        /// Standard deviation of the blur, px.
        radius_px: f32,
    },
    /// Numbers of a camera that uses only part of its range.
    Levels {
        /// What 0 becomes.
        black: f32,
        /// What 1 becomes.
        white: f32,
    },
    /// More noise, standard deviation.
    Noise(f32),
    /// A raw mosaic, RGGB: the three channels' shares of grey light.
    Bayer([f32; 3]),
    /// Turned by so many quarters.
    QuarterTurns(u8),
    /// Left for right.
    Mirrored,
}

/// How a picture is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FileForm {
    /// Grey PNG with so many bits; 9 to 15 stand in the low bits of 16 if `low`, else in the high ones.
    Png {
        /// Bits a pixel.
        bits: u8,
        /// Where they stand.
        low: bool,
    },
    /// Colour PNG of 8 bits: each channel's gain, clipped at its end.
    Colour([f32; 3]),
    /// Grey JPEG.
    Jpeg {
        /// 1 to 100.
        quality: u8,
        /// The share of the file that was written.
        keep: f64,
    },
}

impl FileForm {
    /// The usual file.
    pub const PNG8: FileForm = FileForm::Png { bits: 8, low: false };

    /// The file's name ends so.
    pub fn extension(&self) -> &'static str {
        match self {
            FileForm::Jpeg { .. } => "jpg",
            _ => "png",
        }
    }
}

impl Shares {
    /// From a picture of 16 bits.
    pub fn new(picture: &Picture) -> Shares {
        let values = picture.samples.iter().map(|&v| f32::from(v) / f32::from(u16::MAX)).collect();
        Shares { width: picture.width, height: picture.height, values }
    }

    /// Lets something happen. Draws come from the seed and the picture's number.
    pub fn suffer(&mut self, fault: &PictureFault, seed: u64, picture: u64) {
        let mut draws = Draws::new(seed, Purpose::PictureFaults, picture);
        let (w, h) = (self.width as f64, self.height as f64);
        match *fault {
            PictureFault::HotPixels { count, level } => {
                for _ in 0..count {
                    let at = (draws.unit() * self.values.len() as f64) as usize;
                    self.values[at] = level;
                }
            }
            PictureFault::HotColumn { at, add } => {
                let column = ((at * w) as usize).min(self.width - 1);
                self.values.iter_mut().skip(column).step_by(self.width).for_each(|v| *v = (*v + add).min(1.0));
            }
            PictureFault::Glare { at, radius, add } => {
                let two_variance = 2.0 * (radius * w).powi(2);
                self.each(|x, y, v| {
                    let r2 = (x - at.0 * w).powi(2) + (y - at.1 * h).powi(2);
                    (v + add * (-r2 / two_variance).exp() as f32).min(1.0)
                });
            }
            PictureFault::Shadow { at, along_rad, soft_px, loss } => {
                let (sin, cos) = along_rad.sin_cos();
                self.each(|x, y, v| {
                    let across = (x - at.0 * w) * -sin + (y - at.1 * h) * cos;
                    let in_light = 1.0 / (1.0 + (-1.7 * across / soft_px).exp());
                    v * (1.0 - loss * (1.0 - in_light as f32))
                });
            }
            PictureFault::Gamma(power) => self.values.iter_mut().for_each(|v| *v = v.powf(power)),
            PictureFault::ClipAt(level) => self.values.iter_mut().for_each(|v| *v = v.min(level)),
            PictureFault::Sharpened { amount, radius_px } => self.sharpen(amount, radius_px),
            PictureFault::Levels { black, white } => {
                self.values.iter_mut().for_each(|v| *v = black + (white - black) * *v);
            }
            PictureFault::Noise(sigma) => {
                self.values.iter_mut().for_each(|v| *v = (*v + sigma * draws.normal() as f32).clamp(0.0, 1.0));
            }
            PictureFault::Bayer([red, green, blue]) => self.each(|x, y, v| {
                let gain = match (x as usize % 2, y as usize % 2) {
                    (0, 0) => red,
                    (1, 1) => blue,
                    _ => green,
                };
                (v * gain).min(1.0)
            }),
            PictureFault::QuarterTurns(quarters) => (0..quarters % 4).for_each(|_| self.turn_quarter()),
            PictureFault::Mirrored => self.values.chunks_exact_mut(self.width).for_each(<[f32]>::reverse),
        }
    }

    fn each(&mut self, change: impl Fn(f64, f64, f32) -> f32) {
        for (y, row) in self.values.chunks_exact_mut(self.width).enumerate() {
            row.iter_mut().enumerate().for_each(|(x, v)| *v = change(x as f64, y as f64, *v));
        }
    }

    fn sharpen(&mut self, amount: f32, radius_px: f32) {
        let (w, h) = (self.width, self.height);
        let reach = (3.0 * radius_px).ceil() as isize;
        let weight = |k: isize| (-0.5 * (k as f32 / radius_px).powi(2)).exp();
        let total: f32 = (-reach..=reach).map(weight).sum();
        let inside = |v: usize, k: isize, size: usize| v.saturating_add_signed(k).min(size - 1);
        let along = |at: &dyn Fn(isize) -> f32| (-reach..=reach).map(|k| weight(k) / total * at(k)).sum::<f32>();
        let place = |i: usize| (i % w, i / w);
        let rows: Vec<f32> =
            (0..w * h).map(place).map(|(x, y)| along(&|k| self.values[y * w + inside(x, k, w)])).collect();
        let blurred = (0..w * h).map(place).map(|(x, y)| along(&|k| rows[inside(y, k, h) * w + x]));
        let blurred: Vec<f32> = blurred.collect();
        self.values.iter_mut().zip(blurred).for_each(|(v, b)| *v = (*v + amount * (*v - b)).clamp(0.0, 1.0));
    }

    fn turn_quarter(&mut self) {
        let (w, h) = (self.width, self.height);
        // Clockwise: the left column, read upwards, becomes the first row.
        let values = (0..w).flat_map(|x| (0..h).rev().map(move |y| (x, y))).map(|(x, y)| self.values[y * w + x]);
        *self = Shares { width: h, height: w, values: values.collect() };
    }

    /// Every second row from another picture, as an interlaced camera delivers two moments.
    pub fn interlace(&mut self, other: &Shares) {
        let rows = self.values.chunks_exact_mut(self.width).zip(other.values.chunks_exact(self.width));
        rows.skip(1).step_by(2).for_each(|(row, later)| row.copy_from_slice(later));
    }

    fn rounded(&self, bits: u8) -> impl Iterator<Item = u16> + '_ {
        let top = ((1u32 << bits) - 1) as f32;
        self.values.iter().map(move |v| (v * top + 0.5).clamp(0.0, top) as u16)
    }

    /// The bytes of a file.
    pub fn encode(&self, form: &FileForm) -> Result<Vec<u8>, Error> {
        let (width, height) = (self.width as u32, self.height as u32);
        match *form {
            FileForm::Png { bits, low } => {
                let file_bits = if bits <= 8 { 8 } else { 16 };
                let shift = if low { 0 } else { file_bits - bits };
                let samples = self.rounded(bits).map(|v| v << shift).collect();
                png(&Picture { width: self.width, height: self.height, file_bits, samples })
            }
            FileForm::Colour(gains) => {
                let channels = |v: &f32| gains.map(|gain| (v * gain * 255.0 + 0.5).clamp(0.0, 255.0) as u8);
                let samples: Vec<u8> = self.values.iter().flat_map(channels).collect();
                let mut bytes = Vec::new();
                image::codecs::png::PngEncoder::new(&mut bytes).write_image(
                    &samples,
                    width,
                    height,
                    ExtendedColorType::Rgb8,
                )?;
                Ok(bytes)
            }
            FileForm::Jpeg { quality, keep } => {
                let samples: Vec<u8> = self.rounded(8).map(|v| v as u8).collect();
                let mut bytes = Vec::new();
                let encoder = JpegEncoder::new_with_quality(&mut bytes, quality);
                encoder.write_image(&samples, width, height, ExtendedColorType::L8)?;
                bytes.truncate((bytes.len() as f64 * keep) as usize);
                Ok(bytes)
            }
        }
    }
}
