//! OpenCV's grids of tags from picture to length: how far black has spread is found, whatever it is, and lengths allow
//! for it.

use crate::run::{stderr, stdout, stereocal, workplace};

#[test]
fn the_spread_of_black_is_found_and_moves_no_length() {
    let mut baselines = Vec::new();
    for ink_um in ["0", "50", "200"] {
        let folder = workplace();
        let settings = "[check_board]\nboard = \"apriltag:5x4:tag36h11:24:7.2:opencv\"\n";
        std::fs::write(folder.path().join("stereocal.toml"), settings).unwrap();
        let world = ["--check-pairs", "8", "--samples", "1", "--verify", "1", "--ink-um", ink_um, "--out", "world"];
        let simulate = [&["simulate", "--size", "900"], &world[..]].concat();
        assert_eq!(stereocal(folder.path(), &simulate).status.code(), Some(0));
        // Whose grid it is, nobody says.
        let check = ["camera-check", "world/check", "--board", "apriltag:5x4:tag36h11:24:7.2", "--lens", "brown4"];
        let output = stereocal(folder.path(), &check);
        let said = stderr(&output) + &stdout(&output);
        assert!(matches!(output.status.code(), Some(0 | 1)) && said.contains("OpenCV's layout"), "{said}");
        let read = |name: &str| -> serde_json::Value {
            serde_json::from_str(&std::fs::read_to_string(folder.path().join(name)).unwrap()).unwrap()
        };
        let (found, truth) = (read("out/calibration.json"), read("world/truth/calibration.json"));
        assert_eq!(found["board"], "apriltag:5x4:tag36h11:24:7.2:opencv");
        let [mm, uncertainty_mm] = ["mm", "uncertainty_mm"].map(|key| found["board_spread"][key].as_f64().unwrap());
        let true_mm = 1e-3 * ink_um.parse::<f64>().unwrap();
        assert!((mm - true_mm).abs() < 2.0 * uncertainty_mm + 2e-4 && uncertainty_mm < 1e-3, "{mm} {uncertainty_mm}");
        let chi2 = read("out/camera-check.json")["reduced_chi_square"].as_f64().unwrap();
        // Crossings of the made board are off by a micrometre, too.
        assert!((0.8..1.4).contains(&chi2), "{ink_um}: {chi2}");
        let baseline = |file: &serde_json::Value| -> f64 {
            let t = file["right_from_left"]["translation_mm"].as_array().unwrap();
            t.iter().map(|v| v.as_f64().unwrap().powi(2)).sum::<f64>().sqrt()
        };
        baselines.push(baseline(&found) / baseline(&truth) - 1.0);
        // The first corner is the upper left one of the tag that OpenCV calls 0: its fourth, counted from the lower
        // left.
        let corners = std::fs::read_to_string(folder.path().join("out/corners.csv")).unwrap();
        assert!(corners.lines().any(|line| line.contains(",0,0,") && line.ends_with(",3")), "{corners}");
    }
    // As scales of length, of which the ink would be a hundredth.
    assert!(baselines.iter().all(|off| off.abs() < 1e-4), "{baselines:?}");
}
