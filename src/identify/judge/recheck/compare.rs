//! The comparison itself.

use super::compared::{Compared, rows};
use super::found::{Before, CauseSeen, Recheck};
use super::looks::Looks;
use super::moves::{Moves, placements};
use super::suspects::{Suspect, suspects, zero};
use crate::identify::Error;
use crate::identify::data::dataset::Dataset;
use crate::identify::judge::locate::FEWEST_POSES;
use crate::identify::judge::placement::Uncertain;
use crate::robot::{Parameter, Robot};

/// Compares. `stood` is where the sensor stood by the name of the group.
pub fn recheck(
    set: &Dataset,
    robot: &Robot,
    before: &Before,
    stood: &dyn Fn(&str) -> Option<Uncertain>,
) -> Result<Recheck, Error> {
    let used = set.placing_rows(FEWEST_POSES)?;
    let mut parameters = before.parameters.clone();
    let others = (0..robot.joints.len()).map(zero(robot)).chain((0..3).map(Parameter::V));
    parameters.extend(others.filter(|p| !before.parameters.contains(p)));
    let oriented = set.has_rotations() && before.trust.rotation_rad.is_some();
    let rows = rows(set, robot, &parameters, &used, oriented, before.trust);
    let suspects = suspects(robot, &parameters);
    let compared = Compared { rows: &rows, before, count: parameters.len() + 1 };
    let (linear, look) =
        compared.at(&vec![0.0; compared.count]).ok_or(Error::NothingDetermined { poses: used.len() })?;
    let moves = Moves::new(&linear, compared.count);
    let looks = Looks { look, again: &|offsets| compared.at(offsets).map(|(_, look)| look), suspects: &suspects };
    let causes: Vec<CauseSeen> =
        suspects.iter().filter(|s| s.columns.len() == 1).map(|s| looks.of(s, &moves)).collect();
    let changed = looks.is_change();
    let explained = if changed { looks.explained() } else { Vec::new() };
    let named = |(suspect, amounts): &(&Suspect, Vec<f64>)| (suspect.word.clone(), suspect.by(amounts));
    let likeliest = explained.iter().map(named).collect();
    let placements = if changed { Vec::new() } else { placements(set, &compared, &linear, stood) };
    let seen_mm = causes.iter().filter_map(|c| c.seen_mm).fold(0.0, f64::max);
    let effect_mm = match (changed, explained.first()) {
        (true, Some((suspect, amounts))) => moves.most_mm(&suspect.columns, amounts),
        (true, None) => compared.misfit_mm(),
        (false, _) => 0.0,
    };
    let effect_mm = placements.iter().filter(|p| p.moved).map(|p| p.shift_mm).fold(effect_mm, f64::max);
    let poses = set.names(&used);
    Ok(Recheck { poses, causes, changed, likeliest, placements, effect_mm, seen_mm, by_cameras: set.is_of_cameras() })
}
