//! The pairs that may make up a rig: those with a board in both pictures, each once; of boards whose corners have
//! numbers of their own also those that one picture shows.

use rayon::prelude::*;

use crate::geometry::Transform;
use crate::imaging::{Board, Corner, Corners, PairCorners, Side, Skipped};
use crate::statistics::median;
use crate::stereo::data::{Observation, View};
use crate::stereo::error::{Error, ONE_PICTURE};
use crate::stereo::init::homography::{self, FEWEST_CORNERS};
use crate::stereo::init::single_camera::{self, OneCamera};
use crate::stereo::model::KnownLenses;
use crate::stereo::pairs::discarded::too_few_pairs;
use crate::stereo::pairs::{Cause, DiscardedPair, fewest_pairs, numbering};

/// Pairs to choose from, in the order in which they were taken, with each camera on its own pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidates {
    pub board: Board,
    /// The pairs as they were read.
    pub views: Vec<View>,
    /// The left and the right camera on their own pictures.
    pub cameras: [OneCamera; 2],
    /// Width of the wider picture, px.
    pub width_px: u32,
    /// Pairs that are none.
    pub discarded: Vec<DiscardedPair>,
    /// Fewest pairs for a rig.
    pub fewest_pairs: usize,
}

impl Candidates {
    /// Gathers them; a camera whose lens is known is not looked for in its pictures.
    pub fn new(corners: &Corners, known: Option<&KnownLenses>) -> Result<Candidates, Error> {
        let not_found = |s: &Skipped| DiscardedPair::new(&s.pair, Cause::NoBoard, s.reason.clone());
        let mut discarded: Vec<DiscardedPair> = corners.skipped.iter().map(not_found).collect();
        let mut views = Vec::new();
        let fewest = if corners.board.is_coded() { 0 } else { FEWEST_CORNERS.max(fewest_corners(&corners.board)) };
        for (i, pair) in corners.pairs.iter().enumerate() {
            let is_same = |first: &&PairCorners| same(&first.left, &pair.left) && same(&first.right, &pair.right);
            let first = corners.pairs[..i].iter().find(is_same);
            let again = first.map(|first| format!("the same pictures as pair {}", first.pair));
            let is_one = !pair.left.is_empty() && same(&pair.left, &pair.right);
            let one = is_one.then(|| format!("{ONE_PICTURE}: both cameras need their own"));
            if let Some(reason) = again.or(one) {
                discarded.push(DiscardedPair::new(&pair.pair, Cause::Duplicate, reason));
                continue;
            }
            let view = View::new(&corners.board, pair, fewest);
            let [left, right] = Side::BOTH.map(|side| view.active(side).count());
            let is_enough = if corners.board.is_coded() { tells_a_pose(&view) } else { left.min(right) >= fewest };
            if is_enough {
                views.push(view);
            } else {
                let reason = too_few_corners(pair, [left, right]);
                discarded.push(DiscardedPair::new(&view.pair, Cause::NoBoard, reason));
            }
        }
        let fewest_pairs = fewest_pairs(known);
        if views.len() < fewest_pairs {
            return Err(too_few_pairs(views.len(), fewest_pairs, &discarded));
        }
        let both = |view: &&View| Side::BOTH.into_iter().all(|side| view.active(side).next().is_some());
        if views.iter().filter(both).count() == 0 {
            let blind = Side::BOTH.into_iter().find_map(|side| blind(corners, &views, side));
            return Err(blind.unwrap_or(Error::NothingInCommon { pairs: views.len() }));
        }
        let sizes = [corners.left_size, corners.right_size];
        let cameras: Vec<Option<OneCamera>> = Side::BOTH
            .into_par_iter()
            .map(|side| match known.and_then(|known| known.camera(side)) {
                Some(camera) => Some(single_camera::known_camera(&views, side, *camera)),
                None => single_camera::one_camera(&views, side, sizes[side as usize], corners.board.diagonal_mm()),
            })
            .collect();
        let no_camera = |side: Side| blind(corners, &views, side).unwrap_or(Error::NoCamera { side });
        let of = |side: Side| cameras[side as usize].clone().ok_or_else(|| no_camera(side));
        let cameras = [of(Side::Left)?, of(Side::Right)?];
        Ok(Candidates {
            board: corners.board,
            views,
            cameras,
            width_px: sizes[0].0.max(sizes[1].0),
            discarded,
            fewest_pairs,
        })
    }
}

