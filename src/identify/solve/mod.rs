//! The least-squares problem and its solvers; swarm_cost and placement are the swarms' hot loop.

mod deleted;
pub mod fit;
pub mod formulation;
mod freedom;
pub mod linearised;
pub mod placement;
pub mod problem;
pub mod robust;
pub mod scatter;
pub mod swarm;
pub mod swarm_cost;
pub mod task;
pub mod trust_region;
