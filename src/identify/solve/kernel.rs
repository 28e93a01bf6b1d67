//! The hot loop: the target's point at every pose for one vector of offsets, several poses at a time.
//!
//! Per pose the sine and cosine of each joint's nominal angle are constants; per vector of offsets those of the offsets are
//! computed once, and the angle-sum formulas leave multiplications only. The point is carried from the target back to the
//! base, so that a joint costs three plane rotations and two shifts. Poses lie in lanes of eight (structure of arrays) for the
//! compiler to vectorise; on x86 with AVX2 and FMA a copy compiled for them is taken at run time. A machine always takes the
//! same copy, so the bytes do not depend on threads.
//! Gravity and harmonics add a small angle that differs by pose, bending and wobble small tilts of the links; their sine and cosine
//! are short series (error below 1e-13 up to a tenth of a radian, where the linear models have long ceased to hold).

use nalgebra::{Matrix3, Vector3};

use crate::identify::model::kinematics::Kinematics;
use crate::robot::{Parameter, Robot};

/// Poses that are computed together.
pub const LANES: usize = 8;

/// Length of the axes whose ends give a rotation, mm: as long as the arm, so that rounding of the points is rounding of the axes.
const AXIS_MM: f64 = 1000.0;

type Lane = [f64; LANES];

/// The poses of a [`Kinematics`] laid out for the hot loop.
#[derive(Debug, Clone)]
pub struct Kernel {
    robot: Robot,
    parameters: Vec<Parameter>,
    pose_count: usize,
    /// Sine and cosine of the nominal angle: block by block, joint by joint.
    angles: Vec<(Lane, Lane)>,
    /// Way of a sliding joint, mm: block by block, joint by joint.
    shifts: Vec<Lane>,
    /// Corrections that are free: joint, index of the parameter, feature by block.
    corrections: Vec<(usize, usize, Vec<Lane>)>,
    /// Joints whose links tilt.
    tilts: Vec<Tilt>,
}

/// How a joint's link tilts about its x and y, by block.
#[derive(Debug, Clone)]
struct Tilt {
    joint: usize,
    /// By the nominal robot's own terms, rad.
    own: Vec<[Lane; 2]>,
    /// By free terms: index of the parameter, features.
    free: Vec<(usize, Vec<[Lane; 2]>)>,
}

/// Points, coordinate by coordinate; padded to whole lanes.
#[derive(Debug, Clone, Default)]
pub struct Points {
    /// mm
    pub x: Vec<f64>,
    /// mm
    pub y: Vec<f64>,
    /// mm
    pub z: Vec<f64>,
}

impl Points {
    /// The point at a pose, mm.
    pub fn at(&self, pose: usize) -> Vector3<f64> {
        Vector3::new(self.x[pose], self.y[pose], self.z[pose])
    }
}

/// One joint for one vector of offsets.
#[derive(Debug, Clone, Copy)]
struct Link {
    sin_offset: f64,
    cos_offset: f64,
    sin_alpha: f64,
    cos_alpha: f64,
    sin_beta: f64,
    cos_beta: f64,
    a: f64,
    d: f64,
}

