//! The covariance that is stated: by the corners' noise, by how the pairs scatter, and by what richer models say.
//!
//! In: a problem at its minimum, the model, how the lenses that were tried predict held-out pairs. Out: the covariance,
//! how the pairs scatter, and the richer models that are witnesses of another rig. A covariance assumes that its model
//! is right. A richer model (a lens with more terms, a board that is not flat) that was not chosen, because it predicts
//! no better, may yet be right: where its additional terms are more than chance at the level of a strict test, the step
//! from the chosen model to it is taken as a bias that is known to its own size, and the square of that step is added
//! (GUM, F.2.4.5). Goes wrong: models that are not among those asked.

use nalgebra::{DMatrix, DVector, Translation3, UnitQuaternion};

use crate::geometry::Transform;
use crate::imaging::Side;
use crate::statistics::chi_square_quantile;
use crate::stereo::data::{Noise, in_use};
use crate::stereo::model::{Layout, Shared, Values, nearest_lens};
use crate::stereo::select::cross_validation;
use crate::stereo::select::model_comparison::{LensScore, Trial};
use crate::stereo::select::options::KnownScatter;
use crate::stereo::select::pair_motion;
use crate::stereo::select::pair_scatter::{Jackknife, PairScatter};
use crate::stereo::solve::uncertainty::WORST_FOCAL_SIGMA;
use crate::stereo::solve::{Problem, Solved};
use crate::stereo::{Lens, Rig};

/// Quantile of the normal distribution at whose level of chi-squared additional terms are more than chance: one clean
/// set of pairs in two hundred has such a witness.
const MORE_THAN_CHANCE: f64 = 2.6;

/// A richer model whose additional terms are more than chance.
#[derive(Debug, Clone, PartialEq)]
pub struct Witness {
    /// What is free in it.
    pub layout: Layout,
    pub rig: Rig,
    /// How many terms it adds.
    pub added: usize,
    /// By how much chi-squared falls for them; neighbours, pairs that scatter and print allowed for.
    pub chi_square_fall: f64,
    /// From the chosen model's shared numbers to those by which the chosen model describes its rig.
    step: DVector<f64>,
}

/// What is stated of a rig.
pub struct Stated {
    /// Of the shared numbers, in the layout's order.
    pub covariance: DMatrix<f64>,
    pub pair_scatter: PairScatter,
    /// The richer models that are witnesses of another rig.
    pub witnesses: Vec<Witness>,
    /// The values, where the pairs were weighed by how they are known to move.
    pub weighed: Option<Values>,
}

/// Enlarges the covariance `by_noise`, which is `inflation` times that of the normal equations, to what the numbers
/// scatter by where lenses are `known` at least, or finds the one of pairs whose motion is known. `print_excess`: see
/// [`Chance::print`](crate::stereo::select::model_comparison::Chance).
pub fn state(
    solved: &Solved,
    layout: &Layout,
    by_noise: DMatrix<f64>,
    inflation: f64,
    scores: &[LensScore],
    known: Option<KnownScatter>,
    print_excess: f64,
) -> Stated {
    let [lenses, pairs] = known.map_or([1.0; 2], |known| [known.lenses, known.pairs].map(|v| (v / inflation).max(1.0)));
    let Some((mut covariance, pair_scatter)) = scattered(solved, layout, &by_noise, inflation, [lenses, pairs]) else {
        let pair_scatter = PairScatter { groups: solved.problem.views.len(), ratio: None };
        return Stated { covariance: by_noise * lenses, pair_scatter, witnesses: Vec::new(), weighed: None };
    };
    let motion = known.and_then(|known| known.motion);
    let weighed =
        motion.and_then(|m| pair_motion::weighed(&solved.problem, layout, inflation, lenses, &m, &covariance));
    let weighed = weighed.map(|(values, by_motion)| {
        covariance = by_motion;
        values
    });
    let factor = inflation * pair_scatter.ratio.unwrap_or(1.0).max(lenses);
    let richer = richer(layout, scores, known.is_some());
    let witnesses = witnesses(&solved.problem, layout, richer, factor * print_excess);
    // Lenses contain each other: the steps to two of them are not two biases, and Akaike's criterion names the
    // likeliest. The board's is another.
    let gain = |w: &&Witness| w.chi_square_fall - 2.0 * w.added as f64;
    let lenses = witnesses.iter().filter(|w| w.layout.left != layout.left);
    let likeliest = lenses.max_by(|a, b| gain(a).total_cmp(&gain(b)));
    for witness in likeliest.into_iter().chain(witnesses.iter().filter(|w| w.layout.left == layout.left)) {
        covariance += &witness.step * witness.step.transpose();
    }
    Stated { covariance, pair_scatter, witnesses, weighed }
}

