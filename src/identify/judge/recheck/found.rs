//! What is compared with, and what is said of a robot.

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use serde::Serialize;

use crate::identify::judge::locate::Trust;
use crate::identify::judge::placement::Uncertain;
use crate::robot::Parameter;

/// Chance that a robot that did not change is said to have changed.
pub(super) const FALSE_ALARM: f64 = 0.01;

/// The word for files of readings that scatter more than at the identification.
pub(super) const SCATTER: &str = "scatter";

/// Where the sensor stood by the name of the group.
pub type Stood<'a> = &'a dyn Fn(&str) -> Option<Uncertain>;

/// The robot as it was.
#[derive(Debug, Clone)]
pub struct Before {
    pub parameters: Vec<Parameter>,
    /// Their covariance, mm and mrad.
    pub covariance: DMatrix<f64>,
    /// By how much each was corrected, in units of the file.
    pub correction: Vec<f64>,
    /// How it scattered.
    pub trust: Trust,
    /// Times that variance along each cause, by its word; one where nothing is said.
    pub along: BTreeMap<String, f64>,
    /// Poses that this was found from.
    pub poses: usize,
    /// Degrees of freedom that tell how large the scatter is.
    pub freedom: f64,
    /// What 95 % of its position errors were stated to be below, mm.
    pub p95_mm: f64,
    /// The ranges of its joints there, rad (mm where one slides); empty where nothing says so.
    pub over: Vec<(f64, f64)>,
}

/// What the poses say of one cause.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CauseSeen {
    /// For files: `joint-3`, `tool-x`, `scale`.
    pub cause: String,
    /// For a person: what would have changed.
    pub what: String,
    pub unit: &'static str,
    /// By how much it changed, if it alone did, and the standard deviation; `None` where the poses see nothing of it.
    pub amount: Option<f64>,
    /// See `amount`.
    pub sigma: Option<f64>,
    /// By how much that moves the target after the placement was found anew, mm.
    pub effect_mm: f64,
    /// The smallest change that nineteen of twenty such checks see.
    pub seen: Option<f64>,
    /// By how much that one moves the target, mm.
    pub seen_mm: Option<f64>,
    /// By how much it moves the target at the most, if it alone changed: with a chance of nineteen in twenty, mm.
    pub at_most_mm: Option<f64>,
}

/// How one placement stands against the old one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Moved {
    pub group: String,
    /// Whether it is more than chance.
    pub moved: bool,
    /// By how much the points moved with it, mm, and how much that is by chance.
    pub shift_mm: f64,
    pub turn_rad: f64,
    /// What nineteen of twenty checks see, mm.
    pub seen_mm: f64,
}

/// What is said of the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Recheck {
    /// Poses that were compared.
    pub poses: Vec<String>,
    /// Poses that fit far worse than the rest and were left out.
    pub strays: Vec<String>,
    pub causes: Vec<CauseSeen>,
    pub changed: bool,
    /// What explains it, the likeliest first, as words for files and for people; empty where nothing single does.
    pub likeliest: Vec<(String, String)>,
    /// Placements that are in the old file.
    pub placements: Vec<Moved>,
    /// By how much the change moves the target, in the base, or a placement that moved does, mm.
    pub effect_mm: f64,
    /// What of that is the robot's own, mm.
    pub of_robot_mm: f64,
    /// The largest movement of the target that a single cause could make without being seen, mm.
    pub seen_mm: f64,
    /// The largest movement of the target by a single cause that the poses leave room for, mm.
    pub at_most_mm: f64,
    /// What of the robot explains placements that seem to have moved, had none: words for files and for people. A robot
    /// that stands nearly still shows a turned joint as a sensor that moved.
    pub instead: Vec<(String, String)>,
    /// The largest movement of the target by a single cause over all that the robot was identified in which the poses
    /// leave room for, mm.
    pub elsewhere_mm: f64,
    /// What matters, mm: the robot's own errors, where nothing else is said.
    pub tolerance_mm: f64,
    /// Whether the points are those of cameras, or another instrument's.
    pub by_cameras: bool,
    /// How far what was corrected of the links moves the target at these poses, mm: where they stand outside of what
    /// was identified, as much may be off.
    pub correction_mm: f64,
    /// By how much half of the points and more miss the robot, beyond what their readings are off by, mm.
    pub missed_mm: f64,
    /// The joints whose ranges many rows are outside of, where a change is no more than that.
    pub extrapolated: Vec<String>,
}

impl Before {
    /// The same where these joints stand outside of what was identified. Links hold everywhere; a term that follows an
    /// angle was seen over a range, and says of places beyond it no more than that there is something of its size.
    #[must_use]
    pub fn outside(&self, joints: &[usize]) -> Before {
        let mut beyond = self.clone();
        for (at, (parameter, by)) in self.parameters.iter().zip(&self.correction).enumerate() {
            let follows = match parameter {
                Parameter::Harmonic(joint, _) | Parameter::Wobble(joint, _) | Parameter::Coupling(_, joint) => {
                    joints.contains(joint)
                }
                Parameter::Gravity(..) | Parameter::Bending(..) => !joints.is_empty(),
                _ => false,
            };
            if follows {
                beyond.covariance[(at, at)] += (by / parameter.file_unit().1).powi(2);
            }
        }
        beyond
    }

