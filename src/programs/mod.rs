//! Robot programs: joint targets read out of the makers' languages, put back in place, and lists of stops written as programs.
//!
//! In: a program's text, or a list of stops. Out: every instruction that moves the robot with the joint targets that it moves by, their
//! readings in deg (mm where a joint slides), the text with other readings and nothing else changed; or a program that moves, waits,
//! triggers and logs. Only targets written as numbers in joint coordinates can be changed; an instruction that moves by anything
//! else is named with the reason. What goes wrong: pulses (Yaskawa) without their number a degree.

mod fanuc;
mod instruction;
mod krl;
mod rapid;
mod scan;
mod urscript;
mod variables;
mod yaskawa;

use std::ops::Range;

use camino::Utf8Path;

pub use self::instruction::{Cause, Instruction, Program};

/// A maker's language.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Language {
    /// Universal Robots, `.script`.
    UrScript,
    /// ABB, `.mod`.
    Rapid,
    /// KUKA, `.src` and `.dat`.
    Krl,
    /// Fanuc, `.ls`.
    FanucLs,
    /// Yaskawa, `.jbi`.
    Jbi,
}

impl Language {
    /// All of them.
    pub const ALL: [Language; 5] =
        [Language::UrScript, Language::Rapid, Language::Krl, Language::FanucLs, Language::Jbi];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Language::UrScript => "URScript",
            Language::Rapid => "ABB RAPID",
            Language::Krl => "KUKA KRL",
            Language::FanucLs => "Fanuc LS",
            Language::Jbi => "Yaskawa JBI",
        }
    }

    /// Endings of its files, small letters.
    fn endings(self) -> &'static [&'static str] {
        match self {
            Language::UrScript => &["script", "urscript"],
            Language::Rapid => &["mod", "modx", "prg"],
            Language::Krl => &["src", "dat"],
            Language::FanucLs => &["ls"],
            Language::Jbi => &["jbi"],
        }
    }

    /// The language of a file, by its ending.
    pub fn of(path: &Utf8Path) -> Option<Language> {
        let ending = path.extension()?.to_ascii_lowercase();
        Language::ALL.into_iter().find(|language| language.endings().contains(&ending.as_str()))
    }

    /// What a number of a target is times degrees.
    fn per_degree(self, pulses: bool, pulses_per_deg: &[f64], joint: usize) -> f64 {
        match self {
            Language::UrScript => 1f64.to_radians(),
            Language::Jbi if pulses => pulses_per_deg.get(joint).copied().unwrap_or(1.0),
            _ => 1.0,
        }
    }
}

/// A joint target of a program.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// What the program calls it, or its number.
    pub name: String,
    /// Its line, from 1.
    pub line: u64,
    /// Readings, deg (mm where the joint slides).
    pub readings: Vec<f64>,
    /// Where each of its numbers stands in the text.
    places: Vec<Range<usize>>,
    /// Where it stands as a whole, with its brackets.
    whole: Range<usize>,
    /// Whether they are pulses.
    pulses: bool,
}

/// How the joints of a program's numbers are to be understood.
#[derive(Debug, Clone, Copy)]
pub struct Joints<'a> {
    /// Which slide, one a joint: their numbers are lengths and never converted.
    pub slides: &'a [bool],
    /// Yaskawa's pulses a degree, one a joint; may be empty.
    pub pulses_per_deg: &'a [f64],
}

impl Joints<'_> {
    fn count(&self) -> usize {
        self.slides.len()
    }

    /// Metres of UR's language are the exception among the lengths; no UR slides.
    fn factor(&self, language: Language, pulses: bool, joint: usize) -> f64 {
        if self.slides[joint] && !pulses { 1.0 } else { language.per_degree(pulses, self.pulses_per_deg, joint) }
    }
}

