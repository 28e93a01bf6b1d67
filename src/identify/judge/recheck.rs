//! Whether a robot that was identified earlier is still the one that takes these poses.
//!
//! In: the robot with the covariance of its parameters and its scatter, points of some ten new poses, with orientations where both have them, and
//! where the sensor stood. Out: whether it changed, by what, how far that moves the target, and the smallest change of each kind that the poses
//! would have shown. Method: the residuals at the old robot, placements (and the target's turn) eliminated, are normal with the covariance of
//! readings, scatter and old parameters; a zero of one joint, another tool and another scale are directions of theirs
//! ([`crate::difference`]), all looks together at one level. Where the robot did not change, each placement is compared with the old one.
//! Goes wrong: what a placement takes up (the first joint's zero) is only seen as a sensor that moved; two joints at once are a cause unknown.

mod looks;
mod moves;
#[cfg(test)]
mod tests;

use nalgebra::{DMatrix, DVector, Matrix3xX, Vector3};

use self::looks::{Look, Looks, Suspect, suspects, zero};
use self::moves::{Moves, placements};
use super::locate::{FEWEST_POSES, Trust};
use super::placement::Uncertain;
use crate::difference::Difference;
use crate::identify::Error;
use crate::identify::data::dataset::{Dataset, Kind, Reading};
use crate::identify::residuals::raw::Raw;
use crate::identify::residuals::rows::{Recipe, Rows};
use crate::identify::sensor::{Extra, Scatter};
use crate::identify::settings::Model;
use crate::identify::solve::linearised::Linearised;
use crate::linear_algebra::{product, pseudo_inverse};
use crate::robot::{Parameter, Robot};

/// What no orientation is known better than, rad: a micrometre at 100 mm.
const LEAST_TURN_RAD: f64 = 1e-5;

/// The robot as it was.
#[derive(Debug, Clone)]
pub struct Before {
    /// Identified parameters.
    pub parameters: Vec<Parameter>,
    /// Their covariance, mm and mrad.
    pub covariance: DMatrix<f64>,
    /// How it scattered.
    pub trust: Trust,
    /// Poses that this was found from.
    pub poses: usize,
    /// What 95 % of its position errors were stated to be below, mm.
    pub p95_mm: f64,
}

/// What the poses say of one cause.
#[derive(Debug, Clone, PartialEq)]
pub struct CauseSeen {
    /// For files: `joint-3`, `tool-x`, `scale`.
    pub word: String,
    /// For a person: what would have changed.
    pub words: String,
    /// The unit.
    pub unit: &'static str,
    /// By how much it changed, if it alone did, with its standard deviation; `None` where the poses see nothing of it.
    pub amount: Option<(f64, f64)>,
    /// By how much that moves the target after the placement was found anew, mm.
    pub effect_mm: f64,
    /// The smallest change that nineteen of twenty such checks see.
    pub seen: f64,
    /// By how much that one moves the target, mm.
    pub seen_mm: f64,
}

/// How one placement stands against the old one.
#[derive(Debug, Clone, PartialEq)]
pub struct Moved {
    /// The group.
    pub group: String,
    /// By how much the points moved with it, mm, and how much that is by chance.
    pub shift_mm: f64,
    /// What nineteen of twenty checks see, mm.
    pub seen_mm: f64,
    /// Its turn, rad.
    pub turn_rad: f64,
    /// Whether it is more than chance.
    pub moved: bool,
}

/// What is said of the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Recheck {
    /// Poses that were compared.
    pub poses: Vec<String>,
    /// Every cause.
    pub causes: Vec<CauseSeen>,
    /// Whether the robot changed.
    pub changed: bool,
    /// What explains it, the likeliest first, as words for files and for people; empty where nothing single does.
    pub likeliest: Vec<(String, String)>,
    /// Placements that are in the old file.
    pub placements: Vec<Moved>,
    /// By how much the change moves the target, mm.
    pub effect_mm: f64,
    /// The largest movement of the target that a single cause could make without being seen, mm.
    pub seen_mm: f64,
}

