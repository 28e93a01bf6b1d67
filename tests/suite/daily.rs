//! Daily use: lenses that are known from another day or program, and whether a calibration still holds.

use std::path::Path;
use std::sync::LazyLock;

use serde_json::Value;

use crate::run::{Files, files_below, stderr, stdout, stereocal, with_files, workplace};

/// Shifts the right pictures' corners of a `corners.csv` along x by what a turn of the right camera by so many rad does
/// to them, to first order.
fn turned(folder: &Path, from: &str, to: &str, focal_px: f64, rad: f64) {
    let text = std::fs::read_to_string(folder.join(from)).unwrap();
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let at = |name: &str| header.iter().position(|h| *h == name).unwrap();
    let (side, x, width) = (at("side"), at("x_px"), at("width_px"));
    let mut out = format!("{}\n", header.join(","));
    for line in text.lines().skip(1) {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        if fields[side] == "right" {
            let middle = 0.5 * fields[width].parse::<f64>().unwrap();
            let off = (fields[x].parse::<f64>().unwrap() - middle) / focal_px;
            fields[x] = format!("{:.6}", middle + focal_px * (off + rad * (1.0 + off * off)));
        }
        out.push_str(&fields.join(","));
        out.push('\n');
    }
    std::fs::write(folder.join(to), out).unwrap();
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Eight pairs, calibrated into `out`, and the corners of some of them in files of their own.
fn calibrated() -> tempfile::TempDir {
    static MADE: LazyLock<Files> = LazyLock::new(|| files_below(made().path()));
    with_files(&MADE)
}

fn made() -> tempfile::TempDir {
    let folder = workplace();
    let at = folder.path();
    let few = ["--check-pairs", "8", "--samples", "0", "--verify", "0", "--seed", "3"];
    let made = stereocal(at, &[&["simulate", "--preset", "small", "--out", "."], &few[..]].concat());
    assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
    let checked = stereocal(at, &["camera-check", "check"]);
    assert!(checked.status.code().unwrap() <= 1, "{}", stderr(&checked));
    let corners = std::fs::read_to_string(at.join("out/corners.csv")).unwrap();
    let mut names: Vec<&str> = corners.lines().skip(1).filter_map(|line| line.split(',').next()).collect();
    names.dedup();
    names.sort_unstable();
    names.dedup();
    let some = |file: &str, keep: &dyn Fn(usize) -> bool| {
        let kept: Vec<&str> = names.iter().enumerate().filter(|(i, _)| keep(*i)).map(|(_, name)| *name).collect();
        let lines =
            corners.lines().enumerate().filter(|(i, line)| *i == 0 || kept.contains(&line.split(',').next().unwrap()));
        let text: String = lines.map(|(_, line)| format!("{line}\n")).collect();
        std::fs::write(at.join(file), text).unwrap();
    };
    some("three.csv", &|i| i < 3);
    some("five.csv", &|i| i >= 3);
    folder
}

#[test]
fn three_pairs_and_the_lenses_of_any_program_make_a_rig() {
    let folder = calibrated();
    let at = folder.path();
    let own = ["camera-check", "--corners", "five.csv", "--lens", "brown4", "--out", "lens"];
    assert!(stereocal(at, &own).status.code().unwrap() <= 1);
    for format in ["opencv", "ros", "kalibr", "mrcal"] {
        let told = stereocal(
            at,
            &["export", "calibration", "--format", format, "--calibration", "lens/calibration.json", "--out", format],
        );
        assert_eq!(told.status.code(), Some(0), "{format}: {}", stderr(&told));
    }
    let without = stereocal(at, &["camera-check", "--corners", "three.csv", "--out", "none"]);
    assert!(stderr(&without).contains("calibration needs 4"), "{}", stderr(&without));
    let truth = json(&at.join("truth/calibration.json"))["right_from_left"]["translation_mm"][0].as_f64().unwrap();
    let named: [&[&str]; 6] = [
        &["lens/calibration.json"],
        &["opencv/stereo_opencv.yml"],
        &["ros/left.yaml,left", "ros/right.yaml,right"],
        &["kalibr/camchain.yaml"],
        &["mrcal/left.cameramodel,left", "mrcal/right.cameramodel,right"],
        &["lens/calibration.json,left", "opencv/stereo_opencv.yml,right"],
    ];
    for files in named {
        let lenses: Vec<&str> = files.iter().flat_map(|file| ["--intrinsics", file]).collect();
        let found = stereocal(
            at,
            &[&["camera-check", "--corners", "three.csv", "--out", "known", "--force"], &lenses[..]].concat(),
        );
        assert!(found.status.code().unwrap() <= 1, "{files:?}: {}", stderr(&found));
        let said = stdout(&found);
        assert!(
            said.contains("3 of 3 pairs used") && said.contains("agree with the known lenses"),
            "{files:?}: {said}"
        );
        let x = json(&at.join("known/calibration.json"))["right_from_left"]["translation_mm"][0].as_f64().unwrap();
        assert!((x - truth).abs() < 0.5, "{files:?}: {x} mm, the truth is {truth}");
        assert!(!said.contains("differs by 0.00 %"), "{said}");
        let states = files[0] == "lens/calibration.json" && files.len() == 1;
        assert_eq!(stderr(&found).contains("comes without a covariance"), !states, "{files:?}");
    }
}

#[test]
fn lenses_that_are_not_there_not_read_or_of_other_pictures_are_refused() {
    let folder = calibrated();
    let at = folder.path();
    let refused = |lens: &str, more: &[&str]| {
        let arguments = ["camera-check", "--corners", "three.csv", "--out", "known", "--intrinsics", lens];
        let output = stereocal(at, &[&arguments[..], more].concat());
        assert_eq!(output.status.code(), Some(2), "{lens}: {}{}", stdout(&output), stderr(&output));
        assert!(!at.join("known/calibration.json").exists());
        stderr(&output)
    };
    let nowhere = refused("nowhere.json", &[]);
    assert!(nowhere.contains("nowhere.json") && !nowhere.contains("--calibration"), "{nowhere}");
    assert!(refused("out/calibration.json", &["--lens", "brown4"]).contains("leave one out"));
    std::fs::write(at.join("one.yml"), "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 800., 0., 320., 0., 800., 240., 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   data: [ 0., 0., 0., 0., 0. ]\n").unwrap();
    let other = refused("one.yml,left", &[]);
    assert!(other.contains("the left pictures are") && other.contains("640x480"), "{other}");
    assert!(refused("one.yml", &[]).contains("--intrinsics one.yml,left"));
}

#[test]
fn a_rig_that_stands_is_valid_and_one_that_turned_is_named_with_a_history() {
    let folder = calibrated();
    let at = folder.path();
    let own = ["camera-check", "--corners", "five.csv", "--out", "before"];
    assert!(stereocal(at, &own).status.code().unwrap() <= 1);
    let check = |corners: &str| {
        let arguments =
            ["camera-check", "--corners", corners, "--against", "before/calibration.json", "--tolerance-mm", "1"];
        let output = stereocal(at, &arguments);
        (output.status.code(), stdout(&output), stderr(&output))
    };
    let (status, said, messages) = check("three.csv");
    assert_eq!(status, Some(0), "{said}{messages}");
    assert!(said.starts_with("STILL VALID: no change beyond chance; 3 pairs would have shown"), "{said}");
    assert!(!said.split_whitespace().any(|word| ["0.0000", "-0.0000"].contains(&word)), "{said}");
    // A size of squares that is not the board's is no change of the rig.
    let other = ["--against", "before/calibration.json", "--square-mm", "12", "--out", "other"];
    let other = stereocal(at, &[&["camera-check", "--corners", "three.csv"], &other[..]].concat());
    assert_eq!(other.status.code(), Some(2), "{}{}", stdout(&other), stderr(&other));
    assert!(stderr(&other).contains("not where they are of 12 mm as is said"), "{}", stderr(&other));
    assert!(!at.join("other/recheck.json").exists());
    let focal = json(&at.join("before/calibration.json"))["right"]["fx"].as_f64().unwrap();
    turned(at, "three.csv", "turned.csv", focal, 0.01);
    let (status, said, messages) = check("turned.csv");
    assert_eq!(status, Some(3), "{said}{messages}");
    assert!(said.starts_with("CHANGED: "), "{said}");
    let file = json(&at.join("out/recheck.json"));
    assert!(file["cause"].as_str().unwrap().split('|').any(|cause| cause == "yaw"), "{file}");
    let history = std::fs::read_to_string(at.join("out/recheck.csv")).unwrap();
    assert_eq!(history.lines().count(), 3, "{history}");
    assert!(
        history.lines().nth(1).unwrap().contains(",still-valid,")
            && history.lines().nth(2).unwrap().contains(",changed,")
    );
    assert!(std::fs::read_to_string(at.join("out/recheck.html")).unwrap().contains("Over time"));
    // One pair that contradicts the others: terminal, file, page and history say by how much.
    let [of_three, of_turned] = ["three.csv", "turned.csv"].map(|file| std::fs::read_to_string(at.join(file)).unwrap());
    let last = of_three.lines().last().and_then(|line| line.split(',').next()).unwrap();
    let lines = of_three.lines().zip(of_turned.lines());
    let one: Vec<&str> = lines.map(|(a, b)| if a.starts_with(&format!("{last},")) { b } else { a }).collect();
    std::fs::write(at.join("last.csv"), one.join("\n")).unwrap();
    let (status, said, messages) = check("last.csv");
    assert_eq!(status, Some(1), "{said}{messages}");
    let file = json(&at.join("out/recheck.json"));
    let statement = file["statement"].as_str().unwrap();
    assert!(statement.contains(&format!("pair {last} contradicts the calibration")), "{statement}");
    assert!(said.starts_with(&format!("UNDECIDED: {statement}\n")), "{said}");
    assert_eq!(file["effect_mm"], file["pairs_contradicting"][0]["effect_mm"]);
    assert!(file["effect_mm"].as_f64().unwrap() > 1.0, "{file}");
    let page = std::fs::read_to_string(at.join("out/recheck.html")).unwrap();
    assert!(page.contains("error of a length by pairs that contradict") && !page.contains("<b>0 mm</b>"));
    let history = std::fs::read_to_string(at.join("out/recheck.csv")).unwrap();
    assert!(history.lines().last().is_some_and(|line| !line.contains(",0.000000,")), "{history}");
    // The pictures of the left camera for those of the right one are no change of the rig.
    let other_side = |line: &str| match line.split(',').nth(1) {
        Some("left") => line.replacen(",left,", ",right,", 1),
        _ => line.replacen(",right,", ",left,", 1),
    };
    let three = std::fs::read_to_string(at.join("three.csv")).unwrap();
    let exchanged: Vec<String> = three.lines().map(other_side).collect();
    std::fs::write(at.join("exchanged.csv"), exchanged.join("\n")).unwrap();
    let (status, _, messages) = check("exchanged.csv");
    assert!(status == Some(2) && messages.contains("left and right pictures are exchanged"), "{status:?} {messages}");
    std::fs::write(at.join("one.csv"), "pair,side\n").unwrap();
    assert_eq!(check("one.csv").0, Some(2));
}

/// The volume that was judged, a second board, what lengths can be trusted to and why not, as the terminal has them.
#[test]
fn a_check_says_what_it_judged_and_by_what() {
    let folder = calibrated();
    let at = folder.path();
    let check = |more: &[&str]| {
        let output = stereocal(at, &[&["camera-check", "--out", "said", "--tolerance-mm", "1"], more].concat());
        assert!(output.status.code().unwrap() <= 1, "{}", stderr(&output));
        stdout(&output)
    };
    let all = ["--corners", "out/corners.csv"];
    let said = check(&all);
    assert!(
        said.contains("for where the boards were: ") && said.contains("deciding check: held-out lengths, "),
        "{said}"
    );
    assert!(said.contains("compare that with a ruler"), "{said}");
    let said = check(&[&all[..], &["--volume", "all"]].concat());
    assert!(said.contains("for all that both cameras see ") && !said.contains("where the boards were: "), "{said}");
    let said = check(&[&all[..], &["--volume", "-20,-20,500,20,20,560"]].concat());
    assert!(said.contains("for the box from -20, -20, 500 to 20, 20, 560 mm, in all directions"), "{said}");
    // In metres, beside the view, a temperature in K, an expansion in 1/K: refused with what was meant.
    let refused = |more: &[&str], hint: &str| {
        let output = stereocal(at, &[&["camera-check", "--out", "refused"], &all[..], more].concat());
        assert_eq!(output.status.code(), Some(2), "{more:?}: {}", stdout(&output));
        assert!(stderr(&output).contains(hint), "{more:?}: {}", stderr(&output));
    };
    refused(&["--volume", "-0.02,-0.02,0.5,0.02,0.02,0.56"], "is in mm in the left camera's frame");
    refused(&["--volume", "2000,-20,500,2100,20,560"], "the boards were within ");
    refused(&["--board-temperature-c", "293", "--expansion-ppm-per-k", "23"], "in deg C, not in K");
    refused(&["--board-temperature-c", "25", "--expansion-ppm-per-k", "0.000023"], "it is in 1e-6/K, 23 for aluminium");
    // A file of corners that shows less than the board that is named.
    let larger = stereocal(at, &[&["camera-check", "--out", "larger", "--squares", "24x22"], &all[..]].concat());
    assert!(stderr(&larger).contains(": `--squares 20x20` if the board has no more"), "{}", stderr(&larger));
    // A second board: here the same one once more, its corners first, so that its pictures are not known again.
    let said = check(&[&all[..], &["--check-images", "check"]].concat());
    assert!(said.contains("second board: 8 pairs, largest error 0.0") && !said.contains("with a ruler"), "{said}");
    // A board that is known no better than that is what has to be measured, not the pictures.
    let said = check(&[&all[..], &["--board-uncertainty-mm", "1.5"]].concat());
    assert!(said.contains("next: measure the board's own lengths more finely"), "{said}");
    // Five pairs are too few poses, and that has a plain name.
    let said = check(&["--corners", "five.csv"]);
    assert!(said.contains("what lengths can be trusted to is not known until these checks are passed: "), "{said}");
    assert!(said.contains("number of different poses"), "{said}");
    // Corners that scatter by five px: what may be off by more than a tenth of itself is no length to trust.
    let mut state = 7u64;
    let mut scattered = |value: &str| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        format!("{}", value.parse::<f64>().unwrap() + 16.0 * ((state >> 40) as f64 / f64::from(1u32 << 24) - 0.5))
    };
    let text = std::fs::read_to_string(at.join("out/corners.csv")).unwrap();
    let mut noisy = format!("{}\n", text.lines().next().unwrap());
    for line in text.lines().skip(1) {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        (fields[4], fields[5]) = (scattered(&fields[4]), scattered(&fields[5]));
        (fields[6], fields[7], fields[8]) = ("21.3".to_owned(), "0".to_owned(), "21.3".to_owned());
        noisy += &format!("{}\n", fields.join(","));
    }
    std::fs::write(at.join("noisy.csv"), noisy).unwrap();
    let bad = check(&["--corners", "noisy.csv", "--force"]);
    assert!(bad.contains("no length can be trusted: of one of 70 mm an error of "), "{bad}");
    check(&["--corners", "five.csv"]);
    let evidence = json(&at.join("said/camera-check.json"))["evidence"].to_string();
    assert!(evidence.contains("pairs with poses of their own"), "the names in the file are the contract's");
}

