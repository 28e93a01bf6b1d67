//! What imaging is given: pairs of picture files, corners as text, and corners of pictures measured before.

pub mod cache;
pub mod corners_csv;
pub mod pairs;
