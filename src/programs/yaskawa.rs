//! Yaskawa's job: positions `C00000=..` in pulses or angles, by the `///POSTYPE` before them.

use std::fmt::Write as _;

use super::scan;
use super::{Motion, Target, Written};

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
    scan::target(text, Some(name.trim().to_owned()), numbers).filter(|t| t.readings.len() == count)
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