/// Compares. `stood` is where the sensor stood by the name of the group.
pub fn recheck(
    set: &Dataset,
    robot: &Robot,
    before: &Before,
    stood: &dyn Fn(&str) -> Option<Uncertain>,
) -> Result<Recheck, Error> {
    let used = set.rows(|pose| matches!(pose.reading, Reading::Position { .. }));
    if set.kind != Kind::Positions {
        return Err(Error::ModelNeeds { model: "position", needed: "positions (x_mm, y_mm, z_mm)" });
    }
    if let Some((index, found)) = too_few(set, &used) {
        return Err(Error::TooFewToPlace { group: set.groups[index].name.clone(), found, needed: FEWEST_POSES });
    }
    let mut parameters = before.parameters.clone();
    let others = (0..robot.joints.len()).map(zero(robot)).chain((0..3).map(Parameter::V));
    parameters.extend(others.filter(|p| !before.parameters.contains(p)));
    let oriented = set.has_rotations() && before.trust.rotation_rad.is_some();
    let rows = rows(set, robot, &parameters, &used, oriented, before.trust);
    let suspects = suspects(robot, &parameters);
    let compared = Compared { rows: &rows, before, count: parameters.len() + 1 };
    let (linear, look) =
        compared.at(&vec![0.0; compared.count]).ok_or(Error::NothingDetermined { poses: used.len() })?;
    let moves = Moves::new(&linear, compared.count);
    let looks = Looks { look, again: &|offsets| compared.at(offsets).map(|(_, look)| look), suspects: &suspects };
    let causes: Vec<CauseSeen> =
        suspects.iter().filter(|s| s.columns.len() == 1).map(|s| looks.of(s, &moves)).collect();
    let changed = looks.is_change();
    let explained = if changed { looks.explained() } else { Vec::new() };
    let named = |(suspect, amounts): &(&Suspect, Vec<f64>)| (suspect.word.clone(), suspect.by(amounts));
    let likeliest = explained.iter().map(named).collect();
    let placements = if changed { Vec::new() } else { placements(set, &compared, &linear, stood) };
    let seen_mm = causes.iter().filter(|c| c.amount.is_some()).map(|c| c.seen_mm).fold(0.0, f64::max);
    let effect_mm = match (changed, explained.first()) {
        (true, Some((suspect, amounts))) => moves.most_mm(&suspect.columns, amounts),
        (true, None) => compared.misfit_mm(),
        (false, _) => 0.0,
    };
    let effect_mm = placements.iter().filter(|p| p.moved).map(|p| p.shift_mm).fold(effect_mm, f64::max);
    let poses = used.iter().map(|&r| set.poses[r].name.clone()).collect();
    Ok(Recheck { poses, causes, changed, likeliest, placements, effect_mm, seen_mm })
}

/// The new rows beside the old robot.
struct Compared<'a> {
    rows: &'a Rows,
    before: &'a Before,
    /// Parameters of the robot, and the scale.
    count: usize,
}

/// Rounds in which the target's turn is found: it is nearly linear.
const TURNS: usize = 4;

impl Compared<'_> {
    /// All offsets, the target's turn at its best, where the robot is off by these.
    fn offsets(&self, of_robot: &[f64]) -> Vec<f64> {
        let mut offsets = vec![0.0; self.rows.offset_count()];
        offsets[..self.count].copy_from_slice(of_robot);
        let turns = offsets.len() - self.count;
        for _ in 0..if turns > 0 { TURNS } else { 0 } {
            let (residuals, jacobian) = self.rows.evaluate(&offsets, true);
            let jacobian = jacobian.columns(self.count, turns).into_owned();
            let step = pseudo_inverse(product(&jacobian, &jacobian)) * jacobian.tr_mul(&residuals);
            offsets[self.count..].iter_mut().zip(step.iter()).for_each(|(x, s)| *x -= s);
        }
        offsets
    }

    /// The rows linearised there, and what is to be looked at.
    fn at(&self, of_robot: &[f64]) -> Option<(Linearised, Look)> {
        let linear = Linearised::new(self.rows, &self.offsets(of_robot));
        let (off, columns) = left_over(&linear, self.count);
        let known: Vec<usize> = (0..self.before.parameters.len()).collect();
        let of_old = columns.select_columns(&known);
        let joint = DMatrix::identity(off.len(), off.len()) + &of_old * &self.before.covariance * of_old.transpose();
        let difference = Difference::new(off, &joint, self.before.poses, 1.0)?;
        Some((linear, Look { difference, columns }))
    }

    /// The largest residual of a point at the old robot, mm.
    fn misfit_mm(&self) -> f64 {
        let raw = self.rows.raw(&self.offsets(&vec![0.0; self.count]));
        let of_point = |raw: &Raw| if let Raw::Point(off, _) = raw { off.norm() } else { 0.0 };
        raw.iter().map(|(_, _, raw)| of_point(raw)).fold(0.0, f64::max)
    }
}

