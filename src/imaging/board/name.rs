//! Boards by their names: `checker:20x20:10`, `charuco:11x8:15:11:DICT_5X5_100`, `apriltag:6x6:tag36h11:35.2:10.56`,
//! `aruco:6x4:DICT_6X6_250:30:7.5`.
//!
//! In: what was typed, or a board. Out: the board, or the reason why there is none; its name.

use std::fmt;
use std::str::FromStr;

use super::Error;
use super::certificate::{Board, Kind, MOST_STRETCH, SQUARES_MM};
use super::dictionary::Dictionary;
use super::layout::Layout;
use super::squares::Squares;

impl fmt::Display for Board {
    /// As it is named on the command line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (squares, side) = (self.squares, self.side_written());
        match self.kind {
            Kind::Checker => write!(f, "checker:{squares}:{side}"),
            Kind::Charuco { marker_mm, dictionary, layout } => {
                let layout = layout.map_or("", Layout::of_name);
                write!(f, "charuco:{squares}:{side}:{marker_mm}:{}{layout}", dictionary.name())
            }
            Kind::Tags { gap_mm, family, layout, .. } => {
                let ([columns, rows], layout) = (self.tags(), layout.map_or("", Layout::of_name));
                match family.is_of_tags() {
                    true => write!(f, "apriltag:{columns}x{rows}:{}:{side}:{gap_mm}{layout}", family.said()),
                    // There is one layout of them.
                    false => write!(f, "aruco:{columns}x{rows}:{}:{side}:{gap_mm}", family.said()),
                }
            }
        }
    }
}

impl TryFrom<String> for Board {
    type Error = Error;
    fn try_from(text: String) -> Result<Board, Error> {
        text.parse()
    }
}

impl FromStr for Board {
    type Err = Error;

    /// Reads `checker:20x20:10`, `charuco:11x8:15:11:DICT_5X5_100`, `apriltag:6x6:tag36h11:35.2:10.56` or
    /// `aruco:6x4:DICT_6X6_250:30:7.5`. Squares of a board with markers are counted as printed: columns first. A square
    /// that is not quite one has a width and a height: `checker:20x20:10x10.01`.
    fn from_str(text: &str) -> Result<Board, Error> {
        let refuse = |why: String| Error::Name { found: text.to_owned(), why };
        let (kind, rest) = text.split_once(':').ok_or_else(|| refuse(without_colon(text)))?;
        let fields: Vec<&str> = rest.split(':').map(str::trim).collect();
        let length = |text: &str| length_mm(text).map_err(refuse);
        let sides = |text: &str| sides_mm(text).map_err(refuse);
        match (kind.trim().to_ascii_lowercase().as_str(), fields.as_slice()) {
            ("checker" | "checkerboard" | "chessboard", [squares, square_mm]) => {
                let (square_mm, stretch) = sides(square_mm)?;
                Ok(Board { stretch, ..Board::checker(squares.parse()?, square_mm) })
            }
            ("charuco", [squares, square_mm, marker_mm, dictionary, layout @ ..]) if layout.len() <= 1 => {
                let known = [("old", Layout::Old), ("new", Layout::New), ("legacy", Layout::Old)];
                let layout = layout_named(layout, &known).map_err(&refuse)?;
                let ((square_mm, stretch), marker_mm) = (sides(square_mm)?, length(marker_mm)?);
                let dictionary = Dictionary::named(dictionary).map_err(&refuse)?;
                let board = Board {
                    squares: Squares::as_printed(squares)?,
                    square_mm,
                    stretch,
                    kind: Kind::Charuco { marker_mm, dictionary, layout },
                };
                board.check_markers().map(|()| board).map_err(refuse)
            }
            ("checker" | "checkerboard" | "chessboard", _) => {
                Err(refuse("a checkerboard is `checker:COLSxROWS:SQUARE_MM`".to_owned()))
            }
            ("charuco", _) => {
                Err(refuse("a ChArUco board is `charuco:COLSxROWS:SQUARE_MM:MARKER_MM:DICTIONARY`".to_owned()))
            }
            ("apriltag" | "aprilgrid", [tags, family, tag_mm, gap_mm, layout @ ..]) if layout.len() <= 1 => {
                let known = [("kalibr", Layout::Tags), ("opencv", Layout::Grid)];
                let layout = layout_named(layout, &known).map_err(&refuse)?;
                let family = Dictionary::of_tags(family).map_err(&refuse)?;
                of_tags(Squares::of_tags(tags)?, family, [tag_mm, gap_mm], layout).map_err(refuse)
            }
            ("aruco" | "gridboard", [tags, dictionary, marker_mm, gap_mm]) => {
                let dictionary = Dictionary::named(dictionary).map_err(&refuse)?;
                of_tags(Squares::of_tags(tags)?, dictionary, [marker_mm, gap_mm], Some(Layout::Grid)).map_err(refuse)
            }
            ("apriltag" | "aprilgrid", _) => Err(refuse(
                "a grid of AprilTags is `apriltag:COLSxROWS:FAMILY:TAG_MM:GAP_MM`, counted in tags".to_owned(),
            )),
            ("aruco" | "gridboard", _) => Err(refuse(
                "a grid of ArUco markers is `aruco:COLSxROWS:DICTIONARY:MARKER_MM:GAP_MM`, counted in markers"
                    .to_owned(),
            )),
            (other, _) => Err(refuse(format!(
                "there is no kind of board named `{other}`; there are checker, charuco, apriltag and aruco"
            ))),
        }
    }
}

