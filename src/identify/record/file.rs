//! `identification.json`: what stands in it.

use std::collections::BTreeMap;

use serde::Serialize;

use super::parameters::{Identifiability, MethodRecord};
use super::quality::Quality;
use crate::identify::data::dataset::Skipped;
use crate::identify::data::repeats::Repeats;
use crate::identify::data::targets::Targets;
use crate::identify::examine::sessions::Session;
use crate::identify::finding::Finding;
use crate::identify::judge::scale::CommonScale;
use crate::identify::judge::uncertainty::{Covariance, Expected};
use crate::identify::model::prior::Tolerance;
use crate::identify::run::{Certainty, Identification, Judged};
use crate::identify::sensor::SmoothError;
use crate::measurements::Given;
use crate::robot::{Advice, Check};

#[derive(Debug, Clone, Serialize)]
pub struct Record {
    /// Of every random draw.
    pub seed: u64,
    /// `name/model` of one of `methods`.
    pub chosen: String,
    /// Terms of the robot's model.
    pub terms: String,
    /// The nominal robot.
    pub before: Quality,
    /// All that was run.
    pub methods: Vec<MethodRecord>,
    /// Why methods were not run that were to be compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_run: Option<String>,
    pub identifiability: Identifiability,
    /// Whether to use the robot that was found.
    pub advice: Advice,
    pub reason: String,
    /// Whether links are farther from the file's than any maker's tolerance, which is to be looked at first.
    #[serde(skip)]
    pub is_beyond: bool,
    /// Whether the points are no instrument's.
    #[serde(skip)]
    pub is_computed: bool,
    /// Arms of the catalogue that are near the points, where the file's robot is not, with what they leave, mm.
    #[serde(skip)]
    pub of_catalogue: Vec<(&'static str, f64)>,
    /// In plain words, the gravest first.
    pub warnings: Vec<String>,
    /// Poses that fit far worse than the rest and were left out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outliers: Vec<String>,
    /// Poses to verify that fit far worse than the rest and by which nothing is judged.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub strays: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sessions: Vec<Session>,
    /// The rows that were given, by which they are known again.
    pub rows: Given,
    /// Rows without a usable reading.
    pub skipped: Vec<Skipped>,
    /// Held-out errors of models and terms.
    pub judged: Vec<Judged>,
    /// What is wrong with the data, and what was done about it.
    pub doctor: Vec<Finding>,
    /// Of the chosen method's identified parameters; `None` where nominal was kept.
    pub covariance: Option<Covariance>,
    /// The same with what the poses tell next to nothing of as uncertain as before them: for poses elsewhere.
    pub whole_covariance: Option<Covariance>,
    /// Times that the variance of residuals along what may change on a robot is larger than alike in all directions, by
    /// its word of `verify --against`.
    pub variance_along: BTreeMap<String, f64>,
    /// The position error to expect of the chosen robot; `None` where nominal was kept.
    pub expected: Option<Expected>,
    /// A scale of the readings, as far as the links' tolerance tells it from the robot's size; `None` where the links
    /// were not fitted.
    pub scale: Option<CommonScale>,
    /// The targets of each pose, where there are several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub targets: Option<Targets>,
    /// Readings that were repeated at one pose.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeats: Option<Repeats>,
    /// How sure the choice of terms is.
    pub certainty: Vec<Certainty>,
    /// Whether `verify` has all rows, each in fits that it was left out of, because the file has none to verify.
    pub folded: bool,
    /// The tool that the nominal chain asks for and the middle error that is left with it, mm, where that is far less
    /// than with the tool of the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tool_mm: Option<([f64; 3], f64)>,
    /// Unknowns of the sensor that were found beside the robot: name and value (mm, thousandths, mrad, standard
    /// deviations).
    pub sensor: Vec<(String, f64)>,
    /// A smooth error that the points of each placement share.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smooth: Option<Smooth>,
    /// Scatter of a point coordinate beyond the measurement's covariance, mm.
    pub scatter_mm: f64,
    /// Scatter of a component of the orientation, rad, where orientations were used.
    pub scatter_rad: Option<f64>,
    /// Parameters, or sums of them, whose search limits were widened, with what they are off by.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub widened: Vec<String>,
    /// The prior's standard deviations, where one was used.
    pub prior: Option<Tolerance>,
}

/// A smooth error that the points of each placement share.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Smooth {
    /// How large and how smooth.
    #[serde(flatten)]
    pub error: SmoothError,
    /// Root mean square of a coordinate that is left of it after a rigid fit to each placement, mm.
    pub left_mm: f64,
}

impl Smooth {
    /// Of the chosen fit.
    pub fn new(found: &Identification) -> Option<Smooth> {
        let rows = &found.formulation()?.rows;
        Some(Smooth { error: rows.scatter.smooth?, left_mm: rows.left_by_smooth_mm2().sqrt() })
    }
}

impl Record {
    /// Whether to use the robot, and why not, for its file.
    pub fn check(&self) -> Check {
        let of_joints = self.doctor.iter().filter(|finding| finding.of_joints);
        let mended = of_joints.map(Finding::sentence).collect();
        Check { advice: self.advice, reason: self.reason.clone(), out_of_tolerance: self.is_beyond, mended }
    }

    pub fn chosen_method(&self) -> Option<&MethodRecord> {
        self.methods.iter().find(|m| self.chosen == format!("{}/{}", m.name, m.model))
    }
}
