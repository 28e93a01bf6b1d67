//! Lenses that are known, from the calibrations of other days and programs.
//!
//! In: files with one camera or two, each with the side that it is for where only one is meant. Out: [`KnownLenses`]. A
//! file of two cameras gives both lenses, or that of the side that is asked for; a file of one camera (ROS, mrcal,
//! OpenCV's sample, a Kalibr chain of one) needs the side, where no other stands beside it as a rig's do.

use std::str::FromStr;

use camino::Utf8PathBuf;

use super::export::Cameras;
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

/// How arrays become a file that is read.
const AS_TEXT: &str = "write it as text: `f = cv2.FileStorage('left.yml', cv2.FILE_STORAGE_WRITE)`, then `f.write(name, value)` of image_width, \
                       image_height, camera_matrix and distortion_coefficients, and `f.release()`";

/// The names by which lenses are read.
const NAMES: &str = "of OpenCV these are `camera_matrix`, `distortion_coefficients`, `image_width` and `image_height` (of two cameras `M1 D1 M2 D2`), in \
                     YAML, JSON or XML; files of ROS, Kalibr, mrcal, camodocal and a project of calib.io are read as they are, and a calibration.json of `stereocal camera-check`";

const HINT: &str = "`--intrinsics FILE` takes a calibration.json of `stereocal camera-check`, or a file of OpenCV, ROS, Kalibr or mrcal";

fn read_one(file: &LensFile) -> Result<KnownLenses> {
    let LensFile { path, side } = file;
    let refused = |message: String, hint: &str| files::Error::format(path, None, message, Some(hint));
    if path.extension().is_some_and(|extension| ["npz", "npy", "mat", "pkl"].contains(&extension)) {
        return Err(refused("a file of arrays, of which nothing says which is which".to_owned(), AS_TEXT));
    }
    let text = files::read_text(path, "file of a lens", Some("`--intrinsics FILE,left` or `--intrinsics FILE,right`"))?;
    let asked = |of: Side| side.is_none_or(|side| side == of);
    let in_file = export::read_cameras(&text).transpose().map_err(|message| refused(message, NAMES))?;
    match in_file {
        Some(Cameras::One(camera)) if side.is_some() => {
            return Ok(KnownLenses::of_cameras(Side::BOTH.map(|of| asked(of).then_some(camera))));
        }
        Some(Cameras::Two(both)) => {
            return Ok(KnownLenses::of_cameras(Side::BOTH.map(|of| asked(of).then_some(both[of as usize]))));
        }
        _ => {}
    }
    if in_file.is_none() && export::read(path, &text).is_none() && !text.contains("right_from_left") {
        return Err(refused("no lens by the names that are read".to_owned(), NAMES));
    }
    let read = calibration::read(path).map_err(|error| match (error, in_file) {
        (files::Error::Format { message, hint: None, .. }, Some(_)) => refused(
            format!("the file holds one camera, and as one of a rig: {message}"),
            &format!("say whose lens it is: `--intrinsics {path},left`"),
        ),
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
