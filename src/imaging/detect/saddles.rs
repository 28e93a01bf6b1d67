//! Places that look like a checkerboard corner: four sectors of alternating brightness, a saddle of the grey values.
//!
//! In: a small grey picture. Out: candidates, the local peaks of the ring response of Bennett and Lasenby (ChESS,
//! 2014), each with the axis of its two bright quadrants. What is a candidate is decided on the spot: by the response
//! against the contrast on the same ring and against the picture's noise. Nothing elsewhere in the picture, however
//! bright, takes a dim board's corners away. Goes wrong: squares of less than about 8 px, blur of more than half a
//! square.

use nalgebra::{Point2, Vector2};

use crate::imaging::image::Grey8;
use crate::widest::widest;

/// Offsets of the ring, px, in order round it: radius about 5.
const RING: [(isize, isize); 16] = [
    (5, 0),
    (5, 2),
    (4, 4),
    (2, 5),
    (0, 5),
    (-2, 5),
    (-4, 4),
    (-5, 2),
    (-5, 0),
    (-5, -2),
    (-4, -4),
    (-2, -5),
    (0, -5),
    (2, -5),
    (4, -4),
    (5, -2),
];
/// The ring's reach, px.
const REACH: usize = 5;
/// Least response of a corner over the contrast on its ring; a saddle has 20 to 30, the outer corner of a board's
/// square hardly any.
const LEAST_SHAPE: f64 = 8.0;
/// Least contrast on a ring, in standard deviations of the picture's noise.
const LEAST_CONTRAST: f64 = 3.0;
/// Least noise that is reckoned with, grey values: that of rounding.
const LEAST_NOISE: f64 = 0.5;
/// Tiles along the longer side of a picture. Each keeps as many candidates as it can hold corners of a board with the
/// smallest squares.
const TILES: usize = 16;
/// Responses that are looked at together: most of a picture is far from any corner.
const RUN: usize = 32;
/// Least distance of two corners, px.
const LEAST_DISTANCE_PX: usize = 8;

/// A place that looks like a checkerboard corner.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub(super) at: Point2<f64>,
    /// Five times the ring response.
    pub(super) strength: i16,
    /// Direction of the bright quadrants' axis, rad, modulo pi.
    pub(super) axis: f64,
    /// Mean of the ring's brighter half less that of its darker half.
    pub(super) contrast: f64,
}

/// Side of a picture's tiles, px, and how many there are in a row and in a column.
fn tiling(picture: &Grey8) -> (usize, usize, usize) {
    let side = picture.width.max(picture.height).div_ceil(TILES).max(8 * LEAST_DISTANCE_PX);
    (side, picture.width.div_ceil(side), picture.height.div_ceil(side))
}

/// How many tiles a picture has.
pub(super) fn tiles(picture: &Grey8) -> usize {
    let (_, columns, rows) = tiling(picture);
    columns * rows
}

/// All candidates: first the strongest of each tile, then each tile's second, and so on, so that every part of the
/// picture is soon looked at.
pub(super) fn candidates(picture: &Grey8) -> Vec<Candidate> {
    let (w, h) = (picture.width, picture.height);
    if w <= 2 * REACH || h <= 2 * REACH {
        return Vec::new();
    }
    let response = responses(picture);
    let least_contrast = LEAST_CONTRAST * noise(picture);
    let (side, columns, rows) = tiling(picture);
    let mut tiles: Vec<Vec<Candidate>> = vec![Vec::new(); columns * rows];
    // A whole number, as responses are; those at the border, zero, are below it.
    let least = (LEAST_SHAPE * least_contrast).floor() as i16;
    for y in REACH..h - REACH {
        for (run, here) in response[y * w..(y + 1) * w].chunks(RUN).enumerate().filter(|(_, run)| any_above(run, least))
        {
            for x in (run * RUN..).zip(here).filter(|(_, here)| **here > least).map(|(x, _)| x) {
                if !is_peak(&response, w, x, y) {
                    continue;
                }
                let contrast = contrast(picture, x, y);
                if contrast > least_contrast && f64::from(response[y * w + x]) > LEAST_SHAPE * contrast {
                    tiles[(y / side) * columns + x / side].push(candidate(picture, &response, contrast, (x, y)));
                }
            }
        }
    }
    let most = (side / LEAST_DISTANCE_PX).pow(2) / 2;
    let mut ranked: Vec<(usize, Candidate)> = Vec::new();
    for tile in &mut tiles {
        tile.sort_by_key(|candidate| std::cmp::Reverse(candidate.strength));
        ranked.extend(tile.iter().copied().take(most).enumerate());
    }
    // Stable, so that equal ones stay in the order of their places.
    ranked.sort_by_key(|(rank, candidate)| (*rank, std::cmp::Reverse(candidate.strength)));
    ranked.into_iter().map(|(_, candidate)| candidate).collect()
}

