//! The robot at the poses of a data set, as a function of the offsets of chosen parameters.
//!
//! In: offsets in mm and mrad. Out: the target's point and the flange's rotation at every pose, base frame, and their
//! derivatives. Features of the corrections (levers, waves) are constants of the pose; the chain that levers are taken on is given,
//! so that a fit can end on its own.

use nalgebra::{Matrix3, Matrix3xX, Point3, Vector3};

use crate::robot::bent::{Bent, Torques};
use crate::robot::jacobian::{Feature, Links, Screws, Turn, feature};
use crate::robot::{Joint, Parameter, Robot};

/// A robot at fixed commanded poses with chosen parameters free.
#[derive(Debug, Clone)]
pub struct Kinematics {
    /// The robot whose parameters are offset.
    pub nominal: Robot,
    /// The free parameters.
    pub parameters: Vec<Parameter>,
    /// Places among the parameters of those that act otherwise at each pose, and what they do there.
    acts: Vec<(usize, Act)>,
    poses: Vec<PoseConstants>,
}

/// What a correction does at a pose, to which joint.
#[derive(Debug, Clone, Copy)]
enum Act {
    Tilts(usize),
    Turns(usize),
}

impl Act {
    fn of(parameter: Parameter) -> Option<Act> {
        let turns = || parameter.corrected_joint().map(Act::Turns);
        parameter.tilted_joint().map(Act::Tilts).or_else(turns)
    }
}

#[derive(Debug, Clone)]
struct PoseConstants {
    /// Angles with the nominal robot's own corrections, rad.
    angles_rad: Vec<f64>,
    /// The nominal robot's turns of its joints.
    turns: Vec<Turn>,
    /// What the nominal robot's own bending and wobble add to alpha and beta, one a joint, rad; empty without.
    tilts_rad: Vec<[f64; 2]>,
    /// One a parameter.
    features: Vec<Feature>,
}

/// Where the target is at one pose, and how that changes.
#[derive(Debug, Clone)]
pub struct Place {
    /// Base frame, mm.
    pub point_mm: Point3<f64>,
    /// `base_from_flange`.
    pub rotation: Matrix3<f64>,
    /// Derivatives of the point, a column a parameter, mm per mm or mrad; empty unless asked for.
    pub point_columns: Matrix3xX<f64>,
    /// Derivatives of the rotation (rotation vector, base frame), rad per mm or mrad; empty unless asked for.
    pub rotation_columns: Matrix3xX<f64>,
}

impl Kinematics {
    /// `joints_rad`: one vector of commanded angles a pose, of the robot's joint count.
    /// Weights have their levers on the chain of `load_chain`.
    pub fn new(nominal: &Robot, load_chain: &Robot, parameters: &[Parameter], joints_rad: &[&[f64]]) -> Kinematics {
        let constants = |q: &&[f64]| {
            let torques = Torques::new(load_chain, q);
            let bent = nominal.bent_with(q, &torques);
            let tilt = |(b, n): (&Joint, &Joint)| [b.alpha_rad - n.alpha_rad, b.beta_rad - n.beta_rad];
            let tilts_rad = match (0..nominal.joints.len()).any(|joint| nominal.corrections.tilts(joint)) {
                false => Vec::new(),
                true => bent.joints.iter().zip(&nominal.joints).map(tilt).collect(),
            };
            let turn = |(joint, &q): (&Joint, &f64)| Turn::new(joint.turn_rad(q));
            PoseConstants {
                turns: nominal.joints.iter().zip(&bent.joints_rad).map(turn).collect(),
                angles_rad: bent.joints_rad,
                tilts_rad,
                features: parameters.iter().map(|&p| feature(p, &torques, q)).collect(),
            }
        };
        let poses = joints_rad.iter().map(constants).collect();
        let acts = parameters.iter().enumerate().filter_map(|(k, &p)| Act::of(p).map(|act| (k, act))).collect();
        Kinematics { nominal: nominal.clone(), parameters: parameters.to_vec(), acts, poses }
    }

    /// Every pose, with derivatives where asked.
    pub fn places(&self, offsets: &[f64], derivatives: bool) -> Vec<Place> {
        let robot = self.nominal.shifted(&self.parameters, offsets);
        let links = Links::new(&robot.joints);
        let mut bent = Bent { joints: Vec::new(), joints_rad: Vec::new() };
        let place = |pose: &PoseConstants| {
            self.bend(&robot, pose, offsets, &mut bent);
            if derivatives {
                return self.with_columns(&robot, &links, pose, &bent);
            }
            let (rotation, point_mm) = links.end(&bent, &pose.turns, &robot.tool_mm);
            Place { point_mm, rotation, point_columns: Matrix3xX::zeros(0), rotation_columns: Matrix3xX::zeros(0) }
        };
        self.poses.iter().map(place).collect()
    }

    /// The robot as it stands at a pose.
    fn bend(&self, robot: &Robot, pose: &PoseConstants, offsets: &[f64], bent: &mut Bent) {
        bent.joints.clone_from(&robot.joints);
        bent.joints_rad.clone_from(&pose.angles_rad);
        for (joint, tilt) in pose.tilts_rad.iter().enumerate() {
            bent.tilt(joint, *tilt);
        }
        for &(k, act) in &self.acts {
            let (offset, feature) = (offsets[k] / 1000.0, pose.features[k]);
            match act {
                Act::Tilts(joint) => bent.tilt(joint, feature.map(|f| offset * f)),
                Act::Turns(joint) => {
                    if let Some(angle) = bent.joints_rad.get_mut(joint) {
                        *angle += offset * feature[0];
                    }
                }
            }
        }
    }

    fn with_columns(&self, robot: &Robot, links: &Links, pose: &PoseConstants, bent: &Bent) -> Place {
        let screws = Screws::with_links(bent, &robot.tool_mm, links, &pose.turns);
        let columns = |of: &dyn Fn(Parameter, Feature) -> Vector3<f64>| {
            let all = self.parameters.iter().zip(&pose.features).map(|(&p, &f)| of(p, f));
            Matrix3xX::from_iterator(self.parameters.len(), all.flat_map(<[f64; 3]>::from))
        };
        Place {
            point_mm: screws.target_mm,
            rotation: screws.base_from_flange,
            point_columns: columns(&|p, f| screws.point_column(p, f)),
            rotation_columns: columns(&|p, f| screws.rotation_column(p, f)),
        }
    }
}
