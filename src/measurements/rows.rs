//! `poses.csv` and `measurements.csv`: where the robot was sent, and what was measured there.

use std::fmt::Write as _;

use camino::Utf8Path;
use nalgebra::{Matrix3, Point3, Vector3};

use super::{readings, summaries};
use crate::csv_table::{Table, quoted};
use crate::files::Result;

/// What a pose is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The centre of its group's sphere; one a group at the most.
    Center,
    /// Used to identify.
    Sample,
    /// Held out to verify.
    Verify,
}

impl Role {
    /// The word in the files.
    pub fn name(self) -> &'static str {
        match self {
            Role::Center => "center",
            Role::Sample => "sample",
            Role::Verify => "verify",
        }
    }
}

/// A pose the robot was sent to.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotPose {
    /// Its name: the stem of its pictures.
    pub pose: String,
    /// One placement of the camera and one sphere.
    pub group: String,
    /// What it is for.
    pub role: Role,
    /// Commanded joint angles as the file has them, deg (mm of joints that slide).
    pub joints_deg: Vec<f64>,
    /// Which joints slide (columns `jN_mm`), one a joint; empty where none does.
    pub slides: Vec<bool>,
}

impl RobotPose {
    /// Commanded joint angles, rad (mm of joints that slide).
    pub fn joints_rad(&self) -> Vec<f64> {
        let slides = |i: usize| self.slides.get(i).copied().unwrap_or(false);
        self.joints_deg.iter().enumerate().map(|(i, &v)| if slides(i) { v } else { v.to_radians() }).collect()
    }
}

/// What was measured at a pose.
#[derive(Debug, Clone, PartialEq)]
pub enum Observed {
    /// The mark point in the group's own frame (the left camera's, a tracker's).
    Position {
        /// The point, mm.
        point_mm: Point3<f64>,
        /// Its covariance, mm^2, where known.
        covariance_mm2: Option<Matrix3<f64>>,
        /// Rotation vector of the target in that frame, rad, where known.
        rotation_rad: Option<Vector3<f64>>,
    },
    /// The distance to the group's centre pose, or to a fixed point that is unknown.
    Distance {
        /// The distance, mm.
        distance_mm: f64,
        /// Its standard deviation, mm, where known.
        sigma_mm: Option<f64>,
    },
    /// Nothing, and why.
    Missing {
        /// The row's `status`.
        reason: String,
    },
}

impl Observed {
    /// The numbers that were read, mm.
    pub(super) fn read(&self) -> Option<Vec<f64>> {
        match self {
            Observed::Position { point_mm, .. } => Some(point_mm.iter().copied().collect()),
            Observed::Distance { distance_mm, .. } => Some(vec![*distance_mm]),
            Observed::Missing { .. } => None,
        }
    }
}

/// A row of `measurements.csv`.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// Where the robot was.
    pub at: RobotPose,
    /// Which of several targets was measured; empty where the file names none.
    pub target: String,
    /// What was seen.
    pub observed: Observed,
}

/// No instrument measures farther, mm: a thousand kilometres. Squares of such lengths are still numbers.
const FARTHEST_MM: f64 = 1e9;

impl Measurement {
    /// The same, without a reading that is none.
    #[must_use]
    pub fn of_this_world(mut self) -> Measurement {
        let farthest_mm = match &self.observed {
            Observed::Position { point_mm, .. } => point_mm.coords.amax(),
            Observed::Distance { distance_mm, .. } => distance_mm.abs(),
            Observed::Missing { .. } => return self,
        };
        if farthest_mm > FARTHEST_MM {
            self.observed =
                Observed::Missing { reason: format!("{farthest_mm:e} mm, farther than anything is measured") };
        }
        self
    }
}

