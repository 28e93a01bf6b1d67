//! What owners of tables leave for the reader to find out: names of two words between blanks, numbers of reflectors and
//! of places, transforms one below the other; and robots as tables of formulas and in the text of programs.

use super::*;

fn program(rows: &Rows) -> String {
    let target = |(i, (q, _)): (usize, &(Vec<f64>, [f64; 3]))| {
        let numbers: Vec<String> = q.iter().map(f64::to_string).collect();
        format!("MoveAbsJ j{i} := {{{}}};\n", numbers.join(","))
    };
    rows.iter().enumerate().map(target).collect()
}

#[test]
fn names_of_two_words_between_blanks_are_one_name_and_columns_help_where_names_do_not_fit() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let joints = folder.file("joints.txt", program(&rows));
    let line = |(i, (_, p)): (usize, &(Vec<f64>, [f64; 3]))| {
        let [x, y, z] = p;
        format!("P{i} {} {} {} {x} {y} {z} 0.1\n", x + 0.3 * x.sin(), y + 0.3 * y.sin(), z + 0.3 * z.sin())
    };
    let table: String = rows.iter().enumerate().map(line).collect();
    let header = "Name Nominal X Nominal Y Nominal Z Measure X Measure Y Measure Z Residuals Pos\n";
    let points = folder.file("points.txt", format!("{header}{table}"));
    let (found, said) = source(&[&joints, &points]).read(&robot).expect("both");
    same(&found, &rows, "two words");
    assert!(said[0].contains("points from Measure X to Measure Z of points.txt"), "{said:?}");
    // Names that belong to no columns are an error, until the columns are named.
    let odd = folder.file("odd.txt", format!("one two three four five\n{table}"));
    refused(&source(&[&joints, &odd]), &robot, &["5 names for 8 columns", "--columns"]);
    let columns = Some("j1,j2,j3,j4,j5,j6,-,-,-,-,x,y,z".to_owned());
    let named = Source { files: vec![joints, odd], columns, units: None };
    same(&named.read(&robot).expect("named").0, &rows, "named");
}

#[test]
fn a_point_that_nobody_filled_in_is_none() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    for (name, blank) in [("empty.csv", ",,"), ("nan.csv", "nan,nan,nan")] {
        let mut table = "q1,q2,q3,q4,q5,q6,x1,y1,z1,xb,yb,zb\n".to_owned();
        for (q, [x, y, z]) in &rows {
            let joints: Vec<String> = q.iter().map(f64::to_string).collect();
            let _ = writeln!(table, "{},{x},{y},{z},{blank}", joints.join(","));
        }
        let (found, said) = source(&[&folder.file(name, table)]).read(&robot).expect("one point");
        same(&found, &rows, name);
        assert!(!said[0].contains("xb to zb") && !said[0].contains("targets"), "{said:?}");
    }
}

/// Rows of one reflector each, in turn, their distances from the first one times `size`.
fn in_turn(rows: &Rows, size: f64) -> Vec<(usize, [f64; 3])> {
    let all = of_reflectors(rows);
    let one = |(i, p): (usize, &Vec<f64>)| {
        let k = (i * i + i / 5) % 3;
        (k, std::array::from_fn(|axis| p[axis] + size * (p[3 * k + axis] - p[axis])))
    };
    all.iter().enumerate().map(one).collect()
}

