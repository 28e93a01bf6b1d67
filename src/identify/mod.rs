//! From measurements and joint angles to the robot's kinematic parameters.
//!
//! ```text
//!  data       rows by group and role; what is left out and why; sessions
//!  model      the robot at those poses, with derivatives; ladder, base parameters, prior
//!  residuals  predicted poses to white rows, the placement's own unknowns eliminated
//!  solve      weights, prior and box: the problem that all solvers get, and the solvers
//!  judge      errors on rows that were not fitted; models, terms and methods judged by them
//!  record     identification.json
//! ```

pub mod data;
pub mod error;
pub mod examine;
pub mod finding;
pub mod judge;
pub mod model;
pub mod record;
pub mod residuals;
pub mod run;
pub mod sensor;
pub mod settings;
pub mod solve;
#[cfg(test)]
pub mod synthetic;
#[cfg(test)]
mod tests;

pub use error::Error;
pub use settings::{Method, Model, Settings};
