//! A board put together corner by corner, where no detector sees the whole of it: partly hidden, cut off, or of another
//! size.
//!
//! In: a small grey picture. Out: the largest grid of checkerboard corners in it, whatever its size, with holes where
//! corners are missing. Method: from a candidate and its nearest neighbours of the opposite colouring the grid grows by
//! predicting each next place from the steps before it. Between neighbours there must be an edge, bright on the side on
//! which it is bright at both ends: that keeps clutter out.

use std::collections::{BTreeMap, VecDeque};
use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Point2, Vector2};

use super::saddles::{Candidate, candidates, tiles};
use crate::imaging::board::Pitch;
use crate::imaging::image::Grey8;
use crate::imaging::lattice::{Lattice, Places};

/// Seeds from which a grid is tried, and where one of enough corners is known, altogether and for two tiles: each tile
/// gives its strongest first, and a grid that is larger still has corners in several of them.
const MOST_SEEDS: usize = 600;
const SEEDS_BESIDE_ENOUGH: usize = 300;
const SEEDS_FOR_TWO_TILES: usize = 3;
/// How far from its predicted place a corner may be, in steps of the grid.
const STRAY: f64 = 0.3;
/// How many times weaker than its neighbour a corner may respond; where squares end at the board's margin it is far
/// more.
const WEAKER: i16 = 4;
/// What of the contrast at its ends an edge shows at least, along each of its halves.
const EDGE_CONTRAST: f64 = 0.25;
/// Length of the ways along an edge that are looked at, as a share of it.
const ALONG: f64 = 0.4;
/// How far from an edge both squares are looked at, as a share of such a way: where they certainly are, even on an
/// oblique board.
const ASIDE: f64 = 0.4;
/// How near to an edge its squares are looked at at least, px: nearer, they blur into each other.
const NEAREST_PX: f64 = 1.0;
/// How far the bright axes of neighbours may be from perpendicular, rad.
const SLANT: f64 = 0.6;

/// The largest grid of corners in the picture; `None` where there is none of at least 3 x 3. Once one has `enough`
/// corners, others are looked for less thoroughly.
pub fn largest_grid(picture: &Grey8, enough: usize) -> Option<Places> {
    let candidates = candidates(picture);
    let near = Near::new(picture, &candidates);
    let mut taken = vec![false; candidates.len()];
    let mut best: Vec<(Place, usize)> = Vec::new();
    let beside_enough = SEEDS_BESIDE_ENOUGH.min(SEEDS_FOR_TWO_TILES * tiles(picture) / 2);
    let mut seeds = 0;
    for first in 0..candidates.len() {
        if taken[first] {
            continue;
        }
        if seeds == if best.len() < enough { MOST_SEEDS } else { beside_enough } {
            break;
        }
        seeds += 1;
        let grown = near.grow(Pitch::Even, first, longest_step(picture, best.len()));
        if grown.len() >= 9 {
            grown.iter().for_each(|&(_, i)| taken[i] = true);
        }
        if grown.len() > best.len() {
            best = grown;
        }
        // What is left is less than what was found.
        if best.len() > candidates.len() / 2 {
            break;
        }
    }
    as_grid(&best, &candidates, Pitch::Even).filter(|grid| grid.columns >= 3 && grid.rows >= 3)
}

/// All grids of four corners and more in a picture of a board with markers, the largest first: parts of a board that
/// something divides. Edges are looked at within the `margin` round a marker, a share of a square; of `foreshortened`
/// squares nearer to the edge too, as a marker comes near to their long edges. A grid of tags begins with one both ways
/// and ends with one.
pub fn grids(picture: &Grey8, pitch: Pitch, margin: f64, foreshortened: bool) -> Vec<Places> {
    /// A square with a marker in it.
    const FEWEST: usize = 4;
    let candidates = candidates(picture);
    let near = Near { aside: margin / 2.0 / ALONG, foreshortened, ..Near::new(picture, &candidates) };
    let mut taken = vec![false; candidates.len()];
    let mut found: Vec<Vec<(Place, usize)>> = Vec::new();
    let mut seeds = 0;
    for first in 0..candidates.len() {
        if taken[first] {
            continue;
        }
        if seeds == MOST_SEEDS {
            break;
        }
        seeds += 1;
        let grown = near.grow(pitch, first, longest_step(picture, 1));
        if grown.len() >= FEWEST {
            grown.iter().for_each(|&(_, i)| taken[i] = true);
            found.push(grown);
        }
    }
    // Stable: equal ones stay in the order of their seeds.
    found.sort_by_key(|grown| std::cmp::Reverse(grown.len()));
    let grids = found.iter().filter_map(|grown| as_grid(grown, &candidates, pitch));
    grids.filter(|grid| grid.columns >= 2 && grid.rows >= 2).collect()
}

