//! `identification.json`: what was found, in numbers for other programs, and whether to use it.

mod advice;
mod file;
pub mod findings;
mod gather;
mod parameters;
mod plausible;
mod quality;
mod touched;

pub use file::{Advice, Record, Smooth};
pub use findings::Findings;
pub use parameters::{Identifiability, MethodRecord, ParameterRecord};
pub use quality::{PointSpread, Quality, quality, spread};
