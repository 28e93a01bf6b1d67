//! Folders of pictures as they come: broken files, other boards, hidden boards, and a second run on the same pictures.
#![allow(clippy::unwrap_used, reason = "a test ends where its files are not as they should be")]

use std::path::{Path, PathBuf};

use crate::run::{stderr, stdout, stereocal, workplace};

/// The repository's own pairs, in a folder that may be spoilt.
fn copied(folder: &Path) -> PathBuf {
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("calib_images");
    let to = folder.join("pictures");
    for side in ["left", "right"] {
        std::fs::create_dir_all(to.join(side)).unwrap();
        for entry in std::fs::read_dir(from.join(side)).unwrap() {
            let path = entry.unwrap().path();
            std::fs::copy(&path, to.join(side).join(path.file_name().unwrap())).unwrap();
        }
    }
    to
}

/// The first two of them.
fn two_pairs(folder: &Path) {
    let pictures = copied(folder);
    for name in 3..=10 {
        for side in ["left", "right"] {
            std::fs::remove_file(pictures.join(side).join(format!("{name:02}.png"))).unwrap();
        }
    }
}

/// Exit status and all that was said.
fn check(folder: &Path, more: &[&str]) -> (Option<i32>, String) {
    let arguments = [&["camera-check", "pictures", "--lens", "radial2"], more].concat();
    let output = stereocal(folder, &arguments);
    (output.status.code(), stderr(&output) + &stdout(&output) + &not_used(folder))
}

/// A line a pair that is not used, as camera-check.json has them: the screen has a line a cause.
fn not_used(folder: &Path) -> String {
    let Ok(text) = std::fs::read_to_string(folder.join("out/camera-check.json")) else { return String::new() };
    let file: serde_json::Value = serde_json::from_str(&text).unwrap();
    let line = |skipped: &serde_json::Value| {
        format!("pair {} is not used: {}\n", skipped["pair"].as_str().unwrap(), skipped["reason"].as_str().unwrap())
    };
    file["pairs_skipped"].as_array().unwrap().iter().map(line).collect()
}

#[test]
fn broken_pictures_are_skipped_with_their_reasons() {
    let folder = workplace();
    let pictures = copied(folder.path());
    let whole = std::fs::read(pictures.join("left/01.png")).unwrap();
    std::fs::write(pictures.join("left/01.png"), &whole[..whole.len() / 2]).unwrap();
    std::fs::write(pictures.join("left/02.png"), b"").unwrap();
    std::fs::write(pictures.join("right/03.png"), b"this is a text").unwrap();
    image::GrayImage::new(64, 64).save(pictures.join("right/04.png")).unwrap();
    // Part of the board behind a hand: the other corners are used.
    let mut hidden = image::open(pictures.join("left/05.png")).unwrap().to_luma8();
    let (w, h) = hidden.dimensions();
    for y in 9 * h / 20..11 * h / 20 {
        for x in 9 * w / 20..11 * w / 20 {
            hidden.put_pixel(x, y, image::Luma([90]));
        }
    }
    hidden.save(pictures.join("left/05.png")).unwrap();
    let (status, said) = check(folder.path(), &[]);
    assert!(matches!(status, Some(0 | 1)), "{said}");
    for reason in ["pair 01 is not used: left", "pair 02 is not used: left", "pair 03", "pair 04", "64x64"] {
        assert!(said.contains(reason), "{reason} is not in: {said}");
    }
    // Each reason has its line on the screen, too.
    for line in ["without 01: left picture: ", "without 02: left picture: ", "without 03: right picture: "] {
        assert!(said.contains(line), "{line} is not in: {said}");
    }
    assert!(!said.contains("pair 05 is not used"), "{said}");
    let corners = std::fs::read_to_string(folder.path().join("out/corners.csv")).unwrap();
    let left = corners.lines().filter(|line| line.starts_with("05,left")).count();
    assert!((200..361).contains(&left), "{left}");
}

