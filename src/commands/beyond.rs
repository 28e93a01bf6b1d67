//! Rows and targets outside the ranges of the joints that a robot was identified in.

use camino::Utf8Path;

use crate::diagnostic::count;
use crate::formats::robots::known;
use crate::identify::data::dataset::Dataset;
use crate::robot::{Joint, Robot};

/// Share of a joint's range that rows may be outside of it, as new poses drawn like the old ones are.
const USUAL: f64 = 0.1;

/// One row in so many is outside of it, where rows are drawn otherwise.
const MANY: usize = 10;

/// That rows are where terms beyond the chain of links were not identified: links hold everywhere, what follows an
/// angle does where it was seen.
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
        let of_joints = robot.joints.iter().zip(&ranges).zip(&set.poses[*row].joints_rad);
        of_joints.into_iter().any(|((joint, range), q)| off(joint, *range, *q).is_some())
    };
    Outside { joints, rows: rows.iter().copied().filter(is_outside).collect() }
}

/// By how much a joint's reading may be outside of its range, as new ones are that are drawn like the old ones; a joint
/// that stood still comes back to half a degree (half a mm).
fn usual(joint: &Joint, (low, high): (f64, f64)) -> f64 {
    let same = if joint.slides { 0.5 } else { 0.5f64.to_radians() };
    same.max(USUAL * (high - low))
}

/// By how much a joint's reading is outside of its range, where that is more.
fn off(joint: &Joint, (low, high): (f64, f64), q: f64) -> Option<f64> {
    Some((low - q).max(q - high)).filter(|off| *off > usual(joint, (low, high)))
}

/// Ranges of the joints outside of which a robot was not identified, rad (mm); `None` where nothing says what these
/// were.
pub(super) fn identified_over(file: &Utf8Path, robot: &Robot) -> Option<Vec<(f64, f64)>> {
    let widened = |(joint, (low, high)): (&Joint, (f64, f64))| {
        let usual = usual(joint, (low, high));
        (low - usual, high + usual)
    };
    Some(robot.joints.iter().zip(known::identified_over(file, robot)?).map(widened).collect())
}

/// The joints, from 0, outside of whose ranges many of these readings, rad (mm), are, and what is said of them; a
/// `noun` is what has readings.
fn joints_outside(ranges: &[(f64, f64)], robot: &Robot, readings: &[&[f64]], noun: &str) -> Vec<(usize, String)> {
    let of_joint = |joint: usize| {
        let outside: Vec<f64> =
            readings.iter().filter_map(|q| off(&robot.joints[joint], ranges[joint], q[joint])).collect();
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

/// That targets are where a robot was not identified, and whether one of its joints but the first is farther outside of
/// its range than the range is wide. What was found over a range says of places so far beyond it what a short line says
/// of a far point; the first joint turns the whole arm, with what its links are off by, unless terms go by its own
/// angle.
pub(super) fn targets(file: &Utf8Path, robot: &Robot, readings: &[&[f64]]) -> Option<(String, bool)> {
    let ranges = known::identified_over(file, robot)?;
    let joints = joints_outside(&ranges, robot, readings, "target");
    let is_far = |&(joint, _): &(usize, String)| {
        let (low, high) = ranges[joint];
        let is_far = |q: &&[f64]| off(&robot.joints[joint], (low, high), q[joint]).is_some_and(|off| off > high - low);
        (joint > 0 || robot.corrections.follow(joint)) && readings.iter().any(is_far)
    };
    let far = joints.iter().any(is_far);
    let said: Vec<String> = joints.into_iter().map(|(_, said)| said).collect();
    let what = if far { "nothing says how far off it is there" } else { "it may be farther off there than was stated" };
    (!said.is_empty()).then(|| {
        let all = count(readings.len(), "target");
        let joints = said.join(", ");
        (
            format!(
                "of {all} some stand where the robot was not identified, and {what}: {joints}; identify it with poses around the targets"
            ),
            far,
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joint_that_stood_still_comes_back_to_half_a_degree() {
        let turning = Joint::default();
        let sliding = Joint { slides: true, ..turning };
        let deg = 1f64.to_radians();
        assert_eq!(off(&turning, (0.2, 0.2), 0.2 + 0.3 * deg), None);
        assert!(off(&turning, (0.2, 0.2), 0.2 - 0.7 * deg).is_some_and(|by| (by - 0.7 * deg).abs() < 1e-12));
        assert_eq!((off(&sliding, (3.0, 3.0), 3.4), off(&sliding, (3.0, 3.0), 4.0)), (None, Some(1.0)));
        // A tenth of a wide range.
        assert_eq!((off(&turning, (-1.0, 1.0), 1.15), off(&turning, (-1.0, 1.0), 0.3)), (None, None));
        assert!(off(&turning, (-1.0, 1.0), 1.3).is_some());
    }
}
