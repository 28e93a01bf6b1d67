//! Pictures that do not belong together, or are not as the camera wrote them.
//!
//! In: all pairs of a series, the rig that most of them agree on, and which do not fit it. Out: what was mixed up in
//! these, with what to do. Method: every idea of what happened is a change of the corners (sides exchanged, a picture
//! turned or mirrored, another pair's picture) under which the pair must fit as well as the others do; the first that
//! does is the reason. Goes wrong: two things that happened to one pair.

use nalgebra::Point2;
use rayon::prelude::*;

use crate::geometry::Transform;
use crate::imaging::{Board, Side};
use crate::stereo::Rig;
use crate::stereo::data::View;
use crate::stereo::data::residuals::median_px;
use crate::stereo::init::board_pose;
use crate::stereo::init::single_camera::as_left;
use crate::stereo::model::{Layout, Shared, Values};
use crate::stereo::pairs::Cause;
use crate::stereo::solve::levenberg_marquardt::Search;
use crate::stereo::solve::{Loss, Priors, Problem};

/// Corners of a picture that are enough to try an idea on.
const ENOUGH_CORNERS: usize = 40;
/// Pairs that are tried as the home of a picture, those with the board nearest to where it shows it.
const NEAREST: usize = 3;

/// Share of the limit for pairs within which one fits that was turned or mirrored back: a board near the middle that is
/// seen nearly square looks alike from behind, and half fits what it is not.
const FITS_WELL: f64 = 0.5;

/// A series of pairs, the rig that most of them agree on, and which of them do not.
#[derive(Debug, Clone, PartialEq)]
pub struct Series<'a> {
    /// The common rig.
    pub shared: &'a Shared,
    pub board: &'a Board,
    /// All pairs in their order.
    pub views: &'a [View],
    /// What each picture leaves on its own camera, px; left, then right.
    pub alone_px: [&'a [Option<f64>]; 2],
    /// What a pair leaves on the common rig at most, px, where it belongs to it.
    pub limit_px: f64,
}

/// What was mixed up in each of these pairs, where something was: with it undone the pair fits the rig of the others.
pub fn explain(series: &Series, strays: &[usize]) -> Vec<Option<(Cause, String)>> {
    if strays.is_empty() {
        return Vec::new();
    }
    let views: Vec<View> = series.views.iter().map(|view| view.thinned(ENOUGH_CORNERS)).collect();
    let scene = Scene { series, views };
    let alone: Vec<Alone> = scene.views.par_iter().map(|view| board_pose::of_each_alone(series.shared, view)).collect();
    strays.par_iter().map(|&i| scene.files(i).or_else(|| scene.partner(i, &alone))).collect()
}

/// Something that may be done to a picture on its way from the camera.
struct Change {
    words: &'static str,
    cause: Cause,
    /// Whether the board then shows its back, as it were: corners are numbered so that it faces the viewer.
    mirrors: bool,
    /// A place in the picture as it was, from one in a picture that is so many px wide and high.
    undo: fn(Point2<f64>, f64, f64) -> Point2<f64>,
}

const CHANGES: [Change; 4] = [
    Change { cause: Cause::Turned, words: "turned by 180 degrees", mirrors: false, undo: half },
    Change { cause: Cause::Turned, words: "turned by 90 degrees", mirrors: false, undo: quarter },
    Change { cause: Cause::Turned, words: "turned by 90 degrees", mirrors: false, undo: back },
    Change { cause: Cause::Mirrored, words: "mirrored", mirrors: true, undo: mirror },
];

/// That both pictures of a pair were changed so.
fn both(change: &Change) -> (Cause, String) {
    (change.cause, format!("both pictures are {}: use the files as the cameras wrote them", change.words))
}

fn half(p: Point2<f64>, width: f64, height: f64) -> Point2<f64> {
    Point2::new(width - 1.0 - p.x, height - 1.0 - p.y)
}

