//! The order of it all: gross errors, models, methods, the choice among them.

mod forward_selection;
mod found;
mod held_out;
mod identify;
mod placed;
mod session;

pub use forward_selection::{Certainty, Judged, certainty};
pub use found::{Candidate, Deletion, Identification};
pub use held_out::Against;
pub use identify::{identify, step_count};
