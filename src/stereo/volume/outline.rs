//! The part of a picture that corners reached: the convex hull of all of them. Beyond it the lens model is
//! extrapolated.

use nalgebra::Point2;
use serde::{Deserialize, Serialize};

use crate::geometry::{convex_hull, turn};

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
    /// The convex hull of some points.
    pub fn of(points: impl IntoIterator<Item = Point2<f64>>) -> Hull {
        Hull { points: convex_hull(points.into_iter().collect()) }
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