#[test]
fn a_column_that_sets_rows_apart_is_asked_about() {
    let folder = Folder(workplace());
    let (robot, rows) = world(60);
    let file = |name: &str, size: f64, number: &dyn Fn(usize, usize) -> String| {
        let measured = in_turn(&rows, size);
        let mut table = String::new();
        for (i, ((q, _), (k, p))) in rows.iter().zip(&measured).enumerate() {
            let cells: Vec<String> = q.iter().map(f64::to_string).collect();
            let _ = writeln!(table, "{},{},{},{},{}", cells.join(","), number(i, *k), p[0], p[1], p[2]);
        }
        folder.file(name, table)
    };
    let reflector = |_: usize, k: usize| (k + 1).to_string();
    for size in [1.0, 0.5] {
        let table = file("reflectors.csv", size, &reflector);
        refused(
            &source(&[&table]),
            &robot,
            &[
                "`column 7` (1, 2, 3) sets the rows apart",
                "j1,j2,j3,j4,j5,j6,target,x,y,z",
                "j1,j2,j3,j4,j5,j6,group,x,y,z",
            ],
        );
        let columns = Some("j1,j2,j3,j4,j5,j6,target,x,y,z".to_owned());
        let (found, said) = Source { files: vec![table], columns, units: None }.read(&robot).expect("named");
        assert!(found.len() == 60 && said[0].contains("which the nominal robot confirms"), "{said:?}");
        assert!(found.iter().zip(in_turn(&rows, size)).all(|(row, (k, _))| row.target == (k + 1).to_string()));
    }
    // Words do as well, and numbers that set nothing apart raise no question.
    let words = file("words.csv", 1.0, &|_, k| ["top", "left", "right"][k].to_owned());
    refused(&source(&[&words]), &robot, &["(left, right, top) sets the rows apart"]);
    for (name, size, number) in [
        ("alike.csv", 0.0, &reflector as &dyn Fn(usize, usize) -> String),
        ("halves.csv", 0.0, &|i, _| (i / 30).to_string()),
        ("near.csv", 0.01, &reflector),
    ] {
        let said =
            source(&[&file(name, size, number)]).read(&robot).unwrap_or_else(|e| panic!("{name}: {}", report(&e)));
        assert!(said.1[0].contains("points from columns 8 to 10"), "{name}: {:?}", said.1);
    }
}

#[test]
fn places_of_the_robot_are_asked_about_and_confirmed_one_at_a_time() {
    let folder = Folder(workplace());
    let (robot, rows) = world(60);
    let moved = |row: usize, p: &[f64; 3]| [p[0], p[1] + 400.0 * (row % 4) as f64, p[2]];
    let line = |(i, (q, p)): (usize, &(Vec<f64>, [f64; 3]))| {
        let cells: Vec<String> = [q.as_slice(), &moved(i, p)].concat().iter().map(f64::to_string).collect();
        format!("{},{}\n", cells.join(","), 500 * (i % 4))
    };
    let table: String = rows.iter().enumerate().map(line).collect();
    let file = folder.file("rail.csv", format!("J1,J2,J3,J4,J5,J6,X,Y,Z,E\n{table}"));
    refused(&source(&[&file]), &robot, &["`E` (0, 1000, 1500, 500) sets the rows apart", "j6,x,y,z,group"]);
    let columns = Some("j1,j2,j3,j4,j5,j6,x,y,z,group".to_owned());
    let (found, said) = Source { files: vec![file], columns, units: None }.read(&robot).expect("named");
    assert!(found[3].at.group == "1500" && said[0].contains("which the nominal robot confirms"), "{said:?}");
}

#[test]
fn flags_that_are_named_keep_the_names_of_poses() {
    let folder = Folder(workplace());
    let (robot, rows) = world(36);
    let all = of_reflectors(&rows);
    let cells = |cells: &[f64]| cells.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    let mut table = "pose,SMR,j1,j2,j3,j4,j5,j6,x,y,z\n".to_owned();
    for (i, ((q, _), points)) in rows.iter().zip(&all).enumerate() {
        for k in 0..3 {
            let _ = writeln!(table, "p{i},{},{},{}", ["A", "B", "C"][k], cells(q), cells(&points[3 * k..3 * k + 3]));
        }
    }
    let file = folder.file("smr.csv", table);
    let columns = "pose,target,j1,j2,j3,j4,j5,j6,x,y,z";
    // As places these rows would have one pose at several of them.
    let as_target = format!("`--columns {columns}` if");
    refused(&source(&[&file]), &robot, &[&as_target, "`--columns -,group,j1,j2,j3,j4,j5,j6,x,y,z` if"]);
    let named = Source { files: vec![file], columns: Some(columns.to_owned()), units: None };
    let (found, said) = named.read(&robot).expect("named");
    assert!(found.len() == 108 && found[4].at.pose == "p1" && found[4].target == "B", "{:?}", found[4]);
    assert!(!said[0].contains("pose = row"), "{said:?}");
    let moved = |(i, (q, [x, y, z])): (usize, &(Vec<f64>, [f64; 3]))| {
        let k = i % 3;
        format!("p{i},{k},{},{}\n", cells(q), cells(&[*x, y + 400.0 * k as f64, *z]))
    };
    let places: String = rows.iter().enumerate().map(moved).collect();
    let file = folder.file("places.csv", format!("pose,E,J1,J2,J3,J4,J5,J6,X,Y,Z\n{places}"));
    refused(&source(&[&file]), &robot, &["`--columns pose,group,j1,j2,j3,j4,j5,j6,x,y,z` if"]);
}

