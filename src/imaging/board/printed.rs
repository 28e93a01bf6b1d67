//! What a caliper says of a printed board.
//!
//! In: the printed extent from the outer edge of the first to that of the last square, across and along, and the board
//! as drawn. Out: the board as printed (width and height have scales of their own), and how well its lengths are known.
//! Goes wrong: an extent that is not this board's, which is named: another extent of it, exchanged sides, a print not
//! in true size, other counts.

use std::str::FromStr;

use super::certificate::{Board, Kind, MOST_STRETCH};

/// What to do where the inner corners' extent was measured.
const OF_INNER: &str = "measure from the outer edge of the first square to that of the last";

/// Largest error of a caliper over up to 300 mm, mm (DIN 862).
const CALIPER_MM: f64 = 0.03;

/// A printed extent as it was read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrintedExtent {
    /// Width and height, mm.
    pub mm: [f64; 2],
    /// The last digit that was read, mm.
    pub digit_mm: f64,
}

impl FromStr for PrintedExtent {
    type Err = String;

    /// Reads `149.7x99.8`.
    fn from_str(text: &str) -> Result<PrintedExtent, String> {
        let refuse = || "an extent is WIDTHxHEIGHT in mm, as `149.7x99.8`".to_owned();
        let (width, height) = text.split_once(['x', 'X']).ok_or_else(refuse)?;
        let number = |word: &str| {
            let word = word.trim();
            let value = word.parse::<f64>().ok().filter(|mm| mm.is_finite() && *mm > 0.0).ok_or_else(refuse)?;
            let digits = word.split_once('.').map_or(0, |(_, digits)| digits.len() as i32);
            Ok::<_, String>((value, 10f64.powi(-digits)))
        };
        let ((width, a), (height, b)) = (number(width)?, number(height)?);
        Ok(PrintedExtent { mm: [width, height], digit_mm: a.max(b) })
    }
}

/// A board as it was printed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Printed {
    pub board: Board,
    /// Expanded uncertainty (k = 2) of its whole extent, mm; that of a shorter length is less.
    pub uncertainty_mm: f64,
}

impl PrintedExtent {
    /// A board as large as this extent, whatever size it has.
    fn scaled(&self, board: &Board) -> Board {
        let [width, height] = board.extent_mm();
        board.scaled((self.mm[0] + self.mm[1]) / (width + height))
    }

    /// The board with this extent where nobody said how large its squares are: they are `assumed` to be so large, which
    /// the extent overrules where it is no small mistake. The reason where the unit or what was measured is in doubt.
    pub fn of_any_size(&self, assumed: &Board) -> Result<Printed, String> {
        /// How many times larger squares are none that were printed otherwise or measured over fewer of them.
        const LARGER: f64 = 1.6;
        let scaled = self.scaled(assumed);
        let [width, height] = self.mm;
        match self.of(&scaled) {
            Ok(printed) if scaled.square_mm > LARGER * assumed.square_mm => Ok(printed),
            Ok(_) if LARGER * scaled.square_mm < assumed.square_mm => {
                let [across, along] = self.mm.map(|value| as_written_mm(10.0 * value));
                let side = (scaled.square_mm * 1e3).round() / 1e3;
                Err(format!(
                    "a printed extent of {width} x {height} mm makes {} of {side} mm: if it was read in cm, it is `--measured-mm {across}x{along}`; \
                     if they are so small, say so as well: `--square-mm {side}`",
                    scaled.unit()
                ))
            }
            Err(_) if self.is_inner_of_any_size(assumed) => Err(format!(
                "a printed extent of {width} x {height} mm has the shape of what the inner corners of {} {} span: {OF_INNER}",
                assumed.squares,
                assumed.unit()
            )),
            _ => self.of(assumed),
        }
    }

    /// Whether the extent is as wide as high as what the inner corners span, whatever the board's size, and not as the
    /// whole board is.
    fn is_inner_of_any_size(&self, board: &Board) -> bool {
        let inner = [board.spans_mm(board.columns() - 1)[0], board.spans_mm(board.rows() - 1)[1]];
        let is = |mm: [f64; 2]| (mm[0] / inner[0] / (mm[1] / inner[1]) - 1.0).abs() <= MOST_STRETCH;
        is(self.mm) || !board.is_coded() && is([self.mm[1], self.mm[0]])
    }

