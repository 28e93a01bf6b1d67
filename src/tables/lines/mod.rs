//! Texts that are no table, as rows of cells: lines of a log, lines of a program, objects of JSON.

pub mod log;
pub mod program;
pub mod records;
