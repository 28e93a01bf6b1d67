//! Files that name their rows: joined by these names, rows without a partner said, contradictions said, copies counted
//! once.

use super::*;

/// Joints and points of the rows, each with a name.
fn tables(
    folder: &Folder,
    rows: &Rows,
    joints: &[(usize, String)],
    points: &[(usize, String)],
    head: bool,
) -> [Utf8PathBuf; 2] {
    let line = |name: &str, numbers: &[f64]| {
        format!("{name},{}\n", numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(","))
    };
    let title = |text: &str| if head { text.to_owned() } else { String::new() };
    let q: String = joints.iter().map(|(i, name)| line(name, &rows[*i].0)).collect();
    let p: String = points.iter().map(|(i, name)| line(name, &rows[*i].1)).collect();
    [folder.file("q.csv", title("pose,j1,j2,j3,j4,j5,j6\n") + &q), folder.file("p.csv", title("pose,x,y,z\n") + &p)]
}

/// The rows in this order, each with its number from 1 behind these letters.
fn numbered(order: impl Iterator<Item = usize>, letters: &str) -> Vec<(usize, String)> {
    order.map(|i| (i, format!("{letters}{}", i + 1))).collect()
}

#[test]
fn rows_are_joined_by_their_names() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let mut as_text: Vec<usize> = (0..30).collect();
    as_text.sort_by_key(|i| (i + 1).to_string());
    let mut exchanged: Vec<usize> = (0..30).collect();
    [(3, 20), (8, 9)].iter().for_each(|(a, b)| exchanged.swap(*a, *b));
    for head in [true, false] {
        for order in [&as_text, &exchanged] {
            for (a, b) in [("", ""), ("Motion", ""), ("P", "M")] {
                let (joints, points) = (numbered(order.iter().copied(), a), numbered(0..30, b));
                let [q, p] = tables(&folder, &rows, &joints, &points, head);
                let (found, said) = source(&[&q, &p]).read(&robot).unwrap_or_else(|e| panic!("{}", report(&e)));
                let expected: Rows = order.iter().map(|i| rows[*i].clone()).collect();
                same(&found, &expected, "by name");
                assert!(said[1].contains("rows joined by") && !said[1].contains("left out"), "{said:?}");
            }
        }
        // Rows of which the other file has none.
        let lost = |skipped: &'static [usize]| (0..30).filter(|i| !skipped.contains(i));
        for (first, second, says) in [
            (&[][..], &[4, 17][..], ["left out of q.csv: `", "` 5, 18, which the other file does not have"]),
            (&[4], &[], ["left out of p.csv: `", "` 5, which the other file does not have"]),
        ] {
            let [q, p] = tables(&folder, &rows, &numbered(lost(first), ""), &numbered(lost(second), ""), head);
            let (found, said) = source(&[&q, &p]).read(&robot).unwrap_or_else(|e| panic!("{}", report(&e)));
            let both = lost(first).filter(|i| !second.contains(i));
            same(&found, &both.map(|i| rows[i].clone()).collect(), "lost");
            assert!(says.iter().all(|part| said[1].contains(part)), "{said:?}");
            assert!(found.iter().any(|row| row.at.pose == "30"), "{said:?}");
        }
    }
    // As many rows, each file without another one.
    let [q, p] = tables(&folder, &rows, &numbered(0..29, ""), &numbered(1..30, ""), true);
    let (found, said) = source(&[&q, &p]).read(&robot).expect("both");
    same(&found, &rows[1..29].to_vec(), "each lacks one");
    assert!(said[1].contains("left out of q.csv") && said[1].contains("left out of p.csv"), "{said:?}");
}

#[test]
fn rows_that_are_in_order_stay_and_names_that_contradict_are_said() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let from = |first: usize| (0..30).map(|i| (i, (first + i).to_string())).collect::<Vec<_>>();
    // Counts from 0 and from 1 are of the same rows.
    for head in [true, false] {
        for (a, b) in [(1, 1), (0, 1), (1, 0)] {
            let [q, p] = tables(&folder, &rows, &from(a), &from(b), head);
            let (found, said) = source(&[&q, &p]).read(&robot).unwrap_or_else(|e| panic!("{}", report(&e)));
            same(&found, &rows, "counted");
            assert_eq!(said.len(), 1, "{said:?}");
        }
    }
    let words = |stem: &str| (0..30).map(|i| (i, format!("{stem} {i} late"))).collect::<Vec<_>>();
    let [q, p] = tables(&folder, &rows, &words("day"), &words("night"), true);
    let (found, said) = source(&[&q, &p]).read(&robot).expect("by order");
    same(&found, &rows, "contradiction");
    assert!(
        said[1].contains("row 1 is `day 0 late` in `pose` of") && said[1].contains("paired in their order"),
        "{said:?}"
    );
    // Whether a count from 0 or one from 1 lacks a row, nobody can say.
    let [q, p] = tables(&folder, &rows, &from(0), &numbered(0..29, ""), true);
    refused(&source(&[&q, &p]), &robot, &["q.csv has 30 rows, p.csv has 29 rows"]);
}

