use super::*;

const PI: f64 = std::f64::consts::PI;

type Row = [f64; 4];

fn rows(text: &str) -> (Vec<Row>, Option<Convention>) {
    let text = read(text, false).unwrap();
    let links = text.links.unwrap();
    let rows = links.rows.into_iter().map(|(_, row)| row.map(|v| v.number)).collect();
    let of_calls = links.calls.then_some(Convention::Classic);
    (rows, links.convention.map(|(c, _)| c).or(text.words.convention).or(of_calls))
}

fn table(text: &str) -> Result<Option<Matrix>, Wrong> {
    matrix(text, &read(text, false)?.known, 4)
}

fn close(found: &[Row], expected: &[Row]) -> bool {
    found.len() == expected.len()
        && found.iter().zip(expected).all(|(f, e)| f.iter().zip(e).all(|(a, b)| (a - b).abs() < 1e-12))
}

#[test]
fn links_of_programs_and_settings() {
    let expected = [[PI / 2.0, 0.0, 0.0, 0.33], [0.0, 0.27, -PI / 2.0, 0.0], [-PI / 2.0, -0.06, 0.0, 0.0]];
    let python = "from roboticstoolbox import RevoluteDH, PrismaticDH\n\"\"\"alpha: the twist, d = offset\"\"\"\nmm = 1e-3\nl2 = 270 * mm # a2\n\
                  links = [\n RevoluteDH(d=330*mm, alpha=np.pi/2, qlim=np.deg2rad([-165, 165])),\n \
                  RevoluteDH(a=l2, qlim=[-1, 1], offset=-np.pi / 2),\n RevoluteDH(alpha=-pi/2, a=-0.06)]\n";
    let matlab = "L(1) = Link('d', 0.33, 'a', 0, 'alpha', pi/2); % base\nL(2)=Link('d',0,'a',0.27,'alpha',0,'offset',-pi/2);\nL(3)=Link('d',0,'a',-0.06,'alpha',-pi/2);\n";
    let vectors =
        "L(1) = Link([0 0.33 0 pi/2]);\nL(2) = Link([-pi/2 0 0.27 0 0]);\nL(3) = Link([0, 0, -0.06, -pi/2, 0, 0]);\n";
    let flow = "links:\n - {a: 0, alpha: 1.5707963267948966, d: 0.33, theta: 0}\n - {a: 0.27, alpha: 0, d: 0, theta: -1.5707963267948966}\n - {a: -0.06, alpha: -1.5707963267948966, d: 0, theta: 0}\n";
    let block = "j1:\n  a: 0\n  alpha: pi/2\n  d: 0.33\n  theta: 0\nj2:\n  a: 0.27\n  alpha: 0\n  d: 0\n  theta: -pi/2\nj3:\n  a: -0.06\n  alpha: -pi/2\n  d: 0\n  theta: 0\n";
    let json = "{\"dh\": [{\"theta\": 0, \"d\": 0.33, \"a\": 0, \"alpha\": 1.5707963267948966},\n{\"theta\": -1.5707963267948966, \"d\": 0, \"a\": 0.27, \"alpha\": 0},\n{\"theta\": 0, \"d\": 0, \"a\": -0.06, \"alpha\": -1.5707963267948966}]}\n";
    let lists = "[DH]\na = [0.0, 0.27, -0.06]\nd = [0.33, 0, 0]\nalpha = [1.5707963267948966, 0, -1.5707963267948966]\ntheta = [0, -1.5707963267948966, 0]\n";
    let spaced =
        "function [a,d] = dh()\nalpha = [pi/2 0 -pi/2];\na = [0 0.27 -0.06];\nd = [0.33 0 0];\ntheta = [0 -pi/2 0];\n";
    for text in [python, matlab, vectors, flow, block, json, lists, spaced] {
        assert!(close(&rows(text).0, &expected), "{text}\n{:?}", rows(text));
    }
    assert_eq!(rows(python).1, Some(Convention::Classic));
    assert_eq!(rows(matlab).1, Some(Convention::Classic));
    assert_eq!(rows(&matlab.replace("pi/2);", "pi/2, 'modified');")).1, Some(Convention::Modified));
    assert_eq!(rows(&python.replace("RevoluteDH(", "RevoluteMDH(")).1, Some(Convention::Modified));
    assert_eq!(rows(lists).1, None);
}

