//! What was seen: corners with their covariances, what a rig leaves of them, and how they scatter.

pub mod corner_noise;
pub mod neighbour_correlation;
pub mod observation;
pub mod residuals;
pub mod view;

pub use corner_noise::Noise;
pub use neighbour_correlation::NeighbourCorrelation;
pub use observation::Observation;
pub use view::{View, in_use};
