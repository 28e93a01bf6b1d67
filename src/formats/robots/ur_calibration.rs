//! `calibration.conf` of Universal Robots: deviations of a classic Denavit-Hartenberg table from the nominal one.
//!
//! The table has no place for Hayati's beta: nearly parallel axes are written by their common normal, as the maker
//! does, and d runs to metres there (its pairs cancel). Method: the identified axes in space, converted anew.

use std::fmt::Write as _;

use super::ExportedRobot;
use crate::robot::{Robot, axes};

/// Axes closer to parallel than this have no common normal to be found, rad; beta is lost there.
const PARALLEL_SIN: f64 = 1e-7;

/// What a file of deviations alone is told.
pub const HINT: &str = "`stereocal robot new ur5e` makes the nominal robot of an arm; the calibrated one has the file that ROS makes of the controller: \
                        `ros2 launch ur_calibration calibration_correction.launch.py robot_ip:=IP target_filename:=kinematics.yaml`, then `stereocal robot \
                        import kinematics.yaml`; or add each deviation to the maker's theta, a, d, alpha (rad, m) and import that table with `--dh classic`";

/// The line from which on a text holds such deviations, and what that is.
pub fn deviations(text: &str) -> Option<(u64, String)> {
    let at = |name: &str| {
        let is_it = |line: &str| {
            let behind = line
                .trim_start_matches(|c: char| c.is_whitespace() || matches!(c, '"' | '\'' | '{'))
                .strip_prefix(name);
            behind.is_some_and(|behind| behind.trim_start_matches(['"', '\'', ' ']).starts_with(['=', ':']))
        };
        text.lines().position(is_it)
    };
    let lines = ["delta_theta", "delta_a", "delta_d", "delta_alpha"].map(at);
    let first = lines.into_iter().collect::<Option<Vec<usize>>>()?.into_iter().min()?;
    let what = "these are deviations (delta_theta, delta_a, delta_d, delta_alpha), as in calibration.conf of Universal Robots, and no parameters: \
                what they are added to, the nominal arm, is not in the file";
    Some((first as u64 + 1, what.to_owned()))
}

/// The rows of a classic table: alpha and a behind the joint.
fn classic(robot: &Robot) -> Vec<[f64; 4]> {
    let after = robot.joints.iter().skip(1).map(|j| (j.alpha_rad, j.a_mm)).chain([(0.0, 0.0)]);
    robot.joints.iter().zip(after).map(|(j, (alpha, a))| [j.theta_rad, a, j.d_mm, alpha]).collect()
}

/// Writes the file. Neither robot has corrections; both have the joints of a UR.
pub fn build(robot: &Robot, nominal: &Robot) -> ExportedRobot {
    let zero = vec![0.0; robot.joints.len()];
    let mut carried = axes::robot_with(&robot.name, &robot.axes(), &robot.root_from_flange(&zero), PARALLEL_SIN);
    // What the format has no place for.
    carried.joints.iter_mut().for_each(|j| j.beta_rad = 0.0);
    if let Some(first) = carried.joints.first_mut() {
        (first.alpha_rad, first.a_mm) = (0.0, 0.0);
    }
    carried.ends = nominal.ends;
    let (found, drawn) = (classic(&carried), classic(nominal));
    let mut text = String::from("[mounting]\n");
    for (column, (name, unit)) in [("theta", 1.0), ("a", 1e-3), ("d", 1e-3), ("alpha", 1.0)].into_iter().enumerate() {
        let turns = column == 0 || column == 3;
        let delta = |(a, b): (&[f64; 4], &[f64; 4])| {
            let delta = a[column] - b[column];
            if turns { wrapped(delta) } else { delta * unit }
        };
        let list: Vec<String> = found.iter().zip(&drawn).map(delta).map(|v| format!("{:?}", v + 0.0)).collect();
        let _ = writeln!(text, "delta_{name} = [ {}]", list.join(", "));
    }
    let notes = vec!["no checksum: the controller takes the file only after its own tool has signed it".to_owned()];
    ExportedRobot { name: "calibration.conf", text, carried, notes }
}

/// An angle within half a turn.
fn wrapped(angle_rad: f64) -> f64 {
    let turns = (angle_rad / std::f64::consts::TAU).round();
    angle_rad - turns * std::f64::consts::TAU
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::catalogue::{self, Convention, from_rows};
    use crate::robot::refit::Residual;

    fn lists(text: &str) -> Vec<Vec<f64>> {
        let list = |line: &str| {
            let inner = line.split_once('[')?.1.trim_end_matches(']');
            inner.split(',').map(|v| v.trim().parse().ok()).collect::<Option<Vec<f64>>>()
        };
        text.lines().filter_map(list).collect()
    }

    #[test]
    fn deviations_are_told_from_parameters() {
        let nominal = catalogue::robot("ur5e").unwrap();
        let own = build(&nominal, &nominal).text;
        assert_eq!(deviations(&own).map(|(line, _)| line), Some(2));
        let controller = "[mounting]\ndelta_theta = [ 1.5e-08, 0.3]\ndelta_a = [ 2.5e-05, 0.01]\ndelta_d = [ 1e-05, 90.5]\ndelta_alpha = [ 1e-4, 2e-3]\n\
            joint_checksum = [ 0x1f, 0x2e]\n";
        assert!(deviations(controller).is_some_and(|(_, what)| what.contains("calibration.conf")));
        assert!(deviations(&controller.replace(" =", ":").replace("delta_a:", "'delta_a':")).is_some());
        for none in [controller.replace("delta_", ""), controller.replace("delta_alpha", "alpha"), String::new()] {
            assert_eq!(deviations(&none), None, "{none}");
        }
    }

    /// Read as a UR reads it: nominal table plus deltas, classic.
    #[test]
    fn the_table_with_its_deltas_is_the_identified_robot() {
        let nominal = catalogue::robot("ur5e").unwrap();
        let mut real = nominal.clone();
        for (k, joint) in real.joints.iter_mut().enumerate().skip(1) {
            joint.alpha_rad += 1e-3 * (k as f64).cos();
            joint.theta_rad += 2e-3 * (k as f64).sin();
            (joint.a_mm, joint.d_mm) = (joint.a_mm + 0.3, joint.d_mm - 0.2);
        }
        (real.joints[2].beta_rad, real.joints[3].beta_rad) = (8e-4, -5e-4);
        let exported = build(&real, &nominal);
        let l = lists(&exported.text);
        let rows: Vec<[f64; 4]> = classic(&nominal)
            .iter()
            .enumerate()
            .map(|(i, n)| {
                let [theta, a, d, alpha] = [n[0] + l[0][i], n[1] + 1e3 * l[1][i], n[2] + 1e3 * l[2][i], n[3] + l[3][i]];
                [alpha.to_degrees(), a, theta.to_degrees(), d]
            })
            .collect();
        let read = from_rows("read", Convention::Classic, &rows);
        let off = Residual::between(&real, &read);
        // Offsets of half a kilometre that cancel, along axes known to 1e-10 rad.
        assert!(off.max_mm < 1e-3 && off.max_rad < 1e-9, "{off:?}\n{}", exported.text);
        assert!(Residual::between(&real, &exported.carried).max_mm < 1e-3);
    }
}
