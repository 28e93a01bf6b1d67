//! What the joints do beyond the commanded angle: sag and bending under gravity, once- and twice-a-turn errors of the
//! drives, and axes that wobble as they turn.
//!
//! In: the commanded angles. Out: the small angle that is added to each of them, and how far each joint's bearing
//! tilts. Sag of joint j is its compliance times the torque of unit weights at origins of the chain and at the tool
//! about its axis, on the robot's own chain without corrections; the periodic errors are
//! `a sin q + b cos q + c sin 2q + d cos 2q`; a coupling is a ratio times the angle of another joint, or of the joint itself (an error of its scale).
//! Bending is what a bearing and the link before it yield across the joint's axis: a tilt about x and y of the link
//! (added to its alpha and beta) by the torque about these, with one compliance a joint. Wobble is the same tilt by the
//! joint's own angle: `(cos q, -sin q)` and `(sin q, cos q)` about x and y, an oval bearing; the tilt that turns with
//! the joint, `(cos q, sin q)`, is the twist of the next link. All are linear in their coefficients, so a pose
//! contributes constants (the features) and the coefficients are parameters. The direction of gravity must be known: a
//! robot on a wall needs its own.

use nalgebra::Vector3;

/// Where a unit weight hangs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum LoadPoint {
    /// The origin of a joint's frame, the joint counted from 0.
    Origin(usize),
    /// The target's mark point.
    Tool,
}

impl LoadPoint {
    /// Its name in files: `joint_3`, `tool`.
    pub fn name(self) -> String {
        match self {
            LoadPoint::Origin(joint) => format!("joint_{}", joint + 1),
            LoadPoint::Tool => "tool".to_owned(),
        }
    }

    /// The point of that name on a robot of so many joints. `elbow` and `wrist` are the third and the last but one
    /// joint.
    pub fn from_name(name: &str, joint_count: usize) -> Option<LoadPoint> {
        let joint = match name {
            "tool" => return Some(LoadPoint::Tool),
            "elbow" => 2,
            "wrist" => joint_count.checked_sub(2)?,
            _ => name.strip_prefix("joint_")?.parse::<usize>().ok()?.checked_sub(1)?,
        };
        (joint < joint_count).then_some(LoadPoint::Origin(joint))
    }
}

/// A joint yields to the torque of a unit weight: about its axis where it sags, across it where its bearing and the
/// link before bend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GravityTerm {
    /// The joint, from 0.
    pub joint: usize,
    /// Where the weight hangs.
    pub point: LoadPoint,
    /// Turn a metre of lever, rad.
    pub k_rad_per_m: f64,
}

/// What repeats with a joint's angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Wave {
    /// `sin q`
    Sin,
    /// `cos q`
    Cos,
    /// `sin 2q`
    Sin2,
    /// `cos 2q`
    Cos2,
}

impl Wave {
    /// All of them, in the order of the files.
    pub const ALL: [Wave; 4] = [Wave::Sin, Wave::Cos, Wave::Sin2, Wave::Cos2];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Wave::Sin => "sin",
            Wave::Cos => "cos",
            Wave::Sin2 => "sin2",
            Wave::Cos2 => "cos2",
        }
    }

    /// The tilt about x and y of a wobble at the commanded angle: this wave about x, with that which goes with it about
    /// y.
    pub fn across(self, q_rad: f64) -> [f64; 2] {
        let order = if matches!(self, Wave::Sin | Wave::Cos) { 1.0 } else { 2.0 };
        let (sin, cos) = (order * q_rad).sin_cos();
        match self {
            Wave::Cos | Wave::Cos2 => [cos, -sin],
            Wave::Sin | Wave::Sin2 => [sin, cos],
        }
    }

    /// Its value at the commanded angle.
    pub fn at(self, q_rad: f64) -> f64 {
        match self {
            Wave::Sin => q_rad.sin(),
            Wave::Cos => q_rad.cos(),
            Wave::Sin2 => (2.0 * q_rad).sin(),
            Wave::Cos2 => (2.0 * q_rad).cos(),
        }
    }
}

/// One wave of one joint: of its angle, or, where its axis wobbles, of the tilt about x of the link before (see
/// [`Wave::across`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HarmonicTerm {
    /// The joint, from 0.
    pub joint: usize,
    pub wave: Wave,
    pub amplitude_rad: f64,
}

/// A joint that moves by itself as another one moves, or that counts its own angle too long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CouplingTerm {
    /// The joint that moves, from 0.
    pub joint: usize,
    /// The joint that moves it, from 0; itself for an error of scale.
    pub of: usize,
    /// Way of the one over the commanded way of the other.
    pub ratio: f64,
}

/// All corrections of a robot; none by default.
#[derive(Debug, Clone, PartialEq)]
pub struct Corrections {
    /// Unit vector along gravity in the base frame.
    pub gravity_direction: Vector3<f64>,
    /// Sag.
    pub gravity: Vec<GravityTerm>,
    /// Bending across the joints' axes.
    pub bending: Vec<GravityTerm>,
    /// Periodic errors.
    pub harmonics: Vec<HarmonicTerm>,
    pub wobble: Vec<HarmonicTerm>,
    /// Scale and coupling.
    pub couplings: Vec<CouplingTerm>,
}

impl Default for Corrections {
    fn default() -> Corrections {
        Corrections {
            gravity_direction: Vector3::new(0.0, 0.0, -1.0),
            gravity: Vec::new(),
            bending: Vec::new(),
            harmonics: Vec::new(),
            wobble: Vec::new(),
            couplings: Vec::new(),
        }
    }
}

impl Corrections {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        let weights = self.gravity.is_empty() && self.bending.is_empty();
        weights && self.harmonics.is_empty() && self.wobble.is_empty() && self.couplings.is_empty()
    }

    /// Whether any goes by the angle of this joint, which says nothing of it at angles far from where it was found.
    pub fn follow(&self, joint: usize) -> bool {
        let is_wave = self.harmonics.iter().chain(&self.wobble).any(|t| t.joint == joint);
        is_wave || self.couplings.iter().any(|t| t.of == joint)
    }

    /// Whether a joint's link tilts.
    pub fn tilts(&self, joint: usize) -> bool {
        self.bending.iter().any(|t| t.joint == joint) || self.wobble.iter().any(|t| t.joint == joint)
    }
}
