//! Coarse corners to measured ones: a fit of the blurred corner to the raw pixels at full size, for each corner.

mod acceptance;
mod cell;
mod coarse;
mod curvature;
pub mod fields;
mod full_size;
pub mod light;
mod outlying_pixels;
pub mod saddle_fit;
mod scatter;
mod whole_board;
mod windows;

pub use saddle_fit::Measured;
pub use whole_board::{measure, refine};
