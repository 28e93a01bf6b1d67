//! Folders of pictures as people have them, through the commands: what is taken, what is refused, and the same results
//! whatever the names.

use std::path::Path;

use crate::run::{stderr, stdout, stereocal, workplace};

/// Runs the program to the end and returns what it said.
fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = stereocal(folder, arguments);
    assert!(matches!(output.status.code(), Some(0 | 1)), "{arguments:?}: {}", stderr(&output));
    stderr(&output)
}

/// A small world, its pictures also under other names: `cams/cam1/b0001.png` with `cams/cam2/a0001.png`, both views in
/// each of `wide/` and `high/`.
fn world() -> tempfile::TempDir {
    let folder = workplace();
    let root = folder.path();
    let pairs = ["--check-pairs", "8", "--samples", "0", "--verify", "0"];
    done(root, &[&["simulate", "--preset", "small", "--size", "640", "--out", "world"], &pairs[..]].concat());
    for name in ["cams/cam1", "cams/cam2", "wide", "high"] {
        std::fs::create_dir_all(root.join(name)).unwrap();
    }
    for entry in std::fs::read_dir(root.join("world/check/left")).unwrap() {
        let left = entry.unwrap().path();
        let name = left.file_name().unwrap().to_str().unwrap().to_owned();
        let right = root.join("world/check/right").join(&name);
        std::fs::copy(&left, root.join("cams/cam1").join(format!("b{name}"))).unwrap();
        std::fs::copy(&right, root.join("cams/cam2").join(format!("a{name}"))).unwrap();
        let [left, right] = [left, right].map(|path| image::open(path).unwrap().to_luma8());
        let both = image::GrayImage::from_fn(2 * left.width(), left.height(), |x, y| {
            *if x < left.width() { left.get_pixel(x, y) } else { right.get_pixel(x - left.width(), y) }
        });
        both.save(root.join("wide").join(&name)).unwrap();
        let both = image::GrayImage::from_fn(left.width(), 2 * left.height(), |x, y| {
            *if y < left.height() { left.get_pixel(x, y) } else { right.get_pixel(x, y - left.height()) }
        });
        both.save(root.join("high").join(name)).unwrap();
    }
    folder
}

#[test]
fn the_same_pictures_give_the_same_rig_whatever_their_names() {
    let folder = world();
    let root = folder.path();
    let check = |arguments: &[&str], out: &str| {
        let said = done(root, &[&["camera-check"], arguments, &["--no-provenance", "--out", out]].concat());
        (std::fs::read(root.join(out).join("calibration.json")).unwrap(), said)
    };
    let (plain, said) = check(&["world/check"], "plain");
    assert!(said.contains("8 pairs by name: left left/*.png, right right/*.png"), "{said}");
    let (cams, said) = check(&["cams"], "cams_out");
    assert!(said.contains("8 pairs by number: left cam1/b*.png, right cam2/a*.png; no word tells"), "{said}");
    assert!(cams == plain);
    // What was read is named as the input, wherever it lies below the folder.
    done(root, &["camera-check", "cams", "--out", "cams_out"]);
    let written = std::fs::read_to_string(root.join("cams_out/camera-check.json")).unwrap();
    assert!(written.contains("\"pictures\": 16"), "{written}");
    let (given, _) = check(&["cams/cam1", "cams/cam2"], "given");
    assert!(given == plain);
    let (ordered, said) = check(&["cams", "--pair-by", "order"], "ordered");
    assert!(said.contains("8 pairs by order"), "{said}");
    assert!(ordered == plain);
    let (halves, said) = check(&["wide", "--side-by-side"], "halves");
    assert!(said.contains("8 pairs: the left and the right half of each picture in wide"), "{said}");
    assert!(halves == plain);
    let (halves, said) = check(&["high", "--top-bottom"], "halves");
    assert!(said.contains("8 pairs: the upper and the lower half of each picture in high"), "{said}");
    assert!(halves == plain);
    // Neither can be told from the names; the form of the pictures says which flag may be meant.
    for (name, flag) in [
        ("wide", "`stereocal camera-check wide --side-by-side`"),
        ("high", "`stereocal camera-check high --top-bottom`"),
    ] {
        let output = stereocal(root, &["camera-check", name]);
        assert!(output.status.code() == Some(2) && stderr(&output).contains(flag), "{}", stderr(&output));
    }
    // Exchanged by name: the geometry says so.
    let (_, said) = check(&["cams/cam2", "cams/cam1"], "exchanged");
    assert!(said.contains("are left and right exchanged, are the pictures of both cameras mirrored"), "{said}");
}

