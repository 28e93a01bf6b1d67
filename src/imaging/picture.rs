//! Pictures as measured: one decoder, one grey.
//!
//! In: a file (PNG, TIFF, BMP, JPEG, PGM; 8 or 16 bit; grey or colour). Out: grey values as they were measured, 8 or
//! 16 bit. Colour becomes grey by the luma weights of ITU-R BT.601. Nothing is scaled, turned or corrected: two
//! decoders, or one that "improves", would give two measurements.

use camino::Utf8Path;
use image::{DynamicImage, ImageReader};
use nalgebra::Point2;

/// What every reason for a file that is no picture says.
pub const UNDECODABLE: &str = "cannot be decoded";

/// Weights of red, green and blue in grey (ITU-R BT.601), in 1/65536.
const LUMA: [u64; 3] = [19_595, 38_470, 7_471];

/// Grey values row by row.
#[derive(Debug, Clone, PartialEq)]
pub enum Pixels {
    /// 8 bits a pixel.
    Eight(Vec<u8>),
    /// 16 bits a pixel, of which a camera may use fewer.
    Sixteen(Vec<u16>),
}

/// A grey picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Width, px.
    pub width: usize,
    /// Height, px.
    pub height: usize,
    /// Its `width * height` grey values.
    pub pixels: Pixels,
}

/// A small 8-bit picture for looking, not for measuring.
#[derive(Debug, Clone, PartialEq)]
pub struct Grey8 {
    /// Width, px.
    pub width: usize,
    /// Height, px.
    pub height: usize,
    /// Its `width * height` grey values.
    pub pixels: Vec<u8>,
}

/// Decodes the bytes of a file; the reason where that is not possible. `path` only helps to tell the format.
pub fn decode(bytes: &[u8], path: &Utf8Path) -> Result<Picture, String> {
    let mut reader = ImageReader::new(std::io::Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|e| format!("cannot be read: {e}"))?;
    if reader.format().is_none()
        && let Ok(format) = image::ImageFormat::from_path(path)
    {
        reader.set_format(format);
    }
    let decoded = reader.decode().map_err(|e| format!("{UNDECODABLE}: {e}"))?;
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    if width == 0 || height == 0 {
        return Err("has no pixels".to_owned());
    }
    let pixels = match decoded {
        DynamicImage::ImageLuma8(grey) => Pixels::Eight(grey.into_raw()),
        DynamicImage::ImageLuma16(grey) => Pixels::Sixteen(grey.into_raw()),
        DynamicImage::ImageLumaA8(grey) => Pixels::Eight(grey.into_raw().chunks_exact(2).map(|p| p[0]).collect()),
        DynamicImage::ImageLumaA16(grey) => Pixels::Sixteen(grey.into_raw().chunks_exact(2).map(|p| p[0]).collect()),
        DynamicImage::ImageRgb8(rgb) => Pixels::Eight(grey8(&rgb, 3)),
        DynamicImage::ImageRgba8(rgb) => Pixels::Eight(grey8(&rgb, 4)),
        DynamicImage::ImageRgb16(rgb) => Pixels::Sixteen(grey16(&rgb, 3)),
        DynamicImage::ImageRgba16(rgb) => Pixels::Sixteen(grey16(&rgb, 4)),
        _ => return Err(format!("{UNDECODABLE}: floating-point pixels")),
    };
    Ok(Picture { width, height, pixels })
}

/// Width and height from a file's header, without decoding it; `None` where that fails.
pub fn size(path: &Utf8Path) -> Option<(u32, u32)> {
    ImageReader::open(path).ok()?.with_guessed_format().ok()?.into_dimensions().ok()
}

impl Grey8 {
    /// Mean of the 3 x 3 pixels at a place; `None` at the picture's border.
    pub fn mean_at(&self, at: Point2<f64>) -> Option<f64> {
        mean_at((self.width, self.height), |x, y| f64::from(self.pixels[y * self.width + x]), at)
    }
}

fn mean_at((width, height): (usize, usize), grey: impl Fn(usize, usize) -> f64, at: Point2<f64>) -> Option<f64> {
    let (x, y) = (at.x.round(), at.y.round());
    if !(x >= 1.0 && y >= 1.0 && x + 1.0 < width as f64 && y + 1.0 < height as f64) {
        return None;
    }
    let (x, y) = (x as usize, y as usize);
    Some((y - 1..=y + 1).map(|y| (x - 1..=x + 1).map(|x| grey(x, y)).sum::<f64>()).sum::<f64>() / 9.0)
}

fn luma(p: [u64; 3]) -> u64 {
    (LUMA[0] * p[0] + LUMA[1] * p[1] + LUMA[2] * p[2] + 32_768) >> 16
}

fn grey8(samples: &[u8], channels: usize) -> Vec<u8> {
    samples.chunks_exact(channels).map(|p| luma([p[0], p[1], p[2]].map(u64::from)) as u8).collect()
}

fn grey16(samples: &[u16], channels: usize) -> Vec<u16> {
    samples.chunks_exact(channels).map(|p| luma([p[0], p[1], p[2]].map(u64::from)) as u16).collect()
}

