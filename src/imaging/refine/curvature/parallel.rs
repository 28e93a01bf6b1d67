//! How a board's lines bend that is seen in part: all lines of one direction together.
//!
//! In: the lines of one direction, their corners with covariances. Out: the bend at each corner. Method: a lens bends
//! neighbouring lines alike. The offsets of a line's corners from a straight one, which is its own, are a polynomial of
//! the place along it whose coefficients are polynomials of the line's place across (degree 2 to 5 in both together, by
//! how many corners there are), by weighted least squares: corners that the border cuts are known worse than others,
//! and lines of few corners show their bends at their ends badly. Of fewer terms than the corners tell a lens's
//! fifth-order distortion leaves 0.015 px at the ends of lines of six squares that fill a picture of 800 px. Goes
//! wrong: fewer than three corners on every line, which only the windows themselves show to bend.

use nalgebra::{DMatrix, DVector, Point2, Unit, Vector2};

use super::bend::{Bend, FEWEST, Point};
use crate::statistics::median;

/// Highest degree of the polynomial along a line, and in both directions together: a lens's fifth-order distortion.
const MOST_ALONG: usize = 4;
const MOST_DEGREE: usize = 5;

/// One line of corners, by their numbers.
pub(super) type Line = Vec<(usize, Point)>;

/// A line's own direction and place.
struct Chord {
    from: Point2<f64>,
    along: Vector2<f64>,
    across: Vector2<f64>,
    /// Place across the lines, in units of the common scale.
    place: f64,
}

/// Where lines lie in common coordinates from about -1 to 1.
struct Frame {
    middle: Point2<f64>,
    scale: f64,
    /// A chord a line; none of lines of one corner.
    chords: Vec<Option<Chord>>,
}

impl Frame {
    fn of(lines: &[Line]) -> Option<Frame> {
        let count = lines.iter().map(Vec::len).sum::<usize>();
        let sum = lines.iter().flatten().map(|(_, p)| p.px.coords).sum::<Vector2<f64>>();
        let middle = Point2::from(sum / count as f64);
        let ends = |line: &Line| Some((line.first()?.1.px, line.last().filter(|_| line.len() > 1)?.1.px));
        let direction = lines.iter().filter_map(ends).map(|(first, last)| last - first).sum::<Vector2<f64>>();
        let mean = Unit::try_new(direction, f64::MIN_POSITIVE)?;
        let across = Vector2::new(-mean.y, mean.x);
        let reach = lines.iter().flatten().map(|(_, p)| (p.px - middle).norm()).fold(0.0, f64::max);
        let chord = |line: &Line| {
            let (first, last) = ends(line)?;
            let along = Unit::try_new(last - first, f64::MIN_POSITIVE)?.into_inner();
            let place = line.iter().map(|(_, p)| across.dot(&(p.px - middle))).sum::<f64>() / line.len() as f64 / reach;
            Some(Chord { from: first, along, across: Vector2::new(-along.y, along.x), place })
        };
        (reach > 0.0 && reach.is_finite()).then(|| Frame {
            middle,
            scale: reach,
            chords: lines.iter().map(chord).collect(),
        })
    }
}

/// Powers of the place along a line and across the lines.
type Term = (i32, i32);

/// As many terms as the corners tell, with a half more degrees of freedom; at least the bend of every line.
fn terms((freedom, longest, lines): (usize, usize, usize)) -> Vec<Term> {
    let of = |most_along: usize, degree: usize| -> Vec<Term> {
        let along = 2..=most_along.min(longest.saturating_sub(1));
        let all = along.flat_map(|k| (0..lines).map(move |m| (k, m))).filter(|&(k, m)| k + m <= degree);
        all.map(|(k, m)| (k as i32, m as i32)).collect()
    };
    let richest = (3..=MOST_DEGREE).rev().map(|degree| of(MOST_ALONG, degree));
    let told = richest.into_iter().find(|terms| 3 * terms.len() <= 2 * freedom);
    told.unwrap_or_else(|| of(2, MOST_DEGREE))
}

/// A corner that counts: its number, its line, and its place in the common frame.
#[derive(Clone, Copy)]
struct Counting {
    at: usize,
    line: usize,
    along: f64,
    across: f64,
    offset_px: f64,
    variance_px2: f64,
}

