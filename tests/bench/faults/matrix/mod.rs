//! Planted faults and what the program makes of them.

pub mod boards;
pub mod cameras;
pub mod changes;
pub mod clean;
pub mod judge;
pub mod light;
pub mod measure;
pub mod mixups;
pub mod motion;
pub mod picture_faults;
pub mod pictures;
pub mod said;
pub mod second;
pub mod series;
pub mod set;
pub mod sizes;
pub mod truth;
pub mod views;

use set::Set;

/// What there is to be had from a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Right {
    /// Nothing is wrong: a pass without a word.
    Clean,
    /// A right answer is to be had, with or without a word: a pass.
    Pass,
    /// Whatever the truth bears out.
    Truth,
}

/// One planted fault at one size.
pub struct Case {
    pub class: &'static str,
    pub fault: &'static str,
    pub size: String,
    pub right: Right,
    /// Draws the set for a seed and a width of the pictures.
    pub make: Box<dyn Fn(u64, u32) -> Set>,
    /// Worth a run on large pictures too.
    pub large: bool,
}

/// A case; the fault's size is part of its name.
pub fn case(
    class: &'static str,
    fault: &'static str,
    size: impl Into<String>,
    right: Right,
    make: impl Fn(u64, u32) -> Set + 'static,
) -> Case {
    Case { class, fault, size: size.into(), right, make: Box::new(make), large: false }
}

impl Case {
    /// One whose answer may depend on the size of the pictures.
    pub fn also_large(self) -> Case {
        Case { large: true, ..self }
    }

    /// Class, fault and size.
    pub fn name(&self) -> String {
        format!("{}/{} {}", self.class, self.fault, self.size).trim_end().to_owned()
    }
}

/// All of them.
pub fn cases() -> Vec<Case> {
    let classes = [
        clean::cases,
        motion::cases,
        boards::cases,
        views::cases,
        second::cases,
        pictures::cases,
        mixups::cases,
        cameras::cases,
        light::cases,
        sizes::cases,
    ];
    classes.iter().flat_map(|class| class()).collect()
}

/// The first words of each line, and how many there are.
pub fn brief(words: &[String]) -> String {
    const LINES: usize = 3;
    const LETTERS: usize = 110;
    let short = |line: &String| line.chars().take(LETTERS).collect::<String>();
    let shown: Vec<String> = words.iter().take(LINES).map(short).collect();
    let more = if words.len() > LINES { format!(" // and {} more", words.len() - LINES) } else { String::new() };
    shown.join(" // ") + &more
}
