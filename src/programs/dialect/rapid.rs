//! ABB's language: `jointtarget` values, `[[six robot axes],[external axes]]`, deg.
//!
//! In: the text of a module. Out: its joint targets, and its instructions that move; among them calls of routines that
//! stand in other modules and get a target that no motion of this one has. What goes wrong: a motion without its end.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::ops::Range;

use crate::programs::handed::{self, Calls};
use crate::programs::instruction::{Cause, Instruction};
use crate::programs::language::{Motion, Target, Written};
use crate::programs::scan;
use crate::programs::variables::{Syntax, Variables};

/// Robot axes of a jointtarget; more are external ones.
const AXES: usize = 6;

/// How the words of instructions that move to poses of the tool begin; they have a point, a speed, a zone and a tool at
/// the least.
const CARTESIAN: [&str; 25] = [
    "MoveJ", "MoveL", "MoveC", "TriggJ", "TriggL", "TriggC", "SearchL", "SearchC", "ArcL", "ArcC", "ArcJ", "SpotL",
    "SpotJ", "SpotML", "SpotMJ", "DispL", "DispC", "PaintL", "PaintC", "NutL", "NutJ", "ContactL", "ArcMoveL",
    "ArcMoveC", "ArcMoveJ",
];
/// Those that move to joint targets.
const JOINT: &str = "MoveAbsJ MoveAbsJAO MoveAbsJDO MoveAbsJGO MoveAbsJSync TriggAbsJ ArcMoveAbsJ";
/// How routines begin that are called after them.
const LIKE_JOINT: [&str; 2] = ["MoveAbsJ", "TriggAbsJ"];
/// Those that move external axes alone.
const EXTERNAL: [&str; 7] = ["MoveExtJ", "ArcMoveExtJ", "SearchExtJ", "IndAMove", "IndCMove", "IndDMove", "IndRMove"];
/// Those that follow a sensor or a force.
const LED: [&str; 9] = ["EGMRun", "EGMMove", "FCPress", "FCAct", "FCRef", "CapL", "CapC", "SoftAct", "CSSAct"];
/// Those that move along a path of their own: to find a tool or a load, or back along what was recorded.
const ALONE: &str =
    "BEUpdateTcp BECheckTcp BERefPointer BESetupToolJ PathRecMoveBwd PathRecMoveFwd StepBwdPath ManLoadIdProc LoadId";
/// Routines that a name does not tell from motions begin so.
const MOVE: &str = "Move";

/// Instructions and functions that leave what they are given as it is.
const READING: &str = "MoveExtJ IndAMove IndCMove IndDMove IndRMove TPWrite TPShow Write WriteAnyBin WriteStrBin PackRawBytes ErrWrite \
    ErrLog SocketSend RMQSendMessage RMQSendWait IPers WaitUntil CalcRobT ValToStr NumToStr Abs Round Trunc Dim \
    IsPers IsVar WZHomeJointDef WZLimJointDef PDispOn EOffsOn MToolTCPCalib MToolRotCalib SToolTCPCalib SToolRotCalib";
/// Instructions that may write into what they are given, and move nothing.
const WRITING: &str = "Incr Decr Add Clear UnpackRawBytes ReadAnyBin ReadVar RMQGetMsgData RMQGetMessage RMQReadWait GetDataVal SetDataVal \
    SocketReceive";
/// Types of targets.
const TYPES: [&str; 2] = ["jointtarget", "robtarget"];
/// Functions whose value is a target.
const TARGETS: &str = "Offs RelTool CRobT CJointT CalcRobT CalcJointT ORobT MirPos";
/// What declares data.
const DECLARES: &str = "VAR PERS CONST LOCAL TASK";
/// Words that are no calls.
const KEYWORDS: &str = "IF THEN ELSEIF ELSE ENDIF WHILE DO ENDWHILE FOR FROM TO STEP ENDFOR TEST CASE DEFAULT ENDTEST RETURN RAISE GOTO \
    CONNECT WITH AND OR NOT XOR DIV MOD PROC ENDPROC FUNC ENDFUNC TRAP ENDTRAP MODULE ENDMODULE ERROR UNDO BACKWARD \
    RECORD ENDRECORD VAR PERS CONST LOCAL TASK EXIT RETRY";

