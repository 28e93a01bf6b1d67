//! Where a board's markers stand, and how they are printed.

use super::pitch::Pitch;
use super::squares::Squares;

/// Which squares of a ChArUco board hold markers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// The square in the upper left corner holds none: OpenCV's since 4.6.
    New,
    /// It holds one where the number of rows is even: OpenCV's before.
    Old,
    /// Every other one of every other row, the outermost are gaps: Kalibr's grid of tags.
    Tags,
    /// The same without black squares between the tags: OpenCV's.
    Grid,
}

impl Layout {
    /// Its name, for a person.
    pub fn said(self) -> &'static str {
        match self {
            Layout::New => "OpenCV's layout since 4.6",
            Layout::Old => "OpenCV's layout before 4.6",
            Layout::Tags => "Kalibr's layout",
            Layout::Grid => "OpenCV's layout, without black squares between them",
        }
    }

    /// What the end of a board's name says of it.
    pub fn of_name(self) -> &'static str {
        match self {
            Layout::Tags => ":kalibr",
            Layout::Grid => ":opencv",
            Layout::New => ":new",
            Layout::Old => ":old",
        }
    }

    /// Whether it is one of a grid of tags.
    pub fn is_of_tags(self) -> bool {
        matches!(self, Layout::Tags | Layout::Grid)
    }

    /// Whether the square in this column and row holds a marker.
    pub fn holds_marker(self, x: isize, y: isize) -> bool {
        match self {
            Layout::New => (x + y).rem_euclid(2) == 1,
            Layout::Old => (x + y).rem_euclid(2) == 0,
            Layout::Tags | Layout::Grid => x.rem_euclid(2) == 1 && y.rem_euclid(2) == 1,
        }
    }

    /// Whether the square in this column and row is dark: markers stand in light ones, and tags are dark themselves.
    pub fn is_dark(self, x: isize, y: isize) -> bool {
        match self {
            Layout::New | Layout::Old => !self.holds_marker(x, y),
            Layout::Tags => (x + y).rem_euclid(2) == 0,
            Layout::Grid => self.holds_marker(x, y),
        }
    }

    /// The number of the marker in a square that holds one, on a board of so many squares: they count row by row,
    /// Kalibr's tags from the lowest row up.
    pub fn number(self, Squares { columns, rows }: Squares, x: usize, y: usize) -> usize {
        // Of two rows one holds the larger half.
        let first = match self {
            Layout::New => columns / 2,
            Layout::Old => columns.div_ceil(2),
            Layout::Tags => return (rows - 2 - y) / 2 * (columns / 2) + x / 2,
            Layout::Grid => return y / 2 * (columns / 2) + x / 2,
        };
        y / 2 * columns + if y % 2 == 1 { first } else { 0 } + x / 2
    }
}

/// How a board's markers are printed: what a corner's window must leave out, and what is to be said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Print {
    /// Side of what a square holds beside its own colour, as a share of the square's: of a marker, of a tag's bits
    /// without its border.
    pub share: f64,
    /// How far apart the lines of corners are.
    pub pitch: Pitch,
    /// Which squares hold markers.
    pub layout: Layout,
    /// White on black.
    pub inverted: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markers_count_row_by_row() {
        for (columns, rows) in [(4, 5), (5, 4), (11, 8), (8, 11), (7, 7), (6, 6)] {
            for layout in [Layout::New, Layout::Old] {
                let squares = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
                let held = squares.filter(|(x, y)| layout.holds_marker(*x as isize, *y as isize));
                for (next, (x, y)) in held.enumerate() {
                    assert_eq!(layout.number(Squares { columns, rows }, x, y), next, "{columns}x{rows} {layout:?}");
                }
            }
        }
    }
}