#[test]
fn links_of_loops_over_lists_of_names_and_of_numbers() {
    let expected = [[0.0, 0.0, 0.0, 0.75], [-PI / 2.0, 0.35, -PI / 2.0, 0.0], [0.0, 1.25, 0.0, -0.05]];
    let loops = "a = [0, 0.35, 1.25]\nd = [0.75, 0, -0.05]\nalpha = [0, -pi/2, 0]\noffset = [0, -pi / 2, 0]\nfor j in range(3):\n    links.append(RevoluteMDH(d=d[j], a=a[j], alpha=alpha[j], r=com[j]))\n";
    let dictionary = "s = {alpha0: 0, a0: 0, d1: 0.75, q1: q1,\n alpha1: -pi/2, a1: 0.35, d2: 0, q2: q2 - pi/2,\n alpha2: 0, a2: 1.25, d3: -0.05, q3: q3}\n";
    let assigned = "alpha_0 = 0; a_0 = 0; d_1 = 750 * mm; theta_1 = 0;\nalpha_1 = -pi/2; a_1 = 0.35; d_2 = 0; theta_2 = -pi/2;\nalpha_2 = 0; a_2 = 1.25; d_3 = -0.05; theta_3 = 0;\n";
    for text in [loops.to_owned(), dictionary.to_owned(), format!("mm = 0.001;\n{assigned}")] {
        assert!(close(&rows(&text).0, &expected), "{text}\n{:?}", rows(&text));
        assert_eq!(rows(&text).1, Some(Convention::Modified), "{text}");
    }
    let named = "a1, a2, d1 = 0.35, 1.25, 0.75\nt = [RevoluteMDH(d=d1), RevoluteMDH(alpha=-pi/2, a=a1, offset=-pi/2), RevoluteMDH(a=a2, d=-0.05)]\n";
    assert!(close(&rows(named).0, &expected), "{:?}", rows(named));
}

#[test]
fn a_table_in_brackets_has_its_order_in_a_comment() {
    let body = "dh = np.array([\n    [0, -90, 10, 0],  # joint 1\n    [50, 0, 0, -90],\n    [0, -90, 5, 0]])\n";
    let found = table(&format!("# four parameters a row: [a, alpha, d, theta]\n{body}")).unwrap().unwrap();
    assert_eq!((found.rows.len(), found.rows[1].0), (3, 4));
    assert_eq!(found.names, Some(vec!["a", "alpha", "d", "theta"]));
    assert_eq!(table(body).unwrap().unwrap().names, None);
    let matlab = "%   a(i-1)  alpha(i-1)  d(i)  theta_offset\nDH = [0, 0, 77, 0;      % 1\n      0, -pi/2, 0, -pi/2; % 2\n      128, 0, 0, pi/2];\n";
    let found = table(matlab).unwrap().unwrap();
    assert_eq!((found.names, &found.rows[2].1[3]), (Some(vec!["a", "alpha", "d", "theta"]), "pi/2"));
    for words in [
        "twist length theta_i offset",
        "Link Twist, Link Length, Joint Angle, Link Offset",
        "twist (α), length (a), θ, offset (d)",
    ] {
        let found = table(&format!("{words}\n0 0 0 77\n-90 0 -90 0\n0 128 90 0\n")).unwrap().unwrap();
        assert_eq!(found.names, Some(vec!["alpha", "a", "theta", "d"]), "{words}");
    }
    for text in ["x = [1, 2, 3, 4]\n", ""] {
        assert_eq!(table(text), Ok(None), "{text}");
    }
}

