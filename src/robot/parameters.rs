//! The robot as a vector of parameters, in mm and mrad (about equal effect at a robot's reach), and their names.

use super::anatomy::Anatomy;
use super::corrections::{CouplingTerm, GravityTerm, HarmonicTerm, LoadPoint, Wave};
use super::{Joint, Robot};

/// |sin alpha| below which two neighbouring axes count as parallel: 3 degrees, far above any tolerance of manufacture.
pub(super) const PARALLEL_SIN: f64 = 0.05;

/// One number of the robot. Joints count from 0 here and as in the paper in [`Parameter::name`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Parameter {
    /// Twist of the link before the joint.
    Alpha(usize),
    /// Length of the link before the joint.
    A(usize),
    /// Hayati's rotation about y before the joint.
    Beta(usize),
    /// Offset of the joint's angle.
    Theta(usize),
    /// Offset along the joint's axis.
    D(usize),
    /// The target point along x, y or z (0, 1, 2) of the last joint's frame.
    V(usize),
    /// Compliance of a joint under a weight.
    Gravity(usize, LoadPoint),
    /// Compliance of a joint's bearing, across its axis, under a weight.
    Bending(usize, LoadPoint),
    /// Amplitude of a periodic error.
    Harmonic(usize, Wave),
    /// Amplitude with which a joint's axis tilts as it turns.
    Wobble(usize, Wave),
    /// What a joint does by itself as another joint moves (itself: an error of its scale).
    Coupling(usize, usize),
}

/// Unit of a parameter in vectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    Mm,
    Mrad,
}

impl Parameter {
    /// Unit in files, and what to multiply mm or mrad by.
    pub fn file_unit(self) -> (&'static str, f64) {
        match (self, self.unit()) {
            (_, Unit::Mm) => ("mm", 1.0),
            (Parameter::Gravity(..) | Parameter::Bending(..), _) => ("mrad/m", 1.0),
            (Parameter::Harmonic(..) | Parameter::Wobble(..), _) => ("mrad", 1.0),
            (Parameter::Coupling(..), _) => ("1e-3", 1.0),
            _ => ("deg", (1e-3f64).to_degrees()),
        }
    }

    /// Its name: `alpha_0..`, `a_0..`, `beta_2..`, `theta_1..`, `d_1..`, `v_x`, `k_2_elbow`, `sin_1`, ...
    pub fn name(self) -> String {
        match self {
            Parameter::Alpha(i) => format!("alpha_{i}"),
            Parameter::A(i) => format!("a_{i}"),
            Parameter::Beta(i) => format!("beta_{i}"),
            Parameter::Theta(i) => format!("theta_{}", i + 1),
            Parameter::D(i) => format!("d_{}", i + 1),
            Parameter::V(0) => "v_x".to_owned(),
            Parameter::V(1) => "v_y".to_owned(),
            Parameter::V(_) => "v_z".to_owned(),
            Parameter::Gravity(i, point) => format!("k_{}_{}", i + 1, point.name()),
            Parameter::Bending(i, point) => format!("bend_{}_{}", i + 1, point.name()),
            Parameter::Harmonic(i, wave) => format!("{}_{}", wave.name(), i + 1),
            Parameter::Wobble(i, wave) => format!("wobble_{}_{}", wave.name(), i + 1),
            Parameter::Coupling(i, of) if i == of => format!("scale_{}", i + 1),
            Parameter::Coupling(i, of) => format!("coupling_{}_{}", i + 1, of + 1),
        }
    }

    /// The joint whose angle a correction changes at a pose; `None` for the chain's own parameters, the target's and
    /// those that tilt a link.
    pub fn corrected_joint(self) -> Option<usize> {
        match self {
            Parameter::Gravity(i, _) | Parameter::Harmonic(i, _) | Parameter::Coupling(i, _) => Some(i),
            _ => None,
        }
    }

    /// The joint whose link a correction tilts at a pose.
    pub fn tilted_joint(self) -> Option<usize> {
        match self {
            Parameter::Bending(i, _) | Parameter::Wobble(i, _) => Some(i),
            _ => None,
        }
    }

    /// mm for lengths, mrad for angles (compliances: mrad a metre of lever; couplings: thousandths).
    pub fn unit(self) -> Unit {
        match self {
            Parameter::A(_) | Parameter::D(_) | Parameter::V(_) => Unit::Mm,
            _ => Unit::Mrad,
        }
    }
}

impl Robot {
    /// The paper's parameters, 4 a joint and 3 of the target: alpha, a, theta, d joint by joint, then v.
    pub fn mdh_parameters(&self) -> Vec<Parameter> {
        let joint = |i| [Parameter::Alpha(i), Parameter::A(i), Parameter::Theta(i), Parameter::D(i)];
        (0..self.joints.len()).flat_map(joint).chain((0..3).map(Parameter::V)).collect()
    }