/// Sets the bend of the lines at each of their corners, where they show any. Corners that are off by many times what is
/// usual and by more than `good_px` do not count.
pub(super) fn bends(lines: &[Line], good_px: f64, mut set: impl FnMut(usize, Bend)) {
    let Some(frame) = Frame::of(lines) else { return };
    let counting = lines.iter().zip(&frame.chords).enumerate().flat_map(|(number, (line, chord))| {
        let of_line = line.iter().filter(|(_, p)| p.counts);
        of_line.filter_map(move |&(at, Point { px, covariance_px2, .. })| {
            let chord = chord.as_ref()?;
            Some(Counting {
                at,
                line: number,
                along: chord.along.dot(&(px - frame.middle)) / frame.scale,
                across: chord.place,
                offset_px: chord.across.dot(&(px - chord.from)),
                variance_px2: chord.across.dot(&(covariance_px2 * chord.across)),
            })
        })
    });
    let Some(surface) = Surface::through(counting.collect(), good_px) else { return };
    for (line, chord) in lines.iter().zip(&frame.chords) {
        let Some(chord) = chord else { continue };
        for (at, p) in line {
            let along = chord.along.dot(&(p.px - frame.middle)) / frame.scale;
            let bend = surface.bend(*at, (along, chord.place), frame.scale);
            if bend.per_px.is_finite() {
                set(*at, bend);
            }
        }
    }
}

/// A polynomial through the corners of all lines.
struct Surface {
    terms: Vec<Term>,
    coefficients: DVector<f64>,
    /// How the coefficients change with the corners' offsets.
    by_point: DMatrix<f64>,
    points: Vec<Counting>,
}

impl Surface {
    /// Without points that lie far off: a corner that is hidden in part must not bend the others' lines.
    fn through(mut points: Vec<Counting>, good_px: f64) -> Option<Surface> {
        /// A point is off by this many times the usual misfit at the least.
        const FAR: f64 = 8.0;
        /// With fewer points more than terms than that none can be told from the others.
        const LEAST_MORE: usize = 3;
        // Places are off by more than noise, too: no corner weighs more than twice the usual one.
        let usual_px2 = median(points.iter().map(|p| p.variance_px2))?;
        points.retain(|p| p.variance_px2.is_finite());
        loop {
            let surface = Surface::once(points, usual_px2)?;
            let misfit = surface.misfit(usual_px2);
            let usual = median(misfit.iter().copied())?;
            let (worst, most) = misfit.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
            if most < FAR * usual + good_px || freedom(&surface.points).0 < surface.terms.len() + LEAST_MORE {
                return Some(surface);
            }
            points = surface.points;
            points.remove(worst);
        }
    }

    fn once(points: Vec<Counting>, usual_px2: f64) -> Option<Surface> {
        let terms = terms(freedom(&points));
        if terms.is_empty() {
            return None;
        }
        let weights = DVector::from_iterator(points.len(), points.iter().map(|p| weight(p, usual_px2)));
        let mut columns = DMatrix::from_fn(points.len(), terms.len() + 1, |i, k| {
            let p = &points[i];
            weights[i] * terms.get(k).map_or(p.offset_px, |(k, m)| p.along.powi(*k) * p.across.powi(*m))
        });
        without_lines(&mut columns, &points, &weights);
        let offsets = columns.column(terms.len()).into_owned();
        let columns = columns.columns(0, terms.len()).into_owned();
        let mut by_point = columns.svd(true, true).pseudo_inverse(1e-12).ok()?;
        let coefficients = &by_point * offsets;
        for (i, weight) in weights.iter().enumerate() {
            by_point.column_mut(i).scale_mut(*weight);
        }
        Some(Surface { terms, coefficients, by_point, points })
    }

    /// How far each point is off, px of the usual corner.
    fn misfit(&self, usual_px2: f64) -> Vec<f64> {
        let weights = DVector::from_iterator(self.points.len(), self.points.iter().map(|p| weight(p, usual_px2)));
        let off = |p: &Counting| {
            let known = self.terms.iter().zip(self.coefficients.iter());
            p.offset_px - known.map(|((k, m), c)| c * p.along.powi(*k) * p.across.powi(*m)).sum::<f64>()
        };
        let mut left =
            DMatrix::from_iterator(self.points.len(), 1, self.points.iter().zip(&weights).map(|(p, w)| w * off(p)));
        without_lines(&mut left, &self.points, &weights);
        left.iter().map(|off| off.abs()).collect()
    }

    /// The bend at a place, of the corner of this number.
    fn bend(&self, at: usize, (along, across): (f64, f64), scale: f64) -> Bend {
        let second = |(k, m): &Term| -f64::from(k * (k - 1)) * along.powi(k - 2) * across.powi(*m) / (scale * scale);
        let second = DVector::from_iterator(self.terms.len(), self.terms.iter().map(second));
        let by = self.by_point.tr_mul(&second);
        let own = self.points.iter().position(|p| p.at == at);
        Bend {
            per_px: second.dot(&self.coefficients),
            by_own: own.map_or(0.0, |i| by[i]),
            variance: by.iter().zip(&self.points).map(|(by, p)| by * by * p.variance_px2).sum(),
        }
    }
}

/// The root of a point's weight, one for the usual corner.
fn weight(point: &Counting, usual_px2: f64) -> f64 {
    (2.0 * usual_px2 / (point.variance_px2 + usual_px2)).sqrt()
}

