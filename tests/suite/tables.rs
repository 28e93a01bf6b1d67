//! Tables as people have them: one robot in every form gives the same rows, what was taken is said, and what stays open
//! is refused with what settles it.

use std::fmt::Write as _;
use std::path::Path;

use camino::Utf8PathBuf;
use nalgebra::{Point3, Vector3};
use stereocal::diagnostic::report;
use stereocal::geometry::transform;
use stereocal::measurements::{Measurement, Observed, Source};
use stereocal::robot::Robot;

use crate::run::{shared, stderr, stdout, stereocal, workplace};

mod doubtful;
mod forms;
mod joined;
mod logs;
mod owners;
mod written;

/// Readings that were converted agree to this, deg and mm: rounding of the last digit of a double, times a thousand.
const SAME: f64 = 1e-9;

/// Joints, deg, and points, mm.
type Rows = Vec<(Vec<f64>, [f64; 3])>;

/// The nominal robot, which knows nothing of the tool, and what a tracker reads of a true one.
fn world(poses: usize) -> (Robot, Rows) {
    let nominal = Robot::paper();
    let mut truth = nominal.clone().with_table_2();
    truth.tool_mm = Vector3::new(40.0, -25.0, 110.0);
    let sensor = transform(Vector3::new(0.4, 2.0, -0.7), Vector3::new(1900.0, -2000.0, 300.0));
    let row = |i: usize| {
        let joints: Vec<f64> = (0..6).map(|j| 70.0 * ((7 * i + 3 * j * j + 1) as f64).sin()).collect();
        let radians: Vec<f64> = joints.iter().map(|q| q.to_radians()).collect();
        (joints, (sensor * truth.target_mm(&radians)).into())
    };
    (nominal, (0..poses).map(row).collect())
}

/// The table under this header, none where it is empty.
fn text(header: &str, rows: &Rows, delimiter: &str, line: impl Fn(&[f64], &[f64; 3]) -> Vec<f64>) -> String {
    let mut text = if header.is_empty() { String::new() } else { format!("{header}\n") };
    for (joints, point) in rows {
        let cells: Vec<String> = line(joints, point).iter().map(f64::to_string).collect();
        let _ = writeln!(text, "{}", cells.join(delimiter));
    }
    text
}

fn joined(q: &[f64], p: &[f64; 3]) -> Vec<f64> {
    [q, p].concat()
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn file(&self, name: &str, bytes: impl AsRef<[u8]>) -> Utf8PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).expect("it is written");
        Utf8PathBuf::from_path_buf(path).expect("a name in UTF-8")
    }
}

fn source(files: &[&Utf8PathBuf]) -> Source {
    Source { files: files.iter().map(|f| (*f).clone()).collect(), ..Source::default() }
}

fn same(found: &[Measurement], rows: &Rows, what: &str) {
    assert_eq!(found.len(), rows.len(), "{what}");
    for (row, (joints, point)) in found.iter().zip(rows) {
        assert!(
            row.at.joints_deg.iter().zip(joints).all(|(a, b)| (a - b).abs() < SAME),
            "{what}: {:?} {joints:?}",
            row.at
        );
        let Observed::Position { point_mm, .. } = row.observed else { panic!("{what}: {:?}", row.observed) };
        assert!((point_mm - Point3::from(*point)).norm() < SAME, "{what}: {point_mm} {point:?}");
    }
}

fn refused(source: &Source, robot: &Robot, parts: &[&str]) {
    let said = source.read(robot).map(|_| String::new()).unwrap_or_else(|e| report(&e));
    assert!(parts.iter().all(|part| said.contains(part)), "{parts:?} not in: {said}");
}

