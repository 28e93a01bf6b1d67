//! One way to read a table, and its robot: whether alpha and a of a row stand before the joint (modified, Craig) or
//! behind it (classic, Denavit and Hartenberg), and what tells it.

use std::fmt::Write as _;
use std::ops::Range;

use super::beside::{Beside, Limits};
use super::names::{NAMES, OWN, level, plain};
use super::table::Table;
use super::units::{Open, units};
use crate::files::Result;
use crate::formats::robots::dh_words::Words;
use crate::geometry::Transform;
use crate::robot::Robot;
use crate::robot::catalogue::{Convention, Row, from_rows};
use crate::tables::names::Unit;

/// What a row at an end of the table may have but for its joint: alpha and a that are zero, or alpha that is not.
const PLAIN: &str = "neither twist nor length";
const TWIST: &str = "a twist";

/// How far an angle may be from a multiple of 90 deg that was rounded, deg.
const DRAWN_DEG: f64 = 0.1;

/// The same in this program's own tables, which may hold zeros that were identified, deg: more than a joint's zero is
/// set off by.
const BUILT_DEG: f64 = 5.0;

/// A way to read a table.
#[derive(Debug, Clone, Default)]
pub struct Reading {
    /// In deg and mm.
    pub(super) rows: Vec<Row>,
    /// Rows before the first joint, and behind the last.
    pub(super) base: Vec<Row>,
    pub(super) flange: Vec<Row>,
    /// Other columns, of a table with names.
    pub(super) beta_deg: Vec<Option<f64>>,
    /// Of joints that slide in mm.
    pub(super) limits_deg: Vec<Option<Limits>>,
    pub(super) slides: Vec<bool>,
    /// Of joints that count the other way, where the table says it.
    pub(super) flipped: Vec<bool>,
    /// What a toolbox puts before the first joint's frame, its base, and behind the last one's, its tool, mm.
    pub(super) ends: [Option<Transform>; 2],
    /// What is said of these and of what was left out, each a sentence.
    pub ends_said: Vec<String>,
    /// What the table's unit of lengths is in mm.
    pub(super) length_mm: f64,
    /// What was taken, for a sentence.
    pub said: String,
    /// Which zero offsets were taken that may be angles of a posture.
    pub offsets: Option<String>,
    /// The columns' names in their order, as `--columns` has them.
    pub columns: String,
    /// The convention that names or calls say, and which.
    pub(super) stated: Option<(Convention, &'static str)>,
    pub(super) words: Words,
    /// How calls contradict each other about the convention.
    pub(super) contradiction: Option<String>,
    /// Whether calls of a toolbox make its links.
    pub(super) calls: bool,
    /// Whether the names are this program's own, whose tables are modified ones.
    pub(super) own: bool,
    /// A unit that nothing says.
    pub open: Option<Open>,
}

impl Reading {
    pub fn robot(&self, name: &str, convention: Convention) -> Robot {
        let mut robot = from_rows(name, convention, &self.rows);
        for (joint, (beta, limits)) in robot.joints.iter_mut().zip(self.beta_deg.iter().zip(&self.limits_deg)) {
            joint.beta_rad = beta.map_or(0.0, f64::to_radians);
            joint.limits_rad = limits.map(|(low, high)| (low.to_radians(), high.to_radians()));
        }
        let sliding = robot.joints.iter_mut().zip(self.limits_deg.iter().zip(&self.slides));
        for (joint, (limits, _)) in sliding.filter(|(_, (_, slides))| **slides) {
            (joint.slides, joint.limits_rad) = (true, *limits);
        }
        robot.joints.iter_mut().zip(&self.flipped).filter(|(_, f)| **f).for_each(|(joint, _)| joint.sign = -1.0);
        let held = |rows: &[Row]| from_rows(name, convention, rows).root_from_flange(&vec![0.0; rows.len()]);
        if !self.flange.is_empty() {
            robot.ends.last_frame_from_flange *= held(&self.flange);
        }
        if !self.base.is_empty() {
            robot.ends.root_from_frame0 = held(&self.base) * robot.ends.root_from_frame0;
        }
        let [base, tool] = self.ends.map(Option::unwrap_or_default);
        robot.ends.root_from_frame0 = base * robot.ends.root_from_frame0;
        robot.ends.last_frame_from_flange *= tool;
        robot.tool_mm = robot.ends.last_frame_from_flange.translation.vector;
        robot
    }

