//! Forms in which tables are published: headings over names, lists in cells, names of other languages and of recorders,
//! matrices without names, and two points side by side that no number tells apart.

use super::*;

fn lines(rows: &Rows, line: impl Fn(&[f64], &[f64; 3]) -> String) -> String {
    rows.iter().map(|(q, p)| line(q, p) + "\n").collect()
}

fn list(numbers: &[f64], delimiter: &str) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(delimiter)
}

#[test]
fn tables_in_the_forms_that_programs_write() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let plain = text("", &rows, ",", joined);
    let names = "J1,J2,J3,J4,J5,J6,X,Y,Z";
    let both = |q: &[f64], p: &[f64; 3]| [q.to_vec(), p.map(|v| v + 0.2 * v.sin()).to_vec(), p.to_vec()].concat();
    let headings = "Joint angles (deg),,,,,,Nominal (mm),,,Measured (mm),,\nJ1,J2,J3,J4,J5,J6,X,Y,Z,X,Y,Z";
    let quoted = |q: &[f64], p: &[f64; 3]| format!("\"[{}]\",\"[{}]\"", list(q, ", "), list(p, ", "));
    let numbered: String = plain.lines().enumerate().map(|(i, line)| format!("{i},{line}\n")).collect();
    for (name, text) in [
        ("title.txt", format!("Units: mm\n{plain}")),
        ("blanks.txt", format!("# {}\n{plain}", names.replace(',', " "))),
        ("headings.csv", text(headings, &rows, ",", both)),
        ("counted.csv", format!(",0,1,2,3,4,5,6,7,8\n{numbered}")),
        ("yaml.yaml", lines(&rows, |q, p| format!("- [{}]", list(&joined(q, p), ", ")))),
        ("cells.csv", format!("joint_angles,position\n{}", lines(&rows, quoted))),
        ("lists.csv", lines(&rows, |q, p| format!("[{}];[{}]", list(q, ","), list(p, ",")))),
        (
            "chinese.csv",
            text("关节1,关节2,关节3,关节4,关节5,关节6,理论X,理论Y,理论Z,实测X,实测Y,实测Z", &rows, ",", both),
        ),
        (
            "german.csv",
            text(
                "Gelenk 1,Gelenk 2,Gelenk 3,Gelenk 4,Gelenk 5,Gelenk 6,X soll,Y soll,Z soll,X ist,Y ist,Z ist",
                &rows,
                ",",
                both,
            ),
        ),
    ] {
        let file = folder.file(name, text);
        let (found, _) = source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{name}: {}", report(&e)));
        same(&found, &rows, name);
    }
    let points = folder.file("points.csv", text("X,Y,Z", &rows, ",", |_, p| p.to_vec()));
    let moves = folder.file("moves.txt", lines(&rows, |q, _| format!("MoveJoints({})\nDelay(1)", list(q, ", "))));
    let (found, said) = source(&[&moves, &points]).read(&robot).expect("moves");
    same(&found, &rows, "moves");
    assert!(said[0].contains("30 lines hold no target"), "{said:?}");
}

#[test]
fn joints_in_the_order_of_the_alphabet() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let header = |what: &str| {
        ["elbow", "shoulder_lift", "shoulder_pan", "wrist_1", "wrist_2", "wrist_3"]
            .map(|j| format!("{j}_joint{what}"))
            .join(",")
    };
    let recorded = |q: &[f64], p: &[f64; 3]| {
        let order = [q[2], q[1], q[0], q[3], q[4], q[5]];
        [order.to_vec(), order.map(|v| 0.1 * v).to_vec(), p.to_vec()].concat()
    };
    for other in ["_velocity", "_effort"] {
        let file =
            folder.file("ur.csv", text(&format!("{},{},x,y,z", header(""), header(other)), &rows, ",", recorded));
        let (found, _) = source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{other}: {}", report(&e)));
        same(&found, &rows, other);
    }
}

#[test]
fn transforms_without_names_are_known_by_their_rotation() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let turn = |q: &[f64]| *nalgebra::Rotation3::new(Vector3::new(q[0], q[1], q[2]) / 50.0).matrix();
    let of_rows = |q: &[f64], p: &[f64; 3], last: &[f64]| {
        let turn = turn(q);
        let row = |i: usize| vec![turn[(i, 0)], turn[(i, 1)], turn[(i, 2)], p[i]];
        [q.to_vec(), row(0), row(1), row(2), last.to_vec()].concat()
    };
    for last in [&[][..], &[0.0, 0.0, 0.0, 1.0]] {
        let file = folder.file("matrix.csv", text("", &rows, ",", |q, p| of_rows(q, p, last)));
        let (found, said) = source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{last:?}: {}", report(&e)));
        same(&found, &rows, "matrix");
        assert!(said[0].contains("points from column 10, column 14, column 18"), "{said:?}");
    }
}

