//! What programs and settings say of joints beside the table of their parameters.

use super::*;
use crate::geometry::Transform;

/// Six joints in lists.
const LISTS: &str = "alpha = [-pi/2, pi/2, 0, -pi/2, pi/2, 0]\na = [0, 0, 0.11, 0, 0, 0]\nd = [0.37, 0.14, 0, 0, 0, 0.21]\ntheta = [0, 0, -pi/2, 0, 0, 0]\n";

/// The same in rows.
const ROWS: &str = "# theta, d, a, alpha\ndh = [\n [0, 0.37, 0, -pi/2],\n [0, 0.14, 0, pi/2],\n [-pi/2, 0, 0.11, 0],\n [0, 0, 0, -pi/2],\n [0, 0, 0, pi/2],\n [0, 0.21, 0, 0],\n]\n";

#[test]
fn a_list_beside_the_parameters_says_which_joints_slide() {
    for which in [vec![2], vec![0, 2], vec![5], vec![0, 1, 2, 3, 4, 5], vec![]] {
        let expected: Vec<bool> = (0..6).map(|joint| which.contains(&joint)).collect();
        let list = |turns: &str, slides: &str, by: &str| {
            expected.iter().map(|s| if *s { slides } else { turns }).collect::<Vec<_>>().join(by)
        };
        let letters = list("R", "P", "");
        for kinds in [
            format!("type = [{}];", list("'r'", "'p'", ",")),
            format!("joint_types = [{}]", list("\"revolute\"", "\"prismatic\"", ", ")),
            format!("jointTypes = {{{}}};", list("'R'", "'P'", " ")),
            format!("sigma = [{}];", list("0", "1", " ")),
            format!("types = np.array([{}])", list("0", "1", ", ")),
            format!("char jointType[6] = {{{}}};", list("'R'", "'P'", ", ")),
            format!("std::vector<Kind> types = {{{}}};", list("Kind::Revolute", "Kind::Prismatic", ", ")),
            format!("jointType = '{letters}';"),
        ] {
            for table in [LISTS, ROWS] {
                for text in [format!("{table}{kinds}\n"), format!("{kinds}\n{table}")] {
                    assert_eq!(one("arm.py", &text).slides, expected, "{text}");
                }
            }
        }
    }
}

#[test]
fn lists_of_kinds_of_other_joints_are_refused_and_other_lists_are_none() {
    for (kinds, word) in [
        ("joint_types = ['R', 'R', 'P']", "of 3 joints whether they slide, but 6 rows"),
        ("joint_types = ['R', 'R', 'P', 'R', 'R', 'R', 'R']", "of 7 joints"),
        ("joint_types = ['R'] * 2 + ['P'] + ['R'] * 3", "write the list out"),
    ] {
        for table in [LISTS, ROWS] {
            let said = said("arm.py", &format!("{table}{kinds}\n"));
            assert!(said.contains(word) && said.contains("joint_types"), "{said}");
        }
    }
    for other in
        ["sigma = [0.1, 0.2, 0.3]", "sigma = [0, 1]", "type = 'modified'", "joint_types = ['R'] * 6", "kinds = 3"]
    {
        for table in [LISTS, ROWS] {
            assert_eq!(one("arm.py", &format!("{table}{other}\n")).slides, [false; 6], "{other}");
        }
    }
    let calls = "L(1) = Link([0 0.3 0 pi/2 0]);\nL(2) = Link([0 0 0.4 0 1]);\nL(3) = Link([0 0 0.2 0 0]);\n";
    assert_eq!(one("arm.m", &format!("{calls}type = 'RPR';\n")).slides, [false, true, false]);
    assert!(said("arm.m", &format!("{calls}type = 'RRP';\n")).contains("says of other joints"));
}

/// Links of a dictionary: the first `joints` in its list, the others by name.
fn dictionary(joints: usize, named: &[&str]) -> String {
    let link = |k: usize| {
        format!("{{\"alpha\": {}, \"a\": 0.{k}, \"d\": 0.{}, \"theta\": 0.{}}}", ["pi/2", "0"][k % 2], k + 1, k % 3)
    };
    let list: Vec<String> = (0..joints).map(link).collect();
    let named: String = named.iter().zip(joints..).map(|(name, k)| format!(",\n \"{name}\": {}", link(k))).collect();
    format!("{{\"dh_params\": [\n {}\n]{named}\n}}\n", list.join(",\n "))
}

