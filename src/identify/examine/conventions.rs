//! Hypotheses about what is wrong with the data before anything is identified: units, exchanged or negated joints,
//! another convention.
//!
//! In: a data set and the nominal robot. Out: both as the best hypothesis has them, and its name. Two things prove a
//! hypothesis. A good robot fits to well below a millimetre whatever its errors of manufacture are: where a robust fit
//! leaves more, a hypothesis that makes the errors vanish is taken. And a robot is built after its file: where joints
//! move little a fit swallows nearly everything, but then a hypothesis under which the nominal robot itself is near the
//! readings, and which fits as well, is taken. Nothing is mended that neither proves, and nothing that sessions along
//! the rows explain better. What goes wrong: two faults at once are found one after the other only where each alone
//! brings an improvement. What the target's unknown place undoes (the sign of the last joint with a target on its axis)
//! is not seen and costs nothing.

use std::iter;

use rayon::prelude::*;

use super::hypothesis::{Hypothesis, hypotheses, still};
use crate::identify::data::dataset::Dataset;
use crate::identify::examine::{known, sessions};
use crate::identify::finding::Finding;
use crate::identify::settings::Settings;
use crate::identify::solve::robust::Loss;
use crate::identify::solve::task::Task;
use crate::robot::{Parameter, Robot};
use crate::tables::names::Unit;

/// Robust scatter of a coordinate, mm, that no built robot has after a fit.
pub const IMPLAUSIBLE_MM: f64 = 0.8;

/// A hypothesis explains what is wrong when it brings errors down by this factor.
const EXPLAINS: f64 = 4.0;

/// Where errors do not vanish, the factors by which nominal robot and fit come nearer to the readings must be this
/// together.
const NEARER: f64 = 6.0;

/// By what factor the nominal robot comes nearer where the fit may get worse; each time that it gets worse by some
/// factor asks for the fourth power of that.
const STRIKING: f64 = 50.0;

/// Errors of the nominal robot, mm, below which its file is not doubted.
const DOUBTED_MM: f64 = 0.5;

/// A fit whose scatter is within this factor of another's is as good.
const AS_GOOD: f64 = 1.2;

/// Of hypotheses whose fits are within this factor of the best, that with the nominal robot nearest to the readings is
/// the likelier.
const ALIKE: f64 = 2.0;

/// Hypotheses whose errors differ by less than this share, which is what fits end within, are one robot in other words.
const SAME: f64 = 1e-3;

/// Faults that are looked for one after the other.
const FAULTS: usize = 3;

/// Rows that are enough to tell hypotheses apart.
const ROWS: usize = 120;

/// Rows of a placement: twice its own unknowns, below which it would take up what is wrong.
const ROWS_A_GROUP: usize = 12;

/// Errors of a robot against a set, mm in the units of the file.
#[derive(Debug, Clone, Copy)]
struct Misfit {
    /// Of the nominal robot, the sensor placed.
    nominal: f64,
    /// With the target's place fitted.
    target: f64,
    /// Robust scatter with all MDH parameters fitted.
    fitted: f64,
}

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
    /// Errors that no hypothesis explains, mm a coordinate, where they are more than a built robot's.
    pub unexplained_mm: Option<f64>,
}

