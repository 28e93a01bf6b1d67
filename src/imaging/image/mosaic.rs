//! Raw colour mosaics (Bayer 1976): each pixel behind a red, green or blue filter.
//!
//! A raw mosaic looks like a grey picture with a pattern of period two, and measured as one it gives corners of which
//! nobody knows the error. So it is recognised (in even light the four pixels of a cell differ alike all over the
//! picture) and refused with the patterns that it may have; with its pattern named it is read, and without where the
//! filters hardly differ. A board is black and white: behind each filter its grey is a linear function of the green
//! one. The two are matched, over bright and over dark areas, and every pixel stays a measurement of its own, with its
//! own noise; interpolated colours would be neither. Goes wrong: a lens that images red and blue in other places than
//! green widens the edges a little; a white balance that makes all filters alike leaves no pattern and no harm.

use std::fmt;
use std::str::FromStr;

use image::DynamicImage;

use super::clipping::{self, Value};
use super::{Image, Picture};
use crate::statistics::median;

/// The order of the filters in the first two rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Mosaic {
    /// Red, green / green, blue.
    Rggb,
    /// Blue, green / green, red.
    Bggr,
    /// Green, red / blue, green.
    Grbg,
    /// Green, blue / red, green.
    Gbrg,
}

const ALL: [Mosaic; 4] = [Mosaic::Rggb, Mosaic::Bggr, Mosaic::Grbg, Mosaic::Gbrg];

impl Mosaic {
    pub fn name(self) -> &'static str {
        match self {
            Mosaic::Rggb => "RGGB",
            Mosaic::Bggr => "BGGR",
            Mosaic::Grbg => "GRBG",
            Mosaic::Gbrg => "GBRG",
        }
    }

    /// The two green pixels of a cell; pixels are numbered row by row.
    fn greens(self) -> [usize; 2] {
        match self {
            Mosaic::Rggb | Mosaic::Bggr => [1, 2],
            Mosaic::Grbg | Mosaic::Gbrg => [0, 3],
        }
    }
}

impl fmt::Display for Mosaic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Mosaic {
    type Err = String;

    fn from_str(text: &str) -> Result<Mosaic, String> {
        let found = ALL.into_iter().find(|pattern| pattern.name().eq_ignore_ascii_case(text));
        found.ok_or_else(|| format!("a mosaic is one of {}", ALL.map(Mosaic::name).join(", ")))
    }
}

/// Cells that are looked at.
const CELLS: usize = 30_000;
/// So many of them side by side: memory comes in pieces, and waiting for them is what looking at a large picture costs.
const RUN: usize = 64;
/// Cells that differ from the next one by less than this share are flat.
const FLAT: f64 = 0.06;
/// Share by which pixels of a cell differ from their mean in a mosaic, at the least. Unequal rows of a sensor with
/// several amplifiers differ by a percent or two.
const COLOURED: f64 = 0.04;
/// Share up to which the filters are told apart by the picture alone: under infrared light, or where the camera has
/// matched them but for a little, all see nearly the same. Red and blue filters under a light that one sees by differ
/// from green by several times this.
const NEARLY_ALIKE: f64 = 0.1;
/// Share by which the two greens may differ.
const GREENS_ALIKE: f64 = 0.03;
/// Fewest flat cells that tell anything.
const FEWEST: usize = 200;

/// Why a picture in colour is no mosaic.
pub(super) const IN_COLOUR: &str = "is in colour already: a raw mosaic is grey";

/// [`grey`] of a decoded picture without colours; transparency is left away.
pub(super) fn of_grey(decoded: DynamicImage, pattern: Option<Mosaic>) -> Result<Picture, String> {
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    match decoded {
        DynamicImage::ImageLuma8(samples) => grey(Image { width, height, pixels: samples.into_raw() }, pattern),
        DynamicImage::ImageLuma16(samples) => grey(Image { width, height, pixels: samples.into_raw() }, pattern),
        DynamicImage::ImageLumaA8(samples) => grey(Image { width, height, pixels: without_alpha(&samples) }, pattern),
        DynamicImage::ImageLumaA16(samples) => grey(Image { width, height, pixels: without_alpha(&samples) }, pattern),
        _ => Err(IN_COLOUR.to_owned()),
    }
}

fn without_alpha<T: Copy>(samples: &[T]) -> Vec<T> {
    samples.chunks_exact(2).map(|p| p[0]).collect()
}

