//! Boards with markers and grids of tags, seen in part: whether any corner has another's number, and how well and how
//! surely the corners lie.
//!
//! Every dictionary, markers of 0.6 to 0.8 of a square, or every family of tags, gaps of 0.2 to 0.4 of a tag; tilts to
//! 60 degrees, blur to 2.5 px, noise to 5 grey levels, squares of 12 to 100 px, from the whole board down to a tenth of
//! it. `-- coded FIRST COUNT` (of grids of tags `-- tags FIRST COUNT`, of OpenCV's `-- grid FIRST COUNT`) takes the
//! pictures from one number on, so that parts of a long run add up; with a folder behind that the pictures are written
//! there with truth and findings, for `scripts/peers_coded.py`.

mod bound;
mod case;
mod table;

use std::fmt::Write;
use std::path::Path;

use nalgebra::Point2;
use rayon::prelude::*;
use stereocal::imaging::find::corners_in;
use stereocal::imaging::image::{Image, Picture};
use stereocal::imaging::{Board, Corner};

use case::Case;
pub use case::Coded;

/// A corner farther from its truth than this share of the least step of the board has another's number.
const WRONG: f64 = 0.4;

/// A corner that was found: how far off, in px and in its own sigmas.
struct Found {
    off_px: f64,
    chi2: f64,
    /// The squared deviation over the bound of the masked window, an axis; `None` where there is no such window.
    of_bound: Option<f64>,
    /// Whether the margin round the markers is at least three blurs and two px as it is seen.
    has_margin: bool,
    is_wrong: bool,
}

/// One picture's outcome.
struct Outcome {
    name: String,
    case: Case,
    /// Corners in view.
    visible: usize,
    corners: Vec<Found>,
    reason: Option<String>,
}

/// The least distance of a corner from its neighbours on the board.
fn step_px(board: &Board, truth: &[Point2<f64>], (col, row): (usize, usize)) -> f64 {
    let at = |c: usize, r: usize| (c < board.columns() && r < board.rows()).then(|| truth[board.index(c, r)]);
    let here = truth[board.index(col, row)];
    let around = [(col + 1, row), (col.wrapping_sub(1), row), (col, row + 1), (col, row.wrapping_sub(1))];
    around.into_iter().filter_map(|(c, r)| at(c, r)).map(|p| (p - here).norm()).fold(f64::INFINITY, f64::min)
}

fn judge(case: &Case, corner: &Corner, truth: &[Point2<f64>]) -> Found {
    let place = (corner.col, corner.row);
    let off = corner.px - truth[case.board.index(corner.col, corner.row)];
    let chi2 = corner.covariance_px2.and_then(|s| Some(off.dot(&(s.try_inverse()? * off)) / 2.0));
    let has_margin = bound::margin_px(case, place) >= (3.0 * case.blur_px).max(2.0);
    let least = has_margin.then(|| bound::bound(case, place)).flatten();
    Found {
        off_px: off.norm(),
        chi2: chi2.unwrap_or(f64::NAN),
        of_bound: least.and_then(|least| Some(off.dot(&(least.try_inverse()? * off)) / 2.0)),
        has_margin,
        is_wrong: off.norm() > WRONG * step_px(&case.board, truth, place),
    }
}

fn look(kind: Coded, number: usize, folder: Option<&Path>) -> Outcome {
    let case = Case::drawn(kind, number);
    let (image, truth) = (case.taken(number), case.truth());
    let visible = case.visible();
    let name = format!("{number:06}");
    let found = corners_in(&Picture::from(image.clone()), case.board);
    if let Some(folder) = folder {
        write(folder, &name, &case, &image, &truth, found.as_ref().ok());
    }
    match found {
        Err(refusal) => Outcome { name, case, visible, corners: Vec::new(), reason: Some(refusal.reason) },
        Ok(corners) => {
            let measured = corners.cells.iter().flatten().filter(|corner| corner.used);
            let corners = measured.map(|corner| judge(&case, corner, &truth)).collect();
            Outcome { name, case, visible, corners, reason: None }
        }
    }
}

/// The picture, and a table of id, true place, place found (empty where it was not), whether it has a margin, and its
/// squared deviation in sigmas.
fn write(
    folder: &Path,
    name: &str,
    case: &Case,
    image: &Image<u8>,
    truth: &[Point2<f64>],
    found: Option<&stereocal::imaging::lattice::Lattice<Corner>>,
) {
    let mut pgm = format!("P5\n{} {}\n255\n", image.width, image.height).into_bytes();
    pgm.extend_from_slice(&image.pixels);
    std::fs::write(folder.join(format!("{name}.pgm")), pgm).expect("a picture is written");
    let mut table = format!("{}\n", case.board);
    for id in 0..truth.len() {
        let (col, row) = case.board.by_id(id);
        let at = truth[case.board.index(col, row)];
        let corner = found.and_then(|grid| grid.get(col, row)).filter(|corner| corner.used);
        let place = corner.map_or(",".to_owned(), |corner| format!("{},{}", corner.px.x, corner.px.y));
        let judged = corner.map(|corner| judge(case, corner, truth));
        let margin = judged.as_ref().is_some_and(|judged| judged.has_margin);
        let chi2 = judged.map_or(String::new(), |judged| judged.chi2.to_string());
        writeln!(table, "{id},{},{},{place},{},{chi2}", at.x, at.y, u8::from(margin)).expect("a line");
    }
    std::fs::write(folder.join(format!("{name}.csv")), table).expect("a table is written");
}

/// Looks at so many pictures from one number on, and prints what came of it.
pub fn table(kind: Coded, first: usize, count: usize, folder: Option<&Path>) {
    let outcomes: Vec<Outcome> =
        (first..first + count).into_par_iter().map(|number| look(kind, number, folder)).collect();
    let boards = match kind {
        Coded::Markers => "ChArUco boards",
        Coded::Tags => "grids of AprilTags",
        Coded::Grid => "OpenCV's grids of AprilTags",
    };
    println!(
        "{boards} in part, {} px, pictures {first} to {}: corners by the markers' codes",
        case::SIZE,
        first + count
    );
    table::print(&outcomes);
}