#[test]
fn one_table_in_every_form() {
    let folder = Folder(workplace());
    let (robot, rows) = world(40);
    let plain = text("J1,J2,J3,J4,J5,J6,X,Y,Z", &rows, ",", joined);
    let comma = text("J1;J2;J3;J4;J5;J6;X;Y;Z", &rows, ";", joined).replace('.', ",");
    let radians =
        |q: &[f64], p: &[f64; 3]| [q.iter().map(|v| v.to_radians()).collect(), p.map(|v| v / 1000.0).to_vec()].concat();
    let reversed = |q: &[f64], p: &[f64; 3]| joined(q, p).into_iter().rev().collect::<Vec<_>>();
    let utf16: Vec<u8> = plain.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let latin: Vec<u8> =
        format!("U [\u{b5}m];{comma}").replace('\n', "\n1;").trim_end_matches("1;").chars().map(|c| c as u8).collect();
    let zeros = |q: &[f64], p: &[f64; 3]| [joined(q, p), vec![0.0; 3]].concat();
    let points_first = |q: &[f64], p: &[f64; 3]| [p.to_vec(), vec![0.0; 6], q.to_vec()].concat();
    let forms: Vec<(&str, Vec<u8>)> = vec![
        ("plain.csv", plain.clone().into()),
        ("tabs.txt", plain.replace(',', "\t").into()),
        ("blanks.txt", plain.replace(',', "   ").into()),
        ("comma.csv", comma.into()),
        ("utf16.csv", [vec![0xff, 0xfe], utf16].concat()),
        ("latin.csv", latin),
        ("plain.xlsx", crate::spreadsheet::xlsx(&[("Sheet1", &plain)])),
        ("radians.csv", text("q1,q2,q3,q4,q5,q6,px,py,pz", &rows, ",", radians).into()),
        (
            "said.csv",
            text(
                "theta_1 [rad],theta_2 [rad],theta_3 [rad],theta_4 [rad],theta_5 [rad],theta_6 [rad],x (m),y (m),z (m)",
                &rows,
                ",",
                radians,
            )
            .into(),
        ),
        (
            "reversed.csv",
            text("z_mm,y_mm,x_mm,joint 6,joint 5,joint 4,joint 3,joint 2,joint 1", &rows, ",", reversed).into(),
        ),
        ("bare.csv", text("", &rows, ", ", joined).into()),
        ("zeros.txt", text("", &rows, " ", zeros).into()),
        ("first.csv", text("", &rows, ",", points_first).into()),
        ("counted.csv", text("0,1,2,3,4,5,6,7,8", &rows, ",", joined).into()),
        ("bare-radians.csv", text("", &rows, "\t", radians).into()),
    ];
    for (name, bytes) in forms {
        let file = folder.file(name, bytes);
        let (found, said) = source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{name}: {}", report(&e)));
        same(&found, &rows, name);
        assert!(said[0].contains("40 rows; joints from") && said[0].contains("pose = row"), "{name}: {said:?}");
        assert_eq!(name.contains("radians") || name == "said.csv", said[0].contains("in radians"), "{name}: {said:?}");
    }
}

#[test]
fn names_that_are_not_known_are_taken_on_the_robots_word() {
    let folder = Folder(workplace());
    let (robot, rows) = world(40);
    let six = |word: &str| (1..=6).map(|i| format!("{word}{i}")).collect::<Vec<_>>().join(",");
    for names in [
        six("Achse "),
        six("\u{5173}\u{8282}"),
        six("\u{cd95} "),
        six("position_"),
        "S,L,U,R,B,T".to_owned(),
        "base,shoulder,elbow,wrist1,wrist2,wrist3".to_owned(),
    ] {
        let file = folder.file("named.csv", text(&format!("{names},X,Y,Z"), &rows, ",", joined));
        let (found, said) = source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{names}: {}", report(&e)));
        same(&found, &rows, &names);
        assert!(said[0].contains("which the nominal robot confirms"), "{names}: {said:?}");
    }
    let points = folder.file("points.csv", text("J1,J2,J3,J4,J5,J6,one,two,three", &rows, ",", joined));
    same(&source(&[&points]).read(&robot).expect("points").0, &rows, "points");
    // Torques are no joints, and no point is among what has nothing to do with the joints.
    let torques = |q: &[f64], p: &[f64; 3]| [q.iter().map(|v| v.sin()).collect(), joined(q, p)].concat();
    let tau = folder.file("tau.csv", text(&format!("{},{},X,Y,Z", six("tau_"), six("Ax ")), &rows, ",", torques));
    same(&source(&[&tau]).read(&robot).expect("torques left alone").0, &rows, "torques");
    let other = |q: &[f64], p: &[f64; 3]| joined(q, &p.map(|v| (1e3 * v).sin()));
    let none = folder.file("none.csv", text("J1,J2,J3,J4,J5,J6,one,two,three", &rows, ",", other));
    refused(&source(&[&none]), &robot, &["no name says which columns are the point", "near to the nominal robot"]);
}

