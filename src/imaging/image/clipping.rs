//! From which grey value on a pixel tells only "too bright", and pictures that know it.
//!
//! In: grey values. Out: the clip level; values at or above it are left out of every fit. It is the end of the range
//! that the values use (8, 10, 12, 14 or 16 bits, also where a camera shifts its bits to the top), or a level below it
//! at which the histogram ends in a pile: a camera that clips at 4080 of 65535, or a converter that ends early. A pile
//! is many pixels of the same value with hardly any above, while the values below are thinly spread, in a picture that
//! has noise elsewhere: white without any noise beside dark with noise is clipped, for light has the more noise the
//! brighter it is. A drawn picture without noise is not clipped. Goes wrong: values that were changed after clipping
//! (flat-field correction) have no common level.

use super::grey::{Grey, Image};

/// Values of about this many pixels are looked at.
const LOOKED_AT: usize = 1 << 20;
/// Share of the pixels that makes a pile.
const PILE: f64 = 2e-3;
/// Share of a pile that may lie above it: hot pixels, glints.
const ABOVE: f64 = 0.02;
/// How many times more pixels a pile has than any of the values below it. The tail of a noise has fewer the farther up.
const STEEP: f64 = 3.0;
/// How many of the values below are compared.
const BELOW: usize = 24;

/// A sample of 8 or 16 bits.
pub trait Value: Copy + Into<f64> + Into<u64> + Ord {
    /// The largest.
    const TOP: Self;
    /// Full scales of the ranges that its values may have.
    const FULL: &'static [u32];
    /// As a whole number.
    fn whole(self) -> u64 {
        self.into()
    }
    /// From a whole number that fits.
    fn from_whole(whole: u64) -> Self;
}

impl Value for u8 {
    const TOP: u8 = u8::MAX;
    const FULL: &'static [u32] = &[255];
    fn from_whole(whole: u64) -> u8 {
        whole.min(255) as u8
    }
}

impl Value for u16 {
    const TOP: u16 = u16::MAX;
    // 10, 12, 14 and 16 bits, as numbers and shifted to the top of 16.
    const FULL: &'static [u32] = &[1023, 4095, 16_383, 65_535, 65_472, 65_520, 65_532];
    fn from_whole(whole: u64) -> u16 {
        whole.min(65_535) as u16
    }
}

/// A grey picture and the level at which it is clipped.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    pub grey: Grey,
    clip_level: f64,
}

impl From<Image<u8>> for Picture {
    fn from(image: Image<u8>) -> Picture {
        Picture { clip_level: channel_level(&image.pixels, 1, 0), grey: Grey::Eight(image) }
    }
}

impl From<Image<u16>> for Picture {
    fn from(image: Image<u16>) -> Picture {
        Picture { clip_level: channel_level(&image.pixels, 1, 0), grey: Grey::Sixteen(image) }
    }
}

impl Picture {
    /// The grey value from which on a pixel tells only "too bright".
    pub fn clip_level(&self) -> f64 {
        self.clip_level
    }

    pub fn width(&self) -> usize {
        self.size().0
    }

    pub fn height(&self) -> usize {
        self.size().1
    }

    fn size(&self) -> (usize, usize) {
        match &self.grey {
            Grey::Eight(image) => (image.width, image.height),
            Grey::Sixteen(image) => (image.width, image.height),
        }
    }
}

/// The clip level of one of several interleaved channels.
pub(super) fn channel_level<T: Value>(samples: &[T], channels: usize, channel: usize) -> f64 {
    let pixels = samples.len() / channels.max(1);
    // Runs of pixels, so that memory is read in order; an odd stride would meet all columns of a picture less evenly.
    const RUN: usize = 1024;
    let every = (pixels / LOOKED_AT).max(1);
    let mut counts = vec![0u32; T::TOP.whole() as usize + 1];
    for run in samples.chunks(RUN * channels).step_by(every) {
        for value in run.iter().skip(channel).step_by(channels) {
            counts[value.whole() as usize] += 1;
        }
    }
    let top = counts.iter().rposition(|&count| count > 0).unwrap_or(0);
    let full = |level: &usize| T::FULL.contains(&(*level as u32));
    pile(&counts).or(Some(top).filter(full)).map_or(T::TOP.whole() as f64, |level| level as f64)
}