impl Table<'_> {
    /// The columns `j1_deg`, `j2_deg`, ... without a gap, and which of them are `jN_mm`; no list where none is.
    pub fn joint_columns(&self) -> Result<(Vec<usize>, Vec<bool>)> {
        let column = |i: usize| {
            let turning = self.column(&format!("j{i}_deg")).map(|c| (c, false));
            turning.or_else(|| self.column(&format!("j{i}_mm")).map(|c| (c, true)))
        };
        let (columns, slides): (Vec<usize>, Vec<bool>) = (1..).map_while(column).unzip();
        let beyond = |name: &String| {
            let number = name.strip_prefix('j').and_then(|r| r.strip_suffix("_deg").or_else(|| r.strip_suffix("_mm")));
            number.and_then(|n| n.parse::<usize>().ok()).is_some_and(|n| n > columns.len())
        };
        if columns.is_empty() || self.header.iter().any(beyond) {
            let message = format!("no column `j{}_deg`; the header has: {}", columns.len() + 1, self.header_in_short());
            let hint = "one column a joint, j1_deg, j2_deg, ... without a gap, in deg (j3_mm for a joint that slides)";
            return Err(self.refuse_with(1, message, Some(hint)));
        }
        Ok((columns, if slides.contains(&true) { slides } else { Vec::new() }))
    }

    /// The robot's poses, one a row. With a column `target`, rows of several targets may be of one pose.
    pub(super) fn poses(&self, target: Option<usize>) -> Result<Vec<RobotPose>> {
        let (pose, role) = (self.column("pose"), self.column("role"));
        let group = self.group_column()?;
        let numbers: Vec<String> =
            (1..=if pose.is_none() { self.rows.len() } else { 0 }).map(|n| n.to_string()).collect();
        let (joints, slides) = self.joint_columns()?;
        let mut seen = std::collections::BTreeMap::new();
        let mut centers = std::collections::BTreeMap::new();
        let mut first_rows = std::collections::BTreeMap::new();
        let mut poses: Vec<RobotPose> = Vec::with_capacity(self.rows.len());
        for (i, (line, row)) in self.rows.iter().enumerate() {
            let line = *line;
            let pose = pose.map_or_else(|| numbers[i].as_str(), |c| &row[c]);
            let group = group.map_or("1", |c| &row[c]);
            let role = match role.map_or("sample", |c| &row[c]).to_lowercase().as_str() {
                "center" | "centre" => Role::Center,
                "sample" => Role::Sample,
                "verify" => Role::Verify,
                other => {
                    return Err(self.refuse(line, format!("role is `{other}`; it is one of center, sample, verify")));
                }
            };
            if pose.is_empty() {
                return Err(self.refuse(line, "the pose has no name".to_owned()));
            }
            let of_target = target.map_or("", |c| &row[c]);
            if target.is_some() && of_target.is_empty() {
                return Err(self.refuse(line, format!("the target of pose `{pose}` has no name")));
            }
            if let Some(first) = seen.insert((pose, of_target), line) {
                let what = if target.is_some() { format!(" with target `{of_target}`") } else { String::new() };
                let message = format!("pose `{pose}`{what} stands in line {first} already");
                return Err(self.refuse_with(line, message, Some(readings::ONE_NAME)));
            }
            if role == Role::Center
                && let Some((first, center)) = centers.insert(group, (line, pose))
                && center != pose
            {
                let message = format!("group `{group}` has a center in line {first} already; a group has one");
                return Err(self.refuse(line, message));
            }
            let joints_deg = joints.iter().map(|&c| self.number(line, row, c)).collect::<Result<Vec<f64>>>()?;
            let read =
                RobotPose { pose: pose.to_owned(), group: group.to_owned(), role, joints_deg, slides: slides.clone() };
            let first: usize = *first_rows.entry(pose).or_insert(poses.len());
            if let Some(before) = poses.get(first).filter(|before| **before != read) {
                let message = format!(
                    "pose `{}` stands in line {} with another group, role or joints; its targets are measured at one pose",
                    before.pose, self.rows[first].0
                );
                return Err(self.refuse(line, message));
            }
            poses.push(read);
        }
        Ok(poses)
    }
}

/// Reads `poses.csv`.
pub fn read_poses(path: &Utf8Path) -> Result<Vec<RobotPose>> {
    let hint = "a poses folder holds left/, right/ and poses.csv with the columns pose,group,role,j1_deg,...: \
                `stereocal init` writes one to start from";
    let table = Table::read(path, "list of poses", hint)?;
    // A pose of `measure` is the stem of its pictures; its number would not do.
    table.require("pose")?;
    table.poses(None)
}

/// Reads `measurements.csv`, or any table with `j1_deg..` and either `x_mm,y_mm,z_mm` or `distance_mm`; `pose` is the
/// row's number, `group` one and `role` sample where they are absent. A row whose `status` is not `ok`, or whose
/// numbers are all empty, is [`Observed::Missing`]. With a column `target` a pose has a row for each of its targets.
/// Readings repeated under one name have it with their number behind it.
pub fn read(path: &Utf8Path) -> Result<Vec<Measurement>> {
    read_whole(path).map(|(rows, _)| rows)
}

/// The same with sentences on rows below the table, such as a mean.
pub(super) fn read_whole(path: &Utf8Path) -> Result<(Vec<Measurement>, Vec<String>)> {
    let hint = "`stereocal measure POSES` writes out/measurements.csv; `--measurements FILE` names another";
    let mut table = Table::read(path, "measurements file", hint)?;
    let below = [table.without_rows_below()?, summaries::taken_away(path, &mut table.rows)?];
    Ok((from_table(table)?, below.into_iter().flatten().collect()))
}

