//! ABB's language: `jointtarget` values, `[[six robot axes],[external axes]]`, deg.

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
const CARTESIAN: [&str; 22] = [
    "MoveJ", "MoveL", "MoveC", "TriggJ", "TriggL", "TriggC", "SearchL", "SearchC", "ArcL", "ArcC", "ArcJ", "SpotL",
    "SpotJ", "SpotML", "SpotMJ", "DispL", "DispC", "PaintL", "PaintC", "NutL", "NutJ", "ContactL",
];
/// Those that move to joint targets.
const JOINT: &str = "MoveAbsJ MoveAbsJAO MoveAbsJDO MoveAbsJGO MoveAbsJSync TriggAbsJ";
/// How routines begin that are called after them.
const LIKE_JOINT: [&str; 2] = ["MoveAbsJ", "TriggAbsJ"];
/// Those that move external axes alone.
const EXTERNAL: [&str; 6] = ["MoveExtJ", "SearchExtJ", "IndAMove", "IndCMove", "IndDMove", "IndRMove"];
/// Those that follow a sensor or a force.
const LED: [&str; 6] = ["EGMRun", "EGMMove", "FCPress", "FCAct", "CapL", "CapC"];

/// Instructions and functions that leave what they are given as it is.
const READING: &str = "MoveExtJ IndAMove IndCMove IndDMove IndRMove TPWrite TPShow Write WriteAnyBin WriteStrBin PackRawBytes ErrWrite \
    ErrLog SocketSend RMQSendMessage RMQSendWait IPers WaitUntil CalcRobT ValToStr NumToStr Abs Round Trunc Dim \
    IsPers IsVar";
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
        declares: "VAR PERS CONST LOCAL TASK",
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

/// Every instruction that moves: those whose words are known, and any other one that is given a speed or a zone.
pub(super) fn motions(text: &str, targets: &[Target]) -> Vec<Instruction> {
    let code = scan::code(text, "!");
    let variables = Variables::read(&code, SYNTAX, targets);
    let mut from = 0;
    let statements = code.match_indices(';').map(|(end, _)| std::mem::replace(&mut from, end + 1)..end);
    let motion = |at: Range<usize>| {
        let (word, kind) = known(&code, at.clone()).or_else(|| unknown(&code, at.clone()))?;
        let arguments = arguments(&code, word.end..at.end);
        let place = if begins(&code[word.clone()], "Search") { 2 } else { 0 };
        let target = arguments.get(place).or(arguments.first()).cloned().unwrap_or(word.end..word.end);
        let moves_by = match kind {
            None => variables.expression(&code, target.clone(), targets),
            Some(cause) => Err(cause),
        };
        Some(Instruction::new(text, word, target, moves_by))
    };
    statements.filter_map(motion).collect()
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
        if declared || before || behind.is_empty() || behind.starts_with(['(', ':', '.', ',', ')', '=']) {
            continue;
        }
        let of = |words: &[&str]| words.iter().any(|w| begins(name, w));
        let given = arguments(code, word.end..at.end).len();
        let kind = match () {
            () if handed::of(JOINT, name) => None,
            () if of(&LIKE_JOINT) => Some(Cause::Unknown),
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

/// The word of a statement that is given a speed or a zone among its arguments: a routine that moves, or an instruction
/// of an option.
fn unknown(code: &str, at: Range<usize>) -> Option<(Range<usize>, Option<Cause>)> {
    let parts = scan::parts(code, at.clone());
    let numbered = |text: &str, head: char| {
        let mut chars = text.chars();
        chars.next().is_some_and(|c| c.eq_ignore_ascii_case(&head))
            && chars.as_str().starts_with(|c: char| c.is_ascii_digit())
            && chars.all(|c| c.is_ascii_digit())
    };
    let motion = |part: &Range<usize>| {
        let text = code[part.clone()].split('\\').next().unwrap_or_default().trim();
        text.eq_ignore_ascii_case("fine")
            || text.eq_ignore_ascii_case("vmax")
            || numbered(text, 'v')
            || numbered(text, 'z')
    };
    parts.iter().skip(1).find(|part| motion(part))?;
    // The word before the first argument: the last one but the argument's own.
    let first = parts.first()?.clone();
    let is_outside =
        |word: &Range<usize>| scan::levels(&code[first.start..word.start]).last().is_none_or(|(.., depth)| depth == 0);
    let words: Vec<Range<usize>> = scan::words(&code[first.clone()])
        .map(|w| first.start + w.start..first.start + w.end)
        .filter(|word| is_outside(word) && !code[..word.start].ends_with(['\\', '.']))
        .collect();
    let literal = code[..first.end].ends_with(']');
    let word = words.iter().rev().nth(usize::from(!literal))?.clone();
    Some((word, Some(Cause::Elsewhere)))
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