#[test]
fn numbers_as_people_write_them() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let header = "J1;J2;J3;J4;J5;J6;X;Y;Z";
    let grouped = |value: f64, by: char, point: char| {
        let plain = format!("{value:.9}");
        let (whole, decimals) = plain.split_once('.').expect("nine decimals");
        let (sign, digits) = whole.strip_prefix('-').map_or(("", whole), |digits| ("-", digits));
        let mut out = String::new();
        for (i, c) in digits.chars().enumerate() {
            if i > 0 && (digits.len() - i) % 3 == 0 {
                out.push(by);
            }
            out.push(c);
        }
        format!("{sign}{out}{point}{decimals}")
    };
    let table = |write: &dyn Fn(f64) -> String, delimiter: &str| {
        let line = |(q, p): &(Vec<f64>, [f64; 3])| {
            joined(q, p).iter().map(|v| write(*v)).collect::<Vec<_>>().join(delimiter) + "\n"
        };
        format!("{}\n{}", header.replace(';', delimiter), rows.iter().map(line).collect::<String>())
    };
    let plain = table(&|v| v.to_string(), ",");
    for (name, text) in [
        ("commas.csv", table(&|v| grouped(v, ',', '.'), ";")),
        ("points.csv", table(&|v| grouped(v, '.', ','), ";")),
        ("blanks.csv", table(&|v| grouped(v, '\u{a0}', ','), ";")),
        ("quoted.csv", table(&|v| format!("\"{}\"", v.to_string().replace('.', ",")), ",")),
        ("bars.txt", table(&|v| v.to_string(), "|")),
        ("lists.txt", plain.lines().skip(1).map(|line| format!("[{line}],\n")).collect()),
        ("comments.csv", format!("{plain}# pause; and on\n")),
    ] {
        let file = folder.file(name, text);
        let (found, _) = source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{name}: {}", report(&e)));
        assert_eq!(found.len(), rows.len(), "{name}");
        for (row, (_, point)) in found.iter().zip(&rows) {
            let Observed::Position { point_mm, .. } = row.observed else { panic!("{name}") };
            // Nine decimals.
            assert!((point_mm - Point3::from(*point)).norm() < 2.0 * SAME, "{name}: {point_mm} {point:?}");
        }
    }
    let both = plain.replacen("\n", "\n\"1,234.5\",\"2,5\",3,4,5,6,7,8,9\n", 1);
    refused(&source(&[&folder.file("both.csv", both)]), &robot, &["is not a number: `1,234.5`"]);
    refused(&source(&[&folder.file("a.json", "{\"q\": [1, 2, 3]}")]), &robot, &["a JSON file", "to_csv"]);
}

#[test]
fn computed_points_are_asked_about_and_said() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let radians = |q: &[f64]| q.iter().map(|v| v.to_radians()).collect::<Vec<f64>>();
    let computed = |q: &[f64]| robot.target_mm(&radians(q)).coords.iter().copied().collect::<Vec<f64>>();
    let both = |q: &[f64], p: &[f64; 3]| [q.to_vec(), p.to_vec(), computed(q)].concat();
    // Nearer to the nominal robot than any measured point, and not what was measured.
    let file = folder.file("both.csv", text("", &rows, ",", both));
    refused(&source(&[&file]), &robot, &["two points would do, columns 7 to 9 and columns 10 to 12"]);
    let alone = folder
        .file("alone.csv", text("J1,J2,J3,J4,J5,J6,X,Y,Z", &rows, ",", |q, _| [q.to_vec(), computed(q)].concat()));
    let (_, said) = source(&[&alone]).read(&robot).expect("a point");
    assert!(said[1].contains("computed from the joints, not measured"), "{said:?}");
    // Two points a row that keep no distance are no two targets.
    let header = "J1,J2,J3,J4,J5,J6,X1,Y1,Z1,X2,Y2,Z2";
    let moved = |q: &[f64], p: &[f64; 3]| [joined(q, p), p.map(|v| v + (7.0 * v).sin()).to_vec()].concat();
    let two = folder.file("two.csv", text(header, &rows, ",", moved));
    refused(&source(&[&two]), &robot, &["two points would do, X1 to Z1 and X2 to Z2"]);
}

