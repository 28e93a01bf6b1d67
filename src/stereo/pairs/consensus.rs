//! Pairs that make up one rig, and what happened to the others.
//!
//! In: candidates and a lens that is rich enough for both cameras. Out: the views of the rig that stands now with values to start from,
//! and the others with their causes. Method: each camera on its own pictures, so that nothing is judged by a rig before there is one; the
//! numbering that most pairs agree on; the grouping of the pairs by their own relative poses (`consistency`). Where the series is two
//! rigs, the last one stands. Goes wrong: most pairs contradict each other; too few pairs of the rig that stands.

use nalgebra::Vector3;

use crate::geometry::Transform;
use crate::imaging::{Side, Skipped};
use crate::statistics::median;
use crate::stereo::data::observation::Observation;
use crate::stereo::data::view::View;
use crate::stereo::init::relative_pose::agreed_transform;
use crate::stereo::model::parameters::{Layout, Shared, Values};
use crate::stereo::pairs::candidates::Candidates;
use crate::stereo::pairs::changes::{self, Change, Changes};
use crate::stereo::pairs::consistency::{self, Grouping, Linearised};
use crate::stereo::pairs::diagnosis::{self, Member, Series};
use crate::stereo::pairs::discarded::too_few_pairs;
use crate::stereo::pairs::numbering;
use crate::stereo::pairs::screening::{self, Usual};
use crate::stereo::pairs::single_pictures::SinglePictures;
use crate::stereo::pairs::{Cause, DiscardedPair, FEWEST_PAIRS, Standing};
use crate::stereo::solve::levenberg_marquardt::{self, Search};
use crate::stereo::solve::problem::Problem;
use crate::stereo::solve::robust_loss::{CAUCHY_WIDTH, Loss};
use crate::stereo::{Error, Lens, Rig};

/// The pairs of the rig that stands now.
#[derive(Debug, Clone, PartialEq)]
pub struct Consensus {
    /// Its pairs, with right corners turned where that was needed.
    pub views: Vec<View>,
    /// A first rig, and each pair's pose on it.
    pub values: Values,
    /// The other pairs.
    pub discarded: Vec<DiscardedPair>,
    /// Which part of the series it is.
    pub standing: Standing,
}

impl Consensus {
    /// The pairs with the values to start from.
    pub fn problem(&self) -> Problem {
        Problem { views: self.views.clone(), values: self.values.clone() }
    }

    /// The other pairs with what happened to them.
    pub fn skipped(&self) -> Vec<Skipped> {
        self.discarded.iter().map(DiscardedPair::skipped).collect()
    }

    /// Names of the pairs.
    pub fn names(&self) -> Vec<&str> {
        self.views.iter().map(|view| view.pair.as_str()).collect()
    }
}

/// All pairs, each with a place of the right camera of its own where its pictures give one.
struct Scene<'a> {
    candidates: &'a Candidates,
    layout: Layout,
    /// Cameras and shape as single pictures have them; the rig in it is the one that most pairs agree on.
    shared: Shared,
    /// Corners with the weights of single pictures, and with the right ones renumbered where that was needed.
    views: Vec<View>,
    /// `left_from_board` and the pair's own `right_from_left`.
    own: Vec<Option<(Transform, Transform)>>,
    pairs: Vec<Option<Linearised>>,
}