/// The layout that a name ends with, if it says one; the reason where it is none of those known, of which the first two
/// are named.
fn layout_named(said: &[&str], known: &[(&str, Layout)]) -> Result<Option<Layout>, String> {
    let Some(word) = said.first() else { return Ok(None) };
    let same = known.iter().find(|(name, _)| word.eq_ignore_ascii_case(name));
    let names = || known.iter().take(2).map(|(name, _)| format!("`{name}`")).collect::<Vec<_>>().join(" and ");
    same.map(|(_, layout)| Some(*layout)).ok_or_else(|| format!("`{word}` is no layout; there are {}", names()))
}

/// A grid of tags or markers of a side and a gap; the reason where there can be none.
fn of_tags(
    Squares { columns, rows }: Squares,
    family: Dictionary,
    [side_mm, gap_mm]: [&str; 2],
    layout: Option<Layout>,
) -> Result<Board, String> {
    let ((square_mm, stretch), gap_mm) = (sides_mm(side_mm)?, length_mm(gap_mm)?);
    let squares = Squares { columns: 2 * columns + 1, rows: 2 * rows + 1 };
    let board = Board { squares, square_mm, stretch, kind: Kind::Tags { gap_mm, family, layout, spread_mm: 0.0 } };
    board.check_markers().map(|()| board)
}

/// What a name lacks that has no `:`.
fn without_colon(text: &str) -> String {
    match text.parse::<Squares>() {
        Ok(squares) => format!("the kind and the size are missing; with squares of 25 mm it is `checker:{squares}:25`"),
        Err(_) => "it has no `:`; a checkerboard is `checker:COLSxROWS:SQUARE_MM`".to_owned(),
    }
}

/// A length, mm; the reason where it is none.
fn length_mm(text: &str) -> Result<f64, String> {
    let (least, most) = SQUARES_MM.into_inner();
    let known = text.parse().ok().filter(|mm| SQUARES_MM.contains(mm));
    known.ok_or_else(|| format!("`{text}` is no length from {least} to {most} mm"))
}

