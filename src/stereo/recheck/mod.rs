//! Whether a rig that was calibrated earlier is still the one that takes these pictures.
//!
//! In: a rig with its covariance, and the corners of two or more new pairs. Out: whether it changed, by what, how far
//! that moves a length, and the smallest change of each kind that the pairs would have shown. Method: the new pairs
//! give a rig by themselves, from the old one on; the difference of its numbers against both covariances, all of them
//! together and each cause as a direction of its own ([`crate::difference`]), all looks together at one level; a change
//! is what shows from the old rig on as well as from the new one, and where the pairs' own rig lies several times
//! farther off than the equations at the old one foretell, the latter tell its size. A change of a cause is seen in
//! nineteen of twenty such tests from the level plus 1.645 of its standard deviations on, which is what the pairs are
//! said to see. Goes wrong: pairs that are all alike hardly see a focus; that is what the stated figures say.

pub mod again;
mod looks;
mod strays;
#[cfg(test)]
mod tests;

use nalgebra::{DMatrix, DVector};

use self::looks::Looks;
pub use self::looks::{CauseSeen, Explained};
pub use self::strays::Stray;
use crate::difference::Difference;
use crate::imaging::{Board, Corners, PairCorners, Skipped};
use crate::stereo::Error;
use crate::stereo::board_pose::pair_excess::Usual;
use crate::stereo::data::{Noise, in_use};
use crate::stereo::findings::hypothesis;
use crate::stereo::init::board_pose::{self, misfit_px};
use crate::stereo::model::board_shape::FLAT;
use crate::stereo::model::rig::Rig;
use crate::stereo::model::{KnownLenses, Layout, Shared, Values};
use crate::stereo::pairs::flip::Flip;
use crate::stereo::pairs::series::SEVERAL;
use crate::stereo::pairs::{Cause, numbering};
use crate::stereo::select::model_comparison::Trial;
use crate::stereo::select::stated_uncertainty::scatter_beside;
use crate::stereo::solve::normal_equations;
use crate::stereo::solve::uncertainty;
use crate::stereo::solve::{Priors, Problem, Solved};
use crate::stereo::volume::Volume;
use crate::stereo::volume::lengths::{VolumeLengths, long_mm};

/// Causes that a line names; the table has all.
const TOLD: usize = 3;

/// Fewest pairs: one alone has nothing that confirms it.
pub const FEWEST_PAIRS: usize = 2;

/// The rig as it was, and what its calibration says beside it.
#[derive(Debug, Clone)]
pub struct Before {
    /// The rig with its covariance.
    pub rig: Rig,
    pub noise: Option<Noise>,
    /// How far pairs scattered about the rig beyond that, as a variance.
    pub pair_excess: f64,
    /// How far the pair disagreed that did most, over that, where its file says so.
    pub farthest_pair: Option<f64>,
    /// How many pairs with poses of their own made it, where its file says so.
    pub pairs: Option<usize>,
    /// The volume that it was checked for; that of the new boards where its file does not say.
    pub volume: Option<Volume>,
}

/// What is said of the rig.
#[derive(Debug, Clone, PartialEq)]
pub struct Recheck {
    /// Pairs that were compared.
    pub pairs: Vec<String>,
    pub skipped: Vec<Skipped>,
    /// Of those compared, pairs that contradict the old rig by themselves: what few of them say is lost among the
    /// others.
    pub strays: Vec<Stray>,
    /// Length that changes are given for, mm.
    pub length_mm: f64,
    pub causes: Vec<CauseSeen>,
    /// What explains the change; `None` where nothing changed.
    pub change: Option<Explained>,
    /// By how much the change moves a length, mm: that of the likeliest cause, or of all numbers together; zero where
    /// nothing changed.
    pub effect_mm: f64,
    /// The largest change of a length that a single cause could make without being seen, mm.
    pub seen_mm: f64,
}