/// How many corners there are beyond those that lay the lines, how many the longest line has, and how many lines have
/// more than two.
fn freedom(points: &[Counting]) -> (usize, usize, usize) {
    let lines = points.chunk_by(|a, b| a.line == b.line).map(|line| line.len());
    lines
        .filter(|count| *count >= FEWEST)
        .fold((0, 0, 0), |(freedom, longest, lines), count| (freedom + count - 2, longest.max(count), lines + 1))
}

/// Takes from each column what a straight line of its own for each line of the board explains.
fn without_lines(columns: &mut DMatrix<f64>, points: &[Counting], weights: &DVector<f64>) {
    let mut from = 0;
    for line in points.chunk_by(|a, b| a.line == b.line) {
        let weights = weights.rows(from, line.len());
        let square = weights.norm_squared();
        let mean = line.iter().zip(&weights).map(|(p, w)| w * w * p.along).sum::<f64>() / square;
        let along = DVector::from_iterator(line.len(), line.iter().zip(&weights).map(|(p, w)| w * (p.along - mean)));
        let spread = along.norm_squared();
        for mut column in columns.rows_mut(from, line.len()).column_iter_mut() {
            let level = column.dot(&weights) / square;
            column.axpy(-level, &weights, 1.0);
            if line.len() > 1 && spread > 0.0 {
                let slope = column.dot(&along) / spread;
                column.axpy(-slope, &along, 1.0);
            }
        }
        from += line.len();
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix2;

    use super::*;
    use crate::imaging::lattice::Lattice;
    use crate::imaging::refine::curvature::{Rule, bends};

    const SIDE_PX: f64 = 50.0;
    const SIGMA_PX: f64 = 0.01;

    /// Where a lens that bends lines has a place of the board, sides of a square from the picture's middle.
    fn seen(x: f64, y: f64) -> Point2<f64> {
        let p = Vector2::new(x, y) * SIDE_PX;
        let r2 = p.norm_squared();
        Point2::from(p * (1.0 - 6e-8 * r2 + 4e-14 * r2 * r2))
    }

    fn grid(columns: usize, rows: usize, off: impl Fn(usize, usize) -> f64) -> Lattice<Point> {
        Lattice::from_fn(columns, rows, |col, row| {
            let px = seen(col as f64 - 1.0, row as f64 - 2.0) + Vector2::new(off(col, row), -off(row, col));
            Some(Point { px, counts: true, covariance_px2: Matrix2::identity() * SIGMA_PX * SIGMA_PX })
        })
    }

    /// The bend of a row at a place, 1/px.
    fn truth(x: f64, y: f64) -> f64 {
        let h = 0.01;
        let second = (seen(x + h, y) - seen(x, y)) - (seen(x, y) - seen(x - h, y));
        -second.y / (SIDE_PX * h).powi(2)
    }

    const IN_PART: Rule = Rule { good_px: 0.01, in_part: true };
    /// Half of a window, px, and by how much a bend moves the place in it, px^2.
    const HALF_PX: f64 = 0.85 * SIDE_PX;

    #[test]
    fn neighbouring_lines_tell_a_bend_together() {
        for (columns, rows, most) in [(9, 6, 1.06), (6, 6, 1.15), (4, 4, 1.25)] {
            let found = bends(&grid(columns, rows, |_, _| 0.0), IN_PART);
            for (at, both) in found.iter().enumerate() {
                let bend = both[0].unwrap();
                let (x, y) = ((at % columns) as f64 - 1.0, (at / columns) as f64 - 2.0);
                let off_px = (bend.per_px - truth(x, y)) * HALF_PX * HALF_PX / 6.0;
                assert!(off_px.abs() < 0.2 * SIGMA_PX, "{columns}x{rows} {x} {y}: {off_px} px");
                let factor = bend.variance_px2(HALF_PX, SIGMA_PX * SIGMA_PX) / (SIGMA_PX * SIGMA_PX);
                assert!(factor.sqrt() < most, "{columns}x{rows} {x} {y}: {factor}");
            }
        }
    }

    #[test]
    fn a_corner_that_is_far_off_or_uncertain_bends_no_neighbour() {
        let clean = bends(&grid(9, 6, |_, _| 0.0), IN_PART);
        let strayed = bends(&grid(9, 6, |col, row| if (col, row) == (3, 2) { 0.4 } else { 0.0 }), IN_PART);
        let uncertain = Lattice::from_fn(9, 6, |col, row| {
            let strays = (col, row) == (3, 2);
            let known = grid(9, 6, |_, _| if strays { 0.08 } else { 0.0 }).get(col, row).copied()?;
            let covariance_px2 = known.covariance_px2 * if strays { 100.0 } else { 1.0 };
            Some(Point { covariance_px2, ..known })
        });
        for other in [strayed, bends(&uncertain, IN_PART)] {
            for (a, b) in clean.iter().zip(&other) {
                let off_px = (a[0].unwrap().per_px - b[0].unwrap().per_px) * HALF_PX * HALF_PX / 6.0;
                assert!(off_px.abs() < 0.2 * SIGMA_PX, "{off_px} px");
            }
        }
    }
}
