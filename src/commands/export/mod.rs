//! `stereocal export`: a calibration, a robot or a placement in other programs' words.

mod placement;
mod robot;

use super::heed::heed_rig;
use super::{Outcome, Result};
use crate::cli::{CalibrationFormat, ExportCalibration, ExportWhat};
use crate::config::Config;
use crate::files::OutDir;
use crate::files::provenance::Run;
use crate::formats::{calibration as rig, export};

pub fn run(what: &ExportWhat, config: &Config, run: Run) -> Result<Outcome> {
    match what {
        ExportWhat::Calibration(args) => calibration(args, config, run),
        ExportWhat::Robot(args) => robot::run(args, config, run),
        ExportWhat::Placement(args) => placement::run(args, config, run),
    }
}

fn calibration(args: &ExportCalibration, config: &Config, run: Run) -> Result<Outcome> {
    let out = OutDir::open(args.files.out.as_deref().unwrap_or(&config.out))?;
    let rig_file = rig::file(args.calibration.as_deref(), out.path(), &config.out)?;
    let calibrated = rig::read(&rig_file)?;
    let doubts = heed_rig(&calibrated, &rig_file);
    let rig = calibrated.rig;
    let out = out.for_run(&Run { force: args.files.force, ..run }, &[&rig_file]);
    let files = match args.format {
        CalibrationFormat::Opencv => export::file_storage::files(&rig)?,
        CalibrationFormat::Ros => export::ros::files(&rig)?,
        CalibrationFormat::Kalibr => export::kalibr::files(&rig)?,
        CalibrationFormat::Mrcal => export::mrcal::files(&rig)?,
    };
    let mut stdout = String::new();
    for file in files {
        out.write(file.name, file.text.as_bytes())?;
        stdout.push_str(&format!("{}\n", out.join(file.name)));
    }
    Ok(Outcome { stdout, status: doubts.status_without_uncertainty })
}
