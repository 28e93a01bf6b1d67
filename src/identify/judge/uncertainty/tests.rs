use super::*;
use crate::identify::judge::errors::Judge;
use crate::identify::run::Identification;
use crate::identify::synthetic;
use crate::measurements::Role;

/// What so many rows of one sphere tell, and rows of it to verify.
fn of_one_sphere(samples: usize, seed: u64) -> (Dataset, Identification) {
    let mut world = synthetic::planned(4 * samples, 160, 25.0, 0.1, seed, &|_| {});
    world.rows.retain(|row| row.at.group == "g0" && row.at.role != Role::Center);
    world.identified(&world.rows)
}

#[test]
fn poses_that_were_fitted_are_no_better_known_than_others_like_them() {
    for samples in [12, 50] {
        let (mut of_fitted, mut of_others) = (0.0, 0.0);
        for seed in 1..5 {
            let (set, found) = of_one_sphere(samples, seed);
            let Some(formulation) = found.formulation() else { continue };
            let at = |rows: &[usize]| Expected::at(formulation, &set, &found.fitted, rows).of_robot_mm;
            of_fitted += at(&found.fitted);
            of_others += at(&set.verify_rows());
        }
        let ratio = of_fitted / of_others;
        assert!((0.6..1.6).contains(&ratio), "{samples} rows: {of_fitted} mm at them, {of_others} mm at others");
    }
}

/// Few rows tell their scatter badly: a fit that follows them by chance is no better for it.
#[test]
fn nineteen_of_twenty_errors_at_fresh_poses_are_below_what_is_promised() {
    for samples in [10, 16] {
        let (mut below, mut all) = (0, 0);
        for seed in 100..130 {
            let (set, found) = of_one_sphere(samples, seed);
            let Some(formulation) = found.formulation() else { continue };
            let fresh = set.verify_rows();
            let p95_mm = Expected::at(formulation, &set, &found.fitted, &fresh).p95_mm;
            let errors = Judge::plain(&set, &found.fitted, false).errors(found.robot(), &fresh);
            let errors_mm: Vec<f64> = errors.iter().filter_map(|error| Some(error.point_mm?.norm())).collect();
            below += errors_mm.iter().filter(|mm| **mm < p95_mm).count();
            all += errors_mm.len();
        }
        let share = below as f64 / all as f64;
        assert!((0.93..0.98).contains(&share) && all > 900, "{samples} rows: {share} of {all}");
    }
}
