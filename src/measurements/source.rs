//! Measurements from files as people have them.
//!
//! In: one or several files, perhaps names of their columns and units, and the nominal robot. Out: rows of
//! measurements, and a line for each table that says what was taken. A table in the contract's own columns is read as
//! it stands. Of others the names say which columns are which, where there are names, and the nominal robot decides
//! what they leave open; what stays open is refused with the flags that settle it. Files that lack joints or points are
//! joined row by row, complete ones are stacked.

use camino::Utf8PathBuf;
use serde::Deserialize;

use super::Measurement;
use super::assemble::{self, Taken};
use super::columns::apart;
use super::columns::judge::{self, Basis, Forced, Verdict, Way};
use super::columns::layout;
use super::columns::part::{At, Kind, Part};
use super::columns::pick::{self, Picked, listed};
use super::columns::truth;
use super::columns::two_frames;
use super::columns::unsettled;
use super::copies;
use super::keys;
use super::rows::read_whole;
use super::stuck;
use crate::diagnostic::Place;
use crate::files::{Error, Result};
use crate::robot::Robot;
use crate::tables::names::{Name, Unit, What};

/// Section `[measurements]`: what is known of tables beside what they say.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Known {
    /// As in [`Source`].
    pub columns: Option<String>,
    /// As in [`Source`].
    pub units: Option<String>,
}

impl Known {
    /// Notes what is no unit.
    pub fn validate(&self, problems: &mut Vec<String>) {
        if let Some(units) = &self.units
            && units.split(',').any(|word| Unit::of(word).is_none())
        {
            problems.push(format!("measurements.units is `{units}`; it is one of deg and rad, one of mm, m and um, or both with a comma between"));
        }
    }
}

/// Where measurements come from, and what is known of their columns.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Source {
    /// Files, each perhaps with `#SHEET` behind it.
    pub files: Vec<Utf8PathBuf>,
    /// Names of the columns in their order, those of all files side by side; `-` skips one.
    pub columns: Option<String>,
    /// Units of joints and lengths, `rad,mm`.
    pub units: Option<String>,
}

impl Source {
    /// A single file, nothing known.
    pub fn of(file: Utf8PathBuf) -> Source {
        Source { files: vec![file], ..Source::default() }
    }

    /// The files without the names of sheets.
    pub fn paths(&self) -> Vec<Utf8PathBuf> {
        self.files.iter().map(|file| crate::tables::Grid::file(file)).collect()
    }

    fn forced(&self) -> Forced {
        let units: Vec<Unit> = self.units.iter().flat_map(|u| u.split(',')).filter_map(Unit::of).collect();
        Forced {
            joints: units.iter().copied().find(|u| u.is_angle()),
            lengths: units.iter().copied().find(|u| !u.is_angle()),
        }
    }

    /// The units of angles and of lengths that were typed.
    pub fn typed_units(&self) -> [Option<Unit>; 2] {
        let Forced { joints, lengths } = self.forced();
        [joints, lengths]
    }

    /// Reads everything; the sentences say what was taken.
    pub fn read(&self, robot: &Robot) -> Result<(Vec<Measurement>, Vec<String>)> {
        let count = robot.joints.len();
        if let Some(file) = (1..self.files.len()).find(|&i| self.files[..i].contains(&self.files[i])) {
            let place = Place { path: self.files[file].clone(), line: None };
            let message = "the file is named twice; each of its rows would count twice".to_owned();
            return Err(Error::Format { message, place, hint: Some("name each file once".to_owned()) });
        }
        let mut parts = Vec::with_capacity(self.files.len());
        for file in &self.files {
            if let [only] = &self.files[..]
                && self.columns.is_none()
                && self.units.is_none()
                && is_own(&Part::read(only, count, false)?)
            {
                let (rows, below) = read_whole(only)?;
                return Ok(checked(rows, below, robot));
            }
            parts.push(Part::read(file, count, self.columns.is_some())?);
        }
        let named = self.columns.as_ref().map(|columns| name_columns(&mut parts, columns, count)).transpose()?;
        let sets = if named == Some(true) { vec![parts] } else { sets(parts, count) };
        let several = sets.len() > 1;
        let (mut rows, mut said) = (Vec::new(), Vec::new());
        for (number, mut set) in sets.into_iter().enumerate() {
            let joined = keys::align(&mut set)?;
            let widened = assemble::widen(&mut set)?;
            // A column that a flag skips names nothing.
            if self.columns.is_none() && set.iter().all(|part| part.key.is_none()) {
                set.iter_mut().for_each(|part| part.key = keys::label(part));
            }
            let (way, basis) = self.way(&set, robot, widened)?;
            let taken = Taken { parts: &set, way: &way, basis, robot, number: several.then_some(number + 1) };
            rows.extend(taken.rows()?);
            said.push(taken.sentence());
            said.extend(taken.without_numbers());
            said.extend(joined);
            said.extend(set.iter_mut().filter_map(|part| part.below.take()));
            if way.is_computed() {
                said.push(
                    "the nominal robot predicts these points to a micrometre: they were computed from the joints, not measured"
                        .to_owned(),
                );
            }
        }
        Ok(checked(rows, said, robot))
    }

