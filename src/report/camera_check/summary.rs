//! The verdict in words, and the table on stdout.

use crate::diagnostic::{at_most, capital, count, short, two_digits};
use crate::files::OutDir;
use crate::imaging::corners::named;
use crate::report::table::{Table, number};
use crate::stereo::calibrate::Calibration;
use crate::stereo::findings::Finding;
use crate::stereo::judge::assessment::Judged;
use crate::stereo::judge::evidence::Evidence;
use crate::stereo::judge::ledger::{KNOWN_LENSES, RAYS};
use crate::stereo::judge::lengths::{Axis, Range};
use crate::stereo::judge::moves::KnownMove;
use crate::stereo::judge::verdict::Verdict;
use crate::stereo::pairs::{Cause, DiscardedPair};
use crate::stereo::volume::Extent;

/// Rows of the table on stdout along each axis.
const TABLE_ROWS: usize = 3;

/// Things to do on stdout; the page has all.
const MOST_NEXT: usize = 2;

pub(super) fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Pass => "PASS",
        Verdict::Fail => "FAIL",
        Verdict::Undecided => "UNDECIDED",
    }
}

/// The first screen: the verdict and what it is for, the pairs, the rig, what to do next.
pub fn summary(calibration: &Calibration, judged: &Judged, out: &OutDir) -> String {
    let mut lines = vec![
        format!("{}: {}", word(judged.verdict), explanation(judged)),
        volume(judged),
        deciding_by(judged, Evidence::figure),
        trusted(judged),
    ];
    lines.extend(standing(calibration));
    lines.extend(lenses(calibration));
    lines.extend(scale(judged));
    lines.extend(second_board(judged));
    let found = |finding: &Finding| match finding.is_of_board() {
        true => format!("found over all pairs: {}", finding.briefly()),
        false => format!("during the series: {}", finding.briefly()),
    };
    lines.extend(judged.facts.findings.iter().map(found));
    lines.extend(pairs(calibration, &judged.facts.findings));
    lines.push(rig(calibration, judged));
    lines.push(board(calibration, judged));
    lines.extend(next(judged).into_iter().take(MOST_NEXT).map(|what| format!("next: {what}")));
    let [rig, page] = ["calibration.json", "camera-check.html"].map(|file| out.join(file));
    format!("{}\n\n{}\ncalibration: {rig}\nreport: {page}\n", lines.join("\n"), ranges(judged))
}

/// The shortest, a middle and the longest range along each axis.
fn ranges(judged: &Judged) -> Table {
    let mut table = Table::new(["range mm", "lengths", "mean mm", "std mm", "max |error| mm"]);
    for (name, along) in [("x", Axis::X), ("y", Axis::Y)] {
        let ranges: Vec<&Range> = judged.facts.accuracy.ranges.iter().filter(|r| r.axis == along).collect();
        let mut shown: Vec<usize> =
            (0..TABLE_ROWS).map(|k| k * ranges.len().saturating_sub(1) / (TABLE_ROWS - 1)).collect();
        shown.dedup();
        for range in shown.into_iter().filter_map(|i| ranges.get(i)) {
            table.row([
                format!("{name} {}", short(range.nominal_mm)),
                range.count.to_string(),
                number(Some(range.mean_error_mm), 4),
                number(Some(range.std_mm), 4),
                number(Some(range.max_abs_error_mm), 4),
            ]);
        }
    }
    table
}

/// Where the verdict holds.
pub(super) fn volume(judged: &Judged) -> String {
    let volume = &judged.facts.volume.volume;
    let [near, far] = volume.depth_mm;
    let [x0, x1, y0, y1] = volume.tilt_deg;
    match judged.facts.volume.extent {
        Extent::Boards => format!(
            "for where the boards were: {near:.0} to {far:.0} mm away, tilted by {x0:.0} to {x1:.0} deg about x and {y0:.0} to {y1:.0} deg about y"
        ),
        Extent::All => format!(
            "for all that both cameras see {near:.0} to {far:.0} mm away, where the boards' depths were, in all directions"
        ),
        asked @ Extent::Box(_) => format!("for {}", asked.said()),
    }
}

/// Which rig of several it is, where the rig changed.
fn standing(calibration: &Calibration) -> Option<String> {
    let standing = &calibration.standing;
    if let Some(last) = standing.unconfirmed.first() {
        return Some(format!(
            "the rig may have changed: the last pairs ({}) contradict it; `--since {last}` calibrates from them alone, once there are enough",
            named(&standing.unconfirmed)
        ));
    }
    let since = standing.since.as_ref()?;
    Some(format!("the rig since pair {since}; {} earlier pairs show it before it changed", standing.pairs_before))
}

