//! What recorders and logs leave: joints whose names stand in cells and in the order of the alphabet, lines that name
//! their lists, records of JSON, and figures below a table.

use super::*;

fn list(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
}

fn radians(q: &[f64]) -> Vec<f64> {
    q.iter().map(|v| v.to_radians()).collect()
}

fn metres(p: &[f64; 3]) -> Vec<f64> {
    p.iter().map(|v| v / 1000.0).collect()
}

/// A line for each row, made of its number, joints in rad and point in mm.
fn lines(rows: &Rows, line: impl Fn(usize, &[f64], &[f64; 3]) -> String) -> String {
    rows.iter().enumerate().map(|(i, (q, p))| line(i, &radians(q), p) + "\n").collect()
}

/// Six velocities, which have nothing to do with the readings.
fn velocities(row: usize) -> Vec<f64> {
    (0..6).map(|k| 0.1 * ((17 * row + 5 * k * k) as f64).sin()).collect()
}

/// Names of joints, and which joint each is of.
const RECORDED: [([&str; 6], [usize; 6]); 4] = [
    (
        ["elbow_joint", "shoulder_lift_joint", "shoulder_pan_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"],
        [2, 1, 0, 3, 4, 5],
    ),
    (["joint_6", "joint_1", "joint_2", "joint_3", "joint_5", "joint_4"], [5, 0, 1, 2, 4, 3]),
    (["joint_a3", "joint_a1", "joint_a2", "joint_a6", "joint_a5", "joint_a4"], [2, 0, 1, 5, 4, 3]),
    (["fr3_joint4", "fr3_joint1", "fr3_joint2", "fr3_joint3", "fr3_joint5", "fr3_joint6"], [3, 0, 1, 2, 4, 5]),
];

#[test]
fn joints_are_told_by_names_in_cells() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let points = folder.file("points.csv", text("x,y,z", &rows, ",", |_, p| p.to_vec()));
    let counted = |stem: &str| (0..6).map(|i| format!("{stem}{i}")).collect::<Vec<_>>().join(",");
    let header = ["field.name", "field.position", "field.velocity"].map(counted).join(",");
    for (names, order) in RECORDED {
        let message = |i: usize, q: &[f64]| {
            let positions: Vec<f64> = order.iter().map(|joint| q[*joint]).collect();
            format!("{},{},{}", names.join(","), list(&positions), list(&velocities(i)))
        };
        let first = |i: usize, q: &[f64]| format!("16090603{},{},1609060,,{}", 10 + i, i + 5, message(i, q));
        let second =
            |i: usize, q: &[f64]| format!("16090603{},76842{},base_link,{}", 10 + i, 37 * i + 100, message(i, q));
        let time = format!("%time,field.header.seq,field.header.stamp,field.header.frame_id,{header}");
        for (name, text, lacks) in [
            (
                "one.csv",
                format!("{time},x,y,z\n{}", lines(&rows, |i, q, p| format!("{},{}", first(i, q), list(p)))),
                false,
            ),
            ("one-joints.csv", format!("{time}\n{}", lines(&rows, |i, q, _| first(i, q))), true),
            ("two.csv", lines(&rows, |i, q, p| format!("{},{}", second(i, q), list(&metres(p)))), false),
            ("two-joints.csv", lines(&rows, |i, q, _| second(i, q)), true),
        ] {
            let file = folder.file(name, text);
            let files = if lacks { vec![&file, &points] } else { vec![&file] };
            let (found, said) =
                source(&files).read(&robot).unwrap_or_else(|e| panic!("{name} {names:?}: {}", report(&e)));
            same(&found, &rows, &format!("{name} {names:?}"));
            let joint = names[order.iter().position(|joint| *joint == 0).expect("the first joint")];
            assert!(said[0].contains(joint) && said[0].contains("in radians"), "{name}: {said:?}");
        }
    }
}

