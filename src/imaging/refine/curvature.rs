//! How the lens bends a board's lines: curvature at each corner, from the corners of its line.
//!
//! In: a grid of places and how good they are at least. Out: for each corner the bend of its two edges, and what its own place has to do with it.
//! Method: the offsets of a line's corners from its chord, as a polynomial of the place along it (degree 2 to 4, by how many corners there are).
//! Without it, a straight edge fitted to a long bent one is off by a twenty-fourth of bend times length squared. Goes wrong: lines of one or two
//! corners, which only the windows themselves show to bend.

use nalgebra::{DMatrix, DVector, Point2, Vector2};

use crate::imaging::lattice::Lattice;
use crate::statistics::median;

/// How the corners of a line show it to bend at one of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bend {
    /// 1/px, in the sign of the corner model: the edge runs where `n.d = -bend/2 (t.d)^2`.
    pub per_px: f64,
    /// By how much it changes with that corner's own offset from the line, 1/px^2.
    by_own: f64,
    /// The sum of the squares of how it changes with the offset of each, 1/px^4.
    by_all: f64,
}

impl Bend {
    /// Variance of a corner across its line, measured in a window of half `half_px` whose edge bends like this, in units of what it is where the bend
    /// is known. A straight edge is off by a sixth of bend times half the window squared, and the corner itself shows the bend.
    pub fn scatter(&self, half_px: f64) -> f64 {
        let by_bend = half_px * half_px / 6.0;
        1.0 + 2.0 * by_bend * self.by_own + by_bend * by_bend * self.by_all
    }

    /// How much of what moves the corner in such a window across its line does so still where the line's bend, which it takes part in, is the edge's.
    pub fn own_share(&self, half_px: f64) -> f64 {
        1.0 + half_px * half_px / 6.0 * self.by_own
    }
}

/// Fewest corners that show how a line bends.
const FEWEST: usize = 3;

/// Bends of the two edges at each place of the grid; `None` on lines with fewer than three corners that count. A place that is off its line by many
/// times what is usual there and by more than they are good for does not count.
pub fn bends(grid: &Lattice<Point>, rule: Rule) -> Vec<[Option<Bend>; 2]> {
    let mut bends = vec![[None; 2]; grid.columns * grid.rows];
    let at = |c: usize, r: usize| Some((r * grid.columns + c, *grid.get(c, r)?));
    for row in 0..grid.rows {
        let line: Vec<_> = (0..grid.columns).filter_map(|c| at(c, row)).collect();
        line_bend(&line, rule, |at, bend| bends[at][0] = Some(bend));
    }
    for col in 0..grid.columns {
        let line: Vec<_> = (0..grid.rows).filter_map(|r| at(col, r)).collect();
        line_bend(&line, rule, |at, bend| bends[at][1] = Some(bend));
    }
    bends
}

/// Which lines tell how they bend.
#[derive(Debug, Clone, Copy)]
pub struct Rule {
    /// How good places are at least, px.
    pub good_px: f64,
    /// Whether the board may be seen in part, so that lines are short. They are of the fourth degree from six corners on, not from nine: with six that
    /// costs the corners next to the ends a sixth of their precision, and the third degree leaves what a lens's fifth-order distortion bends at the
    /// ends, 0.01 px in a picture that six squares fill. And where fewer than four corners count the others do not, either.
    pub in_part: bool,
}

/// A corner of a line.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Where it is, px.
    pub px: Point2<f64>,
    /// Whether the line's bend is to be found from it.
    pub counts: bool,
}

fn line_bend(line: &[(usize, Point)], Rule { good_px, in_part }: Rule, mut set: impl FnMut(usize, Bend)) {
    let ([(_, first), .., (_, last)], FEWEST..) = (line, line.len()) else { return };
    let (first, last) = (first.px, last.px);
    let chord = last - first;
    let length = chord.norm();
    let along = chord / length;
    let across = Vector2::new(-along.y, along.x);
    // A decomposition of numbers that are none would not end.
    if !along.iter().all(|v| v.is_finite()) {
        return;
    }
    let few = !in_part && line.len() > FEWEST && line.iter().filter(|(_, p)| p.counts).count() <= FEWEST;
    let counting: Vec<&(usize, Point)> = line.iter().filter(|(_, p)| p.counts || few).collect();
    // Places along the chord from -1 to 1 keep the powers well apart.
    let place = |p: &Point2<f64>| 2.0 * along.dot(&(p - first)) / length - 1.0;
    let degree = match counting.len() {
        0..FEWEST => return,
        FEWEST..=5 => 2,
        6..=8 if !in_part => 3,
        _ => 4,
    };
    let offset = |p: &Point2<f64>| across.dot(&(p - first));
    let points = counting.iter().map(|(at, p)| (*at, place(&p.px), offset(&p.px))).collect();
    let Some(Through { coefficients, by_point, points }) = through(points, degree, good_px) else { return };
    for (at, p) in line {
        let v = place(&p.px);
        let terms: Vec<f64> = (2..=degree).map(|k| (k * (k - 1)) as f64 * v.powi(k as i32 - 2)).collect();
        let second: f64 = terms.iter().zip(2..).map(|(term, k)| coefficients[k] * term).sum();
        let per_px = -second * 4.0 / (length * length);
        let by = |i: usize| -> f64 {
            let second: f64 = terms.iter().zip(2..).map(|(term, k)| by_point[(k, i)] * term).sum();
            -second * 4.0 / (length * length)
        };
        let by_own = points.iter().position(|point| point.0 == *at).map_or(0.0, by);
        let by_all = (0..points.len()).map(|i| by(i).powi(2)).sum();
        if per_px.is_finite() {
            set(*at, Bend { per_px, by_own, by_all });
        }
    }
}

