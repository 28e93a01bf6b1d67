//! Planned poses as pictures: does `measure` find the target at every one of them, also where the cameras stand
//! otherwise than assumed?

use std::process::Command;

use camino::Utf8Path;
use nalgebra::Vector3;
use stereocal::files::OutDir;
use stereocal::geometry::{Transform, transform};
use stereocal::measurements::{Measurement, Observed, read};
use stereocal::plan::scene::{Scene, flange_from_target};
use stereocal::plan::{Planned, Settings, plan};
use stereocal::robot::Robot;
use stereocal::simulate::robot_poses::{Arm, TruePose};
use stereocal::simulate::settings::Settings as Simulated;
use stereocal::simulate::truth_files;
use stereocal::simulate::world::World;

use crate::arms;

/// Width and height of the pictures, px.
const SIZE_PX: u32 = 1280;

/// How far the cameras stand from where the plan assumes them, and how much they are turned.
const OFF_MM: f64 = 100.0;
const OFF_DEG: f64 = 10.0;
/// Safe poses before the others.
const FIRST: usize = 6;

/// A line an arm: poses rendered and measured where the cameras stand as planned; then, where they do not, the first
/// poses and those planned after them.
pub fn table(settings: &Settings) {
    println!("\nplanned poses of a machine that is off, rendered at {SIZE_PX} px and measured");
    for (name, nominal) in arms::arms() {
        let machine = Machine::new(nominal);
        let found = plan(&machine.nominal, &machine.scene, settings, None).expect("a plan");
        let cameras: Vec<Transform> = found.placements.iter().map(|p| p.left_from_base).collect();
        let rows = machine.measured(&found.poses, &cameras);
        println!("{name:12} cameras as planned: {} rendered, {} measured{}", rows.len(), seen(&rows), missed(&rows));
        for way in 0..3 {
            let first = Settings { first: Some(FIRST), ..settings.clone() };
            let found = plan(&machine.nominal, &machine.scene, &first, None).expect("first poses");
            let cameras: Vec<Transform> = found.placements.iter().map(|p| off(way) * p.left_from_base).collect();
            let before = machine.measured(&found.poses, &cameras);
            let after = plan(&machine.nominal, &machine.scene, settings, Some((&before, "measurements.csv")));
            let after = match after {
                Ok(after) => after,
                Err(e) => {
                    println!(
                        "{name:12} cameras off, way {way}: {} of {} first poses measured, then {e}",
                        seen(&before),
                        before.len()
                    );
                    continue;
                }
            };
            let rows = machine.measured(&after.poses, &cameras);
            println!(
                "{name:12} cameras {OFF_MM} mm and {OFF_DEG} deg off, way {way}: {} of {} first poses measured, then {} of {}{}",
                seen(&before),
                before.len(),
                seen(&rows),
                rows.len(),
                missed(&rows)
            );
        }
    }
}

/// A displacement of the cameras.
fn off(way: usize) -> Transform {
    let axes = [Vector3::new(1.0, 0.4, -0.6), Vector3::new(-0.3, 1.0, 0.5), Vector3::new(0.5, -0.7, 1.0)];
    transform(axes[way].normalize() * OFF_DEG.to_radians(), axes[(way + 1) % 3].normalize() * OFF_MM)
}

fn seen(rows: &[Measurement]) -> usize {
    rows.iter().filter(|row| !matches!(row.observed, Observed::Missing { .. })).count()
}

fn missed(rows: &[Measurement]) -> String {
    let of = |row: &Measurement| match &row.observed {
        Observed::Missing { reason } => Some(format!("; {}: {reason}", row.at.pose)),
        _ => None,
    };
    rows.iter().filter_map(of).collect()
}

/// An arm as drawn and as it is, before the rig.
struct Machine {
    nominal: Robot,
    truth: Robot,
    scene: Scene,
}

impl Machine {
    fn new(nominal: Robot) -> Machine {
        let truth = arms::deviated(&nominal, 1);
        let world = world();
        let scene =
            Scene::new(world.rig, world.settings.target_board, 0.03, 35f64.to_radians(), 120.0, 8.0).expect("a field");
        Machine { nominal, truth, scene }
    }

    /// Poses as pictures of cameras that stand there in each group, and what `measure` makes of them.
    fn measured(&self, poses: &[Planned], cameras: &[Transform]) -> Vec<Measurement> {
        let mut world = world();
        let pose = |p: &Planned| TruePose {
            commanded: p.at.clone(),
            group: p.group,
            left_from_target: cameras[p.group]
                * self.truth.base_from_flange(&p.at.joints_rad())
                * flange_from_target(&self.truth),
        };
        world.poses = poses.iter().map(pose).collect();
        world.arm = Arm { nominal: self.nominal.clone(), truth: self.truth.clone() };
        let folder = tempfile::tempdir().expect("a folder");
        let path = Utf8Path::from_path(folder.path()).expect("a path");
        let out = OutDir::open(path).expect("a folder to write into");
        truth_files::write(&world, &out).expect("files");
        world.write_pictures(&out).expect("pictures");
        drop(out);
        Command::new(env!("CARGO_BIN_EXE_stereocal"))
            .current_dir(path)
            .args(["measure", "poses", "--calibration", "truth/calibration.json", "--out", "m", "--quiet"])
            .output()
            .expect("the program starts");
        read(&path.join("m/measurements.csv")).expect("measurements")
    }
}

fn world() -> World {
    let simulated = Simulated { size_px: SIZE_PX, check_pairs: 0, samples: 0, verify: 0, ..Simulated::small() };
    World::new(simulated, None).expect("a world")
}
