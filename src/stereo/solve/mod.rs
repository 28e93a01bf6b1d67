//! The search for the most likely rig: one weighted, robust least squares over the rig, the board's shape and a pose a
//! pair.

mod gram_matrix;
pub mod jacobian;
pub mod levenberg_marquardt;
pub mod normal_equations;
pub mod priors;
pub mod problem;
pub mod robust_loss;
mod spread;
pub mod uncertainty;

pub use normal_equations::Equations;
pub use priors::Priors;
pub use problem::{Problem, Solved};
pub use robust_loss::Loss;
pub use spread::Spread;
