//! Where the board is in a picture, to about a pixel of a small copy: grids of corners that grow, and what tells which
//! part of the board they are.

mod colour;
pub mod continuation;
pub mod count;
#[cfg(test)]
mod cut_boards;
mod detected;
mod extent;
mod growth;
mod plain;
mod saddles;

pub use colour::right_handed;
pub use detected::{Detected, LEAST_SEEN, Open, Refusal, glance_level, on_a_copy};
pub use growth::grids;
pub use plain::{detect, size_seen};
