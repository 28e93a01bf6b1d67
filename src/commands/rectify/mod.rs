//! `stereocal rectify`: pairs of pictures undistorted, on common rows, for eyes and for dense stereo.

mod rows;

use camino::Utf8Path;
use nalgebra::{Matrix3, Point2};
use rayon::prelude::*;

use self::rows::{boards, look_for};
use super::heed::{RigDoubts, heed_rig};
use super::{Outcome, Result};
use crate::cli::Rectify;
use crate::config::Config;
use crate::diagnostic::Status;
use crate::files::provenance::Run;
use crate::files::{self, OutDir};
use crate::formats::calibration;
use crate::formats::rectified::{Coverage, RectifiedFile};
use crate::imaging::image::raster::{Raster, Samples};
use crate::imaging::image::{self, Claim, Header};
use crate::imaging::input::pairs::PairFiles;
use crate::imaging::{self, Skipped};
use crate::opencv::{Failure, Map, remap, undistort_rectify_map};
use crate::stereo::model::rectification::{Matrices, Scaling};
use crate::stereo::volume::Volume;
use crate::stereo::{self, Rig, Side};
use crate::{progress, report};

/// Share of a rectified picture below which it shows too little to be of use.
const LITTLE: f64 = 0.25;

pub fn run(args: &Rectify, config: &Config, run: Run) -> Result<Outcome> {
    let out = OutDir::open(args.output.out.as_deref().unwrap_or(&config.out))?;
    let rig_file = calibration::file(args.calibration.as_deref(), out.path(), &config.out)?;
    let calibrated = calibration::read(&rig_file)?;
    let RigDoubts { said: mut doubts, status_without_uncertainty: at_best, .. } = heed_rig(&calibrated, &rig_file);
    let trusted_mm = calibrated.trusted_mm();
    let calibration::Calibrated { rig, board, volume, .. } = calibrated;
    let run = Run { force: args.output.force, ..run };
    let source = args.pairs.source("rectify", &args.images);
    let out = out.for_run(&run, &[source.places().as_slice(), &[&rig_file]].concat());
    let pairing = source.pairs(&out)?;
    progress::note(&pairing.taken);
    pairing.left_out().iter().for_each(progress::note);
    let headers = headers(&pairing.pairs, &rig)?;
    let names: Vec<[String; 2]> = pairing.pairs.iter().map(names).collect();
    let to_write: Vec<&str> = names.iter().flatten().map(String::as_str).collect();
    out.check_free(&to_write)?;
    out.check_free(&["rectified.json", "rectify.html"])?;

    let Plan { mut file, maps, matrices, lost } = plan(args, &rig, volume.as_ref())?;
    let bar = progress::bar("rectifying", pairing.pairs.len() as u64);
    let done: Vec<std::result::Result<(), String>> = (pairing.pairs.par_iter(), &headers, &names)
        .into_par_iter()
        .map(|(files, headers, names)| {
            bar.inc(1);
            let both = match rectified(files, headers, &maps, args.bayer) {
                Ok(both) => both,
                Err(reason) => return Ok(Err(reason)),
            };
            names.iter().zip(both).try_for_each(|(name, png)| out.write(name, &png)).map(Ok)
        })
        .collect::<Result<_, files::Error>>()?;
    bar.finish_and_clear();
    let kept = kept(pairing.pairs.iter().zip(names).zip(done), &mut file.pairs_skipped);
    if kept.is_empty() {
        return Err(imaging::Error::NoneReadable { path: pairing.place, skipped: file.pairs_skipped }.into());
    }
    let rectified = written(&out, &kept);
    let boards = boards(args, config, board)?;
    let found = if args.undistort_only { None } else { look_for(&rectified, &boards) };
    file.size = rows::size(found.as_ref(), board, matrices.as_ref(), trusted_mm);
    let (file, shown) = rows::judge(file, kept, found, &boards);
    let of_board = report::rectify::doubts(&file);
    of_board.iter().filter(|_| lost.is_none()).for_each(progress::warn);
    let is_in_doubt = lost.is_some() || !of_board.is_empty();
    let status = if is_in_doubt { Status::OutOfTolerance } else { Status::Done };
    let json = out.write_json("rectified.json", &file)?;
    doubts.extend(lost.into_iter().chain(of_board));
    let page = report::rectify::page(&file, &rectified, shown.as_ref(), &doubts)?;
    report::page::write(&out, "rectify.html", page)?;
    let stdout = if args.output.json { json } else { report::rectify::summary(&file, &out) };
    Ok(Outcome { stdout, status: status.or_worse(at_best) })
}

