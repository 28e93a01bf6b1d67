//! Lists of numbers in the text of programs, `a = [0, 0.4]`, and the links of one list a parameter; parameters with the
//! number of their link or joint in the name, `alpha0: 0, a0: 0, d1: 0.3, q2: q2 - pi/2`, and theirs.

use std::collections::BTreeMap;

use super::indexed::opening;
use super::link::{KEYS, Known, Link, Wrong};
use crate::robot::catalogue::Convention;
use crate::tables::expression::{Value, evaluate};
use crate::tables::names::Unit;

/// The first list of each parameter, with its line.
pub(super) type Lists = [Option<(u64, Vec<Value>)>; 4];

/// Parts of a list's name that make it one of something else.
const OTHERS: [&str; 9] = ["delta", "error", "err", "std", "min", "max", "lim", "limits", "diff"];

/// The numbers of a list, `[0, pi/2]`, `np.array([0 1])`, `np.deg2rad([0, 90])`, `[0 90]*pi/180`; `None` where it is
/// none.
pub(super) fn list(value: &str, known: &Known) -> Option<Vec<Value>> {
    let value = value.trim_start();
    let open = opening(value)?;
    let head = value[..open].trim();
    let turned = head.trim_end_matches('(').rsplit('.').next().is_some_and(|f| matches!(f, "deg2rad" | "radians"));
    if !(head.is_empty() || head.ends_with('(') && head.len() < 30) || head.contains(['\n', ',', ';']) {
        return None;
    }
    let end = open + value[open..].find([']', '}'])?;
    let inside = &value[open + 1..end];
    let known = |name: &str| known.get(name).copied();
    let numbers: Option<Vec<Value>> = match inside.contains([',', ';']) {
        true => inside.trim_end_matches([',', ';', ' ', '\n']).split([',', ';']).map(|t| evaluate(t, &known)).collect(),
        false => inside.split_whitespace().map(|t| evaluate(t, &known)).collect(),
    };
    let factor = factor(&value[end + 1..], &known)?;
    let times = |v: Value| match turned {
        true => Value { number: (v.number * factor.number).to_radians(), radians: true, ..v },
        false => Value { number: v.number * factor.number, radians: v.radians || factor.radians, ..v },
    };
    numbers.map(|list| list.into_iter().map(times).collect())
}

/// What a list is multiplied with behind its bracket; a unit by name leaves it as it is. `None` where that is no
/// number.
fn factor(behind: &str, known: &dyn Fn(&str) -> Option<Value>) -> Option<Value> {
    let behind = behind.trim_start_matches([')', ' ']);
    let behind = behind[..extent(behind)].trim_start_matches('.').trim_end();
    if !behind.starts_with(['*', '/']) {
        return Some(Value { number: 1.0, radians: false, variable: false });
    }
    let by_unit = || {
        let name = behind[1..].trim().rsplit('.').next()?;
        Unit::of(name).map(|_| Value { number: 1.0, radians: false, variable: false })
    };
    evaluate(&format!("1{behind}"), known).filter(|v| !v.variable).or_else(by_unit)
}

/// The parameter that a name with something before or behind it is of, `ar3_alpha_vals`, and what stands before.
pub(super) fn affixed(word: &str) -> Option<(String, usize)> {
    let lower = word.to_lowercase();
    let parts: Vec<&str> = lower.split('_').collect();
    let which = |part: &&str| KEYS.iter().position(|names| names.contains(part)).filter(|_| *part != "offset");
    let mut found = parts.iter().enumerate().filter_map(|(at, part)| Some((at, which(part)?)));
    let (Some((at, which)), None) = (found.next(), found.next()) else { return None };
    let other = parts.len() < 2 || parts.iter().any(|part| OTHERS.contains(part));
    (!other).then(|| (parts[..at].join("_"), which))
}

/// Links of lists, where the three that every table has are there, by their own names or by names of one family.
pub(super) fn links(plain: &Lists, families: &BTreeMap<String, Lists>) -> Result<Vec<Link>, Wrong> {
    let whole = |lists: &&Lists| [0, 1, 3].iter().all(|&which| lists[which].is_some());
    let mut of_families = families.values().filter(whole);
    let lists = match (Some(plain).filter(whole), of_families.next(), of_families.next()) {
        (Some(plain), _, _) => plain,
        (None, Some(only), None) => only,
        _ => return Ok(Vec::new()),
    };
    let [Some((line, alpha)), Some((_, a)), theta, Some((_, d))] = lists else { return Ok(Vec::new()) };
    let theta = theta.as_ref().map(|(_, list)| list);
    if [a.len(), d.len(), theta.map_or(a.len(), Vec::len)].iter().any(|n| *n != alpha.len()) {
        return Err((*line, "the lists of alpha, a, d and theta have different lengths".to_owned()));
    }
    let link = |i: usize| Link {
        values: [Some(alpha[i]), Some(a[i]), theta.map(|list| list[i]), Some(d[i])],
        ..Link::at(*line, 0)
    };
    Ok((0..alpha.len()).map(link).collect())
}

