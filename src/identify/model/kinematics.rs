//! The robot at the poses of a data set, as a function of the offsets of chosen parameters.
//!
//! In: offsets in mm and mrad. Out: the target's point and the flange's rotation at every pose, base frame, and their
//! derivatives. Features of the corrections (levers, waves) are constants of the pose; the chain that levers are taken on is given,
//! so that a fit can end on its own.

use nalgebra::{Matrix3, Matrix3xX, Point3};

use crate::robot::corrections::Torques;
use crate::robot::jacobian::{Screws, feature};
use crate::robot::{Parameter, Robot};

/// A robot at fixed commanded poses with chosen parameters free.
#[derive(Debug, Clone)]
pub struct Kinematics {
    nominal: Robot,
    parameters: Vec<Parameter>,
    poses: Vec<PoseConstants>,
}

#[derive(Debug, Clone)]
struct PoseConstants {
    /// Angles with the nominal robot's own corrections, rad.
    angles_rad: Vec<f64>,
    /// One a parameter.
    features: Vec<f64>,
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
    /// Weights have their levers on the chain of `levers`.
    pub fn new(nominal: &Robot, levers: &Robot, parameters: &[Parameter], joints_rad: &[&[f64]]) -> Kinematics {
        let constants = |q: &&[f64]| {
            let torques = Torques::new(levers, q);
            PoseConstants {
                angles_rad: nominal.corrected_with(q, &torques),
                features: parameters.iter().map(|&p| feature(p, &torques, q)).collect(),
            }
        };
        Kinematics {
            nominal: nominal.clone(),
            parameters: parameters.to_vec(),
            poses: joints_rad.iter().map(constants).collect(),
        }
    }

    /// The free parameters.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// The robot whose parameters are offset.
    pub fn nominal(&self) -> &Robot {
        &self.nominal
    }

    /// Number of poses.
    pub fn pose_count(&self) -> usize {
        self.poses.len()
    }

    /// Of a pose: its angles with the nominal robot's own corrections, rad, and the features of the parameters.
    pub fn constants(&self, pose: usize) -> (&[f64], &[f64]) {
        (&self.poses[pose].angles_rad, &self.poses[pose].features)
    }

    /// Every pose, with derivatives where asked.
    pub fn places(&self, offsets: &[f64], derivatives: bool) -> Vec<Place> {
        let robot = self.nominal.shifted(&self.parameters, offsets);
        self.poses.iter().map(|pose| self.place(&robot, pose, offsets, derivatives)).collect()
    }

    fn place(&self, robot: &Robot, pose: &PoseConstants, offsets: &[f64], derivatives: bool) -> Place {
        let mut angles = pose.angles_rad.clone();
        for ((&parameter, &offset), &feature) in self.parameters.iter().zip(offsets).zip(&pose.features) {
            if let Some(joint) = parameter.corrected_joint()
                && let Some(angle) = angles.get_mut(joint)
            {
                *angle += offset / 1000.0 * feature;
            }
        }
        let screws = Screws::new(robot, &angles);
        let (mut point_columns, mut rotation_columns) = (Matrix3xX::zeros(0), Matrix3xX::zeros(0));
        if derivatives {
            let columns = || self.parameters.iter().zip(&pose.features);
            point_columns =
                Matrix3xX::from_columns(&columns().map(|(&p, &f)| screws.point_column(p, f)).collect::<Vec<_>>());
            rotation_columns =
                Matrix3xX::from_columns(&columns().map(|(&p, &f)| screws.rotation_column(p, f)).collect::<Vec<_>>());
        }
        Place { point_mm: screws.target_mm, rotation: *screws.base_from_flange(), point_columns, rotation_columns }
    }
}
