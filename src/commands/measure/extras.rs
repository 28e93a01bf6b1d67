//! What the page of `measure` shows beside the results: small pictures of what went wrong, and distances as the robot
//! was sent.

use camino::Utf8Path;
use rayon::prelude::*;

use super::super::Result;
use crate::identify::data::dataset::Dataset;
use crate::identify::examine::shifted::{self, Shift};
use crate::imaging::input::pairs::PairFiles;
use crate::imaging::{Corners, PairCorners, Wanted, find, overlay};
use crate::measurements::{Measurement, Observed, Role};
use crate::report::drawing::picture::PairJpeg;
use crate::report::measure::Thumbnail;
use crate::robot::{self, Robot};
use crate::stereo::board_pose::{MeasuredPose, Series};

/// Failures that are shown at most, and poses that fit worst.
const FAILURES: usize = 12;
const WORST: usize = 3;

/// Width of a small picture, both sides together, px.
const WIDTH: u32 = 720;

/// The robot that was sent, where none is named.
const ROBOT: &str = "robot.toml";

/// Small pictures of the poses without a measurement and of those that fit worst. `files` are the pictures, `wanted` is
/// what was looked for in them.
pub(super) fn thumbnails(
    series: &Series,
    corners: &Corners,
    files: &[PairFiles],
    wanted: &Wanted<'_>,
) -> Vec<Thumbnail> {
    let has_pictures = |m: &&MeasuredPose| files.iter().any(|f| f.pair == m.at.pose);
    let failures = series.poses.iter().filter(has_pictures);
    let failures = failures.filter_map(|m| Some((m, m.target.as_ref().err()?.reason.clone())));
    let mut chosen: Vec<(&MeasuredPose, String)> = failures.take(FAILURES).collect();
    let mut measured: Vec<(f64, &MeasuredPose)> =
        series.poses.iter().filter_map(|m| Some((m.target.as_ref().ok()?.chi_square, m))).collect();
    measured.sort_by(|a, b| b.0.total_cmp(&a.0));
    let worst = measured.into_iter().take(WORST);
    chosen.extend(
        worst.map(|(chi, m)| (m, format!("measured; its squared residuals are {chi:.2} times what is expected"))),
    );
    let draw = |(m, caption): &(&MeasuredPose, String)| {
        let found = files.iter().find(|f| f.pair == m.at.pose);
        let none = PairCorners { pair: m.at.pose.clone(), ..PairCorners::default() };
        let pair = corners.pairs.iter().find(|p| p.pair == m.at.pose).unwrap_or(&none);
        let both = found.and_then(|files| {
            let (left, right) =
                rayon::join(|| find::thumbnail(&files.left, wanted), || find::thumbnail(&files.right, wanted));
            Some(overlay::drawn_small([&left?, &right?], pair, WIDTH))
        });
        let jpeg_base64 = both.and_then(|both| PairJpeg::new(both, WIDTH)).map_or_else(String::new, |jpeg| jpeg.base64);
        Thumbnail { pose: m.at.pose.clone(), caption: caption.clone(), jpeg_base64 }
    };
    chosen.par_iter().map(draw).collect()
}

fn sent() -> Result<Robot> {
    let file = Utf8Path::new(ROBOT);
    Ok(if file.is_file() { robot::file::read(file)? } else { Robot::paper() })
}

/// Where pictures and joint angles do not belong together, by the robot that was sent.
pub(super) fn shifted(series: &Series) -> Result<Option<String>> {
    let robot = sent()?;
    let measured = |m: &MeasuredPose| {
        let target = m.target.as_ref().ok()?;
        let point_mm = target.cam_from_board.translation.vector.into();
        let observed = Observed::Position { point_mm, covariance_mm2: None, rotation_rad: None };
        Some(Measurement { at: m.at.clone(), target: String::new(), observed })
    };
    let rows: Vec<Measurement> = series.poses.iter().filter_map(measured).collect();
    let Ok(set) = Dataset::new(&rows) else { return Ok(None) };
    if rows.iter().any(|row| row.at.joints_deg.len() != robot.joints.len()) {
        return Ok(None);
    }
    let said = |(set, shift): (&Dataset, Shift)| {
        format!(
            "{}; look for a picture that failed or was taken twice there, and mend poses.csv or the pictures' names",
            shift.statement(set)
        )
    };
    Ok(shifted::found(&set, &robot).map(said))
}

/// Distances to each group's centre as commanded and what was measured beyond them, mm, where a robot of so many joints
/// is known.
pub(super) fn distances(series: &Series) -> Result<Vec<(f64, f64)>> {
    let robot = sent()?;
    if series.poses.iter().any(|m| m.at.joints_deg.len() != robot.joints.len()) {
        return Ok(Vec::new());
    }
    let of = |m: &MeasuredPose| {
        let same_group = |c: &&MeasuredPose| c.at.group == m.at.group && c.at.role == Role::Center;
        let center = series.poses.iter().find(same_group)?;
        let at = |m: &MeasuredPose| m.target.as_ref().ok().map(|t| t.cam_from_board.translation.vector);
        let measured_mm = (at(m)? - at(center)?).norm();
        let commanded_mm = (robot.target_mm(&m.at.joints_rad()) - robot.target_mm(&center.at.joints_rad())).norm();
        (m.at.role != Role::Center).then_some((commanded_mm, measured_mm - commanded_mm))
    };
    Ok(series.poses.iter().filter_map(of).collect())
}