fn quarter(p: Point2<f64>, _: f64, height: f64) -> Point2<f64> {
    Point2::new(height - 1.0 - p.y, p.x)
}

fn back(p: Point2<f64>, width: f64, _: f64) -> Point2<f64> {
    Point2::new(p.y, width - 1.0 - p.x)
}

/// A place in a picture so many px wide that is mirrored, left and right.
pub fn mirror(p: Point2<f64>, width: f64, _: f64) -> Point2<f64> {
    Point2::new(width - 1.0 - p.x, p.y)
}

/// The poses that each of a pair's pictures gives the board alone, as `left_from_board` on the common rig.
type Alone = [Option<Transform>; 2];

/// A series with few corners a picture.
struct Scene<'a> {
    series: &'a Series<'a>,
    views: Vec<View>,
}

impl Scene<'_> {
    /// True where the view fits on a rig, within a share of the limit, in one of the numberings that the board's
    /// outline allows.
    fn fits(&self, shared: &Shared, view: &View, share: f64) -> bool {
        let limit = share * self.series.limit_px;
        self.series.board.turns_of_outline().into_iter().any(|quarters| self.fits_turned(shared, view, quarters, limit))
    }

    /// The same in the numbering after so many quarter turns of the right picture's, within so many px.
    fn fits_turned(&self, shared: &Shared, view: &View, quarters: usize, limit_px: f64) -> bool {
        let mut turned = view.clone();
        turned.turn_right(self.series.board, quarters);
        board_pose::fits_within(shared, &turned, limit_px)
    }

    /// What a pair misses the common rig by in the best of its numberings, px.
    fn misfit_px(&self, view: &View) -> f64 {
        let of = |quarters| {
            let mut turned = view.clone();
            turned.turn_right(self.series.board, quarters);
            board_pose::misfit_px(self.series.shared, &turned).map_or(f64::INFINITY, |(px, _)| px)
        };
        self.series.board.turns_of_outline().into_iter().map(of).fold(f64::INFINITY, f64::min)
    }

    /// A pair with a change of its pictures on these sides undone.
    fn undone(&self, view: &View, change: &Change, sides: &[Side]) -> View {
        let mut undone = view.clone();
        for o in undone.observations.iter_mut().filter(|o| sides.contains(&o.side)) {
            let camera = self.series.shared.rig.camera(o.side);
            o.px = (change.undo)(o.px, f64::from(camera.width), f64::from(camera.height));
            if change.mirrors {
                o.renumber(self.series.board, (o.col, self.series.board.rows() - 1 - o.row));
            }
        }
        undone
    }

    /// What was done to the pair's own files.
    fn files(&self, i: usize) -> Option<(Cause, String)> {
        let (shared, view) = (self.series.shared, &self.views[i]);
        let mut turns = self.series.board.turns_of_outline().into_iter().filter(|quarters| *quarters != 0);
        if turns.any(|quarters| self.fits_turned(shared, view, quarters, self.series.limit_px)) {
            let reason = "the corners are numbered from another end of the board in the right picture than in the left";
            return Some((Cause::Numbering, reason.to_owned()));
        }
        let exchanged = view.exchanged();
        if self.fits(shared, &exchanged, 1.0) {
            // Of cameras that stand alike both pictures turned or mirrored are nearly the same as both exchanged.
            let miss_px = |change: &Change| self.misfit_px(&self.undone(view, change, &Side::BOTH));
            let nearest = CHANGES.iter().map(|change| (miss_px(change), change)).min_by(|a, b| a.0.total_cmp(&b.0));
            let of_both = nearest.filter(|(px, _)| *px < FITS_WELL * self.misfit_px(&exchanged));
            if let Some((_, change)) = of_both {
                return Some(both(change));
            }
            let reason = "left and right picture are exchanged: give each the other's name";
            return Some((Cause::Exchanged, reason.to_owned()));
        }
        for side in Side::BOTH {
            for change in &CHANGES {
                if self.fits(shared, &self.undone(view, change, &[side]), FITS_WELL) {
                    let (side, words) = (side.name(), change.words);
                    let reason = format!("the {side} picture is {words}: use the file as the camera wrote it");
                    return Some((change.cause, reason));
                }
            }
        }
        let of_both = CHANGES.iter().find(|c| self.fits(shared, &self.undone(view, c, &Side::BOTH), FITS_WELL));
        if let Some(change) = of_both {
            return Some(both(change));
        }
        let misread = |side: &Side| {
            let known = self.series.alone_px[*side as usize][i].is_some_and(|px| px <= self.series.limit_px);
            !known && !self.is_board(i, *side)
        };
        Side::BOTH.into_iter().find(misread).map(|side| {
            let side = side.name();
            let reason = format!(
                "the {side} corners do not form a board: misread, in a wrong order, blurred, moving, or taken line by line (interlaced)"
            );
            (Cause::Misread, reason)
        })
    }

    /// Whether a picture's corners are those of a board through a camera of any focal length: one that was zoomed or
    /// focused shows a board.
    fn is_board(&self, i: usize, side: Side) -> bool {
        let camera = *self.series.shared.rig.camera(side);
        let view = as_left(&self.series.views[i], side);
        let rig = Rig { left: camera, right: camera, right_from_left: Transform::identity(), covariance: None };
        let shared = Shared { rig, ..self.series.shared.clone() };
        let Some(pose) = board_pose::of_picture(&shared, &view, Side::Left) else { return false };
        let layout = Layout::one_camera(camera.lens);
        let priors = Priors::of_one_camera(&camera, self.series.board.diagonal_mm());
        let start = Problem { views: vec![view.clone()], values: Values { shared, poses: vec![pose] }, priors };
        let found = start.search(&layout, Loss::Cauchy, Search::ROUGH).values;
        let left_px = found.poses.first().and_then(|pose| median_px(&found.shared, pose, &view, Side::Left));
        left_px.is_some_and(|px| px <= self.series.limit_px)
    }

    /// The pair that one of the pictures belongs to.
    fn partner(&self, i: usize, alone: &[Alone]) -> Option<(Cause, String)> {
        Side::BOTH.into_iter().find_map(|side| {
            let other = side.other();
            let here = alone[i][side as usize]?.translation.vector;
            let mut others: Vec<(f64, usize)> = (0..self.views.len())
                .filter(|&j| j != i)
                .filter_map(|j| Some(((alone[j][other as usize]?.translation.vector - here).norm(), j)))
                .collect();
            others.sort_by(|a, b| a.0.total_cmp(&b.0));
            let home = others
                .into_iter()
                .take(NEAREST)
                .map(|(_, j)| j)
                .find(|&j| self.fits(self.series.shared, &self.views[i].paired(side, &self.views[j]), 1.0))?;
            let reason = format!(
                "the pictures do not belong together: the {} one was taken at the same time as the {} one of pair {}",
                side.name(),
                other.name(),
                self.views[home].pair
            );
            Some((Cause::OtherPair, reason))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::{Corner, Corners, Squares};
    use crate::stereo::calibrate::calibrate;
    use crate::stereo::select::options::Options;
    use crate::stereo::synthetic::{BROWN4, World};

    /// Two cameras that see a board of so many squares; a mix-up; what is said of each pair that is left out.
    fn said(squares: Squares, mix: impl Fn(&World, &mut Corners)) -> Vec<(String, String)> {
        let mut world = World::new(10, 5);
        world.board.squares = squares;
        let mut corners = world.corners(6);
        mix(&world, &mut corners);
        calibrate(&corners, &BROWN4).unwrap().skipped.into_iter().map(|s| (s.pair, s.reason)).collect()
    }

    /// Boards with and without a turn that looks the same.
    const BOARDS: [Squares; 3] =
        [Squares { columns: 12, rows: 9 }, Squares { columns: 12, rows: 8 }, Squares { columns: 9, rows: 9 }];

    fn one(squares: Squares, pair: &str, words: &str, mix: impl Fn(&World, &mut Corners)) {
        let said = said(squares, mix);
        assert!(said.len() == 1 && said[0].0 == pair && said[0].1.contains(words), "{squares}: {said:?}");
    }

    fn change(corners: &mut [Corner], to: impl Fn(&Corner) -> Corner) {
        corners.iter_mut().for_each(|c| *c = to(c));
    }

    #[test]
    fn an_exchanged_pair() {
        for squares in BOARDS {
            one(squares, "04", "left and right picture are exchanged", |_, corners| {
                let pair = &mut corners.pairs[4];
                std::mem::swap(&mut pair.left, &mut pair.right);
            });
        }
    }

    #[test]
    fn a_turned_or_mirrored_picture() {
        for squares in BOARDS {
            one(squares, "06", "left picture is turned by 180 degrees", |world, corners| {
                let (w, h) = (f64::from(world.rig.left.width), f64::from(world.rig.left.height));
                change(&mut corners.pairs[6].left, |c| Corner { px: half(c.px, w, h), ..*c });
            });
            one(squares, "02", "right picture is mirrored", |world, corners| {
                let (w, h) = (f64::from(world.rig.left.width), f64::from(world.rig.left.height));
                let rows = world.board.rows();
                change(&mut corners.pairs[2].right, |c| Corner { px: mirror(c.px, w, h), row: rows - 1 - c.row, ..*c });
            });
        }
    }

    #[test]
    fn both_pictures_of_a_pair_turned() {
        for squares in BOARDS {
            one(squares, "06", "both pictures are turned by 180 degrees", |world, corners| {
                let (w, h) = (f64::from(world.rig.left.width), f64::from(world.rig.left.height));
                let pair = &mut corners.pairs[6];
                for picture in [&mut pair.left, &mut pair.right] {
                    change(picture, |c| Corner { px: half(c.px, w, h), ..*c });
                }
            });
        }
    }

    #[test]
    fn the_same_pictures_twice_and_pictures_of_other_pairs() {
        one(BOARDS[0], "07", "the same pictures as pair 03", |_, corners| {
            let again = corners.pairs[3].clone();
            corners.pairs[7] = crate::imaging::PairCorners { pair: "07".into(), ..again };
        });
        one(BOARDS[0], "02", "left and right picture are one picture", |_, corners| {
            corners.pairs[2].right = corners.pairs[2].left.clone();
        });
        let mixed = said(BOARDS[1], |_, corners| {
            let right = corners.pairs[8].right.clone();
            corners.pairs[8].right = std::mem::replace(&mut corners.pairs[1].right, right);
        });
        let names = |at: usize, pair: &str, other: &str| mixed[at].0 == pair && mixed[at].1.contains(other);
        assert!(mixed.len() == 2 && names(0, "01", "one of pair 08") && names(1, "08", "one of pair 01"), "{mixed:?}");
    }

    #[test]
    fn a_camera_mounted_on_its_side_is_a_rig() {
        for squares in BOARDS {
            let mut world = World::new(10, 5);
            world.board.squares = squares;
            let mut corners = world.corners(6);
            let (w, h) = (f64::from(world.rig.right.width), f64::from(world.rig.right.height));
            for pair in &mut corners.pairs {
                change(&mut pair.right, |c| Corner { px: quarter(c.px, w, h), ..*c });
                if squares.columns == squares.rows {
                    // Numbered as far as the picture tells.
                    let last = squares.rows - 2;
                    change(&mut pair.right, |c| Corner { col: c.row, row: last - c.col, ..*c });
                }
            }
            corners.right_size = (corners.right_size.1, corners.right_size.0);
            let found = calibrate(&corners, &Options::default()).unwrap();
            assert!(found.skipped.is_empty(), "{squares}: {:?}", found.skipped);
            assert!(found.rig().unusual().iter().any(|w| w.contains("rolled")), "{squares}");
        }
    }
}
