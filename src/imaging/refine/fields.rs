//! Were all rows of a picture taken at one moment? Interlaced video takes the even rows first, then the odd ones.
//!
//! In: a picture and where its corners are. Out: how far its two fields lie apart where the board moved between them;
//! corners measured in such a picture are those of two boards. Method: at each edge a row is compared with the mean of
//! the rows above and below; what they differ by, over the grey value's slope along the row, is a shift. Between fields
//! it alternates from row to row. The same sums with a sign that alternates every two rows hold noise, slanted edges
//! and blur just as well, and no fields. Colours that were interpolated from a mosaic alternate from column to column
//! as they do from row to row, which fields do not. Goes wrong: a motion that is all along the columns shifts nothing
//! along the rows.

use nalgebra::{Matrix3, Point2, Vector2, Vector3};

use crate::imaging::image::{Grey, Image, Picture};
use crate::imaging::lattice::Places;
use crate::widest::widest;

/// Corners whose surroundings are looked at.
const CORNERS: usize = 60;
/// Fewest that tell anything.
const FEWEST: usize = 6;
/// How many times larger than the control a shift is that is none by chance.
const BEYOND_CHANCE: f64 = 4.0;
/// Share of the shifts' squares that is a motion of the whole board. Colours that were interpolated from a mosaic leave
/// shifts between rows too, of either sign from edge to edge.
const COMMON: f64 = 0.5;
/// Share of the squares of the shifts between rows that those between columns are where it is a mosaic.
const ALIKE: f64 = 0.25;
/// Least shift that matters, px. Sensors with two read-out paths have rows of unequal gain, which shifts nothing;
/// colours that a camera interpolates from its mosaic leave up to 0.05 px in pictures of one moment.
const LEAST_SHIFT_PX: f64 = 0.06;
/// Fields nearer to each other than this, px, are one picture: the box of a pixel alone blurs as much, 1/sqrt(12). A
/// corner is then that of the mean of two moments, and as uncertain as half of what lies between them.
pub const ONE_PICTURE_PX: f64 = 0.289;
/// Half of what is looked at round a corner, px and in squares.
const HALF_PX: f64 = 40.0;
const HALF_SQUARES: f64 = 0.45;

/// How far the rows of one field lie from those of the other, px; `None` where they were taken together. `places` are
/// in the picture.
pub fn shift_between_fields(picture: &Picture, places: &Places) -> Option<f64> {
    match &picture.grey {
        Grey::Eight(image) => shift(image, places),
        Grey::Sixteen(image) => shift(image, places),
    }
}

fn shift<T: Copy + Into<i32>>(image: &Image<T>, places: &Places) -> Option<f64> {
    let seen = seen(image, places)?;
    let (fields, control) = (square(&seen, 0), square(&seen, 1));
    let shift_px = (fields / seen.len() as f64).sqrt();
    let moved = shift_px > LEAST_SHIFT_PX && fields > BEYOND_CHANCE.powi(2) * control;
    let is_motion = moved && common_square(&seen) > COMMON * fields;
    (is_motion && between_columns(image, places) < ALIKE * fields / seen.len() as f64).then_some(shift_px)
}

/// Mean square of the shifts between columns, px^2.
fn between_columns<T: Copy + Into<i32>>(image: &Image<T>, places: &Places) -> f64 {
    let turned = Image::from_fn(image.height, image.width, |x, y| image.pixels[x * image.width + y]);
    let turned = seen(&turned, &places.map(|p| Point2::new(p.y, p.x)));
    turned.map_or(0.0, |seen| square(&seen, 0) / seen.len() as f64)
}

/// Sum of the squares of the shifts, or of the controls'.
fn square(seen: &[(Point2<f64>, [f64; 2])], which: usize) -> f64 {
    seen.iter().map(|(_, s)| s[which] * s[which]).sum()
}

/// Places with the shift there and its control, px; `None` where too few tell.
fn seen<T: Copy + Into<i32>>(image: &Image<T>, places: &Places) -> Option<Vec<(Point2<f64>, [f64; 2])>> {
    let half = (HALF_SQUARES * places.step_px()?).min(HALF_PX).ceil();
    let corners: Vec<Point2<f64>> = places.iter().map(|(_, _, p)| *p).collect();
    let every = corners.len().div_ceil(CORNERS).max(1);
    let seen: Vec<(Point2<f64>, [f64; 2])> =
        corners.into_iter().step_by(every).filter_map(|p| Some((p, around(image, &p, half)?))).collect();
    (seen.len() >= FEWEST).then_some(seen)
}

/// What a motion of the whole board, a linear function of the place, makes of the shifts' sum of squares.
fn common_square(seen: &[(Point2<f64>, [f64; 2])]) -> f64 {
    let middle = seen.iter().map(|(p, _)| p.coords).sum::<Vector2<f64>>() / seen.len() as f64;
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (p, shift) in seen {
        let d = p.coords - middle;
        let basis = Vector3::new(1.0, d.x, d.y);
        matrix += basis * basis.transpose();
        right += basis * shift[0];
    }
    // On one line of corners there is no slope across it.
    matrix.cholesky().map_or(right.x * right.x / seen.len() as f64, |cholesky| right.dot(&cholesky.solve(&right)))
}

