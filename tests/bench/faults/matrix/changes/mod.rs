//! Rigs that change while they are photographed, planted in corners: is the reason that is given the right one, what
//! does it cost, and do the intervals hold.
//!
//! A run is a set of check pictures of which only the corners are made, with noise, and `camera-check --corners` on
//! them, so that hundreds cost minutes. The detection limit of a fault follows from the normal equations of the
//! faultless set.

pub mod corners;
pub mod intervals;
pub mod limit;
pub mod plants;
pub mod reason;

use std::collections::BTreeMap;
use std::path::Path;

use rayon::prelude::*;

use super::judge::Judgement;
use super::said::Said;
use super::set::Set;
use super::truth;
use corners::World;
use limit::Linear;
use plants::Line;
use reason::Reason;

/// Boards on which lengths are compared.
const BOARDS: usize = 5;

/// A fault that moves lengths by less than this share of the tolerance may cost nothing.
const HARMLESS_SHARE: f64 = 0.1;

/// A pass is false where fresh boards are off by more than so many tolerances.
const FALSE_PASS: f64 = 1.1;

/// Share of the runs above the detection limit that must name the reason, alone or with its equals.
const NAMED_SHARE: f64 = 0.7;

/// The faultless run of a world.
struct Clean {
    set: Set,
    linear: Linear,
    said: Said,
}

/// One run.
struct Run {
    said: Said,
    reason: Reason,
    above_limit: bool,
    /// Pairs or the verdict of the faultless run were lost to a harmless fault.
    lost: bool,
    false_pass: bool,
    limit: f64,
    effect_mm: f64,
}

/// Runs all lines whose name is chosen, and prints a line a size and world.
pub fn run(program: &Path, seed: u64, chooses: &dyn Fn(&str) -> bool) -> Vec<Judgement> {
    let lines: Vec<Line> = plants::lines().into_iter().filter(|line| chooses(&line.full_name())).collect();
    let mut judgements = Vec::new();
    if !lines.is_empty() {
        println!(
            "\nreasons: runs, the size from which the fault can be seen, what it does to a length | verdicts, pairs used, lost though harmless | \
             reason: right, with its equals, unknown, wrong (of those above the limit)"
        );
        judgements = reasons(program, seed, &lines);
    }
    intervals::run(program, seed, chooses);
    judgements
}

fn reasons(program: &Path, seed: u64, lines: &[Line]) -> Vec<Judgement> {
    let worlds = corners::worlds(seed);
    let clean: Vec<Clean> = worlds.par_iter().map(|world| clean(program, world)).collect();
    let mut all: Vec<Run> = Vec::new();
    for line in lines {
        for &size in line.sizes {
            for px in corners::SIZES_PX {
                let of_size = worlds.iter().zip(&clean).filter(|(world, _)| world.px == px);
                let of_size: Vec<(&World, &Clean)> = of_size.collect();
                let runs: Vec<Run> = of_size.par_iter().map(|(w, c)| one(program, line, size, w, c)).collect();
                print(line, size, px, &runs);
                all.extend(runs);
            }
        }
    }
    summary(&all);
    all.iter().map(Run::judgement).collect()
}

fn clean(program: &Path, world: &World) -> Clean {
    let set = world.plan.set();
    let corners = world.corners(&set);
    let said = world.check(program, &corners);
    Clean { linear: Linear::new(&corners), set, said }
}

fn one(program: &Path, line: &Line, size: f64, world: &World, clean: &Clean) -> Run {
    let mut set = clean.set.clone();
    (line.plant)(&mut set, size);
    let said = world.check(program, &world.corners(&set));
    let ratio = clean.linear.share_of_limit(&clean.set, &set, line.spread);
    let effect_mm = set.pairs.iter().map(|pair| limit::rig_of(&clean.set, pair));
    let effect_mm = effect_mm.map(|rig| truth::effect_mm(&clean.set, &rig, 1)).fold(0.0, f64::max);
    let used = |said: &Said| said.check.as_ref().and_then(|check| check["pairs_used"].as_u64());
    let harmless = effect_mm < HARMLESS_SHARE * world.tolerance_mm;
    let off = said.calibration.as_ref().and_then(|file| truth::compare(&set, file, BOARDS));
    let worst = off.map_or(0.0, |off| off.lengths.iter().map(|off| off.mm).fold(0.0, f64::max));
    Run {
        reason: Reason::of(&said, line, &set),
        above_limit: ratio > 1.0,
        lost: harmless && (used(&said) != used(&clean.said) || said.verdict != clean.said.verdict),
        false_pass: said.verdict == "pass" && worst > FALSE_PASS * world.tolerance_mm,
        limit: size / ratio,
        effect_mm,
        said,
    }
}

impl Run {
    fn judgement(&self) -> Judgement {
        match self.reason {
            _ if self.false_pass => Judgement::FalsePass,
            _ if self.lost => Judgement::FalseFail,
            Reason::Wrong => Judgement::FalseAlarm,
            _ => Judgement::Right,
        }
    }
}

fn print(line: &Line, size: f64, px: u32, runs: &[Run]) {
    let mut verdicts: BTreeMap<&str, usize> = BTreeMap::new();
    runs.iter().for_each(|run| *verdicts.entry(run.said.verdict.as_str()).or_insert(0) += 1);
    let used = runs.iter().filter_map(|run| run.said.check.as_ref()?["pairs_used"].as_u64());
    let (least, most) = used.fold((u64::MAX, 0), |(least, most), n| (least.min(n), most.max(n)));
    let count = |reason: Reason, above: bool| {
        runs.iter().filter(|run| run.reason == reason && (run.above_limit || !above)).count()
    };
    let mean = |of: fn(&Run) -> f64| runs.iter().map(of).sum::<f64>() / runs.len() as f64;
    let [right, equals, unknown, wrong] = Reason::ALL.map(|reason| count(reason, false));
    let [right_a, equals_a, unknown_a, wrong_a] = Reason::ALL.map(|reason| count(reason, true));
    println!(
        "{:34} {size:7} {:5} {px} px | {} limit {:8.4} effect {:7.4} mm | {verdicts:?} {least}-{most} lost {}{} | {right} {equals} {unknown} {wrong} ({right_a} {equals_a} {unknown_a} {wrong_a}) | {}",
        line.full_name(),
        line.unit,
        runs.len(),
        mean(|run| run.limit),
        mean(|run| run.effect_mm),
        runs.iter().filter(|run| run.lost).count(),
        if runs.iter().any(|run| run.false_pass) { " FALSE PASS" } else { "" },
        runs.iter().map(|run| reason::findings(&run.said)).collect::<Vec<_>>().join(" ; "),
    );
}

fn summary(all: &[Run]) {
    let count = |of: &dyn Fn(&&Run) -> bool| all.iter().filter(of).count();
    let above = count(&|run| run.above_limit);
    let named = count(&|run| run.above_limit && matches!(run.reason, Reason::Right | Reason::WithEquals));
    println!(
        "{} runs: wrong reasons {}; above the detection limit {above}, of these right or right with its equals {named} ({:.0} %, at least {:.0} %); \
         lost though harmless {}; false passes {}",
        all.len(),
        count(&|run| run.reason == Reason::Wrong),
        100.0 * named as f64 / above.max(1) as f64,
        100.0 * NAMED_SHARE,
        count(&|run| run.lost),
        count(&|run| run.false_pass),
    );
}
