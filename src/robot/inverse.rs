//! Inverse kinematics of any serial robot: joint angles that bring the flange to a pose.
//!
//! In: a robot with all of its terms, the pose wanted in the base frame, angles to start from. Out: angles within the
//! joints' limits. Method: damped least squares (Levenberg-Marquardt) on the pose's six residuals; angles stay inside
//! the limits by clamping each step. It finds the solution near its start, so callers pass several. What goes wrong:
//! out of reach, a singular wrist, or a start on the wrong side of a limit all end in `None`.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Vector3, Vector6};

use super::{Joint, Robot};
use crate::geometry::{Transform, rotation_vector};

/// Length by which angles are weighed against mm: a robot's wrist at about arm's length.
pub(super) const ARM_MM: f64 = 200.0;

/// The same where the place comes first: so little that a turn that is missing moves the place by less than
/// [`REACHED_MM`].
const TURN_MM: f64 = 0.02;

/// The pose is reached when the target is missed by less than this, mm (angles times the arm).
const REACHED_MM: f64 = 1e-7;

/// Steps from one start.
const MAX_STEPS: usize = 100;

/// Difference between a pose and another, base frame: translation (mm), then rotation times `turn_mm`.
pub(super) fn off(reached: &Transform, wanted: &Transform, turn_mm: f64) -> Vector6<f64> {
    let t = reached.translation.vector - wanted.translation.vector;
    let r = rotation_vector(&(reached * wanted.inverse())) * turn_mm;
    Vector6::new(t.x, t.y, t.z, r.x, r.y, r.z)
}

/// The same of the flange's pose at `joints_rad`, turns times [`ARM_MM`].
fn miss(robot: &Robot, wanted: &Transform, joints_rad: &[f64]) -> Vector6<f64> {
    off(&robot.base_from_flange(joints_rad), wanted, ARM_MM)
}

/// Change of the flange's pose with each joint, in the units of [`miss`]: columns `z_j x (p - o_j)` and `z_j` at the
/// angles that the joints really take. A coupling moves a joint with another one's column; the slopes of sag, bending
/// and waves, thousandths, are left out: they cost a step, not the answer.
fn jacobian(robot: &Robot, joints_rad: &[f64]) -> DMatrix<f64> {
    let bent = robot.bent(joints_rad);
    let mut screws = Vec::with_capacity(robot.joints.len());
    let mut base_from_joint = Transform::identity();
    for (joint, &q) in bent.joints.iter().zip(&bent.joints_rad) {
        base_from_joint *= joint.previous_from_this(q);
        screws.push((base_from_joint.rotation * Vector3::z() * joint.sign, base_from_joint.translation.vector));
    }
    let flange = base_from_joint.translation.vector;
    let mut columns = DMatrix::zeros(6, robot.joints.len());
    for (k, (joint, (axis, origin))) in robot.joints.iter().zip(&screws).enumerate() {
        if joint.slides {
            columns.fixed_view_mut::<3, 1>(0, k).copy_from(axis);
            continue;
        }
        columns.fixed_view_mut::<3, 1>(0, k).copy_from(&axis.cross(&(flange - origin)));
        columns.fixed_view_mut::<3, 1>(3, k).copy_from(&(axis * ARM_MM));
    }
    let alone = columns.clone();
    for term in &robot.corrections.couplings {
        if term.joint < columns.ncols() && term.of < columns.ncols() {
            let moved = columns.column(term.of) + alone.column(term.joint) * term.ratio;
            columns.set_column(term.of, &moved);
        }
    }
    columns
}

fn clamp_to_limits(robot: &Robot, joints_rad: &mut [f64]) {
    for (joint, q) in robot.joints.iter().zip(joints_rad) {
        if let Some((low, high)) = joint.limits_rad {
            *q = q.clamp(low, high);
        }
    }
}

/// Where a search ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Approach {
    /// Readings there, rad (mm where a joint slides), inside the limits.
    pub joints_rad: Vec<f64>,
    /// What is missing to the pose, mm: the flange's place and its turn times an arm of 200 mm.
    pub miss_mm: f64,
}

impl Approach {
    /// Whether the pose is reached.
    pub fn arrived(&self) -> bool {
        self.miss_mm < REACHED_MM
    }
}

/// Goes from `start_rad` (a reading a joint) as near to `base_from_flange` as it gets.
pub fn approach(robot: &Robot, base_from_flange: &Transform, start_rad: &[f64]) -> Approach {
    let missed = |q: &[f64]| miss(robot, base_from_flange, q);
    let (q, residual) = descend(robot, start_rad, &missed, &|q| jacobian(robot, q));
    let found = Approach { joints_rad: q, miss_mm: residual.norm() };
    if found.arrived() { unwound(robot, base_from_flange, found, start_rad) } else { found }
}

