//! Yaskawa's job: positions `C00000=..` in pulses or angles, by the `///POSTYPE` before them.
//!
//! In: the text of a job. Out: its positions of joints, and its instructions that move: to them, otherwise, or as
//! instructions that are not known do for all that is known. What goes wrong: positions of no type.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::ops::Range;

use crate::programs::handed;
use crate::programs::instruction::{Cause, Instruction};
use crate::programs::language::{Motion, Target, Written};
use crate::programs::scan;

/// The most axes of a robot or of a position.
const MOST_AXES: usize = 16;
/// Positions of a station, a base or external axes.
const EXTERNAL: [&str; 6] = ["EC", "BC", "EX", "BP", "LEX", "LBP"];
/// What shifts the motions behind it, or lets a sensor, a force or a recorded path lead the arm, up to what ends it.
const LEADS: [(&str, &str, Cause); 6] = [
    ("SFTON", "SFTOF", Cause::Offset),
    ("SSFTON", "SSFTOF", Cause::Offset),
    ("COMARCON", "COMARCOF", Cause::Led),
    ("FLOATON", "FLOATOF", Cause::Led),
    ("IMPON", "IMPOF", Cause::Led),
    ("MEMON", "MEMOF", Cause::Led),
];
/// The use of `MEMON` that only records.
const RECORDS: &str = "REC";
/// Instructions that cut a form of a file about the point where the arm stands.
const FORMS: [&str; 1] = ["FORMCUT"];
/// Instructions that move nothing of the robot.
const STILL: &str = "NOP END COMM JUMP CALL RET PAUSE ABORT TIMER MSG DIALOG CWAIT WAIT DOUT DIN PULSE AOUT ARATION ARATIOF ANTOUT \
    ADVINIT ADVSTOP SETUALM IFTHEN IFTHENEXP ELSEIF ELSEIFEXP ELSE ENDIF FOR NEXT WHILE WHILEEXP ENDWHILE SWITCH CASE \
    DEFAULT ENDSWITCH PSTART PWAIT TSYNC SPEED REFP SREFP SET SETE GETE GETS CLEAR INC DEC ADD SUB MUL DIV SQRT SIN COS ATAN \
    NOT AND OR XOR MULMAT INVMAT CNVRT CONVSFT MFRAME GETPOS SETTOOL SETREG GETREG SETFILE GETFILE GETPRM GETARG LOADV \
    SAVEV VAR2STR VAL ASC CHR$ MID$ LEN CAT$ ARCON ARCOF ARCSET ARCCTS ARCCTE AWELD VWELD WVON WVOF WVADJ SWVON SWVOF TOOLON TOOLOF \
    HAND HSEN GUNCL SVGUNCL SVSPOT GUNCHG SYSTART SYEND CLRSENS SKILLSND SFTOF SSFTOF COMARCOF FLOATOF IMPOF MEMOF";
/// How instructions begin that call a job of their number.
const MACRO: &str = "MACRO";
/// Instructions that read positions alone.
const READING: [&str; 7] = ["SFTON", "MFRAME", "SAVEV", "GETE", "CALL", "JUMP", "COMM"];
/// Instructions that write into the first of their arguments and read the others.
const WRITING_FIRST: [&str; 12] =
    ["SET", "SETE", "ADD", "SUB", "MUL", "DIV", "GETS", "CNVRT", "CONVSFT", "GETPOS", "LOADV", "MULMAT"];

/// What the numbers of a position are.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Pulses,
    Angles,
    Cartesian,
    /// Nothing says it.
    Untyped,
}

/// Positions in pulses or angles; Cartesian ones are left out.
pub(super) fn targets(text: &str, count: usize) -> Vec<Target> {
    let target = |(at, line, kind): (usize, &str, Kind)| {
        let target = position(text, at, line, count).filter(|_| matches!(kind, Kind::Pulses | Kind::Angles))?;
        Some(Target { pulses: kind == Kind::Pulses, ..target })
    };
    positions(text).filter_map(target).collect()
}

