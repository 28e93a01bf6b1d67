//! What is said where a table does not tell what its columns are: what was found, what was needed, and the flags that
//! settle it.

use super::judge::{Forced, Way};
use super::part::{Kind, Part};
use super::pick::{self, Picked, columns_flag, listed};
use crate::files::Error;
use crate::tables::Form;
use crate::tables::names::{Unit, What};

/// That the files lack joints or what was measured.
pub(in crate::measurements) fn lacking(parts: &[Part], picked: &Picked, count: usize) -> Error {
    let names = |p: &Part| {
        let shown = p.names.as_ref().map(|n| n.iter().take(40).cloned().collect::<Vec<_>>().join(", "));
        match shown {
            Some(names) => format!("{} has {names}", p.file_name()),
            // Of a language that is not known nothing says whether these are joints or places of the tool.
            None if matches!(p.grid.form, Form::Program { degrees: false, .. }) => {
                format!("{} has lists of {} numbers in a program's lines", p.file_name(), p.width())
            }
            None if p.is_program() => format!("{} has the joint targets of a program", p.file_name()),
            None => {
                format!("{} has {} columns without names, {} of them numbers", p.file_name(), p.width(), p.free().len())
            }
        }
    };
    let found: Vec<String> = parts.iter().map(names).collect();
    let touches = touches(parts, count);
    let what = match (picked.joints.is_empty() && touches.is_empty(), picked.is_measured()) {
        (true, true) => format!("no columns of {count} joints"),
        (false, false) => "no columns of a measured point or a distance".to_owned(),
        _ => format!("no columns of {count} joints and of a measured point or a distance"),
    };
    let sheets = parts.iter().find(|p| matches!(&p.grid.form, Form::Sheet(_, others) if *others > 0));
    let sheets = sheets.map_or(String::new(), |p| format!(", `{}#SHEET` another sheet", p.file_name()));
    let hint = format!(
        "{}another `--measurements FILE` joins the file that has them row by row{sheets}; \
         `--columns j1,j2,...,-,x,y,z` names the columns{} in their order (`distance_mm` of distances), `-` skips one{touches}",
        lying(parts, count),
        side_by_side(parts)
    );
    parts[0].refuse(format!("{what}: {}", found.join("; ")), Some(&hint))
}

/// Which columns `--columns` names where there are several files.
fn side_by_side(parts: &[Part]) -> String {
    let files: Vec<String> = parts.iter().map(|p| format!("{} of {}", p.width_of_file(), p.file_name())).collect();
    if parts.len() > 1 { format!(" of all files side by side ({})", files.join(", ")) } else { String::new() }
}

/// What to do with a table whose rows are as many as the columns that a pose has.
fn lying(parts: &[Part], count: usize) -> &'static str {
    let lies = |p: &Part| {
        let rows = p.rows.len();
        !p.is_named() && p.width() > 2 * rows && (rows == 3 || rows == count || rows >= count + 3)
    };
    if parts.iter().any(lies) { "if each column is a pose, exchange rows and columns; " } else { "" }
}

/// What to do with files of nothing but joints: what a robot touches is measured without an instrument.
fn touches(parts: &[Part], count: usize) -> &'static str {
    let alone = |p: &Part| match p.is_named() {
        true => pick::names_joints(p, count) && p.kinds.iter().filter(|kind| **kind == Kind::Numbers).count() == count,
        false => p.free().len() == count,
    };
    if parts.iter().all(alone) {
        "; if the target was at one point in all rows of a file, a touch, one table of all with the columns \
         `pose,group,role,j1_deg,...,distance_mm` says so: `distance_mm` 0, a `group` for each point, and \
         `--known-distances FILE` for the distances between the points"
    } else {
        ""
    }
}

/// The columns have names, and nothing comes near to the nominal robot by them.
fn contradicted(parts: &[Part], first: &Picked, forced: Forced) -> Option<Error> {
    let against =
        |forced: Option<Unit>, named: Option<Unit>| forced.zip(named).filter(|(forced, named)| forced != named);
    let joints = against(forced.joints, first.joint_unit).map(|units| (first.joints.clone(), units));
    let lengths = || against(forced.lengths, first.length_unit).map(|units| (first.first_point(), units));
    let (columns, (forced, named)) = joints.or_else(lengths)?;
    let message = format!(
        "`--units {}` contradicts the names {}, which say {}, and with it nothing comes near to the nominal robot",
        forced.flag(),
        listed(parts, &columns),
        named.word()
    );
    Some(parts[0].refuse(message, Some("leave `--units` out: the names say it")))
}

/// That nothing comes near to the nominal robot in the units that were typed, and something does in others.
pub(in crate::measurements) fn other_units(parts: &[Part], forced: Forced, way: &Way) -> Error {
    let typed: Vec<&str> = forced.joints.iter().chain(&forced.lengths).map(|unit| unit.flag()).collect();
    let found = format!("{},{}", way.joints.flag(), way.lengths.flag());
    let message =
        format!("with `--units {}` no choice of the columns comes near to the nominal robot", typed.join(","));
    parts[0].refuse(message, Some(&format!("with `--units {found}` it does; without `--units` that is found")))
}

