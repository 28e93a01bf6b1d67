//! Where a plain board is, to about a pixel of a small copy.
//!
//! In: a picture and the board's size. Out: a reduced copy and a grid of coarse corners on it, right-handed, columns
//! along the longer side, turned as far as the colours tell. The copy is an area average of about a million pixels: the
//! board is seen there as well as on 26 Mpx, in a twentieth of the time. Of large pictures a copy of a quarter of that
//! is tried before, and will do where it shows all of a board with large squares; a ladder of attempts on finer and
//! coarser copies follows where the first fails. Its work is bounded by the pixels of the copies, whatever they show:
//! no clock decides what is found, and OpenCV's classic detector is not among the attempts, because fine texture keeps
//! it busy for minutes (and what it finds is found without it). Goes wrong: no board, another board, or a board of
//! which too little is in view; each is a reason in words.

use super::colour::{right_handed, turn_by_colours};
use super::detected::{Detected, LEAST_SEEN, Open, Refusal, glance_level, on_a_copy};
use super::growth::largest_grid;
use super::{continuation, extent};
use crate::imaging::image::pyramid::{Level, coarse_factor, to_full_size};
use crate::imaging::image::{Grey8, Picture};
use crate::imaging::lattice::{Lattice, Places, Renumbering};
use crate::imaging::{Board, Squares, coded};
use crate::opencv::find_board;

/// How many times more of the board another copy must show to be worth more than the copy before it.
const WORTH: f64 = 1.03;

/// One attempt: on which copy, in which way.
type Attempt = (Level, Way);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    /// Corner by corner, for boards that need not be wholly there.
    Grow,
    /// OpenCV's sector-based detector: slower, sees through more blur and noise.
    Sectors,
    /// Corner by corner where each pixel is as dark as the darkest beside it: in overexposed pictures white bleeds into
    /// small dark squares, until these no longer touch.
    Darkened,
}

/// What was found so far.
#[derive(Default)]
struct Search {
    /// The most of the board, where it is known which part.
    partial: Option<Detected>,
    /// The most telling grid that is not the board, and the copy it was seen on.
    seen: Option<(Places, Level)>,
}

impl Search {
    /// True where an attempt could only find less than is known.
    fn is_pointless(&self, (level, way): Attempt) -> bool {
        /// Squares of this many pixels of a copy are not seen better on a finer one.
        const ENOUGH_PX: f64 = 30.0;
        match way {
            // All of it was looked at corner by corner: more looking would only find a part of what is there.
            Way::Sectors | Way::Darkened => {
                self.partial.is_some() || self.seen.as_ref().is_some_and(|(grid, _)| tells(grid).0)
            }
            Way::Grow => {
                let partial = self.partial.as_ref().map(|p| (&p.corners, p.level));
                let known = [partial, self.seen.as_ref().map(|(grid, level)| (grid, *level))];
                let is_enough = |(grid, of): &(&Places, Level)| {
                    level.scale() < of.scale() && grid.step_px().is_some_and(|side| side > ENOUGH_PX)
                };
                known.iter().flatten().any(is_enough)
            }
        }
    }
}

/// Looks for the board that was asked for, plain or with markers; the reason where it was not found.
pub fn detect(picture: &Picture, board: Board) -> Result<Detected, Refusal> {
    if board.is_coded() {
        return coded::detect(picture, board);
    }
    detect_plain(picture, board).map_err(|refusal| coded::of_other_kind(picture, &board).map_or(refusal, Refusal::from))
}

