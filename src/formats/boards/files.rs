//! Boards as other programs describe them.
//!
//! In: a board's name, or the path of a file that describes it: Kalibr's target file (YAML; the wiki of
//! ethz-asl/kalibr, "Calibration targets"), the project of calib.io's Calibrator (JSON; calibio/calibrator-examples,
//! `opencv_parameters/stereo_calibration.json`), or a file of calib.io's pattern generator, whose name says what is on
//! it (`calib.io_charuco_200x150_8x11_15_11_DICT_5X5.pdf`: the paper, rows x columns, square, marker, dictionary). Out:
//! the board. Goes wrong: another kind of board, which is named.

use camino::Utf8Path;
use serde::Deserialize;

use crate::files;
use crate::formats::export::scan;
use crate::imaging::{Board, Squares};

/// A board as the settings file or the command line names it.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "String")]
pub struct NamedBoard(pub Board);

impl TryFrom<String> for NamedBoard {
    type Error = String;

    fn try_from(text: String) -> Result<NamedBoard, String> {
        named(&text).map(NamedBoard)
    }
}

/// The board of this name, or of this file.
pub fn named(text: &str) -> Result<Board, String> {
    let path = Utf8Path::new(text);
    if let Some(found) = path.file_name().and_then(by_generator) {
        return found;
    }
    let kind = path.extension().map(str::to_ascii_lowercase);
    let of_file = match kind.as_deref() {
        Some("yaml" | "yml") => by_kalibr,
        Some("json") => by_calibrator,
        _ => return parsed(text),
    };
    let content = files::read_text(path, "file of a board", None).map_err(|error| format!("{path}: {error}"))?;
    of_file(&content).map_err(|why| format!("{path}: {why}"))
}

/// The board of a name in this program's words.
fn parsed(name: &str) -> Result<Board, String> {
    name.parse().map_err(|error: crate::imaging::board::Error| error.to_string())
}

/// A checkerboard by its inner corners, mm.
fn checker(columns: f64, rows: f64, square_mm: f64) -> Result<Board, String> {
    let count = |corners: f64, what: &str| match corners.fract() == 0.0 && (2.0..200.0).contains(&corners) {
        true => Ok(corners as usize + 1),
        false => Err(format!("{corners} {what} of inner corners are no board's")),
    };
    let (columns, rows) = (count(columns, "columns")?, count(rows, "rows")?);
    parsed(&format!("checker:{}:{square_mm}", Squares { columns, rows }))
}

/// Rounds off what a length in metres brings along as binary fraction, mm.
fn mm(metres: f64) -> f64 {
    (metres * 1e9).round() / 1e6
}

/// Longest side of a tag or square in Kalibr's file, mm: longer ones were meant as mm.
const MOST_TAG_MM: f64 = 3000.0;

fn by_kalibr(text: &str) -> Result<Board, String> {
    let without_comments: String =
        text.lines().map(|line| line.split_once('#').map_or(line, |(before, _)| before).to_owned() + "\n").collect();
    let text = without_comments.as_str();
    let kind = scan::word(text, "target_type").map_err(|why| format!("no target file of Kalibr: {why}"))?;
    let number = |key: &str| scan::number(text, key);
    match kind {
        "checkerboard" => {
            let (across, along) = (number("colSpacingMeters")?, number("rowSpacingMeters")?);
            if (across - along).abs() > 1e-9 * across.abs() {
                return Err(format!("its squares are {} x {} mm; only square ones are read", mm(across), mm(along)));
            }
            if mm(across) > MOST_TAG_MM {
                return Err(format!("squares of {} mm: `colSpacingMeters` is in metres", mm(across)));
            }
            checker(number("targetCols")?, number("targetRows")?, mm(across))
        }
        "aprilgrid" => {
            let (columns, rows, tag_mm) = (number("tagCols")?, number("tagRows")?, mm(number("tagSize")?));
            if tag_mm > MOST_TAG_MM {
                return Err(format!("tags of {tag_mm} mm: `tagSize` is in metres, and `tagSpacing` a share of it"));
            }
            let gap_mm = (tag_mm * number("tagSpacing")? * 1e9).round() / 1e9;
            if number("codeOffset").is_ok_and(|first| first != 0.0) {
                return Err("`codeOffset` is not 0: only boards whose tags begin with number 0 are read".to_owned());
            }
            // The file names no family: Kalibr knows but this one.
            parsed(&format!("apriltag:{columns}x{rows}:tag36h11:{tag_mm}:{gap_mm}"))
        }
        "circlegrid" => {
            Err("a grid of circles; only boards of squares are read: checkerboards, ChArUco boards and AprilGrids"
                .to_owned())
        }
        other => Err(format!("a target of type `{other}`, which is not known; `checkerboard` and `aprilgrid` are")),
    }
}