/// The picture, read by its pattern where one is named; a reason where it is a mosaic without one, or not of the one
/// named.
pub(super) fn grey<T: Value>(image: Image<T>, pattern: Option<Mosaic>) -> Result<Picture, String>
where
    Picture: From<Image<T>>,
{
    let cells = flat_cells(&image);
    let seen = pattern_of(&cells);
    match (pattern, seen) {
        (None, None) => Ok(image.into()),
        (None, Some((greens, share))) => {
            let fitting = ALL.into_iter().filter(|pattern| pattern.greens() == greens);
            // Which of them it is makes no difference to the match.
            if let (true, Some(pattern)) = (share < NEARLY_ALIKE, fitting.clone().next()) {
                return Ok(matched(&image, &cells, pattern).into());
            }
            let fitting: Vec<String> = fitting.map(|p| format!("`--bayer {p}`")).collect();
            Err(format!(
                "is a raw colour mosaic (neighbouring pixels differ by {:.0} %): {} reads it, by the camera's data sheet",
                100.0 * share,
                fitting.join(" or ")
            ))
        }
        (Some(named), Some((greens, _))) if named.greens() != greens => {
            Err(format!("is a raw colour mosaic, but not {named}: its green pixels lie on the other diagonal"))
        }
        (Some(named), _) => Ok(matched(&image, &cells, named).into()),
    }
}

/// The four pixels of cells in even light.
fn flat_cells<T: Value>(image: &Image<T>) -> Vec<[f64; 4]> {
    let (w, h) = (image.width, image.height);
    if w < 4 || h < 2 {
        return Vec::new();
    }
    let (columns, rows) = (w / 2 - 1, h / 2);
    let run = columns.min(RUN);
    let (runs, a_row) = (columns / run * rows, columns / run);
    // A step with no common divisor walks over all of the picture.
    let step = (runs * run).div_ceil(CELLS) | 1;
    let cell = |x: usize, y: usize| -> [f64; 4] {
        let at = 2 * y * w + 2 * x;
        [at, at + 1, at + w, at + w + 1].map(|k| image.pixels[k].into())
    };
    (0..runs)
        .step_by(step)
        .flat_map(|k| (0..run).map(move |i| (k % a_row * run + i, k / a_row)))
        .map(|(x, y)| (cell(x, y), cell(x + 1, y)))
        .filter(|(here, next)| {
            let scale = here.iter().sum::<f64>() / 4.0;
            let alike = |(a, b): (&f64, &f64)| (a - b).abs() <= FLAT * scale + 1.0;
            scale > 0.0 && here.iter().zip(next).all(alike)
        })
        .map(|(here, _)| here)
        .collect()
}

/// The greens' places and by how much the pixels of a cell differ, where cells have a mosaic's pattern.
fn pattern_of(cells: &[[f64; 4]]) -> Option<([usize; 2], f64)> {
    if cells.len() < FEWEST {
        return None;
    }
    // Dark pixels are mostly offset and noise.
    let mean = |cell: &[f64; 4]| cell.iter().sum::<f64>() / 4.0;
    let middle = median(cells.iter().map(mean))?;
    let share = |k: usize| median(cells.iter().filter(|cell| mean(cell) >= middle).map(|cell| cell[k] / mean(cell)));
    let shares = [share(0)?, share(1)?, share(2)?, share(3)?];
    let differ = |[a, b]: [usize; 2]| (shares[a] - shares[b]).abs();
    let greens = if differ([0, 3]) < differ([1, 2]) { [0, 3] } else { [1, 2] };
    let green = (shares[greens[0]] + shares[greens[1]]) / 2.0;
    let most = shares.iter().map(|share| (share / green - 1.0).abs()).fold(0.0, f64::max);
    (differ(greens) < GREENS_ALIKE && most > COLOURED).then_some((greens, most))
}

/// Each filter's values as the first green's, by a line through the medians of dark and bright cells; 16 bits, so that
/// nothing is rounded away.
fn matched<T: Value>(image: &Image<T>, cells: &[[f64; 4]], pattern: Mosaic) -> Image<u16> {
    let scale = f64::from(u16::MAX) / T::TOP.whole() as f64;
    let green = pattern.greens()[0];
    let middle = median(cells.iter().map(|cell| cell[green])).unwrap_or(0.0);
    let level =
        |phase: usize, bright: bool| median(cells.iter().filter(|c| (c[green] > middle) == bright).map(|c| c[phase]));
    let line = |phase: usize| -> [f64; 2] {
        let levels = [level(phase, false), level(phase, true), level(green, false), level(green, true)];
        let [Some(dark), Some(bright), Some(green_dark), Some(green_bright)] = levels else { return [0.0, 1.0] };
        // Without contrast the filters' sensitivities are known only as if there were no offset.
        if bright - dark < 0.05 * bright {
            return [0.0, if bright > 0.0 { green_bright / bright } else { 1.0 }];
        }
        let slope = (green_bright - green_dark) / (bright - dark);
        [green_dark - slope * dark, slope]
    };
    let lines = [0, 1, 2, 3].map(line);
    let clip = [0, 1, 2, 3].map(|phase| phase_clip_level(image, phase));
    let pixels = image.pixels.iter().enumerate().map(|(at, &value)| {
        let phase = 2 * ((at / image.width) % 2) + (at % image.width) % 2;
        let value: f64 = value.into();
        if value >= clip[phase] {
            return u16::MAX;
        }
        let [offset, slope] = lines[phase];
        ((offset + slope * value) * scale).round().clamp(0.0, f64::from(u16::MAX)) as u16
    });
    Image { width: image.width, height: image.height, pixels: pixels.collect() }
}

