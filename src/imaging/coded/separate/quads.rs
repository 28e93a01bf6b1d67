//! Dark shapes of four sides on a light ground: the outlines of tags that nothing dark touches.
//!
//! In: a copy of a picture. Out: the four corners of each, to about half a pixel. Method: a pixel is dark where it is
//! below the middle of what is darkest and lightest round it; dark pixels side by side are a shape; of the convex hull
//! of each the four corners that enclose most are taken, and lines through its outermost pixels are crossed. Goes
//! wrong: a tag that something dark touches, or that is cut off by the picture's border.

use nalgebra::{Point2, Vector2};

use crate::geometry::{convex_hull, turn};
use crate::imaging::image::Grey8;

/// Side of the tiles whose darkest and lightest pixels are looked at, px: with the tiles round it one spans an edge of
/// three of its sides.
const TILE: usize = 4;
/// What of the copy's own range a tile's surroundings must span to hold an edge, and how much at the least, grey
/// values.
const LEAST_SPAN: f64 = 0.15;
const LEAST_GREY: f64 = 10.0;
/// Least side of a shape, px: fewer hold no bits.
const LEAST_SIDE_PX: usize = 8;
/// What four corners must enclose of a shape's convex hull. A triangle's hull or a disc's leaves more of it outside.
const LEAST_FILLED: f64 = 0.85;
/// How far from a side outermost pixels count for its line, px and in sides, and what of its ends they leave out.
const NEAR_PX: f64 = 1.5;
const NEAR_SIDES: f64 = 0.06;
const ENDS: f64 = 0.12;

/// The corners of a shape, clockwise as it is seen.
pub type Quad = [Point2<f64>; 4];

/// All dark shapes of four sides on a copy.
pub fn quads(copy: &Grey8) -> Vec<Quad> {
    let smooth = smoothed(copy);
    let dark = dark(&smooth);
    let is_large = |shape: &Shape| shape.width.min(shape.height) >= LEAST_SIDE_PX;
    shapes(&dark, copy.width).into_iter().filter(is_large).filter_map(|shape| quad(&shape)).collect()
}

/// Means of three by three pixels, so that noise is no shape.
fn smoothed(copy: &Grey8) -> Grey8 {
    let (w, h) = (copy.width, copy.height);
    let mean = |x: usize, y: usize| {
        let (xs, ys) = (x.saturating_sub(1)..(x + 2).min(w), y.saturating_sub(1)..(y + 2).min(h));
        let count = (xs.len() * ys.len()) as u32;
        let sum: u32 = ys.flat_map(|y| &copy.pixels[y * w..][xs.clone()]).map(|&v| u32::from(v)).sum();
        ((sum + count / 2) / count) as u8
    };
    Grey8 { width: w, height: h, pixels: (0..w * h).map(|k| mean(k % w, k / w)).collect() }
}

/// Which pixels are dark for what is round them.
fn dark(copy: &Grey8) -> Vec<bool> {
    let (w, h) = (copy.width, copy.height);
    let (across, along) = (w.div_ceil(TILE), h.div_ceil(TILE));
    let mut tiles = vec![(u8::MAX, u8::MIN); across * along];
    for (k, &value) in copy.pixels.iter().enumerate() {
        let tile = &mut tiles[k / w / TILE * across + k % w / TILE];
        *tile = (tile.0.min(value), tile.1.max(value));
    }
    let mut greys: Vec<u8> = tiles.iter().flat_map(|tile| [tile.0, tile.1]).collect();
    greys.sort_unstable();
    let range = greys.last().zip(greys.first()).map_or(0.0, |(high, low)| f64::from(high - low));
    let least = (LEAST_SPAN * range).max(LEAST_GREY);
    let round = |k: usize| {
        let (x, y) = (k % across, k / across);
        let (xs, ys) = (x.saturating_sub(1)..(x + 2).min(across), y.saturating_sub(1)..(y + 2).min(along));
        let all = ys.flat_map(|y| &tiles[y * across..][xs.clone()]);
        let (low, high) = all.fold((u8::MAX, u8::MIN), |(low, high), tile| (low.min(tile.0), high.max(tile.1)));
        (f64::from(high) - f64::from(low) >= least).then_some((u16::from(low) + u16::from(high)).div_ceil(2))
    };
    let middles: Vec<Option<u16>> = (0..tiles.len()).map(round).collect();
    let is_dark =
        |(k, value): (usize, &u8)| middles[k / w / TILE * across + k % w / TILE].is_some_and(|m| u16::from(*value) < m);
    copy.pixels.iter().enumerate().map(is_dark).collect()
}

