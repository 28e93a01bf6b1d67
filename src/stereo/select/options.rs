//! What may be forced or known of lens and board, and what was chosen.

use std::sync::{Arc, OnceLock};

use crate::stereo::model::{KnownLenses, Layout, Values};
use crate::stereo::select::model_comparison::{LensScore, Trial};
use crate::stereo::select::pair_motion::KnownMotion;
use crate::stereo::solve::{Priors, Problem, Solved};
use crate::stereo::{Error, Lens};

/// The lens of all cameras whose pictures do not ask for more. What hand-held pictures leave open of its terms is held
/// by what is expected of lenses, so that nothing simpler is needed.
pub(super) const SIMPLEST: Lens = Lens::Brown5;

/// What may be forced.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Options {
    /// The lens; chosen by held-out pairs where `None`.
    pub lens: Option<Lens>,
    /// Whether the board's shape is free; decided by held-out pairs where `None`.
    pub shape: Option<bool>,
    /// Lenses that are known before the pictures.
    pub known: Option<KnownLenses>,
}

/// Variances of the shared numbers over what the weighted corners alone say, where lenses are known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownScatter {
    /// By so much more the lenses count than the corners do.
    pub lenses: f64,
    /// So much the pairs scatter at least: an earlier calibration may have had more of them, and know it better.
    pub pairs: f64,
    /// How the link of the two pictures moved from pair to pair of an earlier calibration that had more of them.
    pub motion: Option<KnownMotion>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// What is free.
    pub layout: Layout,
    /// Values near the minimum of that model, where it was tried.
    pub near: Option<Values>,
    /// What is expected of that model.
    pub priors: Priors,
    /// Where lenses are known: beside what scatter.
    pub scatter: Option<KnownScatter>,
    /// Every lens of the ladder; empty where the lens was forced.
    pub scores: Vec<LensScore>,
    /// The pairs with it, once they were solved; copies share it.
    pub solved: Arc<OnceLock<Solved>>,
}

impl Choice {
    /// The pairs with what was chosen for them, which `start` holds.
    pub fn solve(&self, start: &Problem) -> Result<Solved, Error> {
        if let Some(solved) = self.solved.get() {
            return Ok(solved.clone());
        }
        let values = self.near.clone().unwrap_or_else(|| start.values.clone());
        let solved = Problem { values, priors: self.priors.clone(), views: start.views.clone() }.solve(&self.layout)?;
        Ok(self.solved.get_or_init(|| solved).clone())
    }

    /// The same where its lens is simpler than this one, or else the richest that is.
    pub fn below(self, lens: Option<Lens>) -> Choice {
        let is_below = lens.is_none() || self.layout.left < lens;
        if is_below { self } else { self.simpler().map_or(self, |simpler| simpler.below(lens)) }
    }

    /// The richest lens simpler than the chosen one that the pairs determined when it was tried.
    pub fn simpler(&self) -> Option<Choice> {
        let tried = self.scores.iter().filter_map(|score| score.trial.as_ref());
        let simpler =
            tried.filter(|trial| trial.layout.left < self.layout.left).max_by_key(|trial| trial.layout.left)?;
        let Trial { layout, values, priors, .. } = simpler.clone();
        Some(Choice { layout, near: Some(values), priors, solved: Arc::default(), ..self.clone() })
    }
}
