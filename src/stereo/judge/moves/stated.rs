//! A known move as it is typed: `5mm`, `5mm+-0.002`, `5mm:03,04`.

use std::str::FromStr;

/// Expanded uncertainty (k = 2) of a move that comes without one, mm: a gauge block against a stop.
pub const UNCERTAINTY_MM: f64 = 0.002;

const LONGEST_MM: f64 = 10_000.0;

/// A slide of the board by a known length.
#[derive(Debug, Clone, PartialEq)]
pub struct StatedMove {
    pub length_mm: f64,
    /// Expanded uncertainty (k = 2) of that, mm.
    pub uncertainty_mm: f64,
    /// The pairs before and after it; `None` where their look is to tell.
    pub between: Option<[String; 2]>,
}

impl FromStr for StatedMove {
    type Err = String;

    fn from_str(text: &str) -> Result<StatedMove, String> {
        let refuse = || {
            "a move is a length in mm, perhaps its uncertainty (k = 2) and the pairs before and after it: `5mm`, `5mm+-0.002` or \
             `5mm+-0.002:03,04`"
                .to_owned()
        };
        let (length, pairs) = text.split_once(':').map_or((text, None), |(length, pairs)| (length, Some(pairs)));
        let (length, uncertainty) = match length.split_once("+-").or_else(|| length.split_once('\u{b1}')) {
            Some((length, uncertainty)) => (length, Some(uncertainty)),
            None => (length, None),
        };
        let number = |word: &str| {
            let word = word.trim();
            word.strip_suffix("mm").unwrap_or(word).trim_end().parse::<f64>().map_err(|_| refuse())
        };
        let length_mm = number(length)?;
        let uncertainty_mm = uncertainty.map_or(Ok(UNCERTAINTY_MM), number)?;
        // A comparison with NaN is false, so this way round it is refused as well.
        if !(length_mm > 0.0 && length_mm <= LONGEST_MM) {
            return Err(format!("a move is longer than 0 and at most {LONGEST_MM} mm; {}", refuse()));
        }
        if !(uncertainty_mm >= 0.0 && uncertainty_mm < length_mm) {
            return Err(format!(
                "a move of {length_mm} mm that is known to {uncertainty_mm} mm is none; its uncertainty is less than the move and not negative"
            ));
        }
        let between = pairs.map(|pairs| {
            let (first, second) = pairs.split_once(',').ok_or_else(refuse)?;
            let names = [first, second].map(|name| name.trim().to_owned());
            match &names {
                [a, b] if a.is_empty() || b.is_empty() => Err(refuse()),
                [a, b] if a == b => Err(format!("a move is between two pairs, and pair {a} is named twice")),
                _ => Ok(names),
            }
        });
        Ok(StatedMove { length_mm, uncertainty_mm, between: between.transpose()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moves_are_read_as_a_person_writes_them() {
        let stated = |length_mm, uncertainty_mm, between: Option<[&str; 2]>| StatedMove {
            length_mm,
            uncertainty_mm,
            between: between.map(|names| names.map(str::to_owned)),
        };
        for (text, read) in [
            ("5mm", stated(5.0, UNCERTAINTY_MM, None)),
            ("5", stated(5.0, UNCERTAINTY_MM, None)),
            ("5.08 mm +- 0.003 mm", stated(5.08, 0.003, None)),
            ("5mm±0.003", stated(5.0, 0.003, None)),
            ("25mm+-0:left 03, left 04", stated(25.0, 0.0, Some(["left 03", "left 04"]))),
            ("5mm:a:1,b", stated(5.0, UNCERTAINTY_MM, Some(["a:1", "b"]))),
        ] {
            assert_eq!(text.parse::<StatedMove>().unwrap(), read, "{text}");
        }
    }

    #[test]
    fn what_is_no_move_is_refused() {
        for (text, why) in [
            ("", "a move is a length"),
            ("five", "a move is a length"),
            ("5cm", "a move is a length"),
            ("5mm:03", "a move is a length"),
            ("5mm:,04", "a move is a length"),
            ("0mm", "longer than 0"),
            ("-5mm", "longer than 0"),
            ("nan", "longer than 0"),
            ("5mm+-6", "is none"),
            ("5mm+--1", "is none"),
            ("5mm+-nan", "is none"),
            ("5mm:03,03", "pair 03 is named twice"),
        ] {
            let said = text.parse::<StatedMove>().unwrap_err();
            assert!(said.contains(why), "{text}: {said}");
        }
    }
}
