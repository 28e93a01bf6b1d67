//! Where the cameras stand: what `identify` and `locate` write of it, and what readers of other programs make of the
//! exports.

use std::process::Command;
use std::sync::LazyLock;

use serde_json::Value;

use crate::run::{Files, files_below, stderr, stdout, stereocal, with_files, workplace};

/// A robot with points of 30 poses in two groups, identified into `out`.
fn identified() -> tempfile::TempDir {
    static MADE: LazyLock<Files> = LazyLock::new(|| files_below(made().path()));
    with_files(&MADE)
}

fn made() -> tempfile::TempDir {
    let folder = workplace();
    let at = folder.path();
    let made = ["simulate", "--points-only", "--samples", "40", "--verify", "12", "--seed", "4", "--out", "."];
    let made = stereocal(at, &made);
    assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
    let found = stereocal(
        at,
        &["identify", "--measurements", "truth/measurements.csv", "--method", "trust-region", "--extensions", "none"],
    );
    assert_eq!(found.status.code(), Some(0), "{}", stderr(&found));
    folder
}

fn json(path: &std::path::Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(list) => list.iter().flat_map(numbers).collect(),
        value => value.as_f64().into_iter().collect(),
    }
}

/// Runs a line of Python; `None` where its modules are absent.
fn python(program: &str, file: &std::path::Path) -> Option<Value> {
    let output = Command::new("python3").arg("-c").arg(program).arg(file).output().ok()?;
    if !output.status.success() {
        eprintln!("skipped: {}", String::from_utf8_lossy(&output.stderr));
        return None;
    }
    serde_json::from_slice(&output.stdout).ok()
}

/// The matrix of a quaternion `x, y, z, w`, row by row.
fn matrix(q: &[f64]) -> [f64; 9] {
    let (x, y, z, w) = (q[0], q[1], q[2], q[3]);
    [
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - z * w),
        2.0 * (x * z + y * w),
        2.0 * (x * y + z * w),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - x * w),
        2.0 * (x * z - y * w),
        2.0 * (y * z + x * w),
        1.0 - 2.0 * (x * x + y * y),
    ]
}

fn near(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9 * b.abs().max(1.0))
}

#[test]
fn a_placement_and_its_exports_are_one() {
    let folder = identified();
    let at = folder.path();
    let placement = json(&at.join("out/placement.json"));
    let groups = placement["groups"].as_array().unwrap();
    assert!(groups.len() > 1 && groups.iter().all(|g| g["held_out"]["count"].as_u64().unwrap() > 0));
    let held: Vec<&str> = placement["held"]
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|held| held["parameters"].as_array().unwrap())
        .filter_map(Value::as_str)
        .collect();
    assert_eq!(held, ["alpha_0", "a_0", "theta_1", "d_1", "theta_6", "d_6"]);
    let name = groups[0]["group"].as_str().unwrap();
    for format in ["opencv", "ros-static-tf", "easy-handeye"] {
        let told = stereocal(
            at,
            &[
                "export",
                "placement",
                "--format",
                format,
                "--group",
                name,
                "--out",
                format,
                "--placement",
                "out/placement.json",
            ],
        );
        assert_eq!(told.status.code(), Some(0), "{}", stderr(&told));
    }
    let (rotation, shift) =
        (numbers(&groups[0]["base_from_rig"]["rotation"]), numbers(&groups[0]["base_from_rig"]["translation_mm"]));
    let file = |name: String| at.join(name);
    let read = "import cv2,sys,json; f=cv2.FileStorage(sys.argv[1],cv2.FILE_STORAGE_READ); \
        print(json.dumps([f.getNode(k).mat().ravel().tolist() for k in ('R_cam2base','t_cam2base')]))";
    if let Some(found) = python(read, &file(format!("opencv/placement_opencv_{name}.yml"))) {
        assert!(near(&numbers(&found[0]), &rotation) && near(&numbers(&found[1]), &shift), "{found}");
    }
    let metres: Vec<f64> = shift.iter().map(|mm| mm / 1000.0).collect();
    let read = "import yaml,sys,json; d=yaml.safe_load(open(sys.argv[1])); p=d['parameters']; t=d['transformation']; \
        assert p['eye_on_hand'] is False and sorted(p)==sorted(['eye_on_hand','move_group','move_group_namespace','namespace',\
        'robot_base_frame','robot_effector_frame','tracking_base_frame','tracking_marker_frame']); \
        print(json.dumps([t[k] for k in ('x','y','z','qx','qy','qz','qw')]))";
    if let Some(found) = python(read, &file(format!("easy-handeye/easy_handeye_{name}.yaml"))) {
        let found = numbers(&found);
        assert!(near(&found[..3], &metres) && near(&matrix(&found[3..]), &rotation), "{found:?}");
    }
    let read = "import yaml,sys,json,shlex; n=yaml.safe_load(open(sys.argv[1]))['launch'][0]['node']; a=shlex.split(n['args']); \
        o=dict(zip(a[::2],a[1::2])); assert (n['pkg'],n['exec'])==('tf2_ros','static_transform_publisher'); \
        assert o['--frame-id']=='base_link'; print(json.dumps([float(o['--'+k]) for k in ('x','y','z','qx','qy','qz','qw')]))";
    if let Some(found) = python(read, &file(format!("ros-static-tf/static_tf_{name}.launch.yaml"))) {
        let found = numbers(&found);
        assert!(near(&found[..3], &metres) && near(&matrix(&found[3..]), &rotation), "{found:?}");
    }
    let other = stereocal(at, &["export", "placement", "--format", "opencv", "--group", "nowhere"]);
    assert_eq!(other.status.code(), Some(2));
    assert!(stderr(&other).contains("--group nowhere: the placement has"), "{}", stderr(&other));
}

