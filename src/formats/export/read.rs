//! A rig in the words of other programs, read back.
//!
//! Angles and pixels mean the same in all of them (pixel (0, 0) is the centre of the top-left pixel); lengths are mm in
//! OpenCV's file and metres in the others, as is usual there. A lens that a format cannot say is refused, never
//! approximated.

use camino::Utf8Path;

use super::cameras::{self, Cameras, as_yaml};
use super::{file_storage, kalibr, mrcal, ros};
use crate::files;
use crate::stereo::Rig;

/// The files that [`read`] is given, by the names under which they are written: of two, the left camera's.
pub const NAMES: [&str; 4] = ["stereo_opencv.yml", "left.yaml", "camchain.yaml", "left.cameramodel"];

/// Reads a calibration in one of the formats that are written here; `None` where the text is none of them.
/// Formats with a file a camera are named by the left one; the right one stands beside it.
pub fn read(path: &Utf8Path, text: &str) -> Option<Result<Rig, String>> {
    let beside = || -> Result<String, String> {
        let name = path.file_name().unwrap_or_default();
        let right = path.with_file_name(name.replacen("left", "right", 1));
        if right == path {
            return Err(
                "name the left camera's file; the right camera's stands beside it with `right` for `left`".to_owned()
            );
        }
        files::read_text(&right, "the right camera's file", None)
            .map_err(|e| format!("the right camera's file {right}: {e}"))
    };
    if text.contains("'lensmodel'") {
        return Some(beside().and_then(|right| mrcal::read(text, &right)));
    }
    if text.contains("camera_matrix:") && text.contains("projection_matrix:") {
        return Some(beside().and_then(|right| ros::read(text, &right)));
    }
    if text.contains("T_cn_cnm1:") {
        return Some(kalibr::read(text));
    }
    let text = &*as_yaml(text);
    text.contains("!!opencv-matrix").then(|| file_storage::read(text))
}

