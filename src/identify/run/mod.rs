//! The order of it all: gross errors, models, methods, the choice among them.

mod forward_selection;
mod found;
mod identify;
mod session;

pub use forward_selection::{Certainty, Judged, certainty};
pub use found::{Against, Candidate, Deletion, Identification};
pub use identify::{identify, step_count};