/// The target of a project of calib.io's Calibrator.
fn by_calibrator(text: &str) -> Result<Board, String> {
    #[derive(Deserialize)]
    struct File {
        #[serde(rename = "Calibration")]
        calibration: Project,
    }
    #[derive(Deserialize)]
    struct Project {
        targets: Vec<Target>,
    }
    #[derive(Deserialize)]
    struct Target {
        #[serde(rename = "objectPoints")]
        points: Vec<Point>,
    }
    #[derive(Deserialize)]
    struct Point {
        x: f64,
        y: f64,
        z: f64,
    }
    let file: File =
        serde_json::from_str(text).map_err(|error| format!("no project of calib.io's Calibrator: {error}"))?;
    let [target] = file.calibration.targets.as_slice() else {
        return Err(format!("holds {} targets, not one", file.calibration.targets.len()));
    };
    let points: Vec<[f64; 3]> = target.points.iter().map(|p| [p.x, p.y, p.z]).collect();
    let no_grid = || format!("its {} points are no flat grid of square meshes, row by row", points.len());
    let (Some(first), Some(second)) = (points.first(), points.get(1)) else { return Err(no_grid()) };
    // Along x or along y first.
    let fast = if second[0] == first[0] { 1 } else { 0 };
    let pitch = second[fast] - first[fast];
    let columns = points.iter().take_while(|p| p[1 - fast] == first[1 - fast]).count();
    let is_at = |(k, p): (usize, &[f64; 3])| {
        let (col, row) = ((k % columns) as f64, (k / columns) as f64);
        let off = [p[fast] - first[fast] - col * pitch, p[1 - fast] - first[1 - fast] - row * pitch, p[2] - first[2]];
        off.iter().all(|off| off.abs() < 1e-6 * pitch.abs())
    };
    let is_grid = points.len().is_multiple_of(columns) && pitch > 0.0 && points.iter().enumerate().all(is_at);
    if !is_grid {
        return Err(no_grid());
    }
    checker(columns as f64, (points.len() / columns) as f64, mm(pitch))
}

