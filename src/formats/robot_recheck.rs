//! `verify.json`: whether a robot still is the identified one. The history has the form of [`super::recheck`].

use camino::Utf8Path;
use serde_json::{Map, Value, json};

use super::recheck::Standing;
use crate::identify::judge::recheck::Recheck;

/// The history's name in a results folder.
pub const HISTORY: &str = "verify.csv";

/// What is said of the robot; `own_data` says that these are the rows that it was identified from.
pub fn standing(recheck: &Recheck, tolerance_mm: f64, own_data: bool) -> Standing {
    let changed = !recheck.cause().is_empty();
    match Standing::of(changed, recheck.effect_mm, recheck.room_mm(), tolerance_mm) {
        // Rows from before say nothing of what happened since, whatever they say.
        _ if own_data => Standing::OwnData,
        _ if !recheck.extrapolated.is_empty() || recheck.scatters() => Standing::Undecided,
        Standing::StillValid if !recheck.strays.is_empty() => Standing::Undecided,
        Standing::StillValid if recheck.is_unknown_here() => Standing::Undecided,
        other => other,
    }
}

/// The content of `verify.json`; `against` is the robot that was compared with.
pub fn content(recheck: &Recheck, standing: Standing, against: &Utf8Path, tolerance_mm: f64) -> Map<String, Value> {
    let fields = [
        ("standing", json!(standing)),
        ("tolerance_mm", json!(tolerance_mm)),
        ("against", json!(against)),
        ("poses", json!(recheck.poses)),
        // Poses that fit far worse than the rest and were left out.
        ("strays", json!(recheck.strays)),
        // One or, not told apart, several with `|`; empty where nothing changed.
        ("cause", json!(recheck.cause())),
        ("statement", json!(recheck.statement())),
        // By how much the change moves the target.
        ("effect_mm", json!(recheck.effect_mm)),
        // The largest movement of the target that a single cause could make without being seen in nineteen of twenty
        // checks.
        ("seen_mm", json!(recheck.seen_mm)),
        // The largest that these poses leave room for, with a chance of nineteen in twenty, at them and wherever the
        // robot was identified.
        ("at_most_mm", json!(recheck.at_most_mm)),
        ("elsewhere_mm", json!(recheck.elsewhere_mm)),
        ("causes", json!(recheck.causes)),
        ("placements", json!(recheck.placements)),
    ];
    let said = fields.into_iter().filter(|(key, _)| *key != "strays" || !recheck.strays.is_empty());
    said.map(|(key, value)| (key.to_owned(), value)).collect()
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
            of_robot_mm: 0.0,
            seen_mm: at_most_mm,
            at_most_mm,
            instead: Vec::new(),
            elsewhere_mm,
            tolerance_mm: 0.05,
            by_cameras: true,
            correction_mm: 0.0,
            missed_mm: 0.0,
            extrapolated: Vec::new(),
        }
    }

    /// Poses near to each other rule out a change at them, and none elsewhere; readings that scatter more rule out
    /// little and prove no change.
    #[test]
    fn a_robot_is_valid_where_it_was_identified_and_scatter_is_no_change() {
        let standing = |recheck: &Recheck| standing(recheck, 0.05, false);
        assert_eq!(standing(&unchanged(0.012, 0.04)), Standing::StillValid);
        assert_eq!(standing(&unchanged(0.012, 1.2)), Standing::Undecided);
        let missed = Recheck { missed_mm: 0.06, ..unchanged(0.012, 0.04) };
        assert_eq!(standing(&missed), Standing::Undecided);
        let likeliest = vec![("scatter".to_owned(), "the readings scatter more".to_owned())];
        let scattered = Recheck { changed: true, likeliest, effect_mm: 0.14, ..unchanged(0.3, 0.4) };
        assert!(scattered.scatters() && standing(&scattered) == Standing::Undecided);
        let unknown = Recheck { likeliest: Vec::new(), ..scattered };
        assert_eq!(standing(&unknown), Standing::Changed);
    }
}
