//! Which rig is calibrated where it changed while it was photographed: the one that stands now.
//!
//! In: the corners of all pairs. Out: a calibration with what was found over the series, and whether its last pairs
//! confirm it. Method: all pairs make one rig. A step changes that only where it moves a length by more than a share of
//! the tolerance, and where enough pairs since then make a rig that is surer than the one of all with the step in its
//! uncertainty. A step that stays in is part of the uncertainty, a bias known to its own size (GUM, F.2.4.5). Of a rig
//! that drifts the middle of the series is known best: the rig is that one, and what it drifted since then goes into
//! what is measured later.

use nalgebra::DVector;

use crate::imaging::{Corners, PairCorners};
use crate::stereo::Error;
use crate::stereo::calibrate::{Calibration, RigPairs, calibrate};
use crate::stereo::error::BY_SINCE;
use crate::stereo::findings::one_side::Fit;
use crate::stereo::findings::{
    self, Finding, Kind, before_step, common_misfit, hold, one_side, other_rig, own_lenses, rolling_shutter, two_rigs,
    without_drift,
};
use crate::stereo::model::Covariance;
use crate::stereo::pairs::{Cause, Discarded, DiscardedPair, Standing, fewest_pairs};
use crate::stereo::select::options::Options;
use crate::stereo::volume::Extent;
use crate::stereo::volume::lengths::{VolumeLengths, long_mm};

/// A change that moves a length by less than this share of the tolerance changes nothing.
pub const MATERIAL_SHARE: f64 = 0.1;

/// Share of a drift in the middle of the series.
const MIDDLE: f64 = 0.5;

/// What is asked of a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Asked {
    pub options: Options,
    /// The largest error that passes, mm.
    pub tolerance_mm: f64,
    pub extent: Extent,
}

/// Calibrates the rig that stands now, and says what happened to it before.
pub fn calibrate_standing(corners: &Corners, asked: &Asked) -> Result<(Calibration, Vec<Finding>), Error> {
    let fitting = |corners: &Corners| {
        let (found, _) = standing(corners, asked).ok()?;
        let (missed, rig) = (common_misfit::missed(&found), found.rig());
        Some(Fit { pairs: found.views.len(), missed, is_left_to_the_left: rig.is_left_to_the_left() })
    };
    let known = asked.options.known.as_ref();
    let explain = |error| one_side::explain(error, corners, known, fitting);
    let (mut found, mut told) = standing(corners, asked).map_err(explain)?;
    let of_rig = |found: &Calibration| lengths(found, asked.extent);
    let with_own = own_lenses::instead_of_contradicted(&found);
    let asked_of = with_own.as_ref().unwrap_or(&found);
    match rolling_shutter::look(asked_of, of_rig) {
        // Of corners that were moved back by a drift nothing more is asked.
        Some((rolling, step)) if found.since_moment.is_empty() && rolling.material(asked.tolerance_mm) => {
            allow_for(&mut found, &[step]);
            told.push(rolling);
        }
        _ => {
            let misfit = common_misfit::look(asked_of, &told);
            if misfit.as_ref().is_some_and(|misfit| misfit.cause == Cause::NotSimultaneous.word()) {
                let missed = common_misfit::missed(&found);
                if let Some(changed) = one_side::changed(corners, &one_side::suspected(corners, known), missed, fitting)
                {
                    return Err(changed);
                }
            }
            told.extend(misfit);
        }
    }
    Ok((found, told))
}