/// Candidates by cells of the picture.
struct Near<'a> {
    picture: &'a Grey8,
    candidates: &'a [Candidate],
    /// Where the squares beside an edge are looked at, as a share of the way along it.
    aside: f64,
    /// Whether they are looked at nearer to the edge too.
    foreshortened: bool,
    /// Cells in a row.
    columns: usize,
    /// Row by row; each candidate with its place, which is all that most questions are about.
    cells: Vec<Vec<(Point2<f64>, usize)>>,
}

/// Side of a cell, px.
const CELL: f64 = 32.0;

impl<'a> Near<'a> {
    fn new(picture: &'a Grey8, candidates: &'a [Candidate]) -> Near<'a> {
        let cells_of = |size: usize| cell_of(size as f64, usize::MAX) + 1;
        let (columns, rows) = (cells_of(picture.width), cells_of(picture.height));
        let cells = vec![Vec::new(); columns * rows];
        let mut near = Near { picture, candidates, aside: ASIDE, foreshortened: false, columns, cells };
        for (i, c) in candidates.iter().enumerate() {
            let [x, y] = near.cell(&c.at);
            near.cells[y * columns + x].push((c.at, i));
        }
        near
    }

    /// Column and row of a place's cell, of the nearest one for a place beyond the picture.
    fn cell(&self, p: &Point2<f64>) -> [usize; 2] {
        [cell_of(p.x, self.columns - 1), cell_of(p.y, self.cells.len() / self.columns - 1)]
    }

    /// Candidates in question within a distance, with theirs, the nearest first.
    fn within(&self, at: &Point2<f64>, distance: f64, asked: impl Fn(f64, usize) -> bool) -> Vec<(f64, usize)> {
        let ([left, top], [right, bottom]) =
            (self.cell(&(at - Vector2::repeat(distance))), self.cell(&(at + Vector2::repeat(distance))));
        let mut found: Vec<(f64, usize)> = Vec::new();
        for y in top..=bottom {
            for &(place, i) in self.cells[y * self.columns + left..=y * self.columns + right].iter().flatten() {
                let square = (place - at).norm_squared();
                if square <= distance * distance && asked(square.sqrt(), i) {
                    found.push((square.sqrt(), i));
                }
            }
        }
        found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found
    }

    /// True where two candidates are the ends of a square's edge: their colours are those of neighbours, and along both
    /// halves of the way from one to the other it is bright on the side on which it is bright at the ends.
    fn edge(&self, a: usize, b: usize) -> bool {
        self.ends(a, b) && self.shows_edge(a, b)
    }

    /// True where two candidates by themselves could be neighbours: about as strong, and coloured as such.
    fn ends(&self, a: usize, b: usize) -> bool {
        let (a, b) = (&self.candidates[a], &self.candidates[b]);
        a.strength.max(b.strength) / WEAKER <= a.strength.min(b.strength) && opposite(a, b)
    }

    /// True where the picture between two such candidates is that along an edge.
    fn shows_edge(&self, a: usize, b: usize) -> bool {
        let (a, b) = (&self.candidates[a], &self.candidates[b]);
        let step = b.at - a.at;
        let bright_left = (a.axis - step.y.atan2(step.x)).rem_euclid(PI) < FRAC_PI_2;
        let sign = if bright_left { 1.0 } else { -1.0 };
        let least = EDGE_CONTRAST * a.contrast.max(b.contrast);
        let shows = |aside: f64| {
            [0.1, 0.5].into_iter().all(|from| sign * self.across(a.at + step * from, step * ALONG, aside) > least)
        };
        let nearer = |aside: &f64| self.foreshortened && aside * ALONG * step.norm() > 2.0 * NEAREST_PX;
        std::iter::successors(Some(self.aside), |aside| Some(aside / 2.0).filter(|_| nearer(aside))).any(shows)
    }

    /// Mean grey on the left of a way less that on its right, so far from it.
    fn across(&self, from: Point2<f64>, way: Vector2<f64>, aside: f64) -> f64 {
        let aside = Vector2::new(-way.y, way.x) * aside;
        let samples = (way.norm().ceil() as usize).clamp(2, 32);
        let step = way / samples as f64;
        let sums = [from + aside, from - aside].map(|from| self.sum(from + 0.5 * step, step, samples));
        f64::from(sums[0] - sums[1]) / samples as f64
    }

    /// Sum of the grey values of pixels along a line, those of the border for places beyond it.
    fn sum(&self, from: Point2<f64>, step: Vector2<f64>, samples: usize) -> i32 {
        let Grey8 { width, height, pixels } = self.picture;
        // In units of 2^-16 px, the nearest pixel being the whole part.
        let fixed = |v: f64| ((v + 0.5) * 65_536.0) as i64;
        let (mut x, mut y) = (fixed(from.x), fixed(from.y));
        let (by_x, by_y) = ((step.x * 65_536.0) as i64, (step.y * 65_536.0) as i64);
        let inside = |v: i64, size: usize| (v >> 16).clamp(0, size as i64 - 1) as usize;
        let mut sum = 0;
        for _ in 0..samples {
            sum += i32::from(pixels[inside(y, *height) * width + inside(x, *width)]);
            (x, y) = (x + by_x, y + by_y);
        }
        sum
    }

    /// A grid from one candidate on: places with the candidate there. No neighbour of the first one is farther than
    /// `longest`, px. The nearest neighbours of a tag's corner are those beyond the gap: lines are numbered so that one
    /// before the first begins a tag.
    fn grow(&self, pitch: Pitch, first: usize, longest: f64) -> Vec<(Place, usize)> {
        let Some(seed_steps) = self.seed_steps(first, longest) else { return Vec::new() };
        let candidates = self.candidates;
        let mut placed: BTreeMap<Place, usize> = BTreeMap::from([((0, 0), first)]);
        let mut used = vec![false; candidates.len()];
        used[first] = true;
        let mut queue = VecDeque::from([(0, 0)]);
        while let Some((i, j)) = queue.pop_front() {
            for (di, dj) in [(1, 0), (0, 1), (-1, 0), (0, -1)] {
                let next = (i + di, j + dj);
                if placed.contains_key(&next) {
                    continue;
                }
                let at = |place: Place| placed.get(&place).map(|&k| candidates[k].at);
                let Some(here) = placed.get(&(i, j)).map(|&k| candidates[k]) else { continue };
                let step = step_at(&at, pitch, (i, j), (di, dj))
                    .unwrap_or_else(|| if di != 0 { seed_steps[0] * di as f64 } else { seed_steps[1] * dj as f64 });
                let stray = STRAY * step.norm();
                let around = [(1, 0), (0, 1), (-1, 0), (0, -1)].map(|(di, dj)| placed.get(&(next.0 + di, next.1 + dj)));
                let found = self
                    .within(&(here.at + step), stray, |_, k| !used[k])
                    .into_iter()
                    .find(|&(_, k)| around.iter().flatten().all(|&&neighbour| self.edge(neighbour, k)));
                if let Some((_, k)) = found {
                    used[k] = true;
                    placed.insert(next, k);
                    queue.push_back(next);
                }
            }
        }
        placed.into_iter().collect()
    }

    /// Steps to the neighbours of a corner along its two edges: the nearest of opposite colouring, and the nearest of
    /// those in another direction, no farther than `longest`, px.
    fn seed_steps(&self, first: usize, longest: f64) -> Option<[Vector2<f64>; 2]> {
        /// Edges nearer to each other than this are no board's, rad.
        const LEAST_ANGLE: f64 = 0.35;
        let here = &self.candidates[first];
        let mut nearest: Option<Vector2<f64>> = None;
        // In rings: most candidates have their neighbours near, and those that have none see much of the picture.
        let (mut inner, mut reach) = (0.0, 8.0_f64);
        while inner < longest {
            reach = (2.0 * reach).min(longest);
            let ring =
                |distance: f64, k: usize| (distance > inner || inner == 0.0) && k != first && self.ends(first, k);
            for (_, k) in self.within(&here.at, reach, ring) {
                let step = self.candidates[k].at - here.at;
                let elsewhere =
                    |a: &Vector2<f64>| (a.perp(&step).abs() / (a.norm() * step.norm())).asin() > LEAST_ANGLE;
                if !nearest.as_ref().is_none_or(elsewhere) || !self.shows_edge(first, k) {
                    continue;
                }
                match nearest {
                    None => nearest = Some(step),
                    Some(a) => return Some([a, step]),
                }
            }
            inner = reach;
        }
        None
    }
}

