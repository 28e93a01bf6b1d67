//! Several targets at each pose, told apart by the column `target`, made one: a point and an orientation.

mod apart;
mod body;
mod merge;
mod moved;
mod sorter;
#[cfg(test)]
mod tests;

pub use apart::Apart;
pub use merge::{Part, Targets, as_one};
