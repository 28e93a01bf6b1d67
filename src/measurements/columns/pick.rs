//! Which columns are the joints and which the measured points, by their names.
//!
//! Joints are a set of as many columns as the robot has joints, numbered from 1 or 0 without a gap and of one word; a
//! set that is not complete (a quaternion `Q0..Q3`) is none. Points are three columns whose names differ in x, y, z
//! alone, or the last column of a 4x4 matrix. Points that are commanded, nominal or computed by their names are never
//! taken. What goes wrong: two sets that would do are asked about.

use super::differences;
use super::part::{At, Part};
use crate::files::{Error, Result};
use crate::robot::{Joint, Robot};
use crate::tables::names::{Name, Unit, What, is_index};

/// Columns, taken so far.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in crate::measurements) struct Picked {
    pub joints: Vec<At>,
    /// x, y and z of each target, with its name.
    pub points: Vec<(String, [At; 3])>,
    pub distance: Option<At>,
    /// The unit of the joints that names state.
    pub joint_unit: Option<Unit>,
    /// The unit of points or distances.
    pub length_unit: Option<Unit>,
}

impl Picked {
    pub fn columns(&self) -> impl Iterator<Item = At> {
        self.joints.iter().copied().chain(self.points.iter().flat_map(|(_, at)| *at))
    }

    /// Whether names say all of it.
    pub fn is_sure(&self, parts: &[Part]) -> bool {
        self.columns().all(|at| parts[at.part].is_named() && !parts[at.part].spare().contains(&at.column))
    }

    /// With the units that the columns state.
    pub fn with_units(mut self, parts: &[Part]) -> Picked {
        let unit = |at: &At| unit(parts, at);
        let mut measured = self.points.iter().flat_map(|(_, at)| at).chain(self.distance.iter());
        self.length_unit = measured.find_map(unit).filter(|u| !u.is_angle());
        self.joint_unit = self.joints.iter().find_map(unit).filter(|u| u.is_angle());
        self
    }

    /// The columns of the first point, where there is one.
    pub fn first_point(&self) -> Vec<At> {
        self.points.first().map_or(Vec::new(), |(_, at)| at.to_vec())
    }

    /// The columns of all points.
    pub fn all_points(&self) -> Vec<At> {
        self.points.iter().flat_map(|(_, at)| *at).collect()
    }

    pub fn is_measured(&self) -> bool {
        !self.points.is_empty() || self.distance.is_some()
    }
}

/// A joint's reading in deg, or in mm where it slides: in the unit that its column states, else in these.
pub(in crate::measurements) fn reading(
    parts: &[Part],
    at: &At,
    joint: &Joint,
    value: f64,
    angles: Unit,
    lengths: Unit,
) -> f64 {
    let stated = unit(parts, at).filter(|u| !u.is_angle());
    if joint.slides { stated.unwrap_or(lengths).converted(value) } else { angles.converted(value) }
}

/// Columns of lengths are no joints that turn.
pub(in crate::measurements) fn check_lengths(parts: &[Part], picked: &Picked, robot: &Robot) -> Result<()> {
    for (number, (at, joint)) in picked.joints.iter().zip(&robot.joints).enumerate() {
        if unit(parts, at).is_some_and(|u| !u.is_angle()) && !joint.slides {
            let message = format!("{} is a length, but joint {} of the robot turns", listed(parts, &[*at]), number + 1);
            let hint =
                "a joint that slides has `type = \"prismatic\"` in the robot's file; else name the column's unit";
            return Err(parts[at.part].refuse(message, Some(hint)));
        }
    }
    Ok(())
}

fn unit(parts: &[Part], at: &At) -> Option<Unit> {
    parts[at.part].meanings.as_ref()?[at.column].unit
}

/// A set of columns that belong together.
pub(super) struct Group<'a> {
    /// That of the first column.
    pub name: &'a Name,
    pub columns: Vec<(usize, At)>,
}

