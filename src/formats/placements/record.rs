//! `placement.json`: where the cameras stand and the target sits on the flange, with covariances.

use camino::Utf8Path;
use nalgebra::{Matrix3, Matrix6, Vector3};
use serde::{Deserialize, Serialize};

use crate::files::{self, Result};
use crate::formats::checked;
use crate::geometry::{Transform, rotation_matrix, rotation_vector};
use crate::identify::data::dataset::Dataset;
use crate::identify::judge::errors::{RowError, Spread};
use crate::identify::judge::lengths::Lengths;
use crate::identify::judge::placement::{Placed, Uncertain, is_held};
use crate::identify::judge::uncertainty::region;
use crate::robot::{Check, Parameter};

/// The file's name in a results folder.
pub const PLACEMENT: &str = "placement.json";

/// The file. Transforms are between the robot's root (before `[base]`), its flange (behind `[flange]`), the sensor and
/// the target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlacementFile {
    /// The robot file that it belongs to: held numbers are its own.
    pub robot: String,
    /// What the run that found it says of its use.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub check: Option<Check>,
    /// Whether an instrument measured that is none of cameras: the "rig" is then the frame of its points.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub by_instrument: bool,
    /// Whether the points are left-handed in their file and x of them was negated before they were placed: no transform
    /// places them as they are read.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub mirrored: bool,
    /// Placements of the sensor; none where distances were read.
    pub groups: Vec<GroupRecord>,
    /// Where the target sits; `null` where there are no placements.
    pub flange_from_target: Option<TransformRecord>,
    /// What the rows and columns of a covariance are of.
    pub covariance_order: [String; 6],
    /// Joint ranges for which errors are said.
    pub poses: String,
    /// What cannot be told from a placement and stands as the robot's file has it.
    pub held: Vec<Held>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GroupRecord {
    pub group: String,
    /// The first and the last of its rows, where the sensor moved in between and the group has several placements.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rows: Option<[String; 2]>,
    pub base_from_rig: TransformRecord,
    /// How far the predicted target is to be expected from the true one, at the poses of the group.
    pub error_mm: Lengths,
    /// Errors of points that did not help to place it.
    pub held_out: Spread,
}

/// A rigid transform.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TransformRecord {
    /// Row by row; `null` where nothing told it.
    pub rotation: Option<[[f64; 3]; 3]>,
    pub translation_mm: [f64; 3],
    /// Of `exp(w)` on the left of the rotation, rad, and of the translation, mm; `null` for what was not found.
    pub covariance: [[Option<f64>; 6]; 6],
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Held {
    pub parameters: Vec<String>,
    pub because: String,
}

impl GroupRecord {
    /// The group, and its rows where it has several placements.
    pub fn name(&self) -> String {
        let rows = self.rows.as_ref().map(|[first, last]| format!(", rows {first} to {last}"));
        format!("{}{}", self.group, rows.unwrap_or_default())
    }
}

impl TransformRecord {
    fn new(of: &Uncertain, turn_found: bool, shift_found: bool) -> TransformRecord {
        let known = |k: usize| if k < 3 { turn_found } else { shift_found };
        let entry = |r: usize, c: usize| (known(r) && known(c)).then(|| of.covariance[(r, c)]);
        let rotation = rotation_matrix(&of.transform);
        TransformRecord {
            rotation: turn_found.then(|| std::array::from_fn(|r| std::array::from_fn(|c| rotation[(r, c)]))),
            translation_mm: of.transform.translation.vector.into(),
            covariance: std::array::from_fn(|r| std::array::from_fn(|c| entry(r, c))),
        }
    }

    /// The transform; `None` without a rotation.
    pub fn transform(&self) -> Option<Transform> {
        let rotation = self.rotation?;
        let rotation = Matrix3::from_fn(|r, c| rotation[r][c]);
        Some(crate::geometry::transform_from_matrix(rotation, Vector3::from(self.translation_mm)))
    }

    /// The shift, mm, and the turn, deg, three numbers each; `None` without a rotation.
    pub fn words(&self) -> (String, Option<String>) {
        let three = |v: [f64; 3], digits: usize| v.map(|x| format!("{x:.digits$}")).join(", ");
        let turn = self.transform().map(|t| three(rotation_vector(&t).map(f64::to_degrees).into(), 4));
        (three(self.translation_mm, 3), turn)
    }