/// What lists of two parameters lack of the three that every table has.
pub(super) fn incomplete(lists: &Lists, families: &BTreeMap<String, Lists>) -> Option<Wrong> {
    let whole = families.iter().filter(|(_, lists)| [0, 1, 3].iter().all(|&which| lists[which].is_some()));
    if let [(one, _), (other, lists), ..] = whole.collect::<Vec<_>>()[..] {
        let line = lists[0].as_ref().map_or(1, |(line, _)| *line);
        return Some((
            line,
            format!(
                "lists of several robots stand here, `{one}` and `{other}`, and which is meant is not said: leave one of them in the file"
            ),
        ));
    }
    const NAMES: [&str; 4] = ["alpha", "a", "theta", "d"];
    let (here, lack): (Vec<usize>, Vec<usize>) = [0, 1, 3].into_iter().partition(|which| lists[*which].is_some());
    let ([one, other], [lack]) = (&here[..], &lack[..]) else { return None };
    let (line, list) = lists[*one].as_ref()?;
    let length = lists[*other].as_ref().map(|(_, list)| list.len());
    // A twist may be called `a` where the length has another letter.
    let turns = *one == 1 && list.iter().any(|v| v.radians);
    let twist = if turns { "; what is called `a` holds angles, which would be alpha" } else { "" };
    let message = format!(
        "the lists `{}` and `{}` stand here without one called `{}`{twist}: lists called alpha, a, d and theta are read",
        NAMES[*one], NAMES[*other], NAMES[*lack]
    );
    (list.len() > 1 && length == Some(list.len())).then_some((*line, message))
}

/// Line and value by the number, of each parameter.
pub(super) type Numbered = [BTreeMap<usize, (u64, Value)>; 4];

/// Which parameter a name is, and its number.
pub(super) fn numbered(word: &str) -> Option<(usize, usize)> {
    let name = word.trim_end_matches(|c: char| c.is_ascii_digit());
    let number = word[name.len()..].parse().ok()?;
    let name = name.trim_end_matches('_').to_lowercase();
    let which = KEYS.iter().position(|names| names.contains(&name.as_str()));
    Some((which.or((name == "q").then_some(2))?, number))
}

/// The links, where alpha, a and d of all joints are there: a link's numbers from 0 beside joints from 1 are those of
/// the link before the joint.
pub(super) fn numbered_links(numbered: &Numbered) -> (Vec<Link>, Option<Convention>) {
    let [alpha, a, theta, d] = numbered;
    let from = |of: &BTreeMap<usize, (u64, Value)>| of.keys().next().copied();
    let (Some(first), Some(1)) = (from(alpha), from(d)) else { return (Vec::new(), None) };
    let count = d.len();
    let whole = |of: &BTreeMap<usize, _>, from: usize| (from..from + count).all(|i| of.contains_key(&i));
    if first > 1 || !whole(alpha, first) || !whole(a, first) || !whole(d, 1) || count < 2 {
        return (Vec::new(), None);
    }
    // Where one is its joint's variable, those that are not named are, too; a number holds still.
    let turns = theta.values().any(|(_, v)| v.variable);
    let link = |joint: usize| {
        let of = |of: &BTreeMap<usize, (u64, Value)>, i: usize| of.get(&i).map(|(_, v)| *v);
        let before = first + joint - 1;
        let unnamed = Value { number: 0.0, radians: false, variable: turns };
        let values = [of(alpha, before), of(a, before), Some(of(theta, joint).unwrap_or(unnamed)), of(d, joint)];
        Link { values, ..Link::at(d[&joint].0, 0) }
    };
    ((1..=count).map(link).collect(), (first == 0).then_some(Convention::Modified))
}

/// Bytes of a value: to the comma, the end of the line or the bracket that ends it.
pub(super) fn extent(value: &str) -> usize {
    up_to(value, &[',', ';', '\n'])
}

/// Bytes to one of these outside of all brackets, or to the bracket that ends what is read.
pub(super) fn up_to(text: &str, ends: &[char]) -> usize {
    let mut depth = 0usize;
    for (at, c) in text.char_indices() {
        match c {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' if depth == 0 => return at,
            ')' | ']' | '}' => depth -= 1,
            _ if depth == 0 && ends.contains(&c) => return at,
            _ => {}
        }
    }
    text.len()
}