    /// The board with this extent; the reason where it is not the extent of it.
    pub fn of(&self, board: &Board) -> Result<Printed, String> {
        let whole = board.extent_mm();
        let scales = |mm: [f64; 2], extent: [f64; 2]| [0, 1].map(|k| mm[k] / extent[k]);
        let fits = |scales: [f64; 2]| scales.iter().all(|scale| (scale - 1.0).abs() <= MOST_STRETCH);
        let exchanged = [self.mm[1], self.mm[0]];
        let (mut mm, is_plain) = (self.mm, !board.is_coded());
        // Of a plain board the larger count comes first, however it lies.
        if is_plain && !fits(scales(mm, whole)) && fits(scales(exchanged, whole)) {
            mm = exchanged;
        }
        let [across, along] = scales(mm, whole);
        if !fits([across, along]) {
            let inner = [board.spans_mm(board.columns() - 1)[0], board.spans_mm(board.rows() - 1)[1]];
            let is_inner = fits(scales(mm, inner)) || is_plain && fits(scales(exchanged, inner));
            return Err(self.another(board, fits(scales(exchanged, whole)), is_inner));
        }
        let mut uncertainty_mm = CALIPER_MM + self.digit_mm / 2.0;
        let (width, height) = if is_plain && board.squares.columns == board.squares.rows {
            // Which side was called the width the pictures do not tell.
            uncertainty_mm += (mm[0] - mm[1]).abs() / 2.0;
            let mean = (across + along) / 2.0;
            (mean, mean)
        } else {
            (across, along)
        };
        let scaled = board.scaled(width);
        // As a person writes them: 10.05 for twenty squares in 201 mm.
        let [square_mm, height_mm] = [scaled.square_mm, board.sides_mm()[1] * height].map(as_written_mm);
        Ok(Printed { board: Board { square_mm, stretch: height_mm / square_mm, ..scaled }, uncertainty_mm })
    }

    /// The extent in mm and the unit in which it was written, where the board has it in another one.
    fn in_another_unit(&self, board: &Board) -> Option<([f64; 2], &'static str)> {
        const UNITS: [(f64, &str); 3] = [(10.0, "cm"), (25.4, "inches"), (1000.0, "m")];
        let whole = board.extent_mm();
        let of = |(unit_mm, name): (f64, &'static str)| {
            let mm = self.mm.map(|value| as_written_mm(value * unit_mm));
            let is = |extent: [f64; 2]| (0..2).all(|k| (mm[k] / extent[k] - 1.0).abs() <= MOST_STRETCH);
            (is(whole) || is([whole[1], whole[0]])).then_some((mm, name))
        };
        UNITS.into_iter().find_map(of)
    }

    /// A board that was printed smaller or larger as a whole, and how it is then given.
    fn of_another_scale(&self, board: &Board, scale: [f64; 2], and: &str) -> String {
        let scale = (scale[0] + scale[1]) / 2.0;
        let sides = |mm: f64| (mm * scale * 1e3).round() / 1e3;
        let square = sides(board.square_mm);
        let given = match board.kind {
            Kind::Checker => format!("`--squares {} --square-mm {square}`", board.squares),
            Kind::Charuco { marker_mm, .. } => {
                format!("`--board` with squares of {square} mm and markers of {} mm", sides(marker_mm))
            }
            Kind::Tags { gap_mm, .. } => {
                format!("`--board` with tags of {square} mm and gaps of {} mm", sides(gap_mm))
            }
        };
        let ([width, height], percent) = (self.mm, 100.0 * (scale - 1.0));
        format!(
            "a printed extent of {width} x {height} mm is not that of {}: {and}it was printed {percent:+.1} % in size, or has other squares or counts; as it was \
             printed it is {given}",
            board.said()
        )
    }

    /// Why the extent is not the board's.
    fn another(&self, board: &Board, is_exchanged: bool, is_inner: bool) -> String {
        let ([width, height], nominal) = (self.mm, board.extent_mm());
        let why = if let Some(([across, along], unit)) = self.in_another_unit(board) {
            format!("it is that in {unit}; in mm it is `--measured-mm {across}x{along}`")
        } else if is_exchanged {
            "width and height are exchanged".to_owned()
        } else if is_inner {
            format!("that is the extent of its inner corners: {OF_INNER}")
        } else {
            let scale = [width / nominal[0], height / nominal[1]];
            let percent = scale.map(|scale| 100.0 * (scale - 1.0));
            let turned = [width / nominal[1], height / nominal[0]];
            if (scale[0] / scale[1] - 1.0).abs() <= MOST_STRETCH {
                return self.of_another_scale(board, scale, "");
            }
            if (turned[0] / turned[1] - 1.0).abs() <= MOST_STRETCH {
                return self.of_another_scale(board, turned, "width and height are exchanged, and ");
            }
            format!(
                "{:+.1} % and {:+.1} %: other counts, another side of the squares, or a print that was not in true size",
                percent[0], percent[1]
            )
        };
        format!(
            "a printed extent of {width} x {height} mm is not that of {}, {} x {} mm: {why}",
            board.said(),
            as_written_mm(nominal[0]),
            as_written_mm(nominal[1])
        )
    }
}

