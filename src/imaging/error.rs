//! What can go wrong between a folder and its corners.

use camino::{Utf8Path, Utf8PathBuf};

use super::board::{self, Board, Kind};
use super::coded::measures::other_size_mm;
use super::coded::{HAS_MARKERS, HAS_TAGS};
use super::corners::{Skipped, reasons, too_few};
use super::image::{DRAWN, UNDECODABLE};
use crate::diagnostic::Explain;

/// Result of looking for corners.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What can go wrong between a folder and its corners.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Reading or writing files.
    #[error(transparent)]
    Files(#[from] crate::files::Error),
    /// A board that was not understood.
    #[error(transparent)]
    Board(#[from] board::Error),
    /// The folder is not there.
    #[error("folder not found")]
    NoFolder { path: Utf8PathBuf },
    /// A file where a folder was needed.
    #[error("a folder of pictures is needed, this is a file")]
    NotAFolder { path: Utf8PathBuf },
    /// A second place that is no folder of the right camera's pictures.
    #[error("{}", if *.found { "a folder of the right camera's pictures is needed, this is a file" } else { "folder not found" })]
    NotRight {
        path: Utf8PathBuf,
        /// Whether there is something of that name.
        found: bool,
    },
    /// Pictures, perhaps, but not which left one belongs to which right one.
    #[error("{statement}")]
    Unpaired {
        path: Utf8PathBuf,
        /// What was found.
        statement: String,
        /// The call that would do.
        hint: String,
    },
    /// A picture that cannot be cut into two equal halves.
    #[error("the picture is {px} px {}, which are no two equal halves", .way.0)]
    NoHalves {
        path: Utf8PathBuf,
        /// Its width or height, px.
        px: usize,
        /// "wide" or "high", and the flag that asked for the halves.
        way: (&'static str, &'static str),
    },
    /// Two files that would be the same picture of the same pair.
    #[error("two pictures claim the same side of pair `{pair}`: {first} and {second}")]
    SameName { pair: String, first: Utf8PathBuf, second: Utf8PathBuf },
    /// Not one pair of pictures could be read.
    #[error("not one pair of pictures can be read{}", reasons(.skipped))]
    NoneReadable {
        path: Utf8PathBuf,
        /// The pairs, and why.
        skipped: Vec<Skipped>,
    },
    /// The pictures do not tell how many squares the board has.
    #[error("the board's squares cannot be counted: {}{}", tally(.counts, *.of), reasons(.unread))]
    NotCounted {
        path: Utf8PathBuf,
        /// Columns and rows of whole boards that were seen, and in how many pictures.
        counts: Vec<((usize, usize), usize)>,
        /// Pictures in all.
        of: usize,
        /// Those that could not be read, and why.
        unread: Vec<Skipped>,
    },
    /// The board was not found often enough.
    #[error("{} pairs show {}; {}{}{}", too_few(*.found, *.total), shown(.board), at_least(*.needed), reasons(.skipped), the_rest(*.not_searched))]
    TooFewPairs {
        /// Pairs with the board in both pictures.
        found: usize,
        /// Pairs that were searched.
        total: usize,
        /// The others of the folder: those searched leave no doubt of them.
        not_searched: usize,
        needed: usize,
        /// The board that was looked for; boxed, for errors are returned everywhere.
        board: Box<Board>,
        path: Utf8PathBuf,
        /// The others, and why.
        skipped: Vec<Skipped>,
        /// Another board that the pictures show.
        other: Option<Box<Board>>,
    },
}

/// What pictures are read.
const SAVED_AS: &str = "save the pictures as the camera gives them: PNG, TIFF, BMP, JPEG or PGM of 8 or 16 bits a pixel, up to 300 million \
                        px and 1 GiB when decoded";

/// How pictures come out of a file whose name is that of a video.
pub fn of_video(file: &Utf8Path) -> Option<String> {
    /// In small letters.
    const ENDINGS: [&str; 8] = ["mp4", "avi", "mov", "mkv", "webm", "m4v", "mpg", "wmv"];
    let ending = file.extension()?.to_ascii_lowercase();
    ENDINGS.contains(&ending.as_str()).then(|| {
        format!(
            "`mkdir left; ffmpeg -i {file} -vf fps=1 left/%03d.png` takes pictures out of a video, and those of the other camera go into right/; \
             two videos seldom begin at one moment: the board must stand still"
        )
    })
}

/// What pictures have to show of a board.
fn shown(board: &Board) -> String {
    if board.is_coded() {
        format!("a part of the board of {} with a marker", board.said())
    } else {
        format!("the whole {} board", board.squares)
    }
}

fn at_least(needed: usize) -> String {
    if needed == 1 { "one is needed".to_owned() } else { format!("{needed} are needed") }
}

/// The pairs that were not searched, as a line of their own.
fn the_rest(not_searched: usize) -> String {
    match not_searched {
        0 => String::new(),
        n => {
            format!("\n  {n} more pairs were not searched: those that were are spread over all, and show another board")
        }
    }
}

/// Which whole boards were seen, and how often.
fn tally(counts: &[((usize, usize), usize)], of: usize) -> String {
    let each: Vec<String> = counts.iter().map(|((c, r), pictures)| format!("{c}x{r} squares in {pictures}")).collect();
    match each.as_slice() {
        [] => format!("none of {of} pictures shows a whole checkerboard with a margin all round"),
        each => format!("of {of} pictures of whole checkerboards, {}", each.join(", ")),
    }
}

impl Explain for Error {
    fn place(&self) -> Option<String> {
        match self {
            Error::Files(e) => e.place(),
            Error::Board(_) | Error::SameName { .. } => None,
            Error::NoFolder { path }
            | Error::NotAFolder { path }
            | Error::NotRight { path, .. }
            | Error::Unpaired { path, .. }
            | Error::NoHalves { path, .. }
            | Error::NoneReadable { path, .. }
            | Error::NotCounted { path, .. }
            | Error::TooFewPairs { path, .. } => Some(path.to_string()),
        }
    }

    fn hint(&self) -> Option<String> {
        match self {
            Error::Files(e) => e.hint(),
            Error::Board(e) => e.hint(),
            Error::NotAFolder { path } if let Some(hint) = of_video(path) => Some(hint),
            Error::NoFolder { path } | Error::NotAFolder { path } => crate::files::meant(
                path,
                Some("a folder of pairs holds left/ and right/ with equal names, or left*/right*, *_left/*_right, *_L/*_R names".to_owned()),
            ),
            Error::NotRight { path, .. } => crate::files::meant(
                path,
                Some(format!(
                    "a second folder is that of the right camera's pictures; other places are named by their flags, results by `--out {path}`"
                )),
            ),
            Error::Unpaired { hint, .. } => Some(hint.clone()),
            Error::NoHalves { way: (extent, flag), .. } => {
                Some(format!("`{flag}` is for pictures that hold both views, one as {extent} as the other"))
            }
            Error::SameName { .. } => Some("remove or rename one of them".to_owned()),
            Error::NoneReadable { .. } => Some(SAVED_AS.to_owned()),
            Error::NotCounted { of, unread, .. } if 2 * unread.len() > *of => Some(SAVED_AS.to_owned()),
            Error::NotCounted { counts, .. } => {
                let none = if counts.is_empty() { "; grids of circles are not read" } else { "" };
                Some(format!("count them: `--squares 20x20` is a board with 19x19 inner corners; one with markers needs `--board`{none}"))
            }
            Error::TooFewPairs { found, total, needed, board, skipped, other, .. } => {
                Some(of_too_few([*found, *total, *needed], board, skipped, other.as_deref()))
            }
        }
    }
}

/// What to do where a board was not found in enough pairs.
fn of_too_few([found, total, needed]: [usize; 3], board: &Board, skipped: &[Skipped], other: Option<&Board>) -> String {
    let is_unread = |s: &&Skipped| [UNDECODABLE, DRAWN].iter().any(|words| s.reason.contains(words));
    if 2 * skipped.iter().filter(is_unread).count() > skipped.len() {
        return SAVED_AS.to_owned();
    }
    match other {
        Some(other) if other_size_mm(board, other).is_some() => {
            format!("`--board {other}` has about the sizes that the pictures show: measure them on the print")
        }
        Some(other) if other.is_coded() => {
            format!("`--board {other}`: the pictures show markers as that board has them")
        }
        Some(other) if board.is_coded() => format!(
            "`--squares {}` with its `--square-mm` if it is a plain board: no marker can be read; else {}",
            other.squares,
            as_printed(board)
        ),
        Some(other) => {
            let (squares, columns, rows) = (other.squares, other.columns(), other.rows());
            format!("`--squares {squares}`: the pictures show a board with {columns}x{rows} inner corners")
        }
        // The board is the right one: most pairs show it.
        None if found > 0 && 2 * found >= total => {
            // Where a rig or its lenses are known, a few pairs do.
            let sure = if needed < 4 { "" } else { ", twelve make a sure rig" };
            format!("photograph the board in more places: {needed} pairs are the least{sure}")
        }
        None => of_kind_seen(board, skipped).unwrap_or_else(|| as_printed(board)),
    }
}

/// How the board is named that nothing was found of.
fn as_printed(board: &Board) -> String {
    if board.is_coded() {
        let named = match board.kind {
            Kind::Tags { .. } => "columns x rows of tags, family, tag and gap in mm",
            _ => "columns x rows, square and marker in mm, dictionary",
        };
        let plain = "one without markers is named `--squares CxR --square-mm MM`";
        return format!("`--board {board}` must be the board as printed: {named}; {plain}");
    }
    let (columns, rows) = (board.columns(), board.rows());
    format!(
        "`--squares` counts squares, not inner corners: {} means {columns}x{rows} inner corners; a board with markers is named by `--board`",
        board.squares
    )
}

/// How a board is named of another kind than was looked for, whose markers or tags pictures show. One that has markers
/// itself may stand among others: most pictures are to show them then.
fn of_kind_seen(board: &Board, skipped: &[Skipped]) -> Option<String> {
    let [markers, tags] = [HAS_MARKERS, HAS_TAGS].map(|begins| named(skipped, begins));
    let is_tags = tags.as_ref().map(|(count, _)| *count) > markers.as_ref().map(|(count, _)| *count);
    let most = if is_tags { tags } else { markers };
    let (_, name) = most.filter(|(count, _)| !board.is_coded() || 2 * count > skipped.len())?;
    Some(match is_tags {
        true => {
            let kind = if name.starts_with("tag") { "apriltag" } else { "aruco" };
            format!("name it: `--board {kind}:COLUMNSxROWS:{name}:TAG:GAP`, counts in tags as printed, sizes in mm")
        }
        false => format!(
            "name it: `--board charuco:COLUMNSxROWS:SQUARE:MARKER:{name}`, counts in squares as printed, sizes in mm"
        ),
    })
}

/// What most reasons name that say so, and how many do.
fn named(skipped: &[Skipped], says: &str) -> Option<(usize, String)> {
    let said = |skipped: &Skipped| {
        let (_, after) = skipped.reason.split_once(says)?;
        Some(after.split([' ', ';']).next()?.to_owned())
    };
    let all: Vec<String> = skipped.iter().filter_map(said).collect();
    let count = |one: &str| all.iter().filter(|other| *other == one).count();
    all.iter().map(|one| (count(one), one.clone())).max_by_key(|(count, _)| *count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_that_is_seen_is_not_doubted() {
        let hint = |found: usize, total: usize, board: &str| {
            let board = Box::new(board.parse().unwrap());
            let (path, skipped) = ("pictures".into(), Vec::new());
            Error::TooFewPairs { found, total, not_searched: 0, needed: 3, board, path, skipped, other: None }
                .hint()
                .unwrap()
        };
        for board in ["checker:9x7:20", "charuco:5x4:30:22:DICT_4X4_50"] {
            assert!(hint(2, 3, board).contains("in more places"), "{}", hint(2, 3, board));
            assert!(hint(2, 9, board).contains("--squares") || hint(2, 9, board).contains("--board"));
            assert!(hint(0, 0, board).contains("--squares") || hint(0, 0, board).contains("--board"));
        }
    }

    /// The hint where none of some pairs shows a board, for these reasons.
    fn hint_for(board: &str, reasons: &[&str], other: Option<&str>) -> String {
        let board = Box::new(board.parse().unwrap());
        let other = other.map(|other| Box::new(other.parse().unwrap()));
        let one = |reason: &&str| Skipped { pair: "1".to_owned(), reason: format!("both pictures: {reason}") };
        let skipped: Vec<Skipped> = reasons.iter().map(one).collect();
        let (total, path) = (skipped.len(), "pictures".into());
        Error::TooFewPairs { found: 0, total, not_searched: 0, needed: 4, board, path, skipped, other }.hint().unwrap()
    }

    #[test]
    fn a_board_of_another_kind_is_named_as_far_as_it_is_read() {
        let markers = format!("{HAS_MARKERS}DICT_APRILTAG_36h11 in its squares");
        let tags = format!("{HAS_TAGS}tag25h9");
        let aruco = format!("{HAS_TAGS}DICT_6X6_250");
        let (markers, tags, aruco, none) = (markers.as_str(), tags.as_str(), aruco.as_str(), "no board found");
        let (plain, charuco, grid) =
            ("checker:9x7:20", "charuco:5x4:30:22:DICT_4X4_50", "apriltag:5x4:tag36h11:24:7.2");
        for (board, reasons, hint) in [
            (plain, [markers, none, none], "`--board charuco:COLUMNSxROWS:SQUARE:MARKER:DICT_APRILTAG_36h11`"),
            (plain, [tags, markers, tags], "`--board apriltag:COLUMNSxROWS:tag25h9:TAG:GAP`"),
            (plain, [aruco, none, aruco], "`--board aruco:COLUMNSxROWS:DICT_6X6_250:TAG:GAP`"),
            (charuco, [tags, tags, none], "`--board apriltag:COLUMNSxROWS:tag25h9:TAG:GAP`"),
            (grid, [markers, none, markers], "`--board charuco:COLUMNSxROWS:SQUARE:MARKER:DICT_APRILTAG_36h11`"),
            // Something else beside a board that is not read.
            (charuco, [tags, none, none], "must be the board as printed"),
            (plain, [none, none, none], "counts squares, not inner corners"),
        ] {
            let said = hint_for(board, &reasons, None);
            assert!(said.contains(hint), "{board} {reasons:?}: {said}");
        }
        // As names of boards are read.
        assert!("charuco:5x4:30:22:DICT_APRILTAG_36h11".parse::<Board>().is_ok());
    }

    #[test]
    fn a_plain_board_that_is_seen_instead_is_counted() {
        let said = hint_for("apriltag:6x6:tag36h11:25:7.5", &["shows a board"], Some("checker:10x7:25"));
        assert!(said.starts_with("`--squares 10x7` with its `--square-mm`") && said.contains("as printed"), "{said}");
    }

    #[test]
    fn a_size_that_is_seen_is_to_be_measured() {
        let board = "charuco:5x4:30:22:DICT_4X4_50";
        let said = hint_for(board, &["another"], Some("charuco:5x4:30:18.4:DICT_4X4_50"));
        assert!(said.starts_with("`--board charuco:5x4:30:18.4:DICT_4X4_50`") && said.contains("measure"), "{said}");
        let said = hint_for(board, &["another"], Some("charuco:6x4:30:22:DICT_4X4_50"));
        assert!(said.starts_with("`--board charuco:6x4:30:22:DICT_4X4_50`") && !said.contains("measure"), "{said}");
    }
}
