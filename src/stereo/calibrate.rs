//! From corners to a calibrated rig: start, screening, bundle, covariance.
//!
//! In: the corners of all pairs. Out: the rig with its covariance, the pairs that were used with their residuals, the pairs that were
//! not and why. Goes wrong: too few pairs, pairs that contradict each other, views too similar to tell the cameras.

use crate::imaging::{Board, Corners, Side, Skipped};
use crate::statistics::median;
use crate::stereo::data::corner_noise::Noise;
use crate::stereo::data::neighbour_correlation::NeighbourCorrelation;
use crate::stereo::data::view::View;
use crate::stereo::model::parameters::{Layout, Values};
use crate::stereo::model::rig::Covariance;
use crate::stereo::pairs::candidates::Candidates;
use crate::stereo::pairs::consensus::{self, Consensus};
use crate::stereo::pairs::discarded::too_few_pairs;
use crate::stereo::pairs::{Cause, Discarded, DiscardedPair, FEWEST_PAIRS, Standing};
use crate::stereo::select::lens_ladder;
use crate::stereo::select::lens_ladder::Options;
use crate::stereo::select::model_comparison::LensScore;
use crate::stereo::select::pair_scatter::PairScatter;
use crate::stereo::select::stated_uncertainty::{self, Stated, Witness};
use crate::stereo::solve::problem::Problem;
use crate::stereo::solve::uncertainty::Uncertainty;
use crate::stereo::target::print_share::PrintShare;
use crate::stereo::{Error, Lens, Rig};

/// A calibrated rig with all that it was made from.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The board that was seen.
    pub board: Board,
    /// What was free.
    pub layout: Layout,
    /// The pairs that were used, with whitened corners; outliers are inactive.
    pub views: Vec<View>,
    /// Rig, shape, a pose a pair; the rig carries its covariance.
    pub values: Values,
    /// Covariance of the shared numbers and of each pose.
    pub uncertainty: Uncertainty,
    /// How corners scatter.
    pub noise: Noise,
    /// The same without the board's print: what pictures of another board scatter by.
    pub own_noise: Noise,
    /// How neighbouring corners' residuals hang together; the covariance allows for the information that they share.
    pub neighbours: NeighbourCorrelation,
    /// How the pairs scatter about the common rig; the covariance allows for more than the corners' noise lets expect.
    pub pair_scatter: PairScatter,
    /// Richer models whose additional terms are more than chance.
    pub witnesses: Vec<Witness>,
    /// Root mean square of the length of the 2-D residuals of both pictures, px.
    pub rms_px: f64,
    /// Pairs that were not used.
    pub skipped: Vec<Skipped>,
    /// The same with causes, and the corners that were rejected.
    pub discarded: Discarded,
    /// Which pairs the rig is that of.
    pub standing: Standing,
    /// How the lenses that were tried predict held-out pairs; empty where the lens was forced.
    pub lens_scores: Vec<LensScore>,
}

impl Calibration {
    /// The rig with its covariance.
    pub fn rig(&self) -> &Rig {
        &self.values.shared.rig
    }

    /// The pairs with the values reached, to solve again in part or with another model.
    pub fn problem(&self) -> Problem {
        Problem { views: self.views.clone(), values: self.values.clone() }
    }

    /// The corners as they were used: outliers and the corners of pairs that are out are marked, turned boards turned.
    pub fn mark(&self, corners: &Corners) -> Corners {
        let mut marked = corners.clone();
        for pair in &mut marked.pairs {
            let view = self.views.iter().find(|view| view.pair == pair.pair);
            for (side, list) in [(Side::Left, &mut pair.left), (Side::Right, &mut pair.right)] {
                for corner in list.iter_mut() {
                    let seen = view.and_then(|v| v.observations.iter().find(|o| o.side == side && o.px == corner.px));
                    corner.used = corner.used && seen.is_some_and(|o| o.active);
                    if let Some(o) = seen {
                        (corner.col, corner.row) = (o.col, o.row);
                    }
                }
                list.sort_by_key(|c| (c.row, c.col));
            }
        }
        marked
    }
}

/// The lens with which pairs are judged before there is another: what nearly all cameras need.
const JUDGING_LENS: Lens = Lens::Brown5;

/// A picture that loses more than this share of its corners, and this many times the share that pictures usually lose, is not what it
/// seems: of Gaussian corners one in a million is lost.
const LOST_SHARE: f64 = 0.1;
const LOST_TIMES_USUAL: f64 = 3.0;

