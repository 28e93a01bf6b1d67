//! `verify.json`: whether a robot still is the identified one. The history has the form of [`super::recheck`].

use camino::Utf8Path;
use serde::Serialize;

use super::recheck::Standing;
use crate::identify::judge::recheck::{CauseSeen, Moved, Recheck};

/// The history's name in a results folder.
pub const HISTORY: &str = "verify.csv";

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RobotRecheckFile {
    pub standing: Standing,
    tolerance_mm: f64,
    /// The robot that was compared with.
    against: String,
    poses: Vec<String>,
    /// Poses that fit far worse than the rest and were left out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    strays: Vec<String>,
    /// One or, not told apart, several with `|`; empty where nothing changed.
    cause: String,
    statement: String,
    /// By how much the change moves the target, mm.
    effect_mm: f64,
    /// The largest movement of the target that a single cause could make without being seen in nineteen of twenty checks, mm.
    seen_mm: f64,
    /// The largest movement of the target by a single cause that these poses leave room for, with a chance of nineteen in twenty, mm.
    at_most_mm: f64,
    /// The same wherever the robot was identified, mm.
    elsewhere_mm: f64,
    causes: Vec<CauseSeen>,
    placements: Vec<Moved>,
}

impl RobotRecheckFile {
    pub fn new(recheck: &Recheck, against: &Utf8Path, tolerance_mm: f64, own_data: bool) -> RobotRecheckFile {
        let changed = !recheck.cause().is_empty();
        let standing = match Standing::of(changed, recheck.effect_mm, recheck.room_mm(), tolerance_mm) {
            // Rows from before say nothing of what happened since, whatever they say.
            _ if own_data => Standing::OwnData,
            _ if !recheck.extrapolated.is_empty() || recheck.scatters() => Standing::Undecided,
            Standing::StillValid if !recheck.strays.is_empty() => Standing::Undecided,
            other => other,
        };
        RobotRecheckFile {
            standing,
            tolerance_mm,
            against: against.to_string(),
            poses: recheck.poses.clone(),
            strays: recheck.strays.clone(),
            cause: recheck.cause(),
            statement: recheck.statement(),
            effect_mm: recheck.effect_mm,
            seen_mm: recheck.seen_mm,
            at_most_mm: recheck.at_most_mm,
            elsewhere_mm: recheck.elsewhere_mm,
            causes: recheck.causes.clone(),
            placements: recheck.placements.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A robot of which nothing is off, with what the poses leave room for at them and elsewhere, mm.
    fn unchanged(at_most_mm: f64, elsewhere_mm: f64) -> Recheck {
        Recheck {
            poses: vec!["a".to_owned(); 10],
            strays: Vec::new(),
            causes: Vec::new(),
            changed: false,
            likeliest: Vec::new(),
            placements: Vec::new(),
            effect_mm: 0.0,
            seen_mm: at_most_mm,
            at_most_mm,
            instead: Vec::new(),
            elsewhere_mm,
            tolerance_mm: 0.05,
            by_cameras: true,
            correction_mm: 0.0,
            extrapolated: Vec::new(),
        }
    }

    /// Poses near to each other rule out a change at them, and none elsewhere; readings that scatter more rule out little and prove no change.
    #[test]
    fn a_robot_is_valid_where_it_was_identified_and_scatter_is_no_change() {
        let standing =
            |recheck: &Recheck| RobotRecheckFile::new(recheck, Utf8Path::new("r.toml"), 0.05, false).standing;
        assert_eq!(standing(&unchanged(0.012, 0.04)), Standing::StillValid);
        assert_eq!(standing(&unchanged(0.012, 1.2)), Standing::Undecided);
        let likeliest = vec![("scatter".to_owned(), "the readings scatter more".to_owned())];
        let scattered = Recheck { changed: true, likeliest, effect_mm: 0.14, ..unchanged(0.3, 0.4) };
        assert!(scattered.scatters() && standing(&scattered) == Standing::Undecided);
        let unknown = Recheck { likeliest: Vec::new(), ..scattered };
        assert_eq!(standing(&unknown), Standing::Changed);
    }
}