/// The value at which a histogram ends in a pile.
fn pile(counts: &[u32]) -> Option<usize> {
    let total: u64 = counts.iter().map(|&count| u64::from(count)).sum();
    let mut above = 0u64;
    for (value, &count) in counts.iter().enumerate().rev() {
        let count = u64::from(count);
        if count as f64 >= PILE * total as f64 {
            let used: Vec<u64> =
                counts[..value].iter().rev().filter(|&&c| c > 0).take(BELOW).map(|&c| u64::from(c)).collect();
            let steep = used.iter().all(|&below| below as f64 * STEEP <= count as f64);
            let is_pile = above as f64 <= ABOVE * count as f64 && steep && is_noisy(&counts[..value]);
            return is_pile.then_some(value);
        }
        above += count;
    }
    None
}

/// True where the values below a pile spread as noise spreads them: most lie beside others like them, none by itself.
fn is_noisy(counts: &[u32]) -> bool {
    /// Share of the darker pixels that one value has at the least where there is no noise.
    const ALONE: f64 = 0.5;
    let total: f64 = counts.iter().map(|&count| f64::from(count)).sum();
    let most = counts.iter().skip(1).map(|&count| f64::from(count)).fold(0.0, f64::max);
    total > 0.0 && most < ALONE * total
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Light and dark squares with noise of `sigma` (from sums of congruential numbers), white at `white`, through a
    /// camera that clips.
    fn noisy(white: f64, sigma: f64, clip: f64) -> Vec<f64> {
        let mut state = 1u64;
        let mut uniform = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / f64::from(1u32 << 24)
        };
        (0..200_000)
            .map(|k| {
                let noise = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                let mean = if (k / 50) % 2 == 0 { white } else { 0.15 * white };
                (mean + sigma * noise).round().clamp(0.0, clip)
            })
            .collect()
    }

    fn level8(values: &[f64]) -> f64 {
        channel_level(&values.iter().map(|&v| v as u8).collect::<Vec<_>>(), 1, 0)
    }

    fn level16(values: &[f64]) -> f64 {
        channel_level(&values.iter().map(|&v| v as u16).collect::<Vec<_>>(), 1, 0)
    }

    #[test]
    fn a_pile_is_a_clip_level() {
        for (white, sigma) in [(4500.0, 30.0), (4085.0, 30.0), (6000.0, 5.0)] {
            assert_eq!(level16(&noisy(white, sigma, 4080.0)), 4080.0, "{white} {sigma}");
        }
        for white in [251.0, 260.0, 300.0] {
            assert_eq!(level8(&noisy(white, 2.0, 250.0)), 250.0, "{white}");
        }
    }

    #[test]
    fn hot_pixels_above_a_pile_do_not_hide_it() {
        let mut values = noisy(4500.0, 30.0, 4080.0);
        values.iter_mut().step_by(10_000).for_each(|v| *v = 65_535.0);
        assert_eq!(level16(&values), 4080.0);
    }

    #[test]
    fn light_within_the_range_is_not_clipped() {
        for (white, sigma) in [(200.0, 2.0), (200.0, 0.5), (200.0, 0.0), (220.0, 9.0)] {
            assert_eq!(level8(&noisy(white, sigma, 255.0)), 255.0, "{white} {sigma}");
        }
        for (white, sigma) in [(3000.0, 20.0), (3000.0, 0.0), (50_000.0, 200.0)] {
            assert_eq!(level16(&noisy(white, sigma, 65_535.0)), 65_535.0, "{white} {sigma}");
        }
    }

    #[test]
    fn full_scale_of_fewer_bits_is_a_clip_level() {
        assert_eq!(level16(&noisy(4095.0, 30.0, 4095.0)), 4095.0);
        assert_eq!(level16(&[0.0, 17.0, 65_520.0]), 65_520.0);
        assert_eq!(level16(&[]), 65_535.0);
    }
}
