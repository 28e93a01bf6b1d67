//! Which columns of a table are the joints, which the measured points, and in what units.

pub(super) mod apart;
mod differences;
pub(super) mod judge;
pub(super) mod layout;
pub(super) mod part;
pub(super) mod pick;
pub(super) mod truth;
pub(super) mod two_frames;
pub(super) mod unsettled;

pub use unsettled::is_not_near;