#[test]
fn several_readings_a_pose_are_joined_by_its_name() {
    let folder = Folder(workplace());
    let (robot, rows) = world(24);
    let mut shuffled: Vec<usize> = (0..24).map(|i| i * 7 % 24).collect();
    let readings: Vec<(usize, String)> =
        shuffled.iter().flat_map(|i| [(*i, format!("{}", i + 1)), (*i, format!("{}", i + 1))]).collect();
    let [q, p] = tables(&folder, &rows, &numbered(0..24, ""), &readings, true);
    let (found, _) = source(&[&q, &p]).read(&robot).unwrap_or_else(|e| panic!("{}", report(&e)));
    same(&found, &rows, "twice, and copies");
    // Once more, to the last digit.
    shuffled.push(3);
    let uneven: Vec<(usize, String)> = numbered(shuffled.into_iter(), "");
    let [q, p] = tables(&folder, &rows, &numbered(0..24, ""), &uneven, true);
    let (found, said) = source(&[&q, &p]).read(&robot).unwrap_or_else(|e| panic!("{}", report(&e)));
    same(&found, &rows, "one copy");
    assert!(said.iter().any(|line| line.contains("1 of 25 rows are copies")), "{said:?}");
    // One row of points cannot be at two rows of joints.
    let [q, p] = tables(&folder, &rows, &uneven, &numbered(0..24, ""), true);
    refused(&source(&[&q, &p]), &robot, &["`4` has 2 rows, others have 1"]);
}

/// Each pose of these rows read so many times, some more often than others, a few micrometres apart; and the pose of
/// each.
fn repeated(rows: &Rows, times: fn(usize) -> usize) -> (Rows, Vec<(usize, String)>) {
    let poses: Vec<usize> = (0..rows.len()).flat_map(|pose| vec![pose; times(pose)]).collect();
    let read = |(k, &pose): (usize, &usize)| {
        let (joints, point) = &rows[pose];
        (joints.clone(), point.map(|v| v + 4e-3 * (v + 1.7 * k as f64).sin()))
    };
    let all = poses.iter().enumerate().map(read).collect();
    (all, poses.iter().enumerate().map(|(k, pose)| (k, (pose + 1).to_string())).collect())
}

#[test]
fn readings_repeated_under_the_name_of_a_pose_are_of_one_pose() {
    let folder = Folder(workplace());
    let (robot, rows) = world(24);
    let one_table = |rows: &Rows, names: &[(usize, String)]| {
        let line = |(k, name): &(usize, String)| {
            let cells: Vec<String> = joined(&rows[*k].0, &rows[*k].1).iter().map(f64::to_string).collect();
            format!("{name},{}\n", cells.join(","))
        };
        folder
            .file("one.csv", "pose,j1,j2,j3,j4,j5,j6,x,y,z\n".to_owned() + &names.iter().map(line).collect::<String>())
    };
    let often: [fn(usize) -> usize; 2] = [|_| 3, |pose| 1 + pose % 4];
    for times in often {
        let (readings, names) = repeated(&rows, times);
        let one = one_table(&readings, &names);
        let (found, _) = source(&[&one]).read(&robot).unwrap_or_else(|e| panic!("{}", report(&e)));
        same(&found, &readings, "one file");
        let of_last = (0..times(23)).map(|k| format!("24.{}", k + 1)).collect::<Vec<_>>();
        assert!(found.iter().rev().zip(of_last.iter().rev()).all(|(row, name)| row.at.pose == *name), "{of_last:?}");
        // The joints in a file of their own, in another order: one row of them a name.
        let q = &tables(&folder, &rows, &numbered((0..24).rev(), ""), &[], true)[0];
        let p = &folder.file("points.csv", {
            let point = |(k, name): &(usize, String)| {
                let [x, y, z] = readings[*k].1;
                format!("{name},{x},{y},{z}\n")
            };
            "pose,x,y,z\n".to_owned() + &names.iter().map(point).collect::<String>()
        });
        let (mut found, _) = source(&[q, p]).read(&robot).unwrap_or_else(|e| panic!("{}", report(&e)));
        let number = |row: &Measurement| row.at.pose.split('.').next().and_then(|n| n.parse::<usize>().ok());
        found.sort_by_key(number);
        same(&found, &readings, "two files");
    }
    // Other joints under one name, a point that is another one, and one of two readings that is far off: none is a
    // reading of one point.
    let (readings, names) = repeated(&rows, |_| 2);
    let mut turned = readings.clone();
    turned[7].0[2] += 0.5;
    let other = readings.iter().enumerate().map(|(k, (q, p))| (q.clone(), p.map(|v| v + 5.0 * (k % 2) as f64)));
    let mut far = readings.clone();
    far[7].1[1] += 30.0;
    for (rows, pose) in [(turned, 4), (other.collect(), 1), (far, 4)] {
        let said = format!("pose `{pose}` stands in line {} already", 2 * pose);
        refused(&source(&[&one_table(&rows, &names)]), &robot, &[&said, "a name of its own"]);
    }
}

