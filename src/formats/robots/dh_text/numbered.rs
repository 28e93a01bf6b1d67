//! Parameters with the number of their link or joint in the name: `alpha0: 0, a0: 0, d1: 0.3, q2: q2 - pi/2`.

use std::collections::BTreeMap;

use super::link::{KEYS, Link};
use crate::robot::catalogue::Convention;
use crate::tables::expression::Value;

/// Line and value by the number, of each parameter.
pub(super) type Numbered = [BTreeMap<usize, (u64, Value)>; 4];

/// Which parameter a name is, and its number.
pub(super) fn parameter(word: &str) -> Option<(usize, usize)> {
    let name = word.trim_end_matches(|c: char| c.is_ascii_digit());
    let number = word[name.len()..].parse().ok()?;
    let name = name.trim_end_matches('_').to_lowercase();
    let which = KEYS.iter().position(|names| names.contains(&name.as_str()));
    Some((which.or((name == "q").then_some(2))?, number))
}

/// The links, where alpha, a and d of all joints are there: a link's numbers from 0 beside joints from 1 are those of the link before the joint.
pub(super) fn links(numbered: &Numbered) -> (Vec<Link>, Option<Convention>) {
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