/// The same for an arm of fewer than six joints, which turns its tool some ways only: the tool's place first, and of
/// all readings that bring it there those by which its orientation is nearest. What is missing is said of the place
/// alone.
pub fn approach_place(
    robot: &Robot,
    base_from_tool: &Transform,
    flange_from_tool: &Transform,
    start_rad: &[f64],
) -> Approach {
    let missed =
        |q: &[f64], turn_mm: f64| off(&(robot.base_from_flange(q) * flange_from_tool), base_from_tool, turn_mm);
    let columns = |q: &[f64], turn_mm: f64| {
        let mut columns = jacobian(robot, q);
        let out = robot.base_from_flange(q).rotation * flange_from_tool.translation.vector;
        for mut column in columns.column_iter_mut() {
            let axis = Vector3::new(column[3], column[4], column[5]) / ARM_MM;
            let moved = axis.cross(&out);
            (0..3).for_each(|i| column[i] += moved[i]);
            (3..6).for_each(|i| column[i] *= turn_mm / ARM_MM);
        }
        columns
    };
    let toward =
        |start_rad: &[f64], turn_mm: f64| descend(robot, start_rad, &|q| missed(q, turn_mm), &|q| columns(q, turn_mm));
    // A turn that is missing by far still moves the place a little: the last word is the place's.
    let (joints_rad, residual) = toward(&toward(start_rad, TURN_MM).0, 0.0);
    Approach { joints_rad, miss_mm: residual.fixed_rows::<3>(0).norm() }
}

/// Readings and what they leave, once no step from `start_rad` leaves less.
fn descend(
    robot: &Robot,
    start_rad: &[f64],
    missed: &dyn Fn(&[f64]) -> Vector6<f64>,
    columns: &dyn Fn(&[f64]) -> DMatrix<f64>,
) -> (Vec<f64>, Vector6<f64>) {
    let mut q = start_rad.to_vec();
    clamp_to_limits(robot, &mut q);
    let mut residual = missed(&q);
    let mut damping = 1e-2;
    for _ in 0..MAX_STEPS {
        if residual.norm() < REACHED_MM || damping > 1e6 {
            break;
        }
        let j = columns(&q);
        let mut damped = j.tr_mul(&j);
        let gradient = j.tr_mul(&DVector::from_column_slice(residual.as_slice()));
        for k in 0..damped.nrows() {
            damped[(k, k)] += damping * (ARM_MM * ARM_MM);
        }
        let Some(factor) = damped.cholesky() else { break };
        let step = factor.solve(&gradient);
        let mut next: Vec<f64> = q.iter().zip(step.iter()).map(|(q, s)| q - s).collect();
        clamp_to_limits(robot, &mut next);
        let next_residual = missed(&next);
        if next_residual.norm() < residual.norm() {
            (q, residual) = (next, next_residual);
            damping = (damping * 0.1).max(1e-14);
        } else {
            damping *= 10.0;
        }
    }
    (q, residual)
}

/// The same posture without the whole turns that the search took: each joint within half a turn of `near_rad`, as far
/// as its limits let it. Where a joint's turn moves another one by a part of a turn (a coupling), the search's own
/// answer stays.
fn unwound(robot: &Robot, base_from_flange: &Transform, found: Approach, near_rad: &[f64]) -> Approach {
    let turned = |(joint, (&q, near)): (&Joint, (&f64, &f64))| {
        let turns = if joint.slides { 0.0 } else { ((q - near) / TAU).round() };
        let is_allowed = |q: f64| joint.limits_rad.is_none_or(|(low, high)| (low..=high).contains(&q));
        // Nearest to the start first; the search's own answer, no turn taken off, is always allowed.
        let fewer = (0..=turns.abs() as usize).map(|left| q - turns.signum() * TAU * (turns.abs() - left as f64));
        fewer.into_iter().find(|&q| is_allowed(q)).unwrap_or(q)
    };
    let joints_rad: Vec<f64> = robot.joints.iter().zip(found.joints_rad.iter().zip(near_rad)).map(turned).collect();
    let miss_mm = miss(robot, base_from_flange, &joints_rad).norm();
    let unwound = Approach { joints_rad, miss_mm };
    if unwound.arrived() { unwound } else { found }
}

/// Angles (rad) that bring the flange to `base_from_flange`, searched from `start_rad`. `None` when the search does not
/// arrive.
pub fn from_start(robot: &Robot, base_from_flange: &Transform, start_rad: &[f64]) -> Option<Vec<f64>> {
    if start_rad.len() != robot.joints.len() {
        return None;
    }
    let found = approach(robot, base_from_flange, start_rad);
    found.arrived().then_some(found.joints_rad)
}

