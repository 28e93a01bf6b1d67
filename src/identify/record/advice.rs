//! Whether to use the robot that was found, and the warnings in the order of their weight.
//!
//! In: the record as it is, and what was found. What goes wrong: readings that scatter by millimetres, and hide errors
//! that no robot has.

use nalgebra::Point3;

use super::file::Record;
use super::findings::{self, Findings};
use super::parameters::MethodRecord;
use super::quality::PointSpread;
use super::{plausible, rounded, untested};
use crate::identify::data::dataset::{Dataset, Kind};
use crate::identify::data::{still, unused};
use crate::identify::examine::conventions;
use crate::identify::examine::in_hand::most_points;
use crate::identify::finding::Finding;
use crate::identify::judge::errors::Spread;
use crate::identify::run::{Against, Identification};
use crate::identify::sensor::REPEATABILITY_MM;
use crate::robot::{Advice, Robot};

/// Error of a nominal robot, mm, beyond which units or robots are mixed up: built robots are off by a few mm.
const IMPLAUSIBLE_MM: f64 = 20.0;

/// Times what the fit promises, and what it left, that errors of other rows are not for want of rows.
const FAR_OFF: f64 = 20.0;

impl Record {
    /// The reason with what to do about it, as the warnings have it.
    pub fn whole_reason(&self) -> &str {
        let reason = self.reason.as_str();
        self.warnings
            .iter()
            .map(String::as_str)
            .find(|said| !reason.is_empty() && said.starts_with(reason))
            .unwrap_or(reason)
    }

    /// Whether the robot is known near the poses that were measured only.
    pub fn is_near_only(&self) -> bool {
        self.expected.as_ref().is_some_and(|expected| !expected.near_only.is_empty())
    }

    /// Fills in the advice, its reason and the warnings.
    pub(super) fn advise(
        &mut self,
        set: &Dataset,
        nominal: &Robot,
        found: &Identification,
        findings: &Findings,
        rows: Against,
    ) {
        let worse = self.worse(rows);
        // What speaks against the rows is why they are far off.
        let far = self.far_off(set, found).filter(|_| findings.against.is_empty());
        let kept = found.formulation().is_none().then(|| self.kept_nominal(found));
        let sentences = |list: &[Finding]| list.iter().map(Finding::sentence).collect::<Vec<_>>();
        // Points that nobody measured say nothing of a robot, whatever else is odd about them.
        let computed = || self.computed(set).or_else(|| self.predicted(set, nominal));
        let computed = computed().or_else(|| rounded::as_closely_as_digits(set, found));
        let of_data = sentences(findings.beyond.as_slice()).into_iter().chain(sentences(&findings.doubts));
        let mut doubts: Vec<String> = computed.iter().cloned().chain(of_data).collect();
        doubts.extend(self.implausible(set, nominal));
        // What speaks against the result is why its figures are odd, whatever the number of rows.
        doubts.extend(self.promise(set, nominal).filter(|_| findings.against.is_empty() && far.is_none()));
        doubts.extend(untested::still(set, &found.outliers));
        doubts.extend(untested::one_orientation(set, nominal, found));
        doubts.extend(self.at_limit(found));
        let against = findings.against.first().or(far.as_ref()).map(|finding| finding.finding.clone());
        // A robot file that does not count as the table does is not one to go on with.
        let mended =
            findings.doubts.iter().find(|finding| finding.of_joints && computed.is_none()).map(Finding::sentence);
        let doubt = if kept.is_some() { mended } else { doubts.first().cloned() };
        (self.advice, self.reason) = match (against.or(worse.clone()), doubt, &kept) {
            (Some(reason), ..) => (Advice::DoNotUse, reason),
            (None, Some(doubt), _) => (Advice::Check, doubt),
            (None, None, Some(reason)) => (Advice::KeepNominal, computed.as_ref().unwrap_or(reason).clone()),
            (None, None, None) => (Advice::Use, String::new()),
        };
        self.is_beyond = self.advice == Advice::Check && findings.beyond.is_some();
        self.is_computed = computed.is_some();
        if self.advice == Advice::DoNotUse {
            self.of_catalogue = plausible::of_catalogue(set, nominal);
        }
        self.warnings = findings.against.iter().chain(&far).map(Finding::sentence).collect();
        self.warnings.extend(worse);
        self.warnings.extend(kept.filter(|_| self.advice != Advice::DoNotUse));
        self.warnings.extend(doubts);
        self.warnings.extend(sentences(&findings.notes));
        self.warnings.extend(self.zero_of_readings(found));
        self.warnings.extend(sentences(&unused::unused(set)));
        self.warnings.extend(self.undetermined());
    }

