//! What a table says of a joint's zero and of the way in which it counts.

use super::*;
use crate::robot::Robot;

fn thetas(found: &Reading) -> Vec<f64> {
    found.rows.iter().map(|row| row[2]).collect()
}

#[test]
fn zero_offsets_have_a_column_of_their_own() {
    let table = "link;alpha;a (cm);d (cm);offset;qmin;qmax\n1;-90;12,0;38,0;0;-165;165\n2;0;55,0;0;-90;-80;120\n3;90;0;9,5;0;-340;340\n";
    let found = one("dh.csv", table);
    assert_eq!(found.rows, [[-90.0, 120.0, 0.0, 380.0], [0.0, 550.0, -90.0, 0.0], [90.0, 0.0, 0.0, 95.0]]);
    assert_eq!((found.limits_deg[1], found.columns.as_str()), (Some((-80.0, 120.0)), "alpha,a,d,theta"));
    // Beside the joint's variable, or beside zeros that stand for it.
    let both = |theta: [&str; 3], offset: [&str; 3]| {
        let row = |(k, head): (usize, &str)| format!("{},{head},{}\n", theta[k], offset[k]);
        let rows: String = ["310,0,90", "0,420,0", "80,0,0"].into_iter().enumerate().map(row).collect();
        format!("theta,d,a,alpha,offset\n{rows}")
    };
    let variables = ["q1", "q2", "q3"];
    for theta in [variables, ["0"; 3]] {
        assert_eq!(thetas(&one("dh.csv", &both(theta, ["0", "-90", "180"]))), [0.0, -90.0, 180.0]);
    }
    assert_eq!(thetas(&one("dh.csv", &both(["q1", "q2 - 90", "q3"], ["0"; 3]))), [0.0, -90.0, 0.0]);
    for theta in [["q1", "q2 - 90", "q3"], ["0", "-90", "0"], ["q1", "-q2", "q3"], ["q1", "q2", "0"]] {
        let said = said("dh.csv", &both(theta, ["0", "90", "0"]));
        assert!(said.contains("`theta` and `offset` both") && said.contains("--columns"), "{said}");
    }
    // Without another column for d it is the link's.
    let drawn = "theta,offset,a,alpha\nq1,310,0,90\nq2,0,420,0\nq3,80,0,0\n";
    assert_eq!(one("dh.csv", drawn).rows[0], [90.0, 0.0, 0.0, 310.0]);
    assert!(said("dh.csv", &drawn.replace("a,alpha", "d,alpha")).contains("no column `a_mm`"));
    let twice = "theta,θ,d,a,alpha,offset\n0,0,310,0,90,0\n0,0,0,420,0,90\n";
    assert!(said("dh.csv", twice).contains("two columns `theta`"));
    let sliding = "alpha,a,d,offset,type\n0,0,310,0,R\n90,0,50,20,P\n90,0,0,0,R\n";
    assert!(said("dh.csv", sliding).contains("`20` is of a joint that slides"));
    // What settles it is named.
    assert!(said("dh.csv", "alpha,a,d,phi\n90,0,310,0\n0,420,0,90\n").contains("`--columns NAME,NAME,...`"));
}

#[test]
fn a_variable_with_a_minus_is_of_a_joint_that_counts_the_other_way() {
    let table = "joint,theta,d,a,alpha\n1,q1,410,120,-90\n2,q2-90,0,560,0\n3,-q3,0,90,-90\n4,180 - q4,85,0,0\n";
    let found = one("dh.csv", table);
    assert!(found.said.contains(", counted the other way: 3, 4"), "{}", found.said);
    assert_eq!(thetas(&found), [0.0, -90.0, 0.0, 180.0]);
    let robot = found.robot("arm", Convention::Classic);
    assert_eq!(robot.joints.iter().map(|joint| joint.sign).collect::<Vec<_>>(), [1.0, 1.0, -1.0, -1.0]);
    let plain = one("dh.csv", &table.replace("-q3", "q3").replace("180 - q4", "q4 + 180"));
    assert!(!plain.said.contains("other way"), "{}", plain.said);
    let plain = plain.robot("arm", Convention::Classic);
    let at = |robot: &Robot, q: [f64; 4]| robot.root_from_flange(&q);
    let apart = at(&robot, [0.2, 0.3, 0.4, 0.5]).inverse() * at(&plain, [0.2, 0.3, -0.4, -0.5]);
    assert!(apart.translation.vector.norm() < 1e-9 && apart.rotation.angle() < 1e-9);
    // Without names, and of the one that slides; two variables, or a multiple of one, are no joint's.
    let bare = all(&table.split_once('\n').unwrap().1.replace("1,q1", "1,-q1")).unwrap();
    assert!(bare.iter().any(|way| way.columns == "theta,d,a,alpha" && way.flipped == [true, false, true, true]));
    let slides = "theta,d,a,alpha,type\nq1,0,300,0,R\nq2,0,250,180,R\n0,40-q3,0,0,P\n";
    assert_eq!(one("dh.csv", slides).flipped, [false, false, true]);
    for odd in ["q3-q2", "q2+q3", "-2*q3"] {
        assert!(said("dh.csv", &table.replace("-q3", odd)).contains(&format!("`{odd}` is not a number")));
    }
}

#[test]
fn tables_of_this_program_are_modified_ones_and_may_hold_a_posture() {
    let own = |theta: &str| {
        format!("alpha_deg,a_mm,theta_deg,d_mm\n0,0,{theta},410\n-90,120,-91.3,0\n0,560,0.8,0\n-90,85,0,600\n")
    };
    let found = one("dh.csv", &own("2.1"));
    assert_eq!(found.convention(), (Some(Convention::Modified), "the names are of this program's tables".to_owned()));
    // Zeros that were identified are near to those of the drawing, angles of a posture are not.
    assert_eq!(found.offsets, None);
    assert!(one("dh.csv", &own("12.5")).offsets.is_some_and(|said| said.contains("joints 1 (12.50 deg):")));
    // What is written is read back, whatever its ends look like.
    let mut robot = found.robot("arm", Convention::Modified);
    for [first, last] in [[0.0, -1.5], [1.5, 0.0], [1.5, 1.5], [0.0, 0.0]] {
        (robot.joints[0].alpha_rad, robot.joints[3].alpha_rad) = (first, last);
        robot.joints[3].a_mm = 0.0;
        let back = one("dh.csv", &to_csv(&robot));
        assert_eq!(back.convention().0, Some(Convention::Modified), "{first} {last}");
        let back = back.robot("arm", Convention::Modified);
        let q = [0.2, 0.3, 0.4, 0.5];
        let apart = robot.root_from_flange(&q).inverse() * back.root_from_flange(&q);
        assert!(apart.translation.vector.norm() < 1e-9 && apart.rotation.angle() < 1e-9);
    }
}