/// Rings of the colours in which OpenCV draws the corners that it found.
fn drawn_over(path: &Path) {
    let mut picture = image::open(path).unwrap().to_rgb8();
    let (w, h) = picture.dimensions();
    for (row, colour) in [[255, 0, 0], [255, 128, 0], [200, 200, 0], [0, 255, 0]].into_iter().enumerate() {
        for k in 0..10 * 24 {
            let turn = f64::from(k % 24) * std::f64::consts::TAU / 24.0;
            let (x, y) = (f64::from(w) * (0.25 + 0.05 * f64::from(k / 24)), f64::from(h) * (0.3 + 0.1 * row as f64));
            picture.put_pixel((x + 4.0 * turn.cos()) as u32, (y + 4.0 * turn.sin()) as u32, image::Rgb(colour));
        }
    }
    picture.save(path).unwrap();
}

#[test]
fn pictures_into_which_corners_were_drawn_are_not_measured() {
    let folder = workplace();
    let pictures = copied(folder.path());
    let names: Vec<String> = (1..=10).map(|name| format!("{name:02}.png")).collect();
    let drawn = "has the corners drawn into it that a program found";
    drawn_over(&pictures.join("left").join(&names[2]));
    let (status, said) = check(folder.path(), &[]);
    assert!(
        matches!(status, Some(0 | 1)) && said.contains(&format!("pair 03 is not used: left picture: {drawn}")),
        "{said}"
    );
    for side in ["left", "right"] {
        names.iter().for_each(|name| drawn_over(&pictures.join(side).join(name)));
    }
    for more in [&["--force"][..], &["--force", "--squares", "auto"]] {
        let (status, said) = check(folder.path(), more);
        assert!(status == Some(2) && said.contains(drawn) && said.contains("hint: save the pictures"), "{said}");
    }
}

/// Corners of a list like corners.csv: pair, side, column, row, place.
fn corners_of(path: &Path) -> Vec<(String, [f64; 4])> {
    let text = std::fs::read_to_string(path).unwrap();
    let fields = text.lines().skip(1).map(|line| line.split(',').collect::<Vec<_>>());
    fields.map(|f| (format!("{} {}", f[0], f[1]), [2, 3, 4, 5].map(|k| f[k].parse().unwrap()))).collect()
}

#[test]
fn columns_behind_a_hand_are_numbered_by_the_other_pictures() {
    let folder = workplace();
    let pictures = copied(folder.path());
    // From some place on, in one picture of a pair, in the other, and in both alike.
    for (file, from, grey) in
        [("left/02.png", 0.62, 90), ("right/05.png", 0.55, 200), ("left/07.png", 0.66, 60), ("right/07.png", 0.66, 60)]
    {
        let mut picture = image::open(pictures.join(file)).unwrap().to_luma8();
        let width = f64::from(picture.width());
        for (x, _, pixel) in picture.enumerate_pixels_mut() {
            if f64::from(x) > from * width {
                pixel.0[0] = grey;
            }
        }
        picture.save(pictures.join(file)).unwrap();
    }
    let (status, said) = check(folder.path(), &[]);
    assert!(matches!(status, Some(0 | 1)), "{said}");
    assert!(said.contains("02, 05 only a part of the board is seen"), "{said}");
    assert!(said_of(&said, "07").contains("cannot be told"), "{said}");
    let truth = corners_of(&Path::new(env!("CARGO_MANIFEST_DIR")).join("calib_images/truth/corners.csv"));
    let found = corners_of(&folder.path().join("out/corners.csv"));
    for picture in ["02 left", "02 right", "05 left", "05 right"] {
        let here: Vec<[f64; 4]> = found.iter().filter(|(of, _)| of == picture).map(|(_, corner)| *corner).collect();
        assert!(here.len() > 100, "{picture}: {} corners", here.len());
        // The board looks the same after a half turn.
        let right = |turned: bool| {
            here.iter().all(|[col, row, x, y]| {
                let (col, row) = if turned { (18.0 - col, 18.0 - row) } else { (*col, *row) };
                truth.iter().any(|(of, t)| of == picture && t[..2] == [col, row] && (t[2] - x).hypot(t[3] - y) < 2.0)
            })
        };
        assert!(right(false) || right(true), "{picture}: wrong numbers");
    }
}

