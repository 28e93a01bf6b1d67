//! `rectify.html` and the lines on stdout: what was done to the pictures, and how well their rows agree.

use maud::{Markup, html};

use super::Result;
use super::drawing::figure::Plot;
use super::drawing::picture::PairJpeg;
use super::page::{self, Tone};
use super::table::number;
use crate::diagnostic::count;
use crate::files::OutDir;
use crate::formats::rectified::{RectifiedFile, RectifiedPair};
use crate::imaging::input::pairs::PairFiles;
use crate::imaging::{PairCorners, overlay};
use crate::stereo::model::rectification::row_differences;

/// Width of the pair on the page, both pictures together, px.
const WIDTH: u32 = 1200;

/// Lines over the height of the pictures.
const LINES: u32 = 24;

/// Length at which the largest difference is drawn, as a share of the picture's width.
const LONGEST_ARROW: f64 = 0.06;

/// Rows that differ by more, px RMS, are no common ones: dense stereo looks for a point along one row. Disparities that
/// are off by more are as far from where it finds one.
const AGREE_PX: f64 = 0.5;

/// What the board says against the rectified pictures.
pub fn doubts(file: &RectifiedFile) -> Vec<String> {
    rows_differ(file).into_iter().chain(disparities_off(file)).collect()
}

/// What rows that do not agree mean.
fn rows_differ(file: &RectifiedFile) -> Option<String> {
    let (common, residual) = (file.common?, file.residual?);
    (residual.rms_px > AGREE_PX).then(|| {
        format!(
            "the {common} differ by {} px RMS, too much for dense stereo (up to {AGREE_PX}): the pictures are of another rig, it changed, or its \
             calibration is poor",
            number(Some(residual.rms_px), 2)
        )
    })
}

/// What a board of another size than it has means, where it is off by more than the rig's own calibration leaves open.
fn disparities_off(file: &RectifiedFile) -> Option<String> {
    let (size, board) = (file.size?, file.board.as_ref()?);
    let is_off = size.disparity_px.abs() > AGREE_PX && size.diagonal_mm.abs() > size.trusted_mm.unwrap_or(0.0);
    is_off.then(|| {
        format!(
            "the disparities are off by {} px in the middle one of {}: by them the {board} board that calibrated is {:.4} times as large as it is. The \
             rig changed since, or this is another board of as many squares: `stereocal camera-check IMAGES --against` the calibration tells",
            number(Some(size.disparity_px), 2),
            count(size.pairs, "pair"),
            size.times
        )
    })
}

/// The lines on stdout.
pub fn summary(file: &RectifiedFile, out: &OutDir) -> String {
    let skipped = file.pairs_skipped.len();
    let skipped = if skipped > 0 { format!(", {skipped} skipped") } else { String::new() };
    let what = if file.mode == "rectify" { "rectified" } else { "undistorted" };
    format!(
        "{} pairs {what}{skipped}, {}x{} px, in {}\n{}report: {}\n",
        file.pairs.len(),
        file.width,
        file.height,
        out.join("rectified"),
        agreement(file).map_or_else(String::new, |text| format!("{text}\n")),
        out.join("rectify.html"),
    )
}

/// How well the rows agree, where that is a question.
fn agreement(file: &RectifiedFile) -> Option<String> {
    let common = file.common?;
    Some(match (&file.residual, &file.board) {
        (Some(r), Some(board)) => format!(
            "{common} of corresponding corners differ by {} px RMS, at most {} px ({} corners of the {board} board in {} pairs)",
            number(Some(r.rms_px), 3),
            number(Some(r.max_px), 3),
            r.corners,
            file.pairs.iter().filter(|p| p.residual.is_some()).count(),
        ),
        _ => format!(
            "no board was seen in the rectified pictures (looked for: {} squares): how well their {common} agree was not measured",
            file.looked_for
        ),
    })
}