#[test]
fn what_a_table_has_no_place_for_is_refused_with_its_line() {
    let wrong = |text: &str| read(text, false).unwrap_err();
    let two = "RevoluteDH(d=0.3, alpha=pi/2)\n";
    let slides = "x: {a: 0, d: 1, alpha: 2, moves: 'prismatic'}\ny: {a: 0, d: 1, alpha: 2}\n";
    assert!(wrong(&format!("\n{slides}")) == (2, SLIDES.to_owned()));
    assert!(wrong(&format!("{two}RevoluteDH(d=d2, a=0.2)\n")).1.contains("`d2`"));
    assert!(wrong(&format!("{two}RevoluteDH(d=f(1), a=0.2)\n")).1.contains("sqrt are followed"));
    assert!(wrong(&format!("{two}RevoluteDH(0.1, 0.2, 0.3)\n")).1.contains("without names"));
    assert!(wrong("L(1) = Link([0 0.3 0 0 1]);\nL(2) = Link([0 0 0 0]);\n").1.contains("slides"));
    assert!(wrong("a = [0, 1]\nd = [0, 1, 2]\nalpha = [0, 0]\n").1.contains("different lengths"));
    assert!(wrong("x: {a: 0, d: 1}\ny: {a: 0, d: 1, alpha: 2}\n").1.contains("other parameters"));
    // A link that names nothing is one, too.
    assert_eq!(rows("L1 = RevoluteMDH(qlim=[0, 1])\nL2 = RevoluteMDH(a=0.2)\nL3 = RevoluteMDH()\n").0.len(), 3);
    for text in
        ["", "x = 3\n", "alpha_deg,a_mm,theta_deg,d_mm\n0,0,0,1\n1,2,3,4\n", "delta_a = [0, 1]\ndelta_d = [0, 1]\n"]
    {
        assert_eq!(read(text, false).unwrap().links, None, "{text}");
    }
}

#[test]
fn a_row_that_cannot_be_read_is_named_and_not_left_out() {
    let body = "L2 = 0.4\ndh = [\n # theta, d, a, alpha\n [0, 0.1, 0, pi/2],\n\n [0, 0, -L2, 0],  # elbow\n [0, 0.1, 0, -math.radians(90)],\n [0, 0.1, 0, 0],\n]\nprint(f(a, 0, 0, 1))\n";
    let found = table(body).unwrap().unwrap();
    assert_eq!((found.rows.len(), &found.rows[1].1[2], &found.rows[2].1[3]), (4, "-L2", "-math.radians(90)"));
    for (old, new, line, word) in [
        ("-L2", "-L3", 6, "`-L3`"),
        ("0.1, 0, pi/2]", "0.1, 0, pi2]", 4, "`pi2`"),
        (" [0, 0.1, 0, 0],", " [0, 0.1, 0],", 8, "no row of 4"),
        (" [0, 0, -L2, 0],  # elbow", " *elbow,", 6, "`*elbow,`"),
    ] {
        let (at, message) = table(&body.replace(old, new)).unwrap_err();
        assert!(at == line && message.contains(word), "{at} {message}");
    }
    let c = "Row rows[3] = {\n // a alpha d theta\n { 0.0f, M_PI_2, 0.1f, 0.0f }, // 1\n { 0.3f, 0.0f, 0.0f, 0.0f },\n { 0.0f, 90 * DEG2RAD, 0.1f, 0.0f }\n};\n";
    assert_eq!(table(c).unwrap().unwrap().rows.len(), 3);
    assert_eq!(table("- [0, 0.1, 0, 0]\n- [0, L, 0, 0]\n- [0, 0.2, 0, 0]\n").unwrap_err().0, 2);
    for two in
        ["[1,2,3,4]\n[1,2,3,4]\n\n[1,2,3,4]\n[1,2,3,4]\n", "[1,2,3,4]\n[1,2,3,4]\n[1,2,3,4]\n\n[1,2,3,4]\n[1,2,3,4]\n"]
    {
        assert!(table(two).unwrap_err().1.contains("second table"), "{two}");
    }
}

