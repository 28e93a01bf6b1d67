//! `stereocal simulate`: A world whose truth is known, as files.

use super::{Outcome, Result};
use crate::cli::{LensBlur, Preset, Simulate};
use crate::config::Config;
use crate::diagnostic::{Status, count};
use crate::files::OutDir;
use crate::files::provenance::Run;
use crate::robot;
use crate::simulate::picture::psf::{Defocus, Optics};
use crate::simulate::rig::DISTANCE_MM;
use crate::simulate::settings::{RobotDeviations, Settings};
use crate::simulate::world::World;
use crate::simulate::{true_robot, truth_files};

/// Entrance pupil of the paper's 25 mm lenses at f/16, mm.
const PUPIL_MM: f64 = 25.0 / 16.0;

/// Stands for Table 2 of the paper where a robot file is asked for.
const TABLE_2: &str = "table-2";

/// Comatic flare at the picture's corners, px.
const COMA_PX: f64 = 1.0;

/// Runs the command: settings, world, truth, pictures.
pub fn run(args: &Simulate, config: &Config, run: Run) -> Result<Outcome> {
    let true_robot = match args.true_robot.as_deref() {
        Some(name) if name == TABLE_2 => Some(true_robot::nominal().with_table_2()),
        Some(path) => Some(robot::file::read(path)?),
        None => None,
    };
    let world = World::new(settings(args, config)?, true_robot)?;
    let true_file = args.true_robot.as_deref().filter(|name| *name != TABLE_2);
    let run = Run { force: args.force, ..run };
    let out = OutDir::open(args.out.as_ref().unwrap_or(&config.out))?
        .for_run(&run, &true_file.into_iter().collect::<Vec<_>>());
    out.check_free(&[
        "robot.toml",
        "measurements.csv",
        "poses/poses.csv",
        "truth/robot.toml",
        "truth/calibration.json",
    ])?;
    if args.points_only {
        truth_files::write_points_only(&world, &out)?;
    } else {
        world.check_unoccupied(&out)?;
        truth_files::write(&world, &out)?;
        world.write_pictures(&out)?;
    }
    Ok(Outcome { stdout: summary(args, &world, &out), status: Status::Done })
}

/// The preset with what was typed in place of its values. Boards that were not typed are those of the settings file.
fn settings(args: &Simulate, config: &Config) -> Result<Settings> {
    let mut s = match args.preset {
        Preset::Paper => Settings::paper(),
        Preset::Small => Settings::small(),
    };
    s.seed = args.seed;
    s.check_board = config.check_board.board(args.board, None, None)?;
    s.target_board = config.target_board.board(args.target_board, None, None)?;
    s.optics = optics(args.lens_blur, s.optics);
    replace(&mut s.size_px, args.size);
    replace(&mut s.orientation, args.orientation);
    replace(&mut s.check_pairs, args.check_pairs);
    replace(&mut s.samples, args.samples);
    replace(&mut s.verify, args.verify);
    replace(&mut s.point_noise_mm, args.point_noise_mm);
    replace(&mut s.sensor.bits, args.bits);
    replace(&mut s.check_workmanship.bow_um, args.bow_um.map(|bow| (bow / 2.0, bow / 2.0)));
    replace(&mut s.check_workmanship.pitch_um, args.pitch_um);
    for board in [&mut s.check_workmanship, &mut s.target_workmanship] {
        replace(&mut board.ink_spread_um, args.ink_um);
        replace(&mut board.scale_ppm, args.thermal_ppm);
    }
    let RobotDeviations { beta_deg, gravity_mrad_per_m, harmonics_mrad, repeatability_mm, .. } = &mut s.robot;
    replace(beta_deg, args.beta_deg);
    replace(gravity_mrad_per_m, args.gravity_mrad);
    replace(harmonics_mrad, args.harmonics_mrad);
    replace(repeatability_mm, args.repeatability_mm);
    Ok(s)
}

fn replace<T>(setting: &mut T, typed: Option<T>) {
    if let Some(value) = typed {
        *setting = value;
    }
}

fn optics(blur: LensBlur, preset: Optics) -> Optics {
    match blur {
        LensBlur::Gaussian => preset,
        LensBlur::Defocus => Optics { defocus: Some(Defocus { pupil_mm: PUPIL_MM, focus_mm: DISTANCE_MM }), ..preset },
        LensBlur::Coma => Optics { coma_px: COMA_PX, ..preset },
    }
}

fn summary(args: &Simulate, world: &World, out: &OutDir) -> String {
    let settings = &world.settings;
    let poses = format!("{} in {}", count(world.poses.len(), "robot pose"), count(settings.spheres.len(), "group"));
    if args.points_only {
        return format!("{poses}, {} mm noise a coordinate, in {}\n", settings.point_noise_mm, out.path());
    }
    format!(
        "{} check pairs and {poses}, pictures of {size}x{size} px, in {}\n",
        settings.check_pairs,
        out.path(),
        size = settings.size_px,
    )
}
