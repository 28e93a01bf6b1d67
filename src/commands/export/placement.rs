//! `stereocal export placement`: where the cameras stand, for other programs.

use camino::Utf8Path;

use super::super::heed::heed;
use super::super::{Outcome, Result};
use crate::cli::{ExportPlacement, PlacementFormat};
use crate::config::{self, Config};
use crate::files::OutDir;
use crate::files::provenance::Run;
use crate::formats::placements::record::{GroupRecord, PLACEMENT, PlacementFile};
use crate::formats::placements::{Frames, Placement, plain};

pub fn run(args: &ExportPlacement, config: &Config, run: Run) -> Result<Outcome> {
    let out = OutDir::open(args.files.out.as_deref().unwrap_or(&config.out))?;
    let path = args.placement.clone().unwrap_or_else(|| out.or_usual(PLACEMENT, &config.out));
    let file = PlacementFile::read(&path)?;
    if file.mirrored {
        return Err(mirrored(&path).into());
    }
    let groups = groups(args, &file)?;
    let status = heed(file.check.as_ref(), &path);
    let out = out.for_run(&Run { force: args.files.force, ..run }, &[&path]);
    let flange_from_target = file.flange_from_target.as_ref().and_then(|record| record.transform());
    let (sensor, default) = match file.by_instrument {
        true => ("instrument", "instrument"),
        false => ("camera", "left_camera_optical_frame"),
    };
    let camera_frame = args.camera_frame.as_deref().unwrap_or(default);
    let mut stdout = String::new();
    for group in &groups {
        let Some(base_from_camera) = group.base_from_rig.transform() else { continue };
        // A camera that stood in several places is several frames.
        let rows = group.rows.as_ref().map(|[first, last]| format!("_{}_to_{}", plain(first), plain(last)));
        let place = || format!("_{}{}", plain(&group.group), rows.unwrap_or_default());
        let suffix = if file.groups.len() > 1 { place() } else { String::new() };
        let frames = Frames {
            base: args.base_frame.clone(),
            flange: args.flange_frame.clone(),
            camera: format!("{camera_frame}{suffix}"),
            target: args.target_frame.clone(),
        };
        let placement = Placement { frames: &frames, base_from_camera, flange_from_target };
        let (name, text) = match args.format {
            PlacementFormat::RosStaticTf => (format!("static_tf{suffix}.launch.yaml"), placement.ros_static_tf()),
            PlacementFormat::Opencv => (format!("placement_opencv{suffix}.yml"), placement.file_storage()),
            PlacementFormat::EasyHandeye => {
                let namespace = format!("easy_handeye{suffix}");
                (format!("{namespace}.yaml"), placement.easy_handeye(&namespace))
            }
        };
        out.write(&name, text.as_bytes())?;
        stdout.push_str(&format!("{}\n", out.join(&name)));
    }
    let unit = if args.format == PlacementFormat::Opencv { "mm" } else { "m" };
    let (target, note) = match flange_from_target {
        Some(_) => (format!(", and {} from {}", args.flange_frame, args.target_frame), String::new()),
        None => (
            String::new(),
            format!("note: the target's turn on the flange is not known: only the {sensor}'s place is in the file\n"),
        ),
    };
    stdout.push_str(&format!("{} from {camera_frame}{target}, in {unit}\n{note}", args.base_frame));
    Ok(Outcome { stdout, status })
}

/// Of points in a left-handed frame: the frames of other programs are right-handed.
fn mirrored(path: &Utf8Path) -> config::Error {
    config::Error::Usage {
        message: format!(
            "{path} places points whose x was negated, for those of the file were mirrored (left-handed): the frame that they were read in has no place"
        ),
        hint: "negate the axis that is wrong in the table, as the instrument's own programs then show it, and run `stereocal locate` with that".to_owned(),
    }
}

/// The groups that are asked for.
fn groups<'a>(args: &ExportPlacement, file: &'a PlacementFile) -> Result<Vec<&'a GroupRecord>> {
    let asked = |group: &&GroupRecord| args.group.as_ref().is_none_or(|name| *name == group.group);
    let groups: Vec<&GroupRecord> = file.groups.iter().filter(asked).collect();
    if !groups.is_empty() {
        return Ok(groups);
    }
    let names: Vec<&str> = file.groups.iter().map(|group| group.group.as_str()).collect();
    let problem = match (&args.group, names.is_empty()) {
        (Some(name), false) => format!("--group {name}: the placement has {}", names.join(", ")),
        _ => "the placement holds no group: distances do not tell where the sensor stands".to_owned(),
    };
    Err(config::Error::Invalid { problems: vec![problem] }.into())
}
