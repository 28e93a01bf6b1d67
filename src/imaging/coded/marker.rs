//! What stands in one square of a board with markers.
//!
//! In: a picture and where the four corners of a square lie in it. Out: the bits of the marker that stands there, or
//! none. Method: each bit is the mean of nine places in its middle, carried into the picture by the square's
//! homography; black and white are those of the marker's border and of the paper round it, so that uneven light, and a
//! board printed white on black, do not matter; blur that mixes neighbouring bits is undone to the second order. Goes
//! wrong: bits of less than about two pixels, and blur of more than one of them.

use nalgebra::{Matrix3, Point2, Vector3};

use crate::imaging::board::dictionary::turned;
use crate::imaging::board::{Board, Kind};
use crate::imaging::image::{Grey, Image, Picture};

/// Widths of a tag's black border, in its bits: Kalibr's, and that of most others who print tags.
pub const TAG_BORDERS: [usize; 2] = [2, 1];

/// Share of the border's fields, and of those of the paper beside it, that may be on the wrong side: glare, a fold, or
/// blur. By the binomial sum, fields without any order pass for the border and paper of 4x4 bits once in 4 300 times,
/// of 6x6 in 46 000.
const MOST_BROKEN: f64 = 0.25;
/// Where a bit is looked at, in its own sides from its middle.
const WITHIN_BIT: [f64; 3] = [-0.2, 0.0, 0.2];

/// The bits in a square, in its own order of columns and rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Marker {
    /// Row by row from the lowest bit, one for the border's colour.
    pub code: u64,
    /// Bits along its side.
    pub bits: usize,
    /// Whether the border is brighter than the paper.
    pub inverted: bool,
    /// By how much paper and border differ, grey values.
    pub contrast: f64,
}

impl Marker {
    /// The same as seen after so many quarter turns of the grid that it was read in.
    pub fn turned(self, quarters: usize) -> Marker {
        Marker { code: turned(self.code, self.bits, quarters), ..self }
    }

    /// By how many bits it differs from a code.
    pub fn differs_from(&self, code: u64) -> usize {
        (self.code ^ code).count_ones() as usize
    }
}

/// How markers are printed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fields {
    /// Side of a marker, as a share of its square's.
    pub share: f64,
    /// Bits along its side, without the border.
    pub bits: usize,
    /// Width of the border, in bits.
    pub border: usize,
    /// How deep in the square its paper is looked at, as a share of its side; negative outside of it.
    paper: f64,
}

impl Fields {
    /// A marker in a square of paper.
    pub fn of_marker(share: f64, bits: usize) -> Fields {
        Fields { share, bits, border: 1, paper: (1.0 - share) / 4.0 }
    }

    /// A tag that fills its square, with paper in the gaps round it.
    pub fn of_tag(gap: f64, bits: usize, border: usize) -> Fields {
        Fields { share: 1.0, bits, border, paper: -gap / 2.0 }
    }

    /// Side of what a square holds beside its own colour, as a share of its side: a marker, or the bits of a tag that
    /// fills it.
    pub fn marked(self) -> f64 {
        let Fields { share, bits, border, .. } = self;
        if share < 1.0 { share } else { bits as f64 / (bits + 2 * border) as f64 }
    }

    /// Where the middle of the paper round a tag or marker is, in sides of its square from that one's edge; negative
    /// outside of it.
    pub fn beyond(self) -> f64 {
        self.paper
    }

    /// How wide the square's own colour is round that.
    pub fn margin(self) -> f64 {
        (1.0 - self.marked()) / 2.0
    }
}

/// The fields of a marker with the blur between them undone as far as four neighbours tell, `paper` round it. To the
/// second order a Gaussian blur of a standard deviation of `s` fields is undone by `s^2 / 2` of the differences from
/// the neighbours. Fields that are black and white stay what they are however sharp the picture is, so that one amount
/// does for all.
fn sharpened(fields: &[f64], side: usize, paper: f64) -> Vec<f64> {
    /// Of a blur of 0.7 fields: beyond it fields mix with more than their neighbours.
    const UNDONE: f64 = 0.25;
    let at = |i: isize, j: isize| {
        let inside = |k: isize| (0..side as isize).contains(&k);
        if inside(i) && inside(j) { fields[j as usize * side + i as usize] } else { paper }
    };
    let one = |k: usize| {
        let (i, j) = ((k % side) as isize, (k / side) as isize);
        let neighbours = at(i - 1, j) + at(i + 1, j) + at(i, j - 1) + at(i, j + 1);
        fields[k] + UNDONE * (4.0 * fields[k] - neighbours)
    };
    (0..side * side).map(one).collect()
}

/// Where the corners of a unit square lie in a picture, in order round it from (0, 0) over (1, 0): the map from the one
/// to the other.
pub fn square_map(corners: &[Point2<f64>; 4]) -> Option<Matrix3<f64>> {
    let [a, b, c, d] = corners;
    // Heckbert 1989, section 2.2.3.
    let (d1, d2, sum) = (b - c, d - c, a - b + (c - d));
    let det = d1.perp(&d2);
    let (g, h) = (sum.perp(&d2) / det, d1.perp(&sum) / det);
    let (x, y) = (b - a + g * b.coords, d - a + h * d.coords);
    let map = Matrix3::new(x.x, y.x, a.x, x.y, y.y, a.y, g, h, 1.0);
    map.iter().all(|v| v.is_finite()).then_some(map)
}

