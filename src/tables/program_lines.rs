//! Joint targets of a robot program as rows of numbers.
//!
//! Programs in the makers' languages are read as `compensate` reads them; of any other text each line counts that holds a list of numbers in
//! brackets, `j:{1.0,2.0,...}`, `Angles(1.0, 2.0, ...)`, `[1.0, 2.0, ...]`, as long as most of its lines do.
//! A list is a row as it stands; numbers beyond the joints are those of axes that the robot does not have.

use camino::Utf8Path;

use super::fields::{Fields, Form};
use crate::programs::{self, Joints, Language};

/// Lines in which words tell a program from a table.
const SEEN: usize = 60;

/// The targets with their lines, and the form. `None` where the text is no program.
pub(super) fn read(path: &Utf8Path, text: &str, joints: usize) -> Option<(Vec<(u64, Fields)>, Form)> {
    let lines = text.lines().filter(|line| !line.trim().is_empty()).count();
    if let Some(language) = Language::of(path) {
        let slides = vec![false; joints];
        let found = programs::targets(language, text, Joints { slides: &slides, pulses_per_deg: &[] });
        if let Ok(targets) = found
            && !targets.is_empty()
        {
            let row = |t: &programs::Target| {
                let cells: Vec<String> = t.readings.iter().map(f64::to_string).collect();
                (t.line, Fields::new(cells.iter().map(String::as_str)))
            };
            let rows: Vec<(u64, Fields)> = targets.iter().map(row).collect();
            let others = lines.saturating_sub(rows.len());
            return Some((rows, Form::Program { others, degrees: true }));
        }
    }
    let rows: Vec<(u64, Fields)> =
        text.lines().zip(1..).filter_map(|(line, number)| Some((number, list(line, joints)?))).collect();
    // Lines of nothing but numbers in brackets, with more of them than joints and a point behind them, are a table's.
    let is_word = |line: &str| line.chars().any(|c| c.is_alphabetic() && !matches!(c, 'e' | 'E'));
    let table = !text.lines().take(lines.min(SEEN)).any(is_word)
        && rows.iter().all(|(_, row)| row.len() >= joints + 3 || row.len() < joints);
    (2 * rows.len() > lines && !table).then(|| {
        let others = lines - rows.len();
        (rows, Form::Program { others, degrees: false })
    })
}

/// The first list in brackets with nothing but numbers in it, as many as joints at the least.
fn list(line: &str, joints: usize) -> Option<Fields> {
    line.match_indices(['{', '[', '(']).find_map(|(at, _)| {
        let rest = &line[at + 1..];
        let end = rest.find(['{', '[', '(', '}', ']', ')'])?;
        let numbers: Vec<&str> = rest[..end].split(',').map(str::trim).collect();
        let all = numbers.len() >= joints && numbers.iter().all(|n| n.parse::<f64>().is_ok());
        all.then(|| Fields::new(numbers.into_iter()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(path: &str, text: &str, joints: usize) -> Option<Vec<Vec<String>>> {
        let (rows, _) = read(Utf8Path::new(path), text, joints)?;
        Some(rows.iter().map(|(_, row)| row.iter().map(str::to_owned).collect()).collect())
    }

    #[test]
    fn a_line_holds_one_target() {
        let text = "LOCAL VAR jointtarget j1 = j:{2.5,-29.5,6\t,0\t}\t{EJ 0,0}\nLOCAL VAR jointtarget j2 = j:{1,2,3,0}{EJ 0,0}\n";
        assert_eq!(rows("a.csv", text, 3).unwrap(), [["2.5", "-29.5", "6", "0"], ["1", "2", "3", "0"]]);
        assert_eq!(rows("a.txt", "c(0).Angles(1,2,3)\nc(1).Angles(4,5,6)\n", 3).unwrap().len(), 2);
        assert_eq!(rows("a.csv", "j1,j2,j3\n1,2,3\n", 3), None);
    }

    #[test]
    fn a_makers_program_is_read_in_its_language() {
        let text = "MODULE m\nCONST jointtarget p1 := [[1,2,3,4,5,6],[9E9,9E9,9E9,9E9,9E9,9E9]];\nENDMODULE\n";
        assert_eq!(rows("a.mod", text, 6).unwrap(), [["1", "2", "3", "4", "5", "6"]]);
    }
}
