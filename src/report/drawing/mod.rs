//! What is drawn on pages: plots, views in space, and photographs with what was found in them.

mod axis;
pub mod figure;
mod label;
mod marks;
pub mod pair_picture;
pub mod picture;
pub mod scene;
pub mod script;