pub fn recheck(before: &Before, corners: &Corners) -> Result<Recheck, Error> {
    before.rig.check_size(corners)?;
    let (problem, mut skipped, other_way_round) = start(before, corners);
    if problem.views.is_empty()
        && other_way_round.len() >= FEWEST_PAIRS
        && let Some(&flip) = other_way_round.first()
        && other_way_round.iter().all(|other| *other == flip)
    {
        return Err(Error::OtherWayRound { how: flip.describe(), remedy: flip.remedy() });
    }
    if problem.views.len() < FEWEST_PAIRS {
        let total = corners.pairs.len() + corners.skipped.len();
        return Err(Error::TooFewPairs { found: problem.views.len(), needed: FEWEST_PAIRS, total, skipped });
    }
    skipped.sort_by(|a, b| a.pair.cmp(&b.pair));
    let layout =
        Layout { left: Some(before.rig.left.lens), right: Some(before.rig.right.lens), transform: true, shape: true };
    let solved = problem.solve(&layout)?;
    let [scatter, beyond] = scatter_beside(&solved, &layout, before.pair_excess, before.noise.as_ref());
    let trial = Trial::new(&solved.problem, layout).ok_or_else(Error::undetermined)?;
    let numbers = layout.shape_start();
    let old = before.covariance(&layout).ok_or(Error::NoCovariance)?;
    let joint = old + trial.covariance.view((0, 0), (numbers, numbers)) * scatter;
    let off = layout.between(&problem.values.shared, &trial.values.shared).rows(0, numbers).into_owned();
    let pairs = before.pairs.unwrap_or(0).max(problem.views.len());
    let difference = Difference::new(off, &joint, pairs, beyond).ok_or_else(Error::undetermined)?;
    let from_old = step_from_old(&solved, &problem.values, &layout).and_then(|(off, covariance)| {
        let joint = before.covariance(&layout)? + covariance.view((0, 0), (numbers, numbers)) * scatter;
        Difference::new(off.rows(0, numbers).into_owned(), &joint, pairs, beyond)
    });

    let length_mm = long_mm(&corners.board);
    let views = &solved.problem.views;
    let volume = before.volume.clone().unwrap_or_else(|| Volume::of_boards(&trial.values, views));
    let lengths = VolumeLengths::of_volume(&before.rig, &volume, length_mm);
    let moves =
        |step: &DVector<f64>| lengths.most_changed_mm(&layout, &step.clone().resize_vertically(layout.count(), 0.0));
    let compared = Layout { shape: false, ..layout };
    let hypotheses = hypothesis::all(&compared, &before.rig);
    let looks = Looks {
        own: &difference,
        from_old: from_old.as_ref(),
        layout: &compared,
        hypotheses: &hypotheses,
        corners: in_use(views).count(),
    };
    let of_cause = |h| looks.of_cause(h, &moves);
    let causes = hypotheses.iter().map(of_cause).collect::<Option<Vec<_>>>().ok_or_else(Error::undetermined)?;
    let change = looks.is_change().then(|| looks.explained());
    let effect_mm = match &change {
        Some(Explained::Causes(likeliest)) => likeliest.first().map_or(0.0, |&first| causes[first].effect_mm),
        Some(_) => moves(&looks.nearer().off),
        // What the pairs scatter is no change.
        None => 0.0,
    };
    let seen_mm = causes.iter().map(|cause| cause.seen_mm).fold(0.0, f64::max);
    let pairs = views.iter().map(|view| view.pair.clone()).collect();
    let strays = strays(before, (&solved, &problem.values), &layout, &corners.board, &lengths);
    Ok(Recheck { pairs, skipped, strays, length_mm, causes, change, effect_mm, seen_mm })
}

/// The pairs that contradict the old rig by themselves, with the new board's shape and corners that scatter as those of
/// the calibration did, or these more.
fn strays(
    before: &Before,
    (solved, old): (&Solved, &Values),
    layout: &Layout,
    board: &Board,
    lengths: &VolumeLengths,
) -> Vec<Stray> {
    let mut problem = solved.problem.clone();
    problem.values = old.clone();
    problem.values.shared.shape_mm = solved.shared().shape_mm;
    let typical_px = |noise: &Noise| noise.typical_px(&solved.problem.views);
    let noise = before.noise.filter(|then| typical_px(then) > typical_px(&solved.noise)).unwrap_or(solved.noise);
    // Without what a robust loss makes of corners that lie far off.
    noise.apply(&mut problem.views);
    for (pose, view) in problem.values.poses.iter_mut().zip(&problem.views) {
        *pose = board_pose::follow(&problem.values.shared, view, *pose).unwrap_or(*pose);
    }
    let Some(rig) = before.covariance(layout) else { return Vec::new() };
    let Before { pair_excess: excess, farthest_pair, pairs, .. } = *before;
    let usual = Usual { excess, farthest_pair, pairs };
    strays::find(&problem, (board, layout), &rig, usual, lengths)
}

/// How a pair is the other way round that comes several times nearer to the old rig with its pictures exchanged, turned
/// or mirrored back: no knock moves a camera to the other side.
fn other_way_round(before: &Before, board: &Board, shared: &Shared, pair: &PairCorners) -> Option<Flip> {
    const NEARER: f64 = 4.0;
    /// Ways of which none comes nearer than the others by so much are not told apart.
    const ALIKE: f64 = 2.0;
    let view = |pair: &PairCorners| numbering::seen_on_rig(shared, board, pair, before.noise.as_ref());
    let miss_px = |pair: &PairCorners| misfit_px(shared, &view(pair)).map_or(f64::INFINITY, |(px, _)| px);
    let all = Flip::ALL.map(|flip| (miss_px(&flip.of_pair(board, &before.rig, pair)), flip));
    let least_px = all.iter().map(|(px, _)| *px).fold(f64::INFINITY, f64::min);
    // Of cameras that stand alike both pictures turned are nearly the same as both exchanged, which is more usual.
    let (px, how) = all.into_iter().find(|(px, _)| *px <= ALIKE * least_px)?;
    // A rig that was knocked may come nearer the other way round, but does not fit.
    let usual_px = before.noise.map_or(f64::INFINITY, |noise| noise.typical_px(std::slice::from_ref(&view(pair))));
    (px <= SEVERAL * usual_px && NEARER * px < miss_px(pair)).then_some(how)
}

