//! Which terms the robot's model has beyond MDH, and the ladder on which they are tried.

use crate::robot::{Parameter, Robot};

/// Terms beyond MDH.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct Terms {
    /// Hayati's rotation for parallel axes.
    pub beta: bool,
    /// 0 none, 1 the arm's own weight, 2 the load's too.
    pub gravity: usize,
    /// 0 none, 1 once a turn, 2 twice a turn too.
    pub harmonics: usize,
}

impl Terms {
    /// The parameters of the robot with these terms.
    pub fn parameters(&self, robot: &Robot) -> Vec<Parameter> {
        let mut parameters = robot.mdh_parameters();
        if self.beta {
            parameters.extend(robot.beta_parameters());
        }
        if self.gravity > 0 {
            parameters.extend(robot.gravity_parameters(self.gravity > 1));
        }
        if self.harmonics > 0 {
            parameters.extend(robot.harmonic_parameters(self.harmonics));
        }
        parameters
    }

    /// In words.
    pub fn name(&self) -> String {
        let mut name = "MDH".to_owned();
        if self.beta {
            name.push_str(" + beta");
        }
        match self.gravity {
            0 => {}
            1 => name.push_str(" + gravity (arm)"),
            _ => name.push_str(" + gravity (arm, load)"),
        }
        if self.harmonics > 0 {
            name.push_str(&format!(" + harmonics ({})", self.harmonics));
        }
        name
    }

    /// What is tried next from here, rung by rung; each rung is judged against the best so far.
    pub fn rungs(robot: &Robot) -> Vec<fn(Terms) -> Terms> {
        let mut rungs: Vec<fn(Terms) -> Terms> = Vec::new();
        if !robot.beta_parameters().is_empty() {
            rungs.push(|t| Terms { beta: true, ..t });
        }
        if !robot.gravity_parameters(false).is_empty() {
            rungs.push(|t| Terms { gravity: 1, ..t });
        }
        if !robot.gravity_parameters(true).is_empty() {
            rungs.push(|t| Terms { gravity: 2, ..t });
        }
        rungs.push(|t| Terms { harmonics: 1, ..t });
        rungs.push(|t| Terms { harmonics: 2, ..t });
        rungs
    }
}
