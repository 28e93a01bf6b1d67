//! Yaskawa's job: positions `C00000=..` in pulses or angles, by the `///POSTYPE` before them.

use std::fmt::Write as _;

use super::instruction::{Cause, Instruction};
use super::language::{Motion, Target, Written};
use super::scan;

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
    let (numbers, _) = scan::list(text, at + name.len() + 1, count);
    scan::target(text, Some(name.trim().to_owned()), numbers, None).filter(|t| t.readings.len() == count)
}

/// Every instruction that moves, behind `//INST`.
pub(super) fn motions(text: &str, targets: &[Target]) -> Vec<Instruction> {
    let mut at = text.find("//INST").unwrap_or(0);
    let (mut shifted, mut found) = (false, Vec::new());
    for line in text[at..].split_inclusive('\n') {
        let start = at + line.len() - line.trim_start().len();
        at += line.len();
        let end = at;
        let mut tokens = line.split_whitespace();
        let Some(word) = tokens.next() else { continue };
        match word.to_ascii_uppercase().as_str() {
            "SFTON" => shifted = true,
            "SFTOF" => shifted = false,
            _ => {}
        }
        if !moves(word) {
            continue;
        }
        let Some(point) = tokens.next() else { continue };
        let place = scan::trimmed(text, start + word.len()..end).start;
        let added = shifted || word.to_ascii_uppercase().contains("IMOV") || tokens.any(|t| t.starts_with("+P"));
        let moves_by = if added { Err(Cause::Offset) } else { held(text, point, targets) };
        found.push(Instruction::new(text, start..start + word.len(), place..place + point.len(), moves_by));
    }
    found
}

/// `MOVJ`, `MOVL`, `MOVC`, `MOVS`, `IMOV`, of several robots with `S`, `+` or `E` before it. A remark begins with an apostrophe.
fn moves(word: &str) -> bool {
    let word = word.trim_start_matches('+').to_ascii_uppercase();
    let stem = word.strip_suffix(['J', 'L', 'C', 'S']).unwrap_or(&word);
    ["MOV", "IMOV", "SMOV", "EIMOV", "EMOV", "AMOV"].contains(&stem)
}

/// The joint target of a position, or why there is none.
fn held(text: &str, point: &str, targets: &[Target]) -> Result<Vec<usize>, Cause> {
    let number = key(point).ok_or(Cause::Elsewhere)?;
    if let Some(k) = targets.iter().position(|t| key(&t.name) == Some(number)) {
        return Ok(vec![k]);
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