#[test]
fn files_that_complete_each_other_are_joined_and_complete_ones_stacked() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let joints = folder.file("joints.txt", text("", &rows, " ", |q, _| q.to_vec()));
    let points = folder
        .file("points.csv", text("X,Y,Z,Rx,Ry,Rz", &rows, ",", |_, p| [p.to_vec(), vec![1.0, 2.5, 3.0]].concat()));
    let (found, said) = source(&[&joints, &points]).read(&robot).expect("both");
    same(&found, &rows, "joined");
    assert!(said[0].contains("joints.txt + points.csv") && said[0].contains("not used: Rx, Ry, Rz"), "{said:?}");
    let lines: Vec<String> = rows
        .iter()
        .enumerate()
        .map(|(i, (q, _))| {
            let numbers: Vec<String> = q.iter().map(f64::to_string).collect();
            format!("LOCAL VAR jointtarget j{i} = j:{{{}\t,0\t}}\t{{EJ 0,0,0,0,0,0}}", numbers.join(","))
        })
        .collect();
    let program = folder.file("program.csv", lines.join("\n"));
    let (found, said) = source(&[&program, &points]).read(&robot).expect("both");
    same(&found, &rows, "program");
    assert!(said[0].contains("a program's lines"), "{said:?}");
    let half = rows.split_at(12);
    let whole = |name: &str, rows: &[(Vec<f64>, [f64; 3])]| folder.file(name, text("", &rows.to_vec(), ",", joined));
    let (first, second) = (whole("a.csv", half.0), whole("b.csv", half.1));
    let (found, said) = source(&[&first, &second]).read(&robot).expect("both");
    same(&found, &rows, "stacked");
    assert_eq!(
        (said.len(), found[0].at.group == found[11].at.group, found[11].at.group == found[12].at.group),
        (2, true, false)
    );
    let short = folder.file("short.csv", text("X,Y,Z", &rows[1..].to_vec(), ",", |_, p| p.to_vec()));
    refused(&source(&[&joints, &short]), &robot, &["joints.txt has 30 rows, short.csv has 29 rows", "hint:"]);
}

/// Three reflectors on the flange.
const REFLECTORS: [[f64; 3]; 3] = [[60.0, 10.0, 80.0], [-40.0, 45.0, 100.0], [-20.0, -55.0, 120.0]];

fn of_reflectors(rows: &Rows) -> Vec<Vec<f64>> {
    let truth = Robot::paper().with_table_2();
    let sensor = transform(Vector3::new(0.4, 2.0, -0.7), Vector3::new(1900.0, -2000.0, 300.0));
    let seen = |q: &[f64]| {
        let flange = sensor * truth.base_from_flange(&q.iter().map(|v| v.to_radians()).collect::<Vec<_>>());
        REFLECTORS.iter().flat_map(|r| (flange * Point3::from(*r)).coords.iter().copied().collect::<Vec<_>>()).collect()
    };
    rows.iter().map(|(q, _)| seen(q)).collect()
}

