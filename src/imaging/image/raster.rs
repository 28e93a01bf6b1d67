//! Pictures with their colours, for those who look at them or feed them on: nothing here is measured.

use camino::Utf8Path;
use image::{DynamicImage, ImageBuffer, ImageFormat};

use super::decode::decoded;
use super::{Grey, Header, Mosaic, mosaic, read};

/// Samples row by row, the channels of a pixel side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct Raster {
    pub width: usize,
    pub height: usize,
    /// 1: grey; 3: red, green, blue.
    pub channels: usize,
    /// `width * height * channels` values.
    pub samples: Samples,
}

/// Values in the depth of their file.
#[derive(Debug, Clone, PartialEq)]
pub enum Samples {
    Eight(Vec<u8>),
    Sixteen(Vec<u16>),
}

impl Raster {
    /// Reads a picture whose header was looked at and whose bytes were [claimed](super::Claim); the reason where that
    /// is not possible. Transparency is left away; a raw colour mosaic becomes the grey that [`super::decode()`] makes
    /// of it.
    pub fn read(path: &Utf8Path, header: &Header, pattern: Option<Mosaic>) -> Result<Raster, String> {
        Raster::decode(&read(path, header)?, path, pattern)
    }

    fn decode(bytes: &[u8], path: &Utf8Path, pattern: Option<Mosaic>) -> Result<Raster, String> {
        let decoded = decoded(bytes, path)?;
        let (width, height) = (decoded.width() as usize, decoded.height() as usize);
        let colour = |samples| Ok(Raster { width, height, channels: 3, samples });
        match decoded {
            _ if !decoded.color().has_color() => {
                let picture = mosaic::of_grey(decoded, pattern)?;
                let samples = match picture.grey {
                    Grey::Eight(image) => Samples::Eight(image.pixels),
                    Grey::Sixteen(image) => Samples::Sixteen(image.pixels),
                };
                Ok(Raster { width, height, channels: 1, samples })
            }
            _ if pattern.is_some() => Err(mosaic::IN_COLOUR.to_owned()),
            DynamicImage::ImageRgb8(rgb) => colour(Samples::Eight(rgb.into_raw())),
            DynamicImage::ImageRgb16(rgb) => colour(Samples::Sixteen(rgb.into_raw())),
            DynamicImage::ImageRgba16(_) => colour(Samples::Sixteen(decoded.into_rgb16().into_raw())),
            _ => colour(Samples::Eight(decoded.into_rgb8().into_raw())),
        }
    }

    /// The picture as PNG, in its own depth.
    pub fn png(self) -> Option<Vec<u8>> {
        let (width, height) = (self.width as u32, self.height as u32);
        let image = match (self.samples, self.channels) {
            (Samples::Eight(v), 1) => ImageBuffer::from_raw(width, height, v).map(DynamicImage::ImageLuma8),
            (Samples::Eight(v), _) => ImageBuffer::from_raw(width, height, v).map(DynamicImage::ImageRgb8),
            (Samples::Sixteen(v), 1) => ImageBuffer::from_raw(width, height, v).map(DynamicImage::ImageLuma16),
            (Samples::Sixteen(v), _) => ImageBuffer::from_raw(width, height, v).map(DynamicImage::ImageRgb16),
        }?;
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write_to(&mut bytes, ImageFormat::Png).ok()?;
        Some(bytes.into_inner())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_and_colour_survive_the_file() {
        let (width, height) = (7, 5);
        let eight: Vec<u8> = (0..width * height * 3).map(|k| (k * 11 % 251) as u8).collect();
        let sixteen: Vec<u16> = (0..width * height * 3).map(|k| (k * 601 % 65_521) as u16).collect();
        for channels in [1, 3] {
            let n = width * height * channels;
            for samples in [Samples::Eight(eight[..n].to_vec()), Samples::Sixteen(sixteen[..n].to_vec())] {
                let raster = Raster { width, height, channels, samples };
                let bytes = raster.clone().png().unwrap();
                assert_eq!(Raster::decode(&bytes, "a.png".into(), None), Ok(raster));
            }
        }
    }

    #[test]
    fn transparency_goes_and_depth_stays() {
        let image = ImageBuffer::from_fn(4, 3, |x, y| image::Rgba([40_000u16, x as u16, y as u16, 9]));
        let mut bytes = std::io::Cursor::new(Vec::new());
        DynamicImage::ImageRgba16(image).write_to(&mut bytes, ImageFormat::Png).unwrap();
        let raster = Raster::decode(bytes.get_ref(), "a.png".into(), None).unwrap();
        let Samples::Sixteen(v) = raster.samples else { panic!("16 bits became 8") };
        assert_eq!((raster.channels, &v[..6]), (3, &[40_000, 0, 0, 40_000, 1, 0][..]));
    }
}