const SYNTAX: Syntax = Syntax {
    assign: ":=",
    end: ';',
    any_case: true,
    routines: &["PROC", "FUNC", "TRAP"],
    calls: Some(Calls {
        reads: |word| handed::of(JOINT, word) || handed::of(READING, word),
        by_value: |parameters| !scan::words(parameters).any(|word| handed::of("INOUT VAR PERS REF", &parameters[word])),
        keywords: KEYWORDS,
        declares: DECLARES,
        bare: true,
        by_name: "SetDataVal SetAllDataVal",
    }),
    // A pose begins with three numbers, and no joint target does.
    cartesian: |_| false,
};

/// Values of joint targets: two lists of which the first has a robot's axes. Poses begin with three numbers.
pub(super) fn targets(text: &str, count: usize) -> Vec<Target> {
    let first = count.min(AXES);
    let text = &scan::code(text, "!");
    let value = |at: usize| {
        let inner = scan::word(text, at + 1, "[")?;
        let (mut numbers, end) = scan::list(text, inner, AXES + 1, scan::number);
        // Axes that the arm lacks are written as zero.
        if !(numbers.len() == first || numbers.len() == AXES) {
            return None;
        }
        let end = scan::word(text, end, "]")?;
        numbers.truncate(first);
        if count > AXES {
            let external = scan::word(text, end, ",").and_then(|at| scan::word(text, at, "["))?;
            numbers.extend(scan::list(text, external, count - AXES, scan::number).0);
        }
        let before = text[..at].trim_end();
        let name = before.strip_suffix(":=").and_then(|b| b.split_whitespace().last()).map(str::to_owned);
        scan::target(text, name, numbers, Some(at)).filter(|t| t.readings.len() == count)
    };
    text.match_indices('[').filter_map(|(at, _)| value(at)).collect()
}

/// Every instruction that moves: those whose words are known, any other one that is given a speed or a zone, and calls
/// of what this file does not hold.
pub(super) fn motions(text: &str, targets: &[Target]) -> Vec<Instruction> {
    let code = scan::code(text, "!");
    let variables = Variables::read(&code, SYNTAX, targets);
    let (mut from, mut found, mut calls) = (0, Vec::new(), Vec::new());
    for end in code.match_indices(';').map(|(end, _)| end).chain([code.len()]) {
        let mut at = std::mem::replace(&mut from, end + 1)..end;
        let mut next = known(&code, at.clone());
        if next.is_none() {
            calls.extend(called(&code, at.clone()).map(|word| (word, end)));
        }
        while let Some((word, kind)) = next {
            at.start = word.end;
            // A motion behind this one, or nothing else: its end is missing.
            next = known(&code, at.clone()).filter(|(next, _)| is_operand(code[at.start..next.start].trim_end()));
            let stop = next.as_ref().map_or(end, |(next, _)| next.start);
            let unended = (next.is_some() || end == code.len()).then_some(Cause::Unended);
            let arguments = arguments(&code, word.end..stop);
            let place = if begins(&code[word.clone()], "Search") { 2 } else { 0 };
            let target = arguments.get(place).or(arguments.first()).cloned().unwrap_or(word.end..word.end);
            let moves_by = match kind.or(unended) {
                None => variables.expression(&code, target.clone(), targets),
                Some(cause) => Err(cause),
            };
            found.push(Instruction::new(text, word, target, moves_by));
        }
    }
    let corrected: BTreeSet<usize> = found.iter().flat_map(|m| m.moves_by.iter().flatten().copied()).collect();
    let is_corrected = |at: Range<usize>| {
        let held = variables.expression(&code, at, targets);
        held.is_ok_and(|held| held.iter().all(|k| corrected.contains(k)))
    };
    let unknown = unknown(&code, calls, is_corrected).into_iter();
    found.extend(unknown.map(|(word, target, cause)| Instruction::new(text, word, target, Err(cause))));
    found.sort_by_key(|motion| motion.at);
    found
}

/// Whether an operand of an expression ends there, behind which no other one can stand.
fn is_operand(before: &str) -> bool {
    before.ends_with(|c: char| c.is_alphanumeric() || "_]})".contains(c))
}

fn begins(word: &str, head: &str) -> bool {
    word.get(..head.len()).is_some_and(|w| w.eq_ignore_ascii_case(head))
}

