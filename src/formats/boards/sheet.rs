//! A board to print: a sheet of paper with the board in true size, a ruler to check the print by, and the board's name.
//!
//! In: a board. Out: SVG and PDF, all lengths in mm; PNG (`png`). Goes wrong: a board that no paper up to A0 holds, and
//! printers that scale to fit: the ruler shows it.

use std::fmt::Write as _;

use pdf_writer::{Content, Finish, Name, Pdf, Rect, Ref, Str};

use crate::imaging::Board;
use crate::imaging::board::Layout;
use crate::imaging::coded::faces::{Face, faces};

/// Sheets of paper, mm, the short side first.
const PAPER: [(&str, f64, f64); 5] =
    [("A4", 210.0, 297.0), ("A3", 297.0, 420.0), ("A2", 420.0, 594.0), ("A1", 594.0, 841.0), ("A0", 841.0, 1189.0)];
/// White round the board at the least, mm: what printers leave white, and a margin to hold it by.
const MARGIN_MM: f64 = 10.0;
/// Below the board: ruler and name, mm.
const FOOT_MM: f64 = 16.0;
/// Ticks of the ruler, mm.
const TICK_MM: f64 = 10.0;
/// Longest ruler, mm.
const RULER_MM: f64 = 200.0;
/// Ticks of the ruler down to its numbers' feet, and the height of these, mm.
const NUMBERS_MM: f64 = 7.0;
const NUMBER_MM: f64 = 2.6;
/// Width of a digit of Helvetica as a share of its letters' height.
const DIGIT: f64 = 0.556;
/// Height of letters, mm.
const LETTER_MM: f64 = 3.0;
/// A point of PDF, mm.
const POINT_MM: f64 = 25.4 / 72.0;

/// A rectangle on the sheet, mm from its upper left corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Patch {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) width: f64,
    pub(super) height: f64,
    pub(super) is_black: bool,
}

/// A board on a sheet of paper.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheet {
    pub paper: &'static str,
    pub width_mm: f64,
    pub height_mm: f64,
    /// The board's name, and what the ruler is for.
    pub foot: String,
    pub(super) patches: Vec<Patch>,
    foot_at: (f64, f64),
    /// The ruler's numbers, and where their middle stands.
    numbers: Vec<(String, (f64, f64))>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct TooLarge {
    /// Its size and that of the largest paper.
    pub message: String,
    /// How much smaller it must be.
    pub hint: String,
}

impl TooLarge {
    fn new(width: f64, height: f64) -> TooLarge {
        let (_, short, long) = PAPER[PAPER.len() - 1];
        let [across, along] = [[short, long], [long, short]]
            .map(|[w, h]| ((w - 2.0 * MARGIN_MM) / width).min((h - 2.0 * MARGIN_MM - FOOT_MM) / height));
        let percent = (100.0 * across.max(along)).floor();
        TooLarge {
            message: format!(
                "the board is {width:.1} x {height:.1} mm, more than A0 holds ({short} x {long} mm with its margin)"
            ),
            hint: format!("make its squares {percent} % as large, or fewer"),
        }
    }
}

