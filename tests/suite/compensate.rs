//! `compensate` as a command: the files it writes, what it refuses, and the round trip through the real robot.

use std::fmt::Write as _;
use std::path::Path;

use camino::Utf8Path;
use stereocal::files::provenance::Digested;
use stereocal::robot::corrections::{HarmonicTerm, Wave};
use stereocal::robot::{Advice, Check, Robot, catalogue, file, inverse};

use crate::run::{stderr, stdout, stereocal, workplace};

/// The contract's round trip.
const SAME_MM: f64 = 1e-3;
const SAME_RAD: f64 = 1e-6;

fn robots(folder: &Path) -> (Robot, Robot) {
    robots_of(folder, "ur5e")
}

fn robots_of(folder: &Path, arm: &str) -> (Robot, Robot) {
    let nominal = catalogue::robot(arm).unwrap();
    let mut real = nominal.clone();
    for (k, joint) in real.joints.iter_mut().enumerate() {
        joint.alpha_rad += 2e-3 * (k as f64).sin();
        joint.theta_rad += 3e-3 * (k as f64).cos();
        joint.a_mm += 0.5;
    }
    std::fs::write(folder.join("robot.toml"), file::to_toml(&nominal)).unwrap();
    std::fs::write(folder.join("identified.toml"), file::to_toml(&real)).unwrap();
    let read = |name: &str| file::read(Utf8Path::from_path(&folder.join(name)).unwrap()).unwrap();
    (read("robot.toml"), read("identified.toml"))
}

/// Readings of well-bent postures, deg.
fn postures(robot: &Robot, count: usize) -> Vec<Vec<f64>> {
    let all = (0..).map(|k| inverse::spread_start(robot, k));
    let bent = all.filter(|q| inverse::freedom_mm(robot, q) > 20.0).take(count);
    bent.map(|q| q.iter().map(|v| v.to_degrees()).collect()).collect()
}

fn csv(postures: &[Vec<f64>]) -> String {
    let mut text = String::from("name,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg\n");
    for (k, q) in postures.iter().enumerate() {
        let fields: Vec<String> = q.iter().map(f64::to_string).collect();
        let _ = writeln!(text, "p{k},{}", fields.join(","));
    }
    text
}

fn rows(path: &Path) -> Vec<(Vec<f64>, String)> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let row = |r: csv::StringRecord| ((1..7).filter_map(|c| r[c].parse().ok()).collect(), r[7].to_owned());
    reader.records().map(|r| row(r.unwrap())).collect()
}

fn run(folder: &Path, arguments: &[&str], status: i32) -> String {
    let all = [&["compensate"], arguments, &["--robot", "robot.toml", "--identified", "identified.toml"]].concat();
    let output = stereocal(folder, &all);
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {}{}", stdout(&output), stderr(&output));
    stdout(&output) + &stderr(&output)
}

fn radians(q: &[f64]) -> Vec<f64> {
    q.iter().map(|v| v.to_radians()).collect()
}

#[test]
fn targets_come_back_where_they_were_meant() {
    let folder = workplace();
    let (nominal, real) = robots(folder.path());
    let postures = postures(&nominal, 300);
    std::fs::write(folder.path().join("targets.csv"), csv(&postures)).unwrap();
    let said = run(folder.path(), &["targets.csv"], 0);
    assert!(said.contains("300 of 300 targets compensated"), "{said}");
    // Why `identify` names another figure; the tools are the same.
    assert!(said.contains("at most (in the base frame; ") && !said.contains("the tools of the two files"), "{said}");
    let (mut tipped, mut drawn) = (real.clone(), nominal.clone());
    drawn.tool_mm = nalgebra::Vector3::new(0.0, 0.0, 90.0);
    tipped.tool_mm = nalgebra::Vector3::new(0.0, 3.0, 94.0);
    std::fs::write(folder.path().join("robot.toml"), file::to_toml(&drawn)).unwrap();
    std::fs::write(folder.path().join("identified.toml"), file::to_toml(&tipped)).unwrap();
    let apart = run(folder.path(), &["targets.csv", "--out", "tipped"], 0);
    assert!(apart.contains("the tools of the two files are 5.000 mm apart, and this is corrected too"), "{apart}");
    assert!(apart.contains("`--tool X,Y,Z` names the tool that works"), "{apart}");
    let named = run(folder.path(), &["targets.csv", "--out", "named", "--tool", "0,0,100"], 0);
    assert!(!named.contains("the tools of the two files"), "{named}");
    assert!(
        named.contains("the target was found at 0.000, 3.000, 94.000 mm, 5.0 mm from that of robot.toml,"),
        "{named}"
    );
    assert!(named.contains("(d_6, theta_6): that stays in this tool"), "{named}");
    let measured = run(folder.path(), &["targets.csv", "--out", "measured", "--tool", "0,3,94"], 0);
    assert!(!measured.contains("stays in this tool"), "{measured}");
    robots(folder.path());
    for (q, (found, status)) in postures.iter().zip(rows(&folder.path().join("out/compensated.csv"))) {
        assert_eq!(status, "ok");
        let (q, found) = (radians(q), radians(&found));
        let off = nominal.base_from_flange(&q).inverse() * real.base_from_flange(&found);
        assert!(off.translation.vector.norm() < SAME_MM && off.rotation.angle() < SAME_RAD, "{q:?}");
        // Without compensation it is far more: the test would see a command that copies.
        let before = nominal.base_from_flange(&q).inverse() * real.base_from_flange(&q);
        assert!(before.translation.vector.norm() > 100.0 * SAME_MM);
    }
    // As poses, the postures named beside them: the same readings.
    let mut poses =
        String::from("name,x_mm,y_mm,z_mm,rx_rad,ry_rad,rz_rad,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg\n");
    for (k, q) in postures.iter().enumerate() {
        let there = nominal.base_from_flange(&radians(q));
        let (t, r) = (there.translation.vector, there.rotation.scaled_axis());
        let near: Vec<String> = q.iter().map(f64::to_string).collect();
        let _ = writeln!(poses, "p{k},{},{},{},{},{},{},{}", t.x, t.y, t.z, r.x, r.y, r.z, near.join(","));
    }
    std::fs::write(folder.path().join("poses.csv"), poses).unwrap();
    run(folder.path(), &["poses.csv", "--out", "poses"], 0);
    let (a, b) = (rows(&folder.path().join("out/compensated.csv")), rows(&folder.path().join("poses/compensated.csv")));
    for ((a, _), (b, _)) in a.iter().zip(&b) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5), "{a:?} {b:?}");
    }
    for threads in ["1", "2"] {
        run(folder.path(), &["targets.csv", "--out", threads, "--threads", threads, "--no-provenance"], 0);
    }
    for file in ["compensated.csv", "compensate.json"] {
        let read = |threads: &str| std::fs::read(folder.path().join(threads).join(file)).unwrap();
        assert!(read("1") == read("2"), "{file}");
    }
}

