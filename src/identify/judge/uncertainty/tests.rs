use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use super::*;
use crate::geometry::fitted_frame;
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

/// Touches leave the robot's scale as it is in its file, and what moves all touches of a socket alike shows in none:
/// both are errors of the robot all the same.
#[test]
fn what_touches_promise_holds_wherever_the_robot_goes() {
    let (mut below, mut all) = (0, 0);
    for seed in 1..9 {
        let (world, _) = synthetic::touched(0.0, seed);
        let (set, found) = world.identified(&world.rows);
        let promised_mm = Expected::new(found.formulation().unwrap(), &set, &found.fitted, &[]).p95_mm;
        let pairs = set.poses.iter().map(|pose| {
            let of = |robot: &Robot| robot.target_mm(&pose.joints_rad);
            (of(found.robot()), of(&world.truth), 1.0)
        });
        let frame = fitted_frame(pairs.clone());
        below += pairs.clone().filter(|(found, truth, _)| (frame * found - truth).norm() < promised_mm).count();
        all += set.poses.len();
    }
    assert!(below as f64 > 0.93 * all as f64, "{below} of {all}");
}

/// A robot that comes back to the same few poses says no more of its links than once, however well it repeats there.
#[test]
fn poses_that_were_visited_again_and_again_promise_no_more() {
    for jitter_deg in [0.0005, 0.01, 0.5] {
        let (mut below, mut all) = (0, 0);
        for seed in 200..206 {
            let mut world = synthetic::planned(4 * 8, 160, 25.0, 0.02, seed, &|_| {});
            world.rows.retain(|row| row.at.group == "g0" && row.at.role != Role::Center);
            let mut random = Pcg64Mcg::seed_from_u64(seed);
            for visit in 1..5 {
                for mut row in world.rows.clone().into_iter().filter(|row| row.at.role == Role::Sample).take(8) {
                    let by = [synthetic::normal(&mut random), synthetic::normal(&mut random)];
                    let by = by.iter().flat_map(|by| by.iter().copied().collect::<Vec<f64>>());
                    row.at.joints_deg.iter_mut().zip(by).for_each(|(q, by)| *q += jitter_deg * by);
                    let joints: Vec<f64> = row.at.joints_deg.iter().map(|q| q.to_radians()).collect();
                    row.at.pose = format!("{}-{visit}", row.at.pose);
                    *synthetic::point(&mut row) =
                        synthetic::sensor(0) * world.truth.target_mm(&joints) + 0.02 * synthetic::normal(&mut random);
                    world.rows.push(row);
                }
            }
            let (set, found) = world.identified(&world.rows);
            let Some(formulation) = found.formulation() else { continue };
            let promised_mm = Expected::new(formulation, &set, &found.fitted, &[]).p95_mm;
            let errors = Judge::plain(&set, &found.fitted, false).errors(found.robot(), &set.verify_rows());
            let errors_mm: Vec<f64> = errors.iter().filter_map(|error| Some(error.point_mm?.norm())).collect();
            below += errors_mm.iter().filter(|mm| **mm < promised_mm).count();
            all += errors_mm.len();
        }
        let share = below as f64 / all as f64;
        assert!(share > 0.96 && all > 150, "{jitter_deg} deg: {share} of {all}");
    }
}

/// What is promised holds the instrument's noise where nothing is stated of it, and says that it does not where it is.
#[test]
fn what_is_promised_says_whether_the_instruments_noise_is_in_it() {
    for stated in [false, true] {
        let mut world = synthetic::planned(240, 60, 25.0, 0.1, 3, &|_| {});
        synthetic::state(&mut world.rows, |_| stated.then(|| Matrix3::from_diagonal_element(0.1 * 0.1)));
        let (set, found) = world.identified(&world.rows);
        let expected = Expected::new(found.formulation().unwrap(), &set, &found.fitted, &[]);
        let said = expected.parts();
        let errors = Judge::plain(&set, &found.fitted, false).errors(found.robot(), &set.verify_rows());
        let errors_mm: Vec<f64> = errors.iter().filter_map(|error| Some(error.point_mm?.norm())).collect();
        let mean_mm = errors_mm.iter().sum::<f64>() / errors_mm.len() as f64;
        let noise_mm = MEAN_OVER_RMS * 3f64.sqrt() * expected.stated_mm.unwrap_or(0.0);
        let ratio = expected.mean_mm.hypot(noise_mm) / mean_mm;
        assert!((0.8..1.3).contains(&ratio), "{stated}: {mean_mm} mm, {said}");
        assert_eq!(said.contains("instrument"), !stated, "{said}");
        assert_eq!(said.contains("their own noise, too (standard deviation 0.1000 mm)"), stated, "{said}");
        assert!(!stated || expected.mean_mm < 0.8 * mean_mm, "{mean_mm} mm, {said}");
    }
}

/// Any joint may be the one that was hardly turned, the first as well: where its axis is, its turns alone show.
#[test]
fn a_joint_that_was_hardly_turned_is_named() {
    let robot = Robot::paper();
    let wide = vec![[-60.0, 70.0]; 6];
    assert!(near_only(&robot, &wide).is_empty());
    for joint in 0..6 {
        for half_deg in [0.0, 1.0, 5.0, 14.0] {
            let mut ranges = wide.clone();
            ranges[joint] = [20.0 - half_deg, 20.0 + half_deg];
            let named = near_only(&robot, &ranges);
            assert!(named.len() == 1 && named[0].starts_with(&format!("j{} ", joint + 1)), "{named:?}");
        }
    }
}
