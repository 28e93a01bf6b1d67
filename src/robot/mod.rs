//! The robot: its kinematic parameters, where they put the target, and the file they live in.

mod anatomy;
pub mod axes;
pub mod bent;
pub mod catalogue;
pub mod chain;
pub mod check;
pub mod corrections;
pub mod file;
pub mod inverse;
pub mod jacobian;
pub mod lanes;
pub mod parameters;
pub mod refit;
pub mod tool_fit;

use crate::diagnostic::{Explain, Place};

pub use chain::{Ends, Joint, Robot};
pub use check::{Advice, Check};
pub use corrections::Corrections;
pub use parameters::{Parameter, Unit};

/// Result of reading a robot.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What can go wrong with a robot.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    #[error(transparent)]
    Files(#[from] crate::files::Error),
    /// The file says something that is no robot.
    #[error("{message}")]
    File { message: String, place: Place },
    /// A table that could be read in several ways, or in none.
    #[error("{message}")]
    Table { message: String, place: String, hint: String },
    #[error("no arm `{name}` is known")]
    Unknown {
        name: String,
        /// The name most like it, where one is like it.
        nearest: Option<String>,
    },
    #[error("`{name}` may be any of {}", candidates.join(", "))]
    Ambiguous { name: String, candidates: Vec<&'static str> },
    #[error("a robot file is there already")]
    Occupied { path: String },
    #[error("the identified robot has {identified} joints, the nominal one {nominal}")]
    Different { identified: String, nominal: String },
    /// `identify` wrote the file of the nominal robot, and not the other one.
    #[error(
        "`--robot` names a robot that `identify` found, and `--identified` one that it did not find: are they exchanged?"
    )]
    Exchanged { robot: String, identified: String },
    /// Robots whose links are farther apart than robots are built.
    #[error("`{identified}` is not the arm of `{robot}`: {apart}")]
    OtherArm {
        robot: String,
        identified: String,
        /// Which links, and by how much.
        apart: String,
    },
    /// Targets for the nominal robot are not readings of the one that was found.
    #[error("`{identified}` counts its joints otherwise than `{robot}`: {}", mended.join("; "))]
    OtherCounting {
        robot: String,
        identified: String,
        /// What `identify` mended.
        mended: Vec<String>,
    },
    /// A format that does not fit this robot.
    #[error("{message}")]
    NotExportable { message: String, hint: String },
    #[error("{found} joint angles, but the robot has {needed} joints")]
    AngleCount { found: usize, needed: usize },
}

impl Explain for Error {
    fn place(&self) -> Option<String> {
        match self {
            Error::Files(e) => e.place(),
            Error::File { place, .. } => Some(place.to_string()),
            Error::Table { place, .. } => Some(place.clone()),
            Error::Occupied { path } => Some(path.clone()),
            _ => None,
        }
    }

    fn hint(&self) -> Option<String> {
        let said = |hint: &str| Some(hint.to_owned());
        match self {
            Error::Unknown { nearest, .. } => {
                let nearest =
                    nearest.as_ref().map_or(String::new(), |name| format!("; the most similar one is {name}"));
                Some(format!(
                    "`stereocal robot list` shows the names{nearest}; of any other arm `stereocal robot import FILE` makes one from a URDF or a table \
                     of Denavit-Hartenberg parameters"
                ))
            }
            Error::Ambiguous { candidates, .. } => {
                candidates.first().map(|name| format!("`stereocal robot new {name}` takes the first"))
            }
            Error::Occupied { .. } => said("`--force` overwrites it, `--out DIR` puts it elsewhere"),
            Error::AngleCount { needed, .. } => Some(format!("{needed} angles in degrees with commas between")),
            Error::Different { .. } => said("both files are of one robot, before and after `stereocal identify`"),
            Error::Exchanged { robot, identified } => Some(format!("`--robot {identified} --identified {robot}`")),
            Error::OtherArm { .. } => said(
                "`--robot` names the file that `identify` was given, with the same signs and zeros of the joints, `--identified` the \
                 identified.toml that it wrote; `stereocal robot show FILE` says what each of them is",
            ),
            Error::OtherCounting { robot, .. } => Some(format!(
                "mend what is named, then `stereocal identify` again with {robot}, and `compensate` with what that writes: as they are, targets would \
                 be read as if nothing had been mended"
            )),
            Error::NotExportable { hint, .. } | Error::Table { hint, .. } => Some(hint.clone()),
            Error::File { .. } => None,
            Error::Files(e) => e.hint(),
        }
    }
}

/// A tool's place as it is said and typed.
pub fn tool_text(tool_mm: &[f64; 3]) -> String {
    tool_mm.map(|mm| format!("{mm:.3}")).join(", ")
}
