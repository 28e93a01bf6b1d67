//! From corners to a calibrated rig: start, screening, bundle, covariance.
//!
//! In: the corners of all pairs. Out: the rig with its covariance, the pairs that were used with their residuals, the
//! pairs that were not and why. Goes wrong: too few pairs, pairs that contradict each other, views too similar to tell
//! the cameras.

use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector, Vector6};

use crate::imaging::{Board, Corners, Side, Skipped};
use crate::statistics::median;
use crate::stereo::board_pose::print_share::print_share;
use crate::stereo::data::{NeighbourCorrelation, Noise, View, residuals};
use crate::stereo::init::board_pose;
use crate::stereo::model::{Covariance, Layout, Values};
use crate::stereo::pairs::candidates::Candidates;
use crate::stereo::pairs::series::{self, Series};
use crate::stereo::pairs::{Discarded, DiscardedPair, Standing};
use crate::stereo::select::known_lenses::{self, LensCheck};
use crate::stereo::select::lens_ladder;
use crate::stereo::select::model_comparison::LensScore;
use crate::stereo::select::options::{Choice, Options};
use crate::stereo::select::pair_motion;
use crate::stereo::select::pair_scatter::PairScatter;
use crate::stereo::select::stated_uncertainty::{self, Stated, Witness};
use crate::stereo::solve::{Priors, Problem, Solved, Spread};
use crate::stereo::{Error, Lens, Rig};

/// A calibrated rig with all that it was made from.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The board that was seen.
    pub board: Board,
    /// How far black has spread on it, beyond what its places hold, where that moves its corners.
    pub spread: Option<Spread>,
    /// What was free.
    pub layout: Layout,
    /// The pairs that were used, with whitened corners; outliers are inactive.
    pub views: Vec<View>,
    /// Rig, shape, a pose a pair; the rig carries its covariance.
    pub values: Values,
    /// Covariance of the shared numbers, in the layout's order.
    pub covariance: DMatrix<f64>,
    /// How corners scatter.
    pub noise: Noise,
    /// The same without the board's print: what pictures of another board scatter by.
    pub own_noise: Noise,
    /// How neighbouring corners' residuals hang together; the covariance allows for the information that they share.
    pub neighbours: NeighbourCorrelation,
    /// Factor on the covariance that follows from the weighted normal equations: what neighbours share, and the loss.
    pub inflation: f64,
    /// What is expected of cameras and board beside the pairs: before any picture, or of lenses that are known or that
    /// each camera alone told.
    pub priors: Priors,
    /// What the left and the right camera leave of their own pictures, the median over them, px.
    pub alone_px: [f64; 2],
    /// Whether the lenses are those that each camera alone told, because something moved between the two pictures of
    /// the pairs.
    pub each_alone: bool,
    /// How many of the first or last pairs are in it although they contradict the others.
    pub runs: usize,
    /// How the pairs scatter about the common rig; the covariance allows for more than the corners' noise lets expect.
    pub pair_scatter: PairScatter,
    /// Richer models whose additional terms are more than chance.
    pub witnesses: Vec<Witness>,
    /// Pairs that were not used.
    pub skipped: Vec<Skipped>,
    /// The same with causes, and the corners that were rejected.
    pub discarded: Discarded,
    /// Which pairs the rig is that of.
    pub standing: Standing,
    /// How the rig has changed since the moment that it is that of, each change as a step of the shared numbers.
    pub since_moment: Vec<DVector<f64>>,
    /// Whose lens was known, left and right.
    pub known_sides: [bool; 2],
    /// Whether the pictures agree with the lenses that were known; `None` where none were, or the pictures say nothing
    /// of them.
    pub lens_check: Option<LensCheck>,
    /// How the lenses that were tried predict held-out pairs; empty where the lens was forced.
    pub lens_scores: Vec<LensScore>,
}

impl Calibration {
    /// True where the lenses of both cameras were known before the pictures.
    pub fn lenses_are_known(&self) -> bool {
        self.known_sides.iter().all(|known| *known)
    }

    /// By how much each side of a tag of the board is printed farther out than it is drawn, where that moves its
    /// corners, and the expanded uncertainty (k = 2), mm.
    pub fn spread_mm(&self) -> Option<[f64; 2]> {
        let spread = self.spread.as_ref()?;
        Some([self.board.spread_mm() + spread.change_mm, 2.0 * spread.sigma_mm * self.inflation.sqrt()])
    }