/// Reads the lenses of a file: of one camera (ROS, mrcal, OpenCV's sample, a Kalibr chain of one), or of two by the
/// names of OpenCV's stereo sample. `None` where the text is none of them.
pub fn read_cameras(text: &str) -> Option<Result<Cameras, String>> {
    if text.contains("'lensmodel'") {
        return Some(mrcal::read_camera(text).map(Cameras::One));
    }
    if text.contains("distortion_model:") && text.contains("camera_matrix:") {
        return Some(ros::read_camera(text).map(Cameras::One));
    }
    if text.contains("cam0:") && !text.contains("cam1:") {
        return Some(kalibr::read_camera(text).map(Cameras::One));
    }
    cameras::read(&as_yaml(text))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::export::ExportedFile;
    use crate::geometry::transform;
    use crate::stereo::Lens;
    use crate::stereo::model::projection::tests::bent_camera;
    use crate::stereo::model::rectification::{Matrices, Scaling, essential, fundamental};
    use nalgebra::{Point3, Vector3};

    pub(super) fn rig(lens: Lens) -> Rig {
        let mut right = bent_camera(lens);
        right.fx += 31.25;
        Rig {
            left: bent_camera(lens),
            right,
            right_from_left: transform(Vector3::new(0.02, -0.35, 0.013), Vector3::new(-180.5, 2.25, 33.0)),
            covariance: None,
        }
    }

    /// px; the files keep 17 digits, rotations pass through a matrix or a rotation vector once.
    const ROUND_TRIP: f64 = 1e-8;

    fn assert_same(a: &Rig, b: &Rig) {
        for point in [Point3::new(0.0, 0.0, 600.0), Point3::new(-120.0, 90.0, 550.0), Point3::new(100.0, -80.0, 700.0)]
        {
            let (al, ar) = a.project(&point);
            let (bl, br) = b.project(&point);
            assert!((al - bl).norm() < ROUND_TRIP && (ar - br).norm() < ROUND_TRIP, "{al} {bl} {ar} {br}");
        }
        assert_eq!((a.left.width, a.right.height), (b.left.width, b.right.height));
    }

    /// What is read of files whose text is changed so.
    fn read_changed(files: &[ExportedFile], change: impl Fn(&str) -> String) -> Result<Rig, String> {
        let (_keep, dir) = crate::files::temporary_folder();
        files.iter().for_each(|file| std::fs::write(dir.join(file.name), change(&file.text)).unwrap());
        super::read(&dir.join(files[0].name), &change(&files[0].text)).unwrap()
    }

    #[test]
    fn every_format_reads_back() {
        for lens in Lens::LADDER {
            let rig = rig(lens);
            let mut written = vec![file_storage::files(&rig).unwrap()];
            written.extend(ros::files(&rig));
            written.extend(kalibr::files(&rig));
            written.extend(mrcal::files(&rig));
            let expected = match lens {
                Lens::Radial2 | Lens::Brown4 => 4,
                Lens::Brown5 | Lens::Rational8 => 3,
                Lens::ThinPrism12 => 2,
                Lens::Tilted14 => 1,
            };
            assert_eq!(written.len(), expected, "{lens:?}");
            for files in written {
                assert_same(&rig, &read_changed(&files, |text| text.to_owned()).unwrap());
            }
        }
    }

    /// What OpenCV reads is what it would say itself of the rig it reads: 1e-9 of each number's size (at least one).
    #[test]
    fn opencv_reads_its_file_and_says_the_same_of_it() {
        const SAME: f64 = 1e-9;
        for lens in Lens::LADDER {
            let rig = rig(lens);
            let text = &file_storage::files(&rig).unwrap()[0].text;
            let read = |name: &str| crate::opencv::read_matrix(text, name).unwrap();
            assert_eq!(read("M1"), rig.left.matrix().transpose().as_slice());
            assert_eq!(read("D1"), rig.left.distortion[..lens.vector_length()]);
            let back = file_storage::read(text).unwrap();
            let said = Matrices::new(&back, Scaling::OPENCV).unwrap();
            let e = essential(&back);
            let f = fundamental(&back).unwrap();
            let others = Matrices::new(&back, Scaling { zero_disparity: false, ..Scaling::OPENCV }).unwrap();
            let off = |name: &str, said: &[f64]| {
                let read = read(name);
                assert_eq!(read.len(), said.len(), "{name}");
                read.iter().zip(said).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs() / b.abs().max(1.0)))
            };
            for (name, said) in [
                ("R1", said.rotations[0].transpose().as_slice()),
                ("R2", said.rotations[1].transpose().as_slice()),
                ("P1", said.projections[0].transpose().as_slice()),
                ("P2", said.projections[1].transpose().as_slice()),
                ("Q", said.disparity_to_depth.transpose().as_slice()),
                ("E", e.transpose().as_slice()),
                ("F", f.transpose().as_slice()),
            ] {
                let off = off(name, said);
                assert!(off < SAME, "{lens:?} {name}: {off}");
            }
            // Matrices for other flags would not have passed.
            assert!(off("P1", others.projections[0].transpose().as_slice()) > SAME);
        }
    }

    /// Every format is held to what `calibration.json` is: no rotation, no lens and no list that is not what it says.
    #[test]
    fn what_is_no_rig_is_refused_in_every_format() {
        let rig = rig(Lens::Brown4);
        let read = |files: &[ExportedFile], from: &str, to: &str| {
            assert!(files.iter().any(|file| file.text != file.text.replacen(from, to, 1)), "{from}");
            read_changed(files, |text| text.replacen(from, to, 1)).unwrap_err()
        };
        let opencv = file_storage::files(&rig).unwrap();
        let (ros, kalibr, mrcal) =
            (ros::files(&rig).unwrap(), kalibr::files(&rig).unwrap(), mrcal::files(&rig).unwrap());
        let row = kalibr[0].text.lines().find(|line| line.starts_with("  - [")).unwrap().to_owned() + "\n";
        let fx = format!("{:?}", rig.left.fx);
        for (files, from, to, part) in [
            (
                &opencv,
                "R: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 0.",
                "R: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 1.",
                "not a rotation",
            ),
            (&opencv, &fx, "1e300", "fx is"),
            (&opencv, "image_width: ", "image_width: -", "width is -"),
            (&ros, "plumb_bob", "equidistant", "`equidistant`"),
            (
                &ros,
                "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [0.",
                "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [2.",
                "not a rotation",
            ),
            (&kalibr, "radtan", "equidistant", "`equidistant`"),
            (&kalibr, "pinhole", "omni", "`omni`"),
            (&kalibr, row.as_str(), &format!("{row}{row}"), "20 numbers, not 16"),
            (&kalibr, "[0.0, 0.0, 0.0, 1.0]", "[0.0, 0.0, 0.0, 2.0]", "last row"),
            (&mrcal, "LENSMODEL_OPENCV4", "LENSMODEL_OPENCV5", "LENSMODEL_OPENCV5"),
            (&mrcal, "LENSMODEL_OPENCV4", "LENSMODEL_SPLINED_STEREOGRAPHIC", "only LENSMODEL_PINHOLE"),
        ] {
            let said = read(files, from, to);
            assert!(said.contains(part), "{from} -> {to}: {said}");
        }
        let emptied = |files: &[ExportedFile], key: &str| {
            let start = files[0].text.find(key).unwrap() + key.len();
            let list = &files[0].text[start..][..files[0].text[start..].find(']').unwrap() + 1];
            read(files, &format!("{key}{list}"), &format!("{key}[ ]"))
        };
        assert!(emptied(&kalibr, "intrinsics: ").contains("has 0 numbers"));
        assert!(emptied(&mrcal, "'extrinsics': ").contains("has 0 numbers"));
    }
}
