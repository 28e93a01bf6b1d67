//! What the columns of a table are called.

use crate::files::Result;
use crate::tables::Grid;
use crate::tables::names::{self, Unit};

/// What a table looks like.
pub(super) const HINT: &str =
    "a row a joint, from the base: alpha_deg,a_mm,theta_deg,d_mm (deg and mm), or alpha, a, d, theta in any order";

/// What the columns of a row are called, in the order of a row: alpha, a, theta, d.
pub(super) const NAMES: [&str; 4] = ["alpha", "a", "theta", "d"];

/// The same with units, as this program writes them.
pub(super) const OWN: [&str; 4] = ["alpha_deg", "a_mm", "theta_deg", "d_mm"];

/// Other words for them.
const WORDS: [&[&str]; 4] = [
    &["alpha", "α", "twist"],
    &["a", "r", "length", "linklength"],
    &["theta", "θ", "th", "q", "angle"],
    &["d", "offset", "linkoffset"],
];

/// Words that may stand beside a parameter's letter.
const SAID_BESIDE: [&str; 5] = ["twist", "length", "angle", "offset", "linkoffset"];

/// The columns of alpha, a, theta and d of a table with names.
pub(super) fn named(grid: &Grid, names: &[String]) -> Result<[usize; 4]> {
    let [alpha, a, theta, d] = [0, 1, 2, 3].map(|which| find(grid, names, which));
    Ok([alpha?, a?, theta?, d?])
}

/// The column of a parameter.
fn find(grid: &Grid, names: &[String], which: usize) -> Result<usize> {
    let (wanted, own) = (NAMES[which], OWN[which]);
    if let Some(at) = names.iter().position(|n| n.eq_ignore_ascii_case(own)) {
        return Ok(at);
    }
    let says = |name: &String| {
        let words = plain(name).0;
        // `Link twist (alpha)`, `theta offset`: the letter says it.
        let letters: Vec<&String> = words.iter().filter(|w| !SAID_BESIDE.contains(&w.as_str())).collect();
        let is_it = |w: &String| WORDS[which].contains(&w.as_str());
        if letters.is_empty() { matches!(&words[..], [only] if is_it(only)) } else { letters.into_iter().all(is_it) }
    };
    let found: Vec<usize> = (0..names.len()).filter(|&i| says(&names[i])).collect();
    let line = grid.rows.first().map_or(1, |(line, _)| *line);
    match found[..] {
        [at] => Ok(at),
        [] => Err(grid.refuse(line, format!("no column `{own}`; the header has: {}", names.join(", ")), Some(HINT))),
        _ => Err(grid.refuse(line, format!("two columns `{wanted}`"), Some(HINT))),
    }
}

/// Words of a name without indices and units, and its unit.
pub(super) fn plain(name: &str) -> (Vec<String>, Option<Unit>) {
    let name = ["<sub>", "</sub>"].iter().fold(name.to_owned(), |name, mark| name.replace(mark, " "));
    let (mut words, mut unit) = names::words(&name);
    if words.len() > 1
        && let Some(found) = words.last().and_then(|w| Unit::of(w))
    {
        unit = unit.or(Some(found));
        words.pop();
    }
    words.retain(|w| {
        !w.chars().all(|c| c.is_ascii_digit()) && !matches!(w.as_str(), "i" | "j" | "n" | "link" | "joint")
    });
    (words, unit)
}
