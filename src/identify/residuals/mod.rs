//! Predicted poses of the target to white residuals, with the unknowns of a sensor's placement eliminated.

pub mod cost;
pub mod distances;
pub mod eliminate;
pub mod normal;
pub mod pairwise;
pub mod points;
pub mod rows;
pub mod smooth;
pub mod starts;
pub mod state;
pub mod touch;
