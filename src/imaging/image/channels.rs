//! One grey from three colours.
//!
//! Weights are those of ITU-R BT.601, so that grey stored as colour is the same grey. A pixel at which any colour is clipped counts as clipped: a
//! clipped colour bends an edge's profile and stays unseen in the sum. Weights are the same in all pictures, also where a colour is clipped
//! throughout: lenses show each colour at a place of its own, tenths of a pixel apart, and a rig is made of places that are alike in all pictures.

use super::Image;
use super::clipping::{self, Value};

/// Weights of red, green and blue in grey (ITU-R BT.601), in 1/65536.
const LUMA: [u64; 3] = [19_595, 38_470, 7_471];

/// Grey of samples of `channels` values a pixel, red, green and blue first.
pub(super) fn grey<T: Value>(samples: &[T], channels: usize, (width, height): (usize, usize)) -> Image<T> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_one_colour_is_clipped_the_pixel_is_and_the_others_have_the_same_grey() {
        let noise = |k: usize| (k * 7919 % 23) as u8;
        let dark = |k: usize| [60, 40, 20].map(|v| v + noise(k));
        let of = |clips: bool| {
            let light = |k: usize| if clips { [255, 180 + noise(k), 90 + noise(k)] } else { dark(k) };
            let samples: Vec<u8> = (0..1000).flat_map(|k| if k < 500 { light(k) } else { dark(k) }).collect();
            grey(&samples, 3, (1000, 1))
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
        let grey = grey(&samples, 3, (1000, 1));
        assert_eq!((grey.pixels[0], grey.pixels[600]), (255, 60));
    }
}
