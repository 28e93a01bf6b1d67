//! Common arms from their makers' published tables.
//!
//! Angles are those of the maker's own zero position and signs, so that the numbers on the pendant are the readings.
//! Classic tables (`T_i = Rz(q + theta) Tz(d) Tx(a) Rx(alpha)`) are kept as they are published and converted here:
//! alpha and a move to the next joint's row, and those of the last row to the flange. Where a maker publishes a drawing
//! instead of a table the rows follow from it. A robot file is a start: a machine's serial number decides about limits
//! and options, so hold `robot show` against the pendant.

use super::arm::{Arm, Convention};
use crate::robot::Robot;

const UR_LIMITS: [f64; 2] = [-360.0, 360.0];
const UR_SOURCE: &str = "Universal Robots, \"DH parameters for calculations of kinematics and dynamics\"";

macro_rules! ur {
    ($name:literal, $title:literal, $d1:literal, $a2:literal, $a3:literal, $d4:literal, $d5:literal, $d6:literal) => {
        Arm {
            name: $name,
            title: $title,
            source: UR_SOURCE,
            note: "a calibrated machine reports other numbers; `export robot --format ur-calibration` writes them",
            convention: Convention::Classic,
            joints: &[
                ([90.0, 0.0, 0.0, $d1], UR_LIMITS),
                ([0.0, $a2, 0.0, 0.0], UR_LIMITS),
                ([0.0, $a3, 0.0, 0.0], UR_LIMITS),
                ([90.0, 0.0, 0.0, $d4], UR_LIMITS),
                ([-90.0, 0.0, 0.0, $d5], UR_LIMITS),
                ([0.0, 0.0, 0.0, $d6], UR_LIMITS),
            ],
            flange_deg: [0.0; 3],
            coupled: &[],
        }
    };
}

const IRB1200_SOURCE: &str = "ABB, product specification IRB 1200 (3HAC046982), dimensions and working range";

macro_rules! abb {
    ($name:literal, $title:literal, $source:expr, [$d1:literal, $a2:literal, $a3:literal, $d4:literal, $d6:literal], $limits:expr) => {
        Arm {
            name: $name,
            title: $title,
            source: $source,
            note: "",
            convention: Convention::Modified,
            joints: &[
                ([0.0, 0.0, 0.0, $d1], $limits[0]),
                ([-90.0, 0.0, -90.0, 0.0], $limits[1]),
                ([0.0, $a2, 0.0, 0.0], $limits[2]),
                ([-90.0, $a3, 0.0, $d4], $limits[3]),
                ([90.0, 0.0, 0.0, 0.0], $limits[4]),
                ([-90.0, 0.0, 0.0, $d6], $limits[5]),
            ],
            flange_deg: [0.0, 0.0, 180.0],
            coupled: &[],
        }
    };
}

