//! Whether alpha and a of a row stand before the joint (modified, Craig) or behind it (classic, Denavit and Hartenberg), and what tells it.

use super::reading::Reading;
use crate::robot::catalogue::{Convention, Row};

/// What a row at an end of the table is but for its joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    /// Alpha and a are zero.
    Plain,
    /// Alpha is not.
    Twist,
    Length,
}

impl Reading {
    /// The convention and why, or why it is open: what names, calls and words say, else what the table's ends show.
    pub fn convention(&self) -> (Option<Convention>, String) {
        if self.is_modified() {
            return (Some(Convention::Modified), "`beta_deg` stands beside alpha and a of a modified table".to_owned());
        }
        let (shown, ends) = self.shown();
        match (self.stated, self.words, shown) {
            (Some((stated, why)), ..) => (Some(stated), why.to_owned()),
            (None, Some(said), Some(shown)) if said != shown => {
                (None, format!("words of the file say {}, but {ends} as of the other", said.name()))
            }
            (None, Some(said), _) => (Some(said), "words of the file say so".to_owned()),
            _ if self.calls => {
                (Some(Convention::Classic), "links of a toolbox are where nothing else is said".to_owned())
            }
            (None, None, Some(shown)) => {
                let other = if shown == Convention::Classic { Convention::Modified } else { Convention::Classic };
                (Some(shown), format!("{ends}; `--dh {}` reads it the other way", other.name()))
            }
            _ if self.own => (Some(Convention::Modified), "the names are of this program's tables".to_owned()),
            _ => (None, ends),
        }
    }

    /// What the table's ends show. An arm stands on its base and ends in a flange: the twist between its last axes is in the last row of a modified
    /// table, whose first row is none between axes, and that between its first axes in the first row of a classic one, whose last row is none. A length
    /// tells nothing: a modified table may begin beside the first axis, and a classic one end at the tip of a gripper.
    fn shown(&self) -> (Option<Convention>, String) {
        let end = |row: &Row| match (row[0] != 0.0, row[1] != 0.0) {
            (true, _) => End::Twist,
            (false, true) => End::Length,
            _ => End::Plain,
        };
        let (Some(first), Some(last)) = (self.rows.first().map(end), self.rows.last().map(end)) else {
            return (None, "the table is empty".to_owned());
        };
        let word = |end: End| match end {
            End::Plain => "neither twist nor length",
            End::Twist => "a twist",
            End::Length => "a length without a twist",
        };
        let why = format!("the first row has {} and the last {}", word(first), word(last));
        let shown = match (first, last) {
            _ if self.rows.len() < 3 => None,
            (End::Twist, End::Plain) => Some(Convention::Classic),
            (End::Plain, End::Twist) => Some(Convention::Modified),
            _ => None,
        };
        (shown, why)
    }
}