#[test]
fn copies_are_counted_once() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let twice = [rows.clone(), rows.clone()].concat();
    let names = "J1,J2,J3,J4,J5,J6,X,Y,Z";
    let (found, said) =
        source(&[&folder.file("twice.csv", text(names, &twice, ",", joined))]).read(&robot).expect("twice");
    same(&found, &rows, "copies");
    assert!(
        said[1].contains("30 of 60 rows are copies of others to the last digit, the first `31` of `1`"),
        "{said:?}"
    );
    // Readings that differ are none, nor are those of an instrument that shows hundredths.
    let again = |(q, p): &(Vec<f64>, [f64; 3])| (q.clone(), p.map(|v| v + 1e-3 * v.sin()));
    let revisited: Rows = [rows.clone(), rows.iter().map(again).collect()].concat();
    let coarse: Rows = twice.iter().map(|(q, p)| (q.clone(), p.map(|v| (v * 100.0).round() / 100.0))).collect();
    for (name, rows) in [("again.csv", revisited), ("coarse.csv", coarse)] {
        let file = folder.file(name, text(names, &rows, ",", joined));
        let (found, said) = source(&[&file]).read(&robot).expect(name);
        assert!(found.len() == 60 && said.len() == 1, "{name}: {said:?}");
    }
}

#[test]
fn new_rows_of_one_target_each_are_checked_by_where_the_robot_knows_them() {
    let folder = Folder(workplace());
    let at = folder.0.path();
    let (robot, rows) = world(69);
    let all = of_reflectors(&rows);
    let mut tables = [String::new(), String::new()];
    for (pose, ((q, _), p)) in rows.iter().zip(&all).enumerate() {
        let target = pose % 3;
        let noise = |axis: usize| 0.03 * (17.3 * pose as f64 + 5.1 * axis as f64).sin();
        let point = (0..3).map(|axis| p[3 * target + axis] + noise(axis));
        let cells: Vec<String> = q.iter().copied().chain(point).map(|v| v.to_string()).collect();
        let _ = writeln!(tables[usize::from(pose >= 60)], "p{pose},{},{}", ["a", "b", "c"][target], cells.join(","));
    }
    let header = "pose,target,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm\n";
    folder.file("all.csv", format!("{header}{}", tables[0]));
    folder.file("new.csv", format!("{header}{}", tables[1]));
    folder.file("robot.toml", stereocal::robot::file::to_toml(&robot));
    let identify = ["identify", "--robot", "robot.toml", "--method", "trust-region", "--measurements", "all.csv"];
    let found = stereocal(at, &identify);
    assert_eq!(found.status.code(), Some(0), "{}", stderr(&found));
    let check = ["verify", "--against", "out/identified.toml", "--out", "checks", "--measurements", "new.csv"];
    let checked = stereocal(at, &check);
    let said = stdout(&checked) + &stderr(&checked);
    assert!(
        checked.status.code() != Some(2) && !said.contains("CHANGED") && said.contains("zero of joint 4"),
        "{said}"
    );
    let figures = stereocal(at, &["verify", "--robot", "out/identified.toml", "--measurements", "new.csv"]);
    assert_eq!(figures.status.code(), Some(0), "{}", stderr(&figures));
}

#[test]
fn what_measurements_leave_open_is_said_where_they_are_to_choose_a_way_to_read_a_table() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let both = |q: &[f64], p: &[f64; 3]| [q.to_vec(), p.map(|v| v + 0.2 * v.sin()).to_vec(), p.to_vec()].concat();
    folder.file("both.csv", text("", &rows, ",", both));
    let links: String = robot
        .joints
        .iter()
        .map(|j| format!("{},{},{},{}\n", j.alpha_rad.to_degrees(), j.a_mm, j.theta_rad.to_degrees(), j.d_mm))
        .collect();
    folder.file("dh.csv", format!("alpha_deg,a_mm,theta_deg,d_mm\n{links}"));
    let told = stereocal(folder.0.path(), &["robot", "import", "dh.csv", "--measurements", "both.csv", "--out", "arm"]);
    let said = stderr(&told);
    assert!(
        told.status.code() == Some(2) && said.contains("the measurements cannot be read yet: two points would do"),
        "{said}"
    );
    assert!(said.contains("in: both.csv"), "{said}");
}

