//! The lenses in a file of one camera or of two, by the names that programs and people give them.
//!
//! In: the text of a file of OpenCV's FileStorage (YAML, JSON, or XML as [`as_yaml`] has it), of a ROS message, of
//! camodocal (a pinhole), of calib.io's Calibrator (a project), or as people write it. Out: its cameras; how they stand
//! to each other is not asked. A file that says no size (OpenCV's stereo sample writes none) gives cameras of none,
//! width and height zero: theirs is that of the pictures. Lenses of another model than OpenCV's (fisheye,
//! omnidirectional) are refused by what the file calls them, and by a matrix with a skew. Goes wrong: a file of another
//! model that says so nowhere.

use std::borrow::Cow;
use std::fmt::Write;

use roxmltree::{Document, Node};
use serde_json::Value;

use super::scan::{behind, list, number};
use crate::formats::checked;
use crate::stereo::Camera;

/// Names that programs give the matrix and the coefficients of a single camera: OpenCV's sample of today and of its
/// second version, ROS messages, and what people write by hand.
const ONE: [(&str, &str); 6] = [
    ("camera_matrix", "distortion_coefficients"),
    ("Camera_Matrix", "Distortion_Coefficients"),
    ("cameraMatrix", "distCoeffs"),
    ("camera_matrix", "dist_coeffs"),
    ("cameraMatrix", "distortion"),
    ("K", "D"),
];

/// Those of two cameras, each with the camera's number behind it: OpenCV's stereo sample, and what people write.
const TWO: [(&str, &str); 5] = [
    ("M", "D"),
    ("K", "D"),
    ("cameraMatrix", "distCoeffs"),
    ("camera_matrix_", "dist_coeffs_"),
    ("CAMERA_MATRIX_", "DISTORTION_COEFF_"),
];

/// What a file holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cameras {
    One(Camera),
    /// Left and right.
    Two([Camera; 2]),
}

/// The cameras of a file; `None` where it holds none by these names.
pub fn read(text: &str) -> Option<Result<Cameras, String>> {
    if text.contains("libCalib::CameraModel") {
        return Some(of_calibrator(text));
    }
    if stands(text, "projection_parameters") && stands(text, "distortion_parameters") {
        return Some(of_camodocal(text).map(Cameras::One));
    }
    let has = |(matrix, lens): &(&str, &str)| stands(text, matrix) && stands(text, lens);
    if let Some((matrix, lens)) = ONE.iter().find(|names| has(names)) {
        return Some(one(text, size(text, ""), matrix, lens).map(Cameras::One));
    }
    Some(two(text)?.map(Cameras::Two))
}

/// Left and right, by the names of one program; `None` where they are not there.
pub fn two(text: &str) -> Option<Result<[Camera; 2], String>> {
    let numbered = |(matrix, lens): &(&str, &str)| [1, 2].map(|i| [format!("{matrix}{i}"), format!("{lens}{i}")]);
    let has = |names: &[[String; 2]; 2]| names.as_flattened().iter().all(|name| stands(text, name));
    let [[left, left_lens], [right, right_lens]] = TWO.iter().map(numbered).find(has)?;
    let left_size = size(text, "");
    let right_size = size(text, "right_").or(left_size);
    let both = one(text, left_size, &left, &left_lens)
        .and_then(|first| Ok([first, one(text, right_size, &right, &right_lens)?]));
    Some(both)
}

fn stands(text: &str, key: &str) -> bool {
    matches!(behind(text, key), Ok(Some(_)))
}

/// Width and height of the pictures, where the file says them; of the right ones where it names them so.
fn size(text: &str, of: &str) -> Option<(f64, f64)> {
    let of_keys = |[width, height]: [&str; 2]| {
        Some((number(text, &format!("{of}{width}")).ok()?, number(text, &format!("{of}{height}")).ok()?))
    };
    // A ROS message has a height and a width of its region of interest, too, indented.
    let flush = |key: &str| text.lines().find_map(|line| line.strip_prefix(key)?.trim().parse::<f64>().ok());
    let message = || flush("width:").zip(flush("height:")).filter(|_| of.is_empty());
    [["image_width", "image_height"], ["image_Width", "image_Height"]].into_iter().find_map(of_keys).or_else(message)
}

fn one(text: &str, size: Option<(f64, f64)>, matrix: &str, distortion: &str) -> Result<Camera, String> {
    of_opencv(text)?;
    let pinhole = pinhole(matrix, &list(text, matrix, Some(9))?)?;
    let coefficients = list(text, distortion, None)?;
    let lens = checked::lens_of_length(coefficients.len())?;
    let camera = checked::camera(size.unwrap_or((1.0, 1.0)), &pinhole, lens, &coefficients)?;
    Ok(if size.is_some() { camera } else { Camera { width: 0, height: 0, ..camera } })
}

