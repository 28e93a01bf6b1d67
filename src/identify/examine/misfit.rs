//! How far a robot is off a set as it is, with its target fitted, and with its links fitted, and which of two such
//! misfits the readings speak for.
//!
//! In: a set and a robot, as a hypothesis has them. Out: its misfit, or nothing where it is hopeless beside what is to
//! be beaten. What goes wrong: where joints move little a fit swallows nearly everything, and the file's robot decides.

use crate::difference::TOLD_APART;
use crate::identify::data::dataset::Dataset;
use crate::identify::data::still;
use crate::identify::sensor::REPEATABILITY_MM;
use crate::identify::settings::Settings;
use crate::identify::solve::robust::Loss;
use crate::identify::solve::task::Task;
use crate::robot::{Parameter, Robot};

/// Robust scatter of a coordinate, mm, that no built robot has after a fit.
pub const IMPLAUSIBLE_MM: f64 = 0.8;

/// A hypothesis explains what is wrong when it brings errors down by this factor.
pub const EXPLAINS: f64 = 4.0;

/// Where errors do not vanish, the factors by which nominal robot and fit come nearer to the readings must be this
/// together.
const NEARER: f64 = 6.0;

/// By what factor the nominal robot comes nearer where the fit may get worse; each time that it gets worse by some
/// factor asks for the fourth power of that.
const STRIKING: f64 = 50.0;

/// Errors of the nominal robot, mm, below which its file is not doubted.
pub const DOUBTED_MM: f64 = 0.5;

/// A fit whose scatter is within this factor of another's is as good.
const AS_GOOD: f64 = 1.2;

/// Odds, as a logarithm, of a hypothesis of one joint that explains what a fit leaves though the nominal robot comes no
/// nearer: some eighty are tried, and one of them is to be told apart.
const LIKELIER: f64 = TOLD_APART + 4.4;

/// Of hypotheses whose fits are within this factor of the best, that with the nominal robot nearest to the readings is
/// the likelier.
pub const ALIKE: f64 = 2.0;

/// Rows that are enough to tell hypotheses apart.
pub const ROWS: usize = 120;

/// Rows of a placement: twice its own unknowns, below which it would take up what is wrong.
const ROWS_A_GROUP: usize = 12;

/// Errors of a robot against a set, mm in the units of the file.
#[derive(Debug, Clone, Copy)]
pub struct Misfit {
    /// Of the nominal robot, the sensor placed.
    pub nominal: f64,
    /// With the target's place fitted.
    pub target: f64,
    /// Robust scatter with all MDH parameters fitted.
    pub fitted: f64,
    /// Mean size of what that fit leaves.
    pub left: f64,
    /// Rows, or the numbers that the unknowns of that fit leave free where these are fewer.
    pub free: usize,
}

/// Which hypotheses are fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// Those that bring the file's robot much nearer to the readings.
    Nearer,
    All,
    /// Those of one joint with which the file's robot is about as far off: of a joint that moves the target little.
    OfOneJoint,
}

impl Look {
    /// Times as far off as now that the file's robot may be.
    fn most(self) -> f64 {
        match self {
            Look::Nearer => 1.0,
            Look::All => f64::INFINITY,
            // Its target may turn over with the joint.
            Look::OfOneJoint => ALIKE * EXPLAINS,
        }
    }
}

impl Misfit {
    /// `None` where nothing can be fitted, and where it is not looked at beside what is `to_be_beaten`.
    pub fn of(
        set: &Dataset,
        robot: &Robot,
        settings: &Settings,
        to_be_beaten: Option<(&Misfit, Look)>,
    ) -> Option<Misfit> {
        let rows = some_rows(set);
        let (target, links) = ([0, 1, 2].map(Parameter::V), robot.mdh_parameters());
        let task = |parameters| Task::plain(set, robot, parameters, &rows, settings);
        let is_hopeless = |there: &Misfit| to_be_beaten.is_some_and(|(now, look)| there.is_hopeless(now, look));
        let hopeless_mm = to_be_beaten.map_or(f64::INFINITY, |(now, look)| look.most() * now.nominal);
        let nominal = task(&[]).unfitted_mm(hopeless_mm);
        let mut misfit = Misfit { nominal, target: f64::INFINITY, fitted: f64::INFINITY, left: f64::INFINITY, free: 0 };
        if is_hopeless(&misfit) {
            return None;
        }
        misfit.target = task(&target).robust(Loss::Absolute).map_or(misfit.nominal, |robust| robust.typical_mm());
        if is_hopeless(&misfit) {
            return None;
        }
        let fit = task(&links).robust(Loss::Absolute).ok()?;
        (misfit.fitted, misfit.left) = (fit.scatter.point_mm, fit.typical_mm());
        misfit.free = fit.free_numbers().min(rows.len());
        misfit.fitted.is_finite().then_some(misfit)
    }

