//! The robot at the poses of a data set, as a function of the offsets of chosen parameters.
//!
//! In: offsets in mm and mrad. Out: the target's point and the flange's rotation at every pose, base frame, and their
//! derivatives. Features of the corrections (levers, waves) are constants of the pose; the chain that levers are taken on is given,
//! so that a fit can end on its own.

use nalgebra::{Matrix3, Matrix3xX, Point3, Vector3};
use rayon::prelude::*;

use crate::robot::bent::{Bent, Torques};
use crate::robot::jacobian::{Feature, Links, Screws, Turn, feature};
use crate::robot::lanes::{Frames, LANES, Lane, Turns};
use crate::robot::{Joint, Parameter, Robot};
use crate::widest::widest;

/// Poses that are worth a thread of their own: some tenths of a millisecond with derivatives.
const SHARED_POSES: usize = 128;

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
    /// The same poses, several side by side; the last one fills them up.
    lanes: Vec<LaneConstants>,
}

/// What a correction does at a pose, to which joint.
#[derive(Debug, Clone, Copy, PartialEq)]
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

/// What [`PoseConstants`] are, of several poses.
#[derive(Debug, Clone)]
struct LaneConstants {
    joints: Vec<JointLanes>,
    /// One an entry of [`Kinematics::acts`].
    features: Vec<[Lane; 2]>,
}