    /// What is farther off than a robot can be, if anything.
    pub(super) fn far_off(&self, set: &Dataset, found: &Identification) -> Option<Finding> {
        match found.formulation() {
            None => [&self.before.fit, self.before.judged()].into_iter().find_map(of_nominal),
            Some(_) => self.of_other_rows(set, found),
        }
    }

    fn of_other_rows(&self, set: &Dataset, found: &Identification) -> Option<Finding> {
        let figures = &self.chosen_method()?.quality;
        let (off, _) = size_mm(figures.judged())?;
        let (left, _) = size_mm(&figures.fit)?;
        let expected = self.expected.as_ref().map_or(0.0, |expected| expected.mean_mm);
        if off < FAR_OFF * left.max(expected) || off < conventions::IMPLAUSIBLE_MM {
            return None;
        }
        let which = if self.folded { "rows that were left out of the fit" } else { "the verify rows" };
        let said = format!(
            "{which} are off by {off:.3} mm on average, those of the fit by {left:.3} mm: they were misread, or are not of the robot that was fitted"
        );
        let rows = set.names(&found.verify_outliers);
        Some(Finding::new(said, "look at these rows, or measure others").about(rows))
    }

    /// A nominal robot that is farther off than built ones are. The tool is a free number, and usually unknown: what is
    /// left once it is solved counts.
    fn implausible(&self, set: &Dataset, nominal: &Robot) -> Option<String> {
        let before = self.with_tool_mm(set, nominal).or(self.before.judged().distance.mean_abs_mm);
        let before = before.filter(|&off| off > IMPLAUSIBLE_MM)?;
        Some(format!(
            "the nominal robot is off by {before:.0} mm in the middle of the rows, which is implausible for a real robot: check that the lengths \
             are mm, the angles deg, and that the robot file is of the robot that was measured"
        ))
    }

    /// Points that a chain of links predicts as no instrument measures them.
    fn computed(&self, set: &Dataset) -> Option<String> {
        /// Two digits of the last place that is printed, where that is a hundredth of a mm: no arm keeps to a chain of
        /// links so well. Nor does an instrument read the points of one to two micrometres, whatever is printed.
        const PRINTED_MM: f64 = 0.01;
        const READ_MM: f64 = 0.001;
        let points: Vec<Point3<f64>> = set.poses.iter().filter_map(|pose| pose.reading.point_mm()).collect();
        let is_printed = |v: &f64| (v / PRINTED_MM - (v / PRINTED_MM).round()).abs() < 1e-5;
        let limit_mm =
            2.0 * if points.iter().flat_map(|point| point.iter()).all(is_printed) { PRINTED_MM } else { READ_MM };
        let largest = |figures: &PointSpread| figures.point.as_ref().and_then(|spread| spread.max_abs_mm);
        let held_out_mm = largest(self.chosen_method().map_or(&self.before, |method| &method.quality).judged())?;
        // What is left where the numbers are twice the unknowns is no better for being fitted, and free of what
        // rounding does to rows left out.
        let redundant = |m: &&MethodRecord| 3 * points.len() >= 2 * (m.parameters.len() + 6 * set.groups.len());
        let left_mm = self.chosen_method().filter(redundant).and_then(|method| largest(&method.quality.fit));
        let largest_mm = held_out_mm.min(left_mm.unwrap_or(f64::INFINITY));
        if largest_mm >= limit_mm {
            return None;
        }
        Some(format!(
            "the largest error is {:.2} um, and no instrument measures an arm so: these points were computed, by the robot's controller or in a \
             simulation; only points that were measured show how a robot was built",
            1000.0 * largest_mm
        ))
    }