    /// Whether it need not be fitted beside what is so far, its target fitted or not yet.
    fn is_hopeless(&self, now: &Misfit, look: Look) -> bool {
        // Only where the file has the target in another place can the links be right and the robot as a whole be far
        // off.
        let tells = self.target.is_finite() || now.target * EXPLAINS >= now.nominal;
        match look {
            Look::All => false,
            Look::Nearer => tells && !self.is_nearer(now),
            Look::OfOneJoint if self.target.is_finite() => self.target > ALIKE * now.target,
            Look::OfOneJoint => tells && self.nominal > look.most() * now.nominal,
        }
    }

    /// In other units.
    pub fn scaled(self, factor: f64) -> Misfit {
        let [nominal, target, fitted, left] = [self.nominal, self.target, self.fitted, self.left].map(|mm| mm / factor);
        Misfit { nominal, target, fitted, left, ..self }
    }

    /// Whose errors fall, mm: from what they were now to these, which are in the file's unit. That unit is so many
    /// times what it was said to be.
    pub fn fallen(&self, now: &Misfit, factor: f64) -> (&'static str, f64, f64) {
        let (whose, from, to) = match self.fitted * EXPLAINS < now.fitted {
            true => ("the errors", now.fitted, self.fitted),
            false if self.nominal * EXPLAINS < now.nominal => ("the nominal robot's errors", now.nominal, self.nominal),
            false if self.target * EXPLAINS < now.target => ("the nominal links' errors", now.target, self.target),
            false => ("the errors of a fit", now.left, self.left),
        };
        (whose, from, to * factor)
    }

    /// How far nominal robot, its target and a fit are off, together.
    pub fn product(&self) -> f64 {
        self.nominal * self.target * self.fitted
    }

    /// Whether nothing speaks for the other: neither the file's robot, nor its links, nor a fit.
    pub fn is_nearer_in_all(&self, other: &Misfit) -> bool {
        self.nominal <= other.nominal && self.target <= other.target && self.left <= other.left
    }

    /// Whether two fits leave as much, as of a shoulder turned over and of a base that turns the other way.
    pub fn fits_like(&self, other: &Misfit) -> bool {
        let odds = self.free.min(other.free) as f64 * (self.left / other.left).ln();
        odds.abs() < TOLD_APART
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

    /// Whether the readings speak for it, by the likelihood of what the fits of the links leave (Laplace's
    /// distribution, its scale the mean size). What a row is off by for another reason its coordinates share, so that a
    /// row counts once; less than an arm repeats to tells nothing of how its joints are counted. Nor does a fit that is
    /// about as good: along the lines of a scan what the model lacks hangs together, and many rows agree on little.
    pub fn is_likelier(&self, now: &Misfit) -> bool {
        let [left, then] = [self.left, now.left].map(|mm| mm.max(REPEATABILITY_MM));
        then > AS_GOOD * left && self.free.min(now.free) as f64 * (then / left).ln() > LIKELIER
    }

    /// Whether the joint moves the target of the robot that was fitted by so much that it can be what made the fit
    /// likelier: fits of readings of two kinds end in one place or another whatever a joint reads.
    pub fn follows(&self, set: &Dataset, robot: &Robot, settings: &Settings, joint: usize) -> bool {
        let (rows, links) = (some_rows(set), robot.mdh_parameters());
        let fit = Task::plain(set, robot, &links, &rows, settings).robust(Loss::Absolute);
        let moves = fit.map_or(0.0, |fit| still::moves_mm(set, &fit.robot, &rows, joint) / self.left);
        3.0 * rows.len() as f64 * moves.powi(2) > 2.0 * LIKELIER && moves > 1.0
    }

    pub fn explains(&self, now: &Misfit) -> bool {
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
pub fn some_rows(set: &Dataset) -> Vec<usize> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_rows_of_a_scan_make_no_cause_of_a_fit_that_is_about_as_good() {
        let fit = |left: f64, free: usize| Misfit { nominal: 0.3, target: 0.2, fitted: left, left, free };
        // As of a serpentine scan of a real arm with joint 6 late by a row.
        assert!(!fit(0.023, 120).is_likelier(&fit(0.026, 120)));
        assert!(fit(0.11, 60).is_likelier(&fit(0.21, 60)));
        // Nor do few rows tell, or what is less than an arm repeats to.
        assert!(!fit(0.11, 6).is_likelier(&fit(0.21, 6)));
        assert!(!fit(0.002, 120).is_likelier(&fit(0.015, 120)));
    }
}