#[test]
fn poses_at_which_nothing_was_measured_and_other_lengths() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let header = "q1,q2,q3,q4,q5,q6,x,y,z";
    for nothing in ["--", "#N/A", "nan", ""] {
        let row = |(i, line): (usize, &str)| match i % 7 {
            3 => format!("{},{nothing},{nothing},{nothing}\n", line.rsplitn(4, ',').last().expect("joints")),
            _ => format!("{line}\n"),
        };
        let body: String = text("", &rows, ",", joined).lines().enumerate().map(row).collect();
        let file = folder.file("lost.csv", format!("{header}\n{body}"));
        let (found, _) = source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{nothing}: {}", report(&e)));
        let measured = found.iter().filter(|row| matches!(row.observed, Observed::Position { .. })).count();
        assert_eq!(measured, 26, "{nothing}");
    }
    for (unit, mm) in [("cm", 10.0), ("in", 25.4)] {
        let header = format!("q1,q2,q3,q4,q5,q6,x [{unit}],y [{unit}],z [{unit}]");
        let file = folder.file("unit.csv", text(&header, &rows, ",", |q, p| joined(q, &p.map(|v| v / mm))));
        same(&source(&[&file]).read(&robot).expect(unit).0, &rows, unit);
        let wrong = folder.file("wrong.csv", text(&header, &rows, ",", joined));
        refused(&source(&[&wrong]), &robot, &["call the points", "with mm", "`--units mm`"]);
    }
}

#[test]
fn two_points_that_are_nearly_one_are_asked_about() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    for off in [0.0, 0.01, 0.1, 0.4, 3.0] {
        let both = |q: &[f64], p: &[f64; 3]| [joined(q, p), p.map(|v| v + off * (9.0 * v).sin()).to_vec()].concat();
        for names in ["x,y,z,x1,y1,z1", "x1,y1,z1,x2,y2,z2", "X,Y,Z,X,Y,Z", "Px,Py,Pz,Tx,Ty,Tz"] {
            let file = folder.file("two.csv", text(&format!("J1,J2,J3,J4,J5,J6,{names}"), &rows, ",", both));
            let first = "`--columns j1,j2,j3,j4,j5,j6,x,y,z` takes the first";
            refused(&source(&[&file]), &robot, &["two points would do", first, "j6,-,-,-,x,y,z` the second"]);
            let columns = Some("j1,j2,j3,j4,j5,j6,x1,y1,z1,x2,y2,z2".to_owned());
            let told = Source { columns, ..source(&[&file]) };
            if off > 0.1 {
                // Neither readings of one point nor two points of a body.
                refused(&told, &robot, &["two points would do"]);
                continue;
            }
            let (found, said) = told.read(&robot).expect("told");
            // Readings that are alike to the last digit are copies.
            let count = if off > 0.0 { 60 } else { 30 };
            assert!(found.len() == count && said[0].contains("2 readings a pose"), "{off} {names}: {said:?}");
        }
    }
    // Reflectors that are counted by letters are targets of a body.
    let all = of_reflectors(&rows);
    let reflectors: String =
        rows.iter().zip(&all).map(|((q, _), p)| list(&[p.clone(), q.clone()].concat(), ",") + "\n").collect();
    let header = "x_N1,y_N1,z_N1,x_N2,y_N2,z_N2,x_N3,y_N3,z_N3,q1,q2,q3,q4,q5,q6";
    let file = folder.file("body.csv", format!("{header}\n{reflectors}"));
    let (found, said) = source(&[&file]).read(&robot).expect("targets");
    assert!(found.len() == 90 && said[0].contains("3 targets a pose"), "{said:?}");
}

#[test]
fn what_lies_the_other_way_round_and_other_sheets_are_said() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let all: Vec<Vec<f64>> = rows.iter().map(|(q, p)| joined(q, p)).collect();
    let across: String = (0..9).map(|c| list(&all.iter().map(|row| row[c]).collect::<Vec<_>>(), ",") + "\n").collect();
    refused(&source(&[&folder.file("across.csv", across)]), &robot, &["exchange rows and columns"]);
    let joints = text("J1,J2,J3,J4,J5,J6", &rows, ",", |q, _| q.to_vec());
    let points = text("X,Y,Z", &rows, ",", |_, p| p.to_vec());
    let book = folder.file("book.xlsx", crate::spreadsheet::xlsx(&[("joints", &joints), ("points", &points)]));
    refused(&source(&[&book]), &robot, &["no columns of a measured point", "`book.xlsx#SHEET` another sheet"]);
}