impl Kernel {
    /// Lays out the poses.
    pub fn new(kinematics: &Kinematics) -> Kernel {
        let robot = kinematics.nominal().clone();
        let parameters = kinematics.parameters().to_vec();
        let (pose_count, joints) = (kinematics.pose_count(), robot.joints.len());
        let blocks = pose_count.div_ceil(LANES);
        let mut angles = vec![([0.0; LANES], [1.0; LANES]); blocks * joints];
        let mut shifts = vec![[0.0; LANES]; blocks * joints];
        let mut corrections: Vec<(usize, usize, Vec<Lane>)> = Vec::new();
        let none = vec![[[0.0; LANES]; 2]; blocks];
        let tilts = |joint: &usize| {
            robot.corrections.tilts(*joint) || parameters.iter().any(|p| p.tilted_joint() == Some(*joint))
        };
        let free = |joint: usize| {
            let of_joint = |(_, p): &(usize, &Parameter)| p.tilted_joint() == Some(joint);
            parameters.iter().enumerate().filter(of_joint).map(|(index, _)| (index, none.clone())).collect()
        };
        let mut tilts: Vec<Tilt> =
            (0..joints).filter(tilts).map(|joint| Tilt { joint, own: none.clone(), free: free(joint) }).collect();
        for (index, &parameter) in parameters.iter().enumerate() {
            if let Some(joint) = parameter.corrected_joint()
                && joint < joints
            {
                corrections.push((joint, index, vec![[0.0; LANES]; blocks]));
            }
        }
        for pose in 0..pose_count {
            let (block, lane) = (pose / LANES, pose % LANES);
            let (nominal_rad, features) = kinematics.constants(pose);
            for (joint, angle) in nominal_rad.iter().enumerate() {
                let (sin, cos) = robot.joints[joint].turn_rad(*angle).sin_cos();
                let slot = &mut angles[block * joints + joint];
                (slot.0[lane], slot.1[lane]) = (sin, cos);
                shifts[block * joints + joint][lane] = robot.joints[joint].shift_mm(*angle) - robot.joints[joint].d_mm;
            }
            for (joint, index, lanes) in &mut corrections {
                lanes[block][lane] = robot.joints[*joint].sign * features[*index][0];
            }
            for Tilt { joint, own, free } in &mut tilts {
                for axis in 0..2 {
                    own[block][axis][lane] = kinematics.tilts_rad(pose).get(*joint).map_or(0.0, |tilt| tilt[axis]);
                    for (index, lanes) in free.iter_mut() {
                        lanes[block][axis][lane] = features[*index][axis];
                    }
                }
            }
        }
        Kernel { robot, parameters, pose_count, angles, shifts, corrections, tilts }
    }

    /// The target's points for these offsets (mm, mrad), written into `points`.
    pub fn points(&self, offsets: &[f64], points: &mut Points) {
        self.carry(&self.links(offsets), self.tool(offsets), offsets, points);
    }

    /// `base_from_flange` at every pose for these offsets: where the ends of the flange's axes go.
    pub fn rotations(&self, offsets: &[f64]) -> Vec<Matrix3<f64>> {
        let links = self.links(offsets);
        let [origin, x, y] = [[0.0; 3], [AXIS_MM, 0.0, 0.0], [0.0, AXIS_MM, 0.0]].map(|tool| {
            let mut points = Points::default();
            self.carry(&links, tool, offsets, &mut points);
            points
        });
        let axis = |points: &Points, pose: usize| (points.at(pose) - origin.at(pose)) / AXIS_MM;
        let rotation = |pose: usize| {
            let (x, y) = (axis(&x, pose), axis(&y, pose));
            Matrix3::from_columns(&[x, y, x.cross(&y)])
        };
        (0..self.pose_count).map(rotation).collect()
    }