/// The outermost pixels of a shape: the first and the last in each of its rows and columns.
struct Shape {
    points: Vec<Point2<f64>>,
    width: usize,
    height: usize,
}

impl Shape {
    /// Of pixels `(x, y)`; `None` of those that reach a border of a copy of such a size.
    fn of(pixels: &[(usize, usize)], (width, height): (usize, usize)) -> Option<Shape> {
        let range =
            |of: &dyn Fn(&(usize, usize)) -> usize| Some((pixels.iter().map(of).min()?, pixels.iter().map(of).max()?));
        let ((left, right), (top, bottom)) = (range(&|p| p.0)?, range(&|p| p.1)?);
        if left == 0 || top == 0 || right + 1 == width || bottom + 1 == height {
            return None;
        }
        let (wide, high) = (right + 1 - left, bottom + 1 - top);
        let (mut rows, mut columns) = (vec![(usize::MAX, 0); high], vec![(usize::MAX, 0); wide]);
        for &(x, y) in pixels {
            let (row, column) = (&mut rows[y - top], &mut columns[x - left]);
            *row = (row.0.min(x), row.1.max(x));
            *column = (column.0.min(y), column.1.max(y));
        }
        let at = |x: usize, y: usize| Point2::new(x as f64, y as f64);
        let in_rows = (top..).zip(rows).flat_map(|(y, (first, last))| [at(first, y), at(last, y)]);
        let in_columns = (left..).zip(columns).flat_map(|(x, (first, last))| [at(x, first), at(x, last)]);
        Some(Shape { points: in_rows.chain(in_columns).collect(), width: wide, height: high })
    }
}

/// The shapes that dark pixels make side by side.
fn shapes(dark: &[bool], width: usize) -> Vec<Shape> {
    let height = dark.len() / width.max(1);
    let mut seen = vec![false; dark.len()];
    let (mut shapes, mut open, mut pixels) = (Vec::new(), Vec::new(), Vec::new());
    for start in (0..dark.len()).filter(|at| dark[*at]) {
        let mut reach = |at: usize, open: &mut Vec<usize>| {
            if dark[at] && !std::mem::replace(&mut seen[at], true) {
                open.push(at);
            }
        };
        reach(start, &mut open);
        while let Some(at) = open.pop() {
            let (x, y) = (at % width, at / width);
            pixels.push((x, y));
            let around = [(x > 0).then(|| at - 1), (x + 1 < width).then_some(at + 1)];
            let beside = [(y > 0).then(|| at - width), (y + 1 < height).then_some(at + width)];
            around.into_iter().chain(beside).flatten().for_each(|next| reach(next, &mut open));
        }
        if pixels.len() >= LEAST_SIDE_PX {
            shapes.extend(Shape::of(&pixels, (width, height)));
        }
        pixels.clear();
    }
    shapes
}

fn area(outline: &[Point2<f64>]) -> f64 {
    let next = outline.iter().cycle().skip(1);
    0.5 * outline.iter().zip(next).map(|(a, b)| a.coords.perp(&b.coords)).sum::<f64>()
}

/// The four corners of a shape; `None` where it has others.
fn quad(shape: &Shape) -> Option<Quad> {
    let points = &shape.points;
    let hull = convex_hull(points.clone());
    let rough = corners_of(&hull)?;
    let filled = area(&rough) / area(&hull);
    if filled.is_nan() || filled < LEAST_FILLED {
        return None;
    }
    let lines = [0, 1, 2, 3].map(|k| side(points, &rough[k], &rough[(k + 1) % 4]));
    let [Some(a), Some(b), Some(c), Some(d)] = lines else { return None };
    let crossing = |first: (Point2<f64>, Vector2<f64>), second: (Point2<f64>, Vector2<f64>)| {
        let along = (second.0 - first.0).perp(&second.1) / first.1.perp(&second.1);
        first.0 + first.1 * along
    };
    let corners = [crossing(d, a), crossing(a, b), crossing(b, c), crossing(c, d)];
    let is_near = |k: usize| (corners[k] - rough[k]).norm() < 0.25 * (rough[k] - rough[(k + 2) % 4]).norm();
    ((0..4).all(is_near) && area(&corners) > 0.0).then_some(corners)
}

