use super::*;

use crate::files::Result;
use crate::robot::catalogue::Convention;
use crate::tables::names::Unit;

mod code;
mod joints;

fn of(name: &str, text: &str, asked: Asked) -> Result<Vec<Reading>> {
    let (_folder, path) = crate::files::temporary(name, text);
    readings(&path, &asked)
}

fn all(text: &str) -> Result<Vec<Reading>> {
    of("dh.csv", text, Asked::default())
}

fn one(name: &str, text: &str) -> Reading {
    let mut found = of(name, text, Asked::default()).unwrap();
    assert_eq!(found.len(), 1, "{text}");
    found.remove(0)
}

fn said(name: &str, text: &str) -> String {
    crate::diagnostic::report(&of(name, text, Asked::default()).unwrap_err())
}

#[test]
fn one_table_in_all_its_forms() {
    let expected = vec![[0.0, 0.0, 0.0, 487.0], [-90.0, 85.0, -90.0, 0.0], [0.0, 640.0, 0.0, 12.5]];
    for text in [
        "alpha, a, d, theta\n0, 0, 487, 0\n-90, 85, 0, -90\n0, 640, 12.5, 0\n",
        "theta_deg;d_mm;a_mm;alpha_deg\n0;487;0;0\n-90;0;85;-90\n0;12,5;640;0\n",
        "joint,alpha [rad],a [m],theta [rad],d [m]\n1,0,0,0,0.487\n2,-1.5707963267948966,0.085,-1.5707963267948966,0\n3,0,0.64,0,0.0125\n",
        "d\ttheta\talpha\ta\n0.487\t0\t0\t0\n0\t-1.5707963267948966\t-1.5707963267948966\t0.085\n0.0125\t0\t0\t0.64\n",
    ] {
        let found = all(text).unwrap();
        assert_eq!(found.len(), 1, "{text}");
        for (row, expected) in found[0].rows.iter().zip(&expected) {
            assert!(row.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{text}: {row:?}");
        }
    }
}

#[test]
fn the_ends_of_a_table_show_its_convention_where_no_word_says_it() {
    let of = |text: &str| all(text).unwrap()[0].convention().0;
    let classic = "theta,d,a,alpha\nq1,0.31,0,pi/2\nq2 - pi/2,0,-0.52,0\nq3,0.1,0,-pi/2\nq4,0.09,0,0\n";
    assert_eq!(of(classic), Some(Convention::Classic));
    let [alpha, a, theta, d] = all(classic).unwrap()[0].rows[1];
    assert!((alpha, a, d) == (0.0, -520.0, 0.0) && (theta + 90.0).abs() < 1e-9);
    assert_eq!(of("theta,d,a,alpha\n0,310,0,0\n-90,0,0,-90\n0,0,520,0\n0,90,0,90\n"), Some(Convention::Modified));
    // An arm in a plane, and one that stands on a slope.
    assert_eq!(of("theta,d,a,alpha\n0,310,0,0\n0,0,225,0\n0,9,0,0\n"), None);
    assert_eq!(of("theta,d,a,alpha\n0,310,0,90\n0,0,225,0\n0,9,80,0\n"), None);
    assert_eq!(of("alpha_deg,a_mm,theta_deg,d_mm\n90,0,0,310\n0,225,0,0\n0,80,0,9\n"), Some(Convention::Modified));
    assert_eq!(of("alpha_deg,a_mm,theta_deg,d_mm\n90,0,0,310\n0,225,0,0\n0,0,0,9\n"), Some(Convention::Classic));
    assert_eq!(of("theta_i,d_i,a_(i-1),alpha_{i-1}\n0,310,0,90\n0,0,225,0\n0,9,0,0\n"), Some(Convention::Modified));
    assert!(said("dh.csv", &classic.replace("q3,0.1", "0,d3")).contains("`d3` is not a number"));
    assert!(said("dh.csv", &classic.replace("q3,0.1", "0,q3")).contains("slides"));
    // Of rows that turn and rows that do not the last may be the flange.
    let flange = all(&format!("{classic}0,0.2,0,0\n")).unwrap();
    assert!(flange[0].rows == all(classic).unwrap()[0].rows && flange[0].said.starts_with("4 joints"));
    assert!(said("dh.csv", &classic.replace("q3,0.1", "0,0.1")).contains("does not turn"));
    assert!(said("dh.csv", &classic.replace("q2 - pi/2", "q2 - 90")).contains("in radians stand beside one of 90"));
    let words = "Link Length (a<sub>i-1</sub>),Link Twist (α<sub>i-1</sub>),Joint Offset (d<sub>i</sub>),Joint Angle (θ<sub>i</sub>)\n0,0,310,θ<sub>1</sub>\n0,-90,0,\\theta_2 - 90\n520,0,0,θ<sub>3</sub>\n";
    let found = all(words).unwrap();
    assert_eq!((found[0].rows[1], found[0].convention().0), ([-90.0, 0.0, -90.0, 0.0], Some(Convention::Modified)));
}

#[test]
fn formulas_in_the_first_rows_are_no_names_and_a_column_says_what_slides() {
    let rows = |kind: [&str; 2], d: &str| {
        let (r, p) = (kind[0], kind[1]);
        format!("pi/2,0,0,q1+pi/2,{r}\n-pi/2,0,0,q2 - pi/2,{r}\npi/2,0,{d},0,{p}\n-pi/2,0.02,0.3,q4,{r}\n")
    };
    for (kind, name) in [(["R", "P"], "type"), (["revolute", "prismatic"], "joint_type"), (["0", "1"], "sigma")] {
        for d in ["-0.25", "q3 - 0.25", "q3-0.25"] {
            let found = one("dh.csv", &format!("alpha,a,d,theta,{name}\n{}", rows(kind, d)));
            assert_eq!(found.slides, [false, false, true, false], "{name} {d}");
            let [alpha, a, theta, d_mm] = found.rows[2];
            assert!((alpha - 90.0).abs() < 1e-9 && (a, theta, d_mm) == (0.0, 0.0, -250.0), "{:?}", found.rows);
        }
    }
    // A sliding joint at the end is one, and what stands still behind it is the flange.
    let last = "alpha,a,d,theta,type\n0,0.3,0.4,q1,R\npi,0.2,0,q2,R\n0,0,q3,0,P\n";
    assert_eq!((one("dh.csv", last).rows.len(), one("dh.csv", last).slides[2]), (3, true));
    let without = said("dh.csv", &last.replace(",type", "").replace(",R", "").replace(",P", ""));
    assert!(without.contains("the joint slides") && without.contains("dh.csv:4"), "{without}");
    let still = said("dh.csv", &format!("alpha,a,d,theta,type\n{}", rows(["R", "R"], "-0.25")));
    assert!(still.contains("does not turn"), "{still}");
}

#[test]
fn without_names_every_order_that_could_be_is_offered() {
    let found = all("0, 0, 487, 0\n-90, 85, 0, -90\n0, 640, 12.5, 0\n").unwrap();
    assert!(found.len() > 1 && found.iter().any(|r| r.columns == "alpha,a,d,theta"), "{found:?}");
    assert!(said("dh.csv", "alpha_deg,a_mm,theta_deg,d_mm\n1.5708,85,0,0\n0,640,1.5708,12\n").contains("radians"));
    assert!(said("dh.csv", "alpha_deg,a_mm,theta_deg,d_mm\n90,0.085,0,0\n0,0.640,0,0\n").contains("metres"));
    assert!(said("dh.csv", "alpha,a,theta\n90,85,0\n0,640,0\n").contains("no column `d_mm`"));
}

#[test]
fn a_length_at_an_end_of_a_table_does_not_tell_its_convention() {
    let of = |text: &str| one("dh.csv", text).convention();
    // A gripper's length behind a plain first row is of either.
    let (open, why) = of("theta,d,a,alpha\n0,310,0,0\n-90,0,0,-90\n0,0,520,0\n");
    assert!(open.is_none() && why.contains("a length without a twist"), "{why}");
    assert_eq!(of("theta,d,a,alpha\n0,310,225,0\n-90,0,0,-90\n0,90,0,0\n").0, None);
    let (shown, why) = of("theta,d,a,alpha\n0,310,0,0\n-90,0,0,-90\n0,0,520,0\n0,90,0,90\n");
    assert!(shown == Some(Convention::Modified) && why.contains("--dh classic"), "{why}");
}

#[test]
fn words_say_the_convention_and_ask_where_the_ends_show_the_other() {
    let table = "dh = [\n [0, 0.31, 0, 0],\n [0, 0, 0, -pi/2],\n [0, 0.09, 0, pi/2]]\n";
    let of = |words: &str| one("dh.py", &format!("# {words}: theta, d, a, alpha\n{table}")).convention();
    assert_eq!(of("Modified DH").0, Some(Convention::Modified));
    assert_eq!(of("modified by the author").0, Some(Convention::Modified));
    let (open, why) = of("standard DH");
    assert!(open.is_none() && why.contains("words of the file say classic"), "{why}");
    let twists = table.replace("0, 0],", "0, pi/2],");
    assert_eq!(
        one("dh.py", &format!("# Craig's DH: theta, d, a, alpha\n{twists}")).convention().0,
        Some(Convention::Modified)
    );
    // Numbers from 1 in names show nothing.
    let numbered =
        "a1 = 0; alpha1 = 0; d1 = 0.3;\na2 = 0.4; alpha2 = pi/2; d2 = 0;\na3 = 0; alpha3 = pi/2; d3 = 0.1;\n";
    assert_eq!(one("dh.m", numbered).convention().0, Some(Convention::Modified));
}

#[test]
fn units_are_asked_where_neither_numbers_nor_words_tell() {
    let lists = "dh:\n  theta: [1.3, -0.9]\n  a: [0.3, 0.25]\n  d: [0.0, 0.0]\n  alpha: [0.0, 0.0]\n";
    assert!(one("arm.yml", lists).open.is_some_and(|open| open.message.contains("1.3")));
    let stated = one("arm.yml", &format!("# Unit [radian]\n{lists}"));
    assert!(stated.open.is_none() && (stated.rows[0][2] - 1.3f64.to_degrees()).abs() < 1e-9);
    let asked = Asked { units: [Some(Unit::Deg), Some(Unit::Cm)], ..Asked::default() };
    let flagged = of("arm.yml", lists, asked).unwrap().remove(0);
    assert!(flagged.open.is_none() && flagged.rows[0] == [0.0, 3.0, 1.3, 0.0], "{flagged:?}");
    // Lengths of a program.
    let short = "L1, L2 = 13.8, 14.7\nalpha = [0, pi/2, 0]\na = [0, 0, L2]\nd = [L1, 0, 0]\n";
    assert!(one("arm.py", short).open.is_some_and(|open| open.message.contains("28.5 in all")));
    let stated = one("arm.py", &short.replace("14.7\n", "14.7 # lengths in cm\n"));
    assert!(stated.open.is_none() && stated.rows[0][3] == 138.0, "{stated:?}");
    // Words that the numbers rule out are not heard, or asked about.
    let metres = short.replace("13.8, 14.7", "0.138, 0.147 # lengths in mm");
    assert!((one("arm.py", &metres).rows[0][3] - 138.0).abs() < 1e-9);
    assert!(one("arm.py", &metres.replace("in mm", "in cm")).open.is_some());
    assert!(said("dh.csv", "theta,d,a,alpha\n90,310,0,1.5708\n0,0,220,0\n").contains("quarter turn in radians"));
    let each = one("dh.csv", "theta [deg],d,a,alpha [rad]\n90,310,0,1.5707963267948966\n30,0,220,0\n");
    assert!((each.rows[0][0] - 90.0).abs() < 1e-9 && each.rows[1][2] == 30.0, "{each:?}");
}

#[test]
fn columns_that_a_flag_names_are_those_of_any_text() {
    let asked = Asked { columns: Some("theta,d,a,alpha"), ..Asked::default() };
    let yaml = "dh:\n - [0, 0.15, 0.0, 1.5708]\n - [0, 0.0, -0.24, 0.0]\n - [0, 0.08, 0.0, 0.0]\n";
    for (name, text) in [
        ("arm.yaml", yaml),
        ("arm.txt", "0 0.15 0 pi/2\n0 0 -0.24 0\n0 0.08 0 0\n"),
        ("arm.csv", "q1,0.15,0,pi/2\nq2,0,-0.24,0\nq3,0.08,0,0\n"),
        ("arm.csv", "q1,0.15,q1,pi/2\nq1,0.15,0,pi/2\nq2,0,-0.24,0\nq3,0.08,0,0\n".split_once('\n').unwrap().1),
    ] {
        let found = of(name, text, asked).unwrap();
        assert_eq!((found.len(), found[0].rows.len()), (1, 3), "{text}");
        assert!((found[0].rows[0][0] - 90.0).abs() < 1e-3 && found[0].rows[1][1] == -240.0, "{found:?}");
    }
    let refused = |name: &str, text: &str| crate::diagnostic::report(&of(name, text, asked).unwrap_err());
    assert!(refused("arm.csv", "0,150,0,90,7\n0,0,240,0,8\n").contains("the table has 5"));
    assert!(refused("arm.py", "RevoluteDH(d=0.3, alpha=pi/2)\nRevoluteDH(a=0.3)\n").contains("names of their own"));
    assert!(said("arm.csv", "0,150,0,90,7,5\n0,0,240,0,8,5\n").contains("`--columns"));
}

#[test]
fn a_last_row_that_holds_still_is_the_flange() {
    let numbered = "s = {alpha0: 0, a0: 0, d1: 0.75,\n alpha1: -pi/2, a1: 0.35, d2: 0, q2: q2 - pi/2,\n alpha2: 0, a2: 1.25, d3: 0,\n alpha3: pi/2, a3: 0, d4: 0.3, q4: 0}\n";
    let found = one("fk.py", numbered);
    assert_eq!(found.rows.len(), 3);
    let robot = found.robot("arm", Convention::Modified);
    let turning = one("fk.py", &numbered.replace(", q4: 0", "")).robot("arm", Convention::Modified);
    let (flange, expected) =
        (robot.root_from_flange(&[0.1, 0.2, 0.3]), turning.root_from_flange(&[0.1, 0.2, 0.3, 0.0]));
    assert!((flange.inverse() * expected).translation.vector.norm() < 1e-9, "{flange} {expected}");
    assert!((flange.rotation.inverse() * expected.rotation).angle() < 1e-9);
    let table = "theta,d,a,alpha\nq1,0.31,0,pi/2\nq2,0,0.5,0\nq3,0.1,0,-pi/2\n0,0.2,0,0\n";
    let classic = one("dh.csv", table).robot("arm", Convention::Classic);
    let all = one("dh.csv", &table.replace("\n0,", "\nq4,")).robot("arm", Convention::Classic);
    let (flange, expected) = (classic.root_from_flange(&[0.1, 0.2, 0.3]), all.root_from_flange(&[0.1, 0.2, 0.3, 0.0]));
    assert!((flange.inverse() * expected).translation.vector.norm() < 1e-9, "{flange} {expected}");
}

#[test]
fn a_joint_that_slides_is_read_from_its_words() {
    let table = "alpha_deg,a_mm,theta_deg,d_mm,type,min,max\n0,225,0,387,R,-90,90\n180,175,0,0,R,-90,90\n0,0,0,0,P,0,150\n0,0,0,60,R,-90,90\n";
    let number = |kind: &str| if kind == ",P" { ",1" } else { ",0" };
    let sigma = [",R", ",P"].iter().fold(table.replace("type", "sigma"), |text, kind| text.replace(kind, number(kind)));
    let words = table.replace(",R", ",revolute").replace(",P", ",Prismatic").replace("type", "Joint type");
    for table in [table, &sigma, &words] {
        let found = one("dh.csv", table);
        assert!(found.said.contains(", sliding: 3"), "{}", found.said);
        let joints = found.robot("scara", Convention::Classic).joints;
        let slides: Vec<bool> = joints.iter().map(|joint| joint.slides).collect();
        assert_eq!(slides, [false, false, true, false], "{table}");
        assert_eq!((joints[2].limits_rad, joints[0].limits_rad.unwrap().1), (Some((0.0, 150.0)), 90f64.to_radians()));
    }
    // Other words say nothing of it, and one that is neither is named.
    let motors = one("dh.csv", &table.replace(",R", ",AC").replace(",P", ",DC"));
    assert!(!motors.said.contains("sliding") && motors.slides == [false; 4], "{}", motors.said);
    assert!(said("dh.csv", &table.replace(",P", ",Q")).contains("joint 3 is `Q`, neither revolute nor prismatic"));
}

#[test]
fn limits_are_read_or_said_to_be_left_out() {
    let table = "joint,a,alpha,d,theta,q_min,q_max\n1,0,90,400,0,-170,170\n2,560,0,0,90,-90,90\n3,35,90,0,0,-80,80\n";
    assert_eq!(one("dh.csv", table).limits_deg, [Some((-170.0, 170.0)), Some((-90.0, 90.0)), Some((-80.0, 80.0))]);
    let radians = table.replace("-170,170", "-3,3").replace("-90,90", "-1,1").replace("-80,80", "-1,1");
    assert_eq!(one("dh.csv", &radians).limits_deg[1], Some((-1f64.to_degrees(), 1f64.to_degrees())));
    let other = table.replace("q_min,q_max", "limits,mass");
    assert!(one("dh.csv", &other).said.ends_with("left out: limits, mass"));
    let links = "deg = pi/180;\nL = [Revolute('d', 0.3, 'alpha', pi/2, 'qlim', [-240 240]*deg)\n Revolute('a', 0.2, 'qlim', [-pi/2 pi/2])\n Revolute('a', 0.1, 'qlim', [0, 160]*pi/180)];\n";
    let limits = one("arm.m", links).limits_deg;
    let expected = [(-240.0, 240.0), (-90.0, 90.0), (0.0, 160.0)];
    let near = |(found, (low, high)): (&Option<(f64, f64)>, (f64, f64))| {
        found.is_some_and(|f| (f.0 - low).abs() < 1e-9 && (f.1 - high).abs() < 1e-9)
    };
    assert!(limits.len() == 3 && limits.iter().zip(expected).all(near), "{limits:?}");
    assert!(one("arm.m", &links.replace("[-pi/2 pi/2]", "range(2)")).said.ends_with("left out: qlim"));
    // Names over other columns.
    let mixed = "a,alpha,d,theta\n290,0,1.5707963267948966,-165\n0,270,0,-110\n72,0,0,-100\n";
    assert!(said("dh.csv", mixed).contains("stands in a column of lengths"));
}

#[test]
fn a_table_in_a_document_is_read_without_what_is_around_it() {
    let rows = "&alpha; | a | d | &theta;\n:--:|:--:|:--:|:--:\n0 | 0 | 0.75 | q&#8321;\n-&pi;/2 | 0.35 | 0 | q&#x2082;-&pi;/2\n0 | 1.25 | 0 | q<sub>3</sub>\n";
    let document = format!(
        "# An arm\n\nAs | said | in | [1]:\n\n{rows}\nThe offset is what `q` begins at, in rad.\n$$\\begin{{array}}{{cc}} c & -s \\\\ s & c \\end{{array}}$$\n"
    );
    let found = one("README.md", &document);
    assert_eq!((found.rows.len(), found.rows[1]), (3, [-90.0, 350.0, -90.0, 0.0]));
    assert!(said("README.md", &format!("{document}\n{rows}")).contains("a second table begins here"));
    let ruled = "  a\talpha\t d\t theta\n\n1-0 | 0.09 | 0 | 0.38 | 0 |\n-----------\n2-1 | 0.12 | 1.5708 | 0.35 | 0 |\n-----------\n3-2 | 0.11 | 0 | 0 | 0 |\n";
    let found = one("arm.txt", ruled);
    assert_eq!((found.rows.len(), found.rows[0]), (3, [0.0, 90.0, 0.0, 380.0]));
    let two = "alpha a theta d\n0 0.2 0 -0.2\npi/2 0 0 0\n\nLeft\n0 -0.2 0 -0.2\npi/2 0 0 0\n";
    assert!(said("leg.txt", two).contains("a second table of numbers begins here"));
}

#[test]
fn words_that_contradict_each_other_are_asked_about() {
    let links = "L(1) = Link('d', 0.3, 'alpha', pi/2);\nL(2) = Link('a', 0.4);\nL(3) = Link('a', 0.1);\n";
    let of = |text: &str| one("dh.m", text).convention();
    let (asked, why) = of(&format!("% standard DH; there is a modified DH version, too\n{links}"));
    assert!(asked.is_none() && why.contains("both"), "{why}");
    let flags = links.replace(");", ", 'modified');");
    assert_eq!(of(&format!("% standard DH\n{flags}")).0, Some(Convention::Modified));
    assert_eq!(of(&format!("% standard DH\n{links}")).0, Some(Convention::Classic));
    assert_eq!(of(links).0, Some(Convention::Classic));
    let (asked, why) = of(&links.replacen(");", ", 'modified');", 1));
    assert!(asked.is_none() && why.contains("line 1"), "{why}");
}

#[test]
fn joints_of_a_toolbox_slide_and_count_the_other_way() {
    let text = "links = [\n Revolute('d', 0.4, 'alpha', pi/2, 'flip', 'qlim', [-50 60]*pi/180)\n Prismatic('qlim', [0 0.21])\n Revolute('a', 0.2)\n];\n";
    let reading = one("arm.m", text);
    assert!(reading.said.contains("sliding: 2") && reading.said.contains("(flip): 1"), "{}", reading.said);
    let robot = reading.robot("arm", Convention::Classic);
    let signs: Vec<f64> = robot.joints.iter().map(|joint| joint.sign).collect();
    assert_eq!(signs, [-1.0, 1.0, 1.0]);
    assert_eq!((robot.joints[1].slides, robot.joints[1].limits_rad), (true, Some((0.0, 210.0))));
    let (low, high) = robot.joints[0].limits_rad.unwrap();
    assert!((low.to_degrees() + 50.0).abs() < 1e-9 && (high.to_degrees() - 60.0).abs() < 1e-9);
    // As the toolbox has it: A(q) = Rz(offset - q) Tz(d) Tx(a) Rx(alpha).
    let at = robot.root_from_flange(&[0.3, 100.0, 0.0]) * nalgebra::Point3::origin();
    let (radial, up) = (200.0, 400.0);
    let expected = nalgebra::Point3::new(
        radial * 0.3f64.cos() + 100.0 * (-0.3f64).sin(),
        -radial * 0.3f64.sin() - 100.0 * 0.3f64.cos(),
        up,
    );
    assert!((at - expected).norm() < 1e-9, "{at}");
    let plain = one("arm.m", &text.replace(", 'flip'", ""));
    assert!(!plain.said.contains("flip") && plain.robot("arm", Convention::Classic).joints[0].sign == 1.0);
}

#[test]
fn an_index_behind_a_letter_is_no_other_name() {
    let rows = "1,θ1,350,0,-90\n2,θ2-90,0,420,0\n3,θ3,0,65,-90\n";
    for header in
        ["Joint,θi (°),di (mm),ai (mm),αi (°)", "i,θᵢ,dᵢ,aᵢ,αᵢ", "n,theta_n,dn,an,alphan", "Joint,qi,di,ri,Alphai"]
    {
        let found = one("dh.csv", &format!("{header}\n{rows}"));
        assert_eq!(
            found.rows,
            [[-90.0, 0.0, 0.0, 350.0], [0.0, 420.0, -90.0, 0.0], [-90.0, 65.0, 0.0, 0.0]],
            "{header}"
        );
        assert_eq!((found.stated, found.columns.as_str()), (None, "theta,d,a,alpha"), "{header}");
    }
    for header in ["Joint,θi,di,ai-1,αi-1", "Joint,θᵢ,dᵢ,aᵢ₋₁,αᵢ₋₁", "Joint,θ_i,d_i,a_{i−1},α_{i−1}"]
    {
        let found = one("dh.csv", &format!("{header}\n{rows}"));
        assert_eq!(found.convention().0, Some(Convention::Modified), "{header}");
    }
    // Letters of others, one twice, and the notation in which d is the length.
    for (header, words) in [
        ("i,θi,di,bi,αi", "no column `a_mm`"),
        ("i,φi,di,ai,αi", "no column `theta_deg`"),
        ("i,θi,ai,ai-1,αi", "two columns `a`"),
        ("j,αj,dj,θj,rj", "Khalil"),
    ] {
        let said = said("dh.csv", &format!("{header}\n{}", rows.replace("θ2-90", "0").replace('θ', "")));
        assert!(said.contains(words) && said.contains("dh.csv:1"), "{said}");
    }
}

/// A table as papers have it.
const TEX: &str = "% 3 & of & a & comment\n\\section{An arm}\n\\begin{table}\\caption{Lengths}\\begin{tabular}{|c|c|}\nlink & mm \\\\ \\hline\nupper & 270 \\\\\nlower & 80\\% \\\\\n\\end{tabular}\\end{table}\n\
    \\begin{tabular}[t]{|c|c|@{ }c|c|c|}\n\\hline\n$i$ & $\\alpha_{i-1}$ & $a_{i-1}$ [mm] & $d_i$ [mm] & \\textbf{$\\theta_i$} \\\\ \\hline\\hline\n\
    1 & 0 & 0 & 310 & $\\theta_1^{*}$ \\\\[2pt]\n2 & $-90^\\circ$ & 25 & 0 & $\\theta_2-90^\\circ$ \\\\ \\cline{2-3}\n3 & 0 & 270 &\n 0 & $\\theta_3$ \\\\ 4 & ${-90}^{\\circ}$ & 70 & 302 & $\\theta_4$ % the wrist\n\\\\ \\bottomrule\n\\end{tabular}\n";

#[test]
fn a_table_of_a_paper_is_read_between_its_rules() {
    let text = TEX.replace("${-90}", "$-90");
    let found = one("dh.tex", &text);
    let expected =
        [[0.0, 0.0, 0.0, 310.0], [-90.0, 25.0, -90.0, 0.0], [0.0, 270.0, 0.0, 0.0], [-90.0, 70.0, 0.0, 302.0]];
    assert_eq!((found.rows.as_slice(), found.convention().0), (&expected[..], Some(Convention::Modified)));
    let radians = text.replace("90^\\circ", "\\frac{\\pi}{2}").replace("90^{\\circ}", "\\pi/2");
    let found = one("dh.txt", &radians);
    assert!(found.rows.iter().flatten().zip(expected.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
    // What stands for no number, another table of a robot, and one that does not end.
    let line = text.lines().position(|line| line.starts_with("2 &")).unwrap() + 1;
    assert!(said("dh.tex", &text.replace("& 25 &", "& $a_1$ &")).contains(&format!("dh.tex:{line}")));
    assert!(said("dh.tex", TEX).contains("is not a number"));
    let table = &text[text.find("\\begin{tabular}[t]").unwrap()..];
    assert!(said("dh.tex", &format!("{text}{table}")).contains("a second table begins here"));
    assert!(said("dh.tex", &text.replace("\\bottomrule\n\\end{tabular}", "")).contains("has no `\\end{tabular}`"));
}

#[test]
fn lists_in_one_line_are_rows_and_lists_of_too_few_parameters_are_named() {
    let json = "{\"name\": \"[3]\", \"dh\": [[0, 0, 0.2, 1.5708], [0, -0.3, 0, 0], [0, 0, 0.1, 0]], \"limits\": [[-3, 3], [-2, 2], [-1, 1]]}";
    let asked = Asked { columns: Some("theta,a,d,alpha"), ..Asked::default() };
    for text in [json.to_owned(), json.replace(", ", ",\n  "), format!("dh = {}", &json[22..])] {
        let found = of("dh.json", &text, asked).unwrap();
        assert_eq!((found[0].rows.len(), found[0].rows[1]), (3, [0.0, -300.0, 0.0, 0.0]), "{text}");
        assert!(of("dh.json", &text, Asked::default()).unwrap().len() > 1, "{text}");
    }
    // A row of another length.
    assert!(said("dh.json", &json.replace("0.1, 0]]", "0.1]]")).contains("is no row of 4 numbers"));
    let wide = said("dh.txt", "0 0 0.2 1.5708 0 -0.3 0 0\n");
    assert!(wide.contains("a row a joint") && !wide.contains("names all"), "{wide}");

    let vectors = "function [a, l, d] = dh()\n a = [0 -pi/2 0]; % twist\n l = [0 210 640];\n d = [0 0 480];\nend\n";
    let lacking = said("dh.m", vectors);
    assert!(
        lacking.contains("dh.m:2") && lacking.contains("without one called `alpha`; what is called `a` holds"),
        "{lacking}"
    );
    let named = one("dh.m", &vectors.replace(" a = ", " alpha = ").replace(" l = ", " a = "));
    assert_eq!(named.rows, [[0.0, 0.0, 0.0, 0.0], [-90.0, 210.0, 0.0, 0.0], [0.0, 640.0, 0.0, 480.0]]);
    assert!(!said("dh.m", &vectors.replace("d = [0 0 480]", "d = [0 480]")).contains("without one called"));
}

#[test]
fn deviations_from_a_table_are_none() {
    let text = "[mounting]\ndelta_theta = [ 1e-5, 0.2, -0.2]\ndelta_a = [ 2e-5, 0.3, 0.0]\ndelta_d = [ 1e-4, 80.5, -80.5]\ndelta_alpha = [ 3e-4, 0.001, 0.0]\n";
    for columns in [None, Some("alpha,a,theta"), Some("alpha,a,d,theta")] {
        let asked = Asked { columns, ..Asked::default() };
        let said = crate::diagnostic::report(&of("calibration.conf", text, asked).unwrap_err());
        assert!(said.contains("conf:2") && said.contains("deviations") && said.contains("kinematics.yaml"), "{said}");
    }
    assert_eq!(one("dh.conf", &text.replace("delta_", "")).rows.len(), 3);
}

#[test]
fn zero_offsets_that_may_be_a_posture_are_named() {
    let posture = "dh = [\n {'a': 0, 'alpha': pi/2, 'd': 0.3, 'theta': 0.1},\n {'a': 0.4, 'alpha': 0, 'd': 0, 'theta': 0.2 + pi/2},\n {'a': 0, 'alpha': 0, 'd': 0.1, 'theta': pi}]\n";
    let said = one("arm.py", posture).offsets.unwrap();
    assert!(said.contains("1 (5.73 deg), 2 (101.46 deg):") && said.contains("zero offsets"), "{said}");
    for drawn in [
        posture.replace("0.1}", "0}").replace("0.2 + pi/2", "1.57"),
        posture.replace("theta': ", "theta': q1 + "),
        posture.replace("0.1}", "0}").replace("0.2 + ", "-"),
    ] {
        assert_eq!(one("arm.py", &drawn).offsets, None, "{drawn}");
    }
    let table = |theta: &str| format!("alpha,a,{theta},d\n90,0,12.5,300\n0,400,0,0\n0,0,0,100\n");
    assert!(one("dh.csv", &table("theta")).offsets.is_some());
    assert_eq!(one("dh.csv", &table("theta offset")).offsets, None);
    assert_eq!(
        one("arm.m", "L(1) = Link('d', 0.3, 'alpha', pi/2, 'offset', 0.3);\nL(2) = Link('a', 0.4);\n").offsets,
        None
    );
}
