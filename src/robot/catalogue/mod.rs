//! Arms by name: the makers' tables, how a table makes a robot, and which arm a person means.

pub mod arm;
pub mod arms;
pub mod names;

pub use arm::{Arm, Convention, Row, from_rows};
pub use arms::{ARMS, PAPER, paper, robot};
