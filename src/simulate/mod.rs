//! The truth that everything else is tested against: a rig, boards, a robot with hidden errors, and their pictures.

pub mod backdrop;
pub mod check_poses;
pub mod clutter;
pub mod coverage;
pub mod draws;
pub mod outline;
pub mod physical_board;
pub mod psf;
pub mod render;
pub mod rig;
pub mod robot_poses;
pub mod scene;
pub mod sensor;
pub mod settings;
pub mod true_robot;
pub mod truth_files;
pub mod world;

use crate::error::Explain;

/// What can go wrong in a simulation.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No pose shows the whole board in both pictures.
    #[error("a board of {squares} squares of {square_mm} mm does not fit into the field of both cameras")]
    BoardTooLarge {
        /// The board.
        squares: String,
        /// Its squares' side, mm.
        square_mm: f64,
    },
    /// The robot cannot go there, or not in view.
    #[error(
        "group {group}: no pose round ({:.0}, {:.0}, {:.0}) mm that the robot reaches within its limits and both cameras see",
        point_mm[0], point_mm[1], point_mm[2]
    )]
    OutOfReach {
        /// The group.
        group: String,
        /// Its start point, mm.
        point_mm: [f64; 3],
    },
    /// The true robot is another kind of robot.
    #[error("the true robot has {found} joints; the nominal one has {needed}")]
    Joints {
        /// Its joints.
        found: usize,
        /// Those of Table 1.
        needed: usize,
    },
    /// A picture could not be encoded.
    #[error("cannot encode a picture: {0}")]
    Encode(#[from] image::ImageError),
}

impl Explain for Error {
    fn hint(&self) -> Option<String> {
        match self {
            Error::BoardTooLarge { .. } => {
                Some("the field is about 256 mm wide; take fewer or smaller squares".to_owned())
            }
            Error::OutOfReach { .. } => {
                Some("the spheres of the presets suit the robot of Table 1 of the paper".to_owned())
            }
            Error::Joints { .. } => {
                Some("take the robot.toml that `stereocal simulate` writes and change its numbers".to_owned())
            }
            Error::Encode(_) => None,
        }
    }
}