/// A file of calib.io's generator by its name; `None` where it is none.
fn by_generator(name: &str) -> Option<Result<Board, String>> {
    let rest = name.strip_prefix("calib.io_")?;
    let stem = rest.rsplit_once('.').filter(|(_, end)| end.parse::<f64>().is_err()).map_or(rest, |(stem, _)| stem);
    let words: Vec<&str> = stem.split('_').collect();
    let turned = |size: &str| size.split_once('x').map(|(rows, columns)| format!("{columns}x{rows}"));
    let board = match words.as_slice() {
        ["checker" | "checkerboard", _, size, square_mm, ..] => {
            turned(size).map(|size| format!("checker:{size}:{square_mm}"))
        }
        // Dictionaries of so many bits begin with the same markers: the largest has them all.
        ["charuco", _, size, square_mm, marker_mm, "DICT", bits, ..] => {
            turned(size).map(|size| format!("charuco:{size}:{square_mm}:{marker_mm}:DICT_{bits}_1000"))
        }
        _ => {
            return Some(Err(format!(
                "`{name}` is a pattern of calib.io that is not read; checkerboards and ChArUco are"
            )));
        }
    };
    Some(board.ok_or_else(|| format!("`{name}` does not say rows and columns")).and_then(|name| parsed(&name)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a file of this name and content is read as.
    fn read(name: &str, content: &str) -> Result<String, String> {
        let (_folder, path) = files::temporary(name, content);
        named(path.as_str()).map(|board| board.to_string())
    }

    #[test]
    fn kalibrs_target_files_are_read_or_refused_with_the_reason() {
        let checker = "target_type: 'checkerboard' #gridtype\ntargetCols: 6               #number of internal corners\n\
                       targetRows: 7\nrowSpacingMeters: 0.06      #size of one chessboard square [m]\ncolSpacingMeters: 0.06\n";
        assert_eq!(read("target.yaml", checker), Ok("checker:8x7:60".to_owned()));
        let grid = "target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 6\ntagSize: 0.024\ntagSpacing: 0.3\ncodeOffset: 5\n";
        for (text, why) in [
            (checker.replace("colSpacingMeters: 0.06", "colSpacingMeters: 0.05"), "50 x 60 mm"),
            (checker.replace("targetCols: 6 ", "targetCols: 1 "), "no board's"),
            (checker.replace("targetCols", "tagCols"), "no `targetCols`"),
            (checker.replace("targetRows: 7", "targetRows: seven"), "not a number"),
            ("target_type: 'circlegrid'\ntargetCols: 6\n".to_owned(), "grid of circles"),
            ("target_type: 'aprilgrid'\ntagCols: 6\n".to_owned(), "tagRows"),
            (grid.replace("Cols: 6", "Cols: 6.5").replace("codeOffset: 5\n", ""), "6.5x6"),
            (grid.replace("0.024", "24"), "in metres"),
            (grid.to_owned(), "codeOffset"),
            ("target_type: 'dots'\n".to_owned(), "`dots`"),
            ("cam0:\n".to_owned(), "no target file"),
        ] {
            let said = read("target.yml", &text).unwrap_err();
            assert!(said.contains(why) && said.contains("target.yml"), "{said}");
        }
        assert!(named("nowhere/target.yaml").unwrap_err().contains("nowhere/target.yaml"));
    }

    /// A project whose target has these points, m.
    fn project(points: impl Iterator<Item = [f64; 3]>) -> String {
        let points: Vec<_> = points.map(|[x, y, z]| serde_json::json!({"x": x, "y": y, "z": z})).collect();
        serde_json::json!({"Calibration": {"cameras": [], "targets": [{"objectPoints": points, "refIdx": 3}]}})
            .to_string()
    }

    #[test]
    fn calibrators_projects_are_read_or_refused_with_the_reason() {
        let grid = |k: usize| [0.025 * (k % 38) as f64, 0.025 * (k / 38) as f64, 0.0];
        assert_eq!(read("p.json", &project((0..38 * 26).map(grid))), Ok("checker:39x27:25".to_owned()));
        // Column by column.
        let turned = |k: usize| [0.01 * (k / 5) as f64, 0.01 * (k % 5) as f64, 0.0];
        assert_eq!(read("p.json", &project((0..35).map(turned))), Ok("checker:8x6:10".to_owned()));
        for (points, why) in [
            ((0..38 * 26 - 1).map(grid).collect::<Vec<_>>(), "no flat grid"),
            ((0..35).map(turned).map(|[x, y, _]| [x, 1.2 * y, 0.0]).collect(), "no flat grid"),
            ((0..35).map(turned).map(|[x, y, _]| [x, y, x]).collect(), "no flat grid"),
            (vec![[0.0; 3]], "no flat grid"),
        ] {
            assert!(read("p.json", &project(points.into_iter())).unwrap_err().contains(why));
        }
        assert!(read("p.json", "{}").unwrap_err().contains("no project"));
    }

    #[test]
    fn files_of_the_generator_say_their_board_by_name() {
        for (name, board) in [
            ("calib.io_checker_200x150_8x11_15.pdf", "checker:11x8:15"),
            ("calib.io_charuco_200x150_8x11_15_11_DICT_5X5.pdf", "charuco:11x8:15:11:DICT_5X5_1000"),
            ("pictures/calib.io_charuco_420x297_6x9_45_33_DICT_4X4", "charuco:9x6:45:33:DICT_4X4_1000"),
            ("calib.io_checker_200x150_8x11_7.5", "checker:11x8:7.5"),
        ] {
            assert_eq!(named(name).map(|board| board.to_string()), Ok(board.to_owned()));
        }
        assert!(named("calib.io_circles_200x150_8x11_12_5.pdf").unwrap_err().contains("not read"));
        assert_eq!(named("checker:20x20:10").map(|board| board.to_string()), Ok("checker:20x20:10".to_owned()));
        assert!(named("checker:20x20").unwrap_err().contains("COLSxROWS"));
    }
}