/// The width of a square, mm, and its height over that: `10`, or `10x10.01`.
fn sides_mm(text: &str) -> Result<(f64, f64), String> {
    let Some((width, height)) = text.split_once('x') else { return Ok((length_mm(text)?, 1.0)) };
    let (width, height) = (length_mm(width)?, length_mm(height)?);
    let stretch = height / width;
    // Printers stretch paper by less; other counts or another board are off by more.
    let is_square = (1.0 - MOST_STRETCH..=1.0 + MOST_STRETCH).contains(&stretch);
    if is_square { Ok((width, stretch)) } else { Err(format!("`{text}` is no square")) }
}

/// Widths of gaps, in sides of a tag: black squares that are wider than the tags between them, or narrower than their
/// bits, are no grid of tags.
const GAPS: std::ops::RangeInclusive<f64> = 0.1..=1.0;

impl Board {
    /// Its counts and sizes, for a person.
    pub fn said(&self) -> String {
        let side = self.side_said();
        match self.kind {
            Kind::Checker | Kind::Charuco { .. } => format!("{} squares of {side} mm", self.squares),
            Kind::Tags { gap_mm, .. } => {
                let [columns, rows] = self.tags();
                format!("{columns}x{rows} tags of {side} mm, {gap_mm} mm apart")
            }
        }
    }

    /// The same board with the markers of another dictionary, where that has enough of them.
    pub fn with_dictionary(self, other: Dictionary) -> Option<Board> {
        let kind = match self.kind {
            Kind::Checker => return None,
            Kind::Charuco { marker_mm, layout, .. } => Kind::Charuco { marker_mm, dictionary: other, layout },
            Kind::Tags { gap_mm, layout, spread_mm, .. } => Kind::Tags { gap_mm, family: other, layout, spread_mm },
        };
        let board = Board { kind, ..self };
        board.check_markers().is_ok().then_some(board)
    }

    /// The side of its markers, or the width of the gaps between its tags, mm.
    pub fn marked_mm(&self) -> Option<f64> {
        match self.kind {
            Kind::Checker => None,
            Kind::Charuco { marker_mm: mm, .. } | Kind::Tags { gap_mm: mm, .. } => Some(mm),
        }
    }

    /// The same board with markers of another side, or with other gaps between its tags, where there can be such a one.
    pub fn with_marked_mm(self, mm: f64) -> Option<Board> {
        let kind = match self.kind {
            Kind::Checker => return None,
            Kind::Charuco { dictionary, layout, .. } => Kind::Charuco { marker_mm: mm, dictionary, layout },
            Kind::Tags { family, layout, spread_mm, .. } => Kind::Tags { gap_mm: mm, family, layout, spread_mm },
        };
        let board = Board { kind, ..self };
        board.check_markers().is_ok().then_some(board)
    }

    /// Whether it is this board, or this board with the first markers of its dictionary alone.
    pub fn has_all_of(&self, other: &Board) -> bool {
        self == other
            || self.kind.dictionary().zip(other.kind.dictionary()).is_some_and(|(own, others)| {
                own.begins_with(others) && other.with_dictionary(own).is_some_and(|same| same == *self)
            })
    }

