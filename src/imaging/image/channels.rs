//! One grey from three colours.
//!
//! Weights are those of ITU-R BT.601, so that grey stored as colour is the same grey. A colour that is clipped over part of the picture
//! while another is not (white paper in warm light) is left out: a clipped colour bends an edge's profile and stays unseen in
//! the sum. Where all are clipped, a pixel at which any is counts as clipped.

use super::Image;
use super::clipping::{self, Value};

/// Weights of red, green and blue in grey (ITU-R BT.601), in 1/65536.
const LUMA: [u64; 3] = [19_595, 38_470, 7_471];
/// Share of pixels at a colour's clip level from which on it is clipped over part of the picture.
const CLIPPED: f64 = 1e-3;

/// Grey of samples of `channels` values a pixel, red, green and blue first.
pub(super) fn grey<T: Value>(samples: &[T], channels: usize, (width, height): (usize, usize)) -> Image<T> {
    /// Every so many pixels one is asked whether it is clipped.
    const EVERY: usize = 17;
    let levels = [0, 1, 2].map(|colour| clipping::channel_level(samples, channels, colour) as u64);
    let clipped = [0, 1, 2].map(|colour| {
        let asked = samples.iter().skip(colour).step_by(EVERY * channels);
        let at_level = asked.clone().filter(|v| v.whole() >= levels[colour]).count();
        at_level as f64 > CLIPPED * asked.len() as f64
    });
    // Where all are clipped, none is better than another.
    let used = [0, 1, 2].map(|colour| !clipped[colour] || clipped == [true; 3]);
    let weights = weights(used);
    let tops = [0, 1, 2].map(|colour| if used[colour] { levels[colour] } else { u64::MAX });
    let pixels = samples
        .chunks_exact(channels)
        .map(|p| {
            let p = [p[0].whole(), p[1].whole(), p[2].whole()];
            let sum = weights[0] * p[0] + weights[1] * p[1] + weights[2] * p[2];
            let is_clipped = (p[0] >= tops[0]) | (p[1] >= tops[1]) | (p[2] >= tops[2]);
            if is_clipped { T::TOP } else { T::from_whole((sum + 32_768) >> 16) }
        })
        .collect();
    Image { width, height, pixels }
}

/// Weights of the colours that are used, in 1/65536 of the whole.
fn weights(used: [bool; 3]) -> [u64; 3] {
    let total: u64 = (0..3).filter(|&colour| used[colour]).map(|colour| LUMA[colour]).sum();
    let mut weights = [0, 1, 2].map(|colour| if used[colour] { LUMA[colour] * 65_536 / total } else { 0 });
    // What rounding down has left over goes to the first.
    let left = 65_536 - weights.iter().sum::<u64>();
    if let Some(first) = weights.iter_mut().find(|weight| **weight > 0) {
        *first += left;
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clipped_colour_is_left_out() {
        // Red clips over half of the picture; green and blue do not.
        let noise = |k: usize| (k * 7919 % 23) as u8;
        let samples: Vec<u8> = (0..1000usize)
            .flat_map(
                |k| if k < 500 { [255, 180 + noise(k), 90 + noise(k)] } else { [60, 40, 20].map(|v| v + noise(k)) },
            )
            .collect();
        let grey = grey(&samples, 3, (1000, 1));
        let expected = (f64::from(LUMA[1] as u32) * 180.0 + f64::from(LUMA[2] as u32) * 90.0)
            / f64::from((LUMA[1] + LUMA[2]) as u32);
        assert_eq!(grey.pixels[0], expected.round() as u8);
    }

    #[test]
    fn clipped_alike_is_clipped() {
        let samples: Vec<u8> = (0..1000usize).flat_map(|k| [if k < 500 { 255 } else { (k % 90) as u8 }; 3]).collect();
        let grey = grey(&samples, 3, (1000, 1));
        assert_eq!((grey.pixels[0], grey.pixels[600]), (255, 60));
    }
}