pub(super) fn groups(parts: &[Part], number: impl Fn(&Name) -> Option<usize>) -> Vec<Group<'_>> {
    let mut list: Vec<Group> = Vec::new();
    for (part, meanings) in parts.iter().enumerate().filter_map(|(i, p)| Some((i, p.meanings.as_ref()?))) {
        for (column, name) in meanings.iter().enumerate() {
            let Some(number) = number(name) else { continue };
            let at = (number, At { part, column });
            // One number in two units is of two sets.
            let other = |g: &Group| g.name.unit != name.unit && g.columns.iter().any(|(n, _)| *n == number);
            let same = |g: &&mut Group| g.name.key == name.key && g.columns[0].1.part == part && !other(g);
            match list.iter_mut().find(same) {
                Some(group) => group.columns.push(at),
                None => list.push(Group { name, columns: vec![at] }),
            }
        }
    }
    list
}

/// Takes what the names say; `count` is the robot's number of joints.
pub(in crate::measurements) fn by_names(parts: &[Part], count: usize) -> Result<Picked> {
    let mut picked = Picked { joints: joints(parts, count)?, ..Picked::default() };
    let distance = groups(parts, |n| (n.what == What::Distance && n.measured != Some(false)).then_some(0));
    let points = points(parts)?;
    // `x y z` beside a length is where the robot was sent; one called measured, or by the contract's name, is not.
    let own = |at: &At| parts[at.part].names.as_ref().is_some_and(|n| n[at.column].eq_ignore_ascii_case("x_mm"));
    let bare = points.iter().all(|(_, at, measured)| *measured != Some(true) && !own(&at[0]));
    match distance.first() {
        Some(group) if bare => {
            if group.columns.len() > 1 || distance.len() > 1 {
                let columns: Vec<At> = distance.iter().flat_map(|g| g.columns.iter().map(|(_, at)| *at)).collect();
                return Err(twice(parts, "a distance", &columns));
            }
            picked.distance = Some(group.columns[0].1);
        }
        _ => picked.points = points.into_iter().map(|(name, at, _)| (name, at)).collect(),
    }
    let picked = picked.with_units(parts);
    let unit = |at: &At| unit(parts, at);
    let measured = picked.points.iter().flat_map(|(_, at)| at).chain(picked.distance.iter());
    let mixed = |columns: Vec<At>| {
        let units: Vec<Unit> = columns.iter().filter_map(unit).collect();
        units.windows(2).any(|two| two[0] != two[1]).then_some(columns)
    };
    // A joint that slides has a unit of its own.
    let angles = picked.joints.iter().copied().filter(|at| unit(at).is_none_or(Unit::is_angle)).collect();
    match mixed(angles).or_else(|| mixed(measured.copied().collect())) {
        Some(columns) => {
            let message = format!("{} have different units", listed(parts, &columns));
            Err(parts[columns[0].part]
                .refuse(message, Some("convert the table to one unit each for joints and lengths")))
        }
        None => Ok(picked),
    }
}

/// The joints alone, of a table that measured nothing.
pub(in crate::measurements) fn joints_alone(parts: &[Part], count: usize) -> Result<Picked> {
    Ok(Picked { joints: joints(parts, count)?, ..Picked::default() }.with_units(parts))
}

/// Whether a file names as many joints as the robot has; a quaternion `Q0..Q3` is none.
pub(in crate::measurements) fn names_joints(part: &Part, count: usize) -> bool {
    groups(std::slice::from_ref(part), joint_number).iter().any(|group| group.columns.len() == count)
}

fn joint_number(name: &Name) -> Option<usize> {
    if let What::Joint(number) = name.what { Some(number) } else { None }
}

