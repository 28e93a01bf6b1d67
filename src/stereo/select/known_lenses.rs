//! Lenses that are known: what is free beside them, and whether the pictures agree with them.
//!
//! In: the pairs at their start, and lenses from another calibration. Out: the layout with what is expected, and the test. Method: the
//! lenses are expectations with their covariance; the board is bent where the evidence for that is larger. The test compares the known numbers
//! with those that the pictures give by themselves: their difference against both covariances (Hotelling), the pictures' one
//! enlarged by what pairs scatter. A focus alone is asked for, too: it is what changes, and a test of one number sees smaller changes of it. Causes are other lenses that might be known instead: another focus, left and right exchanged, another
//! camera. One is named where what it leaves is chance, and beside it those that do nearly as well.
//! Goes wrong: pictures that say little of a lens; then the test says how large a change of focus it would have seen.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::imaging::{Board, Side};
use crate::statistics::chi_square_quantile;
use crate::stereo::model::known_lenses::KnownLenses;
use crate::stereo::model::parameters::Layout;
use crate::stereo::pairs::Cause;
use crate::stereo::select::lens_ladder::{Choice, Options, SIMPLEST};
use crate::stereo::select::model_comparison::{Trial, gain_of_terms};
use crate::stereo::select::stated_uncertainty;
use crate::stereo::solve::problem::Problem;
use crate::stereo::{Error, Rig};

/// Quantile of the normal distribution beyond which pictures contradict a lens: one set of pairs in a thousand by chance, in the four tests
/// together (all numbers, the focus of either side and of both).
const CONTRADICTED: f64 = 3.48;

/// Quantile for the share of changes that the test sees at the size that is stated: nineteen in twenty.
const SEEN: f64 = 1.645;

/// Causes are told apart where the logarithm of one's likelihood is larger by this: 150 to 1.
const TOLD_APART: f64 = 5.0;

/// Whether the pictures agree with the lenses that were known.
#[derive(Debug, Clone, PartialEq)]
pub struct LensCheck {
    /// Squared difference of the known numbers from those that the pictures give, in units of its covariance: of all numbers, or the part
    /// that a focus explains, whichever is the larger share of its limit.
    pub chi_square: f64,
    /// Beyond it they contradict each other.
    pub limit: f64,
    /// How many numbers are known.
    pub numbers: usize,
    /// What explains the difference, the likeliest first; empty where there is none.
    pub causes: Vec<Cause>,
    /// The same for a person.
    pub statement: String,
    /// By how much the focal length changed, %, where that is the likeliest cause.
    pub focus_change: Option<f64>,
    /// The change of each known focal length that nineteen of twenty such tests see, as a share.
    pub focus_seen: [Option<f64>; 2],
    /// The rig as the pictures give it without the known lenses.
    pub rig_without: Rig,
}

impl LensCheck {
    /// True where the pictures contradict the lenses.
    pub fn contradicts(&self) -> bool {
        self.chi_square > self.limit
    }
}

/// What is free beside lenses that are known, and what is expected.
pub fn choose(start: &Problem, board: &Board, known: &KnownLenses, options: &Options) -> Result<Choice, Error> {
    let lens = options.lens.unwrap_or(SIMPLEST);
    let problem = start_of(start, known);
    let shape = match options.shape {
        Some(shape) => shape,
        None => is_bent(&problem, board, &known.layout(lens, true), &known.layout(lens, false))?,
    };
    Ok(Choice {
        layout: known.layout(lens, shape),
        near: Some(problem.values),
        priors: problem.priors,
        scores: Vec::new(),
    })
}

/// The pairs with the known cameras to start from, and what is known of them.
fn start_of(start: &Problem, known: &KnownLenses) -> Problem {
    let mut problem = Problem { priors: start.priors.knowing(known), ..start.clone() };
    let rig = &mut problem.values.shared.rig;
    for (side, camera) in [(Side::Left, &mut rig.left), (Side::Right, &mut rig.right)] {
        if let Some(known) = known.camera(side) {
            *camera = *known;
        }
    }
    problem
}

/// Whether the evidence for a board that is bent is larger than for a flat one.
fn is_bent(problem: &Problem, board: &Board, bent: &Layout, flat: &Layout) -> Result<bool, Error> {
    let (solved, layout) = match problem.solve(bent) {
        Ok(solved) => (solved, bent),
        Err(_) => (problem.solve(flat)?, flat),
    };
    let scatter = stated_uncertainty::excess_scatter(&solved, layout, board);
    let solved = solved.problem;
    let trials = Trial::new(&solved, *bent).zip(Trial::new(&solved, *flat));
    Ok(trials.is_some_and(|(bent, flat)| {
        gain_of_terms(&solved.priors, &bent, &flat, scatter).is_some_and(|gain| gain > 0.0)
    }))
}

