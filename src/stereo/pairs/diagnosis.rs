//! What happened to the pairs that do not fit the common rig.
//!
//! In: all pairs of a series, the rig that most of them agree on, and which do. Out: a reason for each of the others, with what to do.
//! Method: every idea of what happened is a change of the corners (sides exchanged, a picture turned or mirrored, another pair's
//! picture, another place of the right camera) under which the pair must fit as well as the others do; the first that does is the
//! reason. What is left was not taken at one moment. Goes wrong: two things that happened to one pair.

use nalgebra::{Point2, Vector3};
use rayon::prelude::*;

use crate::geometry::{Transform, rotation_vector};
use crate::imaging::{Board, Side};
use crate::stereo::Rig;
use crate::stereo::data::view::View;
use crate::stereo::init::board_pose;
use crate::stereo::init::relative_pose::{agreed_transform, deviation};
use crate::stereo::model::parameters::{Layout, Shared, Values};
use crate::stereo::pairs::Cause;
use crate::stereo::pairs::numbering::{renumbered, turns_of_outline};
use crate::stereo::pairs::screening::{Usual, misfit_px};
use crate::stereo::solve::levenberg_marquardt::{self, Search};
use crate::stereo::solve::robust_loss::{CAUCHY_WIDTH, Loss};

/// Corners of a picture that are enough to try an idea on.
const ENOUGH_CORNERS: usize = 40;
/// Pairs that are tried as the home of a picture, those with the board nearest to where it shows it.
const NEAREST: usize = 3;
/// How far relative poses from single pictures may be apart for one rig: radians, and shares of the boards' distance.
const ONE_RIG: f64 = 0.1;
/// Pairs that make another rig; two that agree in six numbers to a fraction of a pixel do not by chance.
const FEWEST_MOVED: usize = 2;

/// A pair of the series.
#[derive(Debug, Clone, PartialEq)]
pub struct Member<'a> {
    /// Its corners.
    pub view: &'a View,
    /// What each of its pictures leaves alone, px.
    pub alone_px: [Option<f64>; 2],
    /// Whether it fits the common rig.
    pub belongs: bool,
}

/// The pairs in their order, with what most of them agree on.
#[derive(Debug, Clone, PartialEq)]
pub struct Series<'a> {
    /// The common rig.
    pub shared: &'a Shared,
    /// The board.
    pub board: &'a Board,
    /// What pictures of this rig usually leave.
    pub usual: Usual,
    /// All pairs.
    pub members: Vec<Member<'a>>,
}

/// The poses that each of a pair's pictures gives the board alone, as `left_from_board` on the common rig.
type Alone = [Option<Transform>; 2];

/// A reason for each pair that does not belong, in the order of the members; `None` for the others.
pub fn explain(series: &Series) -> Vec<Option<(Cause, String)>> {
    let strays: Vec<usize> = (0..series.members.len()).filter(|&i| !series.members[i].belongs).collect();
    let mut reasons = vec![None; series.members.len()];
    if strays.is_empty() {
        return reasons;
    }
    let views: Vec<View> = series.members.iter().map(|m| m.view.thinned(ENOUGH_CORNERS)).collect();
    let scene = Scene { series, views };
    let alone: Vec<Alone> = scene.views.par_iter().map(|view| scene.alone(view)).collect();
    let of_pictures: Vec<_> = strays.par_iter().map(|&i| scene.files(i).or_else(|| scene.partner(i, &alone))).collect();
    strays.iter().zip(of_pictures).for_each(|(&i, reason)| reasons[i] = reason);
    loop {
        let open: Vec<usize> = strays.iter().copied().filter(|&i| reasons[i].is_none()).collect();
        let Some((group, right_from_left)) = scene.other_rig(&open, &alone) else { break };
        let as_first = |&i: &usize| format!("a camera moved, as for pair {}", series.members[i].view.pair);
        let as_first = group.first().map(|i| (Cause::CameraMoved, as_first(i)));
        group.iter().for_each(|&i| reasons[i] = as_first.clone());
        if let Some(&first) = group.first() {
            reasons[first] = Some((Cause::CameraMoved, scene.camera_moved(&group, &right_from_left)));
        }
    }
    for i in strays {
        reasons[i].get_or_insert_with(|| (Cause::NotSimultaneous, scene.board_moved(&alone[i])));
    }
    reasons
}

