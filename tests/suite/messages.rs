//! Bad usage and bad input: what is said, and the exit status it ends in.

use crate::run::{stderr, stdout, stereocal, workplace};

/// Runs the program, expects it to refuse with `status` and to say every one of `parts`, and to leave stdout empty.
fn refused(arguments: &[&str], files: &[(&str, &str)], status: i32, parts: &[&str]) {
    let folder = workplace();
    for (name, content) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
    }
    let output = stereocal(folder.path(), arguments);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(status), "{arguments:?} said: {said}");
    assert_eq!(stdout(&output), "", "{arguments:?}");
    for part in parts {
        assert!(said.contains(part), "{arguments:?} did not say `{part}` but: {said}");
    }
}

#[test]
fn no_command_is_bad_usage() {
    refused(&[], &[], 2, &["Usage"]);
    refused(&["camera-check"], &[], 2, &["required"]);
    refused(&["calibrate"], &[], 2, &["unrecognized subcommand", "hint: `camera-check` calibrates the cameras"]);
    refused(
        &["identify", "points.csv"],
        &[],
        2,
        &["unexpected argument", "hint: ", "here: `--measurements points.csv`"],
    );
    refused(&["camera-check", "x", "--square-size", "12.5"], &[], 2, &["hint: there is `--square-mm MM`"]);
    refused(&["verify", "--measurements", "x"], &[], 2, &["hint: or `--against IDENTIFIED` in its place"]);
}

/// Slips of a first hour, each answered with what would do.
#[test]
fn what_a_beginner_mistypes() {
    refused(&["camera-check", "x", "--square-mm", "0.75in"], &[], 2, &["hint: ", "`--square-mm 19.05`"]);
    refused(&["camera-check", "l/1.png", "l/2.png", "l/3.png"], &[], 2, &["hint: pictures are named by their folder"]);
    refused(&["export", "calibration"], &[], 2, &["hint: ", "opencv, ros, kalibr, mrcal"]);
    refused(&["simulate", "--squares", "9x6"], &[], 2, &["hint: there is `--board BOARD`"]);
    refused(&["guide", "bord"], &[], 2, &["no page `bord`", "hint: there are day, boards"]);
    refused(
        &["camera-check", "x", "--squares", "10x7"],
        &[("x/left.mp4", "")],
        2,
        &["left.mp4", "hint: `mkdir left; ffmpeg -i "],
    );
    refused(&["camera-check", "left.mp4"], &[("left.mp4", "")], 2, &["this is a file", "ffmpeg -i left.mp4 "]);
    let called = "hint: the robot's file in it is called robot.toml: `--out ur5e` writes ur5e/robot.toml";
    refused(&["robot", "new", "ur5e", "--out", "ur5e.toml"], &[], 2, &["the name of a file", called]);
    let two = [("a.csv", ""), ("b.csv", "")];
    let repeated = "hint: the flag takes one file, and is repeated: once for each of a.csv and b.csv";
    refused(&["identify", "--measurements", "a.csv,b.csv"], &two, 2, &["measurements file not found", repeated]);
    refused(&["identify", "--measurements", "a.csv,c.csv"], &two, 2, &["not found", "hint: `stereocal measure POSES`"]);
    refused(&["measure", "x"], &[("x/poses.csv", "")], 2, &["calibration file not found", "`--calibration FILE`"]);
    let robot = [("x/poses.csv", ""), ("robot.toml", "name = \"r\"")];
    refused(&["measure", "x", "--calibration", "robot.toml"], &robot, 2, &["this is no JSON", "camera-check IMAGES"]);
    refused(&["camera-check", "pose"], &[("poses/x", "")], 2, &["folder not found", "hint: there is poses: is it"]);
    refused(&["robot", "show", "robo.toml"], &robot, 2, &["robot file not found", "hint: there is robot.toml: is it"]);
    refused(&["identify", "--measurements", "pose/table.csv"], &[("poses/tables.csv", "")], 2, &["hint: `stereocal"]);
    let table = [("poses/table.csv", "")];
    let meant = "hint: there is poses/table.csv: is it meant? `stereocal measure POSES`";
    refused(&["identify", "--measurements", "pose/table.csv"], &table, 2, &["not found", meant]);
    another_file_of_the_program();
    refused(&["identify", "--robot", "a.json"], &[("a.json", "{}")], 2, &["this is JSON", "hint: ", "robot new"]);
    refused(&["board", "9x6"], &[], 2, &["`9x6` names no board", "it is `checker:9x6:25`"]);
    refused(&["camera-check", "x", "--square-mm", "12,5"], &[], 2, &["a number is needed", "`--square-mm 12.5`"]);
    refused(&["camera-check", "x", "--tolerance-mm", "0"], &[], 2, &["--tolerance-mm", "from 0.000001 to 10000"]);
    refused(&["camera-check", "x"], &[("x/y/none", "")], 2, &["no pictures here"]);
    refused(&["board", "checker:9x6:194.4"], &[], 2, &["the board is 1749.6 x 1166.4 mm", "hint: ", "66 %"]);
}

