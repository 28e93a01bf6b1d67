//! ABB's language: `jointtarget` values, `[[six robot axes],[external axes]]`, deg.

use std::fmt::Write as _;

use super::scan;
use super::{Motion, Target, Written};

/// Robot axes of a jointtarget; more are external ones.
const AXES: usize = 6;

/// Values of joint targets: two lists of which the first has a robot's axes. Poses begin with three numbers.
pub(super) fn targets(text: &str, count: usize) -> Vec<Target> {
    let first = count.min(AXES);
    let value = |at: usize| {
        let inner = scan::word(text, at + 1, "[")?;
        let (mut numbers, end) = scan::list(text, inner, AXES + 1);
        // Axes that the arm lacks are written as zero.
        if scan::in_comment(text, at, "!") || !(numbers.len() == first || numbers.len() == AXES) {
            return None;
        }
        let end = scan::word(text, end, "]")?;
        numbers.truncate(first);
        if count > AXES {
            let external = scan::word(text, end, ",").and_then(|at| scan::word(text, at, "["))?;
            numbers.extend(scan::list(text, external, count - AXES).0);
        }
        let before = text[..at].trim_end();
        let name = before.strip_suffix(":=").and_then(|b| b.split_whitespace().last()).map(str::to_owned);
        scan::target(text, name, numbers).filter(|t| t.readings.len() == count)
    };
    text.match_indices('[').filter_map(|(at, _)| value(at)).collect()
}

fn jointtarget(list: &[String]) -> String {
    let filled = |axes: &[String], empty: &str| -> Vec<String> {
        (0..AXES).map(|k| axes.get(k).cloned().unwrap_or_else(|| empty.to_owned())).collect()
    };
    let (robot, external) = list.split_at(list.len().min(AXES));
    format!("[[{}],[{}]]", filled(robot, "0").join(","), filled(external, "9E9").join(","))
}

pub(super) fn program(name: &str, stops: &[Written], motion: &Motion) -> Vec<(String, String)> {
    let mut text = format!(
        "MODULE {name}\n  ! Signal doTrigger triggers the cameras; the log holds name and joints, deg.\n  VAR iodev log;\n  \
         PROC note(string stop)\n    VAR jointtarget now;\n    now := CJointT();\n    \
         Write log, stop + \" \" + ValToStr(now);\n  ENDPROC\n  PROC main()\n    \
         Open \"HOME:\" \\File:=\"{name}.log\", log \\Write;\n    VelSet {:.0}, 5000;\n",
        motion.speed_percent
    );
    for stop in stops {
        for list in [&stop.approach, &stop.readings] {
            let _ = writeln!(text, "    MoveAbsJ {}\\NoEOffs, v1000, fine, tool0;", jointtarget(list));
        }
        let _ = writeln!(text, "    WaitTime {:.2};\n    PulseDO \\PLength:=0.1, doTrigger;", motion.dwell_s);
        let _ = writeln!(text, "    note \"{}\";", stop.name);
    }
    text.push_str("    Close log;\n  ENDPROC\nENDMODULE\n");
    vec![(format!("{name}.mod"), text)]
}