/// The joint targets of a program, in its order: those that it moves by, and what is plainly one though nothing moves by it.
pub fn targets(language: Language, text: &str, joints: Joints) -> Result<Vec<Target>, String> {
    let program = Program::read(language, text, joints)?;
    if language != Language::UrScript {
        return Ok(program.targets);
    }
    // A list is a joint target where something moves by it, or where its name says so, as PolyScope's do.
    let moved = program.moved_by(language);
    let kept = |(k, t): (usize, Target)| (moved.binary_search(&k).is_ok() || t.name.ends_with('q')).then_some(t);
    Ok(program.targets.into_iter().enumerate().filter_map(kept).collect())
}

/// Every list of joint values, in the order of the text.
fn all_targets(language: Language, text: &str, joints: Joints) -> Result<Vec<Target>, String> {
    let found = match language {
        Language::UrScript => urscript::targets(text, joints.count()),
        Language::Rapid => rapid::targets(text, joints.count()),
        Language::Krl => krl::targets(text, joints.count()),
        Language::FanucLs => fanuc::targets(text, joints.count()),
        Language::Jbi => yaskawa::targets(text, joints.count()),
    };
    if found.iter().any(|t| t.pulses) && joints.pulses_per_deg.len() != joints.count() {
        return Err(format!(
            "the targets are in pulses; the number of pulses a degree of each of the {} joints is needed",
            joints.count()
        ));
    }
    let converted = |mut t: Target| {
        for (joint, reading) in t.readings.iter_mut().enumerate() {
            *reading /= joints.factor(language, t.pulses, joint);
        }
        t
    };
    Ok(found.into_iter().map(converted).collect())
}

/// The program with other readings (deg, mm) for some of its targets; everything else stays to the byte.
pub fn with_readings(language: Language, text: &str, joints: Joints, changed: &[(&Target, Vec<f64>)]) -> String {
    let mut edits: Vec<(Range<usize>, String)> = Vec::new();
    for (target, readings) in changed {
        for (joint, (place, reading)) in target.places.iter().zip(readings).enumerate() {
            let value = reading * joints.factor(language, target.pulses, joint);
            edits.push((place.clone(), number(language, target.pulses, value)));
        }
    }
    edits.sort_by_key(|(place, _)| place.start);
    let mut out = String::with_capacity(text.len() + 8 * edits.len());
    let mut done = 0;
    for (place, written) in edits {
        out.push_str(&text[done..place.start]);
        out.push_str(&written);
        done = place.end;
    }
    out + &text[done..]
}

/// A number as the language takes it: a hundredth of a microradian or finer; whole pulses.
fn number(language: Language, pulses: bool, value: f64) -> String {
    let value = value + 0.0;
    match language {
        Language::UrScript => format!("{value:.9}"),
        Language::Jbi if pulses => format!("{value:.0}"),
        _ => format!("{value:.6}"),
    }
}

/// A pose to stop at.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop {
    /// Its name: that of its pictures.
    pub name: String,
    /// Readings, deg (mm where a joint slides).
    pub readings: Vec<f64>,
    /// Readings of the point that it is approached from, always from the same side of every joint (backlash).
    pub approach: Vec<f64>,
}

/// How the robot moves between stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Share of the joints' full speed, per cent.
    pub speed_percent: f64,
    /// Time to rest before the pictures, s.
    pub dwell_s: f64,
}

/// Files of a program that visits the stops: name and text.
pub fn program(
    language: Language,
    name: &str,
    stops: &[Stop],
    motion: &Motion,
    joints: Joints,
) -> Vec<(String, String)> {
    let pulses = !joints.pulses_per_deg.is_empty();
    let list = |readings: &[f64]| -> Vec<String> {
        let value = |(joint, r): (usize, &f64)| r * joints.factor(language, pulses, joint);
        readings.iter().enumerate().map(value).map(|v| number(language, pulses, v)).collect()
    };
    let stops: Vec<Written> = stops
        .iter()
        .map(|s| Written { name: plain(&s.name), readings: list(&s.readings), approach: list(&s.approach) })
        .collect();
    match language {
        Language::UrScript => urscript::program(name, &stops, motion),
        Language::Rapid => rapid::program(name, &stops, motion),
        Language::Krl => krl::program(name, &stops, motion),
        Language::FanucLs => fanuc::program(name, &stops, motion),
        Language::Jbi => yaskawa::program(name, &stops, motion, pulses),
    }
}

