//! The world's files other than pictures: poses, robots, and the truth in the formats that the commands write.

use std::fmt::Write as _;

use super::draws::{Draws, Purpose};
use super::world::World;
use crate::files::{OutDir, Result};
use crate::formats::calibration::CalibrationFile;
use crate::imaging::input::corners_csv;
use crate::measurements::{pose_fields, pose_header, poses_csv};
use crate::robot::file::to_toml;

/// The columns of `measurements.csv` behind the pose.
const MEASURED: &str =
    "x_mm,y_mm,z_mm,sxx_mm2,sxy_mm2,sxz_mm2,syy_mm2,syz_mm2,szz_mm2,rx_rad,ry_rad,rz_rad,fit_rms_mm,corners,status";

/// Writes `poses/poses.csv`, `robot.toml` and `truth/`.
pub fn write(world: &World, out: &OutDir) -> Result<()> {
    let commanded = world.poses.iter().map(|pose| &pose.commanded);
    out.write("poses/poses.csv", poses_csv(commanded).as_bytes())?;
    out.write("robot.toml", to_toml(&world.arm.nominal).as_bytes())?;
    out.write("truth/robot.toml", to_toml(&world.arm.truth).as_bytes())?;
    out.write_json("truth/calibration.json", &CalibrationFile::from(&world.rig))?;
    out.write("truth/corners.csv", corners_csv::to_csv(&world.check_corners()).as_bytes())?;
    out.write("truth/pose-corners.csv", corners_csv::to_csv(&world.pose_corners()).as_bytes())?;
    out.write("truth/measurements.csv", measurements_csv(world, 0.0).as_bytes())
}

/// Writes what a measurement without pictures leaves: `robot.toml`, `measurements.csv` with noise, and the truth.
pub fn write_points_only(world: &World, out: &OutDir) -> Result<()> {
    out.write("robot.toml", to_toml(&world.arm.nominal).as_bytes())?;
    out.write("measurements.csv", measurements_csv(world, world.settings.point_noise_mm).as_bytes())?;
    out.write("truth/robot.toml", to_toml(&world.arm.truth).as_bytes())?;
    out.write("truth/measurements.csv", measurements_csv(world, 0.0).as_bytes())
}

/// True positions, or with noise of a standard deviation (mm) on each coordinate and the covariance that belongs to it.
fn measurements_csv(world: &World, noise_mm: f64) -> String {
    let mut text = pose_header(world.poses.first().map(|pose| &pose.commanded));
    let _ = writeln!(text, ",{MEASURED}");
    for (k, pose) in world.poses.iter().enumerate() {
        let noise = Draws::new(world.settings.seed, Purpose::Points, k as u64).normal3() * noise_mm;
        let (truth, r) = World::mark_point(pose);
        let p = truth + noise;
        let variance = noise_mm * noise_mm;
        let covariance =
            if noise_mm > 0.0 { format!("{variance},0,0,{variance},0,{variance}") } else { ",,,,,".to_owned() };
        // Rotations are left out with noise: nothing says how well they would be known.
        let rotation = if noise_mm > 0.0 { ",,".to_owned() } else { format!("{},{},{}", r.x, r.y, r.z) };
        let _ = writeln!(text, "{},{},{},{},{covariance},{rotation},,,ok", pose_fields(&pose.commanded), p.x, p.y, p.z);
    }
    text
}
