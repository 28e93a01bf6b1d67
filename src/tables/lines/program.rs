//! Joint targets of a robot program as rows of numbers.
//!
//! Programs in the makers' languages are read as `compensate` reads them; of any other text each line counts that holds
//! a list of numbers in brackets, `j:{1.0,2.0,...}`, `Angles(1.0, 2.0, ...)`, `[1.0, 2.0, ...]`, as long as most of its
//! lines do, or one of five where each has a word beside the list. Lists in calls of different names are no targets of
//! one kind. What a maker's program calls its targets stands behind their readings, where each has a name of its own. A
//! list is a row as it stands; numbers beyond the joints are those of axes that the robot does not have.

use std::collections::BTreeSet;
use std::ops::Range;

use camino::Utf8Path;

use crate::programs::{self, Joints, Language};
use crate::tables::{Fields, Form};

/// Moves from which on a program may have more lines of other commands.
const MOVES: usize = 5;

/// The targets with their lines, and the form. `None` where the text is no program.
pub fn read(path: &Utf8Path, text: &str, joints: usize) -> Option<(Vec<(u64, Fields)>, Form)> {
    let lines = text.lines().filter(|line| !line.trim().is_empty()).count();
    if let Some(language) = Language::of(path) {
        let slides = vec![false; joints];
        let found = programs::targets(language, text, Joints { slides: &slides, pulses_per_deg: &[] });
        if let Ok(targets) = found
            && !targets.is_empty()
        {
            let named = are_named(&targets);
            let row = |t: &programs::Target| {
                let name = named.then(|| t.name.clone());
                (t.line, Fields::new(t.readings.iter().map(f64::to_string).chain(name)))
            };
            let rows: Vec<(u64, Fields)> = targets.iter().map(row).collect();
            let others = lines.saturating_sub(rows.len());
            return Some((rows, Form::Program { others, degrees: true, calls: Vec::new() }));
        }
    }
    let found: Vec<(u64, &str, Fields)> =
        text.lines().zip(1..).filter_map(|(line, number)| Some((number, line, list(line, joints)?))).collect();
    let is_word = |line: &str| line.chars().any(|c| c.is_alphabetic() && !matches!(c, 'e' | 'E'));
    let words = found.iter().filter(|(_, line, _)| is_word(line)).count();
    // Lines of nothing but numbers in brackets, with a point behind the joints, are a table's.
    let whole = |line: &str, row: &Fields| row.len() >= joints + 3 || line.matches(['[', '{', '(']).count() > 1;
    let table = words == 0 && found.iter().all(|(_, line, row)| whole(line, row));
    // What a program commands between its moves holds no list, and its moves are more than what a table says of itself.
    let enough = 2 * found.len() > lines || found.len() >= MOVES && words == found.len() && 5 * found.len() > lines;
    (enough && !table).then(|| {
        let mut calls: Vec<String> = Vec::new();
        for call in found.iter().filter_map(|(_, line, _)| call(line, joints)) {
            if !calls.iter().any(|seen| seen == call) {
                calls.push(call.to_owned());
            }
        }
        let rows: Vec<(u64, Fields)> = found.into_iter().map(|(line, _, row)| (line, row)).collect();
        let others = lines - rows.len();
        (rows, Form::Program { others, degrees: false, calls })
    })
}

/// Whether each target has a name that no other has: a number in a list of positions, and a line, are none.
fn are_named(targets: &[programs::Target]) -> bool {
    let is_word =
        |name: &str| name.starts_with(char::is_alphabetic) && name.chars().all(|c| c.is_alphanumeric() || c == '_');
    let names: BTreeSet<&str> = targets.iter().map(|t| t.name.as_str()).filter(|name| is_word(name)).collect();
    names.len() == targets.len()
}

/// The word of the call that a list of numbers stands in.
fn call(line: &str, joints: usize) -> Option<&str> {
    let list = place(line, joints)?.start;
    let mut open = Vec::new();
    for (at, c) in line[..list + 1].char_indices() {
        match c {
            '(' => open.push(at),
            ')' => drop(open.pop()),
            _ => {}
        }
    }
    let before = line[..*open.first()?].trim_end();
    let part = |c: char| c.is_alphanumeric() || c == '_';
    Some(&before[before.trim_end_matches(part).len()..]).filter(|word| word.starts_with(|c: char| c.is_alphabetic()))
}

/// The first list in brackets with nothing but numbers in it, as many as joints at the least.
fn list(line: &str, joints: usize) -> Option<Fields> {
    // A list in quotes is a cell of a table.
    let place = place(line, joints).filter(|at| at.start == 0 || !line[..at.start].ends_with('"'));
    place.map(|at| Fields::new(line[at.start + 1..at.end].split(',').map(str::trim)))
}

/// Where it stands, from its bracket on.
fn place(line: &str, joints: usize) -> Option<Range<usize>> {
    line.match_indices(['{', '[', '(']).find_map(|(at, _)| {
        let end = at + 1 + line[at + 1..].find(['{', '[', '(', '}', ']', ')'])?;
        let mut numbers = line[at + 1..end].split(',').map(|n| n.trim().parse::<f64>().is_ok());
        (numbers.clone().count() >= joints && numbers.all(|is| is)).then_some(at..end)
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
        let moves: String = (0..5).map(|k| format!("MoveJoints(1, 2, {k})\nDelay(1)\nGetPose()\n")).collect();
        assert_eq!(rows("a.txt", &moves, 3).unwrap()[4], ["1", "2", "4"]);
        // A table says of itself where its tool is.
        let table: String = (0..9).map(|k| format!("1,2,{k},4,5,6\n")).collect();
        assert_eq!(rows("a.csv", &format!("# tool [1,2,3]\n{table}"), 3), None);
        assert_eq!(rows("a.csv", &"\"[1, 2, 3]\",\"[4, 5, 6]\"\n".repeat(6), 3), None);
    }

    #[test]
    fn a_makers_program_is_read_in_its_language() {
        let text = "MODULE m\nCONST jointtarget p1 := [[1,2,3,4,5,6],[9E9,9E9,9E9,9E9,9E9,9E9]];\nENDMODULE\n";
        assert_eq!(rows("a.mod", text, 6).unwrap(), [["1", "2", "3", "4", "5", "6", "p1"]]);
        // A target without a name, and a name that stands twice.
        let bare = "MODULE m\nMoveAbsJ [[1,2,3,4,5,6],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0;\nENDMODULE\n";
        assert_eq!(rows("a.mod", bare, 6).unwrap(), [["1", "2", "3", "4", "5", "6"]]);
        let twice = text.replace("ENDMODULE", &text["MODULE m\n".len()..]);
        let twice = rows("a.mod", &twice, 6).unwrap();
        assert!(twice.len() == 2 && twice.iter().all(|row| row.len() == 6), "{twice:?}");
    }
}
