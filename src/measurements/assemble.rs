//! Rows of measurements from the columns that were taken, and the sentence that says which.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::blanks;
use super::columns::judge::{Basis, Way};
use super::columns::layout::{ONE_POINT, are_readings, is_kept, point};
use super::columns::part::{At, Kind, Part};
use super::columns::pick::{self, listed};
use super::rows::{Measurement, from_table, reading_name};
use crate::csv_table::Table;
use crate::diagnostic::count;
use crate::files::Result;
use crate::robot::Robot;
use crate::tables::names::{Name, What, words};
use crate::tables::{Fields, Form};

/// Makes files with a multiple of the others' rows, so many readings a pose, as long as these: one row a pose, the
/// readings side by side. Says whether there were any.
pub(super) fn widen(parts: &mut [Part]) -> Result<bool> {
    let Some(least) = parts.iter().map(|p| p.rows.len()).min() else { return Ok(false) };
    let widened = parts.iter().any(|p| p.rows.len() != least);
    let counts: Vec<String> = parts.iter().map(|p| format!("{} has {} rows", p.file_name(), p.rows.len())).collect();
    for part in parts.iter_mut().filter(|part| part.rows.len() != least) {
        let times = part.rows.len() / least;
        let strides = if times * least == part.rows.len() { strides(part, least, times) } else { None };
        let Some((of_row, of_reading)) = strides else {
            let hint = "files are joined row by row: the same rows in each, or for each pose so many readings one after the other, whose distances are kept";
            return Err(part.refuse(counts.join(", "), Some(hint)));
        };
        let together = |row: usize| {
            let all: Vec<&(u64, Fields)> = (0..times).map(|k| &part.rows[row * of_row + k * of_reading]).collect();
            (all[0].0, Fields::new(all.iter().flat_map(|(_, fields)| fields.iter())))
        };
        let rows = (0..least).map(together).collect();
        let repeated = |k: usize| {
            move |name: &Name| match name.what {
                What::Coordinate(_) | What::Matrix(..) => {
                    Name { key: [name.key.clone(), vec![k.to_string()]].concat(), ..name.clone() }
                }
                _ if k == 1 => name.clone(),
                _ => Name { what: What::Other, ..name.clone() },
            }
        };
        part.meanings = part.meanings.as_ref().map(|m| (1..=times).flat_map(|k| m.iter().map(repeated(k))).collect());
        part.names = part.names.as_ref().map(|n| n.iter().cycle().take(times * n.len()).cloned().collect());
        part.kinds = part.kinds.iter().cycle().take(times * part.kinds.len()).cloned().collect();
        (part.rows, part.times) = (rows, times);
    }
    Ok(widened)
}

/// How many rows farther the next pose stands, and the next reading of a pose: one after the other, or first all of the
/// first target.
fn strides(part: &Part, poses: usize, times: usize) -> Option<(usize, usize)> {
    let columns = coordinates(part)?.map(|column| At { part: 0, column });
    let point = |row: usize| point(std::slice::from_ref(part), row, &columns);
    let apart = |a: usize, b: usize| Some((point(a)? - point(b)?).norm());
    let next: Vec<f64> = (0..poses).filter_map(|row| apart(row * times, row * times + 1)).collect();
    let between: Vec<f64> = (1..poses).filter_map(|row| apart((row - 1) * times, row * times)).collect();
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len().max(1) as f64;
    if is_kept(next.clone()) || mean(&next) < ONE_POINT * mean(&between) {
        return Some((times, 1));
    }
    let later: Vec<f64> = (0..poses).filter_map(|row| apart(row, poses + row)).collect();
    (is_kept(later.clone()) || mean(&later) < ONE_POINT * mean(&between)).then_some((1, poses))
}

/// The first three columns that are a point.
fn coordinates(part: &Part) -> Option<[usize; 3]> {
    let named = |axis: usize| {
        part.meanings.as_ref()?.iter().position(|n| n.what == What::Coordinate(axis) && n.measured != Some(false))
    };
    match (named(0), named(1), named(2)) {
        (Some(x), Some(y), Some(z)) => Some([x, y, z]),
        _ => part.free().first_chunk::<3>().copied(),
    }
}