/// The coefficients of OpenCV's vector, in its order.
const OF_OPENCV: [&str; 14] = ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tauX", "tauY"];

/// The pinhole of camodocal, which writes each number by its own name.
fn of_camodocal(text: &str) -> Result<Camera, String> {
    of_opencv(text)?;
    let size = size(text, "").ok_or("no `image_width` and `image_height`: add both lines, the size of the pictures")?;
    let all = |names: &[&str]| names.iter().map(|name| number(text, name)).collect::<Result<Vec<f64>, String>>();
    let coefficients = all(&OF_OPENCV[..4])?;
    checked::camera(size, &all(&["fx", "fy", "cx", "cy"])?, checked::lens_of_length(4)?, &coefficients)
}

/// The cameras of a project of calib.io's Calibrator, of its model of OpenCV's lens.
fn of_calibrator(text: &str) -> Result<Cameras, String> {
    let project: Value = serde_json::from_str(text).map_err(|error| format!("no project of calib.io: {error}"))?;
    let cameras = project["Calibration"]["cameras"].as_array().map_or(&[][..], Vec::as_slice);
    let one = |camera: &Value| {
        let model = &camera["model"];
        // The first camera of a model names it for all.
        if let Some(other) = model["polymorphic_name"].as_str().filter(|name| *name != "libCalib::CameraModelOpenCV") {
            return Err(format!("a camera's model is {other}; libCalib::CameraModelOpenCV is read"));
        }
        let data = &model["ptr_wrapper"]["data"];
        let size = &data["CameraModelCRT"]["CameraModelBase"]["imageSize"];
        let side = |key: &str| size[key].as_f64().ok_or_else(|| format!("no `imageSize` with a {key}"));
        let value = |key: &str| {
            let number = data["parameters"][key]["val"].as_f64();
            number.ok_or_else(|| format!("no parameter `{key}` of a camera"))
        };
        // Which of both focal lengths it multiplies the file does not say.
        if (value("ar")? - 1.0).abs() > 1e-9 {
            return Err("`ar` is not 1: cameras of pixels that are not square are not read".to_owned());
        }
        let pinhole = [value("f")?, value("f")?, value("cx")?, value("cy")?];
        let mut lens = OF_OPENCV.iter().map(|key| value(key)).collect::<Result<Vec<f64>, String>>()?;
        let used = lens.iter().rposition(|number| *number != 0.0).map_or(0, |last| last + 1);
        lens.truncate([4, 5, 8, 12, 14].into_iter().find(|count| *count >= used).unwrap_or(14));
        checked::camera((side("width")?, side("height")?), &pinhole, checked::lens_of_length(lens.len())?, &lens)
    };
    match cameras {
        [camera] => one(camera).map(Cameras::One),
        [left, right] => Ok(Cameras::Two([one(left)?, one(right)?])),
        others => Err(format!("the project holds {} cameras; one or two are read", others.len())),
    }
}

/// `fx fy cx cy` of a camera matrix that stands row by row; the reason where it is none, or has a skew.
pub(super) fn pinhole(name: &str, matrix: &[f64]) -> Result<[f64; 4], String> {
    /// What numbers of six digits leave, as a share of the focal length.
    const ROUNDING: f64 = 1e-6;
    let &[fx, skew, cx, a, fy, cy, b, c, last] = matrix else {
        return Err(format!("`{name}` has {} numbers, not 9", matrix.len()));
    };
    if [a, b, c, last - 1.0].iter().any(|off| off.abs() > ROUNDING) {
        let column_by_column = cx == 0.0 && cy == 0.0;
        let why = if column_by_column { ": it stands column by column (transposed)" } else { "" };
        return Err(format!("`{name}` is no camera matrix{why}; row by row that is fx 0 cx, 0 fy cy, 0 0 1"));
    }
    if skew.abs() > ROUNDING * fx.abs() {
        return Err(format!(
            "`{name}` has a skew of {skew} px, which OpenCV's fisheye model has and lenses that are read have not"
        ));
    }
    Ok([fx, fy, cx, cy])
}

/// Words by which files call lenses that are not OpenCV's pinhole with radial and tangential terms.
const OTHERS: [&str; 11] =
    ["fisheye", "equidist", "kannala", "omni", "mei", "fov", "atan", "ftheta", "sphere", "ucm", "scaramuzza"];