    /// Root mean square of the length of the 2-D residuals of both pictures, px.
    pub fn rms_px(&self) -> f64 {
        let left = residuals::active(&self.views, &self.values).unwrap_or_default();
        residuals::root_mean_square(left.iter().map(|(_, r)| r.norm_squared())).unwrap_or(0.0)
    }

    /// Median over the pairs of what they miss the rig by, px.
    pub fn usual_misfit_px(&self) -> Option<f64> {
        median(self.views.iter().filter_map(|view| Some(board_pose::misfit_px(&self.values.shared, view)?.0)))
    }

    /// Names of the pairs that were used.
    pub fn pair_names(&self) -> Vec<String> {
        self.views.iter().map(|view| view.pair.clone()).collect()
    }

    /// The rig with its covariance.
    pub fn rig(&self) -> &Rig {
        &self.values.shared.rig
    }

    /// The covariance for what the rig measures from the last pair on: the one at its moment, and how it has changed
    /// since.
    pub fn covariance_now(&self) -> Option<Covariance> {
        let mut covariance = self.rig().covariance.clone()?;
        self.since_moment.iter().for_each(|step| covariance.matrix += step * step.transpose());
        Some(covariance)
    }

    /// The pairs at the moment that the rig is that of: the middle of those that were used.
    pub fn moment(&self) -> [String; 2] {
        let count = self.views.len();
        [(count - 1) / 2, count / 2].map(|i| self.views[i].pair.clone())
    }

    /// Moves the rig by a step of the shared numbers, and the boards with it.
    pub fn move_rig(&mut self, step: &DVector<f64>) {
        board_pose::move_shared(&mut self.values, &self.views, &self.layout, step);
    }

    /// Variances of the six numbers of `right_from_left` from pair to pair, rad^2 and mm^2, and those by which a pair
    /// usually tells them; see [`pair_motion`].
    pub fn pair_motion(&self) -> Option<[Vector6<f64>; 2]> {
        pair_motion::of_pairs(&self.problem().equations(&self.layout)?, &self.layout, self.inflation)
    }

    /// The pairs with the values reached, to solve again in part or with another model.
    pub fn problem(&self) -> Problem {
        Problem { views: self.views.clone(), values: self.values.clone(), priors: self.priors.clone() }
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

/// Calibrates both cameras and the rig from the pairs that belong together.
pub fn calibrate(corners: &Corners, options: &Options) -> Result<Calibration, Error> {
    RigPairs::new(corners, options, false)?.calibrate(false)
}

/// The pairs of one rig, to be calibrated with the lenses that they or each camera alone tell.
pub struct RigPairs<'a> {
    corners: &'a Corners,
    options: &'a Options,
    /// Whether the first or the last pairs of the series stay in where they contradict the others, so that a change of
    /// the rig can be found over the series.
    runs: bool,
    candidates: Candidates,
    series: Series,
    /// What the pairs choose, once it was asked for.
    of_pairs: OnceLock<Choice>,
}

impl<'a> RigPairs<'a> {
    /// Finds them; `runs`: see [`RigPairs::runs`].
    pub fn new(corners: &'a Corners, options: &'a Options, runs: bool) -> Result<RigPairs<'a>, Error> {
        let candidates = Candidates::new(corners, options.known.as_ref())?;
        let series = series::find(&candidates, runs).map_err(|error| error.of_one_pose(candidates.one_pose()))?;
        Ok(RigPairs { corners, options, runs, candidates, series, of_pairs: OnceLock::new() })
    }

    /// Calibrates them; `by_pairs` with the lenses that the pairs tell, whatever each camera alone tells of them. How
    /// far black has spread on a grid of separate tags is found by the way.
    pub fn calibrate(&self, by_pairs: bool) -> Result<Calibration, Error> {
        /// Share of its standard deviation that is not worth another round, and rounds at the most: the first step is
        /// nearly the last.
        const STILL: f64 = 0.1;
        const ROUNDS: usize = 3;
        let mut found = self.with_spread(by_pairs)?;
        for _ in 1..ROUNDS {
            let Some(change_mm) =
                found.spread.as_ref().filter(|s| s.change_mm.abs() > STILL * s.sigma_mm).map(|s| s.change_mm)
            else {
                break;
            };
            let board = found.board.with_spread_mm(found.board.spread_mm() + change_mm);
            if board == found.board {
                break;
            }
            let corners = Corners { board, ..self.corners.clone() };
            found = RigPairs::new(&corners, self.options, self.runs)?.with_spread(by_pairs)?;
        }
        Ok(found)
    }