#[test]
fn what_is_far_off_is_said_of_the_sum_that_is_determined() {
    let folder = Folder(workplace());
    let nominal = Robot::paper();
    let mut truth = Robot { tool_mm: Vector3::new(40.0, -25.0, 110.0), ..nominal.clone() };
    truth.joints[2].a_mm += 0.3;
    truth.joints[4].theta_rad += 4e-4;
    let sensor = transform(Vector3::new(0.4, 2.0, -0.7), Vector3::new(1900.0, -2000.0, 300.0));
    let seen = |q: &[f64]| sensor * truth.target_mm(&q.iter().map(|v| v.to_radians()).collect::<Vec<_>>());
    let noise = |q: &[f64]| Vector3::new(q[0].sin(), q[1].sin(), q[2].sin()) * 0.03;
    let rows: Rows = world(40).1.into_iter().map(|(q, _)| (q.clone(), (seen(&q) + noise(&q)).into())).collect();
    folder.file("m.csv", text("J1,J2,J3,J4,J5,J6,X,Y,Z", &rows, ",", joined));
    let said = |off_mm: f64| {
        let tool_mm = Vector3::new(40.0, -25.0, 110.0 + off_mm);
        folder.file("robot.toml", stereocal::robot::file::to_toml(&Robot { tool_mm, ..nominal.clone() }));
        let flags = ["identify", "--measurements", "m.csv", "--robot", "robot.toml", "--method", "trust-region"];
        let output = stereocal(folder.0.path(), &flags);
        assert!(output.status.success(), "{}", stderr(&output));
        stderr(&output)
    };
    for (off_mm, way) in [(-60.0, '+'), (-15.0, '+'), (40.0, '-'), (200.0, '-')] {
        let (said, far) = (said(off_mm), format!("far from nominal: d_6 + v_z {way}"));
        assert!(said.contains(&far) && said.contains(" mm (the tool, "), "{off_mm}: {said}");
    }
    // A ruler's centimetre is good enough for a tool.
    for off_mm in [0.0, 6.0, -9.0] {
        assert!(!said(off_mm).contains("far from nominal"), "{off_mm}: {}", said(off_mm));
    }
}

/// A joint that slides has the unit of its own column, else that of the points; a column of lengths is no joint that
/// turns.
#[test]
fn a_joint_that_slides_is_read_in_its_own_unit() {
    let folder = Folder(workplace());
    let (turning, _) = world(1);
    let mut robot = turning.clone();
    robot.joints[2].slides = true;
    let sensor = transform(Vector3::new(0.4, 2.0, -0.7), Vector3::new(1900.0, -2000.0, 300.0));
    let row = |i: usize| {
        let joints: Vec<f64> = (0..6).map(|j| 70.0 * ((7 * i + 3 * j * j + 1) as f64).sin()).collect();
        let reading = |(j, q): (usize, &f64)| if j == 2 { *q } else { q.to_radians() };
        let readings: Vec<f64> = joints.iter().enumerate().map(reading).collect();
        (joints, (sensor * robot.target_mm(&readings)).into())
    };
    let rows: Rows = (0..40).map(row).collect();
    let forms = [("m", 1e-3, "mm", 1.0), ("cm", 0.1, "mm", 1.0), ("mm", 1.0, "m", 1e-3), ("m", 1e-3, "m", 1e-3)];
    for (slide, times, length, of_point) in forms {
        let header =
            format!("q1 [deg],q2 [deg],q3 [{slide}],q4 [deg],q5 [deg],q6 [deg],x [{length}],y [{length}],z [{length}]");
        let line = |q: &[f64], p: &[f64; 3]| {
            let readings: Vec<f64> = q.iter().enumerate().map(|(j, v)| if j == 2 { v * times } else { *v }).collect();
            joined(&readings, &p.map(|v| v * of_point))
        };
        let file = folder.file("slides.csv", text(&header, &rows, ",", line));
        let (found, _) = source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{slide}: {}", report(&e)));
        same(&found, &rows, slide);
        let what = format!("q3 [{slide}] is a length, but joint 3 of the robot turns");
        refused(&source(&[&file]), &turning, &[&what, "prismatic"]);
    }
}

#[test]
fn a_transform_is_no_command_and_differences_are_not_added() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let cells = |q: &[f64], p: &[f64; 3]| {
        let [x, y, z] = p.map(|v| v / 1000.0);
        let matrix =
            format!("[[1.0, 0.0, 0.0, {x}], [0.0, 1.0, 0.0, {y}], [0.0, 0.0, 1.0, {z}], [0.0, 0.0, 0.0, 1.0]]");
        format!("\"[{}]\",\"{matrix}\"", list(&q.iter().map(|v| v.to_radians()).collect::<Vec<_>>(), ", "))
    };
    let file = folder.file("transforms.csv", format!("joint_positions,T\n{}", lines(&rows, cells)));
    let (found, said) = source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{}", report(&e)));
    same(&found, &rows, "transforms");
    assert!(said[0].contains("T_x"), "{said:?}");
    let off =
        |q: &[f64], p: &[f64; 3]| [q.to_vec(), p.map(|v| v + v.sin()).to_vec(), p.map(|v| -v.sin()).to_vec()].concat();
    let head = "J1,J2,J3,J4,J5,J6,x_t,y_t,z_t";
    let differ = folder.file("differ.csv", text(&format!("{head},x_dif,y_dif,z_dif"), &rows, ",", off));
    refused(
        &source(&[&differ]),
        &robot,
        &["x_t to z_t are where", "x_dif to z_dif look like differences", "x_meas,y_meas"],
    );
    let turned = folder.file("turned.csv", text(&format!("{head},rx_err,ry_err,rz_err"), &rows, ",", off));
    let error = source(&[&turned]).read(&robot).map(|_| ()).expect_err("no point was measured");
    assert!(!report(&error).contains("differences"), "{}", report(&error));
}
