//! Where the cameras stand and the target sits, in tables.

use maud::{Markup, html};

use crate::diagnostic::two_digits;
use crate::formats::placements::record::{PlacementFile, TransformRecord};
use crate::report::page;
use crate::report::table::short;

/// Turn in degrees and shift in mm, three numbers each, and their standard deviations.
fn cells(record: &TransformRecord) -> Vec<String> {
    let ((shift, turn), [turn_rad, shift_mm]) = (record.words(), record.sigmas());
    vec![
        shift,
        short(shift_mm),
        turn.unwrap_or_else(|| "not in the readings".to_owned()),
        short(turn_rad.map(f64::to_degrees)),
    ]
}

/// The section of a page; nothing without placements.
pub(super) fn section(placement: &PlacementFile, by_cameras: bool) -> Markup {
    if placement.groups.is_empty() {
        return html! {};
    }
    let groups = placement.groups.iter().map(|group| {
        let mut row = vec![format!("base from {}, {}", if by_cameras { "rig" } else { "instrument" }, group.group)];
        row.extend(cells(&group.base_from_rig));
        row.extend([
            two_digits(group.error_mm.mean_mm),
            two_digits(group.error_mm.p95_mm),
            short(group.held_out.mean_abs_mm),
        ]);
        row
    });
    let target = placement.flange_from_target.iter().map(|target| {
        let mut row = vec!["flange from target".to_owned()];
        row.extend(cells(target));
        row.extend([String::new(), String::new(), String::new()]);
        row
    });
    let rows: Vec<Vec<String>> = groups.chain(target).collect();
    let (heading, what) = match by_cameras {
        true => ("Where the cameras stand", "The left camera"),
        false => ("Where the instrument stands", "The frame of the points as they were read"),
    };
    html! {
        h2 { (heading) }
        p { (what) " in the robot's base frame, and the target on its flange; shift, and turn as axis times angle. The error is that of the \
            predicted target, robot, placement and scatter together, at poses like these (" (placement.poses) ")." }
        (page::table(&["transform", "x, y, z in mm", "sigma", "turn in deg", "sigma", "error to expect, mm", "95 of 100 below", "held out"], &rows))
        @for held in placement.held.iter().filter(|held| !held.parameters.is_empty()) {
            p { "Not observable from a placement, and taken from " (placement.robot) ": " (held.parameters.join(", ")) " (" (held.because) ")." }
        }
    }
}