/// Measurements from a table.
pub(super) fn from_table(mut table: Table) -> Result<Vec<Measurement>> {
    readings::named_apart(&mut table)?;
    let named = |c: &usize| table.rows.iter().any(|(_, row)| !row[*c].is_empty());
    let target = table.column("target").filter(named);
    let poses = table.poses(target)?;
    let status = table.column("status");
    let all = |names: &[&str]| names.iter().map(|n| table.column(n)).collect::<Option<Vec<usize>>>();
    let position = all(&["x_mm", "y_mm", "z_mm"]);
    let distance = table.column("distance_mm");
    let covariance = all(&["sxx_mm2", "sxy_mm2", "sxz_mm2", "syy_mm2", "syz_mm2", "szz_mm2"]);
    let rotation = all(&["rx_rad", "ry_rad", "rz_rad"]);
    let sigma = table.column("sigma_mm");
    if position.is_none() && distance.is_none() {
        let message =
            format!("neither the columns x_mm,y_mm,z_mm nor distance_mm; the header has: {}", table.header_in_short());
        let hint = "a point's columns are x_mm,y_mm,z_mm, a distance's is distance_mm, all in mm";
        return Err(table.refuse_with(1, message, Some(hint)));
    }
    let mut rows = Vec::with_capacity(poses.len());
    for (at, (line, row)) in poses.into_iter().zip(&table.rows) {
        let line = *line;
        let numbers =
            |columns: &[usize]| columns.iter().map(|&c| table.number(line, row, c)).collect::<Result<Vec<_>>>();
        let filled = |columns: &&Vec<usize>| !columns.iter().all(|&c| row[c].is_empty());
        let optional =
            |columns: &Option<Vec<usize>>| columns.as_ref().filter(filled).map(|columns| numbers(columns)).transpose();
        let said = status.map_or("ok", |c| &row[c]);
        let observed = if !(said.is_empty() || said == "ok") {
            Observed::Missing { reason: said.to_owned() }
        } else if let Some(p) = optional(&position)? {
            let covariance_mm2 =
                optional(&covariance)?.map(|s| Matrix3::new(s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5]));
            if let Some(s) = &covariance_mm2
                && !is_covariance(s)
            {
                let message = "the covariance sxx..szz is none: it has a negative eigenvalue";
                return Err(table.refuse(line, message.to_owned()));
            }
            let rotation_rad = optional(&rotation)?.map(|r| Vector3::new(r[0], r[1], r[2]));
            Observed::Position { point_mm: Point3::new(p[0], p[1], p[2]), covariance_mm2, rotation_rad }
        } else if let Some(d) = optional(&distance.map(|c| vec![c]))? {
            let sigma_mm = optional(&sigma.map(|c| vec![c]))?.map(|s| s[0]);
            if d[0] < 0.0 || sigma_mm.is_some_and(|s| s <= 0.0) {
                return Err(table.refuse(line, "a distance is not negative, and its sigma_mm is positive".to_owned()));
            }
            Observed::Distance { distance_mm: d[0], sigma_mm }
        } else {
            Observed::Missing { reason: "no numbers".to_owned() }
        };
        rows.push(Measurement { at, target: target.map_or_else(String::new, |c| row[c].to_owned()), observed });
    }
    Ok(rows)
}

/// No eigenvalue is negative beyond what rounding the entries to five digits leaves; zeros are an instrument's
/// resolution.
fn is_covariance(matrix: &Matrix3<f64>) -> bool {
    let eigen = matrix.symmetric_eigenvalues();
    eigen.min() >= -1e-4 * eigen.max() && eigen.max() >= 0.0
}

/// Name of a joint's column of readings, counted from 0: `j1_deg`, or `j1_mm` where it slides.
pub fn reading_name(joint: usize, slides: bool) -> String {
    format!("j{}_{}", joint + 1, if slides { "mm" } else { "deg" })
}

/// The header's first columns where the first row is this pose: `pose,group,role,j1_deg,...`.
pub fn pose_header(first: Option<&RobotPose>) -> String {
    let mut text = String::from("pose,group,role");
    for joint in 0..first.map_or(0, |pose| pose.joints_deg.len()) {
        let slides = first.is_some_and(|pose| pose.slides.get(joint) == Some(&true));
        let _ = write!(text, ",{}", reading_name(joint, slides));
    }
    text
}

/// Poses as a list that [`read_poses`] reads.
pub fn poses_csv<'a>(poses: impl Iterator<Item = &'a RobotPose>) -> String {
    let mut poses = poses.peekable();
    let mut text = format!("{}\n", pose_header(poses.peek().copied()));
    poses.for_each(|pose| text.push_str(&format!("{}\n", pose_fields(pose))));
    text
}