/// A program's targets in their order, each with what `name` calls it.
fn program(rows: &Rows, name: impl Fn(usize) -> String) -> String {
    let target = |(i, (q, _)): (usize, &(Vec<f64>, [f64; 3]))| {
        let numbers: Vec<String> = q.iter().map(|v| format!("{v:.12}")).collect();
        let external = "[9E9,9E9,9E9,9E9,9E9,9E9]";
        format!("CONST jointtarget {}:=[[{}],{external}];\n", name(i), numbers.join(","))
    };
    format!("MODULE m\n{}ENDMODULE\n", rows.iter().enumerate().map(target).collect::<String>())
}

/// What a tracker's program exports: where a point belongs, its name, the point and when it was measured.
fn exported(rows: &Rows, order: impl Iterator<Item = usize>) -> String {
    let line = |i: usize| {
        let [x, y, z] = rows[i].1;
        format!("A,Main,p{},{x},{y},{z},2024-05-06 10:{i:02}:00\n", i + 1)
    };
    order.map(line).collect()
}

#[test]
fn points_of_an_export_are_joined_with_a_programs_targets_by_their_names() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let targets = folder.file("q.mod", program(&rows, |i| format!("p{}", i + 1)));
    let shuffled = || (0..30).map(|i| (7 * i + 3) % 30);
    let names = "Collection,Group,Target,X,Y,Z,Timestamp\n";
    let plain = exported(&rows, 0..30);
    for (name, text) in [
        ("bare.txt", plain.clone()),
        ("named.txt", format!("{names}{plain}")),
        ("noted.txt", format!("// of a tracker\n// {names}{plain}")),
        ("shuffled.txt", format!("{names}{}", exported(&rows, shuffled()))),
        ("shuffled-bare.txt", exported(&rows, shuffled())),
    ] {
        let points = folder.file(name, text);
        let (found, said) =
            source(&[&targets, &points]).read(&robot).unwrap_or_else(|e| panic!("{name}: {}", report(&e)));
        same(&found, &rows, name);
        let joined = said.iter().any(|said| said.contains("rows joined by `name`, not by their order"));
        assert_eq!(joined, name.starts_with("shuffled"), "{said:?}");
        assert_eq!(found[4].at.pose, "p5", "{name}");
    }
    // Names of other points join nothing.
    let others = folder.file("r.mod", program(&rows, |i| format!("a{}", 100 * (i + 1))));
    let points = folder.file("points.txt", format!("{names}{plain}"));
    let (found, said) = source(&[&others, &points]).read(&robot).expect("in their order");
    same(&found, &rows, "in their order");
    assert!(said.iter().any(|said| said.contains("the rows are paired in their order")), "{said:?}");
}

#[test]
fn columns_of_one_name_join_files_where_they_name_the_same_rows() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let shuffled: Vec<usize> = (0..30).map(|i| (7 * i + 3) % 30).collect();
    for (first, second, letters) in [("Spot", "spot", "S"), ("Spot", "Spot", ""), ("stamp", "stamp", "t")] {
        let is_of_rows = first != "stamp";
        let called = |i: usize| format!("{letters}{}", i + 1);
        // Times are other ones in both files.
        let later = |i: usize| if is_of_rows { called(i) } else { called(1000 + i) };
        let order: Vec<usize> = if is_of_rows { shuffled.clone() } else { (0..30).collect() };
        let named = |list: Vec<(usize, String)>| tables(&folder, &rows, &list, &list, true);
        let [q, _] = named((0..30).map(|i| (i, called(i))).collect());
        let joints = folder.file("a.csv", std::fs::read_to_string(&q).unwrap().replacen("pose", first, 1));
        let [_, p] = named(order.iter().map(|&i| (i, later(i))).collect());
        let points = folder.file("b.csv", std::fs::read_to_string(&p).unwrap().replacen("pose", second, 1));
        let (found, said) = source(&[&joints, &points]).read(&robot).unwrap_or_else(|e| panic!("{}", report(&e)));
        same(&found, &rows, first);
        assert_eq!(said.iter().any(|said| said.contains("rows joined by `Spot`")), is_of_rows, "{said:?}");
        assert!(!said.iter().any(|said| said.contains("in their order;")), "{said:?}");
    }
}
