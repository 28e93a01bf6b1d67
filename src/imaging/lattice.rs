//! A rectangular grid of corners, some perhaps missing, and the turns it can be given.

use nalgebra::{Point2, Vector2};

use super::board::Pitch;
use crate::statistics::median;

/// Corners (or anything that belongs to one) by column and row.
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice<T> {
    pub columns: usize,
    pub rows: usize,
    /// Row by row; `None` where the corner is missing.
    pub cells: Vec<Option<T>>,
}

/// Places in a picture, px.
pub type Places = Lattice<Point2<f64>>;

impl Places {
    /// The median distance of neighbours along the rows and the columns, px; `None` without neighbours.
    pub fn step_px(&self) -> Option<f64> {
        self.side_px(Pitch::Even)
    }

    /// The median side of a square, px, by the distances of neighbours on a board whose lines follow one another like
    /// this; `None` without neighbours.
    pub fn side_px(&self, pitch: Pitch) -> Option<f64> {
        median(self.sides_px(pitch))
    }

    /// The least distance of neighbours, px; `None` without neighbours.
    pub fn least_step_px(&self) -> Option<f64> {
        self.sides_px(Pitch::Even).min_by(f64::total_cmp)
    }

    fn sides_px(&self, pitch: Pitch) -> impl Iterator<Item = f64> + '_ {
        let to = move |line: usize, p: &Point2<f64>, next: Option<&Point2<f64>>| {
            next.map(|next| (next - p).norm() / pitch.after(line as isize))
        };
        let both = move |(col, row, p): (usize, usize, &Point2<f64>)| {
            [to(col, p, self.get(col + 1, row)), to(row, p, self.get(col, row + 1))]
        };
        self.iter().flat_map(both).flatten()
    }

    /// Where a line of corners goes on beyond `(col, row)` in a direction, and the step that leads there: from the two
    /// or three corners before it. Steps of perspective change evenly enough from one square to the next. `None` where
    /// two are missing.
    pub fn next(&self, (col, row): (isize, isize), (dc, dr): (isize, isize)) -> Option<(Point2<f64>, Vector2<f64>)> {
        let back = |k: isize| self.around(col - k * dc, row - k * dr);
        let (near, second) = (back(0)?, back(1)?);
        let step = near - second;
        let step = back(2).map_or(step, |third| 2.0 * step - (second - third));
        Some((near + step, step))
    }
}

impl<T: Clone> Lattice<T> {
    /// A grid filled by column and row, in order.
    pub fn from_fn(columns: usize, rows: usize, mut at: impl FnMut(usize, usize) -> Option<T>) -> Lattice<T> {
        let cells = (0..columns * rows).map(|i| at(i % columns, i / columns)).collect();
        Lattice { columns, rows, cells }
    }

    /// The corner at a place; `None` where it is missing or outside of the grid.
    pub fn get(&self, col: usize, row: usize) -> Option<&T> {
        if col < self.columns && row < self.rows { self.cells[row * self.columns + col].as_ref() } else { None }
    }

    /// The corner at a place that may lie outside of the grid.
    pub fn around(&self, col: isize, row: isize) -> Option<&T> {
        self.get(usize::try_from(col).ok()?, usize::try_from(row).ok()?)
    }

    /// Number of corners that are there.
    pub fn count(&self) -> usize {
        self.cells.iter().flatten().count()
    }

    /// Corners that are there, with column and row.
    pub fn iter(&self) -> impl Iterator<Item = (usize, usize, &T)> {
        let columns = self.columns;
        self.cells.iter().enumerate().filter_map(move |(i, c)| c.as_ref().map(|c| (i % columns, i / columns, c)))
    }

    /// The four corners of the square after corner `(col, row)`, in order round it; `None` where one is missing.
    pub fn square(&self, col: usize, row: usize) -> Option<[&T; 4]> {
        Some([self.get(col, row)?, self.get(col + 1, row)?, self.get(col + 1, row + 1)?, self.get(col, row + 1)?])
    }

    /// The rows that have a corner in the first column.
    pub fn rows_at_front(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.rows).filter(|&row| self.get(0, row).is_some())
    }

    /// The grid without its first column.
    pub fn without_front(&self) -> Lattice<T> {
        Lattice::from_fn(self.columns - 1, self.rows, |col, row| self.get(col + 1, row).cloned())
    }

    /// What some of the corners are or tell, in a grid of the same size.
    pub fn filter_map<U: Clone>(&self, mut to: impl FnMut(usize, usize, &T) -> Option<U>) -> Lattice<U> {
        Lattice::from_fn(self.columns, self.rows, |col, row| to(col, row, self.get(col, row)?))
    }

    /// The same corners numbered from the opposite corner of the board.
    pub fn half_turn(&self) -> Lattice<T> {
        Lattice::from_fn(self.columns, self.rows, |col, row| {
            self.get(self.columns - 1 - col, self.rows - 1 - row).cloned()
        })
    }

    /// The same corners with columns along the former rows; handedness stays.
    pub fn quarter_turn(&self) -> Lattice<T> {
        Lattice::from_fn(self.rows, self.columns, |col, row| self.get(row, self.rows - 1 - col).cloned())
    }

    /// The same corners with the rows numbered backwards: the other handedness.
    pub fn flip_rows(&self) -> Lattice<T> {
        Lattice::from_fn(self.columns, self.rows, |col, row| self.get(col, self.rows - 1 - row).cloned())
    }

    /// The grid turned `quarters` times by 90 degrees.
    pub fn turned(&self, quarters: usize) -> Lattice<T> {
        match quarters % 4 {
            0 => self.clone(),
            1 => self.quarter_turn(),
            2 => self.half_turn(),
            _ => self.half_turn().quarter_turn(),
        }
    }

    /// The grid with something else at each corner.
    pub fn map<U: Clone>(&self, to: impl Fn(&T) -> U) -> Lattice<U> {
        Lattice {
            columns: self.columns,
            rows: self.rows,
            cells: self.cells.iter().map(|c| c.as_ref().map(&to)).collect(),
        }
    }
}