#[test]
fn rows_have_the_names_of_the_table() {
    let folder = Folder(workplace());
    let (robot, rows) = world(20);
    let numbers = text("", &rows, ",", joined);
    let file = |head: &str, name: &dyn Fn(usize) -> String| {
        let lines: String = numbers.lines().enumerate().map(|(i, line)| format!("{},{line}\n", name(i))).collect();
        folder.file("named.csv", format!("{head},J1,J2,J3,J4,J5,J6,X,Y,Z\n{lines}"))
    };
    let named = |head: &str, name: &dyn Fn(usize) -> String| {
        let (found, said) = source(&[&file(head, name)]).read(&robot).expect(head);
        (found[3].at.pose.clone(), said[0].clone())
    };
    let words = |i: usize| format!("Pose left {}", i + 1);
    for head in ["Name", "Point ID"] {
        let (pose, said) = named(head, &words);
        assert!(pose == "Pose left 4" && said.contains(&format!("; pose = {head}")), "{pose}: {said}");
    }
    // A remark, a name that comes again, one that is lacking, and a column that a flag skips.
    let lacking = |i: usize| if i == 7 { String::new() } else { words(i) };
    for (head, name) in
        [("Remark", &words as &dyn Fn(usize) -> String), ("Name", &|i| words(i / 2)), ("Name", &lacking)]
    {
        let (pose, said) = named(head, name);
        assert!(pose == "4" && said.contains("; pose = row"), "{head}: {pose}: {said}");
    }
    let columns = Some("-,j1,j2,j3,j4,j5,j6,x,y,z".to_owned());
    let skipped = Source { files: vec![file("Name", &words)], columns, units: None };
    assert_eq!(skipped.read(&robot).expect("skipped").0[3].at.pose, "4");
}

#[test]
fn orientations_in_other_forms_are_said_to_be_none_that_are_read() {
    let folder = Folder(workplace());
    let (robot, rows) = world(20);
    let said = |more: &str| {
        let count = more.split(',').count();
        let line = |q: &[f64], p: &[f64; 3]| {
            [q.to_vec(), p.to_vec(), (0..count).map(|k| (q[0] + k as f64).sin()).collect()].concat()
        };
        let table = text(&format!("J1,J2,J3,J4,J5,J6,X,Y,Z,{more}"), &rows, ",", line);
        source(&[&folder.file("turned.csv", table)]).read(&robot).expect(more).1[0].clone()
    };
    for more in ["qw,qx,qy,qz", "r11,r12,r13,r21,r22,r23,r31,r32,r33", "Rx [deg],Ry [deg],Rz [deg]"] {
        assert!(said(more).contains(" (an orientation is read from rx_rad, ry_rad, rz_rad"), "{more}: {}", said(more));
    }
    for more in ["rms,temp", "rx_rad,ry_rad,rz_rad"] {
        assert!(!said(more).contains("an orientation is"), "{more}: {}", said(more));
    }
}