/// Compares the known lenses with what the pictures say by themselves. `None` where they say nothing.
pub fn check(start: &Problem, known: &KnownLenses, layout: &Layout, board: &Board) -> Option<LensCheck> {
    let own = Problem { priors: start.priors.knowing(&known.loosened()), ..start_of(start, known) };
    let solved = own.solve(layout).ok()?;
    let scatter = stated_uncertainty::excess_scatter(&solved, layout, board);
    let trial = Trial::new(&solved.problem, *layout)?;
    let places: Vec<usize> = known.numbers().iter().map(|(side, at)| layout.camera_start(*side) + at).collect();
    let all = layout.numbers(&trial.values.shared);
    let n = places.len();
    let pictures = Pictures {
        values: DVector::from_iterator(n, places.iter().map(|at| all[*at])),
        covariance: DMatrix::from_fn(n, n, |i, j| trial.covariance[(places[i], places[j])])
            * scatter.max(known.pair_excess),
        corners: solved.problem.views.iter().flat_map(|view| &view.observations).filter(|o| o.active).count(),
    };
    let (chi_square, limit) = pictures.contradiction(known)?;
    let causes = if chi_square > limit { causes(known, &pictures) } else { Vec::new() };
    let focus_seen = Side::BOTH.map(|side| pictures.focus_seen(known, side));
    let statement = statement(known, &pictures, &causes);
    let focused = causes.first().filter(|likeliest| likeliest.cause == Cause::Focus);
    let focus_change = focused.and_then(|likeliest| Some(pictures.focus_change(known, *likeliest.sides.first()?)));
    let rig_without = trial.values.shared.rig;
    Some(LensCheck {
        chi_square,
        limit,
        numbers: n,
        causes: causes.into_iter().map(|explanation| explanation.cause).collect(),
        statement,
        focus_change,
        focus_seen,
        rig_without,
    })
}

/// What the pictures say of the numbers that are known.
struct Pictures {
    values: DVector<f64>,
    covariance: DMatrix<f64>,
    corners: usize,
}

impl Pictures {
    /// Both covariances together, those of some of the numbers.
    fn joint(&self, known: &KnownLenses, numbers: &[usize]) -> Option<Cholesky<f64, Dyn>> {
        let own = DMatrix::from_fn(numbers.len(), numbers.len(), |i, j| self.covariance[(numbers[i], numbers[j])]);
        (own + known.covariance()).cholesky()
    }

    /// Squared difference from lenses that might be known; only the numbers that are known in them count.
    fn misfit(&self, known: &KnownLenses) -> Option<f64> {
        self.misfit_of(known, &(0..self.values.len()).collect::<Vec<_>>())
    }

    fn misfit_of(&self, known: &KnownLenses, numbers: &[usize]) -> Option<f64> {
        let own = DVector::from_iterator(numbers.len(), numbers.iter().map(|i| self.values[*i]));
        let off = own - known.values();
        Some(off.dot(&self.joint(known, numbers)?.solve(&off)))
    }

    /// By how much a side's focal length differs from the known one, %: the mean of fx and fy.
    fn focus_change(&self, known: &KnownLenses, side: Side) -> f64 {
        let (numbers, values) = (known.numbers(), known.values());
        let focal = (0..numbers.len()).filter(|i| numbers[*i].0 == side && numbers[*i].1 < 2);
        focal.map(|i| 50.0 * (self.values[i] / values[i] - 1.0)).sum()
    }

    /// The test that comes nearest to its limit, or is farthest beyond: its chi-squared and that limit.
    fn contradiction(&self, known: &KnownLenses) -> Option<(f64, f64)> {
        let all = self.misfit(known)?;
        let focused = subsets(known).into_iter().filter_map(|sides| {
            let left = self.misfit(&known.with_open_focus(&sides))?;
            Some((all - left, chi_square_quantile(sides.len() as f64, CONTRADICTED)))
        });
        let every = (all, chi_square_quantile(self.values.len() as f64, CONTRADICTED));
        focused.chain([every]).max_by(|a, b| (a.0 / a.1).total_cmp(&(b.0 / b.1)))
    }

