//! Fanuc's listing: positions `J1= .. deg` behind `/POS`.

use std::fmt::Write as _;

use super::scan;
use super::{Motion, Target, Written};

/// Names of the axes: those of the robot, then extended ones.
fn axes(count: usize) -> Vec<String> {
    (0..count).map(|k| if k < 6 { format!("J{}", k + 1) } else { format!("E{}", k - 5) }).collect()
}

/// Positions in joint coordinates, by their number.
pub(super) fn targets(text: &str, count: usize) -> Vec<Target> {
    let names = axes(count);
    let position = |at: usize| {
        let (numbers, _) = scan::labelled(text, at, &names, &["deg", "mm", ","])?;
        let before = &text[..at];
        let open = before.rfind("P[")?;
        let name = before[open..].split_inclusive(']').next().map(str::to_owned);
        scan::target(text, name, numbers)
    };
    let word_starts = |at: &usize| text[..*at].ends_with(|c: char| !c.is_ascii_alphanumeric());
    text.match_indices("J1").map(|(at, _)| at).filter(word_starts).filter_map(position).collect()
}

pub(super) fn program(name: &str, stops: &[Written], motion: &Motion) -> Vec<(String, String)> {
    let name = name.to_ascii_uppercase();
    let mut lines = vec!["!DO[1] triggers the cameras ;".to_owned(), "!PR[n] holds stop n's joints ;".to_owned()];
    let mut positions = String::new();
    for (k, stop) in stops.iter().enumerate() {
        lines.push(format!("!{} ;", stop.name));
        for (side, list) in [&stop.approach, &stop.readings].into_iter().enumerate() {
            let number = 2 * k + side + 1;
            lines.push(format!("J P[{number}] {:.0}% FINE ;", motion.speed_percent));
            let parts: Vec<String> = axes(list.len()).iter().zip(list).map(|(n, v)| format!("{n}= {v} deg")).collect();
            let _ = writeln!(positions, "P[{number}]{{\n   GP1:\n  UF : 0, UT : 1,\n  {}\n}};", parts.join(", "));
        }
        lines.push(format!("WAIT {:.2}(sec) ;", motion.dwell_s));
        lines.push("DO[1]=PULSE,0.1sec ;".to_owned());
        lines.push(format!("PR[{}]=JPOS ;", k + 1));
    }
    let mut text = format!("/PROG  {name}\n/ATTR\nDEFAULT_GROUP = 1,*,*,*,*;\n/MN\n");
    for (k, line) in lines.iter().enumerate() {
        let _ = writeln!(text, "{:4}:{line}", k + 1);
    }
    let _ = write!(text, "/POS\n{positions}/END\n");
    vec![(format!("{name}.ls"), text)]
}