/// The cell of a place along one side, the first or the last one where it lies beyond.
fn cell_of(place: f64, last: usize) -> usize {
    ((place / CELL) as usize).min(last)
}

/// True for corners whose colours are those of neighbours along an edge: the bright axes are perpendicular.
fn opposite(a: &Candidate, b: &Candidate) -> bool {
    // Axes are at most half a turn apart: no division is needed.
    let d = a.axis - b.axis;
    let d = if d < 0.0 { d + PI } else { d };
    (d - FRAC_PI_2).abs() < SLANT
}

type Place = (isize, isize);

/// How long the steps of a grid of at least so many corners are at its start, px. Its squares share the picture, and
/// where some are larger than their share others are smaller: the grid is found from those.
fn longest_step(picture: &Grey8, corners: usize) -> f64 {
    /// The longest step that is looked for, px.
    const LONGEST: f64 = 512.0;
    /// How much longer than the side of a square of that share: seen obliquely, one side is longer than the other.
    const LONGER: f64 = 2.0;
    let share = (picture.width * picture.height) as f64 / corners.max(1) as f64;
    (LONGER * share.sqrt()).min(LONGEST)
}

/// The step from a place in a direction, from the steps before it or beside it.
fn step_at(
    at: &dyn Fn(Place) -> Option<Point2<f64>>,
    pitch: Pitch,
    (i, j): Place,
    (di, dj): Place,
) -> Option<Vector2<f64>> {
    let here = at((i, j))?;
    if let Some(back) = at((i - di, j - dj)) {
        let width = |from: isize, way: isize| pitch.after(from + 1 + way.min(0));
        let (line, way) = if di != 0 { (i, di) } else { (j, dj) };
        return Some((here - back) * (width(line, way) / width(line, -way)));
    }
    [1, -1].into_iter().find_map(|side| {
        let (i, j) = (i + side * dj, j + side * di);
        Some(at((i + di, j + dj))? - at((i, j))?)
    })
}