/// Standard deviation of the noise, grey values: from what neighbours differ by in three places of four. Half of a
/// picture may be clipped and without noise, a quarter may be edges.
fn noise(picture: &Grey8) -> f64 {
    /// About this many places are looked at.
    const LOOKED_AT: usize = 50_000;
    /// The third quartile of the difference of two normal deviates, in standard deviations of one.
    const THIRD_QUARTILE: f64 = 1.627;
    let step = (picture.pixels.len() / LOOKED_AT).max(1) | 1;
    // How often each difference occurs, to find the one of that rank.
    let mut counts = [0_usize; 256];
    for two in picture.pixels.windows(2).step_by(step) {
        counts[usize::from(two[0].abs_diff(two[1]))] += 1;
    }
    let rank = 3 * counts.iter().sum::<usize>() / 4;
    let mut below = 0;
    let third_quartile = counts.iter().position(|count| {
        below += count;
        below > rank
    });
    third_quartile.map_or(LEAST_NOISE, |difference| (difference as f64 / THIRD_QUARTILE).max(LEAST_NOISE))
}

/// Five times the ring response of every pixel, a whole number that fits: opposite pixels of the ring alike and a
/// quarter turn on the other colour, less what a line or an edge shows, less what a spot shows. `REACH` px at the
/// border have none.
fn responses(picture: &Grey8) -> Vec<i16> {
    widest(
        #[inline(always)]
        || row_by_row(picture),
    )
}

#[inline(always)]
fn row_by_row(picture: &Grey8) -> Vec<i16> {
    let (w, h) = (picture.width, picture.height);
    let mut response = vec![0i16; w * h];
    let wide = w - 2 * REACH;
    let mut spot = vec![0i16; wide];
    for y in REACH..h - REACH {
        let row = |(dx, dy): (isize, isize)| {
            let start = ((y as isize + dy) * w as isize + REACH as isize + dx) as usize;
            &picture.pixels[start..start + wide]
        };
        let here = &mut response[y * w + REACH..][..wide];
        spot.fill(0);
        // Row after row, so that the compiler makes vector loops of them.
        for n in 0..4 {
            let [a, b, c, d] = [0, 4, 8, 12].map(|quarter| row(RING[n + quarter]));
            for (((((here, spot), a), b), c), d) in here.iter_mut().zip(&mut spot).zip(a).zip(b).zip(c).zip(d) {
                let [a, b, c, d] = [*a, *b, *c, *d].map(i16::from);
                *here += 5 * ((a + c - b - d).abs() - (a - c).abs() - (b - d).abs());
                *spot += 5 * (a + b + c + d);
            }
        }
        for local in [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)].map(row) {
            for (spot, grey) in spot.iter_mut().zip(local) {
                *spot -= 16 * i16::from(*grey);
            }
        }
        for (here, spot) in here.iter_mut().zip(&spot) {
            *here -= spot.abs();
        }
    }
    response
}

#[inline]
fn any_above(responses: &[i16], least: i16) -> bool {
    let mut any = false;
    for &response in responses {
        any |= response > least;
    }
    any
}

fn is_peak(response: &[i16], w: usize, x: usize, y: usize) -> bool {
    const AROUND: usize = 3;
    let here = response[y * w + x];
    let highest = |v: usize, from: usize, to: usize| response[v * w + from..v * w + to].iter().copied().max();
    let (left, right) = (x - AROUND, x + AROUND + 1);
    // Of equal neighbours the first is the peak. The nearest rows first: they tell most places that are none.
    highest(y, left, x) < Some(here)
        && highest(y, x + 1, right) <= Some(here)
        && (1..=AROUND).all(|d| highest(y - d, left, right) < Some(here) && highest(y + d, left, right) <= Some(here))
}

/// Grey value of a pixel of the ring round a place.
fn on_ring(picture: &Grey8, (x, y): (usize, usize), (dx, dy): (isize, isize)) -> u8 {
    picture.pixels[((y as isize + dy) as usize) * picture.width + (x as isize + dx) as usize]
}

/// Mean of the brighter half of the ring round a place less that of the darker half.
fn contrast(picture: &Grey8, x: usize, y: usize) -> f64 {
    let ring = RING.map(|offset| on_ring(picture, (x, y), offset));
    // Where half of the values lie on either side of a level, their distances from it add up to the one less the other,
    // and to more elsewhere.
    let distances = |level: u8| ring.iter().map(|grey| u16::from(grey.abs_diff(level))).sum::<u16>();
    f64::from(ring.map(distances).into_iter().fold(u16::MAX, u16::min)) / (ring.len() / 2) as f64
}

fn candidate(picture: &Grey8, response: &[i16], contrast: f64, (x, y): (usize, usize)) -> Candidate {
    let w = picture.width;
    let (mut sum, mut weight) = (Vector2::zeros(), 0.0);
    for v in y - 2..=y + 2 {
        for u in x - 2..=x + 2 {
            let r = f64::from(response[v * w + u].max(0));
            sum += Vector2::new(u as f64, v as f64) * r;
            weight += r;
        }
    }
    let (mut cos, mut sin) = (0.0, 0.0);
    for (dx, dy) in RING {
        let grey = f64::from(on_ring(picture, (x, y), (dx, dy)));
        // Cosine and sine of twice the direction.
        let (dx, dy) = (dx as f64, dy as f64);
        let square = dx * dx + dy * dy;
        cos += grey * (dx * dx - dy * dy) / square;
        sin += grey * 2.0 * dx * dy / square;
    }
    Candidate { at: Point2::from(sum / weight), strength: response[y * w + x], axis: 0.5 * sin.atan2(cos), contrast }
}
