//! What can go wrong in planning.

use crate::diagnostic::{Explain, Status};

/// Result of planning.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What can go wrong in planning.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    #[error(
        "group {group}: the robot does not reach ({}, {}, {}) mm with its flange level or pointing down, within its limits",
        tenths(point_mm[0]), tenths(point_mm[1]), tenths(point_mm[2])
    )]
    Unreachable {
        group: String,
        point_mm: [f64; 3],
        /// The nearest point of that line from the base that it reaches, mm.
        nearest_mm: Option<[f64; 3]>,
    },
    #[error(
        "the rig never sees a target of {width_mm:.0} x {height_mm:.0} mm wholly in both pictures; its field is about {field_mm:.0} mm at {distance_mm:.0} mm"
    )]
    NeverSeen {
        width_mm: f64,
        height_mm: f64,
        /// Width that both cameras see.
        field_mm: f64,
        /// Distance of the field's middle.
        distance_mm: f64,
    },
    #[error(
        "group {group}: {found} of {tried} poses that were tried are in view and can be reached within the joints' limits; {needed} are needed"
    )]
    TooFew {
        group: String,
        found: usize,
        tried: usize,
        needed: usize,
        /// Whether it is so many because so many poses were asked for.
        asked: bool,
        /// The nearest middle of a sphere, base frame, mm, about which the arm reaches enough places.
        reached_mm: Option<[f64; 3]>,
    },
    /// The measurements are of other groups, or of nothing.
    #[error("{message}")]
    Measured { message: String, place: String },
}

/// Nearer to the base than that no flange comes, mm.
const LEAST_MM: f64 = 10.0;

/// A length as a message shows it, to a tenth of a millimetre.
fn tenths(mm: f64) -> f64 {
    (10.0 * mm).round() / 10.0
}

impl Explain for Error {
    fn status(&self) -> Status {
        match self {
            Error::TooFew { .. } => Status::Undetermined,
            _ => Status::BadInput,
        }
    }
    fn place(&self) -> Option<String> {
        match self {
            Error::Measured { place, .. } => Some(place.clone()),
            _ => None,
        }
    }
    fn hint(&self) -> Option<String> {
        Some(match self {
            Error::Unreachable { point_mm, .. } if point_mm.iter().all(|mm| mm.abs() < LEAST_MM) => {
                "`--center` is in mm".to_owned()
            }
            Error::Unreachable { nearest_mm: Some([x, y, z]), .. } => {
                format!("`--center {x:.0},{y:.0},{z:.0}` is reached; repeat --center for more spheres")
            }
            Error::Unreachable { .. } => {
                "`stereocal robot show` gives the pose at joint angles: is the robot file right?".to_owned()
            }
            Error::NeverSeen { .. } => {
                "a smaller target (`--squares`, `--square-mm`), or cameras that look at one place".to_owned()
            }
            Error::TooFew { asked, reached_mm, .. } => {
                let place = reached_mm.map_or("another place of the sphere (`--center X,Y,Z`)".to_owned(), |[x, y, z]| {
                    format!("`--center {x:.0},{y:.0},{z:.0}`, where the arm reaches enough of them (repeat --center for more spheres)")
                });
                let fewer = if *asked { ", fewer poses (`--poses`, `--verify`)" } else { "" };
                format!(
                    "{place}, smaller spheres (`--radius-mm`){fewer}, or joint limits (limits_deg) as wide as the arm's"
                )
            }
            Error::Measured { .. } => {
                "`--after` takes the measurements.csv of poses that `stereocal plan --first` made".to_owned()
            }
        })
    }
}
