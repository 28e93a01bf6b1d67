//! Rows that failed, angles that look like a point, units that are not read: none of them decides what a table says.

use stereocal::robot::{catalogue, file};

use super::*;

/// Columns of joints and points without names.
fn bare(rows: &Rows) -> String {
    text("", rows, ",", joined)
}

#[test]
fn readings_that_failed_change_no_choice() {
    let folder = Folder(workplace());
    let (robot, rows) = world(40);
    let of = |bad: &[(usize, [f64; 3])]| {
        let mut rows = rows.clone();
        bad.iter().for_each(|(row, point)| rows[*row].1 = *point);
        rows
    };
    let mean = |k: usize| rows.iter().map(|(_, p)| p[k]).sum::<f64>() / rows.len() as f64;
    let kinds: [&[(usize, [f64; 3])]; 4] = [
        &[(7, [0.0; 3])],
        &[(7, [0.0; 3]), (20, [0.0; 3]), (21, [9e4, -9e4, 9e4])],
        &[(39, [mean(0), mean(1), mean(2)]), (38, [300.0, 280.0, 310.0])],
        &[(0, [1e6, 0.0, 0.0])],
    ];
    for bad in kinds {
        let rows = of(bad);
        // Several zeros are no readings; a single one is the fit's to find.
        let zeros = rows.iter().filter(|(_, point)| *point == [0.0; 3]).count();
        let read: Rows = rows.iter().filter(|(_, point)| zeros < 2 || *point != [0.0; 3]).cloned().collect();
        let with_reading = |found: Vec<Measurement>| -> Vec<Measurement> {
            found.into_iter().filter(|row| !matches!(row.observed, Observed::Missing { .. })).collect()
        };
        let file = folder.file("bare.csv", bare(&rows));
        let (found, said) = source(&[&file]).read(&robot).expect("it is read");
        assert_eq!(found.len(), rows.len());
        same(&with_reading(found), &read, &said[0]);
        assert!(said[0].contains("confirms"), "{said:?}");
        // Radians and metres, which no name says.
        let small = text("q1 q2 q3 q4 q5 q6 x y z", &rows, " ", |q, p| {
            q.iter().map(|v| v.to_radians()).chain(p.iter().map(|v| v / 1000.0)).collect()
        });
        let file = folder.file("small.txt", small);
        let (found, said) = source(&[&file]).read(&robot).expect("it is read");
        same(&with_reading(found), &read, &said[0]);
        assert!(said[0].contains("in radians") && said[0].contains("in m "), "{said:?}");
    }
}

/// A column of a few words may be the group that is meant; remarks are none.
#[test]
fn words_that_part_the_rows_are_listed_where_they_are_not_used() {
    let folder = Folder(workplace());
    let (robot, rows) = world(40);
    let numbers = text("", &rows, ",", joined);
    let labelled = |(k, line): (usize, &str)| format!("{},w{k}x,{line}\n", if k % 2 == 0 { "left" } else { "right" });
    let table: String = numbers.lines().enumerate().map(labelled).collect();
    let file = folder.file("parted.csv", format!("station,remark,J1,J2,J3,J4,J5,J6,X,Y,Z\n{table}"));
    let (found, said) = source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{}", report(&e)));
    assert_eq!(found.len(), rows.len());
    assert!(said[0].ends_with("; not used: station"), "{said:?}");
}

#[test]
fn three_angles_beside_a_point_are_no_second_target() {
    let folder = Folder(workplace());
    let (robot, rows) = world(40);
    let turn = transform(Vector3::new(0.4, 2.0, -0.7), Vector3::zeros());
    let angles = |q: &[f64]| -> [[f64; 3]; 2] {
        let radians: Vec<f64> = q.iter().map(|v| v.to_radians()).collect();
        let rotation = (turn * robot.base_from_flange(&radians)).rotation;
        let (a, b, c) = rotation.euler_angles();
        [[a, b, c].map(f64::to_degrees), rotation.scaled_axis().into()]
    };
    for kind in [0, 1] {
        let after = text("", &rows, ",", |q, p| [q, p, &angles(q)[kind]].concat());
        let before = text("", &rows, ",", |q, p| [&angles(q)[kind], p.as_slice(), q].concat());
        for (name, table) in [("after.csv", after), ("before.csv", before)] {
            let file = folder.file(name, table);
            let (found, said) =
                source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{name} {kind}: {}", report(&e)));
            same(&found, &rows, &said[0]);
            assert!(said[0].contains("not used"), "{said:?}");
        }
    }
    // A second target is one.
    let second = text("", &rows, ",", |q, p| {
        let radians: Vec<f64> = q.iter().map(|v| v.to_radians()).collect();
        let offset = turn * robot.base_from_flange(&radians) * Vector3::new(30.0, 40.0, 0.0);
        [q, p, &[p[0] + offset.x, p[1] + offset.y, p[2] + offset.z]].concat()
    });
    let file = folder.file("second.csv", second);
    let (found, _) = source(&[&file]).read(&robot).expect("it is read");
    assert_eq!(found.len(), 2 * rows.len());
}

