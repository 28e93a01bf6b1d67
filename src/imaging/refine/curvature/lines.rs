//! The bends of all lines of a board, both ways: of whole boards line by line, by the offsets of its corners from its
//! chord.

use nalgebra::{DMatrix, DVector, Point2, Vector2};

use super::bend::{Bend, FEWEST, Point, Rule};
use super::parallel::{self, Line};
use crate::imaging::lattice::Lattice;
use crate::statistics::median;

/// Bends of the two edges at each place of the grid; `None` on lines with fewer than three corners that count. A place
/// that is off its line by many times what is usual there and by more than they are good for does not count.
pub fn bends(grid: &Lattice<Point>, rule: Rule) -> Vec<[Option<Bend>; 2]> {
    let mut bends = vec![[None; 2]; grid.columns * grid.rows];
    let at = |c: usize, r: usize| Some((r * grid.columns + c, *grid.get(c, r)?));
    let rows = (0..grid.rows).map(|row| (0..grid.columns).filter_map(|c| at(c, row)).collect()).collect();
    let columns = (0..grid.columns).map(|col| (0..grid.rows).filter_map(|r| at(col, r)).collect()).collect();
    let ways: [Vec<Line>; 2] = [rows, columns];
    for (way, lines) in ways.iter().enumerate() {
        let mut set = |at: usize, bend: Bend| bends[at][way] = Some(bend);
        if rule.in_part {
            parallel::bends(lines, rule.good_px, set);
        } else {
            lines.iter().for_each(|line| line_bend(line, rule.good_px, &mut set));
        }
    }
    bends
}

/// Sets the bend of a line at each of its corners, where it shows any. Corners that are off by many times what is usual
/// and by more than `good_px` do not count.
fn line_bend(line: &[(usize, Point)], good_px: f64, mut set: impl FnMut(usize, Bend)) {
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
    let few = line.len() > FEWEST && line.iter().filter(|(_, p)| p.counts).count() <= FEWEST;
    let counting: Vec<&(usize, Point)> = line.iter().filter(|(_, p)| p.counts || few).collect();
    // Places along the chord from -1 to 1 keep the powers well apart.
    let place = |p: &Point2<f64>| 2.0 * along.dot(&(p - first)) / length - 1.0;
    let degree = match counting.len() {
        0..FEWEST => return,
        FEWEST..=5 => 2,
        6..=8 => 3,
        _ => 4,
    };
    let offset = |p: &Point2<f64>| across.dot(&(p - first));
    let points = counting.iter().map(|(at, p)| (*at, place(&p.px), offset(&p.px))).collect();
    let Some(coefficients) = through(points, degree, good_px) else { return };
    for (at, p) in line {
        let v = place(&p.px);
        let terms = (2..=degree).map(|k| (k * (k - 1)) as f64 * v.powi(k as i32 - 2));
        let second: f64 = terms.zip(2..).map(|(term, k)| coefficients[k] * term).sum();
        let per_px = -second * 4.0 / (length * length);
        if per_px.is_finite() {
            // Whole boards have lines so long that what their bends are off by is hardly anything.
            set(*at, Bend { per_px, by_own: 0.0, variance: 0.0 });
        }
    }
}

/// The polynomial through points `(number, place, offset)`, without those that lie far off: a corner that is hidden in
/// part must not bend the line of the others.
fn through(mut points: Vec<(usize, f64, f64)>, degree: usize, good_px: f64) -> Option<DVector<f64>> {
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
            return Some(coefficients);
        }
        points.remove(worst);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::refine::curvature::SEEN;

    const PLAIN: Rule = Rule { good_px: 0.1, in_part: false };

    #[test]
    fn circles_have_their_curvature() {
        // Rows are arcs of radius 5000 px about a point far below the grid: curving away from the normal (0, 1).
        let radius = 5000.0;
        let grid = Lattice::from_fn(9, 5, |col, row| {
            let angle = (col as f64 - 4.0) * 40.0 / radius;
            let r = radius - row as f64 * 40.0;
            Some(Point { px: Point2::new(r * angle.sin(), -r * angle.cos()), counts: true, covariance_px2: SEEN })
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
        for (count, lines) in [(3, 1), (4, 1), (6, 1), (9, 1), (3, 3), (6, 4), (9, 6)] {
            let line = Lattice::from_fn(count, lines, |col, row| {
                let px = Point2::new(30.0 * col as f64 + (col % 2) as f64, 0.1 + 30.0 * row as f64);
                Some(Point { px, counts: true, covariance_px2: SEEN * 0.01 })
            });
            for bend in bends(&line, Rule { in_part: true, ..PLAIN }).iter().map(|both| both[0].unwrap()) {
                for half_px in [3.0, 10.0, 25.0] {
                    let (scatter, own) = (bend.variance_px2(half_px, 0.01) / 0.01, bend.own_share(half_px));
                    assert!(scatter >= own * own && (own - 1.0).abs() > 1e-7, "{count} {half_px}: {scatter} {own}");
                }
            }
        }
    }

    #[test]
    fn lines_of_two_corners_and_broken_ones_tell_no_bend() {
        let point = |x: f64, y: f64| Point { px: Point2::new(x, y), counts: true, covariance_px2: SEEN };
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
                Some(Point { px: Point2::new(40.0 * col as f64, y), counts: counts || col > 0, covariance_px2: SEEN })
            })
        };
        let most = |bends: Vec<[Option<Bend>; 2]>| bends.iter().map(|b| b[0].unwrap().per_px.abs()).fold(0.0, f64::max);
        assert!(most(bends(&line(true), PLAIN)) > 1e-5);
        assert!(most(bends(&line(false), PLAIN)) < 1e-12);
    }
}