/// Calibrates both cameras and the rig.
pub fn calibrate(corners: &Corners, options: &Options) -> Result<Calibration, Error> {
    let candidates = Candidates::new(corners)?;
    let mut consensus = consensus::find(&candidates, JUDGING_LENS.max(options.lens.unwrap_or(JUDGING_LENS)))?;
    let choose = |consensus: &Consensus| {
        lens_ladder::choose(&consensus.problem(), &corners.board, options).map_err(|e| e.without(&consensus.skipped()))
    };
    let mut choice = choose(&consensus)?;
    if let Some(richer) = choice.layout.left.filter(|lens| options.lens.is_none() && *lens > JUDGING_LENS) {
        let again = consensus::find(&candidates, richer)?;
        if again.names() != consensus.names() {
            choice = choose(&again)?;
        }
        consensus = again;
    }
    let lens_ladder::Choice { layout, near, scores: lens_scores } = choice;
    let start = consensus.problem();
    let near = near.filter(|near| near.poses.len() == start.views.len());
    let mut solved = Problem { values: near.unwrap_or(start.values), ..start }
        .solve(&layout)
        .map_err(|e| e.without(&consensus.skipped()).of_lens(options.lens))?;
    let Consensus { mut discarded, standing, .. } = consensus;
    loop {
        let lost = emptied(&solved.problem.views);
        if lost.is_empty() {
            break;
        }
        let kept = solved.problem.subset(|i| lost.iter().all(|(at, _)| *at != i));
        discarded.extend(lost.into_iter().map(|(_, pair)| pair));
        discarded.sort_by(|a, b| a.pair.cmp(&b.pair));
        if kept.views.len() < FEWEST_PAIRS {
            return Err(too_few_pairs(kept.views.len(), &discarded));
        }
        let skipped = || discarded.iter().map(DiscardedPair::skipped).collect::<Vec<Skipped>>();
        solved = kept.solve(&layout).map_err(|e| e.without(&skipped()))?;
    }
    let neighbours = solved.neighbours(&corners.board);
    let by_noise = solved.uncertainty(&layout).map_err(|e| e.of_lens(options.lens))?.scaled(neighbours.inflation());
    let without_scatter = by_noise.shared.clone();
    let print = PrintShare::of(&solved, &corners.board, &layout);
    let print_excess = print.as_ref().map_or(1.0, |print| print.excess);
    let Stated { mut uncertainty, pair_scatter, witnesses } =
        stated_uncertainty::state(&solved, &layout, by_noise, &neighbours, &lens_scores, print_excess);
    let Problem { views, mut values } = solved.problem;
    let mut own_noise = solved.noise;
    if let Some(print) = print {
        uncertainty.shared += print.covariance - without_scatter;
        own_noise = print.own_noise;
    }
    values.shared.rig.covariance = Some(Covariance { order: layout.names(), matrix: uncertainty.shared.clone() });
    Ok(Calibration {
        board: corners.board,
        layout,
        rms_px: solved.rms_px,
        noise: solved.noise,
        own_noise,
        neighbours,
        pair_scatter,
        witnesses,
        skipped: discarded.iter().map(DiscardedPair::skipped).collect(),
        discarded: Discarded::new(&views, discarded),
        standing,
        lens_scores,
        views,
        values,
        uncertainty,
    })
}

/// Pairs that lost a good part of the corners in one of their pictures, and their places.
fn emptied(views: &[View]) -> Vec<(usize, DiscardedPair)> {
    let lost = |view: &View, side: Side| {
        let seen = view.observations.iter().filter(|o| o.side == side).count();
        (seen - view.active(side).count(), seen)
    };
    let share = |view: &View, side: Side| lost(view, side).0 as f64 / lost(view, side).1.max(1) as f64;
    let usual = median(views.iter().flat_map(|view| Side::BOTH.map(|side| share(view, side)))).unwrap_or(0.0);
    let limit = LOST_SHARE.max(LOST_TIMES_USUAL * usual);
    let of = |(i, view): (usize, &View)| {
        let side = Side::BOTH.into_iter().find(|side| share(view, *side) > limit)?;
        let (lost, seen) = lost(view, side);
        let reason = format!(
            "{lost} of {seen} corners in the {} picture lie farther from the rig's prediction than their scatter allows: \
             partly covered, in motion, taken line by line (interlaced), or a light that moves edges",
            side.name()
        );
        Some((i, DiscardedPair::new(&view.pair, Cause::CornersLost, reason)))
    };
    views.iter().enumerate().filter_map(of).collect()
}
