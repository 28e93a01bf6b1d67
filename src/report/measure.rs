//! `measure.html` and the table on stdout: where the target was, how well that is known, and whether the rig is the
//! calibrated one.

use std::f64::consts::TAU;

use maud::{Markup, PreEscaped, html};

use super::drawing::figure::Plot;
use super::drawing::scene::{Ink, Scene};
use super::page::{self, Tone};
use super::table::{number, short};
use super::{Result, rig};
use crate::diagnostic::aligned;
use crate::files::OutDir;
use crate::formats::measure::MeasureFile;
use crate::measurements::Role;
use crate::stereo::board_pose::rig_change::judgement::Judgement;
use crate::stereo::board_pose::{Knowledge, MeasuredPose, Series, Shape, TargetPose};

/// Poses in the table of the worst.
const WORST: usize = 10;

/// Standard deviations beyond which a pose's residual is none of chance.
const LIMIT_SIGMAS: f64 = 5.0;

/// A small picture of a pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Thumbnail {
    pub pose: String,
    /// What is to be seen.
    pub caption: String,
    /// A JPEG in base64; empty where there are no pictures, or none that can be read: then the page shows none.
    pub jpeg_base64: String,
}

/// What the page shows beside the results.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Extras {
    /// The worst poses and all failures.
    pub thumbnails: Vec<Thumbnail>,
    /// Distances to the group's centre as the nominal robot was sent, and what was measured beyond them, mm; empty
    /// where no robot of so many joints is known.
    pub distances: Vec<(f64, f64)>,
    /// What is said against the rig.
    pub doubts: Vec<String>,
}

/// The short text on stdout.
pub fn summary(file: &MeasureFile, out: &OutDir) -> String {
    let quality = quality(file, |mm| number(mm, 4));
    let (points, page) = (out.join("measurements.csv"), out.join("measure.html"));
    let MeasureFile { measured, poses, .. } = file;
    format!("{measured} of {poses} poses measured; {quality}\nmeasurements: {points}\nreport: {page}\n")
}

/// How well the boards fit and the points are known; `mm` writes a length.
fn quality(file: &MeasureFile, mm: fn(Option<f64>) -> String) -> String {
    let [x, y, z] = [0, 1, 2].map(|i: usize| mm(file.sigma_mm.map(|s| s[i])));
    let usual = file.calibration_noise_px.map_or(String::new(), |px| format!(" ({px:.4} at the calibration)"));
    format!(
        "residuals of the fitted target {} mm, {} px RMS; corners scatter by {} px{usual}; median sigma of its centre x {x} y {y} z {z} mm",
        mm(file.fit_rms_mm),
        number(file.reprojection_rms_px, 3),
        number(file.corner_noise_px, 4)
    )
}

