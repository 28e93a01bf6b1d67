//! Copies of a picture at other sizes, and where their pixels lie.
//!
//! In: a picture. Out: an 8-bit copy for looking, each of its pixels the mean of a block of the picture's, or twice as
//! large. How a place on a copy becomes one in the picture and back is said here and nowhere else. 16-bit values are
//! stretched over the range that all but a few in a thousand use, so that a hot pixel or a lamp does not flatten the
//! board.

use std::ops::AddAssign;

use nalgebra::Point2;

use super::{Grey, Grey8, Image, Picture};
use crate::widest::widest;

/// The size of a copy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// Reduced by a whole factor.
    Reduced(usize),
    /// The same of four lines of each block only, which costs half: most of the time goes into reading the picture.
    Skimmed(usize),
    /// Enlarged to twice the size, for squares of a few pixels.
    Doubled,
}

impl Level {
    /// Pixels of the picture along one pixel of the copy.
    pub fn scale(self) -> f64 {
        match self {
            Level::Reduced(factor) | Level::Skimmed(factor) => factor as f64,
            Level::Doubled => 0.5,
        }
    }

    /// A place on the copy as one in the picture, px.
    pub fn to_picture(self, p: &Point2<f64>) -> Point2<f64> {
        p.map(|v| (v + 0.5) * self.scale() - 0.5)
    }

    /// A place in the picture as one on the copy, px.
    pub fn to_copy(self, p: &Point2<f64>) -> Point2<f64> {
        p.map(|v| (v + 0.5) / self.scale() - 0.5)
    }

    /// The copy of a picture at this level.
    pub fn copy(self, picture: &Picture) -> Grey8 {
        match self {
            Level::Reduced(factor) => reduced(picture, factor, &|factor| (0..factor).collect()),
            Level::Skimmed(factor) => reduced(picture, factor, &skimmed_lines),
            Level::Doubled => doubled(&Level::Reduced(1).copy(picture)),
        }
    }
}

/// Columns of a thumbnail at the least, where its copy has as many.
const THUMBNAIL_COLUMNS: usize = 360;

/// A reduced copy, and how far it is reduced.
#[derive(Debug, Clone, PartialEq)]
pub struct Small {
    pub copy: Grey8,
    /// Its size; never doubled.
    pub level: Level,
}

impl Small {
    /// The copy on which boards are looked for first.
    pub fn coarse(picture: &Picture) -> Small {
        let level = Level::Reduced(coarse_factor(picture));
        Small { copy: level.copy(picture), level }
    }

    /// A thumbnail from a reduced copy.
    pub fn thumbnail(copy: &Grey8, level: Level) -> Small {
        let factor = (copy.width / THUMBNAIL_COLUMNS).max(1);
        let lines: Vec<usize> = (0..factor).collect();
        let smaller = means(copy, factor, &lines, u16::from, (0.0, 255.0));
        Small { copy: smaller, level: Level::Reduced(factor * level.scale() as usize) }
    }
}

/// Pixels of the copy on which boards of any kind are looked for first.
pub const COARSE_PX: usize = 1_000_000;

/// The whole factor that brings a picture closest to [`COARSE_PX`] from above.
pub fn coarse_factor(picture: &Picture) -> usize {
    let ratio = (picture.width() * picture.height()) as f64 / COARSE_PX as f64;
    ratio.sqrt().floor().max(1.0) as usize
}

/// Copies from that of [`COARSE_PX`] to full size, each of about half the factor of the one before it.
pub fn to_full_size(picture: &Picture) -> impl Iterator<Item = Level> + use<> {
    let halved = |factor: &usize| (*factor > 1).then(|| factor.div_ceil(2));
    std::iter::successors(Some(coarse_factor(picture)), halved).map(Level::Reduced)
}

/// A copy reduced by a whole factor; what is left over at the right and lower border is dropped. `lines` are those of a
/// block that count.
fn reduced(picture: &Picture, factor: usize, lines: &dyn Fn(usize) -> Vec<usize>) -> Grey8 {
    let factor = factor.clamp(1, picture.width().min(picture.height()).clamp(1, MOST_REDUCED));
    let lines = lines(factor);
    match &picture.grey {
        Grey::Eight(image) => means(image, factor, &lines, u16::from, (0.0, 255.0)),
        Grey::Sixteen(image) => {
            let (low, high) = range(image);
            // A hot pixel must not shine over its block.
            means(image, factor, &lines, |v| u32::from(v.min(high)), (f64::from(low), f64::from(high)))
        }
    }
}

/// The lines of a block of `factor` that are read where it is skimmed: spread evenly, their mean the block's centre.
fn skimmed_lines(factor: usize) -> Vec<usize> {
    /// Half as many as are read.
    const HALF: usize = 2;
    if factor <= 2 * HALF {
        return (0..factor).collect();
    }
    let upper = (0..HALF).map(|i| (2 * i + 1) * factor / (4 * HALF));
    let lower = upper.clone().rev().map(|line| factor - 1 - line);
    upper.chain(lower).collect()
}

