//! From a folder of pictures to the corners of the board in each, in an order both cameras agree on.

pub mod board;
pub mod coded;
pub mod corners;
pub mod count;
pub mod detect;
mod error;
pub mod find;
pub mod image;
pub mod input;
pub mod kind;
pub mod lattice;
pub mod order;
pub mod overlay;
pub mod refine;
#[cfg(test)]
pub mod shot;
mod shown;
mod sort;

pub use board::{Board, Squares};
pub use corners::{Corner, Corners, PairCorners, Side, Skipped};
pub use error::{Error, Result};
pub use find::{Wanted, find_corners};
pub use image::Mosaic;