/// Whether the pictures agree with lenses that were known, and what they would have shown.
fn lenses(calibration: &Calibration) -> Option<String> {
    let check = calibration.lens_check.as_ref()?;
    if check.contradicts() {
        return Some(check.statement.clone());
    }
    let seen = check.focus_seen.iter().flatten().copied().fold(0.0, f64::max);
    Some(format!("{}; they would show a focal length that differs by {} %", check.statement, two_digits(100.0 * seen)))
}

/// What known moves say of the scale.
fn scale(judged: &Judged) -> Vec<String> {
    let moves = &judged.facts.standards.moves;
    let measured = moves.measured.iter().map(KnownMove::statement);
    let why = judged.of_scale().and_then(|_| moves.why());
    measured.chain(moves.missing.iter().cloned()).chain(why).collect()
}

/// What a second board says, where there was one.
fn second_board(judged: &Judged) -> Option<String> {
    let second = judged.facts.standards.second.as_ref()?;
    let pairs = count(second.pairs, "pair");
    let Some(extremes) = &second.extremes else {
        return Some(format!("second board: no length on it could be measured in {pairs}"));
    };
    let scale = second.scale_error.zip(second.scale_error_sigma).map_or(String::new(), |(scale, sigma)| {
        format!("; its scale is off by {} +- {} ppm", two_digits(1e6 * scale), two_digits(2e6 * sigma))
    });
    Some(format!(
        "second board: {pairs}, largest error {} mm ({} with its uncertainty){scale}",
        number(Some(extremes.max_abs_error_mm), 4),
        number(Some(extremes.largest.at_most_mm()), 4)
    ))
}

/// How many pairs were used, and in a line a reason which were not; a finding that is the reason was told before.
fn pairs(calibration: &Calibration, findings: &[Finding]) -> Vec<String> {
    /// Causes and reasons with a line of their own; the page has all.
    const MOST: usize = 6;
    let total = calibration.views.len() + calibration.skipped.len();
    let mut lines = vec![format!("{} of {total} pairs used", calibration.views.len())];
    // Reasons that differ by a figure alone are one.
    let without_figures = |reason: &str| reason.replace(|c: char| c.is_ascii_digit() || ".-".contains(c), "");
    let mut groups: Vec<(Cause, String, Vec<&DiscardedPair>)> = Vec::new();
    for pair in &calibration.discarded.pairs {
        let pattern = without_figures(&pair.reason);
        match groups.iter_mut().find(|(cause, known, _)| *cause == pair.cause && *known == pattern) {
            Some((.., pairs)) => pairs.push(pair),
            None => groups.push((pair.cause, pattern, vec![pair])),
        }
    }
    groups.sort_by_key(|(.., pairs)| std::cmp::Reverse(pairs.len()));
    let others: usize = groups.iter().skip(MOST).map(|(.., pairs)| pairs.len()).sum();
    lines.extend(groups.iter().take(MOST).map(|(.., pairs)| {
        let reason = &pairs[0].reason;
        let alike = pairs.iter().all(|pair| pair.reason == *reason);
        let reason = match findings.iter().find_map(|finding| reason.strip_suffix(&finding.action)) {
            Some("") => "that change",
            Some(why) => why.trim_end_matches(": "),
            None => reason,
        };
        let names: Vec<String> = pairs.iter().map(|pair| pair.pair.clone()).collect();
        match alike {
            true => format!("  without {}: {reason}", named(&names)),
            // The figures are the first one's.
            false => format!("  without {}, likewise {}: {reason}", names[0], named(&names[1..])),
        }
    }));
    if others > 0 {
        lines.push(format!("  without {others} more, see the report"));
    }
    lines
}

fn rig(calibration: &Calibration, judged: &Judged) -> String {
    let (rig, epipolar) = (calibration.rig(), &judged.facts.accuracy.epipolar);
    format!(
        "{} lens, baseline {} mm, reprojection RMS {} px, epipolar error RMS {} px",
        rig.left.lens.name(),
        number(Some(rig.baseline_mm()), 3),
        number(Some(calibration.rms_px()), 3),
        number(Some(epipolar.rms_px), 3),
    )
}