    /// Standard deviations of the turn, rad, and of the shift, mm, each as the root of the mean square of its three;
    /// `None` for what was not found.
    pub fn sigmas(&self) -> [Option<f64>; 2] {
        [0, 3].map(|first| {
            let variances = (first..first + 3).map(|k| self.covariance[k][k]).collect::<Option<Vec<f64>>>()?;
            Some((variances.iter().sum::<f64>() / 3.0).sqrt())
        })
    }
}

impl PlacementFile {
    /// Of what was placed; `held_out` are errors of rows that took no part in it.
    pub fn new(robot: &str, set: &Dataset, placed: Option<&Placed>, held_out: &[RowError]) -> PlacementFile {
        let group = |placed: &Placed, index: usize| {
            let group = placed.groups[index].0;
            let (name, rows) = (&set.groups[group].name, set.rows(|pose| pose.group == group));
            let ends =
                [rows.first(), rows.last()].map(|row| row.map_or_else(String::new, |&r| set.poses[r].name.clone()));
            let is_cut = set.groups.iter().filter(|other| other.name == *name).count() > 1;
            let of_group = held_out.iter().filter(|e| set.poses[e.row].group == group);
            let sensor = placed.sensor_from_base(index).inverse().after(&placed.robot.ends.root_from_frame0);
            let record = GroupRecord {
                group: name.clone(),
                rows: is_cut.then_some(ends),
                base_from_rig: TransformRecord::new(&sensor, true, true),
                error_mm: placed.expected(set, index),
                held_out: Spread::new(of_group.filter_map(|e| e.point_mm.map(|p| p.norm()))),
            };
            (rows.first().copied(), record)
        };
        let groups = |placed: &Placed| {
            let mut groups: Vec<_> = (0..placed.groups.len()).map(|index| group(placed, index)).collect();
            groups.sort_by_key(|(row, _)| *row);
            groups.into_iter().map(|(_, record)| record).collect()
        };
        let target = |placed: &Placed| {
            let target = placed.target().after(&placed.robot.ends.last_frame_from_flange.inverse());
            TransformRecord::new(&target, placed.oriented, placed.target_found)
        };
        PlacementFile {
            robot: robot.to_owned(),
            check: None,
            by_instrument: !set.is_of_cameras(),
            mirrored: set.mirrored,
            groups: placed.map_or_else(Vec::new, groups),
            flange_from_target: placed.map(target),
            covariance_order: ["rx", "ry", "rz", "tx", "ty", "tz"].map(str::to_owned),
            poses: region(set),
            held: placed.map_or_else(Vec::new, held),
        }
    }

    /// Where a group's sensor stood, of several places the last, as the chain has it; `None` of a group that is not
    /// there.
    pub fn sensor_from_base(&self, group: &str, root_from_frame0: &Transform) -> Option<Uncertain> {
        let record = &self.groups.iter().rfind(|g| g.group == group)?.base_from_rig;
        let entries: Option<Vec<f64>> = record.covariance.iter().flatten().copied().collect();
        let root_from_rig =
            Uncertain { transform: record.transform()?, covariance: Matrix6::from_row_slice(&entries?) };
        Some(root_from_rig.after(&root_from_frame0.inverse()).inverse())
    }

    pub fn read(path: &Utf8Path) -> Result<PlacementFile> {
        let hint = "`stereocal identify` and `stereocal locate` write it";
        let file: PlacementFile = files::read_json(path, "placement", Some(hint))?;
        let all = file.groups.iter().map(|group| &group.base_from_rig).chain(&file.flange_from_target);
        for record in all {
            let Some(rotation) = record.rotation else { continue };
            checked::rotation("a rotation", Matrix3::from_fn(|r, c| rotation[r][c]))
                .map_err(|message| files::Error::format(path, None, message, Some(hint)))?;
        }
        Ok(file)
    }
}

/// What stands as the robot's file has it.
fn held(placed: &Placed) -> Vec<Held> {
    let robot = &placed.robot;
    let joints = robot.joints.len();
    let held = robot.mdh_parameters().into_iter().filter(|p| is_held(*p, joints));
    let (of_base, of_flange): (Vec<Parameter>, Vec<Parameter>) = held.partition(|p| is_held(*p, usize::MAX));
    let record = |list: Vec<Parameter>, because: &str| Held {
        parameters: list.into_iter().map(Parameter::name).collect(),
        because: because.to_owned(),
    };
    vec![
        record(of_base, "they move the whole robot, as the placement does"),
        record(of_flange, "they move the target on the flange, as its own place does"),
    ]
}
