//! Rows of figures that stand below a table and are no measurements: means, deviations, extremes, sums.
//!
//! In: the rows of a table. Out: the rows without those, and a sentence that says which they were. A row's numbers
//! tell, in whatever language it is called: each is the same figure of the numbers above it. A word that is known,
//! where others are numbered, makes do with most of them. What goes wrong: a row at the end that is called by such a
//! word where others are numbered, and is no such figure, is refused: whether it was measured only the table's owner
//! knows.

use camino::Utf8Path;

use crate::diagnostic::count;
use crate::files::{Error, Result};
use crate::tables::Fields;

/// Rows of figures below a table at the most.
const MOST: usize = 10;

/// Rows of the longest table whose figures people write below it.
const MOST_ROWS: usize = 100_000;

/// What rounding leaves of a sum, as a share of it.
const ROUNDED: f64 = 1e-9;

/// Half of a last digit, and something for numbers above that were rounded as well.
const DIGIT: f64 = 0.6;

/// Numbers of which there are figures that mean something.
const FEWEST: usize = 4;

/// Columns whose figures are no chance: a measured row is seldom the mean, or the extreme, of a single one.
const COLUMNS: usize = 4;

/// The same beside a word that says it.
const CALLED: usize = 3;

const WORDS: &str = "mean means average avg std stdev stddev stdabw std.dev sd sigma min minimum max maximum sum total median rms range count n \
    mittel mittelwert durchschnitt standardabweichung stabw summe spannweite anzahl moyenne écart-type ecart-type somme media promedio desviación \
    mínimo máximo suma minimo massimo somma 均值 平均 平均值 标准差 最小值 最大值 总和 合计 中位数";