#[test]
fn names_in_lists_and_in_another_order_each_row() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let (names, order) = RECORDED[0];
    let turned = |i: usize, k: usize| (k + i) % 6;
    let named = |i: usize| (0..6).map(|k| format!("'{}'", names[turned(i, k)])).collect::<Vec<_>>().join(", ");
    let positions = |i: usize, q: &[f64]| list(&(0..6).map(|k| q[order[turned(i, k)]]).collect::<Vec<_>>());
    let line = |i: usize, q: &[f64], p: &[f64; 3]| format!("\"[{}]\",\"[{}]\",{}", named(i), positions(i, q), list(p));
    let file = folder.file("lists.csv", format!("name,position,x,y,z\n{}", lines(&rows, line)));
    same(&source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{}", report(&e))).0, &rows, "lists");
    // Names that tell nothing leave the order open, and this one is not the robot's.
    let unknown = |i: usize, q: &[f64], p: &[f64; 3]| {
        let line = line(6 * i, q, p);
        names.iter().zip(["one", "two", "three", "four", "five", "six"]).fold(line, |line, (a, b)| line.replace(a, b))
    };
    let file = folder.file("unknown.csv", format!("name,position,x,y,z\n{}", lines(&rows, unknown)));
    refused(&source(&[&file]), &robot, &["no name says which columns are the joints", "--columns"]);
}

#[test]
fn lines_of_a_log_name_their_lists() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let pose = |i: usize, p: &[f64; 3]| list(&[metres(p), velocities(i)[..3].to_vec()].concat());
    for (name, text) in [
        ("plain.txt", lines(&rows, |_, q, p| format!("q=[{}] p=[{}]", list(q), list(&metres(p))))),
        ("spaced.log", lines(&rows, |_, q, p| format!("q: [ {} ] tcp: [ {} ]", list(q), list(p)))),
        (
            "timed.txt",
            lines(&rows, |i, q, p| format!("2024-05-03 12:30:{:02}.125 INFO q={:?} xyz={:?}", i, q, metres(p))),
        ),
        ("pose.txt", lines(&rows, |i, q, p| format!("[{i}.5]: q = [{}], tcp = p[{}]", list(q), pose(i, p)))),
        ("below.txt", lines(&rows, |i, q, p| format!("12:30:{i:02}: q=[{}]\n12:31:{i:02}: p=[{}]", list(q), list(p)))),
        ("numbers.txt", lines(&rows, |_, q, p| format!("moved\nq=[{}] x={} y={} z={}", list(q), p[0], p[1], p[2]))),
    ] {
        let file = folder.file(name, text);
        let (found, said) = source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{name}: {}", report(&e)));
        same(&found, &rows, name);
        assert!(
            said[0].contains("joints from q_1 to q_6 in radians") && said[0].contains("lists of a log"),
            "{said:?}"
        );
        assert_eq!(said[0].contains("(30 lines hold none)"), name == "numbers.txt", "{said:?}");
    }
}

#[test]
fn records_of_json_are_rows() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let (names, order) = RECORDED[0];
    let quoted = names.map(|name| format!("\"{name}\"")).join(", ");
    let numbered = |q: &[f64]| (1..).zip(q).map(|(j, v)| format!("\"j{j}\": {v}")).collect::<Vec<_>>().join(", ");
    let point = |p: &[f64]| format!("\"x\": {}, \"y\": {}, \"z\": {}", p[0], p[1], p[2]);
    let degrees = |q: &[f64]| list(&q.iter().map(|v| v.to_degrees()).collect::<Vec<_>>());
    for (name, text) in [
        ("q", lines(&rows, |_, q, p| format!("{{\"q\": [{}], \"xyz\": [{}]}}", list(q), list(p)))),
        (
            "joints",
            lines(&rows, |i, q, p| {
                format!("{{\"t\": {i}.5, \"joints\": [{}], \"position\": [{}]}}", list(q), list(&metres(p)))
            }),
        ),
        ("flat", lines(&rows, |_, q, p| format!("{{{}, {}}}", numbered(q), point(p)))),
        (
            "nested",
            lines(&rows, |i, q, p| {
                let positions: Vec<f64> = order.iter().map(|joint| q[*joint]).collect();
                let state = format!(
                    "\"name\": [{quoted}], \"position\": [{}], \"velocity\": [{}]",
                    list(&positions),
                    list(&velocities(i))
                );
                format!("{{\"joint_state\": {{{state}}}, \"point\": {{{}}}}}", point(&metres(p)))
            }),
        ),
        (
            "units",
            lines(&rows, |i, q, p| {
                format!(
                    "{{\"id\": {i}, \"joints_deg\": [{}], \"tracker\": {{\"position_mm\": [{}]}}}}",
                    degrees(q),
                    list(p)
                )
            }),
        ),
    ] {
        let array = format!("[{}]", text.trim_end().replace('\n', ", "));
        let pretty = format!("[\n{}\n]\n", text.trim_end().replace('\n', ",\n").replace(", \"", ",\n  \""));
        for (form, text) in [("jsonl", text), ("json", array), ("txt", pretty)] {
            let file = folder.file(&format!("{name}.{form}"), text);
            let (found, said) =
                source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{name}.{form}: {}", report(&e)));
            same(&found, &rows, &format!("{name}.{form}"));
            assert!(said[0].contains("records of JSON"), "{name}.{form}: {said:?}");
        }
    }
    let lost = lines(&rows, |i, q, p| {
        let point = if i % 7 == 3 { "NaN".to_owned() } else { format!("[{}]", list(p)) };
        format!("{{\"q\": [{}], \"p\": {point}}}", list(q))
    });
    let (found, _) = source(&[&folder.file("lost.jsonl", lost)]).read(&robot).expect("lost");
    assert_eq!(found.iter().filter(|row| matches!(row.observed, Observed::Position { .. })).count(), 26);
}