#[test]
fn a_link_that_is_a_tool_by_its_name_holds_still() {
    let at = |found: &Reading| -> Transform {
        let robot = found.robot("arm", Convention::Modified);
        let q: Vec<f64> = (0..robot.joints.len()).map(|k| 0.2 + 0.1 * k as f64).collect();
        robot.root_from_flange(&q)
    };
    for (joints, tools) in
        [(3, vec!["tool_frame"]), (6, vec!["flange"]), (6, vec!["ee"]), (4, vec!["flange", "end_effector"])]
    {
        let found = one("arm.json", &dictionary(joints, &tools));
        assert_eq!((found.rows.len(), found.flange.len(), found.ends_said.len()), (joints, tools.len(), tools.len()));
        assert!(found.ends_said[0].contains(&format!("`{}`", tools[0])), "{:?}", found.ends_said);
        // As all joints, those of the tool at zero.
        let mut all = one("arm.json", &dictionary(joints + tools.len(), &[]));
        all.flange = all.rows.split_off(joints);
        all.limits_deg.truncate(joints);
        let apart = at(&found).inverse() * at(&all);
        assert!(apart.translation.vector.norm() < 1e-9 && apart.rotation.angle() < 1e-9);
    }
    // Names of joints, a word that it turns, and a variable.
    assert_eq!(one("arm.json", &dictionary(3, &["wrist"])).rows.len(), 4);
    let turns = dictionary(3, &["tool_frame"]).replace("{\"alpha\"", "{\"type\": \"revolute\", \"alpha\"");
    assert_eq!(one("arm.json", &turns).rows.len(), 4);
    let block = |names: [&str; 4]| -> String {
        let link = |name: &&str| format!("{name}:\n  alpha: 0\n  a: 0.3\n  d: 0.2\n  theta: 0\n");
        names.iter().map(link).collect()
    };
    for (names, joints, base) in [
        (["shoulder", "elbow", "wrist", "hand"], 4, 0),
        (["base", "elbow", "wrist", "hand"], 4, 0),
        (["base", "joint1", "joint2", "joint3"], 3, 1),
        (["base", "joint1", "joint2", "tool0"], 2, 1),
    ] {
        let found = one("arm.yaml", &block(names));
        assert_eq!((found.rows.len(), found.base.len()), (joints, base), "{names:?}");
    }
    let fixed = dictionary(4, &[]).replacen(
        "{\"alpha\": pi/2, \"a\": 0.2",
        "{\"type\": \"fixed\", \"alpha\": pi/2, \"a\": 0.2",
        1,
    );
    assert!(said("arm.json", &fixed).contains("row 3 holds still"));
}

#[test]
fn rows_that_name_no_variable_are_the_base_where_the_others_begin_with_the_first() {
    let rows = |first: usize, base: usize, tool: usize| -> String {
        let still = |n: usize| "[0, 0.1, 0.3, pi/2],\n".repeat(n);
        let joints: String = (first..first + 3).map(|k| format!("[q{k}, 0.{k}, 0, 0],\n")).collect();
        format!("# theta, d, a, alpha\ndh = [\n{}{joints}{}]\n", still(base), still(tool))
    };
    for (base, tool) in [(0, 0), (1, 0), (0, 1), (2, 1)] {
        for first in [0, 1] {
            let found = one("arm.py", &rows(first, base, tool));
            assert_eq!((found.rows.len(), found.base.len(), found.flange.len()), (3, base, tool), "{}", found.said);
            assert_eq!(found.said.contains("base before row"), base > 0, "{}", found.said);
        }
    }
    assert!(said("arm.py", &rows(2, 1, 0)).contains("this one does not turn"));
    // Rows of a base are passed before the joints.
    let (with, without) = (one("arm.py", &rows(1, 1, 0)), one("arm.py", &rows(1, 0, 0)));
    let at = |found: &Reading| found.robot("arm", Convention::Classic).root_from_flange(&[0.3, -0.2, 0.5]);
    let base = crate::robot::catalogue::from_rows("base", Convention::Classic, &with.base).root_from_flange(&[0.0]);
    let apart = at(&with).inverse() * base * at(&without);
    assert!(apart.translation.vector.norm() < 1e-9 && apart.rotation.angle() < 1e-9);
}

