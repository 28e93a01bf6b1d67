//! A link while it is read, and what its parameters are called.

use std::collections::BTreeMap;

use crate::tables::expression::Value;

/// What names of a text stand for.
pub type Known = BTreeMap<String, Value>;

/// A line and what is wrong there.
pub type Wrong = (u64, String);

/// Names of the parameters, in the order of a row.
pub(super) const KEYS: [&[&str]; 4] = [
    &["alpha", "α", "twist", "link_twist"],
    &["a", "r", "link_length"],
    &["theta", "θ", "offset", "theta_offset", "offset_theta", "theta0"],
    &["d", "link_offset"],
];

#[derive(Debug, Clone)]
pub(super) struct Link {
    pub line: u64,
    pub depth: usize,
    /// Whether a call makes it, whose parameters may be left out.
    pub call: bool,
    pub values: [Option<Value>; 4],
    /// The least and the largest angle.
    pub limits: Option<[Value; 2]>,
}

impl Link {
    /// One that has nothing yet.
    pub fn at(line: u64, depth: usize) -> Link {
        Link { line, depth, call: false, values: [None; 4], limits: None }
    }
}
