//! Wrong conventions planted in the tables of real robots, whose joints move less than a simulated plan's: is each
//! named, and what does it cost?

use std::path::{Path, PathBuf};

use camino::Utf8PathBuf;
use rayon::prelude::*;
use stereocal::identify::Settings;
use stereocal::identify::data::dataset::Dataset;
use stereocal::identify::examine::{self, Examined};
use stereocal::identify::judge::errors::{Judge, Spread};
use stereocal::identify::run::identify;
use stereocal::identify::settings::Method;
use stereocal::measurements::{self, Measurement};
use stereocal::robot::{Robot, file};

use crate::faults::{as_standard, joints, late};

/// Sets of points and of wire lengths.
const SETS: [&str; 4] = ["irb120-tracker-a", "ur5-tracker", "motoman-right", "robotcali-120"];

/// Changes rows or the nominal robot.
type Plant = fn(&mut Vec<Measurement>, &mut Robot);

/// Faults and words of the findings that name each. Half a turn of a wrist's first joint is a flipped sign of its
/// second where the target stands near the last axis, and half a turn of the shoulder the first joint counted the other
/// way round.
const FAULTS: [(&str, Plant, &[&str]); 17] = [
    ("clean", |_, _| {}, &[]),
    ("radians", |rows, _| joints(rows, |_, q| q.iter_mut().for_each(|q| *q = q.to_radians())), &["radians"]),
    ("joints 2 and 4 exchanged", |rows, _| joints(rows, |_, q| q.swap(1, 3)), &["joints 2 and 4 are exchanged"]),
    ("joints 4 and 6 exchanged", |rows, _| joints(rows, |_, q| q.swap(3, 5)), &["joints 4 and 6 are exchanged"]),
    ("joints 5 and 6 exchanged", |rows, _| joints(rows, |_, q| q.swap(4, 5)), &["joints 5 and 6 are exchanged"]),
    ("joint 1 negated", |rows, _| joints(rows, |_, q| q[0] = -q[0]), &["joint 1 is counted", "joint 2 is offset by"]),
    ("joint 2 negated", |rows, _| joints(rows, |_, q| q[1] = -q[1]), &["joint 2 is counted"]),
    ("joint 3 negated", |rows, _| joints(rows, |_, q| q[2] = -q[2]), &["joint 3 is counted"]),
    ("joint 4 negated", |rows, _| joints(rows, |_, q| q[3] = -q[3]), &["joint 4 is counted"]),
    ("joint 5 negated", |rows, _| joints(rows, |_, q| q[4] = -q[4]), &["joint 5 is counted", "joint 4 is offset by"]),
    ("joint 6 negated", |rows, _| joints(rows, |_, q| q[5] = -q[5]), &["joint 6 is counted"]),
    ("joint 3 off by 90 deg", |rows, _| joints(rows, |_, q| q[2] += 90.0), &["joint 3 is offset by"]),
    (
        "joint 4 off by 180 deg",
        |rows, _| joints(rows, |_, q| q[3] += 180.0),
        &["joint 4 is offset by", "joint 5 is counted"],
    ),
    ("joint 5 off by 90 deg", |rows, _| joints(rows, |_, q| q[4] += 90.0), &["joint 5 is offset by"]),
    ("joint 5 off by -90 deg", |rows, _| joints(rows, |_, q| q[4] -= 90.0), &["joint 5 is offset by"]),
    ("joints a row late", |rows, _| late(rows), &["joints lag"]),
    ("standard DH", |_, robot| *robot = as_standard(robot), &["standard DH"]),
];

/// One line a fault, two columns a set: whether it was named, and the error on verify rows against that of the clean
/// table.
pub fn table() {
    let root = std::env::var_os("STEREOCAL_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared"), PathBuf::from);
    let sets: Vec<(&str, PathBuf)> = SETS.map(|name| (name, root.join("data/robot").join(name))).into();
    let sets: Vec<(&str, PathBuf)> = sets.into_iter().filter(|(_, folder)| folder.is_dir()).collect();
    println!(
        "\nconventions planted in real tables: named (or `silent`), mean verification error against that of the clean table"
    );
    if sets.is_empty() {
        println!("skipped: no {}", root.join("data/robot").display());
        return;
    }
    print!("{:26}", "");
    sets.iter().for_each(|(name, _)| print!("{name:>22}"));
    println!();
    let of_set = |folder: &PathBuf| -> Vec<(String, f64)> {
        FAULTS.into_par_iter().map(|(_, plant, words)| planted(folder, plant, words)).collect()
    };
    let columns: Vec<Vec<(String, f64)>> = sets.iter().map(|(_, folder)| of_set(folder)).collect();
    for (line, (what, ..)) in FAULTS.iter().enumerate() {
        print!("{what:26}");
        for column in &columns {
            let (said, error) = &column[line];
            print!("{said:>14} {:>7.3}", error / column[0].1);
        }
        println!();
    }
}

/// What was said, and the mean distance error of the verify rows, mm.
fn planted(folder: &Path, plant: Plant, words: &[&str]) -> (String, f64) {
    let path = |name: &str| Utf8PathBuf::from_path_buf(folder.join(name)).expect("a name in UTF-8");
    let mut rows = measurements::read(&path("measurements.csv")).expect("measurements");
    let mut nominal = file::read(&path("robot.toml")).expect("a robot");
    plant(&mut rows, &mut nominal);
    let settings = Settings { method: Some(Method::TrustRegion), ..Settings::default() };
    let given = Dataset::new(&rows).expect("rows");
    let Examined { set, robot, findings, .. } = examine::examine(&given, &nominal, &settings, &|_| {});
    let found = identify(&set, &robot, &settings, 1, &|_| {}).expect("it is enough");
    let judge = Judge::plain(&set, &found.fitted, settings.wire_offset);
    let errors = judge.errors(&found.candidates[found.chosen].robot, &set.verify_rows());
    let error = Spread::new(errors.iter().filter_map(|e| e.distance_mm)).mean_abs_mm.unwrap_or(f64::NAN);
    let mended = || findings.iter().filter(|f| f.action.contains("mended"));
    let said = match mended().count() {
        0 if words.is_empty() => "nothing",
        0 => "silent",
        _ if mended().any(|f| words.iter().any(|word| f.finding.contains(word))) => "named",
        _ => "other",
    };
    (said.to_owned(), error)
}