pub(super) struct Taken<'a> {
    pub parts: &'a [Part],
    pub way: &'a Way,
    /// Who says so.
    pub basis: Basis,
    pub robot: &'a Robot,
    /// Which of several tables it is.
    pub number: Option<usize>,
}

impl Taken<'_> {
    pub fn rows(&self) -> Result<Vec<Measurement>> {
        let picked = &self.way.picked;
        let places = self.targets_as_readings();
        let own = self.own();
        let mut header: Vec<String> = ["pose", "group", "role"].map(str::to_owned).into();
        let several = picked.points.len() > 1 && !places && !own.contains_key("target");
        header.extend(several.then(|| "target".to_owned()));
        header.extend(self.robot.joints.iter().enumerate().map(|(j, joint)| reading_name(j, joint.slides)));
        header.extend(match picked.distance {
            Some(_) => vec!["distance_mm".to_owned()],
            None => ["x_mm", "y_mm", "z_mm"].map(str::to_owned).to_vec(),
        });
        let more: Vec<(&str, At)> =
            own.iter().filter(|(n, _)| !["pose", "group", "role"].contains(n)).map(|(n, at)| (*n, *at)).collect();
        header.extend(more.iter().map(|(name, _)| (*name).to_owned()));
        let measured: Vec<(&str, Vec<At>)> = match picked.distance {
            Some(at) => vec![("", vec![at])],
            None => picked.points.iter().map(|(name, at)| (name.as_str(), at.to_vec())).collect(),
        };
        let mut rows = Vec::new();
        for row in (0..self.count()).filter(|row| !self.is_without_numbers(*row)) {
            for (k, (target, columns)) in measured.iter().enumerate() {
                let repeated = (places && measured.len() > 1).then_some(k + 1);
                let mut cells = self.named(row, repeated, &own);
                cells.extend(several.then(|| (*target).to_owned()));
                for (at, joint) in picked.joints.iter().zip(&self.robot.joints) {
                    let value = self.parts[at.part].number(row, at.column)?;
                    let reading = pick::reading(self.parts, at, joint, value, self.way.joints, self.way.lengths);
                    cells.push(reading.to_string());
                }
                let mut numbers = Vec::new();
                for at in columns {
                    numbers.push(self.parts[at.part].optional(row, at.column)?.map(|v| self.way.lengths.converted(v)));
                }
                // A point without one of its coordinates is none.
                let whole = numbers.iter().all(Option::is_some);
                cells.extend(numbers.iter().map(|v| v.filter(|_| whole).map_or_else(String::new, |v| v.to_string())));
                cells.extend(more.iter().map(|(_, at)| self.cell(row, *at).to_owned()));
                let line = columns.first().map_or(0, |at| self.parts[at.part].rows[row].0);
                rows.push((line, Fields::new(cells)));
            }
        }
        let path = &self.parts[picked.points.first().map_or(picked.joints[0].part, |(_, at)| at[0].part)].grid.path;
        from_table(Table::new(path, header, rows)?)
    }

    /// Whether a row has neither joints nor anything that was measured: what a logger writes that lost a sample.
    fn is_without_numbers(&self, row: usize) -> bool {
        let lost = |at: &At| matches!(self.parts[at.part].optional(row, at.column), Ok(None));
        self.way.picked.columns().chain(self.way.picked.distance).all(|at| lost(&at))
    }

    /// The lines of such rows, for a sentence.
    pub fn without_numbers(&self) -> Option<String> {
        let part = &self.parts[self.way.picked.joints[0].part];
        let rows = (0..self.count()).filter(|row| self.is_without_numbers(*row));
        let lines: Vec<u64> = rows.map(|row| part.rows[row].0).collect();
        let what = count(lines.len(), "row");
        (!lines.is_empty()).then(|| format!("{what} without joints and points left out: {}", blanks::listed(&lines)))
    }

    fn count(&self) -> usize {
        self.parts[self.way.picked.joints[0].part].rows.len()
    }

    fn cell(&self, row: usize, at: At) -> &str {
        &self.parts[at.part].rows[row].1[at.column]
    }

    /// Columns of the contract's own names; a group that no row has is none.
    fn own(&self) -> BTreeMap<&'static str, At> {
        let mut list = BTreeMap::new();
        for (part, meanings) in self.parts.iter().enumerate().filter_map(|(i, p)| Some((i, p.meanings.as_ref()?))) {
            for (column, name) in meanings.iter().enumerate() {
                if let What::Own(own) = name.what {
                    list.entry(own).or_insert(At { part, column });
                }
            }
        }
        let joined = self.parts.iter().enumerate().find_map(|(part, p)| Some(At { part, column: p.key? }));
        if let Some(at) = joined {
            list.entry("pose").or_insert(at);
        }
        list.retain(|name, at| *name != "group" || (0..self.count()).any(|row| !self.cell(row, *at).is_empty()));
        list
    }

    /// Pose, group and role of a row.
    fn named(&self, row: usize, repeated: Option<usize>, own: &BTreeMap<&'static str, At>) -> Vec<String> {
        let given = |name: &str| own.get(name).map(|at| self.cell(row, *at).to_owned()).filter(|cell| !cell.is_empty());
        let mut pose = given("pose").unwrap_or_else(|| (row + 1).to_string());
        if let Some(k) = repeated {
            let _ = write!(pose, ".{k}");
        }
        // A row without a group where others have one is refused when the rows are read.
        let of_column = own.get("group").map(|at| self.cell(row, *at).to_owned());
        let mut group = of_column.clone().unwrap_or_else(|| "1".to_owned());
        if let Some(number) = self.number {
            pose = format!("{number}:{pose}");
            group = match of_column {
                Some(group) if group.is_empty() => group,
                Some(group) => format!("{number}:{group}"),
                None => number.to_string(),
            };
        }
        vec![pose, group, given("role").unwrap_or_else(|| "sample".to_owned())]
    }

    /// Whether a column's name is one of the contract's.
    fn is_own(&self, at: At) -> bool {
        self.parts[at.part].meanings.as_ref().is_some_and(|meanings| matches!(meanings[at.column].what, What::Own(_)))
    }

    fn targets_as_readings(&self) -> bool {
        are_readings(self.parts, &self.way.picked)
    }

    /// What was taken, in one line.
    pub fn sentence(&self) -> String {
        let picked = &self.way.picked;
        let files: Vec<String> = self.parts.iter().map(Part::file_name).collect();
        let count = self.count();
        let from = |columns: &[At]| {
            let part = &self.parts[columns[0].part];
            let of = if self.parts.len() > 1 { format!(" of {}", part.file_name()) } else { String::new() };
            match part.is_program() {
                true => format!("targets{of}"),
                false => format!("{}{of}", listed(self.parts, columns)),
            }
        };
        let measured = match (&picked.distance, &picked.points[..]) {
            (Some(at), _) => format!("distances from {}", from(&[*at])),
            (None, [(_, at)]) => format!("points from {}", from(at)),
            (None, all) => {
                let each: Vec<String> = all.iter().map(|(_, at)| from(at)).collect();
                let what = if self.targets_as_readings() { "readings" } else { "targets" };
                format!("{} {what} a pose from {}", all.len(), each.join(" and "))
            }
        };
        let basis = match self.basis {
            Basis::Stated => String::new(),
            Basis::Robot => " (which the nominal robot confirms)".to_owned(),
            Basis::Sizes if self.way.left.is_some() => {
                format!(" (by their size; the nominal robot is {:.0} mm off with them)", self.way.left_mm)
            }
            Basis::Sizes => " (by their size; the nominal robot does not tell)".to_owned(),
        };
        let mut text = format!(
            "{}: {count} rows; joints from {} in {}, {measured} in {}{basis}",
            files.join(" + "),
            from(&picked.joints),
            self.way.joints.word(),
            self.way.lengths.word()
        );
        text.push_str(&self.form());
        let own = self.own();
        match own.get("pose") {
            None => text.push_str("; pose = row"),
            Some(at) if self.parts[at.part].key == Some(at.column) && !self.is_own(*at) => {
                let _ = write!(text, "; pose = {}", self.parts[at.part].column_name(at.column));
            }
            Some(_) => {}
        }
        if let Some(number) = self.number.filter(|_| !own.contains_key("group")) {
            let _ = write!(text, "; group = {number}");
        }
        text.push_str(&self.unused());
        text
    }

    fn form(&self) -> String {
        let mut words: Vec<String> = Vec::new();
        for part in self.parts {
            let form = match &part.grid.form {
                Form::Delimited(';') => Some("semicolons".to_owned()),
                Form::Delimited('\t') => Some("tabs".to_owned()),
                Form::Delimited(' ') => Some("blanks".to_owned()),
                Form::Delimited(_) => None,
                Form::Named(what, 0) => Some((*what).to_owned()),
                Form::Named(what, others) => Some(format!("{what} ({others} lines hold none)")),
                Form::Sheet(name, others) if *others > 0 => Some(format!("sheet {name} ({others} more not read)")),
                Form::Sheet(name, _) => Some(format!("sheet {name}")),
                Form::Program { others: 0, .. } => Some("a program's lines".to_owned()),
                Form::Program { others, .. } => Some(format!("a program's lines ({others} lines hold no target)")),
            };
            let header = (part.names.is_none() && !part.is_program()).then(|| "no header".to_owned());
            let of_part = form.into_iter().chain(part.grid.encoding.map(str::to_owned)).chain(header);
            for word in of_part {
                if !words.contains(&word) {
                    words.push(word);
                }
            }
        }
        words.iter().map(|word| format!(", {word}")).collect()
    }

    /// Columns of numbers, and of words that part the rows, that were left alone, but for those of `measure` that say
    /// how a row came about.
    fn unused(&self) -> String {
        const NAMED: usize = 12;
        let of_measure =
            |name: &String| name.ends_with("_rad2") || ["fit_rms_mm", "corners", "status"].contains(&name.as_str());
        let picked = &self.way.picked;
        let taken: Vec<At> = picked.columns().chain(picked.distance).chain(self.own().into_values()).collect();
        let (mut left, mut turned) = (Vec::new(), false);
        let whole = |part: usize| self.parts.len() > 1 && taken.iter().all(|at| at.part != part);
        let idle = (0..self.parts.len()).filter(|&part| whole(part));
        left.extend(idle.map(|part| format!("all of {}", self.parts[part].file_name())));
        for (part, file) in self.parts.iter().enumerate().filter(|(part, p)| !p.is_program() && !whole(*part)) {
            let is_left = |column: &usize| {
                let at = At { part, column: *column };
                let is_told = match file.kinds[*column] {
                    Kind::Numbers | Kind::Beyond => true,
                    Kind::Words => file.parts_rows(*column),
                    _ => false,
                };
                is_told && !taken.contains(&at)
            };
            let columns: Vec<usize> = (0..file.width()).filter(is_left).collect();
            turned |= columns.iter().any(|column| turns(file, *column));
            let names = columns.into_iter().map(|column| file.column_name(column));
            left.extend(names.filter(|name| !of_measure(name)));
        }
        let read = if turned { " (an orientation is read from rx_rad, ry_rad, rz_rad, a rotation vector)" } else { "" };
        match left.len() {
            0 => String::new(),
            n if n > NAMED => {
                format!("; not used: {} and {}{read}", left[..NAMED].join(", "), count(n - NAMED, "more column"))
            }
            _ => format!("; not used: {}{read}", left.join(", ")),
        }
    }
}

/// Words of columns that say how a target is turned.
const TURNS: [&str; 15] =
    ["rx", "ry", "rz", "qw", "qx", "qy", "qz", "roll", "pitch", "yaw", "euler", "quat", "quaternion", "rotvec", "rvec"];

/// Whether a column's name is of an orientation, an entry of a matrix included.
fn turns(file: &Part, column: usize) -> bool {
    let is_entry = file.meanings.as_ref().is_some_and(|meanings| matches!(meanings[column].what, What::Matrix(..)));
    let name = file.names.as_ref().and_then(|names| names.get(column));
    is_entry || name.is_some_and(|name| words(name).0.iter().any(|word| TURNS.contains(&word.as_str())))
}
