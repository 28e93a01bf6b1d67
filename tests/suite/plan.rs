//! `plan` as a command: its files, what it says, and what it refuses.

use std::path::Path;

use camino::Utf8Path;
use serde_json::Value;
use stereocal::formats::calibration::CalibrationFile;
use stereocal::measurements::{Role, read_poses};
use stereocal::robot::{catalogue, file};
use stereocal::simulate::rig::true_rig;

use crate::run::{stderr, stdout, stereocal, workplace};

/// Enough candidates for a test.
const QUICK: [&str; 4] = ["--pool", "600", "--noise-mm", "0.02"];

fn world(folder: &Path) {
    let rig = CalibrationFile::from(&true_rig(1280));
    std::fs::create_dir_all(folder.join("out")).unwrap();
    std::fs::write(folder.join("out/calibration.json"), serde_json::to_string(&rig).unwrap()).unwrap();
    let mut robot = catalogue::robot("paper").unwrap();
    robot.tool_mm = nalgebra::Vector3::new(12.0, -8.0, 25.0);
    std::fs::write(folder.join("robot.toml"), file::to_toml(&robot)).unwrap();
}

fn run(folder: &Path, arguments: &[&str], status: i32) -> String {
    let output = stereocal(folder, &[&["plan"], arguments].concat());
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {}{}", stdout(&output), stderr(&output));
    stdout(&output) + &stderr(&output)
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// A rig that failed its check plans poses, and the status says that it did not pass.
#[test]
fn a_rig_that_failed_is_planned_with_in_so_many_words() {
    let folder = workplace();
    let at = folder.path();
    world(at);
    let mut rig = json(&at.join("out/calibration.json"));
    for (verdict, status) in [("pass", 0), ("undecided", 0), ("fail", 1)] {
        rig["check"] =
            serde_json::json!({"verdict": verdict, "tolerance_mm": 0.05, "trusted_mm": 0.2, "length_mm": 70.0});
        std::fs::write(at.join("out/calibration.json"), rig.to_string()).unwrap();
        let said = run(at, &[&["--poses", "8", "--verify", "2", "--force"], &QUICK[..]].concat(), status);
        let doubt = "lengths of up to 70 mm can be trusted to 0.200 mm";
        assert_eq!(said.contains(doubt), verdict != "pass", "{verdict}: {said}");
    }
}

#[test]
fn the_files_are_those_of_the_contract() {
    let folder = workplace();
    let at = folder.path();
    world(at);
    let said = run(at, &[&["--poses", "24", "--verify", "6"], &QUICK[..]].concat(), 0);
    assert!(said.contains("34 poses in 4 groups") && said.contains("are not checked"), "{said}");
    let poses = read_poses(Utf8Path::from_path(&at.join("out/poses.csv")).unwrap()).unwrap();
    let count = |role| poses.iter().filter(|p| p.role == role).count();
    assert_eq!([Role::Center, Role::Sample, Role::Verify].map(count), [4, 24, 6]);
    let plan = json(&at.join("out/plan.json"));
    for key in [
        "/rank",
        "/condition",
        "/observability/O1",
        "/observability/O5",
        "/noise_mm",
        "/paper/rank",
        "/paper/expected/0/rms_mm",
    ] {
        assert!(plan.pointer(key).is_some_and(Value::is_number), "{key}: {plan}");
    }
    for key in ["/groups/0/cam_from_base/rotation/2/2", "/groups/3/cam_from_base/translation_mm/0"] {
        assert!(plan.pointer(key).is_some_and(Value::is_number), "{key}");
    }
    let counts: Vec<u64> = plan["expected"].as_array().unwrap().iter().map(|e| e["poses"].as_u64().unwrap()).collect();
    assert_eq!(counts, [10, 20, 24, 40, 80]);
    let page = std::fs::read_to_string(at.join("out/plan.html")).unwrap();
    // As many parameters are named as not determined as the rank lacks.
    let [parameters, rank, zero] =
        [plan["parameters"].as_u64(), plan["rank"].as_u64(), plan["zero"].as_array().map(|zero| zero.len() as u64)];
    let [parameters, rank, zero] = [parameters, rank, zero].map(Option::unwrap);
    let sums = format!("{} only in sums: d_2 + d_3 + d_4", parameters - rank - zero);
    assert!(said.contains(&format!("{rank} of {parameters} parameters determined")) && said.contains(&sums), "{said}");
    assert!(said.contains("as the table of plan.html says") && page.contains("left camera of each group"), "{said}");
    assert!(
        page.contains(&sums) && page.contains("What the cameras will see") && page.contains("as planned by Shi et al.")
    );
    // What the figure is of, and no rows of another plan's counts.
    assert!(page.contains("that the identified parameters will leave") && !page.contains("n/a"), "{page}");
    assert!(said.contains("through the parameters alone") && !said.contains("n/a"), "{said}");
    // Fanuc's and Yaskawa's controllers take names in capitals.
    for (stem, ending) in
        [("stereocal_plan", "csv"), ("stereocal_plan", "script"), ("stereocal_plan", "mod")].into_iter().chain([
            ("stereocal_plan", "src"),
            ("stereocal_plan", "dat"),
            ("STEREOCAL_PLAN", "ls"),
            ("STEREOCAL_PLAN", "jbi"),
        ])
    {
        let path = at.join(format!("out/programs/{stem}.{ending}"));
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        assert!(text.len() > 40, "{ending}");
    }
    // The program is one that compensate understands: approach and stop of every pose.
    let output = stereocal(
        at,
        &[
            "compensate",
            "out/programs/stereocal_plan.mod",
            "--robot",
            "robot.toml",
            "--identified",
            "robot.toml",
            "--out",
            "c",
        ],
    );
    assert!(stdout(&output).contains("of 68 targets compensated"), "{}{}", stdout(&output), stderr(&output));
    for threads in ["1", "2"] {
        let more = ["--out", threads, "--threads", threads, "--no-provenance", "--calibration", "out/calibration.json"];
        run(at, &[&more[..], &QUICK[..]].concat(), 0);
    }
    for name in ["poses.csv", "plan.json", "plan.html", "programs/STEREOCAL_PLAN.jbi"] {
        let read = |threads: &str| std::fs::read(at.join(threads).join(name)).unwrap();
        assert!(read("1") == read("2"), "{name}");
    }
}

#[test]
fn the_papers_plan_and_the_first_poses() {
    let folder = workplace();
    let at = folder.path();
    world(at);
    let said = run(
        at,
        &["--plan", "paper", "--noise-mm", "0.02", "--calibration", "out/calibration.json", "--out", "paper"],
        0,
    );
    assert!(said.contains("316 poses in 4 groups"), "{said}");
    let said = run(at, &["--first", "3", "--calibration", "out/calibration.json", "--out", "first"], 0);
    assert!(said.contains("16 poses in 4 groups") && said.contains("--after"), "{said}");
    std::fs::write(at.join("m.csv"), "pose,group,role,j1_deg,x_mm,y_mm,z_mm\na,1,sample,0,1,2,3\n").unwrap();
    let said = run(at, &["--after", "m.csv"], 2);
    assert!(said.contains("the robot has 6 joints, the measurements have 1") && said.contains("m.csv"), "{said}");
}

#[test]
fn plans_that_nobody_can_run_are_refused() {
    let folder = workplace();
    let at = folder.path();
    world(at);
    let said = run(at, &["--center", "1500,0,300"], 2);
    assert!(said.contains("does not reach (1500, 0, 300) mm") && said.contains("`--center "), "{said}");
    let said = run(at, &["--squares", "40x40"], 2);
    assert!(said.contains("never sees a target of 412 x 412 mm") && said.contains("smaller target"), "{said}");
    // A middle that is reached, a sphere that is not: fewer poses do not help.
    let sphere = ["--center", "200,0,665", "--radius-mm", "150", "--poses", "10", "--verify", "3"];
    let said = run(at, &[&sphere[..], &QUICK[..]].concat(), 3);
    assert!(said.contains("are in view and can be reached") && !said.contains("fewer poses"), "{said}");
    let here = ["--poses", "10", "--verify", "3", "--calibration", "out/calibration.json", "--out", "here"];
    let said = run(at, &[&here[..], &QUICK[..]].concat(), 0);
    // Either the paper's plan has its column, or it is said why not.
    let left_out = said.contains("the paper's plan is left out: this robot does not reach its poses");
    assert!(said.contains("the paper's, mm") != left_out, "{said}");
    assert!(said.contains("report: here/plan.html") && said.contains("programs: here/programs"), "{said}");
    let text = std::fs::read_to_string(at.join("robot.toml")).unwrap();
    let lines = text.lines().map(|l| if l.starts_with("limits_deg") { "limits_deg = [-1.0, 1.0]" } else { l });
    std::fs::write(at.join("stiff.toml"), lines.collect::<Vec<_>>().join("\n")).unwrap();
    let said = run(at, &["--robot", "stiff.toml"], 2);
    assert!(said.contains("does not reach") && said.contains("within its limits"), "{said}");
    for (flags, part) in [
        (&["--center", "1,2"][..], "three numbers X,Y,Z"),
        (&["--poses", "2"], "from 4 to 2000"),
        (&["--first", "3", "--after", "m.csv"], "cannot be used with"),
        (&["--calibration", "none.json"], "none.json"),
        (&["--pulses-per-deg", "1,2"], "--pulses-per-deg has 2 numbers; 6"),
    ] {
        let said = run(at, flags, 2);
        assert!(said.contains(part), "{flags:?}: {said}");
    }
}

#[test]
fn programs_of_seven_joints_need_their_order() {
    let folder = workplace();
    let at = folder.path();
    world(at);
    let mut robot = catalogue::robot("franka-panda").unwrap();
    robot.joints[6].limits_rad = None;
    std::fs::write(at.join("robot.toml"), file::to_toml(&robot)).unwrap();
    let few = ["--poses", "12", "--verify", "2", "--calibration", "out/calibration.json"];
    let said = run(at, &[&few[..], &["--out", "open"], &QUICK[..]].concat(), 0);
    assert!(said.contains("no programs for ABB RAPID") && said.contains("--joint-order"), "{said}");
    let open: Vec<bool> =
        ["mod", "src", "script", "csv"].map(|e| at.join(format!("open/programs/stereocal_plan.{e}")).exists()).into();
    assert_eq!(open, [false, false, true, true]);
    let said = run(at, &[&few[..], &["--out", "bad", "--joint-order", "1,2,3"], &QUICK[..]].concat(), 2);
    assert!(said.contains("each of the numbers 1 to 7 once"), "{said}");
    let ordered = ["--out", "ordered", "--joint-order", "1,2,4,5,6,7,3"];
    let said = run(at, &[&few[..], &ordered, &QUICK[..]].concat(), 0);
    assert!(!said.contains("no programs"), "{said}");
    // The seventh joint has no limits: half a turn either way, and said.
    assert!(said.contains("no limits of joint 7: -180 to 180 deg"), "{said}");
    let poses = read_poses(Utf8Path::from_path(&at.join("ordered/poses.csv")).unwrap()).unwrap();
    assert!(poses.iter().all(|pose| pose.joints_deg[6].abs() <= 180.0));
    // The first pose's third joint stands behind the six axes.
    let text = std::fs::read_to_string(at.join("ordered/programs/stereocal_plan.mod")).unwrap();
    let third = format!("{:.6},9E9", poses[0].joints_deg[2]);
    assert!(text.contains(&third), "{third}\n{}", &text[..2000]);
}
