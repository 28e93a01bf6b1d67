//! Hypotheses about what is wrong with the data before anything is identified: units, exchanged or negated joints,
//! another convention.
//!
//! In: a data set and the nominal robot. Out: both as the best hypothesis has them, and its name. Two things prove a
//! hypothesis. A good robot fits to well below a millimetre whatever its errors of manufacture are: where a robust fit
//! leaves more, a hypothesis that makes the errors vanish is taken. And a robot is built after its file: where joints
//! move little a fit swallows nearly everything, but then a hypothesis under which the nominal robot itself is near the
//! readings, and which fits as well, is taken. A joint that moves the target little (the last one, with a target near
//! its axis) shows in neither: there the likelihood of what the fits leave decides. Nothing is mended that none proves,
//! nothing that sessions along the rows explain better, and nothing that two robots explain about as well. What goes
//! wrong: two faults at once are found one after the other only where each alone brings an improvement, but for signs
//! of joints (`counting`). What the target's unknown place undoes (the sign of the last joint with a target on its
//! axis) is not seen and costs nothing.

use std::iter;

use rayon::prelude::*;

use super::counting;
use super::hypothesis::{Hypothesis, hypotheses, still};
pub use super::misfit::IMPLAUSIBLE_MM;
use super::misfit::{ALIKE, DOUBTED_MM, EXPLAINS, Look, Misfit, some_rows};
use crate::identify::data::dataset::Dataset;
use crate::identify::data::still::stuck;
use crate::identify::examine::{known, sessions};
use crate::identify::finding::Finding;
use crate::identify::settings::Settings;
use crate::identify::solve::robust::Loss;
use crate::identify::solve::task::Task;
use crate::robot::Robot;
use crate::tables::names::Unit;

/// Faults that are looked for one after the other.
const FAULTS: usize = 3;

/// What the hypotheses left of a data set and a robot.
#[derive(Debug, Clone)]
pub struct Mended {
    /// The measurements as they are to be used.
    pub set: Dataset,
    /// The robot as it is to be used.
    pub robot: Robot,
    pub findings: Vec<Finding>,
    /// What was mended and yet speaks against the file: its rows are not of one kind.
    pub against: Vec<Finding>,
    /// Joints that are not as they are counted, where nothing tells which.
    pub open: Option<Finding>,
    /// Errors that no hypothesis explains, mm a coordinate, where they are more than a built robot's.
    pub unexplained_mm: Option<f64>,
    /// Whether that, or what is left where the rows fall into sessions, is more than a built robot's.
    pub is_open: bool,
}