/// Something that may be done to a picture on its way from the camera.
struct Change {
    words: &'static str,
    /// Whether the board then shows its back, as it were: corners are numbered so that it faces the viewer.
    mirrors: bool,
    /// A place in the picture as it was, from one in a picture that is so many px wide and high.
    undo: fn(Point2<f64>, f64, f64) -> Point2<f64>,
}

const CHANGES: [Change; 4] = [
    Change { words: "turned by 180 degrees", mirrors: false, undo: half },
    Change { words: "turned by 90 degrees", mirrors: false, undo: quarter },
    Change { words: "turned by 90 degrees", mirrors: false, undo: back },
    Change { words: "mirrored", mirrors: true, undo: mirror },
];

fn half(p: Point2<f64>, width: f64, height: f64) -> Point2<f64> {
    Point2::new(width - 1.0 - p.x, height - 1.0 - p.y)
}

fn quarter(p: Point2<f64>, _: f64, height: f64) -> Point2<f64> {
    Point2::new(height - 1.0 - p.y, p.x)
}

fn back(p: Point2<f64>, width: f64, _: f64) -> Point2<f64> {
    Point2::new(p.y, width - 1.0 - p.x)
}

fn mirror(p: Point2<f64>, width: f64, _: f64) -> Point2<f64> {
    Point2::new(width - 1.0 - p.x, p.y)
}

/// A series with few corners a picture.
struct Scene<'a> {
    series: &'a Series<'a>,
    views: Vec<View>,
}