/// A place of the unit square in the picture.
pub fn mapped(map: &Matrix3<f64>, x: f64, y: f64) -> Point2<f64> {
    let p = map * Vector3::new(x, y, 1.0);
    Point2::new(p.x / p.z, p.y / p.z)
}

/// Grey value at a place, px, between the four pixels round it; `None` at the border.
pub fn grey_at(picture: &Picture, at: &Point2<f64>) -> Option<f64> {
    match &picture.grey {
        Grey::Eight(image) => between(image, at),
        Grey::Sixteen(image) => between(image, at),
    }
}

fn between<T: Copy + Into<f64>>(image: &Image<T>, at: &Point2<f64>) -> Option<f64> {
    let (x, y) = (at.x.floor(), at.y.floor());
    if !(x >= 0.0 && y >= 0.0 && x + 1.0 < image.width as f64 && y + 1.0 < image.height as f64) {
        return None;
    }
    let (u, v) = (at.x - x, at.y - y);
    let first = y as usize * image.width + x as usize;
    let pixel = |offset: usize| -> f64 { image.pixels[first + offset].into() };
    let row = |offset: usize| pixel(offset) * (1.0 - u) + pixel(offset + 1) * u;
    Some(row(0) * (1.0 - v) + row(image.width) * v)
}

/// A square's fields, border and bits, and the paper round them, grey values; `None` at the picture's border.
struct Sampled {
    /// Row by row, the blur between them undone.
    fields: Vec<f64>,
    /// Fields along a side.
    side: usize,
    paper: Vec<f64>,
}

fn sampled(picture: &Picture, corners: &[Point2<f64>; 4], fields: Fields) -> Option<Sampled> {
    let map = square_map(corners)?;
    let Fields { share, bits, border, paper: near } = fields;
    let margin = (1.0 - share) / 2.0;
    let side = bits + 2 * border;
    let field = share / side as f64;
    let place = |i: usize| margin + (i as f64 + 0.5) * field;
    let mean = |x: f64, y: f64| {
        let mut sum = 0.0;
        for dx in WITHIN_BIT {
            for dy in WITHIN_BIT {
                sum += grey_at(picture, &mapped(&map, x + dx * field, y + dy * field))?;
            }
        }
        Some(sum / (WITHIN_BIT.len() * WITHIN_BIT.len()) as f64)
    };
    let blurred: Vec<f64> =
        (0..side * side).map(|k| mean(place(k % side), place(k / side))).collect::<Option<Vec<f64>>>()?;
    let along = |i: usize, k: usize| {
        let far = 1.0 - near;
        let at = [(place(i), near), (place(i), far), (near, place(i)), (far, place(i))][k];
        grey_at(picture, &mapped(&map, at.0, at.1))
    };
    let paper: Vec<f64> = (0..4 * side).map(|k| along(k / 4, k % 4)).collect::<Option<Vec<f64>>>()?;
    Some(Sampled { fields: sharpened(&blurred, side, mean_of(&paper)), side, paper })
}

fn mean_of(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// How dark the bits in a square are, row by row, grey values from their mean, whatever stands round them: for markers
/// that are too faint to be read one by one. `None` at the picture's border.
pub fn darkness(picture: &Picture, corners: &[Point2<f64>; 4], fields: Fields) -> Option<Vec<f64>> {
    let Sampled { fields: greys, side, .. } = sampled(picture, corners, fields)?;
    let Fields { bits, border, .. } = fields;
    let greys: Vec<f64> = (0..bits * bits).map(|k| greys[(k / bits + border) * side + k % bits + border]).collect();
    let mean = mean_of(&greys);
    Some(greys.into_iter().map(|grey| mean - grey).collect())
}

/// Reads the marker in a square. `None` where there is none: border and paper are then not told apart.
pub fn read(picture: &Picture, corners: &[Point2<f64>; 4], fields: Fields) -> Option<Marker> {
    let Sampled { fields: grid, side, paper } = sampled(picture, corners, fields)?;
    let Fields { bits, border, .. } = fields;
    let is_border = |k: usize| [k % side, k / side].iter().any(|&i| i < border || i >= side - border);
    let outline: Vec<f64> = (0..side * side).filter(|&k| is_border(k)).map(|k| grid[k]).collect();
    let (white, black) = (mean_of(&paper), mean_of(&outline));
    let inverted = black > white;
    let middle = 0.5 * (white + black);
    let is_black = |grey: f64| (grey < middle) != inverted;
    let wrong = |fields: &[f64], black: bool| {
        fields.iter().filter(|grey| is_black(**grey) != black).count() as f64 > MOST_BROKEN * fields.len() as f64
    };
    if wrong(&outline, true) || wrong(&paper, false) {
        return None;
    }
    let bit = |k: usize| u64::from(is_black(grid[(k / bits + border) * side + k % bits + border])) << k;
    let code = (0..bits * bits).map(bit).sum();
    Some(Marker { code, bits, inverted, contrast: (white - black).abs() })
}

/// How a board's markers may be divided; none for a board without.
pub fn fields(board: &Board) -> Vec<Fields> {
    match board.kind {
        Kind::Checker => Vec::new(),
        Kind::Charuco { marker_mm, dictionary, .. } => {
            vec![Fields::of_marker(marker_mm / board.square_mm, dictionary.bits())]
        }
        Kind::Tags { gap_mm, family, .. } => {
            TAG_BORDERS.iter().map(|border| Fields::of_tag(gap_mm / board.square_mm, family.bits(), *border)).collect()
        }
    }
}
