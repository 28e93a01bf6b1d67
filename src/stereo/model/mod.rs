//! What is looked for: cameras with their lenses, the rig, the board's shape, and which of their numbers are free.

pub mod board_shape;
pub mod camera;
pub mod known_lenses;
pub mod nearest_lens;
pub mod parameters;
pub mod projection;
pub mod rectification;
pub mod rig;

pub use known_lenses::KnownLenses;
pub use parameters::{Layout, Shared, Values};
pub use rig::Covariance;
