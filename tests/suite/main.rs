//! The program as its users meet it, and the habits of its house.

mod run;

mod house;
mod messages;