    /// Points that the nominal robot, its tool solved, predicts better than arms come back to them. Where the wrist alone
    /// moved it does so of an arm as it is built, too: what is off in the rest of it moves all points alike.
    fn predicted(&self, set: &Dataset, nominal: &Robot) -> Option<String> {
        /// Joints of a wrist.
        const OF_WRIST: usize = 3;
        let moved = (0..set.joint_count()).filter(|&joint| still::way(set, joint) > still::STILL).count();
        let of_points = self.with_tool_mm(set, nominal).filter(|_| set.kind == Kind::Positions && moved > OF_WRIST);
        let left_mm = of_points.filter(|left| *left < REPEATABILITY_MM)?;
        Some(format!(
            "with the right tool the nominal robot is off by {left_mm:.4} mm in the middle of the rows, less than arms repeat to: these points \
             were computed, by the robot's controller or in a simulation; only points that were measured show how a robot was built"
        ))
    }

    /// What is left of the nominal robot once its tool is solved, mm in the middle of the rows.
    fn with_tool_mm(&self, set: &Dataset, nominal: &Robot) -> Option<f64> {
        let (joints, points) = most_points(set);
        self.tool_mm.map(|(_, left)| left).or_else(|| nominal.left_mm(&joints, &points))
    }

    /// An expected error that the rows themselves contradict: those left out miss by several times as much, or miss by
    /// more than the nominal robot does with a tool of its own, or the nominal robot is off by less.
    fn promise(&self, set: &Dataset, nominal: &Robot) -> Option<String> {
        /// Beyond what leaving a row out costs where unknowns are half of the numbers.
        const SEVERAL: f64 = 3.0;
        const ANOTHER_STATE: &str = "they were misread, or are of another state of the robot than the fitted rows, as where a joint was mastered \
                                     anew in between; look at these rows, or measure others";
        /// What is expected holds the scatter of the readings, which the nominal robot's errors hold as well.
        const FAR: f64 = 2.0;
        let (chosen, expected_mm) = (self.chosen_method()?, self.expected.as_ref()?.mean_mm);
        let mean = |figures: &PointSpread| figures.point.as_ref().and_then(|spread| spread.mean_abs_mm);
        let held_out_mm = mean(chosen.quality.judged());
        let (rows, poses) = (set.fit_rows().len(), still::by_pose(set, set.fit_rows()).len());
        let few = if poses < rows {
            format!(
                "the {rows} rows are of {poses} poses only, too few for so many unknowns; measure others, that bend every joint"
            )
        } else {
            "there are too few rows for so many unknowns; measure more, that bend every joint".to_owned()
        };
        if let Some(off) = held_out_mm.filter(|off| *off > SEVERAL * expected_mm) {
            // Where rows are no fewer than half as many more as are needed, what is expected holds what they leave
            // open.
            let unknowns = chosen.parameters.len() + 6 * set.groups.len();
            let why = if self.folded || 3 * rows < 2 * unknowns { few.as_str() } else { ANOTHER_STATE };
            return Some(format!(
                "rows that the fit did not have are off by {off:.3} mm, expected are {expected_mm:.3} mm: {why}"
            ));
        }
        let nominal_mm = self.with_tool_mm(set, nominal).filter(|_| held_out_mm.is_some());
        if let Some((off, nominal)) = held_out_mm.zip(nominal_mm).filter(|(off, nominal)| *off > SEVERAL * nominal) {
            return Some(format!(
                "rows that the fit did not have are off by {off:.3} mm, and with a tool of its own the nominal robot is off by {nominal:.3} mm only: {few}"
            ));
        }
        let before = self.before.judged();
        let before_mm = mean(before).or(before.distance.mean_abs_mm)?;
        let (before_mm, tool) = match self.tool_mm {
            Some((_, left_mm)) if left_mm < before_mm => (left_mm, "with a tool of its own "),
            _ => (before_mm, ""),
        };
        (expected_mm > FAR * before_mm).then(|| {
            format!("the identified robot is expected to be off by {expected_mm:.3} mm, and {tool}the nominal one is off by {before_mm:.3} mm only: {few}")
        })
    }

