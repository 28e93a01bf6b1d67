//! `corners.csv`: corners of all pairs as text, from this program or from any other detector.
//!
//! In: a CSV file with the columns `pair,side,col,row,x_px,y_px` and optionally
//! `sxx_px2,sxy_px2,syy_px2,used,blur_px,width_px,height_px`, rows in any order; where the board has markers `id` may
//! stand for `col` and `row`. Out: [`Corners`], and back. Raw (distorted) pixels, pixel (0, 0) is the centre of the
//! top-left pixel. Width and height are those of the picture, one size for each side; a file without them needs them
//! said.

mod line;

use std::collections::BTreeMap;
use std::fmt::Write as _;

use camino::Utf8Path;
use nalgebra::Point2;

use self::line::{Columns, Line, Row};
use super::pairs::natural_order;
use crate::csv_table::{Table, quoted};
use crate::files::Result;
use crate::imaging::board::Layout;
use crate::imaging::coded::measures::with_seen_spread;
use crate::imaging::{Board, Corner, Corners, PairCorners, Side, Skipped};

/// The header of `corners.csv`.
pub const HEADER: &str = "pair,side,col,row,x_px,y_px,sxx_px2,sxy_px2,syy_px2,used,blur_px,width_px,height_px";

/// The text of `corners.csv`. Numbers are written so that they read back exactly.
pub fn to_csv(corners: &Corners) -> String {
    let board = corners.board;
    let mut text = format!("{HEADER}{}\n", if board.is_coded() { ",id" } else { "" });
    for pair in &corners.pairs {
        let sides = [(Side::Left, &pair.left, corners.left_size), (Side::Right, &pair.right, corners.right_size)];
        for (side, list, (w, h)) in sides {
            for c in list {
                let s = c.covariance_px2.map(|s| [s[(0, 0)], s[(0, 1)], s[(1, 1)]]);
                let s = s.map_or_else(|| ",,".to_owned(), |[xx, xy, yy]| format!("{xx},{xy},{yy}"));
                let blur = c.blur_px.map_or_else(String::new, |blur| blur.to_string());
                let (name, side, used) = (quoted(&pair.pair), side.name(), u8::from(c.used));
                let (col, row, x, y) = (c.col, c.row, c.px.x, c.px.y);
                let _ = write!(text, "{name},{side},{col},{row},{x},{y},{s},{used},{blur},{w},{h}");
                if board.is_coded() {
                    let _ = write!(text, ",{}", board.id(col, row));
                }
                text.push('\n');
            }
        }
    }
    text
}

/// What is said of a file of a board with markers that is read as one of a plain board.
const UNUSED_ID: &str = "the corners file has a column `id`, as of a board with markers: name that with --board; col and row are taken as a plain board's";

/// Reads `corners.csv`. `size` is the width and height of the pictures, px, for a file that does not hold them.
///
/// Refused with the line: bad numbers, an unknown side, a corner that stands there twice or does not exist on the board
/// or in the picture, a size that differs from that of the side's other pictures or from `size`. A file whose columns
/// run along the shorter side is turned by 90 degrees. Pairs seen by one camera only are skipped, but for boards whose
/// corners have numbers of their own.
pub fn read(path: &Utf8Path, board: Board, size: Option<(u32, u32)>) -> Result<Corners> {
    let hint = "`stereocal camera-check IMAGES` writes corners.csv beside its report";
    let table = Table::read(path, "corners file", hint)?;
    let separate = board.may_be_grid().then(|| board.with_layout(Layout::Grid));
    // The numbers of a grid of tags say whose it is, where the places do.
    let (board, mut rows) = match (parse(&table, board), separate) {
        (Err(error), Some(separate)) => (separate, parse(&table, separate).map_err(|_| error)?),
        (rows, _) => (board, rows?),
    };
    let mut notes = Vec::new();
    let is_unused = table.column("id").is_some() && !board.is_coded();
    if is_unused {
        notes.push(UNUSED_ID.to_owned());
    }
    if fit_to_board(&table, &mut rows, board)? {
        notes.push("the columns of the corners file run along the shorter side: turned by 90 degrees".to_owned());
    }
    // Of a board with markers the part that is seen tells nothing of its size.
    notes.extend(smaller(&rows, board).filter(|_| !is_unused));
    let [left_size, right_size] =
        [size_of(&table, &rows, Side::Left, size)?, size_of(&table, &rows, Side::Right, size)?];
    let (pairs, skipped) = gather(rows, board);
    let (blind, open) = (Vec::new(), Vec::new());
    let board = with_seen_spread(board, &pairs);
    Ok(Corners { board, left_size, right_size, pairs, skipped, blind, open, notes })
}

