//! Corners that say less about the rig than the others: measured much worse than usual, or contradicted by the other
//! picture.
//!
//! In: measured pairs. Out: how many such corners there are and in which pictures; the lengths that end in them are
//! left out, as long as they are few. A hand, a shadow or a hot column makes a few corners bad, which is no error of
//! the rig; where many are bad it is.

use crate::stereo::judge::lengths::Measured;

/// A corner whose standard deviation is this many times the usual one was not measured as the others are.
const UNSURE: f64 = 3.0;

/// Rays that miss each other by more standard deviations than this do not belong to one point: one in ten million does
/// so by chance.
pub const CONTRADICTED: f64 = 5.3;

/// Share of the corners up to which they are exceptions; beyond it they are what this rig delivers, and every length
/// counts.
const EXCEPTIONS: f64 = 0.1;

#[derive(Debug, Clone, PartialEq, Default)]
pub struct DoubtfulCorners {
    /// Corners that both pictures show.
    pub corners: usize,
    /// Of these, with a standard deviation far beyond the usual.
    pub unsure: usize,
    /// Of these, with rays that contradict each other.
    pub contradicted: usize,
    /// Lengths that end in one of them and were left out.
    pub lengths_left_out: usize,
    /// Pairs with such corners, the most first, with their number.
    pub pairs: Vec<(String, usize)>,
}

impl DoubtfulCorners {
    /// Share of the corners with rays that contradict each other.
    pub fn contradicted_share(&self) -> f64 {
        self.contradicted as f64 / self.corners.max(1) as f64
    }

    /// The worst pictures by name, for a person; empty where there are none.
    pub fn named(&self) -> String {
        let named = |(pair, count): &(String, usize)| format!("{pair} ({count})");
        self.pairs.iter().take(5).map(named).collect::<Vec<_>>().join(", ")
    }
}

/// Finds the doubtful corners and, where they are exceptions, leaves out the lengths that end in them. `names` are the
/// pairs', `usual_px` is the corners' usual standard deviation.
pub(super) fn leave_out(measured: &mut [Measured], names: &[&str], usual_px: f64) -> DoubtfulCorners {
    let mut found = DoubtfulCorners::default();
    let mut marks = Vec::new();
    for (measured, name) in measured.iter().zip(names) {
        let unsure = measured.sigmas_px.iter().map(|sigma| *sigma > UNSURE * usual_px);
        let contradicted = measured.points.iter().map(|p| p.chi_square > CONTRADICTED * CONTRADICTED);
        let both: Vec<(bool, bool)> = unsure.zip(contradicted).collect();
        found.corners += both.len();
        found.unsure += both.iter().filter(|b| b.0).count();
        found.contradicted += both.iter().filter(|b| b.1).count();
        let marked: Vec<bool> = both.iter().map(|b| b.0 || b.1).collect();
        let count = marked.iter().filter(|m| **m).count();
        if count > 0 {
            found.pairs.push(((*name).to_owned(), count));
        }
        marks.push(marked);
    }
    found.pairs.sort_by_key(|pair| std::cmp::Reverse(pair.1));
    let doubtful: usize = found.pairs.iter().map(|pair| pair.1).sum();
    if doubtful as f64 > EXCEPTIONS * found.corners as f64 {
        return found;
    }
    for (measured, marked) in measured.iter_mut().zip(&marks) {
        let before = measured.lengths.len();
        measured.lengths.retain(|length| !marked[length.ends.0] && !marked[length.ends.1]);
        found.lengths_left_out += before - measured.lengths.len();
        measured.doubtful.clone_from(marked);
    }
    found
}