impl Sheet {
    /// The board on the smallest paper that holds it; why there is none otherwise.
    pub fn new(board: &Board) -> Result<Sheet, TooLarge> {
        let [width, height] = board.extent_mm();
        let (wide, high) = (width + 2.0 * MARGIN_MM, height + 2.0 * MARGIN_MM + FOOT_MM);
        let sheets = PAPER.into_iter().flat_map(|(name, a, b)| [(name, a, b), (name, b, a)]);
        let Some((paper, width_mm, height_mm)) = sheets.into_iter().find(|(_, w, h)| *w >= wide && *h >= high) else {
            return Err(TooLarge::new(width, height));
        };
        let (left, top) = ((width_mm - width) / 2.0, (height_mm - FOOT_MM - height) / 2.0);
        let mut patches: Vec<Patch> = Vec::new();
        let (pitch, sides) = (board.pitch(), board.sides_mm());
        // Nothing is printed beyond the outermost tags where there are no black squares.
        let first = if board.is_grid() { 0.0 } else { pitch.at(-1) };
        let of = |face: &Face, is_black: bool| {
            let squares = [face.square.0, face.square.1].map(|k| k as isize - 1);
            let at = |axis: usize, share: f64| {
                let (from, wide) = (pitch.at(squares[axis]) - first, pitch.after(squares[axis]));
                (from + share * wide) * sides[axis]
            };
            let ([x, y], [right, below]) = ([0, 1].map(|k| at(k, face.from[k])), [0, 1].map(|k| at(k, face.to[k])));
            Patch { x: left + x, y: top + y, width: right - x, height: below - y, is_black }
        };
        let layout = board.layouts().first().copied().unwrap_or(Layout::New);
        let whole = |square| Face { square, from: [0.0; 2], to: [1.0; 2] };
        let squares = (0..board.squares.rows).flat_map(|y| (0..board.squares.columns).map(move |x| (x, y)));
        let black = squares.filter(|(x, y)| layout.is_dark(*x as isize, *y as isize));
        patches.extend(black.map(|square| of(&whole(square), true)));
        let markers = faces(board, layout);
        patches.extend(markers.markers.iter().map(|face| of(face, true)));
        patches.extend(markers.bits.iter().map(|face| of(face, false)));
        let ruler_mm = ((width_mm - 2.0 * MARGIN_MM).min(RULER_MM) / TICK_MM).floor() * TICK_MM;
        let ruler_top = top + height + MARGIN_MM / 2.0;
        let ruler_left = (width_mm - ruler_mm) / 2.0;
        patches.extend(ruler(ruler_left, ruler_top, ruler_mm));
        let ticks = (ruler_mm / TICK_MM).round() as usize;
        let number = |k: usize| {
            let mm = k as f64 * TICK_MM;
            (format!("{mm:.0}"), (ruler_left + mm, ruler_top + NUMBERS_MM))
        };
        let foot = format!("--board {board}    the ruler is {ruler_mm} mm long: print at 100 %, not \"fit to page\"");
        let foot_at = (ruler_left, ruler_top + NUMBERS_MM + 1.0 + LETTER_MM);
        Ok(Sheet { paper, width_mm, height_mm, foot, patches, foot_at, numbers: (0..=ticks).map(number).collect() })
    }

    pub fn svg(&self) -> String {
        let (w, h) = (self.width_mm, self.height_mm);
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}mm\" height=\"{h}mm\" viewBox=\"0 0 {w} {h}\">\n\
             <rect width=\"{w}\" height=\"{h}\" fill=\"white\"/>\n"
        );
        for Patch { x, y, width, height, is_black } in &self.patches {
            let fill = if *is_black { "black" } else { "white" };
            let _ = writeln!(
                text,
                "<rect x=\"{x:.6}\" y=\"{y:.6}\" width=\"{width:.6}\" height=\"{height:.6}\" fill=\"{fill}\"/>"
            );
        }
        for (number, (x, y)) in &self.numbers {
            let _ = writeln!(
                text,
                "<text x=\"{x}\" y=\"{y}\" text-anchor=\"middle\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"{NUMBER_MM}\">{number}</text>"
            );
        }
        let ((x, y), foot) = (self.foot_at, self.foot.replace('"', "&quot;"));
        let _ = writeln!(
            text,
            "<text x=\"{x}\" y=\"{y}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"{LETTER_MM}\">{foot}</text>\n</svg>"
        );
        text
    }

    pub fn pdf(&self) -> Vec<u8> {
        let [catalog, pages, page, contents, font] = [1, 2, 3, 4, 5].map(Ref::new);
        let letters = Name(b"F1");
        let points = |mm: f64| (mm / POINT_MM) as f32;
        let mut pdf = Pdf::new();
        pdf.catalog(catalog).pages(pages);
        pdf.pages(pages).kids([page]).count(1);
        let mut sheet = pdf.page(page);
        sheet.media_box(Rect::new(0.0, 0.0, points(self.width_mm), points(self.height_mm)));
        sheet.parent(pages);
        sheet.contents(contents);
        sheet.resources().fonts().pair(letters, font);
        sheet.finish();
        pdf.type1_font(font).base_font(Name(b"Helvetica"));
        let mut content = Content::new();
        // From here on in mm from the lower left corner: numbers of seven digits then hold a thousandth of a micrometre
        // of a square.
        let scale = points(1.0);
        content.transform([scale, 0.0, 0.0, scale, 0.0, 0.0]);
        for patch in &self.patches {
            content.set_fill_gray(if patch.is_black { 0.0 } else { 1.0 });
            let bottom = self.height_mm - patch.y - patch.height;
            content.rect(patch.x as f32, bottom as f32, patch.width as f32, patch.height as f32);
            content.fill_nonzero();
        }
        content.set_fill_gray(0.0);
        let mut write = |text: &str, size_mm: f64, (x, y): (f64, f64)| {
            content.begin_text();
            content.set_font(letters, size_mm as f32);
            content.next_line(x as f32, (self.height_mm - y) as f32);
            content.show(Str(text.as_bytes()));
            content.end_text();
        };
        for (number, (middle, y)) in &self.numbers {
            let wide = number.len() as f64 * DIGIT * NUMBER_MM;
            write(number, NUMBER_MM, (middle - wide / 2.0, *y));
        }
        write(&self.foot, LETTER_MM, self.foot_at);
        pdf.stream(contents, &content.finish());
        pdf.finish()
    }
}

