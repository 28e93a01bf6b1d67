//! Tags of a grid that do not lie where the board has them: moved when the board was made, or printed elsewhere.
//!
//! In: a calibration by a grid of separate tags. Out: a line for a person. Method: what the rig misses the corners of
//! one tag by, in the middle of all pictures, beside what it misses all corners by. Goes wrong: more than half of the
//! tags, which are then what is usual.

use std::collections::BTreeMap;

use crate::statistics::median;
use crate::stereo::calibrate::Calibration;
use crate::stereo::data::residuals;

/// How many times as far as usual a moved tag is missed, and fewest corners that say so.
const FAR: f64 = 5.0;
const FEWEST: usize = 8;

/// The tags that lie elsewhere, and how far.
pub fn said(calibration: &Calibration) -> Option<String> {
    let board = &calibration.board;
    if !board.is_grid() {
        return None;
    }
    let mut by_tag: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for (view, pose) in calibration.views.iter().zip(&calibration.values.poses) {
        for o in &view.observations {
            let missed = residuals::residual_px(&calibration.values.shared, pose, o);
            by_tag.entry(board.id(o.col, o.row) / 4).or_default().extend(missed.map(|r| r.norm()));
        }
    }
    let usual_px = median(by_tag.values().flatten().copied())?;
    let far = |(tag, missed): (&usize, &Vec<f64>)| {
        let px = median(missed.iter().copied()).filter(|px| missed.len() >= FEWEST && *px > FAR * usual_px)?;
        Some(format!("{tag} by {px:.2} px"))
    };
    let moved: Vec<String> = by_tag.iter().filter_map(far).collect();
    (!moved.is_empty()).then(|| {
        format!(
            "tags that are not where the board has them: {} (median over the pictures; of all corners {usual_px:.3} px). They were moved or printed \
             elsewhere: cover them, or print the board anew",
            moved.join(", ")
        )
    })
}