fn phase_clip_level<T: Value>(image: &Image<T>, phase: usize) -> f64 {
    let rows = image.pixels.chunks_exact(image.width).skip(phase / 2).step_by(2);
    let values: Vec<T> = rows.flat_map(|row| row.iter().skip(phase % 2).step_by(2).copied()).collect();
    clipping::channel_level(&values, 1, 0)
}

#[cfg(test)]
mod tests {
    use super::super::Grey;
    use super::*;

    /// Squares of 40 px behind filters, with a little noise.
    fn mosaic(gains: [f64; 4], offset: f64) -> Image<u8> {
        Image::from_fn(400, 300, |x, y| {
            let light = if (x / 40 + y / 40) % 2 == 0 { 180.0 } else { 30.0 };
            (offset + gains[2 * (y % 2) + x % 2] * light + ((400 * y + x) * 7919 % 5) as f64 - 2.0) as u8
        })
    }

    #[test]
    fn a_mosaic_is_named() {
        let reason = grey(mosaic([0.6, 1.0, 1.0, 0.5], 8.0), None).unwrap_err();
        assert!(
            reason.contains("mosaic") && reason.contains("--bayer RGGB") && reason.contains("--bayer BGGR"),
            "{reason}"
        );
        let reason = grey(mosaic([1.0, 0.6, 0.8, 1.0], 8.0), None).unwrap_err();
        assert!(reason.contains("--bayer GRBG") && !reason.contains("RGGB"), "{reason}");
        assert!(grey(mosaic([1.0, 0.6, 0.8, 1.0], 8.0), Some(Mosaic::Rggb)).unwrap_err().contains("not RGGB"));
    }

    #[test]
    fn grey_is_no_mosaic() {
        let image = mosaic([1.0; 4], 8.0);
        assert_eq!(grey(image.clone(), None).unwrap(), Picture::from(image));
        // Two amplifiers that differ by two percent.
        assert!(grey(mosaic([1.0, 1.0, 0.98, 0.98], 8.0), None).is_ok());
    }

    #[test]
    fn filters_that_hardly_differ_are_matched_unasked() {
        for gains in [[0.95, 1.0, 1.0, 1.0], [1.0, 0.94, 0.93, 1.0], [0.95, 1.0, 1.0, 1.06]] {
            let picture = grey(mosaic(gains, 8.0), None).unwrap();
            let Grey::Sixteen(image) = &picture.grey else { panic!("8 bits") };
            let mean = |phase: usize| {
                let cells = (0..64).map(|k| (4 + k % 8 * 2 + phase % 2, 4 + k / 8 * 2 + phase / 2));
                cells.map(|(x, y)| f64::from(image.pixels[y * 400 + x]) / 257.0).sum::<f64>() / 64.0
            };
            let means = [0, 1, 2, 3].map(mean);
            assert!(means.iter().all(|m| (m / means[0] - 1.0).abs() < 0.01), "{gains:?}: {means:?}");
        }
        // By as little as amplifiers differ nothing is changed.
        let image = mosaic([0.985, 1.0, 1.0, 1.0], 8.0);
        assert_eq!(grey(image.clone(), None).unwrap(), Picture::from(image));
    }

    #[test]
    fn a_named_mosaic_is_grey() {
        for pattern in [Mosaic::Rggb, Mosaic::Bggr] {
            let picture = grey(mosaic([0.6, 1.0, 1.0, 0.5], 8.0), Some(pattern)).unwrap();
            let Grey::Sixteen(image) = &picture.grey else { return assert_eq!(0, 16, "bits") };
            // Cells of one square, bright and dark: as green would see them, whatever the filter.
            for (x, y, expected) in [(20, 20, 188.0), (60, 20, 38.0)] {
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let mean: f64 = (0..8)
                        .map(|k| f64::from(image.pixels[(y + dy + 2 * (k % 4)) * 400 + x + dx + 2 * (k / 4)]) / 257.0)
                        .sum::<f64>()
                        / 8.0;
                    assert!((mean - expected).abs() < 4.0, "{pattern} {x} {dx} {dy}: {mean} {expected}");
                }
            }
        }
    }

    #[test]
    fn patterns_have_names() {
        assert_eq!("grbg".parse(), Ok(Mosaic::Grbg));
        assert!("rgb".parse::<Mosaic>().unwrap_err().contains("RGGB"));
    }
}
