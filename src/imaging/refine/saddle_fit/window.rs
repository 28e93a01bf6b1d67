//! The pixels that one corner is fitted to, sorted by what they can tell.
//!
//! A window is a parallelogram along the corner's two edges. Pixels near both edges, at the crossing, see all of the
//! model; those near one edge alone, on an arm of the cross, see that edge; those away from both see only the two grey
//! levels and the light, and enter as sums. Saturated pixels, and what else is not to be kept, are left out.

use std::ops::Range;

use nalgebra::{Matrix2, Matrix4, Point2, Vector2, Vector4};

use crate::imaging::image::Image;
use crate::widest::widest;

/// Pixels that are worked on side by side: enough that the compiler makes vector loops of them.
pub const LANES: usize = 32;

/// About so many rows of a window give pixels away from both edges, all where it has less than twice as many: in a
/// large window they are so many that what they tell, two levels and the light's slope, is known far better than the
/// corner. The step from one to the next is odd, so that both fields of an interlaced picture are seen.
const FLAT_ROWS: usize = 100;

/// A number for each pixel of a group. Of seven digits, so that twice as many fit side by side: what rounding adds to a
/// residual is a hundred-thousandth of the contrast, far less than any camera's noise; sums are of sixteen.
pub type Lanes = [f32; LANES];

/// A few pixels side by side, places relative to the window's start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Group {
    /// x - x0, px.
    pub x: Lanes,
    /// y - y0, px.
    pub y: Lanes,
    pub grey: Lanes,
    /// One for a pixel, zero for none: the last group is filled up.
    pub weight: Lanes,
}

/// A grey value as the camera gave it.
pub trait Sample: Copy + Into<f64> + Into<u32> {}

impl Sample for u8 {}
impl Sample for u16 {}

/// Any number of pixels in groups.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Groups {
    pub groups: Vec<Group>,
    /// Number of pixels.
    pub count: usize,
}

/// The pixels of a window.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Window {
    /// Near both edges.
    pub crossing: Groups,
    /// Near edge `k` alone, on the side of the other edge where its normal's product is negative, then where it is
    /// positive.
    pub arms: [[Groups; 2]; 2],
    /// Away from both edges, where the product of both normals' products is negative, then where it is positive: the
    /// sums of all products of `(1, x, y, grey)`. Of a corner with one dark quadrant that one alone, and all that is
    /// light.
    pub flat: [Matrix4<f64>; 2],
    /// Number of pixels that were not kept.
    pub left_out: usize,
    /// Whether something is hidden in it.
    pub hides: bool,
}

/// Where a window lies and what is near.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// Its middle, px; places in the window are relative to it.
    pub start: Point2<f64>,
    /// From the middle to the middles of two sides, along the two edges, px.
    pub halves: [Vector2<f64>; 2],
    /// Distance from an edge up to which pixels see it, px.
    pub band_px: f64,
    /// What is printed in two of the squares and is none of the corner's: pixels in it are no part of the window.
    pub hidden: [Option<Quad>; 2],
    /// The signs of both edges' normals' products where the only dark quadrant is: elsewhere nothing is seen of the
    /// edges but at their crossing.
    pub dark: Option<[f64; 2]>,
}

/// A convex shape of four corners in order round it, relative to the middle of a window, px.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quad(pub [Vector2<f64>; 4]);

impl Quad {
    /// The places of a row of pixels in it, from the least to the greatest x; `None` where the row passes it by.
    #[inline(always)]
    fn interval(&self, dy: f64) -> Option<(f64, f64)> {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for k in 0..4 {
            let (a, b) = (self.0[k], self.0[(k + 1) % 4]);
            if (a.y <= dy) != (b.y <= dy) {
                let x = a.x + (dy - a.y) / (b.y - a.y) * (b.x - a.x);
                (low, high) = (low.min(x), high.max(x));
            }
        }
        (low <= high).then_some((low, high))
    }
}

/// Which pixels a window takes.
pub trait Keep {
    /// Whether it takes a pixel at a place relative to the window's start.
    fn keeps(&self, x: f64, y: f64, grey: f64) -> bool;