/// All of them, by name.
pub const ARMS: &[Arm] = &[
    abb!(
        "abb-irb120",
        "ABB IRB 120-3/0.6",
        "ABB, product specification IRB 120 (3HAC035960), dimensions and working range",
        [290.0, 270.0, 70.0, 302.0, 72.0],
        [[-165.0, 165.0], [-110.0, 110.0], [-110.0, 70.0], [-160.0, 160.0], [-120.0, 120.0], [-400.0, 400.0]]
    ),
    abb!(
        "abb-irb1200-5-0.9",
        "ABB IRB 1200-5/0.9",
        IRB1200_SOURCE,
        [399.1, 448.0, 42.0, 451.0, 82.0],
        [[-170.0, 170.0], [-100.0, 130.0], [-200.0, 70.0], [-270.0, 270.0], [-130.0, 130.0], [-360.0, 360.0]]
    ),
    abb!(
        "abb-irb1200-7-0.7",
        "ABB IRB 1200-7/0.7",
        IRB1200_SOURCE,
        [399.1, 350.0, 42.0, 351.0, 82.0],
        [[-170.0, 170.0], [-100.0, 135.0], [-200.0, 70.0], [-270.0, 270.0], [-130.0, 130.0], [-360.0, 360.0]]
    ),
    Arm {
        name: "fanuc-lrmate200id",
        title: "Fanuc LR Mate 200iD",
        source: "Fanuc, LR Mate 200iD data sheet, dimensions and motion range; base at the mounting plane",
        note: "the pendant's J3 counts from the level, not from link 2: [couplings] adds J2 to it",
        convention: Convention::Modified,
        joints: &[
            ([0.0, 0.0, 0.0, 330.0], [-170.0, 170.0]),
            ([-90.0, 50.0, -90.0, 0.0], [-100.0, 145.0]),
            ([180.0, 330.0, 0.0, 0.0], [-140.0, 280.0]),
            ([-90.0, 35.0, 0.0, -335.0], [-190.0, 190.0]),
            ([90.0, 0.0, 0.0, 0.0], [-125.0, 125.0]),
            ([-90.0, 0.0, 0.0, -80.0], [-360.0, 360.0]),
        ],
        flange_deg: [180.0, 0.0, 0.0],
        coupled: &[(2, 1)],
    },
    Arm {
        name: "franka-panda",
        title: "Franka Emika Panda / Research 3",
        source: "Franka Robotics, FCI documentation, \"Denavit-Hartenberg parameters\" (Craig's) and joint limits of the Panda",
        note: "the flange, without a hand; the Research 3 has narrower limits",
        convention: Convention::Modified,
        joints: &[
            ([0.0, 0.0, 0.0, 333.0], [-166.0, 166.0]),
            ([-90.0, 0.0, 0.0, 0.0], [-101.0, 101.0]),
            ([90.0, 0.0, 0.0, 316.0], [-166.0, 166.0]),
            ([90.0, 82.5, 0.0, 0.0], [-176.0, -4.0]),
            ([-90.0, -82.5, 0.0, 384.0], [-166.0, 166.0]),
            ([90.0, 0.0, 0.0, 0.0], [-1.0, 215.0]),
            ([90.0, 88.0, 0.0, 107.0], [-166.0, 166.0]),
        ],
        flange_deg: [0.0; 3],
        coupled: &[],
    },
    Arm {
        name: "kuka-iiwa14",
        title: "KUKA LBR iiwa 14 R820",
        source: "KUKA, LBR iiwa 14 R820 specification, dimensions and axis ranges",
        note: "the bare flange; a media flange adds to d_7",
        convention: Convention::Classic,
        joints: &[
            ([-90.0, 0.0, 0.0, 360.0], [-170.0, 170.0]),
            ([90.0, 0.0, 0.0, 0.0], [-120.0, 120.0]),
            ([90.0, 0.0, 0.0, 420.0], [-170.0, 170.0]),
            ([-90.0, 0.0, 0.0, 0.0], [-120.0, 120.0]),
            ([-90.0, 0.0, 0.0, 400.0], [-170.0, 170.0]),
            ([90.0, 0.0, 0.0, 0.0], [-120.0, 120.0]),
            ([0.0, 0.0, 0.0, 126.0], [-175.0, 175.0]),
        ],
        flange_deg: [0.0; 3],
        coupled: &[],
    },
    Arm {
        name: "kuka-kr6-r900",
        title: "KUKA KR 6 R900 sixx",
        source: "KUKA, KR AGILUS sixx specification, dimensions and axis data",
        note: "",
        convention: Convention::Modified,
        joints: &[
            ([180.0, 0.0, 0.0, -400.0], [-170.0, 170.0]),
            ([90.0, 25.0, 0.0, 0.0], [-190.0, 45.0]),
            ([0.0, 455.0, -90.0, 0.0], [-120.0, 156.0]),
            ([90.0, 35.0, 0.0, -420.0], [-185.0, 185.0]),
            ([-90.0, 0.0, 0.0, 0.0], [-120.0, 120.0]),
            ([90.0, 0.0, 180.0, -80.0], [-350.0, 350.0]),
        ],
        flange_deg: [180.0, 0.0, 0.0],
        coupled: &[],
    },
    ur!("ur10", "Universal Robots UR10", 127.3, -612.0, -572.3, 163.941, 115.7, 92.2),
    ur!("ur10e", "Universal Robots UR10e", 180.7, -612.7, -571.55, 174.15, 119.85, 116.55),
    ur!("ur16e", "Universal Robots UR16e", 180.7, -478.4, -360.0, 174.15, 119.85, 116.55),
    ur!("ur3", "Universal Robots UR3", 151.9, -243.65, -213.25, 112.35, 85.35, 81.9),
    ur!("ur3e", "Universal Robots UR3e", 151.85, -243.55, -213.2, 131.05, 85.35, 92.1),
    ur!("ur5", "Universal Robots UR5", 89.159, -425.0, -392.25, 109.15, 94.65, 82.3),
    ur!("ur5e", "Universal Robots UR5e", 162.5, -425.0, -392.2, 133.3, 99.7, 99.6),
    Arm {
        name: "yaskawa-gp7",
        title: "Yaskawa Motoman GP7",
        source: "Yaskawa, MOTOMAN-GP7 specification, dimensions and range of motion; base at the mounting plane",
        note: "",
        convention: Convention::Modified,
        joints: &[
            ([0.0, 0.0, 0.0, 330.0], [-170.0, 170.0]),
            ([-90.0, 40.0, -90.0, 0.0], [-65.0, 145.0]),
            ([180.0, 445.0, 0.0, 0.0], [-70.0, 190.0]),
            ([-90.0, 40.0, 0.0, -440.0], [-190.0, 190.0]),
            ([90.0, 0.0, 0.0, 0.0], [-135.0, 135.0]),
            ([-90.0, 0.0, 0.0, -80.0], [-360.0, 360.0]),
        ],
        flange_deg: [180.0, 0.0, 0.0],
        coupled: &[],
    },
];