fn detect_plain(picture: &Picture, board: Board) -> Result<Detected, Refusal> {
    if let Some(detected) = at_a_glance(picture, board) {
        return Ok(detected);
    }
    let mut search = Search::default();
    let mut last: Option<(Level, Grey8)> = None;
    for (level, way) in ladder(picture) {
        if search.is_pointless((level, way)) {
            continue;
        }
        let small = match last.take() {
            Some((known, small)) if known == level => small,
            _ => level.copy(picture),
        };
        if let Some(grid) = found(&small, (level, way), board, &mut search) {
            let complete = grid.count() == board.corner_count();
            // The whole of a board is not less than what else hangs together in the picture; what was grown ends where
            // the board ends.
            let less = |(seen, _): &(Places, Level)| match way {
                Way::Grow | Way::Darkened => tells(seen) > tells(&grid),
                Way::Sectors => seen.count() > grid.count(),
            };
            if complete && search.seen.as_ref().is_some_and(less) {
                break;
            }
            let grid = turn_by_colours(&small, right_handed(grid), board);
            let detected = on_a_copy(picture, level, &small, grid);
            if complete {
                return Ok(detected);
            }
            // A few more corners are not worth a coarser start.
            let worth = |p: &Detected| detected.corners.count() as f64 > WORTH * p.corners.count() as f64;
            if search.partial.as_ref().is_none_or(worth) {
                search.partial = Some(detected);
            }
        }
        // Another board, seen whole, that this one could be a part of.
        if search.seen.as_ref().is_some_and(|(grid, _)| tells(grid).0 && holds(grid, board)) {
            break;
        }
        last = Some((level, small));
    }
    // A part of a larger grid is not the board with corners missing.
    let larger = search.seen.as_ref().map_or(0, |(grid, _)| grid.count());
    let partial = search.partial.filter(|p| p.corners.count() > larger);
    partial.map_or_else(|| with_open_numbers(picture, search.seen, board), Ok)
}

/// A grid that may be several parts of the board as one of them; the reason where it is none, or shows too little.
fn with_open_numbers(picture: &Picture, seen: Option<(Places, Level)>, board: Board) -> Result<Detected, Refusal> {
    /// Share of the board's corners, and count of them, that are worth asking the other pictures about.
    const LEAST: f64 = 0.25;
    let refusal = refusal(seen.as_ref().map(|(grid, _)| grid), board);
    let is_enough =
        |grid: &Places| grid.count() >= LEAST_SEEN && grid.count() as f64 >= LEAST * board.corner_count() as f64;
    let Some((grid, level)) = seen.filter(|(grid, _)| is_enough(grid)) else { return Err(refusal) };
    let small = level.copy(picture);
    let ways = ways_to_lie(&small, &grid, board).into_iter();
    let mut ways = ways.map(|way| turn_by_colours(&small, right_handed(way), board));
    let Some(first) = ways.next() else { return Err(refusal) };
    let others = ways.filter_map(|way| Renumbering::between(&first, &way)).collect();
    Ok(Detected { open: Some(Open { others, refusal }), ..on_a_copy(picture, level, &small, first) })
}

/// The whole board, where its squares are large enough on a smaller copy than that of the first attempt.
fn at_a_glance(picture: &Picture, board: Board) -> Option<Detected> {
    /// Squares whose sides have at least as many pixels of a copy are seen there as well as on a finer one.
    const LARGE_PX: f64 = 11.0;
    let level = glance_level(picture);
    if level == Level::Reduced(1) {
        return None;
    }
    let copy = level.copy(picture);
    let grid = fitting(&copy, &grown(&copy, board.corner_count())?, board)?;
    if grid.count() < board.corner_count() || grid.least_step_px()? < LARGE_PX {
        return None;
    }
    let corners = turn_by_colours(&copy, right_handed(grid), board);
    Some(Detected::plain(corners, copy, level))
}

/// The board, or a part of it, by one attempt; another grid is kept as seen.
fn found(small: &Grey8, (level, way): Attempt, board: Board, search: &mut Search) -> Option<Places> {
    if way == Way::Sectors {
        // Where OpenCV cannot work at all, it has found nothing.
        let (columns, rows) = (board.columns(), board.rows());
        let corners = find_board(&small.pixels, small.width, (columns, rows)).ok().flatten()?;
        // Where a line is hidden it takes the board's outline for one.
        let grid = Lattice { columns, rows, cells: corners.into_iter().map(Some).collect() };
        return Some(grid.clone()).filter(|_| extent::without_outline(small, grid).count() == board.corner_count());
    }
    if way == Way::Darkened {
        // Borders of what is hidden look otherwise there, and say nothing of which part of a board is seen.
        let darkened = small.darkest_around();
        let whole = |grid: &Places| grid.count() == board.corner_count();
        return fitting(&darkened, &grown(&darkened, board.corner_count())?, board).filter(whole);
    }
    let grid = grown(small, board.corner_count())?;
    let fitting = fitting(small, &grid, board);
    if fitting.is_none() && search.seen.as_ref().is_none_or(|(seen, _)| tells(&grid) > tells(seen)) {
        search.seen = Some((grid, level));
    }
    fitting
}

