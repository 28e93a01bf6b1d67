//! The robot at the poses of a data set, as a function of the offsets of chosen parameters.
//!
//! In: offsets in mm and mrad. Out: the target's point and the flange's rotation at every pose, base frame, and their
//! derivatives. Features of the corrections (levers, waves) are constants of the pose; the chain that levers are taken
//! on is given, so that a fit can end on its own.

use nalgebra::{Matrix3, Matrix3xX, Point3, Vector3};
use rayon::prelude::*;

use crate::robot::bent::Torques;
use crate::robot::jacobian::{Feature, Screws, Small, Turn, feature};
use crate::robot::lanes::{Frames, LANES, Lane, Stances, Turns, back_over};
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
    /// Several poses side by side.
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

/// What offsets leave as it is at a pose.
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

/// The same at several poses; the last one fills the lanes up.
#[derive(Debug, Clone)]
struct LaneConstants {
    poses: usize,
    joints: Vec<JointLanes>,
    features: Vec<[Lane; 2]>,
}

#[derive(Debug, Clone)]
struct JointLanes {
    angle_rad: Lane,
    turns: Turns,
    /// By the nominal robot's own terms; `None` where no term tilts the joint.
    tilt_rad: Option<[Lane; 2]>,
}

/// A robot with its offsets; alpha and beta of its joints where nothing tilts them, and what turns each of them further
/// at all poses alike, where that is all.
struct Shifted<'a> {
    robot: Robot,
    links: Vec<[Turn; 2]>,
    further: Vec<Option<Small>>,
    offsets: &'a [f64],
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
        Kinematics { nominal: nominal.clone(), parameters: parameters.to_vec(), acts, lanes }
    }

    /// Whether weights bend it: then the chain that their levers are on matters.
    pub fn has_levers(&self) -> bool {
        let of_weight = |p: &Parameter| matches!(p, Parameter::Gravity(..) | Parameter::Bending(..));
        let own = &self.nominal.corrections;
        !own.gravity.is_empty() || !own.bending.is_empty() || self.parameters.iter().any(of_weight)
    }

    /// Every pose, with derivatives where asked.
    pub fn places(&self, offsets: &[f64], derivatives: bool) -> Vec<Place> {
        let shifted = self.shifted(offsets);
        if derivatives {
            let columns = |lanes| self.with_columns(&shifted, lanes);
            return self.lanes.par_iter().with_min_len(SHARED_POSES / LANES).flat_map_iter(columns).collect();
        }
        let mut places = Vec::with_capacity(LANES * self.lanes.len());
        widest(
            #[inline(always)]
            || {
                // A loop, as the iterator's own may not be inlined.
                for lanes in &self.lanes {
                    let frames = self.frames(&shifted, lanes);
                    let [x, y, z] = frames.target_mm(&shifted.robot.tool_mm);
                    for l in 0..lanes.poses {
                        let (point_columns, rotation_columns) = (Matrix3xX::zeros(0), Matrix3xX::zeros(0));
                        let (point_mm, rotation) = (Point3::new(x[l], y[l], z[l]), frames.rotation(l));
                        places.push(Place { point_mm, rotation, point_columns, rotation_columns });
                    }
                }
            },
        );
        places
    }

    /// The target's point at every pose, base frame, mm, axis by axis: as of [`Kinematics::places`], but for rounding.
    pub fn targets_mm(&self, offsets: &[f64]) -> [Vec<f64>; 3] {
        let shifted = self.shifted(offsets);
        let (joints, tool_mm) = (&shifted.robot.joints, shifted.robot.tool_mm);
        let mut targets_mm = [(); 3].map(|()| Vec::with_capacity(LANES * self.lanes.len()));
        widest(
            #[inline(always)]
            || {
                for lanes in &self.lanes {
                    let mut of_lanes = [tool_mm.x, tool_mm.y, tool_mm.z].map(|number| [number; LANES]);
                    for (i, joint) in joints.iter().enumerate().rev() {
                        back_over(joint.a_mm, &self.stances(&shifted, lanes, i), &mut of_lanes);
                    }
                    for (targets_mm, of_lanes) in targets_mm.iter_mut().zip(&of_lanes) {
                        targets_mm.extend_from_slice(&of_lanes[..lanes.poses]);
                    }
                }
            },
        );
        targets_mm
    }

    fn shifted<'a>(&self, offsets: &'a [f64]) -> Shifted<'a> {
        let robot = self.nominal.shifted(&self.parameters, offsets);
        let links = robot.joints.iter().map(|joint| [joint.alpha_rad, joint.beta_rad].map(Turn::new)).collect();
        let further = |(i, (to, from)): (usize, (&Joint, &Joint))| {
            let by = to.theta_rad - from.theta_rad;
            let alike = !to.slides && Small::is_small(by) && !self.acts.iter().any(|(_, act)| *act == Act::Turns(i));
            alike.then(|| Small::new(by))
        };
        let further = robot.joints.iter().zip(&self.nominal.joints).enumerate().map(further).collect();
        Shifted { robot, links, further, offsets }
    }

    /// The ends of the chain at several poses.
    #[inline(always)]
    fn frames(&self, shifted: &Shifted, lanes: &LaneConstants) -> Frames {
        let mut frames = Frames::base();
        for (i, joint) in shifted.robot.joints.iter().enumerate() {
            frames.over(joint.a_mm, &self.stances(shifted, lanes, i));
        }
        frames
    }

    /// How a joint stands.
    #[inline(always)]
    fn stances(&self, shifted: &Shifted, lanes: &LaneConstants, i: usize) -> Stances {
        let (joint, own, offsets) = (&shifted.robot.joints[i], &lanes.joints[i], shifted.offsets);
        let mut angle_rad = own.angle_rad;
        self.correct(&mut angle_rad, (Act::Turns(i), 0), lanes, offsets);
        // As of one pose by `Joint::turn_rad` and `Joint::shift_mm`.
        let (mut turn_rad, mut shift_mm) = ([joint.theta_rad; LANES], [joint.d_mm; LANES]);
        add(if joint.slides { &mut shift_mm } else { &mut turn_rad }, joint.sign, &angle_rad);
        Stances {
            alpha: self.swung(shifted, lanes, (i, 0), joint.alpha_rad),
            beta: self.swung(shifted, lanes, (i, 1), joint.beta_rad),
            turn: match shifted.further[i] {
                Some(by) => own.turns.further(by),
                None => own.turns.sin_cos(&turn_rad),
            },
            shift_mm,
        }
    }

    /// Sines and cosines of alpha (axis 0) or beta (axis 1) of a joint, which is so many rad before anything tilts it.
    #[inline(always)]
    fn swung(&self, shifted: &Shifted, lanes: &LaneConstants, (i, axis): (usize, usize), rad: f64) -> [Lane; 2] {
        let turn = shifted.links[i][axis];
        let Some(own) = &lanes.joints[i].tilt_rad else {
            return Turns::of_one(turn).both();
        };
        let mut tilted_rad = [rad; LANES];
        add(&mut tilted_rad, 1.0, &own[axis]);
        self.correct(&mut tilted_rad, (Act::Tilts(i), axis), lanes, shifted.offsets);
        Turns::of_one(turn).sin_cos(&tilted_rad)
    }

    /// Adds what the corrections add that act like this.
    #[inline(always)]
    fn correct(&self, to_rad: &mut Lane, (act, axis): (Act, usize), lanes: &LaneConstants, offsets: &[f64]) {
        for (k, own) in &self.acts {
            if *own == act {
                add(to_rad, offsets[*k] / 1000.0, &lanes.features[*k][axis]);
            }
        }
    }

    /// Several poses with derivatives.
    fn with_columns(&self, shifted: &Shifted, lanes: &LaneConstants) -> Vec<Place> {
        let joints = &shifted.robot.joints;
        let stances: Vec<Stances> = (0..joints.len()).map(|i| self.stances(shifted, lanes, i)).collect();
        let place = |pose: usize| {
            let screws = Screws::standing(joints, stances.iter().map(|joint| joint.at(pose)), &shifted.robot.tool_mm);
            let columns = |of: &dyn Fn(Parameter, Feature) -> Vector3<f64>| {
                let features = lanes.features.iter().map(|both| both.map(|lane| lane[pose]));
                let all = self.parameters.iter().zip(features).map(|(&p, f)| of(p, f));
                Matrix3xX::from_iterator(self.parameters.len(), all.flat_map(<[f64; 3]>::from))
            };
            Place {
                point_mm: screws.target_mm,
                rotation: screws.base_from_flange,
                point_columns: columns(&|p, f| screws.point_column(p, f)),
                rotation_columns: columns(&|p, f| screws.rotation_column(p, f)),
            }
        };
        (0..lanes.poses).map(place).collect()
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
            poses: poses.len(),
            joints: (0..poses.first().map_or(0, |pose| pose.turns.len())).map(joint).collect(),
            features: (0..poses.first().map_or(0, |pose| pose.features.len()))
                .map(|k| both(&|pose| pose.features[k]))
                .collect(),
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
                    let targets_mm = kinematics.targets_mm(&offsets);
                    for (k, place) in without.iter().enumerate() {
                        let target_mm = Point3::from([0, 1, 2].map(|axis| targets_mm[axis][k]));
                        assert!((target_mm - place.point_mm).norm() < 1e-9, "{target_mm} for {}", place.point_mm);
                    }
                }
            }
        }
    }
}