#[test]
fn figures_below_a_table_are_no_measurements() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let column = |k: usize| rows.iter().map(move |(q, p)| joined(q, p)[k]);
    let means = |off: f64| {
        list(&(0..9).map(|k| ((column(k).sum::<f64>() / 30.0 + off) * 1e3).round() / 1e3).collect::<Vec<_>>())
    };
    let least = list(&(0..9).map(|k| column(k).fold(f64::INFINITY, f64::min)).collect::<Vec<_>>());
    let degrees = |before: &'static str| {
        move |(i, (q, p)): (usize, &(Vec<f64>, [f64; 3]))| format!("P{}{before},{}\n", i + 1, list(&joined(q, p)))
    };
    let table = |before: &'static str| rows.iter().enumerate().map(degrees(before)).collect::<String>();
    let plain = format!("pose,J1,J2,J3,J4,J5,J6,X,Y,Z\n{}", table(""));
    let own =
        format!("pose,group,role,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm\n{}", table(",1,sample"));
    for (name, text, figures) in [
        (
            "mean.csv",
            format!("{plain}Mittel,{}\n", means(0.0)),
            "1 row below the table left out, figures of the rows above: line 32 `Mittel` (mean)",
        ),
        (
            "two.csv",
            format!("{plain}\nfoo,{}\nbar,{least}\n", means(0.0)),
            "line 33 `foo` (mean), line 34 `bar` (minimum)",
        ),
        ("own.csv", format!("{own}\u{5747}\u{503c},,,{}\n", means(0.0)), "line 32 `\u{5747}\u{503c}` (mean)"),
    ] {
        let file = folder.file(name, text);
        let (found, said) = source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{name}: {}", report(&e)));
        same(&found, &rows, name);
        assert!(said.iter().any(|said| said.contains(figures)), "{name}: {said:?}");
    }
    let other = folder.file("other.csv", format!("{plain}Mittel,{}\n", means(1.0)));
    refused(&source(&[&other]), &robot, &["other.csv:32", "is called `Mittel`", "remove the row"]);
    // Numbers are no mean by a name, and no name is one by itself.
    let named = folder.file("named.csv", plain.replace("P30,", "last,"));
    same(&source(&[&named]).read(&robot).expect("named").0, &rows, "named");
}

#[test]
fn a_sample_that_a_logger_lost_is_left_out() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    for (nothing, what) in [("nan", "1 row"), ("", "1 row"), ("NaN", "2 rows")] {
        let lost = |i: usize| i == 12 || i == 20 && what == "2 rows";
        let row = |(i, line): (usize, &str)| match lost(i) {
            true => [nothing; 9].join(",") + "\n",
            false => format!("{line}\n"),
        };
        let body: String = text("", &rows, ",", joined).lines().enumerate().map(row).collect();
        let file = folder.file("lost.csv", format!("J1,J2,J3,J4,J5,J6,X,Y,Z\n{body}"));
        let (found, said) = source(&[&file]).read(&robot).unwrap_or_else(|e| panic!("{nothing}: {}", report(&e)));
        let read: Rows = rows.iter().enumerate().filter(|(i, _)| !lost(*i)).map(|(_, row)| row.clone()).collect();
        same(&found, &read, nothing);
        let expected = format!("{what} without joints and points left out: line");
        assert!(nothing.is_empty() || said.iter().any(|said| said.contains(&expected)), "{nothing}: {said:?}");
    }
    // A row that has one of both is still one to mend.
    let body = text("", &rows, ",", joined).replacen(&rows[3].0[0].to_string(), "nan", 1);
    let file = folder.file("half.csv", format!("J1,J2,J3,J4,J5,J6,X,Y,Z\n{body}"));
    refused(&source(&[&file]), &robot, &["`J1` has no number"]);
}
