//! Planted faults of `measure`: a rig that is no longer the calibrated one, a target that is not the typed one, bad
//! poses.

pub mod judge;
pub mod pose_faults;
pub mod rig_faults;
pub mod session;

use super::judge::Judgement;
use super::set::Studio;
use session::{Calibrated, Session};

/// What there is to be had.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Expected {
    /// Every pose, and not a word.
    Clean,
    /// A word about all of it wherever a pose is wrong, or the end of the run.
    Said,
    /// These poses by name wherever they are wrong, and all others measured.
    Named(Vec<usize>),
}

/// One planted fault at one size.
pub struct MeasureCase {
    pub fault: &'static str,
    pub size: String,
    pub expected: Expected,
    /// Draws the session for a seed and a width of the pictures.
    pub make: Box<dyn Fn(u64, u32) -> Session>,
}

fn case(
    fault: &'static str,
    size: impl Into<String>,
    expected: Expected,
    make: impl Fn(Session) -> Session + 'static,
) -> MeasureCase {
    let make = Box::new(move |seed, px| make(Session::usual(seed, px)));
    MeasureCase { fault, size: size.into(), expected, make }
}

impl MeasureCase {
    pub fn name(&self) -> String {
        format!("measure/{} {}", self.fault, self.size).trim_end().to_owned()
    }
}

/// All of them, and so many clean rigs of other seeds.
pub fn cases(clean: u64) -> Vec<MeasureCase> {
    let mut list = vec![case("clean", "", Expected::Clean, |session| session)];
    list.extend((0..clean).map(|k| MeasureCase {
        fault: "clean",
        size: format!("seed +{k}"),
        expected: Expected::Clean,
        make: Box::new(move |seed, px| Session::usual(seed + 2000 + k, px)),
    }));
    list.extend(rig_faults::cases());
    list.extend(pose_faults::cases());
    list
}

/// Runs the cases and prints a line each.
pub fn run(
    studio: &Studio,
    program: &std::path::Path,
    cases: &[MeasureCase],
    (seed, px): (u64, u32),
    print: &dyn Fn(String),
) -> Vec<Judgement> {
    let mut rigs = std::collections::BTreeMap::new();
    print("worst mm  its sigmas  poses: measured, wrong, named  judgement    case | what was said".to_owned());
    let one = |(k, case): (usize, &MeasureCase)| {
        let session = (case.make)(seed, px);
        let rig: &Calibrated =
            rigs.entry(session.plan.settings.seed).or_insert_with(|| Calibrated::new(studio, program, &session.plan));
        let said = session.measure(studio, program, rig, k);
        let judged = judge::judge(&session, &case.expected, &said);
        let d = &judged.poses;
        print(format!(
            "{:8.4} {:10.1} {:>8} {:5} {:5}               {:11}  {} | {}",
            judged.worst_mm,
            judged.worst_sigmas,
            d.measured,
            d.wrong,
            d.named,
            judged.judgement.name(),
            case.name(),
            super::brief(&said.words),
        ));
        judged.judgement
    };
    cases.iter().enumerate().map(one).collect()
}
