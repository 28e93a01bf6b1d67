//! Corners of pictures that were measured before, by what is in the picture.
//!
//! In: a picture file's bytes and the board. Out: what a former run found, if it is the same algorithm's. The name of an
//! entry is a hash of all that the result depends on, so a changed picture, board or program makes a new
//! entry. An entry that can't be read is as good as none, and one that can't be written costs only time.

use nalgebra::{Matrix2, Point2};
use xxhash_rust::xxh3::Xxh3Default;

use super::detect::Refusal;
use super::grid::Grid;
use super::{Board, Corner};
use crate::files::OutDir;

/// Changed with every change of detection or refinement that moves a corner.
const ALGORITHM: &str = concat!("corners 9 ", env!("CARGO_PKG_VERSION"));

/// What was found in a picture, or why nothing.
pub type Look = Result<Grid<Corner>, Refusal>;

/// A place for what was found.
#[derive(Debug, Clone, Copy)]
pub struct Cache<'a> {
    /// The results folder.
    pub out: &'a OutDir,
}

impl Cache<'_> {
    /// The entry of a picture file.
    pub fn entry(&self, bytes: &[u8], board: Board) -> String {
        let mut hash = Xxh3Default::new();
        hash.update(ALGORITHM.as_bytes());
        hash.update(board.squares.to_string().as_bytes());
        hash.update(bytes);
        format!("cache/{:032x}.txt", hash.digest128())
    }

    /// What a former run found.
    pub fn read(&self, entry: &str, board: Board) -> Option<Look> {
        parse(&std::fs::read_to_string(self.out.join(entry)).ok()?, board)
    }

    /// Keeps what was found.
    pub fn write(&self, entry: &str, look: &Look) {
        // Without the entry the next run is slower, nothing else.
        let _ = self.out.write(entry, text(look).as_bytes());
    }
}

fn text(look: &Look) -> String {
    let mut text = format!("{ALGORITHM}\n");
    match look {
        Err(Refusal { reason, seen }) => {
            let seen = seen.map_or("-".to_owned(), |squares| squares.to_string());
            text.push_str(&format!("none {seen} {}\n", reason.replace('\n', " ")));
        }
        Ok(grid) => {
            for (_, _, c) in grid.iter() {
                let s = c.covariance_px2.map_or([f64::NAN; 3], |s| [s[(0, 0)], s[(0, 1)], s[(1, 1)]]);
                let used = u8::from(c.used);
                text.push_str(&format!(
                    "{} {} {} {} {} {} {} {} {used}\n",
                    c.col,
                    c.row,
                    c.px.x,
                    c.px.y,
                    s[0],
                    s[1],
                    s[2],
                    c.blur_px.unwrap_or(f64::NAN)
                ));
            }
        }
    }
    text.push_str("end\n");
    text
}

fn parse(text: &str, board: Board) -> Option<Look> {
    let body = text.strip_prefix(ALGORITHM)?.strip_prefix('\n')?.strip_suffix("end\n")?;
    if let Some(refusal) = body.strip_prefix("none ") {
        let (seen, reason) = refusal.split_once(' ')?;
        let seen = if seen == "-" { None } else { Some(seen.parse().ok()?) };
        return Some(Err(Refusal { reason: reason.trim_end().to_owned(), seen }));
    }
    let mut grid: Grid<Corner> = Grid::from_fn(board.columns(), board.rows(), |_, _| None);
    for line in body.lines() {
        let numbers: Vec<f64> = line.split(' ').map(|n| n.parse().ok()).collect::<Option<_>>()?;
        let [col, row, x, y, xx, xy, yy, blur, used] = numbers.try_into().ok()?;
        let (col, row) = (col as usize, row as usize);
        if col >= board.columns() || row >= board.rows() || !x.is_finite() || !y.is_finite() {
            return None;
        }
        let covariance_px2 = xx.is_finite().then(|| Matrix2::new(xx, xy, xy, yy));
        let blur_px = blur.is_finite().then_some(blur);
        let corner = Corner { col, row, px: Point2::new(x, y), covariance_px2, blur_px, used: used != 0.0 };
        *grid.cells.get_mut(row * board.columns() + col)? = Some(corner);
    }
    Some(Ok(grid))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn board() -> Board {
        Board { squares: "4x3".parse().unwrap(), square_mm: 10.0 }
    }

    #[test]
    fn entries_read_back_exactly_and_broken_ones_not_at_all() {
        let look: Look = Ok(Grid::from_fn(3, 2, |col, row| {
            let covariance_px2 = (col > 0).then(|| Matrix2::new(1.0 / 3e5, 1e-8, 1e-8, 2e-6));
            let px = Point2::new(1.0 / 3.0 + col as f64, row as f64);
            let blur_px = (col > 0).then_some(1.0 / 3.0);
            (row + col < 3).then_some(Corner { col, row, px, covariance_px2, blur_px, used: col > 0 })
        }));
        let written = text(&look);
        assert_eq!(parse(&written, board()), Some(look));
        for cut in 0..written.len() {
            assert_eq!(parse(&written[..cut], board()), None);
        }
        assert_eq!(parse(&written.replace("1 0 1.3", "9 0 1.3"), board()), None);
        for seen in [None, Some("10x7".parse().unwrap())] {
            let none: Look = Err(Refusal { reason: "no board found".to_owned(), seen });
            assert_eq!(parse(&text(&none), board()), Some(none));
        }
    }

    #[test]
    fn the_entry_follows_picture_and_board() {
        let dir = tempfile::tempdir().unwrap();
        let out = OutDir::open(camino::Utf8Path::from_path(dir.path()).unwrap()).unwrap();
        let cache = Cache { out: &out };
        let other = Board { squares: "5x3".parse().unwrap(), square_mm: 10.0 };
        let names = [cache.entry(b"a", board()), cache.entry(b"b", board()), cache.entry(b"a", other)];
        assert!(names[0] != names[1] && names[0] != names[2] && names[0] == cache.entry(b"a", board()));
    }
}
