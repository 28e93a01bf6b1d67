//! What the columns of a table are called.

use crate::files::Result;
use crate::tables::Grid;
use crate::tables::names::{self, Unit};

/// What a table looks like.
pub(super) const HINT: &str =
    "a row a joint, from the base: alpha_deg,a_mm,theta_deg,d_mm (deg and mm), or alpha, a, d, theta in any order";

/// What settles which column is which.
pub(super) const BY_FLAG: &str = "`--columns NAME,NAME,...` names the columns in their order: alpha, a, theta and d where they are these, `-` for others";

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

/// Letters of indices that stand below the line, and where they do.
const BELOW: (&str, &str) = (
    "ijn0123456789-+",
    "\u{1d62}\u{2c7c}\u{2099}\u{2080}\u{2081}\u{2082}\u{2083}\u{2084}\u{2085}\u{2086}\u{2087}\u{2088}\u{2089}\u{208b}\u{208a}",
);

/// The columns of alpha, a, theta and d of a table with names.
pub(super) fn named(grid: &Grid, names: &[String]) -> Result<[usize; 4]> {
    let [alpha, a, theta, d] = [0, 1, 2, 3].map(|which| find(grid, names, which));
    let (alpha, a, theta, d) = (alpha?, a?, theta?, d?);
    if plain(&names[a]).0 == ["r"] && alpha < d && d < theta && theta < a {
        let message = "alpha, d, theta, r may be Khalil and Kleinfinger's, where d is the length and r the offset";
        return Err(grid.refuse(grid.rows.first().map_or(1, |(line, _)| *line), message.to_owned(), Some(BY_FLAG)));
    }
    Ok([alpha, a, theta, d])
}

/// The column of the joints' zero offsets as toolboxes have it: `offset` alone is d where no other column is.
pub(super) fn zero_offsets(names: &[String]) -> Option<usize> {
    // `Link offset` is d.
    let first = |name: &str| names::words(name).0.first().is_some_and(|word| word == "offset");
    let is_offset = |at: &usize| first(&names[*at]) && plain(&names[*at]).0 == ["offset"];
    let is_d = |name: &String| name.eq_ignore_ascii_case(OWN[3]) || plain(name).0.iter().any(|word| word == "d");
    let mut found = (0..names.len()).filter(is_offset);
    found.next().filter(|_| found.next().is_none() && names.iter().any(is_d))
}

/// The columns of alpha, a and d where each has one, and theta has none.
pub(super) fn without_theta(names: &[String]) -> Option<[usize; 3]> {
    let only = |which: usize| match columns(names, which)[..] {
        [at] => Some(at),
        _ => None,
    };
    let none = columns(names, 2).is_empty() && zero_offsets(names).is_none();
    Some([only(0)?, only(1)?, only(3)?]).filter(|_| none)
}

/// The columns that a parameter may have.
fn columns(names: &[String], which: usize) -> Vec<usize> {
    if let Some(at) = names.iter().position(|n| n.eq_ignore_ascii_case(OWN[which])) {
        return vec![at];
    }
    let says = |name: &String| {
        let words = plain(name).0;
        // `Link twist (alpha)`, `theta offset`: the letter says it.
        let letters: Vec<&String> = words.iter().filter(|w| !SAID_BESIDE.contains(&w.as_str())).collect();
        let is_it = |w: &String| WORDS[which].contains(&w.as_str());
        if letters.is_empty() { matches!(&words[..], [only] if is_it(only)) } else { letters.into_iter().all(is_it) }
    };
    let is_other = |at: usize| which == 3 && zero_offsets(names) == Some(at);
    (0..names.len()).filter(|&i| says(&names[i]) && !is_other(i)).collect()
}

/// The column of a parameter.
fn find(grid: &Grid, names: &[String], which: usize) -> Result<usize> {
    let (wanted, own) = (NAMES[which], OWN[which]);
    let found = columns(names, which);
    let line = grid.rows.first().map_or(1, |(line, _)| *line);
    match found[..] {
        [at] => Ok(at),
        [] => zero_offsets(names).filter(|_| which == 2).ok_or_else(|| {
            let message = format!("no column `{own}`; the header has: {}", names.join(", "));
            grid.refuse(line, message, Some(&format!("{HINT}; {BY_FLAG}")))
        }),
        _ => Err(grid.refuse(line, format!("two columns `{wanted}`"), Some(&format!("{HINT}; {BY_FLAG}")))),
    }
}

/// A name with its indices on the line, `αᵢ₋₁` as `αi-1`.
pub(super) fn level(name: &str) -> String {
    let (plain, below) = BELOW;
    let of = |c: char| below.chars().zip(plain.chars()).find(|(b, _)| *b == c).map_or(c, |(_, p)| p);
    name.chars().map(of).collect()
}

/// Words of a name without indices and units, and its unit.
pub(super) fn plain(name: &str) -> (Vec<String>, Option<Unit>) {
    let name = ["<sub>", "</sub>"].iter().fold(level(name), |name, mark| name.replace(mark, " "));
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
    // `αi` is `α_i`.
    for word in &mut words {
        let letter = word.strip_suffix(['i', 'j', 'n']).filter(|w| WORDS.iter().any(|known| known.contains(w)));
        if let Some(letter) = letter.map(str::to_owned) {
            *word = letter;
        }
    }
    (words, unit)
}