#[test]
fn limits_of_fewer_joints_than_rows_are_refused_with_both_counts() {
    let limits = |count: usize| "[-2, 2], ".repeat(count);
    for count in [6, 7, 8, 3] {
        let text = format!(
            "{}joint_limits = [{}]\n",
            dictionary(7, &[]).replace("{\"dh_params\"", "x = {\"dh_params\""),
            limits(count)
        );
        let found = of("arm.py", &text, Asked::default());
        assert_eq!(found.is_err(), count == 6, "{count}");
        if let Err(error) = found {
            let said = crate::diagnostic::report(&error);
            assert!(said.contains("`joint_limits` has 6 entries, but 7 rows are joints"), "{said}");
        }
    }
    for (limits, refused) in
        [("joint_limits = {'lower': [1, 2], 'upper': [3, 4]}", false), ("qlim = [1 2; 3 4; 5 6; 7 8; 9 10];", true)]
    {
        assert_eq!(of("arm.m", &format!("{LISTS}{limits}\n"), Asked::default()).is_err(), refused, "{limits}");
    }
    // Readings that the code names by number.
    let uses = |count: usize| (0..count).map(|k| format!("T = f(q[{k}])\n")).collect::<String>();
    for count in [3, 4, 5, 6, 7] {
        let found = one("arm.py", &format!("{LISTS}{}", uses(count)));
        assert_eq!(found.ends_said.len(), usize::from(count == 4 || count == 5), "{count} {:?}", found.ends_said);
    }
}

#[test]
fn two_lists_of_links_are_two_robots_and_offsets_apart_are_said() {
    let list = |name: &str, count: usize| {
        format!("{name} = [\n{}]\n", "  Part(alpha=0.0, a=0.4, d=0.1, theta=0.0),\n".repeat(count))
    };
    for (one_, other) in [(2, 2), (3, 6)] {
        let said = said("arm.py", &(list("links", one_) + &list("again", other)));
        let words = format!("2 lists of links (links, {one_} links from line 2; again, {other} links from line");
        assert!(said.contains(&words), "{said}");
    }
    assert_eq!(one("arm.py", &list("links", 3)).rows.len(), 3);
    let calls = "L(1) = Link([0 0.3 0 pi/2]);\nL(2) = Link([0 0 0.4 0]);\nL(3) = Link([0 0 0.2 0]);\n";
    for (offset, said) in [("0.3, 0, -1.2", true), ("0, 0, 0", false), ("0.3, 0", false)] {
        let found = one("arm.m", &format!("theta_offset = [{offset}];\n{calls}"));
        assert_eq!(found.ends_said.len(), usize::from(said), "{offset}");
    }
    // An example of fewer links beside a table.
    let table = "| alpha | a (m) | d (m) | theta |\n|---|---|---|---|\n| 0 | 0.4 | 0 | q1 |\n| 0 | 0.3 | 0 | q2 |\n| pi/2 | 0.2 | 0 | q3 |\n\n";
    let found = one("arm.md", &format!("{table}{}", list("    example", 2)));
    assert!(found.rows.len() == 3 && found.ends_said[0].contains("the 2 links from line"), "{:?}", found.ends_said);
    assert_eq!(one("arm.md", &format!("{table}{}", list("    arm", 4))).rows.len(), 4);
}

