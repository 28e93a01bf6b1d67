//! A rig in the words of other programs, written and read back.

mod cameras;
pub mod file_storage;
pub mod kalibr;
pub mod mrcal;
mod read;
pub mod ros;
pub mod scan;
mod written;

pub use cameras::Cameras;
pub use read::{NAMES, read, read_cameras};
pub(super) use written::METRE;
pub use written::{ExportedFile, matrix};
