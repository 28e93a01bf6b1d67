//! KUKA's language: `{A1 .., A2 .., ..}`, deg.
//!
//! In: the text of a program, with that of its data file behind it. Out: its joint targets, and its instructions that
//! move; among them calls of routines of other files that get axis values which no motion of this one has. What goes
//! wrong: points that neither file declares.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::ops::Range;

use crate::programs::handed::{self, Calls};
use crate::programs::instruction::{Cause, Instruction};
use crate::programs::language::{Motion, Target, Written};
use crate::programs::scan;
use crate::programs::variables::{Syntax, Variables};

/// Motions to axis values or poses.
const EITHER: [&str; 2] = ["PTP", "SPTP"];
/// Motions to poses.
const CARTESIAN: [&str; 5] = ["LIN", "CIRC", "SLIN", "SCIRC", "SPL"];
/// Motions from where the robot stands.
const RELATIVE: [&str; 7] = ["PTP_REL", "LIN_REL", "CIRC_REL", "SPTP_REL", "SLIN_REL", "SCIRC_REL", "SPL_REL"];
/// A motion along recorded points.
const RECORDED: &str = "MOVE_EMI";
/// What moves nothing: a motion to where the robot stands.
const HERE: [&str; 2] = ["$AXIS_ACT", "$POS_ACT"];

/// Types of points, and whether these are poses.
const TYPES: [(&str, bool); 5] = [("FRAME", true), ("POS", true), ("E6POS", true), ("AXIS", false), ("E6AXIS", false)];
/// How variables of the controller begin.
const OF_CONTROLLER: char = '$';

/// Functions that leave what they are given as it is.
const READING: &str = "BAS INV_POS FORWARD VARSTATE ABS SWRITE CWRITE EKI_SetReal EKI_SetFrame EKI_SetInt SQRT";
/// What lets a sensor lead the robot or change its path, in the packages RobotSensorInterface 2 to 4.
const LED: &str = "RSI_ON RSI_AXISCORR RSI_PATHCORR RSI_MOVECORR ST_ON ST_ON1 ST_SKIPSENS ST_MOVESENS ST_AXISCORR ST_PATHCORR ST_PATHCORR1";

const SYNTAX: Syntax = Syntax {
    assign: "=",
    end: '\n',
    any_case: true,
    routines: &["DEF", "DEFFCT"],
    calls: Some(CALLS),
    cartesian: |value| {
        let first = scan::words(value).next().map_or("", |word| &value[word]);
        value.starts_with('{')
            && ["X", "Y", "Z", "A", "B", "C", "POS", "E6POS", "FRAME"].contains(&first.to_ascii_uppercase().as_str())
    },
};

const CALLS: Calls = Calls {
    reads: |word| handed::of(READING, word),
    by_value: |parameters| {
        let mut each = parameters.trim_matches(['(', ')']).split(',').map(str::trim);
        each.all(|p| p.is_empty() || p.to_ascii_uppercase().replace(' ', "").ends_with(":IN"))
    },
    keywords: "IF WHILE UNTIL FOR SWITCH CASE RETURN AND OR NOT EXOR WHEN DO",
    declares: "DECL GLOBAL CONST",
    bare: false,
    by_name: "",
};

/// Aggregates of all axes in any order, with or without their type before them.
pub(super) fn targets(text: &str, count: usize) -> Vec<Target> {
    let names = scan::axes('A', count);
    let text = &scan::code(text, ";");
    let aggregate = |at: usize| {
        let typed = ["E6AXIS", "AXIS"].iter().find_map(|t| scan::word(text, at + 1, t));
        let from = typed.and_then(|end| scan::word(text, end, ":")).unwrap_or(at + 1);
        let parts = scan::parts(text, from..scan::closed(text, at)? - 1);
        let number = |name: &String| {
            let (part, label) = parts.iter().find_map(|part| {
                let label = scan::words(&text[part.clone()]).next().filter(|w| w.start == 0)?;
                text[part.start..part.start + label.end].eq_ignore_ascii_case(name).then_some((part, label))
            })?;
            scan::number(text, part.start + label.end).filter(|(_, place)| place.end == part.end)
        };
        let numbers = names.iter().map(number).collect::<Option<Vec<_>>>()?;
        let before = text[..at].trim_end();
        let name = before.strip_suffix('=').and_then(|b| b.split_whitespace().last()).map(str::to_owned);
        scan::target(text, name, numbers, Some(at))
    };
    text.match_indices('{').filter_map(|(at, _)| aggregate(at)).collect()
}

