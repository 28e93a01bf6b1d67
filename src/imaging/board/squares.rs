//! How many squares or tags a board has.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::Error;

/// Number of squares of a board; of a plain one the larger number first, of one with markers as printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Squares {
    /// Squares along x, the longer side of a plain board.
    pub columns: usize,
    /// Squares along y.
    pub rows: usize,
}

impl FromStr for Squares {
    type Err = Error;

    /// Reads `20x20`. `6x7` and `7x6` are the same board.
    fn from_str(text: &str) -> Result<Squares, Error> {
        let Squares { columns, rows } = Squares::as_printed(text)?;
        Ok(Squares { columns: columns.max(rows), rows: columns.min(rows) })
    }
}

impl Squares {
    /// Reads `6x6` as six columns of six tags.
    pub fn of_tags(text: &str) -> Result<Squares, Error> {
        counts(text, 1..100).ok_or_else(|| Error::TagCounts { found: text.to_owned() })
    }

    /// Reads `8x11` as eight columns of eleven squares.
    pub fn as_printed(text: &str) -> Result<Squares, Error> {
        // Two inner corners each way are the least that has a direction; 200 is far beyond any picture.
        counts(text, 3..201).ok_or_else(|| Error::Size { found: text.to_owned() })
    }
}

/// Two counts in a range, columns first.
fn counts(text: &str, range: Range<usize>) -> Option<Squares> {
    let (columns, rows) = text.split_once(['x', 'X'])?;
    let count = |text: &str| text.trim().parse().ok().filter(|count| range.contains(count));
    Some(Squares { columns: count(columns)?, rows: count(rows)? })
}

impl TryFrom<String> for Squares {
    type Error = Error;
    fn try_from(text: String) -> Result<Squares, Error> {
        text.parse()
    }
}

impl From<Squares> for String {
    fn from(squares: Squares) -> String {
        squares.to_string()
    }
}

impl fmt::Display for Squares {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.columns, self.rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn larger_count_comes_first() {
        let squares: Squares = "6x7".parse().unwrap();
        assert_eq!(squares.to_string(), "7x6");
    }

    #[test]
    fn nonsense_is_refused() {
        for text in ["", "7", "7x", "x6", "7x2", "-7x6", "7.5x6", "7x6x5", "1000x6"] {
            assert!(text.parse::<Squares>().is_err(), "{text}");
        }
    }
}