impl Scene<'_> {
    /// True where the view fits on a rig in one of the numberings that the board's outline allows.
    fn fits(&self, shared: &Shared, view: &View) -> bool {
        let limit = self.series.usual.limit_px(0.0);
        turns_of_outline(self.series.board).into_iter().any(|quarters| {
            let mut turned = view.clone();
            turned.turn_right(self.series.board, quarters);
            misfit_px(shared, &turned).is_some_and(|(px, _)| px <= limit)
        })
    }

    fn alone(&self, view: &View) -> Alone {
        let of = |side| board_pose::fit(self.series.shared, &view.only(side), Loss::Cauchy(CAUCHY_WIDTH));
        Side::BOTH.map(|side| of(side).map(|fit| fit.left_from_board))
    }

    /// What was done to the pair's own files.
    fn files(&self, i: usize) -> Option<(Cause, String)> {
        let (shared, view) = (self.series.shared, &self.views[i]);
        let turned = |&quarters: &usize| {
            let mut turned = view.clone();
            turned.turn_right(self.series.board, quarters);
            misfit_px(shared, &turned).is_some_and(|(px, _)| px <= self.series.usual.limit_px(0.0))
        };
        if turns_of_outline(self.series.board).iter().filter(|&&quarters| quarters != 0).any(turned) {
            let reason = "the corners are numbered from another end of the board in the right picture than in the left";
            return Some((Cause::Numbering, reason.to_owned()));
        }
        if self.fits(shared, &view.exchanged()) {
            let reason = "left and right picture are exchanged: give each the other's name";
            return Some((Cause::Altered, reason.to_owned()));
        }
        for side in Side::BOTH {
            let camera = shared.rig.camera(side);
            let (width, height) = (f64::from(camera.width), f64::from(camera.height));
            for change in &CHANGES {
                let mut undone = view.clone();
                for o in undone.observations.iter_mut().filter(|o| o.side == side) {
                    o.px = (change.undo)(o.px, width, height);
                    if change.mirrors {
                        o.renumber(self.series.board, (o.col, self.series.board.rows() - 1 - o.row));
                    }
                }
                if self.fits(shared, &undone) {
                    let (side, words) = (side.name(), change.words);
                    let reason = format!("the {side} picture is {words}: use the file as the camera wrote it");
                    return Some((Cause::Altered, reason));
                }
            }
        }
        let misread = |side: &Side| {
            self.series.members[i].alone_px[*side as usize].is_none_or(|px| px > self.series.usual.limit_px(0.0))
        };
        Side::BOTH.into_iter().find(misread).map(|side| {
            let side = side.name();
            let reason = format!(
                "the {side} corners do not form a board: misread, in a wrong order, blurred, moving, or taken line by line (interlaced)"
            );
            (Cause::Misshapen, reason)
        })
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
            let home = others.into_iter().take(NEAREST).map(|(_, j)| j).find(|&j| {
                let mut mixed = self.views[i].only(side);
                mixed.observations.extend(self.views[j].only(other).observations);
                self.fits(self.series.shared, &mixed)
            })?;
            let reason = format!(
                "the pictures do not belong together: the {} one was taken at the same time as the {} one of pair {}",
                side.name(),
                other.name(),
                self.views[home].pair
            );
            Some((Cause::Mismatched, reason))
        })
    }

    /// Pairs that fit together on a rig with another place of the right camera, and that place.
    fn other_rig(&self, open: &[usize], alone: &[Alone]) -> Option<(Vec<usize>, Transform)> {
        let rig = &self.series.shared.rig;
        let both: Vec<(usize, Transform, Transform)> =
            open.iter().filter_map(|&i| Some((i, alone[i][0]?, rig.right_from_left * alone[i][1]?))).collect();
        let choices: Vec<Vec<Transform>> = both
            .iter()
            .map(|(_, l, r)| {
                turns_of_outline(self.series.board)
                    .into_iter()
                    .map(|quarters| r * renumbered(quarters) * l.inverse())
                    .collect()
            })
            .collect();
        let distance_mm = both.first()?.1.translation.vector.norm();
        let agreed = agreed_transform(&choices, distance_mm)?;
        let (mut views, mut poses) = (Vec::new(), Vec::new());
        for ((i, left_from_board, _), choices) in both.iter().zip(&choices) {
            let off = |choice: &Transform| deviation(choice, &agreed, distance_mm);
            let nearest = turns_of_outline(self.series.board)
                .into_iter()
                .zip(choices)
                .min_by(|a, b| off(a.1).total_cmp(&off(b.1)));
            if let Some((quarters, choice)) = nearest
                && off(choice) < ONE_RIG
            {
                let mut view = self.views[*i].clone();
                view.turn_right(self.series.board, quarters);
                views.push(view);
                poses.push(*left_from_board);
            }
        }
        let moved =
            |right_from_left| Shared { rig: Rig { right_from_left, ..rig.clone() }, ..self.series.shared.clone() };
        let layout = Layout { transform: true, ..Layout::POSES_ONLY };
        let start = Values { shared: moved(agreed), poses };
        let shared =
            levenberg_marquardt::solve(&views, &layout, start, Loss::Cauchy(CAUCHY_WIDTH), Search::ROUGH).values.shared;
        let group: Vec<usize> = open.iter().copied().filter(|&i| self.fits(&shared, &self.views[i])).collect();
        (group.len() >= FEWEST_MOVED).then_some((group, shared.rig.right_from_left))
    }

    fn camera_moved(&self, group: &[usize], right_from_left: &Transform) -> String {
        let members = &self.series.members;
        let name = |i: Option<&usize>| i.map_or("", |&i| members[i].view.pair.as_str());
        let belongs = |range: &[Member]| range.iter().any(|m| m.belongs);
        let (first, last) = (group.first().copied().unwrap_or(0), group.last().copied().unwrap_or(0));
        let which = match (belongs(&members[..first]), belongs(&members[last..])) {
            (true, false) => format!("from pair {} on", name(group.first())),
            (false, true) => format!("up to pair {}", name(group.last())),
            _ => format!("in {} pairs", group.len()),
        };
        let change = right_from_left * self.series.shared.rig.right_from_left.inverse();
        let shift = camera_place(right_from_left) - camera_place(&self.series.shared.rig.right_from_left);
        format!(
            "a camera moved: {which} the right one is turned by {:.2} deg and shifted by {:.1} mm against the left, compared with the \
             other pairs. Clamp both; pictures from before and from after make two calibrations",
            rotation_vector(&change).norm().to_degrees(),
            shift.norm()
        )
    }

    fn board_moved(&self, alone: &Alone) -> String {
        let amount = alone[0].zip(alone[1]).map_or(String::new(), |(left, right)| {
            let turn = |quarters| rotation_vector(&(right * renumbered(quarters) * left.inverse())).norm();
            let least = turns_of_outline(self.series.board).into_iter().map(turn).fold(f64::INFINITY, f64::min);
            let shift = (right.translation.vector - left.translation.vector).norm();
            format!(" by about {shift:.1} mm and {:.1} deg", least.to_degrees())
        });
        format!(
            "the pictures were not taken at the same time: each shows a board, but between them it moved{amount} (or a camera did). \
             Clamp the board and trigger both cameras at once"
        )
    }
}

