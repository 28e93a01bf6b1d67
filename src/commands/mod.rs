//! One file or folder a command; each reads as the list of its stages, and nothing else knows their order.

mod beyond;
pub mod board;
pub mod camera_check;
pub mod compensate;
mod dispatch;
pub mod error;
pub mod export;
mod heed;
pub mod identify;
pub mod locate;
mod measure;
pub mod plan;
pub mod rectify;
pub mod report;
pub mod robot;
pub mod simulate;
pub mod start;
pub mod verify;

pub use dispatch::run;
pub use error::{Error, Outcome, Result};
