//! Universal Robots' language: lists of angles in rad.
//!
//! In: the text of a script. Out: its lists of joint angles, and its calls that move; among them those of functions of
//! other files that get joint angles which no motion of this one has. What goes wrong: angles that are computed at run
//! time.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::ops::Range;

use crate::programs::handed;
use crate::programs::instruction::{Cause, Instruction};
use crate::programs::language::{Motion, Target, Written};
use crate::programs::scan::{self, Number};
use crate::programs::variables::{Syntax, Variables};

/// Calls that move to their first arguments, lists of joint angles or poses, and how many of these they have.
const MOVES: [(&str, usize); 7] =
    [("movej", 1), ("movel", 1), ("movep", 1), ("movec", 2), ("servoj", 1), ("optimovej", 1), ("optimovel", 1)];
/// Calls that move by a speed, a force or a path that is set elsewhere, or follow poses.
const LED: &str = "servoc servol speedj speedl force_mode freedrive_mode teach_mode path_offset_set screw_driving \
    track_conveyor_linear track_conveyor_circular freedrive_mode_no_incorrect_payload_check path_offset_enable \
    torque_command direct_torque jog_start";
/// Calls of a path that is put together elsewhere, and of its parts, which are poses.
const PATHS: [(&str, Cause); 5] = [
    ("mc_add_linear", Cause::Cartesian),
    ("mc_add_circular", Cause::Cartesian),
    ("mc_add_path", Cause::Elsewhere),
    ("mc_load_path", Cause::Elsewhere),
    ("mc_run_motion", Cause::Elsewhere),
];
/// Functions of the language that take lists of a joint's numbers, and move nothing; and words that are no calls.
const STILL: &str = "if elif while and or not xor return struct get_forward_kin get_inverse_kin_has_solution get_inverse_kin_qnear \
    is_within_safety_limits get_jacobian get_jacobian_time_derivative get_mass_matrix get_coriolis_and_centrifugal_torques \
    norm normalize length size get_list_length textmsg popup assert str_cat to_str to_num dot cross transpose inv wrench_trans \
    tool_contact set_target_payload set_payload force_mode_set_damping floor ceil sqrt socket_send_string socket_send_line \
    socket_send_int socket_set_var rtde_set_watchdog write_output_float_register";
/// What the names of functions that move have in them.
const MOVE: &str = "move";
/// Functions whose value is a pose, or joint angles that belong to one.
const POSES: &str = "p[ get_inverse_kin get_actual_tcp_pose get_target_tcp_pose get_forward_kin pose_trans pose_add pose_sub \
    pose_inv interpolate_pose";

const SYNTAX: Syntax = Syntax {
    assign: "=",
    end: '\n',
    any_case: false,
    routines: &["def", "thread"],
    // Every call gets values.
    calls: None,
    cartesian: |value| POSES.split(' ').any(|pose| value.starts_with(pose)),
};

/// The function that makes radians of degrees.
const DEGREES: &str = "d2r";

/// Full speed of a joint, rad/s.
const FULL_SPEED: f64 = std::f64::consts::PI;

/// Lists of angles that a call of a motion takes, or that stand alone or in a list behind a variable's name.
pub(super) fn targets(text: &str, count: usize) -> Vec<Target> {
    let text = &scan::code(text, "#");
    let list = |at: usize| {
        let before = text[..at].trim_end();
        if !before.ends_with(['(', '=', ',', '[']) {
            return None;
        }
        let (numbers, end) = scan::list(text, at + 1, count + 1, angle);
        scan::word(text, end, "]").filter(|_| numbers.len() == count)?;
        let assigned = before.strip_suffix('=');
        let name = assigned.map(|before| before.split_whitespace().last().unwrap_or_default().to_owned());
        scan::target(text, name, numbers, Some(at))
    };
    text.match_indices('[').filter_map(|(at, _)| list(at)).collect()
}