/// A stop with its numbers as text.
struct Written {
    name: String,
    readings: Vec<String>,
    approach: Vec<String>,
}

/// A name that stands in a comment or a string of every language.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || "_-.".contains(c) { c } else { '_' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PULSES: [f64; 7] = [1341.4, 1341.4, 1341.4, 1000.0, 1000.0, 622.0, 500.0];

    fn stops(count: usize) -> Vec<Stop> {
        let at = |k: f64| (0..count).map(|j| 12.345678 * k - 31.25 * j as f64).collect::<Vec<f64>>();
        let stop = |k: usize| Stop { name: format!("g1_{k:03}"), readings: at(k as f64), approach: at(k as f64 - 0.2) };
        (0..5).map(stop).collect()
    }

    /// deg; pulses are whole.
    fn same(a: &[f64], b: &[f64], by: f64) {
        assert_eq!(a.len(), b.len());
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < by), "{a:?} {b:?}");
    }

    #[test]
    fn what_is_written_is_read_and_put_back_in_place() {
        let motion = Motion { speed_percent: 20.0, dwell_s: 1.5 };
        for (language, pulses) in Language::ALL.map(|l| (l, false)).into_iter().chain([(Language::Jbi, true)]) {
            for count in [6, 7] {
                let slides = vec![false; count];
                let pulses_per_deg: &[f64] = if pulses { &PULSES[..count] } else { &[] };
                let joints = Joints { slides: &slides, pulses_per_deg };
                let stops = stops(count);
                let (name, text) = program(language, "plan", &stops, &motion, joints).swap_remove(0);
                assert_eq!(Language::of(Utf8Path::new(&name)), Some(language), "{name}");
                let read = targets(language, &text, joints).unwrap();
                let by = if pulses { 1e-3 } else { 1e-6 };
                assert_eq!(read.len(), 10, "{language:?} {text}");
                for (k, stop) in stops.iter().enumerate() {
                    same(&read[2 * k].readings, &stop.approach, by);
                    same(&read[2 * k + 1].readings, &stop.readings, by);
                }
                // Nothing changed is nothing changed; one target changed leaves all other bytes.
                assert_eq!(with_readings(language, &text, joints, &[]), text);
                let other: Vec<f64> = read[3].readings.iter().map(|r| r + 0.5).collect();
                let changed = with_readings(language, &text, joints, &[(&read[3], other.clone())]);
                let again = targets(language, &changed, joints).unwrap();
                same(&again[3].readings, &other, by);
                assert_eq!(again[4].readings, read[4].readings);
                let differ = text.lines().zip(changed.lines()).filter(|(a, b)| a != b).count();
                assert!(differ <= 7 && text.lines().count() == changed.lines().count(), "{language:?}: {differ}");
            }
        }
    }

    #[test]
    fn poses_and_comments_are_no_joint_targets() {
        let slides = [false; 6];
        let joints = Joints { slides: &slides, pulses_per_deg: &[] };
        for (language, text) in [
            (
                Language::UrScript,
                "# movej([1,2,3,4,5,6])\nmovel(p[0.1,0.2,0.3,0,3.1,0], a=1, v=1)\ng = [1,2,3,4,5,6]\n",
            ),
            (Language::Rapid, "MoveL [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]], v100, fine, tool0;\n"),
            (Language::Krl, ";PTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}\nLIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"),
            (
                Language::FanucLs,
                "/POS\nP[1]{\n GP1:\n UF : 0, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n X = 1.0 mm, Y = 2 mm\n};\n",
            ),
            (Language::Jbi, "///POSTYPE BASE\n///RECTAN\nC00000=1,2,3,4,5,6\n"),
        ] {
            assert_eq!(targets(language, text, joints).unwrap(), [], "{text}");
        }
        let said = targets(Language::Jbi, "///POSTYPE PULSE\nC00000=1,2,3,4,5,6\n", joints).unwrap_err();
        assert!(said.contains("pulses a degree of each of the 6 joints"), "{said}");
    }
}
