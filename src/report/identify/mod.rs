//! The screen and the page of `identify`.

mod figures;
mod placement;
mod screen;
mod tables;

use maud::{Markup, html};
use nalgebra::Point3;

use super::Result;
use super::page::{self, Tone};
use super::table::short;
use crate::diagnostic::{capital, two_digits};
use crate::formats::placements::record::PlacementFile;
use crate::identify::data::dataset::Dataset;
use crate::identify::judge::errors::RowError;
use crate::identify::record::{Advice, PointSpread, Record};
use crate::measurements::Role;

pub use self::screen::{summary, verified};

/// The page. `before` and `after` are the errors of the verify rows under the nominal and the identified robot.
/// `places` are the target's points in the nominal base frame, row by row; `arm` is the arm's line at the first centre
/// pose.
pub fn page(
    set: &Dataset,
    record: &Record,
    placement: &PlacementFile,
    places: &[(Role, Point3<f64>)],
    arm: &[Point3<f64>],
    before: &[RowError],
    after: &[RowError],
) -> Result<String> {
    let lead = format!(
        "{} poses in {} {}, {}; {} kept, seed {}",
        set.poses.len(),
        set.groups.len(),
        if set.groups.len() == 1 { "group" } else { "groups" },
        match record.folded {
            true => "all fitted, each judged by fits that it was left out of".to_owned(),
            false => format!("{} to verify", set.verify_rows().len()),
        },
        record.chosen,
        record.seed
    );
    // What the verdict says is not said again.
    let others: Vec<String> = record.warnings.iter().filter(|said| *said != record.whole_reason()).cloned().collect();
    let content = html! {
        (verdict(record))
        (page::warnings(&others))
        (verification(set, record, before, after)?)
        @if let Some(expected) = &record.expected {
            h2 { "How far to trust it" }
            (tables::expected_table(expected))
            @if let Some(scale) = screen::of_scale(record) {
                p { "Not in these figures: " (scale) "." }
            }
            (figures::expected_map(expected, places)?)
        }
        (placement::section(placement, set.is_of_cameras()))
        h2 { "Parameters" }
        p { "The corrected parameters of each link and joint, nominal value and correction: alpha and a of link j - 1, theta and d of joint j." }
        (tables::joint_table(record))
        (tables::parameter_table(record))
        h2 { "What the poses determine" }
        (tables::rank_table(record))
        h2 { "Convergence" }
        (figures::convergence_figure(record)?)
        h2 { "How it was chosen" }
        (tables::judged_table(record))
        h2 { "Where was measured" }
        (figures::in_space(places, arm))
        (figures::layout_figures(places)?)
        h2 { "How the swarms start" }
        (figures::start_figures(record.seed)?)
    };
    Ok(page::page("Identification", &lead, &content))
}

/// Errors before and after on rows that took no part in the fit.
fn verification(set: &Dataset, record: &Record, before: &[RowError], after: &[RowError]) -> Result<Markup> {
    Ok(html! {
        h2 { "Verification" }
        (tables::distances(set))
        (figures::verification_figure(before, after, record.folded)?)
        (tables::verification_table(record))
        @if let Some(targets) = &record.targets {
            p { "Several targets: " (targets.sentence()) "." }
        }
        (tables::worst_table(set, before, after, record.folded))
    })
}

/// Whether to use the robot, with the errors before and after and what to expect.
fn verdict(record: &Record) -> Markup {
    let (tone, word) = match record.advice {
        Advice::Use if record.is_near_only() => (Tone::Good, "Use the identified robot near these poses only"),
        Advice::Use => (Tone::Good, "Use the identified robot"),
        Advice::Check => (Tone::Doubtful, "Check before use"),
        Advice::KeepNominal => (Tone::Doubtful, "Keep the nominal robot"),
        Advice::DoNotUse => (Tone::Bad, "Do not use"),
    };
    let mean = |spread: Option<&PointSpread>| {
        let of = |s: &PointSpread| s.point.and_then(|p| p.mean_abs_mm).or(s.distance.mean_abs_mm);
        short(spread.and_then(of))
    };
    let (before, after) = (record.before.judged(), record.chosen_method().map(|m| m.quality.judged()));
    let what = if before.point.is_some() { "position" } else { "distance" };
    let after = after.filter(|_| screen::is_corrected(record));
    // With the tool of a file that has none, the error is that tool, and nothing to decide by.
    let mut numbers = vec![match record.tool_mm {
        Some((_, left_mm)) => {
            (format!("{} mm", two_digits(left_mm)), "median error before, its tool fitted".to_owned())
        }
        None => (format!("{} mm", mean(Some(before))), format!("mean {what} error before")),
    }];
    numbers.extend(after.map(|after| (format!("{} mm", mean(Some(after))), format!("mean {what} error after"))));
    // Rows that are farther off than nineteen of twenty should be have said otherwise.
    let held_out_mm = after.and_then(|after| after.point?.mean_abs_mm);
    if let Some(expected) =
        record.expected.as_ref().filter(|expected| held_out_mm.is_none_or(|mm| mm < expected.p95_mm))
    {
        let p95 = format!("{} mm", two_digits(expected.p95_mm));
        numbers.push((p95, "95 of 100 positions are better than this".to_owned()));
    }
    let after = after.map_or(String::new(), |after| format!(" After: {}.", screen::errors(after, two_digits)));
    let reason = record.whole_reason();
    let reason = if reason.is_empty() { String::new() } else { format!("{}. ", capital(reason)) };
    let detail = format!(
        "{reason}Before: {}.{after} {}.{}",
        screen::errors(before, two_digits),
        capital(&screen::judged_on(record)),
        screen::of_tool(record).map_or_else(String::new, |said| format!(" {}.", capital(&said)))
    );
    page::verdict(tone, word, &numbers, &detail)
}
