//! The part of a picture that corners reached: the convex hull of all of them. Beyond it the lens model is extrapolated.

use nalgebra::Point2;
use serde::{Deserialize, Serialize};

/// A convex polygon, its points in order; empty for fewer than three points.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(from = "Vec<[f64; 2]>", into = "Vec<[f64; 2]>")]
pub struct Hull {
    points: Vec<Point2<f64>>,
}

impl From<Vec<[f64; 2]>> for Hull {
    fn from(points: Vec<[f64; 2]>) -> Hull {
        Hull::of(points.into_iter().map(|[x, y]| Point2::new(x, y)))
    }
}

impl From<Hull> for Vec<[f64; 2]> {
    fn from(hull: Hull) -> Vec<[f64; 2]> {
        hull.points.iter().map(|p| [p.x, p.y]).collect()
    }
}

impl Hull {
    /// The convex hull of some points (Andrew's monotone chain).
    pub fn of(points: impl IntoIterator<Item = Point2<f64>>) -> Hull {
        let mut sorted: Vec<Point2<f64>> = points.into_iter().collect();
        sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
        let mut lower = chain(sorted.iter());
        let upper = chain(sorted.iter().rev());
        lower.extend(upper);
        Hull { points: lower }
    }

    /// Its points in order.
    pub fn corners(&self) -> &[Point2<f64>] {
        &self.points
    }

    /// Whether a point lies inside or on the border.
    pub fn contains(&self, at: &Point2<f64>) -> bool {
        let count = self.points.len();
        count >= 3 && (0..count).all(|i| turn(&self.points[i], &self.points[(i + 1) % count], at) >= 0.0)
    }
}

/// Half of the hull, without its last point.
fn chain<'a>(sorted: impl Iterator<Item = &'a Point2<f64>>) -> Vec<Point2<f64>> {
    let mut chain: Vec<Point2<f64>> = Vec::new();
    for point in sorted {
        while let [.., a, b] = chain[..]
            && turn(&a, &b, point) <= 0.0
        {
            chain.pop();
        }
        chain.push(*point);
    }
    chain.pop();
    chain
}

/// Twice the area of a triangle, positive where its corners turn left (with y up).
fn turn(a: &Point2<f64>, b: &Point2<f64>, c: &Point2<f64>) -> f64 {
    (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_holds_its_middle_and_its_border_only() {
        let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0), (1.0, 2.0), (2.0, 0.0)];
        let hull = Hull::of(corners.map(|(x, y)| Point2::new(x, y)));
        for (x, y, inside) in
            [(2.0, 2.0, true), (4.0, 1.0, true), (4.1, 1.0, false), (-0.1, 2.0, false), (2.0, 5.0, false)]
        {
            assert_eq!(hull.contains(&Point2::new(x, y)), inside, "{x} {y}");
        }
        assert!(!Hull::of([Point2::origin()]).contains(&Point2::origin()));
        assert!(!Hull::default().contains(&Point2::origin()));
    }
}
