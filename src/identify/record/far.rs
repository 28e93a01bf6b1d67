//! Errors that no robot has: of the nominal robot where it is kept, and of rows that the fit did not have beside those that it had.
//!
//! In: the figures of the record. Out: what then speaks against the result. What goes wrong: readings that scatter by millimetres, and hide as
//! much.

use super::advice::IMPLAUSIBLE_MM;
use super::file::Record;
use super::quality::PointSpread;
use crate::identify::data::dataset::Dataset;
use crate::identify::examine::conventions;
use crate::identify::finding::Finding;
use crate::identify::run::Identification;

/// Times what the fit promises, and what it left, that errors of other rows are not for want of rows.
const FAR: f64 = 20.0;

impl Record {
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
        if off < FAR * left.max(expected) || off < conventions::IMPLAUSIBLE_MM {
            return None;
        }
        let which = if self.folded { "rows that were left out of the fit" } else { "the verify rows" };
        let said = format!(
            "{which} are off by {off:.3} mm on average, those of the fit by {left:.3} mm: they were misread, or are not of the robot that was fitted"
        );
        let rows = set.names(&found.verify_outliers);
        Some(Finding::new(said, "look at these rows, or measure others").about(rows))
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

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::identify::examine::sessions::Along;
    use crate::identify::judge::errors::Spread;
    use crate::identify::record::Findings;
    use crate::identify::synthetic::{self, planned, point};
    use crate::measurements::Role;
    use crate::robot::Advice;

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