#[test]
fn what_is_not_read_is_refused_and_a_joint_that_stands_still_is_a_joint() {
    let folder = Folder(workplace());
    let (robot, mut rows) = world(40);
    for (unit, per_deg) in [("gon", 1.0 / 0.9), ("mrad", 1000.0 / 57.295_779_513_082_32), ("arcmin", 60.0)] {
        let header = (1..=6).map(|j| format!("J{j}[{unit}]")).chain(["x", "y", "z"].map(str::to_owned));
        let header = header.collect::<Vec<_>>().join(",");
        let table = text(&header, &rows, ",", |q, p| q.iter().map(|v| v * per_deg).chain(*p).collect());
        refused(&source(&[&folder.file("unit.csv", table)]), &robot, &["J1[", unit, "no unit that is read"]);
    }
    let twice = folder.file("twice.csv", bare(&rows));
    refused(&source(&[&twice, &twice]), &robot, &["named twice"]);
    let sensor = transform(Vector3::new(0.4, 2.0, -0.7), Vector3::new(1900.0, -2000.0, 300.0));
    for (joints, point) in &mut rows {
        (joints[3], joints[5]) = (0.0, 0.0);
        let radians: Vec<f64> = joints.iter().map(|q| q.to_radians()).collect();
        *point = (sensor * robot.target_mm(&radians)).into();
    }
    let still = folder.file("still.csv", bare(&rows));
    let (found, said) = source(&[&still]).read(&robot).expect("it is read");
    same(&found, &rows, &said[0]);
}

#[test]
fn points_that_were_computed_are_said_to_be() {
    let folder = workplace();
    let (_, rows) = world(30);
    let stated = |digits: i32| -> String {
        let rounded = |v: f64| (v * 10f64.powi(digits)).round() / 10f64.powi(digits);
        let table =
            text("J1,J2,J3,J4,J5,J6,X,Y,Z", &rows, ",", |q, p| q.iter().copied().chain(p.map(rounded)).collect());
        std::fs::write(folder.path().join("table.csv"), table).expect("it is written");
        let arguments = ["identify", "--measurements", "table.csv", "--method", "trust-region", "--force"];
        let run = stereocal(folder.path(), &arguments);
        assert!(run.status.success(), "{}", stderr(&run));
        String::from_utf8_lossy(&run.stdout).lines().next().unwrap_or_default().to_owned()
    };
    for digits in [2, 3, 6, 12] {
        assert!(stated(digits).contains("these points were computed"), "{digits}: {}", stated(digits));
    }
    // To tenths of a mm an arm may be as good as the digits: then nothing shows that it was measured.
    let told = stated(1);
    assert!(told.starts_with("check before") && told.contains("were computed, or have too few digits"), "{told}");
}

/// Rows of an arm with a tool of its own, its links as in `built`; each coordinate scattered by about `noise_mm`,
/// lengths times `scale`.
fn of_arm(built: &Robot, poses: usize, noise_mm: f64, scale: f64) -> Rows {
    let sensor = transform(Vector3::new(0.4, 2.0, -0.7), Vector3::new(1900.0, -2000.0, 300.0));
    let row = |i: usize| {
        let joints: Vec<f64> = (0..built.joints.len()).map(|j| 70.0 * ((7 * i + 3 * j * j + 1) as f64).sin()).collect();
        let radians: Vec<f64> = joints.iter().map(|q| q.to_radians()).collect();
        let point = (sensor * built.target_mm(&radians)).coords * scale;
        let off = |k: usize| noise_mm * 1.4 * ((17 * i + 5 * k) as f64).sin();
        (joints, [0, 1, 2].map(|k| point[k] + off(k)))
    };
    (0..poses).map(row).collect()
}