#[test]
fn locate_finds_what_identify_found_and_names_a_robot_that_is_wrong() {
    let folder = identified();
    let at = folder.path();
    let text = std::fs::read_to_string(at.join("truth/measurements.csv")).unwrap();
    let group = text.lines().nth(1).unwrap().split(',').nth(1).unwrap();
    let rows = |count: usize| -> String {
        let of_group = text.lines().skip(1).filter(|line| line.split(',').nth(1) == Some(group)).take(count);
        std::iter::once(text.lines().next().unwrap()).chain(of_group).map(|line| format!("{line}\n")).collect()
    };
    std::fs::write(at.join("three.csv"), rows(3)).unwrap();
    std::fs::write(at.join("two.csv"), rows(2)).unwrap();
    let located = stereocal(at, &["locate", "three.csv", "--robot", "out/identified.toml", "--out", "there"]);
    assert_eq!(located.status.code(), Some(0), "{}{}", stdout(&located), stderr(&located));
    // Without a covariance of the points nothing says that cameras measured.
    assert!(stdout(&located).starts_with("base from instrument"), "{}", stdout(&located));
    let shift = |file: &str| numbers(&json(&at.join(file))["groups"][0]["base_from_rig"]["translation_mm"]);
    for (a, b) in shift("out/placement.json").iter().zip(shift("there/placement.json")) {
        assert!((a - b).abs() < 1.0, "{a} {b}");
    }
    // A record of a version that did not tell the scatter from the rest promises no more.
    std::fs::write(at.join("six.csv"), rows(6)).unwrap();
    let variance = || {
        let six = ["locate", "six.csv", "--robot", "out/identified.toml", "--out", "there", "--force"];
        let six = stereocal(at, &six);
        assert_eq!(six.status.code(), Some(0), "{}{}", stdout(&six), stderr(&six));
        json(&at.join("there/placement.json"))["groups"][0]["base_from_rig"]["covariance"][3][3].as_f64().unwrap()
    };
    let now = variance();
    let mut record = json(&at.join("out/identification.json"));
    record["expected"].as_object_mut().unwrap().remove("scatter_mm").unwrap();
    std::fs::write(at.join("out/identification.json"), record.to_string()).unwrap();
    let earlier = variance();
    assert!(earlier >= now, "{earlier} {now}");
    let nominal = stereocal(at, &["locate", "truth/measurements.csv", "--robot", "robot.toml", "--out", "there"]);
    assert_eq!(nominal.status.code(), Some(1), "{}", stderr(&nominal));
    assert!(stdout(&nominal).contains("the points contradict this robot"), "{}", stdout(&nominal));
    let two = stereocal(at, &["locate", "two.csv", "--robot", "out/identified.toml", "--out", "there"]);
    assert_eq!(two.status.code(), Some(3));
    assert!(stderr(&two).contains("a placement takes 3"), "{}", stderr(&two));
}