impl Candidates {
    /// How far apart the places of the right camera are in the median that the pictures of each pair give by themselves,
    /// as an angle and a share of the boards' distance, where the right pictures' numbering may be turned so.
    pub fn places_apart(&self, turns: &[usize]) -> Option<f64> {
        let [left, right] = &self.cameras;
        let both: Vec<_> = left.poses.iter().zip(&right.poses).map(|(l, r)| l.zip(*r)).collect();
        let distance_mm = median(both.iter().flatten().map(|(l, _)| l.translation.vector.norm()))?;
        let (rig, turned) = numbering::agreed(turns, &both, distance_mm)?;
        let off = |(pair, quarters): (&Option<(Transform, Transform)>, usize)| {
            let (left, right) = (*pair)?;
            Some(numbering::deviation(&(right * numbering::renumbered(quarters) * left.inverse()), &rig, distance_mm))
        };
        median(both.iter().zip(turned).filter_map(off))
    }

    /// The number of pairs and the most that a corner moves from one to another, px, where they all show the board in
    /// one pose: by a small part of what a board must move over the pictures that are to tell the cameras.
    pub fn one_pose(&self) -> Option<(usize, f64)> {
        /// Of a picture's width.
        const HARDLY: f64 = 0.005;
        let first = self.views.first()?;
        let of = |o: &Observation, view: &View| {
            let same = |other: &&Observation| (other.side, other.col, other.row) == (o.side, o.col, o.row);
            view.observations.iter().find(same).map_or(f64::INFINITY, |other| (other.px - o.px).norm())
        };
        let moves = self.views[1..].iter().flat_map(|view| first.observations.iter().map(|o| of(o, view)));
        // From the first to either of two others.
        let px = 2.0 * moves.fold(0.0, f64::max);
        (px <= HARDLY * f64::from(self.width_px)).then_some((self.views.len(), px))
    }
}

/// Where a side shows corners in hardly any pair: how many, and why it shows none in the others.
fn blind(corners: &Corners, views: &[View], side: Side) -> Option<Error> {
    /// One pair in so many is hardly any.
    const HARDLY: usize = 10;
    let (seeing, without): (Vec<&View>, Vec<&View>) = views.iter().partition(|view| view.active(side).next().is_some());
    let why = |view: &&View| {
        let known = corners.blind.iter().find(|(of, skipped)| *of == side && skipped.pair == view.pair);
        let reason =
            known.map_or_else(|| "no corner that can be measured".to_owned(), |(_, skipped)| skipped.reason.clone());
        Skipped { pair: view.pair.clone(), reason }
    };
    let (found, total) = (seeing.len(), views.len());
    let error = || Error::OneSideBlind { side, found, total, without: without.iter().map(why).collect() };
    (HARDLY * found <= total).then(error)
}

/// What is said of a pair of which so few corners count. Of those that were seen and not measured, smeared or in glare,
/// the rest is.
fn too_few_corners(pair: &PairCorners, counting: [usize; 2]) -> String {
    let [left, right] = counting;
    let [of_left, of_right] = [pair.left.len(), pair.right.len()];
    if of_left + of_right == left + right {
        return format!("too few corners: {left} left, {right} right");
    }
    format!(
        "too few corners can be measured: {left} of {of_left} left, {right} of {of_right} right; the others are too blurred, smeared or in glare"
    )
}

/// True where one of the pictures tells how the board lies; whatever the other one shows then counts as well.
fn tells_a_pose(view: &View) -> bool {
    Side::BOTH.into_iter().any(|side| homography::of_picture(view, side).is_some())
}

/// True for corners of one picture: no two pictures have the same noise.
pub fn same(a: &[Corner], b: &[Corner]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.px == b.px)
}

/// A quarter of the board tells its pose well enough.
fn fewest_corners(board: &Board) -> usize {
    board.corner_count().div_ceil(4).min(12)
}