/// Refuses a file that says that its lens is of another model.
fn of_opencv(text: &str) -> Result<(), String> {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    for (at, _) in text.match_indices(':') {
        let bare = |side: &str| side.trim_matches(|c: char| c.is_whitespace() || "\"'".contains(c)).to_owned();
        let key = text[..at].trim_end_matches(['"', '\'', ' ']).rsplit(|c| !is_part(c)).next().unwrap_or_default();
        let value = bare(text[at + 1..].split(['\n', ',', '}', '#']).next().unwrap_or_default());
        let (key, low) = (key.to_ascii_lowercase(), value.to_ascii_lowercase());
        let is_set = value.parse::<f64>().map_or(low == "true", |number| number != 0.0);
        let is_other = match key.as_str() {
            "fisheye_model" | "fisheye" | "xi" => is_set,
            _ => key.contains("model") && OTHERS.iter().any(|other| low.contains(other)),
        };
        if is_other {
            return Err(format!(
                "the file says `{key}: {value}`: its lens is of another model; lenses are read in OpenCV's terms without fisheye \
                 (k1 k2 p1 p2 k3 ...)"
            ));
        }
    }
    Ok(())
}

/// The text of a file of OpenCV's FileStorage in XML as it is in YAML; any other text as it is.
pub(super) fn as_yaml(text: &str) -> Cow<'_, str> {
    if !text.contains("<opencv_storage") {
        return Cow::Borrowed(text);
    }
    let Ok(document) = Document::parse(text) else { return Cow::Borrowed(text) };
    let mut yaml = String::from("%YAML:1.0\n---\n");
    for node in document.root_element().children().filter(Node::is_element) {
        let of = |name: &str| node.children().find(|child| child.has_tag_name(name)).and_then(|child| child.text());
        let name = node.tag_name().name();
        // Writing into a String does not fail.
        let _ = match (of("rows"), of("cols"), of("data")) {
            (Some(rows), Some(columns), Some(data)) => {
                let data = data.split_whitespace().collect::<Vec<_>>().join(", ");
                writeln!(yaml, "{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   data: [ {data} ]")
            }
            _ => writeln!(yaml, "{name}: {}", node.text().unwrap_or_default().trim()),
        };
    }
    Cow::Owned(yaml)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stereo::Lens;

    const K: &str = "[ 800., 0., 320., 0., 801., 240., 0., 0., 1. ]";

    fn matrix(name: &str, rows: usize, columns: usize, data: &str) -> String {
        format!("{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: {data}\n")
    }

    fn of_names(k: &str, d: &str) -> String {
        matrix(k, 3, 3, K) + &matrix(d, 1, 5, "[ 0.1, -0.2, 0.001, 0.002, 0.3 ]")
    }

    fn only(text: &str) -> Camera {
        match read(&as_yaml(text)) {
            Some(Ok(Cameras::One(camera))) => camera,
            other => panic!("{text}: {other:?}"),
        }
    }

    #[test]
    fn a_camera_is_read_by_every_name_with_its_size_or_without() {
        let size = "image_width: 640\nimage_height: 480\n";
        for (k, d) in ONE {
            let bare = only(&of_names(k, d));
            let sized = only(&(size.to_owned() + &of_names(k, d)));
            assert_eq!([bare.width, bare.height, sized.width, sized.height], [0, 0, 640, 480], "{k} {d}");
            assert_eq!((sized.fx, sized.fy, sized.cx, sized.cy), (800.0, 801.0, 320.0, 240.0));
            assert_eq!(sized.distortion[..5], [0.1, -0.2, 0.001, 0.002, 0.3]);
        }
        let message = "D:\n- 0.1\n- -0.2\n- 0.001\n- 0.002\nK:\n- 800.0\n- 0.0\n- 320.0\n- 0.0\n- 801.0\n- 240.0\n- 0.0\n- 0.0\n- 1.0\n\
                       distortion_model: plumb_bob\nheight: 480\nroi:\n  height: 0\n  width: 0\nwidth: 640\n";
        let camera = only(message);
        assert_eq!((camera.width, camera.height, camera.fy), (640, 480, 801.0));
    }

    #[test]
    fn pinholes_of_camodocal_and_projects_of_the_calibrator_are_read() {
        let pinhole = "model_type: PINHOLE\nimage_width: 640\nimage_height: 480\ndistortion_parameters:\n   k1: 0.1\n   k2: -0.2\n   \
                       p1: 0.001\n   p2: 0.002\nprojection_parameters:\n   fx: 800.\n   fy: 801.\n   cx: 320.\n   cy: 240.\n";
        let camera = only(pinhole);
        assert_eq!((camera.width, camera.fy, camera.distortion[3]), (640, 801.0, 0.002));
        let omni = pinhole.replace("PINHOLE", "MEI");
        assert!(matches!(read(&omni), Some(Err(why)) if why.contains("another model")));

        let of = |k3: f64, ar: f64| {
            let named: Vec<String> = OF_OPENCV
                .iter()
                .map(|key| format!("\"{key}\": {{\"val\": {}}}", if *key == "k3" { k3 } else { 0.0 }))
                .collect();
            format!(
                "{{\"model\": {{\"polymorphic_name\": \"libCalib::CameraModelOpenCV\", \"ptr_wrapper\": {{\"data\": {{\"CameraModelCRT\": {{\"CameraModelBase\": \
                 {{\"imageSize\": {{\"width\": 640, \"height\": 480}}}}}}, \"parameters\": {{\"f\": {{\"val\": 800}}, \"ar\": {{\"val\": {ar}}}, \"cx\": {{\"val\": 320}}, \
                 \"cy\": {{\"val\": 240}}, {}}}}}}}}}}}",
                named.join(", ")
            )
        };
        let project = |cameras: &[String]| format!("{{\"Calibration\": {{\"cameras\": [{}]}}}}", cameras.join(", "));
        let unnamed = of(0.0, 1.0).replace("\"polymorphic_name\": \"libCalib::CameraModelOpenCV\", ", "");
        let two = read(&project(&[of(0.3, 1.0), unnamed]));
        let Some(Ok(Cameras::Two([left, right]))) = two else { panic!("{two:?}") };
        assert_eq!((left.fy, left.lens, left.distortion[4]), (800.0, Lens::Brown5, 0.3));
        assert_eq!((right.lens, right.height), (Lens::Brown4, 480));
        assert!(matches!(read(&project(&[of(0.3, 1.2)])), Some(Err(why)) if why.contains("not square")));
        let other = of(0.3, 1.0).replace("ModelOpenCV", "ModelFisheye");
        assert!(matches!(read(&project(&[other])), Some(Err(why)) if why.contains("CameraModelFisheye")));
    }

    #[test]
    fn xml_says_the_same_as_yaml() {
        let of = |name: &str, rows: usize, columns: usize, data: &str| {
            format!(
                "<{name} type_id=\"opencv-matrix\">\n  <rows>{rows}</rows>\n  <cols>{columns}</cols>\n  <dt>d</dt>\n  <data>\n    {data}</data></{name}>\n"
            )
        };
        let xml = format!(
            "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_width>640</image_width>\n<image_height>480</image_height>\n<!-- flags -->\n{}{}</opencv_storage>\n",
            of("camera_matrix", 3, 3, "800. 0. 320. 0. 801. 240.\n    0. 0. 1."),
            of("distortion_coefficients", 5, 1, "0.1 -0.2 0.001 0.002\n 0.3"),
        );
        let yaml =
            "image_width: 640\nimage_height: 480\n".to_owned() + &of_names("camera_matrix", "distortion_coefficients");
        assert_eq!(only(&xml), only(&yaml));
    }

    #[test]
    fn two_cameras_need_neither_size_nor_place() {
        for (k, d) in TWO {
            let text: String = [1, 2].map(|i| of_names(&format!("{k}{i}"), &format!("{d}{i}"))).concat();
            assert!(matches!(read(&text), Some(Ok(Cameras::Two([left, _]))) if left.fx == 800.0), "{k} {d}");
        }
        assert_eq!(read("version: 3\nleft: 4\n"), None);
    }

    #[test]
    fn lenses_of_another_model_and_matrices_that_are_none_are_refused() {
        let plain = of_names("camera_matrix", "distortion_coefficients");
        for said in ["fisheye_model: 0\n", "camera_model: pinhole\n", "\"model\": \"opencv\",\n", "xi: 0\n"] {
            only(&(said.to_owned() + &plain));
        }
        for said in [
            "fisheye_model: 1\n",
            "distortion_model: equidistant\n",
            "{\"model\": \"fisheye\", \"width\": 3}\n",
            "camera_model: \"KANNALA_BRANDT\"\n",
            "model_type: MEI\n",
            "xi: 1.2\n",
            "fisheye: true\n",
        ] {
            let refused = read(&(said.to_owned() + &plain)).unwrap().unwrap_err();
            assert!(refused.contains("another model"), "{said}: {refused}");
        }
        for (data, why) in [
            ("[ 800., 35., 320., 0., 801., 240., 0., 0., 1. ]", "a skew of 35 px"),
            ("[ 800., 0.01, 320., 0., 801., 240., 0., 0., 1. ]", "a skew of 0.01 px"),
            ("[ 800., 0., 0., 0., 801., 0., 320., 240., 1. ]", "transposed"),
            ("[ 800., 0., 320., 0., 801., 240., 0., 0., 2. ]", "no camera matrix"),
        ] {
            let refused = read(&plain.replace(K, data)).unwrap().unwrap_err();
            assert!(refused.contains(why), "{data}: {refused}");
        }
    }
}