fn board(calibration: &Calibration, judged: &Judged) -> String {
    let [along_x, along_y, twist] = calibration.values.shared.shape_mm;
    let bow = if calibration.layout.shape {
        format!(", bowed by {along_x:.4} mm along x and {along_y:.4} mm along y, twisted by {twist:.4} mm")
    } else {
        ", taken as flat".to_owned()
    };
    let standards = &judged.facts.standards;
    let by_itself = standards.second.is_none() && standards.moves.measured.is_empty();
    // A wrong size makes a rig of another size, and nothing else.
    let check = if by_itself {
        "; a wrong size of its squares shows in the baseline alone: compare that with a ruler"
    } else {
        ""
    };
    format!("board of {}{bow}{check}", calibration.board.said())
}

/// What to do next: about what happened to the rig and about the board, then what the deciding line asks for, then what
/// the views lack.
pub(super) fn next(judged: &Judged) -> Vec<&str> {
    let passes = judged.verdict == Verdict::Pass;
    let tolerance_mm = judged.facts.tolerance_mm;
    let matters = move |finding: &&Finding| !passes && finding.effect_mm.is_none_or(|_| finding.material(tolerance_mm));
    let happened = judged.facts.findings.iter().filter(matters).filter_map(|finding| finding.remedy.as_deref());
    // Rays that miss each other because the rig changed are no matter of a hand or a shadow.
    let is_explained = |line: &&Evidence| line.what == RAYS && !judged.facts.findings.is_empty();
    let changed = judged.facts.findings.iter().filter_map(|finding| finding.remedy.as_deref());
    let changed = changed.filter(|_| judged.deciding().is_some_and(|line| is_explained(&line)));
    let board = judged.print_scatter.iter().filter(move |_| !passes).map(|board| board.text.as_str());
    // Lenses that are not these cameras' spoil all other lines.
    let lenses = judged.evidence.iter().find(|line| line.what == KNOWN_LENSES && line.allows != Verdict::Pass);
    let decides = |line: &&Evidence| lenses.is_none() && line.allows != Verdict::Pass && !is_explained(line);
    let deciding = judged.deciding().filter(decides).map(|line| &*line.remedy);
    let first = lenses.into_iter().map(|line| &*line.remedy);
    let mut told: Vec<&str> =
        first.chain(happened).chain(changed).chain(board).chain(deciding.filter(|remedy| !remedy.is_empty())).collect();
    told.extend(judged.advice.iter().map(String::as_str));
    let mut said = std::collections::BTreeSet::new();
    told.retain(|what| said.insert(*what));
    told
}

pub(super) fn explanation(judged: &Judged) -> String {
    let extremes = &judged.facts.accuracy.extremes;
    let pairs = judged.facts.accuracy.pairs.iter().filter_map(|pair| Some((pair.max_abs_error_mm?, &pair.pair)));
    let worst = pairs.max_by(|a, b| a.0.total_cmp(&b.0));
    format!(
        "95 % of held-out lengths within {:.4} mm, largest error {:.4} mm in pair {} ({:.4} with its uncertainty), tolerance {} mm",
        extremes.one_in_twenty_mm,
        extremes.max_abs_error_mm,
        worst.map_or("", |(_, pair)| pair.as_str()),
        extremes.largest.at_most_mm(),
        judged.facts.tolerance_mm
    )
}

/// The line of the ledger that decides, and which others are below a pass; the figure as a page or the terminal has it.
pub(super) fn deciding_by(judged: &Judged, figure: fn(&Evidence) -> String) -> String {
    let deciding = judged.deciding();
    let below = || judged.evidence.iter().filter(|line| line.allows != Verdict::Pass);
    let others: Vec<&str> =
        below().filter(|line| deciding.is_none_or(|first| first.what != line.what)).map(Evidence::name).collect();
    let others = match (below().next(), others.is_empty()) {
        (None, _) => format!("all {} checks passed", judged.evidence.len()),
        (_, true) => "all other checks passed".to_owned(),
        _ => format!("also not passed: {}", others.join(", ")),
    };
    deciding.map_or(others.clone(), |line| format!("deciding check: {}, {}; {others}", line.name(), figure(line)))
}

/// The lengths for which all lines of the ledger hold: of longer ones most lines say nothing.
pub(super) fn lengths(judged: &Judged) -> String {
    format!("lengths of up to {:.0} mm", judged.facts.volume.length_mm)
}