/// The first line and the status of an identification with this arm's file.
fn verdict(arm: &str, rows: &Rows) -> (String, i32) {
    let folder = workplace();
    std::fs::write(folder.path().join("robot.toml"), file::to_toml(&catalogue::robot(arm).expect("it is known")))
        .expect("it is written");
    let table = text("J1,J2,J3,J4,J5,J6,X,Y,Z", rows, ",", joined);
    std::fs::write(folder.path().join("table.csv"), table).expect("it is written");
    let run = stereocal(folder.path(), &["identify", "--measurements", "table.csv", "--method", "trust-region"]);
    let first = String::from_utf8_lossy(&run.stdout).lines().next().unwrap_or_default().to_owned();
    (first, run.status.code().unwrap_or(-1))
}

/// A UR5e as one may be built, its tool and the file's links otherwise by `more`.
fn built(more: impl Fn(&mut Robot)) -> Robot {
    let mut robot = catalogue::robot("ur5e").expect("it is known");
    for (k, joint) in robot.joints.iter_mut().enumerate() {
        joint.theta_rad += 1e-3 * (k as f64 + 1.0).sin();
        joint.a_mm += 0.3 * (2.0 * k as f64).cos();
        joint.d_mm += 0.3 * (3.0 * k as f64).cos();
    }
    robot.tool_mm = Vector3::new(20.0, -35.0, 90.0);
    more(&mut robot);
    robot
}

#[test]
fn the_links_of_another_arm_are_none_of_this_one() {
    let (said, status) = verdict("ur5e", &of_arm(&built(|_| {}), 60, 0.03, 1.0));
    assert!(said.starts_with("use") && status == 0, "{said}");
    // Three parallel axes: their offsets are one sum, of which each has a third.
    let (said, status) = verdict("ur5e", &of_arm(&built(|robot| robot.joints[3].d_mm += 24.0), 60, 0.03, 1.0));
    assert!(said.contains("d_2 + d_3 + d_4 +2") && said.contains("another robot") && status == 1, "{said}");
}

#[test]
fn what_a_tool_alone_explains_was_computed() {
    let mut nominal = catalogue::robot("ur5e").expect("it is known");
    nominal.tool_mm = Vector3::new(20.0, -35.0, 90.0);
    let (said, _) = verdict("ur5e", &of_arm(&nominal, 40, 0.01, 1.0));
    assert!(said.contains("these points were computed"), "{said}");
    let (said, _) = verdict("ur5e", &of_arm(&nominal, 40, 0.1, 1.0));
    assert!(!said.contains("computed"), "{said}");
}

/// Sweeps of the last two joints, as a tool is measured.
fn of_wrist(robot: &Robot, noise_mm: f64) -> Rows {
    let sensor = transform(Vector3::new(0.4, 2.0, -0.7), Vector3::new(1900.0, -2000.0, 300.0));
    let row = |i: usize| {
        let (fifth, sixth) = if i < 25 { (5.0 * i as f64 - 60.0, 90.0) } else { (0.0, 5.0 * i as f64 - 200.0) };
        let joints = vec![20.0, -70.0, 60.0, 15.0, fifth, sixth];
        let radians: Vec<f64> = joints.iter().map(|q| q.to_radians()).collect();
        let point = sensor * robot.target_mm(&radians);
        (joints, [0, 1, 2].map(|k| point[k] + noise_mm * 1.4 * ((17 * i + 5 * k) as f64).sin()))
    };
    (0..60).map(row).collect()
}

/// The file's tool, which stands on the last axis, says nothing of the points' spread, and what is off in the rest of
/// the arm moves all points alike.
#[test]
fn a_table_of_the_wrist_alone_is_read_and_was_measured() {
    let folder = Folder(workplace());
    let robot = catalogue::robot("ur5e").expect("it is known");
    let rows = of_wrist(&Robot { tool_mm: Vector3::new(24.0, -10.0, 55.0), ..robot.clone() }, 0.01);
    let behind = |rows: &Rows| text("", rows, ",", |q, p| [q, p, &[0.0; 3]].concat());
    let (found, said) = source(&[&folder.file("wrist.csv", behind(&rows))]).read(&robot).expect("it is read");
    same(&found, &rows, "wrist");
    assert!(said[0].contains("points from columns 7 to 9 in mm (by their size"), "{said:?}");
    let (said, _) = verdict("ur5e", &rows);
    assert!(!said.contains("computed"), "{said}");
    // Points that do not follow the joints are refused as before.
    let mixed: Rows = rows.iter().enumerate().map(|(i, (q, _))| (q.clone(), rows[(7 * i + 11) % 60].1)).collect();
    refused(&source(&[&folder.file("mixed.csv", behind(&mixed))]), &robot, &["no choice of them comes near"]);
}

