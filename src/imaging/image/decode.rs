//! From a file's bytes to grey values.

use camino::Utf8Path;
use image::{DynamicImage, ImageFormat, ImageReader};
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::clipping::{self, Value};
use super::limits::{self, undecodable};
use super::{Claim, Image, Mosaic, Picture, UNDECODABLE, drawn, integrity, mosaic};

/// Decodes the bytes of a file; the reason where that is not possible, the file is cut or damaged, or something was
/// drawn into the picture. `path` only helps to tell the format. A grey picture that is a raw colour mosaic needs its pattern.
pub fn decode(bytes: &[u8], path: &Utf8Path, pattern: Option<Mosaic>) -> Result<Picture, String> {
    let decoded = decoded(bytes, path)?;
    let size = (decoded.width() as usize, decoded.height() as usize);
    match decoded {
        _ if !decoded.color().has_color() => mosaic::of_grey(decoded, pattern),
        _ if pattern.is_some() => Err(mosaic::IN_COLOUR.to_owned()),
        DynamicImage::ImageRgb8(rgb) => drawn::check(&rgb, 3).map(|()| of_colours(&rgb, 3, size).into()),
        DynamicImage::ImageRgba8(rgb) => drawn::check(&rgb, 4).map(|()| of_colours(&rgb, 4, size).into()),
        DynamicImage::ImageRgb16(rgb) => Ok(of_colours(&rgb, 3, size).into()),
        DynamicImage::ImageRgba16(rgb) => Ok(of_colours(&rgb, 4, size).into()),
        _ => Err(undecodable(FLOATING_POINT)),
    }
}

const FLOATING_POINT: &str = "floating-point pixels";

/// Weights of red, green and blue in grey (ITU-R BT.601), in 1/65536.
const LUMA: [u64; 3] = [19_595, 38_470, 7_471];

/// One grey from three colours: of samples of `channels` values a pixel, red, green and blue first.
///
/// Weights are those of ITU-R BT.601, so that grey stored as colour is the same grey. A pixel at which any colour is
/// clipped counts as clipped: a clipped colour bends an edge's profile and stays unseen in the sum. Weights are the
/// same in all pictures, also where a colour is clipped throughout: lenses show each colour at a place of its own,
/// tenths of a pixel apart, and a rig is made of places that are alike in all pictures.
fn of_colours<T: Value>(samples: &[T], channels: usize, (width, height): (usize, usize)) -> Image<T> {
    let levels = [0, 1, 2].map(|colour| clipping::channel_level(samples, channels, colour) as u64);
    let pixels = samples
        .chunks_exact(channels)
        .map(|p| {
            let p = [p[0].whole(), p[1].whole(), p[2].whole()];
            let sum = LUMA[0] * p[0] + LUMA[1] * p[1] + LUMA[2] * p[2];
            let is_clipped = (p[0] >= levels[0]) | (p[1] >= levels[1]) | (p[2] >= levels[2]);
            if is_clipped { T::TOP } else { T::from_whole((sum + 32_768) >> 16) }
        })
        .collect();
    Image { width, height, pixels }
}

/// A picture file read and decoded, by itself.
pub fn picture(path: &Utf8Path, pattern: Option<Mosaic>) -> Result<Picture, String> {
    let header = limits::header(path)?;
    let _claim = Claim::wait(&header);
    decode(&limits::read(path, &header)?, path, pattern)
}

/// Decodes the bytes of a file to its own colours and depth, whole numbers only.
pub(super) fn decoded(bytes: &[u8], path: &Utf8Path) -> Result<DynamicImage, String> {
    let format = image::guess_format(bytes).ok().or_else(|| ImageFormat::from_path(path).ok());
    integrity::check(bytes, format)?;
    let decoded = if format == Some(ImageFormat::Jpeg) { jpeg(bytes)? } else { other(bytes, format)? };
    match decoded {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => Err(undecodable(FLOATING_POINT)),
        decoded => Ok(decoded),
    }
}

fn other(bytes: &[u8], format: Option<ImageFormat>) -> Result<DynamicImage, String> {
    let format = format.ok_or_else(|| undecodable("neither PNG, TIFF, BMP, JPEG nor PGM"))?;
    let reader = ImageReader::with_format(std::io::Cursor::new(bytes), format);
    DynamicImage::from_decoder(limits::decoder(reader)?).map_err(limits::given_up)
}

/// Decodes a JPEG by the letter: the decoder of the `image` crate, told not to fill in what is missing.
fn jpeg(bytes: &[u8]) -> Result<DynamicImage, String> {
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(usize::from(u16::MAX))
        .set_max_height(usize::from(u16::MAX));
    let mut decoder = zune_jpeg::JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(undecodable)?;
    let grey = decoder.input_colorspace() == Some(ColorSpace::Luma);
    let (width, height) = decoder.dimensions().ok_or_else(|| UNDECODABLE.to_owned())?;
    let (width, height) = (width as u32, height as u32);
    limits::check((width, height), u64::from(width) * u64::from(height) * if grey { 1 } else { 3 })?;
    let colours = if grey { ColorSpace::Luma } else { ColorSpace::RGB };
    decoder.set_options(options.jpeg_set_out_colorspace(colours));
    let samples = decoder.decode().map_err(|e| integrity::cut_or_damaged("JPEG", &e.to_string()))?;
    let image = if grey {
        image::GrayImage::from_raw(width, height, samples).map(DynamicImage::ImageLuma8)
    } else {
        image::RgbImage::from_raw(width, height, samples).map(DynamicImage::ImageRgb8)
    };
    image.ok_or_else(|| UNDECODABLE.to_owned())
}

