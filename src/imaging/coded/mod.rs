//! Boards whose markers number their corners.

pub mod dictionary;