/// Finds the pairs of the rig that stands now.
pub fn find(candidates: &Candidates, lens: Lens) -> Result<Consensus, Error> {
    let scene = Scene::new(candidates, lens)?;
    let mut grouping = consistency::group(&scene.pairs);
    scene.without_gross(&mut grouping);
    consistency::dissolve_single(&mut grouping);
    let changes = changes::of(&scene.pairs, &scene.layout, &scene.shared.rig, &grouping);
    let standing = changes.standing;
    let members: Vec<usize> = (0..grouping.len()).filter(|&i| standing.is_some() && grouping[i] == standing).collect();
    let values = scene.start(&members);
    let mut discarded = scene.explain(&grouping, &changes, &members, &values.shared);
    let unconfirmed = unconfirmed(candidates, &members, &discarded);
    let before: Vec<usize> = (0..grouping.len())
        .filter(|&i| grouping[i].is_some_and(|g| Some(g) != standing && changes.is_other_rig(g)))
        .collect();
    check(candidates, &grouping, &members, &before, &discarded)?;
    let first = members.first().filter(|_| !before.is_empty());
    let since = first.map(|&i| candidates.views[i].pair.clone());
    discarded.extend(candidates.discarded.iter().cloned());
    discarded.sort_by(|a, b| a.pair.cmp(&b.pair));
    Ok(Consensus {
        views: members.iter().map(|&i| scene.views[i].clone()).collect(),
        values,
        discarded,
        standing: Standing { since, pairs_before: before.len(), unconfirmed },
    })
}

/// The last pairs, where what is wrong with them may be that the rig no longer stands.
fn unconfirmed(candidates: &Candidates, members: &[usize], discarded: &[DiscardedPair]) -> Vec<String> {
    let after = members.last().map_or(0, |last| last + 1);
    let may_have_moved = |pair: &str| {
        let cause = discarded.iter().find(|d| d.pair == pair).map(|d| d.cause);
        matches!(cause, Some(Cause::NotSimultaneous | Cause::CameraMoved | Cause::Zoomed))
    };
    candidates.views[after..].iter().map(|v| v.pair.clone()).filter(|pair| may_have_moved(pair)).collect()
}

/// Refuses where there is no telling which pairs are right, or too few of the rig that stands.
fn check(
    candidates: &Candidates,
    grouping: &Grouping,
    members: &[usize],
    before: &[usize],
    discarded: &[DiscardedPair],
) -> Result<(), Error> {
    let judged = candidates.views.len();
    let together = grouping.iter().flatten().count();
    let mut bad: Vec<Skipped> = discarded.iter().map(DiscardedPair::skipped).collect();
    if 2 * together <= judged || (members.len() < FEWEST_PAIRS && before.is_empty() && 2 * members.len() <= judged) {
        let lonely = |&i: &usize| Skipped {
            pair: candidates.views[i].pair.clone(),
            reason: "fits that rig, but too few do to trust it".into(),
        };
        bad.extend(members.iter().map(lonely));
        bad.sort_by(|a, b| a.pair.cmp(&b.pair));
        return Err(Error::Contradiction { agreeing: members.len(), total: judged, bad });
    }
    if members.len() >= FEWEST_PAIRS {
        return Ok(());
    }
    if let (Some(&first), false) = (members.first(), before.is_empty()) {
        let since = candidates.views[first].pair.clone();
        return Err(Error::SeriesChanged { since, after: members.len(), needed: FEWEST_PAIRS, bad });
    }
    let all: Vec<DiscardedPair> = discarded.iter().chain(&candidates.discarded).cloned().collect();
    Err(too_few_pairs(members.len(), &all))
}