/// On which side of its singular postures a six-axis arm is there: the sign of its Jacobian's determinant. Zero for
/// other arms.
pub fn side(robot: &Robot, joints_rad: &[f64]) -> f64 {
    let columns = jacobian(robot, joints_rad);
    if columns.is_square() { columns.determinant().signum() } else { 0.0 }
}

/// How freely the flange moves there: the least singular value of its Jacobian, mm a rad, angles of the flange times
/// the arm of 200 mm. Zero in a singular posture, where small motions of the flange need large ones of the joints, and
/// for fewer than six joints.
pub fn freedom_mm(robot: &Robot, joints_rad: &[f64]) -> f64 {
    let singular = jacobian(robot, joints_rad).singular_values();
    if singular.len() < 6 { 0.0 } else { singular.min() }
}

/// Least way from a joint's angle to one of its limits, rad; infinite without limits.
pub fn room_rad(robot: &Robot, joints_rad: &[f64]) -> f64 {
    let limits = robot.joints.iter().zip(joints_rad).filter_map(|(joint, q)| Some((joint.limits_rad?, q)));
    limits.map(|((low, high), q)| (q - low).min(high - q)).fold(f64::INFINITY, f64::min)
}

/// Way that the joints should have to their limits, rad: those of neighbouring poses differ by about so much.
const ROOM_RAD: f64 = 0.7;

/// How good a posture is to work round: the freedom of the flange, less where a joint is near its limit.
pub fn merit(robot: &Robot, joints_rad: &[f64]) -> f64 {
    freedom_mm(robot, joints_rad) * (room_rad(robot, joints_rad) / ROOM_RAD).min(1.0)
}

/// Start `k` of a sequence that fills the joints' ranges evenly (multiples of irrational numbers: Weyl's sequence).
pub fn spread_start(robot: &Robot, k: usize) -> Vec<f64> {
    const PRIMES: [f64; 12] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0, 31.0, 37.0];
    let share = |j: usize| ((k + 1) as f64 * PRIMES[j % PRIMES.len()].sqrt() * (1 + j / PRIMES.len()) as f64).fract();
    let place = |(j, joint): (usize, &Joint)| {
        let unlimited = if joint.slides { (-ARM_MM, ARM_MM) } else { (-std::f64::consts::PI, std::f64::consts::PI) };
        let (low, high) = joint.limits_rad.unwrap_or(unlimited);
        low + (high - low) * (0.1 + 0.8 * share(j))
    };
    robot.joints.iter().enumerate().map(place).collect()
}

