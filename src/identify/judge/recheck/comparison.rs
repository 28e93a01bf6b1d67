//! What some rows say of the old robot.

use super::compared::{Compared, Look, rows};
use super::found::{Before, CauseSeen, Moved, Recheck, Stood};
use super::looks::Looks;
use super::moves::{Moves, Off, placements};
use super::suspects::{Suspect, suspects};
use crate::difference::Difference;
use crate::identify::Error;
use crate::identify::data::dataset::Dataset;
use crate::identify::judge::uncertainty::stated_mm;
use crate::identify::residuals::eliminate::Block;
use crate::robot::{Parameter, Robot};

/// What is compared.
pub(super) struct Comparison<'a> {
    pub(super) set: &'a Dataset,
    pub(super) robot: &'a Robot,
    pub(super) before: &'a Before,
    pub(super) stood: Stood<'a>,
    /// What is known of the robot, and behind it what else may have changed.
    pub(super) parameters: Vec<Parameter>,
    pub(super) oriented: bool,
}

/// What some of the rows say.
pub(super) struct Said {
    pub(super) recheck: Recheck,
    pub(super) difference: Difference,
    /// Logarithm of the likelihood of the likeliest cause that explains a change.
    pub(super) likelihood: Option<f64>,
}

impl Comparison<'_> {
    /// Calls `with` with these rows beside the old robot.
    fn compared<T>(&self, used: &[usize], with: impl FnOnce(&Compared) -> T) -> T {
        let rows = rows(self.set, self.robot, &self.parameters, used, self.oriented, self.before.trust);
        with(&Compared { rows: &rows, before: self.before, count: self.parameters.len() + 1 })
    }

    /// What these rows leave of the old robot.
    pub(super) fn look(&self, used: &[usize]) -> Option<Look> {
        self.compared(used, |compared| Some(compared.at(&vec![0.0; compared.count])?.1))
    }

    /// By how much leaving out each of these rows would shrink what they leave.
    pub(super) fn gains(&self, used: &[usize]) -> Vec<(usize, f64)> {
        self.compared(used, |compared| compared.gains())
    }

    pub(super) fn said(&self, used: &[usize]) -> Result<Said, Error> {
        let undetermined = || Error::NothingDetermined { poses: used.len() };
        self.compared(used, |compared| self.of(compared, used)).ok_or_else(undetermined)
    }

    fn of(&self, compared: &Compared, used: &[usize]) -> Option<Said> {
        let mut suspects = suspects(self.robot, &self.parameters);
        for suspect in &mut suspects {
            suspect.variance = self.before.along.get(&suspect.word).map_or(1.0, |times| times.max(1.0));
        }
        let (linear, look) = compared.at(&vec![0.0; compared.count])?;
        let moves = Moves::new(&linear, compared.count);
        let looks = Looks { look, again: &|offsets| compared.at(offsets).map(|(_, look)| look), suspects: &suspects };
        let causes: Vec<CauseSeen> =
            suspects.iter().filter(|s| s.columns.len() == 1).map(|s| looks.of(s, &moves)).collect();
        let changed = looks.is_change();
        let explained = if changed { looks.explained() } else { Vec::new() };
        let named = |(_, suspect, off): &(f64, &Suspect, Off)| (suspect.word.clone(), suspect.by(&off.amounts));
        let likeliest = explained.iter().map(named).collect();
        let placements = self.placements(compared, changed, explained.iter().map(|(.., off)| off));
        let instead = match !changed && placements.iter().any(|p| p.moved) {
            true => self.instead(compared, &suspects),
            false => Vec::new(),
        };
        let everywhere = Moves::over(self.robot, &self.parameters, &self.before.over);
        let elsewhere_mm = suspects.iter().map(|s| looks.room_mm(s, &everywhere)).fold(0.0, f64::max);
        let most = |of: fn(&CauseSeen) -> Option<f64>| causes.iter().filter_map(of).fold(0.0, f64::max);
        let (seen_mm, at_most_mm) = (most(|c| c.seen_mm), most(|c| c.at_most_mm));
        // Cameras that are said to stand as before do not take up what the robot is off.
        let in_base_mm = explained.iter().map(|(.., off)| moves.in_base_mm(&off.columns, &off.amounts));
        let of_robot_mm = match (changed, explained.is_empty()) {
            (true, false) => in_base_mm.fold(0.0, f64::max),
            (true, true) => compared.misfit_mm(),
            (false, _) => 0.0,
        };
        let effect_mm = placements.iter().filter(|p| p.moved).map(|p| p.shift_mm).fold(of_robot_mm, f64::max);
        let likelihood = explained.first().map(|(likelihood, ..)| *likelihood);
        let (poses, by_cameras) = (self.set.names(used), self.set.is_of_cameras());
        let (columns, amounts) = self.before.corrected();
        let correction_mm = moves.in_base_mm(&columns, &amounts);
        let (strays, extrapolated) = (Vec::new(), Vec::new());
        let recheck = Recheck {
            poses,
            strays,
            causes,
            changed,
            likeliest,
            placements,
            effect_mm,
            of_robot_mm,
            seen_mm,
            at_most_mm,
            instead,
            elsewhere_mm,
            tolerance_mm: self.before.p95_mm,
            by_cameras,
            correction_mm,
            missed_mm: compared.missed_mm(stated_mm(self.set).unwrap_or(0.0)),
            extrapolated,
        };
        Some(Said { recheck, difference: looks.look.difference, likelihood })
    }

    /// What may have changed of the robot where no placement moved, and explains what looks like placements that did.
    fn instead(&self, compared: &Compared, suspects: &[Suspect]) -> Vec<(String, String)> {
        let stood = |block: usize| {
            let Block::Points(points) = &compared.rows.blocks[block] else { return None };
            let row = compared.rows.rows[points.spots.first()?.pose];
            (self.stood)(&self.set.groups[self.set.poses[row].group].name)
        };
        let held = |offsets: &[f64]| compared.held(offsets, &stood);
        let Some(look) = held(&vec![0.0; compared.count]) else { return Vec::new() };
        let explained = Looks { look, again: &held, suspects }.explained();
        let others = explained.into_iter().filter(|(_, suspect, _)| suspect.word != "joint-1");
        others.map(|(_, suspect, off)| (suspect.word.clone(), suspect.by(&off.amounts))).collect()
    }

    /// Each placement against where it stood: moved where it did whichever of the causes it was. Of a change that
    /// nothing explains they tell nothing.
    fn placements<'a>(&self, compared: &Compared, changed: bool, causes: impl Iterator<Item = &'a Off>) -> Vec<Moved> {
        let placed = |off: &Off| placements(self.set, compared, off, self.stood);
        if !changed {
            return placed(&Off::nothing());
        }
        let of_causes: Vec<Vec<Moved>> = causes.map(placed).collect();
        let Some((first, others)) = of_causes.split_first() else { return Vec::new() };
        let in_all = |group: &str| {
            others.iter().all(|list| list.iter().any(|placement| placement.group == group && placement.moved))
        };
        let each = first.iter().cloned();
        each.map(|placement| Moved { moved: placement.moved && in_all(&placement.group), ..placement }).collect()
    }
}