/// Variance of what the pairs leave over what their corners' noise lets expect, as neighbouring corners and whole pairs
/// tell; at least that of the corners. `None` where the pairs do not tell how they scatter.
pub fn told_scatter(solved: &Solved, layout: &Layout) -> Option<f64> {
    let inflation = solved.inflation();
    let by_noise = solved.covariance(layout).ok()? * inflation;
    let ratio = scattered(solved, layout, &by_noise, inflation, [1.0; 2])?.1.ratio?;
    Some(inflation * ratio.max(1.0))
}

/// The same, by the corners alone where the pairs do not tell.
pub fn excess_scatter(solved: &Solved, layout: &Layout) -> f64 {
    told_scatter(solved, layout).unwrap_or_else(|| solved.inflation())
}

/// Variance of the numbers over that of the weighted normal equations, by these pairs or as an earlier calibration of
/// the rig knows it, whichever is larger, and the same over what their corners' noise lets expect.
pub fn scatter_beside(solved: &Solved, layout: &Layout, pair_excess: f64, noise: Option<&Noise>) -> [f64; 2] {
    let scatter = excess_scatter(solved, layout).max(pair_excess) * solved.noise_of(noise);
    [scatter, scatter / solved.inflation()]
}

/// The covariance of the shared numbers that allows for the pairs' scatter, and that scatter.
fn scattered(
    solved: &Solved,
    layout: &Layout,
    by_noise: &DMatrix<f64>,
    inflation: f64,
    [lenses, least]: [f64; 2],
) -> Option<(DMatrix<f64>, PairScatter)> {
    let Problem { views, values, .. } = &solved.problem;
    let groups = cross_validation::groups(views, &values.poses);
    let (equations, curvature) = (solved.problem.equations(layout)?, solved.curvature(layout)?);
    let sure = WORST_FOCAL_SIGMA;
    let without = cross_validation::leave_out(&curvature, &equations, layout, &values.shared, &groups, sure);
    let (group_of, without) = (groups.as_slice(), without.as_slice());
    let jackknife =
        Jackknife { equations: &equations, curvature: &curvature, group_of, layout, without, least, lenses };
    Some(jackknife.covariance(by_noise, inflation))
}

fn witnesses(problem: &Problem, layout: &Layout, richer: Vec<Layout>, factor: f64) -> Vec<Witness> {
    let Some(chosen) = Trial::new(problem, *layout) else { return Vec::new() };
    let witness = |richer: Layout| {
        let trial = Trial::new(problem, richer)?;
        let added = richer.count().checked_sub(layout.count())?;
        let chi_square_fall = (chosen.chi_square - trial.chi_square) / factor;
        let step = step_to_witness(layout, &chosen.values.shared, &trial.values.shared, problem);
        let witness = Witness { layout: richer, rig: trial.values.shared.rig, added, chi_square_fall, step };
        (chi_square_fall > chi_square_quantile(added as f64, MORE_THAN_CHANCE)).then_some(witness)
    };
    richer.into_iter().filter_map(witness).collect()
}

