//! What was measured, sorted for identification: groups and roles, what is left out and why, sessions along the rows.

pub mod covariances;
pub mod dataset;
pub mod doctor;
pub mod examine;
pub mod known;
pub mod sessions;
pub mod shared;
