//! Several targets at each pose, told apart by the column `target`, made one: a point and an orientation.

mod body;
mod joined;
mod merge;
mod moved;
mod sorter;
#[cfg(test)]
mod tests;

pub use body::middle;
pub use joined::{Joined, of_places};
pub use merge::{Part, Targets, as_one};
