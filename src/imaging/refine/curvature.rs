//! How the lens bends a board's lines: curvature at each corner, from one smooth map of the whole board.
//!
//! In: a grid of places and how good they are at least. Out: for each corner the bend of its two edges. Method: the board's homography keeps
//! lines straight; by how much the places lie off it is a sum of terms (`distortion`), as many of them, in their order, as have the least
//! Bayesian information criterion (Schwarz 1978; a stricter one). All corners tell of every line, so that crossings which are printed off their
//! places bend none by much. Without its bend, a straight edge fitted to a long bent one is off by a twenty-fourth of bend
//! times length squared. Goes wrong: a board of few corners tells of few terms only.

use nalgebra::{DVector, Matrix3, Point2, Vector2};

use super::distortion::{Along, FAMILIES, Family, LENS, PROJECTIVE, displacement};
use crate::homography::{apply, homography};
use crate::imaging::lattice::Lattice;
use crate::statistics::median;

/// A corner is off the map by this many times the usual misfit at the least where it does not count.
const FAR: f64 = 8.0;
/// How often the homography is found again from places without what the lens does to them.
const LENS_ROUNDS: usize = 4;
/// How often corners that are off the map are left out.
const ROUNDS: usize = 5;
/// How many times the criterion's penalty for a parameter counts. Once, chance brings terms on boards of thirty crossings that are off their
/// places, at some poses and not at others: bends and noise of the corners grow by some per cent.
const PENALTY: f64 = 2.0;
/// Share of a term's square that must be left of it, once those before it are taken off, for it to tell anything of its own.
const OWN_SHARE: f64 = 1e-10;

/// A corner of a grid.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Where it is, px.
    pub px: Point2<f64>,
    /// Whether bends are to be found from it; where fewer than half are, from all.
    pub counts: bool,
}

/// Bend of the two edges at each place of the grid, 1/px, in the sign of the corner model: the edge runs where
/// `n.d = -bend/2 (t.d)^2`. Zero where too few corners tell. `middle` is that of the picture, px. A corner that is off by many times what
/// is usual and by `good_px` does not count.
pub fn bends(grid: &Lattice<Point>, middle: &Point2<f64>, good_px: f64) -> Vec<[f64; 2]> {
    let few = 2 * grid.iter().filter(|(_, _, point)| point.counts).count() < grid.count();
    let seen = grid
        .iter()
        .filter(|(_, _, point)| point.counts || few)
        .map(|(col, row, point)| (Point2::new(col as f64, row as f64), point.px));
    let map = Map::of(seen.collect(), middle, good_px);
    let bend = |at: usize| map.as_ref().map_or([0.0; 2], |map| map.bends(at % grid.columns, at / grid.columns));
    (0..grid.columns * grid.rows).map(bend).collect()
}

/// A corner's column and row, and its place.
type Seen = (Point2<f64>, Point2<f64>);

/// From columns and rows to places. Places are relative to the corners' mean, in units of the farthest: powers of them stay well apart.
struct Map {
    unit_px: f64,
    /// Of the picture.
    middle: Point2<f64>,
    /// Columns and rows to places on lines that do not bend.
    straight: Matrix3<f64>,
    /// How much of each term moves those.
    shares: Vec<f64>,
}