#[test]
fn a_scale_that_is_seen_is_a_doubt() {
    let (said, _) = verdict("ur5e", &of_arm(&built(|_| {}), 60, 0.03, 1.01));
    assert!(said.starts_with("check") && said.contains("longer than the nominal ones"), "{said}");
}

/// A unit that is forced against what the names say is the reason, not names that are missing.
#[test]
fn units_that_contradict_the_names_are_told_so() {
    let folder = Folder(workplace());
    let (robot, rows) = world(40);
    let names = "pose,group,role,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm";
    let mut table = format!("{names}\n");
    for (i, (joints, point)) in rows.iter().enumerate() {
        let cells: Vec<String> = joined(joints, point).iter().map(f64::to_string).collect();
        let _ = writeln!(table, "p{i},1,sample,{}", cells.join(","));
    }
    let file = folder.file("own.csv", table);
    let of = |units: &str| Source { units: Some(units.to_owned()), ..source(&[&file]) };
    assert!(of("deg").read(&robot).is_ok());
    refused(&of("rad"), &robot, &["`--units rad` contradicts the names j1_deg", "hint: leave `--units` out"]);
    refused(&of("deg,um"), &robot, &["`--units um` contradicts the names x_mm to z_mm, which say mm"]);
}

#[test]
fn rows_of_a_pose_of_which_one_is_missing_are_told_with_a_form_that_takes_them() {
    let folder = Folder(workplace());
    let (robot, rows) = world(24);
    let all = of_reflectors(&rows);
    let cells = |cells: &[f64]| cells.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    let joints = folder.file("joints.csv", text("", &rows, ",", |q, _| q.to_vec()));
    let point = |pose: usize, k: usize| cells(&all[pose][3 * k..3 * k + 3]);
    let (mut below, mut named) =
        (String::new(), "pose,target,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm\n".to_owned());
    for (pose, (q, _)) in rows.iter().enumerate() {
        for k in 0..3 {
            // One row is missing, and the last one is there twice.
            let times = usize::from((pose, k) != (4, 1)) + usize::from((pose, k) == (23, 2));
            below.push_str(&format!("{}\n", point(pose, k)).repeat(times));
            let _ = writeln!(named, "{pose},{},{},{}", ["a", "b", "c"][k], cells(q), point(pose, k));
        }
    }
    let below = folder.file("below.csv", below);
    for columns in [None, Some("j1,j2,j3,j4,j5,j6,x,y,z".to_owned())] {
        let told = Source { columns, ..source(&[&joints, &below]) };
        refused(
            &told,
            &robot,
            &["below.csv has 3 rows a pose", "neither targets in one order", "`pose,target,j1_deg,...,x_mm,y_mm,z_mm`"],
        );
    }
    let (found, _) = source(&[&folder.file("named.csv", named)]).read(&robot).expect("named");
    assert!(found.len() == 72 && found[0].target == "a" && found[10].target == "b", "{:?}", found[10]);
}

/// Points that vary along one axis alone leave both units open: each flag that is named settles both, and nothing is
/// asked again.
#[test]
fn units_that_are_open_are_asked_once() {
    let folder = Folder(workplace());
    let (robot, rows) = world(12);
    let small = |q: &[f64], p: &[f64; 3]| [q.iter().map(|v| v / 30.0).collect(), vec![1.0, 2.0, p[2].sin()]].concat();
    let file = folder.file("open.csv", text("J1,J2,J3,J4,J5,J6,X,Y,Z", &rows, ",", small));
    let flags = ["deg,mm", "deg,m", "rad,mm", "rad,m"];
    let named: Vec<String> = flags.iter().map(|flag| format!("`--units {flag}`")).collect();
    refused(&source(&[&file]), &robot, &named.iter().map(String::as_str).collect::<Vec<_>>());
    let with = |units: &str| Source { units: Some(units.to_owned()), ..source(&[&file]) };
    refused(&with("deg"), &robot, &["whether the points are mm or m,", "`--units deg,mm` or `--units deg,m` says it"]);
    refused(&with("mm"), &robot, &["joints are degrees or radians,", "`--units deg,mm` or `--units rad,mm` says it"]);
    for units in flags {
        assert_eq!(with(units).read(&robot).unwrap().0.len(), 12, "{units}");
    }
}

/// Where two files lack something, the columns of both are those that a flag names, and lists of a program that no
/// language says are no joints by that.
#[test]
fn what_is_lacking_is_said_of_all_files() {
    let folder = Folder(workplace());
    let (robot, rows) = world(12);
    let moves: String = rows.iter().map(|(q, _)| format!("MOVL({q:?})\n")).collect();
    let moves = folder.file("moves.txt", moves);
    refused(&source(&[&moves]), &robot, &["moves.txt has lists of 6 numbers in a program's lines"]);
    let part = |name: &str| folder.file(name, text("u,v", &rows, ",", |q, _| vec![q[0], q[1]]));
    let (a, b) = (part("a.csv"), part("b.csv"));
    refused(&source(&[&a, &b]), &robot, &["of all files side by side (2 of a.csv, 2 of b.csv)"]);
}