fn standing(corners: &Corners, asked: &Asked) -> Result<(Calibration, Vec<Finding>), Error> {
    let Ok(pairs) = RigPairs::new(corners, &asked.options, true) else { return without_runs(corners, asked, None) };
    let mut with_runs = pairs.calibrate(false);
    let mut told = with_runs.as_ref().ok().and_then(|found| change(found, asked));
    if with_runs.as_ref().is_ok_and(|found| found.each_alone)
        && let Some((by_pairs, change)) = by_pairs(&pairs, corners, asked)
    {
        (with_runs, told) = (Ok(by_pairs), Some(change));
    }
    if let (Ok(all), Some(change)) = (&with_runs, &mut told)
        && let Some(later) = later(corners, asked, all, change)
    {
        return Ok(stands_since(corners, asked, later, change.clone()));
    }
    match with_runs {
        Ok(mut found) if found.runs == 0 => {
            trailing(&mut found, corners);
            told.iter_mut().for_each(|change| stays(&mut found, change, asked, corners));
            Ok((found, Vec::from_iter(told)))
        }
        // What contradicts the others is no rig of its own, or too few pairs of one: it is left out.
        _ => without_runs(corners, asked, told),
    }
}

/// The rig with the lenses that the pairs tell, and the drift over them, where that alone is why the pairs miss the rig
/// by more than each camera misses its own pictures: a lens that drifts leaves a picture by itself as good as ever, and
/// looks like something that moved between the two.
fn by_pairs(pairs: &RigPairs, corners: &Corners, asked: &Asked) -> Option<(Calibration, Finding)> {
    let found = pairs.calibrate(true).ok().filter(|found| found.runs == 0)?;
    let change = change(&found, asked).filter(|change| change.kind == Kind::Drift)?;
    let still = without_drift::at_share(&found, corners, &asked.options, change.along.as_ref()?, MIDDLE)?;
    (!still.each_alone).then_some((found, change))
}

/// The rig that stands since a step.
fn stands_since(corners: &Corners, asked: &Asked, later: Later, change: Finding) -> (Calibration, Vec<Finding>) {
    let mut found = later.calibration;
    let (before, is_step) = before_step::left_out(&found, corners, &later.corners, &change);
    let mut told = Vec::new();
    if is_step {
        let since = change.pairs.first().cloned();
        found.standing = Standing { since, pairs_before: before.len(), ..Standing::default() };
        told.push(change);
    }
    trailing(&mut found, corners);
    leave_out(&mut found, before);
    if let Some(mut further) = later.change {
        stays(&mut found, &mut further, asked, &later.corners);
        told.push(further);
    }
    (found, told)
}

/// The rig without the first or the last pairs that contradict the others; `told` is the step that these are, where it
/// was found.
fn without_runs(corners: &Corners, asked: &Asked, told: Option<Finding>) -> Result<(Calibration, Vec<Finding>), Error> {
    let mut found = match calibrate(corners, &asked.options) {
        Err(error @ Error::Contradiction { .. }) => return since_another(corners, asked, error),
        found => found?,
    };
    let first = first_run(&found, corners, told.as_ref());
    let last = last_run(&found, corners, asked, told.as_ref());
    if let Some(last) = &last
        && last.len() >= fewest_pairs(asked.options.known.as_ref())
        && let Some(kept) = since(corners, &last[0])
        && let Ok(calibration) = calibrate(&kept, &asked.options)
    {
        let change = another_rig(told, last.clone());
        return Ok(stands_since(corners, asked, Later { corners: kept, calibration, change: None }, change));
    }
    let at_end = last.is_some();
    let mut findings = Vec::new();
    if let Some(run) = last.or(first) {
        let pairs = if at_end { run.clone() } else { found.pair_names() };
        let change = another_rig(told, pairs);
        for discarded in found.discarded.pairs.iter_mut().filter(|d| run.contains(&d.pair)) {
            *discarded = DiscardedPair::new(&discarded.pair, before_step::of_rig(&change), change.action.clone());
        }
        found.skipped = found.discarded.pairs.iter().map(DiscardedPair::skipped).collect();
        if at_end {
            found.standing.unconfirmed = run;
        } else {
            found.standing.since = change.pairs.first().cloned();
            found.standing.pairs_before = run.len();
        }
        findings.push(change);
    }
    trailing(&mut found, corners);
    Ok((found, findings))
}