#[test]
fn points_of_a_tracker_are_an_instruments() {
    let folder = identified();
    let at = folder.path();
    let identify = |table: &str, out: &str| {
        let found =
            ["identify", "--measurements", table, "--method", "trust-region", "--extensions", "none", "--out", out];
        let found = stereocal(at, &found);
        assert_eq!(found.status.code(), Some(0), "{}", stderr(&found));
        std::fs::read_to_string(at.join(out).join("identify.html")).unwrap()
    };
    // Cameras state how sure they are of a point, and its orientation.
    let mut reader = csv::Reader::from_path(at.join("truth/measurements.csv")).unwrap();
    let header = reader.headers().unwrap().clone();
    let variance = |name: &str| match name {
        "sxx_mm2" | "syy_mm2" | "szz_mm2" => Some("1e-4"),
        "sxy_mm2" | "sxz_mm2" | "syz_mm2" => Some("0"),
        _ => None,
    };
    let sure = |row: csv::StringRecord| {
        let cells = row.iter().zip(&header).map(|(cell, name)| variance(name).unwrap_or(cell).to_owned());
        cells.collect::<Vec<_>>().join(",")
    };
    let first = header.iter().collect::<Vec<_>>().join(",");
    let rows = reader.records().map(|row| sure(row.unwrap()));
    let table: String = std::iter::once(first).chain(rows).map(|line| line + "\n").collect();
    std::fs::write(at.join("cameras.csv"), table).unwrap();
    let page = identify("cameras.csv", "c");
    for part in ["Where the cameras stand", "the cameras or its centre moved", "Distance errors of the verify rows"] {
        assert!(page.contains(part), "{part}");
    }
    // Joints and points alone, as a tracker's table has them: no orientation, no covariance, no roles.
    let mut reader = csv::Reader::from_path(at.join("truth/measurements.csv")).unwrap();
    let header = reader.headers().unwrap().clone();
    let kept = ["group", "j1_deg", "j2_deg", "j3_deg", "j4_deg", "j5_deg", "j6_deg", "x_mm", "y_mm", "z_mm"];
    let columns = kept.map(|name| header.iter().position(|h| h == name).unwrap());
    let rows = reader.records().map(|row| columns.map(|k| row.as_ref().unwrap()[k].to_owned()).join(","));
    let table: String = std::iter::once(kept.join(",")).chain(rows).map(|line| line + "\n").collect();
    std::fs::write(at.join("tracker.csv"), table).unwrap();
    let page = identify("tracker.csv", "t");
    let (body, _) = page.split_once("<footer").unwrap();
    for part in ["Where the instrument stands", "Distance errors of rows held out of the fit", "nearest to the middle"]
    {
        assert!(body.contains(part), "{part}");
    }
    for part in ["camera", "verify row", "of the paper"] {
        assert!(!body.contains(part), "{part}");
    }
    let said = stereocal(
        at,
        &["verify", "--against", "t/identified.toml", "--measurements", "tracker.csv", "--out", "t", "--force"],
    );
    assert!(stdout(&said).contains("instrument of group"), "{}{}", stdout(&said), stderr(&said));
    let verified = stereocal(at, &["verify", "--measurements", "tracker.csv", "--robot", "t/identified.toml"]);
    assert!(stdout(&verified).starts_with("rows, mm"), "{}", stdout(&verified));
}

