//! Pairs of which none fits: did something happen to all pictures of one side?
//!
//! A picture that failed on one side, in series that are paired by their order or their numbers, gives every later
//! picture the partner of another moment; a program mirrors or inverts what it saves of one camera. In: corners of
//! pairs that contradict each other. Out: what, undone, makes most of the pairs fit one rig. Method: where pictures
//! were lost is searched by the board's poses in single pictures; calibration tells whether the pairs that this leads
//! to, or those of another change, fit one rig; pictures that were changed are the cause where with that undone the
//! pairs miss their rig by less than half as much. Goes wrong: a camera that lost more than a few pictures.

use crate::geometry::Transform;
use crate::imaging::input::pairs::natural_order;
use crate::imaging::{Corner, Corners, PairCorners, Side};
use crate::stereo::Error;
use crate::stereo::error::{OneSide, ShiftedFrom};
use crate::stereo::model::KnownLenses;
use crate::stereo::pairs::Missed;
use crate::stereo::pairs::candidates::Candidates;
use crate::stereo::pairs::mixups::mirror;
use crate::stereo::pairs::shifts::{self, Partners};

/// Share of the pairs that must fit a rig that explains them.
pub(super) const MOST: f64 = 0.8;

/// What becomes of pairs as a rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Pairs that fit it.
    pub pairs: usize,
    /// How far these miss it.
    pub missed: Missed,
    /// Whether the left camera stands to the left; `None` where they do not stand side by side.
    pub is_left_to_the_left: Option<bool>,
}

impl Fit {
    /// Whether most of the pairs fit.
    fn is_of_most(&self, corners: &Corners) -> bool {
        self.pairs as f64 >= MOST * corners.pairs.len() as f64
    }
}

/// How far pairs that contradict each other miss the rig of all; `None` of another error.
pub fn missed(error: &Error) -> Option<Missed> {
    let Error::Contradiction { usual_px, alone_px, .. } = error else { return None };
    Some(Missed { times: usual_px / alone_px.max(f64::MIN_POSITIVE) })
}

/// The error of pairs that contradict each other, or that of what happened to one side where that explains it. `known`
/// are the lenses that are known; `fitting` makes a rig of pairs.
pub fn explain(
    error: Error,
    corners: &Corners,
    known: Option<&KnownLenses>,
    fitting: impl Fn(&Corners) -> Option<Fit>,
) -> Error {
    let Some(missed) = missed(&error) else { return error };
    let series = Series::new(corners);
    let shifted = |partners: Vec<Partners>| {
        let first = partners.iter().find(|pair| pair.agree && pair.left != pair.right)?;
        let [left, right] = [first.left, first.right].map(|at| series.names[at].to_owned());
        let paired = series.paired(&partners);
        let fit = fitting(&paired).filter(|fit| fit.is_of_most(&paired))?;
        Some(Error::Shifted { fit: fit.pairs, of: paired.pairs.len(), left, right, from: series.changes(&partners) })
    };
    let any = [OneSide::Mirrored, OneSide::Inverted];
    shifted(series.by_poses(known)).or_else(|| changed(corners, &any, missed, fitting)).unwrap_or(error)
}

/// What may have been done to the pictures of one side of pairs that fit a rig badly: with it undone, the places of the
/// right camera that single pictures give are apart by less than half as much.
pub fn suspected(corners: &Corners, known: Option<&KnownLenses>) -> Vec<OneSide> {
    let apart = |corners: &Corners, turns: &[usize]| Candidates::new(corners, known).ok()?.places_apart(turns);
    let (open, all) = (corners.board.turns_left_open(), corners.board.turns_of_outline());
    let as_they_are = apart(corners, &open).unwrap_or(0.0);
    let undone = |what: &OneSide| match what {
        OneSide::Mirrored => apart(&with_right(corners, *what, 0), &all),
        OneSide::Inverted if all.len() > open.len() => apart(corners, &all),
        OneSide::Inverted => None,
    };
    let explains = |what: &OneSide| undone(what).is_some_and(|apart| 2.0 * apart < as_they_are);
    [OneSide::Mirrored, OneSide::Inverted].into_iter().filter(explains).collect()
}

