//! Yaskawa's job: positions `C00000=..` in pulses or angles, by the `///POSTYPE` before them.

use std::fmt::Write as _;
use std::ops::Range;

use crate::programs::instruction::{Cause, Instruction};
use crate::programs::language::{Motion, Target, Written};
use crate::programs::scan;

/// The most axes of a robot or of a position.
const MOST_AXES: usize = 16;
/// Positions of a station, a base or external axes.
const EXTERNAL: [&str; 6] = ["EC", "BC", "EX", "BP", "LEX", "LBP"];
/// Instructions that read positions alone.
const READING: [&str; 7] = ["SFTON", "MFRAME", "SAVEV", "GETE", "CALL", "JUMP", "COMM"];
/// Instructions that write into the first of their arguments and read the others.
const WRITING_FIRST: [&str; 12] =
    ["SET", "SETE", "ADD", "SUB", "MUL", "DIV", "GETS", "CNVRT", "CONVSFT", "GETPOS", "LOADV", "MULMAT"];

/// Positions in pulses or angles; Cartesian ones are left out.
pub(super) fn targets(text: &str, count: usize) -> Vec<Target> {
    let (mut at, mut kind, mut found) = (0, String::new(), Vec::new());
    for line in text.split_inclusive('\n') {
        if let Some(word) = line.trim().strip_prefix("///POSTYPE") {
            kind = word.trim().to_owned();
        } else if let Some(target) = position(text, at, line, count).filter(|_| kind == "PULSE" || kind == "ANGLE") {
            found.push(Target { pulses: kind == "PULSE", ..target });
        }
        at += line.len();
    }
    found
}

fn position(text: &str, at: usize, line: &str, count: usize) -> Option<Target> {
    let (name, _) = line.split_once('=')?;
    let number = name.trim().strip_prefix(['C', 'P'])?;
    if number.is_empty() || !number.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    let (mut numbers, _) = scan::list(text, at + name.len() + 1, MOST_AXES, scan::number);
    // Axes that the arm lacks are written as zero.
    if numbers.iter().skip(count).any(|(value, _)| *value != 0.0) {
        return None;
    }
    numbers.truncate(count);
    scan::target(text, Some(name.trim().to_owned()), numbers, None).filter(|t| t.readings.len() == count)
}

/// Every instruction that moves, behind `//INST`.
pub(super) fn motions(text: &str, targets: &[Target]) -> Vec<Instruction> {
    let first = text.find("//INST").unwrap_or(0);
    let (mut at, mut shifted, mut found) = (first, false, Vec::new());
    let written = written(&text[first..]);
    for line in text[at..].split_inclusive('\n') {
        let tokens: Vec<Range<usize>> = tokens(line).map(|token| at + token.start..at + token.end).collect();
        at += line.len();
        let Some(word) = tokens.first().cloned() else { continue };
        match text[word.clone()].to_ascii_uppercase().as_str() {
            "SFTON" => shifted = true,
            "SFTOF" => shifted = false,
            _ => {}
        }
        let (Some(moves), Some(point)) = (kind(&text[word.clone()]), tokens.get(1).cloned()) else { continue };
        let added = shifted || tokens[2..].iter().any(|token| text[token.clone()].starts_with("+P"));
        let moves_by = match moves {
            Err(cause) => Err(cause),
            Ok(()) if added => Err(Cause::Offset),
            Ok(()) => held(text, &text[point.clone()], targets, &written),
        };
        found.push(Instruction::new(text, word, point, moves_by));
        // A second robot's motion stands behind the first one's; what a station does is none of a robot.
        for pair in tokens[2..].windows(2).filter(|pair| text[pair[0].clone()].starts_with('+')) {
            let (word, point) = (pair[0].clone(), pair[1].clone());
            let station = is_external(&text[point.clone()]);
            if let Some(moves_by @ Err(_)) = kind(&text[word.clone()]).filter(|_| !station) {
                found.push(Instruction::new(text, word, point, moves_by.map(|()| Vec::new())));
            }
        }
    }
    found
}

/// Places of what stands between blanks.
fn tokens(line: &str) -> impl Iterator<Item = Range<usize>> + '_ {
    scan::runs(line, |c| !c.is_ascii_whitespace())
}