/// Where the right camera stands in the left one's frame, mm.
fn camera_place(right_from_left: &Transform) -> Vector3<f64> {
    right_from_left.inverse().translation.vector
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::transform;
    use crate::imaging::{Corner, Corners, Squares};
    use crate::stereo::calibrate::calibrate;
    use crate::stereo::select::lens_ladder::Options;
    use crate::stereo::synthetic::World;

    /// Two cameras that see a board of so many squares; a mix-up; what is said of each pair that is left out.
    fn said(squares: Squares, mix: impl Fn(&World, &mut Corners)) -> Vec<(String, String)> {
        let mut world = World::new(10, 5);
        world.board.squares = squares;
        let mut corners = world.corners(6);
        mix(&world, &mut corners);
        let found =
            calibrate(&corners, &Options { lens: Some(crate::stereo::Lens::Brown4), shape: Some(false) }).unwrap();
        found.skipped.into_iter().map(|s| (s.pair, s.reason)).collect()
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
    fn the_same_pictures_twice_and_pictures_of_other_pairs() {
        one(BOARDS[0], "07", "the same pictures as pair 03", |_, corners| {
            let again = corners.pairs[3].clone();
            corners.pairs[7] = crate::imaging::PairCorners { pair: "07".into(), ..again };
        });
        let mixed = said(BOARDS[1], |_, corners| {
            let right = corners.pairs[8].right.clone();
            corners.pairs[8].right = std::mem::replace(&mut corners.pairs[1].right, right);
        });
        let names = |at: usize, pair: &str, other: &str| mixed[at].0 == pair && mixed[at].1.contains(other);
        assert!(mixed.len() == 2 && names(0, "01", "one of pair 08") && names(1, "08", "one of pair 01"), "{mixed:?}");
    }

    #[test]
    fn a_camera_that_moved() {
        for squares in BOARDS {
            let moved = said(squares, |world, corners| {
                let mut after = world.clone();
                let turn = transform(Vector3::new(0.0, 0.01, 0.0), Vector3::new(0.5, 0.0, 0.0));
                after.rig.right_from_left = turn * world.rig.right_from_left;
                corners.pairs[6..].clone_from_slice(&after.corners(6).pairs[6..]);
            });
            let pairs: Vec<&str> = moved.iter().map(|(pair, _)| pair.as_str()).collect();
            // The last rig is the one that stands.
            assert_eq!(pairs, ["00", "01", "02", "03", "04", "05"], "{moved:?}");
            let reason = &moved[0].1;
            assert!(reason.contains("from pair 06 on") && reason.contains("turned by 0.5"), "{reason}");
        }
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
            assert!(found.rig().unusual().is_some_and(|w| w.contains("rolled")), "{squares}");
        }
    }
}