/// Of the postures found from so many starts spread over the joints' ranges, the best one ([`merit`]).
pub fn best_posture(robot: &Robot, base_from_flange: &Transform, starts: usize) -> Option<Vec<f64>> {
    let middle: Vec<f64> =
        robot.joints.iter().map(|j| j.limits_rad.map_or(0.0, |(low, high)| 0.5 * (low + high))).collect();
    let found = (0..starts).filter_map(|k| {
        let found = approach(robot, base_from_flange, &spread_start(robot, k));
        found.arrived().then(|| unwound(robot, base_from_flange, found, &middle).joints_rad)
    });
    let judged = found.map(|q| (merit(robot, &q), q));
    judged.reduce(|best, next| if next.0 > best.0 { next } else { best }).map(|(_, q)| q)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::corrections::CouplingTerm;

    const THERE: [f64; 6] = [0.4, -0.6, 1.1, 0.3, -0.9, 0.7];

    fn within(most: f64) -> Robot {
        Robot::paper().within(&[(-most, most); 6])
    }

    #[test]
    fn forward_of_inverse_is_the_pose() {
        let robot = within(2.8);
        let wanted = robot.base_from_flange(&THERE);
        let start = THERE.map(|q| q + 0.3);
        let q = from_start(&robot, &wanted, &start).unwrap();
        assert!(miss(&robot, &wanted, &q).norm() < REACHED_MM);
        let is_same = q.iter().zip(&THERE).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(is_same, "the nearby solution is the one we came from");
    }

    #[test]
    fn a_solution_has_no_whole_turns_that_its_start_has_not() {
        for robot in [Robot::paper(), within(TAU)] {
            let wanted = robot.base_from_flange(&THERE);
            let wild = Approach { joints_rad: THERE.iter().map(|q| q + TAU).collect(), miss_mm: 0.0 };
            let q = unwound(&robot, &wanted, wild, &[0.0; 6]);
            assert!(q.joints_rad.iter().zip(&THERE).all(|(a, b)| (a - b).abs() < 1e-12), "{q:?}");
            for k in 0..40 {
                let start = spread_start(&robot, k);
                let Some(q) = from_start(&robot, &wanted, &start) else { continue };
                let far = q.iter().zip(&start).any(|(q, s)| (q - s).abs() > std::f64::consts::PI + 1e-9);
                assert!(!far || robot.joints[0].limits_rad.is_some(), "{q:?} from {start:?}");
            }
            let best = best_posture(&robot, &wanted, 40).unwrap();
            assert!(best.iter().all(|q| q.abs() < std::f64::consts::PI + 1e-9), "{best:?}");
        }
    }

    #[test]
    fn a_turn_of_a_coupled_joint_is_not_taken_off() {
        let mut robot = Robot::paper();
        robot.corrections.couplings = vec![CouplingTerm { joint: 5, of: 4, ratio: 0.3 }];
        let there = [0.4, -0.6, 1.1, 0.3, -0.9 + TAU, 0.7];
        let wanted = robot.base_from_flange(&there);
        let q = unwound(&robot, &wanted, Approach { joints_rad: there.to_vec(), miss_mm: 0.0 }, &[0.0; 6]);
        assert_eq!(q.joints_rad, there);
    }

    /// Four axes: the place is reached whatever the tilt, and what is left of the orientation is the tilt alone.
    #[test]
    fn an_arm_of_few_joints_brings_the_tool_to_its_place() {
        let turn = |a_mm| Joint { a_mm, ..Default::default() };
        let slide = Joint { slides: true, ..Default::default() };
        let robot = Robot { joints: vec![turn(0.0), turn(225.0), turn(175.0), slide], ..Robot::paper() };
        let tool: Transform = Transform::translation(40.0, -25.0, 110.0);
        let tilt = crate::geometry::transform(Vector3::new(3e-3, -2e-3, 0.0), Vector3::zeros());
        let there = robot.base_from_flange(&[0.4, -0.6, 1.1, 30.0]) * tool;
        let wanted = there * tilt;
        let found = approach_place(&robot, &wanted, &tool, &[0.38, -0.63, 1.13, 28.0]);
        assert!(found.arrived(), "{found:?}");
        let left_rad = (robot.base_from_flange(&found.joints_rad) * tool).rotation.angle_to(&wanted.rotation);
        assert!((left_rad - 3e-3_f64.hypot(2e-3)).abs() < 1e-6, "{left_rad}");
    }

    #[test]
    fn out_of_reach_is_none() {
        let robot = Robot::paper();
        let wanted = crate::geometry::transform(Vector3::zeros(), Vector3::new(2000.0, 0.0, 0.0));
        assert_eq!(from_start(&robot, &wanted, &[0.1; 6]), None);
    }

    #[test]
    fn limits_are_kept() {
        let mut robot = Robot::paper();
        let wanted = robot.base_from_flange(&THERE);
        robot.joints[0].limits_rad = Some((-0.3, 0.3));
        if let Some(q) = from_start(&robot, &wanted, &THERE) {
            assert!(q[0].abs() <= 0.3);
        }
    }

    #[test]
    fn a_stretched_wrist_is_not_free() {
        let robot = within(2.8);
        let mut stretched = THERE;
        stretched[4] = 0.0;
        assert!(freedom_mm(&robot, &THERE) > 20.0, "{}", freedom_mm(&robot, &THERE));
        assert!(freedom_mm(&robot, &stretched) < 1e-9);
        assert!((room_rad(&robot, &THERE) - (2.8 - 1.1)).abs() < 1e-12);
    }

    #[test]
    fn any_number_of_joints() {
        let mut robot = Robot::paper();
        let extra = robot.joints[4];
        robot.joints.push(extra);
        let there = [0.4, -0.6, 1.1, 0.3, -0.9, 0.7, 0.2];
        let wanted = robot.base_from_flange(&there);
        let q = from_start(&robot, &wanted, &[0.3; 7]).unwrap();
        assert!(miss(&robot, &wanted, &q).norm() < REACHED_MM);
    }

    #[test]
    fn the_jacobian_agrees_with_differences() {
        let mut robot = Robot::paper();
        let coupling = |joint, of, ratio| CouplingTerm { joint, of, ratio };
        robot.corrections.couplings = vec![coupling(2, 1, 1.0), coupling(4, 4, 0.01), coupling(5, 4, -0.5)];
        robot.joints[3].slides = true;
        let wanted = robot.base_from_flange(&THERE);
        let j = jacobian(&robot, &THERE);
        let h = 1e-6;
        for k in 0..6 {
            let shifted = |by: f64| {
                let mut q = THERE;
                q[k] += by;
                miss(&robot, &wanted, &q)
            };
            let difference = (shifted(h) - shifted(-h)) / (2.0 * h);
            for i in 0..6 {
                assert!((difference[i] - j[(i, k)]).abs() < 1e-4, "row {i}, joint {k}");
            }
        }
    }
}
