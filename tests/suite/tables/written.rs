//! What stands in cells beside numbers, tables below or beside others, files that are no tables: read as a person reads
//! them, or said with what they are and where.

use super::*;

const NAMES: &str = "A1,A2,A3,A4,A5,A6,X,Y,Z";

/// A table whose rows are written cell by cell, `write` knowing the column and the number.
fn written(header: &str, rows: &Rows, delimiter: &str, write: impl Fn(usize, f64) -> String) -> String {
    let line = |(q, p): &(Vec<f64>, [f64; 3])| {
        let cells: Vec<String> = joined(q, p).iter().enumerate().map(|(i, v)| write(i, *v)).collect();
        cells.join(delimiter) + "\n"
    };
    let header = if header.is_empty() { String::new() } else { format!("{header}\n") };
    header + &rows.iter().map(line).collect::<String>()
}

fn list(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(", ")
}

#[test]
fn units_names_and_comments_beside_numbers() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let unit = |i: usize, v: f64| if i < 6 { format!("{v}\u{b0}") } else { format!("{v} mm") };
    let names = ["A1", "A2", "A3", "A4", "A5", "A6", "X", "Y", "Z"];
    let in_braces = |i: usize, v: f64| {
        let (open, close) = (if i.is_multiple_of(6) { "{" } else { "" }, if i == 5 || i == 8 { "}" } else { "" });
        format!("{open}{} {v}{close}", names[i])
    };
    let plain = written(NAMES, &rows, ",", |_, v| v.to_string());
    let noted: String = plain
        .lines()
        .enumerate()
        .map(|(i, l)| if i % 3 == 1 { format!("{l}  # ok, fine\n") } else { format!("{l}\n") })
        .collect();
    for (name, text) in [
        ("units.csv", written(NAMES, &rows, ",", unit)),
        ("units-alone.csv", written("", &rows, ",", unit)),
        ("pairs.txt", written("", &rows, " ", |i, v| format!("{}={v}", names[i]))),
        ("pairs.csv", written("", &rows, ", ", |i, v| format!("{}: {v}", names[i]))),
        ("braces.txt", written("", &rows, ",", in_braces).replace("},{", "} {")),
        (
            "records.txt",
            written("", &rows, ", ", |i, v| format!("\"{}\": {v}", names[i]))
                .lines()
                .map(|l| format!("{{{l}}}\n"))
                .collect(),
        ),
        ("noted.csv", noted.clone()),
        ("noted.txt", noted.replace("ok, fine", "ok fine").replace(',', " ")),
    ] {
        let file = folder.file(name, text);
        let (found, said) = source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{name}: {}", report(&e)));
        same(&found, &rows, name);
        assert!(said[0].contains("in degrees") && said[0].contains("in mm"), "{name}: {said:?}");
    }
    // Units in cells are stated ones, and do not contradict the names.
    let metres = written(NAMES, &rows, ",", |i, v| if i < 6 { format!("{v} deg") } else { format!("{}m", v / 1000.0) });
    same(&source(&[&folder.file("metres.csv", metres)]).read(&robot).expect("metres").0, &rows, "metres");
    let wrong = written("A1,A2,A3,A4,A5,A6,X [m],Y [m],Z [m]", &rows, ",", unit);
    refused(&source(&[&folder.file("wrong.csv", wrong)]), &robot, &["`X [m]` is not a number", " mm`"]);
    let false_unit = written("", &rows, ",", |i, v| if i < 6 { format!("{v} rad") } else { v.to_string() });
    refused(&source(&[&folder.file("false.csv", false_unit)]), &robot, &["call the joints", "`--units deg`"]);
}

