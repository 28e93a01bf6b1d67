//! The lines of `locate`.

use crate::files::OutDir;
use crate::formats::placements::record::{PLACEMENT, PlacementFile, TransformRecord};
use crate::identify::judge::locate::Fit;
use crate::report::table::number;

fn line(what: &str, record: &TransformRecord) -> String {
    let ((shift, turn), [turn_rad, shift_mm]) = (record.words(), record.sigmas());
    let shift = match shift_mm {
        Some(sigma) => format!("{shift} mm +- {:.4}", 2.0 * sigma),
        None => format!("{shift} mm (as in the robot's file)"),
    };
    let turn = match (turn, turn_rad) {
        (Some(turn), Some(sigma)) => format!("; turned by {turn} deg +- {:.5}", 2.0 * sigma.to_degrees()),
        _ => "; its turn is not in the readings".to_owned(),
    };
    format!("{what}: {shift}{turn}")
}

/// Whether the robot agrees with the points, the placement, the error to expect; `is_doubted` where warnings speak
/// against the rows.
pub fn summary(placement: &PlacementFile, fit: &Fit, is_doubted: bool, out: &OutDir) -> String {
    let poses = fit.poses;
    let mut lines = Vec::new();
    let of_rows = is_doubted.then(|| "the warnings say what is wrong with its rows".to_owned());
    lines.extend(fit.objection().or(of_rows).map(|why| {
        let use_ = if fit.contradicted { "do not use this placement" } else { "check before you use this placement" };
        format!("{use_}: {why}")
    }));
    for group in &placement.groups {
        let sensor = if placement.by_instrument { "instrument" } else { "rig" };
        lines.push(line(&format!("base from {sensor}, {}", group.name()), &group.base_from_rig));
        lines.push(format!(
            "  error to expect of the target: {:.4} mm on average, 95 % below {:.4}; {} on poses held out",
            group.error_mm.mean_mm,
            group.error_mm.p95_mm,
            number(group.held_out.mean_abs_mm, 4)
        ));
    }
    if placement.mirrored {
        lines.push(
            "  of points whose x is negated: those of the file are left-handed, and no placement is theirs".to_owned(),
        );
    }
    lines.extend(placement.flange_from_target.as_ref().map(|target| line("flange from target", target)));
    lines.push(match fit.misfit.freedom {
        0 => format!(
            "{poses} poses are as many as the placement takes: none is left to check the robot by; add two or more"
        ),
        freedom => format!(
            "{poses} poses fit to {:.4} mm; chi-squared {:.1} over {freedom} degrees of freedom",
            fit.misfit.rms_mm, fit.misfit.chi_square
        ),
    });
    let of_robot = match fit.robot_uncertain {
        true => "with what the identification left open of the robot",
        false => {
            "of a robot that is taken as exact but for its scatter: nothing beside its file says how well its parameters are known"
        }
    };
    lines.push(format!("95 % intervals, {of_robot}; covariances: {}", out.join(PLACEMENT)));
    lines.join("\n") + "\n"
}
