//! The program as its users meet it, and the habits of its house.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    clippy::print_stdout,
    reason = "a test ends where its world is not as it should be, and says what it skips"
)]

mod boards;
mod corner_floors;
mod damaged_corners;
mod golden_corners;
mod pictures;
mod planted_faults;
mod run;
mod shot;
mod spreadsheet;
mod tables;
mod worlds;

mod advice;
mod compensate;
mod daily;
mod export_robot;
mod faults;
mod folders;
mod fuzz;
mod guide;
mod guide_pictures;
mod house;
mod identify;
mod known_move;
mod located;
mod measure;
mod mended;
mod messages;
mod picture_faults;
mod pipeline;
mod placement;
mod plan;
mod provenance;
mod published;
mod readme;
mod real;
mod rectify;
mod report;
mod rows;
mod separate_tags;
mod unread;
