//! `identification.json`: what was found, in numbers for other programs, and whether to use it.

mod advice;
mod file;
pub mod findings;
mod gather;
mod left_out;
mod misfits;
mod parameters;
mod plausible;
mod quality;
mod rounded;
mod touched;
mod untested;

pub use crate::robot::Advice;
pub use file::{Record, Smooth};
pub use findings::Findings;
pub use gather::asked_tool;
pub use parameters::{Identifiability, MethodRecord, ParameterRecord};
pub use plausible::links_apart;
pub use quality::{PointSpread, Quality, quality, spread};