/// The known word that moves in a statement, and why it is not corrected; `None` where it moves to a joint target.
fn known(code: &str, at: Range<usize>) -> Option<(Range<usize>, Option<Cause>)> {
    let mut last = "";
    for word in scan::words(&code[at.clone()]) {
        let word = at.start + word.start..at.start + word.end;
        let name = &code[word.clone()];
        let declared = SYNTAX.routines.iter().any(|r| r.eq_ignore_ascii_case(std::mem::replace(&mut last, name)));
        let before = code[..word.start].ends_with(['\\', '.', ',', '(', '=']);
        let behind = code[word.end..at.end].trim_start();
        let is_alone = handed::of(ALONE, name);
        if declared || before || (behind.is_empty() && !is_alone) || behind.starts_with(['(', ':', '.', ',', ')', '='])
        {
            continue;
        }
        let of = |words: &[&str]| words.iter().any(|w| begins(name, w));
        let given = arguments(code, word.end..at.end).len();
        let kind = match () {
            () if handed::of(JOINT, name) => None,
            () if of(&LIKE_JOINT) => Some(Cause::Unknown),
            () if is_alone => Some(Cause::Elsewhere),
            () if of(&EXTERNAL) => Some(Cause::External),
            () if of(&LED) => Some(Cause::Led),
            // A routine may have such a name, as in `MoveLeft 10;`.
            () if of(&CARTESIAN) && given > 2 => Some(Cause::Cartesian),
            () => continue,
        };
        return Some((word, kind));
    }
    None
}

/// The word of a statement that calls without brackets: the one before its first argument.
fn called(code: &str, at: Range<usize>) -> Option<Range<usize>> {
    let label =
        |(k, c, depth): &(usize, char, usize)| *c == ':' && *depth == 0 && !code[at.start + k + 1..].starts_with('=');
    let start = scan::levels(&code[at.clone()]).filter(label).last().map_or(at.start, |(k, ..)| at.start + k + 1);
    let parts = scan::parts(code, start..at.end);
    let first = parts.first()?.clone();
    // Up to what is optional behind an argument.
    let mut optional = false;
    let is_outside = |(_, c, depth): &(usize, char, usize)| {
        optional |= *c == '\\';
        !optional && *depth == 0
    };
    let outside: BTreeSet<usize> =
        scan::levels(&code[first.clone()]).filter(is_outside).map(|(k, ..)| first.start + k).collect();
    let words: Vec<Range<usize>> = scan::words(&code[first.clone()])
        .map(|w| first.start + w.start..first.start + w.end)
        .filter(|word| outside.contains(&word.start) && !code[..word.start].ends_with('.'))
        .collect();
    let mut backwards = words.iter().rev();
    let (last, before, third) = (backwards.next()?, backwards.next(), backwards.next());
    if third.is_some_and(|word| handed::of(DECLARES, &code[word.clone()])) {
        return None;
    }
    let is_call = |word: &&Range<usize>| {
        let name = &code[(*word).clone()];
        scan::is_name(name) && !handed::of(KEYWORDS, name) && !TYPES.iter().any(|t| t.eq_ignore_ascii_case(name))
    };
    let behind = code[last.end..first.end].trim_start();
    // Behind `IF` and a condition stands the call.
    let condition = third.is_some_and(|word| code[word.clone()].eq_ignore_ascii_case("IF"));
    let is_argument =
        !(condition && behind.starts_with('\\')) && (behind.is_empty() || behind.starts_with(['{', '(', '.', '\\']));
    let is_apart = |word: &&Range<usize>| {
        let gap = &code[word.end..last.start];
        gap.starts_with(char::is_whitespace) && ["", "-", "+"].contains(&gap.trim())
    };
    let with_arguments = parts.len() > 1 || behind.starts_with(['[', '\\']);
    let before = before.filter(|word| is_argument && is_apart(word) && is_call(word));
    before.or(Some(last).filter(|word| with_arguments && is_call(word))).cloned()
}