/// The shift between fields round a corner, px, and the control's; `None` without an edge across the rows.
fn around<T: Copy + Into<i32>>(image: &Image<T>, corner: &Point2<f64>, half: f64) -> Option<[f64; 2]> {
    let range = |at: f64, size: usize| {
        let low = (at - half).max(1.0) as usize;
        low..((at + half).max(0.0) as usize).min(size.saturating_sub(2)).max(low)
    };
    let (columns, rows) = (range(corner.x, image.width), range(corner.y, image.height));
    if columns.is_empty() || rows.is_empty() {
        return None;
    }
    let (mut sums, mut weight) = ([0i64; 2], 0);
    for y in rows {
        let line = |y: usize| &image.pixels[y * image.width..][columns.start - 1..columns.end + 1];
        let [along, square] = widest(
            #[inline(always)]
            || line_sums([line(y - 1), line(y), line(y + 1)]),
        );
        sums[0] += if y % 2 == 0 { along } else { -along };
        sums[1] += if y % 4 < 2 { along } else { -along };
        weight += square;
    }
    // Differences are twice, slopes four times what they are called.
    (weight > 0).then(|| sums.map(|sum| -2.0 * sum as f64 / weight as f64))
}

/// Over a line's pixels: the sum of the slope along the rows times what the line differs by from those above and below,
/// and that of the slope's square. Whole numbers: slopes times four, differences times two.
#[inline(always)]
fn line_sums<T: Copy + Into<i32>>([above, here, below]: [&[T]; 3]) -> [i64; 2] {
    let (mut along, mut square) = (0, 0);
    let at = |line: &'_ [T], i: usize| -> i32 { line[i].into() };
    let length = here.len().min(above.len()).min(below.len());
    for i in 1..length.saturating_sub(1) {
        let slope = at(above, i + 1) - at(above, i - 1) + at(below, i + 1) - at(below, i - 1);
        let differs = 2 * at(here, i) - at(above, i) - at(below, i);
        along += i64::from(slope) * i64::from(differs);
        square += i64::from(slope) * i64::from(slope);
    }
    [along, square]
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;

    use super::*;
    use crate::imaging::lattice::Lattice;

    /// Squares of 30 px, turned, blurred by a linear ramp, with noise; odd rows are taken `shift` px later.
    fn picture(turn: f64, moved: f64) -> (Picture, Places) {
        let (sin, cos) = turn.sin_cos();
        let image = Image::from_fn(300, 300, |col, row| {
            let (x, y) = (col as f64 - if row % 2 == 1 { moved } else { 0.0 } - 150.0, row as f64 - 150.0);
            let saw = |v: f64| ((((v / 30.0).rem_euclid(2.0) - 1.0).abs() - 0.5) * 30.0 / 1.5).clamp(-1.0, 1.0);
            let noise = ((300 * row + col) * 7919 % 13) as f64 / 3.0 - 2.0;
            (120.0 + 80.0 * saw(cos * x + sin * y) * saw(cos * y - sin * x) + noise).round() as u8
        });
        let places = Lattice::from_fn(7, 7, |col, row| {
            let (u, v) = (30.0 * (col as f64 - 3.0) + 15.0, 30.0 * (row as f64 - 3.0) + 15.0);
            Some(Point2::new(150.0 + cos * u - sin * v, 150.0 + sin * u + cos * v))
        });
        (image.into(), places)
    }

    #[test]
    fn fields_of_two_moments_are_seen_and_a_picture_of_one_has_none() {
        for turn in [0.0, 0.1, 0.4, 0.78] {
            for moved in [0.0, 0.1, 0.5, 2.0, 6.0] {
                let (picture, places) = picture(turn, moved);
                assert_eq!(shift_between_fields(&picture, &places).is_some(), moved > 0.0, "{turn} {moved}");
            }
        }
    }

    #[test]
    fn edges_that_alternate_along_rows_and_columns_alike_are_a_mosaics() {
        for zigzag in [0.4, 0.8, 1.5] {
            let (sharp, places) = picture(0.1, 0.0);
            let Grey::Eight(image) = &sharp.grey else { return };
            let at = |x: f64, y: f64| {
                let (i, j) = (x.clamp(0.0, 298.0), y.clamp(0.0, 298.0));
                let (c, r) = (i as usize, j as usize);
                let g = |c: usize, r: usize| f64::from(image.pixels[r * 300 + c]);
                let (u, v) = (i - c as f64, j - r as f64);
                (1.0 - v) * ((1.0 - u) * g(c, r) + u * g(c + 1, r))
                    + v * ((1.0 - u) * g(c, r + 1) + u * g(c + 1, r + 1))
            };
            let by = |n: usize| if n.is_multiple_of(2) { 0.5 * zigzag } else { -0.5 * zigzag };
            let mosaic = Image::from_fn(300, 300, |x, y| at(x as f64 + by(y), y as f64 + by(x)).round() as u8);
            assert_eq!(shift_between_fields(&mosaic.into(), &places), None, "{zigzag}");
        }
    }
}