    fn of_pairs(&self) -> Result<Choice, Error> {
        if let Some(choice) = self.of_pairs.get() {
            return Ok(choice.clone());
        }
        let choice = lens_ladder::of_pairs(&self.series.problem, &self.corners.board, self.options)?;
        Ok(self.of_pairs.get_or_init(|| choice).clone())
    }

    /// The same with the spread that the board has.
    fn with_spread(&self, by_pairs: bool) -> Result<Calibration, Error> {
        let RigPairs { corners, options, candidates, .. } = self;
        let Series { problem: start, discarded, missed, .. } = &self.series;
        let skipped: Vec<Skipped> = discarded.iter().map(DiscardedPair::skipped).collect();
        let missed_at_all = Some(*missed).filter(|_| !by_pairs);
        let choose =
            |below| lens_ladder::choose(start, || self.of_pairs(), missed_at_all, &corners.board, options, below);
        let explained = |e: Error| e.without(&skipped).of_one_pose(candidates.one_pose()).of_lens(options.lens);
        let chosen = solved_by(start, choose).map_err(explained)?;
        Ok(self.stated(chosen, skipped))
    }

    /// The calibration with what is stated of it.
    fn stated(&self, (choice, solved, by_corners): Chosen, skipped: Vec<Skipped>) -> Calibration {
        let (known, board) = (self.options.known.as_ref(), self.corners.board);
        let Series { problem: start, discarded, runs, alone_px, .. } = &self.series;
        let Choice { layout, scatter, scores: lens_scores, .. } = choice;
        let lens_check = known.and_then(|known| known_lenses::check(start, known, &layout));
        let neighbours = solved.problem.neighbours();
        let inflation = solved.inflation();
        let by_noise = by_corners * inflation;
        let without_scatter = by_noise.clone();
        let print = print_share(&solved, &board, &layout);
        let spread = board.is_grid().then(|| Spread::of(&solved.problem, &layout)).flatten();
        let print_excess = print.as_ref().map_or(1.0, |print| print.excess);
        let stated =
            stated_uncertainty::state(&solved, &layout, by_noise, inflation, &lens_scores, scatter, print_excess);
        let Stated { mut covariance, pair_scatter, witnesses, weighed } = stated;
        if let Some(spread) = &spread {
            covariance += spread.covariance(inflation);
        }
        let Problem { views, values, priors } = solved.problem;
        let mut values = weighed.unwrap_or(values);
        let mut own_noise = solved.noise;
        if let Some(print) = print {
            covariance += print.covariance - without_scatter;
            own_noise = print.own_noise;
        }
        values.shared.rig.covariance = Some(Covariance { order: layout.names(), matrix: covariance.clone() });
        Calibration {
            board,
            spread,
            layout,
            noise: solved.noise,
            own_noise,
            neighbours,
            pair_scatter,
            witnesses,
            inflation,
            priors,
            each_alone: known.is_none() && scatter.is_some(),
            runs: *runs,
            alone_px: *alone_px,
            skipped,
            discarded: Discarded::new(&views, discarded.clone()),
            standing: Standing::default(),
            since_moment: Vec::new(),
            known_sides: Side::BOTH.map(|side| known.is_some_and(|known| known.camera(side).is_some())),
            lens_check,
            lens_scores,
            views,
            values,
            covariance,
        }
    }
}

/// What was chosen for pairs, the pairs with it, and the covariance that their corners alone give.
type Chosen = (Choice, Solved, DMatrix<f64>);

/// The pairs with what is chosen for them. A lens that predicts held-out pairs best may still have numbers that can be
/// exchanged for each other, where something that no lens explains made it look better; a simpler one is taken then.
fn solved_by(start: &Problem, choose: impl Fn(Option<Lens>) -> Result<Choice, Error>) -> Result<Chosen, Error> {
    let mut below = None;
    loop {
        let choice = choose(below)?;
        match choice.solve(start).and_then(|solved| Ok((solved.covariance(&choice.layout)?, solved))) {
            Ok((covariance, solved)) => return Ok((choice, solved, covariance)),
            Err(error) if choice.simpler().is_none() => return Err(error),
            Err(_) => below = choice.layout.left,
        }
    }
}
