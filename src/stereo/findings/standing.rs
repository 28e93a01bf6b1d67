//! Which rig is calibrated where it changed while it was photographed: the one that stands now.
//!
//! In: the corners of all pairs. Out: a calibration with what was found over the series, and whether its last pairs confirm it. Method: all pairs
//! make one rig. A step changes that only where it moves a length by more than a share of the tolerance, and where enough pairs since then
//! make a rig that is surer than the one of all with the step in its uncertainty. What stays in is part of the uncertainty: the
//! step or drift from the common rig to the last pair is a bias known to its own size (GUM, F.2.4.5).

use crate::imaging::{Corners, PairCorners};
use crate::stereo::Error;
use crate::stereo::calibrate::{Calibration, calibrate, calibrate_with};
use crate::stereo::findings::{self, Finding, Kind};
use crate::stereo::model::rig::Covariance;
use crate::stereo::pairs::{Cause, Discarded, DiscardedPair, FEWEST_PAIRS, Standing};
use crate::stereo::select::lens_ladder::Options;
use crate::stereo::volume::Extent;
use crate::stereo::volume::lengths::VolumeLengths;

/// A change that moves a length by less than this share of the tolerance changes nothing.
pub const MATERIAL_SHARE: f64 = 0.1;

/// Squares of the lengths that a change is judged by: 70 mm on the paper's board.
const LONG_SQUARES: usize = 7;

/// What is asked of a calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asked {
    /// Lens and board.
    pub options: Options,
    /// The largest error that passes, mm.
    pub tolerance_mm: f64,
    /// The volume.
    pub extent: Extent,
}

/// Calibrates the rig that stands now, and says what happened to it before.
pub fn calibrate_standing(corners: &Corners, asked: &Asked) -> Result<(Calibration, Vec<Finding>), Error> {
    let mut found = calibrate_with(corners, &asked.options, true)?;
    let mut told = Vec::from_iter(change(&found, asked));
    let mut standing = told.first_mut().and_then(|change| later(corners, asked, &found, change));
    if standing.is_none() && found.runs > 0 {
        // What contradicts the others is no rig of its own, or too few pairs of one: it is left out.
        found = calibrate(corners, &asked.options)?;
        told = Vec::from_iter(change(&found, asked));
        standing = told.first_mut().and_then(|change| later(corners, asked, &found, change));
    }
    match (standing, told.first()) {
        (Some(standing), Some(change)) => {
            let since = change.pairs.first().cloned();
            let before = dropped(corners, &standing.corners, change);
            found = standing.calibration;
            found.standing = Standing { since, pairs_before: before.len(), ..Standing::default() };
            trailing(&mut found, corners);
            leave_out(&mut found, before);
            if let Some(change) = standing.change {
                stays(&mut found, &change, asked);
                told.push(change);
            }
        }
        (_, change) => {
            trailing(&mut found, corners);
            change.into_iter().for_each(|change| stays(&mut found, change, asked));
        }
    }
    Ok((found, told))
}

/// Calibrates from the pairs since one of them, as asked for.
pub fn calibrate_since(corners: &Corners, pair: &str, asked: &Asked) -> Result<(Calibration, Vec<Finding>), Error> {
    let names = || corners.pairs.iter().map(|p| p.pair.clone()).collect();
    let kept = since(corners, pair).ok_or_else(|| Error::NoSuchPair { pair: pair.to_owned(), pairs: names() })?;
    let (mut found, told) = calibrate_standing(&kept, asked)?;
    let before = corners.pairs.iter().take_while(|p| p.pair != pair);
    let reason = format!("it was taken before pair {pair}, which --since names");
    let before: Vec<DiscardedPair> =
        before.map(|p| DiscardedPair::new(&p.pair, Cause::Before, reason.clone())).collect();
    leave_out(&mut found, before);
    Ok((found, told))
}

/// Adds pairs that are not used.
fn leave_out(found: &mut Calibration, pairs: Vec<DiscardedPair>) {
    found.skipped.extend(pairs.iter().map(DiscardedPair::skipped));
    found.skipped.sort_by(|a, b| a.pair.cmp(&b.pair));
    let mut all: Vec<DiscardedPair> = found.discarded.pairs.iter().cloned().chain(pairs).collect();
    all.sort_by(|a, b| a.pair.cmp(&b.pair));
    found.discarded = Discarded::new(&found.views, all);
}

