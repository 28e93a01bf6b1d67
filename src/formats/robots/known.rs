//! What `identification.json` says of the robot file beside it: how far to trust the robot, and the covariance of what
//! was identified.

use std::collections::BTreeMap;

use camino::Utf8Path;
use nalgebra::{DMatrix, Vector3};
use serde::Deserialize;

use crate::files::provenance::{Digested, Provenance};
use crate::identify::judge::lengths::MEAN_OVER_RMS;
use crate::identify::judge::locate::{LeftOpen, Trust};
use crate::identify::judge::recheck::Before;
use crate::identify::judge::uncertainty::Covariance;
use crate::identify::model::ladder::Terms;
use crate::identify::sensor::REPEATABILITY_MM;
use crate::measurements::Given;
use crate::robot::{Joint, Parameter, Robot};

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Identified {
    expected: Option<Expected>,
    scatter_mm: f64,
    scatter_rad: Option<f64>,
    smooth: Option<Smooth>,
    whole_covariance: Option<Covariance>,
    variance_along: BTreeMap<String, f64>,
    rows: Given,
    targets: Option<Targets>,
    chosen: String,
    methods: Vec<Method>,
}

#[derive(Debug, Deserialize)]
struct Method {
    name: String,
    model: String,
    parameters: Vec<Corrected>,
}

/// A parameter, in units of the file.
#[derive(Debug, Deserialize)]
struct Corrected {
    name: String,
    delta: f64,
}

#[derive(Debug, Deserialize)]
struct Targets {
    names: Vec<String>,
    scatter_mm: Option<f64>,
    places_mm: Vec<Option<[f64; 3]>>,
}

impl Identified {
    /// By how much the identification corrected a parameter, in units of the file.
    fn correction(&self, of: Parameter) -> f64 {
        let chosen = self.methods.iter().find(|method| self.chosen == format!("{}/{}", method.name, method.model));
        let found = chosen.and_then(|method| method.parameters.iter().find(|known| known.name == of.name()));
        found.map_or(0.0, |known| known.delta)
    }
}

#[derive(Debug, Deserialize)]
struct Expected {
    mean_mm: f64,
    scatter_mm: Option<f64>,
    p95_mm: f64,
    freedom: Option<f64>,
    #[serde(default)]
    joint_ranges: Vec<[f64; 2]>,
    map: Vec<(String, f64)>,
}

#[derive(Debug, Deserialize)]
struct Smooth {
    left_mm: f64,
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
    let identified = beside(robot).unwrap_or_default();
    Trust {
        point_mm: identified.expected.as_ref().map_or(REPEATABILITY_MM, |e| of_coordinate(e.mean_mm)),
        rotation_rad: identified.scatter_rad,
    }
}

/// The error of a coordinate whose points are off by so much on average: over the root of three, and of a mean length
/// over that of its square.
fn of_coordinate(mean_mm: f64) -> f64 {
    mean_mm / (MEAN_OVER_RMS * 3f64.sqrt())
}

/// What the identification of a robot left open of it. `None` where nothing beside its file says so.
pub fn left_open(file: &Utf8Path, robot: &Robot) -> Option<LeftOpen> {
    let expected = beside(file)?.expected?;
    // A record that does not tell the scatter from the rest tells no less than both.
    let point_mm = of_coordinate(expected.scatter_mm.unwrap_or(expected.mean_mm));
    let Before { parameters, covariance, freedom, .. } = before(file, robot)?;
    Some(LeftOpen { parameters, covariance, freedom, point_mm })
}

/// The ranges of the joints over which a robot was identified, rad (mm where a joint slides). `None` where nothing
/// beside its file says so.
pub fn identified_over(file: &Utf8Path, robot: &Robot) -> Option<Vec<(f64, f64)>> {
    let ranges = beside(file)?.expected?.joint_ranges;
    let unit = |slides: bool| if slides { 1.0 } else { 1f64.to_radians() };
    let inside = |([low, high], joint): ([f64; 2], &Joint)| (low * unit(joint.slides), high * unit(joint.slides));
    (ranges.len() == robot.joints.len()).then(|| ranges.into_iter().zip(&robot.joints).map(inside).collect())
}

/// The rows that a robot was identified from; none where nothing beside its file says so.
pub fn given(file: &Utf8Path) -> Given {
    beside(file).unwrap_or_default().rows
}

/// Where targets stand from the mark point along the flange's axes, mm, by name, where the robot joined them; none
/// where their poses did.
pub fn places_mm(file: &Utf8Path) -> BTreeMap<String, Vector3<f64>> {
    let joined = beside(file).and_then(|identified| identified.targets).filter(|t| t.scatter_mm.is_none());
    let placed = joined.into_iter().flat_map(|t| t.names.into_iter().zip(t.places_mm));
    placed.filter_map(|(name, place)| Some((name, place?.into()))).collect()
}

/// What is known of an identified robot. `None` where its file has no record beside it, or one of another program's
/// version.
pub fn before(file: &Utf8Path, robot: &Robot) -> Option<Before> {
    let identified = beside(file)?;
    let (Covariance { order, matrix }, expected) =
        (identified.whole_covariance.as_ref()?, identified.expected.as_ref()?);
    let all = Terms::ALL.parameters(robot);
    let named = |name: &String| all.iter().copied().find(|p| p.name() == *name);
    let parameters = order.iter().map(named).collect::<Option<Vec<Parameter>>>()?;
    let count = parameters.len();
    if matrix.len() != count || matrix.iter().any(|row| row.len() != count) {
        return None;
    }
    let factor = |i: usize| parameters[i].file_unit().1;
    let covariance = DMatrix::from_fn(count, count, |r, c| matrix[r][c] / (factor(r) * factor(c)));
    let correction = parameters.iter().map(|of| identified.correction(*of)).collect();
    let point_mm = identified.scatter_mm.hypot(identified.smooth.as_ref().map_or(0.0, |smooth| smooth.left_mm));
    let trust = Trust { point_mm, rotation_rad: identified.scatter_rad };
    let (poses, p95_mm) = (expected.map.len(), expected.p95_mm);
    let along = identified.variance_along;
    let freedom = expected.freedom.unwrap_or(3.0 * expected.map.len() as f64);
    let over = identified_over(file, robot).unwrap_or_default();
    Some(Before { parameters, covariance, correction, trust, along, poses, freedom, p95_mm, over })
}
