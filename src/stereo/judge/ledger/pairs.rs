//! Lines on the pairs: what happened over them, how they scatter, which are missing, how the boards stood, and lenses
//! that were known.

use super::facts::Case;
use crate::diagnostic::two_digits;
use crate::imaging::Side;
use crate::stereo::Camera;
use crate::stereo::calibrate::Calibration;
use crate::stereo::findings::standing::MATERIAL_SHARE;
use crate::stereo::findings::{Finding, Kind};
use crate::stereo::judge::evidence::Evidence;
use crate::stereo::judge::verdict::Verdict;
use crate::stereo::pairs::Cause;
use crate::stereo::solve::uncertainty::{WORST_FOCAL_SIGMA, worst_focal_sigma};

/// Steps and drifts that are in the rig, and a step to it that may as well be one of the board: of two boards one has
/// another size than was said, and no pictures tell which.
pub(super) fn findings(case: &Case) -> Evidence {
    let since = case.calibration.standing.since.as_deref();
    let is_before = |finding: &Finding| since.is_some() && finding.pairs.first().map(String::as_str) == since;
    let may_be_board =
        |finding: &&Finding| is_before(finding) && finding.kind == Kind::Step && finding.may_be(Cause::OtherBoard);
    let counts = |finding: &&Finding| !is_before(finding) || may_be_board(finding);
    let left: Vec<&Finding> = case.facts.findings.iter().filter(counts).collect();
    let of_board = left.iter().copied().find(may_be_board);
    // A step that is left behind is not in the uncertainty of the rig.
    let if_of_board = of_board
        .map(|step| step.effect_mm.unwrap_or(f64::INFINITY) + case.facts.accuracy.extremes.largest.at_most_mm());
    let value = left.iter().filter_map(|finding| finding.effect_mm).chain(if_of_board).fold(0.0, f64::max);
    let detail = if left.is_empty() {
        "no change during the series: no step, drift or change of focus beyond their scatter".to_owned()
    } else {
        let told: Vec<&str> = left.iter().map(|finding| finding.action.as_str()).collect();
        let effect = if of_board.is_some() {
            "If the boards before and since are two, one of them is not as large as was said, and the pictures do not tell which: all lengths may \
             be off with it. If one board was photographed throughout, no length is off"
                .to_owned()
        } else if left.iter().any(|finding| finding.effect_mm.is_some()) {
            format!(
                "It is included in the uncertainty of the rig; a change of a length of less than {:.0} % of the tolerance does not affect the verdict",
                100.0 * MATERIAL_SHARE
            )
        } else {
            "What it does to a length stands in the held-out lengths".to_owned()
        };
        format!("{}. {effect}", told.join("; "))
    };
    let board_moved = |finding: &&Finding| finding.cause == Cause::NotSimultaneous.word();
    let remedy = if of_board.is_some() {
        "measure the squares of the board that was photographed since then, and name its first pair with `--since`"
    } else if !left.is_empty() && left.iter().all(board_moved) {
        "hold the board still while its pictures are taken, and photograph again"
    } else {
        let of_finding = left.iter().find_map(|finding| finding.remedy.as_deref());
        of_finding.unwrap_or("clamp the cameras, switch autofocus off, and photograph again")
    };
    Evidence::of_length("changes over the pairs", remedy.to_owned(), Some(value), case, detail)
}

pub(super) fn pair_scatter(case: &Case) -> Evidence {
    let scatter = &case.calibration.pair_scatter;
    let detail = match scatter.ratio {
        Some(_) => format!(
            "variance of the rig by how {} pairs with different poses scatter about it, over the one by the corners' noise; what \
             exceeds one is in all uncertainties here",
            scatter.groups
        ),
        None => format!(
            "one of {} pairs with different poses cannot be left out without losing the calibration: no other pair checks it",
            scatter.groups
        ),
    };
    Evidence {
        what: "scatter of pairs",
        remedy: "add pairs with the board elsewhere and tilted otherwise".into(),
        value: scatter.ratio,
        limit: None,
        unit: "",
        allows: if scatter.ratio.is_some() { Verdict::Pass } else { Verdict::Undecided },
        detail,
    }
}

