//! Which lens model, and whether the board is flat: what predicts pairs that it has not seen.
//!
//! In: views that agree. Out: the layout to solve, and how each lens of the ladder predicts held-out pairs. Method: k
//! folds over the pairs ([`crate::stereo::select::cross_validation`]); the rig of a fold measures the pose of each pair
//! it has not seen, and what is left counts. The simplest model whose loss is within two standard errors of the best
//! wins (after Breiman et al. 1984), since a richer one extrapolates worse; unless the corners refute it: chi-squared
//! falls by more than chance for a richer one that predicts no worse. What the board's print alone would let a term of
//! no worth gain is allowed for in both. How much chance does, the richest lens tells that the pairs determine. Goes
//! wrong: pairs too few or too alike to tell models apart; then the simplest that fits wins, and
//! [`crate::stereo::judge::lengths::model_disagreement`] says what is at stake.

use std::sync::Arc;

use crate::imaging::Board;
use crate::stereo::board_pose::print_share::print_share;
use crate::stereo::model::Layout;
use crate::stereo::pairs::Missed;
use crate::stereo::select::model_comparison::{Chance, LensScore, OF_PAIR, Trial, gain_of_terms, score, simplest};
use crate::stereo::select::options::{Choice, KnownScatter, Options, SIMPLEST};
use crate::stereo::select::stated_uncertainty;
use crate::stereo::select::{each_alone, known_lenses};
use crate::stereo::solve::uncertainty;
use crate::stereo::solve::{Priors, Problem, Solved};
use crate::stereo::{Error, Lens};

/// Chooses what is free, where it is not forced. Where each camera alone tells more of its lens than the pairs, whose
/// pictures were not taken at one moment, the lenses are expected to be those; which model, the pairs say, where they
/// say anything. `of_pairs` is what the pairs choose; `missed` is how far pictures are missed, where that may decide;
/// `below` is a lens that turned out to be richer than the pairs determine.
pub fn choose(
    start: &Problem,
    of_pairs: impl FnOnce() -> Result<Choice, Error>,
    missed: Option<Missed>,
    board: &Board,
    options: &Options,
    below: Option<Lens>,
) -> Result<Choice, Error> {
    if let Some(known) = &options.known {
        return known_lenses::choose(start, known, options);
    }
    let of_pairs = of_pairs().map(|choice| choice.below(below));
    let Some(missed) = missed.filter(Missed::is_better_alone) else { return of_pairs };
    let chosen = of_pairs.as_ref().ok();
    let lens = chosen.and_then(|choice| choice.layout.left).unwrap_or(SIMPLEST);
    let paired = chosen.and_then(|choice| choice.solve(start).ok());
    let Some(known) = each_alone::lenses(start, board, lens, paired.as_ref(), missed) else { return of_pairs };
    let scores = of_pairs.map_or(Vec::new(), |choice| choice.scores);
    let choice = known_lenses::choose(start, &known, options)?;
    // How the pairs scatter, these pairs tell themselves.
    let scatter = choice.scatter.map(|scatter| KnownScatter { pairs: 1.0, ..scatter });
    Ok(Choice { scores, scatter, ..choice })
}

