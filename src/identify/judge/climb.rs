//! Up the ladder of models: which terms the robot gets, and which unknowns of the sensor.
//!
//! In: the rows that may be fitted. Out: the terms that are worth taking, with the held-out error of all that were tried. From the
//! nominal robot on the successor of least held-out error is taken that is worth its terms; the cells that say so are linearised anew
//! where the model that was taken fits, and the climb goes on from there.

use super::cells::{Cells, HeldOut, clearly_less, root_mean};
use super::choose::Session;
use crate::identify::Error;
use crate::identify::model::ladder::{Chain, Terms};
use crate::identify::residuals::weights::{EVIDENCE, Extra, Scatter, WARPS};
use crate::identify::settings::Model;
use crate::identify::solve::formulation::Formulation;
use crate::robot::Parameter;

/// A rung of the ladder, or a model, and how it did.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Judged {
    /// The model's name.
    pub model: &'static str,
    /// The terms in words.
    pub terms: String,
    /// Root mean square held-out error of a number, mm; `None` where it could not be judged.
    pub held_out_mm: Option<f64>,
}

/// Numbers a parameter that terms beyond MDH need at the least.
const MOST_PARAMETERS: f64 = 1.5;

/// Times that the ladder is climbed on, each time from where the model that was taken fits.
const MOST_CLIMBS: usize = 4;

impl Session<'_> {
    /// From the nominal robot up as far as it is worth it, with all that was judged.
    pub(super) fn climb(&mut self, model: Model) -> Result<(Terms, Vec<Judged>), Error> {
        let all = Terms::ALL.parameters(self.robot);
        let reference = self.reference(MOST_PARAMETERS);
        let mut at = Terms { chain: Chain::Mdh, ..reference };
        let parameters = at.parameters(self.robot);
        let formulation = Formulation::new(&self.task(&parameters, model))?;
        let scatter = formulation.rows.scatter;
        let cells = self.cells(&all, &parameters, &formulation, scatter, model);
        let mut cells = self.take_warps(cells, &all, &parameters, scatter, model)?;
        let mut judged = Vec::new();
        let mut best = Terms::NOMINAL;
        for _ in 0..MOST_CLIMBS {
            let Some(next) = self.climb_from(best, &cells, model, &mut judged) else {
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
            let parameters = at.parameters(self.robot);
            let formulation = Formulation::new(&self.task(&parameters, model))?;
            cells = self.cells(&all, &parameters, &formulation, formulation.rows.scatter, model);
        }
        Ok((best, judged))
    }

    /// Up the ladder from `best` by what these cells say; `None` where nothing can be held out.
    fn climb_from(&self, mut best: Terms, cells: &Cells, model: Model, judged: &mut Vec<Judged>) -> Option<Terms> {
        let judge = |terms: Terms, judged: &mut Vec<Judged>| -> Option<HeldOut> {
            let held_out = cells.held_out(&terms.parameters(self.robot));
            let (held_out_mm, terms) = (held_out.as_ref().and_then(root_mean), terms.name());
            judged.retain(|j| j.terms != terms);
            judged.push(Judged { model: model.name(), terms, held_out_mm });
            held_out
        };
        let evidence = |terms: &Terms| cells.tolerance(&terms.parameters(self.robot)).1;
        // Several are tried, so that what falls by chance must be probable, too; and of probable errors that whole placements share,
        // or of a robot that nobody has found fault with, only what falls clearly counts.
        let worth = |new: &(Terms, HeldOut), old: &(Terms, HeldOut)| {
            evidence(&new.0) - evidence(&old.0) > EVIDENCE
                && match cells.whole_placements() || old.0 == Terms::NOMINAL {
                    true => clearly_less(&new.1, &old.1),
                    false => root_mean(&new.1) < root_mean(&old.1),
                }
        };
        let mut at = (best, judge(best, judged)?);
        loop {
            let mut next: Option<(Terms, HeldOut)> = None;
            for terms in best.successors(self.robot) {
                let beyond = terms.chain == Chain::Mdh && terms != Terms::default();
                if beyond && !self.tells(&terms, MOST_PARAMETERS) {
                    continue;
                }
                let Some(held_out) = judge(terms, judged) else { continue };
                let new = (terms, held_out);
                // Against what it contains a richer model has to be worth its terms; among others the least error decides.
                let better = next.as_ref().is_none_or(|pick| match terms.contains(&pick.0) {
                    true => worth(&new, pick),
                    false => root_mean(&new.1) < root_mean(&pick.1),
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

    /// Cells linearised where a formulation ended, at a scatter that need not be its own.
    pub(super) fn cells(
        &self,
        all: &[Parameter],
        reference: &[Parameter],
        at: &Formulation,
        scatter: Scatter,
        model: Model,
    ) -> Cells {
        let offsets = at.offsets_of();
        let (of_robot, extras) = offsets.split_at(reference.len());
        let mut wide: Vec<f64> =
            all.iter().map(|p| reference.iter().position(|q| q == p).map_or(0.0, |i| of_robot[i])).collect();
        wide.extend_from_slice(extras);
        let levers = self.robot.shifted(reference, of_robot);
        let rows = self.task(all, model).rows_at(scatter, &levers);
        Cells::new(self.set, &rows, &wide, self.settings.folds)
    }

    /// Takes the warps of cameras about whose errors nothing is stated where they make the data much more probable at one and the same
    /// scatter.
    fn take_warps(
        &mut self,
        cells: Cells,
        all: &[Parameter],
        reference: &[Parameter],
        scatter: Scatter,
        model: Model,
    ) -> Result<Cells, Error> {
        if self.set.supposed_scale.is_none() {
            return Ok(cells);
        }
        let kept = self.extras.len();
        self.extras.extend((0..WARPS.len()).map(Extra::Warp));
        let with = Formulation::new(&self.task(reference, model))?;
        let richer = self.cells(all, reference, &with, scatter, model);
        if richer.tolerance(reference).1 > cells.tolerance(reference).1 + EVIDENCE {
            return Ok(richer);
        }
        self.extras.truncate(kept);
        Ok(cells)
    }
}
