//! The makers' languages, and what stands in their programs: joint targets, stops, numbers.

use std::ops::Range;

use camino::Utf8Path;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Language {
    /// Universal Robots, `.script`.
    UrScript,
    /// ABB, `.mod`, `.sys`.
    Rapid,
    /// KUKA, `.src` and `.dat`.
    Krl,
    FanucLs,
    /// Yaskawa, `.jbi`.
    Jbi,
}

impl Language {
    pub const ALL: [Language; 5] =
        [Language::UrScript, Language::Rapid, Language::Krl, Language::FanucLs, Language::Jbi];

    /// Its name, endings of its files in small letters, and what it calls the number behind the six axes of a robot.
    fn known(self) -> (&'static str, &'static [&'static str], Option<&'static str>) {
        match self {
            Language::UrScript => ("URScript", &["script", "urscript"], None),
            Language::Rapid => ("ABB RAPID", &["mod", "modx", "prg", "sys", "sysx"], Some("`eax_a`")),
            Language::Krl => ("KUKA KRL", &["src", "dat"], Some("`E1`")),
            Language::FanucLs => ("Fanuc LS", &["ls"], Some("`E1`")),
            Language::Jbi => ("Yaskawa JBI", &["jbi"], Some("the seventh number")),
        }
    }

    pub fn name(self) -> &'static str {
        self.known().0
    }

    /// The language of a file, by its ending.
    pub fn of(path: &Utf8Path) -> Option<Language> {
        let ending = path.extension()?.to_ascii_lowercase();
        Language::ALL.into_iter().find(|language| language.known().1.contains(&ending.as_str()))
    }

    /// The language of a text whose file has another ending, by what every program of it begins with or holds; and the
    /// ending that says it.
    pub fn seen_in(text: &str) -> Option<(Language, &'static str)> {
        let starts = |word: &str| text.lines().any(|line| line.trim_start().starts_with(word));
        let calls = |word: &str| text.lines().any(|line| line.trim_start().starts_with(&format!("{word}(")));
        let ends = |word: &str| text.lines().any(|line| line.trim() == word);
        let found = match () {
            () if starts("def ") && ends("end") && (calls("movej") || calls("movel") || calls("movep")) => {
                Language::UrScript
            }
            () if starts("MODULE ") && ends("ENDMODULE") => Language::Rapid,
            () if starts("&ACCESS") || starts("DEF ") && ends("END") => Language::Krl,
            () if starts("/PROG") && starts("/MN") => Language::FanucLs,
            () if ends("/JOB") && ends("//INST") => Language::Jbi,
            () => return None,
        };
        Some((found, found.known().1[0]))
    }

    /// What the language calls the number behind the six axes of a robot; `None` where all are in one list.
    pub fn seventh(self) -> Option<&'static str> {
        self.known().2
    }

    /// Whether points of this file stand in one of data beside it.
    pub fn has_data_file(self, path: &Utf8Path) -> bool {
        self == Language::Krl && path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("src"))
    }
}

/// The language of a program that is none of those that are read: by the ending of its file, or by what stands in it.
pub fn unread(path: &Utf8Path, text: &str) -> Option<&'static str> {
    const BY_ENDING: [(&str, &str); 9] = [
        ("drl", "Doosan DRL"),
        ("as", "Kawasaki AS"),
        ("pg", "Kawasaki AS"),
        ("pgx", "Staubli VAL 3"),
        ("tp", "Fanuc TP, which only the controller reads"),
        ("urp", "PolyScope, which only the controller reads"),
        ("lua", "Lua"),
        ("py", "Python"),
        ("m", "MATLAB"),
    ];
    let has = |word: &str| text.lines().any(|line| line.trim_start().starts_with(word));
    let ending = path.extension().map(str::to_ascii_lowercase);
    match () {
        () if has(".PROGRAM ") => Some("Kawasaki AS"),
        () if has("from DRCF import") || has("movej(posj(") => Some("Doosan DRL"),
        () => BY_ENDING.iter().find(|(known, _)| ending.as_deref() == Some(known)).map(|(_, name)| *name),
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
    pub(super) places: Vec<Range<usize>>,
    /// Where it stands as a whole, with its brackets.
    pub(super) whole: Range<usize>,
    pub(super) pulses: bool,
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
    /// What is wrong with the pulses a degree, for a person.
    pub fn problem(&self) -> Option<String> {
        let (pulses, count) = (self.pulses_per_deg, self.count());
        let fit = pulses.is_empty() || pulses.len() == count && pulses.iter().all(|p| p.is_finite() && *p != 0.0);
        let said = || format!("--pulses-per-deg has {} numbers; {count} that are not zero are needed", pulses.len());
        (!fit).then(said)
    }

    pub(super) fn count(&self) -> usize {
        self.slides.len()
    }

    /// What a number of a target is times degrees (mm). Metres of UR's language are the exception among the lengths; no
    /// UR slides.
    pub(super) fn factor(&self, language: Language, pulses: bool, joint: usize) -> f64 {
        match language {
            _ if self.slides[joint] && !pulses => 1.0,
            Language::UrScript => 1f64.to_radians(),
            Language::Jbi if pulses => self.pulses_per_deg.get(joint).copied().unwrap_or(1.0),
            _ => 1.0,
        }
    }
}

/// A number as the language takes it: a hundredth of a microradian or finer; whole pulses.
pub(super) fn number(language: Language, pulses: bool, value: f64) -> String {
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

/// A stop with its numbers as text.
pub(super) struct Written {
    pub(super) name: String,
    pub(super) readings: Vec<String>,
    pub(super) approach: Vec<String>,
}