/// Whether an instruction moves, to its target or otherwise: `MOVJ`, `MOVL`, `MOVC`, `MOVS`, `SMOVL`, `IMOV`, ... A
/// remark begins with an apostrophe, a label with an asterisk.
fn kind(word: &str) -> Option<Result<(), Cause>> {
    let word = word.to_ascii_uppercase();
    let stem = word.strip_suffix(['J', 'L', 'C', 'S']).unwrap_or(&word);
    Some(match stem {
        _ if !word.contains("MOV") || !word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '+') => return None,
        _ if word.starts_with('+') => Err(Cause::Group),
        "MOV" | "SMOV" | "AMOV" | "EMOV" => Ok(()),
        _ if stem.ends_with("IMOV") => Err(Cause::Offset),
        // A conveyor's.
        "SYMOV" => Err(Cause::Led),
        _ => Err(Cause::Unknown),
    })
}

/// Whether a position is one of a station, a base or external axes.
fn is_external(point: &str) -> bool {
    let numbered = |rest: &str| rest.starts_with(|c: char| c.is_ascii_digit() || c == '[');
    EXTERNAL.iter().any(|head| point.strip_prefix(head).is_some_and(numbered))
}

/// The joint target of a position, or why there is none.
fn held(text: &str, point: &str, targets: &[Target], written: &[Option<(char, u64)>]) -> Result<Vec<usize>, Cause> {
    if is_external(point) {
        return Err(Cause::External);
    }
    let number = key(point).ok_or(Cause::Elsewhere)?;
    if let Some(k) = targets.iter().position(|t| key(&t.name) == Some(number)) {
        let overwritten = written.iter().any(|w| w.is_none_or(|w| w == number));
        return if overwritten { Err(Cause::Elsewhere) } else { Ok(vec![k]) };
    }
    let mut kind = "";
    for line in text.lines() {
        if let Some(word) = line.trim().strip_prefix("///POSTYPE") {
            kind = word.trim();
        } else if line.split_once('=').is_some_and(|(name, _)| key(name.trim()) == Some(number)) {
            return Err(if ["PULSE", "ANGLE"].contains(&kind) { Cause::Incomplete } else { Cause::Cartesian });
        }
    }
    Err(Cause::Elsewhere)
}

/// Positions that instructions write into; `None` for one whose number is computed. Of an instruction that is not known
/// all its positions may be.
fn written(text: &str) -> Vec<Option<(char, u64)>> {
    let of_line = |line: &str| {
        let all: Vec<&str> = tokens(line).map(|token| &line[token]).collect();
        let word = all.first().map_or("", |word| *word);
        let instruction = word.starts_with(|c: char| c.is_ascii_alphabetic());
        let count = match () {
            () if !instruction || READING.contains(&word) || kind(word).is_some() => 0,
            () if WRITING_FIRST.contains(&word) => 1,
            () => all.len(),
        };
        let position = |token: &&str| {
            let name = token.trim_start_matches(|c: char| !c.is_ascii_alphanumeric());
            let number = name.strip_prefix("PX").or(name.strip_prefix('P'))?;
            match number.parse() {
                Ok(number) => Some(Some(('P', number))),
                Err(_) => number.starts_with('[').then_some(None),
            }
        };
        all.into_iter().skip(1).take(count).filter_map(|token| position(&token)).collect::<Vec<_>>()
    };
    text.lines().flat_map(of_line).collect()
}

/// Letter and number of a position.
fn key(name: &str) -> Option<(char, u64)> {
    let letter = name.chars().next().filter(|c| matches!(c, 'C' | 'P'))?;
    name[1..].parse().ok().map(|number| (letter, number))
}

pub(super) fn program(name: &str, stops: &[Written], motion: &Motion, pulses: bool) -> Vec<(String, String)> {
    let name = name.to_ascii_uppercase();
    let word = if pulses { "PULSE" } else { "ANGLE" };
    let mut text = format!(
        "/JOB\n//NAME {name}\n//POS\n///NPOS {},0,0,0,0,0\n///TOOL 0\n///POSTYPE {word}\n///{word}\n",
        2 * stops.len()
    );
    let mut moves = String::from("NOP\n'OUTPUT 1 TRIGGERS THE CAMERAS\n'PX(N) HOLDS THE JOINTS\n");
    for (k, stop) in stops.iter().enumerate() {
        for (side, list) in [&stop.approach, &stop.readings].into_iter().enumerate() {
            let number = 2 * k + side;
            let _ = writeln!(text, "C{number:05}={}", list.join(","));
            let _ = writeln!(moves, "MOVJ C{number:05} VJ={:.2}", motion.speed_percent);
        }
        let _ = writeln!(moves, "'{}\nTIMER T={:.2}\nPULSE OT#(1) T=0.10", stop.name, motion.dwell_s);
        let _ = writeln!(moves, "GETS PX{k:03} $PX000");
    }
    text.push_str("//INST\n///DATE 2000/01/01 00:00\n///ATTR SC,RW\n///GROUP1 RB1\n");
    vec![(format!("{name}.jbi"), text + &moves + "END\n")]
}
