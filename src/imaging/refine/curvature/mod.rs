//! How the lens bends a board's lines: curvature at each corner, from the corners of its line.
//!
//! In: a grid of places and how good they are at least. Out: for each corner the bend of its two edges, and what its
//! own place has to do with it. Method: the offsets of a line's corners from its chord, as a polynomial of the place
//! along it (degree 2 to 4, by how many corners there are); on boards that may be seen in part all lines of one
//! direction together (`parallel`). Without it, a straight edge fitted to a long bent one is off by a twenty-fourth of
//! bend times length squared. Goes wrong: lines of one or two corners, which only the windows themselves show to bend.

mod bend;
mod lines;
mod parallel;

pub use bend::{Bend, Point, Rule, SEEN};
pub use lines::bends;