/// Factor up to which 2^8 values of 8 bits fit into a sum of 16, and 2^16 of 16 into one of 32; no picture is so large.
const MOST_REDUCED: usize = 256;

/// Bits of a reciprocal in whole numbers: 255 n / n times 2^23 fits into 31 bits.
const SHIFT: u32 = 23;

/// Pixels up to which a mean by a reciprocal in whole numbers is rounded as the mean itself: 255 n / 2^23 is less than
/// 1 / n up to here.
const MOST_BY_WHOLE: usize = 181;

/// Means of the `lines` of blocks of `factor` x `factor` pixels, `low..high` stretched to 0..255. `value` is a pixel as
/// a type that holds the sum of a column.
fn means<T: Copy, S: Copy + Default + AddAssign + Into<u32>>(
    image: &Image<T>,
    factor: usize,
    lines: &[usize],
    value: impl Fn(T) -> S,
    (low, high): (f64, f64),
) -> Grey8 {
    let (w, h) = (image.width / factor, image.height / factor);
    let mut pixels = vec![0; w * h];
    let mut sums = vec![S::default(); w * factor];
    let mut totals = vec![0u32; w];
    let scale = 255.0 / (high - low).max(1.0);
    let count = lines.len() * factor;
    let unit = scale / count as f64;
    // The same numbers in whole ones where nothing is stretched: the rounding upwards of the reciprocal is too little
    // to reach the next half.
    let by_whole =
        (low == 0.0 && high == 255.0 && count <= MOST_BY_WHOLE).then(|| (1u32 << SHIFT).div_ceil(count as u32));
    let rows = image.pixels.chunks(factor * image.width.max(1));
    for (out, rows) in pixels.chunks_exact_mut(w.max(1)).zip(rows) {
        widest(
            #[inline(always)]
            || {
                // Whole lines first: adding them up is what a processor does many at a time.
                add_lines(rows, image.width, lines, &value, &mut sums);
                add_groups(&sums, factor, &mut totals);
                match by_whole {
                    Some(per_total) => {
                        for (out, &total) in out.iter_mut().zip(&totals) {
                            *out = ((total * per_total + (1 << (SHIFT - 1))) >> SHIFT) as u8;
                        }
                    }
                    None => {
                        for (out, &total) in out.iter_mut().zip(&totals) {
                            *out = (f64::from(total) * unit - low * scale + 0.5) as u8;
                        }
                    }
                }
            },
        );
    }
    Grey8 { width: w, height: h, pixels }
}

/// The sums of these lines, place by place.
#[inline(always)]
fn add_lines<T: Copy, S: Copy + Default + AddAssign>(
    rows: &[T],
    width: usize,
    lines: &[usize],
    value: &impl Fn(T) -> S,
    sums: &mut [S],
) {
    // For the usual ones a number of lines that the compiler knows: it keeps the sums in registers.
    match *lines {
        [a, b] => add_known_lines(rows, width, [a, b], value, sums),
        [a, b, c] => add_known_lines(rows, width, [a, b, c], value, sums),
        [a, b, c, d] => add_known_lines(rows, width, [a, b, c, d], value, sums),
        [a, b, c, d, e] => add_known_lines(rows, width, [a, b, c, d, e], value, sums),
        [a, b, c, d, e, f] => add_known_lines(rows, width, [a, b, c, d, e, f], value, sums),
        _ => {
            sums.fill(S::default());
            for line in lines {
                for (sum, &v) in sums.iter_mut().zip(&rows[line * width..][..width]) {
                    *sum += value(v);
                }
            }
        }
    }
}

#[inline(always)]
fn add_known_lines<const COUNT: usize, T: Copy, S: Copy + Default + AddAssign>(
    rows: &[T],
    width: usize,
    lines: [usize; COUNT],
    value: &impl Fn(T) -> S,
    sums: &mut [S],
) {
    let lines = lines.map(|line| &rows[line * width..][..sums.len()]);
    for (at, sum) in sums.iter_mut().enumerate() {
        let mut here = S::default();
        for line in lines {
            here += value(line[at]);
        }
        *sum = here;
    }
}

/// The sums of groups of `factor` numbers.
#[inline(always)]
fn add_groups<S: Copy + Into<u32>>(sums: &[S], factor: usize, totals: &mut [u32]) {
    // For the usual factors a length that the compiler knows.
    match factor {
        2 => add_each::<2, S>(sums, totals),
        3 => add_each::<3, S>(sums, totals),
        4 => add_each::<4, S>(sums, totals),
        5 => add_each::<5, S>(sums, totals),
        6 => add_each::<6, S>(sums, totals),
        8 => add_each::<8, S>(sums, totals),
        10 => add_each::<10, S>(sums, totals),
        _ => {
            for (total, group) in totals.iter_mut().zip(sums.chunks_exact(factor)) {
                *total = 0;
                for &sum in group {
                    *total += sum.into();
                }
            }
        }
    }
}