#[test]
fn several_targets_a_row_and_several_rows_a_pose() {
    let folder = Folder(workplace());
    let (robot, rows) = world(24);
    let all = of_reflectors(&rows);
    let line = |cells: Vec<f64>, d: &str| cells.iter().map(f64::to_string).collect::<Vec<_>>().join(d);
    let side = |d: &str| -> String {
        rows.iter().zip(&all).map(|((q, _), p)| line([p.clone(), vec![0.0; 6], q.clone()].concat(), d) + "\n").collect()
    };
    let joints = folder.file("joints.csv", text("J1,J2,J3,J4,J5,J6", &rows, ",", |q, _| q.to_vec()));
    let below: String =
        all.iter().flat_map(|p| p.chunks(3).map(|c| line(c.to_vec(), ",") + "\n").collect::<Vec<_>>()).collect();
    let block: String =
        (0..3).flat_map(|k| all.iter().map(move |p| line(p[3 * k..3 * k + 3].to_vec(), ",") + "\n")).collect();
    let named = "x1,y1,z1,x2,y2,z2,x3,y3,z3,a,b,c,d,e,f,q1,q2,q3,q4,q5,q6\n".to_owned() + &side(",");
    let sets = [
        ("side", vec![folder.file("side.txt", side(" "))]),
        ("named", vec![folder.file("named.csv", named)]),
        ("below", vec![joints.clone(), folder.file("below.csv", format!("x,y,z\n{below}"))]),
        ("block", vec![joints.clone(), folder.file("block.csv", block)]),
    ];
    for (what, files) in sets {
        let source = Source { files, ..Source::default() };
        let (found, said) = source.read(&robot).unwrap_or_else(|e| panic!("{what}: {}", report(&e)));
        assert_eq!(found.len(), 72, "{what}: {said:?}");
        assert!(said[0].contains("3 targets a pose"), "{what}: {said:?}");
        for (i, row) in found.iter().enumerate() {
            let Observed::Position { point_mm, .. } = row.observed else { panic!("{what}") };
            let expected = Point3::from_slice(&all[i / 3][3 * (i % 3)..3 * (i % 3) + 3]);
            assert!((point_mm - expected).norm() < SAME && !row.target.is_empty(), "{what}: {i}");
        }
    }
    let thrice: String = rows
        .iter()
        .flat_map(|(_, p)| (0..3).map(|k| line(p.map(|v| v + 0.001 * f64::from(k)).to_vec(), ",") + "\n"))
        .collect();
    let (found, said) = source(&[&joints, &folder.file("thrice.csv", thrice)]).read(&robot).expect("readings");
    assert!(found.len() == 72 && found[0].target.is_empty() && said[0].contains("3 readings a pose"), "{said:?}");
}

#[test]
fn what_was_commanded_is_never_taken_for_what_was_measured() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let both = |q: &[f64], p: &[f64; 3]| [q.to_vec(), p.map(|v| v + 0.2 * v.sin()).to_vec(), p.to_vec()].concat();
    let j = "j1,j2,j3,j4,j5,j6";
    for header in [
        "x_cmd,y_cmd,z_cmd,x,y,z",
        "x_t,y_t,z_t,x_a,y_a,z_a",
        "x nominal,y nominal,z nominal,X_meas [mm],Y_meas [mm],Z_meas [mm]",
        "x,y,z,xm,ym,zm",
    ] {
        let file = folder.file("both.csv", text(&format!("{j},{header}"), &rows, ",", both));
        let (found, _) = source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{header}: {}", report(&e)));
        same(&found, &rows, header);
    }
    let bare = folder.file("bare.csv", text("", &rows, ",", both));
    let asked = [
        "two points would do, columns 7 to 9 and columns 10 to 12",
        "`--columns j1,j2,j3,j4,j5,j6,-,-,-,x,y,z` the second",
    ];
    refused(&source(&[&bare]), &robot, &asked);
    let columns = Some("j1,j2,j3,j4,j5,j6,-,-,-,x,y,z".to_owned());
    let (found, _) = Source { columns, ..source(&[&bare]) }.read(&robot).expect("told");
    same(&found, &rows, "told");
    let only = folder.file("only.csv", text(&format!("{j},x_t,y_t,z_t"), &rows, ",", joined));
    refused(&source(&[&only]), &robot, &["x_t to z_t are where the robot was sent"]);
    let named = folder.file("named.csv", text(&format!("{j},x,y,z,tcp_x,tcp_y,tcp_z"), &rows, ",", both));
    refused(&source(&[&named]), &robot, &["two points would do", "--columns"]);
    // A length beside a bare point is what was measured.
    let length = |q: &[f64], p: &[f64; 3]| [joined(q, p), vec![p[0].abs() + 500.0]].concat();
    let wire = folder.file("wire.csv", text(&format!("{j},x,y,z,L"), &rows, ",", length));
    let (found, said) = source(&[&wire]).read(&robot).expect("lengths");
    assert!(matches!(found[0].observed, Observed::Distance { .. }) && said[0].contains("distances from L"), "{said:?}");
    let own = folder.file("own.csv", text(&format!("{j},x_mm,y_mm,z_mm,distance_mm"), &rows, ",", length));
    same(&source(&[&own]).read(&robot).expect("points").0, &rows, "own");
}

