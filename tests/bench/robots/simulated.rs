//! Simulated arms: is the promised accuracy the realised one, and is the result ever worse than nominal?

use stereocal::identify::Settings;
use stereocal::identify::data::dataset::{Dataset, Reading};
use stereocal::identify::judge::choose::identify;
use stereocal::identify::judge::errors::Judge;
use stereocal::identify::model::uncertainty::Expected;
use stereocal::identify::settings::Method;
use stereocal::robot::Robot;

use crate::worlds::{Plan, arms, measured};

/// One line a case.
pub fn table(runs: u64) {
    println!(
        "\npoint errors against the truth, mm, over {runs} runs: nominal, identified, promised / realised, worse than nominal, than 1.1 times nominal"
    );
    for (name, nominal) in arms() {
        for (what, plan) in [
            ("60 poses", Plan { samples: 60, verify: 100, noise_mm: 0.02, error_mm: 0.5, error_mrad: 1.0 }),
            ("20 poses, 0.1 mm", Plan { samples: 20, verify: 100, noise_mm: 0.1, error_mm: 0.3, error_mrad: 0.3 }),
            ("8 poses, 0.1 mm", Plan { samples: 8, verify: 100, noise_mm: 0.1, error_mm: 0.3, error_mrad: 0.3 }),
            (
                "20 poses, perfect robot",
                Plan { samples: 20, verify: 100, noise_mm: 0.1, error_mm: 0.0, error_mrad: 0.0 },
            ),
            (
                "12 poses, perfect robot",
                Plan { samples: 12, verify: 100, noise_mm: 0.1, error_mm: 0.0, error_mrad: 0.0 },
            ),
        ] {
            line(name, what, &nominal, plan, runs);
        }
    }
}

fn line(name: &str, what: &str, nominal: &Robot, plan: Plan, runs: u64) {
    let settings = Settings { method: Some(Method::TrustRegion), ..Settings::default() };
    let (mut before, mut after, mut ratio, mut promised) = (0.0, 0.0, 0.0, 0);
    let (mut worse, mut much_worse, mut refused) = (0, 0, 0);
    for seed in 1..=runs {
        let (nominal, truth, rows) = measured(nominal, plan, seed);
        let set = Dataset::new(&rows, 1).expect("rows");
        let Ok(found) = identify(&set, &nominal, &settings, 1, &|_| {}) else {
            refused += 1;
            continue;
        };
        let robot = &found.candidates[found.chosen].robot;
        let errors = [&nominal, robot].map(|robot| against_truth(&set, &truth, robot));
        before += errors[0];
        after += errors[1];
        worse += usize::from(errors[1] > errors[0] * (1.0 + 1e-9));
        much_worse += usize::from(errors[1] > 1.1 * errors[0]);
        if let Some((formulation, _)) = &found.candidates[found.chosen].found {
            let expected = Expected::new(formulation, &set, &found.fitted);
            ratio += expected.of_robot_mm / errors[1];
            promised += 1;
        }
    }
    let done = (runs as usize - refused).max(1) as f64;
    println!(
        "{name:12} {what:26} {:8.4} {:8.4} {:8.2} {worse:4} {much_worse:4}  refused {refused}",
        before / done,
        after / done,
        ratio / f64::from(promised.max(1)),
    );
}

/// Mean error of points at the verify rows with no noise, after one rigid fit of the robot to the truth at all of them.
fn against_truth(set: &Dataset, truth: &Robot, robot: &Robot) -> f64 {
    let mut exact = set.clone();
    for pose in &mut exact.poses {
        if let Reading::Position { point_mm, .. } = &mut pose.reading {
            *point_mm = truth.target_mm(&pose.joints_rad);
        }
    }
    let rows = exact.verify_rows();
    let errors = Judge::plain(&exact, &rows, true).errors(robot, &rows);
    errors.iter().filter_map(|e| e.point_mm).map(|p| p.norm()).sum::<f64>() / errors.len().max(1) as f64
}