fn joints(parts: &[Part], count: usize) -> Result<Vec<At>> {
    let mut complete: Vec<Vec<At>> = Vec::new();
    let mut largest: Option<(usize, usize)> = None;
    for mut group in groups(parts, joint_number) {
        group.columns.sort_unstable();
        if let Some(two) = group.columns.windows(2).find(|two| two[0].0 == two[1].0) {
            return Err(twice(parts, &format!("joint {}", two[0].0), &[two[0].1, two[1].1]));
        }
        let first = group.columns[0].0;
        let without_gap = group.columns.iter().zip(first..).all(|((n, _), i)| *n == i);
        if group.columns.len() == count && without_gap && first < 2 {
            complete.push(group.columns.iter().map(|(_, at)| *at).collect());
        } else if largest.is_none_or(|(most, _)| group.columns.len() > most) {
            largest = Some((group.columns.len(), group.columns[0].1.part));
        }
    }
    if complete.len() > 1 {
        // Where the robot was sent and where it says that it is: the identified robot corrects commands.
        let (first, second) = (&complete[0], &complete[1]);
        let message = format!("two sets of joints would do: {} and {}", listed(parts, first), listed(parts, second));
        // Nothing of the points where they are not clear.
        let points: Vec<At> = points(parts).into_iter().flatten().flat_map(|(_, at, _)| at).collect();
        let flag = |joints: &[At]| columns_flag(parts, joints, &points, &[]);
        let hint = format!("`--columns {}` takes the first, `--columns {}` the second", flag(first), flag(second));
        return Err(parts[first[0].part].refuse(message, Some(&hint)));
    }
    match (complete.pop(), largest) {
        (Some(columns), _) => Ok(columns),
        (None, Some((found, part))) if found >= 3 && !parts.iter().any(|p| !p.free().is_empty()) => {
            let message = format!(
                "{found} columns of joints, but the robot has {count} joints, counted from 1 or 0 without a gap"
            );
            let hint = "`--robot FILE` names the robot that was measured; `--columns` names all joints in their order, a rail (`E1`) as well";
            Err(parts[part].refuse(message, Some(hint)))
        }
        _ => Ok(Vec::new()),
    }
}

/// The measured points: the name of each target, its columns, and whether they call themselves measured.
#[allow(clippy::type_complexity, reason = "one use")]
fn points(parts: &[Part]) -> Result<Vec<(String, [At; 3], Option<bool>)>> {
    let mut sets: Vec<(Vec<String>, [At; 3], Option<bool>)> = Vec::new();
    let mut commanded: Option<[At; 3]> = None;
    for group in groups(parts, |n| if let What::Coordinate(axis) = n.what { Some(axis) } else { None }) {
        let of_axis = |axis: usize| group.columns.iter().filter(move |(a, _)| *a == axis).map(|(_, at)| *at);
        let all = [0, 1, 2].map(|axis| of_axis(axis).collect::<Vec<At>>());
        if let [[a, d], [b, e], [c, f]] = all.each_ref().map(Vec::as_slice)
            && group.name.measured != Some(false)
        {
            return Err(asked(parts, &[], [&[*a, *b, *c], &[*d, *e, *f]], false));
        }
        for found in all {
            if found.len() > 1 && group.name.measured != Some(false) {
                return Err(twice(parts, "a coordinate", &found));
            }
        }
        let [Some(x), Some(y), Some(z)] = [0, 1, 2].map(|axis| of_axis(axis).next()) else { continue };
        match group.name.measured {
            Some(false) => commanded = Some([x, y, z]),
            measured => sets.push((group.name.key.clone(), [x, y, z], measured)),
        }
    }
    sets.extend(translations(parts));
    if sets.len() > 1 {
        let marked: Vec<usize> = (0..sets.len()).filter(|&i| sets[i].2 == Some(true)).collect();
        if let Some(names) = as_targets(&sets.iter().map(|s| s.0.clone()).collect::<Vec<_>>()) {
            return Ok(names.into_iter().zip(sets).map(|(name, set)| (name, set.1, set.2)).collect());
        }
        let of_marked: Vec<Vec<String>> = marked.iter().map(|&i| sets[i].0.clone()).collect();
        match (&marked[..], as_targets(&of_marked)) {
            ([one], _) => sets = vec![sets.swap_remove(*one)],
            (_, Some(names)) if marked.len() > 1 => {
                let taken = names.into_iter().zip(&marked);
                return Ok(taken.map(|(name, &i)| (name, sets[i].1, sets[i].2)).collect());
            }
            _ => return Err(asked(parts, &[], [&sets[0].1, &sets[1].1], false)),
        }
    }
    if sets.is_empty()
        && let Some(columns) = commanded
        && !parts.iter().any(|p| !p.free().is_empty() || p.names_any(|w| *w == What::Distance))
    {
        return Err(sent_alone(parts, &columns));
    }
    Ok(sets.into_iter().map(|(_, at, measured)| (String::new(), at, measured)).collect())
}