#[test]
fn lists_in_cells_have_the_names_of_their_columns() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let table = |header: &str, line: &dyn Fn(&[f64], &[f64; 3]) -> String| {
        let lines = rows.iter().enumerate().map(|(i, (q, p))| format!("{},{}\n", i + 1, line(q, p)));
        format!("pose_id,{header}\n{}", lines.collect::<String>())
    };
    let metres = |p: &[f64; 3]| p.map(|v| v / 1000.0);
    let joints = folder.file("joints.csv", table("joints_deg", &|q, _| format!("\"[{}]\"", list(q))));
    let turn = |p: &[f64; 3]| list(&p.map(|v| (v / 500.0).sin()));
    let matrix =
        |p: &[f64; 3]| format!("[[0, -1, 0, {}], [1, 0, 0, {}], [0, 0, 1, {}], [0, 0, 0, 1]]", p[0], p[1], p[2]);
    for (name, text) in [
        ("t.csv", table("tvec_m", &|_, p| format!("\"[{}]\"", list(&metres(p))))),
        ("rt.csv", table("rvec_rad,tvec_m", &|_, p| format!("\"[{}]\",\"[{}]\"", turn(p), list(&metres(p))))),
        (
            "picture.csv",
            table("image,success,tvec_m,camera_3x3,rmse_px", &|_, p| {
                format!("a.png,True,\"[{}]\",\"[[9, 0, 5], [0, 9, 4], [0, 0, 1]]\",0.2", list(&metres(p)))
            }),
        ),
        ("matrix.csv", table("T_base_board_4x4", &|_, p| format!("\"{}\"", matrix(p)))),
        ("numpy.csv", table("position_mm", &|_, p| format!("[{}]", list(p).replace(", ", "  ")))),
    ] {
        let file = folder.file(name, text);
        let (found, said) = source(&[&joints, &file]).read(&robot).unwrap_or_else(|e| panic!("{name}: {}", report(&e)));
        same(&found, &rows, name);
        assert!(said[0].contains("joints from joints_1 [deg] to joints_6 [deg]"), "{name}: {said:?}");
        assert!(!said[0].contains("program"), "{name}: {said:?}");
    }
    let radians = |q: &[f64]| list(&q.iter().map(|v| v.to_radians()).collect::<Vec<_>>());
    let both = table("joints_deg,joints_rad,tvec_mm", &|q, p| {
        format!("\"[{}]\",\"[{}]\",\"[{}]\"", list(q), radians(q), list(p))
    });
    refused(&source(&[&folder.file("both.csv", both)]), &robot, &["two sets of joints would do: joints_1 [deg]"]);
}

#[test]
fn a_comment_is_no_row_of_names() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let matrix = |q: &[f64], p: &[f64; 3]| {
        let turn = nalgebra::Rotation3::new(Vector3::new(q[0], q[1], q[2]) / 50.0);
        let row = |i: usize| vec![turn[(i, 0)], turn[(i, 1)], turn[(i, 2)], p[i]];
        [q.to_vec(), row(0), row(1), row(2), vec![0.0, 0.0, 0.0, 1.0]].concat()
    };
    let table = text("# joints[:ndof], pose[-16:]", &rows, ",", matrix);
    same(&source(&[&folder.file("matrix.csv", table)]).read(&robot).expect("matrix").0, &rows, "matrix");
    // A remark between the names and the numbers takes no names away.
    let table = text(&format!("{NAMES}\n# Monday, in the hall"), &rows, ",", joined);
    let (found, said) = source(&[&folder.file("remark.csv", table)]).read(&robot).expect("remark");
    same(&found, &rows, "remark");
    assert!(said[0].contains("joints from A1 to A6"), "{said:?}");
    // Names that belong to fewer columns are not passed over.
    let table = text("# x,y,z", &rows, ",", joined);
    refused(&source(&[&folder.file("names.csv", table)]), &robot, &["3 names for 9 columns"]);
}

#[test]
fn a_second_table_is_said_with_its_place() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let table = text(NAMES, &rows, ",", joined);
    let again = format!("{table}\n{table}");
    refused(&source(&[&folder.file("again.csv", again)]), &robot, &["again.csv:33", "a second table begins here"]);
    let below = format!("{table}Second series,,,,,,,,\n{table}");
    refused(&source(&[&folder.file("below.csv", &below)]), &robot, &["below.csv:33", "a second table begins here"]);
    let book = crate::spreadsheet::xlsx(&[("Sheet1", below.as_str())]);
    refused(&source(&[&folder.file("below.xlsx", book)]), &robot, &["below.xlsx:33", "a second table begins here"]);
    let beside: String = table.lines().map(|line| format!("{line},,{line}\n")).collect();
    refused(&source(&[&folder.file("beside.csv", beside)]), &robot, &["beside the first, from column 11 on"]);
}

