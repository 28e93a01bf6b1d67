//! Time with all methods, and whether the result depends on the seed or on the number of threads.

use std::time::Instant;

use stereocal::identify::Settings;
use stereocal::identify::data::dataset::Dataset;
use stereocal::identify::examine::{self, Examined};
use stereocal::identify::run::{Identification, identify};
use stereocal::robot::Robot;

use crate::worlds::{Beyond, Plan, arms, measured};

/// Seeds that must all choose the same.
const SEEDS: u64 = 10;

/// One line a size, then seeds and threads.
pub fn table() {
    println!("\nseconds from rows to robot with all methods, 2 threads");
    for (what, samples, groups, beyond, wanted) in [
        ("300 rows", 300, 1, Beyond::Nothing, 1.5),
        ("4000 rows", 4000, 1, Beyond::Nothing, 10.0),
        ("4000 rows, 4 placements off", 4000, 4, Beyond::Common, 10.0),
        ("100 groups of 12", 1200, 100, Beyond::Nothing, 10.0),
        ("100 groups of 40, off", 4000, 100, Beyond::Common, 10.0),
    ] {
        let plan = Plan { samples, groups, beyond, verify: 50.max(groups), ..Plan::default() };
        let (nominal, _, rows) = measured(&arms()[0].1, plan, 1);
        let set = Dataset::new(&rows).expect("rows");
        let start = Instant::now();
        threads(2, &|| whole(&set, &nominal, 1));
        println!("{what:28} {:6.2} (wanted {wanted})", start.elapsed().as_secs_f64());
    }
    for (name, nominal) in arms() {
        let (nominal, _, rows) = measured(&nominal, Plan::default(), 1);
        let set = Dataset::new(&rows).expect("rows");
        let choice = |found: &Identification| {
            let chosen = &found.candidates[found.chosen];
            format!("{}/{} {}", chosen.name, chosen.model.name(), found.terms.name())
        };
        let mut choices: Vec<String> = (1..=SEEDS).map(|seed| choice(&whole(&set, &nominal, seed))).collect();
        choices.dedup();
        let robots = [1, 2].map(|count| {
            let found = threads(count, &|| whole(&set, &nominal, 1));
            found.candidates.iter().map(|c| c.robot.clone()).collect::<Vec<_>>()
        });
        let same = if robots[0] == robots[1] { "the same" } else { "NOT the same" };
        println!("{name:18} over {SEEDS} seeds: {}; 1 and 2 threads: {same}", choices.join(" and "));
    }
}

fn whole(set: &Dataset, nominal: &Robot, seed: u64) -> Identification {
    let settings = Settings::default();
    let Examined { set, robot: nominal, .. } = examine::examine(set, nominal, &settings, &|_| {});
    identify(&set, &nominal, &settings, seed, &|_| {}).expect("it is enough")
}

fn threads<T: Send>(count: usize, run: &(dyn Fn() -> T + Sync)) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(count).build().expect("threads").install(run)
}