/// Pairs with a board that do not fit the rig now standing: not those without a board, shown twice, or of a rig that
/// stood before.
pub(super) fn pairs_discarded(case: &Case) -> Evidence {
    /// Up to a third single pairs are wrong; beyond it what was kept may be the wrong choice.
    const LIMIT_PERCENT: f64 = 34.0;
    let all = case.calibration.discarded.pairs.iter();
    let contradicting: Vec<&str> = all.filter(|p| p.cause.contradicts()).map(|p| p.pair.as_str()).collect();
    let judged = case.calibration.views.len() + contradicting.len();
    let value = 100.0 * contradicting.len() as f64 / judged.max(1) as f64;
    let named: Vec<&str> = contradicting.iter().take(5).copied().collect();
    let named = if named.is_empty() { String::new() } else { format!(" ({})", named.join(", ")) };
    let remedy = "see why each is not used, and take those again";
    let detail = format!(
        "{} of {judged} pairs with corners do not fit the common rig{named}; beyond the limit the rig may have changed",
        contradicting.len()
    );
    Evidence::of_doubt("pairs discarded", remedy, [value, LIMIT_PERCENT], "%", value <= LIMIT_PERCENT, detail)
}

/// Whether the rig that was calibrated is the one that stands now.
pub(super) fn standing(case: &Case) -> Evidence {
    let standing = &case.calibration.standing;
    let after = &standing.unconfirmed;
    let before = match &standing.since {
        Some(since) => format!(
            "the rig changed while it was photographed: {} pairs are of the one before, all that is said here is of the one that stands \
             since {since}",
            standing.pairs_before
        ),
        None => "all pairs that were used are of one rig".to_owned(),
    };
    let detail = if after.is_empty() {
        format!("{before}, and the last pair is one of them")
    } else {
        format!(
            "{before}; {} came after them and contradict it: whether the rig is still the same is unknown. Add pairs",
            after.join(", ")
        )
    };
    let (what, remedy) = ("last pairs that contradict the rig", "add pairs of the rig as it stands");
    Evidence::of_doubt(what, remedy, [after.len() as f64, 0.0], "", after.is_empty(), detail)
}

pub(super) fn poses(case: &Case) -> Evidence {
    /// With fewer, leaving out one loses a fifth or more of all that is known, and one wrong pair cannot be told from
    /// the others.
    const FEWEST: f64 = 6.0;
    /// Where the lenses are known, only where the cameras stand is left to be found.
    const FEWEST_OF_KNOWN: f64 = 3.0;
    let fewest = if case.calibration.lenses_are_known() { FEWEST_OF_KNOWN } else { FEWEST };
    let groups = case.calibration.pair_scatter.groups as f64;
    let remedy = "add pairs with the board elsewhere and tilted otherwise";
    let detail = format!(
        "{} pairs were used. Few pairs cannot show one that is wrong by a little, a rig that drifts, or a lens that differs at the \
         border: with fewer than {fewest:.0} different poses each held-out pair is judged by too few others",
        case.facts.coverage.pairs
    );
    Evidence::of_doubt("pairs with poses of their own", remedy, [groups, fewest], "", groups >= fewest, detail)
}

pub(super) fn tilts(case: &Case) -> Evidence {
    /// Below, perspective hardly tells the focal length from the distance, and the lens model decides instead of the
    /// data.
    const LEAST_DEG: f64 = 5.0;
    let [horizontal, vertical] = case.facts.coverage.tilts_deg;
    let value = horizontal.max(vertical);
    let detail = format!(
        "range of the boards' tilts, {horizontal:.0} degrees about the horizontal and {vertical:.0} about the vertical axis; boards \
         that are all parallel do not tell the focal length from the distance, and lengths on them come out right even where tilted \
         ones are wrong"
    );
    let (what, remedy) = ("tilts of the boards", "add pairs tilted by 20 to 45 degrees");
    let is_kept = value >= LEAST_DEG || case.calibration.lenses_are_known();
    Evidence::of_doubt(what, remedy, [value, LEAST_DEG], "deg", is_kept, detail)
}