    /// Parameters whose search ended at its limit.
    fn at_limit(&self, found: &Identification) -> Option<String> {
        let chosen = self.chosen_method().filter(|_| found.formulation().is_some())?;
        let reached = chosen.parameters.iter().filter(|p| p.at_bound).map(|p| p.name.as_str());
        let list = reached.collect::<Vec<&str>>().join(", ");
        (!list.is_empty()).then(|| format!("{list} reached the search limit: the best value may lie beyond it"))
    }

    fn zero_of_readings(&self, found: &Identification) -> Option<String> {
        let zero_mm = found.formulation()?.zero_sigma_mm().unwrap_or(0.0);
        // What is expected of the robot holds what its size is uncertain by for want of the zero.
        let scatter_mm = self.expected.as_ref().map_or(f64::INFINITY, |e| e.scatter_mm);
        (zero_mm > scatter_mm && findings::zero(found).is_none()).then(|| {
            format!(
                "the distances are too similar to separate an offset of the readings from a robot of another size: the offset is known to \
                 {zero_mm:.2} mm only; measure at distances that differ, or set `wire_offset = false` where the offset is zero"
            )
        })
    }

    /// What the poses do not determine.
    fn undetermined(&self) -> Vec<String> {
        let mut list = Vec::new();
        let i = &self.identifiability;
        if !i.zero.is_empty() {
            let stay = if i.zero.len() == 1 { "it stays" } else { "they stay" };
            list.push(format!("these poses do not determine {}: {stay} nominal", i.zero.join(", ")));
        }
        if !i.dependent.is_empty() {
            list.push(format!(
                "only these sums are determined: {}; the correction of each is split by tolerance",
                shortened(&i.dependent)
            ));
        }
        if !i.weak.is_empty() {
            let weak = i.weak.join(", ");
            list.push(format!(
                "the data hardly determine {weak}: the correction comes from the manufacturing tolerance"
            ));
        }
        if !self.widened.is_empty() {
            list.push(format!("far from nominal: {}; the search limits were widened", self.widened.join(", ")));
        }
        list
    }

    /// Where rows that took no part in the fit find the chosen robot worse than the nominal one.
    fn worse(&self, rows: Against) -> Option<String> {
        let chosen = self.chosen_method()?;
        let pair = |before: &Spread, after: &Spread| Some((before.mean_abs_mm?, after.mean_abs_mm?));
        let (before, after) = (self.before.judged(), chosen.quality.judged());
        let of_points = || pair(before.point.as_ref()?, after.point.as_ref()?);
        let figures = of_points().or_else(|| pair(&before.distance, &after.distance));
        let figures =
            figures.map_or_else(String::new, |(before, after)| format!(" ({after:.3} against {before:.3} mm)"));
        let on = if self.folded { "rows that were left out of the fit" } else { "the verify rows" };
        match rows {
            Against::NotWorse => None,
            Against::Perhaps => Some(format!(
                "on {on} the identified robot is no better than the nominal one{figures}, by less than chance explains: measure \
                 more rows before you use it"
            )),
            Against::Worse => Some(format!(
                "on {on} the identified robot is worse than the nominal one{figures}, by more than chance explains"
            )),
        }
    }