/// The name of the paper's robot, which is not among [`ARMS`].
pub const PAPER: &str = "paper";

/// Ranges for the paper's robot, deg either way. The paper gives none; these are a common arm's.
const PAPER_LIMITS_DEG: [f64; 6] = [175.0, 130.0, 150.0, 175.0, 175.0, 175.0];

/// The paper's robot, with ranges for its joints.
pub fn paper() -> Robot {
    Robot::paper().within(&PAPER_LIMITS_DEG.map(|most| ((-most).to_radians(), most.to_radians())))
}

/// The arm of a name, as its maker delivers it.
pub fn robot(name: &str) -> Option<Robot> {
    let name = name.to_ascii_lowercase();
    if name == PAPER {
        return Some(paper());
    }
    ARMS.iter().find(|arm| arm.name == name).map(Arm::robot)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Transform;
    use nalgebra::{Point3, Vector3};

    fn flange(name: &str, deg: &[f64]) -> Transform {
        let joints: Vec<f64> = deg.iter().map(|d| d.to_radians()).collect();
        robot(name).unwrap().root_from_flange(&joints)
    }

    /// Flange positions that the makers' drawings give for the zero position, mm, and where its z and x look there.
    #[test]
    fn at_zero_every_arm_stands_as_in_its_drawing() {
        let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
        for (name, at, looks, across) in [
            ("abb-irb120", [374.0, 0.0, 630.0], x, -z),
            ("abb-irb1200-5-0.9", [533.0, 0.0, 889.1], x, -z),
            ("abb-irb1200-7-0.7", [433.0, 0.0, 791.1], x, -z),
            ("fanuc-lrmate200id", [465.0, 0.0, 695.0], x, z),
            ("kuka-kr6-r900", [980.0, 0.0, 435.0], x, -z),
            ("kuka-iiwa14", [0.0, 0.0, 1306.0], z, x),
            ("yaskawa-gp7", [560.0, 0.0, 815.0], x, z),
            ("franka-panda", [88.0, 0.0, 926.0], -z, x),
            ("ur5", [-817.25, -191.45, -5.491], -y, x),
            ("ur5e", [-817.2, -232.9, 62.8], -y, x),
        ] {
            let joints = robot(name).unwrap().joints.len();
            let found = flange(name, &vec![0.0; joints]);
            assert!((found * Point3::origin() - Point3::from(at)).norm() < 1e-9, "{name}: {}", found.translation);
            assert!((found.rotation * z - looks).norm() < 1e-12, "{name}: {}", found.rotation * z);
            assert!((found.rotation * x - across).norm() < 1e-12, "{name}: {}", found.rotation * x);
        }
    }

    /// The makers' signs: which way the flange goes when one joint turns by 10 degrees from zero (arms that stand
    /// upright there).
    #[test]
    fn joints_turn_the_way_that_their_maker_says() {
        for (name, joint, expected) in [
            ("abb-irb120", 0, Vector3::y()),
            ("abb-irb120", 2, -Vector3::z()),
            ("kuka-kr6-r900", 0, -Vector3::y()),
            ("kuka-kr6-r900", 1, -Vector3::z()),
            ("kuka-kr6-r900", 2, -Vector3::z()),
            ("fanuc-lrmate200id", 0, Vector3::y()),
            ("fanuc-lrmate200id", 1, Vector3::x()),
            ("fanuc-lrmate200id", 2, Vector3::z()),
            ("yaskawa-gp7", 1, Vector3::x()),
            ("yaskawa-gp7", 2, Vector3::z()),
        ] {
            let mut deg = [0.0; 6];
            deg[joint] = 10.0;
            let moved = flange(name, &deg).translation.vector - flange(name, &[0.0; 6]).translation.vector;
            assert!(moved.normalize().dot(&expected) > 0.5, "{name} joint {}: {moved}", joint + 1);
        }
    }

    #[test]
    fn every_arm_has_limits_that_hold_zero_or_say_why_not() {
        for arm in ARMS {
            let without_zero = arm.joints.iter().filter(|(_, [low, high])| *low > 0.0 || *high < 0.0).count();
            assert_eq!(without_zero, usize::from(arm.name == "franka-panda"), "{}", arm.name);
        }
    }
}
