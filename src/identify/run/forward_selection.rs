//! Up the ladder of models: which terms the robot gets, and which unknowns of the sensor.
//!
//! In: the rows that may be fitted. Out: the terms that are worth taking, with the held-out error of all that were
//! tried. From the nominal robot on the successor of least held-out error is taken that is worth its terms; the cells
//! that say so are linearised anew where the model that was taken fits, and the selection goes on from there.

use rayon::prelude::*;

use super::session::Session;
use crate::identify::Error;
use crate::identify::judge::cross_validation::{CrossValidation, HeldOut, clearly_less, root_mean};
use crate::identify::judge::folds;
use crate::identify::model::ladder::{Chain, Terms};
use crate::identify::residuals::rows::Rows;
use crate::identify::sensor::{EVIDENCE, Extra, Scatter, WARPS};
use crate::identify::settings::Model;
use crate::identify::solve::formulation::Formulation;
use crate::identify::solve::linearised::Linearised;
use crate::robot::Parameter;

/// A rung of the ladder, or a model, and how it did.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Judged {
    pub model: &'static str,
    pub terms: String,
    #[serde(skip)]
    pub of: Terms,
    /// Root mean square held-out error of a number, mm; `None` where it could not be judged.
    pub held_out_mm: Option<f64>,
    /// The same of each way in which rows were held out: regions or placements first, then here and there, several
    /// times.
    pub by_way_mm: Vec<f64>,
}

/// In how many ways to hold rows out a model has less error than another.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Certainty {
    /// The other model.
    pub than: String,
    /// Ways in which it has less error.
    pub better: usize,
    /// Ways in all.
    pub of: usize,
}

/// How sure the choice of `terms` is: against the nominal robot, and against the model that comes nearest of those that
/// do not contain it. Richer ones may have a little less error by chance: they must make the data more probable, too.
pub fn certainty(judged: &[Judged], terms: &Terms) -> Vec<Certainty> {
    let Some(chosen) = judged.iter().find(|j| j.of == *terms) else { return Vec::new() };
    let against = |other: &Judged| Certainty {
        than: other.terms.clone(),
        better: chosen.by_way_mm.iter().zip(&other.by_way_mm).filter(|(a, b)| a < b).count(),
        of: chosen.by_way_mm.len().min(other.by_way_mm.len()),
    };
    let nominal = judged.iter().find(|j| j.of == Terms::NOMINAL);
    let others = judged.iter().filter(|j| j.of != Terms::NOMINAL && !j.of.contains(terms));
    let next = others.filter_map(|j| Some((j.held_out_mm?, j))).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, j)| j);
    nominal.filter(|n| n.of != *terms).into_iter().chain(next).map(against).collect()
}

/// Held-out errors of a model, of each way to hold rows out.
type Ways = Vec<HeldOut>;

/// Root mean square over all ways.
fn root_mean_of(ways: &Ways) -> Option<f64> {
    root_mean(&ways.concat())
}

/// Numbers a parameter that terms beyond MDH need at the least.
const MOST_PARAMETERS: f64 = 1.5;

/// Times that the ladder is climbed on, each time from where the model that was taken fits.
const MOST_CLIMBS: usize = 4;