#[derive(Debug, Clone)]
struct JointLanes {
    angle_rad: Lane,
    turns: Turns,
    /// By the nominal robot's own terms; `None` where no term tilts the joint.
    tilt_rad: Option<[Lane; 2]>,
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
        let poses: Vec<PoseConstants> = joints_rad.iter().map(constants).collect();
        let acts: Vec<_> = parameters.iter().enumerate().filter_map(|(k, &p)| Act::of(p).map(|act| (k, act))).collect();
        let lanes = poses.chunks(LANES).map(|poses| LaneConstants::new(poses, &acts)).collect();
        Kinematics { nominal: nominal.clone(), parameters: parameters.to_vec(), acts, poses, lanes }
    }

    /// Every pose, with derivatives where asked.
    pub fn places(&self, offsets: &[f64], derivatives: bool) -> Vec<Place> {
        let robot = self.nominal.shifted(&self.parameters, offsets);
        let links = Links::new(&robot.joints);
        if !derivatives {
            return widest(
                #[inline(always)]
                || self.ends(&robot, &links, offsets),
            );
        }
        let bent = || Bent { joints: Vec::new(), joints_rad: Vec::new() };
        let place = |bent: &mut Bent, pose: &PoseConstants| {
            self.bend(&robot, pose, offsets, bent);
            self.with_columns(&robot, &links, pose, bent)
        };
        self.poses.par_iter().with_min_len(SHARED_POSES).map_init(bent, place).collect()
    }

    /// Every pose without derivatives.
    #[inline(always)]
    fn ends(&self, robot: &Robot, links: &Links, offsets: &[f64]) -> Vec<Place> {
        let mut places = Vec::with_capacity(LANES * self.lanes.len());
        for lanes in &self.lanes {
            let mut frames = Frames::base();
            for (i, (joint, link)) in robot.joints.iter().zip(&links.0).enumerate() {
                let alpha = self.swung(lanes, (i, 0), (joint.alpha_rad, link[0]), offsets);
                let beta = self.swung(lanes, (i, 1), (joint.beta_rad, link[1]), offsets);
                let mut angle_rad = lanes.joints[i].angle_rad;
                self.correct(&mut angle_rad, (Act::Turns(i), 0), lanes, offsets);
                // As of one pose by `Joint::turn_rad` and `Joint::shift_mm`.
                let (mut turn_rad, mut shift_mm) = ([joint.theta_rad; LANES], [joint.d_mm; LANES]);
                add(if joint.slides { &mut shift_mm } else { &mut turn_rad }, joint.sign, &angle_rad);
                let turn = lanes.joints[i].turns.sin_cos(&turn_rad);
                frames.over([&alpha, &beta, &turn], joint.a_mm, &shift_mm);
            }
            places.extend((0..LANES).map(|pose| {
                let (rotation, point_mm) = frames.end(pose, &robot.tool_mm);
                Place { point_mm, rotation, point_columns: Matrix3xX::zeros(0), rotation_columns: Matrix3xX::zeros(0) }
            }));
        }
        places.truncate(self.poses.len());
        places
    }

    /// Sines and cosines of alpha (axis 0) or beta (axis 1) of a joint, which is so many rad before anything tilts it.
    #[inline(always)]
    fn swung(
        &self,
        lanes: &LaneConstants,
        (joint, axis): (usize, usize),
        (rad, turn): (f64, Turn),
        offsets: &[f64],
    ) -> [Lane; 2] {
        let Some(own) = &lanes.joints[joint].tilt_rad else {
            let (sine, cosine) = turn.sin_cos(rad);
            return [[sine; LANES], [cosine; LANES]];
        };
        let mut tilted_rad = [rad; LANES];
        add(&mut tilted_rad, 1.0, &own[axis]);
        self.correct(&mut tilted_rad, (Act::Tilts(joint), axis), lanes, offsets);
        Turns::of_one(turn).sin_cos(&tilted_rad)
    }

    /// Adds what the corrections add that act like this.
    #[inline(always)]
    fn correct(&self, to_rad: &mut Lane, (act, axis): (Act, usize), lanes: &LaneConstants, offsets: &[f64]) {
        for ((k, own), feature) in self.acts.iter().zip(&lanes.features) {
            if *own == act {
                add(to_rad, offsets[*k] / 1000.0, &feature[axis]);
            }
        }
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

impl LaneConstants {
    /// Of up to [`LANES`] poses; the last stands for those that are missing.
    fn new(poses: &[PoseConstants], acts: &[(usize, Act)]) -> LaneConstants {
        let lane = |of: &dyn Fn(&PoseConstants) -> f64| -> Lane {
            std::array::from_fn(|l| poses.get(l).or(poses.last()).map_or(0.0, of))
        };
        let both = |of: &dyn Fn(&PoseConstants) -> [f64; 2]| [0, 1].map(|axis| lane(&|pose| of(pose)[axis]));
        let joint = |i: usize| {
            let tilts = acts.iter().any(|(_, act)| *act == Act::Tilts(i));
            let own = poses.iter().any(|pose| !pose.tilts_rad.is_empty());
            let turns: [Option<Turn>; LANES] =
                std::array::from_fn(|l| poses.get(l).or(poses.last()).map(|pose| pose.turns[i]));
            JointLanes {
                angle_rad: lane(&|pose| pose.angles_rad[i]),
                turns: Turns::new(turns.map(|turn| turn.unwrap_or(Turn::new(0.0)))),
                tilt_rad: (tilts || own).then(|| both(&|pose| pose.tilts_rad.get(i).copied().unwrap_or_default())),
            }
        };
        LaneConstants {
            joints: (0..poses.first().map_or(0, |pose| pose.turns.len())).map(joint).collect(),
            features: acts.iter().map(|&(k, _)| both(&|pose| pose.features[k])).collect(),
        }
    }
}

/// Adds a multiple at each pose.
#[inline(always)]
fn add(to: &mut Lane, times: f64, what: &Lane) {
    for (to, what) in to.iter_mut().zip(what) {
        *to += times * what;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Swarms and fits see the same robot: with every kind of term, near the nominal robot and far from it.
    #[test]
    fn places_with_and_without_derivatives_are_the_same_to_the_bit() {
        let mut robot = Robot::paper();
        for (i, joint) in robot.joints.iter_mut().enumerate() {
            joint.beta_rad = 0.01 * i as f64;
            joint.sign = if i % 2 == 0 { 1.0 } else { -1.0 };
        }
        let mut sliding = robot.clone();
        sliding.joints[2].slides = true;
        for robot in [robot, sliding] {
            let terms = [
                robot.mdh_parameters(),
                robot.gravity_parameters(true),
                robot.bending_parameters(),
                robot.wobble_parameters(),
                robot.harmonic_parameters(2),
            ];
            let joints: Vec<Vec<f64>> =
                (0..11).map(|k| (0..6).map(|i| (1.3 * k as f64 + 0.7 * i as f64).sin()).collect()).collect();
            let joints: Vec<&[f64]> = joints.iter().map(Vec::as_slice).collect();
            for parameters in [terms[0].clone(), terms.concat()] {
                // A robot that has the terms itself is tilted before anything is added.
                let own = robot.shifted(&parameters, &vec![0.3; parameters.len()]);
                for (nominal, size) in [(&robot, 1.0), (&own, 1.0), (&own, 90.0)] {
                    let offsets: Vec<f64> = (0..parameters.len()).map(|k| size * (1.9 * k as f64).cos()).collect();
                    let kinematics = Kinematics::new(nominal, nominal, &parameters, &joints);
                    let (with, without) = (kinematics.places(&offsets, true), kinematics.places(&offsets, false));
                    assert_eq!(without.len(), joints.len());
                    for (with, without) in with.iter().zip(&without) {
                        assert_eq!((with.point_mm, with.rotation), (without.point_mm, without.rotation));
                    }
                }
            }
        }
    }
}
