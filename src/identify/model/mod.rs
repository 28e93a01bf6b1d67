//! The robot's model: which parameters there are, what poses determine of them, and how far they may be from nominal.

pub mod base;
pub mod kinematics;
pub mod ladder;
pub mod prior;