/// Looks for what is wrong with the conventions of a set and of a robot's file, and mends it.
pub fn examine(set: &Dataset, robot: &Robot, settings: &Settings) -> Mended {
    let (mut set, mut robot, mut findings, mut against) = (set.clone(), robot.clone(), Vec::new(), Vec::new());
    let mut in_other_units = false;
    let Some(mut left) = Misfit::of(&set, &robot, settings, None) else {
        return Mended { set, robot, findings, against, unexplained_mm: None };
    };
    let mut cut = None;
    for _ in 0..FAULTS {
        let now = left;
        if now.fitted < IMPLAUSIBLE_MM && now.nominal.max(now.target) <= DOUBTED_MM {
            break;
        }
        // Most faults bring the file's robot nearer to the readings; the others cost a fit each.
        // Lengths have one unit.
        let open: Vec<Hypothesis> = hypotheses(&set)
            .into_iter()
            .filter(|h| !(in_other_units && h.factor() != 1.0) && suits(*h, &set, &robot))
            .collect();
        let mut tried = explaining(&open, &set, &robot, settings, &now, true);
        let unexplained = tried.is_empty() && now.fitted >= IMPLAUSIBLE_MM;
        cut = if unexplained { in_sessions(&set, &robot, settings) } else { None };
        if unexplained {
            tried = explaining(&open, &set, &robot, settings, &now, false);
        }
        let least = tried.iter().map(|(there, _)| there.fitted).fold(f64::INFINITY, f64::min);
        let product = |of: &Misfit| of.nominal * of.target * of.fitted;
        let best = tried
            .iter()
            .filter(|(there, _)| there.fitted <= ALIKE * least)
            .min_by(|(a, _), (b, _)| product(a).total_cmp(&product(b)));
        let Some(&(there, hypothesis)) = best.filter(|(there, _)| cut.is_none_or(|cut| there.fitted < cut)) else {
            break;
        };
        let others = tried.iter().filter(|(other, h)| *h != hypothesis && other.is_the_same(&there));
        let others: Vec<Hypothesis> = others.map(|(_, h)| *h).collect();
        let same: Vec<String> =
            others.iter().map(|h| format!(", or, which these readings do not tell apart, {}", h.name())).collect();
        let rows = set.names(&hypothesis.rows(&set));
        (set, robot) = hypothesis.applied(&set, &robot);
        in_other_units |= hypothesis.factor() != 1.0;
        let (whose, from, to) = there.fallen(&now, hypothesis.factor());
        let typed = set.typed_unit.filter(|_| hypothesis.factor() != 1.0);
        let list = if rows.is_empty() && typed.is_none() { &mut findings } else { &mut against };
        let says = typed.map_or_else(String::new, |unit| format!(" as `--units {}` says", unit.flag()));
        let finding = Finding::new(
            format!("{}{says}{} ({whose} fall from {from:.2} to {to:.3} mm)", hypothesis.name(), same.concat()),
            action(hypothesis, &others, typed),
        );
        list.push(Finding { of_joints: hypothesis.is_of_counting(), ..finding.about(rows) });
        left = there.scaled(1.0 / hypothesis.factor());
    }
    let unexplained_mm = (left.fitted >= IMPLAUSIBLE_MM && cut.is_none()).then_some(left.fitted);
    Mended { set, robot, findings, against, unexplained_mm }
}

/// Whether the nominal robot does not speak against it: a unit explains all known distances, and not a mistyped one.
fn suits(hypothesis: Hypothesis, set: &Dataset, robot: &Robot) -> bool {
    let Hypothesis::KnownLengths(unit_mm, _) = hypothesis else { return true };
    known::are_of_unit(set, robot, unit_mm)
}