#[test]
fn traps_are_refused_for_what_they_are() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let header = "J1,J2,J3,J4,J5,J6,X,Y,Z";
    let plain = text(header, &rows, ",", joined);
    let one = |name: &str, bytes: &[u8]| source(&[&folder.file(name, bytes)]);
    refused(&one("a.mat", b"MATLAB 5.0 MAT-file, Platform: GLNXA64"), &robot, &["MATLAB file", "writematrix"]);
    let mut lines: Vec<String> = plain.lines().map(str::to_owned).collect();
    lines[5] = lines[5].replacen(|c: char| c.is_ascii_digit(), "o", 1);
    refused(&one("text.csv", lines.join("\n").as_bytes()), &robot, &["`J1` is not a number", "text.csv:6", "29 of 30"]);
    let twice = plain.replace("J1,J2,J3", "J1,J3,J3");
    refused(&one("twice.csv", twice.as_bytes()), &robot, &["joint 3 is named twice: columns 2 (`J3`) and 3 (`J3`)"]);
    let radians = |q: &[f64], p: &[f64; 3]| [q.iter().map(|v| v.to_radians()).collect(), p.to_vec()].concat();
    let wrong = text("J1 [deg],J2 [deg],J3 [deg],J4 [deg],J5 [deg],J6 [deg],X [mm],Y [mm],Z [mm]", &rows, ",", radians);
    refused(
        &one("wrong.csv", wrong.as_bytes()),
        &robot,
        &["J1 [deg] to J6 [deg]", "times nearer to the points with radians", "`--units rad`"],
    );
    let kept = Source { units: Some("deg".to_owned()), ..one("wrong.csv", wrong.as_bytes()) };
    assert!(kept.read(&robot).is_ok(), "a flag is not doubted");
    // Lengths in metres under a name that says mm: the joints are not to blame.
    let metres = |q: &[f64], p: &[f64; 3]| joined(q, &p.map(|v| v / 1000.0));
    let wrong = text("J1,J2,J3,J4,J5,J6,x_mm,y_mm,z_mm", &rows, ",", metres);
    refused(&one("metres.csv", wrong.as_bytes()), &robot, &["call the points (x_mm to z_mm) mm", "`--units m`"]);
    let wrong = text("J1,J2,J3,J4,J5,J6,x_m,y_m,z_m", &rows, ",", joined);
    refused(&one("millimetres.csv", wrong.as_bytes()), &robot, &["call the points (x_m to z_m) m,", "`--units mm`"]);
    let mut lines: Vec<String> = text("", &rows, ",", joined).lines().map(str::to_owned).collect();
    lines[7] = lines[7].rsplit_once(',').map_or(String::new(), |(head, _)| format!("{head},lost"));
    refused(
        &one("bare.csv", lines.join("\n").as_bytes()),
        &robot,
        &["`column 9` is not a number: `lost`", "bare.csv:8"],
    );
    let few = plain.replace("J6,X", "K,X");
    refused(&one("few.csv", few.as_bytes()), &robot, &["5 columns of joints, but the robot has 6"]);
    refused(
        &one("joints.csv", text("J1,J2,J3,J4,J5,J6", &rows, ",", |q, _| q.to_vec()).as_bytes()),
        &robot,
        &["no columns of a measured point", "--measurements FILE"],
    );
    // Joints that hardly move say nothing about their unit.
    let still =
        |q: &[f64], p: &[f64; 3]| [q.iter().map(|v| v / 70.0).collect(), p.map(|v| v / 1e4 + 3.0).to_vec()].concat();
    refused(&one("still.csv", text(header, &rows, ",", still).as_bytes()), &robot, &["degrees or radians", "--units"]);
    // A quaternion is no set of joints.
    let quaternion = |_: &[f64], p: &[f64; 3]| [p.to_vec(), vec![0.5, 0.25, 0.1, 0.7]].concat();
    let joints = folder.file("j.csv", text("J1,J2,J3,J4,J5,J6", &rows, ",", |q, _| q.to_vec()));
    let leica = folder.file("leica.csv", text("X  [mm],Y  [mm],Z  [mm],Q0 ,Q1 ,Q2 ,Q3 ", &rows, ",", quaternion));
    same(&source(&[&joints, &leica]).read(&robot).expect("points").0, &rows, "leica");
}

