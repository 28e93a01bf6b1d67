//! What was measured, sorted for identification: groups and roles, what is left out and why.

pub mod dataset;
pub mod known;
pub mod repeats;
pub mod shared;
pub mod still;
pub mod targets;
pub mod unused;