/// A number in rad, or of degrees as `d2r(90)`; the place is then all of that.
fn angle(text: &str, at: usize) -> Option<Number> {
    let of_degrees = || {
        let open = scan::word(text, scan::word(text, at, DEGREES)?, "(")?;
        let (degrees, place) = scan::number(text, open)?;
        let place = scan::trimmed(text, at..scan::word(text, place.end, ")")?);
        Some((degrees.to_radians(), place))
    };
    scan::number(text, at).or_else(of_degrees)
}

/// A reading as it is written in place of `before`.
pub(super) fn written(before: &str, number: String, value: f64) -> String {
    if before.starts_with(DEGREES) { format!("{DEGREES}({:.7})", value.to_degrees()) } else { number }
}

/// Every call that moves.
pub(super) fn motions(text: &str, targets: &[Target]) -> Vec<Instruction> {
    let code = scan::code(text, "#");
    let variables = Variables::read(&code, SYNTAX, targets);
    let (mut found, mut calls) = (Vec::new(), Vec::new());
    let mut last = "";
    for word in scan::words(&code) {
        let name = &code[word.clone()];
        let before = std::mem::replace(&mut last, name);
        let Some(open) = scan::word(&code, word.end, "(").filter(|_| !SYNTAX.routines.contains(&before)) else {
            continue;
        };
        let end = scan::closed(&code, open - 1).map_or(code.len(), |end| end - 1);
        let arguments = scan::parts(&code, open..end);
        let led = LED.split(' ').any(|led| led == name).then_some(Cause::Led);
        let path = || PATHS.iter().find(|(path, _)| *path == name).map(|(_, cause)| cause.clone());
        if let Some(cause) = led.or_else(path) {
            found.push(Instruction::new(text, word, open..open, Err(cause)));
            continue;
        }
        let Some((_, count)) = MOVES.iter().find(|(move_, _)| *move_ == name) else {
            calls.push((word, arguments));
            continue;
        };
        let held = |at: &std::ops::Range<usize>| variables.expression(&code, unnamed(&code, at.clone()), targets);
        let moves_by =
            arguments.iter().take(*count).map(held).collect::<Result<Vec<_>, Cause>>().map(|all| all.concat());
        let shown = arguments[0].start..arguments[arguments.len().min(*count) - 1].end;
        found.push(Instruction::new(text, word, shown, moves_by));
    }
    let corrected: BTreeSet<usize> = found.iter().flat_map(|m| m.moves_by.iter().flatten().copied()).collect();
    let headers = handed::headers(&code, SYNTAX.routines);
    let own: BTreeSet<&str> = headers.iter().map(|(_, name)| &code[name.clone()]).collect();
    let moves = |(word, arguments): &(Range<usize>, Vec<Range<usize>>)| {
        let name = &code[word.clone()];
        let is_known = own.contains(name) || [STILL, POSES, DEGREES].iter().any(|known| handed::of(known, name));
        let given = |at: &Range<usize>| match variables.expression(&code, unnamed(&code, at.clone()), targets) {
            Ok(held) => held.iter().any(|k| !corrected.contains(k)),
            Err(cause) => cause == Cause::Cartesian && name.to_ascii_lowercase().contains(MOVE),
        };
        !is_known && scan::is_name(name) && !code[..word.start].ends_with('.') && arguments.iter().any(given)
    };
    for (word, arguments) in calls.into_iter().filter(moves) {
        found.push(Instruction::new(text, word, arguments[0].clone(), Err(Cause::Unknown)));
    }
    found.sort_by_key(|motion| motion.at);
    found
}

/// An argument without the name before it, as in `movej(q=[...])`.
fn unnamed(code: &str, at: std::ops::Range<usize>) -> std::ops::Range<usize> {
    let text = &code[at.clone()];
    let named = text.find('=').filter(|&k| text[..k].trim().chars().all(|c| c.is_alphanumeric() || c == '_'));
    match named {
        Some(k) if !text[k + 1..].starts_with('=') => scan::trimmed(code, at.start + k + 1..at.end),
        _ => at,
    }
}

pub(super) fn program(name: &str, stops: &[Written], motion: &Motion, _: bool) -> Vec<(String, String)> {
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