/// The same corners from a pair on, in their order.
pub fn since(corners: &Corners, pair: &str) -> Option<Corners> {
    let first = corners.pairs.iter().position(|p| p.pair == pair)?;
    Some(Corners { pairs: corners.pairs[first..].to_vec(), ..corners.clone() })
}

fn lengths(calibration: &Calibration, extent: Extent) -> VolumeLengths {
    let board = &calibration.board;
    let squares = LONG_SQUARES.min(board.columns() - 1);
    VolumeLengths::new(calibration, extent, squares as f64 * board.square_mm, 1.0)
}

fn change(calibration: &Calibration, asked: &Asked) -> Option<Finding> {
    findings::look(calibration, &lengths(calibration, asked.extent))
}

impl Finding {
    /// Whether it moves a length by more than the share of the tolerance up to which a change is harmless.
    pub fn material(&self, asked: &Asked) -> bool {
        self.effect_mm.is_some_and(|mm| mm > MATERIAL_SHARE * asked.tolerance_mm)
    }
}

/// The rig of the pairs since a step.
struct Later {
    corners: Corners,
    calibration: Calibration,
    /// What goes on in these pairs.
    change: Option<Finding>,
}

/// The rig of the pairs since a step, where these are enough, it is surer than the one of all, and it stands: of a rig that goes on changing (a
/// focus that hunts) no part is the one that stands, and all pairs together say best what it does.
fn later(corners: &Corners, asked: &Asked, all: &Calibration, change: &mut Finding) -> Option<Later> {
    if change.kind != Kind::Step || !change.material(asked) || change.pairs.len() < FEWEST_PAIRS {
        return None;
    }
    let corners = since(corners, change.pairs.first()?)?;
    let calibration = calibrate(&corners, &asked.options).ok()?;
    let worst = |calibration: &Calibration| {
        let lengths = lengths(calibration, asked.extent);
        lengths.worst(|length| length.calibration_mm).map_or(f64::INFINITY, |(mm, _)| mm)
    };
    let with_step = worst(all).hypot(change.effect_mm?);
    let further = self::change(&calibration, asked);
    if let Some(again) = further.as_ref().filter(|again| again.kind == Kind::Step && again.material(asked)) {
        let from = again.pairs.first().map_or("", String::as_str);
        change.cause = Cause::Unknown.word().to_owned();
        change.action =
            format!("the rig goes on changing: {}, and again from pair {from} on ({})", change.action, again.action);
        return None;
    }
    (worst(&calibration) < with_step).then_some(Later { corners, calibration, change: further })
}

/// A change that stays in the rig is part of its uncertainty; where its last pairs are those of another rig, that is said.
fn stays(found: &mut Calibration, change: &Finding, asked: &Asked) {
    if let Some(step) = &change.step {
        found.uncertainty.shared += step * step.transpose();
        let matrix = found.uncertainty.shared.clone();
        found.values.shared.rig.covariance = Some(Covariance { order: found.layout.names(), matrix });
    }
    let fewer = 2 * change.pairs.len() < found.views.len();
    if change.kind == Kind::Step && change.material(asked) && fewer {
        found.standing.unconfirmed = change.pairs.clone();
    }
}

/// The last pairs, where they are left out because they contradict the others: the rig may no longer stand.
fn trailing(found: &mut Calibration, corners: &Corners) {
    let used = |pair: &PairCorners| found.views.iter().any(|view| view.pair == pair.pair);
    let Some(last) = corners.pairs.iter().rposition(used) else { return };
    let contradicts = |pair: &&PairCorners| {
        found
            .discarded
            .pairs
            .iter()
            .any(|d| d.pair == pair.pair && matches!(d.cause, Cause::Unknown | Cause::NotSimultaneous))
    };
    let after: Vec<String> =
        corners.pairs[last + 1..].iter().filter(contradicts).map(|pair| pair.pair.clone()).collect();
    found.standing =
        Standing { unconfirmed: [found.standing.unconfirmed.clone(), after].concat(), ..found.standing.clone() };
}

/// The pairs of the rig that stood before a step.
fn dropped(corners: &Corners, kept: &Corners, change: &Finding) -> Vec<DiscardedPair> {
    let is_kept = |pair: &str| kept.pairs.iter().any(|p| p.pair == pair);
    let cause = if change.cause == "focus" { Cause::Focus } else { Cause::CameraMoved };
    let reason = format!("the rig changed after it: {}", change.action);
    let before = corners.pairs.iter().filter(|p| !is_kept(&p.pair));
    before.map(|p| DiscardedPair::new(&p.pair, cause, reason.clone())).collect()
}