    /// Hayati's rotation for every pair of neighbouring axes that are parallel (none before the first joint: the base
    /// is free).
    pub fn beta_parameters(&self) -> Vec<Parameter> {
        let parallel = |i: &usize| self.joints[*i].alpha_rad.sin().abs() < PARALLEL_SIN;
        (1..self.joints.len()).filter(parallel).map(Parameter::Beta).collect()
    }

    /// Compliances under the arm's own weight, of the shoulder and the elbow, and of the base where its axis does not
    /// stand along gravity, then (`tool`) under the load's of all joints from the shoulder to the wrist, those that
    /// turn a link about itself too. The joints come from the chain's geometry (see `super::anatomy`).
    pub fn gravity_parameters(&self, tool: bool) -> Vec<Parameter> {
        let Some(anatomy) = Anatomy::of(self) else { return Vec::new() };
        let (shoulder, elbow, wrist) = (anatomy.shoulder, anatomy.elbow, anatomy.wrist);
        let of_origin = |joint: usize, at: usize| Parameter::Gravity(joint, LoadPoint::Origin(at));
        let mut terms = vec![of_origin(shoulder, elbow), of_origin(shoulder, wrist), of_origin(elbow, wrist)];
        let leaning = anatomy.base_leans(self);
        if leaning {
            terms.extend([of_origin(0, elbow), of_origin(0, wrist)]);
        }
        if tool {
            let joints = (shoulder..=wrist).chain(leaning.then_some(0));
            terms.extend(joints.map(|joint| Parameter::Gravity(joint, LoadPoint::Tool)));
        }
        terms.retain(|t| t.corrected_joint().is_some_and(|j| !self.joints[j].slides));
        terms
    }

    /// Compliances across the axes of the joints from the base to the wrist under the load's weight: what bearings and
    /// links yield.
    pub fn bending_parameters(&self) -> Vec<Parameter> {
        let Some(anatomy) = Anatomy::of(self) else { return Vec::new() };
        (0..=anatomy.wrist).map(|joint| Parameter::Bending(joint, LoadPoint::Tool)).collect()
    }

    /// An error of scale of every joint, and with `neighbours` what each does by itself as the joint before it moves
    /// (a parallelogram, a cable that runs over two joints).
    pub fn coupling_parameters(&self, neighbours: bool) -> Vec<Parameter> {
        let count = self.joints.len();
        let mut terms: Vec<Parameter> = (0..count).map(|i| Parameter::Coupling(i, i)).collect();
        if neighbours {
            let same = |i: &usize| self.joints[*i].slides == self.joints[*i - 1].slides;
            terms.extend((1..count).filter(same).map(|i| Parameter::Coupling(i, i - 1)));
        }
        terms
    }

    /// Once-a-turn (`order` 1) or also twice-a-turn (`order` 2) errors of every joint.
    pub fn harmonic_parameters(&self, order: usize) -> Vec<Parameter> {
        let waves = &Wave::ALL[..(2 * order).min(4)];
        let turning = (0..self.joints.len()).filter(|&i| !self.joints[i].slides);
        turning.flat_map(|i| waves.iter().map(move |&w| Parameter::Harmonic(i, w))).collect()
    }

    /// Once-a-turn wobble of the axis of every joint that turns.
    pub fn wobble_parameters(&self) -> Vec<Parameter> {
        let turning = (0..self.joints.len()).filter(|&i| !self.joints[i].slides);
        turning.flat_map(|i| [Wave::Sin, Wave::Cos].map(|wave| Parameter::Wobble(i, wave))).collect()
    }

    /// The parameter's value, mm or mrad.
    pub fn value(&self, parameter: Parameter) -> f64 {
        let joint = |i: usize| self.joints.get(i);
        match parameter {
            Parameter::Alpha(i) => joint(i).map_or(0.0, |j| 1000.0 * j.alpha_rad),
            Parameter::A(i) => joint(i).map_or(0.0, |j| j.a_mm),
            Parameter::Beta(i) => joint(i).map_or(0.0, |j| 1000.0 * j.beta_rad),
            Parameter::Theta(i) => joint(i).map_or(0.0, |j| 1000.0 * j.theta_rad),
            Parameter::D(i) => joint(i).map_or(0.0, |j| j.d_mm),
            Parameter::V(axis) => self.tool_mm[axis.min(2)],
            Parameter::Gravity(joint, point) => 1000.0 * compliance(&self.corrections.gravity, joint, point),
            Parameter::Bending(joint, point) => 1000.0 * compliance(&self.corrections.bending, joint, point),
            Parameter::Harmonic(joint, wave) => 1000.0 * amplitude(&self.corrections.harmonics, joint, wave),
            Parameter::Wobble(joint, wave) => 1000.0 * amplitude(&self.corrections.wobble, joint, wave),
            Parameter::Coupling(joint, of) => {
                let terms = self.corrections.couplings.iter();
                1000.0 * terms.filter(|t| t.joint == joint && t.of == of).map(|t| t.ratio).sum::<f64>()
            }
        }
    }

