//! Columns of what a point is off by from where the robot was sent.
//!
//! In: a file with names. Out: the columns of such a difference along x, y and z, where names say it. They are not
//! added to the commanded point: of two signs nothing says which, and one of them leaves twice the robot's error. What
//! goes wrong: turns about axes and uncertainties have names alike; a name with a letter of an axis beside a word for a
//! difference is taken for one.

use super::part::Part;
use crate::tables::names::{Unit, words};

const WORDS: [&str; 10] =
    ["dif", "diff", "difference", "delta", "err", "error", "errors", "dev", "deviation", "residual"];

/// The columns of a difference along x, y and z; `None` where there are not all three, or several.
pub(super) fn of(part: &Part) -> Option<[usize; 3]> {
    let names = part.names.as_ref()?;
    let along = |axis: &str| {
        let mut columns = (0..names.len()).filter(|&column| is_along(&names[column], axis));
        columns.next().filter(|_| columns.next().is_none())
    };
    Some([along("x")?, along("y")?, along("z")?])
}

/// `x_dif`, `Error X [mm]`, `dx`.
fn is_along(name: &str, axis: &str) -> bool {
    let words = words(name).0;
    let says = |word: &String| WORDS.contains(&word.as_str());
    let (axes, others): (Vec<&String>, Vec<&String>) =
        words.iter().filter(|word| !says(word)).partition(|word| matches!(word.as_str(), "x" | "y" | "z"));
    let beside = words.iter().any(says) && axes.len() == 1 && axes[0].as_str() == axis;
    beside && others.iter().all(|word| Unit::of(word).is_some()) || words == [format!("d{axis}")]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_told_by_their_names() {
        for name in ["x_dif", "Error X [mm]", "dx", "delta_x", "x_err_mm"] {
            assert!(is_along(name, "x") && !is_along(name, "y"), "{name}");
        }
        for name in ["x", "rx_err", "x_std", "x_rot_err", "xy error", "error", "vx", "x_t"] {
            assert!(!is_along(name, "x"), "{name}");
        }
    }
}