/// Looks for what is wrong with the conventions of a set and of a robot's file, and mends it.
pub fn examine(set: &Dataset, robot: &Robot, settings: &Settings) -> Mended {
    let (mut set, mut robot, mut findings, mut against) = (set.clone(), robot.clone(), Vec::new(), Vec::new());
    let mut in_other_units = false;
    let Some(mut left) = Misfit::of(&set, &robot, settings, None) else {
        return Mended { set, robot, findings, against, open: None, unexplained_mm: None, is_open: false };
    };
    let (mut cut, mut open) = (None, None);
    for _ in 0..FAULTS {
        let now = left;
        let is_doubted = now.fitted >= IMPLAUSIBLE_MM || now.nominal.max(now.target) > DOUBTED_MM;
        // Most faults bring the file's robot nearer to the readings; the others cost a fit each.
        // Lengths have one unit.
        let suiting: Vec<Hypothesis> = hypotheses(&set, &robot)
            .into_iter()
            .filter(|h| !(in_other_units && h.factor() != 1.0) && suits(*h, &set, &robot))
            .collect();
        let explaining = |look| explaining(&suiting, &set, &robot, settings, &now, look);
        let mut tried = if is_doubted { explaining(Look::Nearer) } else { Vec::new() };
        let unexplained = tried.is_empty() && now.fitted >= IMPLAUSIBLE_MM;
        cut = if unexplained { in_sessions(&set, &robot, settings) } else { None };
        if tried.is_empty() {
            tried = explaining(if unexplained { Look::All } else { Look::OfOneJoint });
        }
        // The one that is right may bring the file's robot little nearer, whose target stands elsewhere.
        if is_open(&tried) {
            tried = explaining(Look::All);
        }
        // Several faults of counting at once where none alone explains the errors, or where a twist does: two joints that
        // are counted the other way round do the same.
        if now.fitted >= IMPLAUSIBLE_MM && (!makes_plausible(&tried) || is_twist(&tried)) {
            let several = counting::likeliest(&set, &robot);
            with_several(&mut tried, &self::explaining(&several, &set, &robot, settings, &now, Look::All));
        }
        let best = Likeliest::of(&tried).filter(|best| cut.is_none_or(|cut| best.there.fitted < cut));
        let Some(best) = best else { break };
        if !best.rivals.is_empty() {
            open = (!unexplained && now.fitted < IMPLAUSIBLE_MM).then(|| best.open());
            break;
        }
        let Likeliest { there, hypothesis, .. } = best;
        let rows = set.names(&hypothesis.rows(&set));
        (set, robot) = hypothesis.applied(&set, &robot);
        in_other_units |= hypothesis.factor() != 1.0;
        let typed = typed(hypothesis, &set);
        let is_length = hypothesis.factor() != 1.0;
        let list = if rows.is_empty() && !(is_length && typed.is_some()) { &mut findings } else { &mut against };
        list.push(best.told(&now, typed, set.typed_unit).about(rows));
        left = there.scaled(1.0 / hypothesis.factor());
    }
    let unexplained_mm = (left.fitted >= IMPLAUSIBLE_MM && cut.is_none()).then_some(left.fitted);
    if unexplained_mm.is_some() {
        for finding in findings.iter_mut().chain(&mut against) {
            let done = &finding.action;
            finding.action =
                format!("what is left is implausible all the same, so that the cause may be another one; {done}");
        }
    }
    let is_open = cut.or(unexplained_mm).is_some_and(|left_mm| left_mm >= IMPLAUSIBLE_MM);
    Mended { set, robot, findings, against, open, unexplained_mm, is_open }
}

/// Adds several faults at once that explain the errors, in the place of what does not.
fn with_several(tried: &mut Vec<(Misfit, Hypothesis)>, several: &[(Misfit, Hypothesis)]) {
    if makes_plausible(several) {
        if !makes_plausible(tried) {
            tried.clear();
        }
        tried.extend(counting::without_untold(several));
    }
}

/// Whether the likeliest is a twist of the wrong sign.
fn is_twist(tried: &[(Misfit, Hypothesis)]) -> bool {
    Likeliest::of(tried).is_some_and(|best| matches!(best.hypothesis, Hypothesis::Twisted(_)))
}

/// Whether none leaves what a built robot may leave, and nothing tells which of them it is.
fn is_open(tried: &[(Misfit, Hypothesis)]) -> bool {
    !makes_plausible(tried) && Likeliest::of(tried).is_some_and(|best| !best.rivals.is_empty())
}

/// Whether one of them leaves what a built robot may leave.
fn makes_plausible(tried: &[(Misfit, Hypothesis)]) -> bool {
    tried.iter().any(|(there, hypothesis)| there.fitted * hypothesis.factor() < IMPLAUSIBLE_MM)
}

/// The likeliest of the hypotheses that were tried.
struct Likeliest {
    there: Misfit,
    hypothesis: Hypothesis,
    /// Those that these readings do not tell from it: a fit leaves as much, and the file's robot is about as near.
    like: Vec<Hypothesis>,
    /// Those of which the file's robot is about as near and a fit leaves something else, and for which some figure
    /// speaks: then none of them is the cause.
    rivals: Vec<Hypothesis>,
}