#[test]
fn targets_to_compensate_may_have_any_names() {
    let folder = Folder(workplace());
    let (robot, rows) = world(12);
    let read = |name: &str, text: String| stereocal::formats::targets::read(&folder.file(name, text), &robot);
    let joints = |q: &[f64], _: &[f64; 3]| q.to_vec();
    let turned = |q: &[f64], _: &[f64; 3]| q.iter().map(|v| v.to_radians()).collect::<Vec<_>>();
    for (name, text) in [
        ("named.csv", text("Joint 1;Joint 2;Joint 3;Joint 4;Joint 5;Joint 6", &rows, ";", joints)),
        ("letters.csv", text("S,L,U,R,B,T", &rows, ",", joints)),
        ("bare.txt", text("", &rows, " ", joints)),
        ("radians.csv", text("q1 [rad],q2 [rad],q3 [rad],q4 [rad],q5 [rad],q6 [rad]", &rows, ",", turned)),
    ] {
        let found = read(name, text).unwrap_or_else(|e| panic!("{name}: {}", report(&e)));
        for (row, (joints, _)) in found.iter().zip(&rows) {
            let given = row.given.as_ref().expect("readings");
            assert!(given.iter().zip(joints).all(|(a, b)| (a - b).abs() < SAME), "{name}: {given:?} {joints:?}");
        }
        assert_eq!(found.len(), rows.len(), "{name}");
    }
    let small = text("q1,q2,q3,q4,q5,q6", &rows, ",", |q, _| q.iter().map(|v| v / 70.0).collect());
    let said = read("small.csv", small).err().map(|e| report(&e)).expect("either unit would do");
    assert!(said.contains("degrees or radians") && said.contains("hint:"), "{said}");
}

#[test]
fn sheets_are_named_behind_the_file() {
    let folder = Folder(workplace());
    let (robot, rows) = world(20);
    let joints = text("J1,J2,J3,J4,J5,J6", &rows, ",", |q, _| q.to_vec());
    let points = text("X,Y,Z", &rows, ",", |_, p| p.to_vec());
    let book = folder.file("book.xlsx", crate::spreadsheet::xlsx(&[("joints", &joints), ("points", &points)]));
    let second = Utf8PathBuf::from(format!("{book}#points"));
    same(&source(&[&book, &second]).read(&robot).expect("both").0, &rows, "sheets");
    let none = Utf8PathBuf::from(format!("{book}#other"));
    refused(&source(&[&none]), &robot, &["no sheet `other`; the file has: joints, points"]);
}

