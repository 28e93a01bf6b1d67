//! KUKA's language: `{A1 .., A2 .., ..}`, deg.

use std::fmt::Write as _;

use super::scan;
use super::{Motion, Target, Written};

/// Names of the axes: those of the robot, then external ones.
fn axes(count: usize) -> Vec<String> {
    (0..count).map(|k| if k < 6 { format!("A{}", k + 1) } else { format!("E{}", k - 5) }).collect()
}

/// Aggregates of all axes, with or without their type before them.
pub(super) fn targets(text: &str, count: usize) -> Vec<Target> {
    let names = axes(count);
    let aggregate = |at: usize| {
        if scan::in_comment(text, at, ";") {
            return None;
        }
        let typed = ["E6AXIS", "AXIS"].iter().find_map(|t| scan::word(text, at + 1, t));
        let from = typed.and_then(|end| scan::word(text, end, ":")).unwrap_or(at + 1);
        let (numbers, _) = scan::labelled(text, from, &names, &[","])?;
        let before = text[..at].trim_end();
        let name = before.strip_suffix('=').and_then(|b| b.split_whitespace().last()).map(str::to_owned);
        scan::target(text, name, numbers)
    };
    text.match_indices('{').filter_map(|(at, _)| aggregate(at)).collect()
}

pub(super) fn program(name: &str, stops: &[Written], motion: &Motion) -> Vec<(String, String)> {
    let aggregate = |list: &[String]| {
        let parts: Vec<String> = axes(list.len()).iter().zip(list).map(|(n, v)| format!("{n} {v}")).collect();
        format!("{{{}}}", parts.join(","))
    };
    let mut text = format!(
        "DEF {name}()\n; output 1 triggers the cameras; the array seen in {name}.dat holds the joints of each stop, deg\n\
         BAS(#INITMOV,0)\nBAS(#VEL_PTP,{:.0})\n",
        motion.speed_percent
    );
    for (k, stop) in stops.iter().enumerate() {
        let _ = writeln!(text, "; {}", stop.name);
        for list in [&stop.approach, &stop.readings] {
            let _ = writeln!(text, "PTP {}", aggregate(list));
        }
        let _ = writeln!(text, "WAIT SEC {:.2}\nPULSE($OUT[1],TRUE,0.1)\nSEEN[{}]=$AXIS_ACT", motion.dwell_s, k + 1);
    }
    text.push_str("END\n");
    let data = format!("DEFDAT {name}\nDECL E6AXIS SEEN[{}]\nENDDAT\n", stops.len().max(1));
    vec![(format!("{name}.src"), text), (format!("{name}.dat"), data)]
}
