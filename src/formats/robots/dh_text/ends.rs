//! The base and the tool that a program tells the toolbox: `DHRobot(links, tool=transl(0, 0, 0.1), base=SE3.Rx(pi/2))`,
//! `robot.tool = ...`.
//!
//! In: code, and the names that it sets to numbers. Out: both as transforms where they are products of shifts and turns
//! by numbers, and a sentence about each. What goes wrong: one that cannot be followed is said with its line, for the
//! robot's frames are then not the program's.

use nalgebra::{UnitQuaternion, Vector3};

use super::link::Known;
use super::lists::{extent, up_to};
use super::robots;
use crate::geometry::Transform;
use crate::tables::expression::evaluate;

/// A transform whose lengths are in the unit of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct End(Transform);

impl End {
    /// The transform in mm.
    pub fn in_mm(self, unit_mm: f64) -> Transform {
        let End(mut transform) = self;
        transform.translation.vector *= unit_mm;
        transform
    }
}

/// Base and tool, and what is said of them.
pub(super) fn of(code: &str, known: &Known) -> ([Option<End>; 2], Vec<String>) {
    let mut said = Vec::new();
    let ends = [("base", "base"), ("tool", "flange")].map(|(name, table)| {
        let (line, value, once) = told(code, name)?;
        let found = if once { product(code, known, value, 0) } else { None };
        match found {
            Some(transform) if transform == Transform::identity() => None,
            Some(transform) => {
                said.push(format!("the {name} of line {line} is part of the robot file's [{table}]"));
                Some(End(transform))
            }
            None => {
                let value = value.split_whitespace().collect::<Vec<_>>().join(" ");
                said.push(format!(
                    "the {name} of line {line}, `{value}`, is LEFT OUT: it is no product of shifts and turns by numbers, or another line says it \
                     otherwise; write it into the robot file's [{table}]"
                ));
                None
            }
        }
    });
    (ends, said)
}

/// The last thing that is told to be the base or the tool, in a call that makes a robot, or of a robot; and whether
/// nothing else is. `None` and an argument of the same name that nothing in the text sets say nothing.
fn told<'a>(code: &'a str, name: &str) -> Option<(u64, &'a str, bool)> {
    let found = code.match_indices(name).filter_map(|(at, _)| {
        let before = &code[..at];
        let statement = before.rsplit(['\n', ';']).next().unwrap_or("");
        let quote = before.chars().next_back().filter(|c| matches!(c, '\'' | '"'));
        let behind = code[at + name.len()..].trim_start_matches(['\'', '"', ' ']);
        let sign = if quote.is_some() { ',' } else { '=' };
        let value = behind.strip_prefix(sign).filter(|value| !value.starts_with('='))?;
        let of_robot = before.ends_with('.')
            && statement.trim().trim_end_matches('.').chars().all(|c| c.is_alphanumeric() || c == '_');
        let inside = !before.ends_with(|c: char| c.is_alphanumeric() || matches!(c, '_' | '.')) && in_call(before);
        let value = &value[..if of_robot { up_to(value, &['\n', ';']) } else { up_to(value, &[',']) }];
        let says_nothing = value.trim() == "None" || value.trim() == name && assigned(code, name).is_none();
        ((of_robot || inside) && !says_nothing).then(|| (1 + before.matches('\n').count() as u64, value.trim()))
    });
    let all: Vec<(u64, &str)> = found.collect();
    let &(line, value) = all.last()?;
    Some((line, value, all.iter().all(|(_, other)| *other == value)))
}

/// Whether the text so far is inside of a call that makes a robot.
fn in_call(before: &str) -> bool {
    let last = |call: &&str| before.rfind(&format!("{call}(")).map(|at| (at, at + call.len() + 1));
    let opened = robots::CALLS.iter().filter_map(last).max();
    opened.is_some_and(|(at, start)| {
        let statement = before[..at].rsplit('\n').next().unwrap_or("");
        !["class ", "def "].iter().any(|word| statement.contains(word))
            && up_to(&before[start..], &[]) == before.len() - start
    })
}

/// What a name is set to at the beginning of a line, last.
fn assigned<'a>(code: &'a str, name: &str) -> Option<&'a str> {
    let value = |line: &'a str| {
        line.trim_start().strip_prefix(name)?.trim_start().strip_prefix('=').filter(|v| !v.starts_with('='))
    };
    // An argument on a line of its own is none.
    code.lines()
        .filter_map(value)
        .rfind(|value| !value.trim_end().ends_with(','))
        .map(|value| value.trim().trim_end_matches(';'))
}

/// A product of shifts and turns.
fn product(code: &str, known: &Known, text: &str, depth: usize) -> Option<Transform> {
    let mut all = Transform::identity();
    let mut rest = text.trim();
    while !rest.is_empty() {
        let end = up_to(rest, &['*', '@']);
        all *= factor(code, known, rest[..end].trim(), depth)?;
        rest = rest.get(end + 1..).unwrap_or("").trim();
    }
    (!text.trim().is_empty()).then_some(all)
}

/// One of them: a call with numbers, or a name that is set to such a product.
fn factor(code: &str, known: &Known, text: &str, depth: usize) -> Option<Transform> {
    let Some((head, inside)) = text.split_once('(') else {
        let is_name = !text.is_empty() && text.chars().all(|c| c.is_alphanumeric() || c == '_');
        return (is_name && depth < 4).then(|| product(code, known, assigned(code, text)?, depth + 1))?;
    };
    let inside = inside.strip_suffix(')')?;
    let listed = inside.trim().trim_start_matches(['[', '(']).trim_end_matches([']', ')']);
    let listed = if inside.trim().starts_with(['[', '(']) { listed } else { inside };
    let (mut numbers, mut degrees, mut rest) = (Vec::new(), false, listed);
    while !rest.trim().is_empty() {
        let word = rest[..extent(rest)].trim();
        match word.trim_start_matches("unit=").trim_matches(['"', '\'']) {
            "deg" => degrees = true,
            "rad" => {}
            _ => numbers.push(evaluate(word, &|name| known.get(name).copied()).filter(|v| !v.variable)?.number),
        }
        rest = rest[extent(rest)..].strip_prefix(',').unwrap_or("");
    }
    let shift = |x: f64, y: f64, z: f64| Some(Transform::translation(x, y, z));
    let turn = |axis: Vector3<f64>, angle: f64| {
        let angle = if degrees { angle.to_radians() } else { angle };
        Some(Transform::from_parts(Vector3::zeros().into(), UnitQuaternion::from_scaled_axis(axis * angle)))
    };
    let head = head.trim();
    match (head.rsplit('.').next().unwrap_or(head), &numbers[..]) {
        ("SE3" | "eye", []) => Some(Transform::identity()),
        ("SE3" | "transl" | "Trans", &[x, y, z]) => shift(x, y, z),
        ("Tx", &[x]) => shift(x, 0.0, 0.0),
        ("Ty", &[y]) => shift(0.0, y, 0.0),
        ("Tz", &[z]) => shift(0.0, 0.0, z),
        ("Rx" | "trotx", &[angle]) => turn(Vector3::x(), angle),
        ("Ry" | "troty", &[angle]) => turn(Vector3::y(), angle),
        ("Rz" | "trotz", &[angle]) => turn(Vector3::z(), angle),
        _ => None,
    }
}