/// The richer models that are asked: lenses that the pairs determine and that do not predict held-out pairs worse, or,
/// where the lens was forced, the ladder up to eight terms, and none where it is known; and a board that is not flat.
fn richer(layout: &Layout, scores: &[LensScore], lenses_known: bool) -> Vec<Layout> {
    let Some(own) = layout.left else { return Vec::new() };
    let trial = |lens: Lens| scores.iter().filter_map(|s| s.trial.as_ref()).find(|t| t.layout.left == Some(lens));
    let asked = |lens: Lens| match (trial(lens), trial(own)) {
        (Some(other), Some(own)) => other.excess_over(own).partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater),
        _ => scores.is_empty() && lens <= Lens::Rational8,
    };
    let lenses = Lens::LADDER.into_iter().filter(|lens| !lenses_known && *lens > own && asked(*lens));
    let lenses = lenses.map(|lens| Layout { left: Some(lens), right: Some(lens), ..*layout });
    lenses.chain((!layout.shape).then_some(Layout { shape: true, ..*layout })).collect()
}

/// From the chosen model's shared numbers to those by which it describes a richer one's rig. Only a lens with rational
/// terms beside one without needs to be described: the numbers of the others mean the same in both.
fn step_to_witness(layout: &Layout, chosen: &Shared, richer: &Shared, problem: &Problem) -> DVector<f64> {
    let describe = |side: Side| {
        let (camera, like) = (richer.rig.camera(side), chosen.rig.camera(side));
        let places = in_use(&problem.views).filter(|o| o.side == side).map(|o| o.px);
        let is_other = camera.lens >= Lens::Rational8 && like.lens < Lens::Rational8;
        if is_other { nearest_lens::describe(camera, like, places) } else { None }
    };
    let (Some(left), Some(right)) = (describe(Side::Left), describe(Side::Right)) else {
        return layout.between(chosen, richer);
    };
    let mut described = richer.clone();
    let turned = |turn: UnitQuaternion<f64>| Transform::from_parts(Translation3::identity(), turn);
    described.rig.right_from_left =
        turned(right.own_from_camera) * richer.rig.right_from_left * turned(left.own_from_camera.inverse());
    let mut step = layout.between(chosen, &described);
    for (side, camera) in [(Side::Left, left), (Side::Right, right)] {
        step.rows_mut(layout.camera_start(side), camera.step.len()).copy_from(&camera.step);
    }
    step
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::stereo::calibrate::calibrate;
    use crate::stereo::synthetic::{BROWN4, World};

    #[test]
    fn a_bow_that_was_ruled_out_is_a_witness_and_widens_the_covariance() {
        let mut world = World::new(12, 3);
        let clean = calibrate(&world.corners(4), &BROWN4).unwrap();
        assert!(clean.witnesses.iter().all(|w| !w.layout.shape), "{:?}", clean.witnesses);
        world.bow_mm[0] = 0.1;
        let bowed = calibrate(&world.corners(4), &BROWN4).unwrap();
        assert!(bowed.witnesses.iter().any(|w| w.layout.shape), "{:?}", bowed.witnesses);
        let off = (bowed.rig().left.fx - world.rig.left.fx).abs();
        assert!(off < 2.0 * bowed.covariance[(0, 0)].sqrt(), "{off}");
    }

    #[test]
    fn pairs_of_which_none_can_be_spared_do_not_tell_how_they_scatter() {
        let told = |world: &World| {
            let found = calibrate(&world.corners(1), &BROWN4).ok()?;
            let solved = found.problem().solve(&found.layout).ok()?;
            Some(told_scatter(&solved, &found.layout))
        };
        assert!(told(&World::new(12, 3)).unwrap().is_some_and(|scatter| scatter >= 1.0));
        // Nearly parallel boards: with all of them the focal lengths are known somewhat, without one they are not.
        let world = World::facing(5, |i| Vector3::new(0.02 * (i - 2.0), 0.03, 0.1 * i));
        let of = |sigma_px: f64| told(&World { sigma_px, ..world.clone() });
        assert!([0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0].into_iter().any(|sigma_px| of(sigma_px) == Some(None)));
    }
}