impl Likeliest {
    fn of(tried: &[(Misfit, Hypothesis)]) -> Option<Likeliest> {
        let least = tried.iter().map(|(there, _)| there.fitted).fold(f64::INFINITY, f64::min);
        let as_good = || tried.iter().filter(|(there, _)| there.fitted <= ALIKE * least);
        // A joint that is counted otherwise is the usual cause of what a twist of the wrong sign does as well, and one
        // twist that of what several joints do.
        let rank = |(there, h): &(Misfit, Hypothesis)| {
            let unusual = match h {
                Hypothesis::Twisted(_) => ALIKE,
                Hypothesis::Counted(_) => ALIKE * ALIKE,
                _ => 1.0,
            };
            there.product() * unusual
        };
        let &(there, hypothesis) = as_good().min_by(|a, b| rank(a).total_cmp(&rank(b)))?;
        let of = |wanted: &dyn Fn(&Misfit) -> bool| -> Vec<Hypothesis> {
            as_good().filter(|(other, h)| *h != hypothesis && wanted(other)).map(|(_, h)| *h).collect()
        };
        let is_near = |other: &Misfit, times: f64| other.product() < times * there.product();
        let like = of(&|other| other.fits_like(&there) && is_near(other, ALIKE));
        let rivals =
            of(&|other| !other.fits_like(&there) && is_near(other, EXPLAINS) && !there.is_nearer_in_all(other));
        Some(Likeliest { there, hypothesis, like, rivals })
    }

    /// What is said of it where errors were `now`, and where another unit was typed; beside it perhaps one of `lengths`.
    fn told(&self, now: &Misfit, typed: Option<Unit>, lengths: Option<Unit>) -> Finding {
        let Likeliest { there, hypothesis, like, .. } = self;
        let same: Vec<String> =
            like.iter().map(|h| format!(", or, which these readings do not tell apart, {}", h.name())).collect();
        let (whose, from, to) = there.fallen(now, hypothesis.factor());
        let from = if from < 1.0 { format!("{from:.3}") } else { format!("{from:.2}") };
        let says = typed.map_or_else(String::new, |unit| format!(" as `--units {}` says", unit.flag()));
        let finding = Finding::new(
            format!("{}{says}{} ({whose} fall from {from} to {to:.3} mm)", hypothesis.name(), same.concat()),
            action(*hypothesis, like, typed, lengths),
        );
        Finding { of_joints: hypothesis.is_of_counting(), ..finding }
    }

    /// What is said of a table that several of them explain.
    fn open(&self) -> Finding {
        let all = iter::once(&self.hypothesis).chain(&self.like).chain(&self.rivals);
        let all: Vec<String> = all.map(|hypothesis| hypothesis.name()).collect();
        Finding::new(
            format!(
                "the readings do not follow the joints as they are counted, and would fit better if {}",
                all.join(", or if ")
            ),
            "nothing was changed, for they do not tell which; compare these columns and the robot file with the controller",
        )
    }
}

/// Whether the nominal robot does not speak against it: a unit explains all known distances, and not a mistyped one.
fn suits(hypothesis: Hypothesis, set: &Dataset, robot: &Robot) -> bool {
    let Hypothesis::KnownLengths(unit_mm, _) = hypothesis else { return true };
    known::are_of_unit(set, robot, unit_mm)
}

/// The unit that was typed, where another one is said of the same.
fn typed(hypothesis: Hypothesis, set: &Dataset) -> Option<Unit> {
    match hypothesis {
        Hypothesis::Lengths(..) => set.typed_unit,
        Hypothesis::Angles(read_as, _) => set.typed_angle.filter(|typed| *typed == read_as),
        _ => None,
    }
}