#[test]
fn lists_have_sizes_factors_and_names_of_a_family() {
    let expected = [[PI / 2.0, 0.0, 0.0, 0.33], [0.0, 0.27, 0.0, 0.0], [-PI / 2.0, -0.06, 0.0, 0.0]];
    let sized = "static double a[3] = {0, 0.27, -0.06};\nstatic double d[3] = {0.33, 0, 0};\nstatic double alpha[N] = {M_PI/2, 0, -M_PI_2};\n";
    let family = "ar_alpha_vals = [pi/2, 0, -pi/2]\nar_a_vals = [0, 0.27, -0.06]\nar_d_vals = [0.33, 0, 0]\nar_theta_offsets = [0, 0, 0]\n";
    let factor = "alpha = [90, 0, -90]*pi/180;\na = [0 270 -60]/1000;\nd = [330 0 0]./1000;\n";
    for text in [sized, family, factor] {
        assert!(close(&rows(text).0, &expected), "{text}\n{:?}", rows(text));
    }
    for text in [factor.replace("*pi/180", "*k"), family.replace("ar_a", "br_a"), family.replace("ar_", "delta_")] {
        assert_eq!(read(&text, false).unwrap().links, None, "{text}");
    }
}

#[test]
fn tables_beside_the_longest_are_named_by_their_lines() {
    let arm = |name: &str, joints: usize| {
        let rows: String = (0..joints).map(|i| format!("  [0, {}, 0, {}],\n", 100 * i, 10 + i)).collect();
        format!("def {name}():\n return np.array([\n{rows} ])\n\n")
    };
    for (joints, others) in
        [(vec![7, 6], vec![14]), (vec![6, 7, 4], vec![3, 24]), (vec![2, 7], vec![]), (vec![7], vec![])]
    {
        let text: String = joints.iter().enumerate().map(|(k, n)| arm(&format!("arm_{k}"), *n)).collect();
        let matrix = table(&text).unwrap().unwrap();
        assert_eq!((matrix.rows.len(), &matrix.others), (7, &others), "{text}");
    }
}

/// Two arms of three joints, links in the calls that make the robots.
const TWO: &str = "deg = pi/180;\nleft = SerialLink( [\n Revolute('d', 0.1, 'alpha', -pi/2, 'modified')\n Revolute('a', 0.2, 'modified')\n Revolute('a', 0.3, 'modified')\n ], ...\n 'base', transl(0, 0.1, 0), 'name', 'left arm');\nright = SerialLink( [\n Revolute('d', -0.1, 'modified')\n Revolute('a', 0.2, 'modified')\n Revolute('a', 0.3, 'modified')\n ], 'base', transl(0, 0.1, 0));\n";

#[test]
fn links_of_several_robots_are_not_those_of_one() {
    let links = "L(1) = Link([0 0.3 0 pi/2]);\nL(2) = Link([0 0 0.4 0]);\n";
    let again = links.replace("L(", "M(");
    let python = "class A(DHRobot):\n def __init__(self):\n  links = [RevoluteDH(d=1), RevoluteDH(a=2)]\n  super().__init__(links, name=\"A\")\n";
    for (several, names) in [
        (TWO.to_owned(), "2 robots (left arm, line 2; right, line 8)"),
        (format!("{links}r = SerialLink(L);\n{links}s = SerialLink(L, 'name', 'S 2');\n"), "(r, line 3; S 2, line 6)"),
        (format!("{links}{again}r = SerialLink(L);\ns = SerialLink(M);\n"), "(r, line 5; s, line 6)"),
        (format!("{python}{}", python.replace('A', "B")), "(A, line 4; B, line 8)"),
    ] {
        let (_, message) = read(&several, false).unwrap_err();
        assert!(message.contains(names) && message.contains("leave the links of one"), "{message}");
    }
    for one in [
        TWO.split("right =").next().unwrap().to_owned(),
        format!("{links}r = SerialLink(L, 'name', 'left');\ns = SerialLink(L, 'name', 'right');\n"),
        format!("{links}r = SerialLink(L);\ns = SerialLink(r, 'name', 'with a tool');\n"),
        format!("from rtb import DHRobot\n{python}\nif __name__ == '__main__':\n robot = A()\n"),
        links.to_owned(),
    ] {
        assert_eq!(read(&one, false).unwrap().links.map(|l| l.rows.len() < 4), Some(true), "{one}");
    }
}