#[test]
fn transforms_one_below_the_other_are_a_row_each() {
    let folder = Folder(workplace());
    let (robot, rows) = world(30);
    let joints = folder.file("joints.txt", text("", &rows, "\t", |q, _| q.to_vec()));
    let turn = |i: usize| transform(Vector3::new(0.1 * i as f64, -0.4, 0.2), Vector3::zeros()).to_homogeneous();
    let one = |(i, (_, p)): (usize, &(Vec<f64>, [f64; 3]))| -> String {
        let m = turn(i);
        let row = |r: usize| format!("{} {} {} {}\n", m[(r, 0)], m[(r, 1)], m[(r, 2)], p[r]);
        format!("{}{}{}0 0 0 1\n", row(0), row(1), row(2))
    };
    let poses: String = rows.iter().enumerate().map(one).collect();
    let file = folder.file("poses.txt", &poses);
    same(&source(&[&joints, &file]).read(&robot).expect("poses").0, &rows, "poses");
    // A lost line makes rows of something else.
    let cut = folder.file("cut.txt", poses.split_once('\n').expect("lines").1);
    refused(&source(&[&joints, &cut]), &robot, &["joints.txt has 30 rows, cut.txt has 119 rows"]);
}

#[test]
fn a_robot_of_formulas_or_of_a_program_is_the_one_of_numbers() {
    let folder = Folder(workplace());
    let at = |arguments: &[&str]| stereocal(Path::new(folder.0.path()), arguments);
    let flanges = |out: &str| -> Vec<Point3<f64>> {
        let path = Utf8PathBuf::from_path_buf(folder.0.path().join(out).join("robot.toml")).expect("UTF-8");
        let robot = stereocal::robot::file::read(&path).expect("a robot");
        let joints = |k: usize| (0..4).map(|j| (k as f64 + 0.7 * j as f64).sin()).collect::<Vec<f64>>();
        (0..5).map(|k| Point3::from(robot.base_from_flange(&joints(k)).translation.vector)).collect()
    };
    folder.file("numbers.csv", "alpha_deg,a_mm,theta_deg,d_mm\n90,0,0,310\n0,-520,-90,0\n-90,0,0,105\n0,0,0,90\n");
    folder.file(
        "formulas.md",
        "| joint | \u{3b8} | d (m) | a (m) | \u{3b1} |\n|---|---|---|---|---|\n| 1 | q1 | 0.31 | 0 | pi/2 |\n| 2 | q2-pi/2 | 0 | -0.52 | 0 |\n| 3 | q3 | 0.105 | 0 | -pi/2 |\n| 4 | q4 | 0.09 | 0 | 0 |\n",
    );
    folder.file(
        "program.py",
        "from roboticstoolbox import RevoluteDH\nmm = 1e-3\nlinks = [RevoluteDH(d=310*mm, alpha=pi/2), RevoluteDH(a=-0.52, offset=-pi/2),\n RevoluteDH(d=0.105, alpha=-np.pi/2), RevoluteDH(d=0.09)]\n",
    );
    let classic = at(&["robot", "import", "numbers.csv", "--dh", "classic", "--out", "numbers"]);
    assert!(classic.status.success(), "{}", stderr(&classic));
    for file in ["numbers.csv", "formulas.md", "program.py"] {
        let read = at(&["robot", "import", file, "--out", file.split_once('.').expect("a name").1]);
        assert!(read.status.success() && stderr(&read).contains("classic convention"), "{file}: {}", stderr(&read));
    }
    // What became of its tool is said to those who want no notes, too.
    for (tool, said) in [("SE3(0, 0, 0.1)", "is part of the robot file's [flange]"), ("grip(3)", "is LEFT OUT")] {
        folder.file(
            "tool.py",
            format!(
                "r = DHRobot([RevoluteDH(d=0.3, alpha=pi/2), RevoluteDH(a=-0.5), RevoluteDH(d=0.1)], tool={tool})\n"
            ),
        );
        let read = at(&["robot", "import", "tool.py", "--out", "tool", "--force", "--quiet"]);
        let words = stderr(&read);
        assert!(
            words.contains("the tool of line 1") && words.contains(said) && !words.contains("convention"),
            "{words}"
        );
    }
    let expected = flanges("numbers");
    for out in ["csv", "md", "py"] {
        let most = flanges(out).iter().zip(&expected).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(most < 1e-9, "{out}: {most}");
    }
    folder.file("plane.csv", "alpha,a,d,theta\n0,0,310,0\n0,225,0,0\n0,0,20,0\n");
    let open = at(&["robot", "import", "plane.csv", "--out", "plane"]);
    assert!(open.status.code() == Some(2) && stderr(&open).contains("--dh classic"), "{}", stderr(&open));
}

