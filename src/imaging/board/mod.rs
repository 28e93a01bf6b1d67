//! What a board is: its squares, its markers and their codes, its name, and its sizes as drawn and as printed.

mod certificate;
pub mod dictionary;
mod error;
mod layout;
mod name;
mod pitch;
pub mod printed;
mod squares;

pub use certificate::{Board, Kind, SQUARES_MM};
pub use error::Error;
pub use layout::{Layout, Print};
pub use pitch::Pitch;
pub use squares::Squares;