#[test]
fn a_board_that_is_none() {
    refused(&["camera-check", "x", "--squares", "20"], &[], 2, &["COLUMNSxROWS", "`20`"]);
    refused(
        &["camera-check", "x", "--square-mm", "-3"],
        &[("x/a.txt", "")],
        2,
        &["--square-mm", "from 0.001 to 100000"],
    );
}

#[test]
fn settings_that_are_none() {
    let toml = [("stereocal.toml", "tolerance_mm = 0.0\n[target_board]\nsquares = \"7x6\"\nsquare_mm = -1.0\n")];
    refused(&["identify"], &toml, 2, &["tolerance_mm is 0", "target_board.square_mm is -1"]);
    refused(&["identify", "--config", "none.toml"], &[], 2, &["not found", "none.toml"]);
    let unknown = [("stereocal.toml", "\ntolerance = 1.0\n")];
    refused(&["identify"], &unknown, 2, &["unknown key `tolerance`", "stereocal.toml:2"]);
}

/// Every number that can be set has a range, and the message says it.
#[test]
fn numbers_beyond_their_range() {
    for (key, value, range) in [
        ("tolerance_mm", "1e9", "from 0.000001 to 10000"),
        ("identify.folds", "9223372036854775807", "from 2 to 1000"),
        ("identify.folds", "18446744073709551615", "from 2 to 1000"),
        ("identify.swarm.particles", "1000000000", "from 2 to 100000"),
        ("identify.swarm.iterations", "0", "from 1 to 1000000"),
        ("identify.swarm.cpso_c", "2.0", "more than 2"),
        ("identify.swarm.apso_inertia", "[0.4, nan]", "from 0 to 1000"),
        ("identify.swarm.stapso.trust_region_steps", "1000000000", "from 0 to 100000"),
        ("identify.trust_region.iterations", "1000000000", "from 1 to 100000"),
        ("identify.trust_region.step", "inf", "from 0 to 1"),
        ("identify.bound_deg", "1e300", "from 0.000001 to 180"),
        ("identify.rank_tolerance", "nan", "to 0.1"),
        ("check_board", "{ squares = \"20x20\", square_mm = 1e300 }", "from 0.001 to 100000"),
        ("check_board", "{ squares = \"99999999999999999999x20\", square_mm = 10.0 }", "COLUMNSxROWS"),
    ] {
        let toml = format!("{key} = {value}\n");
        refused(&["identify"], &[("stereocal.toml", &toml)], 2, &[range]);
    }
    for (flags, range) in [
        (
            &["camera-check", "x", "--board-temperature-c", "1e9", "--expansion-ppm-per-k", "7"][..],
            "from -273.15 to 1000",
        ),
        (&["camera-check", "--corners", "x", "--picture-size", "0x7"], "from 1 to 100000"),
        (&["simulate", "--check-pairs", "99999999"], "from 0 to 10000"),
        (&["simulate", "--thermal-ppm", "nan"], "from -100000 to 100000"),
        (&["simulate", "--bits", "17"], "from 8 to 16"),
        (&["identify", "--threads", "0"], "from 1 to 1024"),
    ] {
        refused(flags, &[], 2, &[range]);
    }
}