/// Of pictures that the calibration was made of, under other names, a check says nothing: they are left out where the
/// others are enough.
#[test]
fn pairs_that_the_calibration_was_made_of_are_no_test_of_it() {
    let folder = calibrated();
    let at = folder.path();
    let copied = |to: &str, pairs: &[(usize, &str)]| {
        for side in ["left", "right"] {
            let mut pictures: Vec<_> =
                std::fs::read_dir(at.join("check").join(side)).unwrap().map(|entry| entry.unwrap().path()).collect();
            pictures.sort();
            std::fs::create_dir_all(at.join(to).join(side)).unwrap();
            for (pair, name) in pairs {
                let ending = pictures[*pair].extension().unwrap().to_str().unwrap();
                std::fs::copy(&pictures[*pair], at.join(to).join(side).join(format!("{name}.{ending}"))).unwrap();
            }
        }
    };
    copied("old", &[(3, "a"), (4, "b"), (5, "c"), (6, "d"), (7, "e")]);
    copied("mixed", &[(0, "1"), (1, "2"), (2, "3"), (5, "4"), (0, "5")]);
    copied("again", &[(3, "1"), (5, "2"), (0, "3")]);
    let calibrated = stereocal(at, &["camera-check", "old", "--out", "before"]);
    assert!(calibrated.status.code().unwrap() <= 1, "{}", stderr(&calibrated));
    let check = |pictures: &str| {
        let against = ["--against", "before/calibration.json", "--tolerance-mm", "1"];
        let output = stereocal(at, &[&["camera-check", pictures], &against[..]].concat());
        (output.status.code(), stdout(&output), stderr(&output))
    };
    let (status, said, messages) = check("mixed");
    assert_eq!(status, Some(0), "{said}{messages}");
    assert!(said.starts_with("STILL VALID") && said.contains("3 of 3 pairs compared"), "{said}");
    assert!(messages.contains("1 of 5 pairs is left out, of which this calibration was made: 4"), "{messages}");
    assert!(messages.contains("1 of 5 pairs is left out, the same pictures as another pair's: 5"), "{messages}");
    // A check of this calibration in its own folder goes with it; one of another does not.
    let report = || stereocal(at, &["report", "--out", "before"]);
    assert!(!stderr(&report()).contains("no longer holds"));
    let corners = std::fs::read_to_string(at.join("before/calibration.json")).unwrap();
    let focal = serde_json::from_str::<Value>(&corners).unwrap()["right"]["fx"].as_f64().unwrap();
    turned(at, "three.csv", "turned.csv", focal, 0.01);
    let against = ["--against", "before/calibration.json", "--out", "before", "--tolerance-mm", "1"];
    let changed = stereocal(at, &[&["camera-check", "--corners", "turned.csv"], &against[..]].concat());
    assert_eq!(changed.status.code(), Some(3), "{}", stderr(&changed));
    let said = report();
    assert_eq!(said.status.code(), Some(1));
    assert!(stderr(&said).contains("calibration.json no longer holds by before/recheck.json: "), "{}", stderr(&said));
    // Nor is it used or handed on without a word.
    std::fs::create_dir_all(at.join("alone")).unwrap();
    std::fs::copy(at.join("before/calibration.json"), at.join("alone/calibration.json")).unwrap();
    let export = ["export", "calibration", "--format", "opencv", "--out", "handed-on", "--force", "--calibration"];
    for (file, status) in [("before/calibration.json", 1), ("alone/calibration.json", 0)] {
        let handed = stereocal(at, &[&export[..], &[file]].concat());
        assert_eq!(handed.status.code(), Some(status), "{}", stderr(&handed));
        assert_eq!(stderr(&handed).contains("no longer holds by before/recheck.json: "), status == 1);
    }
    // Lenses that were told by these very pairs count twice, and a board that calibrated is no second one.
    let known =
        ["camera-check", "old", "--intrinsics", "before/calibration.json", "--out", "known", "--tolerance-mm", "1"];
    let twice = stereocal(at, &known);
    assert_eq!(twice.status.code(), Some(1), "{}", stderr(&twice));
    let file = json(&at.join("known/camera-check.json"));
    assert!(file["evidence"].to_string().contains("lenses known from other pairs"), "{file}");
    // One of the five among new ones is said, and changes little.
    let known =
        ["camera-check", "mixed", "--intrinsics", "before/calibration.json", "--out", "mostly", "--tolerance-mm", "1"];
    let mostly = stereocal(at, &known);
    assert!(
        stderr(&mostly).contains("calibrated from 1 of these pairs (of 5), which count twice: the uncertainty that is stated is a little too small"),
        "{}",
        stderr(&mostly)
    );
    let file = json(&at.join("mostly/camera-check.json"));
    assert!(!file["evidence"].to_string().contains("lenses known from other pairs"), "{file}");
    let second = stereocal(at, &["camera-check", "old", "--check-images", "mixed", "--out", "second"]);
    assert_eq!(second.status.code(), Some(2));
    assert!(stderr(&second).contains("2 of the 10 pictures in mixed are those"), "{}", stderr(&second));
    // One new pair alone does not judge.
    let (status, said, messages) = check("again");
    assert_eq!(status, Some(1), "{said}{messages}");
    assert!(
        said.starts_with("UNDECIDED, ITS OWN DATA") && messages.contains("only new pairs tell"),
        "{said}{messages}"
    );
}