#[test]
fn readings_by_their_number_are_the_joints_variables() {
    let expected = [[90.0, 0.0, 0.0, 131.0], [0.0, -110.0, -90.0, 0.0], [0.0, -96.0, 0.0, 63.0]];
    let table = |q: &dyn Fn(usize) -> String| {
        format!(
            "// alpha a d theta\nm = {{\n {{M_PI/2, 0, 0.131, {}}},\n {{0, -0.11, 0, {} - M_PI/2}},\n {{0, -0.096, 0.063, {}}}\n}};\n",
            q(0),
            q(1),
            q(2)
        )
    };
    for name in ["q", "joints", "joint_angles", "theta", "jA", "self.q"] {
        for text in [
            table(&|k| format!("{name}[{k}]")),
            table(&|k| format!("{name}({})", k + 1)),
            table(&|k| format!("q{}", k + 1)),
        ] {
            let text = format!("double {name}[3] = {{0, 0, 0}};\n{text}").replace("double self.q[3] = {0, 0, 0};", "");
            let found = one("arm.cpp", &text);
            let close =
                |(row, expected): (&[f64; 4], &[f64; 4])| row.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9);
            assert!(found.rows.iter().zip(&expected).all(close), "{text} {:?}", found.rows);
        }
    }
    // Behind the last one the flange, and numbers that a list holds.
    let flange = table(&|k| format!("q[{k}]")).replace("}\n};", "},\n {0, 0, 0.107, 0}\n};");
    assert_eq!(one("arm.cpp", &flange).flange.len(), 1);
    let lengths = "double lengths[2] = {0.131, 0.063};\n".to_owned() + &table(&|k| format!("q[{k}]"));
    let lengths = lengths.replace(" 0.131, q", " lengths[0], q").replace(" 0.063, q", " lengths[1], q");
    assert_eq!(one("arm.cpp", &lengths).rows[2][3], 63.0);
    let unset =
        lengths.replace("double lengths[2] = {0.131, 0.063};\n", "lengths = read();\n").replace("lengths[1]", "0.063");
    assert!(said("arm.cpp", &unset).contains("lengths[0]"), "{}", said("arm.cpp", &unset));
}

#[test]
fn rows_of_a_transform_are_no_table() {
    let matrix = |rows: [&str; 4]| format!("T = [\n {}\n]\n\n", rows.map(|row| format!("[{row}],")).join("\n "));
    let identity = matrix(["1, 0, 0, 0", "0, 1, 0, 0", "0, 0, 1, 0.3", "0, 0, 0, 1"]);
    let turned = matrix(["0, -1, 0, 0.2", "0.6, 0, -0.8, 0", "0.8, 0, 0.6, 0", "0, 0, 0, 1"]);
    let formula = matrix(["1, 0, 0, 0", "0, ca, -sa, 0", "0, sa, ca, 0", "0, 0, 0, 1"]);
    for transform in [identity, turned, formula] {
        assert_eq!(one("arm.py", &(transform.clone() + ROWS)).rows.len(), 6, "{transform}");
        assert!(said("arm.py", &transform).contains("no Denavit-Hartenberg parameters"), "{transform}");
    }
    // A table whose last row looks like that, but whose others do not turn.
    let table = matrix(["0, 0.3, 0, 1", "0, 0, 1, 0.2", "0, 0, 0.25, 0", "0, 0, 0, 1"]);
    assert!(all_of("arm.py", &table) > 0);
}

fn all_of(name: &str, text: &str) -> usize {
    of(name, text, Asked::default()).map_or(0, |found| found.len())
}