/// Which of these was done to the pictures of one side, where the pairs miss their rig by so much as they are, and with
/// it undone most of them miss it by less than half of that: the one with which they miss it least.
pub fn changed(
    corners: &Corners,
    any: &[OneSide],
    missed: Missed,
    fitting: impl Fn(&Corners) -> Option<Fit>,
) -> Option<Error> {
    let undone = |(what, quarters): (OneSide, usize)| {
        let undone = with_right(corners, what, quarters);
        let explains = |fit: &Fit| fit.is_of_most(&undone) && 2.0 * fit.missed.times < missed.times;
        let fit = fitting(&undone).filter(explains)?;
        // Undone in the other pictures instead, all is mirrored: the cameras have changed places. Which side is inverted
        // no pictures tell.
        let told = fit.is_left_to_the_left.filter(|_| what == OneSide::Mirrored);
        let side = told.map(|is| if is { Side::Right } else { Side::Left });
        Some((fit.missed.times, Error::ChangedSide { what, side, fit: fit.pairs, of: undone.pairs.len() }))
    };
    let (turns, open) = (corners.board.turns_of_outline(), corners.board.turns_left_open());
    let with_turns = |&what: &OneSide| turns.iter().map(move |&quarters| (what, quarters));
    let is_change = |&(what, quarters): &(OneSide, usize)| what == OneSide::Mirrored || !open.contains(&quarters);
    let all = any.iter().flat_map(with_turns).filter(is_change).filter_map(undone);
    Some(all.min_by(|a, b| a.0.total_cmp(&b.0))?.1)
}

/// The pairs by their places in the series; pairs in which no board was found have one as well.
struct Series<'a> {
    corners: &'a Corners,
    names: Vec<&'a str>,
    pairs: Vec<Option<&'a PairCorners>>,
}