    /// Why the nominal robot was kept, with what the best of the others has on the same rows.
    fn kept_nominal(&self, found: &Identification) -> String {
        if found.vetoed {
            return "on the verify rows the identified robot is worse than the nominal one by more than chance explains: the nominal robot \
                    is kept"
                .to_owned();
        }
        let nominal = self.judged.iter().find(|j| j.terms == self.terms).and_then(|j| j.held_out_mm);
        let others = self.judged.iter().filter(|j| j.terms != self.terms);
        let best = others.filter_map(|j| Some((j.held_out_mm?, &j.terms))).min_by(|a, b| a.0.total_cmp(&b.0));
        match (nominal, best) {
            (Some(nominal), Some((best, terms))) if best < nominal => format!(
                "the nominal robot is kept: the best other model, {terms}, has {best:.4} mm on held-out samples against {nominal:.4} mm, \
                 which is no significant gain"
            ),
            _ => "the nominal robot is kept: no model predicts held-out samples better".to_owned(),
        }
    }
}

/// That the nominal robot, which nothing is better than, is off by more than robots are.
fn of_nominal(figures: &PointSpread) -> Option<Finding> {
    let (mean, most) = size_mm(figures).filter(|(mean, _)| *mean > IMPLAUSIBLE_MM)?;
    let said = format!(
        "no model is better than the nominal robot, which is off by {mean:.1} mm on average and by {most:.1} mm at most, farther than robots are \
         built: some rows are no readings, or robot file and rows do not belong together"
    );
    Some(Finding::new(said, "look at the rows that are farthest off, and mend or remove them"))
}

/// Mean and largest error: of points where there are any, else of distances.
fn size_mm(figures: &PointSpread) -> Option<(f64, f64)> {
    let spread = figures.point.as_ref().unwrap_or(&figures.distance);
    Some((spread.mean_abs_mm?, spread.max_abs_mm?))
}

/// A list of which the first are said.
fn shortened(list: &[String]) -> String {
    const SAID: usize = 6;
    match list.len() {
        0..=SAID => list.join("; "),
        n => format!("{}; and {} more", list[..SAID].join("; "), n - SAID),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::identify::examine::sessions::Along;
    use crate::identify::synthetic::{self, planned, point};
    use crate::measurements::Role;

    /// The advice where so many of the verify rows are off by this, mm, each in its own direction.
    fn advised(count: usize, by_mm: f64) -> Record {
        let mut world = planned(60, 30, 25.0, 0.02, 5, &|_| {});
        let verify = world.rows.iter_mut().filter(|row| row.at.role == Role::Verify);
        for (k, row) in verify.enumerate().take(count) {
            let t = k as f64;
            *point(row) += by_mm * Vector3::new(t.sin(), t.cos(), 0.5);
        }
        let (set, found) = world.identified(&world.rows);
        let along = Along::default();
        let findings = Findings::new(Vec::new(), (Vec::new(), None), Vec::new(), &along, &set, &found);
        Record::new(&set, &world.nominal, &found, &along, findings, &synthetic::settings(), 1)
    }

    #[test]
    fn verify_rows_that_are_far_off_speak_against_the_result() {
        assert_eq!(advised(0, 0.0).advice, Advice::Use);
        // One is a stray.
        assert_eq!(advised(1, 300.0).advice, Advice::Check);
        for by_mm in [10.0, 100.0, 3000.0] {
            let record = advised(8, by_mm);
            assert_eq!(record.advice, Advice::DoNotUse, "{by_mm}: {:?}", record.warnings);
            assert!(record.reason.starts_with("the verify rows are off by"), "{}", record.reason);
        }
    }

    #[test]
    fn a_nominal_robot_that_is_kept_and_far_off_is_named() {
        let of = |errors: &[f64]| PointSpread {
            distance: Spread::new(errors.iter().copied()),
            point: Some(Spread::new(errors.iter().copied())),
            consistency: None,
            distortion: None,
        };
        assert_eq!(of_nominal(&of(&[1.0, 2.0, 8.0])), None);
        assert_eq!(of_nominal(&of(&[1.0, 2.0, 50.0])), None);
        for far in [150.0, 3000.0] {
            let said = of_nominal(&of(&[2.0, 3.0, far])).unwrap().sentence();
            assert!(said.contains("farther than robots are built"), "{said}");
        }
    }
}
