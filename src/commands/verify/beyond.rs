//! Rows outside the ranges of the joints that a robot was identified in.

use camino::Utf8Path;

use crate::diagnostic::count;
use crate::formats::robots::known;
use crate::identify::data::dataset::Dataset;
use crate::robot::Robot;

/// Share of a joint's range that rows may be outside of it, as new poses drawn like the old ones are.
const USUAL: f64 = 0.1;

/// One row in so many is outside of it, where rows are drawn otherwise.
const MANY: usize = 10;

/// That rows are where terms beyond the chain of links were not identified: links hold everywhere, what follows an angle does where it was seen.
pub(super) fn ranges(file: &Utf8Path, robot: &Robot, set: &Dataset, rows: &[usize]) -> Option<String> {
    if robot.corrections.is_empty() {
        return None;
    }
    let outside = outside(file, robot, set, rows).joints.into_iter();
    let joints: Vec<String> = outside.map(|(_, said)| said).collect();
    (!joints.is_empty()).then(|| {
        format!(
            "{file} has terms beyond its links that hold where it was identified, and of these {} are outside: {}; there `identify --extensions none` \
             may be nearer",
            count(rows.len(), "row"),
            joints.join(", ")
        )
    })
}

/// Rows outside of the joints' ranges.
pub(super) struct Outside {
    /// The joints, from 0, outside of whose ranges many are, and what is said of them.
    pub(super) joints: Vec<(usize, String)>,
    /// The rows that are in any joint.
    pub(super) rows: Vec<usize>,
}

/// Of these rows those outside of the ranges that a robot was identified in; none where nothing says what these were.
pub(super) fn outside(file: &Utf8Path, robot: &Robot, set: &Dataset, rows: &[usize]) -> Outside {
    let ranges = known::identified_over(file, robot).unwrap_or_default();
    let off = |joint: usize, row: usize| {
        let ((low, high), q) = (ranges[joint], set.poses[row].joints_rad[joint]);
        Some((low - q).max(q - high)).filter(|off| *off > USUAL * (high - low))
    };
    let of_joint = |joint: usize| {
        let outside: Vec<f64> = rows.iter().filter_map(|&row| off(joint, row)).collect();
        let most = outside.iter().copied().fold(0.0, f64::max);
        let (unit, name) = if robot.joints[joint].slides { (1.0, "mm") } else { (1f64.to_degrees(), "deg") };
        (outside.len() * MANY >= rows.len() && most > 0.0).then(|| {
            let (low, high) = (ranges[joint].0 * unit, ranges[joint].1 * unit);
            let rows = count(outside.len(), "row");
            (joint, format!("joint {} in {rows} by up to {:.0} {name} ({low:.0}..{high:.0})", joint + 1, most * unit))
        })
    };
    let is_outside = |row: &usize| (0..ranges.len()).any(|joint| off(joint, *row).is_some());
    let joints = (0..ranges.len()).filter_map(of_joint).collect();
    Outside { joints, rows: rows.iter().copied().filter(is_outside).collect() }
}