    /// The change of a focal length, as a share, that nineteen of twenty tests see. `None` where it is not known.
    fn focus_seen(&self, known: &KnownLenses, side: Side) -> Option<f64> {
        let focus = known.focal_direction(side)?;
        let joint = self.joint(known, &(0..self.values.len()).collect::<Vec<_>>())?;
        Some((CONTRADICTED + SEEN) / focus.dot(&joint.solve(&focus)).sqrt())
    }
}

/// The known sides: each, and both together.
fn subsets(known: &KnownLenses) -> Vec<Vec<Side>> {
    let sides: Vec<Side> = Side::BOTH.into_iter().filter(|side| known.camera(*side).is_some()).collect();
    let each = sides.iter().map(|side| vec![*side]);
    each.chain((sides.len() == 2).then(|| sides.clone())).collect()
}

/// A cause that explains the difference.
struct Explanation {
    cause: Cause,
    sides: Vec<Side>,
    /// Logarithm of its likelihood but for a constant, less what its numbers cost.
    evidence: f64,
}

/// The causes that explain the difference and are not told apart, the likeliest first.
fn causes(known: &KnownLenses, pictures: &Pictures) -> Vec<Explanation> {
    let subsets = subsets(known);
    let numbers = known.numbers();
    let penalty = 0.5 * (pictures.corners.max(2) as f64).ln();
    let explains = |cause, sides: &[Side], misfit: Option<f64>, left: usize, freed: usize| {
        let misfit = misfit?;
        let chance = left == 0 || misfit <= chi_square_quantile(left as f64, CONTRADICTED);
        let evidence = -0.5 * misfit - penalty * freed as f64;
        chance.then(|| Explanation { cause, sides: sides.to_vec(), evidence })
    };
    let focused = subsets.iter().filter_map(|sides| {
        let misfit = pictures.misfit(&known.with_open_focus(sides));
        explains(Cause::Focus, sides, misfit, numbers.len() - sides.len(), sides.len())
    });
    let replaced = subsets.iter().filter_map(|sides| {
        let kept: Vec<usize> = (0..numbers.len()).filter(|i| !sides.contains(&numbers[*i].0)).collect();
        let left = sides.iter().fold(known.clone(), |known, side| known.without(*side));
        let misfit = if kept.is_empty() { Some(0.0) } else { pictures.misfit_of(&left, &kept) };
        explains(Cause::OtherCamera, sides, misfit, kept.len(), numbers.len() - kept.len())
    });
    let exchanged = known.exchanged();
    let exchanged = (exchanged.numbers() == numbers)
        .then(|| explains(Cause::Exchanged, &Side::BOTH, pictures.misfit(&exchanged), numbers.len(), 0))
        .flatten();
    let mut all: Vec<Explanation> = focused.chain(replaced).chain(exchanged).collect();
    let best = all.iter().map(|e| e.evidence).fold(f64::NEG_INFINITY, f64::max);
    all.retain(|e| best - e.evidence < TOLD_APART);
    all.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    let mut seen: Vec<Cause> = Vec::new();
    all.retain(|e| {
        !seen.contains(&e.cause) && {
            seen.push(e.cause);
            true
        }
    });
    all
}

/// What the difference is and what explains it, in words.
fn statement(known: &KnownLenses, pictures: &Pictures, causes: &[Explanation]) -> String {
    let told: Vec<String> = causes.iter().map(|explanation| cause_in_words(known, pictures, explanation)).collect();
    match told.split_first() {
        None => "the pictures agree with the known lenses".to_owned(),
        Some((first, [])) => format!("the pictures contradict the known lenses: {first}"),
        Some((first, others)) => {
            format!("the pictures contradict the known lenses: {first} (or {})", others.join(", or "))
        }
    }
}

fn cause_in_words(known: &KnownLenses, pictures: &Pictures, explanation: &Explanation) -> String {
    let names: Vec<&str> = explanation.sides.iter().map(|side| side.name()).collect();
    let names = names.join(" and the ");
    match explanation.cause {
        Cause::Focus => {
            let change = |side: &Side| format!("{:+.3} %", pictures.focus_change(known, *side));
            let changes: Vec<String> = explanation.sides.iter().map(change).collect();
            format!("the {names} lens was focused otherwise, its focal length changed by {}", changes.join(" and "))
        }
        Cause::Exchanged => "the lenses of left and right are exchanged".to_owned(),
        _ => format!("the {names} camera is another one, or its lens was changed"),
    }
}
