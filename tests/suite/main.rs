//! The program as its users meet it, and the habits of its house.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test ends where its world is not as it should be, and says what it skips"
)]

mod boards;
mod pictures;
mod run;
mod worlds;

mod house;
mod identify;
mod messages;
mod pipeline;
mod published;
mod real;