/// What the pairs choose, whatever each camera alone tells.
pub fn of_pairs(start: &Problem, board: &Board, options: &Options) -> Result<Choice, Error> {
    let choice =
        |layout, near, priors, scores| Choice { layout, near, priors, scatter: None, scores, solved: Arc::default() };
    let forced_shape = options.shape.or(options.lens.map(|_| false));
    if let (Some(lens), Some(shape)) = (options.lens, forced_shape) {
        let layout = Layout::rig(lens, shape);
        let priors = priors_of_forced(start, &layout);
        return Ok(choice(layout, None, priors, Vec::new()));
    }
    // Weights from a model that is at least as rich as most need; the comparison uses the same for all.
    let simple = start.solve_bent_or_flat(forced_shape, |shape| Layout::rig(SIMPLEST, shape));
    let (mut solved, layout) = simple.map_err(|e| match e {
        // Not even the simplest search ends: the pairs leave a valley, not a minimum.
        Error::NotConverged { .. } => Error::undetermined(),
        other => other,
    })?;
    if let Some(wide) = of_wide_lens(start, &solved, &layout) {
        solved = wide;
    }
    let scatter = stated_uncertainty::excess_scatter(&solved, &layout);
    let mut chance = Chance { scatter, print: print_excess(&solved, &layout, board) };
    // The lens is compared with the board bent, if it may be: a bow that is left out would look like a lens.
    let mut scores = ladder(&solved.problem, layout.shape, &chance, &[]);
    if let Some((problem, told)) = of_richest(&solved.problem, &scores, &chance, board) {
        chance = told;
        (solved.problem.views, solved.problem.priors) = (problem.views, problem.priors);
        scores = ladder(&solved.problem, layout.shape, &chance, &scores);
    }
    let bent = simplest(&scores, &chance).filter(|_| forced_shape.is_none() && layout.shape);
    let flat = bent.and_then(|bent| score(&solved.problem, bent.layout.left?, false).trial);
    let bends = bent
        .zip(flat)
        .is_none_or(|(bent, flat)| flat.is_worse_than(bent, &chance) || flat.is_refuted_by(bent, &chance));
    if !bends {
        scores = ladder(&solved.problem, false, &chance, &[]);
    }
    let Some(chosen) = simplest(&scores, &chance) else {
        // Some pairs cannot be left out without losing the cameras: nothing can be compared.
        let priors = solved.problem.priors.clone();
        return Ok(choice(layout, Some(solved.problem.values), priors, Vec::new()));
    };
    let fewer = fewer_terms(&solved.problem, chosen, &chance);
    let Trial { layout, values, priors, .. } = fewer.as_ref().unwrap_or(chosen).clone();
    Ok(choice(layout, Some(values), priors, scores))
}

fn print_excess(solved: &Solved, layout: &Layout, board: &Board) -> f64 {
    print_share(solved, board, layout).map_or(1.0, |print| print.excess)
}

/// The corners as the richest lens weighs them with which the pairs tell how they scatter, what is expected beside
/// pairs that scatter so, and what chance does then, where a richer lens than the simplest was tried. What the simpler
/// one lacks would else pass for scatter of the pairs, before which no term seems worth anything (Mallows,
/// Technometrics 15, 1973, takes the variance from the full model for the same reason). At least half of what the pairs
/// tell of a rig must be left to scatter.
fn of_richest(problem: &Problem, scores: &[LensScore], chance: &Chance, board: &Board) -> Option<(Problem, Chance)> {
    /// Two standard deviations of the scatter of one pair that chance alone makes.
    const BY_CHANCE: f64 = 1.5;
    let chosen = simplest(scores, chance)?.layout.count();
    let pairs = problem.views.len();
    let is_richer = |t: &&Trial| t.layout.count() >= chosen && t.layout.left > Some(SIMPLEST);
    let richer = scores.iter().rev().filter_map(|score| score.trial.as_ref()).filter(is_richer);
    richer.filter(|trial| 2 * trial.layout.count() <= OF_PAIR * pairs).find_map(
        |Trial { layout, values, priors, .. }| {
            let near = Problem { views: problem.views.clone(), values: values.clone(), priors: priors.clone() };
            let full = near.solve_on_trial(layout).ok()?;
            let scatter = stated_uncertainty::told_scatter(&full, layout)?;
            let told =
                Chance { scatter, print: print_excess(&full, layout, board) }.with_taken_up(layout.count(), pairs);
            let beyond = scatter / (1.0 + BY_CHANCE / (pairs as f64).sqrt());
            let priors = problem.priors.beside(beyond);
            Some((Problem { priors, ..full.problem }, told))
        },
    )
}

/// The pairs as a lens with the rational terms leaves them, where many corners lie far from where the simplest one puts
/// them, this one explains them and the pairs determine it. In wide pictures the simplest lens gives up the borders:
/// corners there hardly count with it, and no lens would gain anything by them.
fn of_wide_lens(start: &Problem, simplest: &Solved, layout: &Layout) -> Option<Solved> {
    /// How many times the usual distance (root mean square of a normal distribution) marks residuals with borders given
    /// up.
    const FAR: f64 = 2.0;
    let usual_px = simplest.noise.typical_px(&simplest.problem.views) * 2f64.sqrt();
    if simplest.rms_px < FAR * usual_px {
        return None;
    }
    let wide = Layout::rig(Lens::Rational8, layout.shape);
    let solved = Problem { values: simplest.problem.values.clone(), ..start.clone() }.solve(&wide).ok()?;
    solved.covariance(&wide).ok()?;
    let added = (wide.count() - layout.count()) as f64;
    let gain = solved.log_likelihood - simplest.log_likelihood;
    (2.0 * gain > added + 2.0 * (2.0 * added).sqrt()).then_some(solved)
}

