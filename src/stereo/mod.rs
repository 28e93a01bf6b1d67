//! From corners to a calibrated rig, and from a rig to points in space.
//!
//! Rooms in the order of the data; imports point up this list only: `model` and `data` say what is looked for and what
//! was seen, `solve` finds the most likely rig, `init` where to start, `pairs` which pairs belong to it, `select` which
//! lens; `calibrate()` is all of that in turn. `volume` is where the boards were, `findings` what happened while they
//! were photographed, `judge` measures boards with the rig and says what it is worth, `triangulate` and `board_pose`
//! measure points and a board's pose with it, `recheck` says later whether it still stands.

mod error;

pub mod model;

pub mod data;

pub mod solve;

pub mod init;

pub mod pairs;

pub mod select;

pub mod calibrate;

pub mod triangulate;

pub mod volume;

pub mod findings;

pub mod judge;

pub mod board_pose;

pub mod recheck;

#[cfg(test)]
pub(crate) mod synthetic;
#[cfg(test)]
mod tests;

pub use crate::imaging::Side;
pub use error::Error;
pub use model::camera::{Camera, Lens};
pub use model::rig::Rig;