impl Picture {
    /// The grey value from which on a pixel tells only "too bright": the top of the range the values use (8, 10, 12, 14
    /// or 16 bits, also where a camera shifts its bits to the top).
    pub fn saturation(&self) -> f64 {
        match &self.pixels {
            Pixels::Eight(_) => 255.0,
            Pixels::Sixteen(values) => {
                let top = u32::from(values.iter().copied().max().unwrap_or(0));
                let shifted = [10, 12, 14].map(|bits| 65_536 - (1u32 << (16 - bits)));
                let plain = [10, 12, 14].map(|bits| (1u32 << bits) - 1);
                let level = plain.into_iter().chain(shifted).find(|&level| top == level);
                f64::from(level.unwrap_or(65_535))
            }
        }
    }

    /// The grey value of a pixel inside the picture.
    #[inline]
    pub fn at(&self, x: usize, y: usize) -> f64 {
        match &self.pixels {
            Pixels::Eight(values) => f64::from(values[y * self.width + x]),
            Pixels::Sixteen(values) => f64::from(values[y * self.width + x]),
        }
    }

    /// Mean of the 3 x 3 pixels at a place; `None` at the picture's border.
    pub fn mean_at(&self, at: Point2<f64>) -> Option<f64> {
        mean_at((self.width, self.height), |x, y| self.at(x, y), at)
    }

    /// An 8-bit copy reduced by a whole factor, each pixel the mean of `factor` x `factor`; what is left over at the right
    /// and lower border is dropped. 16-bit values are stretched to the range they use.
    /// Pixel centres map by `x_full = (x + 0.5) * factor - 0.5`.
    pub fn reduced(&self, factor: usize) -> Grey8 {
        let factor = factor.clamp(1, self.width.min(self.height));
        match &self.pixels {
            Pixels::Eight(values) => reduce(values, self.width, self.height, factor, 0.0, 1.0),
            Pixels::Sixteen(values) => {
                let (low, high) = values.iter().fold((u16::MAX, 0), |(low, high), &v| (low.min(v), high.max(v)));
                let scale = 255.0 / f64::from(high.saturating_sub(low).max(1));
                reduce(values, self.width, self.height, factor, f64::from(low), scale)
            }
        }
    }
}

fn reduce<T: Copy + Into<u32>>(
    values: &[T],
    width: usize,
    height: usize,
    factor: usize,
    low: f64,
    scale: f64,
) -> Grey8 {
    let (w, h) = (width / factor, height / factor);
    let mut pixels = Vec::with_capacity(w * h);
    let mut sums = vec![0u32; w];
    // 2^16 values of 16 bits just fit; no picture is reduced by more than 256.
    let unit = scale / (factor * factor) as f64;
    for y in 0..h {
        sums.fill(0);
        for line in values[y * factor * width..].chunks_exact(width).take(factor) {
            for (sum, group) in sums.iter_mut().zip(line.chunks_exact(factor)) {
                *sum += group.iter().map(|&v| v.into()).sum::<u32>();
            }
        }
        pixels.extend(sums.iter().map(|&sum| (f64::from(sum) * unit - low * scale + 0.5) as u8));
    }
    Grey8 { width: w, height: h, pixels }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(image: &DynamicImage) -> Vec<u8> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn grey_and_sixteen_bit_come_back_as_they_are() {
        let grey = image::ImageBuffer::from_fn(5, 4, |x, y| image::Luma([(x * 40 + y) as u8]));
        let picture = decode(&png(&DynamicImage::ImageLuma8(grey.clone())), "a.png".into()).unwrap();
        assert_eq!(picture.pixels, Pixels::Eight(grey.into_raw()));
        let grey = image::ImageBuffer::from_fn(5, 4, |x, y| image::Luma([(x * 900 + y) as u16]));
        let picture = decode(&png(&DynamicImage::ImageLuma16(grey.clone())), "a.png".into()).unwrap();
        assert_eq!(picture.pixels, Pixels::Sixteen(grey.into_raw()));
    }

    #[test]
    fn grey_stored_as_colour_is_the_same_grey() {
        let rgb = image::ImageBuffer::from_fn(256, 1, |x, _| image::Rgb([x as u8; 3]));
        let picture = decode(&png(&DynamicImage::ImageRgb8(rgb)), "a.png".into()).unwrap();
        assert_eq!(picture.pixels, Pixels::Eight((0..=255).collect()));
    }

    #[test]
    fn a_broken_file_is_a_reason() {
        let grey = image::ImageBuffer::from_fn(50, 40, |x, y| image::Luma([(x * 4 + y) as u8]));
        let bytes = png(&DynamicImage::ImageLuma8(grey));
        assert!(decode(&bytes[..bytes.len() / 2], "a.png".into()).unwrap_err().contains("cannot be decoded"));
        assert!(decode(b"", "a.png".into()).is_err());
        assert!(decode(b"P5 100000 100000 255\n", "a.pgm".into()).is_err());
    }

    #[test]
    fn reduced_pixels_are_means() {
        let picture = Picture { width: 5, height: 4, pixels: Pixels::Eight((0..20).collect()) };
        assert_eq!(picture.reduced(2).pixels, [3, 5, 13, 15]);
        let picture = Picture { width: 2, height: 1, pixels: Pixels::Sixteen(vec![1000, 3000]) };
        assert_eq!(picture.reduced(1).pixels, [0, 255]);
    }
}
