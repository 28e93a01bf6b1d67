//! Particle swarms: PSO of eq. (14) and its relatives CPSO, APSO and ARPSO; the paper's STAPSO is built on them.

pub mod halton;
mod methods;
mod particles;
mod stapso;

pub use methods::solve;
pub use particles::uniform;