    /// Carries a point of the flange back to the base at every pose.
    fn carry(&self, links: &[Link], tool: [f64; 3], offsets: &[f64], points: &mut Points) {
        let blocks = self.pose_count.div_ceil(LANES);
        for axis in [&mut points.x, &mut points.y, &mut points.z] {
            axis.resize(blocks * LANES, 0.0);
        }
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
            // SAFETY: the features that the copy is compiled for have just been found.
            unsafe { self.blocks_avx2(links, tool, offsets, points) };
            return;
        }
        self.blocks::<false>(links, tool, offsets, points);
    }

    fn tool(&self, offsets: &[f64]) -> [f64; 3] {
        let mut tool = [self.robot.tool_mm.x, self.robot.tool_mm.y, self.robot.tool_mm.z];
        for (&parameter, &offset) in self.parameters.iter().zip(offsets) {
            if let Parameter::V(axis) = parameter {
                tool[axis.min(2)] += offset;
            }
        }
        tool
    }

    fn links(&self, offsets: &[f64]) -> Vec<Link> {
        let mut values: Vec<[f64; 5]> =
            self.robot.joints.iter().map(|j| [j.alpha_rad, j.a_mm, j.beta_rad, 0.0, j.d_mm]).collect();
        for (&parameter, &offset) in self.parameters.iter().zip(offsets) {
            let (joint, field, by) = match parameter {
                Parameter::Alpha(i) => (i, 0, offset / 1000.0),
                Parameter::A(i) => (i, 1, offset),
                Parameter::Beta(i) => (i, 2, offset / 1000.0),
                Parameter::Theta(i) => (i, 3, offset / 1000.0),
                Parameter::D(i) => (i, 4, offset),
                Parameter::V(_)
                | Parameter::Gravity(..)
                | Parameter::Bending(..)
                | Parameter::Harmonic(..)
                | Parameter::Wobble(..)
                | Parameter::Coupling(..) => continue,
            };
            if let Some(value) = values.get_mut(joint) {
                value[field] += by;
            }
        }
        let link = |[alpha, a, beta, theta, d]: &[f64; 5]| {
            let ((sin_alpha, cos_alpha), (sin_beta, cos_beta)) = (alpha.sin_cos(), beta.sin_cos());
            let (sin_offset, cos_offset) = theta.sin_cos();
            Link { sin_offset, cos_offset, sin_alpha, cos_alpha, sin_beta, cos_beta, a: *a, d: *d }
        };
        values.iter().map(link).collect()
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn blocks_avx2(&self, links: &[Link], tool: [f64; 3], offsets: &[f64], points: &mut Points) {
        self.blocks::<true>(links, tool, offsets, points);
    }

    #[inline(always)]
    fn blocks<const FMA: bool>(&self, links: &[Link], tool: [f64; 3], offsets: &[f64], points: &mut Points) {
        let joints = links.len();
        let outputs = points
            .x
            .chunks_exact_mut(LANES)
            .zip(points.y.chunks_exact_mut(LANES))
            .zip(points.z.chunks_exact_mut(LANES));
        for ((block, angles), ((xs, ys), zs)) in self.angles.chunks_exact(joints).enumerate().zip(outputs) {
            let (mut x, mut y, mut z) = ([tool[0]; LANES], [tool[1]; LANES], [tool[2]; LANES]);
            for (joint, link) in links.iter().enumerate().rev() {
                let (sin, cos) = &angles[joint];
                let mut shift = self.shifts[block * joints + joint];
                let (mut s, mut c) = ([0.0; LANES], [0.0; LANES]);
                for l in 0..LANES {
                    s[l] = fma::<FMA>(sin[l], link.cos_offset, cos[l] * link.sin_offset);
                    c[l] = fma::<FMA>(cos[l], link.cos_offset, -(sin[l] * link.sin_offset));
                }
                if !self.corrections.is_empty() {
                    self.correct(block, joint, offsets, &mut s, &mut c, &mut shift);
                }
                let (turn, at) = ((&s, &c), [&mut x, &mut y, &mut z]);
                match self.tilts.iter().find(|t| t.joint == joint) {
                    None => link.carry::<FMA, false>(turn, &shift, &STRAIGHT, at),
                    Some(tilt) => link.carry::<FMA, true>(turn, &shift, &tilt.at(block, offsets), at),
                }
            }
            xs.copy_from_slice(&x);
            ys.copy_from_slice(&y);
            zs.copy_from_slice(&z);
        }
    }

    /// Adds a joint's free corrections to its angle, or to its way.
    #[inline(always)]
    fn correct(&self, block: usize, joint: usize, offsets: &[f64], s: &mut Lane, c: &mut Lane, shift: &mut Lane) {
        let mut small = [0.0; LANES];
        for (_, index, features) in self.corrections.iter().filter(|(j, _, _)| *j == joint) {
            let by = offsets[*index] / 1000.0;
            for l in 0..LANES {
                small[l] += by * features[block][l];
            }
        }
        if self.robot.joints[joint].slides {
            for l in 0..LANES {
                shift[l] += small[l];
            }
            return;
        }
        for l in 0..LANES {
            let (sin, cos) = small_sin_cos(small[l]);
            (s[l], c[l]) = (s[l] * cos + c[l] * sin, c[l] * cos - s[l] * sin);
        }
    }
}

/// Sine and cosine of the tilts of a link about its x and y.
type TiltLanes = [[(f64, f64); LANES]; 2];

/// No tilt.
const STRAIGHT: TiltLanes = [[(0.0, 1.0); LANES]; 2];

impl Link {
    /// Carries points from the joint's frame to the frame before it. Two copies: what links do that do not tilt is the hot loop.
    #[inline(always)]
    fn carry<const FMA: bool, const TILTS: bool>(
        &self,
        (s, c): (&Lane, &Lane),
        shift: &Lane,
        [about_x, about_y]: &TiltLanes,
        [x, y, z]: [&mut Lane; 3],
    ) {
        for l in 0..LANES {
            let mut turned_x = fma::<FMA>(c[l], x[l], -(s[l] * y[l]));
            let mut turned_y = fma::<FMA>(s[l], x[l], c[l] * y[l]);
            let mut risen = z[l] + self.d + shift[l];
            if TILTS {
                (risen, turned_x) = turned::<FMA>(&about_y[l], risen, turned_x);
            }
            let swung_x = fma::<FMA>(self.cos_beta, turned_x, self.sin_beta * risen);
            let mut swung_z = fma::<FMA>(self.cos_beta, risen, -(self.sin_beta * turned_x));
            if TILTS {
                (turned_y, swung_z) = turned::<FMA>(&about_x[l], turned_y, swung_z);
            }
            x[l] = swung_x + self.a;
            y[l] = fma::<FMA>(self.cos_alpha, turned_y, -(self.sin_alpha * swung_z));
            z[l] = fma::<FMA>(self.sin_alpha, turned_y, self.cos_alpha * swung_z);
        }
    }
}