#[test]
fn lists_of_a_structure_and_tables_without_theta() {
    let structure =
        "DH.alpha(1:3) = [-pi/2, pi/2, 0];\nDH.a(1:3) = [0, 0.2, 0.3];\nDH.d(1:3) = [0.4, 0, 0];\nDH.theta(1:3) = 0;\n";
    let plain = "alpha = [-pi/2, pi/2, 0];\na = [0, 0.2, 0.3];\nd = [0.4, 0, 0];\n";
    assert_eq!(one("arm.m", structure).rows, one("arm.m", plain).rows);
    assert_eq!(one("arm.m", &structure.replace("theta(1:3) = 0", "theta(1:3) = pi/2")).rows[1][2], 90.0);
    let two = structure.to_owned() + &structure.replace("DH.", "left.");
    assert!(said("arm.m", &two).contains("lists of several robots stand here, `DH` and `left`"));
    // Without theta.
    let rows = "0.0, pi/2, 0.15\n-0.42, 0, 0\n0, -pi/2, 0.1\n";
    let table =
        format!("joint,a,alpha,d\n{}", rows.lines().zip(1..).map(|(r, k)| format!("{k},{r}\n")).collect::<String>());
    let found = one("dh.csv", &table);
    assert!(
        found.rows == [[90.0, 0.0, 0.0, 150.0], [0.0, -420.0, 0.0, 0.0], [-90.0, 0.0, 0.0, 100.0]],
        "{:?}",
        found.rows
    );
    assert!(found.said.contains("no column of theta"), "{}", found.said);
    let tuples: String = rows.lines().map(|row| format!("    ({row}),\n")).collect();
    let columns = |columns| Asked { columns: Some(columns), ..Asked::default() };
    for (text, asked) in [
        (format!("dh = [\n{tuples}]\n"), columns("a,alpha,d")),
        (format!("dh = [\n{tuples}]\ngrip = np.array([0, 0, 0.12])\n"), columns("a,alpha,d")),
        (format!("# rows of {{a, alpha, d}}\ndh = [\n{tuples}]\n"), Asked::default()),
    ] {
        assert_eq!(of("arm.py", &text, asked).unwrap()[0].rows, found.rows, "{text}");
    }
    let four = tuples.replace(" (-0.42", " (0.3, 0, 0.2),\n    (-0.42");
    assert!(said("arm.py", &format!("dh = [\n{four}]\n")).contains("--columns a,alpha,d"));
    for other in ["phi", "zero"] {
        assert!(
            said("dh.csv", &table.replace("joint,", &format!("{other},")).replace("\n1,", "\n7,"))
                .contains("no column `theta_deg`")
        );
    }
    // A column of that index is no call.
    let header = "Link(i) | alpha(i-1) | a(i-1) | d(i) | q(i)\n--- | --- | --- | --- | ---\n1 | 0 | 0 | 0.7 | q1\n2 | -pi/2 | 0.3 | 0 | q2 - pi/2\n3 | 0 | 1.2 | 0 | q3\n4 | pi/2 | 0.2 | 0 | q4\n";
    assert_eq!(one("arm.md", header).rows.len(), 4);
}

#[test]
fn cells_with_units_and_letters_of_axes_are_read() {
    let table = "theta,d,a,alpha\nq1,0.35m,0,90deg\nq2,0,0.2m,0\nq3,0.1 m,0,-90deg\n";
    let expected = vec![[90.0, 0.0, 0.0, 350.0], [0.0, 200.0, 0.0, 0.0], [-90.0, 0.0, 0.0, 100.0]];
    assert_eq!(one("dh.csv", table).rows, expected);
    let millimetres = table.replace("0.35m", "350mm").replace("0.2m", "200mm").replace("0.1 m", "100 mm");
    assert_eq!(one("dh.csv", &millimetres).rows, expected);
    for (old, new) in [("0.1 m", "100mm"), ("0.1 m", "0.1"), ("theta,d,", "theta,d [mm],")] {
        assert!(said("dh.csv", &table.replace(old, new)).contains("whose unit is m"), "{old} {new}");
    }
    // KUKA's axes, one counted the other way, one with a blank before its offset.
    let kuka = "No Theta a d alpha\n1 -A1 210 650 -90\n2 A2 640 0 0\n3 A3 -90 -30 0 90\n4 A4 0 -610 -90\n";
    let found = one("dh.txt", kuka);
    assert_eq!(found.rows.iter().map(|row| row[2]).collect::<Vec<_>>(), [0.0, 0.0, -90.0, 0.0]);
    assert_eq!(found.flipped, [true, false, false, false]);
    assert_eq!(one("dh.txt", &kuka.replace("-A1", "A1").replace("A3 -90", "A3-90")).flipped, [false; 4]);
    // d of a joint that slides, and of one that does not.
    let slides = "type,theta,d,a,alpha\nR,q1,310,0,0\nR,q2,0,250,180\nP,0,d3 + 40,0,0\n";
    let found = one("dh.csv", slides);
    assert_eq!((found.rows[2][3], found.slides[2]), (40.0, true));
    assert_eq!(one("dh.csv", &slides.replace("d3 + 40", "40 - d3")).flipped, [false, false, true]);
    assert!(said("dh.csv", &slides.replace("P,0,", "R,q3,")).contains("`d3 + 40` is not a number"));
}
