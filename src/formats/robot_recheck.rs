//! `verify.json`: whether a robot still is the identified one. The history has the form of [`super::recheck`].

use camino::Utf8Path;
use serde::Serialize;

use super::recheck::Standing;
use crate::identify::judge::recheck::{CauseSeen, Moved, Recheck};

/// The history's name in a results folder.
pub const HISTORY: &str = "verify.csv";

/// The file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RobotRecheckFile {
    /// What is said of the robot.
    pub standing: Standing,
    tolerance_mm: f64,
    /// The robot that was compared with.
    against: String,
    poses: Vec<String>,
    /// One or, not told apart, several with `|`; empty where nothing changed.
    cause: String,
    statement: String,
    /// By how much the change moves the target, mm.
    effect_mm: f64,
    /// The largest movement of the target that a single cause could make without being seen in nineteen of twenty checks, mm.
    seen_mm: f64,
    causes: Vec<CauseRecord>,
    placements: Vec<PlacementRecord>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct CauseRecord {
    cause: String,
    what: String,
    unit: &'static str,
    /// `null` where the poses see nothing of it.
    amount: Option<f64>,
    sigma: Option<f64>,
    effect_mm: f64,
    /// The smallest change that nineteen of twenty checks see, and by how much it moves the target.
    seen: Option<f64>,
    seen_mm: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct PlacementRecord {
    group: String,
    moved: bool,
    shift_mm: f64,
    turn_rad: f64,
    seen_mm: f64,
}

impl From<&CauseSeen> for CauseRecord {
    fn from(seen: &CauseSeen) -> CauseRecord {
        let told = |value: f64| seen.amount.map(|_| value);
        CauseRecord {
            cause: seen.word.clone(),
            what: seen.words.clone(),
            unit: seen.unit,
            amount: seen.amount.map(|(amount, _)| amount),
            sigma: seen.amount.map(|(_, sigma)| sigma),
            effect_mm: seen.effect_mm,
            seen: told(seen.seen),
            seen_mm: told(seen.seen_mm),
        }
    }
}

impl From<&Moved> for PlacementRecord {
    fn from(moved: &Moved) -> PlacementRecord {
        PlacementRecord {
            group: moved.group.clone(),
            moved: moved.moved,
            shift_mm: moved.shift_mm,
            turn_rad: moved.turn_rad,
            seen_mm: moved.seen_mm,
        }
    }
}

impl RobotRecheckFile {
    /// Gathers the figures.
    pub fn new(recheck: &Recheck, against: &Utf8Path, tolerance_mm: f64) -> RobotRecheckFile {
        let changed = !recheck.cause().is_empty();
        RobotRecheckFile {
            standing: Standing::of(changed, recheck.effect_mm, recheck.seen_mm, tolerance_mm),
            tolerance_mm,
            against: against.to_string(),
            poses: recheck.poses.clone(),
            cause: recheck.cause(),
            statement: recheck.statement(),
            effect_mm: recheck.effect_mm,
            seen_mm: recheck.seen_mm,
            causes: recheck.causes.iter().map(CauseRecord::from).collect(),
            placements: recheck.placements.iter().map(PlacementRecord::from).collect(),
        }
    }
}
