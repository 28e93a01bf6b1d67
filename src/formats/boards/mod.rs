//! Boards: their descriptions by other programs, and the sheet to print as PDF, SVG and PNG.

pub mod files;
mod png;
pub mod sheet;