/// Of these calls, each up to its end, those that may move, with their first argument and why they are not corrected:
/// they are given a speed or a zone, or a target that is not corrected where it stands.
fn unknown(
    code: &str,
    calls: Vec<(Range<usize>, usize)>,
    is_corrected: impl Fn(Range<usize>) -> bool,
) -> Vec<(Range<usize>, Range<usize>, Cause)> {
    let headers = handed::headers(code, SYNTAX.routines);
    let own: BTreeSet<String> = headers.iter().map(|(_, name)| code[name.clone()].to_ascii_uppercase()).collect();
    let words: Vec<Range<usize>> = scan::words(code).collect();
    let declared = words.windows(2).filter(|two| TYPES.iter().any(|t| t.eq_ignore_ascii_case(&code[two[0].clone()])));
    let declared: BTreeSet<String> = declared.map(|two| code[two[1].clone()].to_ascii_uppercase()).collect();
    let is_target = |at: &Range<usize>| {
        let text = &code[at.clone()];
        let first = scan::words(text).next().filter(|word| word.start == 0).unwrap_or(0..0);
        let field = text[first.end..].starts_with('.');
        let literal = text.starts_with("[[")
            && text.ends_with(']')
            && [2, 4].contains(&scan::parts(text, 1..text.len() - 1).len());
        literal
            || !field
                && (handed::of(TARGETS, &text[first.clone()]) || declared.contains(&text[first].to_ascii_uppercase()))
    };
    let is_named = |at: &Range<usize>| scan::is_name(&code[at.clone()]) && !handed::of("TRUE FALSE", &code[at.clone()]);
    let one = |(word, end): (Range<usize>, usize)| {
        let name = &code[word.clone()];
        let given: Vec<_> = scan::parts(code, word.end..end).into_iter().map(|part| values(code, part)).collect();
        let mut paces = given.iter().filter_map(|values| values.first()).skip(1);
        let has_pace = paces.any(|at| is_pace(&code[at.clone()]));
        let any = |is: &dyn Fn(&Range<usize>) -> bool| given.iter().flatten().any(is);
        let is_own = own.contains(&name.to_ascii_uppercase());
        let cause = match () {
            () if has_pace && is_own => Cause::Elsewhere,
            () if has_pace => Cause::Unknown,
            () if is_own || handed::of(READING, name) || handed::of(WRITING, name) => return None,
            () if any(&|at| is_target(at) && !is_corrected(at.clone())) => Cause::Unknown,
            () if begins(name, MOVE) && any(&is_named) && !any(&is_target) => Cause::Unknown,
            () => return None,
        };
        let target = arguments(code, word.end..end).first().cloned().unwrap_or(word.end..word.end);
        Some((word, target, cause))
    };
    calls.into_iter().filter_map(one).collect()
}

/// Whether an argument is one of the speeds or zones that the controller knows.
fn is_pace(argument: &str) -> bool {
    let numbered = |head: char| {
        let mut chars = argument.chars();
        chars.next().is_some_and(|c| c.eq_ignore_ascii_case(&head))
            && chars.as_str().starts_with(|c: char| c.is_ascii_digit())
            && chars.all(|c| c.is_ascii_digit())
    };
    handed::of("fine vmax", argument) || numbered('v') || numbered('z')
}

/// The values of an argument: its own, and those of what is optional before or behind it.
fn values(code: &str, part: Range<usize>) -> Vec<Range<usize>> {
    let optional = scan::levels(&code[part.clone()]).filter(|(_, c, depth)| *c == '\\' && *depth == 0);
    let starts: Vec<usize> = optional.map(|(k, ..)| part.start + k).collect();
    let ends = starts.iter().copied().chain([part.end]);
    let pieces = std::iter::once(part.start).chain(starts.iter().map(|start| start + 1)).zip(ends);
    let value = |(from, to): (usize, usize)| {
        let named = code[from..to].find(":=").map_or(from, |k| from + k + 2);
        scan::trimmed(code, named..to)
    };
    pieces.map(value).collect()
}

/// Arguments without switches (`\Conc`) and without what is optional behind them (`\NoEOffs`).
fn arguments(code: &str, at: Range<usize>) -> Vec<Range<usize>> {
    let plain = |part: Range<usize>| {
        let mut optional = scan::levels(&code[part.clone()]).filter(|(_, c, depth)| *c == '\\' && *depth == 0);
        let optional = optional.next().map(|(at, ..)| at);
        (optional != Some(0)).then(|| scan::trimmed(code, part.start..optional.map_or(part.end, |k| part.start + k)))
    };
    scan::parts(code, at).into_iter().filter_map(plain).collect()
}

fn jointtarget(list: &[String]) -> String {
    let filled = |axes: &[String], empty: &str| -> Vec<String> {
        (0..AXES).map(|k| axes.get(k).cloned().unwrap_or_else(|| empty.to_owned())).collect()
    };
    let (robot, external) = list.split_at(list.len().min(AXES));
    format!("[[{}],[{}]]", filled(robot, "0").join(","), filled(external, "9E9").join(","))
}

pub(super) fn program(name: &str, stops: &[Written], motion: &Motion, _: bool) -> Vec<(String, String)> {
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
