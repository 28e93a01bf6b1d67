//! Planted faults against the verdict of `camera-check` and the points of `measure`: `cargo bench --bench faults [--
//! NAME ...] [--seed N] [--clean N] [--large] [--px N] [--program FILE] [--keep DIR]`.
//!
//! Every case is a rendered folder, the command run on it as a user runs it, and the truth. Names choose cases that
//! contain one of them; `--clean N` runs N controls of other seeds as well; `--large` runs those cases whose answer may
//! depend on the size of the pictures at 5120 px; `--program` judges another build of the command; `--keep` keeps the
//! pictures for the next run.
#![allow(missing_docs, reason = "a benchmark is read as a whole")]
#![allow(clippy::expect_used, clippy::panic, reason = "a benchmark ends where its folders cannot be made")]
#![expect(clippy::print_stdout, reason = "a benchmark says what it measured")]

mod matrix;

use std::path::{Path, PathBuf};

use matrix::judge::{Judged, Judgement, judge};
use matrix::set::{Plan, Studio};
use matrix::{Case, Right, case, said};

/// Width of the pictures of the quick part and of the large one, px.
const SMALL_PX: u32 = 1024;
const LARGE_PX: u32 = 5120;

struct Wanted {
    names: Vec<String>,
    seed: u64,
    clean: u64,
    large: bool,
    px: Option<u32>,
    program: PathBuf,
    keep: Option<PathBuf>,
}

impl Wanted {
    fn chooses(&self, name: &str) -> bool {
        self.names.is_empty() || self.names.iter().any(|part| name.contains(part.as_str()))
    }
}

fn wanted() -> Wanted {
    let mut wanted = Wanted {
        names: Vec::new(),
        seed: 1,
        clean: 0,
        large: false,
        px: None,
        program: env!("CARGO_BIN_EXE_stereocal").into(),
        keep: None,
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        if argument == "--program" || argument == "--keep" {
            let path: PathBuf = arguments.next().expect("a path behind the option").into();
            if argument == "--keep" {
                wanted.keep = Some(path)
            } else {
                wanted.program = path
            }
            continue;
        }
        let mut number = || arguments.next().and_then(|n| n.parse().ok()).expect("a number behind the option");
        match argument.as_str() {
            // What cargo gives to every benchmark.
            "--bench" => {}
            "--seed" => wanted.seed = number(),
            "--clean" => wanted.clean = number(),
            "--px" => wanted.px = Some(number() as u32),
            "--large" => wanted.large = true,
            name => wanted.names.push(name.to_owned()),
        }
    }
    wanted
}

fn main() {
    let wanted = wanted();
    let px = wanted.px.unwrap_or(if wanted.large { LARGE_PX } else { SMALL_PX });
    let mut cases: Vec<Case> = matrix::cases().into_iter().filter(|case| case.large || !wanted.large).collect();
    cases.extend((0..wanted.clean).map(|k| {
        case("clean", "seed", format!("+{k}"), Right::Clean, move |seed, px| Plan::usual(seed + 1000 + k, px).set())
    }));
    cases.retain(|case| wanted.chooses(&case.name()));

    println!("{} cases, {px} px, seed {}; tolerance {} mm", cases.len(), wanted.seed, matrix::judge::TOLERANCE_MM);
    println!("verdict    claimed    true mm  sigmas: length, point  judgement    case | what was said");
    let studio = Studio::new(wanted.keep.as_deref());
    let mut counts = std::collections::BTreeMap::new();
    for (k, case) in cases.iter().enumerate() {
        let judged = run(&studio, &wanted.program, case, (wanted.seed, px, k));
        print(case, &judged);
        *counts.entry(judged.judgement).or_insert(0) += 1;
    }
    let mut of_measure = matrix::measure::cases(wanted.clean);
    of_measure.retain(|case| !wanted.large && wanted.chooses(&case.name()));
    let line = |text: String| println!("{text}");
    for judgement in matrix::measure::run(&studio, &wanted.program, &of_measure, (wanted.seed, px), &line) {
        *counts.entry(judgement).or_insert(0) += 1;
    }
    if !wanted.large {
        for judgement in matrix::changes::run(&wanted.program, wanted.seed, &|name| wanted.chooses(name)) {
            *counts.entry(judgement).or_insert(0) += 1;
        }
    }
    println!();
    for judgement in [
        Judgement::Right,
        Judgement::Undecided,
        Judgement::FalsePass,
        Judgement::Silent,
        Judgement::FalseFail,
        Judgement::FalseAlarm,
    ] {
        println!("{:4} {}", counts.get(&judgement).unwrap_or(&0), judgement.name());
    }
}

fn run(studio: &Studio, program: &Path, case: &Case, (seed, px, k): (u64, u32, usize)) -> Judged {
    let set = (case.make)(seed, px);
    let folder = studio.folder(&format!("{k}"), &set);
    let judged = judge(&set, case.right, said::camera_check(program, &folder, &set));
    std::fs::remove_dir_all(&folder).expect("the folder can be removed");
    judged
}

fn print(case: &Case, judged: &Judged) {
    let figure = |value: Option<f64>, digits: usize| value.map_or("-".to_owned(), |v| format!("{v:.digits$}"));
    let d = judged.deviation;
    println!(
        "{:10} {:>7} {:>10} {:>12} {:>8}   {:11}  {} | {}",
        judged.said.verdict,
        figure(judged.said.claimed_mm, 4),
        figure(d.map(|d| d.length_mm), 5),
        figure(d.and_then(|d| d.length_sigmas), 1),
        figure(d.and_then(|d| d.point_sigmas), 1),
        judged.judgement.name(),
        case.name(),
        matrix::brief(&judged.said.words),
    );
}