/// The size of one side's pictures: what the file holds, or else what was said. All of its corners lie inside.
fn size_of(table: &Table, rows: &[Row], side: Side, said: Option<(u32, u32)>) -> Result<(u32, u32)> {
    let of_side = || rows.iter().filter(|row| row.side == side);
    let Some(size) = of_side().find_map(|row| row.size).or(said) else {
        // A side without corners has no pictures whose size could matter.
        let Some(row) = of_side().next() else { return Ok((0, 0)) };
        let message = "the corners file does not hold the pictures' size".to_owned();
        let hint = "`--picture-size WxH`, or columns width_px and height_px";
        return Err(table.refuse_with(row.line, message, Some(hint)));
    };
    let (w, h) = size;
    for row in of_side() {
        if let Some((width, height)) = row.size.into_iter().chain(said).find(|other| *other != size) {
            let message = format!("a {} picture of {width}x{height} px, another has {w}x{h}", side.name());
            return Err(table.refuse(row.line, message));
        }
        if !inside(&row.corner.px, size) {
            let (x, y) = (row.corner.px.x, row.corner.px.y);
            let message = format!("a corner at ({x:.2}, {y:.2}) lies outside of a picture of {w}x{h}");
            return Err(table.refuse(row.line, message));
        }
    }
    Ok(size)
}

fn inside(px: &Point2<f64>, (w, h): (u32, u32)) -> bool {
    (-0.5..=f64::from(w) - 0.5).contains(&px.x) && (-0.5..=f64::from(h) - 0.5).contains(&px.y)
}

fn parse(table: &Table, board: Board) -> Result<Vec<Row>> {
    let columns = Columns::of(table, board)?;
    let mut rows = Vec::with_capacity(table.rows.len());
    let mut seen = BTreeMap::new();
    for (number, fields) in &table.rows {
        let line = Line { table, columns: &columns, number: *number, fields };
        let Some(row) = line.row(board)? else { continue };
        let Corner { col, row: at, .. } = row.corner;
        if let Some(first) = seen.insert((row.pair.clone(), row.side, col, at), row.line) {
            let (side, name) = (row.side.name(), &row.pair);
            return Err(
                line.refuse(format!("corner {col},{at} of the {side} picture of {name} stands in line {first}"))
            );
        }
        rows.push(row);
    }
    Ok(rows)
}

/// Checks that every corner exists on the board; true where the file's columns ran along the shorter side and were
/// turned.
fn fit_to_board(table: &Table, rows: &mut [Row], board: Board) -> Result<bool> {
    let (columns, lines) = (board.columns(), board.rows());
    if rows.iter().all(|r| r.corner.col < columns && r.corner.row < lines) {
        return Ok(false);
    }
    // The order of a board with markers is a part of it.
    if !board.is_coded() && rows.iter().all(|r| r.corner.col < lines && r.corner.row < columns) {
        for row in rows {
            // A quarter turn, not a transposition: a mirrored board would lie behind the camera.
            (row.corner.col, row.corner.row) = (row.corner.row, lines - 1 - row.corner.col);
        }
        return Ok(true);
    }
    let col = rows.iter().map(|r| r.corner.col).max().unwrap_or(0);
    let row = rows.iter().map(|r| r.corner.row).max().unwrap_or(0);
    let line = rows.iter().find(|r| r.corner.col >= columns || r.corner.row >= lines).map_or(1, |r| r.line);
    let message = format!(
        "corners reach col {col} and row {row}, but a board of {} squares has {columns}x{lines} inner corners",
        board.squares
    );
    let hint = match (board.is_coded(), table.column("id")) {
        (false, Some(_)) => UNUSED_ID.to_owned(),
        (false, None) => format!("`--squares {}x{}` if the board has that many squares", col + 2, row + 2),
        (true, _) => {
            format!("a board of {}x{} squares or more, columns first as printed, has such corners", col + 2, row + 2)
        }
    };
    Err(table.refuse_with(line, message, Some(&hint)))
}

/// Where no picture shows a plain board's last column or row: the board may be a smaller one.
fn smaller(rows: &[Row], board: Board) -> Option<String> {
    let reach = |of: fn(&Corner) -> usize| rows.iter().map(|row| of(&row.corner) + 1).max();
    let (columns, lines) = (reach(|corner| corner.col)?, reach(|corner| corner.row)?);
    let is_smaller = !board.is_coded() && (columns < board.columns() || lines < board.rows());
    is_smaller.then(|| {
        format!(
            "no picture of the corners file shows more than {columns}x{lines} corners of this board of {} squares: `--squares {}x{}` if the board has no more",
            board.squares,
            columns + 1,
            lines + 1
        )
    })
}

