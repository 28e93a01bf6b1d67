//! Numbers as people write them: a decimal comma, thousands set apart, a minus sign or blanks as typesetters have them.
//!
//! In: the cells of a whole file. Out: the same cells, those that are numbers written as a program reads them. What a
//! comma or a point means is decided once for the file, by cells that allow one reading alone: `1,487.1` and
//! `1,234,567` set thousands apart by commas, `1.487,1` by points, and a comma before other than three digits is a
//! decimal one. What goes wrong: a file that holds cells of both kinds keeps them as they are, and is refused where
//! they should be numbers.

/// What separates in the numbers of a file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Style {
    /// A comma stands before the decimals.
    comma_is_decimal: bool,
    /// What sets thousands apart.
    thousands: Option<char>,
}

impl Style {
    /// Of these cells; `free` says that a comma may stand inside of a number without quotes around it.
    pub fn of<'a>(cells: impl Iterator<Item = &'a str>, free: bool) -> Style {
        let (mut by_commas, mut by_points, mut decimal) = (false, false, false);
        for cell in cells.filter(|cell| cell.contains(',') && cell.len() < 40 || cell.matches('.').count() > 1) {
            let cell = bare(cell);
            let sets_apart = |by: char, decimal: char| {
                ungrouped(&cell, by, decimal).is_some() && (cell.contains(decimal) || cell.matches(by).count() > 1)
            };
            by_commas |= sets_apart(',', '.');
            by_points |= sets_apart('.', ',');
            decimal |= is_decimal_comma(&cell);
        }
        let both = by_commas && (by_points || decimal);
        Style {
            comma_is_decimal: !by_commas && (free || decimal || by_points),
            thousands: if both { None } else { by_commas.then_some(',').or(by_points.then_some('.')) },
        }
    }

    /// A cell as a program reads it, where it is a number; `None` where it is none, or is one as it stands.
    pub fn number(self, cell: &str) -> Option<String> {
        if cell.parse::<f64>().is_ok() && self.thousands != Some('.') {
            return None;
        }
        let bare = bare(cell);
        let decimal = if self.comma_is_decimal { ',' } else { '.' };
        let plain = match self.thousands.and_then(|thousands| ungrouped(&bare, thousands, decimal)) {
            Some(plain) => plain,
            None if self.comma_is_decimal && bare.matches(',').count() == 1 && !bare.contains('.') => {
                bare.replace(',', ".")
            }
            None => bare,
        };
        is_number(&plain).then_some(plain).filter(|plain| plain != cell)
    }
}

/// Whether a comma in it can be a decimal one alone: not three digits behind it, or nothing or too much before it.
fn is_decimal_comma(cell: &str) -> bool {
    let Some((before, after)) = cell.split_once(',') else { return false };
    let digits = before.trim_start_matches(['+', '-']);
    let behind = after.split(['e', 'E']).next().unwrap_or("");
    is_number(&cell.replacen(',', ".", 1))
        && !behind.is_empty()
        && (behind.len() != 3 || digits.is_empty() || digits.len() > 3 || digits == "0")
}

pub(super) fn is_number(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.')) && text.parse::<f64>().is_ok()
}

/// Without blanks between digits and apostrophes that set thousands apart, with a plain minus sign and an exponent's
/// `e` for Fortran's `D`.
fn bare(cell: &str) -> String {
    let plain = cell.trim().replace(['\u{a0}', '\u{202f}', '\u{2009}', '\u{2007}'], "").replace('\u{2212}', "-");
    if plain.contains(' ') || plain.contains('\'') || plain.contains('\u{2019}') {
        let grouped = [' ', '\'', '\u{2019}']
            .iter()
            .find_map(|&by| ungrouped(&plain, by, '.').or_else(|| ungrouped(&plain, by, ',')));
        return grouped.unwrap_or(plain);
    }
    let of_fortran = plain.replacen(['D', 'd'], "e", 1);
    if of_fortran != plain && is_number(&of_fortran) { of_fortran } else { plain }
}

/// A number whose digits are set apart in threes, without what sets them apart and with its decimals as they are but
/// for the point.
fn ungrouped(cell: &str, by: char, decimal: char) -> Option<String> {
    let (sign, rest) = cell.split_at(usize::from(cell.starts_with(['+', '-'])));
    let (whole, decimals) = rest.split_once(decimal).map_or((rest, None), |(whole, behind)| (whole, Some(behind)));
    let mut groups = whole.split(by);
    let first = groups.next()?;
    let digits = |text: &str| text.chars().all(|c| c.is_ascii_digit());
    let rest: Vec<&str> = groups.collect();
    let grouped = (1..=3).contains(&first.len()) && digits(first) && !rest.is_empty();
    if !grouped || !rest.iter().all(|group| group.len() == 3 && digits(group)) {
        return None;
    }
    let plain = format!("{sign}{first}{}{}", rest.concat(), decimals.map_or(String::new(), |d| format!(".{d}")));
    is_number(&plain).then_some(plain)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(cells: &[&str], free: bool) -> Vec<String> {
        let style = Style::of(cells.iter().copied(), free);
        cells.iter().map(|cell| style.number(cell).unwrap_or_else(|| (*cell).to_owned())).collect()
    }

    #[test]
    fn what_a_comma_means_is_decided_by_cells_that_allow_one_reading() {
        assert_eq!(read(&["1,487.1", "-2,345"], true), ["1487.1", "-2345"]);
        assert_eq!(read(&["1.487,1", "-2.345", "3,5"], true), ["1487.1", "-2345", "3.5"]);
        assert_eq!(read(&["1,234,567", "1,000"], false), ["1234567", "1000"]);
        assert_eq!(read(&["1,5", "2,345"], true), ["1.5", "2.345"]);
        assert_eq!(read(&["1,5", "-0,25e-3"], false), ["1.5", "-0.25e-3"]);
        // A quoted cell that could be either stays as it is.
        assert_eq!(read(&["1,500"], false), ["1,500"]);
        assert_eq!(read(&["1,487.1", "2,5"], true), ["1,487.1", "2,5"]);
    }

    #[test]
    fn blanks_and_apostrophes_set_thousands_apart() {
        assert_eq!(read(&["1\u{a0}487.5", "1\u{202f}487,5", "1'487.5"], true), ["1487.5", "1487.5", "1487.5"]);
        assert_eq!(read(&["2.5\u{a0}", "\u{2212}3", "1.5D+02", "1.25d-1"], false), ["2.5", "-3", "1.5e+02", "1.25e-1"]);
        assert_eq!(
            read(&["P1", "D5", "2020-05-03", "12:30", "a,b", "nan"], true),
            ["P1", "D5", "2020-05-03", "12:30", "a,b", "nan"]
        );
    }
}
