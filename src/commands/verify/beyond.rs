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
    let ranges = known::identified_over(file, robot)?;
    let of_joint = |(joint, &(low, high)): (usize, &(f64, f64))| {
        let usual = USUAL * (high - low);
        let off = |row: &usize| {
            let q = set.poses[*row].joints_rad[joint];
            (low - q).max(q - high)
        };
        let outside: Vec<f64> = rows.iter().map(off).filter(|off| *off > usual).collect();
        let most = outside.iter().copied().fold(0.0, f64::max);
        let (unit, name) = if robot.joints[joint].slides { (1.0, "mm") } else { (1f64.to_degrees(), "deg") };
        (outside.len() * MANY >= rows.len() && most > 0.0).then(|| {
            let (low, high) = (low * unit, high * unit);
            format!(
                "joint {} in {} by up to {:.0} {name} ({low:.0}..{high:.0})",
                joint + 1,
                count(outside.len(), "row"),
                most * unit
            )
        })
    };
    let joints: Vec<String> = ranges.iter().enumerate().filter_map(of_joint).collect();
    (!joints.is_empty()).then(|| {
        format!(
            "{file} has terms beyond its links that hold where it was identified, and of these {} are outside: {}; there `identify --extensions none` \
             may be nearer",
            count(rows.len(), "row"),
            joints.join(", ")
        )
    })
}