/// A ruler of such a length, with ticks: its first tick's and its last one's outer edges are that far apart.
fn ruler(x: f64, y: f64, length: f64) -> Vec<Patch> {
    const LINE_MM: f64 = 0.2;
    const HIGH_MM: f64 = 4.0;
    let ticks = (length / TICK_MM).round() as usize;
    let at = |k: usize| match k {
        0 => x,
        _ if k == ticks => x + length - LINE_MM,
        _ => x + k as f64 * TICK_MM - LINE_MM / 2.0,
    };
    let line = Patch { x, y, width: length, height: LINE_MM, is_black: true };
    let tick = |k: usize| Patch { x: at(k), width: LINE_MM, height: HIGH_MM, ..line };
    std::iter::once(line).chain((0..=ticks).map(tick)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_is_on_the_smallest_paper_in_its_true_size() {
        for (name, paper) in [
            ("charuco:8x11:20:14:DICT_5X5_100", "A4"),
            ("charuco:11x8:30:22:DICT_5X5_100", "A3"),
            ("checker:20x20:10", "A3"),
        ] {
            let board: Board = name.parse().unwrap();
            let sheet = Sheet::new(&board).unwrap();
            assert_eq!(sheet.paper, paper, "{name}");
            let squares: Vec<&Patch> =
                sheet.patches.iter().filter(|patch| (patch.width - board.square_mm).abs() < 1e-9).collect();
            assert_eq!(squares.len(), (board.squares.columns * board.squares.rows).div_ceil(2));
            let left = squares.iter().map(|patch| patch.x).fold(f64::INFINITY, f64::min);
            let right = squares.iter().map(|patch| patch.x + patch.width).fold(0.0, f64::max);
            assert!((right - left - board.squares.columns as f64 * board.square_mm).abs() < 1e-9);
            assert!(sheet.svg().contains(name) && sheet.pdf().starts_with(b"%PDF"));
            let pdf = String::from_utf8_lossy(&sheet.pdf()).into_owned();
            for number in ["0", "10", "100", "190"] {
                assert!(sheet.svg().contains(&format!(">{number}</text>")), "{name}: {number}");
                assert!(pdf.contains(&format!("({number}) Tj")), "{name}: {number}");
            }
            let ruler = sheet.patches.iter().filter(|patch| patch.height < 0.3 && patch.width > 50.0);
            let ruler_mm = ruler.map(|patch| patch.width).fold(0.0, f64::max);
            assert_eq!(sheet.numbers.last().map(|(number, _)| number.parse().unwrap()), Some(ruler_mm), "{name}");
            assert!(
                sheet
                    .patches
                    .iter()
                    .all(|p| p.x >= 0.0 && p.x + p.width <= sheet.width_mm && p.y + p.height <= sheet.height_mm)
            );
        }
        assert!(Sheet::new(&"checker:20x20:100".parse().unwrap()).unwrap_err().message.contains("A0 holds"));
    }

    #[test]
    fn the_pdf_is_true_to_a_ten_thousandth() {
        let board: Board = "charuco:8x11:20:14:DICT_5X5_100".parse().unwrap();
        let pdf = Sheet::new(&board).unwrap().pdf();
        let text = String::from_utf8_lossy(&pdf);
        let numbers = |line: &str| line.split(' ').filter_map(|word| word.parse().ok()).collect::<Vec<f64>>();
        let unit = numbers(text.lines().find(|line| line.ends_with(" cm")).unwrap());
        let mm = |number: f64| number * unit[0] * POINT_MM;
        let rectangles = text.lines().filter(|line| line.ends_with(" re")).map(numbers);
        let squares: Vec<Vec<f64>> = rectangles.filter(|r| (mm(r[2]) - 20.0).abs() < 0.1).collect();
        assert_eq!(squares.len(), 44);
        for side in [0, 1] {
            let places = || squares.iter().map(|square| mm(square[side]));
            let first = places().fold(f64::INFINITY, f64::min);
            for place in places() {
                let count = ((place - first) / 20.0).round();
                assert!((place - first - 20.0 * count).abs() <= 1e-4 * 20.0, "{side}: {place} {first}");
            }
        }
    }
}