/// Every instruction that moves.
pub(super) fn motions(text: &str, targets: &[Target]) -> Vec<Instruction> {
    let code = scan::code(text, ";");
    let variables = Variables::read(&code, SYNTAX, targets);
    let types = types(&code);
    let (mut found, mut calls) = (Vec::new(), Vec::new());
    let mut last = "";
    for word in scan::words(&code) {
        let name = code[word.clone()].to_ascii_uppercase();
        let before = std::mem::replace(&mut last, &code[word.clone()]);
        let end = code[word.end..].find('\n').map_or(code.len(), |length| word.end + length);
        let behind = code[word.end..end].trim();
        let declared = SYNTAX.routines.iter().any(|r| r.eq_ignore_ascii_case(before));
        let of = |words: &[&str]| words.contains(&name.as_str());
        if handed::of(LED, &name) && !declared {
            found.push(Instruction::new(text, word.clone(), word.end..word.end, Err(Cause::Led)));
        }
        let moves = of(&EITHER) || of(&CARTESIAN) || of(&RELATIVE) || name == "ASYPTP" || name == RECORDED;
        if !moves && !declared && behind.starts_with('(') {
            calls.push(word.clone());
        }
        if !moves || declared || behind.is_empty() || behind.starts_with(['=', '(', ')', ',', '.', '[']) {
            continue;
        }
        let at = point(&code, word.end..end);
        if HERE.iter().any(|here| here.eq_ignore_ascii_case(&code[at.clone()])) {
            continue;
        }
        let moves_by = match () {
            () if of(&EITHER) => variables.expression(&code, at.clone(), targets).map_err(|cause| {
                if cause == Cause::Elsewhere { why(&code[at.clone()], &variables, &types) } else { cause }
            }),
            () if of(&CARTESIAN) => Err(Cause::Cartesian),
            () if of(&RELATIVE) => Err(Cause::Offset),
            () if name == RECORDED => Err(Cause::Elsewhere),
            () => Err(Cause::External),
        };
        found.push(Instruction::new(text, word, at, moves_by));
    }
    let corrected: BTreeSet<usize> = found.iter().flat_map(|m| m.moves_by.iter().flatten().copied()).collect();
    let is_left = |at: &Range<usize>| match variables.expression(&code, at.clone(), targets) {
        Ok(held) => held.iter().any(|k| !corrected.contains(k)),
        Err(_) => variable(&code[at.clone()]).is_some_and(|name| types.get(&name) == Some(&false)),
    };
    found.extend(others(&code, calls, is_left).map(|(word, at)| Instruction::new(text, word, at, Err(Cause::Unknown))));
    found.sort_by_key(|motion| motion.at);
    found
}

/// Of these calls, those of routines that this file does not hold and that get axis values which are not corrected
/// where they stand, each with its first argument of that kind.
fn others(
    code: &str,
    calls: Vec<Range<usize>>,
    is_left: impl Fn(&Range<usize>) -> bool,
) -> impl Iterator<Item = (Range<usize>, Range<usize>)> {
    let headers = handed::headers(code, SYNTAX.routines);
    let own: BTreeSet<String> = headers.iter().map(|(_, name)| code[name.clone()].to_ascii_uppercase()).collect();
    calls.into_iter().filter_map(move |word| {
        let name = &code[word.clone()];
        if handed::of(READING, name) || handed::of(CALLS.keywords, name) || own.contains(&name.to_ascii_uppercase()) {
            return None;
        }
        let open = scan::word(code, word.end, "(")?;
        let arguments = scan::parts(code, open..scan::closed(code, open - 1)? - 1);
        arguments.into_iter().find(&is_left).map(|at| (word, at))
    })
}

/// The name, in capitals, of what is a variable or an element of one, and none of the controller's.
fn variable(point: &str) -> Option<String> {
    let first = scan::words(point).next().filter(|word| word.start == 0)?;
    let (name, behind) = (&point[first.clone()], point[first.end..].trim_start());
    let own = scan::is_name(name) && !name.starts_with(OF_CONTROLLER);
    (own && (behind.is_empty() || behind.starts_with('['))).then(|| name.to_ascii_uppercase())
}

/// Why a point has no numbers here, by what declares it, or that nothing does.
fn why(point: &str, variables: &Variables, types: &BTreeMap<String, bool>) -> Cause {
    let Some(name) = variable(point) else { return Cause::Elsewhere };
    match types.get(&name) {
        Some(true) => Cause::Cartesian,
        None if !variables.knows(&name) => Cause::Undeclared,
        _ => Cause::Elsewhere,
    }
}

/// Variables of points as they are declared, in capitals, and whether they hold poses.
fn types(code: &str) -> BTreeMap<String, bool> {
    let declared = |word: Range<usize>| {
        let (_, poses) = TYPES.iter().find(|(name, _)| name.eq_ignore_ascii_case(&code[word.clone()]))?;
        let end = code[word.end..].find('\n').map_or(code.len(), |length| word.end + length);
        let names = scan::parts(code, word.end..end).into_iter().filter_map(|part| {
            let first = scan::words(&code[part.clone()]).next().filter(|w| w.start == 0)?;
            Some(code[part.start..part.start + first.end].to_ascii_uppercase())
        });
        Some(names.map(|name| (name, *poses)).collect::<Vec<_>>())
    };
    scan::words(code).filter_map(declared).flatten().collect()
}

/// The first point behind a word, without the blending and the settings behind it.
fn point(code: &str, at: Range<usize>) -> Range<usize> {
    let first = scan::parts(code, at).swap_remove(0);
    let text = &code[first.clone()];
    let settings = ["C_PTP", "C_DIS", "C_VEL", "C_ORI", "C_SPL", "WITH"];
    let stop = scan::words(text).find(|w| settings.iter().any(|s| s.eq_ignore_ascii_case(&text[w.clone()])));
    scan::trimmed(code, first.start..stop.map_or(first.end, |w| first.start + w.start))
}

pub(super) fn program(name: &str, stops: &[Written], motion: &Motion, _: bool) -> Vec<(String, String)> {
    let aggregate = |list: &[String]| {
        let parts: Vec<String> =
            scan::axes('A', list.len()).iter().zip(list).map(|(n, v)| format!("{n} {v}")).collect();
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
