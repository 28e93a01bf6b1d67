//! Pairs of which none fits: did something happen to all pictures of one side?
//!
//! A picture that failed on one side, in series that are paired by their order or their numbers, gives every later
//! picture the partner of another moment; a program mirrors or inverts what it saves of one camera. In: corners of
//! pairs that contradict each other. Out: what, undone, makes most of the pairs fit one rig. Method: where pictures
//! were lost is searched by the board's poses in single pictures; calibration tells whether the pairs that this leads
//! to, or those of another change, fit one rig. Goes wrong: a camera that lost more than a few pictures.

use crate::geometry::Transform;
use crate::imaging::input::pairs::natural_order;
use crate::imaging::{Corner, Corners, PairCorners, Side};
use crate::stereo::Error;
use crate::stereo::error::{OneSide, ShiftedFrom};
use crate::stereo::model::KnownLenses;
use crate::stereo::pairs::candidates::Candidates;
use crate::stereo::pairs::mixups::mirror;
use crate::stereo::pairs::shifts::{self, Partners};

/// Share of the pairs that must fit one rig then.
const MOST: f64 = 0.8;

/// The error of pairs that contradict each other, or that of what happened to one side where that explains it. `known`
/// are the lenses that are known; `fitting` counts the pairs that fit one rig.
pub fn explain(
    error: Error,
    corners: &Corners,
    known: Option<&KnownLenses>,
    fitting: impl Fn(&Corners) -> Option<usize>,
) -> Error {
    if !matches!(error, Error::Contradiction { .. }) {
        return error;
    }
    let enough = |changed: &Corners| {
        let of = changed.pairs.len();
        fitting(changed).filter(|fit| *fit as f64 >= MOST * of as f64).map(|fit| (fit, of))
    };
    let series = Series::new(corners);
    let shifted = |partners: Vec<Partners>| {
        let first = partners.iter().find(|pair| pair.agree && pair.left != pair.right)?;
        let [left, right] = [first.left, first.right].map(|at| series.names[at].to_owned());
        let (fit, of) = enough(&series.paired(&partners))?;
        Some(Error::Shifted { fit, of, left, right, from: series.changes(&partners) })
    };
    let turns = || corners.board.turns_of_outline().into_iter();
    let changed = |what: OneSide, quarters: usize| {
        let (fit, of) = enough(&with_right(corners, what, quarters))?;
        Some(Error::ChangedSide { what, fit, of })
    };
    let open = corners.board.turns_left_open();
    shifted(series.by_poses(known))
        .or_else(|| turns().find_map(|quarters| changed(OneSide::Mirrored, quarters)))
        .or_else(|| turns().filter(|q| !open.contains(q)).find_map(|quarters| changed(OneSide::Inverted, quarters)))
        .unwrap_or(error)
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
