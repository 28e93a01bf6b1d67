//! Lens models that disagree by more than they are sure of.
//!
//! In: a calibration and the models that were tried beside the chosen one. Out: for each the number that moves most in units of its own
//! standard deviation, and what the change of model does to lengths. A covariance assumes that its model is right; where two models
//! fit almost equally and their numbers differ by many sigmas, the covariance of neither is the truth.

use serde::Serialize;

use super::calibrate::Calibration;
use super::layout::Layout;
use super::lens_choice::Trial;
use super::triangulate::{SpacePoint, common, triangulate};
use super::{Lens, Rig};

/// Sigmas beyond which a difference is worth saying; four hardly ever happen by chance among some twenty numbers.
const NOTABLE_SIGMAS: f64 = 4.0;

/// A model that leaves this many times the chosen one's squared residuals is wrong, not another view of the matter.
const WORST_FIT: f64 = 1.5;

/// Another lens model, compared with the chosen one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Disagreement {
    /// The chosen model.
    pub chosen: &'static str,
    /// The other model.
    pub other: &'static str,
    /// The number that moves most.
    pub number: String,
    /// By how much, in its unit.
    pub change: f64,
    /// And in standard deviations (the larger of both models' own).
    pub sigmas: f64,
    /// Change of `right_from_left`'s translation, mm.
    pub translation_change_mm: [f64; 3],
    /// The same in standard deviations.
    pub translation_change_sigmas: [f64; 3],
    /// Largest change of a length between two corners of one board, mm.
    pub length_on_board_change_mm: f64,
    /// Largest change of the distance between the middles of two boards, mm.
    pub distance_of_boards_change_mm: f64,
    /// The same as a share of that distance.
    pub distance_of_boards_change_share: f64,
}

/// All models that fit about as well and move a number by more than it is sure of.
pub fn find(calibration: &Calibration) -> Vec<Disagreement> {
    let Some(chosen) = calibration.layout.left else { return Vec::new() };
    let trials = models(calibration);
    let Some(own) = trials.iter().find(|t| t.layout.left == Some(chosen)).map(|t| t.mean_square) else {
        return Vec::new();
    };
    trials
        .iter()
        .filter(|t| t.layout.left != Some(chosen) && t.mean_square <= WORST_FIT * own)
        .filter_map(|trial| compare(calibration, chosen, trial))
        .filter(|d| d.sigmas > NOTABLE_SIGMAS)
        .collect()
}

/// The models that were tried, or, where the lens was forced, the ladder up to eight terms.
fn models(calibration: &Calibration) -> Vec<Trial> {
    let tried: Vec<Trial> = calibration.lens_scores.iter().filter_map(|s| s.trial.clone()).collect();
    if !tried.is_empty() {
        return tried;
    }
    let problem = calibration.problem();
    let ladder = Lens::LADDER.into_iter().filter(|lens| *lens <= Lens::Rational8);
    ladder.filter_map(|lens| Trial::new(&problem, Layout::rig(lens, calibration.layout.shape))).collect()
}

fn compare(calibration: &Calibration, chosen: Lens, trial: &Trial) -> Option<Disagreement> {
    let other = trial.layout.left?;
    let names = calibration.layout.names();
    let (own, theirs) =
        (calibration.layout.numbers(&calibration.values.shared), trial.layout.numbers(&trial.values.shared));
    // Distortion terms mean different things in different models; the pinhole and the rig mean the same in all.
    let comparable = |name: &str| {
        name.starts_with("right_from_left.") || [".fx", ".fy", ".cx", ".cy"].iter().any(|end| name.ends_with(end))
    };
    let (number, change, sigmas) = trial
        .layout
        .names()
        .into_iter()
        .enumerate()
        .filter(|(_, name)| comparable(name))
        .filter_map(|(j, name)| {
            let i = names.iter().position(|n| *n == name)?;
            let variance = calibration.uncertainty.shared[(i, i)].max(trial.covariance[(j, j)]);
            let change = theirs[j] - own[i];
            Some((name, change, change.abs() / variance.sqrt()))
        })
        .max_by(|a, b| a.2.total_cmp(&b.2))?;
    let t = trial.values.shared.rig.right_from_left.translation.vector
        - calibration.rig().right_from_left.translation.vector;
    let sigmas_of = |axis: usize| {
        let variance = |layout: &Layout, covariance: &nalgebra::DMatrix<f64>| {
            let at = layout.transform_start() + 3 + axis;
            covariance[(at, at)]
        };
        let own = variance(&calibration.layout, &calibration.uncertainty.shared);
        t[axis].abs() / own.max(variance(&trial.layout, &trial.covariance)).sqrt()
    };
    let lengths = Lengths::compare(calibration, &trial.values.shared.rig);
    Some(Disagreement {
        chosen: chosen.name(),
        other: other.name(),
        number,
        change,
        sigmas,
        translation_change_mm: [t.x, t.y, t.z],
        translation_change_sigmas: [0, 1, 2].map(sigmas_of),
        length_on_board_change_mm: lengths.on_board_mm,
        distance_of_boards_change_mm: lengths.between_boards_mm,
        distance_of_boards_change_share: lengths.between_boards_share,
    })
}