/// That no choice of columns comes near to the robot.
pub(in crate::measurements) fn unplaced(parts: &[Part], picked: &Picked, forced: Forced) -> Error {
    if let Some(contradicted) = contradicted(parts, picked, forced) {
        return contradicted;
    }
    let count = picked.joints.len();
    if !touches(parts, count).is_empty() {
        return lacking(parts, &Picked { joints: picked.joints.clone(), ..Picked::default() }, count);
    }
    let what = match parts.iter().any(|p| p.names_any(|w| matches!(w, What::Coordinate(_) | What::Distance))) {
        true => "the joints",
        false if parts.iter().any(|p| p.names_any(|w| matches!(w, What::Joint(_)))) => "the point",
        false => "the joints and which the point",
    };
    let lacking = if what == "the point" { "points" } else { "joint angles" };
    let elsewhere = match parts.len() {
        1 => {
            format!("where the {lacking} stand in a file of their own, a second `--measurements FILE` names it; else ")
        }
        _ => String::new(),
    };
    let hint = format!(
        "{}{elsewhere}see whether the file of `--robot` is of this robot; if it is, `--columns` names the {} columns{} in their order: j1 to j{count} for \
         the joints, x, y, z for the point, `-` for each that is neither, and `--units deg,mm` (rad, m) their units: a column that is spoilt is \
         then looked for",
        lying(parts, count),
        parts.iter().map(Part::width_of_file).sum::<usize>(),
        side_by_side(parts)
    );
    // Joints that names say are not what is in question.
    let is_open = |p: &&Part| what != "the point" || !(p.is_program() || pick::names_joints(p, count));
    let message = format!("no name says which columns are {what}, {NOT_NEAR}");
    parts.iter().find(is_open).unwrap_or(&parts[0]).refuse(message, Some(&hint))
}

/// What is said where no choice of columns does.
const NOT_NEAR: &str = "and no choice of them comes near to the nominal robot";

/// Whether it is said that no choice of columns comes near to the robot.
pub fn is_not_near(error: &Error) -> bool {
    error.to_string().contains(NOT_NEAR)
}

/// That the rows of a pose are neither targets of one body nor readings of one point.
pub(in crate::measurements) fn rows_of_pose(parts: &[Part]) -> Error {
    let part = parts.iter().find(|part| part.times > 1).unwrap_or(&parts[0]);
    let message = format!(
        "{} has {} rows a pose, one after the other, and they are neither targets in one order, whose distances are kept, nor readings of one point",
        part.file_name(),
        part.times
    );
    let hint = "look for rows that are missing, doubled or in another order; a table of all rows with the columns `pose,target,j1_deg,...,x_mm,y_mm,z_mm` \
                says which is which; look at `--robot`, too: its file must be of this robot";
    part.refuse(message, Some(hint))
}

/// That two ways would do, with the flags that take either.
pub(in crate::measurements) fn open(parts: &[Part], a: &Way, b: &Way) -> Error {
    match (a.picked.points.first(), b.picked.points.first()) {
        (Some((_, first)), Some((_, second))) if first != second && a.picked.joints == b.picked.joints => {
            pick::asked(parts, &a.picked.joints, [first.min(second), first.max(second)], false)
        }
        _ => {
            let [first, second] = [a, b].map(|way| listed(parts, &way.picked.joints));
            let message = format!("two sets of joints would do, {first} and {second}");
            let flag = |way: &Way| columns_flag(parts, &way.picked.joints, &way.picked.all_points(), &[]);
            let hint = format!("`--columns {}` takes the first, `--columns {}` the second", flag(a), flag(b));
            parts[0].refuse(message, Some(&hint))
        }
    }
}

/// That a name states a unit in which the robot is far from the points.
pub(in crate::measurements) fn wrong_unit(parts: &[Part], stated: &Way, better: &Way) -> Error {
    let (what, columns, said, found) = match stated.joints == better.joints {
        false => ("joints", better.picked.joints.clone(), stated.joints, better.joints),
        true => ("points", better.picked.first_point(), stated.lengths, better.lengths),
    };
    let factor = stated.left.unwrap_or(f64::NAN) / better.left.unwrap_or(f64::NAN).max(f64::MIN_POSITIVE);
    let (names, said_word, found_word) = (listed(parts, &columns), said.word(), found.word());
    let message = format!(
        "the names call the {what} ({names}) {said_word}, but the nominal robot is {factor:.0} times nearer to the points with {found_word}"
    );
    let (said, found) = (said.flag(), found.flag());
    let hint = format!("`--units {found}` if they are {found_word}; `--units {said}` keeps what the names say");
    parts[columns[0].part].refuse(message, Some(&hint))
}

/// That nothing tells a unit, with flags of which each says both: one that said the open one alone would take back what
/// another had said.
pub(in crate::measurements) fn no_unit(parts: &[Part], joints: Option<Unit>, lengths: Option<Unit>) -> Error {
    let open = [(joints, "joints are degrees or radians"), (lengths, "points are mm or m")];
    let what: Vec<&str> = open.iter().filter(|(unit, _)| unit.is_none()).map(|(_, what)| *what).collect();
    let message = format!(
        "no column name tells whether the {}, the numbers could be either, and the nominal robot does not tell",
        what.join(", nor whether the ")
    );
    let either = |unit: Option<Unit>, all: [Unit; 2]| unit.map_or(all.to_vec(), |unit| vec![unit]);
    let lengths = either(lengths, [Unit::Mm, Unit::M]);
    let of_joints = |joints: Unit| lengths.iter().map(move |l| format!("`--units {},{}`", joints.flag(), l.flag()));
    let flags: Vec<String> = either(joints, [Unit::Deg, Unit::Rad]).into_iter().flat_map(of_joints).collect();
    parts[0].refuse(
        message,
        Some(&format!(
            "{} says it, and a column that is spoilt is then looked for; look at `--robot`, too: its file must be of this robot",
            flags.join(" or ")
        )),
    )
}