/// From the old rig to that of the pairs as the equations at the old one foretell it, with its covariance: where the
/// pairs leave a bent valley, its two ends lie off the straight line along which the old rig is uncertain. The poses
/// are those on the old rig: from those on another one a board may fall over to its mirrored pose. `None` where they
/// say nothing.
fn step_from_old(solved: &Solved, old: &Values, layout: &Layout) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let mut problem = Problem { values: old.clone(), ..solved.problem.clone() };
    for (pose, view) in problem.values.poses.iter_mut().zip(&problem.views) {
        *pose = board_pose::follow(&problem.values.shared, view, *pose)?;
    }
    let (matrix, gradient) = normal_equations::eliminate(&problem.equations(layout)?, 0.0)?;
    Some((-normal_equations::solve_scaled(&matrix, &gradient)?, uncertainty::invert(&matrix)?))
}

/// The pairs with the poses that the old rig gives them, from where a rig of their own is looked for; those that are
/// left out, and of which of these the pictures are the other way round.
fn start(before: &Before, corners: &Corners) -> (Problem, Vec<Skipped>, Vec<Flip>) {
    let shared = Shared { rig: before.rig.clone(), shape_mm: FLAT };
    let mut skipped = corners.skipped.clone();
    let (mut views, mut poses, mut turned) = (Vec::new(), Vec::new(), Vec::new());
    for pair in &corners.pairs {
        let view = numbering::seen_on_rig(&shared, &corners.board, pair, before.noise.as_ref());
        let mut skip = |reason: String| skipped.push(Skipped { pair: pair.pair.clone(), reason });
        let Some((_, pose)) = misfit_px(&shared, &view) else {
            skip("its corners give no pose of the board on this rig".to_owned());
            continue;
        };
        if let Some(flip) = other_way_round(before, &corners.board, &shared, pair) {
            turned.push(flip);
            skip(format!("{}: {}", flip.describe(), flip.remedy()));
            continue;
        }
        views.push(view);
        poses.push(pose);
    }
    let known = KnownLenses::of_cameras([Some(before.rig.left), Some(before.rig.right)]).loosened();
    let priors = Priors::of_rig(&before.rig, corners.board.diagonal_mm()).knowing(&known);
    (Problem { views, values: Values { shared, poses }, priors }, skipped, turned)
}

impl Before {
    /// The covariance of cameras and transform in the layout's order. `None` where the calibration has none of one of
    /// its numbers.
    fn covariance(&self, layout: &Layout) -> Option<DMatrix<f64>> {
        self.rig.covariance.as_ref()?.part(&layout.names()[..layout.shape_start()])
    }
}

impl Recheck {
    /// The causes that explain the change, the likeliest first.
    pub fn likeliest(&self) -> Vec<&CauseSeen> {
        match &self.change {
            Some(Explained::Causes(likeliest)) => likeliest.iter().map(|&at| &self.causes[at]).collect(),
            _ => Vec::new(),
        }
    }

    /// The causes' words for files, with `|` between those that are not told apart; empty where nothing changed.
    pub fn cause(&self) -> String {
        match &self.change {
            None => String::new(),
            Some(Explained::Moved) => Cause::CameraMoved.word().to_owned(),
            Some(Explained::Cut { .. } | Explained::Nothing { .. }) => Cause::Unknown.word().to_owned(),
            Some(Explained::Causes(_)) => Cause::words(self.likeliest().iter().map(|cause| cause.cause)),
        }
    }

    /// What pairs mean that contradict the old rig by themselves, for a person, and what they are off by, mm; `None`
    /// where there are none.
    pub fn contradiction(&self) -> Option<(String, f64)> {
        let said = || (strays::statement(&self.strays, &self.pairs, self.length_mm), strays::largest_mm(&self.strays));
        (!self.strays.is_empty()).then(said)
    }

    /// What changed, for a person.
    pub fn statement(&self) -> String {
        let of = |c: &CauseSeen| format!("{} by {:.4} {} (+- {:.4})", c.words, c.amount, c.unit, 2.0 * c.sigma);
        match &self.change {
            None => "no change beyond chance".to_owned(),
            Some(Explained::Moved) => "the right camera stands and looks otherwise, in more than one way".to_owned(),
            Some(Explained::Cut { side, by_px: [x, y] }) => format!(
                "the {} camera's pictures show everything {x:+.2} px across and {y:+.2} px down from where they had it: they are cut or padded otherwise, or \
                 moved by what steadies them",
                side.name()
            ),
            Some(Explained::Nothing { nearest }) => {
                let nearest = nearest.map(|at| of(&self.causes[at]));
                let most = nearest.map_or(String::new(), |cause| format!("; nearest to it comes that {cause}"));
                format!("the rig changed, and no single cause explains how{most}")
            }
            Some(Explained::Causes(_)) => {
                let likeliest = self.likeliest();
                let more = likeliest.len().saturating_sub(TOLD);
                let told = likeliest.into_iter().take(TOLD).map(of);
                told.chain((more > 0).then(|| format!("{more} more"))).collect::<Vec<String>>().join(", or ")
            }
        }
    }
}