/// That no name is of what was measured; with what to do where there are differences from where the robot was sent.
fn sent_alone(parts: &[Part], sent: &[At; 3]) -> Error {
    let part = sent[0].part;
    let mut message = format!(
        "{} are where the robot was sent, or computed, by their names; no column has what was measured",
        listed(parts, sent)
    );
    let mut hint =
        "join the file of the measured points with another `--measurements FILE`, or name the columns with `--columns`";
    if let Some(columns) = differences::of(&parts[part]) {
        let listed = listed(parts, &columns.map(|column| At { part, column }));
        message +=
            &format!("; {listed} look like differences of measured and commanded, and nothing says of which sign");
        hint = "make columns `x_meas,y_meas,z_meas` of the measured point: where a difference is measured minus commanded, it is the commanded \
                point plus the difference, where it is commanded minus measured, the commanded point minus it";
    }
    parts[part].refuse(message, Some(hint))
}

/// Names of targets, where the sets' names differ in one number or letter alone; one may be without.
fn as_targets(keys: &[Vec<String>]) -> Option<Vec<String>> {
    if keys.len() < 2 {
        return None;
    }
    let split = |key: &Vec<String>| -> (Vec<String>, String) {
        match key.iter().position(|word| is_index(word) && word != "m") {
            Some(at) => {
                (key.iter().enumerate().filter(|(i, _)| *i != at).map(|(_, w)| w.clone()).collect(), key[at].clone())
            }
            None => (key.clone(), String::new()),
        }
    };
    let parts: Vec<(Vec<String>, String)> = keys.iter().map(split).collect();
    let alike = parts.iter().all(|(stem, _)| *stem == parts[0].0);
    let without = parts.iter().filter(|(_, name)| name.is_empty()).count();
    (alike && without < 2)
        .then(|| parts.into_iter().map(|(_, n)| if n.is_empty() { "0".to_owned() } else { n }).collect())
}

/// The last columns of 4x4 matrices, counted from 0 or from 1.
fn translations(parts: &[Part]) -> Vec<(Vec<String>, [At; 3], Option<bool>)> {
    let number = |n: &Name| if let What::Matrix(row, column) = n.what { Some(10 * row + column) } else { None };
    let translation = |group: Group| {
        let at = |entry: usize| group.columns.iter().find(|(n, _)| *n == entry).map(|(_, at)| *at);
        let entries = if at(0).is_some() || at(3).is_some() { [3, 13, 23] } else { [14, 24, 34] };
        let [x, y, z] = entries.map(at);
        Some((group.name.key.clone(), [x?, y?, z?], group.name.measured))
    };
    groups(parts, number).into_iter().filter_map(translation).collect()
}

/// Columns as a sentence names them.
pub(in crate::measurements) fn listed(parts: &[Part], columns: &[At]) -> String {
    let name = |at: &At| parts[at.part].column_name(at.column);
    let run = columns.windows(2).all(|two| two[0].part == two[1].part && two[0].column + 1 == two[1].column);
    match columns {
        [] => "none".to_owned(),
        [first, .., last] if run => match (name(first).strip_prefix("column "), name(last).strip_prefix("column ")) {
            (Some(a), Some(b)) => format!("columns {a} to {b}"),
            _ => format!("{} to {}", name(first), name(last)),
        },
        _ => columns.iter().map(name).collect::<Vec<_>>().join(", "),
    }
}

