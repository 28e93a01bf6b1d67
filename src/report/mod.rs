//! What people look at: tables for the terminal, figures and HTML pages. Computes no metric of its own.

pub mod blur;
pub mod book;
pub mod camera_check;
pub mod day;
pub mod drawing;
pub mod identify;
pub mod located;
pub mod measure;
pub mod page;
pub mod plan;
pub mod recheck;
pub mod rectify;
pub mod rig;
pub mod robot;
pub mod robot_recheck;
pub mod table;

use crate::diagnostic::Explain;

/// Result of drawing.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What can go wrong in a report.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The plotting library refused.
    #[error("cannot draw the figure `{figure}`: {message}")]
    Figure {
        /// Its title.
        figure: String,
        /// The library's reason.
        message: String,
    },
}

impl Explain for Error {}
