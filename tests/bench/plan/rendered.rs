//! Planned poses as pictures: does `measure` find the target at every one of them?

use std::process::Command;

use camino::Utf8Path;
use stereocal::files::OutDir;
use stereocal::measurements::{Observed, read};
use stereocal::plan::scene::{Scene, flange_from_target};
use stereocal::plan::{Settings, plan};
use stereocal::robot::Robot;
use stereocal::simulate::robot_poses::{Arm, TruePose};
use stereocal::simulate::settings::Settings as Simulated;
use stereocal::simulate::world::World;

use crate::arms;

/// Width and height of the pictures, px.
const SIZE_PX: u32 = 1280;

/// One line an arm: poses rendered, poses measured.
pub fn table(settings: &Settings) {
    println!("\nplanned poses of a machine that is off, rendered at {SIZE_PX} px and measured");
    for (name, nominal) in arms::arms() {
        let (rendered, missed) = measured(&nominal, settings);
        println!("{name:12} {rendered} rendered, {} measured {}", rendered - missed.len(), missed.join("; "));
    }
}

fn measured(nominal: &Robot, settings: &Settings) -> (usize, Vec<String>) {
    let simulated = Simulated { size_px: SIZE_PX, check_pairs: 0, samples: 0, verify: 0, ..Simulated::small() };
    let mut world = World::new(simulated, None).expect("a world");
    let board = world.settings.target_board;
    let scene = Scene::new(world.rig.clone(), board, 0.03, 35f64.to_radians(), 120.0, 8.0).expect("a field");
    let found = plan(nominal, &scene, settings, None).expect("a plan");
    let truth = arms::deviated(nominal, 1);
    let pose = |p: &stereocal::plan::Planned| TruePose {
        commanded: p.at.clone(),
        group: p.group,
        left_from_target: found.placements[p.group].left_from_base
            * truth.base_from_flange(&p.at.joints_rad())
            * flange_from_target(&truth),
    };
    world.poses = found.poses.iter().map(pose).collect();
    world.arm = Arm { nominal: nominal.clone(), truth: truth.clone() };
    let folder = tempfile::tempdir().expect("a folder");
    let path = Utf8Path::from_path(folder.path()).expect("a path");
    let out = OutDir::open(path).expect("a folder to write into");
    world.write_truth(&out).expect("files");
    world.write_pictures(&out).expect("pictures");
    drop(out);
    let status = Command::new(env!("CARGO_BIN_EXE_stereocal"))
        .current_dir(path)
        .args(["measure", "poses", "--calibration", "truth/calibration.json", "--out", "m", "--quiet"])
        .output()
        .expect("the program starts");
    let Ok(rows) = read(&path.join("m/measurements.csv")) else {
        return (found.poses.len(), vec![String::from_utf8_lossy(&status.stderr).into_owned()]);
    };
    let missed = |row: &stereocal::measurements::Measurement| match &row.observed {
        Observed::Missing { reason } => Some(format!("{}: {reason}", row.at.pose)),
        _ => None,
    };
    (rows.len(), rows.iter().filter_map(missed).collect())
}
