//! One picture: what stands before the camera, what the lens and the sensor make of it, and what may go wrong with the
//! file.
//!
//! In: a [`scene::Scene`]. Out: pixels ([`render::Renderer`]), and the true corners.

pub mod backdrop;
pub mod coverage;
pub mod outline;
pub mod patch;
pub mod psf;
pub mod render;
pub mod scene;
pub mod sensor;