/// A length without what a double makes of its last digits.
fn as_written_mm(mm: f64) -> f64 {
    (mm * 1e9).round() / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(board: &str, extent: &str) -> Result<Printed, String> {
        extent.parse::<PrintedExtent>()?.of(&board.parse().unwrap())
    }

    #[test]
    fn width_and_height_have_scales_of_their_own() {
        let Printed { board, uncertainty_mm } = measured("charuco:10x8:15:11:DICT_5X5_100", "149.7x120.6").unwrap();
        let [width, height] = board.sides_mm();
        assert!((width - 14.97).abs() < 1e-12 && (height - 15.075).abs() < 1e-12, "{width} {height}");
        assert!((uncertainty_mm - 0.08).abs() < 1e-12);
        let (a, b) = (board.corner_mm(0, 0), board.corner_mm(8, 6));
        assert!((b.x - a.x - 8.0 * 14.97).abs() < 1e-9 && (b.y - a.y - 6.0 * 15.075).abs() < 1e-9);
        // As it was drawn nothing changes, to the bit.
        assert_eq!(measured("checker:10x8:15", "150x120").unwrap().board, "checker:10x8:15".parse().unwrap());
        // A plain board may lie on either side.
        let lying = measured("checker:10x8:15", "120.6x149.7").unwrap();
        assert_eq!(lying.board, measured("checker:10x8:15", "149.7x120.6").unwrap().board);
        // Sides that are no short numbers are told in few digits, and exact ones stay exact.
        let thirds = measured("checker:9x7:30", "266.5x210.0").unwrap().board;
        assert_eq!(
            (thirds.said(), thirds.to_string()),
            ("9x7 squares of 29.61111x30 mm".to_owned(), "checker:9x7:29.611111111x30".to_owned())
        );
        assert!((thirds.spans_mm(5)[1] - 150.0).abs() < 1e-12);
        // And of a square one the sides are not told apart.
        let square = measured("checker:10x10:15", "149.7x150.1").unwrap();
        assert!(square.board.stretch == 1.0 && (square.board.square_mm - 14.99).abs() < 1e-12);
        assert!((square.uncertainty_mm - 0.28).abs() < 1e-9, "{}", square.uncertainty_mm);
    }

    #[test]
    fn of_a_size_that_nobody_gave_the_extent_alone_tells_it() {
        let extent: PrintedExtent = "266.5x210".parse().unwrap();
        let said = "checker:9x7:30".parse().unwrap();
        let assumed = "checker:9x7:10".parse().unwrap();
        assert_eq!(extent.of_any_size(&assumed).unwrap(), extent.of(&said).unwrap());
        for (extent, why) in [
            (
                "26.65x21",
                "if it was read in cm, it is `--measured-mm 266.5x210`; if they are so small, say so as well: `--square-mm 2.978`",
            ),
            ("210x150", "span: measure from the outer edge of the first square"),
            ("150x210", "span: measure from the outer edge of the first square"),
            ("80.1x62", "printed -11.2 % in size"),
            ("266.5x260", "other counts"),
        ] {
            let said = extent.parse::<PrintedExtent>().unwrap().of_any_size(&assumed).unwrap_err();
            assert!(said.contains(why), "{extent}: {said}");
        }
    }

    #[test]
    fn another_extent_is_named() {
        let coded = "charuco:10x8:15:11:DICT_5X5_100";
        for (board, extent, why) in [
            (coded, "120.1x150.2", "exchanged"),
            (coded, "120.1x90.2", "inner corners"),
            ("checker:10x8:15", "90.2x120.1", "inner corners"),
            (coded, "142.5x114", "printed -5.0 % in size"),
            (coded, "142.5x114", "`--board` with squares of 14.25 mm and markers of 10.45 mm"),
            ("checker:11x8:20", "212.3x154.4", "`--squares 11x8 --square-mm 19.3`"),
            ("checker:11x8:20", "154.4x212.3", "width and height are exchanged, and it was printed -3.5 %"),
            (coded, "150x112", "+0.0 % and -6.7 %"),
            ("checker:10x7:25", "25x17.5", "it is that in cm; in mm it is `--measured-mm 250x175`"),
            ("checker:10x7:25", "17.5x25", "`--measured-mm 175x250`"),
            ("checker:10x7:25.4", "10x7", "it is that in inches"),
            // A tenth as large is no mistake of the unit where the sides are not those of the board.
            ("checker:10x7:25", "25x16", "-90.0 % and -90.9 %"),
        ] {
            let said = measured(board, extent).unwrap_err();
            assert!(said.contains(why), "{board} {extent}: {said}");
        }
        // Three per cent are not more than that.
        measured("checker:11x8:20", "213.4x155.2").unwrap();
        for extent in ["150", "150x", "x120", "150x-3", "axb", "150x120x3"] {
            assert!(extent.parse::<PrintedExtent>().is_err(), "{extent}");
        }
    }
}
