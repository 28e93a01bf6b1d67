//! Readings that scatter more than at the identification: an instrument that is noisier, rounded joint angles, play.
//!
//! In: rows that contradict the old robot, and that nothing single explains. Out: what they say where all of it may be
//! scatter, which then is their cause. Method: what no zero of a joint, no tool and no scale together explain tells the
//! scatter; where neither all of these together nor any of them shows beyond it (F tests), nothing but scatter is told.
//! All figures are then those of the larger scatter. Where all of several placements seem to stand elsewhere beside it,
//! it is no scatter: the target is off by what they seem to have moved. Goes wrong: what follows the pose in another way
//! than those (a load, play) is scatter too, unless it looks like one of them.

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::comparison::{Comparison, Said};
use super::found::{Before, FALSE_ALARM, Recheck, SCATTER};
use super::looks::Looks;
use super::suspects::suspects;
use crate::identify::judge::locate::Trust;
use crate::linear_algebra::pseudo_inverse;

/// Chance beyond which what a change explains of the residuals is not called scatter.
const EXPLAINED: f64 = 0.05;

/// Rows that scatter more times than this as far as before are rows of something else.
const MOST_TIMES: f64 = 50.0;

/// What the rows say as readings that scatter more; `None` where that is not all that they show.
pub(super) fn larger(comparison: &Comparison, used: &[usize], whole: &Said) -> Option<Recheck> {
    if !whole.recheck.changed || whole.likelihood.is_some() {
        return None;
    }
    let (times, freedom) = beyond_changes(comparison, used)?;
    let Comparison { set, robot, before, stood, oriented, .. } = *comparison;
    let stated = used.iter().filter_map(|&row| Some(set.poses[row].reading.covariance_mm2()?.trace() / 3.0));
    let stated_mm2 = stated.sum::<f64>() / used.len() as f64;
    let of_point = |times: f64| times * before.trust.point_mm.hypot(stated_mm2.sqrt());
    let [now_mm, then_mm] = [times, 1.0].map(of_point);
    let trust = Trust {
        point_mm: (now_mm * now_mm - stated_mm2).sqrt(),
        rotation_rad: before.trust.rotation_rad.map(|rad| times * rad),
    };
    let before = Before { trust, freedom, ..before.clone() };
    let parameters = comparison.parameters.clone();
    let said = Comparison { set, robot, before: &before, stood, parameters, oriented }.said(used).ok()?.recheck;
    // An instrument that was placed several times does not stand elsewhere each time: the robot does.
    if said.placements.len() > 1 && said.placements.iter().all(|placement| placement.moved) {
        let shifts_mm = said.placements.iter().map(|placement| placement.shift_mm);
        let effect_mm = shifts_mm.fold(whole.recheck.effect_mm, f64::max);
        return Some(Recheck { effect_mm, ..whole.recheck.clone() });
    }
    let words = format!(
        "the readings scatter more than at the identification ({now_mm:.4} mm a coordinate against {then_mm:.4}), and no zero of a joint, tool or scale \
         shows beyond that: a noisier instrument, rounded joint angles, or play"
    );
    let likeliest = vec![(SCATTER.to_owned(), words)];
    (!said.changed).then_some(Recheck {
        changed: true,
        likeliest,
        effect_mm: whole.recheck.effect_mm,
        of_robot_mm: whole.recheck.of_robot_mm,
        ..said
    })
}

/// How many times as far as they are known to the residuals scatter beside all changes, and the degrees of freedom that
/// tell; `None` where they do not scatter more, or a change shows beyond it.
fn beyond_changes(comparison: &Comparison, used: &[usize]) -> Option<(f64, f64)> {
    let look = comparison.look(used)?;
    let suspects = suspects(comparison.robot, &comparison.parameters);
    let looks = Looks { look, again: &|_| None, suspects: &suspects };
    let single = suspects.iter().filter(|suspect| suspect.columns.len() == 1 && looks.is_seen(suspect));
    let (look, directions) =
        (&looks.look, single.flat_map(|suspect| looks.look.directions(suspect)).collect::<Vec<_>>());
    let difference = &look.difference;
    let n = directions.len();
    let (normal, pull) = look.products(&directions);
    let inverse = pseudo_inverse(normal.clone());
    let gain = pull.dot(&(&inverse * &pull));
    let rank = (inverse * &normal).trace().round();
    let (left, freedom) = (difference.chi_square() - gain, difference.off.len() as f64 - rank);
    if freedom < 1.0 || left < difference.limit(freedom as usize, FALSE_ALARM) {
        return None;
    }
    let variance = left / freedom;
    // Whether so much by so many numbers is no more than what the scatter makes, looked at so often.
    let by_scatter = |gain: f64, numbers: f64, times: usize| {
        let law = FisherSnedecor::new(numbers, freedom);
        law.is_ok_and(|law| 1.0 - law.cdf(gain / numbers / variance) > EXPLAINED / times as f64)
    };
    let alone = |i: usize| by_scatter(pull[i] * pull[i] / normal[(i, i)], 1.0, n);
    let is_scatter = (rank < 1.0 || by_scatter(gain, rank, 1)) && (0..n).all(alone);
    (is_scatter && variance.sqrt() < MOST_TIMES).then_some((variance.sqrt(), freedom))
}