    /// Why there can be no such board, where there can be none.
    fn check_markers(&self) -> Result<(), String> {
        let square_mm = self.square_mm;
        match self.kind {
            Kind::Charuco { marker_mm, .. } if marker_mm >= square_mm => {
                Err(format!("a marker of {marker_mm} mm does not fit into a square of {square_mm} mm"))
            }
            Kind::Charuco { dictionary, .. } => {
                // The old layout of an even number of rows has markers in the other squares, and as many.
                let markers = self.squares.columns * self.squares.rows / 2;
                let (name, count) = (dictionary.name(), dictionary.count());
                let lacks = format!("{} squares hold {markers} markers, {name} has {count}", self.squares);
                if markers <= count { Ok(()) } else { Err(lacks) }
            }
            Kind::Tags { gap_mm, .. } if !GAPS.contains(&(gap_mm / square_mm)) => {
                Err(format!("gaps of {gap_mm} mm between tags of {square_mm} mm are no grid's"))
            }
            Kind::Tags { family, .. } => {
                let ([columns, rows], name, count) = (self.tags(), family.said(), family.count());
                let lacks = format!("{columns}x{rows} tags are {}, {name} has {count}", columns * rows);
                if columns * rows <= count { Ok(()) } else { Err(lacks) }
            }
            Kind::Checker => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boards_read_back_as_they_are_named() {
        for text in [
            "checker:20x20:10",
            "checker:9x7:20x20.25",
            "charuco:4x5:54:40.5:DICT_4X4_1000",
            "charuco:11x8:15:11:DICT_ARUCO_ORIGINAL:old",
            "apriltag:6x6:tag36h11:35.2:10.56",
            "apriltag:7x4:tag25h9:40x40.1:8",
            "apriltag:7x4:tag25h9:40:8:opencv",
            "apriltag:7x4:tag25h9:40:8:kalibr",
            "aruco:6x4:DICT_6X6_250:30:7.5",
        ] {
            let board: Board = text.parse().unwrap();
            assert_eq!(board.to_string(), text);
        }
        let short: Board = "CharUco:4x5:54:40.5:4x4_50".parse().unwrap();
        assert_eq!(short.to_string(), "charuco:4x5:54:40.5:DICT_4X4_50");
        for (other, usual) in [
            ("chessboard:9x7:20", "checker:9x7:20"),
            ("aprilgrid:6x6:tag36h11:35.2:10.56", "apriltag:6x6:tag36h11:35.2:10.56"),
            ("aruco:6x4:6x6_250:30:7.5", "aruco:6x4:DICT_6X6_250:30:7.5"),
            ("aruco:6x4:DICT_APRILTAG_36h11:30:7.5", "apriltag:6x4:tag36h11:30:7.5:opencv"),
        ] {
            assert_eq!(other.parse::<Board>().unwrap(), usual.parse().unwrap());
        }
    }

    #[test]
    fn boards_that_cannot_be_are_refused_with_the_reason() {
        for (text, why) in [
            ("20x20", "`checker:20x20:25`"),
            ("board", "no `:`"),
            ("checker:20x20", "checker:COLSxROWS:SQUARE_MM"),
            ("dots:20x20:10", "there are checker, charuco, apriltag and aruco"),
            ("aruco:6x4:DICT_6X6_250:30", "aruco:COLSxROWS:DICTIONARY:MARKER_MM:GAP_MM"),
            ("aruco:6x4:DICT_9X9_250:30:7.5", "no dictionary `DICT_9X9_250`"),
            ("aruco:10x6:DICT_4X4_50:30:7.5", "10x6 tags are 60, DICT_4X4_50 has 50"),
            ("apriltag:6x4:DICT_6X6_250:30:7.5", "a grid of them is `aruco:COLSxROWS:DICT_6X6_250:MARKER_MM:GAP_MM`"),
            ("checker:20x20:10x12", "no square"),
            ("apriltag:6x6:tag36h11:35.2:10.56:opncv", "`kalibr` and `opencv`"),
            ("apriltag:6x6:tag36h11:35.2", "apriltag:COLSxROWS:FAMILY:TAG_MM:GAP_MM"),
            ("apriltag:6x6:tag36h12:35.2:10.56", "no family of tags"),
            ("apriltag:6:tag36h11:35.2:10.56", "COLUMNSxROWS tags"),
            ("apriltag:6x6:tag36h11:35.2:40", "no grid's"),
            ("apriltag:6x6:tag16h5:35.2:10", "tag16h5 has 30"),
            ("charuco:4x5:54:60:DICT_4X4_50", "does not fit"),
            ("charuco:4x5:54:40:DICT_4X4_51", "DICT_4X4_50"),
            ("charuco:20x20:54:40:DICT_4X4_50", "200 markers"),
            ("charuco:4x5:0:40:DICT_4X4_50", "no length"),
        ] {
            let error = text.parse::<Board>().unwrap_err().to_string();
            assert!(error.contains(why), "{text}: {error}");
        }
    }
}