/// What the rig can be trusted to, whatever the tolerance.
pub(super) fn trusted(judged: &Judged) -> String {
    match (judged.trusted(), judged.trusted_mm()) {
        (Some(line), Some(mm)) if judged.measures_nothing() => format!(
            "{}: of one of {:.0} mm an error {} is not ruled out ({})",
            // The tolerance that was asked for is as large.
            if judged.verdict == Verdict::Pass {
                "within a tolerance that bounds hardly any length"
            } else {
                "no length can be trusted"
            },
            judged.facts.volume.length_mm,
            if mm < judged.facts.volume.length_mm {
                format!("of {} mm", two_digits(mm))
            } else {
                "as large as itself".to_owned()
            },
            line.name()
        ),
        (Some(line), Some(mm)) => {
            // The held-out lengths stand in the line before.
            let is_first = judged.evidence.first().is_some_and(|first| first.what == line.what);
            let why = if is_first { String::new() } else { format!(" ({})", line.name()) };
            format!("{} can be trusted to {mm:.4} mm{why}", lengths(judged))
        }
        _ => {
            let is_open = |line: &&Evidence| line.value.is_none() || (line.unit != "mm" && line.unit != "px");
            let open = judged.evidence.iter().filter(is_open);
            let open: Vec<&str> = open.filter(|line| line.allows != Verdict::Pass).map(Evidence::name).collect();
            match open.is_empty() {
                true => "no length can be trusted: these pairs do not bound their errors".to_owned(),
                false => format!(
                    "what lengths can be trusted to is not known until these checks are passed: {}",
                    open.join(", ")
                ),
            }
        }
    }
}

/// What the verdict means for somebody who must decide.
pub(super) fn advice(judged: &Judged) -> String {
    let sure = judged.facts.tolerance_mm;
    match judged.verdict {
        Verdict::Pass => {
            let trusted = judged.trusted_mm().unwrap_or(sure);
            let over = match judged.facts.volume.extent {
                Extent::Boards => "the volume where the boards stood".to_owned(),
                asked => asked.said(),
            };
            format!("{} can be trusted to {} mm in {over}.", capital(&lengths(judged)), at_most(trusted, sure))
        }
        Verdict::Undecided => format!(
            "Not decided: the checks below that are not passed say why and what to do; until then do not rely on {sure} mm."
        ),
        Verdict::Fail => format!(
            "Do not rely on {sure} mm: the lengths, the pairs and the residuals below show where the errors are."
        ),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::imaging::Side;
    use crate::stereo::calibrate::calibrate;
    use crate::stereo::findings::standing::{Asked, calibrate_standing};
    use crate::stereo::judge::ledger::Standards;
    use crate::stereo::model::KnownLenses;
    use crate::stereo::select::options::Options;
    use crate::stereo::synthetic::{BROWN4, World, judged};

    #[test]
    fn what_changed_is_told_once() {
        let world = World::new(12, 4);
        let later = world.with_camera_moved(Vector3::y() * 0.01, Vector3::zeros()).corners(14);
        for (pairs, left_out) in [(5..12, "the rig changed after it"), (10..12, "that change")] {
            let mut corners = world.corners(14);
            corners.pairs[pairs.clone()].clone_from_slice(&later.pairs[pairs.clone()]);
            let asked = Asked { options: BROWN4, tolerance_mm: 0.05, extent: Extent::Boards };
            let (found, told) = calibrate_standing(&corners, &asked).unwrap();
            let said = super::pairs(&found, &told);
            assert!(said.len() == 2 && said[1].ends_with(&format!(": {left_out}")), "{said:?} {told:?}");
        }
    }

    /// What is known of lenses that are others makes all other lines as they are.
    #[test]
    fn what_to_do_about_lenses_that_are_exchanged_comes_first() {
        let world = World::new(8, 88);
        let earlier = calibrate(&World::new(12, 188).corners(188), &BROWN4).unwrap();
        let said = |known: KnownLenses| {
            let found = calibrate(&world.corners(71), &Options { known: Some(known), ..Options::default() }).unwrap();
            let judged = judged(&found, Vec::new(), Standards::default(), 0.01);
            next(&judged).into_iter().map(str::to_owned).collect::<Vec<String>>()
        };
        let known = KnownLenses::of_rig(earlier.rig(), &Side::BOTH);
        let exchanged = said(known.exchanged());
        assert!(exchanged[0].starts_with("exchange the folders of left and right"), "{exchanged:?}");
        let as_they_are = said(known);
        assert!(!as_they_are.iter().any(|what| what.contains("exchange")), "{as_they_are:?}");
    }
}
