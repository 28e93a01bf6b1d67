//! The pixels that one corner is fitted to.
//!
//! A window is a parallelogram along the corner's two edges. Pixels near an edge enter one by one; far from both edges
//! the picture is flat, and the mean of a block of pixels tells as much as they do, so it enters once with
//! their weight. Saturated pixels are left out.

use nalgebra::{Matrix2, Point2, Vector2};

use super::picture::Picture;

/// Side of a block in the flat parts of a window, px: small, so that few pixels near an edge are taken along.
const BLOCK_PX: usize = 4;

/// Pixels that are worked on side by side: enough that the compiler makes vector loops of them.
pub const LANES: usize = 32;

/// Observations of a window, places relative to its start.
#[derive(Debug, Clone, Default)]
pub struct Window {
    /// In groups; the last is padded with weight zero.
    pub groups: Vec<Group>,
    /// Number of observations.
    pub count: usize,
    /// Number of pixels that were left out as saturated.
    pub saturated: usize,
}

/// A few observations side by side.
#[derive(Debug, Clone, Copy)]
pub struct Group {
    /// x - x0, px.
    pub x: [f64; LANES],
    /// y - y0, px.
    pub y: [f64; LANES],
    /// Grey value, a mean where it stands for several pixels.
    pub grey: [f64; LANES],
    /// Square root of the number of pixels it stands for.
    pub weight: [f64; LANES],
}

/// Where a window lies and what is near.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// Its middle, px; places in the window are relative to it.
    pub start: Point2<f64>,
    /// From the middle to the middles of two sides, along the two edges, px.
    pub halves: [Vector2<f64>; 2],
    /// Distance from an edge up to which pixels enter one by one, px.
    pub band_px: f64,
}

impl Window {
    /// Adds an observation that stands for `weight^2` pixels.
    pub fn push(&mut self, x: f64, y: f64, grey: f64, weight: f64) {
        let lane = self.count % LANES;
        if lane == 0 {
            let zero = [0.0; LANES];
            self.groups.push(Group { x: zero, y: zero, grey: zero, weight: zero });
        }
        if let Some(group) = self.groups.last_mut() {
            (group.x[lane], group.y[lane], group.grey[lane], group.weight[lane]) = (x, y, grey, weight);
        }
        self.count += 1;
    }

    /// Fills the window anew; grey values from `saturation` on are left out.
    pub fn collect(&mut self, picture: &Picture, saturation: f64, frame: &Frame) {
        self.groups.clear();
        (self.count, self.saturated) = (0, 0);
        let [a, b] = frame.halves;
        let Some(inverse) = Matrix2::from_columns(&[a, b]).try_inverse() else { return };
        let reach = Vector2::new(a.x.abs() + b.x.abs(), a.y.abs() + b.y.abs());
        let block = BLOCK_PX;
        let first = |middle: f64, reach: f64| (middle - reach).ceil().max(0.0) as usize;
        let last =
            |middle: f64, reach: f64, size: usize| ((middle + reach).floor() as isize + 1).clamp(0, size as isize);
        let (x0, y0) = (first(frame.start.x, reach.x), first(frame.start.y, reach.y));
        let x1 = last(frame.start.x, reach.x, picture.width) as usize;
        let y1 = last(frame.start.y, reach.y, picture.height) as usize;
        let inside = Inside { frame, inverse, normals: [a, b].map(|v| Vector2::new(-v.y, v.x).normalize()) };
        for y in (y0..y1).step_by(block) {
            for x in (x0..x1).step_by(block) {
                let (w, h) = (block.min(x1 - x), block.min(y1 - y));
                match inside.flat(x, y, w, h) {
                    Some(true) => self.add_mean(picture, saturation, frame, (x, y, w, h)),
                    Some(false) => {}
                    None => self.add_pixels(picture, saturation, &inside, (x, y, w, h)),
                }
            }
        }
    }