/// The first group that has too few poses, with how many.
fn too_few(set: &Dataset, used: &[usize]) -> Option<(usize, usize)> {
    let count = |group: usize| used.iter().filter(|&&r| set.poses[r].group == group).count();
    (0..set.groups.len()).map(|group| (group, count(group))).find(|(_, found)| *found < FEWEST_POSES)
}

/// The rows with a scale of the sensor as an unknown, and the target's turn where orientations are used.
fn rows(set: &Dataset, robot: &Robot, parameters: &[Parameter], used: &[usize], oriented: bool, trust: Trust) -> Rows {
    let mut set = set.clone();
    let point = |reading: &Reading| match reading {
        Reading::Position { point_mm, .. } => point_mm.coords,
        _ => Vector3::zeros(),
    };
    // A thousandth of scale.
    set.shared = set.poses.iter().map(|p| Matrix3xX::from_columns(&[-1e-3 * point(&p.reading)])).collect();
    let turns = [Extra::Target(0), Extra::Target(1), Extra::Target(2)];
    let turned: &[Extra] = if oriented { &turns } else { set.body_unknowns() };
    let extras: Vec<Extra> = std::iter::once(Extra::Shared(0)).chain(turned.iter().copied()).collect();
    let rotation_rad = trust.rotation_rad.unwrap_or(1e-4).max(LEAST_TURN_RAD);
    Rows::new(&Recipe {
        set: &set,
        robot,
        levers: robot,
        parameters,
        extras: &extras,
        rows: used,
        weights: &[],
        model: if oriented { Model::Pose } else { Model::Position },
        scatter: Scatter { rotation_rad, ..Scatter::of_point(trust.point_mm) },
        wire_offset: false,
    })
}

/// White residuals and the columns of the first so many offsets, in coordinates that the placements and the target's turn do not reach.
fn left_over(linear: &Linearised, count: usize) -> (DVector<f64>, DMatrix<f64>) {
    let total: usize = linear.placements.iter().map(|p| p.linear.residuals.len()).sum();
    let turns = linear.shared - count;
    let mut nuisance = DMatrix::zeros(total, turns + 6 * linear.placements.len());
    let mut all = DMatrix::zeros(total, 1 + count);
    let mut row = 0;
    for (k, placement) in linear.placements.iter().enumerate() {
        let part = &placement.linear;
        let rows = part.residuals.len();
        nuisance.view_mut((row, turns + 6 * k), (rows, 6)).copy_from(&part.design);
        nuisance.view_mut((row, 0), (rows, turns)).copy_from(&part.jacobian.columns(count, turns));
        all.view_mut((row, 0), (rows, 1)).copy_from(&part.residuals);
        all.view_mut((row, 1), (rows, count)).copy_from(&part.jacobian.columns(0, count));
        row += rows;
    }
    let taken = nuisance.ncols();
    nuisance.qr().q_tr_mul(&mut all);
    let rest = all.rows(taken, total.saturating_sub(taken)).into_owned();
    (rest.column(0).into_owned(), rest.columns(1, count).into_owned())
}

impl Recheck {
    /// The causes' words for files, with `|` between those that are not told apart; empty where nothing changed.
    pub fn cause(&self) -> String {
        match (self.changed, self.likeliest.is_empty()) {
            (true, true) => "unknown".to_owned(),
            (true, false) => self.likeliest.iter().map(|(word, _)| word.as_str()).collect::<Vec<_>>().join("|"),
            (false, _) if self.placements.iter().any(|p| p.moved) => "camera-moved|joint-1".to_owned(),
            (false, _) => String::new(),
        }
    }

    /// What changed, for a person.
    pub fn statement(&self) -> String {
        let moved: Vec<String> = self
            .placements
            .iter()
            .filter(|p| p.moved)
            .map(|p| format!("group {} by {:.4} mm and {:.4} deg", p.group, p.shift_mm, p.turn_rad.to_degrees()))
            .collect();
        match (self.changed, self.likeliest.is_empty()) {
            (true, true) => "the robot changed, and no single cause explains how".to_owned(),
            (true, false) => self.likeliest.iter().map(|(_, words)| words.as_str()).collect::<Vec<_>>().join(", or "),
            (false, _) if !moved.is_empty() => {
                format!(
                    "the robot is the same; the cameras stand elsewhere, or the zero of joint 1 moved: {}",
                    moved.join(", ")
                )
            }
            (false, _) => "no change beyond chance".to_owned(),
        }
    }
}