#[test]
fn sheets_with_texts_formulas_and_headings() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let table = text(NAMES, &rows, ",", joined);
    let sheet = |name: &str, text: &str| folder.file(name, crate::spreadsheet::xlsx(&[("Sheet1", text)]));
    let texts = written(NAMES, &rows, ",", |i, v| {
        if i < 6 { v.to_string() } else { format!("\"{}\"", v.to_string().replace('.', ",")) }
    });
    same(&source(&[&sheet("texts.xlsx", &texts)]).read(&robot).expect("texts").0, &rows, "texts");
    let column: String = table
        .lines()
        .enumerate()
        .map(
            |(i, l)| {
                if i == 0 { format!("{l}\n") } else { format!("{},=I{i}+0\n", l.rsplit_once(',').expect("cells").0) }
            },
        )
        .collect();
    let unsaved = ["hold a formula without its value", "save it"];
    refused(
        &source(&[&sheet("column.xlsx", &column)]),
        &robot,
        &[unsaved.as_slice(), &["30 cells", "column.xlsx:2"]].concat(),
    );
    let total = format!("{table}{}\n", ["=AVERAGE(A2:A31)"; 9].join(","));
    refused(
        &source(&[&sheet("total.xlsx", &total)]),
        &robot,
        &[unsaved.as_slice(), &["9 cells", "total.xlsx:32"]].concat(),
    );
    // A heading's unit is that of the columns below it.
    let heading = format!("Joints [rad],,,,,,Tracker [mm],,\n{table}");
    refused(&source(&[&sheet("heading.xlsx", &heading)]), &robot, &["call the joints (A1 [rad] to A6 [rad]) radians"]);
}

#[test]
fn files_that_are_no_tables_are_said_to_be() {
    let folder = Folder(workplace());
    let (robot, _) = world(1);
    let said = |name: &str, text: &str, parts: &[&str]| refused(&source(&[&folder.file(name, text)]), &robot, parts);
    said(
        "a.json",
        "{\"robot\": \"R\", \"poses\": [{\"q\": [1, 2]}, {\"q\": [3, 4]}], \"cameras\": [{\"f\": 1}]}",
        &["a JSON file", "json_normalize(json.load(open('a.json')), record_path=['poses']).to_csv"],
    );
    said(
        "frame.json",
        "{\"j1\": {\"0\": 1.5, \"1\": 2.5}, \"x\": {\"0\": 10.0, \"1\": null}}",
        &["a JSON file", "`import pandas; pandas.read_json('frame.json').to_csv"],
    );
    said("b.txt", "[{\"q\": 1}, {\"q\": 2}]", &["a JSON file", "json_normalize(json.load(open('b.txt')))"]);
    said("c.json", "{\"a\": {\"q\": 1}, \"b\": {\"q\": 2}}", &["list(json.load(open('c.json')).values())"]);
    said("d.json", "{\"q1\": [1, 2], \"x\": [3, 4]}", &["pandas.DataFrame(json.load(open('d.json')))"]);
    let record = |name: &str| format!("{name}:\n  joints:\n  - 0.5\n  - 0.25\n  pose:\n    x: 1.5\n    y: 2.5\n");
    said(
        "e.yaml",
        &format!("{}{}", record("'1593'"), record("'1594'")),
        &["a YAML file", "json_normalize(list(yaml.safe_load(open('e.yaml')).values()))"],
    );
    said("g.csv", "robot,poses\nR,\"[{'q': [1, 2]}, {'q': [3, 4]}]\"\n", &["no row of numbers", "`record_path`"]);
    let listed = "robot: R\nposes:\n- x: 1\n  joints:\n  - 2\n- x: 3\n  joints:\n  - 4\n";
    said("f.txt", listed, &["a YAML file", "json_normalize(yaml.safe_load(open('f.txt'))['poses'])"]);
}

