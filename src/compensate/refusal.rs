//! Why a target is left as it is.

use crate::diagnostic::two_digits;

/// Why a target has no compensated readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refusal {
    /// The real robot does not get there.
    OutOfReach {
        /// What is missing, mm.
        short_mm: f64,
    },
    /// A joint would have to leave its range; deg or mm.
    Limit {
        /// The joint, from 1.
        joint: usize,
        /// The reading needed.
        needed: f64,
        /// Its range.
        range: (f64, f64),
    },
    /// The target itself is where a joint does not go; deg or mm.
    Outside {
        /// The joint, from 1.
        joint: usize,
        /// The reading that was given.
        given: f64,
        /// Its range.
        range: (f64, f64),
        /// Whether the file it was given in holds radians.
        radians: bool,
    },
    /// The correction would turn a joint far: the posture is next to a singular one.
    Singular {
        /// The joint that turns most, from 1.
        joint: usize,
        /// By how much, deg.
        turn_deg: f64,
    },
    /// An arm of few joints has no such orientation there.
    Tilted {
        /// Its joints.
        joints: usize,
        /// What is left of the turn to it, deg.
        left_deg: f64,
    },
}

impl std::fmt::Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Refusal::OutOfReach { short_mm } => write!(f, "out of reach by {} mm", two_digits(*short_mm)),
            Refusal::Limit { joint, needed, range: (low, high) } => {
                write!(f, "joint {joint} would need {needed:.3}; its range is {low:.3} to {high:.3}")
            }
            Refusal::Outside { joint, given, range: (low, high), radians } => {
                write!(f, "joint {joint} of the target is at {given:.3}; its range is {low:.3} to {high:.3}")?;
                let as_degrees = given.to_radians();
                if *radians && given.abs() > 360.0 && (*low..=*high).contains(&as_degrees) {
                    write!(f, ": degrees, {as_degrees:.1}, where radians are read?")?;
                }
                Ok(())
            }
            Refusal::Tilted { joints, left_deg } => {
                write!(f, "an arm of {joints} joints cannot turn its tool so there: {left_deg:.1} deg are left")
            }
            Refusal::Singular { joint, turn_deg } => {
                write!(f, "next to a singular posture: joint {joint} would turn by {turn_deg:.1} deg")
            }
        }
    }
}