/// The three numbers of the page: how well the point is known, and how well boards fit.
fn numbers(file: &MeasureFile) -> [(String, &'static str); 3] {
    let worst = file.sigma_mm.map(|sigma| sigma.into_iter().fold(0.0, f64::max));
    [
        (format!("{} mm", short(worst)), "median standard deviation of the mark point, along its least certain axis"),
        (format!("{} mm", short(file.fit_rms_mm)), "what is left of the corners after fitting the target (RMS)"),
        (format!("{} px", number(file.reprojection_rms_px, 3)), "reprojection residual (RMS)"),
    ]
}

/// Green only where every pose was measured and everything agrees with what was known before.
fn tone(series: &Series, file: &MeasureFile, doubts: &[String]) -> Tone {
    match &series.judgement {
        judgement if judgement.ends_the_run() => Tone::Bad,
        _ if !doubts.is_empty() => Tone::Doubtful,
        Judgement::Agrees if file.poses == file.measured && file.chi_square_is_usual => Tone::Good,
        _ => Tone::Doubtful,
    }
}

pub fn page(series: &Series, file: &MeasureFile, known: &Knowledge, extras: &Extras) -> Result<String> {
    let (poses, count) = (file.poses, file.measured);
    let measured = &series.poses;
    let missing = measured.iter().filter_map(|m| Some((m, m.target.as_ref().err()?)));
    let missing: Vec<[String; 3]> =
        missing.map(|(m, refusal)| [m.at.pose.clone(), refusal.status.to_owned(), refusal.reason.clone()]).collect();
    let content = html! {
        (page::verdict(tone(series, file, &extras.doubts), &format!("{count} of {poses} poses measured"), &numbers(file), &format!("{}.", quality(file, short))))
        (page::warnings(&[extras.doubts.as_slice(), &file.warnings].concat()))
        @if !missing.is_empty() {
            h2 { "Poses without a measurement" }
            (page::table(&["pose", "status", "why"], missing))
        }
        (thumbnails(&extras.thumbnails))
        @if count > 0 {
            (rig(measured)?)
            (residuals(measured)?)
            @if let Some(shape) = &series.shape { (target(shape, file.columns)?) }
            (in_space(measured, known))
            (places(measured)?)
            (distances(&extras.distances)?)
        }
    };
    Ok(page::page("Target measurements", &format!("{poses} poses"), &content))
}

/// The rig over the run: what a turn of the right camera against the left would leave in the pictures.
fn rig(measured: &[MeasuredPose]) -> Result<Markup> {
    let of = |figure: fn(&TargetPose) -> [f64; 2]| -> (Vec<(f64, f64, f64)>, f64) {
        let milli = |rad: f64| 1e3 * rad.to_degrees();
        let found = measured.iter().enumerate().filter_map(|(i, m)| Some((i as f64, figure(m.target.as_ref().ok()?))));
        let bars: Vec<(f64, f64, f64)> = found.map(|(i, [at, sigma])| (i, milli(at), milli(sigma))).collect();
        let limit = crate::statistics::median(bars.iter().map(|b| b.2)).unwrap_or(0.0) * LIMIT_SIGMAS;
        (bars, limit)
    };
    let plot = |title: &str, (bars, limit): (Vec<(f64, f64, f64)>, f64)| {
        Plot::new(title, "pose, in the order of the run", "turn of the right camera, mdeg")
            .whole_x()
            .error_bars("", bars)
            .hline(limit, "limit")
            .hline(-limit, "limit")
            .size(520, 340)
            .svg()
    };
    let pitch = plot("Rig: epipolar residual", of(|t| t.pitch_rad))?;
    let yaw = plot("Rig: residual of the target's size", of(|t| t.yaw_rad))?;
    Ok(html! {
        h2 { "The rig during the run" }
        div.side {
            (page::figure(&pitch, "The turn of the right camera about its horizontal axis, by the differences in height at each pose. A step is a rig that was pushed, a slope one that warms up."))
            (page::figure(&yaw, "Its turn about the vertical axis, by the target's known size; epipolar lines do not show it. Steps and slopes as in the other figure; bars are one standard deviation."))
        }
    })
}

fn residuals(measured: &[MeasuredPose]) -> Result<Markup> {
    let of = |figure: fn(&TargetPose) -> f64| {
        measured.iter().enumerate().filter_map(move |(i, m)| Some((i as f64, figure(m.target.as_ref().ok()?))))
    };
    let residual = Plot::new("Residual of every pose", "pose, in the order of the run", "RMS, px")
        .whole_x()
        .points("", of(|t| t.rms_px))
        .size(520, 340)
        .svg()?;
    let sigma = Plot::new("Standard deviation of the mark point", "pose, in the order of the run", "mm")
        .whole_x()
        .points("x", of(|t| t.covariance[(3, 3)].sqrt()))
        .points("y", of(|t| t.covariance[(4, 4)].sqrt()))
        .points("z", of(|t| t.covariance[(5, 5)].sqrt()))
        .size(520, 340)
        .svg()?;
    Ok(html! {
        h2 { "Poses, the worst first" }
        (worst_table(measured))
        div.side {
            (page::figure(&residual, "A pose far above the others was blurred, in motion, or partly hidden."))
            (page::figure(&sigma, "From the corners, the calibration and the target together: most of it comes from the calibration, which all poses share. A pose far above the others stood far from where the boards were."))
        }
    })
}

/// The poses with the largest residuals.
fn worst_table(measured: &[MeasuredPose]) -> Markup {
    let mut found: Vec<_> = measured.iter().filter_map(|m| Some((m, m.target.as_ref().ok()?))).collect();
    found.sort_by(|a, b| b.1.chi_square.total_cmp(&a.1.chi_square));
    found.truncate(WORST);
    let column =
        |of: &dyn Fn(&TargetPose) -> Option<f64>| aligned(&found.iter().map(|(_, t)| of(t)).collect::<Vec<_>>());
    let sigma = |k: usize| column(&|t| Some(t.covariance[(k, k)].sqrt()));
    let lengths = [column(&|t| t.fit_rms_mm), sigma(3), sigma(4), sigma(5)];
    let row = |(k, (m, t)): (usize, &(&MeasuredPose, &TargetPose))| {
        let residuals = [number(Some(t.chi_square), 2), number(Some(t.rms_px), 4)];
        let lengths = lengths.each_ref().map(|column| column[k].clone());
        let names = [m.at.pose.clone(), m.at.group.clone()].into_iter();
        names.chain(residuals).chain(lengths).chain([t.corners, t.outliers].map(|count| count.to_string()))
    };
    let header = [
        "pose",
        "group",
        "chi-square",
        "residual, px",
        "board fit, mm",
        "sigma x, mm",
        "sigma y, mm",
        "sigma z, mm",
        "corners",
        "outliers",
    ];
    page::table(&header, found.iter().enumerate().map(row))
}

/// The target as a map of its crossings' deviations.
fn target(shape: &Shape, columns: usize) -> Result<Markup> {
    let largest = shape.deviations_mm.iter().map(|d| d.norm()).fold(1e-6, f64::max);
    // The largest arrow is as long as a square.
    let magnified = 1.0 / largest;
    let map = |title: &str, of: fn(&nalgebra::Vector3<f64>) -> [f64; 2]| {
        let arrows = shape.deviations_mm.iter().enumerate().map(|(k, d)| {
            let [dx, dy] = of(d).map(|v| v * magnified);
            [(k % columns) as f64, (k / columns) as f64, dx, dy]
        });
        Plot::new(title, "column", "row").vectors("", arrows).equal_axes().y_down().size(460, 400).svg()
    };
    let flat = map("Target: crossings in the plane", |d| [d.x, d.y])?;
    let deep = map("Target: crossings out of the plane", |d| [0.0, d.z])?;
    let said = format!(
        "An arrow as long as a square is {:.2} um. Crossings scatter by {:.2} um a coordinate in the plane and {:.2} um out of it; the \
         target is {:.1} ppm {} than its drawing, known to {:.1} ppm.",
        1e3 * largest,
        1e3 * shape.in_plane_mm,
        1e3 * shape.out_of_plane_mm,
        1e6 * shape.stretch[0].abs(),
        if shape.stretch[0] < 0.0 { "smaller" } else { "larger" },
        1e6 * shape.stretch[1]
    );
    Ok(html! {
        h2 { "The target as it is" }
        div.side { (page::figure(&flat, &said)) (page::figure(&deep, "Down is away from the viewer, at the same scale. A bow shows as arrows that point one way in the middle and the other way at the rim.")) }
    })
}

/// Cameras and targets as they stood to each other.
fn in_space(measured: &[MeasuredPose], known: &Knowledge) -> Markup {
    let mut scene = Scene::default();
    rig::cameras(&mut scene, &known.rig, known.rig.baseline_mm() / 2.0);
    for m in measured {
        if let Ok(target) = &m.target {
            let ink = if m.at.role == Role::Center { Ink::Good } else { Ink::Plain };
            rig::board(&mut scene, ink, &known.board, &target.cam_from_board);
        }
    }
    html! {
        h2 { "The poses as the cameras saw them" }
        (scene.figure("cameras and targets", "Both cameras and the target at each pose, the groups' centres in green, in the left camera's frame. A target that stands apart from the others is a wrong pose or a wrong numbering."))
    }
}

/// Mark points of each group from three sides, with the sphere about the centre.
fn places(measured: &[MeasuredPose]) -> Result<Markup> {
    let mut rows: Vec<(&str, Vec<String>)> = Vec::new();
    for MeasuredPose { at, .. } in measured {
        if rows.iter().all(|(group, _)| *group != at.group) {
            let of_group: Vec<&MeasuredPose> = measured.iter().filter(|m| m.at.group == at.group).collect();
            let views = [[0, 1], [0, 2], [2, 1]].into_iter().map(|axes| view(&of_group, axes));
            rows.push((&at.group, views.collect::<Result<_>>()?));
        }
    }
    Ok(html! {
        h2 { "Mark points of each group" }
        @for (group, views) in &rows {
            p.lead { "group " (group) ": from the left camera, from above, from the side; the circle is the sphere through the median distance to the centre" }
            div.side { @for svg in views { figure style="flex: 1 1 280px" { (PreEscaped(svg.as_str())) } } }
        }
    })
}

fn view(group: &[&MeasuredPose], [a, b]: [usize; 2]) -> Result<String> {
    const AXES: [&str; 3] = ["x, mm", "y, mm", "z, mm"];
    let at = |m: &&MeasuredPose| m.target.as_ref().ok().map(|t| t.cam_from_board.translation.vector);
    let center = group.iter().find(|m| m.at.role == Role::Center).and_then(at);
    let points = group.iter().filter_map(at).map(|p| (p[a], p[b]));
    let mut plot = Plot::new("", AXES[a], AXES[b]).equal_axes().size(330, 330);
    if b == 1 {
        plot = plot.y_down();
    }
    if let Some(center) = center {
        let away = group.iter().filter(|m| m.at.role != Role::Center).filter_map(at).map(|p| (p - center).norm());
        let radius = crate::statistics::median(away).unwrap_or(0.0);
        let turns = (0..=72).map(|k| (f64::from(k) * TAU / 72.0).sin_cos());
        let circle = turns.map(|(sin, cos)| (center[a] + radius * cos, center[b] + radius * sin));
        plot = plot.line("", circle).points("", [(center[a], center[b])]);
    }
    plot.points("", points).svg()
}

fn distances(distances: &[(f64, f64)]) -> Result<Markup> {
    if distances.is_empty() {
        return Ok(html! {});
    }
    let svg = Plot::new("Distance to the group's centre", "commanded, mm", "measured minus commanded, mm")
        .points("", distances.iter().copied())
        .size(640, 340)
        .svg()?;
    Ok(html! {
        h2 { "Distances" }
        (page::figure(&svg, "Against the nominal robot (robot.toml here, else the arm of Shi et al.): what identification will explain. A single point far from the others is a pose that the robot did not go to, or another pose's pictures."))
    })
}

/// Poses without pictures have their row in the table of those that are not measured.
fn thumbnails(list: &[Thumbnail]) -> Markup {
    let shown: Vec<&Thumbnail> = list.iter().filter(|picture| !picture.jpeg_base64.is_empty()).collect();
    html! {
        @if !shown.is_empty() {
            h2 { "Pictures of failures and of the worst poses" }
            div.side {
                @for picture in shown {
                    figure {
                        img alt={ "pose " (picture.pose) } style="max-width: 100%" src={ "data:image/jpeg;base64," (picture.jpeg_base64) };
                        figcaption { strong { (picture.pose) } ": " (picture.caption) }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_without_pictures_has_no_empty_frame() {
        let of = |pose: &str, jpeg_base64: &str| Thumbnail {
            pose: pose.to_owned(),
            caption: "why".to_owned(),
            jpeg_base64: jpeg_base64.to_owned(),
        };
        assert_eq!(thumbnails(&[of("01", "")]).into_string(), "");
        let page = thumbnails(&[of("01", ""), of("02", "/9j/")]).into_string();
        assert!(page.contains(">02<") && !page.contains(">01<") && page.matches("<figure").count() == 1, "{page}");
    }
}
