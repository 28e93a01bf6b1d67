//! The truth that everything else is tested against: a rig, boards, a robot with hidden errors, and their pictures.
//!
//! In: [`settings::Settings`], plain data; the presets are values of it. Out: a [`world::World`] and, where wanted, its
//! files in the formats that the commands read and write. One picture is a [`picture::scene::Scene`] given to
//! [`picture::render::Renderer`].
//!
//! The renderer shares no formula with the corner fit that it judges: areas are exact by Green's theorem, the lens's
//! spread is summed numerically, and both are compared with rays. What it leaves out: reflexes, motion blur, rolling
//! shutters, and the depth of what stands behind the board, which is a blurred backdrop.
//!
//! ```
//! use stereocal::imaging::corners::Side;
//! use stereocal::simulate::{draws::NormalTable, picture::render::Renderer, settings::Settings, world::World};
//!
//! let settings = Settings { size_px: 320, check_pairs: 1, samples: 0, verify: 0, ..Settings::small() };
//! let world = World::new(settings, None)?;
//! let shot = &world.shots()[0];
//! let (backdrop, holder) = (world.backdrop(shot.placement, Side::Left), world.holder(shot));
//! let scene = world.scene(shot, Side::Left, &backdrop, &holder);
//! let picture = Renderer::new(&scene).picture(&NormalTable::new());
//! assert_eq!((picture.width, scene.corners_px().len()), (320, 361));
//! # Ok::<(), stereocal::Error>(())
//! ```

pub mod check_poses;
pub mod clutter;
pub mod draws;
pub mod physical_board;
pub mod picture;
pub mod rig;
pub mod robot_poses;
pub mod settings;
pub mod true_robot;
pub mod truth_files;
pub mod world;

use camino::Utf8PathBuf;

use crate::diagnostic::Explain;

/// Result of simulating.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What can go wrong in a simulation.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    #[error(transparent)]
    Files(#[from] crate::files::Error),
    #[error("a board of {squares} squares of {square_mm} mm does not fit into the field of both cameras")]
    BoardTooLarge { squares: String, square_mm: f64 },
    #[error(
        "group {group}: no pose round ({:.0}, {:.0}, {:.0}) mm that the robot reaches within its limits and both cameras see",
        point_mm[0], point_mm[1], point_mm[2]
    )]
    OutOfReach {
        group: String,
        /// Its start point, mm.
        point_mm: [f64; 3],
    },
    #[error("the true robot has {found} joints; the nominal one has {needed}")]
    Joints { found: usize, needed: usize },
    /// Pictures of something else stand where these would go.
    #[error("the folder holds pictures that are not of this world, {name} for one; they would be taken for its own")]
    Occupied { name: String, folder: Utf8PathBuf },
    #[error("cannot encode a picture: {0}")]
    Encode(#[from] image::ImageError),
}

impl Explain for Error {
    fn place(&self) -> Option<String> {
        match self {
            Error::Files(e) => e.place(),
            Error::Occupied { folder, .. } => Some(folder.to_string()),
            _ => None,
        }
    }
    fn hint(&self) -> Option<String> {
        let said = |hint: &str| Some(hint.to_owned());
        match self {
            Error::Files(e) => e.hint(),
            Error::BoardTooLarge { .. } => said("the field is about 256 mm wide; take fewer or smaller squares"),
            Error::OutOfReach { .. } => said("the spheres of the presets suit the robot of Table 1 of the paper"),
            Error::Joints { .. } => said("take the robot.toml that `stereocal simulate` writes and change its numbers"),
            Error::Occupied { .. } => said("`--out DIR` names another folder, or remove the old pictures"),
            Error::Encode(_) => None,
        }
    }
}