    fn add_mean(
        &mut self,
        picture: &Picture,
        saturation: f64,
        frame: &Frame,
        (x, y, w, h): (usize, usize, usize, usize),
    ) {
        let (mut sum, mut sum_x, mut sum_y, mut count) = (0.0, 0.0, 0.0, 0.0);
        for py in y..y + h {
            for px in x..x + w {
                let grey = picture.at(px, py);
                if grey < saturation {
                    sum += grey;
                    sum_x += px as f64;
                    sum_y += py as f64;
                    count += 1.0;
                }
            }
        }
        self.saturated += w * h - count as usize;
        if count > 0.0 {
            self.push(sum_x / count - frame.start.x, sum_y / count - frame.start.y, sum / count, f64::sqrt(count));
        }
    }

    fn add_pixels(
        &mut self,
        picture: &Picture,
        saturation: f64,
        inside: &Inside,
        (x, y, w, h): (usize, usize, usize, usize),
    ) {
        for py in y..y + h {
            for px in x..x + w {
                let d = Vector2::new(px as f64, py as f64) - inside.frame.start.coords;
                if (inside.inverse * d).amax() > 1.0 {
                    continue;
                }
                let grey = picture.at(px, py);
                if grey < saturation {
                    self.push(d.x, d.y, grey, 1.0);
                } else {
                    self.saturated += 1;
                }
            }
        }
    }
}

struct Inside<'a> {
    frame: &'a Frame,
    inverse: Matrix2<f64>,
    normals: [Vector2<f64>; 2],
}

impl Inside<'_> {
    /// True for a block wholly inside and away from both edges, false for one wholly outside, `None` for any other.
    fn flat(&self, x: usize, y: usize, w: usize, h: usize) -> Option<bool> {
        let half = Vector2::new((w - 1) as f64 / 2.0, (h - 1) as f64 / 2.0);
        let d = Vector2::new(x as f64, y as f64) + half - self.frame.start.coords;
        let at = self.inverse * d;
        let reach = self.inverse.abs() * half;
        if (0..2).any(|k| at[k].abs() - reach[k] > 1.0) {
            return Some(false);
        }
        let whole = (0..2).all(|k| at[k].abs() + reach[k] <= 1.0);
        let away = self.normals.iter().all(|n| n.dot(&d).abs() - n.abs().dot(&half) > self.frame.band_px);
        (whole && away).then_some(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::picture::Pixels;

    #[test]
    fn blocks_stand_for_all_their_pixels() {
        let pixels = (0..100 * 100).map(|k| (k % 100 + k / 100) as u8).collect();
        let picture = Picture { width: 100, height: 100, pixels: Pixels::Eight(pixels) };
        let halves = [Vector2::new(30.0, 8.0), Vector2::new(-8.0, 30.0)];
        let of = |band_px: f64| {
            let mut window = Window::default();
            window.collect(&picture, 256.0, &Frame { start: Point2::new(49.3, 50.2), halves, band_px });
            let sum = |value: &dyn Fn(&Group, usize) -> f64| -> f64 {
                window.groups.iter().flat_map(|g| (0..LANES).map(move |l| g.weight[l].powi(2) * value(g, l))).sum()
            };
            ([sum(&|_, _| 1.0), sum(&|g, l| g.grey[l]), sum(&|g, l| g.x[l])], window.count)
        };
        let ((single, n), (blocks, m)) = (of(1e9), of(6.0));
        // The picture is a plane, so means lose nothing; only rounding differs.
        assert!(
            single.iter().zip(&blocks).all(|(a, b)| (a - b).abs() < 1e-6 * a.abs().max(1e3)),
            "{single:?} {blocks:?}"
        );
        assert!(m < 2 * n / 3, "{m} of {n}");
    }

    #[test]
    fn a_window_over_the_border_keeps_what_is_there() {
        let picture = Picture { width: 10, height: 10, pixels: Pixels::Eight(vec![255; 100]) };
        let frame = Frame {
            start: Point2::new(0.0, 0.0),
            halves: [Vector2::new(5.0, 0.0), Vector2::new(0.0, 5.0)],
            band_px: 1e9,
        };
        let mut window = Window::default();
        window.collect(&picture, 256.0, &frame);
        assert_eq!((window.count, window.saturated), (36, 0));
        window.collect(&picture, 255.0, &frame);
        assert_eq!((window.count, window.saturated), (0, 36));
        window.collect(&picture, 255.0, &Frame { start: Point2::new(-50.0, 1e6), ..frame });
        assert_eq!(window.count, 0);
    }
}