#[test]
fn what_calls_say_of_the_convention_comes_before_comments() {
    let of = |text: &str| read(text, false).unwrap().links.map(|l| (l.convention.map(|(c, _)| c), l.contradiction));
    let one = TWO.split("right =").next().unwrap();
    for comment in ["", "% MODEL: humanoid, standard_DH\n"] {
        assert_eq!(of(&format!("{comment}{one}")), Some((Some(Convention::Modified), None)), "{comment}");
    }
    let standard = one.replace("modified", "standard");
    assert_eq!(of(&format!("% modified DH\n{standard}")), Some((Some(Convention::Classic), None)));
    assert_eq!(of(&standard.replacen(", 'standard'", "", 2)), Some((Some(Convention::Classic), None)));
    assert_eq!(of(&one.replace(", 'modified'", "")), Some((None, None)));
    for mixed in [one.replacen(", 'modified'", "", 1), "[RevoluteMDH(d=1), RevoluteDH(a=1)]\n".to_owned()] {
        let (convention, contradiction) = of(&mixed).unwrap();
        assert!(convention.is_none() && contradiction.is_some_and(|said| said.contains("classic")), "{mixed}");
    }
}

#[test]
fn links_of_calls_slide_count_the_other_way_and_follow_formulas() {
    let links = |text: &str| read(text, false).unwrap().links.unwrap();
    let arm = "aa = 30*pi/180; sa = sin(aa); s2a = sin(2*aa);\nD3 = 0.2; d4b = D3 + sa/s2a*0.1;\nlinks = [\n Revolute('alpha', 2*aa, 'd', -d4b, 'flip')\n Prismatic('theta', pi/2, 'a', 0.3, 'offset', 0.01, 'qlim', [0 0.21])\n Revolute('offset', pi/2, 'r', RC(1,:), 'm', M(1))\n ];\n%{\nlinks = [\n Revolute('a', 0.7, 'modified')\n ];\n%}\n";
    let found = links(arm);
    let rows: Vec<Row> = found.rows.iter().map(|(_, row)| row.map(|v| v.number)).collect();
    let d4b = 0.2 + 0.1 * (PI / 6.0).sin() / (PI / 3.0).sin();
    assert!(
        close(&rows, &[[PI / 3.0, 0.0, 0.0, -d4b], [0.0, 0.3, PI / 2.0, 0.01], [0.0, 0.0, PI / 2.0, 0.0]]),
        "{rows:?}"
    );
    assert_eq!((found.slides, found.flipped), (vec![false, true, false], vec![true, false, false]));
    assert_eq!(found.limits[1].map(|limits| limits.map(|v| v.number)), Some([0.0, 0.21]));
    let python =
        links("[RevoluteDH(d=1, flip=True), PrismaticDH(theta=1), RevoluteDH(a=1, r=[1, 2, 3], flip=False)]\n");
    assert_eq!((python.slides, python.flipped), (vec![false, true, false], vec![true, false, false]));
    let vectors = links("L(1) = Link([0 0.4 0 -pi/2 0]);\nL(2) = Link([-pi/2 0 0 0 1]);\nL(3) = Link('sigma', 1);\n");
    assert_eq!((vectors.slides, vectors.flipped), (vec![false, true, true], vec![false; 3]));
}

#[test]
fn a_word_beside_the_parameters_says_that_a_joint_slides() {
    let block = "j1:\n  type: revolute\n  a: 0.1\n  alpha: 0\n  d: 0.3\n  theta: 0\nj2:\n  type: prismatic\n  a: 0.2\n  alpha: 3.14159\n  d: 0.05\n  theta: 0\n";
    let last = "- a: 0.1\n  alpha: 0\n  d: 0.3\n  theta: 0\n  joint_type: R\n- a: 0.2\n  alpha: 0\n  d: 0.05\n  theta: 0\n  joint_type: P\n";
    let flow = "{\"links\": [{\"type\": \"revolute\", \"a\": 0.1, \"alpha\": 0, \"d\": 0.3, \"theta\": 0},\n{\"a\": 0.2, \"alpha\": 0, \"d\": 0.05, \"theta\": 0, \"type\": \"prismatic\"}]}\n";
    for text in [block, last, flow] {
        let links = read(text, false).unwrap().links.unwrap();
        assert_eq!(links.slides, [false, true], "{text}");
        assert_eq!((links.rows.len(), links.rows[1].1[3].number), (2, 0.05), "{text}");
    }
}