    /// True where it takes every pixel up to this grey value, wherever it is: then nobody needs to ask for each.
    fn keeps_up_to(&self, _highest: f64) -> bool {
        false
    }
}

/// Takes every pixel below a level.
pub struct Below(pub f64);

impl Keep for Below {
    #[inline(always)]
    fn keeps(&self, _: f64, _: f64, grey: f64) -> bool {
        grey < self.0
    }

    #[inline(always)]
    fn keeps_up_to(&self, highest: f64) -> bool {
        highest < self.0
    }
}

impl Groups {
    #[inline]
    pub fn push(&mut self, x: f32, y: f32, grey: f32) {
        let lane = self.count % LANES;
        if lane == 0 {
            let zero = [0.0; LANES];
            self.groups.push(Group { x: zero, y: zero, grey: zero, weight: zero });
        }
        if let Some(group) = self.groups.last_mut() {
            (group.x[lane], group.y[lane], group.grey[lane], group.weight[lane]) = (x, y, grey, 1.0);
        }
        self.count += 1;
    }

    fn clear(&mut self) {
        self.groups.clear();
        self.count = 0;
    }
}

impl Window {
    /// Number of pixels that see an edge.
    pub fn near(&self) -> usize {
        self.crossing.count + self.arms.iter().flatten().map(|arm| arm.count).sum::<usize>()
    }

    /// Number of pixels.
    pub fn count(&self) -> usize {
        self.near() + self.flat.iter().map(|sums| sums[(0, 0)] as usize).sum::<usize>()
    }

    /// Fills the window anew with the pixels that are to be kept, as grey values above a whole number `veil`. Nothing
    /// is in a window without area.
    pub fn collect<T: Sample>(&mut self, image: &Image<T>, veil: f64, keep: &impl Keep, frame: &Frame) {
        widest(
            #[inline(always)]
            || self.sort_in(image, veil, keep, frame),
        );
    }

    #[inline(always)]
    fn sort_in<T: Sample>(&mut self, image: &Image<T>, veil: f64, keep: &impl Keep, frame: &Frame) {
        self.crossing.clear();
        self.arms.iter_mut().flatten().for_each(Groups::clear);
        (self.flat, self.left_out) = ([Matrix4::zeros(); 2], 0);
        self.hides = frame.hidden != [None; 2];
        let Some(cut) = Cut::new(frame) else { return };
        let Image { width, height, pixels } = image;
        let (width, height) = (*width, *height);
        let rows = whole(cut.start.y - cut.reach, cut.start.y + cut.reach, height);
        let step = (rows.len() / FLAT_ROWS) | 1;
        for y in rows {
            let dy = y as f64 - cut.start.y;
            let row = &pixels[y * width..(y + 1) * width];
            let inside = cut.columns(&cut.inside, dy, width);
            let near = cut.bands.map(|band| cut.columns(&[band], dy, width));
            let hidden = frame.hidden.map(|quad| {
                let interval = quad.and_then(|quad| quad.interval(dy));
                interval.map_or(0..0, |(low, high)| whole(cut.start.x + low, cut.start.x + high, width))
            });
            // Each of these is where one run of equal pixels ends and the next begins.
            let mut ends = [&inside, &near[0], &near[1], &hidden[0], &hidden[1]].map(|of| [of.start, of.end]);
            let ends = ends.as_flattened_mut();
            ends.iter_mut().for_each(|end| *end = (*end).clamp(inside.start, inside.end.max(inside.start)));
            ends.sort_unstable();
            for run in ends.windows(2).map(|ends| ends[0]..ends[1]).filter(|run| !run.is_empty()) {
                if hidden.iter().any(|hidden| hidden.contains(&run.start)) {
                    continue;
                }
                let dx = run.start as f64 - cut.start.x;
                let side = cut.bands.map(|band| usize::from(band.at(dx, dy) > 0.0));
                let by_edge = [0, 1].map(|k| near[k].contains(&run.start));
                let groups = match by_edge {
                    [true, true] => &mut self.crossing,
                    [true, false] if cut.has_edge(side, 1) => &mut self.arms[0][side[1]],
                    [false, true] if cut.has_edge(side, 0) => &mut self.arms[1][side[0]],
                    _ if y.is_multiple_of(step) => {
                        let alike = cut.alike(side, by_edge);
                        self.left_out += add(&mut self.flat[alike], &row[run], (veil, keep), (dx, dy));
                        continue;
                    }
                    _ => continue,
                };
                self.left_out += push(groups, &row[run], (veil, keep), (dx, dy));
            }
        }
    }
}