impl Map {
    /// The map of corners without those that are far off it: one that is hidden in part must not bend the lines of the others. `None` where
    /// they have no homography.
    fn of(mut seen: Vec<Seen>, middle: &Point2<f64>, good_px: f64) -> Option<Map> {
        let mean = seen.iter().map(|(_, px)| px.coords).sum::<Vector2<f64>>() / seen.len() as f64;
        let unit_px = seen.iter().map(|(_, px)| (px.coords - mean).norm()).fold(0.0, f64::max);
        let in_units = |px: &Point2<f64>| Point2::from((px.coords - mean) / unit_px);
        for (_, place) in &mut seen {
            *place = in_units(place);
            // A decomposition of numbers that are none would not end.
            if !place.iter().all(|v| v.is_finite()) {
                return None;
            }
        }
        let good = good_px / unit_px;
        let mut map = Map { unit_px, middle: in_units(middle), straight: Matrix3::zeros(), shares: Vec::new() };
        for _ in 0..ROUNDS {
            map.settle_homography(&seen, good)?;
            let from = map.straight_places(&seen);
            map.shares = map.ask(&seen, &from, &FAMILIES, good);
            let misfit =
                |((_, place), from): (&Seen, &Point2<f64>)| (place - from - map.moved(&map.shares, from)).norm();
            let misfits: Vec<f64> = seen.iter().zip(&from).map(misfit).collect();
            let limit = FAR * median(misfits.iter().copied())? + good;
            if misfits.iter().all(|&misfit| misfit < limit) {
                break;
            }
            seen = seen.into_iter().zip(misfits).filter(|(_, misfit)| *misfit < limit).map(|(seen, _)| seen).collect();
        }
        Some(map)
    }

    /// Finds the homography from places without what the lens does to them.
    fn settle_homography(&mut self, seen: &[Seen], good: f64) -> Option<()> {
        self.straight = homography(seen)?.0;
        for _ in 0..LENS_ROUNDS {
            let from = self.straight_places(seen);
            let mut lens = self.ask(seen, &from, &FAMILIES[..LENS], good);
            if lens.is_empty() {
                break;
            }
            // What a change of the homography does is for the homography to do.
            lens[..PROJECTIVE].fill(0.0);
            let without = |((at, place), from): (&Seen, &Point2<f64>)| (*at, place - self.moved(&lens, from));
            self.straight = homography(&seen.iter().zip(&from).map(without).collect::<Vec<_>>())?.0;
            let change = from.iter().zip(self.straight_places(seen)).map(|(before, after)| (after - before).norm());
            if change.fold(0.0, f64::max) < good {
                break;
            }
        }
        Some(())
    }

    fn straight_places(&self, seen: &[Seen]) -> Vec<Point2<f64>> {
        seen.iter().map(|(at, _)| apply(&self.straight, at)).collect()
    }

    fn moved(&self, shares: &[f64], from: &Point2<f64>) -> Vector2<f64> {
        displacement(shares, &self.middle, [from.x, from.y]).into()
    }

    /// How much of each term moves straight places to the seen ones: of as many of the families as the places ask for, least squares.
    fn ask(&self, seen: &[Seen], from: &[Point2<f64>], families: &[Family], good: f64) -> Vec<f64> {
        let numbers = 2 * seen.len();
        let mut left = DVector::from_fn(numbers, |i, _| seen[i / 2].1[i % 2] - from[i / 2][i % 2]);
        // What rounding leaves of exact places is no reason for more terms.
        let least = (1e-3 * good).powi(2);
        let criterion = |left: &DVector<f64>, parameters: usize| {
            let variance = left.norm_squared() / numbers as f64 + least;
            numbers as f64 * variance.ln() + PENALTY * parameters as f64 * (numbers as f64).ln()
        };
        // Without terms there are the homography's parameters.
        let mut best = (criterion(&left, PROJECTIVE), Vec::new());
        let mut shares = Vec::new();
        let mut directions = Directions::default();
        for family in families {
            let terms: Vec<Vec<[f64; 2]>> = from.iter().map(|p| family.at(&self.middle, [p.x, p.y])).collect();
            for term in 0..terms.first().map_or(0, Vec::len) {
                shares.push(0.0);
                let column = DVector::from_fn(numbers, |i, _| terms[i / 2][term][i % 2]);
                if let Some((direction, own)) = directions.add(column, shares.len()) {
                    let along = direction.dot(&left);
                    left.axpy(-along, direction, 1.0);
                    shares.iter_mut().zip(own).for_each(|(share, own)| *share += along * own);
                }
            }
            // Half of the numbers must be left to tell how well it fits.
            if 2 * directions.0.len() > numbers {
                break;
            }
            let found = criterion(&left, directions.0.len());
            if found < best.0 && !matches!(family, Family::Projective) {
                best = (found, shares.clone());
            } else if matches!(family, Family::Degree(3..)) {
                break;
            }
        }
        best.1
    }

