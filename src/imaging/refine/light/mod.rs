//! What reaches a window beside the board's print: a gradient of the light, stray light, and the veil from which light
//! counts.

pub mod illumination;
pub mod stray;
pub mod veil;