/// The lines of positions, each with its place and what its numbers are: as `///POSTYPE` before it says, or else
/// `///PULSE` and the like; without either, whole numbers are pulses.
fn positions(text: &str) -> impl Iterator<Item = (usize, &str, Kind)> {
    let (mut end, mut kind) = (0, Kind::Untyped);
    text.split_inclusive('\n').filter_map(move |line| {
        let at = end;
        end += line.len();
        let header = line.trim().strip_prefix("///").unwrap_or("");
        match header.strip_prefix("POSTYPE").unwrap_or(header).trim() {
            "PULSE" => kind = Kind::Pulses,
            "ANGLE" => kind = Kind::Angles,
            "RECTAN" => kind = Kind::Cartesian,
            _ if header.starts_with("POSTYPE") => kind = Kind::Cartesian,
            _ => {}
        }
        let (name, numbers) = line.split_once('=')?;
        key(name.trim())?;
        let is_whole = kind == Kind::Untyped && !numbers.contains('.');
        Some((at, line, if is_whole { Kind::Pulses } else { kind }))
    })
}

fn position(text: &str, at: usize, line: &str, count: usize) -> Option<Target> {
    let (name, _) = line.split_once('=')?;
    let number = name.trim().strip_prefix(['C', 'P'])?;
    if number.is_empty() || !number.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    let (mut numbers, _) = scan::list(text, at + name.len() + 1, MOST_AXES, scan::number);
    // Axes that the arm lacks are written as zero.
    if numbers.iter().skip(count).any(|(value, _)| *value != 0.0) {
        return None;
    }
    numbers.truncate(count);
    scan::target(text, Some(name.trim().to_owned()), numbers, None).filter(|t| t.readings.len() == count)
}

/// Every instruction that moves, behind `//INST`, and those that are not known.
pub(super) fn motions(text: &str, targets: &[Target]) -> Vec<Instruction> {
    let first = text.find("//INST").unwrap_or(0);
    let (mut at, mut leads, mut found) = (first, Vec::new(), Vec::new());
    let points = Points::read(text, &text[first..], targets);
    for line in text[at..].split_inclusive('\n') {
        let tokens: Vec<Range<usize>> = tokens(line).map(|token| at + token.start..at + token.end).collect();
        at += line.len();
        let Some(word) = tokens.first().cloned() else { continue };
        let point = tokens.get(1).cloned().unwrap_or(word.end..word.end);
        let name = text[word.clone()].to_ascii_uppercase();
        leads.retain(|(end, _)| *end != name);
        if let Some((_, end, cause)) = LEADS.iter().find(|(begin, ..)| *begin == name) {
            if text[point.clone()] != *RECORDS {
                leads.push((*end, cause.clone()));
                // The arm may move by it alone.
                found.extend((*cause == Cause::Led).then(|| Instruction::new(text, word, point, Err(Cause::Led))));
            }
            continue;
        }
        let Some(moves) = kind(&name).or_else(|| is_unknown(&name).then_some(Err(Cause::Unknown))) else { continue };
        let behind = tokens.get(2..).unwrap_or_default();
        let added = behind.iter().any(|token| text[token.clone()].starts_with("+P")).then_some(Cause::Offset);
        let moves_by = match (moves, leads.first().map(|(_, cause)| cause.clone()).or(added)) {
            (Err(cause), _) | (Ok(()), Some(cause)) => Err(cause),
            (Ok(()), None) => points.held(&text[point.clone()]),
        };
        found.push(Instruction::new(text, word, point, moves_by));
        // A second robot's motion stands behind the first one's; what a station does is none of a robot.
        for pair in behind.windows(2).filter(|pair| text[pair[0].clone()].starts_with('+')) {
            let (word, point) = (pair[0].clone(), pair[1].clone());
            let station = is_external(&text[point.clone()]);
            if let Some(moves_by @ Err(_)) = kind(&text[word.clone()]).filter(|_| !station) {
                found.push(Instruction::new(text, word, point, moves_by.map(|()| Vec::new())));
            }
        }
    }
    found
}

/// Places of what stands between blanks.
fn tokens(line: &str) -> impl Iterator<Item = Range<usize>> + '_ {
    scan::runs(line, |c| !c.is_ascii_whitespace())
}