/// What was done about a hypothesis, and what is to be mended, of it or of what is not told apart from it.
fn action(hypothesis: Hypothesis, others: &[Hypothesis], typed: Option<Unit>, lengths: Option<Unit>) -> String {
    match (typed, hypothesis) {
        (Some(_), Hypothesis::Lengths(.., unit)) => {
            return format!("`--units {}` says so, if the robot file is the right one", unit.flag());
        }
        (Some(_), Hypothesis::Angles(_, unit)) => {
            let units: Vec<&str> = iter::once(unit).chain(lengths).map(Unit::flag).collect();
            return format!("mended for this run; `--units {}` says so", units.join(","));
        }
        _ => {}
    }
    let mut mend: Vec<String> = Vec::new();
    for place in iter::once(&hypothesis).chain(others).map(|hypothesis| hypothesis.mend()) {
        // The table may stand behind the robot file already.
        if !mend.iter().any(|said| said.ends_with(&place)) {
            mend.push(place);
        }
    }
    format!(
        "mended for this run; mend {} (`examine = false` in [identify] takes it as it is)",
        mend.join("; or, for the other cause, ")
    )
}

/// What is said of errors that no hypothesis explains, of the fit that left them, with a column that stands still.
pub fn unexplained(set: &Dataset, fit: &str, left_mm: f64) -> Finding {
    Finding::new(
        format!(
            "{fit} leaves {left_mm:.2} mm a coordinate, implausible for a real robot: the robot file is not of the robot that was \
             measured, joints and readings do not belong together, the sensor was moved between rows of one `group`, or the readings \
             scatter by as much{}",
            stuck(set)
        ),
        "no single change of units, signs or conventions of all rows explains it; two at once, or one beside a sensor that was moved without a `group` that says \
         so, are not all looked for",
    )
}

/// The hypotheses that explain what is left, of those that are looked at.
fn explaining(
    open: &[Hypothesis],
    set: &Dataset,
    robot: &Robot,
    settings: &Settings,
    now: &Misfit,
    look: Look,
) -> Vec<(Misfit, Hypothesis)> {
    let still = still(set);
    let explains = |h: Hypothesis| {
        if look == Look::OfOneJoint && (h.of_one_joint().is_none() || h.is_of_still(&still)) {
            return None;
        }
        let (s, r) = h.applied(set, robot);
        let to_be_beaten = now.scaled(1.0 / h.factor());
        let there = Misfit::of(&s, &r, settings, Some((&to_be_beaten, look)))?.scaled(h.factor());
        // What stands still is told from the tool only where the tool's place is free in both.
        let free = |of: Misfit| if h.is_of_still(&still) { Misfit { nominal: of.target, ..of } } else { of };
        // In larger units errors are a smaller share of the readings, and larger all the same.
        let (_, from, to) = there.fallen(now, h.factor());
        let explains = match look {
            Look::OfOneJoint => {
                there.is_likelier(now) && h.of_one_joint().is_some_and(|i| there.follows(&s, &r, settings, i))
            }
            _ => free(there).explains(&free(*now)) && to < from,
        };
        explains.then_some((there, h))
    };
    open.par_iter().filter_map(|h| explains(*h)).collect()
}

/// Robust scatter, mm, after the groups were cut into sessions, where that explains what is wrong.
fn in_sessions(set: &Dataset, robot: &Robot, settings: &Settings) -> Option<f64> {
    let kept = some_rows(set);
    let others: Vec<usize> = set.rows(|_| true).into_iter().filter(|row| !kept.contains(row)).collect();
    let thinned = set.clone().without(&others, "");
    let (cut, _) = sessions::find(&thinned, robot, settings);
    // Placements of a few rows each, such as of a socket, take up what is wrong instead of explaining it.
    if kept.len() < sessions::SHORTEST * cut.groups.len() {
        return None;
    }
    let parameters = robot.mdh_parameters();
    let scatter = |set: &Dataset| {
        let rows = set.fit_rows();
        Some(Task::plain(set, robot, &parameters, &rows, settings).robust(Loss::Absolute).ok()?.scatter.point_mm)
    };
    let (before, after) = (scatter(&thinned)?, scatter(&cut)?);
    (after * EXPLAINS < before || after < IMPLAUSIBLE_MM).then_some(after)
}

#[cfg(test)]
mod tests;
