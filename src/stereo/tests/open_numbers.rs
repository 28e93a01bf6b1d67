//! Pairs of a plain board that is cut: numbered by the rig of the others, or left out.

use super::*;
use crate::imaging::Corner;
use crate::imaging::Skipped;
use crate::imaging::corners::OpenPair;
use crate::stereo::pairs::open_numbers;

/// A picture's corners but for the first columns and rows, in all ways in which the rest may lie on the board.
fn cut(list: &[Corner], columns: usize, rows: usize) -> Vec<Vec<Corner>> {
    let ways = (0..=columns).flat_map(|left| (0..=rows).map(move |top| (left, top)));
    let moved = |(left, top): (usize, usize)| {
        let kept = list.iter().filter(|c| c.col >= columns && c.row >= rows);
        kept.map(|c| Corner { col: c.col - left, row: c.row - top, ..*c }).collect()
    };
    ways.map(moved).collect()
}

/// The corners with some pairs cut: columns and rows that the left, then the right picture lacks.
fn with_cut(mut corners: Corners, pairs: &[(usize, [usize; 2], [usize; 2])]) -> Corners {
    for &(i, left, right) in pairs.iter().rev() {
        let pair = corners.pairs.remove(i);
        let sides = [cut(&pair.left, left[0], left[1]), cut(&pair.right, right[0], right[1])];
        let skipped = Skipped { pair: pair.pair.clone(), reason: "cannot be told".to_owned() };
        corners.skipped.push(skipped);
        corners.open.push(OpenPair { pair: pair.pair, sides, before: i - pairs.iter().filter(|p| p.0 < i).count() });
    }
    corners.open.reverse();
    corners
}

#[test]
fn what_one_picture_leaves_open_the_other_one_tells_on_the_rig_of_the_other_pairs() {
    let seed = 0;
    let world = World::new(10, seed);
    let whole = world.corners(seed + 20);
    for lacks in [[1, 0], [0, 1], [3, 0], [2, 2], [4, 1]] {
        // Cut in one picture, in the other, and in both but not alike.
        let cases = [(2, lacks, [0, 0]), (5, [0, 0], lacks), (7, [lacks[0], 0], [0, lacks[1]])];
        let corners = open_numbers::by_other_pairs(with_cut(whole.clone(), &cases), &BROWN4);
        assert!(corners.open.is_empty() && corners.skipped.is_empty(), "{lacks:?}");
        for (known, pair) in whole.pairs.iter().zip(&corners.pairs) {
            assert_eq!(known.pair, pair.pair);
            for (known, list) in [(&known.left, &pair.left), (&known.right, &pair.right)] {
                assert!(list.iter().all(|c| known.contains(c)), "{lacks:?}, pair {}: a wrong number", pair.pair);
            }
        }
        assert!(corners.notes.iter().any(|note| note.contains("02, 05, 07")), "{:?}", corners.notes);
        let rig = calibrate(&whole, &BROWN4).unwrap();
        assert_eq!(open_numbers::by_rig(with_cut(whole.clone(), &cases), rig.rig()).pairs, corners.pairs);
    }
}

#[test]
fn what_both_pictures_leave_open_alike_stays_out() {
    let whole = World::new(10, 4).corners(24);
    for lacks in [[1, 0], [0, 2], [2, 1]] {
        let cut = with_cut(whole.clone(), &[(3, lacks, lacks), (6, [0, 0], lacks)]);
        let corners = open_numbers::by_other_pairs(cut, &BROWN4);
        assert_eq!((corners.open.len(), corners.skipped.len(), corners.pairs.len()), (1, 1, 9));
        assert_eq!(corners.skipped[0].pair, "03");
    }
    // Without other pairs there is no rig that would tell.
    let all: Vec<_> = (0..10).map(|i| (i, [1, 0], [0, 0])).collect();
    let none = with_cut(whole, &all);
    assert_eq!(open_numbers::by_other_pairs(none.clone(), &BROWN4), none);
}