    /// The readings of the first file alone, whatever else stands beside them: line, name and readings in deg (mm); and
    /// what was taken.
    #[allow(clippy::type_complexity, reason = "one use")]
    pub fn readings(&self, robot: &Robot) -> Result<(Vec<(u64, String, Vec<f64>)>, String)> {
        let count = robot.joints.len();
        let parts: Vec<Part> =
            self.files.iter().take(1).map(|file| Part::read(file, count, false)).collect::<Result<_>>()?;
        if let [call, ..] = parts[0].calls() {
            let message = format!("a program with `{call}`, in a language that is not known");
            let hint = "a table of the joint targets alone, `name,j1_deg,j2_deg,...`; programs are .script, .mod, .src, .dat, .ls and .jbi";
            return Err(parts[0].refuse(message, Some(hint)));
        }
        let mut picked = pick::joints_alone(&parts, count)?;
        let free: Vec<At> = parts[0].free().into_iter().map(|column| At { part: 0, column }).collect();
        if picked.joints.is_empty() && free.len() == count {
            picked.joints = free;
        }
        if picked.joints.is_empty() {
            let hint = "columns `name,j1_deg,j2_deg,...`, or as many columns of numbers as the robot has joints";
            let found = format!("{} of {} columns are numbers", parts[0].free().len(), parts[0].width());
            return Err(parts[0].refuse(format!("no columns of {count} joints: {found}"), Some(hint)));
        }
        pick::check_lengths(&parts, &picked, robot)?;
        let unit = self.forced().joints.or(picked.joint_unit).or_else(|| judge::angle_by_size(&parts, &picked));
        let Some(unit) = unit else {
            let message =
                "no column name tells whether the joints are degrees or radians, and the numbers could be either";
            return Err(parts[0]
                .refuse(message.to_owned(), Some("name the columns j1_deg, j2_deg, ... or q1 [rad], q2 [rad], ...")));
        };
        let name = parts[0].meanings.iter().flatten().position(|n| matches!(n.what, What::Own("pose")));
        let name = name.or_else(|| parts[0].names.iter().flatten().position(|n| n.eq_ignore_ascii_case("name")));
        let row = |row: usize| {
            let (line, cells) = &parts[0].rows[row];
            let reading = |(at, joint): (&At, &crate::robot::Joint)| {
                let value = parts[0].number(row, at.column)?;
                Ok(pick::reading(&parts, at, joint, value, unit, Unit::Mm))
            };
            let readings = picked.joints.iter().zip(&robot.joints).map(reading).collect::<Result<Vec<f64>>>()?;
            Ok((*line, name.map_or_else(|| (row + 1).to_string(), |column| cells[column].to_owned()), readings))
        };
        let said = format!(
            "{}: {}; joints from {} in {}",
            parts[0].file_name(),
            crate::diagnostic::count(parts[0].rows.len(), "target"),
            listed(&parts, &picked.joints),
            unit.word()
        );
        let said = parts[0].below.iter().fold(said, |said, below| format!("{said}; {below}"));
        Ok(((0..parts[0].rows.len()).map(row).collect::<Result<Vec<_>>>()?, said))
    }