/// The pairs that were written; the others go to those that were skipped, with a word.
fn kept<'a>(
    pairs: impl Iterator<Item = ((&'a PairFiles, [String; 2]), std::result::Result<(), String>)>,
    skipped: &mut Vec<Skipped>,
) -> Vec<(String, [String; 2])> {
    let mut kept = Vec::new();
    for ((files, names), outcome) in pairs {
        match outcome {
            Ok(()) => kept.push((files.pair.clone(), names)),
            Err(reason) => {
                progress::warn(format!("pair {} is not rectified: {reason}", files.pair));
                skipped.push(Skipped { pair: files.pair.clone(), reason });
            }
        }
    }
    kept
}

/// The pairs as they were written.
fn written(out: &OutDir, kept: &[(String, [String; 2])]) -> Vec<PairFiles> {
    let files = |(pair, [left, right]): &(String, [String; 2])| PairFiles {
        pair: pair.clone(),
        left: out.join(left),
        right: out.join(right),
    };
    kept.iter().map(files).collect()
}

/// The headers of all pictures. Another size than the calibration's ends the run before anything is written; a picture
/// that is none is told from the others later.
fn headers(pairs: &[PairFiles], rig: &Rig) -> Result<Vec<[std::result::Result<Header, String>; 2]>> {
    let headers: Vec<_> = pairs.par_iter().map(|p| [&p.left, &p.right].map(|path| image::header(path))).collect();
    for of_pair in &headers {
        for (side, header) in Side::BOTH.into_iter().zip(of_pair) {
            if let Ok(header) = header {
                rig.camera(side).check_picture_size(side, (header.width, header.height))?;
            }
        }
    }
    Ok(headers)
}

/// Names of a pair's rectified pictures below the results folder: the raw ones', as PNG.
fn names(files: &PairFiles) -> [String; 2] {
    let name = |side: Side, path: &Utf8Path| {
        format!("rectified/{}/{}.png", side.name(), path.file_stem().unwrap_or(&files.pair))
    };
    [name(Side::Left, &files.left), name(Side::Right, &files.right)]
}

/// A picture with its colours at the places of a map.
fn remapped(raw: &Raster, map: &Map) -> Result<Raster, Failure> {
    let samples = match &raw.samples {
        Samples::Eight(v) => Samples::Eight(remap(v, raw.width, raw.channels, map)?),
        Samples::Sixteen(v) => Samples::Sixteen(remap(v, raw.width, raw.channels, map)?),
    };
    let (width, height) = map.size();
    Ok(Raster { width, height, channels: raw.channels, samples })
}

/// What will be done to the pictures, and what is said of it.
struct Plan {
    file: RectifiedFile,
    maps: [Map; 2],
    /// Of common rows.
    matrices: Option<Matrices>,
    /// That the pictures will not show where the boards of the calibration stood.
    lost: Option<String>,
}

fn plan(args: &Rectify, rig: &Rig, volume: Option<&Volume>) -> Result<Plan> {
    let (width, height) = (rig.left.width, rig.left.height);
    let map = |side: Side, r: &Matrix3<f64>, p: &Matrix3<f64>, size| {
        let camera = rig.camera(side);
        let mut map = undistort_rectify_map(&camera.for_opencv(), r, p, size).map_err(stereo::Error::from)?;
        let folded = map.empty_folds(&Point2::new(camera.cx, camera.cy), (camera.width, camera.height));
        if folded > 0.0 {
            progress::warn(format!(
                "the {} camera's lens model holds no longer toward the borders, where no board stood: {:.0} % of the rectified picture stays black. \
                 Boards nearer to the borders at the calibration, or a poorer `--lens`, tell it there",
                side.name(),
                (100.0 * folded).max(1.0)
            ));
        }
        Ok::<Map, stereo::Error>(map)
    };
    let raw = Side::BOTH.map(|side| (rig.camera(side).width, rig.camera(side).height));
    let coverage = |maps: &[Map; 2]| Coverage { left: maps[0].coverage(raw[0]), right: maps[1].coverage(raw[1]) };
    if args.undistort_only {
        let alone = |side: Side| map(side, &Matrix3::identity(), &rig.camera(side).matrix(), raw[side as usize]);
        let maps = [alone(Side::Left)?, alone(Side::Right)?];
        let file = RectifiedFile::undistorted(rig, coverage(&maps));
        return Ok(Plan { file, maps, matrices: None, lost: None });
    }
    let alpha = args.alpha.unwrap_or(Scaling::OPENCV.alpha);
    let scaling = Scaling { alpha, zero_disparity: args.zero_disparity };
    let matrices = Matrices::new(rig, scaling).map_err(stereo::Error::from)?;
    let both = |side: Side| {
        let (r, p) = matrices.of(side);
        map(side, r, &p.fixed_view::<3, 3>(0, 0).into_owned(), (width, height))
    };
    let maps = [both(Side::Left)?, both(Side::Right)?];
    let coverage = coverage(&maps);
    let least = coverage.left.min(coverage.right);
    if least == 0.0 || least.is_nan() {
        let reason = "one of the rectified pictures would show nothing of the raw one".to_owned();
        return Err(stereo::Error::NoCommonRows { reason }.into());
    }
    if least < LITTLE {
        progress::warn(format!(
            "a rectified picture shows something in {:.0} % of its area only: `--alpha 1` keeps all of the raw one, and without \
             `--zero-disparity` each picture is centred on what its camera sees",
            100.0 * least
        ));
    }
    let lost = volume.and_then(|volume| lost(volume, rig, &matrices));
    lost.iter().for_each(progress::warn);
    let file = RectifiedFile::rectified(rig, &matrices, scaling, coverage);
    Ok(Plan { file, maps, matrices: Some(matrices), lost })
}

/// That a rectified picture does not show the middle of where the boards stood: common rows look at right angles to the
/// line between the cameras, and of cameras that look along it, or at one near place, that is elsewhere.
fn lost(volume: &Volume, rig: &Rig, matrices: &Matrices) -> Option<String> {
    let [low, high] = volume.bounding_box_mm(rig);
    let middle_mm = 0.5 * (low + high);
    let in_rectified = matrices.of(Side::Left).0 * middle_mm;
    let is_shown = |side: Side| {
        let at = matrices.of(side).1 * in_rectified.push(1.0);
        let share = |px: f64, size: u32| (0.0..f64::from(size)).contains(&(px / at.z + 0.5));
        at.z > 0.0 && share(at.x, rig.left.width) && share(at.y, rig.left.height)
    };
    let side = Side::BOTH.into_iter().find(|side| !is_shown(*side))?;
    Some(format!(
        "the rectified {} pictures do not show where the boards of the calibration stood ({:.0} mm away): cameras that look at one near place lose it \
         from view on common rows. `--alpha 1` keeps all of the raw pictures, without `--zero-disparity` each is centred on what its camera sees; \
         otherwise measure points in the raw pictures",
        side.name(),
        middle_mm.z
    ))
}

/// Both pictures of a pair through the maps, as PNG; the reason where one cannot be read.
fn rectified(
    files: &PairFiles,
    headers: &[std::result::Result<Header, String>; 2],
    maps: &[Map; 2],
    mosaic: Option<image::Mosaic>,
) -> std::result::Result<[Vec<u8>; 2], String> {
    let one = |side: Side, path: &Utf8Path| {
        let say = |reason: String| format!("{} picture: {reason}", side.name());
        let header = headers[side as usize].as_ref().map_err(|reason| say(reason.clone()))?;
        let _claim = Claim::wait(header);
        let raw = Raster::read(path, header, mosaic).map_err(say)?;
        let size = (header.width as usize, header.height as usize);
        if (raw.width, raw.height) != size {
            return Err(say("is not of the size that its header announces".to_owned()));
        }
        let rectified = remapped(&raw, &maps[side as usize]).map_err(|e| say(e.to_string()))?;
        rectified.png().ok_or_else(|| say("cannot be written as PNG".to_owned()))
    };
    Ok([one(Side::Left, &files.left)?, one(Side::Right, &files.right)?])
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::geometry::transform;
    use crate::stereo::Camera;
    use crate::stereo::volume::outline::Hull;

    #[test]
    fn boards_that_common_rows_lose_are_said() {
        let camera = Camera::pinhole(1280, 720, 640.0);
        let lost_by = |turn: f64, right_mm: Vector3<f64>| {
            let left_from_right = transform(Vector3::new(0.0, turn, 0.0), right_mm);
            let rig = Rig { left: camera, right: camera, right_from_left: left_from_right.inverse(), covariance: None };
            let corners = [(690.0, 290.0), (840.0, 290.0), (840.0, 580.0), (690.0, 580.0)];
            let outline = Hull::of(corners.map(|(x, y)| Point2::new(x, y)));
            let volume =
                Volume { left_px: outline.clone(), right_px: outline, depth_mm: [800.0, 1200.0], tilt_deg: [0.0; 4] };
            lost(&volume, &rig, &Matrices::new(&rig, Scaling::OPENCV).unwrap())
        };
        assert_eq!(lost_by(0.0, Vector3::new(60.0, 0.0, 0.0)), None);
        assert_eq!(lost_by(-0.2, Vector3::new(100.0, 0.0, 10.0)), None);
        // Far round the board, and far in front of the other.
        let said = lost_by(0.83, Vector3::new(-520.0, 0.0, 450.0)).unwrap();
        assert!(said.contains("1000 mm away"), "{said}");
    }
}