/// A focal length that the pictures hardly tell, or that is none of a lens; lengths elsewhere than where the boards
/// were are then anybody's guess.
pub(super) fn focal_lengths(case: &Case) -> Option<Evidence> {
    /// From corner to corner, deg. What these lens models say of a ray grows beyond all bounds towards 180, and lenses
    /// that see wider than this are calibrated with others.
    const WIDEST_DEG: f64 = 150.0;
    let Calibration { covariance, layout, .. } = case.calibration;
    let rig = case.calibration.rig();
    let remedy = "add pairs tilted by 20 to 45 degrees about both axes, at several distances";
    let undecided = |figures, unit, detail| Evidence::of_doubt("focal lengths", remedy, figures, unit, false, detail);
    let worst = worst_focal_sigma(covariance, layout, rig);
    if worst > WORST_FOCAL_SIGMA {
        let detail = "standard deviation of the focal length that the pictures tell least: boards that all lie alike do not tell it from \
                      their distance";
        return Some(undecided([100.0 * worst, 100.0 * WORST_FOCAL_SIGMA], "%", detail.to_owned()));
    }
    let seen_deg = |camera: &Camera| {
        let corner = (f64::from(camera.width) / camera.fx).hypot(f64::from(camera.height) / camera.fy);
        2.0 * (0.5 * corner).atan().to_degrees()
    };
    let widest = [&rig.left, &rig.right].into_iter().max_by(|a, b| seen_deg(a).total_cmp(&seen_deg(b)))?;
    let (seen, [fx, fy]) = (seen_deg(widest), [widest.fx, widest.fy]);
    (seen > WIDEST_DEG && !case.calibration.lenses_are_known()).then(|| {
        let detail = format!(
            "what a camera sees from corner to corner if its focal lengths are the {fx:.1} and {fy:.1} px that fit best: no lens of these \
             models does; boards that all lie alike, or that are not as flat as they are taken to be, do not tell a focal length"
        );
        undecided([seen, WIDEST_DEG], "deg", detail)
    })
}

/// Cameras that stand nearer to each other than any are built: a board whose side is in other units makes a rig that is
/// as consistent as any.
pub(super) fn baseline(case: &Case) -> Option<Evidence> {
    /// Endoscopes have 4 mm.
    const LEAST_MM: f64 = 3.0;
    let baseline_mm = case.calibration.rig().baseline_mm();
    let (what, remedy) = ("distance of the cameras", "check `--square-mm`: it is in mm, and an inch is 25.4");
    let detail =
        "cameras are wider than that: the side of the board's squares is in other units, and all lengths with it";
    let figures = [baseline_mm, LEAST_MM];
    (baseline_mm < LEAST_MM).then(|| Evidence::of_doubt(what, remedy, figures, "mm apart", false, detail.to_owned()))
}

/// Lenses that were known from some of these very pairs: what those tell counts twice, and the uncertainty is too
/// small.
pub(super) fn lenses_of_these_pairs(case: &Case) -> Option<Evidence> {
    let pairs = case.facts.lens_pairs;
    let what = "lenses known from other pairs";
    let remedy = "leave `--intrinsics` away, or give it a calibration from other pictures";
    let figures = [pairs.same as f64, 0.5 * pairs.of as f64];
    let line = |detail| Evidence::of_doubt(what, remedy, figures, "pairs that are the same", false, detail);
    pairs.statement().filter(|_| pairs.are_many()).map(line)
}

/// Name of the line on lenses that were known beforehand.
pub const KNOWN_LENSES: &str = "known lenses";

/// Whether the pictures agree with lenses that were known.
pub(super) fn known_lenses(case: &Case) -> Option<Evidence> {
    let check = case.calibration.lens_check.as_ref()?;
    let seen: Vec<String> = Side::BOTH
        .into_iter()
        .filter_map(|side| Some(format!("{} {} %", side.name(), two_digits(100.0 * check.focus_seen[side as usize]?))))
        .collect();
    let detail = format!(
        "{}: squared difference of {} known numbers from what the pictures give by themselves, in units of its covariance. Nineteen of \
         twenty such tests see a focal length that differs by {}",
        check.statement,
        check.numbers,
        seen.join(", ")
    );
    let figures = [check.chi_square, check.limit];
    Some(Evidence::of_doubt(KNOWN_LENSES, check.remedy(), figures, "", !check.contradicts(), detail))
}

/// Depth and field: what lies beyond is extrapolated; within, the uncertainty of lengths says what it costs.
pub(super) fn reach(case: &Case) -> [Evidence; 2] {
    let [near, far] = case.facts.coverage.depths_mm;
    let [left, right] = case.facts.coverage.field_shares;
    let line = |what, value, unit, detail| Evidence {
        what,
        value: Some(value),
        limit: None,
        unit,
        allows: Verdict::Pass,
        detail,
        remedy: "".into(),
    };
    [
        line(
            "depth of the working volume",
            far - near,
            "mm",
            format!(
                "the middles of the boards stood {near:.0} to {far:.0} mm away; much nearer and farther the rig was not checked"
            ),
        ),
        line(
            "field reached by corners",
            100.0 * left.min(right),
            "%",
            format!(
                "of what both cameras see corners reached {:.0} % of the left and {:.0} % of the right picture; in the rest the lens model is extrapolated and \
                 was not checked",
                100.0 * left,
                100.0 * right
            ),
        ),
    ]
}
