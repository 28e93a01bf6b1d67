//! What was seen: corners with their covariances, what a rig leaves of them, and how they scatter.

pub mod corner_noise;
pub mod neighbour_correlation;
pub mod observation;
pub mod residuals;
pub mod view;