#[test]
fn what_cannot_be_reached_is_named_and_left_alone() {
    let folder = workplace();
    let (nominal, _) = robots(folder.path());
    let mut list = postures(&nominal, 5);
    list[2] = vec![0.0, -90.0, 0.0, -90.0, 60.0, 0.0];
    list[3][0] = -360.0;
    std::fs::write(folder.path().join("targets.csv"), csv(&list)).unwrap();
    let said = run(folder.path(), &["targets.csv"], 1);
    assert!(said.contains("3 of 5 targets compensated") && said.contains("p2 (line 4): "), "{said}");
    assert!(said.contains("p3 (line 5): joint 1 would need -360.") && said.contains("range is -360"), "{said}");
    let rows = rows(&folder.path().join("out/compensated.csv"));
    assert_eq!((&rows[2].0, &rows[3].0), (&list[2], &list[3]));
    assert!(rows[0].1 == "ok" && rows[4].1 == "ok" && rows[2].1 != "ok");
    let far = "name,x_mm,y_mm,z_mm,rx_rad,ry_rad,rz_rad\na,9000,0,0,0,0,0\nb,300,200,400,0,3,0\n";
    std::fs::write(folder.path().join("far.csv"), far).unwrap();
    let said = run(folder.path(), &["far.csv", "--out", "far"], 1);
    assert!(said.contains("a (line 2): out of reach by"), "{said}");
    let text = std::fs::read_to_string(folder.path().join("far/compensated.csv")).unwrap();
    assert!(text.contains("a,,,,,,,out of reach"), "{text}");
}

#[test]
fn poses_in_metres_are_asked_whether_they_are() {
    let folder = workplace();
    robots_of(folder.path(), "abb-irb120");
    let said = |rows: &str, status: i32| {
        let text = format!("name,x_mm,y_mm,z_mm,rx_rad,ry_rad,rz_rad\n{rows}");
        std::fs::write(folder.path().join("poses.csv"), text).unwrap();
        run(folder.path(), &["poses.csv", "--force"], status)
    };
    let both = said("a,400,0,300,0,3.14159,0\nb,0.4,0,0.3,0,3.14159,0\n", 1);
    let asked = "1 of the targets (b) would be reached with lengths 1000 times as long: are they metres?";
    assert!(both.contains(asked) && both.contains("1 of 2 targets compensated"), "{both}");
    // Neither in mm nor in metres.
    let far = said("a,400,0,300,0,3.14159,0\nb,9000,0,300,0,3.14159,0\n", 1);
    assert!(!far.contains("are they metres"), "{far}");
}