    /// Bend of the lines along the rows and along the columns, 1/px.
    fn bends(&self, col: usize, row: usize) -> [f64; 2] {
        let at = Point2::new(col as f64, row as f64);
        let from = apply(&self.straight, &at);
        [Vector2::x(), Vector2::y()].map(|along: Vector2<f64>| {
            let [ahead, behind] = [0.5, -0.5].map(|half| apply(&self.straight, &(at + along * half)));
            let t = (ahead - behind).normalize();
            let place = [0, 1].map(|k| Along { value: from[k], first: t[k], second: 0.0 });
            let [x, y] = displacement(&self.shares, &self.middle, place);
            let first = t + Vector2::new(x.first, y.first);
            let bend = -first.perp(&Vector2::new(x.second, y.second)) / first.norm().powi(3) / self.unit_px;
            if bend.is_finite() { bend } else { 0.0 }
        })
    }
}

/// Directions of unit length at right angles to each other, each with the sum of terms that it is (Gram and Schmidt).
#[derive(Default)]
struct Directions(Vec<(DVector<f64>, Vec<f64>)>);

impl Directions {
    /// Adds what the last of so many terms tells of its own; `None` if that is nothing.
    fn add(&mut self, term: DVector<f64>, terms: usize) -> Option<&(DVector<f64>, Vec<f64>)> {
        let whole = term.norm();
        let (mut direction, mut own) = (term, vec![0.0; terms]);
        *own.last_mut()? = 1.0;
        for (other, others) in &self.0 {
            let along = other.dot(&direction);
            direction.axpy(-along, other, 1.0);
            own.iter_mut().zip(others).for_each(|(own, other)| *own -= along * other);
        }
        let length = direction.norm();
        if length.partial_cmp(&(OWN_SHARE.sqrt() * whole)) != Some(std::cmp::Ordering::Greater) {
            return None;
        }
        direction /= length;
        own.iter_mut().for_each(|own| *own /= length);
        self.0.push((direction, own));
        self.0.last()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIDDLE: Point2<f64> = Point2::new(2040.0, 1470.0);

    #[test]
    fn circles_have_their_curvature() {
        // Rows are arcs of radius 5000 px about a point far below the grid: curving away from the normal (0, 1).
        let radius = 5000.0;
        let grid = Lattice::from_fn(9, 5, |col, row| {
            let angle = (col as f64 - 4.0) * 40.0 / radius;
            let r = radius - row as f64 * 40.0;
            Some(Point { px: Point2::new(r * angle.sin(), -r * angle.cos()), counts: true })
        });
        for (at, [along_rows, along_columns]) in bends(&grid, &Point2::new(0.0, -radius), 0.004).into_iter().enumerate()
        {
            let r = radius - (at / 9) as f64 * 40.0;
            // y grows away from the middle of the arc, so n.d is positive there and the bend negative.
            assert!((along_rows * r + 1.0).abs() < 2e-3, "{along_rows}");
            assert!((along_columns * r).abs() < 2e-3, "{along_columns}");
        }
    }

    #[test]
    fn few_or_broken_corners_bend_no_lines() {
        let point = |x: f64, y: f64| Point { px: Point2::new(x, y), counts: true };
        let grid = Lattice::from_fn(3, 2, |col, row| Some(point((col * col) as f64, row as f64)));
        assert!(bends(&grid, &MIDDLE, 0.1).iter().all(|b| *b == [0.0; 2]));
        let same = Lattice::from_fn(5, 5, |_, _| Some(point(1.0, 1.0)));
        assert!(bends(&same, &MIDDLE, 0.1).iter().all(|b| b.iter().all(|v| v.is_finite())));
    }

    /// A board of 12x9 corners, tilted, through a lens with a term of the third and of the fifth power: places at any column and row.
    fn through_a_lens(col: f64, row: f64) -> Point2<f64> {
        let (x, y) = (col - 5.5, row - 4.0);
        let depth = 20.0 + 0.4 * x - 0.3 * y;
        let (x, y) = (x / depth, y / depth);
        let r2 = x * x + y * y;
        let lens = 1.0 - 0.25 * r2 + 0.1 * r2 * r2;
        Point2::new(2000.0 + 3000.0 * x * lens, 1500.0 + 3000.0 * y * lens)
    }

    fn board(off: impl Fn(usize, usize) -> Vector2<f64>) -> Lattice<Point> {
        Lattice::from_fn(12, 9, |col, row| {
            Some(Point { px: through_a_lens(col as f64, row as f64) + off(col, row), counts: true })
        })
    }

    /// The largest difference of bends from those of the lens, 1/px.
    fn worst(found: &[[f64; 2]]) -> f64 {
        let h = 1e-2;
        let bend = |ends: [Point2<f64>; 3]| {
            let first = (ends[2] - ends[0]) / (2.0 * h);
            let second = (ends[2].coords - 2.0 * ends[1].coords + ends[0].coords) / (h * h);
            -first.perp(&second) / first.norm().powi(3)
        };
        let mut worst: f64 = 0.0;
        for (at, found) in found.iter().enumerate() {
            let (col, row) = ((at % 12) as f64, (at / 12) as f64);
            let truth = [
                bend([-h, 0.0, h].map(|step| through_a_lens(col + step, row))),
                bend([-h, 0.0, h].map(|step| through_a_lens(col, row + step))),
            ];
            worst = (0..2).map(|k| (found[k] - truth[k]).abs()).fold(worst, f64::max);
        }
        worst
    }

    #[test]
    fn a_lens_through_a_tilted_board_bends_lines_as_it_does() {
        let straight = worst(&[[0.0; 2]; 108]);
        let found = worst(&bends(&board(|_, _| Vector2::zeros()), &MIDDLE, 0.004));
        assert!(found < 1e-3 * straight, "{found} {straight}");
    }

    #[test]
    fn crossings_off_their_places_hardly_bend_lines() {
        let straight = worst(&[[0.0; 2]; 108]);
        for (sigma, share) in [(0.002, 0.02), (0.02, 0.05), (0.2, 0.2)] {
            let mut state = 7u64;
            let offs: Vec<Vector2<f64>> = (0..108)
                .map(|_| {
                    Vector2::from_fn(|_, _| {
                        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                        sigma * 12f64.sqrt() * ((state >> 40) as f64 / f64::from(1u32 << 24) - 0.5)
                    })
                })
                .collect();
            let found = worst(&bends(&board(|col, row| offs[row * 12 + col]), &MIDDLE, 0.004));
            assert!(found < share * straight, "{sigma}: {found} {straight}");
        }
    }

    #[test]
    fn a_corner_that_does_not_count_bends_no_line() {
        // A corner at the side, where it has the most weight, is off.
        let grid = |off_px: f64, counts: bool| {
            let mut grid = board(|col, row| {
                Vector2::new(1e-3, -1e-3) * if (col + row) % 2 == 0 { 1.0 } else { -1.0 }
                    + Vector2::new(0.0, if (col, row) == (0, 3) { off_px } else { 0.0 })
            });
            if let Some(point) = &mut grid.cells[3 * 12] {
                point.counts = counts;
            }
            bends(&grid, &MIDDLE, 0.004)
        };
        let clean = worst(&grid(0.0, true));
        // By itself, or because it is far off.
        for (off_px, counts) in [(0.05, false), (0.5, false), (0.5, true), (30.0, true)] {
            let found = worst(&grid(off_px, counts));
            assert!(found < 3.0 * clean, "{off_px} {counts}: {found} {clean}");
        }
    }
}