/// Adds a run of pixels one by one; `from` is the first one's place. Returns how many were not kept.
#[inline(always)]
fn push<T: Sample>(to: &mut Groups, values: &[T], (veil, keep): (f64, &impl Keep), from: (f64, f64)) -> usize {
    let mut left_out = 0;
    for (i, &value) in values.iter().enumerate() {
        let value: f64 = value.into();
        let (x, grey) = (from.0 + i as f64, value - veil);
        if keep.keeps(x, from.1, grey) {
            to.push(x as f32, from.1 as f32, grey as f32);
        } else {
            left_out += 1;
        }
    }
    left_out
}

/// Sums of a run that are kept side by side, so that the compiler makes vector loops of them.
const SIDE_BY_SIDE: usize = 16;

/// Adds a run of pixels to the sums of products of `(1, x, y, grey)`; `from` is the first one's place. Returns how
/// many were not kept.
#[inline(always)]
fn add<T: Sample>(to: &mut Matrix4<f64>, values: &[T], (veil, keep): (f64, &impl Keep), from: (f64, f64)) -> usize {
    let [n, x, xx, g, xg, gg] = if keep.keeps_up_to(highest(values) - veil) {
        run_sums(values, veil)
    } else {
        let mut sums = [0.0; 6];
        for (i, &value) in values.iter().enumerate() {
            let value: f64 = value.into();
            let (i, grey) = (i as f64, value - veil);
            if keep.keeps(from.0 + i, from.1, grey) {
                for (sum, term) in sums.iter_mut().zip([1.0, i, i * i, grey, i * grey, grey * grey]) {
                    *sum += term;
                }
            }
        }
        sums
    };
    let (x0, y) = from;
    let sum_x = x + n * x0;
    let sum_xx = xx + 2.0 * x0 * x + n * x0 * x0;
    let sum_xg = xg + x0 * g;
    *to += Matrix4::from_columns(&[
        Vector4::new(n, sum_x, n * y, g),
        Vector4::new(sum_x, sum_xx, sum_x * y, sum_xg),
        Vector4::new(n * y, sum_x * y, n * y * y, g * y),
        Vector4::new(g, sum_xg, g * y, gg),
    ]);
    values.len() - n as usize
}

/// The highest grey value of a run.
#[inline(always)]
fn highest<T: Sample>(values: &[T]) -> f64 {
    let mut highest = 0;
    for &value in values {
        let value: u32 = value.into();
        highest = value.max(highest);
    }
    f64::from(highest)
}

/// Number, sums of x, x^2, grey, x grey and grey^2 of pixels side by side, the first at x = 0. Whole numbers, hence
/// exact; the veil is taken off at the end.
#[inline(always)]
fn run_sums<T: Sample>(values: &[T], veil: f64) -> [f64; 6] {
    let (mut g, mut xg, mut gg) = ([0u64; SIDE_BY_SIDE], [0u64; SIDE_BY_SIDE], [0u64; SIDE_BY_SIDE]);
    let mut at: [u32; SIDE_BY_SIDE] = std::array::from_fn(|l| l as u32);
    let mut blocks = values.chunks_exact(SIDE_BY_SIDE);
    for block in &mut blocks {
        for l in 0..SIDE_BY_SIDE {
            let value: u32 = block[l].into();
            g[l] += u64::from(value);
            xg[l] += u64::from(at[l]) * u64::from(value);
            gg[l] += u64::from(value) * u64::from(value);
            at[l] += SIDE_BY_SIDE as u32;
        }
    }
    for (l, &value) in blocks.remainder().iter().enumerate() {
        let value: u32 = value.into();
        g[l] += u64::from(value);
        xg[l] += u64::from(at[l]) * u64::from(value);
        gg[l] += u64::from(value) * u64::from(value);
    }
    let total = |sums: [u64; SIDE_BY_SIDE]| sums.iter().sum::<u64>() as f64;
    let (n, g, xg, gg) = (values.len() as f64, total(g), total(xg), total(gg));
    let (x, xx) = (n * (n - 1.0) / 2.0, n * (n - 1.0) * (2.0 * n - 1.0) / 6.0);
    [n, x, xx, g - n * veil, xg - x * veil, gg - (2.0 * g - n * veil) * veil]
}