/// The rig that followed on another one, where that is why pairs contradict each other.
fn since_another(corners: &Corners, asked: &Asked, error: Error) -> Result<(Calibration, Vec<Finding>), Error> {
    let missed = one_side::missed(&error);
    let later = missed.and_then(|missed| two_rigs::later(corners, missed, &asked.options));
    let Some((kept, calibration)) = later else { return Err(error) };
    let mut change = another_rig(None, kept.pairs.iter().map(|pair| pair.pair.clone()).collect());
    let lengths = lengths(&calibration, asked.extent);
    two_rigs::retell(&mut change, corners, &calibration, None, &lengths, &asked.options);
    Ok(stands_since(corners, asked, Later { corners: kept, calibration, change: None }, change))
}

/// The first pairs, two or more, where they contradict the others and are of one other rig; `told` is a step that was
/// found.
fn first_run(found: &Calibration, corners: &Corners, told: Option<&Finding>) -> Option<Vec<String>> {
    let before: Vec<&PairCorners> = corners.pairs.iter().take_while(|pair| is_of_another_rig(found, pair)).collect();
    let is_step = told.is_some_and(|told| told.is_step_to(&found.pair_names()));
    let mut runs = (2..=before.len()).rev().map(|count| &before[..count]);
    runs.find(|run| is_step || other_rig::is_one(found, found.rig(), run)).map(names)
}

/// The same of the last pairs; where they are enough, the lenses may be others as well.
fn last_run(found: &Calibration, corners: &Corners, asked: &Asked, told: Option<&Finding>) -> Option<Vec<String>> {
    let others = corners.pairs.iter().rev().take_while(|pair| is_of_another_rig(found, pair)).count();
    let after: Vec<&PairCorners> = corners.pairs[corners.pairs.len() - others..].iter().collect();
    let with_lenses = |run: &[&PairCorners]| {
        let kept = Corners { pairs: run.iter().copied().cloned().collect(), ..corners.clone() };
        calibrate(&kept, &asked.options).is_ok_and(|own| other_rig::is_one(found, own.rig(), run))
    };
    let is_one = |run: &&[&PairCorners]| {
        told.is_some_and(|told| told.is_step_to(&names(run)))
            || other_rig::is_one(found, found.rig(), run)
            || run.len() >= fewest_pairs(asked.options.known.as_ref()) && with_lenses(run)
    };
    (2..=after.len()).rev().map(|count| &after[after.len() - count..]).find(is_one).map(names)
}

fn names(pairs: &[&PairCorners]) -> Vec<String> {
    pairs.iter().map(|pair| pair.pair.clone()).collect()
}

/// The step to these pairs, as it was found, or as far as it is known: a rig that fits so badly to the other that none
/// fits both.
fn another_rig(told: Option<Finding>, pairs: Vec<String>) -> Finding {
    told.filter(|told| told.is_step_to(&pairs)).unwrap_or_else(|| {
        let first = pairs.first().map_or("", String::as_str);
        let action = format!(
            "a camera moved or was focused: from pair {first} on the pairs are of another rig than those before. Clamp both cameras"
        );
        let cause = format!("{}|{}", Cause::CameraMoved.word(), Cause::Focus.word());
        let remedy = hold(&cause, None);
        Finding { cause, kind: Kind::Step, pairs, action, remedy, ..Finding::default() }
    })
}