#[test]
fn a_board_is_counted_measured_and_read_from_files() {
    let folder = workplace();
    copied(folder.path());
    let corners = || std::fs::read_to_string(folder.path().join("out/corners.csv")).unwrap();
    let (status, said) = check(folder.path(), &[]);
    assert!(matches!(status, Some(0 | 1)), "{said}");
    let known = corners();
    let target = "target_type: 'checkerboard' #gridtype\ntargetCols: 19\ntargetRows: 19\nrowSpacingMeters: 0.01\ncolSpacingMeters: 0.01\n";
    std::fs::write(folder.path().join("target.yaml"), target).unwrap();
    for (more, words) in [
        (["--squares", "auto"], "the board has 20x20 squares: "),
        (["--board", "target.yaml"], "20x20 squares of 10 mm"),
    ] {
        let (again, said) = check(folder.path(), &more);
        assert!(again == status && said.contains(words), "{words}: {said}");
        assert_eq!(corners(), known);
    }
    // A print that is half a percent large: lengths follow, and the caliper's uncertainty is in the verdict.
    // Of a size that nobody gave nothing is said.
    for (given, words) in [(&["--square-mm", "10"][..], "10.05 mm, not 10 mm; by"), (&[], "10.05 mm; by a caliper")] {
        let (_, said) = check(folder.path(), &[&["--measured-mm", "201.0x201.0"], given].concat());
        assert!(said.contains(&format!("squares of {words}")) && said.contains("20x20 squares of 10.05"), "{said}");
    }
    let text = std::fs::read_to_string(folder.path().join("out/camera-check.json")).unwrap();
    assert!(text.contains("10.05"), "{text}");
    for (extent, why) in [("180x180", "inner corners"), ("210x210", "+5.0 %")] {
        let (status, said) = check(folder.path(), &["--measured-mm", extent]);
        assert!(status == Some(2) && said.contains(why), "{extent}: {said}");
    }
    // Boards of two sizes, and none that is whole.
    std::fs::create_dir(folder.path().join("none")).unwrap();
    for side in ["left", "right"] {
        std::fs::create_dir(folder.path().join("none").join(side)).unwrap();
        image::GrayImage::from_pixel(64, 64, image::Luma([90]))
            .save(folder.path().join("none").join(side).join("1.png"))
            .unwrap();
    }
    let output = stereocal(folder.path(), &["camera-check", "none", "--squares", "auto"]);
    assert!(output.status.code() == Some(2) && stderr(&output).contains("cannot be counted"), "{}", stderr(&output));
}

#[test]
fn a_grid_of_tags_is_calibrated_and_its_corners_have_kalibrs_numbers() {
    let folder = workplace();
    std::fs::write(
        folder.path().join("target.yaml"),
        "target_type: 'aprilgrid'\ntagCols: 5\ntagRows: 4\ntagSize: 0.024 #m\ntagSpacing: 0.3\n",
    )
    .unwrap();
    std::fs::write(folder.path().join("stereocal.toml"), "[check_board]\nboard = \"target.yaml\"\n").unwrap();
    let simulate =
        ["simulate", "--size", "900", "--check-pairs", "8", "--samples", "1", "--verify", "1", "--out", "world"];
    assert_eq!(stereocal(folder.path(), &simulate).status.code(), Some(0));
    let output = stereocal(folder.path(), &["camera-check", "world/check"]);
    let said = stderr(&output) + &stdout(&output);
    assert!(matches!(output.status.code(), Some(0 | 1)) && said.contains("5x4 tags of 24 mm, 7.2 mm apart"), "{said}");
    assert!(said.contains("8 of 8 pairs used"), "{said}");
    let truth = corners_of(&folder.path().join("world/truth/corners.csv"));
    let found = corners_of(&folder.path().join("out/corners.csv"));
    assert!(found.len() > 1100, "{} corners", found.len());
    for (picture, [col, row, x, y]) in &found {
        let (_, [_, _, a, b]) = truth.iter().find(|(of, t)| of == picture && t[..2] == [*col, *row]).unwrap();
        assert!((a - x).hypot(b - y) < 0.3, "{picture} {col},{row} is off by {} {}", x - a, y - b);
    }
    // By their numbers alone: the lower left corner of the lower left tag is 0.
    let text = std::fs::read_to_string(folder.path().join("out/corners.csv")).unwrap();
    assert!(text.lines().any(|line| line.contains(",0,7,") && line.ends_with(",0")), "{text}");
    let without = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        [&fields[..2], &fields[4..]].concat().join(",") + "\n"
    };
    std::fs::write(folder.path().join("by-id.csv"), text.lines().map(without).collect::<String>()).unwrap();
    let again = ["camera-check", "--corners", "by-id.csv", "--out", "again"];
    let output = stereocal(folder.path(), &again);
    assert!(matches!(output.status.code(), Some(0 | 1)), "{}", stderr(&output));
    assert_eq!(corners_of(&folder.path().join("again/corners.csv")), found);
}