/// The corners of a hull that enclose most of it: the one that is farthest from its middle, the one farthest from that,
/// and on either side of both the one farthest from their line; then each again as far as the others allow.
fn corners_of(hull: &[Point2<f64>]) -> Option<Quad> {
    let middle = Point2::from(hull.iter().map(|p| p.coords).sum::<Vector2<f64>>() / hull.len() as f64);
    let farthest = |of: &dyn Fn(&Point2<f64>) -> f64| hull.iter().max_by(|a, b| of(a).total_cmp(&of(b))).copied();
    let a = farthest(&|p| (p - middle).norm())?;
    let c = farthest(&|p| (p - a).norm())?;
    let [b, d] = [farthest(&|p| turn(&a, p, &c).max(-1.0))?, farthest(&|p| -turn(&a, p, &c))?];
    // Seen with y down a clockwise outline has a positive area.
    let mut corners = if area(&[a, b, c, d]) > 0.0 { [a, b, c, d] } else { [a, d, c, b] };
    for k in [0, 2, 1, 3, 0, 2] {
        let (before, after) = (corners[(k + 3) % 4], corners[(k + 1) % 4]);
        corners[k] = farthest(&|p| turn(&before, p, &after))?;
    }
    (area(&corners) > 0.0).then_some(corners)
}

/// The line through the outermost pixels beside a side, half a pixel beyond them, as a place and a direction.
fn side(points: &[Point2<f64>], from: &Point2<f64>, to: &Point2<f64>) -> Option<(Point2<f64>, Vector2<f64>)> {
    let length = (to - from).norm();
    let along = (to - from) / length;
    // Outwards of a clockwise outline.
    let out = Vector2::new(along.y, -along.x);
    let near = NEAR_PX.max(NEAR_SIDES * length);
    let place = |p: &&Point2<f64>| {
        let share = along.dot(&(*p - from)) / length;
        (ENDS..=1.0 - ENDS).contains(&share) && out.dot(&(*p - from)).abs() <= near
    };
    let beside: Vec<&Point2<f64>> = points.iter().filter(place).collect();
    let count = beside.len() as f64;
    if beside.len() < 3 {
        return Some((from + out * 0.5, along));
    }
    let middle = beside.iter().map(|p| p.coords).sum::<Vector2<f64>>() / count;
    let (mut square, mut across) = (0.0, 0.0);
    for p in beside {
        let d = p.coords - middle;
        square += along.dot(&d).powi(2);
        across += along.dot(&d) * out.dot(&d);
    }
    let direction = if square > 0.0 { along + out * (across / square) } else { along };
    Some((Point2::from(middle) + out * 0.5, direction))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::image::Image;

    /// A square of 40 px, turned, dark with light inside, blurred by a ramp.
    fn square(turn: f64, inside: f64) -> Grey8 {
        let (sin, cos) = turn.sin_cos();
        Image::from_fn(120, 100, |x, y| {
            let (x, y) = (x as f64 - 57.3, y as f64 - 48.6);
            let out = (cos * x + sin * y).abs().max((cos * y - sin * x).abs());
            let ramp = |at: f64| ((out - at) / 2.0).clamp(-0.5, 0.5) + 0.5;
            (40.0 + 160.0 * (ramp(20.0) + (1.0 - ramp(inside)))).clamp(0.0, 255.0) as u8
        })
    }

    #[test]
    fn a_dark_square_is_found_to_half_a_pixel_however_it_is_turned() {
        for k in 0..12 {
            let turn = 0.13 * f64::from(k);
            let found = quads(&square(turn, 12.0));
            assert_eq!(found.len(), 1, "{turn}");
            let (sin, cos) = turn.sin_cos();
            for (u, v) in [(-20.0, -20.0), (20.0, -20.0), (20.0, 20.0), (-20.0, 20.0)] {
                let at = Point2::new(57.3 + cos * u - sin * v, 48.6 + sin * u + cos * v);
                let off = found[0].iter().map(|p| (p - at).norm()).fold(f64::INFINITY, f64::min);
                assert!(off < 0.9, "{turn}: {off}");
            }
            assert!(area(&found[0]) > 0.0);
        }
    }

    #[test]
    fn discs_and_shapes_that_are_cut_are_none() {
        let disc: Grey8 =
            Image::from_fn(80, 80, |x, y| if (x as f64 - 40.0).hypot(y as f64 - 40.0) < 20.0 { 30 } else { 220 });
        assert_eq!(quads(&disc), Vec::<Quad>::new());
        let cut: Grey8 = Image::from_fn(80, 80, |x, y| if x < 30 && (20..60).contains(&y) { 30 } else { 220 });
        assert_eq!(quads(&cut), Vec::<Quad>::new());
    }
}