/// Calibrates from the pairs since one of them, as asked for.
pub fn calibrate_since(corners: &Corners, pair: &str, asked: &Asked) -> Result<(Calibration, Vec<Finding>), Error> {
    let names = || corners.pairs.iter().map(|p| p.pair.clone()).collect();
    let kept = since(corners, pair).ok_or_else(|| Error::NoSuchPair { pair: pair.to_owned(), pairs: names() })?;
    let before = corners.pairs.iter().take_while(|p| p.pair != pair);
    let reason = format!("it was taken before pair {pair}, {BY_SINCE}");
    let before: Vec<DiscardedPair> =
        before.map(|p| DiscardedPair::new(&p.pair, Cause::Before, reason.clone())).collect();
    let (mut found, told) = calibrate_standing(&kept, asked).map_err(|error| match error {
        Error::TooFewPairs { found, needed, total, mut skipped } => {
            skipped.extend(before.iter().map(DiscardedPair::skipped));
            Error::TooFewPairs { found, needed, total: total + before.len(), skipped }
        }
        other => other,
    })?;
    leave_out(&mut found, before);
    Ok((found, told))
}

/// Adds pairs that are not used.
fn leave_out(found: &mut Calibration, pairs: Vec<DiscardedPair>) {
    let mut all = [std::mem::take(&mut found.discarded.pairs), pairs].concat();
    all.sort_by(|a, b| a.pair.cmp(&b.pair));
    found.skipped = all.iter().map(DiscardedPair::skipped).collect();
    found.discarded = Discarded::new(&found.views, all);
}

/// The same corners from a pair on, in their order.
pub fn since(corners: &Corners, pair: &str) -> Option<Corners> {
    let first = corners.pairs.iter().position(|p| p.pair == pair)?;
    Some(Corners { pairs: corners.pairs[first..].to_vec(), ..corners.clone() })
}

fn lengths(calibration: &Calibration, extent: Extent) -> VolumeLengths {
    VolumeLengths::new(calibration, extent, long_mm(&calibration.board), 1.0)
}

fn change(calibration: &Calibration, asked: &Asked) -> Option<Finding> {
    findings::look(calibration, &lengths(calibration, asked.extent))
}

impl Finding {
    /// Whether it is a step, and these are the pairs from it on.
    fn is_step_to(&self, pairs: &[String]) -> bool {
        self.kind == Kind::Step && self.pairs == pairs
    }

    /// Whether this cause is the one found, or not told apart from it.
    pub fn may_be(&self, cause: Cause) -> bool {
        self.cause.split('|').any(|word| word == cause.word())
    }

    /// Whether it moves a length by more than the share of the tolerance up to which a change is harmless.
    pub fn material(&self, tolerance_mm: f64) -> bool {
        self.effect_mm.is_some_and(|mm| mm > MATERIAL_SHARE * tolerance_mm)
    }
}

/// The rig of the pairs since a step.
struct Later {
    corners: Corners,
    calibration: Calibration,
    /// What goes on in these pairs.
    change: Option<Finding>,
}

/// The rig of the pairs since a step, where these are enough, it is surer than the one of all, and it stands: of a rig
/// that goes on changing (a focus that hunts) no part is the one that stands, and all pairs together say best what it
/// does.
fn later(corners: &Corners, asked: &Asked, all: &Calibration, change: &mut Finding) -> Option<Later> {
    if change.kind != Kind::Step
        || !change.material(asked.tolerance_mm)
        || change.pairs.len() < fewest_pairs(asked.options.known.as_ref())
    {
        return None;
    }
    let kept = since(corners, change.pairs.first()?)?;
    let calibration = calibrate(&kept, &asked.options).ok()?;
    let worst = |calibration: &Calibration| {
        let lengths = lengths(calibration, asked.extent);
        lengths.worst(|length| length.calibration_mm).map_or(f64::INFINITY, |(mm, _)| mm)
    };
    let with_step = worst(all).hypot(change.effect_mm?);
    let further = self::change(&calibration, asked);
    if let Some(again) = further.as_ref().filter(|again| again.kind == Kind::Step && again.material(asked.tolerance_mm))
    {
        change.cause = Cause::Unknown.word().to_owned();
        let fewest = fewest_pairs(asked.options.known.as_ref());
        change.remedy =
            hold(&change.cause, Some(&again.pairs).filter(|pairs| pairs.len() >= fewest).map(Vec::as_slice));
        let [from, by_mm] = [again.pairs.first().cloned(), again.effect_mm.map(|mm| format!("{mm:.4}"))];
        let [from, by_mm] = [from, by_mm].map(Option::unwrap_or_default);
        let on = |first: &str| {
            format!("the rig goes on changing: {first}; and again from pair {from} on, by up to {by_mm} mm")
        };
        (change.brief, change.action) = (Some(on(change.briefly())), on(&change.action));
        // Lengths may be off by the larger of both.
        change.effect_mm = again.effect_mm.into_iter().chain(change.effect_mm).reduce(f64::max);
        return None;
    }
    if worst(&calibration) >= with_step {
        return None;
    }
    let told = change.along.as_ref().map(|along| along.in_layout(&all.layout, &calibration.layout).whole);
    let lengths = lengths(&calibration, asked.extent);
    two_rigs::retell(change, corners, &calibration, told, &lengths, &asked.options);
    Some(Later { corners: kept, calibration, change: further })
}