impl Session<'_> {
    /// From the nominal robot up as far as it is worth it, with all that was judged.
    pub(super) fn select_terms(&mut self, model: Model) -> Result<(Terms, Vec<Judged>), Error> {
        let all = Terms::ALL.parameters(self.robot);
        let reference = self.reference(MOST_PARAMETERS);
        let mut at = Terms { chain: Chain::Mdh, ..reference };
        let formulation = Formulation::new(&self.task(&at.parameters(self.robot), model))?;
        let validations = self.validations(&all, &formulation, formulation.rows.scatter);
        let mut validations = self.take_warps(validations, &all, &formulation)?;
        let mut judged = Vec::new();
        let mut best = Terms::NOMINAL;
        for _ in 0..MOST_CLIMBS {
            let Some(next) = self.select_from(best, &validations, model, &mut judged) else {
                return Ok((Terms::default(), judged));
            };
            if next == best {
                break;
            }
            best = next;
            // What a poor model leaves over hides what the next term would explain: on from where this one fits.
            if best.chain < Chain::Mdh || best == at {
                break;
            }
            at = best;
            let formulation = Formulation::new(&self.task(&at.parameters(self.robot), model))?;
            validations = self.validations(&all, &formulation, formulation.rows.scatter);
        }
        Ok((best, judged))
    }

    /// Up the ladder from `best` by what these cells say; `None` where nothing can be held out.
    fn select_from(
        &self,
        mut best: Terms,
        validations: &[CrossValidation],
        model: Model,
        judged: &mut Vec<Judged>,
    ) -> Option<Terms> {
        let regions = validations.first()?;
        let judge = |terms: Terms, judged: &mut Vec<Judged>| -> Option<Ways> {
            let parameters = terms.parameters(self.robot);
            let tolerance = regions.tolerance(&parameters).0;
            let ways: Option<Ways> = validations.par_iter().map(|c| c.held_out(&parameters, &tolerance)).collect();
            let held_out_mm = ways.as_ref().and_then(root_mean_of);
            let by_way_mm = ways.iter().flatten().filter_map(root_mean).collect();
            judged.retain(|j| j.of != terms);
            judged.push(Judged { model: model.name(), terms: terms.name(), of: terms, held_out_mm, by_way_mm });
            ways
        };
        let evidence = |terms: &Terms| regions.tolerance(&terms.parameters(self.robot)).1;
        // Several are tried, so that what falls by chance must be probable, too; and of probable errors that whole
        // placements share, or of a robot that nobody has found fault with, only what falls clearly counts: where
        // regions or placements are held out, or every time that rows are held out here and there.
        let clearly = |new: &Ways, old: &Ways| {
            let falls: Vec<bool> = new.iter().zip(old).map(|(n, o)| clearly_less(n, o)).collect();
            falls.split_first().is_some_and(|(first, rest)| *first || !rest.is_empty() && rest.iter().all(|f| *f))
        };
        let worth = |new: &(Terms, Ways), old: &(Terms, Ways)| {
            evidence(&new.0) - evidence(&old.0) > EVIDENCE
                && match regions.whole_placements || old.0 == Terms::NOMINAL {
                    true => clearly(&new.1, &old.1),
                    false => root_mean_of(&new.1) < root_mean_of(&old.1),
                }
        };
        let mut at = (best, judge(best, judged)?);
        loop {
            let mut next: Option<(Terms, Ways)> = None;
            for terms in best.successors(self.robot) {
                let beyond = terms.chain == Chain::Mdh && terms != Terms::default();
                if beyond && !self.tells(&terms, MOST_PARAMETERS) {
                    continue;
                }
                let Some(held_out) = judge(terms, judged) else { continue };
                let new = (terms, held_out);
                // Against what it contains a richer model has to be worth its terms; among others the least error
                // decides.
                let better = next.as_ref().is_none_or(|pick| match terms.contains(&pick.0) {
                    true => worth(&new, pick),
                    false => root_mean_of(&new.1) < root_mean_of(&pick.1),
                });
                if better && worth(&new, &at) {
                    next = Some(new);
                }
            }
            let Some(next) = next else { break };
            best = next.0;
            at = next;
        }
        Some(best)
    }

    /// CrossValidation linearised where a formulation ended, at a scatter that need not be its own: regions or whole
    /// placements, and where it is regions rows here and there as often as they are cut anew.
    pub(super) fn validations(&self, all: &[Parameter], at: &Formulation, scatter: Scatter) -> Vec<CrossValidation> {
        let (rows, linearised) = self.linearised(all, at, scatter);
        let regions = CrossValidation::by_regions(&linearised, &rows, self.set, self.settings.folds);
        if regions.whole_placements {
            return vec![regions];
        }
        let scattered = folds::folds(self.set, &self.rows);
        let others: Vec<CrossValidation> =
            scattered.iter().map(|of_row| CrossValidation::by_folds(&linearised, &rows, of_row)).collect();
        std::iter::once(regions).chain(others).collect()
    }

    /// The rows of all these parameters at a scatter, linearised where a formulation of some of them ended.
    pub(super) fn linearised(&self, all: &[Parameter], at: &Formulation, scatter: Scatter) -> (Rows, Linearised) {
        let (offsets, reference) = (at.offsets_of(), at.parameters());
        let (of_robot, extras) = offsets.split_at(reference.len());
        let of_all = all.iter().map(|p| reference.iter().position(|q| q == p).map_or(0.0, |i| of_robot[i]));
        let wide: Vec<f64> = of_all.chain(extras.iter().copied()).collect();
        let rows = self.task(all, at.model).rows_at(scatter, &self.robot.shifted(reference, of_robot));
        let linearised = Linearised::new(&rows, &wide);
        (rows, linearised)
    }

    /// Takes the warps of cameras about whose errors nothing is stated where they make the data much more probable at
    /// one and the same scatter.
    fn take_warps(
        &mut self,
        validations: Vec<CrossValidation>,
        all: &[Parameter],
        at: &Formulation,
    ) -> Result<Vec<CrossValidation>, Error> {
        if self.set.supposed_scale.is_none() {
            return Ok(validations);
        }
        let (kept, reference) = (self.extras.len(), at.parameters());
        self.extras.extend((0..WARPS.len()).map(Extra::Warp));
        let with = Formulation::new(&self.task(reference, at.model))?;
        let richer = self.validations(all, &with, at.rows.scatter);
        if richer[0].tolerance(reference).1 > validations[0].tolerance(reference).1 + EVIDENCE {
            return Ok(richer);
        }
        self.extras.truncate(kept);
        Ok(validations)
    }
}
