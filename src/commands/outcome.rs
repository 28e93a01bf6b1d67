//! What a command ends with.

use crate::diagnostic::Status;

/// What a command leaves for `main` to print, and how it ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The result: a short table, or JSON.
    pub stdout: String,
    /// The exit status.
    pub status: Status,
}
