//! A link while it is read, and what its parameters are called.

use std::collections::BTreeMap;

use crate::robot::catalogue::Convention;
use crate::tables::expression::Value;

/// What names of a text stand for.
pub type Known = BTreeMap<String, Value>;

/// A line and what is wrong there.
pub type Wrong = (u64, String);

/// Calls that make a link.
pub(super) const CALLS: [&str; 8] =
    ["RevoluteDH", "RevoluteMDH", "PrismaticDH", "PrismaticMDH", "DHLink", "Link", "Revolute", "Prismatic"];

/// Where a text calls something of that name, and what stands behind the bracket.
pub(super) fn calls<'a>(text: &'a str, call: &'a str) -> impl Iterator<Item = (usize, &'a str)> {
    text.match_indices(call).filter_map(move |(at, _)| {
        let alone = !text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
        let behind = text[at + call.len()..].trim_start_matches(' ').strip_prefix('(');
        behind.filter(|_| alone).map(|inside| (at, inside))
    })
}

/// Whether a call in it makes a link.
pub(super) fn makes(text: &str) -> bool {
    CALLS.iter().any(|call| calls(text, call).next().is_some())
}

/// Names of the parameters, in the order of a row.
pub(super) const KEYS: [&[&str]; 4] = [
    &["alpha", "α", "twist", "link_twist"],
    &["a", "r", "link_length"],
    &["theta", "θ", "offset", "theta_offset", "offset_theta", "theta0"],
    &["d", "link_offset"],
];

#[derive(Debug, Clone, Default)]
pub(super) struct Link {
    pub line: u64,
    pub depth: usize,
    /// Whether a call makes it, whose parameters may be left out.
    pub call: bool,
    pub values: [Option<Value>; 4],
    /// What a call adds to the joint's own variable, theta or d.
    pub offset: Option<Value>,
    /// The least and the largest reading.
    pub limits: Option<[Value; 2]>,
    pub slides: bool,
    /// Whether a word beside its parameters said so or not, `type: prismatic`.
    pub kind: bool,
    /// Whether such a word says that it holds still, `type: fixed`.
    pub fixed: bool,
    /// What stands for d where that is a variable.
    pub variable_d: Option<String>,
    /// What it is called.
    pub name: Option<String>,
    /// The list around it: its place in the text, and its name.
    pub of: Option<(usize, String)>,
    /// Whether the joint counts the other way.
    pub flipped: bool,
    /// The convention that its call says.
    pub convention: Option<Convention>,
}

impl Link {
    /// One that has nothing yet.
    pub fn at(line: u64, depth: usize) -> Link {
        Link { line, depth, ..Link::default() }
    }

    /// What a word beside its parameters says.
    pub fn kind(&mut self, slides: bool) {
        (self.kind, self.slides) = (true, slides);
    }

    /// What is wrong with a variable for d of a joint that is not said to slide.
    pub fn unsaid(&self) -> Option<Wrong> {
        let text = self.variable_d.as_ref().filter(|_| !self.slides)?;
        let message = format!(
            "d is `{text}`: a joint that slides, which `type: prismatic` beside its parameters says, or a name that stands for no number"
        );
        Some((self.line, message))
    }

    /// Alpha, a, theta and d, zero where nothing says otherwise. What a call makes moves, whatever its theta says.
    pub fn row(&self) -> Result<[Value; 4], Wrong> {
        let none = Value { number: 0.0, radians: false, variable: false };
        let value = |v: Option<Value>| v.map_or(none, |v| Value { variable: v.variable && !self.call, ..v });
        let mut row = self.values.map(value);
        if self.slides && self.call && row[3].number != 0.0 {
            let message = format!(
                "the joint slides, so that d is its reading, but d is {} beside it, which the toolbox leaves out: write it as `offset`, or leave it out",
                row[3].number
            );
            return Err((self.line, message));
        }
        let own = &mut row[if self.slides { 3 } else { 2 }];
        let offset = value(self.offset);
        *own = Value { number: own.number + offset.number, radians: own.radians || offset.radians, ..*own };
        Ok(row)
    }
}

/// The convention that the calls of links say, those that say nothing being classic beside others; where they
/// contradict each other, how.
pub(super) fn convention(links: &[Link]) -> Result<Option<Convention>, String> {
    let calls = || links.iter().filter(|link| link.call);
    let is_modified = |link: &&Link| link.convention == Some(Convention::Modified);
    match (calls().find(is_modified), calls().find(|link| !is_modified(link))) {
        (Some(modified), Some(other)) => Err(format!(
            "the link of line {} is made as a modified one and that of line {} as a classic one",
            modified.line, other.line
        )),
        (Some(_), None) => Ok(Some(Convention::Modified)),
        (None, _) => Ok(calls().find_map(|link| link.convention)),
    }
}
