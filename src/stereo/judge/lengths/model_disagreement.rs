//! Models that measure other lengths than the chosen one, by more than chance.
//!
//! In: a calibration with the richer models that are witnesses (see [`crate::stereo::select::stated_uncertainty`]),
//! lengths over the working volume. Out: for each by how much it changes lengths. A simpler model than the chosen one
//! is either refuted by the corners or says the same. A richer one is less sure by nature: it disagrees only where its
//! additional terms are more than chance. By how much chi-squared falls for them says so for all lengths at once: no
//! length changes by more standard deviations of the difference of nested estimates, whose covariance is `V(richer) -
//! V(simpler)` (Hausman 1978), than the root of that fall (Scheffe).

use serde::Serialize;

use crate::diagnostic::two_digits;
use crate::statistics::{NORMAL_999, chi_square_quantile};
use crate::stereo::calibrate::Calibration;
use crate::stereo::select::stated_uncertainty::Witness;
use crate::stereo::volume::lengths::VolumeLengths;

/// Another model, compared with the chosen one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Disagreement {
    /// The chosen lens.
    pub chosen: &'static str,
    /// The other lens; the same where it is the board that is not flat.
    pub other: &'static str,
    /// Whether the board's shape is free in the other model and not in the chosen one.
    pub other_board_shape: bool,
    /// Largest change of a length in the working volume, mm.
    pub length_change_mm: f64,
    /// By how much chi-squared falls for the additional terms, neighbours and pairs that scatter allowed for.
    pub chi_square_fall: f64,
    /// By how much it falls by chance once in a thousand calibrations.
    pub chance: f64,
    /// Change of `right_from_left`'s translation, mm.
    pub translation_change_mm: [f64; 3],
}

/// All richer models that measure other lengths.
pub fn find(calibration: &Calibration, volume: &VolumeLengths) -> Vec<Disagreement> {
    calibration.witnesses.iter().filter_map(|witness| compare(calibration, volume, witness)).collect()
}

fn compare(calibration: &Calibration, volume: &VolumeLengths, witness: &Witness) -> Option<Disagreement> {
    let (own, theirs) = (calibration.layout.left?, witness.layout.left?);
    let chance = chi_square_quantile(witness.added as f64, NORMAL_999);
    if witness.chi_square_fall <= chance {
        return None;
    }
    let lengths = [calibration.rig(), &witness.rig].map(|rig| volume.measured_by(rig));
    let changes = lengths[0].iter().zip(&lengths[1]).filter_map(|(a, b)| Some(((*b)? - (*a)?).abs()));
    let t = witness.rig.right_from_left.translation.vector - calibration.rig().right_from_left.translation.vector;
    Some(Disagreement {
        chosen: own.name(),
        other: theirs.name(),
        other_board_shape: witness.layout.shape && !calibration.layout.shape,
        length_change_mm: changes.fold(0.0, f64::max),
        chi_square_fall: witness.chi_square_fall,
        chance,
        translation_change_mm: [t.x, t.y, t.z],
    })
}

/// The findings for a person, where there are any: the one that changes lengths most, and the names of the others.
pub fn describe(all: &[Disagreement]) -> Option<String> {
    let worst = all.iter().max_by(|a, b| a.length_change_mm.total_cmp(&b.length_change_mm))?;
    let named = |d: &Disagreement| format!("{} ({} mm)", d.name(), two_digits(d.length_change_mm));
    let others: Vec<String> = all.iter().filter(|d| *d != worst).map(named).collect();
    let and = if others.is_empty() { String::new() } else { format!(". So does {}", others.join(", ")) };
    Some(worst.describe() + &and)
}

impl Disagreement {
    /// The other model, for a person.
    pub fn name(&self) -> String {
        if self.other_board_shape {
            "a board that is not flat".to_owned()
        } else {
            format!("the lens model {}", self.other)
        }
    }

    /// The finding for a person: what differs, what it does to lengths, which pictures would settle it.
    pub fn describe(&self) -> String {
        format!(
            "{} instead of {} measures lengths in the working volume that differ by up to {} mm, and its additional terms are more than chance (chi-squared \
             falls by {:.0}, by chance {:.0} at most), though too weak to predict other pairs better. To settle it, photograph the board in all four \
             corners and along the edges of both pictures, tilted by 30 to 45 degrees about both axes, and at the nearest and the farthest distance",
            self.name(),
            if self.other_board_shape { "a flat one" } else { self.chosen },
            two_digits(self.length_change_mm),
            self.chi_square_fall,
            self.chance
        )
    }
}