    /// The columns and units of a set of files; `widened` says that several rows of one were put side by side.
    fn way(&self, parts: &[Part], robot: &Robot, widened: bool) -> Result<(Way, Basis)> {
        let count = robot.joints.len();
        if let Some([first, second]) = truth::beside_measured(parts) {
            return Err(pick::asked(parts, &[], [&first, &second], false));
        }
        let picked = pick::by_names(parts, count)?;
        pick::check_lengths(parts, &picked, robot)?;
        if let [(_, first), .., (_, second)] = &picked.points[..] {
            let readings = layout::are_readings(parts, &picked);
            // Two that are nearly one may be where the robot was sent and what was measured there.
            let unsaid = picked.points.len() == 2 && !widened && self.columns.is_none();
            let differ = !readings && layout::differ(parts, first, second);
            if differ && widened {
                return Err(unsettled::rows_of_pose(parts));
            }
            if readings && unsaid || differ {
                return Err(pick::asked(parts, &[], [first, second], readings));
            }
        }
        let complete = picked.joints.len() == count && picked.is_measured();
        let candidates = if complete { vec![picked.clone()] } else { layout::candidates(parts, &picked, count) };
        if candidates.is_empty() {
            return Err(parts
                .iter()
                .find_map(Part::mixed)
                .unwrap_or_else(|| unsettled::lacking(parts, &picked, count)));
        }
        // Columns that are named are not asked about.
        let apart = |ways| if self.columns.is_some() { None } else { apart::clearest(parts, ways, robot) };
        match judge::decide(parts, &candidates, robot, self.forced()) {
            Verdict::Taken(way, basis) => {
                if let Some([first, second]) = two_frames::of_way(parts, &way, robot) {
                    return Err(match widened {
                        true => unsettled::rows_of_pose(parts),
                        false => pick::asked(parts, &way.picked.joints, [&first, &second], false),
                    });
                }
                apart(vec![way.clone()]).map_or(Ok((way, basis)), |apart| Err(apart.asked(parts)))
            }
            Verdict::WrongUnit { stated, better } => Err(unsettled::wrong_unit(parts, &stated, &better)),
            Verdict::Open(..) if widened => Err(unsettled::rows_of_pose(parts)),
            Verdict::Open(a, b) => Err(unsettled::open(parts, &a, &b)),
            Verdict::NoUnit { joints, lengths } => Err(unsettled::no_unit(parts, joints, lengths)),
            Verdict::None => {
                let mixed = || parts.iter().find_map(Part::mixed);
                Err(apart(judge::usual(&candidates, self.forced()))
                    .map(|a| a.asked(parts))
                    .or_else(mixed)
                    .or_else(|| self.other_units(parts, &candidates, robot))
                    .unwrap_or_else(|| unsettled::unplaced(parts, &candidates[0], self.forced())))
            }
        }
    }

    /// That the units that were typed are what is in the way.
    fn other_units(&self, parts: &[Part], candidates: &[Picked], robot: &Robot) -> Option<Error> {
        let forced = Some(self.forced()).filter(|forced| *forced != Forced::default())?;
        match judge::decide(parts, candidates, robot, Forced::default()) {
            Verdict::Taken(way, Basis::Robot) => Some(unsettled::other_units(parts, forced, &way)),
            _ => None,
        }
    }
}

/// Rows that are copies, or hold no reading, are none; with what is said besides.
fn checked(rows: Vec<Measurement>, mut said: Vec<String>, robot: &Robot) -> (Vec<Measurement>, Vec<String>) {
    let (rows, copied) = copies::counted_once(rows);
    said.extend(copied);
    (copies::verifying_nothing(stuck::taken_away(rows, robot)), said)
}

/// Whether a file has the contract's own columns, poses with names, groups and roles.
fn is_own(part: &Part) -> bool {
    let has = |name: &str| part.names.as_ref().is_some_and(|names| names.iter().any(|n| n == name));
    ["pose", "group", "role"].into_iter().all(has)
        && (has("j1_deg") || has("j1_mm"))
        && (has("x_mm") || has("distance_mm"))
}

