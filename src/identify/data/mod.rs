//! What was measured, sorted for identification: groups and roles, what is left out and why, what is wrong with it, sessions along the rows.

pub mod conventions;
pub mod covariances;
pub mod dataset;
pub mod doctor;
pub mod known;
pub mod orientations;
pub mod plausible;
pub mod repeats;
pub mod sessions;
pub mod shared;
mod still;
pub mod targets;