#[test]
fn a_board_with_markers_that_is_said_to_be_plain_is_named() {
    let folder = workplace();
    let config = "[check_board]\nboard = \"charuco:7x5:24:18:DICT_4X4_50\"\n";
    std::fs::write(folder.path().join("stereocal.toml"), config).unwrap();
    let simulate =
        ["simulate", "--size", "700", "--check-pairs", "6", "--samples", "1", "--verify", "1", "--out", "world"];
    assert_eq!(stereocal(folder.path(), &simulate).status.code(), Some(0));
    std::fs::remove_file(folder.path().join("stereocal.toml")).unwrap();
    let plain = ["camera-check", "world/check", "--squares", "7x5", "--square-mm", "24"];
    let output = stereocal(folder.path(), &plain);
    let said = stderr(&output);
    assert!(output.status.code().is_some_and(|status| status > 1), "{said}");
    assert!(said.contains("shows a board with markers of DICT_4X4_50 in its squares"), "{said}");
    assert!(said.contains("`--board charuco:COLUMNSxROWS:SQUARE:MARKER:DICT_4X4_50`"), "{said}");
}

#[test]
fn a_second_run_reads_what_the_first_found_and_survives_a_torn_file() {
    let folder = workplace();
    copied(folder.path());
    let corners = || std::fs::read(folder.path().join("out/corners.csv")).unwrap();
    let (status, said) = check(folder.path(), &["--draw"]);
    assert!(matches!(status, Some(0 | 1)), "{said}");
    assert!(folder.path().join("out/overlays/01.png").is_file());
    let first = corners();
    let entries: Vec<PathBuf> =
        std::fs::read_dir(folder.path().join("out/cache")).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(entries.len(), 20);
    let entry = std::fs::read(&entries[0]).unwrap();
    std::fs::write(&entries[0], &entry[..entry.len() / 2]).unwrap();
    check(folder.path(), &[]);
    assert_eq!(first, corners());
    assert_eq!(std::fs::read(&entries[0]).unwrap(), entry);
}

#[test]
fn a_changed_entry_of_the_cache_is_not_believed() {
    let folder = workplace();
    copied(folder.path());
    let corners = || std::fs::read(folder.path().join("out/corners.csv")).unwrap();
    check(folder.path(), &[]);
    let first = corners();
    for entry in std::fs::read_dir(folder.path().join("out/cache")).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        let corner = text.lines().nth(2).unwrap();
        std::fs::write(&path, text.replace(corner, &corner.replace('1', "2"))).unwrap();
    }
    check(folder.path(), &[]);
    assert_eq!(first, corners());
}

/// All files that a run wrote but the cache's, by name.
fn results(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<(String, Vec<u8>)> = std::fs::read_dir(folder.join("out"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_file())
        .map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(&path).unwrap()))
        .collect();
    files.sort();
    files
}

#[test]
fn simulated_boards_are_those_that_were_named() {
    let folder = workplace();
    let boards = ["--board", "checker:9x6:25", "--target-board", "charuco:5x4:16:12:DICT_4X4_50"];
    let few = ["--size", "640", "--check-pairs", "6", "--samples", "8", "--verify", "0", "--out", "."];
    let made = stereocal(folder.path(), &[&["simulate"], &boards[..], &few].concat());
    assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
    let check = ["camera-check", "check", "--board", "checker:9x6:25", "--tolerance-mm", "1"];
    let checked = stereocal(folder.path(), &check);
    assert!(stdout(&checked).contains("6 of 6 pairs used"), "{}{}", stdout(&checked), stderr(&checked));
    let measured = stereocal(folder.path(), &["measure", "poses", "--board", boards[3]]);
    assert!(stdout(&measured).starts_with("12 of 12 poses measured"), "{}{}", stdout(&measured), stderr(&measured));
}

