//! The least-squares problem and its solvers; kernel, batch and placement are the swarms' hot loop.

pub mod batch;
pub mod fit;
pub mod formulation;
pub mod kernel;
pub mod placement;
pub mod problem;
pub mod swarm;
pub mod trust_region;