    /// Whether it has a column that stands beside alpha and a of a modified table alone.
    pub fn is_modified(&self) -> bool {
        self.beta_deg.iter().any(Option::is_some)
    }

    /// The convention and why, or why it is open: what names, calls and words say, else what the table's ends show.
    pub fn convention(&self) -> (Option<Convention>, String) {
        if self.is_modified() {
            return (Some(Convention::Modified), "`beta_deg` stands beside alpha and a of a modified table".to_owned());
        }
        let (shown, ends) = self.shown();
        match (self.stated, self.words.convention, shown) {
            (Some((stated, why)), ..) => (Some(stated), why.to_owned()),
            _ if let Some(contradiction) = &self.contradiction => (None, contradiction.clone()),
            _ if self.words.both => (None, "words of the file say both, modified and classic".to_owned()),
            (None, Some(said), Some(shown)) if said != shown => {
                (None, format!("words of the file say {}, but {ends} as of the other", said.name()))
            }
            (None, Some(said), _) => (Some(said), "words of the file say so".to_owned()),
            _ if self.calls => {
                (Some(Convention::Classic), "links of a toolbox are where nothing else is said".to_owned())
            }
            // A classic table may have these names, too, where its ends are those of one.
            _ if self.own && shown != Some(Convention::Classic) => {
                (Some(Convention::Modified), "the names are of this program's tables".to_owned())
            }
            (None, None, Some(shown)) => {
                let other = if shown == Convention::Classic { Convention::Modified } else { Convention::Classic };
                (Some(shown), format!("{ends}; `--dh {}` reads it the other way", other.name()))
            }
            _ => (None, ends),
        }
    }