/// How much a grid tells of the size of its board: first whether all its corners are there, then how many they are.
fn tells(grid: &Places) -> (bool, usize) {
    (grid.count() == grid.columns * grid.rows && grid.count() >= LEAST_SEEN, grid.count())
}

/// True where the board could be a part of the grid.
fn holds(grid: &Places, board: Board) -> bool {
    grid.columns.max(grid.rows) >= board.columns() && grid.columns.min(grid.rows) >= board.rows()
}

/// Attempts in their order. Coarser copies see through blur and noise, finer ones see small boards far away, down to
/// full size.
pub(super) fn ladder(picture: &Picture) -> Vec<Attempt> {
    /// Shorter sides than this hold no board that sectors would show, px.
    const LEAST_FOR_SECTORS_PX: usize = 48;
    let first = coarse_factor(picture);
    let finer = to_full_size(picture).skip(1).chain((first == 1).then_some(Level::Doubled));
    let (first, coarser) = (Level::Reduced(first), Level::Reduced(2 * first));
    let grown = [first, coarser].into_iter().chain(finer).map(|level| (level, Way::Grow));
    let side = |level: &Level| picture.width().min(picture.height()) as f64 / level.scale();
    let sectors = [first, coarser].into_iter().filter(|level| side(level) >= LEAST_FOR_SECTORS_PX as f64);
    grown.chain(sectors.map(|level| (level, Way::Sectors))).chain([(first, Way::Darkened)]).collect()
}

pub(super) fn grown(small: &Grey8, enough: usize) -> Option<Places> {
    let grid = extent::without_chance_lines(small, continuation::without_ends(small, largest_grid(small, enough)?));
    Some(extent::without_outline(small, grid)).filter(|grid| grid.columns > 1 && grid.rows > 1)
}

/// A grid as the board's, without lines of squares that are cut where those are too many.
fn fitting(small: &Grey8, grid: &Places, board: Board) -> Option<Places> {
    of_size(small, grid, board)
        .or_else(|| of_size(small, &continuation::without_cut_lines(small, grid, board)?, board))
        .or_else(|| of_size(small, &extent::whole_without_sparse_line(grid, board)?, board))
}

/// A grid as the board's, where it is known which of the board's corners are missing: it can lie on the board in one
/// way only.
fn of_size(small: &Grey8, grid: &Places, board: Board) -> Option<Places> {
    /// Share of the board's corners that makes a grid the board.
    const LEAST: f64 = 0.5;
    if (grid.count() as f64) < LEAST * board.corner_count() as f64 {
        return None;
    }
    let mut ways = ways_to_lie(small, grid, board).into_iter();
    ways.next().filter(|_| ways.next().is_none())
}

/// All ways in which a grid may lie on the board, but for turns after which the board looks the same.
fn ways_to_lie(small: &Grey8, grid: &Places, board: Board) -> Vec<Places> {
    let quarter = grid.quarter_turn();
    let turned = [Some(grid), (board.columns() != board.rows()).then_some(&quarter)];
    turned.into_iter().flatten().flat_map(|grid| extent::placings(small, grid, board)).collect()
}