fn as_grid(grown: &[(Place, usize)], candidates: &[Candidate], pitch: Pitch) -> Option<Places> {
    let range = |of: &dyn Fn(&Place) -> isize| {
        let values = grown.iter().map(|(place, _)| of(place));
        Some((values.clone().min()?, values.max()?))
    };
    // Whole tags: the line of a grid's seed ends one.
    let whole = |(first, last): (isize, isize)| match pitch {
        Pitch::Even => (first, last),
        Pitch::Tags { .. } => (first - (first + 1).rem_euclid(2), last + last.rem_euclid(2)),
    };
    let ((left, right), (top, bottom)) = (whole(range(&|p| p.0)?), whole(range(&|p| p.1)?));
    let (columns, rows) = ((right - left + 1) as usize, (bottom - top + 1) as usize);
    let mut grid: Places = Lattice::from_fn(columns, rows, |_, _| None);
    for &((i, j), k) in grown {
        grid.cells[(j - top) as usize * columns + (i - left) as usize] = Some(candidates[k].at);
    }
    Some(grid)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A board of 8x6 squares, skewed, with a part painted over.
    fn picture(hidden: impl Fn(f64, f64) -> bool) -> Grey8 {
        Grey8::from_fn(240, 200, |x, y| {
            let mut sum = 0.0;
            for (a, b) in [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)] {
                let (x, y) = (x as f64 + a - 30.0, y as f64 + b - 20.0);
                let (u, v) = ((x - 0.2 * y) / 20.0, (y - 0.1 * x) / 20.0);
                let inside = (0.0..8.0).contains(&u) && (0.0..6.0).contains(&v);
                let black = inside && (u.floor() + v.floor()) as i32 % 2 == 0;
                let grey = if black { 30.0 } else { 210.0 };
                sum += if hidden(u, v) { 130.0 } else { grey } / 4.0;
            }
            sum as u8
        })
    }

    fn size(grid: &Places) -> (usize, usize) {
        (grid.columns.max(grid.rows), grid.columns.min(grid.rows))
    }

    #[test]
    fn a_whole_board_is_found_whole() {
        let grid = largest_grid(&picture(|_, _| false), 35).unwrap();
        assert_eq!((size(&grid), grid.count()), ((7, 5), 35));
    }

    #[test]
    fn a_hidden_part_is_a_hole() {
        let grid = largest_grid(&picture(|u, v| (2.5..4.5).contains(&u) && (1.5..3.5).contains(&v)), 35).unwrap();
        assert_eq!((size(&grid), grid.count()), ((7, 5), 31));
        let cut = largest_grid(&picture(|u, _| u > 5.5), 35).unwrap();
        assert_eq!((size(&cut), cut.count()), ((5, 5), 25));
    }

    #[test]
    fn nothing_in_nothing() {
        assert_eq!(largest_grid(&picture(|_, _| true), 35), None);
        assert_eq!(largest_grid(&Grey8 { width: 3, height: 3, pixels: vec![0; 9] }, 35), None);
        assert_eq!(largest_grid(&Grey8 { width: 0, height: 0, pixels: vec![] }, 35), None);
    }
}
