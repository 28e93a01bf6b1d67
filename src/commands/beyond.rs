//! Rows and targets outside the ranges of the joints that a robot was identified in.

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
    let readings: Vec<&[f64]> = rows.iter().map(|&row| set.poses[row].joints_rad.as_slice()).collect();
    let joints = joints_outside(&ranges, robot, &readings, "row");
    let is_outside = |row: &usize| {
        let of_joints = ranges.iter().zip(&set.poses[*row].joints_rad);
        of_joints.into_iter().any(|(range, q)| off(*range, *q).is_some())
    };
    Outside { joints, rows: rows.iter().copied().filter(is_outside).collect() }
}

/// By how much a reading is outside of a range by more than new ones are that are drawn like the old ones.
fn off((low, high): (f64, f64), q: f64) -> Option<f64> {
    Some((low - q).max(q - high)).filter(|off| *off > USUAL * (high - low))
}

/// The joints, from 0, outside of whose ranges many of these readings, rad (mm), are, and what is said of them; a `noun` is what has readings.
fn joints_outside(ranges: &[(f64, f64)], robot: &Robot, readings: &[&[f64]], noun: &str) -> Vec<(usize, String)> {
    let of_joint = |joint: usize| {
        let outside: Vec<f64> = readings.iter().filter_map(|q| off(ranges[joint], q[joint])).collect();
        let most = outside.iter().copied().fold(0.0, f64::max);
        let (unit, name) = if robot.joints[joint].slides { (1.0, "mm") } else { (1f64.to_degrees(), "deg") };
        (outside.len() * MANY >= readings.len() && most > 0.0).then(|| {
            let (low, high) = (ranges[joint].0 * unit, ranges[joint].1 * unit);
            let rows = count(outside.len(), noun);
            (joint, format!("joint {} in {rows} by up to {:.0} {name} ({low:.0}..{high:.0})", joint + 1, most * unit))
        })
    };
    (0..ranges.len()).filter_map(of_joint).collect()
}

/// That targets are where a robot was not identified, and whether one of its joints but the first is farther outside of its range than the range is
/// wide. What was found over a range says of places so far beyond it what a short line says of a far point; the first joint turns the whole arm, and
/// its own range tells nothing of the others' links.
pub(super) fn targets(file: &Utf8Path, robot: &Robot, readings: &[&[f64]]) -> Option<(String, bool)> {
    let ranges = known::identified_over(file, robot)?;
    let joints = joints_outside(&ranges, robot, readings, "target");
    let is_far = |&(joint, _): &(usize, String)| {
        let (low, high) = ranges[joint];
        joint > 0 && readings.iter().any(|q| off((low, high), q[joint]).is_some_and(|off| off > high - low))
    };
    let far = joints.iter().any(is_far);
    let said: Vec<String> = joints.into_iter().map(|(_, said)| said).collect();
    let what = if far { "nothing says how far off it is there" } else { "it may be farther off there than was stated" };
    (!said.is_empty()).then(|| {
        let all = count(readings.len(), "target");
        let joints = said.join(", ");
        (
            format!(
                "of {all} many stand where the robot was not identified, and {what}: {joints}; identify it with poses around the targets"
            ),
            far,
        )
    })
}