#[cfg(test)]
mod tests {
    use super::super::Grey;
    use super::*;

    fn image<T>((width, height): (usize, usize), pixels: Vec<T>) -> Image<T> {
        Image { width, height, pixels }
    }

    fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    fn png(image: &DynamicImage) -> Vec<u8> {
        encoded(image, ImageFormat::Png)
    }

    #[test]
    fn grey_and_sixteen_bit_come_back_as_they_are() {
        let grey = image::ImageBuffer::from_fn(5, 4, |x, y| image::Luma([(x * 40 + y) as u8]));
        let picture = decode(&png(&DynamicImage::ImageLuma8(grey.clone())), "a.png".into(), None).unwrap();
        assert_eq!(picture.grey, Grey::Eight(image((5, 4), grey.into_raw())));
        let grey = image::ImageBuffer::from_fn(5, 4, |x, y| image::Luma([(x * 900 + y) as u16]));
        let picture = decode(&png(&DynamicImage::ImageLuma16(grey.clone())), "a.png".into(), None).unwrap();
        assert_eq!(picture.grey, Grey::Sixteen(image((5, 4), grey.into_raw())));
    }

    #[test]
    fn grey_stored_as_colour_is_the_same_grey() {
        let rgb = image::ImageBuffer::from_fn(256, 1, |x, _| image::Rgb([x as u8; 3]));
        let picture = decode(&png(&DynamicImage::ImageRgb8(rgb)), "a.png".into(), None).unwrap();
        assert_eq!(picture.grey, Grey::Eight(image((256, 1), (0..=255).collect())));
    }

    /// Something with enough detail that no part of its file is dispensable.
    fn textured(colour: bool) -> DynamicImage {
        let value = |x: u32, y: u32| ((x * x * 7 + y * 13 + x * y * 3) % 251) as u8;
        let rgb = image::RgbImage::from_fn(96, 80, |x, y| image::Rgb([value(x, y), value(y, x), value(x, x + y)]));
        if colour { rgb.into() } else { DynamicImage::ImageRgb8(rgb).to_luma8().into() }
    }

    #[test]
    fn a_cut_file_is_said_to_be_cut() {
        for colour in [false, true] {
            for (format, name) in [
                (ImageFormat::Png, "a.png"),
                (ImageFormat::Jpeg, "a.jpg"),
                (ImageFormat::Bmp, "a.bmp"),
                (ImageFormat::Pnm, "a.pgm"),
                (ImageFormat::Tiff, "a.tif"),
            ] {
                let bytes = encoded(&textured(colour), format);
                decode(&bytes, name.into(), None).unwrap();
                for percent in [5, 30, 50, 70, 90, 98] {
                    let cut = &bytes[..bytes.len() * percent / 100];
                    let reason = decode(cut, name.into(), None).expect_err(name);
                    assert!(percent < 30 || reason.contains("cut") || reason.contains(UNDECODABLE), "{name}: {reason}");
                }
                for bytes_less in 1..4 {
                    decode(&bytes[..bytes.len() - bytes_less], name.into(), None).expect_err(name);
                }
            }
        }
    }

    #[test]
    fn a_changed_byte_of_a_png_is_noticed() {
        let bytes = png(&textured(false));
        for at in (8..bytes.len()).step_by(37) {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            assert!(decode(&damaged, "a.png".into(), None).is_err(), "{at}");
        }
    }

    #[test]
    fn a_format_that_is_not_read_is_named_whatever_the_file_is_called() {
        let reason = decode(b"RIFF\x24\0\0\0WEBPVP8 \x18\0\0\0", "a.jpg".into(), None).unwrap_err();
        assert!(reason.contains(UNDECODABLE) && reason.contains("a WEBP file"), "{reason}");
    }

    #[test]
    fn no_more_is_decoded_than_a_camera_takes() {
        for header in ["P5 100000 100000 255\n", "P5 100000000 1 255\n", "P5 1 50000000 255\n", "P5 65000 65000 255\n"]
        {
            let reason = decode(header.as_bytes(), "a.pgm".into(), None).unwrap_err();
            assert!(reason.contains("announces") && reason.contains("at most"), "{reason}");
        }
        assert!(decode(b"", "a.png".into(), None).is_err());
        assert!(decode(b"", "a".into(), None).is_err());
    }

    #[test]
    fn where_one_colour_is_clipped_the_pixel_is_and_the_others_have_the_same_grey() {
        let noise = |k: usize| (k * 7919 % 23) as u8;
        let dark = |k: usize| [60, 40, 20].map(|v| v + noise(k));
        let of = |clips: bool| {
            let light = |k: usize| if clips { [255, 180 + noise(k), 90 + noise(k)] } else { dark(k) };
            let samples: Vec<u8> = (0..1000).flat_map(|k| if k < 500 { light(k) } else { dark(k) }).collect();
            of_colours(&samples, 3, (1000, 1))
        };
        let (clips, plain) = (of(true), of(false));
        assert!(clips.pixels[..500].iter().all(|pixel| *pixel == 255));
        assert_eq!(clips.pixels[500..], plain.pixels[500..]);
        assert_eq!(
            plain.pixels[500],
            (0.299 * 60.0 + 0.587 * 40.0 + 0.114 * 20.0 + f64::from(noise(500))).round() as u8
        );
    }

    #[test]
    fn clipped_alike_is_clipped() {
        let samples: Vec<u8> = (0..1000usize).flat_map(|k| [if k < 500 { 255 } else { (k % 90) as u8 }; 3]).collect();
        let grey = of_colours(&samples, 3, (1000, 1));
        assert_eq!((grey.pixels[0], grey.pixels[600]), (255, 60));
    }
}
