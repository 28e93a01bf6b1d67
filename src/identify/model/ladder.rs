//! The ladder of models: nominal, tool, joint offsets, MDH, and the terms beyond.

use crate::robot::{Parameter, Robot};

/// How much of the MDH chain may move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Chain {
    Nominal,
    /// The target point.
    Tool,
    /// The target point and the offsets of the joints.
    Offsets,
    /// All MDH parameters.
    #[default]
    Mdh,
}

/// A model of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct Terms {
    /// The chain's own parameters.
    pub chain: Chain,
    /// Hayati's rotation for parallel axes.
    pub beta: bool,
    /// 0 none, 1 the arm's own weight, 2 the load's too, 3 and what bearings and links yield across the axes.
    pub gravity: usize,
    /// 0 none, 1 scale of each joint, 2 coupling to the joint before it too.
    pub couplings: usize,
    /// 0 none, 1 once a turn, 2 twice a turn too.
    pub harmonics: usize,
    /// Axes that tilt as they turn.
    pub wobble: bool,
}

impl Terms {
    /// The nominal robot.
    pub const NOMINAL: Terms =
        Terms { chain: Chain::Nominal, beta: false, gravity: 0, couplings: 0, harmonics: 0, wobble: false };

    pub const ALL: Terms =
        Terms { chain: Chain::Mdh, beta: true, gravity: 3, couplings: 2, harmonics: 2, wobble: true };

    /// What gross errors and sessions are looked for with.
    pub const REFERENCE: Terms =
        Terms { chain: Chain::Mdh, beta: true, gravity: 1, couplings: 0, harmonics: 0, wobble: false };

    /// The parameters of the robot with these terms.
    pub fn parameters(&self, robot: &Robot) -> Vec<Parameter> {
        let mut parameters = robot.mdh_parameters();
        parameters.retain(|p| match p {
            Parameter::V(_) => self.chain >= Chain::Tool,
            Parameter::Theta(i) if !robot.joints[*i].slides => self.chain >= Chain::Offsets,
            Parameter::D(i) if robot.joints[*i].slides => self.chain >= Chain::Offsets,
            _ => self.chain >= Chain::Mdh,
        });
        if self.beta {
            parameters.extend(robot.beta_parameters());
        }
        if self.gravity > 0 {
            parameters.extend(robot.gravity_parameters(self.gravity > 1));
        }
        if self.gravity > 2 {
            parameters.extend(robot.bending_parameters());
        }
        if self.couplings > 0 {
            parameters.extend(robot.coupling_parameters(self.couplings > 1));
        }
        if self.harmonics > 0 {
            parameters.extend(robot.harmonic_parameters(self.harmonics));
        }
        if self.wobble {
            parameters.extend(robot.wobble_parameters());
        }
        parameters
    }

    /// Whether it has all that another one has.
    pub fn contains(&self, other: &Terms) -> bool {
        self.chain >= other.chain
            && self.beta >= other.beta
            && self.gravity >= other.gravity
            && self.couplings >= other.couplings
            && self.harmonics >= other.harmonics
            && self.wobble >= other.wobble
    }

    /// In words.
    pub fn name(&self) -> String {
        let mut name = match self.chain {
            Chain::Nominal => "nominal",
            Chain::Tool => "tool",
            Chain::Offsets => "tool + joint offsets",
            Chain::Mdh => "MDH",
        }
        .to_owned();
        if self.beta {
            name.push_str(" + beta");
        }
        match self.gravity {
            0 => {}
            1 => name.push_str(" + gravity (arm)"),
            2 => name.push_str(" + gravity (arm, load)"),
            _ => name.push_str(" + gravity (arm, load) and bending"),
        }
        match self.couplings {
            0 => {}
            1 => name.push_str(" + joint scale"),
            _ => name.push_str(" + joint scale and coupling"),
        }
        if self.harmonics > 0 {
            name.push_str(&format!(" + harmonics ({})", self.harmonics));
        }
        if self.wobble {
            name.push_str(" + wobble");
        }
        name
    }

    /// What can be tried from here: every richer chain, and with the whole chain every term that is not taken yet.
    /// Rungs that failed from a poorer model are tried again from a richer one; below the whole chain every term is
    /// also tried together with it.
    pub fn successors(&self, robot: &Robot) -> Vec<Terms> {
        let chains = [Chain::Tool, Chain::Offsets, Chain::Mdh];
        let mut next: Vec<Terms> =
            chains.into_iter().filter(|c| *c > self.chain).map(|chain| Terms { chain, ..*self }).collect();
        if self.chain < Chain::Mdh {
            // What a heavy, crooked or unround arm needs before anything else pays.
            let mdh = Terms { chain: Chain::Mdh, ..*self };
            next.extend(mdh.successors(robot));
            next.push(Terms { beta: true, gravity: 1, ..mdh });
        }
        if self.chain == Chain::Mdh {
            next.push(Terms { beta: true, ..*self });
            next.extend((self.gravity + 1..=3).map(|gravity| Terms { gravity, ..*self }));
            next.extend((self.couplings + 1..=2).map(|couplings| Terms { couplings, ..*self }));
            next.extend((self.harmonics + 1..=2).map(|harmonics| Terms { harmonics, ..*self }));
            next.push(Terms { wobble: true, ..*self });
        }
        let count = self.parameters(robot).len();
        next.retain(|t| t.parameters(robot).len() > count);
        next
    }
}