#[test]
fn a_description_whose_declaration_does_not_stand_at_its_beginning_is_read() {
    let folder = Folder(workplace());
    let at = |arguments: &[&str]| stereocal(Path::new(folder.0.path()), arguments);
    let joint = |n: usize| {
        format!(
            "<joint name=\"j{n}\" type=\"revolute\"><parent link=\"l{}\"/><child link=\"l{n}\"/><origin xyz=\"0.1 0 0.2\"/><axis xyz=\"0 {} {}\"/></joint>\n",
            n - 1,
            n % 2,
            1 - n % 2
        )
    };
    let links: String = (0..4).map(|n| format!("<link name=\"l{n}\"/>\n")).collect();
    let body = format!("<robot name=\"arm\">\n{links}{}</robot>\n", (1..4).map(joint).collect::<String>());
    let mut said = Vec::new();
    for (name, head) in [
        ("a", ""),
        ("b", "<?xml version=\"1.0\" ?>\n"),
        ("c", "\n<?xml version=\"1.0\" ?>\n"),
        ("d", "\u{feff}\n\n<?xml version=\"1.0\"\n?>\n"),
    ] {
        folder.file(&format!("{name}.urdf"), format!("{head}{body}"));
        let read = at(&["robot", "import", &format!("{name}.urdf"), "--out", name]);
        assert!(read.status.success(), "{name}: {}", stderr(&read));
        said.push(std::fs::read_to_string(folder.0.path().join(name).join("robot.toml")).expect("a robot"));
    }
    let plain =
        |text: &String| text.lines().filter(|line| !line.starts_with('#')).map(str::to_owned).collect::<Vec<_>>();
    assert!(said.iter().all(|text| plain(text) == plain(&said[0])));
    // A line is that of the file.
    folder.file(
        "bad.urdf",
        format!(
            "\n<?xml version=\"1.0\" ?>\n{}",
            body.replace("</robot>", "<joint name=\"x\" type=\"revolute\"/></robot>")
        ),
    );
    let bad = at(&["robot", "import", "bad.urdf", "--out", "bad"]);
    assert!(bad.status.code() == Some(2) && stderr(&bad).contains("bad.urdf:11"), "{}", stderr(&bad));
}

/// The figures of a robot whose file has no tool are those of its absence: that is said, and nothing of one that has
/// it.
#[test]
fn verify_says_which_tool_a_robot_asks_for() {
    let folder = Folder(workplace());
    let rows = world(40).1;
    folder.file("m.csv", text("J1,J2,J3,J4,J5,J6,X,Y,Z", &rows, ",", joined));
    let at = |arguments: &[&str]| stereocal(Path::new(folder.0.path()), arguments);
    assert!(at(&["robot", "new", "paper"]).status.success());
    let drawn = std::fs::read_to_string(folder.0.path().join("out/robot.toml")).expect("a robot");
    let (links, _) = drawn.split_once("[tool]").expect("a tool");
    for ([x, y, z], is_asked) in [([0.0, 0.0, 0.0], true), ([40.0, -25.0, 110.0], false)] {
        folder.file("robot.toml", format!("{links}[tool]\nx_mm = {x:?}\ny_mm = {y:?}\nz_mm = {z:?}\n"));
        let said = stdout(&at(&["verify", "--measurements", "m.csv", "--robot", "robot.toml"]));
        assert_eq!(said.contains("robot.toml: with a tool of "), is_asked, "{said}");
    }
}

#[test]
fn columns_of_a_robots_table_may_begin_with_one_that_is_skipped() {
    let folder = Folder(workplace());
    folder.file("dh.csv", "5,90,0,310,0\n7,0,425,0,-90\n9,0,80,0,0\n");
    let arguments = ["robot", "import", "dh.csv", "--columns", "-,alpha,a,d,theta", "--dh", "classic"];
    let read = stereocal(Path::new(folder.0.path()), &arguments);
    assert!(read.status.success() && stdout(&read).contains("425.0000"), "{}", stderr(&read));
}
