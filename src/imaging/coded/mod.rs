//! Boards whose markers number their corners: found in any part of them.

mod copies;
mod detection;
mod explain;
pub mod faces;
mod faint;
mod in_grid;
pub mod local_map;
pub mod marker;
pub mod measures;
mod numbering;
mod other_kind;
mod separate;
#[cfg(test)]
mod tests;

pub use detection::BY_LAYOUT;
pub use explain::is_unread;
pub use other_kind::{HAS_MARKERS, HAS_TAGS, of_other_kind};
pub use separate::detect;
