//! A few of the planted faults of `cargo bench --bench faults`, on small pictures: none of them may pass falsely.

#[path = "../bench/faults/matrix/mod.rs"]
#[expect(dead_code, reason = "the benchmark uses all of it")]
pub mod matrix;

use std::path::Path;

use matrix::judge::{Judgement, judge};
use matrix::set::Studio;

/// Width of the pictures, px.
const SIZE_PX: u32 = 640;

const SEED: u64 = 3;

/// One of each class whose answer was wrong once.
const CHOSEN: [&str; 5] = [
    "rig moved/zoom 0.10 % after 6 of 12",
    "out of step/interlaced 12 pairs, 2 mm",
    "views/parallel boards to 0 deg, 12 pairs",
    "board shape/S 500 um",
    "second board/pitch 1 %",
];

#[test]
fn planted_faults_do_not_pass() {
    let studio = Studio::new(None);
    let cases: Vec<_> = matrix::cases().into_iter().filter(|case| CHOSEN.contains(&case.name().as_str())).collect();
    assert_eq!(cases.len(), CHOSEN.len());
    for (k, case) in cases.iter().enumerate() {
        let set = (case.make)(SEED, SIZE_PX);
        let folder = studio.folder(&k.to_string(), &set);
        let said = matrix::said::camera_check(Path::new(env!("CARGO_BIN_EXE_stereocal")), &folder, &set);
        let judged = judge(&set, case.right, said);
        assert_ne!(judged.judgement, Judgement::FalsePass, "{}: {:?} {:?}", case.name(), judged.deviation, judged.said);
    }
}

/// The guide names what the benchmark runs.
#[test]
fn the_guide_counts_the_cases_as_they_are() {
    let (of_check, of_measure) = (matrix::cases().len(), matrix::measure::cases(0).len());
    let page = |topic| stereocal::guide::page(topic).unwrap().text.replace('\n', " ");
    let all = of_check + of_measure;
    assert!(page("accuracy").contains(&format!("{all} cases")), "{all}");
    let limits = format!(
        "plants {all} faults and oddities in rendered pictures, {of_check} of the check board and {of_measure} of the"
    );
    assert!(page("limits").contains(&limits), "{limits}");
}
