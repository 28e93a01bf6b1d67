//! Where the cameras stand and the target sits, in tables.

use maud::{Markup, html};

use crate::diagnostic::two_digits;
use crate::formats::placements::record::{PlacementFile, TransformRecord};
use crate::report::page;
use crate::report::table::short;

/// Shift in mm and turn in degrees, three numbers each, and their standard deviations, before the errors.
fn row(name: String, record: &TransformRecord, [mean, p95, held_out]: [String; 3]) -> [String; 8] {
    let ((shift, turn), [turn_rad, shift_mm]) = (record.words(), record.sigmas());
    let turn = turn.unwrap_or_else(|| "not in the readings".to_owned());
    [name, shift, short(shift_mm), turn, short(turn_rad.map(f64::to_degrees)), mean, p95, held_out]
}

/// The section of a page; nothing without placements.
pub(super) fn section(placement: &PlacementFile, by_cameras: bool) -> Markup {
    if placement.groups.is_empty() {
        return html! {};
    }
    let groups = placement.groups.iter().map(|group| {
        let name = format!("base from {}, {}", if by_cameras { "rig" } else { "instrument" }, group.name());
        let [mean, p95] = [group.error_mm.mean_mm, group.error_mm.p95_mm].map(two_digits);
        row(name, &group.base_from_rig, [mean, p95, short(group.held_out.mean_abs_mm)])
    });
    let target = placement.flange_from_target.as_ref();
    let target = target.map(|target| row("flange from target".to_owned(), target, Default::default()));
    let (heading, what) = match by_cameras {
        true => ("Where the cameras stand", "The left camera"),
        false => ("Where the instrument stands", "The frame of the points as they were read"),
    };
    html! {
        h2 { (heading) }
        p { (what) " in the robot's base frame, and the target on its flange; shift, and turn as axis times angle. The error is that of the \
            predicted target, robot, placement and scatter together, at poses like these (" (placement.poses) ")." }
        (page::table(&["transform", "x, y, z in mm", "sigma", "turn in deg", "sigma", "error to expect, mm", "95 of 100 below", "held out"], groups.chain(target)))
        @for held in placement.held.iter().filter(|held| !held.parameters.is_empty()) {
            p { "Not observable from a placement, and taken from " (placement.robot) ": " (held.parameters.join(", ")) " (" (held.because) ")." }
        }
    }
}