impl<'a> Series<'a> {
    fn new(corners: &'a Corners) -> Series<'a> {
        let mut names: Vec<&str> = corners.skipped.iter().map(|pair| pair.pair.as_str()).collect();
        names.extend(corners.pairs.iter().map(|pair| pair.pair.as_str()));
        names.sort_by(|a, b| natural_order(a, b));
        names.dedup();
        let pairs = names.iter().map(|name| corners.pairs.iter().find(|pair| pair.pair == *name)).collect();
        Series { corners, names, pairs }
    }

    /// The pairs that the board's poses lead to; none where most of them agree with no rig.
    fn by_poses(&self, known: Option<&KnownLenses>) -> Vec<Partners> {
        let Ok(candidates) = Candidates::new(self.corners, known) else { return Vec::new() };
        let [left, right] = candidates.cameras.each_ref().map(|camera| -> Vec<Option<Transform>> {
            let view = |name: &&str| candidates.views.iter().position(|view| view.pair == **name);
            self.names.iter().map(|name| camera.poses[view(name)?]).collect()
        });
        let found = shifts::partners(&self.corners.board.turns_left_open(), [&left, &right]);
        let seen = found.iter().filter(|pair| left[pair.left].is_some() && right[pair.right].is_some()).count();
        if 2 * found.iter().filter(|pair| pair.agree).count() > seen { found } else { Vec::new() }
    }

    /// The corners of these pairs, each with its left picture's name.
    fn paired(&self, partners: &[Partners]) -> Corners {
        let pair = |pair: &Partners| {
            let (left, right) = self.pairs[pair.left].zip(self.pairs[pair.right])?;
            Some(PairCorners { pair: left.pair.clone(), left: left.left.clone(), right: right.right.clone() })
        };
        Corners { pairs: partners.iter().filter_map(pair).collect(), ..self.corners.clone() }
    }

    /// Where the shift changes from one pair that agrees to the next.
    fn changes(&self, partners: &[Partners]) -> Vec<ShiftedFrom> {
        let agree: Vec<&Partners> = partners.iter().filter(|pair| pair.agree).collect();
        let change = |two: &[&Partners]| {
            let [before, after] = [two[0], two[1]];
            let lefts = &self.names[before.left + 1..after.left];
            let rights = &self.names[before.right + 1..after.right];
            let (lost, alone) = match lefts.len().cmp(&rights.len()) {
                std::cmp::Ordering::Equal => return None,
                std::cmp::Ordering::Greater => ((Side::Right, lefts.len() - rights.len()), lefts),
                std::cmp::Ordering::Less => ((Side::Left, rights.len() - lefts.len()), rights),
            };
            Some(ShiftedFrom {
                pair: self.names[after.left.min(after.right)].to_owned(),
                by: after.left.abs_diff(after.right),
                partners: [after.left, after.right].map(|at| self.names[at].to_owned()),
                lost,
                alone: alone.iter().map(|name| (*name).to_owned()).collect(),
            })
        };
        agree.windows(2).filter_map(change).collect()
    }
}

/// The corners with what was done to the right pictures undone, and numbered after so many quarter turns.
fn with_right(corners: &Corners, what: OneSide, quarters: usize) -> Corners {
    let (board, (width, height)) = (&corners.board, corners.right_size);
    let undone = |corner: &Corner| {
        let (px, place) = match what {
            // Numbered so that the board faces the viewer, its rows run the other way.
            OneSide::Mirrored => {
                (mirror(corner.px, f64::from(width), f64::from(height)), (corner.col, board.rows() - 1 - corner.row))
            }
            OneSide::Inverted => (corner.px, (corner.col, corner.row)),
        };
        let ((col, row), mut reach) = (board.turned(place, quarters), corner.reach);
        if !quarters.is_multiple_of(2) {
            reach.iter_mut().for_each(|reach| reach.reverse());
        }
        Corner { col, row, px, reach, ..*corner }
    };
    let mut changed = corners.clone();
    for pair in &mut changed.pairs {
        pair.right = pair.right.iter().map(undone).collect();
        pair.right.sort_by_key(|corner| (corner.row, corner.col));
    }
    changed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::Explain;
    use crate::stereo::findings::standing::{Asked, calibrate_standing};
    use crate::stereo::synthetic::{BROWN4, World};
    use crate::stereo::volume::Extent;
    use nalgebra::Vector3;

    const PAIRS: usize = 14;

    /// What is said of the pairs: the error, or the pairs that are left out with their reasons.
    fn said(corners: &Corners) -> Result<Vec<(String, String)>, Error> {
        let asked = Asked { options: BROWN4, tolerance_mm: 0.05, extent: Extent::default() };
        let (found, _) = calibrate_standing(corners, &asked)?;
        Ok(found.skipped.into_iter().map(|pair| (pair.pair, pair.reason)).collect())
    }

    /// A series in which a camera lost so many pictures, and the later ones took their names.
    fn lost(side: Side, first: usize, count: usize) -> Corners {
        let mut corners = World::new(PAIRS, 13).corners(14);
        for at in first..PAIRS - count {
            let (earlier, later) = corners.pairs.split_at_mut(at + count);
            match side {
                Side::Left => earlier[at].left = later[0].left.clone(),
                Side::Right => earlier[at].right = later[0].right.clone(),
            }
        }
        corners.pairs.truncate(PAIRS - count);
        corners
    }

    fn names(of: std::ops::Range<usize>) -> Vec<String> {
        of.map(|at| format!("{at:02}")).collect()
    }

    fn is_named(side: Side, first: usize, count: usize) {
        match said(&lost(side, first, count)) {
            Err(Error::Shifted { fit, of, from, left, right }) => {
                let all = PAIRS - 2 * count;
                let later = format!("{:02}", first + count);
                let expected = ShiftedFrom {
                    pair: format!("{first:02}"),
                    by: count,
                    partners: [left, right],
                    lost: (side, count),
                    alone: names(first..first + count),
                };
                let of_other = &expected.partners[side.other() as usize];
                assert!(*of_other == later && expected.partners[side as usize] == expected.pair, "{expected:?}");
                assert_eq!((fit, of, from), (all, all, vec![expected]), "{side:?} {first} {count}");
            }
            other => panic!("{side:?} {first} {count}: {other:?}"),
        }
    }

    #[test]
    fn pictures_that_the_right_camera_lost_are_named() {
        for (first, count) in [(1, 1), (2, 2), (4, 1), (6, 1), (5, 2)] {
            is_named(Side::Right, first, count);
        }
    }

    #[test]
    fn pictures_that_the_left_camera_lost_are_named() {
        for (first, count) in [(1, 2), (2, 1), (4, 2), (6, 1), (5, 1)] {
            is_named(Side::Left, first, count);
        }
    }

    /// Of a late loss the pairs after it are left out, each with the pair that its picture belongs to.
    #[test]
    fn a_loss_at_the_first_pair_is_a_shift_of_all_and_a_late_one_is_told_pair_by_pair() {
        for side in Side::BOTH {
            let first = said(&lost(side, 0, 1));
            assert!(matches!(&first, Err(Error::Shifted { from, fit: 12, .. }) if from.is_empty()), "{first:?}");
            let late = said(&lost(side, PAIRS - 4, 1)).unwrap();
            let (pair, reason) = &late[0];
            assert!(late.len() == 3 && pair == "10" && reason.contains("of pair 11"), "{side:?}: {late:?}");
        }
    }

    #[test]
    fn pairs_that_contradict_each_other_otherwise_are_not_called_shifted() {
        let world = World::new(PAIRS, 13);
        let contradicts = |what: &str, corners: &Corners| {
            let said = said(corners);
            assert!(matches!(said, Err(Error::Contradiction { .. })), "{what}: {said:?}");
            assert!(said.unwrap_err().hint().unwrap().starts_with("trigger both cameras"));
        };
        let mut shuffled = world.corners(14);
        let rights: Vec<_> = shuffled.pairs.iter().map(|pair| pair.right.clone()).collect();
        // Five apart, as nothing that one camera lost.
        (0..PAIRS).for_each(|at| shuffled.pairs[at].right = rights[(5 * at + 3) % PAIRS].clone());
        contradicts("in another order", &shuffled);
        contradicts("cameras that nobody clamped", &world.corners_by_hand(14, 4.0));
        let mut moved = world.corners(14);
        let other = world.with_camera_moved(Vector3::new(0.0, 0.08, 0.03), Vector3::new(5.0, 0.0, 0.0)).corners(14);
        moved.pairs[PAIRS / 2..].clone_from_slice(&other.pairs[PAIRS / 2..]);
        let said = said(&moved);
        assert!(!matches!(said, Err(Error::Shifted { .. } | Error::ChangedSide { .. })), "{said:?}");
    }

    #[test]
    fn what_is_said_of_a_loss_names_pair_number_and_picture() {
        let said = said(&lost(Side::Right, 4, 1)).unwrap_err();
        let expected = "the pictures of one side are shifted against the other's: with left picture 05 and right picture 04 as \
                        one pair, and so on, 12 of 12 pairs fit one rig, and as they are named they do not\n  from pair 04 on, \
                        by 1 picture: left picture 05 and right picture 04 are one pair; left picture 04 has no partner, the \
                        right one seems lost";
        assert_eq!(said.to_string(), expected);
        assert!(said.hint().unwrap().starts_with("give pictures of one moment the same name"));
    }
}