#[inline(always)]
fn add_each<const FACTOR: usize, S: Copy + Into<u32>>(sums: &[S], totals: &mut [u32]) {
    for (total, group) in totals.iter_mut().zip(sums.as_chunks::<FACTOR>().0) {
        *total = 0;
        for &sum in group {
            *total += sum.into();
        }
    }
}

/// The values below and above which only a few pixels in a thousand lie.
fn range(image: &Image<u16>) -> (u16, u16) {
    /// Share of the pixels that may lie outside on either side.
    const OUTSIDE: f64 = 2e-3;
    /// About this many pixels are looked at.
    const LOOKED_AT: usize = 1 << 18;
    let step = (image.pixels.len() / LOOKED_AT).max(1) | 1;
    let mut values: Vec<u16> = image.pixels.iter().step_by(step).copied().collect();
    if values.is_empty() {
        return (0, u16::MAX);
    }
    let rank = (OUTSIDE * values.len() as f64) as usize;
    let last = values.len() - 1;
    let low = *values.select_nth_unstable(rank).1;
    let high = *values.select_nth_unstable(last - rank).1;
    (low, high)
}

/// A copy of twice the size, linear between pixels.
fn doubled(small: &Grey8) -> Grey8 {
    let (w, h) = (small.width, small.height);
    // A quarter of a pixel from its own pixel's centre towards the next one's.
    let near = |i: usize, size: usize| {
        let other = if i.is_multiple_of(2) { (i / 2).saturating_sub(1) } else { (i / 2 + 1).min(size - 1) };
        [(i / 2, 3u32), (other, 1u32)]
    };
    Grey8::from_fn(2 * w, 2 * h, |x, y| {
        let columns = near(x, w);
        let weigh = |(row, a): (usize, u32)| {
            columns.iter().map(|&(col, b)| a * b * u32::from(small.pixels[row * w + col])).sum::<u32>()
        };
        ((near(y, h).into_iter().map(weigh).sum::<u32>() + 8) / 16) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reduced_pixels_are_means() {
        let picture = Picture::from(Image { width: 5, height: 4, pixels: (0..20u8).collect() });
        assert_eq!(Level::Reduced(2).copy(&picture).pixels, [3, 5, 13, 15]);
        let picture = Picture::from(Image { width: 2, height: 1, pixels: vec![1000u16, 3000] });
        assert_eq!(Level::Reduced(1).copy(&picture).pixels, [0, 255]);
    }

    #[test]
    fn every_factor_gives_means() {
        let (width, height) = (97, 41);
        let grey = |x: usize, y: usize| (x * x * 7 + y * 13 + x * y * 3) % 251;
        let picture = Picture::from(Image::from_fn(width, height, |x, y| grey(x, y) as u8));
        for factor in 1..=9 {
            let copy = Level::Reduced(factor).copy(&picture);
            assert_eq!((copy.width, copy.height), (width / factor, height / factor));
            for (k, &pixel) in copy.pixels.iter().enumerate() {
                let (x, y) = (factor * (k % copy.width), factor * (k / copy.width));
                let sum: usize = (0..factor * factor).map(|i| grey(x + i % factor, y + i / factor)).sum();
                let mean = sum as f64 / (factor * factor) as f64;
                assert!((f64::from(pixel) - mean).abs() <= 0.5 + 1e-9, "{factor}: {pixel} {mean}");
            }
        }
    }

    #[test]
    fn skimmed_pixels_are_means_of_lines_round_the_centre() {
        for factor in 1..=25 {
            let lines = skimmed_lines(factor);
            assert!(lines.is_sorted_by(|a, b| a < b) && lines.iter().all(|&line| line < factor), "{factor}: {lines:?}");
            // A ramp shows whether the copy is shifted.
            let picture = Picture::from(Image::from_fn(3 * factor, 2 * factor, |x, y| (2 * x + 2 * y) as u8));
            let (skimmed, all) = (Level::Skimmed(factor).copy(&picture), Level::Reduced(factor).copy(&picture));
            assert_eq!(skimmed, all, "{factor}: {lines:?}");
        }
    }

    #[test]
    fn one_hot_pixel_does_not_flatten_a_picture() {
        let mut pixels: Vec<u16> = (0..10_000).map(|k| if k % 2 == 0 { 1000 } else { 3000 }).collect();
        pixels[5000] = 65_535;
        let copy = Level::Reduced(1).copy(&Picture::from(Image { width: 100, height: 100, pixels }));
        assert_eq!((copy.pixels[0], copy.pixels[1], copy.pixels[5000]), (0, 255, 255));
    }

    #[test]
    fn places_go_there_and_back() {
        for level in [Level::Reduced(1), Level::Reduced(5), Level::Doubled] {
            let p = Point2::new(12.25, 7.5);
            assert!((level.to_copy(&level.to_picture(&p)) - p).norm() < 1e-12);
        }
        // The first pixel of a copy reduced by four covers pixels 0 to 3.
        assert_eq!(Level::Reduced(4).to_picture(&Point2::origin()), Point2::new(1.5, 1.5));
    }
}