#[test]
fn first_and_second_run_and_any_number_of_threads_give_the_same_bytes() {
    // The repository's pictures and a simulated world.
    for seed in 0..2 {
        let folder = workplace();
        if seed == 0 {
            copied(folder.path());
        } else {
            let world = ["simulate", "--preset", "small", "--size", "640", "--samples", "0", "--verify", "0"];
            let more = ["--seed", &seed.to_string(), "--out", "world"];
            assert!(stereocal(folder.path(), &[&world[..], &more].concat()).status.success());
            std::fs::rename(folder.path().join("world/check"), folder.path().join("pictures")).unwrap();
        }
        let run = |threads: &str| {
            std::process::Command::new(env!("CARGO_BIN_EXE_stereocal"))
                .current_dir(folder.path())
                .args(["camera-check", "pictures", "--lens", "radial2", "--no-provenance"])
                .env("RAYON_NUM_THREADS", threads)
                .output()
                .unwrap();
            results(folder.path())
        };
        let cold = run("2");
        assert!(cold.iter().any(|(name, _)| name == "calibration.json"), "seed {seed}");
        let warm = run("2");
        std::fs::remove_dir_all(folder.path().join("out")).unwrap();
        let one = run("1");
        for ((name, bytes), others) in cold.iter().zip(warm.iter().zip(&one)) {
            assert!(*bytes == others.0.1 && *bytes == others.1.1, "seed {seed}: {name}");
        }
    }
}

#[test]
fn another_size_of_board_is_named() {
    let folder = workplace();
    two_pairs(folder.path());
    let (status, said) = check(folder.path(), &["--squares", "19x19"]);
    assert_eq!(status, Some(2), "{said}");
    assert!(said.contains("--squares 20x20"), "{said}");
}

/// Gives a picture of one pair to another, and the other way round.
fn exchange(pictures: &Path, one: &str, other: &str) {
    let aside = pictures.join("aside");
    std::fs::rename(pictures.join(one), &aside).unwrap();
    std::fs::rename(pictures.join(other), pictures.join(one)).unwrap();
    std::fs::rename(aside, pictures.join(other)).unwrap();
}

#[test]
fn mixed_up_pictures_are_named_as_what_they_are() {
    let folder = workplace();
    let pictures = copied(folder.path());
    exchange(&pictures, "left/02.png", "right/02.png");
    exchange(&pictures, "right/05.png", "right/07.png");
    image::open(pictures.join("right/04.png")).unwrap().rotate180().save(pictures.join("right/04.png")).unwrap();
    for side in ["left", "right"] {
        std::fs::copy(pictures.join(side).join("09.png"), pictures.join(side).join("11.png")).unwrap();
    }
    let (status, said) = check(folder.path(), &[]);
    assert!(matches!(status, Some(0 | 1)), "{said}");
    for (pair, reason) in [
        ("02", "left and right picture are exchanged"),
        ("04", "the right picture is turned by 180 degrees"),
        ("05", "taken at the same time as the right one of pair 07"),
        ("07", "taken at the same time as the right one of pair 05"),
        ("11", "the same pictures as pair 09"),
    ] {
        let line = said.lines().find(|line| line.contains(&format!("pair {pair} is not used")));
        assert!(line.is_some_and(|line| line.contains(reason)), "{pair}, {reason}: {said}");
    }
    assert!(said.contains("6 of 11 pairs"), "{said}");
}

#[test]
fn exchanged_folders_are_a_rig_and_said() {
    let folder = workplace();
    let pictures = copied(folder.path());
    let straight = check(folder.path(), &[]);
    assert!(!straight.1.contains("are left and right exchanged"), "{}", straight.1);
    exchange(&pictures, "left", "right");
    let exchanged = check(folder.path(), &[]);
    assert_eq!(straight.0, exchanged.0);
    assert!(exchanged.1.contains("are left and right exchanged"), "{}", exchanged.1);
}

#[test]
fn a_board_in_a_larger_or_smaller_one_is_named() {
    let folder = workplace();
    two_pairs(folder.path());
    for wrong in ["18x12", "22x21"] {
        let (status, said) = check(folder.path(), &["--squares", wrong]);
        assert_eq!(status, Some(2), "{said}");
        assert!(said.contains("hint: `--squares 20x20`"), "{wrong}: {said}");
    }
}