/// Names the columns of all files in their order; says whether the files are one table side by side.
fn name_columns(parts: &mut [Part], columns: &str, count: usize) -> Result<bool> {
    let words: Vec<&str> = columns.split(',').map(str::trim).collect();
    let width = |part: &Part, whole: bool| {
        if part.is_program() && !whole { count.min(part.width()) } else { part.width_of_file() }
    };
    let whole = words.len() == parts.iter().map(|p| width(p, true)).sum::<usize>();
    let total: usize = parts.iter().map(|p| width(p, whole)).sum();
    let name = |word: &&str| if *word == "-" { Name::of("") } else { Name::of(word) };
    let names: Vec<Name> = words.iter().map(name).collect();
    let says = |of: &dyn Fn(&What) -> bool| names.iter().any(|n| of(&n.what));
    let complete =
        says(&|w| matches!(w, What::Joint(_))) && says(&|w| matches!(w, What::Coordinate(_) | What::Distance));
    let each = parts.len() > 1 && complete && parts.iter().all(|p| words.len() <= p.width() && !p.is_program());
    if !each && words.len() > total {
        let message = format!("`--columns` names {} columns, but there are {total}", words.len());
        let hint = "one name a column in their order, those of all files side by side; `-` skips one";
        return Err(parts[0].refuse(message, Some(hint)));
    }
    if let Some(word) = words.iter().zip(&names).find(|(word, name)| **word != "-" && name.what == What::Other) {
        let message = format!("`--columns` has `{}`, which is no name of a column", word.0);
        return Err(parts[0].refuse(message, Some("j1, j2, ... for joints, x, y, z (x1, y1, z1, x2, ... of several targets) or L, pose, group, role; `-` skips one")));
    }
    let mut given = names.into_iter();
    for part in parts.iter_mut() {
        let own = match each {
            true => words.iter().map(name).collect(),
            false => given.by_ref().take(width(part, whole)).collect::<Vec<_>>(),
        };
        let label = part.label();
        let before = part.meanings.take();
        // A unit that the file states stays true of a column that gets another name.
        let with_unit = |(column, name): (usize, Name)| {
            let unit = before.as_ref().and_then(|m| m.get(column)).and_then(|n| n.unit);
            Name { unit: name.unit.or(unit), ..name }
        };
        let mut meanings: Vec<Name> = own.into_iter().enumerate().map(with_unit).collect();
        let named = meanings.len();
        meanings.resize(part.width(), Name::of(""));
        if let Some(column) = label {
            meanings[column] = Name::of("pose");
        }
        // What is not named is not looked at.
        for (column, kind) in part.kinds.iter_mut().enumerate().filter(|(c, _)| meanings[*c].what == What::Other) {
            *kind = if column >= named && *kind == Kind::Numbers { Kind::Beyond } else { Kind::Words };
        }
        part.meanings = Some(meanings);
    }
    Ok(!each)
}

/// Files that make one table each: those with joints and points, and those that complete each other.
fn sets(parts: Vec<Part>, count: usize) -> Vec<Vec<Part>> {
    let joints = |p: &Part| p.is_program() || pick::names_joints(p, count);
    let measured = |p: &Part| p.names_any(|w| matches!(w, What::Coordinate(_) | What::Distance | What::Matrix(..)));
    let lone = |p: &Part| joints(p) != measured(p);
    // A file without names may be either; beside one that lacks the other half it is what that one lacks.
    let short = |p: &Part| !p.is_named() && (count..count + 3).contains(&p.free().len());
    let lacking = parts.iter().any(|p| p.is_named() && lone(p) || short(p));
    // Names that are not known may be those of joints.
    let alone = parts.iter().all(|p| p.is_named() && measured(p));
    let whole = |p: &Part| match p.is_named() {
        true => measured(p) && (joints(p) || alone && p.spare().len() >= count),
        false => !lacking && p.free().len() >= count + 3,
    };
    let mut list: Vec<Vec<Part>> = Vec::new();
    let mut open: Vec<Part> = Vec::new();
    for part in parts {
        if whole(&part) {
            list.push(vec![part]);
            continue;
        }
        let begins = joints(&part)
            || !part.is_named()
                && part.free().len() == count
                && !open.is_empty()
                && open.iter().any(|p| p.free().len() == count);
        if begins && open.iter().any(|p| joints(p) || !p.is_named() && p.free().len() == count) && open.len() > 1 {
            list.push(std::mem::take(&mut open));
        }
        open.push(part);
    }
    if !open.is_empty() {
        list.push(open);
    }
    list
}