    /// What the table's ends show. An arm stands on its base and ends in a flange: the twist between its last axes is
    /// in the last row of a modified table, whose first row is none between axes, and that between its first axes in
    /// the first row of a classic one, whose last row is none. A length tells nothing: a modified table may begin
    /// beside the first axis, and a classic one end at the tip of a gripper.
    fn shown(&self) -> (Option<Convention>, String) {
        let end = |row: &Row| match (row[0] != 0.0, row[1] != 0.0) {
            (true, _) => TWIST,
            (false, true) => "a length without a twist",
            _ => PLAIN,
        };
        let (Some(first), Some(last)) = (self.rows.first().map(end), self.rows.last().map(end)) else {
            return (None, "the table is empty".to_owned());
        };
        let why = format!("the first row has {first} and the last {last}");
        let shown = match (first, last) {
            _ if self.rows.len() < 3 => None,
            (TWIST, PLAIN) => Some(Convention::Classic),
            (PLAIN, TWIST) => Some(Convention::Modified),
            _ => None,
        };
        (shown, why)
    }
}

/// The table with these columns for alpha, a, theta and d.
pub(super) fn reading(table: &Table, columns: [usize; 4]) -> Result<Reading> {
    let joints = table.turning(columns)?;
    let (mut rows, radians) = table.numbers(columns)?;
    let names = table.names;
    let of_pi = |at: usize| (radians && matches!(at, 0 | 2)).then_some(Unit::Rad);
    let stated = |at: usize| names.and_then(|n| plain(&n[columns[at]]).1).or_else(|| of_pi(at));
    let ([alpha, theta], angles_open) = units(table, &rows, [0, 2], [stated(0), stated(2)])?;
    let ([a, d], lengths_open) = units(table, &rows, [1, 3], [stated(1), stated(3)])?;
    for row in &mut rows {
        *row = [alpha.converted(row[0]), a.converted(row[1]), theta.converted(row[2]), d.converted(row[3])];
    }
    let Range { start, end } = joints;
    let flange = rows.split_off(end);
    let base: Vec<Row> = rows.drain(..start).collect();
    let Beside { beta_deg, limits_deg, slides, left_out } = table.beside(columns)?;
    let (beta_deg, slides) = (beta_deg[start..end].to_vec(), slides[start..end].to_vec());
    let mut limits_deg = limits_deg[start..end].to_vec();
    let flipped = table.flipped(columns)?[start..end].to_vec();
    let numbers = |of: &[bool]| -> String {
        let which: Vec<String> = (1..).zip(of).filter(|(_, of)| **of).map(|(j, _)| j.to_string()).collect();
        which.join(", ")
    };
    for (low, high) in limits_deg.iter_mut().zip(&slides).filter(|(_, slides)| **slides).filter_map(|(l, _)| l.as_mut())
    {
        (*low, *high) = (d.converted(*low), d.converted(*high));
    }
    let stated = names.and_then(|names| of_link_before(names, columns));
    let own = names.is_some_and(|n| columns.iter().zip(OWN).all(|(&c, own)| n[c].eq_ignore_ascii_case(own)));
    let offsets = odd_offsets(table, (columns[2], start), &rows, &slides, if own { BUILT_DEG } else { DRAWN_DEG });
    let mut order: Vec<(usize, &str)> = columns.iter().copied().zip(NAMES).collect();
    order.sort_unstable();
    let columns = order.iter().map(|(_, name)| *name).collect::<Vec<_>>().join(",");
    let word = |one: Unit, other: Unit| match one == other {
        true => one.word().to_owned(),
        false => format!("{} and {}", one.word(), other.word()),
    };
    let (angle, length) = (word(alpha, theta), word(a, d));
    let mut said = format!("{} joints; columns {columns}, angles in {angle}, lengths in {length}", rows.len());
    if slides.contains(&true) {
        let _ = write!(said, ", sliding: {}", numbers(&slides));
    }
    if flipped.contains(&true) {
        let _ = write!(said, ", counted the other way: {}", numbers(&flipped));
    }
    if names.is_none() {
        said.push_str(", no header");
    }
    said += &if flange.is_empty() { String::new() } else { format!(", flange behind row {end}") };
    said += &if base.is_empty() { String::new() } else { format!(", base before row {}", start + 1) };
    if !left_out.is_empty() {
        let _ = write!(said, ", left out: {}", left_out.join(", "));
    }
    let (words, open) = (table.words, angles_open.or(lengths_open));
    let found =
        Reading { rows, base, flange, beta_deg, limits_deg, slides, flipped, said, columns, ..Reading::default() };
    Ok(Reading { stated, words, own, open, offsets, length_mm: d.converted(1.0), ..found })
}

/// The numbers in the place of theta that a drawing seldom has, where nothing says that they are offsets.
fn odd_offsets(
    table: &Table,
    (theta, first): (usize, usize),
    rows: &[Row],
    slides: &[bool],
    from_deg: f64,
) -> Option<String> {
    let is_offset = table.names.is_some_and(|names| names[theta].to_lowercase().contains("offset"));
    let is_odd = |(at, row): &(usize, &Row)| {
        let from_drawn_deg = row[2] - 90.0 * (row[2] / 90.0).round();
        let added = table.theta(&table.rows[first + at].1[theta]).is_some_and(|v| v.variable);
        from_drawn_deg.abs() > from_deg && !(added || slides[*at])
    };
    let odd = rows.iter().enumerate().filter(is_odd);
    let odd: Vec<String> = odd.map(|(at, row)| format!("{} ({:.2} deg)", at + 1, row[2])).collect();
    (!is_offset && !odd.is_empty()).then(|| {
        format!(
            "theta of the table was taken as the joints' zero offsets, which are no multiples of 90 deg at joints {}: where these are angles of a \
             posture, put the drawing's angle, mostly 0, in their place",
            odd.join(", ")
        )
    })
}

/// What `a(i-1)`, `alpha_{i-1}` say.
fn of_link_before(names: &[String], columns: [usize; 4]) -> Option<(Convention, &'static str)> {
    let before = |name: &String| {
        let bare: String =
            level(name).chars().filter(|c| c.is_alphanumeric() || matches!(c, '-' | '\u{2212}')).collect();
        ["i-1", "i\u{2212}1", "j-1", "n-1"].iter().any(|index| bare.contains(index))
    };
    (before(&names[columns[0]]) || before(&names[columns[1]]))
        .then_some((Convention::Modified, "alpha and a are named as those of the link before"))
}