/// A lens of fewer terms than the simplest of the ladder, where the pairs say so: the logarithm of its evidence
/// (Laplace's approximation; what is expected of the terms that it lacks is part of it) is larger. Corners that are
/// measured well tell a term that is not there from one that is; hand-held pictures do not, and keep all of them.
fn fewer_terms(problem: &Problem, five: &Trial, chance: &Chance) -> Option<Trial> {
    if five.layout.left != Some(SIMPLEST) {
        return None;
    }
    let loss = |trial: &Trial| gain_of_terms(&problem.priors, five, trial, chance.scatter);
    let fewer = Lens::LADDER.into_iter().filter(|lens| *lens < SIMPLEST);
    let trials = fewer.filter_map(|lens| Trial::new(problem, Layout::rig(lens, five.layout.shape)));
    let best = trials.filter_map(|trial| Some((loss(&trial)?, trial))).min_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0 < 0.0).then_some(best.1)
}

/// What is expected of a lens that was asked for. Rational terms and radial ones are exchanged for each other where a
/// lens bends little: where all of them are free and the pairs do not tell them apart, the terms after them do not need
/// them.
fn priors_of_forced(start: &Problem, layout: &Layout) -> Priors {
    let holds = layout.left > Some(Lens::Rational8)
        && start.solve(layout).and_then(|solved| solved.covariance(layout)).is_err();
    if holds { start.priors.holding_rational() } else { start.priors.clone() }
}

/// The simplest lens and those that are richer, each from where the best before it ended: a richer lens begins as a
/// simpler one. One that is expected to gain no more than chance cannot predict better, and is not tried. Rational
/// terms that did not prove themselves are held at zero in the lenses after them, which would only carry them on along
/// the valley where they are exchanged for the radial ones. `before`: the same with other weights; where lenses were
/// tried then, they start from there.
fn ladder(problem: &Problem, shape: bool, chance: &Chance, before: &[LensScore]) -> Vec<LensScore> {
    let mut problem = problem.clone();
    let mut simpler: Option<Layout> = None;
    let mut scores = Vec::new();
    for (i, lens) in Lens::LADDER.into_iter().filter(|lens| *lens >= SIMPLEST).enumerate() {
        let layout = Layout::rig(lens, shape);
        let known = before.get(i).and_then(|score| score.trial.as_ref());
        if let Some(known) = known {
            problem.values = known.values.clone();
        }
        let tried = known.is_some() || simpler.is_none_or(|simpler| expects_gain(&problem, &layout, &simpler));
        scores.push(if tried { score(&problem, lens, shape) } else { LensScore::untried(lens) });
        if lens == Lens::Rational8 {
            let best = simplest(&scores, chance);
            if best.is_none_or(|best| best.layout != layout) {
                problem.priors = problem.priors.holding_rational();
            }
            if let Some(best) = best {
                (problem.values, simpler) = (best.values.clone(), Some(best.layout));
            }
        } else if let Some(trial) = scores.last().and_then(|score| score.trial.as_ref()) {
            (problem.values, simpler) = (trial.values.clone(), Some(layout));
        }
    }
    scores
}

/// Whether a richer lens can be expected to explain more than noise would let it: more than two standard deviations
/// above the mean of a chi-square with as many degrees of freedom as it adds. Of a lens that cannot be determined
/// nothing is expected.
fn expects_gain(problem: &Problem, layout: &Layout, simpler: &Layout) -> bool {
    let start = problem.with_layout(layout);
    let expected = start.equations(layout).and_then(|equations| uncertainty::expected_decrease(&equations));
    let added = (layout.count() - simpler.count()) as f64;
    expected.is_some_and(|expected| expected > added + 2.0 * (2.0 * added).sqrt())
}
