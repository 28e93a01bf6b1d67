//! Files as the program reads and writes them: whole, atomically, with the path in every complaint.

mod fault;
mod io;
pub mod kind;
mod missing;
pub mod out_dir;
pub mod provenance;

pub use io::*;
pub use missing::meant;
pub use out_dir::{OutDir, or_usual};