fn gather(rows: Vec<Row>, board: Board) -> (Vec<PairCorners>, Vec<Skipped>) {
    let mut pairs: BTreeMap<String, PairCorners> = BTreeMap::new();
    for row in rows {
        let pair =
            pairs.entry(row.pair.clone()).or_insert_with(|| PairCorners { pair: row.pair, ..PairCorners::default() });
        match row.side {
            Side::Left => pair.left.push(row.corner),
            Side::Right => pair.right.push(row.corner),
        }
    }
    let (mut kept, mut skipped) = (Vec::new(), Vec::new());
    // In the order of a folder's pairs.
    let mut pairs: Vec<PairCorners> = pairs.into_values().collect();
    pairs.sort_by(|a, b| natural_order(&a.pair, &b.pair));
    for mut pair in pairs {
        pair.left.sort_by_key(|c| (c.row, c.col));
        pair.right.sort_by_key(|c| (c.row, c.col));
        let sides = [(&pair.left, Side::Left), (&pair.right, Side::Right)];
        let without = sides.into_iter().find(|(corners, _)| corners.is_empty() && !board.is_coded());
        match without.map(|(_, side)| side) {
            None => kept.push(pair),
            Some(side) => {
                let reason = format!("no corners in the {} picture", side.name());
                skipped.push(Skipped { pair: pair.pair, reason });
            }
        }
    }
    (kept, skipped)
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix2;

    use super::*;
    use crate::diagnostic::Explain;

    fn read_str(text: &str, squares: &str, size: Option<(u32, u32)>) -> Result<Corners> {
        read_of(text, Board::checker(squares.parse().unwrap(), 10.0), size)
    }

    fn read_of(text: &str, board: Board, size: Option<(u32, u32)>) -> Result<Corners> {
        let (_keep, path) = crate::files::temporary("corners.csv", text);
        read(&path, board, size)
    }

    #[test]
    fn what_is_written_reads_back_exactly() {
        let covariance_px2 = Some(Matrix2::new(1.0 / 3.0e4, 1e-7, 1e-7, 2.2e-5));
        let blur_px = Some(2.0 / 3.0);
        let px = |x: f64| Point2::new(x, 2.0 / 7.0);
        let corner =
            |col, row, x: f64| Corner { col, row, px: px(x), covariance_px2, blur_px, reach: None, used: true };
        let plain = |c: Corner| Corner { covariance_px2: None, blur_px: None, used: false, ..c };
        let corners = Corners {
            board: Board::checker("4x3".parse().unwrap(), 10.0),
            left_size: (640, 480),
            right_size: (320, 240),
            pairs: vec![PairCorners {
                pair: "a,b".to_owned(),
                left: vec![corner(0, 0, 0.1), corner(2, 1, 639.0)],
                right: vec![plain(corner(1, 1, 3.0))],
            }],
            skipped: Vec::new(),
            blind: Vec::new(),
            open: Vec::new(),
            notes: Vec::new(),
        };
        let back = read_str(&to_csv(&corners), "4x3", None).unwrap();
        assert_eq!(back, corners);
    }

    #[test]
    fn complaints_name_the_line() {
        let top = "pair,side,col,row,x_px,y_px,sxx_px2,sxy_px2,syy_px2,used\na,left,0,0,1,2,,,,1\n";
        for (row, part) in [
            ("a,left,0,0,1,2,,,,1", "stands in line 2"),
            ("a,middle,0,0,1,2,,,,1", "side is `middle`"),
            ("a,left,-1,0,1,2,,,,1", "`col` is not a count"),
            ("a,left,1,0,x,2,,,,1", "`x_px` is not a number"),
            ("a,left,1,0,1,2,1,,,1", "`sxy_px2` is not a number"),
            ("a,left,1,0,1,2,1,2,1,1", "not positive definite"),
            ("a,left,1,0,1,2,,,,maybe", "used is `maybe`"),
            ("a,left,1,7,1,2,,,,1", "`--squares 3x9`"),
            ("a,left,1,0,700,2,,,,1", "outside of a picture of 640x480"),
        ] {
            let error = read_str(&format!("{top}{row}\n"), "4x3", Some((640, 480))).unwrap_err();
            let message = crate::diagnostic::report(&error);
            assert!(message.contains(part) && message.contains("corners.csv:3"), "{message}");
        }
    }

    #[test]
    fn sizes_are_said_once_and_alike() {
        let bare = "pair,side,col,row,x_px,y_px\na,left,0,0,1,2\na,right,0,0,1,2\n";
        let message = crate::diagnostic::report(&read_str(bare, "4x3", None).unwrap_err());
        assert!(
            message.contains("does not hold the pictures' size") && message.contains("--picture-size"),
            "{message}"
        );
        let top = "pair,side,col,row,x_px,y_px,width_px,height_px\na,left,0,0,1,2,640,480\na,right,0,0,1,2,320,240\n";
        let corners = read_str(top, "4x3", None).unwrap();
        assert_eq!((corners.left_size, corners.right_size), ((640, 480), (320, 240)));
        let other = format!("{top}b,left,0,0,1,2,1280,960\n");
        let message = read_str(&other, "4x3", None).unwrap_err().to_string();
        assert!(message.contains("1280x960") && message.contains("640x480"), "{message}");
        assert!(read_str(top, "4x3", Some((640, 480))).is_err(), "the right pictures are smaller");
    }

    #[test]
    fn pairs_stand_in_the_order_of_a_folder() {
        let both = |p: &str| format!("{p},left,0,0,1,2\n{p},right,0,0,1,2\n");
        let rows: String = ["10", "9", "a2", "a10"].into_iter().map(both).collect();
        let text = format!("pair,side,col,row,x_px,y_px\n{rows}");
        let corners = read_str(&text, "4x3", Some((640, 480))).unwrap();
        let names: Vec<&str> = corners.pairs.iter().map(|p| p.pair.as_str()).collect();
        assert_eq!(names, ["9", "10", "a2", "a10"]);
    }

    #[test]
    fn columns_along_the_shorter_side_are_turned() {
        let text = "pair,side,col,row,x_px,y_px\na,left,0,0,0,0\na,left,0,2,0,20\na,left,1,0,10,0\na,right,0,0,0,0\n";
        let corners = read_str(text, "4x3", Some((640, 480))).unwrap();
        let at = |col, row| corners.pairs[0].left.iter().find(|c| c.col == col && c.row == row).unwrap().px;
        // x now runs down the picture and y to the left: still right-handed.
        assert_eq!(
            (at(0, 1), at(2, 1), at(0, 0)),
            (Point2::new(0.0, 0.0), Point2::new(0.0, 20.0), Point2::new(10.0, 0.0))
        );
        assert_eq!(corners.notes.len(), 1);
    }

    #[test]
    fn corners_of_a_board_with_markers_have_ids_and_may_be_seen_by_one_camera() {
        let board: Board = "charuco:4x5:20:14:DICT_4X4_50".parse().unwrap();
        let read = |text: &str| read_of(text, board, Some((640, 480)));
        let corners = read("pair,side,id,x_px,y_px\na,left,0,1,2\na,left,10,3,4\nb,right,11,5,6\n").unwrap();
        let places: Vec<_> = corners.pairs[0].left.iter().map(|c| (c.col, c.row)).collect();
        assert_eq!((places, corners.pairs[1].left.len()), (vec![(0, 0), (1, 3)], 0));
        let with_size = |text: &str| text.lines().map(|line| format!("{line}\n")).collect::<String>();
        let back = read(&with_size(&to_csv(&corners))).unwrap();
        assert_eq!(back, corners);
        for (text, why) in [
            ("pair,side,col,row,id,x_px,y_px\na,left,1,1,5,1,2\n", "has the id of 2,1"),
            ("pair,side,id,x_px,y_px\na,left,12,1,2\n", "row 4"),
            ("pair,side,col,row,x_px,y_px\na,left,3,0,1,2\n", "col 3"),
        ] {
            let message = format!("{}", read(text).unwrap_err());
            assert!(message.contains(why), "{message}");
        }
    }

    #[test]
    fn numbers_of_a_board_with_markers_that_is_taken_for_a_plain_one_are_spoken_of() {
        let text = "pair,side,col,row,id,x_px,y_px\na,left,1,0,1,1,2\na,right,1,0,1,5,6\n";
        assert_eq!(read_str(text, "4x3", Some((640, 480))).unwrap().notes, [UNUSED_ID]);
        let beyond = read_str(&text.replace(",1,0,", ",7,0,"), "4x3", Some((640, 480))).unwrap_err();
        assert_eq!(beyond.hint().as_deref(), Some(UNUSED_ID));
    }

    #[test]
    fn a_pair_with_one_side_is_skipped() {
        let text = "pair,side,col,row,x_px,y_px\nb,left,0,0,5,6\nb,right,0,0,5,6\na,left,0,0,0,0\n";
        let corners = read_str(text, "4x3", Some((640, 480))).unwrap();
        assert_eq!(corners.pairs.len(), 1);
        assert_eq!(corners.skipped[0].reason, "no corners in the right picture");
    }
}