/// A row's first columns. Names with a comma or a quote in them are quoted.
pub fn pose_fields(pose: &RobotPose) -> String {
    let mut text = format!("{},{},{}", quoted(&pose.pose), quoted(&pose.group), pose.role.name());
    for deg in &pose.joints_deg {
        let _ = write!(text, ",{deg}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files;

    fn read_str(text: &str) -> Result<Vec<Measurement>> {
        let (_folder, path) = files::temporary("m.csv", text);
        read(&path)
    }

    #[test]
    fn positions_distances_and_gaps() {
        let rows = read_str(
            "pose,group,role,j1_deg,j2_deg,x_mm,y_mm,z_mm,status\na,1,center,0,10,1,2,3,ok\nb,1,sample,5,6,,,,no board\n",
        )
        .unwrap();
        assert_eq!(rows[0].at.joints_deg, [0.0, 10.0]);
        assert!(matches!(rows[0].observed, Observed::Position { covariance_mm2: None, .. }));
        assert_eq!(rows[1].observed, Observed::Missing { reason: "no board".into() });
        let rows = read_str("pose;group;role;j1_deg;distance_mm;sigma_mm\na;1;sample;0;12.5;0.1\n").unwrap();
        assert_eq!(rows[0].observed, Observed::Distance { distance_mm: 12.5, sigma_mm: Some(0.1) });
    }

    #[test]
    fn poses_read_back_as_they_are_written() {
        let pose = |name: &str, slides: Vec<bool>| RobotPose {
            pose: name.to_owned(),
            group: "1, left".to_owned(),
            role: Role::Sample,
            joints_deg: vec![5.5, -120.0],
            slides,
        };
        for slides in [vec![], vec![false, true]] {
            let poses = [pose("a", slides.clone()), pose("b", slides)];
            let (_folder, path) = files::temporary("poses.csv", poses_csv(poses.iter()));
            assert_eq!(read_poses(&path).unwrap(), poses);
        }
    }

    #[test]
    fn a_pose_has_a_row_for_each_of_its_targets() {
        let header = "pose,group,role,target,j1_deg,x_mm,y_mm,z_mm\n";
        let rows =
            read_str(&format!("{header}a,1,center,l,0,1,2,3\na,1,center,r,0,4,5,6\nb,1,sample,l,1,1,2,3\n")).unwrap();
        assert_eq!(rows.iter().map(|r| r.target.as_str()).collect::<Vec<_>>(), ["l", "r", "l"]);
        for (second, part) in [
            ("a,1,center,l,0,4,5,6", "with target `l` stands in line 2 already"),
            ("a,1,center,r,5,4,5,6", "another group, role or joints"),
            ("b,1,center,r,0,4,5,6", "has a center in line 2 already"),
            ("a,1,center,,0,4,5,6", "has no name"),
        ] {
            let message =
                crate::diagnostic::report(&read_str(&format!("{header}a,1,center,l,0,1,2,3\n{second}\n")).unwrap_err());
            assert!(message.contains(part) && message.contains("m.csv:3"), "{message}");
        }
    }

    #[test]
    fn complaints_name_the_line() {
        for (text, line, part) in [
            ("pose,group,role,j1_deg,x_mm,y_mm,z_mm\na,1,sample,0,1,2,x\n", 2, "`z_mm` is not a number"),
            ("pose,group,role,j1_deg,distance_mm\na,1,sample,0,1\na,1,sample,0,1\n", 3, "in line 2 already"),
            ("pose,group,role,j1_deg,distance_mm\na,1,start,0,1\n", 2, "role is `start`"),
            ("pose,group,role,j1_deg,distance_mm\na,1,center,0,1\nb,1,center,0,1\n", 3, "has a center in line 2"),
            ("pose,group,role,distance_mm\na,1,center,0\n", 1, "no column `j1_deg`"),
            ("pose,group,role,j1_deg,j3_deg,distance_mm\na,1,sample,0,0,0\n", 1, "no column `j2_deg`"),
            ("pose,group,role,j1_deg,distance_mm\na,1,sample,nan,0\n", 2, "`j1_deg` is not a number"),
            ("pose,group,role,j1_deg,distance_mm\na,1,sample,0\n", 2, "4 fields"),
            ("pose,group,role,j1_deg,distance_mm\n", 1, "no rows"),
        ] {
            let message = crate::diagnostic::report(&read_str(text).unwrap_err());
            assert!(message.contains(part) && message.contains(&format!("m.csv:{line}")), "{message}");
        }
    }
}