#[test]
fn a_matrix_of_the_wrong_shape_is_named_by_its_key() {
    let camera = r#"{"width": 64, "height": 48, "fx": 50, "fy": 50, "cx": 31, "cy": 23, "model": "brown4", "distortion": [0, 0, 0, 0]}"#;
    let file = |rotation: &str, translation: &str, more: &str| {
        format!(
            r#"{{"version": 1, "left": {camera}, "right": {camera}, "right_from_left": {{"rotation": {rotation}, "translation_mm": {translation}}}{more}}}"#
        )
    };
    let whole = "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]";
    for (text, part) in [
        (file("[[1, 0, 0], [0, 1, 0]]", "[-80, 0, 0]", ""), "right_from_left.rotation has 2 rows"),
        (
            file("[[1, 0], [0, 1, 0], [0, 0, 1]]", "[-80, 0, 0]", ""),
            "right_from_left.rotation has 3 rows of 2, 3, 3 numbers",
        ),
        (file(whole, "[-80, 0]", ""), "right_from_left.translation_mm has 2 numbers"),
        (
            file(whole, "[-80, 0, 0]", r#", "covariance": {"order": ["left.fx"], "matrix": [[1, 0]]}"#),
            "covariance.matrix is not 1 by 1",
        ),
    ] {
        let files = [("c.json", text.as_str()), ("poses/poses.csv", "pose,group,role,j1_deg\np,g,sample,0\n")];
        refused(&["measure", "poses", "--calibration", "c.json"], &files, 2, &[part, "c.json"]);
    }
}

#[test]
fn global_options_stand_under_their_own_heading() {
    let folder = workplace();
    for command in ["camera-check", "identify", "compensate", "robot"] {
        let help = stdout(&stereocal(folder.path(), &[command, "--help"]));
        let (own, global) = help.split_once("Global options:").unwrap();
        assert!(
            ["--config", "--quiet", "--threads", "--no-provenance"]
                .iter()
                .all(|g| global.contains(g) && !own.contains(g)),
            "{help}"
        );
    }
}

#[test]
fn an_arm_is_found_by_what_people_call_it() {
    let folder = workplace();
    let output = stereocal(folder.path(), &["robot", "new", "IRB 120"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("`IRB 120` is abb-irb120"), "{}", stderr(&output));
    refused(&["robot", "new", "irb1200"], &[], 2, &["abb-irb1200-5-0.9, abb-irb1200-7-0.7", "hint: "]);
    refused(&["robot", "new", "irb9"], &[], 2, &["no arm `irb9`", "robot list"]);
}

/// A flag that was given a file of the program's that is for another one.
fn another_file_of_the_program() {
    let placement = [("x/poses.csv", ""), ("placement.json", r#"{"groups": [], "flange_from_target": null}"#)];
    let measure = ["measure", "x", "--calibration", "placement.json"];
    refused(&measure, &placement, 2, &["calibration file: this is a placement", "hint: "]);
    let table = [("m.csv", "pose,group,role,j1_deg\n1,a,sample,0\n")];
    refused(&["identify", "--robot", "m.csv"], &table, 2, &["this is a table, and TOML is needed", "robot new NAME"]);
    let robot = [(
        "robot.toml",
        "name = \"r\"\nconvention = \"mdh\"\n[[joint]]\nalpha_deg = 0.0\na_mm = 0.0\ntheta_deg = 0.0\nd_mm = 100.0\n",
    )];
    refused(
        &["measure", "x", "--calibration", "robot.toml"],
        &[placement[0], robot[0]],
        2,
        &["no JSON, but a robot file"],
    );
    refused(&["robot", "import", "robot.toml"], &robot, 2, &["this is a robot file already", "`--robot FILE`"]);
    let compensate = ["compensate", "robot.toml", "--robot", "robot.toml", "--identified", "robot.toml"];
    refused(&compensate, &robot, 2, &["this is a robot file, and a table is needed"]);
    let against = ["camera-check", "x", "--against", "robot.toml"];
    refused(&against, &[placement[0], robot[0]], 2, &["a robot file", "`stereocal verify --against"]);
}

#[test]
fn an_empty_folder_and_a_file_of_somebody_else() {
    let folder = workplace();
    std::fs::create_dir_all(folder.path().join("x")).unwrap();
    let output = stereocal(folder.path(), &["camera-check", "x"]);
    assert!(stderr(&output).contains("hint: is the path right?"), "{}", stderr(&output));
    std::fs::create_dir_all(folder.path().join("out")).unwrap();
    std::fs::write(folder.path().join("out/board.pdf"), "mine").unwrap();
    let output = stereocal(folder.path(), &["board", "--squares", "9x6", "--square-mm", "20"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("`--force` replaces the file"), "{}", stderr(&output));
}

/// Of a board that was written before, nothing is replaced or left beside the new one without a word.
#[test]
fn a_second_board_in_one_folder() {
    let folder = workplace();
    let board = |name: &str, more: &[&str]| {
        let output = stereocal(folder.path(), &[&["board", name], more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        stderr(&output)
    };
    assert_eq!(board("checker:9x6:20", &["--png", "--dpi", "50"]), "");
    assert!(board("checker:9x6:20", &[]).contains("board.png stays as an earlier run wrote it"));
    assert!(board("checker:7x6:20", &[]).contains("board.pdf of an earlier run is replaced"));
}

/// Markers say which board they are of: the flag that fits is the hint, and one finding is one line.
#[test]
fn another_board_with_markers_is_answered_with_its_name() {
    let folder = workplace();
    let made = stereocal(folder.path(), &["board", "charuco:5x7:30:22:DICT_4X4_50", "--png", "--dpi", "120"]);
    assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
    for side in ["left", "right"] {
        std::fs::create_dir_all(folder.path().join("x").join(side)).unwrap();
        for name in ["1.png", "2.png", "3.png"] {
            std::fs::copy(folder.path().join("out/board.png"), folder.path().join("x").join(side).join(name)).unwrap();
        }
    }
    for (said, fits) in [
        ("charuco:5x7:30:22:DICT_5X5_100", "hint: `--board charuco:5x7:30:22:DICT_4X4_"),
        ("charuco:7x5:30:22:DICT_4X4_50", "hint: `--board charuco:5x7:30:22:DICT_4X4_50`"),
    ] {
        let output = stereocal(folder.path(), &["camera-check", "x", "--board", said, "--out", "y"]);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains(fits), "{said}: {message}");
        assert_eq!(message.matches("both pictures: ").count(), 1, "{message}");
    }
    // Asked for a plain board, too.
    let message = stderr(&stereocal(folder.path(), &["camera-check", "x", "--squares", "5x7", "--out", "y"]));
    assert!(message.contains("`--board charuco:COLUMNSxROWS:SQUARE:MARKER:DICT_4X4_"), "{message}");
}

#[test]
fn settings_as_init_writes_them_can_be_changed_line_by_line() {
    let folder = workplace();
    let output = stereocal(folder.path(), &["init"]);
    assert!(stdout(&output).contains("next: ") && stdout(&output).contains("robot.toml (it holds the paper's)"));
    let robot = std::fs::read_to_string(folder.path().join("robot.toml")).unwrap();
    assert!(robot.starts_with("# The nominal robot.") && robot.contains("degrees and mm"), "{robot}");
    let settings = std::fs::read_to_string(folder.path().join("stereocal.toml")).unwrap();
    let changed = settings.replace("# squares = \"20x20\"\n# square_mm = 10.0", "squares = \"9x7\"\nsquare_mm = 20.0");
    assert_ne!(settings, changed);
    let changed = changed.replace("# folds = 10", "folds = 8");
    std::fs::write(folder.path().join("stereocal.toml"), changed).unwrap();
    std::fs::create_dir_all(folder.path().join("x")).unwrap();
    // What is said of the settings comes before what is said of the pictures.
    let output = stereocal(folder.path(), &["camera-check", "x"]);
    assert!(stderr(&output).contains("no pictures here"), "{}", stderr(&output));
    // Settings that nobody named are said; `--quiet` and a file that is named need no word.
    let settings = "settings: stereocal.toml of this folder";
    assert!(stderr(&output).contains(settings), "{}", stderr(&output));
    for named in [&["--config", "stereocal.toml"][..], &["--quiet"]] {
        let output = stereocal(folder.path(), &[named, &["camera-check", "x"]].concat());
        assert!(!stderr(&output).contains(settings), "{}", stderr(&output));
    }
    refused(
        &["identify"],
        &[("stereocal.toml", "squares = \"9x7\"\n# [check_board]\n")],
        2,
        &["unknown key `squares`", "below `[check_board]`"],
    );
    let twice = "[check_board]\nsquares = \"9x7\"\nsquare_mm = 10.0\nsquare_mm = 20.0\n";
    refused(
        &["identify"],
        &[("stereocal.toml", twice)],
        2,
        &["duplicate key: `square_mm`, which stands in line 3 already", "stereocal.toml:4"],
    );
}

#[test]
fn an_arm_that_is_like_none_is_not_called_like_one() {
    let folder = workplace();
    let output = stereocal(folder.path(), &["robot", "new", "meca500"]);
    let said = stderr(&output);
    assert!(said.contains("robot import FILE") && !said.contains("most similar"), "{said}");
}