impl Tilt {
    /// Sine and cosine of the tilt about x, then about y.
    #[inline(always)]
    fn at(&self, block: usize, offsets: &[f64]) -> TiltLanes {
        let mut small = self.own[block];
        for (index, lanes) in &self.free {
            let by = offsets[*index] / 1000.0;
            for axis in 0..2 {
                for l in 0..LANES {
                    small[axis][l] += by * lanes[block][axis][l];
                }
            }
        }
        small.map(|lane| lane.map(small_sin_cos))
    }
}

/// The plane vector (u, v) turned by an angle of this sine and cosine, from u towards v.
#[inline(always)]
fn turned<const FMA: bool>((sin, cos): &(f64, f64), u: f64, v: f64) -> (f64, f64) {
    (fma::<FMA>(*cos, u, -(sin * v)), fma::<FMA>(*sin, u, cos * v))
}

/// Error below 1e-13 up to a tenth of a radian.
#[inline(always)]
fn small_sin_cos(angle: f64) -> (f64, f64) {
    let square = angle * angle;
    let sin = angle * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0))));
    let cos = 1.0 - square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0)));
    (sin, cos)
}

#[inline(always)]
fn fma<const FMA: bool>(a: f64, b: f64, c: f64) -> f64 {
    // Without the instruction `mul_add` is a slow call.
    if FMA { a.mul_add(b, c) } else { a * b + c }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::corrections::{GravityTerm, LoadPoint};

    /// Rounding of some dozen operations on coordinates of a metre.
    const TOLERANCE_MM: f64 = 1e-10;

    #[test]
    fn the_hot_loop_agrees_with_the_chain() {
        let mut robot = Robot::paper();
        robot.tool_mm = nalgebra::Vector3::new(10.0, -20.0, 30.0);
        robot.joints[3].slides = true;
        robot.joints[4].sign = -1.0;
        let mut parameters = robot.mdh_parameters();
        parameters.extend(robot.beta_parameters());
        parameters.extend(robot.gravity_parameters(true));
        parameters.extend(robot.bending_parameters());
        parameters.extend(robot.wobble_parameters());
        robot.corrections.bending = vec![GravityTerm { joint: 2, point: LoadPoint::Tool, k_rad_per_m: 3e-3 }];
        parameters.extend(robot.harmonic_parameters(2));
        parameters.extend(robot.coupling_parameters(true));
        let joints: Vec<Vec<f64>> = (0..21).map(|i| (0..6).map(|j| ((7 * i + 3 * j) as f64).sin()).collect()).collect();
        let rows: Vec<&[f64]> = joints.iter().map(Vec::as_slice).collect();
        let kinematics = Kinematics::new(&robot, &robot, &parameters, &rows);
        let offsets: Vec<f64> = (0..parameters.len()).map(|i| 3.0 * (i as f64).cos()).collect();
        let places = kinematics.places(&offsets, false);
        let kernel = Kernel::new(&kinematics);
        let (mut fast, mut plain) = (Points::default(), Points::default());
        kernel.points(&offsets, &mut fast);
        plain.x.resize(24, 0.0);
        plain.y.resize(24, 0.0);
        plain.z.resize(24, 0.0);
        kernel.blocks::<false>(&kernel.links(&offsets), kernel.tool(&offsets), &offsets, &mut plain);
        for (i, place) in places.iter().enumerate() {
            for points in [&fast, &plain] {
                let point = nalgebra::Point3::new(points.x[i], points.y[i], points.z[i]);
                assert!((point - place.point_mm).norm() < TOLERANCE_MM, "{i}: {point} {}", place.point_mm);
            }
            let turned = kernel.rotations(&offsets)[i] - place.rotation;
            assert!(turned.norm() * AXIS_MM < 10.0 * TOLERANCE_MM, "{i}: {turned}");
        }
    }
}