/// A model in the manner of a toolbox.
const MODEL: &str = "class Arm(DHRobot):\n    def __init__(self, base=None):\n        links = [\n            RevoluteDH(d=0.4, a=0.3),\n            RevoluteDH(a=0.2, alpha=pi),\n            PrismaticDH(qlim=[0, 0.2]),\n        ]\n        super().__init__(links, name=\"Arm\")\n";

#[test]
fn what_shows_the_use_of_a_robot_is_no_link() {
    let shown = format!(
        "{MODEL}\n\nif __name__ == \"__main__\":  # no cover\n    a = RevoluteDH(d=0.4, a=0.3)\n\n    print(a)\n"
    );
    assert_eq!(rows(&shown).0.len(), 3);
    assert_eq!(rows(&format!("{shown}x = 3\nl4 = RevoluteDH(a=0.1)\n")).0.len(), 4);
}

#[test]
fn links_that_cannot_be_followed_are_refused_with_their_line() {
    let before = "        super().__init__";
    for (added, word) in [
        ("links.extend(other.links)", "`links.extend(other.links)`"),
        ("links += other.links", "`links += other.links`"),
        ("links.append(other[0])", "`links.append(other[0])`"),
    ] {
        let (line, message) = read(&MODEL.replace(before, &format!("        {added}\n{before}")), false).unwrap_err();
        assert!(line == 8 && message.contains(word), "{line} {message}");
    }
    let (line, message) = read(&MODEL.replace("(links,", "(links + other.links,"), false).unwrap_err();
    assert!(line == 8 && message.contains("`links + other.links`"), "{message}");
    // What the file makes itself may be added one by one.
    let tail = "        links.append(RevoluteDH())\n        last = RevoluteDH(a=0.1)\n        links.append(last)\n";
    assert_eq!(rows(&MODEL.replace(before, &format!("{tail}{before}"))).0.len(), 5);
    let matlab =
        "L1 = Link('d', 0.1, 'a', 0.2);\nL2 = Link('d', 0, 'a', 0.3);\nr = SerialLink([L1 L2], 'name', 'two');\n";
    assert_eq!(rows(matlab).0.len(), 2);
}

#[test]
fn base_and_tool_of_a_toolbox_are_taken_where_they_are_numbers() {
    let of = |told: &str| {
        let text = MODEL.replace("name=\"Arm\"", &format!("name=\"Arm\", {told}"));
        let links = read(&text, false).unwrap().links.unwrap();
        (links.ends.map(|end| end.map(|end| end.in_mm(1000.0))), links.ends_said)
    };
    let ([base, tool], said) = of("base=SE3.Ry(pi / 2), tool=transl(0, 0.1, 0.2) @ trotz(-90, 'deg')");
    assert!((base.unwrap().rotation.angle() - PI / 2.0).abs() < 1e-12);
    let tool = tool.unwrap();
    assert_eq!(tool.translation.vector.as_slice(), [0.0, 100.0, 200.0]);
    assert!((tool.rotation.scaled_axis().z + PI / 2.0).abs() < 1e-12);
    assert_eq!(said.len(), 2);
    assert!(said[0].contains("the base of line 8 is part of") && said[1].contains("the tool of line 8 is part of"));
    for nothing in ["manufacturer='x'", "base=base", "tool=None", "tool=SE3()"] {
        assert_eq!(of(nothing), ([None; 2], Vec::new()), "{nothing}");
    }
    let (ends, said) = of("tool=grip(3)");
    assert!(ends == [None; 2] && said[0].starts_with("the tool of line 8, `grip(3)`, is LEFT OUT"), "{said:?}");
    // One of two arms, and which is meant is not known.
    let arms = "        if left:\n            self.base = SE3(0, 0.3, 0)\n        else:\n            self.base = SE3(0, -0.3, 0)\n";
    let two = read(&format!("{MODEL}{arms}"), false).unwrap().links.unwrap();
    assert!(two.ends == [None; 2] && two.ends_said[0].contains("the base of line 12,"), "{:?}", two.ends_said);
    // Names, and what is told of the robot afterwards.
    let ends = |code: &str| read(code, false).unwrap().links.unwrap().ends;
    let named = MODEL
        .replace("        super", "        h = 0.05\n        tool = SE3(0, 0, 2*h)\n        super")
        .replace("name=", "\n            tool=tool,\n            name=");
    assert_eq!(ends(&named)[1].map(|e| e.in_mm(1.0).translation.z), Some(0.1));
    let matlab = "L(1) = Link('d', 0.1, 'a', 0.2);\nL(2) = Link('d', 0, 'a', 0.3);\nr = SerialLink(L, 'name', 'two', 'tool', transl(0, 0, 0.1));\nr.base = transl([0.5 0 0]);\n";
    let found = ends(&matlab.replace("0.5 0 0", "0.5, 0, 0"));
    assert_eq!(found.map(|e| e.map(|e| e.in_mm(1.0).translation.vector.sum())), [Some(0.5), Some(0.1)]);
}