#[test]
fn files_that_are_no_pictures_are_said_to_be_none() {
    let folder = workplace();
    for side in ["left", "right"] {
        std::fs::create_dir_all(folder.path().join("pictures").join(side)).unwrap();
        for name in ["1.png", "2.png", "3.pgm", "4.pgm", "5.jpg"] {
            // What a header promises must not be believed: ten thousand million pixels.
            let bytes: &[u8] = if name.ends_with("pgm") { b"P5 100000 100000 255\n" } else { b"GIF89a" };
            std::fs::write(folder.path().join("pictures").join(side).join(name), bytes).unwrap();
        }
    }
    let (status, said) = check(folder.path(), &[]);
    assert_eq!(status, Some(2), "{said}");
    assert!(
        said.contains("1, 2, 5: both pictures: cannot be decoded") && said.contains("hint: save the pictures"),
        "{said}"
    );
    assert!(said.contains("3, 4: both pictures: announces 100000x100000 px"), "{said}");
}

/// One line said about a pair.
fn said_of<'a>(said: &'a str, pair: &str) -> &'a str {
    said.lines().find(|line| line.contains(&format!("pair {pair} is not used"))).unwrap_or_default()
}

#[test]
fn what_is_no_picture_to_measure_is_named() {
    let folder = workplace();
    let pictures = copied(folder.path());
    let at = |name: &str| pictures.join(name);
    let grey = |name: &str| image::open(pictures.join(name)).unwrap().to_luma8();
    // A JPEG cut off at 70 %.
    let mut jpeg = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut jpeg, 95).encode_image(&grey("left/01.png")).unwrap();
    std::fs::remove_file(at("left/01.png")).unwrap();
    std::fs::write(at("left/01.jpg"), &jpeg[..jpeg.len() * 7 / 10]).unwrap();
    // A header that announces 100 000 000 x 1 px.
    std::fs::remove_file(at("left/02.png")).unwrap();
    std::fs::write(at("left/02.pgm"), b"P5 100000000 1 255\n").unwrap();
    // A raw mosaic: red and blue see less.
    let mut mosaic = grey("right/03.png");
    for (x, y, pixel) in mosaic.enumerate_pixels_mut() {
        let gain = [[0.6, 1.0], [1.0, 0.5]][(y % 2) as usize][(x % 2) as usize];
        pixel.0[0] = (f64::from(pixel.0[0]) * gain) as u8;
    }
    mosaic.save(at("right/03.png")).unwrap();
    // Two fields: the odd rows were taken three pixels later.
    let whole = grey("left/04.png");
    let mut fields = whole.clone();
    for (x, y, pixel) in fields.enumerate_pixels_mut() {
        if y % 2 == 1 {
            *pixel = *whole.get_pixel(x.saturating_sub(3), y);
        }
    }
    fields.save(at("left/04.png")).unwrap();
    let (status, said) = check(folder.path(), &[]);
    assert!(matches!(status, Some(0..=3)), "{said}");
    for (pair, reason) in [
        ("01", "the JPEG is cut off or damaged"),
        ("02", "announces 100000000x1 px"),
        ("03", "raw colour mosaic"),
        ("04", "interlaced"),
    ] {
        assert!(said_of(&said, pair).contains(reason), "{pair}, {reason}: {said}");
    }
    assert!(said_of(&said, "03").contains("--bayer RGGB"), "{said}");
}

#[cfg(unix)]
#[test]
fn a_pipe_is_not_waited_for() {
    let folder = workplace();
    let pictures = copied(folder.path());
    std::fs::remove_file(pictures.join("left/01.png")).unwrap();
    let made = std::process::Command::new("mkfifo").arg(pictures.join("left/01.png")).status();
    if !made.is_ok_and(|status| status.success()) {
        println!("skipped: no mkfifo here");
        return;
    }
    let (status, said) = check(folder.path(), &[]);
    assert!(matches!(status, Some(0 | 1)), "{said}");
    assert!(said_of(&said, "01").contains("not a regular file"), "{said}");
}