    /// Columns and amounts of what was corrected of the robot without its tool.
    pub(super) fn corrected(&self) -> (Vec<(usize, f64)>, Vec<f64>) {
        let links = self.parameters.iter().zip(&self.correction).enumerate();
        let links = links.filter(|(_, (parameter, _))| !matches!(parameter, Parameter::V(_)));
        links.map(|(at, (parameter, by))| ((at, 1.0 / parameter.file_unit().1), *by)).unzip()
    }
}

impl Recheck {
    /// The causes' words for files, with `|` between those that are not told apart; empty where nothing changed.
    pub fn cause(&self) -> String {
        match (self.changed, self.likeliest.is_empty()) {
            (true, true) => "unknown".to_owned(),
            (true, false) => self.likeliest.iter().map(|(word, _)| word.as_str()).collect::<Vec<_>>().join("|"),
            (false, _) if self.placements.iter().any(|p| p.moved) => {
                let instead = self.instead.iter().map(|(word, _)| word.as_str());
                ["camera-moved", "joint-1"].into_iter().chain(instead).collect::<Vec<_>>().join("|")
            }
            (false, _) => String::new(),
        }
    }

    /// Whether the readings scatter more than they did, and that is all that they show.
    pub fn scatters(&self) -> bool {
        self.likeliest.iter().any(|(word, _)| word == SCATTER)
    }

    /// Whether no change is seen only because the robot was not known as well as it is held to be.
    pub fn is_unknown_here(&self) -> bool {
        self.is_open() && self.missed_mm > self.tolerance_mm
    }

    /// Whether no change is told: figures are then those of what one may be.
    pub fn is_open(&self) -> bool {
        self.scatters() || self.cause().is_empty()
    }

    /// The largest movement of the target by a single cause that is not ruled out, at these poses and wherever the
    /// robot was identified, mm.
    pub fn room_mm(&self) -> f64 {
        self.at_most_mm.max(self.elsewhere_mm)
    }

    /// The rows that fit far worse than the rest, for a person; `None` where there are none.
    pub fn of_strays(&self) -> Option<String> {
        match &self.strays[..] {
            [] => None,
            [one] => Some(format!("row {one} fits far worse than the rest: take it again")),
            all => Some(format!("rows {} fit far worse than the rest: take them again", all.join(", "))),
        }
    }

    /// What the poses see nothing of, for a person; `None` where they see of everything.
    pub fn unseen(&self) -> Option<String> {
        let unseen = self.causes.iter().filter(|cause| cause.amount.is_none()).map(|cause| cause.what.as_str());
        let unseen = unseen.collect::<Vec<_>>();
        (!unseen.is_empty()).then(|| unseen.join(", "))
    }

    /// What changed, for a person.
    pub fn statement(&self) -> String {
        let moved: Vec<String> = self
            .placements
            .iter()
            .filter(|p| p.moved)
            .map(|p| format!("group {} by {:.4} mm and {:.4} deg", p.group, p.shift_mm, p.turn_rad.to_degrees()))
            .collect();
        if !self.extrapolated.is_empty() {
            let moved = moved
                .first()
                .map(|group| format!("{} elsewhere ({group})", self.stands().replace(" stand", " that stand")));
            let found = self.likeliest.first().map(|(_, words)| words.clone()).or(moved);
            let found = found.map_or_else(String::new, |found| format!(", as by {found},"));
            return format!(
                "these poses stand where the robot was not identified ({}): what is off there{found} is no more than what was corrected \
                 of the robot, and may be what its model lacks as well as a change",
                self.extrapolated.join(", ")
            );
        }
        match (self.changed, self.likeliest.is_empty()) {
            (true, true) => "the robot changed, and no single cause explains how".to_owned(),
            (true, false) => {
                let causes = self.likeliest.iter().map(|(_, words)| words.as_str()).collect::<Vec<_>>().join(", or ");
                let whose = if self.by_cameras { "the cameras" } else { "the instrument" };
                match moved.is_empty() {
                    true => causes,
                    false => format!("{causes}; and {whose} moved, or the zero of joint 1: {}", moved.join(", ")),
                }
            }
            (false, _) if !moved.is_empty() => self.of_moved(&moved.join(", ")),
            (false, _) if self.is_unknown_here() => format!(
                "no change beyond chance, but half of the poses miss the robot by {:.4} mm and more: it is not known so well there",
                self.missed_mm
            ),
            (false, _) => "no change beyond chance".to_owned(),
        }
    }

    /// Who measured and stands.
    fn stands(&self) -> &'static str {
        if self.by_cameras { "the cameras stand" } else { "the instrument stands" }
    }

    /// Whether the poses rule out that the robot changed: in place of the sensor that moved, and beside it by as much
    /// as matters.
    pub fn is_same(&self) -> bool {
        !self.changed && self.instead.is_empty() && self.room_mm().max(self.missed_mm) <= self.tolerance_mm
    }

    /// Of placements that moved, or seem to.
    fn of_moved(&self, moved: &str) -> String {
        let (stands, instead) = (self.stands(), self.instead.iter().map(|(_, words)| words.as_str()));
        match (self.is_same(), self.instead.is_empty()) {
            (true, _) => format!("the robot is the same; {stands} elsewhere, or the zero of joint 1 moved: {moved}"),
            (_, true) => format!(
                "{stands} elsewhere, or the zero of joint 1 moved: {moved}; whether the robot changed as well these poses leave open, by up to {:.4} mm \
                 where it was identified",
                self.room_mm()
            ),
            (_, false) => format!(
                "{stands} elsewhere, or the zero of joint 1 moved ({moved}), or the robot changed: {}; these poses do not tell which",
                instead.collect::<Vec<_>>().join(", or ")
            ),
        }
    }
}