/// What was done about a hypothesis, and what is to be mended, of it or of what is not told apart from it.
fn action(hypothesis: Hypothesis, others: &[Hypothesis], typed: Option<Unit>) -> String {
    if let (Some(_), Hypothesis::Lengths(.., unit)) = (typed, hypothesis) {
        return format!("`--units {}` says so, if the robot file is the right one", unit.flag());
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

/// What is said of errors that no hypothesis explains, of the fit that left them.
pub fn unexplained(fit: &str, left_mm: f64) -> Finding {
    Finding::new(
        format!(
            "{fit} leaves {left_mm:.2} mm a coordinate, implausible for a real robot: the robot file is not of the robot that was \
             measured, joints and readings do not belong together, or the readings scatter by as much"
        ),
        "no single change of units, signs or conventions of all rows explains it",
    )
}

/// The hypotheses that explain what is left, of those that bring the file's robot `nearer` or of all.
fn explaining(
    open: &[Hypothesis],
    set: &Dataset,
    robot: &Robot,
    settings: &Settings,
    now: &Misfit,
    nearer: bool,
) -> Vec<(Misfit, Hypothesis)> {
    let still = still(set);
    let explains = |h: Hypothesis| {
        let (s, r) = h.applied(set, robot);
        let to_be_beaten = now.scaled(1.0 / h.factor());
        let there = Misfit::of(&s, &r, settings, nearer.then_some(&to_be_beaten))?.scaled(h.factor());
        // What stands still is told from the tool only where the tool's place is free in both.
        let free = |of: Misfit| if h.is_of_still(&still) { Misfit { nominal: of.target, ..of } } else { of };
        // In larger units errors are a smaller share of the readings, and larger all the same.
        let (_, from, to) = there.fallen(now, h.factor());
        (free(there).explains(&free(*now)) && to < from).then_some((there, h))
    };
    open.par_iter().filter_map(|h| explains(*h)).collect()
}

impl Misfit {
    /// `None` where nothing can be fitted, and where the robot of the file is not much nearer than `to_be_beaten`.
    fn of(set: &Dataset, robot: &Robot, settings: &Settings, to_be_beaten: Option<&Misfit>) -> Option<Misfit> {
        let rows = some_rows(set);
        let (target, links) = ([0, 1, 2].map(Parameter::V), robot.mdh_parameters());
        let task = |parameters| Task::plain(set, robot, parameters, &rows, settings);
        let hopeless_mm = to_be_beaten.map_or(f64::INFINITY, |now| now.nominal);
        let nominal = task(&[]).unfitted_mm(hopeless_mm);
        let mut misfit = Misfit { nominal, target: f64::INFINITY, fitted: f64::INFINITY };
        // Only where the file has the target in another place can the links be right and the robot as a whole be far
        // off.
        if to_be_beaten.is_some_and(|now| now.target * EXPLAINS >= now.nominal && !misfit.is_nearer(now)) {
            return None;
        }
        misfit.target = task(&target).robust(Loss::Absolute).map_or(misfit.nominal, |robust| robust.typical_mm());
        if to_be_beaten.is_some_and(|now| !misfit.is_nearer(now)) {
            return None;
        }
        misfit.fitted = task(&links).robust(Loss::Absolute).ok()?.scatter.point_mm;
        misfit.fitted.is_finite().then_some(misfit)
    }

    /// In other units.
    fn scaled(self, factor: f64) -> Misfit {
        Misfit { nominal: self.nominal / factor, target: self.target / factor, fitted: self.fitted / factor }
    }

    /// Whose errors fall, mm: from what they were now to these, which are in the file's unit. That unit is so many
    /// times what it was said to be.
    fn fallen(&self, now: &Misfit, factor: f64) -> (&'static str, f64, f64) {
        let (whose, from, to) = match self.fitted * EXPLAINS < now.fitted {
            true => ("the errors", now.fitted, self.fitted),
            false if self.nominal * EXPLAINS < now.nominal => ("the nominal robot's errors", now.nominal, self.nominal),
            false => ("the nominal links' errors", now.target, self.target),
        };
        (whose, from, to * factor)
    }

    /// Whether two hypotheses are one and the same robot in other words, as a shoulder turned over and a base that
    /// turns the other way.
    fn is_the_same(&self, other: &Misfit) -> bool {
        let pairs = [(self.nominal, other.nominal), (self.target, other.target), (self.fitted, other.fitted)];
        pairs.iter().all(|(a, b)| (a - b).abs() <= SAME * b)
    }

    /// Whether the robot of the file is much nearer to the readings, by its target as well or by its links alone.
    fn is_nearer(&self, now: &Misfit) -> bool {
        self.nearer(now) > EXPLAINS
    }

    /// By what factor it is nearer; none where the file's robot was near enough before.
    fn nearer(&self, now: &Misfit) -> f64 {
        let falls = |from: f64, to: f64| if from > DOUBTED_MM { from / to } else { 1.0 };
        f64::max(falls(now.nominal, self.nominal), falls(now.target, self.target))
    }

    fn explains(&self, now: &Misfit) -> bool {
        let better = now.fitted / self.fitted;
        if now.fitted >= IMPLAUSIBLE_MM {
            return better > EXPLAINS;
        }
        // Of some sixty hypotheses one that is wrong brings distances with few poses nearer by four or five times. None
        // that is wrong brings the file's robot nearer by a hundred, and where joints move little what is wrong may
        // even fit a little better.
        let nearer = self.nearer(now);
        let striking = better * ALIKE >= 1.0 && nearer * better.powi(4) > STRIKING;
        striking || better * AS_GOOD >= 1.0 && nearer > EXPLAINS && nearer * better > NEARER
    }
}

/// Rows that are enough: some of every placement, or where there are many placements, of some of them.
fn some_rows(set: &Dataset) -> Vec<usize> {
    let all = set.fit_rows();
    if all.len() <= ROWS {
        return all;
    }
    let of_groups = (0..set.groups.len()).map(|group| set.of_group(&all, group));
    let of_groups: Vec<Vec<usize>> = of_groups.filter(|rows| !rows.is_empty()).collect();
    let each = (ROWS / of_groups.len()).max(ROWS_A_GROUP);
    let apart = of_groups.len().div_ceil(ROWS / each);
    let some = |rows: &Vec<usize>| rows.iter().copied().step_by(rows.len().div_ceil(each)).collect::<Vec<_>>();
    let mut rows: Vec<usize> = of_groups.iter().step_by(apart).flat_map(some).collect();
    rows.sort_unstable();
    rows
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
