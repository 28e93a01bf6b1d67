//! The program as its users meet it, and the habits of its house.

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