fn refusal(seen: Option<&Places>, board: Board) -> Refusal {
    let Some(grid) = seen.filter(|grid| grid.count() >= LEAST_SEEN) else { return "no board found".to_owned().into() };
    let (long, short) = (grid.columns.max(grid.rows), grid.columns.min(grid.rows));
    let (columns, rows) = (board.columns(), board.rows());
    let shows = format!("shows {} corners in {long} columns and {short} rows", grid.count());
    // A corner or two are lost easily; the size is but a hint.
    let complete = 10 * grid.count() >= 9 * long * short;
    let seen = complete.then_some(Board { squares: Squares { columns: long + 1, rows: short + 1 }, ..board });
    let reason = if long <= columns && short <= rows {
        format!("{shows}: which of the board's {columns}x{rows} they are cannot be told")
    } else {
        format!("{shows}, the board has {columns}x{rows}")
    };
    Refusal { reason, seen }
}

/// The board that a picture shows, whatever was asked for, where all its corners are there.
pub fn size_seen(detected: &Detected) -> Option<Squares> {
    whole_squares(&grown(&detected.copy, usize::MAX)?)
}

/// The squares of a board whose corners a grid holds; `None` where one of them is missing.
pub(super) fn whole_squares(grid: &Places) -> Option<Squares> {
    let (columns, rows) = (grid.columns.max(grid.rows) + 1, grid.columns.min(grid.rows) + 1);
    (grid.count() == grid.columns * grid.rows).then_some(Squares { columns, rows })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::image::Image;

    /// A board of 8x6 squares of `side` px in a light margin, its crossings at whole multiples of `side`.
    fn picture(size: usize, side: usize) -> Picture {
        let image = Image::from_fn(size, size, |x, y| {
            let (i, j) = (x / side, y / side);
            let dark = (1..=8).contains(&i) && (1..=6).contains(&j) && (i + j) % 2 == 0;
            if dark { 40 } else { 200u8 }
        });
        image.into()
    }

    /// How far a corner is from the nearest crossing at the most, px of the picture.
    fn farthest(detected: &Detected, side: usize) -> f64 {
        let off = |v: f64| ((v + 0.5) / side as f64 - ((v + 0.5) / side as f64).round()).abs() * side as f64;
        let places = detected.corners.iter().map(|(_, _, place)| detected.level.to_picture(place));
        places.map(|place| off(place.x).max(off(place.y))).fold(0.0, f64::max)
    }

    #[test]
    fn large_squares_are_found_on_a_smaller_copy_than_small_ones() {
        let board = Board::checker("8x6".parse().unwrap(), 10.0);
        let (glance, first) = (Level::Skimmed(4), Level::Reduced(2));
        for (side, level) in [(170, glance), (48, glance), (40, first), (20, first)] {
            let detected = detect(&picture(2048, side), board).unwrap();
            assert_eq!((detected.level, detected.corners.count()), (level, 35), "{side}");
            assert!(farthest(&detected, side) <= level.scale(), "{side}");
        }
    }

    #[test]
    fn a_board_is_found_whose_dark_squares_no_longer_touch() {
        let board = Board::checker("8x6".parse().unwrap(), 10.0);
        // White reaches into the dark squares by so many pixels on all sides.
        for (side, bleeds) in [(14, 1), (16, 2), (30, 2)] {
            let picture: Picture = Image::from_fn(24 * side, 20 * side, |x, y| {
                let inside = |v: usize| (bleeds..side - bleeds).contains(&(v % side));
                let (i, j) = (x / side, y / side);
                let dark = (5..=12).contains(&i) && (5..=10).contains(&j) && (i + j) % 2 == 0;
                if dark && inside(x) && inside(y) { 40 } else { 255u8 }
            })
            .into();
            let found = detect(&picture, board).unwrap();
            assert_eq!(found.corners.count(), 35, "{side} {bleeds}");
            assert!(farthest(&found, side) < 1.5, "{side} {bleeds}");
        }
    }

    #[test]
    fn a_part_of_a_board_is_not_what_is_seen_at_a_glance() {
        let board = Board::checker("9x6".parse().unwrap(), 10.0);
        assert!(at_a_glance(&picture(2048, 170), board).is_none());
        let smaller = Board::checker("7x6".parse().unwrap(), 10.0);
        assert!(at_a_glance(&picture(2048, 170), smaller).is_none());
        assert!(detect(&picture(2048, 170), smaller).is_err());
    }
}