/// The place that a column and a row have after so many quarter turns, from the columns' direction to the rows', of a
/// grid that ends at `last`.
pub fn turned_place((col, row): (isize, isize), last: (isize, isize), quarters: usize) -> (isize, isize) {
    match quarters % 4 {
        0 => (col, row),
        1 => (last.1 - row, col),
        2 => (last.0 - col, last.1 - row),
        _ => (row, last.0 - col),
    }
}

/// Another numbering of the same corners: turned about corner (0, 0) by so many quarter turns, then moved by columns
/// and rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Renumbering {
    /// Quarter turns, from the columns' direction to the rows'.
    pub quarters: usize,
    /// Columns that the turned numbers are moved by.
    pub columns: isize,
    /// Rows that they are moved by.
    pub rows: isize,
}

impl Renumbering {
    /// The numbering that leads from one lattice to another of the same corners; `None` where none does.
    pub fn between<T: PartialEq + Clone>(from: &Lattice<T>, to: &Lattice<T>) -> Option<Renumbering> {
        let (col, row, first) = from.iter().next()?;
        let (to_col, to_row, _) = to.iter().find(|(_, _, value)| *value == first)?;
        (0..4).find_map(|quarters| {
            let (x, y) = Renumbering { quarters, columns: 0, rows: 0 }.of(col, row);
            let found = Renumbering { quarters, columns: to_col as isize - x, rows: to_row as isize - y };
            from.renumbered(&found, (to.columns, to.rows)).filter(|renumbered| renumbered == to).map(|_| found)
        })
    }

    /// The numbers of what had these.
    pub fn of(&self, col: usize, row: usize) -> (isize, isize) {
        let (x, y) = turned_place((col as isize, row as isize), (0, 0), self.quarters);
        (x + self.columns, y + self.rows)
    }
}

impl<T: Clone> Lattice<T> {
    /// The same corners with other numbers, in a lattice of this many columns and rows; `None` where one would lie
    /// outside of it.
    pub fn renumbered(&self, numbering: &Renumbering, (columns, rows): (usize, usize)) -> Option<Lattice<T>> {
        let mut lattice = Lattice { columns, rows, cells: vec![None; columns * rows] };
        for (col, row, value) in self.iter() {
            let (x, y) = numbering.of(col, row);
            let (x, y) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
            if x >= columns || y >= rows {
                return None;
            }
            lattice.cells[y * columns + x] = Some(value.clone());
        }
        Some(lattice)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered() -> Lattice<(usize, usize)> {
        Lattice::from_fn(4, 3, |col, row| (row != 2).then_some((col, row)))
    }

    #[test]
    fn four_quarter_turns_are_none_and_two_are_a_half() {
        let grid = numbered();
        assert_eq!(grid.quarter_turn().quarter_turn(), grid.half_turn());
        assert_eq!(grid.turned(3).turned(1), grid);
        assert_eq!(grid.flip_rows().flip_rows(), grid);
    }

    #[test]
    fn every_other_numbering_is_known_from_its_lattice() {
        let grid = numbered();
        for quarters in 0..4 {
            let turned = grid.turned(quarters);
            let moved = Lattice::from_fn(7, 6, |c, r| turned.get(c.checked_sub(1)?, r.checked_sub(2)?).copied());
            let found = Renumbering::between(&grid, &moved).unwrap();
            // A quarter turn of the lattice takes its columns along the former rows.
            assert_eq!(found.quarters, quarters);
            assert_eq!(grid.renumbered(&found, (7, 6)), Some(moved));
            assert_eq!(grid.renumbered(&found, (3, 2)), None);
        }
    }

    #[test]
    fn a_quarter_turn_keeps_handedness() {
        let turned = numbered().quarter_turn();
        let at = |col, row| *turned.get(col, row).unwrap_or(&(9, 9));
        let (o, x, y) = (at(1, 0), at(2, 0), at(1, 1));
        let cross = (x.0 as i32 - o.0 as i32) * (y.1 as i32 - o.1 as i32)
            - (x.1 as i32 - o.1 as i32) * (y.0 as i32 - o.0 as i32);
        assert_eq!(cross, 1, "{o:?} {x:?} {y:?}");
    }
}