#[test]
fn ten_poses_say_whether_the_robot_is_still_the_same() {
    let folder = identified();
    let at = folder.path();
    let text = std::fs::read_to_string(at.join("truth/measurements.csv")).unwrap();
    let header = text.lines().next().unwrap();
    let lines: Vec<&str> = text.lines().skip(1).collect();
    // Ten poses of the first group, which `identify` is not given; the reading of the third joint is off by so much.
    let group = lines[0].split(',').nth(1).unwrap();
    let of_group: Vec<&str> = lines.iter().copied().filter(|line| line.split(',').nth(1) == Some(group)).collect();
    let new = &of_group[of_group.len() - 10..];
    let ten = |off_deg: f64| -> String {
        let third = header.split(',').position(|name| name == "j3_deg").unwrap();
        let turned = |line: &&str| {
            let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
            fields[third] = (fields[third].parse::<f64>().unwrap() - off_deg).to_string();
            fields.join(",")
        };
        std::iter::once(header.to_owned()).chain(new.iter().map(turned)).map(|line| format!("{line}\n")).collect()
    };
    let others: Vec<&str> = lines.iter().copied().filter(|line| !new.contains(line)).collect();
    let of_rows =
        |rows: &[String]| std::iter::once(header.to_owned()).chain(rows.iter().cloned()).collect::<Vec<_>>().join("\n");
    let old: Vec<String> = others.iter().map(|line| (*line).to_owned()).collect();
    std::fs::write(at.join("others.csv"), of_rows(&old)).unwrap();
    let anew =
        ["identify", "--measurements", "others.csv", "--method", "trust-region", "--extensions", "none", "--force"];
    assert_eq!(stereocal(at, &anew).status.code(), Some(0));
    std::fs::write(at.join("same.csv"), ten(0.0)).unwrap();
    std::fs::write(at.join("turned.csv"), ten(0.5)).unwrap();
    let check = |file: &str, tolerance: &str| {
        stereocal(
            at,
            &["verify", "--against", "out/identified.toml", "--measurements", file, "--tolerance-mm", tolerance],
        )
    };
    let same = check("same.csv", "5");
    assert_eq!(same.status.code(), Some(0), "{}{}", stdout(&same), stderr(&same));
    assert!(stdout(&same).starts_with("STILL VALID"), "{}", stdout(&same));
    let page = || std::fs::read_to_string(at.join("out/verify.html")).unwrap();
    assert!(page().contains("10 new poses against the identified robot"), "{}", page());
    let said = stdout(&same);
    let table: Vec<&str> = said.lines().skip_while(|line| !line.starts_with("cause")).take(12).collect();
    assert!(table.len() == 12 && table.iter().all(|line| line.chars().count() <= 80), "{said}");
    // Whatever the plan called the poses.
    std::fs::write(at.join("verify.csv"), ten(0.0).replace(",sample,", ",verify,").replace(",center,", ",verify,"))
        .unwrap();
    let verify = check("verify.csv", "5");
    assert_eq!(verify.status.code(), Some(0), "{}{}", stdout(&verify), stderr(&verify));
    // What the poses would not have shown is not taken for proof.
    assert_eq!(check("same.csv", "0.0001").status.code(), Some(1));
    let turned = check("turned.csv", "0.1");
    assert_eq!(turned.status.code(), Some(3), "{}{}", stdout(&turned), stderr(&turned));
    assert!(stdout(&turned).contains("the zero of joint 3"), "{}", stdout(&turned));
    let history = std::fs::read_to_string(at.join("out/verify.csv")).unwrap();
    assert!(history.starts_with("date,against,poses,standing,cause,"), "{history}");
    assert_eq!(history.lines().count(), 5, "{history}");
    assert!(history.lines().last().unwrap().contains("joint-3"), "{history}");
    // The poses that it was identified from prove nothing, and the page says so, too.
    let own = check("others.csv", "5");
    let all = format!("this robot was identified from {0} of these {0} rows", old.len());
    assert!(stderr(&own).contains(&all) && page().contains(&all), "{}", stderr(&own));
    assert!(!page().contains("new poses against"));
    // Rows that the robot was identified from, under other names: alone they say nothing, among new ones they are left
    // out.
    let renamed: Vec<String> = old
        .iter()
        .take(12)
        .enumerate()
        .map(|(k, line)| format!("again{k},{}", line.split_once(',').unwrap().1))
        .collect();
    std::fs::write(at.join("own.csv"), of_rows(&renamed)).unwrap();
    let own = check("own.csv", "5");
    assert!(own.status.code() == Some(1) && stdout(&own).starts_with("UNDECIDED, ITS OWN DATA"), "{}", stdout(&own));
    assert!(stderr(&own).contains("identified from 12 of these 12 rows: only new poses"), "{}", stderr(&own));
    let fresh: Vec<String> = new.iter().map(|line| (*line).to_owned()).collect();
    std::fs::write(at.join("mixed.csv"), of_rows(&[&renamed[..], &fresh[..]].concat())).unwrap();
    let mixed = check("mixed.csv", "5");
    assert!(mixed.status.code() == Some(0) && stdout(&mixed).contains("; these 10 poses"), "{}", stdout(&mixed));
    assert!(stderr(&mixed).contains("12 of these 22 rows, which are left out"), "{}", stderr(&mixed));
    // One misread coordinate is no change of the robot.
    let x = header.split(',').position(|name| name == "x_mm").unwrap();
    for off_mm in [1.0, 40.0] {
        let mut spoilt = fresh.clone();
        let mut fields: Vec<String> = spoilt[4].split(',').map(str::to_owned).collect();
        fields[x] = (fields[x].parse::<f64>().unwrap() + off_mm).to_string();
        spoilt[4] = fields.join(",");
        std::fs::write(at.join("spoilt.csv"), of_rows(&spoilt)).unwrap();
        let said = check("spoilt.csv", "5");
        let words =
            format!("UNDECIDED: row {} fits far worse than the rest: take it again; without: no change", fields[0]);
        assert!(said.status.code() == Some(1) && stdout(&said).starts_with(&words), "{off_mm}: {}", stdout(&said));
        assert_eq!(json(&at.join("out/verify.json"))["strays"], serde_json::json!([fields[0]]));
    }
    std::fs::remove_file(at.join("out/identification.json")).unwrap();
    let unknown = check("same.csv", "5");
    assert_eq!(unknown.status.code(), Some(2));
    assert!(stderr(&unknown).contains("says nothing of how well it is known"), "{}", stderr(&unknown));
}
