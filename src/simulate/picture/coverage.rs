//! How much of each cell of a grid a polygon covers, exactly.
//!
//! In: closed outlines in the grid's own coordinates (cell `(i, j)` is the square from `(i, j)` to `(i + 1, j + 1)`).
//! Out: covered area of each cell. Method: each piece of an outline inside one cell adds the area between itself and
//! the cell's right side; a running sum along the row carries the rest (Green's theorem cell by cell). Nothing is
//! sampled.

use nalgebra::Point2;

/// Areas under outlines, before the running sum.
#[derive(Debug, Clone)]
pub struct Coverage {
    width: usize,
    height: usize,
    /// One more column than the grid: what runs out on the right.
    cells: Vec<f32>,
}

impl Coverage {
    pub fn new(width: usize, height: usize) -> Coverage {
        Coverage { width, height, cells: vec![0.0; (width + 1) * height] }
    }

    /// Forgets all outlines.
    pub fn clear(&mut self) {
        self.cells.fill(0.0);
    }

    /// Adds a closed outline, multiplied by `sign`. Outlines that run clockwise in the picture (y down) count positive.
    pub fn add(&mut self, outline: &[Point2<f64>], origin: (f64, f64), scale: f64, sign: f64) {
        let Some(last) = outline.last() else { return };
        let cell = |p: &Point2<f64>| ((p.x - origin.0) * scale, (p.y - origin.1) * scale);
        let mut from = cell(last);
        for point in outline {
            let to = cell(point);
            self.add_edge(from, to, sign);
            from = to;
        }
    }

    fn add_edge(&mut self, from: (f64, f64), to: (f64, f64), sign: f64) {
        // Downward edges (y growing) lie on the right of a clockwise outline: they take away what the left ones add.
        let (top, bottom, sign) = if from.1 < to.1 { (from, to, -sign) } else { (to, from, sign) };
        let (y_start, y_end) = (top.1.max(0.0), bottom.1.min(self.height as f64));
        if y_start >= y_end || top.0.min(bottom.0) >= self.width as f64 {
            return;
        }
        let slope = (bottom.0 - top.0) / (bottom.1 - top.1);
        let x_at = |y: f64| top.0 + (y - top.1) * slope;
        let mut row = y_start as usize;
        let mut y = y_start;
        let mut x = x_at(y);
        while y < y_end && row < self.height {
            let y_next = y_end.min((row + 1) as f64);
            let x_next = if y_next == bottom.1 { bottom.0 } else { x_at(y_next) };
            self.add_in_row(row, x, x_next, (y_next - y) * sign);
            (x, y) = (x_next, y_next);
            row += 1;
        }
    }

    /// A piece of an edge within one row, from `x_a` to `x_b`, of signed height `rise`.
    fn add_in_row(&mut self, row: usize, x_a: f64, x_b: f64, rise: f64) {
        let limit = self.width as f64;
        let cells = &mut self.cells[row * (self.width + 1)..(row + 1) * (self.width + 1)];
        let (left, right) = if x_a < x_b { (x_a, x_b) } else { (x_b, x_a) };
        if right <= 0.0 {
            cells[0] += rise as f32;
            return;
        }
        if left >= limit {
            return;
        }
        let first = left.max(0.0) as usize;
        if right <= (first + 1) as f64 && left >= 0.0 {
            let carried = (0.5 * (left + right) - first as f64) * rise;
            cells[first] += (rise - carried) as f32;
            cells[first + 1] += carried as f32;
            return;
        }
        let per_x = rise / (right - left);
        if left < 0.0 {
            cells[0] += (-left * per_x) as f32;
        }
        let mut x = left.max(0.0);
        let end = right.min(limit);
        for cell in first..self.width {
            if x >= end {
                break;
            }
            let x_next = end.min((cell + 1) as f64);
            let part = (x_next - x) * per_x;
            let carried = (0.5 * (x + x_next) - cell as f64) * part;
            cells[cell] += (part - carried) as f32;
            cells[cell + 1] += carried as f32;
            x = x_next;
        }
    }

    /// Lays a tone over `values` (row by row, the grid's size) as far as the outlines cover each cell.
    /// `tone` is the value at the grid's first cell and its change along x and y, a cell.
    pub fn paint(&self, values: &mut [f32], tone: (f32, f32, f32)) {
        for row in 0..self.height {
            let cells = &self.cells[row * (self.width + 1)..][..self.width];
            let line = &mut values[row * self.width..][..self.width];
            let mut covered = 0.0f32;
            let mut value = tone.0 + tone.2 * row as f32;
            for (cell, out) in cells.iter().zip(line) {
                covered += cell;
                *out += (value - *out) * covered;
                value += tone.1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn areas(outline: &[(f64, f64)], width: usize, height: usize) -> Vec<f32> {
        let mut coverage = Coverage::new(width, height);
        let points: Vec<_> = outline.iter().map(|&(x, y)| Point2::new(x, y)).collect();
        coverage.add(&points, (0.0, 0.0), 1.0, 1.0);
        let mut values = vec![0.0; width * height];
        coverage.paint(&mut values, (1.0, 0.0, 0.0));
        values
    }

    #[test]
    fn a_triangle_covers_its_area_in_each_cell() {
        // Under the diagonal of a 2x2 grid, clockwise on the screen.
        let cells = areas(&[(0.0, 0.0), (2.0, 2.0), (0.0, 2.0)], 2, 2);
        assert_eq!(cells, [0.5, 0.0, 1.0, 0.5]);
    }

    #[test]
    fn what_lies_outside_the_grid_is_cut_off() {
        let cells = areas(&[(-5.0, -5.0), (1.5, -5.0), (1.5, 7.0), (-5.0, 7.0)], 3, 2);
        for (cell, expected) in cells.iter().zip([1.0, 0.5, 0.0, 1.0, 0.5, 0.0]) {
            assert!((cell - expected).abs() < 1e-6, "{cells:?}");
        }
    }

    #[test]
    fn a_slanted_quadrilateral_keeps_its_area() {
        let quad = [(0.3, 0.7), (8.2, 1.9), (9.1, 8.8), (1.2, 6.4)];
        let area: f64 = (0..4).map(|i| (quad[i], quad[(i + 1) % 4])).map(|(a, b)| 0.5 * (a.0 * b.1 - b.0 * a.1)).sum();
        let cells = areas(&quad, 10, 10);
        assert!((f64::from(cells.iter().sum::<f32>()) - area).abs() < 1e-5 * area);
        assert!(cells.iter().all(|&c| (-1e-6..=1.0 + 1e-6).contains(&c)));
    }
}