/// A polynomial through points.
struct Through {
    coefficients: DVector<f64>,
    /// How the coefficients (rows) change with the points' offsets (columns).
    by_point: DMatrix<f64>,
    /// What it goes through.
    points: Vec<(usize, f64, f64)>,
}

/// The polynomial through points `(number, place, offset)`, without those that lie far off: a corner that is hidden in part must
/// not bend the line of the others.
fn through(mut points: Vec<(usize, f64, f64)>, degree: usize, good_px: f64) -> Option<Through> {
    /// A point is off by this many times the usual misfit at the least.
    const FAR: f64 = 8.0;
    loop {
        let powers = DMatrix::from_fn(points.len(), degree + 1, |i, k| points[i].1.powi(k as i32));
        let offsets = DVector::from_fn(points.len(), |i, _| points[i].2);
        let svd = powers.clone().svd(true, true);
        let coefficients = svd.solve(&offsets, 1e-12).ok()?;
        let misfit: Vec<f64> = (powers * &coefficients - offsets).iter().map(|v| v.abs()).collect();
        let usual = median(misfit.iter().copied())?;
        let (worst, most) = misfit.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        // With fewer points than that none can be told from the others.
        if most < FAR * usual + good_px || points.len() < degree + 4 {
            let by_point = svd.pseudo_inverse(1e-12).ok()?;
            return Some(Through { coefficients, by_point, points });
        }
        points.remove(worst);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Rule = Rule { good_px: 0.1, in_part: false };

    #[test]
    fn circles_have_their_curvature() {
        // Rows are arcs of radius 5000 px about a point far below the grid: curving away from the normal (0, 1).
        let radius = 5000.0;
        let grid = Lattice::from_fn(9, 5, |col, row| {
            let angle = (col as f64 - 4.0) * 40.0 / radius;
            let r = radius - row as f64 * 40.0;
            Some(Point { px: Point2::new(r * angle.sin(), -r * angle.cos()), counts: true })
        });
        for (at, both) in bends(&grid, PLAIN).into_iter().enumerate() {
            let [along_rows, along_columns] = both.map(|bend| bend.unwrap().per_px);
            let r = radius - (at / 9) as f64 * 40.0;
            // y grows away from the middle of the arc, so n.d is positive there and the bend negative.
            assert!((along_rows * r + 1.0).abs() < 2e-3, "{along_rows}");
            assert!(along_columns.abs() < 1e-9);
        }
    }

    #[test]
    fn a_corner_scatters_at_least_by_its_own_share() {
        // Corners at the ends of short lines bend them against themselves, those in the middle with themselves.
        for count in [3, 4, 6, 9] {
            let line = Lattice::from_fn(count, 1, |col, _| {
                Some(Point { px: Point2::new(30.0 * col as f64 + (col % 2) as f64, 0.1), counts: true })
            });
            for bend in bends(&line, Rule { in_part: true, ..PLAIN }).iter().map(|both| both[0].unwrap()) {
                for half_px in [3.0, 10.0, 25.0] {
                    let (scatter, own) = (bend.scatter(half_px), bend.own_share(half_px));
                    assert!(scatter >= own * own && (own - 1.0).abs() > 1e-6, "{count} {half_px}: {scatter} {own}");
                }
            }
        }
    }

    #[test]
    fn lines_of_two_corners_and_broken_ones_tell_no_bend() {
        let point = |x: f64, y: f64| Point { px: Point2::new(x, y), counts: true };
        let grid = Lattice::from_fn(2, 2, |col, row| Some(point(col as f64, (row * col) as f64)));
        assert!(bends(&grid, PLAIN).iter().all(|b| *b == [None; 2]));
        let same = Lattice::from_fn(5, 5, |_, _| Some(point(1.0, 1.0)));
        assert!(bends(&same, PLAIN).iter().flatten().flatten().all(|bend| bend.per_px.is_finite()));
    }

    #[test]
    fn a_corner_that_does_not_count_bends_no_line() {
        // The first corner of a straight line, where it has the most weight, is off.
        let line = |counts: bool| {
            Lattice::from_fn(12, 1, |col, _| {
                let y = if col == 0 { 0.5 } else { 0.0 };
                Some(Point { px: Point2::new(40.0 * col as f64, y), counts: counts || col > 0 })
            })
        };
        let most = |bends: Vec<[Option<Bend>; 2]>| bends.iter().map(|b| b[0].unwrap().per_px.abs()).fold(0.0, f64::max);
        assert!(most(bends(&line(true), PLAIN)) > 1e-5);
        assert!(most(bends(&line(false), PLAIN)) < 1e-12);
    }
}
