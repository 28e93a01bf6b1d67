//! The three arms, and machines of them.

use nalgebra::Vector3;
use stereocal::robot::{Parameter, Robot, catalogue};
use stereocal::simulate::draws::{Draws, Purpose};

/// Standard deviations of a machine's lengths, mm, angles, mrad, and of the alignment of parallel axes, mrad.
const LENGTH_MM: f64 = 0.5;
const ANGLE_MRAD: f64 = 2.0;
const BETA_MRAD: f64 = 1.0;

/// Names and nominal robots, a target off the flange's axis on each.
pub fn arms() -> Vec<(&'static str, Robot)> {
    ["paper", "ur5e", "kuka-iiwa14"]
        .into_iter()
        .map(|name| {
            let mut robot = catalogue::robot(name).expect("a common arm");
            robot.tool_mm = Vector3::new(12.0, -8.0, 25.0);
            (name, robot)
        })
        .collect()
}

/// A machine: every parameter of the chain off, axes that should be parallel too.
pub fn deviated(nominal: &Robot, seed: u64) -> Robot {
    let mut draws = Draws::new(seed, Purpose::RobotErrors, 0);
    let mut parameters = nominal.mdh_parameters();
    parameters.extend(nominal.beta_parameters());
    let off = |p: &Parameter| match p {
        Parameter::A(_) | Parameter::D(_) | Parameter::V(_) => LENGTH_MM,
        Parameter::Beta(_) => BETA_MRAD,
        _ => ANGLE_MRAD,
    };
    let offsets: Vec<f64> = parameters.iter().map(|p| off(p) * draws.normal()).collect();
    nominal.shifted(&parameters, &offsets)
}