#[test]
fn hints_count_the_columns_and_know_touches() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let alone = |name: &str| folder.file(name, text("", &rows, ",", |q, _| q.iter().map(|v| v.to_radians()).collect()));
    let second = "hint: another `--measurements FILE` joins the file that has them row by row";
    let touches = ["no columns of a measured point", second, "a touch", "`distance_mm` 0", "--known-distances"];
    refused(&source(&[&alone("a.csv")]), &robot, &touches);
    refused(&source(&[&alone("a.csv"), &alone("b.csv")]), &robot, &touches);
    let other =
        |q: &[f64], p: &[f64; 3]| [q.to_vec(), p.map(|v| (1e3 * v).sin()).to_vec(), vec![2.5, 3.5 + q[0]]].concat();
    let none = folder.file("none.csv", text("", &rows, ",", other));
    refused(
        &source(&[&none]),
        &robot,
        &[
            "hint: where the joint angles stand in a file of their own, a second `--measurements FILE` names it; else see",
            "of this robot; if it is, `--columns` names the 11 columns in their order: j1 to j6",
        ],
    );
    // What stands behind the columns that are named is not used.
    let more = |q: &[f64], p: &[f64; 3]| [joined(q, p), vec![q[0] / 7.0, p[0] / 3.0]].concat();
    let more = folder.file("more.csv", text("", &rows, ",", more));
    let columns = Some("j1,j2,j3,j4,j5,j6,x,y,z".to_owned());
    let (found, said) = Source { columns, ..source(&[&more]) }.read(&robot).expect("named");
    same(&found, &rows, "named");
    assert!(said[0].contains("not used: column 10, column 11"), "{said:?}");
}

#[test]
fn a_finger_is_not_the_end_of_an_arm() {
    let folder = Folder(workplace());
    let joint = |name: &str, kind: &str, parent: &str, child: &str| {
        format!(
            "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/><origin xyz=\"0.1 0 0.2\"/><axis xyz=\"0 1 0\"/></joint>\n"
        )
    };
    let links = ["l0", "l1", "l2", "l3", "hand", "hand_tcp", "left_finger", "right_finger"];
    let links: String = links.iter().map(|link| format!("<link name=\"{link}\"/>\n")).collect();
    let arm: String =
        (1..4).map(|n| joint(&format!("j{n}"), "revolute", &format!("l{}", n - 1), &format!("l{n}"))).collect();
    let hand = joint("mount", "fixed", "l3", "hand") + &joint("tcp", "fixed", "hand", "hand_tcp");
    let fingers = joint("f1", "prismatic", "hand", "left_finger") + &joint("f2", "prismatic", "hand", "right_finger");
    folder.file("arm.urdf", format!("<robot name=\"arm\">\n{links}{arm}{hand}{fingers}</robot>\n"));
    let read = stereocal(folder.0.path(), &["robot", "import", "arm.urdf", "--out", "arm"]);
    assert!(read.status.code() == Some(2) && stderr(&read).contains("`--tip hand_tcp`"), "{}", stderr(&read));
}

/// A controller's own point stands beside a reference instrument's.
#[test]
fn an_actual_point_beside_a_reference_is_asked_about() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let both = |q: &[f64], p: &[f64; 3]| [joined(q, p), vec![p[0] + 900.0, p[1] + 2.0 * (p[2]).sin(), p[2]]].concat();
    let of = |first: &str, second: &str| {
        let names = |word: &str| ["X", "Y", "Z"].map(|axis| format!("{axis}_{word}")).join(",");
        folder.file("two.csv", text(&format!("J1,J2,J3,J4,J5,J6,{},{}", names(first), names(second)), &rows, ",", both))
    };
    for (first, second) in
        [("act", "ref"), ("actual", "reference"), ("meas", "gt"), ("ref", "act"), ("truth", "measured")]
    {
        let first_taken = "`--columns j1,j2,j3,j4,j5,j6,x,y,z` takes the first";
        refused(&source(&[&of(first, second)]), &robot, &["two points would do", first_taken]);
    }
    for (first, second) in [("laser", "ref"), ("meas", "ref"), ("meas", "cmd"), ("act", "nominal"), ("tracker", "gt")] {
        let (found, said) = source(&[&of(first, second)]).read(&robot).unwrap_or_else(|e| panic!("{}", report(&e)));
        same(&found, &rows, &said[0]);
    }
    let encoder = of("encoder", "reference");
    refused(&source(&[&encoder]), &robot, &["where the robot was sent, or computed", "`--columns`"]);
}
