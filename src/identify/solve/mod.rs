//! The least-squares problem and its solvers; batch and placement are the swarms' hot loop.

pub mod batch;
mod deleted;
pub mod fit;
pub mod formulation;
pub mod linearised;
pub mod placement;
pub mod problem;
pub mod robust;
pub mod scatter;
pub mod swarm;
pub mod task;
pub mod trust_region;
