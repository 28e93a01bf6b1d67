//! Lenses that are known, from the calibrations of other days and programs.
//!
//! In: files with one camera or two, each with the side that it is for where only one is meant. Out: [`KnownLenses`]. A
//! rig's file gives both lenses, or that of the side that is asked for; a file of one camera (ROS, mrcal, OpenCV's
//! example, a Kalibr chain of one) needs the side.

use std::str::FromStr;

use camino::{Utf8Path, Utf8PathBuf};

use super::{calibration, export};
use crate::files::{self, Result};
use crate::imaging::Side;
use crate::stereo::model::known_lenses::KnownLenses;

/// A file with lenses, and the side that it is for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LensFile {
    pub path: Utf8PathBuf,
    /// The side; both where `None`.
    pub side: Option<Side>,
}

impl FromStr for LensFile {
    type Err = String;

    fn from_str(text: &str) -> Result<LensFile, String> {
        let (path, side) = match text.rsplit_once(',') {
            Some((path, "left")) => (path, Some(Side::Left)),
            Some((path, "right")) => (path, Some(Side::Right)),
            _ => (text, None),
        };
        if path.is_empty() {
            return Err("a file is needed, and behind a comma `left` or `right` where it is for one camera".to_owned());
        }
        Ok(LensFile { path: path.into(), side })
    }
}

/// Reads them all; of two that are for one side the later counts.
pub fn read(named: &[LensFile]) -> Result<Option<KnownLenses>> {
    let all = named.iter().map(read_one).collect::<Result<Vec<KnownLenses>>>()?;
    Ok(all.into_iter().reduce(KnownLenses::and))
}

const HINT: &str = "`--intrinsics FILE` takes a calibration.json of `stereocal camera-check`, or a file of OpenCV, ROS, Kalibr or mrcal";

fn read_one(file: &LensFile) -> Result<KnownLenses> {
    let LensFile { path, side } = file;
    if let Some(side) = side
        && let Some(camera) = one_camera(path)?
    {
        return Ok(KnownLenses::of_cameras(Side::BOTH.map(|of| (of == *side).then_some(camera))));
    }
    let read = calibration::read(path).map_err(|error| match (error, side) {
        (files::Error::Format { message, place, hint: None }, None) => {
            let hint = Some(format!("of a file with one camera say which: `--intrinsics {path},left`"));
            files::Error::Format { message, place, hint }
        }
        (other, _) => other.with_hint(HINT),
    })?;
    let sides = side.map_or(Side::BOTH.to_vec(), |side| vec![side]);
    let mut known = KnownLenses::of_rig(&read.rig, &sides);
    known.pairs = read.pairs;
    known.noise = read.noise;
    known.pair_motion = read.pair_motion.filter(|_| known.both());
    known.pair_excess = read.pair_excess.unwrap_or(1.0);
    Ok(known)
}

/// The camera of a file that holds one; `None` where it holds a rig.
fn one_camera(path: &Utf8Path) -> Result<Option<crate::stereo::Camera>> {
    let text = files::read_text(path, "file of a lens", Some("`--intrinsics FILE,left` or `--intrinsics FILE,right`"))?;
    let camera = export::read_camera(&text);
    camera.transpose().map_err(|message| files::Error::format(path, None, message, None))
}