fn twice(parts: &[Part], what: &str, columns: &[At]) -> Error {
    let part = &parts[columns[0].part];
    let numbers: Vec<String> =
        columns.iter().map(|at| format!("{} (`{}`)", at.column + 1, parts[at.part].column_name(at.column))).collect();
    let message = format!("{what} is named twice: columns {}", numbers.join(" and "));
    let name = |column: usize| part.names.as_ref().and_then(|names| names.get(column));
    let again =
        |second: usize| (0..3).all(|i| name(columns[0].column + i).is_some_and(|n| name(second + i) == Some(n)));
    match columns.iter().skip(1).find(|at| at.part == columns[0].part && again(at.column)) {
        Some(second) => {
            let message =
                format!("a second table stands beside the first, from column {} on: {message}", second.column + 1);
            part.refuse(message, Some("save each table as a file of its own and name each with `--measurements FILE`"))
        }
        None => part.refuse(message, Some("`--columns NAME,NAME,...` names the columns in their order; `-` skips one")),
    }
}

/// That two sets of points would do, with the flags that take either, or both as readings of one point.
/// Joints that are not given are those of the names.
pub(in crate::measurements) fn asked(
    parts: &[Part],
    joints: &[At],
    [first, second]: [&[At; 3]; 2],
    readings: bool,
) -> Error {
    let message = format!(
        "two points would do, {} and {}: which was measured, and which was commanded or computed, only you know",
        listed(parts, first),
        listed(parts, second)
    );
    let flag = |points: &[At]| columns_flag(parts, joints, points, &[]);
    let both = if readings {
        format!(", `--columns {}` both as readings of one point", flag(&[*first, *second].concat()))
    } else {
        String::new()
    };
    let hint = format!("`--columns {}` takes the first, `--columns {}` the second{both}", flag(first), flag(second));
    parts[first[0].part].refuse(message, Some(&hint))
}

/// What `--columns` must say to take these columns, and one `more` by its name, which may be `-`; joints or points that
/// names say are added, and the columns of the measurements' own format, the rows' names and placements among them,
/// keep theirs.
pub(in crate::measurements) fn columns_flag(
    parts: &[Part],
    joints: &[At],
    points: &[At],
    more: &[(At, &str)],
) -> String {
    let mut named: Vec<(usize, At)> =
        groups(parts, joint_number).into_iter().map(|g| g.columns).max_by_key(Vec::len).unwrap_or_default();
    named.sort_unstable();
    let named: Vec<At> = named.into_iter().map(|(_, at)| at).collect();
    // Of rows put side by side the first says what all are.
    let points: Vec<At> = points.iter().copied().filter(|at| at.column < parts[at.part].width_of_file()).collect();
    let named_joints = if joints.is_empty() { named.as_slice() } else { joints };
    let mut words = Vec::new();
    for (part, file) in parts.iter().enumerate() {
        let width = match file.is_program() {
            true => named_joints.len().max(1).min(file.width()),
            false => file.width_of_file(),
        };
        for column in 0..width {
            let at = At { part, column };
            let joint = named_joints.iter().position(|j| *j == at).map(|i| format!("j{}", i + 1));
            let number = |i: usize| if points.len() > 3 { (i / 3 + 1).to_string() } else { String::new() };
            let point = points.iter().position(|p| *p == at).map(|i| ["x", "y", "z"][i % 3].to_owned() + &number(i));
            let more = more.iter().find(|(column, _)| *column == at).map(|(_, name)| (*name).to_owned());
            let own = file.meanings.as_ref().and_then(|meanings| match meanings[column].what {
                What::Own(name) => Some(name.to_owned()),
                _ => None,
            });
            words.push(joint.or(point).or(more).or(own).unwrap_or_else(|| "-".to_owned()));
        }
    }
    while words.last().is_some_and(|word| word == "-") {
        words.pop();
    }
    words.join(",")
}
