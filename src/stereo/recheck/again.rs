//! Pairs whose pictures show the board exactly where the calibration's own did: those pictures, saved anew.
//!
//! In: where each pair of the calibration had its first and its last corner, and new pairs. Out: those that have them
//! there as well. Goes wrong: a board that stood still since the calibration, and pairs that lost such a corner.

use nalgebra::Point2;

use crate::imaging::{Corner, Corners, PairCorners, Side};
use crate::stereo::data::View;

/// Where the first and the last corner of the left and of the right picture of a pair are, px; `None` of a picture
/// without.
pub type Ends = [Option<[[f64; 2]; 2]>; 2];

/// Neither another compression nor more noise moves a corner so far, px, and no hand brings a board back so closely.
const SAME_PX: f64 = 0.1;

/// Of a pair that was used.
pub fn of_view(view: &View) -> Ends {
    Side::BOTH.map(|side| ends(view.active(side).map(|o| ((o.row, o.col), o.px))))
}

/// The names of the pairs that show the board where the calibration's pairs did.
pub fn pairs(corners: &Corners, known: &[Ends]) -> Vec<String> {
    let of = |corners: &[Corner]| ends(corners.iter().map(|corner| ((corner.row, corner.col), corner.px)));
    let is_known = |pair: &&PairCorners| {
        let own = [of(&pair.left), of(&pair.right)];
        own.iter().any(Option::is_some) && known.iter().any(|other| (0..2).all(|side| same(&own[side], &other[side])))
    };
    corners.pairs.iter().filter(is_known).map(|pair| pair.pair.clone()).collect()
}

fn ends(corners: impl Iterator<Item = ((usize, usize), Point2<f64>)>) -> Option<[[f64; 2]; 2]> {
    let all: Vec<_> = corners.collect();
    let first = all.iter().min_by_key(|(at, _)| *at)?;
    let last = all.iter().max_by_key(|(at, _)| *at)?;
    Some([first, last].map(|(_, px)| [px.x, px.y]))
}

/// Whichever end of the board was counted from.
fn same(a: &Option<[[f64; 2]; 2]>, b: &Option<[[f64; 2]; 2]>) -> bool {
    let (Some(a), Some(b)) = (a, b) else { return a.is_none() && b.is_none() };
    let near = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).abs() < SAME_PX && (a[1] - b[1]).abs() < SAME_PX;
    near(&a[0], &b[0]) && near(&a[1], &b[1]) || near(&a[0], &b[1]) && near(&a[1], &b[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stereo::synthetic::World;

    #[test]
    fn pictures_that_were_saved_anew_are_known_again_and_others_are_not() {
        let world = World::new(6, 3);
        let board = world.board;
        let known: Vec<Ends> = world.corners(1).pairs.iter().map(|pair| of_view(&View::new(&board, pair, 0))).collect();
        for sigma_px in [0.0, 0.005, 0.02] {
            let saved = World { sigma_px, ..world.clone() };
            let clean = World { sigma_px: 0.0, ..world.clone() };
            let known: Vec<Ends> =
                clean.corners(1).pairs.iter().map(|pair| of_view(&View::new(&board, pair, 0))).collect();
            assert_eq!(pairs(&saved.corners(2), &known).len(), 6, "{sigma_px} px");
        }
        assert!(pairs(&World::new(20, 4).corners(2), &known).is_empty());
        // One picture alone is not the pair's.
        let turned = world.with_camera_moved(nalgebra::Vector3::new(0.0, 1e-3, 0.0), nalgebra::Vector3::zeros());
        assert!(pairs(&turned.corners(1), &known).is_empty());
        assert!(pairs(&world.corners(1), &[]).is_empty());
    }
}
