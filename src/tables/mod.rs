//! Tables as people have them: files of any common form as rows of cells, and names of columns as what they mean.
//!
//! ```text
//!  source   a file's bytes -> text in whatever encoding, or the cells of a spreadsheet
//!  foreign  what is no table: which program's file it is, and how to export it
//!  grid     text -> rows of cells: which delimiter, decimal comma, lines of a program; line numbers as an editor counts them
//!  cells    a unit, a list, a name or a comment beside the number of a cell
//!  lines    lines of a log or of a program, objects of JSON -> rows of cells
//!  called   joints whose names stand in cells -> names of their columns
//!  numbers  a cell with a decimal comma, or with thousands set apart, as a number
//!  expression   a cell with a formula, `pi/2`, `q2 - 90`, as a number
//!  header   where the names of the columns stand, if there are any
//!  names    a name -> a joint, a coordinate, a distance, its unit, and whether it was commanded
//!  vocabulary   the words of such names, in the languages that tables have them in
//! ```

mod called;
mod cells;
pub mod expression;
mod fields;
mod foreign;
pub mod grid;
pub mod header;
mod lines;
pub mod names;
mod numbers;
mod source;
pub mod vocabulary;

pub use fields::{Fields, Form};
pub use grid::Grid;