/// What another rig makes of the same corners.
#[derive(Default)]
struct Lengths {
    on_board_mm: f64,
    between_boards_mm: f64,
    between_boards_share: f64,
}

impl Lengths {
    fn compare(calibration: &Calibration, other: &Rig) -> Lengths {
        let mut lengths = Lengths::default();
        let mut middles = Vec::new();
        for view in &calibration.views {
            let points = |rig: &Rig| -> Option<Vec<SpacePoint>> {
                common(view).into_iter().map(|(l, r)| triangulate(rig, l, r)).collect()
            };
            let (Some(a), Some(b)) = (points(calibration.rig()), points(other)) else { continue };
            let (Some(first), Some(last)) = (a.first().zip(b.first()), a.last().zip(b.last())) else { continue };
            let change = (last.1.point_mm - first.1.point_mm).norm() - (last.0.point_mm - first.0.point_mm).norm();
            lengths.on_board_mm = lengths.on_board_mm.max(change.abs());
            let middle = |points: &[SpacePoint]| {
                points.iter().map(|p| p.point_mm.coords).sum::<nalgebra::Vector3<f64>>() / points.len() as f64
            };
            middles.push((middle(&a), middle(&b)));
        }
        for (i, a) in middles.iter().enumerate() {
            for b in &middles[i + 1..] {
                let (own, theirs) = ((a.0 - b.0).norm(), (a.1 - b.1).norm());
                if (theirs - own).abs() > lengths.between_boards_mm && own > 0.0 {
                    lengths.between_boards_mm = (theirs - own).abs();
                    lengths.between_boards_share = lengths.between_boards_mm / own;
                }
            }
        }
        lengths
    }
}

/// The findings for a person, where there are any: the one that changes lengths most, and the names of the others.
pub fn describe(all: &[Disagreement]) -> Option<String> {
    let worst = all.iter().max_by(|a, b| a.length_on_board_change_mm.total_cmp(&b.length_on_board_change_mm))?;
    let others: Vec<String> = all
        .iter()
        .filter(|d| d.other != worst.other)
        .map(|d| format!("{} ({} by {:.0})", d.other, d.number, d.sigmas))
        .collect();
    let and = if others.is_empty() { String::new() } else { format!(". So does {}", others.join(", ")) };
    Some(worst.describe() + &and)
}

impl Disagreement {
    /// The finding for a person: what differs, what it does to lengths, which pictures would settle it.
    pub fn describe(&self) -> String {
        let [x, y, z] = self.translation_change_mm;
        let [sx, sy, sz] = self.translation_change_sigmas;
        format!(
            "the lens models {} and {} disagree by more than they are sure of: {} changes by {:.4}, {:.0} of its standard deviations \
             (right_from_left by {x:.3}, {y:.3}, {z:.3} mm: {sx:.0}, {sy:.0}, {sz:.0}). The same corners then give lengths on one board that differ by up to {:.4} mm, \
             and distances between boards by up to {:.4} mm ({:.3} %). To settle it, photograph the board in all four corners and along the \
             edges of both pictures, tilted by 30 to 45 degrees about both axes, and at the nearest and the farthest distance",
            self.chosen,
            self.other,
            self.number,
            self.change,
            self.sigmas,
            self.length_on_board_change_mm,
            self.distance_of_boards_change_mm,
            100.0 * self.distance_of_boards_change_share,
        )
    }
}