#[test]
fn flags_that_settle_which_joints_keep_all_targets() {
    let folder = Folder(workplace());
    let (robot, rows) = world(24);
    let all = of_reflectors(&rows);
    let beside = |again: fn(f64) -> f64| -> String {
        let line = |((q, _), p): (&(Vec<f64>, [f64; 3]), &Vec<f64>)| {
            let cells = [p.clone(), q.clone(), q.iter().copied().map(again).collect()].concat();
            cells.iter().map(f64::to_string).collect::<Vec<_>>().join(",") + "\n"
        };
        rows.iter().zip(&all).map(line).collect()
    };
    let points = "x1,y1,z1,x2,y2,z2,x3,y3,z3";
    let units = ["deg", "rad"].map(|unit| (1..7).map(|j| format!(",q{j} [{unit}]")).collect::<String>()).concat();
    let check = |joints: &str, again: fn(f64) -> f64| {
        let file = folder.file("two.csv", format!("{points}{joints}\n{}", beside(again)));
        let flags = ["", "-,-,-,-,-,-,"].map(|skipped| format!("{points},{skipped}j1,j2,j3,j4,j5,j6"));
        let [first, second] = flags.each_ref().map(|flag| format!("`--columns {flag}`"));
        refused(&source(&[&file]), &robot, &["two sets of joints would do", &first, &second]);
        for flag in flags {
            let told = Source { columns: Some(flag), ..source(&[&file]) };
            let (found, said) = told.read(&robot).unwrap_or_else(|e| panic!("{joints}: {}", report(&e)));
            assert!(found.len() == 72 && said[0].contains("3 targets a pose"), "{joints}: {said:?}");
        }
    };
    check(&units, f64::to_radians);
    // Names that are not known, and none.
    check(",torso,knee,hip,neck,waist,ankle,,,,,,", |q| q + 1e-3 * (9.0 * q).sin());
}

/// Where the robot was sent stands beside what a sensor saw that is parallel to the robot: a body's two points would
/// turn with the flange.
#[test]
fn a_point_that_is_another_one_shifted_is_asked_about() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    for (shift, noise) in [([0.0, 0.0, 15.0], 0.1), ([800.0, -300.0, 40.0], 0.0), ([800.0, -300.0, 40.0], 0.5)] {
        let other = |p: &[f64; 3]| (0..3).map(|i| p[i] + shift[i] + noise * (9.0 * p[i]).sin()).collect::<Vec<f64>>();
        let both = |q: &[f64], p: &[f64; 3]| [joined(q, p), other(p)].concat();
        for header in [
            "",
            "q1,q2,q3,q4,q5,q6,x1,y1,z1,x2,y2,z2",
            "j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x1_mm,y1_mm,z1_mm,x2_mm,y2_mm,z2_mm",
        ] {
            let file = folder.file("shifted.csv", text(header, &rows, ",", both));
            refused(
                &source(&[&file]),
                &robot,
                &["two points would do", "`--columns j1,j2,j3,j4,j5,j6,x,y,z` takes the first"],
            );
        }
    }
    // A body that does not turn carries two points that are one shifted, too.
    let turned = |q: &[f64]| robot.base_from_flange(&q.iter().map(|q| q.to_radians()).collect::<Vec<_>>()).rotation;
    let still: Rows = (0..30)
        .map(|i| {
            let [a, b] = [1.3, 2.9].map(|k| 35.0 * (k * f64::from(i)).sin());
            let joints = [20.0, a, b, -a - b, 35.0, 10.0];
            let radians: Vec<f64> = joints.iter().map(|q| q.to_radians()).collect();
            (joints.to_vec(), robot.target_mm(&radians).into())
        })
        .collect();
    assert!(still.iter().all(|(q, _)| turned(q).angle_to(&turned(&still[0].0)) < 1e-6));
    let file = folder.file(
        "still.csv",
        text("", &still, ",", |q, p| [joined(q, p), vec![p[0] + 800.0, p[1] - 300.0, p[2] + 40.0]].concat()),
    );
    let (_, said) = source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{}", report(&e)));
    assert!(said[0].contains("2 targets a pose"), "{said:?}");
}
