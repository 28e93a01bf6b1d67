//! What can go wrong in an identification.

use crate::diagnostic::{Explain, Status, count};

/// What can go wrong in an identification.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    #[error(
        "none of the {rows} rows can be fitted ({skipped} have no usable reading); rows of role `sample` are needed"
    )]
    NoSamples {
        rows: usize,
        /// Rows without a reading.
        skipped: usize,
        /// Why the first of them has none.
        reason: Option<String>,
    },
    /// Points that do not move with the robot.
    #[error("all {rows} points are one, {:.3}, {:.3}, {:.3} mm{}", point_mm[0], point_mm[1], point_mm[2], of_one(*.way_mm, *.of_robot_mm))]
    OnePoint {
        rows: usize,
        point_mm: [f64; 3],
        /// How far they are from their middle, mm, in the middle of them.
        way_mm: f64,
        /// The same of the robot's target.
        of_robot_mm: f64,
    },
    /// A column of another kind was taken for that of the placements.
    #[error(
        "the {rows} rows are of {groups} groups, none of more than {most}: a group is one placement of the sensor, which takes the numbers of two points by itself"
    )]
    SmallGroups {
        rows: usize,
        groups: usize,
        /// Rows of the largest.
        most: usize,
    },
    /// Robot and measurements are not about the same machine.
    #[error("the robot has {robot} joints, the measurements have {measurements}{}", missing.as_ref().map_or_else(String::new, |column| format!("; there is no column `{column}`")))]
    JointCount {
        robot: usize,
        measurements: usize,
        /// The column of the first joint that the measurements lack.
        missing: Option<String>,
        /// The measurements' file.
        place: String,
    },
    /// A joint slides in one file and turns in the other.
    #[error(
        "joint {joint} {} in the robot's file; its readings are then in a column `j{joint}_{}`",
        if *.slides { "slides" } else { "turns" }, if *.slides { "mm" } else { "deg" }
    )]
    JointKind {
        /// The joint, from 1.
        joint: usize,
        /// Whether it slides in the robot's file.
        slides: bool,
        /// The measurements' file.
        place: String,
    },
    /// Moving any parameter changes nothing that was measured.
    #[error("the {} no parameter: moving any of them changes nothing that was measured", if *.poses == 1 { "1 pose determines".to_owned() } else { format!("{poses} poses determine") })]
    NothingDetermined {
        /// Poses to fit.
        poses: usize,
    },
    #[error(
        "{} {numbers} independent numbers for {parameters} parameters; more numbers than parameters are needed: at least {}",
        if *.poses == 1 { "1 pose gives".to_owned() } else { format!("{poses} poses give") },
        count(*.more, "more pose")
    )]
    TooFew {
        /// Independent numbers.
        numbers: usize,
        /// Base parameters.
        parameters: usize,
        /// Poses to fit.
        poses: usize,
        /// Poses that are missing at the least.
        more: usize,
    },
    /// Several targets a pose that cannot be made one.
    #[error("{message}")]
    Targets {
        /// What was found.
        message: String,
        /// What to look at.
        hint: &'static str,
    },
    /// No verify row has anything to be measured from.
    #[error(
        "none of the {rows} rows can be judged: a row is judged by its distance to another of its group, or by a placement that takes {needed}"
    )]
    NothingJudged {
        rows: usize,
        /// Rows that a group is placed by.
        needed: usize,
    },
    /// The chosen model needs what the data lack.
    #[error("model `{model}` needs {needed}, which the measurements don't have")]
    ModelNeeds { model: &'static str, needed: &'static str },
    /// Too few poses to place the sensor by.
    #[error("group `{group}` has {} with a point; a placement takes {needed}", count(*.found, "pose"))]
    TooFewToPlace {
        group: String,
        /// Poses with a point.
        found: usize,
        needed: usize,
    },
    /// The sensor is on the flange.
    #[error(
        "the points move as those of cameras on the flange before a target that stands still ({backwards_mm:.2} mm off the nominal robot that way \
         round, {as_is_mm:.1} mm as they are read); cameras that stand still, with the target on the flange, are what is identified"
    )]
    CamerasOnHand {
        /// Median error as the readings are meant, mm.
        as_is_mm: f64,
        /// The other way round, mm.
        backwards_mm: f64,
    },
    /// Nothing says how well the robot is known.
    #[error("{path} says nothing of how well it is known")]
    NotKnown { path: String },
    /// The poses leave a direction open.
    #[error("these poses do not tell {direction}: they leave it open")]
    Open {
        /// What moves along it.
        direction: String,
    },
    /// The robot is not the one whose rows these are.
    #[error("the cameras cannot be placed with this robot: {why}")]
    OtherRobot {
        /// What was found.
        why: String,
    },
    /// A solver started from numbers that are no numbers.
    #[error("the residuals at the nominal robot are not finite")]
    NotFinite,
}

/// What points say that are one although the joints moved.
fn of_one(way_mm: f64, of_robot_mm: f64) -> String {
    if way_mm == 0.0 {
        return ", although the joints moved: nothing was measured".to_owned();
    }
    format!(
        " within {way_mm:.4} mm, while the robot moves its target by {of_robot_mm:.0} mm: what was measured stands still (the base, a reference)"
    )
}

impl Explain for Error {
    fn status(&self) -> Status {
        match self {
            Error::NothingDetermined { .. }
            | Error::TooFew { .. }
            | Error::NothingJudged { .. }
            | Error::TooFewToPlace { .. }
            | Error::Open { .. }
            | Error::OtherRobot { .. }
            | Error::NotFinite => Status::Undetermined,
            _ => Status::BadInput,
        }
    }

    fn place(&self) -> Option<String> {
        match self {
            Error::JointCount { place, .. } | Error::JointKind { place, .. } => Some(place.clone()),
            _ => None,
        }
    }

    fn hint(&self) -> Option<String> {
        match self {
            Error::JointCount { missing: Some(column), .. } => {
                Some(format!("add column `{column}`, or name the robot that was measured with `--robot FILE`"))
            }
            Error::JointCount { .. } | Error::OtherRobot { .. } => {
                Some("`--robot FILE` names the robot that was measured".to_owned())
            }
            Error::NothingDetermined { .. } | Error::TooFew { .. } | Error::NothingJudged { .. } => {
                Some("measure more poses, spread over the workspace and with varied orientation".to_owned())
            }
            Error::TooFewToPlace { .. } | Error::Open { .. } => Some(
                "turn the flange about two axes that are not parallel, by 20 deg or more, over three poses or more of each group".to_owned(),
            ),
            Error::CamerasOnHand { .. } => Some(
                "with orientations, give each row the inverse of its pose (point -R'p, rotation vector -r): the board is then the sensor, and \
                 flange_from_target is where the camera sits on the hand"
                    .to_owned(),
            ),
            Error::OnePoint { .. } => {
                Some("`--columns` names the columns that hold the points, where they are others".to_owned())
            }
            Error::SmallGroups { .. } => Some(
                "give all rows that were measured from one placement the same `group`, or leave the column away where there is but one: under another name it is \
                 not read"
                    .to_owned(),
            ),
            Error::NotKnown { .. } => {
                Some("`identify` writes identification.json beside identified.toml: keep both together".to_owned())
            }
            Error::NoSamples { reason: Some(reason), .. } => Some(format!("the first of those without: {reason}")),
            Error::Targets { hint, .. } => Some((*hint).to_owned()),
            Error::ModelNeeds { .. } => Some("leave `--model` out and the model is chosen by the data".to_owned()),
            _ => None,
        }
    }
}