/// A figure of a column.
type Figure = (&'static str, fn(&[f64]) -> f64);

const FIGURES: [Figure; 10] = [
    ("mean", mean),
    ("standard deviation", |v| (squares(v) / (v.len() - 1) as f64).sqrt()),
    ("standard deviation", |v| (squares(v) / v.len() as f64).sqrt()),
    ("minimum", least),
    ("maximum", most),
    ("sum", |v| v.iter().sum()),
    ("median", median),
    ("root mean square", |v| (v.iter().map(|v| v * v).sum::<f64>() / v.len() as f64).sqrt()),
    ("range", |v| most(v) - least(v)),
    ("count", |v| v.len() as f64),
];

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn least(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

fn most(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// Of what is off the mean.
fn squares(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|v| (v - mean).powi(2)).sum()
}

/// As spreadsheets have it: the mean of two in the middle.
fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    f64::midpoint(sorted[(sorted.len() - 1) / 2], sorted[sorted.len() / 2])
}

/// Takes the rows of figures at the end away, and says so.
pub(super) fn taken_away(path: &Utf8Path, rows: &mut Vec<(u64, Fields)>) -> Result<Option<String>> {
    if rows.len() > MOST_ROWS {
        return Ok(None);
    }
    let longest = MOST.min(rows.len().saturating_sub(FEWEST));
    let found = (1..=longest).rev().find_map(|below| {
        let (above, below) = rows.split_at(rows.len() - below);
        // The last row first: mostly it is none.
        let figures: Option<Vec<String>> = below.iter().rev().map(|row| figure(above, row)).collect();
        figures.map(|figures| (above.len(), figures.into_iter().rev().collect::<Vec<_>>().join(", ")))
    });
    let said = found.map(|(end, figures)| {
        let left_out = rows.drain(end..).len();
        let (file, left_out) = (path.file_name().unwrap_or(path.as_str()), count(left_out, "row"));
        format!("{file}: {left_out} below the table left out, figures of the rows above: {figures}")
    });
    match rows.split_last() {
        Some((last, above)) if above.len() >= FEWEST => doubtful(path, above, last).map_or(Ok(said), Err),
        _ => Ok(said),
    }
}

/// Which figure of the rows above a row is, with its line.
fn figure(above: &[(u64, Fields)], (line, row): &(u64, Fields)) -> Option<String> {
    let called = is_called_one(above, row);
    let (mut compared, mut agree) = (0, [0; FIGURES.len()]);
    for column in 0..row.len() {
        let Some(value) = number(&row[column]) else { continue };
        let cells = above.iter().filter(|(_, r)| r.len() > column).map(|(_, r)| &r[column]);
        let (values, steps): (Vec<f64>, Vec<f64>) = cells.filter_map(|cell| Some((number(cell)?, step(cell)))).unzip();
        if values.len() < FEWEST || least(&values) == most(&values) {
            continue;
        }
        compared += 1;
        let (finest, largest) = (least(&steps), most(&values).max(-least(&values)));
        for (agree, (name, of)) in agree.iter_mut().zip(FIGURES) {
            let figure = of(&values);
            // Of numbers that were rounded afterwards the figure may be off by as much as they are.
            let times = if name == "sum" { values.len() as f64 } else { 1.0 };
            let rounding = DIGIT * step(&row[column]).max(times * finest) + ROUNDED * figure.abs().max(largest);
            *agree += usize::from((figure - value).abs() <= rounding);
        }
        if !called && agree.iter().all(|&agree| agree < compared) {
            return None;
        }
    }
    let (best, (name, _)) = agree.into_iter().zip(FIGURES).rev().max_by_key(|(agree, _)| *agree)?;
    let is_figure = match called {
        true => best >= CALLED && 2 * best > compared,
        false => best == compared && best >= COLUMNS && !above.iter().any(|(_, other)| is_copy(row, other)),
    };
    let label = label(row).map_or(String::new(), |(_, label)| format!(" `{label}`"));
    is_figure.then(|| format!("line {line}{label} ({name})"))
}

/// That a row at the end is called a figure and is none.
fn doubtful(path: &Utf8Path, above: &[(u64, Fields)], (line, row): &(u64, Fields)) -> Option<Error> {
    let (_, label) = label(row).filter(|_| is_called_one(above, row))?;
    // A row that lacks what all others have is no measurement, which is said where it is read.
    let lacks = |column: usize| {
        number(&row[column]).is_none() && above.iter().all(|(_, r)| r.len() > column && number(&r[column]).is_some())
    };
    if (0..row.len()).any(lacks) {
        return None;
    }
    let message = format!("the last row is called `{label}`, but its numbers are no such figure of the rows above");
    let hint = "remove the row if it was not measured; if it was, give it a name or a number as the others have";
    Some(Error::format(path, Some(*line), message, Some(hint)))
}

/// The first cell with something in it, with its column, where it is no number.
fn label(row: &Fields) -> Option<(usize, &str)> {
    let column = (0..row.len()).find(|&column| !row[column].trim().is_empty())?;
    number(&row[column]).is_none().then(|| (column, &row[column]))
}

/// Whether a row has the name of a figure where those above are numbered; names that are words may be any, `min` that
/// of a pose.
fn is_called_one(above: &[(u64, Fields)], row: &Fields) -> bool {
    let is_numbered = |cell: &str| cell.is_empty() || cell.contains(|c: char| c.is_ascii_digit());
    label(row).is_some_and(|(column, label)| {
        let word = label.trim().trim_end_matches([':', '.', '=']).to_lowercase();
        WORDS.split_whitespace().any(|known| known == word)
            && above.iter().all(|(_, other)| other.len() <= column || is_numbered(&other[column]))
    })
}

fn number(cell: &str) -> Option<f64> {
    cell.trim().parse().ok().filter(|value: &f64| value.is_finite())
}

/// One of the last digit of a number.
fn step(cell: &str) -> f64 {
    let (mantissa, exponent) = cell.trim().split_once(['e', 'E']).unwrap_or((cell.trim(), "0"));
    let decimals = mantissa.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    10f64.powi(exponent.parse::<i32>().unwrap_or(0).saturating_sub(decimals as i32))
}

/// Whether all numbers of a row are those of another one.
fn is_copy(row: &Fields, other: &Fields) -> bool {
    let same = |column: usize| row.len() == other.len() && number(&row[column]) == number(&other[column]);
    (0..row.len()).all(|column| number(&row[column]).is_none() || same(column))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::report;

    const ABOVE: [[f64; 5]; 5] = [
        [1.5, 20.25, -3.5, 700.125, 8.0],
        [2.5, -10.5, 4.75, 650.5, 8.0],
        [-7.25, 5.5, 1.25, 810.75, 8.0],
        [4.0, 0.25, -9.5, 590.25, 8.0],
        [0.5, -6.25, 2.0, 640.0, 8.0],
    ];

    type Of<'a> = &'a dyn Fn(&[f64]) -> f64;

    /// Rows of these names, and one of each figure below, named so.
    fn table(names: [&str; 5], below: &[(&str, Of)]) -> Vec<(u64, Fields)> {
        let row = |name: &str, numbers: [f64; 5]| {
            Fields::new(std::iter::once(name.to_owned()).chain(numbers.iter().map(f64::to_string)))
        };
        let column = |k: usize| ABOVE.map(|row| row[k]);
        let measured = names.into_iter().zip(ABOVE).map(|(name, numbers)| row(name, numbers));
        let figures =
            below.iter().map(|(name, of)| row(name, [0, 1, 2, 3, 4].map(|k| (1e3 * of(&column(k))).round() / 1e3)));
        (2..).zip(measured.chain(figures)).collect()
    }

    fn said(rows: &mut Vec<(u64, Fields)>) -> String {
        let said = taken_away(Utf8Path::new("t.csv"), rows);
        said.map_or_else(|e| report(&e), Option::unwrap_or_default)
    }

    #[test]
    fn figures_of_the_columns_are_no_rows_whatever_they_are_called() {
        let numbered = ["P1", "P2", "P3", "P4", "P5"];
        for (name, of, figure) in [
            ("Mittel", &mean as Of, "line 7 `Mittel` (mean)"),
            ("Keskiarvo", &mean, "line 7 `Keskiarvo` (mean)"),
            ("", &least, "line 7 (minimum)"),
            ("max", &most, "line 7 `max` (maximum)"),
            ("Std:", &|v: &[f64]| (squares(v) / 4.0).sqrt(), "line 7 `Std:` (standard deviation)"),
            ("Summe", &|v: &[f64]| v.iter().sum(), "line 7 `Summe` (sum)"),
        ] {
            for names in [numbered, ["home", "left", "right", "max", "mean"]] {
                let mut rows = table(names, &[(name, of)]);
                let said = said(&mut rows);
                assert!(said.contains("1 row below the table left out") && said.ends_with(figure), "{name}: {said}");
                assert_eq!(rows, table(names, &[]), "{name}");
            }
        }
        let mut rows = table(numbered, &[("a", &mean), ("b", &least), ("c", &most), ("d", &median)]);
        assert!(
            said(&mut rows)
                .contains("line 7 `a` (mean), line 8 `b` (minimum), line 9 `c` (maximum), line 10 `d` (median)")
        );
        assert_eq!(rows.len(), 5);
    }

    #[test]
    fn a_word_alone_takes_no_row_away() {
        let numbered = ["P1", "P2", "P3", "P4", "P5"];
        let other: Of = &|v| 0.3 * v[0] + 0.9 * v[3];
        // Names of rows that are all words may be any.
        let mut rows = table(["home", "left", "right", "up", "min"], &[("max", other)]);
        assert!(said(&mut rows).is_empty() && rows.len() == 6);
        let mut rows = table(numbered, &[("P6", other)]);
        assert!(said(&mut rows).is_empty() && rows.len() == 6);
        let refused = said(&mut table(numbered, &[("Mittel", other)]));
        assert!(
            refused.contains("t.csv:7") && refused.contains("is called `Mittel`") && refused.contains("remove the row"),
            "{refused}"
        );
        // A pose at the least of most columns may be called so.
        let corner: Of = &|v| if v[0] > 100.0 { 612.5 } else { least(v) };
        let mut rows = table(["home", "left", "right", "up", "max"], &[("min", corner)]);
        assert!(said(&mut rows).is_empty() && rows.len() == 6);
        // A row that was measured again is no extreme of the others.
        let mut rows = table(numbered, &[("P6", &|v: &[f64]| v[1])]);
        assert!(said(&mut rows).is_empty() && rows.len() == 6);
    }

    #[test]
    fn a_word_makes_do_with_most_columns() {
        let of = |v: &[f64]| if v[0] > 100.0 { 1.5 } else { mean(v) };
        for (name, left) in [("Mean", 5), ("P6", 6)] {
            let mut rows = table(["P1", "P2", "P3", "P4", "P5"], &[(name, &of)]);
            said(&mut rows);
            assert_eq!(rows.len(), left, "{name}");
        }
    }
}