/// A change that stays in the rig: of one that drifts the rig is that of the middle of the series, and what it drifted
/// since then is told beside it; a step is part of the uncertainty. Where the last pairs are those of another rig, that
/// is said.
fn stays(found: &mut Calibration, change: &mut Finding, asked: &Asked, corners: &Corners) {
    let board_may_grow = change.may_be(Cause::OtherBoard);
    if let Some(along) = &mut change.along {
        let mut noise = 1.0;
        if change.kind == Kind::Drift {
            match without_drift::at_share(found, corners, &asked.options, along, MIDDLE) {
                Some(still) => {
                    // What the corners were said to scatter by had the drift in it.
                    let [own, with_drift] = [&still, &*found].map(|c| c.noise.typical_px(&c.views));
                    noise = still.inflation * (own / with_drift).powi(2);
                    *along = along.in_layout(&found.layout, &still.layout);
                    *found = still;
                }
                None => found.move_rig(&along.to(MIDDLE)),
            }
        }
        let mut within = vec![if change.kind == Kind::Drift { along.sigma_of(MIDDLE, noise) } else { along.to(1.0) }];
        if change.kind == Kind::Drift {
            *along = along.seen_from(MIDDLE);
            found.since_moment.push(along.to(1.0));
            // Of a board that grows nobody knows at which pair it had its size.
            if board_may_grow {
                within.push(along.to(1.0));
            }
        }
        allow_for(found, &within);
    }
    let fewer = 2 * change.pairs.len() < found.views.len();
    if change.kind == Kind::Step && change.material(asked.tolerance_mm) && fewer {
        found.standing.unconfirmed = change.pairs.clone();
    }
}

/// Adds steps that the rig may be off by to its uncertainty.
fn allow_for(found: &mut Calibration, steps: &[DVector<f64>]) {
    steps.iter().for_each(|step| found.covariance += step * step.transpose());
    let matrix = found.covariance.clone();
    found.values.shared.rig.covariance = Some(Covariance { order: found.layout.names(), matrix });
}

/// The last pairs, where they are left out because they contradict the others: the rig may no longer stand.
fn trailing(found: &mut Calibration, corners: &Corners) {
    let used = |pair: &PairCorners| found.views.iter().any(|view| view.pair == pair.pair);
    let Some(last) = corners.pairs.iter().rposition(used) else { return };
    let after = corners.pairs[last + 1..].iter().filter(|pair| is_of_another_rig(found, pair));
    let after: Vec<String> = after.map(|pair| pair.pair.clone()).collect();
    found.standing.unconfirmed.extend(after);
}

/// Whether a pair is left out because it contradicts the others, by what may be the rig.
fn is_of_another_rig(found: &Calibration, pair: &PairCorners) -> bool {
    found.discarded.pairs.iter().any(|d| d.pair == pair.pair && d.cause.may_be_the_rig())
}