#[test]
fn the_given_tables_read_as_they_are() {
    let Some(folder) = shared("robot/raw") else { return };
    let numbers = |file: &str, delimiter: char, from: usize| -> Vec<Vec<f64>> {
        let text = std::fs::read_to_string(folder.join(file)).expect("it is there");
        let cells = |line: &str| line.split(delimiter).filter_map(|c| c.trim().parse().ok()).collect::<Vec<f64>>();
        text.lines().skip(from).map(cells).filter(|row| !row.is_empty()).collect()
    };
    let file = |name: &str| Utf8PathBuf::from_path_buf(folder.join(name)).expect("UTF-8");
    let robot = |name: &str| stereocal::robot::file::read(&file(name)).expect("a robot");
    let expected: Rows = numbers("iiwa7/20161118_run_1.csv", ',', 1)
        .iter()
        .map(|r| (r[1..8].iter().map(|v| v.to_degrees()).collect(), [r[18], r[22], r[26]]))
        .collect();
    same(
        &source(&[&file("iiwa7/20161118_run_1.csv")]).read(&robot("iiwa7/robot.toml")).expect("iiwa").0,
        &expected,
        "iiwa",
    );
    for name in ["Large160", "Small80"] {
        let name = format!("meca500_left/CAL00005_Left_{name}_Output.csv");
        let expected: Rows =
            numbers(&name, ',', 0).iter().map(|r| (r[..6].to_vec(), [r[6], r[7], r[8]].map(|v| 1000.0 * v))).collect();
        same(&source(&[&file(&name)]).read(&robot("meca500_left/robot.toml")).expect("meca").0, &expected, &name);
    }
    let program = std::fs::read_to_string(folder.join("rokae/joint_angle.csv")).expect("it is there");
    let target = |line: &str| -> Vec<f64> {
        let list = &line[line.find("j:{").expect("a target") + 3..];
        list.split([',', '}']).take(6).map(|v| v.trim().parse().expect("a number")).collect()
    };
    let points = numbers("rokae/laser_pos.csv", ' ', 0);
    let expected: Rows = program.lines().map(target).zip(points.iter().map(|r| [r[6], r[7], r[8]])).collect();
    let files = [file("rokae/joint_angle.csv"), file("rokae/laser_pos.csv")];
    let rokae = robot("rokae/robot.toml");
    refused(&source(&[&files[0], &files[1]]), &rokae, &["columns 2 to 4 and columns 8 to 10", "--columns"]);
    let columns = Some("j1,j2,j3,j4,j5,j6,-,-,-,-,-,-,-,x,y,z".to_owned());
    same(&Source { files: files.into(), columns, units: None }.read(&rokae).expect("rokae").0, &expected, "rokae");
    let files = [file("rokae/test_joint_angles.xlsx"), file("rokae/test_positions.csv")];
    assert_eq!(Source { files: files.into(), ..Source::default() }.read(&rokae).expect("the first ten").0.len(), 10);
}

#[test]
fn a_table_of_denavit_and_hartenberg_is_asked_about_or_told_by_the_readings() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let table: String = robot
        .joints
        .iter()
        .map(|j| format!("{} {} {} {}\n", j.a_mm / 1000.0, j.alpha_rad, j.d_mm / 1000.0, j.theta_rad))
        .collect();
    folder.file("dh.txt", table);
    folder.file("m.csv", text("J1,J2,J3,J4,J5,J6,X,Y,Z", &rows, ",", joined));
    let at = |arguments: &[&str]| stereocal(Path::new(folder.0.path()), arguments);
    let open = at(&["robot", "import", "dh.txt", "--out", "a"]);
    assert!(open.status.code() == Some(2) && stderr(&open).contains("--columns"), "{}", stderr(&open));
    let told = at(&["robot", "import", "dh.txt", "--measurements", "m.csv", "--out", "b"]);
    assert!(told.status.success() && stderr(&told).contains("modified convention"), "{}", stderr(&told));
    let read =
        stereocal::robot::file::read(&Utf8PathBuf::from_path_buf(folder.0.path().join("b/robot.toml")).expect("UTF-8"))
            .expect("a robot");
    for (a, b) in read.joints.iter().zip(&robot.joints) {
        assert!(
            (a.a_mm - b.a_mm).abs() < SAME
                && (a.alpha_rad - b.alpha_rad).abs() < SAME
                && (a.d_mm - b.d_mm).abs() < SAME
        );
    }
    let shown = at(&["robot", "show", "b/robot.toml", "--joints", "-10,20,30,-40,50,60"]);
    assert!(shown.status.success(), "{}", stderr(&shown));
}