    /// Adds to a parameter, mm or mrad. A joint that the robot lacks is left alone.
    pub fn add(&mut self, parameter: Parameter, delta: f64) {
        let angle = delta / 1000.0;
        let mut joint = |i: usize, add: &dyn Fn(&mut Joint)| self.joints.get_mut(i).into_iter().for_each(add);
        match parameter {
            Parameter::Alpha(i) => joint(i, &|j| j.alpha_rad += angle),
            Parameter::A(i) => joint(i, &|j| j.a_mm += delta),
            Parameter::Beta(i) => joint(i, &|j| j.beta_rad += angle),
            Parameter::Theta(i) => joint(i, &|j| j.theta_rad += angle),
            Parameter::D(i) => joint(i, &|j| j.d_mm += delta),
            Parameter::V(axis) => self.tool_mm[axis.min(2)] += delta,
            Parameter::Gravity(joint, point) => add_compliance(&mut self.corrections.gravity, joint, point, angle),
            Parameter::Bending(joint, point) => add_compliance(&mut self.corrections.bending, joint, point, angle),
            Parameter::Harmonic(joint, wave) => add_amplitude(&mut self.corrections.harmonics, joint, wave, angle),
            Parameter::Wobble(joint, wave) => add_amplitude(&mut self.corrections.wobble, joint, wave, angle),
            Parameter::Coupling(joint, of) => {
                let terms = &mut self.corrections.couplings;
                match terms.iter_mut().find(|t| t.joint == joint && t.of == of) {
                    Some(term) => term.ratio += angle,
                    None => terms.push(CouplingTerm { joint, of, ratio: angle }),
                }
            }
        }
    }

    /// The robot with `delta` (mm, mrad) added to `parameters`.
    pub fn shifted(&self, parameters: &[Parameter], delta: &[f64]) -> Robot {
        let mut robot = self.clone();
        for (&parameter, &delta) in parameters.iter().zip(delta) {
            if delta != 0.0 {
                robot.add(parameter, delta);
            }
        }
        robot
    }
}

/// The compliance of a joint to a weight, rad a metre of lever.
fn compliance(terms: &[GravityTerm], joint: usize, point: LoadPoint) -> f64 {
    terms.iter().filter(|t| t.joint == joint && t.point == point).map(|t| t.k_rad_per_m).sum()
}

fn add_compliance(terms: &mut Vec<GravityTerm>, joint: usize, point: LoadPoint, k_rad_per_m: f64) {
    match terms.iter_mut().find(|t| t.joint == joint && t.point == point) {
        Some(term) => term.k_rad_per_m += k_rad_per_m,
        None => terms.push(GravityTerm { joint, point, k_rad_per_m }),
    }
}

/// The amplitude of a joint's wave, rad.
fn amplitude(terms: &[HarmonicTerm], joint: usize, wave: Wave) -> f64 {
    terms.iter().filter(|t| t.joint == joint && t.wave == wave).map(|t| t.amplitude_rad).sum()
}

fn add_amplitude(terms: &mut Vec<HarmonicTerm>, joint: usize, wave: Wave, amplitude_rad: f64) {
    match terms.iter_mut().find(|t| t.joint == joint && t.wave == wave) {
        Some(term) => term.amplitude_rad += amplitude_rad,
        None => terms.push(HarmonicTerm { joint, wave, amplitude_rad }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_robot_has_27_parameters_and_two_parallel_pairs() {
        let robot = Robot::paper();
        let names: Vec<String> = robot.mdh_parameters().into_iter().map(Parameter::name).collect();
        assert_eq!(names.len(), 27);
        assert_eq!(names[..5], ["alpha_0", "a_0", "theta_1", "d_1", "alpha_1"]);
        assert_eq!(names[24..], ["v_x", "v_y", "v_z"]);
        assert_eq!(robot.beta_parameters(), [Parameter::Beta(2), Parameter::Beta(3)]);
    }

    #[test]
    fn what_is_added_is_there() {
        let robot = Robot::paper();
        let mut parameters = robot.mdh_parameters();
        parameters.extend(robot.beta_parameters());
        parameters.extend(robot.gravity_parameters(true));
        parameters.extend(robot.bending_parameters());
        parameters.extend(robot.wobble_parameters());
        parameters.extend(robot.harmonic_parameters(2));
        parameters.extend(robot.coupling_parameters(true));
        let delta: Vec<f64> = (0..parameters.len()).map(|i| 0.1 + i as f64).collect();
        let shifted = robot.shifted(&parameters, &delta);
        for (&p, d) in parameters.iter().zip(&delta) {
            // Angles near 1571 mrad carry rounding of 1e-13.
            assert!((shifted.value(p) - robot.value(p) - d).abs() < 1e-10, "{}", p.name());
        }
    }
}