#[test]
fn measure_finds_the_poses_beside_two_folders() {
    let folder = workplace();
    let root = folder.path();
    let poses = ["--check-pairs", "0", "--samples", "12", "--verify", "0"];
    done(root, &[&["simulate", "--preset", "small", "--size", "640", "--out", "world"], &poses[..]].concat());
    let measure = |arguments: &[&str], out: &str| {
        let with = ["--calibration", "world/truth/calibration.json", "--no-provenance", "--out", out];
        done(root, &[&["measure"], arguments, &with].concat());
        std::fs::read(root.join(out).join("measurements.csv")).unwrap()
    };
    let one = measure(&["world/poses"], "one");
    assert!(measure(&["world/poses/left", "world/poses/right"], "two") == one);
    few_pairs_give_way_where_more_are_needed(root);
}

/// Of these pictures, which are empty, only what is taken is looked at: four pairs calibrate, three do with known
/// lenses, two say whether a rig still holds, and measure takes any number.
fn few_pairs_give_way_where_more_are_needed(root: &Path) {
    let pairs = |folder: &str, count: usize| {
        std::fs::create_dir_all(root.join(folder)).unwrap();
        for name in (0..count).flat_map(|k| [format!("left{k}.png"), format!("right{k}.png")]) {
            std::fs::write(root.join(folder).join(name), "").unwrap();
        }
    };
    for (set, few) in [(9, 3), (9, 2), (2, 1)] {
        pairs(&format!("of_{few}/set"), set);
        pairs(&format!("of_{few}/demo"), few);
        std::fs::copy(root.join("world/poses/poses.csv"), root.join(format!("of_{few}/poses.csv"))).unwrap();
    }
    let truth = "world/truth/calibration.json";
    for (arguments, taken) in [
        (["camera-check", "of_3", "--out", "none"], Some("9 pairs by name: left set/left*.png")),
        (["camera-check", "of_3", "--intrinsics", truth], None),
        (["camera-check", "of_2", "--intrinsics", truth], Some("9 pairs by name: left set/left*.png")),
        (["camera-check", "of_2", "--against", truth], None),
        (["camera-check", "of_1", "--against", truth], Some("2 pairs by name: left set/left*.png")),
        (["measure", "of_1", "--calibration", truth], None),
    ] {
        let said = stderr(&stereocal(root, &arguments));
        assert_eq!(said.contains("; not taken: demo/ ("), taken.is_some(), "{arguments:?}: {said}");
        assert!(said.contains(taken.unwrap_or("these pictures can be read in 2 ways")), "{arguments:?}: {said}");
    }
}

#[test]
fn a_second_place_that_is_none_is_told_from_a_folder_of_pictures() {
    let folder = workplace();
    let root = folder.path();
    for name in ["cam1/1.png", "cam1/2.png", "results/notes.txt", "calibration.json"] {
        let path = root.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, "").unwrap();
    }
    let refused = |arguments: &[&str], parts: &[&str]| {
        let output = stereocal(root, arguments);
        let said = stderr(&output);
        assert_eq!((output.status.code(), stdout(&output).as_str()), (Some(2), ""), "{said}");
        assert!(parts.iter().all(|part| said.contains(part)), "{arguments:?}: {said}");
    };
    refused(&["camera-check", "cam1", "nowhere"], &["folder not found", "`--out nowhere`"]);
    refused(&["camera-check", "cam1", "results"], &["no pictures here", "results"]);
    refused(&["camera-check", "cam1", "calibration.json"], &["this is a file", "--out"]);
    refused(&["camera-check", "cam1", "cam1", "more"], &["unexpected argument", "`--out more`"]);
    refused(&["camera-check", "cam1"], &["neither left nor right", "./: 2 pictures (1.png, 2.png)", "LEFT RIGHT"]);
    refused(&["camera-check", "cam1", "--side-by-side", "--bayer", "RGGB"], &["cannot be used with"]);
}
