//! Whether rows that the links alone do not explain as one robot are of one with a term more.
//!
//! In: parts of the rows that seem to be of different robots, or of different states of one, and what these leave. Out: whether one robot with a
//! term beyond its links, in one state, leaves too little in all of them for that. Goes wrong: a change along the rows that a term follows, as
//! where a joint only turned one way while it happened.

use rayon::prelude::*;

use super::fit::{Points, TARGET};
use super::{MUCH_LARGER, Table};
use crate::identify::model::ladder::{Chain, Terms};
use crate::robot::Parameter;

impl Points {
    /// The same with these parameters beside those of the links.
    pub(super) fn with_terms(&self, more: impl IntoIterator<Item = Parameter>) -> Points {
        let mut parameters = self.parameters.clone();
        let before_target = parameters.len() - TARGET;
        parameters.splice(before_target..before_target, more);
        Points { parameters, ..self.clone() }
    }
}

impl Table {
    /// Whether one robot with any of the terms that `identify` may keep leaves less in these parts than what is much larger than several do.
    pub(super) fn is_one_beyond_links(&self, parts: &[Vec<usize>], apart_mm: f64) -> bool {
        let robot = &self.points.robot;
        let links = Terms { chain: Chain::Mdh, ..Terms::NOMINAL };
        let weights = self.points.without_gross(parts);
        // From where the links end: far from there a term that hardly differs from a link's runs away.
        let (_, near) = self.points.solved(parts, &weights);
        links.successors(robot).into_par_iter().any(|terms| {
            let more = terms.parameters(robot).into_iter().filter(|p| !self.points.parameters.contains(p));
            let left = self.points.with_terms(more).together_from(parts, &weights, &near);
            left.scatter_mm() < MUCH_LARGER * apart_mm
        })
    }
}
