//! What the words around a table say: its convention, and the units of its angles and lengths.
//!
//! In: comments, titles and sentences, and the text of a program without them. Out: what is said once; a unit that is
//! said both ways is not said. A unit counts where the words say that something is in it (`lengths in cm`, `Unit
//! [radian]`, `units: mm, deg`), and not on lines about limits and speeds; a convention where the line is about Denavit
//! and Hartenberg. What goes wrong: words about something else; what the numbers rule out is not heard.

use crate::robot::catalogue::Convention;
use crate::tables::names::Unit;

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Words {
    pub convention: Option<Convention>,
    /// Whether they name both conventions.
    pub both: bool,
    pub angle: Option<Unit>,
    pub length: Option<Unit>,
}

/// Words of a line that is about parameters of links.
const ABOUT: [&str; 6] = ["dh", "mdh", "sdh", "denavit", "hartenberg", "convention"];

const MODIFIED: [&str; 4] = ["modified", "craig", "proximal", "mdh"];
const CLASSIC: [&str; 5] = ["standard", "classic", "classical", "distal", "sdh"];

/// Words that make a line one about other numbers.
const OTHERS: [&str; 13] = [
    "limit", "limits", "qlim", "range", "min", "max", "minimum", "maximum", "speed", "velocity", "torque", "mass",
    "pose",
];

impl Words {
    /// Of comments and sentences, and of the code between them.
    pub fn of(prose: &str, code: &str) -> Words {
        let code = code.to_lowercase();
        let has = |words: &[&str]| words.iter().any(|word| code.contains(word));
        let mut modified = has(&["mdh", "modified", "craig"]);
        let mut classic = has(&["standard", "classic"]);
        let (mut angles, mut lengths) = (Vec::new(), Vec::new());
        for line in prose.lines() {
            let line = line.to_lowercase();
            let words: Vec<&str> = line.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).collect();
            let is = |list: &[&str]| words.iter().any(|word| list.contains(word));
            // Chinese has no blanks between words.
            if is(&ABOUT) || line.contains("d-h") || line.contains("dh参数") || line.contains("dh 参数") {
                modified |= is(&MODIFIED) || line.contains("mdh") || line.contains("改进") || line.contains("修正");
                classic |= is(&CLASSIC) || line.contains("标准");
            }
            if !is(&OTHERS) {
                let stated = stated(&line);
                angles.extend(stated.iter().copied().filter(|unit| unit.is_angle()));
                lengths.extend(stated.into_iter().filter(|unit| !unit.is_angle()));
            }
        }
        let once = |units: Vec<Unit>| units.first().copied().filter(|first| units.iter().all(|unit| unit == first));
        let convention = match (modified, classic) {
            (true, false) => Some(Convention::Modified),
            (false, true) => Some(Convention::Classic),
            _ => None,
        };
        Words { convention, both: modified && classic, angle: once(angles), length: once(lengths) }
    }
}

/// Whether a joint slides, in the words of tables; sigma of the Robotics Toolbox is 1 where it does.
pub fn slides(word: &str) -> Option<bool> {
    match word.trim().trim_matches(['"', '\'']).to_lowercase().as_str() {
        "revolute" | "rotary" | "rotational" | "rot" | "r" | "0" => Some(false),
        "prismatic" | "linear" | "sliding" | "translational" | "p" | "1" => Some(true),
        _ => None,
    }
}

/// The units that a line in small letters says something to be in.
fn stated(line: &str) -> Vec<Unit> {
    let mut found = Vec::new();
    let mut cued = false;
    let mut rest = line;
    let mut before = ' ';
    while let Some(start) = rest.find(|c: char| c.is_alphanumeric()) {
        before = rest[..start].chars().next_back().unwrap_or(before);
        let end = rest[start..].find(|c: char| !c.is_alphanumeric()).map_or(rest.len(), |n| start + n);
        let (word, behind) = (&rest[start..end], rest[end..].chars().next());
        let bracketed = matches!((before, behind), ('[', Some(']')) | ('(', Some(')')));
        // `in` is none of them here.
        match Unit::of(word).filter(|_| word != "in") {
            Some(unit) if cued || bracketed => found.push(unit),
            Some(_) => {}
            None => cued = matches!(word, "in" | "unit" | "units" | "einheit" | "einheiten") || cued && word == "and",
        }
        rest = &rest[end..];
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_what_something_is_said_to_be_in() {
        let of = |prose: &str| (Words::of(prose, "").angle, Words::of(prose, "").length);
        for prose in ["angles in radians, distances in meters", "units in m and rad, [m]", "Unit [radian] (m)"] {
            assert_eq!(of(prose), (Some(Unit::Rad), Some(Unit::M)), "{prose}");
        }
        assert_eq!(of("lengths in cm"), (None, Some(Unit::Cm)));
        assert_eq!(of("units: mm, deg"), (Some(Unit::Deg), Some(Unit::Mm)));
        for prose in ["reach 850 mm", "turns 90 degrees", "limits in degrees, max speed in m", "in mm\nin cm", "in in"]
        {
            assert_eq!(of(prose), (None, None), "{prose}");
        }
    }

    #[test]
    fn a_convention_is_said_of_denavit_and_hartenberg_alone() {
        let of = |prose: &str, code: &str| Words::of(prose, code).convention;
        for prose in ["Modified DH table", "D-H parameters (Craig)", "MDH参数", "改进 DH 参数"] {
            assert_eq!(of(prose, ""), Some(Convention::Modified), "{prose}");
        }
        assert_eq!(of("the classic convention", ""), Some(Convention::Classic));
        assert_eq!(of("", "DHRobot(links, 'modified')"), Some(Convention::Modified));
        for (prose, both) in
            [("modified by the author", false), ("standard library", false), ("standard DH, not modified DH", true)]
        {
            assert_eq!((of(prose, ""), Words::of(prose, "").both), (None, both), "{prose}");
        }
    }
}
