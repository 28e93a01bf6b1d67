//! The comparison itself.

use super::compared::{Compared, Look, rows};
use super::found::{Before, CauseSeen, Recheck};
use super::looks::Looks;
use super::moves::{Moves, placements};
use super::strays;
use super::suspects::{Suspect, suspects, zero};
use crate::difference::Difference;
use crate::identify::Error;
use crate::identify::data::dataset::Dataset;
use crate::identify::judge::locate::FEWEST_POSES;
use crate::identify::judge::placement::Uncertain;
use crate::robot::{Parameter, Robot};

/// Where the sensor stood by the name of the group.
pub type Stood<'a> = &'a dyn Fn(&str) -> Option<Uncertain>;

/// What is compared.
pub(super) struct Comparison<'a> {
    pub(super) set: &'a Dataset,
    robot: &'a Robot,
    before: &'a Before,
    stood: Stood<'a>,
    /// What is known of the robot, and behind it what else may have changed.
    parameters: Vec<Parameter>,
    oriented: bool,
}

/// What some of the rows say.
pub(super) struct Said {
    pub(super) recheck: Recheck,
    pub(super) difference: Difference,
    /// Logarithm of the likelihood of the likeliest cause that explains a change.
    pub(super) likelihood: Option<f64>,
}

/// Compares. A few rows that fit far worse than the rest are named and left out where the rest is then of one piece.
pub fn recheck(set: &Dataset, robot: &Robot, before: &Before, stood: Stood) -> Result<Recheck, Error> {
    let used = set.placing_rows(FEWEST_POSES)?;
    let mut parameters = before.parameters.clone();
    let others = (0..robot.joints.len()).map(zero(robot)).chain((0..3).map(Parameter::V));
    parameters.extend(others.filter(|p| !before.parameters.contains(p)));
    let oriented = set.has_rotations() && before.trust.rotation_rad.is_some();
    let comparison = Comparison { set, robot, before, stood, parameters, oriented };
    let whole = comparison.said(&used)?;
    Ok(strays::left_out(&comparison, &used, &whole).unwrap_or(whole.recheck))
}

impl Comparison<'_> {
    /// Numbers that a row tells.
    pub(super) fn numbers_of_row(&self) -> usize {
        if self.oriented { 6 } else { 3 }
    }

    /// Calls `with` with these rows beside the old robot.
    fn compared<T>(&self, used: &[usize], with: impl FnOnce(&Compared) -> T) -> T {
        let rows = rows(self.set, self.robot, &self.parameters, used, self.oriented, self.before.trust);
        with(&Compared { rows: &rows, before: self.before, count: self.parameters.len() + 1 })
    }

    /// What these rows leave of the old robot.
    pub(super) fn look(&self, used: &[usize]) -> Option<Look> {
        self.compared(used, |compared| Some(compared.at(&vec![0.0; compared.count])?.1))
    }

    pub(super) fn said(&self, used: &[usize]) -> Result<Said, Error> {
        let undetermined = || Error::NothingDetermined { poses: used.len() };
        self.compared(used, |compared| self.of(compared, used)).ok_or_else(undetermined)
    }

    fn of(&self, compared: &Compared, used: &[usize]) -> Option<Said> {
        let suspects = suspects(self.robot, &self.parameters);
        let (linear, look) = compared.at(&vec![0.0; compared.count])?;
        let moves = Moves::new(&linear, compared.count);
        let looks = Looks { look, again: &|offsets| compared.at(offsets).map(|(_, look)| look), suspects: &suspects };
        let causes: Vec<CauseSeen> =
            suspects.iter().filter(|s| s.columns.len() == 1).map(|s| looks.of(s, &moves)).collect();
        let changed = looks.is_change();
        let explained = if changed { looks.explained() } else { Vec::new() };
        let named = |(_, suspect, amounts): &(f64, &Suspect, Vec<f64>)| (suspect.word.clone(), suspect.by(amounts));
        let likeliest = explained.iter().map(named).collect();
        let placements = if changed { Vec::new() } else { placements(self.set, compared, &linear, self.stood) };
        let seen_mm = causes.iter().filter_map(|c| c.seen_mm).fold(0.0, f64::max);
        let effect_mm = match (changed, explained.first()) {
            (true, Some((_, suspect, amounts))) => moves.most_mm(&suspect.columns, amounts),
            (true, None) => compared.misfit_mm(),
            (false, _) => 0.0,
        };
        let effect_mm = placements.iter().filter(|p| p.moved).map(|p| p.shift_mm).fold(effect_mm, f64::max);
        let likelihood = explained.first().map(|(likelihood, ..)| *likelihood);
        let (poses, by_cameras) = (self.set.names(used), self.set.is_of_cameras());
        let strays = Vec::new();
        let recheck =
            Recheck { poses, strays, causes, changed, likeliest, placements, effect_mm, seen_mm, by_cameras };
        Some(Said { recheck, difference: looks.look.difference, likelihood })
    }
}