/// The whole numbers from `low` to `high` that are at least zero and below `size`.
fn whole(low: f64, high: f64, size: usize) -> Range<usize> {
    let start = low.ceil().max(0.0) as usize;
    let end = ((high.floor() + 1.0).max(0.0) as usize).min(size);
    start.min(end)..end
}

/// Places `d` with `|across . d| <= limit`.
#[derive(Clone, Copy)]
struct Strip {
    across: Vector2<f64>,
    limit: f64,
}

impl Strip {
    fn at(&self, dx: f64, dy: f64) -> f64 {
        self.across.x * dx + self.across.y * dy
    }

    /// The values of dx in a row.
    fn interval(&self, dy: f64) -> (f64, f64) {
        let offset = self.across.y * dy;
        if self.across.x.abs() < 1e-12 {
            return if offset.abs() <= self.limit { (f64::NEG_INFINITY, f64::INFINITY) } else { (0.0, -1.0) };
        }
        let (a, b) = ((-self.limit - offset) / self.across.x, (self.limit - offset) / self.across.x);
        (a.min(b), a.max(b))
    }
}

/// A frame as strips.
struct Cut {
    start: Point2<f64>,
    /// Rows farther than this from the start are outside, px.
    reach: f64,
    inside: [Strip; 2],
    bands: [Strip; 2],
    /// On which sides of both edges the only dark quadrant is, one for the positive one.
    dark: Option<[usize; 2]>,
}

impl Cut {
    fn new(frame: &Frame) -> Option<Cut> {
        let [a, b] = frame.halves;
        let inverse = Matrix2::from_columns(&[a, b]).try_inverse()?;
        let inside = [0, 1].map(|k| Strip { across: inverse.row(k).transpose(), limit: 1.0 });
        let bands = [a, b].map(|v| Strip { across: Vector2::new(-v.y, v.x).normalize(), limit: frame.band_px });
        let dark = frame.dark.map(|sides| sides.map(|side| usize::from(side > 0.0)));
        Some(Cut { start: frame.start, reach: a.y.abs() + b.y.abs(), inside, bands, dark })
    }

    /// Whether there is an edge along one of the lines, on this side of the other, `across`.
    fn has_edge(&self, side: [usize; 2], across: usize) -> bool {
        self.dark.is_none_or(|dark| dark[across] == side[across])
    }

    /// Which of the flats pixels on such sides of both edges belong to that see none, near whose lines they may be all
    /// the same.
    fn alike(&self, side: [usize; 2], near: [bool; 2]) -> usize {
        match self.dark {
            Some(dark) if near != [false; 2] || dark != side => usize::from(dark[0] != dark[1]),
            _ => usize::from(side[0] == side[1]),
        }
    }

    /// The columns of a row that are in all strips.
    fn columns(&self, strips: &[Strip], dy: f64, width: usize) -> Range<usize> {
        let (low, high) = strips.iter().fold((f64::NEG_INFINITY, f64::INFINITY), |(low, high), strip| {
            let (a, b) = strip.interval(dy);
            (low.max(a), high.min(b))
        });
        whole(self.start.x + low, self.start.x + high, width)
    }
}

#[cfg(test)]
mod tests;