#[test]
fn programs_keep_everything_but_their_joint_targets() {
    let folder = workplace();
    let (nominal, real) = robots(folder.path());
    let q = postures(&nominal, 2);
    let rad = |q: &[f64]| radians(q).iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
    let text = format!(
        "def main():\n  movej([{}], a=1.4, v=1.05) # there\n  movej([{}])\n  movel(p[0.1,0.2,0.3,0,0,0])\nend\n",
        rad(&q[0]),
        rad(&q[1])
    );
    std::fs::write(folder.path().join("main.script"), &text).unwrap();
    let said = run(folder.path(), &["main.script"], 2);
    assert!(
        said.contains("3 motions, 2 through joint targets; line 4: movel p[0.1,0.2,0.3,0,0,0] is Cartesian")
            && said.contains("--joint-targets-only")
            && !folder.path().join("out").exists(),
        "{said}"
    );
    let said = run(folder.path(), &["main.script", "--joint-targets-only"], 1);
    assert!(
        said.contains("2 of 2 targets compensated")
            && said.contains("2 of 3 motions move to them; 1 left as written")
            && said.contains("left: line 4: movel p[0.1,0.2,0.3,0,0,0] is Cartesian"),
        "{said}"
    );
    let changed = std::fs::read_to_string(folder.path().join("out/compensated/main.script")).unwrap();
    assert!(
        changed.contains("], a=1.4, v=1.05) # there\n") && changed.contains("  movel(p[0.1,0.2,0.3,0,0,0])\nend\n")
    );
    let list = changed.split_once("movej([").unwrap().1.split_once(']').unwrap().0;
    let found: Vec<f64> = list.split(',').map(|v| v.trim().parse().unwrap()).collect();
    let off = nominal.base_from_flange(&radians(&q[0])).inverse() * real.base_from_flange(&found);
    assert!(off.translation.vector.norm() < SAME_MM && off.rotation.angle() < SAME_RAD);
    let whole = text.replace("  movel(p[0.1,0.2,0.3,0,0,0])\n", "");
    std::fs::write(folder.path().join("whole.script"), &whole).unwrap();
    let said = run(folder.path(), &["whole.script", "--out", "whole"], 0);
    assert!(said.contains("all 2 motions move to them"), "{said}");
    std::fs::write(folder.path().join("none.script"), "movel(p[0.1,0.2,0.3,0,0,0])\n").unwrap();
    // What corrects nothing is not offered.
    let of_poses = "1 motion, 0 through joint targets; line 1: movel p[0.1,0.2,0.3,0,0,0] is Cartesian";
    let said = run(folder.path(), &["none.script", "--out", "x"], 2);
    assert!(said.contains(of_poses) && said.contains("CSV") && !said.contains("--joint-targets-only"), "{said}");
    let said = run(folder.path(), &["none.script", "--out", "x", "--joint-targets-only"], 2);
    let nothing = format!("nothing in this URScript program moves to a joint target of 6 numbers: {of_poses}");
    assert!(said.contains(&nothing) && said.contains("CSV"), "{said}");
    // A list of numbers by which nothing moves is nobody's target, whatever its name ends in.
    let list = rad(&q[0]);
    let pose = "p[0.1,0.2,0.3,0,0,0]";
    let text = format!(
        "Waypoint_1_p={pose}\nWaypoint_1_q=[{list}]\nmovej(get_inverse_kin(Waypoint_1_p, qnear=Waypoint_1_q))\nmovej([{list}])\n"
    );
    std::fs::write(folder.path().join("polyscope.script"), &text).unwrap();
    run(folder.path(), &["polyscope.script", "--out", "x"], 2);
    run(folder.path(), &["polyscope.script", "--out", "x", "--joint-targets-only"], 1);
    let changed = std::fs::read_to_string(folder.path().join("x/compensated/polyscope.script")).unwrap();
    assert!(changed.starts_with(text.rsplit_once("movej([").unwrap().0) && changed != text, "{changed}");
    let json = std::fs::read_to_string(folder.path().join("x/compensate.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let done: Vec<&str> = json["motions"].as_array().unwrap().iter().map(|m| m["done"].as_str().unwrap()).collect();
    assert_eq!(done, ["unchanged", "compensated"]);
    // A file of data alone: what moves to it stands elsewhere.
    let data = format!(
        "MODULE d\nCONST jointtarget j:=[[{}],[9E9,9E9,9E9,9E9,9E9,9E9]];\nENDMODULE\n",
        q[0].iter().map(f64::to_string).collect::<Vec<_>>().join(",")
    );
    std::fs::write(folder.path().join("data.mod"), data).unwrap();
    let said = run(folder.path(), &["data.mod", "--out", "data"], 2);
    assert!(said.contains("1 joint target, but no instruction that moves to it, in this file"), "{said}");
    run(folder.path(), &["data.mod", "--out", "data", "--joint-targets-only"], 1);
    std::fs::write(folder.path().join("job.jbi"), "///POSTYPE PULSE\n///PULSE\nC00000=1,2,3,4,5,6\n").unwrap();
    let said = run(folder.path(), &["job.jbi", "--out", "x"], 2);
    assert!(said.contains("pulses a degree") && said.contains("--pulses-per-deg"), "{said}");
}

/// A program in RAPID that moves to these readings, deg.
fn rapid(postures: &[Vec<f64>], comment: &str) -> String {
    let list = |q: &[f64]| q.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    let mut text = format!("MODULE m\n! {comment}\nPROC main()\n");
    for q in postures {
        let (robot, external) = q.split_at(6);
        let external: Vec<f64> = external.iter().copied().chain(std::iter::repeat(9e9)).take(6).collect();
        let _ = writeln!(text, "MoveAbsJ [[{}],[{}]],v100,fine,tool0;", list(robot), list(&external));
    }
    text + "ENDPROC\nENDMODULE\n"
}

#[test]
fn bytes_of_any_encoding_stay_as_they_are() {
    let folder = workplace();
    let (nominal, _) = robots(folder.path());
    let text = rapid(&postures(&nominal, 2), "COMMENT");
    let (before, after) = text.split_once("COMMENT").unwrap();
    let all: Vec<u8> = (0..=255).filter(|byte| *byte != b'\n').collect();
    std::fs::write(folder.path().join("bytes.mod"), [before.as_bytes(), &all, after.as_bytes()].concat()).unwrap();
    let said = run(folder.path(), &["bytes.mod"], 0);
    assert!(said.contains("all 2 motions move to them"), "{said}");
    let written = std::fs::read(folder.path().join("out/compensated/bytes.mod")).unwrap();
    std::fs::write(folder.path().join("plain.mod"), &text).unwrap();
    run(folder.path(), &["plain.mod"], 0);
    let plain = std::fs::read_to_string(folder.path().join("out/compensated/plain.mod")).unwrap();
    let (before, after) = plain.split_once("COMMENT").unwrap();
    assert!(plain != text && written == [before.as_bytes(), &all, after.as_bytes()].concat());
    let utf16: Vec<u8> = std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    std::fs::write(folder.path().join("wide.mod"), utf16).unwrap();
    let said = run(folder.path(), &["wide.mod"], 2);
    assert!(said.contains("UTF-16") && said.contains("save it as UTF-8"), "{said}");
}

#[test]
fn exchanged_robots_are_refused() {
    let folder = workplace();
    let (nominal, _) = robots_of(folder.path(), "abb-irb120");
    let at = |name: &str| folder.path().join(name);
    let found = std::fs::read_to_string(at("identified.toml")).unwrap();
    std::fs::write(at("identified.toml"), format!("# stereocal identify\n# Identified; expected\n{found}")).unwrap();
    std::fs::write(at("one.mod"), rapid(&postures(&nominal, 2), "")).unwrap();
    let said = run(folder.path(), &["one.mod"], 0);
    assert!(!said.contains("itself a robot"), "{said}");
    // Two that were found, and none of them from the other: the targets may be of neither.
    let nominal = std::fs::read_to_string(at("robot.toml")).unwrap();
    std::fs::write(at("robot.toml"), format!("# stereocal identify\n# Identified; expected\n{nominal}")).unwrap();
    let said = run(folder.path(), &["one.mod", "--force"], 0);
    assert!(said.contains("--robot robot.toml is itself a robot that `identify` found"), "{said}");
    let robot = Digested::read(Utf8Path::from_path(&at("robot.toml")).unwrap());
    let run_of = serde_json::json!({"program": "", "date": "", "command": "", "inputs": [robot], "outputs": []});
    let record = serde_json::json!({"provenance": run_of}).to_string();
    std::fs::write(at("identification.json"), record).unwrap();
    let said = run(folder.path(), &["one.mod", "--force"], 0);
    assert!(!said.contains("itself a robot"), "{said}");
    std::fs::remove_file(at("identification.json")).unwrap();
    std::fs::write(at("robot.toml"), nominal).unwrap();
    std::fs::rename(at("robot.toml"), at("aside.toml")).unwrap();
    std::fs::rename(at("identified.toml"), at("robot.toml")).unwrap();
    std::fs::rename(at("aside.toml"), at("identified.toml")).unwrap();
    let said = run(folder.path(), &["one.mod", "--force"], 2);
    assert!(said.contains("are they exchanged?") && said.contains("--robot identified.toml"), "{said}");
}

/// Writes both robots with these tools, and a target.
fn with_tools(folder: &Path, drawn: [f64; 3], found: [f64; 3]) -> (Robot, Robot) {
    let (mut nominal, mut real) = robots(folder);
    (nominal.tool_mm, real.tool_mm) = (drawn.into(), found.into());
    std::fs::write(folder.join("robot.toml"), file::to_toml(&nominal)).unwrap();
    std::fs::write(folder.join("identified.toml"), file::to_toml(&real)).unwrap();
    std::fs::write(folder.join("targets.csv"), csv(&postures(&nominal, 4))).unwrap();
    (nominal, real)
}

#[test]
fn a_tool_that_one_file_lacks_is_taken_for_both() {
    let folder = workplace();
    for (drawn, found) in [([0.0; 3], [1.4, -1.1, 237.6]), ([1.4, -1.1, 237.6], [0.0; 3])] {
        let (nominal, real) = with_tools(folder.path(), drawn, found);
        let said = run(folder.path(), &["targets.csv", "--force"], 0);
        let states = if drawn[2] == 0.0 {
            "robot.toml states no tool: that of identified.toml, 1.400, -1.100, 237.600 mm,"
        } else {
            "identified.toml states no tool: that of robot.toml,"
        };
        assert!(said.contains(states) && said.contains("is taken for both; `--tool X,Y,Z` names another"), "{said}");
        // The same as with that tool typed, and by the arm's errors alone: a few mm, not the tool's length.
        let typed = run(folder.path(), &["targets.csv", "--tool", "1.4,-1.1,237.6", "--out", "typed", "--force"], 0);
        let line = |said: &str| said.lines().find(|l| l.starts_with("without it")).map(str::to_owned).unwrap();
        assert_eq!(line(&said), line(&typed));
        let mean: f64 = line(&said).split(' ').find_map(|word| word.parse().ok()).unwrap();
        assert!(mean > 0.5 && mean < 30.0, "{said}");
        let tool = nalgebra::Translation3::new(1.4, -1.1, 237.6);
        for (q, (found, _)) in postures(&nominal, 4).iter().zip(rows(&folder.path().join("out/compensated.csv"))) {
            let off = (nominal.base_from_flange(&radians(q)) * tool).inverse()
                * (real.base_from_flange(&radians(&found)) * tool);
            assert!(off.translation.vector.norm() < SAME_MM && off.rotation.angle() < SAME_RAD);
        }
    }
}

#[test]
fn two_tools_that_are_far_apart_are_said() {
    let folder = workplace();
    for (apart, status) in [(0.5, 0), (9.9, 0), (10.1, 1), (235.0, 1)] {
        with_tools(folder.path(), [0.0, 0.0, 100.0], [0.0, 0.0, 100.0 + apart]);
        let said = run(folder.path(), &["targets.csv", "--force"], status);
        if status == 1 {
            let tools = format!(
                "{apart:.1} mm apart, 0.000, 0.000, 100.000 mm in robot.toml and 0.000, 0.000, {:.3} mm in identified.toml",
                100.0 + apart
            );
            assert!(said.contains(&tools) && said.contains("`--tool X,Y,Z` names the one that works"), "{said}");
            run(folder.path(), &["targets.csv", "--force", "--tool", "0,0,100"], 0);
        }
    }
}

#[test]
fn robots_that_are_not_one_arm_are_refused_and_one_robot_twice_is_said() {
    let folder = workplace();
    let (nominal, _) = with_tools(folder.path(), [0.0; 3], [0.0; 3]);
    let write = |name: &str, robot: &Robot| std::fs::write(folder.path().join(name), file::to_toml(robot)).unwrap();
    // Another arm of as many joints, links and twists beyond what robots are built to, a joint that is counted the
    // other way.
    let mut changed: Vec<(Robot, &str)> = vec![(catalogue::robot("abb-irb120").unwrap(), "d_1 ")];
    for (size, part) in [(15.0, "a_2 +15.0 mm"), (80.0, "a_2 +80.0 mm")] {
        let mut robot = nominal.clone();
        robot.joints[2].a_mm += size;
        changed.push((robot, part));
    }
    let mut robot = nominal.clone();
    robot.joints[1].theta_rad += 0.1;
    changed.push((robot, "theta_2 +5.7 deg"));
    let mut robot = nominal.clone();
    robot.joints[1].sign = -1.0;
    changed.push((robot, "joint 2 is counted the other way round"));
    for (robot, part) in changed {
        write("identified.toml", &robot);
        let said = run(folder.path(), &["targets.csv", "--force"], 2);
        assert!(said.contains("`identified.toml` is not the arm of `robot.toml`: ") && said.contains(part), "{said}");
    }
    // As far as robots are built off their drawing, and by a whole turn more.
    let mut robot = nominal.clone();
    robot.joints[2].a_mm += 8.0;
    robot.joints[1].theta_rad += 0.05 - std::f64::consts::TAU;
    write("identified.toml", &robot);
    let arguments =
        ["compensate", "targets.csv", "--force", "--robot", "robot.toml", "--identified", "identified.toml"];
    let output = stereocal(folder.path(), &arguments);
    assert!(output.status.code() != Some(2) && stdout(&output).contains("of 4 targets"), "{}", stderr(&output));
    write("identified.toml", &nominal);
    let said = run(folder.path(), &["targets.csv", "--force"], 1);
    assert!(said.starts_with("nothing to correct: robot.toml and identified.toml describe the same robot"), "{said}");
    assert!(!said.contains("without it the real tool"), "{said}");
}

#[test]
fn a_target_beyond_a_joints_range_is_named_so() {
    let folder = workplace();
    let (nominal, _) = robots_of(folder.path(), "abb-irb120");
    let mut list = postures(&nominal, 2);
    list[1][0] = 500.0;
    std::fs::write(folder.path().join("targets.csv"), csv(&list)).unwrap();
    let said = run(folder.path(), &["targets.csv"], 1);
    assert!(
        said.contains("p1 (line 3): joint 1 of the target is at 500.000; its range is -165.000 to 165.000"),
        "{said}"
    );
    // Of a program each reason is said once, by the motion.
    let motion = |q: &[f64]| {
        let q: Vec<String> = radians(q).iter().map(f64::to_string).collect();
        format!("movej([{}])\n", q.join(","))
    };
    for (motions, counts) in [
        (vec![&list[1]], "no motion is corrected: the program is left as written"),
        (vec![&list[0], &list[1]], "1 of 2 motions move to them; 1 left as written"),
    ] {
        let program: String = motions.iter().map(|q| motion(q)).collect();
        std::fs::write(folder.path().join("p.script"), program).unwrap();
        let said = run(folder.path(), &["p.script", "--out", "program", "--force"], 1);
        assert_eq!(said.matches("joint 1 of the target is at 500.000").count(), 1, "{said}");
        assert!(said.contains(counts) && !said.contains("not compensated"), "{said}");
        assert_eq!(said.contains("without it the real tool"), motions.len() == 2, "{said}");
    }
}

/// Only URScript has radians; system modules are RAPID; one motion is one.
#[test]
fn a_reading_beyond_a_range_is_asked_for_radians_where_there_are_any() {
    let folder = workplace();
    let (nominal, _) = robots_of(folder.path(), "abb-irb120");
    let mut list = postures(&nominal, 1);
    std::fs::write(folder.path().join("a.sys"), rapid(&list, "")).unwrap();
    let said = run(folder.path(), &["a.sys"], 0);
    assert!(said.contains("the program has one motion, and it is corrected"), "{said}");
    list[0][0] = 999.0;
    std::fs::write(folder.path().join("far.mod"), rapid(&list, "")).unwrap();
    let said = run(folder.path(), &["far.mod", "--out", "far"], 1);
    assert!(said.contains("joint 1 of the target is at 999.000") && !said.contains("radians"), "{said}");
    let q: Vec<String> = radians(&list[0]).iter().map(f64::to_string).collect();
    std::fs::write(folder.path().join("far.script"), format!("movej([{}])\n", q.join(","))).unwrap();
    let said = run(folder.path(), &["far.script", "--out", "script"], 1);
    assert!(said.contains("where radians are read?"), "{said}");
}

/// Beside a singular posture of the wrist.
#[test]
fn a_correction_that_turns_a_joint_far_is_said() {
    let folder = workplace();
    robots(folder.path());
    let told = |wrist_deg: f64| {
        let posture = vec![20.0, -70.0, 80.0, -50.0, wrist_deg, 10.0];
        std::fs::write(folder.path().join("t.csv"), csv(&[posture])).unwrap();
        run(folder.path(), &["t.csv", "--force"], 0)
    };
    assert!(!told(60.0).contains("turns joint"));
    let said = told(0.2);
    assert!(said.contains("the correction of p0 (line 2) turns joint 4 by 9."), "{said}");
}

/// What moves the arm and is not corrected, in the words of each maker; without it the program is corrected.
#[test]
fn programs_are_refused_for_what_leads_the_arm() {
    let folder = workplace();
    robots_of(folder.path(), "abb-irb120");
    let job = |line: &str| {
        format!(
            "/JOB\n//POS\n///NPOS 1,0,0,0,0,0\n///PULSE\nC00000=10000,20000,-15000,5000,40000,30000\n//INST\nNOP\n{line}MOVJ C00000 VJ=5.00\nEND\n"
        )
    };
    let module = |line: &str| {
        format!(
            "MODULE m\nCONST jointtarget j:=[[10,20,-15,5,40,30],[9E9,9E9,9E9,9E9,9E9,9E9]];\nPROC main()\nMoveAbsJ j,v100,fine,tool0;\n{line}ENDPROC\nENDMODULE\n"
        )
    };
    let pulses = ["--pulses-per-deg", "1000,1000,1000,1000,1000,1000"];
    for (name, clean, planted, said_of_it) in [
        ("a.jbi", job(""), job("FORMCUT FCF#(2)\n"), "line 8: FORMCUT FCF#(2) moves by values"),
        ("a.jbi", job(""), job("GLIDE C00000\n"), "line 8: GLIDE C00000 is an instruction that is not known here"),
        ("a.mod", module(""), module("BECheckTcp tGun;\n"), "line 5: BECheckTcp tGun moves by values"),
        (
            "a.mod",
            module(""),
            module("Park pSafe, j;\nMovePose pSafe;\n"),
            "line 6: MovePose pSafe is an instruction that is not known here",
        ),
    ] {
        std::fs::write(folder.path().join(name), clean).unwrap();
        let with =
            |more: &[&str], status: i32| run(folder.path(), &[&[name, "--force"], &pulses[..], more].concat(), status);
        with(&[], 0);
        std::fs::write(folder.path().join(name), planted).unwrap();
        let said = with(&[], 2);
        assert!(said.contains("2 motions, 1 through joint targets; ") && said.contains(said_of_it), "{said}");
        let said = with(&["--joint-targets-only"], 1);
        assert!(said.contains("1 of 2 motions move to them; 1 left as written") && said.contains(said_of_it), "{said}");
    }
}

#[test]
fn seven_joints_need_their_order() {
    let folder = workplace();
    let (nominal, real) = robots_of(folder.path(), "franka-panda");
    // The third joint is written behind the others.
    let order = [0, 1, 3, 4, 5, 6, 2];
    let meant = postures(&nominal, 3);
    let written: Vec<Vec<f64>> = meant.iter().map(|q| order.map(|joint| q[joint]).to_vec()).collect();
    std::fs::write(folder.path().join("seven.mod"), rapid(&written, "")).unwrap();
    let said = run(folder.path(), &["seven.mod"], 2);
    assert!(said.contains("7 joints; which of them `eax_a`") && said.contains("--joint-order"), "{said}");
    let said = run(folder.path(), &["seven.mod", "--joint-order", "1,2,4,5,6,7,7"], 2);
    assert!(said.contains("each of the numbers 1 to 7 once"), "{said}");
    run(folder.path(), &["seven.mod", "--joint-order", "1,2,4,5,6,7,3"], 0);
    let text = std::fs::read_to_string(folder.path().join("out/compensated/seven.mod")).unwrap();
    for (q, line) in meant.iter().zip(text.lines().filter(|line| line.starts_with("MoveAbsJ"))) {
        let numbers = line.split(['[', ']', ',']).filter_map(|v| v.parse().ok()).take(7).collect::<Vec<f64>>();
        let mut found = vec![0.0; 7];
        order.iter().zip(&numbers).for_each(|(&joint, value)| found[joint] = *value);
        let off = nominal.base_from_flange(&radians(q)).inverse() * real.base_from_flange(&radians(&found));
        assert!(off.translation.vector.norm() < SAME_MM && off.rotation.angle() < SAME_RAD, "{line}");
    }
}

#[test]
fn what_only_looks_like_joint_targets_is_refused() {
    let folder = workplace();
    robots(folder.path());
    let moves = "MoveJoints(0,10,20,30,40,50)\nMoveJoints(1,10,20,30,40,50)\nMoveJoints(2,10,20,30,40,50)\n";
    for (text, parts) in [
        (moves.to_owned(), ["`MoveJoints`", "in a language that is not known"]),
        (format!("{moves}MovePose(1,10,20,30,40,50)\n"), ["`MoveJoints`, `MovePose`", "not all of them can be joint"]),
        ("arm.set_angle(angle=[0,10,20,30,40,50], wait=True)\n".repeat(3), ["`set_angle`", "is not known"]),
    ] {
        std::fs::write(folder.path().join("moves.txt"), text).unwrap();
        let said = run(folder.path(), &["moves.txt"], 2);
        assert!(parts.iter().all(|part| said.contains(part)) && said.contains("hint:"), "{said}");
    }
    // Points of inline forms.
    std::fs::write(folder.path().join("inline.src"), "DEF a( )\nPTP XP1\nEND\n").unwrap();
    let said = run(folder.path(), &["inline.src"], 2);
    assert!(
        said.contains("PTP XP1 goes to a point that is declared in none of the files read")
            && said.contains(".dat file of this name")
            && said.contains("`XHOME` and what else all programs use in `$config.dat`")
            && !said.contains("--joint-targets-only"),
        "{said}"
    );
}

#[test]
fn bad_targets_are_refused() {
    let folder = workplace();
    robots(folder.path());
    for (text, part) in [
        ("name,x_mm,y_mm\na,1,2\n", "there is no z_mm, rx_rad"),
        ("name,j1_deg\na,1\n", "1 columns of readings, but the robot has 6 joints"),
        ("j1_deg\n1\n", "no column `name`"),
        ("name,j1_deg,j2_deg,j3_mm,j4_deg,j5_deg,j6_deg\na,1,2,3,4,5,6\n", "no column `j3_deg`"),
        ("name,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg\na,1,2,x,4,5,6\n", "`j3_deg` is not a number"),
    ] {
        std::fs::write(folder.path().join("t.csv"), text).unwrap();
        let said = run(folder.path(), &["t.csv"], 2);
        assert!(said.contains(part), "{said}");
    }
    let said = run(folder.path(), &["t.csv", "--tool", "1,2"], 2);
    assert!(said.contains("--tool has 2 numbers"), "{said}");
    std::fs::write(folder.path().join("identified.toml"), file::to_toml(&catalogue::robot("franka-panda").unwrap()))
        .unwrap();
    let said = run(folder.path(), &["t.csv"], 2);
    assert!(said.contains("the identified robot has 7 joints, the nominal one 6"), "{said}");
}

#[test]
fn what_compensate_wrote_is_not_corrected_again() {
    let folder = workplace();
    let (nominal, _) = robots(folder.path());
    std::fs::write(folder.path().join("targets.csv"), csv(&postures(&nominal, 3))).unwrap();
    run(folder.path(), &["targets.csv", "--out", "once"], 0);
    let said = run(folder.path(), &["once/compensated.csv", "--out", "twice"], 2);
    assert!(said.contains("is what `compensate` wrote"), "{said}");
    assert!(!folder.path().join("twice").exists(), "nothing is written");
    // A copy is known again, whatever it is called, by the folder of results near to it, to this one or named.
    std::fs::create_dir(folder.path().join("mine")).unwrap();
    let copy = folder.path().join("mine/targets.csv");
    std::fs::copy(folder.path().join("once/compensated.csv"), &copy).unwrap();
    for out in ["thrice", "once"] {
        let said = run(folder.path(), &["mine/targets.csv", "--out", out, "--force"], 2);
        assert!(said.contains("is what `compensate` wrote"), "{said}");
    }
    // Other numbers are anybody's, and so is what a run left as it was.
    let more = std::fs::read_to_string(&copy).unwrap() + "own,10,20,-15,5,40,30,ok\n";
    std::fs::write(&copy, more).unwrap();
    run(folder.path(), &["mine/targets.csv", "--out", "thrice"], 0);
    let program = "def go():\n  movej([0.1, -0.2, 0.3, 0.4, 0.5, 0.6])\nend\n";
    std::fs::write(folder.path().join("go.script"), program).unwrap();
    let same = ["compensate", "go.script", "--robot", "robot.toml", "--identified", "robot.toml"];
    for out in ["same", "again"] {
        let told = stereocal(folder.path(), &[&same[..], &["--out", out]].concat());
        assert_eq!(told.status.code(), Some(1), "{}{}", stdout(&told), stderr(&told));
    }
}

/// Points of inline forms stand in the data file of the program.
#[test]
fn a_program_is_corrected_with_the_points_of_its_data_file() {
    let folder = workplace();
    let at = folder.path();
    let (nominal, real) = robots(at);
    let program =
        |point: &str| format!("DEF a( )\nPTP {{A1 10,A2 20,A3 -15,A4 5,A5 40,A6 30}}\nPTP {point} C_PTP\nEND");
    let aggregate = "{A1 -20,A2 12.5,A3 -31,A4 15,A5 55,A6 -40,E1 0.0}";
    let data = format!(
        "DEFDAT a\nDECL E6AXIS XP4={aggregate}\nDECL E6AXIS XP5={aggregate}\nDECL E6POS XP6={{X 1,Y 2,Z 3,A 0,B 0,C 0}}\nENDDAT\n"
    );
    std::fs::write(at.join("a.src"), program("XP4")).unwrap();
    std::fs::write(at.join("a.dat"), &data).unwrap();
    let said = run(at, &["a.src", "--out", "o"], 0);
    assert!(said.contains("compensated/a.src, o/compensated/a.dat") && said.contains("all 2 motions"), "{said}");
    let [src, dat] =
        ["a.src", "a.dat"].map(|name| std::fs::read_to_string(at.join("o/compensated").join(name)).unwrap());
    assert!(src.starts_with("DEF a( )\nPTP {A1 ") && src.ends_with("\nPTP XP4 C_PTP\nEND"), "{src}");
    let lines: Vec<&str> = dat.lines().collect();
    let others: Vec<&str> = data.lines().collect();
    assert!(
        lines.len() == 5 && lines[0] == others[0] && lines[2..] == others[2..] && lines[1].ends_with(",E1 0.0}"),
        "{dat}"
    );
    let reading = |axis: usize| {
        let (_, behind) = lines[1].split_once(&format!("A{axis} ")).unwrap();
        behind.split(',').next().unwrap().parse::<f64>().unwrap()
    };
    let found: Vec<f64> = (1..=6).map(reading).collect();
    let meant = nominal.base_from_flange(&radians(&[-20.0, 12.5, -31.0, 15.0, 55.0, -40.0]));
    let off = meant.inverse() * real.base_from_flange(&radians(&found));
    assert!(off.translation.vector.norm() < SAME_MM && off.rotation.angle() < SAME_RAD, "{dat}");
    // A data file that is corrected already is not corrected again.
    std::fs::copy(at.join("o/compensated/a.dat"), at.join("a.dat")).unwrap();
    let said = run(at, &["a.src", "--out", "p"], 2);
    assert!(said.contains("a.dat is what `compensate` wrote"), "{said}");
    // A pose, and a point that is in neither.
    std::fs::write(at.join("a.dat"), &data).unwrap();
    for (point, why) in
        [("XP6", "PTP XP6 is Cartesian"), ("XP7", "PTP XP7 goes to a point that is declared in none of")]
    {
        std::fs::write(at.join("a.src"), program(point)).unwrap();
        let said = run(at, &["a.src", "--out", "q"], 2);
        assert!(said.contains(why), "{said}");
        let said = run(at, &["a.src", "--out", point, "--joint-targets-only"], 1);
        assert!(said.contains(why) && !at.join(point).join("compensated/a.dat").exists(), "{said}");
    }
}

#[test]
fn angles_in_another_unit_are_said() {
    let folder = workplace();
    let (nominal, _) = robots(folder.path());
    let degrees = postures(&nominal, 3);
    let with = |name: &str, q: &[Vec<f64>], status: i32| {
        std::fs::write(folder.path().join("targets.csv"), name.to_owned() + csv(q).split_once('\n').unwrap().1)
            .unwrap();
        run(folder.path(), &["targets.csv", "--force", "--out", "out"], status)
    };
    let [deg, rad] = ["deg", "rad"].map(|unit| {
        let names: Vec<String> = (1..7).map(|j| format!("j{j}_{unit}")).collect();
        format!("name,{}\n", names.join(","))
    });
    let in_radians: Vec<Vec<f64>> = degrees.iter().map(|q| radians(q)).collect();
    assert!(!with(&deg, &degrees, 0).contains("radians?"));
    assert!(!with(&rad, &in_radians, 0).contains("where radians are read?"));
    // So near to its zero the arm is stretched, and out of reach besides.
    assert!(with(&deg, &in_radians, 1).contains("are they radians?"));
    assert!(with(&rad, &degrees, 1).contains("where radians are read?"));
    // What refuses a turn is the turn: whether the arm gets there is another question.
    let poses = "name,x_mm,y_mm,z_mm,rx_rad,ry_rad,rz_rad\na,300,200,300,0,";
    for (turn, is_degrees) in [("3.14159", false), ("6.2", false), ("7", true), ("180", true)] {
        std::fs::write(folder.path().join("targets.csv"), format!("{poses}{turn},0\n")).unwrap();
        let all = [
            "compensate",
            "targets.csv",
            "--robot",
            "robot.toml",
            "--identified",
            "identified.toml",
            "--force",
            "--out",
            "out",
        ];
        let output = stereocal(folder.path(), &all);
        assert_eq!(stderr(&output).contains("are these degrees?"), is_degrees, "{turn}: {}", stderr(&output));
        assert_eq!(output.status.code() == Some(2), is_degrees, "{turn}");
    }
}

#[test]
fn an_arm_of_four_joints_is_corrected_in_its_places() {
    let folder = workplace();
    let joint = |alpha: f64, a: f64, d: f64, slides: bool| {
        let kind = if slides { "type = \"prismatic\"\nlimits_mm = [0.0, 150.0]\n" } else { "" };
        format!("[[joint]]\n{kind}alpha_deg = {alpha:?}\na_mm = {a:?}\ntheta_deg = 0.0\nd_mm = {d:?}\n")
    };
    let arm = |off: f64| {
        let joints = [
            joint(0.0, 0.0, 387.0, false),
            joint(off, 225.0 + off, 0.0, false),
            joint(180.0 - off, 175.0, 0.0, true),
            joint(off, off, 60.0, false),
        ];
        format!(
            "name = \"scara\"\nconvention = \"mdh\"\n{}[tool]\nx_mm = 40.0\ny_mm = -25.0\nz_mm = 110.0\n",
            joints.concat()
        )
    };
    std::fs::write(folder.path().join("robot.toml"), arm(0.0)).unwrap();
    std::fs::write(folder.path().join("identified.toml"), arm(0.1)).unwrap();
    let targets = [[20.0, 60.0, 75.0, 30.0], [-70.0, -40.0, 20.0, 100.0], [5.0, 100.0, 140.0, -150.0]];
    let row = |(k, q): (usize, &[f64; 4])| format!("t{k},{},{},{},{}\n", q[0], q[1], q[2], q[3]);
    let table: String = targets.iter().enumerate().map(row).collect();
    std::fs::write(folder.path().join("t.csv"), format!("name,j1_deg,j2_deg,j3_mm,j4_deg\n{table}")).unwrap();
    let said = run(folder.path(), &["t.csv"], 0);
    assert!(said.contains("3 of 3 targets compensated"), "{said}");
    assert!(
        said.contains("an arm of 4 joints cannot turn its tool every way: its place is corrected, and up to 0."),
        "{said}"
    );
    let robot = |name: &str| file::read(Utf8Path::from_path(&folder.path().join(name)).unwrap()).unwrap();
    let (nominal, real) = (robot("robot.toml"), robot("identified.toml"));
    let in_robot = |q: &[f64]| vec![q[0].to_radians(), q[1].to_radians(), q[2], q[3].to_radians()];
    let mut reader = csv::Reader::from_path(folder.path().join("out/compensated.csv")).unwrap();
    for (row, q) in reader.records().map(Result::unwrap).zip(&targets) {
        let found: Vec<f64> = (1..5).map(|c| row[c].parse().unwrap()).collect();
        let off_mm = (nominal.target_mm(&in_robot(q)) - real.target_mm(&in_robot(&found))).norm();
        assert!(off_mm < SAME_MM, "{off_mm}");
    }
    // A pose that stands on its side is none of this arm.
    let lying =
        "name,x_mm,y_mm,z_mm,rx_rad,ry_rad,rz_rad,j1_deg,j2_deg,j3_mm,j4_deg\nlying,300,100,150,1.57,0,0,20,60,75,30\n";
    std::fs::write(folder.path().join("t.csv"), lying).unwrap();
    let said = run(folder.path(), &["t.csv", "--force"], 1);
    assert!(said.contains("an arm of 4 joints cannot turn its tool so there: "), "{said}");
}

#[test]
fn targets_of_a_robot_whose_joints_were_mended_are_refused() {
    let folder = workplace();
    let (nominal, real) = robots(folder.path());
    std::fs::write(folder.path().join("targets.csv"), csv(&postures(&nominal, 4))).unwrap();
    let with = |mended: &[&str]| {
        let mended = mended.iter().map(|said| (*said).to_owned()).collect();
        let check =
            Check { advice: Advice::Check, reason: "the floor shook".to_owned(), out_of_tolerance: false, mended };
        std::fs::write(folder.path().join("identified.toml"), file::to_toml_checked(&real, Some(&check))).unwrap();
    };
    with(&[]);
    run(folder.path(), &["targets.csv"], 0);
    with(&["joint 3 is counted together with joint 2; mend the table"]);
    let said = run(folder.path(), &["targets.csv", "--force"], 2);
    assert!(said.contains("counts its joints otherwise than `robot.toml`: joint 3 is counted together"), "{said}");
    assert!(said.contains("`stereocal identify` again with robot.toml"), "{said}");
}

#[test]
fn targets_far_outside_of_the_ranges_of_the_identification_are_said() {
    let folder = workplace();
    let (nominal, real) = robots(folder.path());
    let postures = postures(&nominal, 12);
    std::fs::write(folder.path().join("targets.csv"), csv(&postures)).unwrap();
    let known = |ranges: &[[f64; 2]]| {
        let expected = serde_json::json!({ "mean_mm": 0.05, "p95_mm": 0.1, "map": [], "joint_ranges": ranges });
        let record = serde_json::json!({ "expected": expected }).to_string();
        std::fs::write(folder.path().join("identification.json"), record).unwrap();
    };
    known(&[[-360.0, 360.0]; 6]);
    assert!(!run(folder.path(), &["targets.csv"], 0).contains("was not identified"));
    // A narrow range of the first joint alone, which turns the whole arm, is no reason to stop.
    let mut ranges = [[-360.0, 360.0]; 6];
    ranges[0] = [10.0, 12.0];
    known(&ranges);
    let said = run(folder.path(), &["targets.csv", "--force"], 0);
    assert!(
        said.contains("stand where the robot was not identified, and it may be farther off")
            && said.contains("joint 1 in "),
        "{said}"
    );
    // A term that goes by its angle is.
    let wave = HarmonicTerm { joint: 0, wave: Wave::Sin, amplitude_rad: 1e-4 };
    let mut wavy = real.clone();
    wavy.corrections.harmonics.push(wave);
    std::fs::write(folder.path().join("identified.toml"), file::to_toml(&wavy)).unwrap();
    let said = run(folder.path(), &["targets.csv", "--force"], 1);
    assert!(said.contains("nothing says how far off it is there") && said.contains("joint 1 in "), "{said}");
    std::fs::write(folder.path().join("identified.toml"), file::to_toml(&real)).unwrap();
    ranges[2] = [10.0, 12.0];
    known(&ranges);
    let said = run(folder.path(), &["targets.csv", "--force"], 1);
    assert!(said.contains("nothing says how far off it is there") && said.contains("joint 3 in "), "{said}");
}

#[test]
fn limits_of_either_file_count_and_where_neither_has_any_both_are_named() {
    let folder = workplace();
    let (nominal, real) = robots(folder.path());
    let write = |name: &str, robot: &Robot| std::fs::write(folder.path().join(name), file::to_toml(robot)).unwrap();
    let without = |robot: &Robot| {
        let mut robot = robot.clone();
        robot.joints.iter_mut().for_each(|joint| joint.limits_rad = None);
        robot
    };
    std::fs::write(folder.path().join("targets.csv"), csv(&postures(&nominal, 3))).unwrap();
    write("identified.toml", &without(&real));
    assert!(!run(folder.path(), &["targets.csv"], 0).contains("limits of joint"));
    // They are kept to.
    write("robot.toml", &nominal.within(&[(-0.01, 0.01); 6]));
    let said = run(folder.path(), &["targets.csv", "--force"], 1);
    assert!(said.contains("0 of 3 targets compensated") && !said.contains("limits of joint"), "{said}");
    write("robot.toml", &without(&nominal));
    let said = run(folder.path(), &["targets.csv", "--force"], 0);
    assert!(said.contains("neither robot.toml nor identified.toml has limits of joint 1, 2, 3, 4, 5, 6:"), "{said}");
    // One joint is open in one of them alone.
    let mut one = without(&real);
    one.joints[3].limits_rad = Some((-6.3, 6.3));
    write("identified.toml", &one);
    assert!(run(folder.path(), &["targets.csv", "--force"], 0).contains("has limits of joint 1, 2, 3, 5, 6:"));
}
