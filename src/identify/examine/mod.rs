//! What is wrong with the data, asked before anything is identified: each question is answered with the data mended and
//! a sentence.

mod all;
pub mod conventions;
mod counting;
pub mod covariances;
mod hypothesis;
pub mod in_hand;
pub mod known;
pub mod misfit;
pub mod on_rows;
pub mod orientations;
pub mod robots;
pub mod sessions;
pub mod shifted;

pub use all::{Examined, examine};