/// Whether an instruction moves, to its target or otherwise: `MOVJ`, `MOVL`, `MOVC`, `MOVS`, `SMOVL`, `IMOV`, ... A
/// remark begins with an apostrophe, a label with an asterisk.
fn kind(word: &str) -> Option<Result<(), Cause>> {
    let word = word.to_ascii_uppercase();
    let stem = word.strip_suffix(['J', 'L', 'C', 'S']).unwrap_or(&word);
    Some(match stem {
        _ if FORMS.contains(&word.as_str()) => Err(Cause::Elsewhere),
        _ if !word.contains("MOV") || !word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '+') => return None,
        _ if word.starts_with('+') => Err(Cause::Group),
        "MOV" | "SMOV" | "AMOV" | "EMOV" => Ok(()),
        _ if stem.ends_with("IMOV") => Err(Cause::Offset),
        // A conveyor's.
        "SYMOV" => Err(Cause::Led),
        _ => Err(Cause::Unknown),
    })
}

/// Whether an instruction is none of those that are known to move nothing. Other lines are a remark, a label, a heading
/// or a position.
fn is_unknown(word: &str) -> bool {
    let number = word.strip_prefix(MACRO).unwrap_or("-");
    word.starts_with(|c: char| c.is_ascii_alphabetic())
        && !word.contains('=')
        && !handed::of(STILL, word)
        && !number.bytes().all(|b| b.is_ascii_digit())
}

/// Whether a position is one of a station, a base or external axes.
fn is_external(point: &str) -> bool {
    let numbered = |rest: &str| rest.starts_with(|c: char| c.is_ascii_digit() || c == '[');
    EXTERNAL.iter().any(|head| point.strip_prefix(head).is_some_and(numbered))
}

/// The positions of a job by their keys.
struct Points {
    joints: BTreeMap<(char, u64), usize>,
    /// Of every position.
    kinds: BTreeMap<(char, u64), Kind>,
    written: Vec<Option<(char, u64)>>,
}

impl Points {
    fn read(text: &str, instructions: &str, targets: &[Target]) -> Points {
        let (mut joints, mut kinds) = (BTreeMap::new(), BTreeMap::new());
        for (k, key) in targets.iter().enumerate().filter_map(|(k, t)| Some((k, key(&t.name)?))) {
            joints.entry(key).or_insert(k);
        }
        for (_, line, kind) in positions(text) {
            let key = line.split_once('=').and_then(|(name, _)| key(name.trim()));
            key.map(|key| kinds.entry(key).or_insert(kind));
        }
        Points { joints, kinds, written: written(instructions) }
    }

    /// The joint target of a position, or why there is none.
    fn held(&self, point: &str) -> Result<Vec<usize>, Cause> {
        if is_external(point) {
            return Err(Cause::External);
        }
        let key = key(point).ok_or(Cause::Elsewhere)?;
        match (self.joints.get(&key), self.kinds.get(&key)) {
            (Some(_), _) if self.written.iter().any(|w| w.is_none_or(|w| w == key)) => Err(Cause::Elsewhere),
            (Some(&k), _) => Ok(vec![k]),
            (None, Some(Kind::Pulses | Kind::Angles)) => Err(Cause::Incomplete),
            (None, Some(Kind::Cartesian)) => Err(Cause::Cartesian),
            (None, Some(Kind::Untyped)) => Err(Cause::Untyped),
            (None, None) => Err(Cause::Elsewhere),
        }
    }
}

/// Positions that instructions write into; `None` for one whose number is computed. Of an instruction that is not known
/// all its positions may be.
fn written(text: &str) -> Vec<Option<(char, u64)>> {
    let of_line = |line: &str| {
        let all: Vec<&str> = tokens(line).map(|token| &line[token]).collect();
        let word = all.first().map_or("", |word| *word);
        let instruction = word.starts_with(|c: char| c.is_ascii_alphabetic());
        let count = match () {
            () if !instruction || READING.contains(&word) || kind(word).is_some() => 0,
            () if WRITING_FIRST.contains(&word) => 1,
            () => all.len(),
        };
        let position = |token: &&str| {
            let name = token.trim_start_matches(|c: char| !c.is_ascii_alphanumeric());
            let number = name.strip_prefix("PX").or(name.strip_prefix('P'))?;
            match number.parse() {
                Ok(number) => Some(Some(('P', number))),
                Err(_) => number.starts_with('[').then_some(None),
            }
        };
        all.into_iter().skip(1).take(count).filter_map(|token| position(&token)).collect::<Vec<_>>()
    };
    text.lines().flat_map(of_line).collect()
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
