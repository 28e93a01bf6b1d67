//! `stereocal export`: A calibration in other programs' words.

use super::Outcome;
use crate::cli::{CalibrationFormat, Export, ExportWhat};
use crate::config::Config;
use crate::error::{Result, Status};
use crate::files::OutDir;
use crate::stereo::{calibration_file, export};

/// Runs the command.
pub fn run(args: &Export, config: &Config) -> Result<Outcome> {
    let ExportWhat::Calibration(args) = &args.what;
    let out = OutDir::open(args.out.as_deref().unwrap_or(&config.out))?;
    let rig = calibration_file::read(&args.calibration.clone().unwrap_or_else(|| out.join("calibration.json")))?;
    let files = match args.format {
        CalibrationFormat::Opencv => export::file_storage::files(&rig),
        CalibrationFormat::Ros => export::ros::files(&rig)?,
        CalibrationFormat::Kalibr => export::kalibr::files(&rig)?,
        CalibrationFormat::Mrcal => export::mrcal::files(&rig)?,
    };
    let mut stdout = String::new();
    for file in files {
        out.write(file.name, file.text.as_bytes())?;
        stdout.push_str(&format!("{}\n", out.join(file.name)));
    }
    Ok(Outcome { stdout, status: Status::Done })
}
