//! What `identification.json` says of the robot file beside it: how far to trust the robot, and the covariance of what was identified.

use camino::Utf8Path;
use serde::Deserialize;

use crate::files::provenance::{Digested, Provenance};
use crate::identify::judge::locate::{REPEATABILITY_MM, Trust};

#[derive(Debug, Deserialize)]
struct Identified {
    expected: Option<Expected>,
    #[serde(default)]
    scatter_rad: Option<f64>,
    covariance: Option<Covariance>,
}

#[derive(Debug, Deserialize)]
struct Expected {
    mean_mm: f64,
}

/// As [`crate::identify::judge::uncertainty::Covariance`] writes it: names, and the units of the file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Covariance {
    /// Names of parameters.
    pub order: Vec<String>,
    /// Row by row.
    pub matrix: Vec<Vec<f64>>,
}

/// The record beside a robot's file, where it is about that file.
fn beside(robot: &Utf8Path) -> Option<Identified> {
    let record = robot.with_file_name("identification.json");
    let identified = serde_json::from_slice(&std::fs::read(&record).ok()?).ok()?;
    // Without provenance nothing says that they belong together but where they are.
    let Some(made_by) = Provenance::of_json(&record) else { return Some(identified) };
    let here = Digested::read(robot)?;
    made_by.outputs.iter().any(|output| output.sha256 == here.sha256).then_some(identified)
}

/// How far to trust a robot: what its identification says that a coordinate is off by, or a common arm's repeatability.
pub fn trust(robot: &Utf8Path) -> Trust {
    let identified = beside(robot);
    // Over the root of three, and of a mean length over that of its square.
    let of_coordinate = |e: &Expected| e.mean_mm / (0.921_317_731_923_561_3 * 3f64.sqrt());
    Trust {
        point_mm: identified.as_ref().and_then(|i| i.expected.as_ref()).map_or(REPEATABILITY_MM, of_coordinate),
        rotation_rad: identified.and_then(|i| i.scatter_rad),
    }
}

/// The covariance of the identified parameters, where the robot's file has its record beside it.
pub fn covariance(robot: &Utf8Path) -> Option<Covariance> {
    beside(robot)?.covariance
}