impl<'a> Scene<'a> {
    fn new(candidates: &'a Candidates, lens: Lens) -> Result<Scene<'a>, Error> {
        let refine =
            |side: Side| SinglePictures::refine(&candidates.views, side, &candidates.cameras[side as usize], lens);
        let (left, right) = rayon::join(|| refine(Side::Left), || refine(Side::Right));
        let both: Vec<Option<(Transform, Transform)>> =
            left.poses.iter().zip(&right.poses).map(|(l, r)| l.zip(*r)).collect();
        let distances = both.iter().flatten().map(|(l, _)| l.translation.vector.norm());
        let distance_mm = median(distances).ok_or(Error::NoCamera { side: Side::Left })?;
        let open = numbering::turns_left_open(&candidates.board);
        let (right_from_left, turns) =
            numbering::agreed(&open, &both, distance_mm).ok_or(Error::NoCamera { side: Side::Right })?;
        let rig = Rig { left: left.camera, right: right.camera, right_from_left, covariance: None };
        let shape_mm = std::array::from_fn(|i| 0.5 * (left.shape_mm[i] + right.shape_mm[i]));
        let shared = Shared { rig, shape_mm };
        let layout =
            Layout { left: Some(left.camera.lens), right: Some(right.camera.lens), transform: true, shape: true };
        let (mut views, mut own, mut pairs) = (left.pictures, Vec::new(), Vec::new());
        for (((view, picture), poses), &turn) in views.iter_mut().zip(&right.pictures).zip(&both).zip(&turns) {
            view.observations.extend(picture.observations.iter().map(|o| Observation { side: Side::Right, ..*o }));
            view.turn_right(&candidates.board, turn);
            let of_pair = poses.map(|(l, r)| (l, r * numbering::renumbered(turn) * l.inverse()));
            own.push(of_pair);
            pairs.push(of_pair.and_then(|(left_from_board, right_from_left)| {
                let own = Shared { rig: Rig { right_from_left, ..shared.rig.clone() }, ..shared.clone() };
                Linearised::new(&own, &layout, &left_from_board, view, &shared.rig.right_from_left)
            }));
        }
        Ok(Scene { candidates, layout, shared, views, own, pairs })
    }

    /// Values to start from: a robust bundle of these pairs.
    fn start(&self, members: &[usize]) -> Values {
        let of = |i: &usize| Some((self.views[*i].clone(), self.own[*i]?));
        let known: Vec<(View, (Transform, Transform))> = members.iter().filter_map(of).collect();
        let choices: Vec<Vec<Transform>> = known.iter().map(|(_, (_, own))| vec![*own]).collect();
        let distance_mm = median(known.iter().map(|(_, (left, _))| left.translation.vector.norm())).unwrap_or(1.0);
        let reference = self.shared.rig.right_from_left;
        let right_from_left = agreed_transform(&choices, distance_mm).unwrap_or(reference);
        let shared = Shared { rig: Rig { right_from_left, ..self.shared.rig.clone() }, ..self.shared.clone() };
        let values = Values { shared, poses: known.iter().map(|(_, (left, _))| *left).collect() };
        let views: Vec<View> = known.into_iter().map(|(view, _)| view).collect();
        // The cameras stay as their own pictures have them, from whatever rig: the rig follows.
        let layout = Layout { transform: true, ..Layout::POSES_ONLY };
        levenberg_marquardt::solve(&views, &layout, values, Loss::Cauchy(CAUCHY_WIDTH), Search::ROUGH).values
    }

    /// Takes out what misses the rig of its own group by much more than single pictures miss a camera: where nearly all pairs contradict each
    /// other their scatter is no measure.
    fn without_gross(&self, grouping: &mut Grouping) {
        let alone = self.candidates.cameras.iter().flat_map(|camera| camera.median_px.iter().flatten().copied());
        let px = median(alone).unwrap_or(0.0);
        let limit = Usual { px, width_px: self.candidates.width_px }.limit_px(px);
        for group in 0..consistency::groups(grouping) {
            let members: Vec<usize> = (0..grouping.len()).filter(|&i| grouping[i] == Some(group)).collect();
            let shared = self.start(&members).shared;
            for i in members {
                if screening::misfit_px(&shared, &self.views[i]).is_none_or(|(px, _)| px > limit) {
                    grouping[i] = None;
                }
            }
        }
    }

    /// Every pair that is none of the standing rig's, with what happened to it.
    fn explain(
        &self,
        grouping: &Grouping,
        changes: &Changes,
        members: &[usize],
        shared: &Shared,
    ) -> Vec<DiscardedPair> {
        let alone_px = |i: usize| self.candidates.cameras.each_ref().map(|camera| camera.median_px[i]);
        let all: Vec<usize> = (0..self.views.len()).collect();
        let strays: Vec<usize> = all.iter().copied().filter(|i| !members.contains(i)).collect();
        if strays.is_empty() {
            return Vec::new();
        }
        let px = median(all.iter().flat_map(|&i| alone_px(i)).flatten()).unwrap_or(0.0);
        let usual = Usual { px, width_px: self.candidates.width_px };
        // What the grouping explains by itself needs no further ideas.
        let change = |i: usize| changes.of_pair(grouping, i);
        let settled = |i: usize| {
            members.contains(&i)
                || grouping[i].is_some()
                || matches!(change(i), Some(Change::Pitch(_)))
                || (self.pairs[i].is_some()
                    && screening::misfit_px(shared, &self.views[i]).is_some_and(|(px, _)| px <= usual.limit_px(0.0)))
        };
        let member = |&i: &usize| Member { view: &self.views[i], alone_px: alone_px(i), belongs: settled(i) };
        let series = Series { shared, board: &self.candidates.board, usual, members: all.iter().map(member).collect() };
        let ideas = diagnosis::explain(&series);
        strays
            .into_iter()
            .map(|i| {
                let group = grouping[i]
                    .map(|group| all.iter().copied().filter(|&j| grouping[j] == Some(group)).collect::<Vec<usize>>());
                let names = |j: usize| self.candidates.views[j].pair.as_str();
                let (cause, reason) = match (ideas[i].clone(), change(i), group) {
                    (Some(idea), ..) => idea,
                    (None, Some(change), Some(group)) => {
                        let group: Vec<&str> = group.into_iter().map(names).collect();
                        of_group(&change, &group, names(members.first().copied().unwrap_or(i)), &self.shared.rig)
                    }
                    (None, Some(change), None) => of_pair(&change),
                    (None, None, _) => (Cause::Misshapen, "its corners form no board on either camera".to_owned()),
                };
                DiscardedPair::new(names(i), cause, reason)
            })
            .collect()
    }
}

/// What happened to a single pair that the rig of the others contradicts.
fn of_pair(change: &Change) -> (Cause, String) {
    match change {
        Change::Pitch(share) => (Cause::OtherBoard, other_board(*share)),
        Change::Zoom(side, share) => (
            Cause::Zoomed,
            format!(
                "the {} camera's focal length differs by {:.3} % from the other pairs': was it focused?",
                side.name(),
                100.0 * share
            ),
        ),
        Change::Moved(by) => (
            Cause::NotSimultaneous,
            format!(
                "the pictures contradict the rig of the other pairs by much more than their corners scatter: between them the board or a \
                 camera moved by {:.4} deg and {:.3} mm. Clamp the board and trigger both cameras at once",
                by.fixed_rows::<3>(0).norm().to_degrees(),
                by.fixed_rows::<3>(3).norm()
            ),
        ),
    }
}

/// What happened to the pairs of another rig; `since` is the first pair of the one that stands.
fn of_group(change: &Change, group: &[&str], since: &str, rig: &Rig) -> (Cause, String) {
    let (first, last) = (group.first().copied().unwrap_or(""), group.last().copied().unwrap_or(""));
    match change {
        Change::Pitch(share) => (Cause::OtherBoard, other_board(*share)),
        Change::Zoom(side, share) => (
            Cause::Zoomed,
            format!(
                "the rig changed: up to pair {last} the {} camera's focal length differed by {:.3} % from what it is from pair {since} on. \
                 The rig that stands is calibrated from the pairs since then alone",
                side.name(),
                100.0 * share
            ),
        ),
        Change::Moved(by) => {
            let turn = Vector3::new(by[0], by[1], by[2]);
            let shift = Vector3::new(by[3], by[4], by[5]);
            // The camera's own place moves by what the turn about the left camera does not explain.
            let place = shift - turn.cross(&rig.right_from_left.translation.vector);
            (
                Cause::CameraMoved,
                format!(
                    "a camera moved: in pairs {first} to {last} the right one is turned by {:.3} deg and shifted by {:.3} mm against the left, \
                     compared with the rig that stands from pair {since} on. Clamp both; the rig is calibrated from the pairs since then alone",
                    turn.norm().to_degrees(),
                    place.norm()
                ),
            )
        }
    }
}

fn other_board(share: f64) -> String {
    format!(
        "it shows another board: its squares are {:.3} % {} than those in the other pairs",
        100.0 * share.abs(),
        if share > 0.0 { "larger" } else { "smaller" }
    )
}