/// A link that is made several times stands in the text once.
#[test]
fn repeated_links_are_written_out_or_refused_with_their_line() {
    let count = |list: &str| {
        let text = format!("first = RevoluteDH(d=0.1, alpha=pi/2)\nL = {list}\nr = DHRobot(L)\n");
        read(&text, false).map(|text| text.links.map_or(0, |links| links.rows.len()))
    };
    let link = "RevoluteDH(a=0.3)";
    assert_eq!(count(&format!("[{link}] + [{link}]*3")), Ok(1 + 1 + 3));
    assert_eq!(count(&format!("[{link}, *[{link}, {link}] * 2]")), Ok(1 + 1 + 4));
    assert_eq!(count(&format!("[{link}, RevoluteDH(a=0.2*3)]")), Ok(3));
    for list in [
        format!("[{link}] * n"),
        format!("3 * [{link}]"),
        format!("[{link}]*2*2"),
        "[first]*3".to_owned(),
        format!("[{link} for _ in range(3)]"),
        format!("repmat({link}, 1, 3)"),
        format!("[]\nfor _ in range(3):\n    L.append({link})"),
        format!("[]\nfor _ in range(3):\n    if True:\n        L.append({link})"),
        format!("[]\nfor _ in range(3): L.append({link})"),
        format!("[]\nfor i=1:3\nL(i) = {link}\nend"),
    ] {
        let (line, message) = count(&list).unwrap_err();
        assert!((2..=5).contains(&line) && message.contains("more often than they are written"), "{list}: {message}");
    }
    // A loop that ended, and one that only looks.
    let after = format!("[{link}]\nfor i=1:3\nx = i;\nend\nL2 = {link}\nfor l in L:\n    print(l)");
    assert_eq!(count(&after), Ok(3));
}

#[test]
fn rows_that_share_a_line_are_all_read() {
    let rows = "[0, 0.3, 0, pi/2], [0, 0, 0.4, 0],\n [0, 0.1, 0, 0], [0, 0, 0.2, 0]";
    for text in [format!("dh = [\n {rows}\n]\nprint(dh[0][1], [1])\n"), format!("dh = np.array([{rows}])\n")] {
        let found = table(&text).unwrap().unwrap();
        let lengths: Vec<&str> =
            found.rows.iter().map(|(_, row)| if &row[1] == "0" { &row[2] } else { &row[1] }).collect();
        assert_eq!(lengths, ["0.3", "0.4", "0.1", "0.2"], "{text}");
    }
    // One of them among rows that have their own lines, and a row that is none.
    let mixed = "dh = [\n [0, 0.3, 0, 0],\n [0, 0, 0.4, 0],\n [0, 0.1, 0, 0], [0, 0, 0.2, 0],\n]\n";
    assert!(table(mixed).unwrap_err().1.contains("is no row of 4 numbers"));
    let broken = table("dh = [\n [0, 0.3, 0, 0], [0, 0, 0.4, 0],\n [0, 0.1, 0, 0], [0, 0, L, 0]\n]\n").unwrap_err();
    assert!(broken.0 == 3 && broken.1.contains("`L`"), "{broken:?}");
    assert_eq!(table("plot([0, 1, 2, 3], [1, 2, 3, 4])\n"), Ok(None));
}
