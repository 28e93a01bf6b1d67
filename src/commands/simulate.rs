//! `stereocal simulate`: A world whose truth is known, as files.

use super::Outcome;
use crate::cli::{Preset, Simulate};
use crate::config::Config;
use crate::error::{Result, Status};
use crate::files::OutDir;
use crate::simulate::settings::Settings;
use crate::simulate::truth_files;
use crate::simulate::world::World;

/// Runs the command: settings, world, truth, pictures.
pub fn run(args: &Simulate, config: &Config) -> Result<Outcome> {
    let out = OutDir::open(args.out.as_ref().unwrap_or(&config.out))?;
    let world = World::new(settings(args), None)?;
    if args.points_only {
        truth_files::write_points_only(&world, &out)?;
    } else {
        world.write_truth(&out)?;
        world.write_pictures(&out)?;
    }
    Ok(Outcome { stdout: summary(args, &world, &out), status: Status::Done })
}

fn settings(args: &Simulate) -> Settings {
    let preset = match args.preset {
        Preset::Paper => Settings::paper(),
        Preset::Small => Settings::small(),
    };
    Settings {
        size_px: args.size.unwrap_or(preset.size_px),
        seed: args.seed,
        orientation: args.orientation.unwrap_or(preset.orientation),
        ..preset
    }
}

fn summary(args: &Simulate, world: &World, out: &OutDir) -> String {
    let settings = &world.settings;
    let poses = format!("{} robot poses in {} groups", world.poses.len(), settings.spheres.len());
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