/// The report. `rectified` are the pictures written, `shown` the corners of the pair that agrees worst.
/// `doubts` is what speaks against the rig or the rows.
pub fn page(
    file: &RectifiedFile,
    rectified: &[PairFiles],
    shown: Option<&PairCorners>,
    doubts: &[String],
) -> Result<String> {
    let name = shown.map(|pair| pair.pair.clone()).or_else(|| rectified.first().map(|p| p.pair.clone()));
    let files = name.as_ref().and_then(|name| rectified.iter().find(|files| files.pair == *name));
    let none = PairCorners::default();
    let drawn = files.and_then(|files| PairJpeg::new(overlay::drawn(files, shown.unwrap_or(&none), None)?, WIDTH));
    let rectify = file.mode == "rectify";
    let content = html! {
        @if let Some(text) = agreement(file) {
            @let (tone, headline) = match (&file.residual, doubts.is_empty()) {
                (None, _) => (Tone::Doubtful, "Not checked"),
                _ if rows_differ(file).is_some() => (Tone::Bad, "The rows do not agree"),
                _ if disparities_off(file).is_some() => (Tone::Bad, "The disparities are off"),
                (_, false) => (Tone::Doubtful, "Rectified by a doubtful rig"),
                (_, true) => (Tone::Good, "Rectified"),
            };
            (page::verdict(tone, headline, &numbers(file), &format!("{text}.")))
        }
        (page::warnings(doubts))
        @if let (Some(jpeg), Some(name)) = (&drawn, &name) {
            h2 { (if rectify { "Epipolar lines" } else { "A pair" }) }
            (page::figure(&lined(jpeg, file.common), &caption(name, file)))
        }
        @if let Some(pair) = shown { (differences(file, pair)?) }
        h2 { "Pairs" }
        div.scroll { (pairs(&file.pairs)) }
        @if !file.pairs_skipped.is_empty() {
            p { "Not written:" }
            ul { @for skipped in &file.pairs_skipped { li { (skipped.pair) ": " (page::text(&skipped.reason)) } } }
        }
        p { "The matrices R1, R2, P1, P2" @if rectify { " and Q" } " stand in " code { "rectified.json" } ", row by row, as OpenCV has them." }
    };
    let title = if rectify { "Rectified pictures" } else { "Undistorted pictures" };
    let lead = format!("{} pairs of {}x{} px", file.pairs.len(), file.width, file.height);
    Ok(page::page(title, &lead, &content))
}

/// The three numbers of the page, where a board was seen.
fn numbers(file: &RectifiedFile) -> Vec<(String, String)> {
    let Some(r) = &file.residual else { return Vec::new() };
    let common = file.common.unwrap_or("rows");
    vec![
        (
            format!("{} px", number(Some(r.rms_px), 3)),
            format!("difference of the {common} of corresponding corners (RMS)"),
        ),
        (format!("{} px", number(Some(r.max_px), 3)), "the largest".to_owned()),
        (r.corners.to_string(), "corners compared".to_owned()),
    ]
}

fn caption(name: &str, file: &RectifiedFile) -> String {
    match (file.common, &file.residual) {
        (Some(common), Some(_)) => format!(
            "Pair {name}, the one whose {common} agree worst: each line passes through the same points in both pictures."
        ),
        (Some(_), None) => format!(
            "Pair {name}: each line passes through the same points in both pictures if they are of this rig, which no board in them tells."
        ),
        (None, _) => format!("Pair {name}: straight edges are straight."),
    }
}

/// The picture with epipolar lines over it, as SVG.
fn lined(jpeg: &PairJpeg, common: Option<&str>) -> String {
    let line =
        |[x1, y1, x2, y2]: [f64; 4]| format!("<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"/>");
    let (full_w, full_h) = (f64::from(jpeg.width), f64::from(jpeg.height));
    let places = (1..LINES).map(|k| f64::from(k) / f64::from(LINES));
    let lines: String = match common {
        Some("rows") => places.map(|s| line([0.0, s * full_h, full_w, s * full_h])).collect(),
        Some(_) => {
            places.flat_map(|s| [s, 1.0 + s].map(|s| line([s * full_w / 2.0, 0.0, s * full_w / 2.0, full_h]))).collect()
        }
        None => String::new(),
    };
    let drawn = format!("<g stroke=\"#ff3b30\" stroke-width=\"0.8\" stroke-opacity=\"0.75\">{lines}</g>");
    jpeg.svg("the pair side by side", &drawn)
}

/// The differences of a pair's corners as arrows over the left picture.
fn differences(file: &RectifiedFile, pair: &PairCorners) -> Result<Markup> {
    let in_columns = file.common == Some("columns");
    let found = row_differences(pair, in_columns);
    let most = found.iter().fold(0.0_f64, |most, (_, d)| most.max(d.abs()));
    if most == 0.0 {
        return Ok(html! {});
    }
    let scale = LONGEST_ARROW * f64::from(file.width) / most;
    let arrows = found.iter().map(|(at, d)| {
        let (dx, dy) = if in_columns { (d * scale, 0.0) } else { (0.0, d * scale) };
        [at.x, at.y, dx, dy]
    });
    let svg = Plot::new(&format!("Pair {}: differences of the corners", pair.pair), "x, px", "y, px")
        .vectors("", arrows)
        .equal_axes()
        .y_down()
        .svg()?;
    let caption = format!(
        "Left minus right, in the left rectified picture, {scale:.0} times enlarged; the longest is {most:.3} px. Arrows without order are \
         the corners' noise and that of the interpolation; a common direction over a part of the picture is an error of the calibration."
    );
    Ok(page::figure(&svg, &caption))
}

fn pairs(pairs: &[RectifiedPair]) -> Markup {
    let rows = pairs.iter().map(|p| {
        let corners = p.residual.map_or_else(|| "-".to_owned(), |r| r.corners.to_string());
        let [rms, most] = [p.residual.map(|r| r.rms_px), p.residual.map(|r| r.max_px)].map(|px| number(px, 3));
        [p.pair.clone(), corners, rms, most]
    });
    page::table(&["pair", "corners", "RMS, px", "largest, px"], rows)
}
