use super::*;
use crate::identify::synthetic;
use crate::measurements::Role;

#[test]
fn poses_that_were_fitted_are_no_better_known_than_others_like_them() {
    for samples in [12, 20, 50] {
        let (mut of_fitted, mut of_others) = (0.0, 0.0);
        for seed in 1..5 {
            let mut world = synthetic::planned(4 * samples, 160, 25.0, 0.1, seed, &|_| {});
            world.rows.retain(|row| row.at.group == "g0" && row.at.role != Role::Center);
            let (set, found) = world.identified(&world.rows);
            let Some(formulation) = found.formulation() else { continue };
            let at = |rows: &[usize]| Expected::at(formulation, &set, &found.fitted, rows).of_robot_mm;
            of_fitted += at(&found.fitted);
            of_others += at(&set.verify_rows());
        }
        let ratio = of_fitted / of_others;
        assert!((0.6..1.6).contains(&ratio), "{samples} rows: {of_fitted} mm at them, {of_others} mm at others");
    }
}
