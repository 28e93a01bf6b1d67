//! Universal Robots' language: lists of angles in rad.

use std::fmt::Write as _;

use super::scan;
use super::{Motion, Target, Written};

/// Calls whose first argument is a list of joint angles.
const MOVES: [&str; 4] = ["movej(", "movel(", "movep(", "servoj("];

/// Full speed of a joint, rad/s.
const FULL_SPEED: f64 = std::f64::consts::PI;

/// Lists of angles that a move takes, or that a variable with a name ending in `q` holds, as PolyScope writes them.
pub(super) fn targets(text: &str, count: usize) -> Vec<Target> {
    let list = |at: usize| {
        let before = text[..at].trim_end();
        let moved = MOVES.iter().any(|m| before.ends_with(m));
        let kept = before.strip_suffix('=').map(str::trim_end).is_some_and(|name| name.ends_with('q'));
        if !(moved || kept) || scan::in_comment(text, at, "#") {
            return None;
        }
        let (numbers, end) = scan::list(text, at + 1, count + 1);
        scan::word(text, end, "]").filter(|_| numbers.len() == count)?;
        let name = kept.then(|| before.trim_end_matches('=').split_whitespace().last().unwrap_or_default().to_owned());
        scan::target(text, name, numbers)
    };
    text.match_indices('[').filter_map(|(at, _)| list(at)).collect()
}

pub(super) fn program(name: &str, stops: &[Written], motion: &Motion) -> Vec<(String, String)> {
    let speed = FULL_SPEED * motion.speed_percent / 100.0;
    let mut text =
        format!("def {name}():\n  # digital output 0 triggers the cameras; the log shows name and joints, rad\n");
    for stop in stops {
        for list in [&stop.approach, &stop.readings] {
            let _ = writeln!(text, "  movej([{}], a={:.3}, v={speed:.3})", list.join(", "), 2.0 * speed);
        }
        let _ = writeln!(text, "  sleep({:.2})", motion.dwell_s);
        text.push_str("  set_digital_out(0, True)\n  sleep(0.1)\n  set_digital_out(0, False)\n");
        let _ = writeln!(text, "  textmsg(\"{} \", get_actual_joint_positions())", stop.name);
    }
    text.push_str("end\n");
    vec![(format!("{name}.script"), text)]
}
