//! The least-squares problem and its solvers.

mod deleted;
pub mod fit;
pub mod formulation;
pub mod linearised;
pub mod problem;
pub mod robust;
pub mod scatter;
pub mod swarm;
pub mod task;
pub mod trust_region;
