//! Which joint of the robot each number of a program's target is.

use super::language::Language;

/// Joints that a maker's language has in the robot's own order; what stands behind them is an axis of its own.
const MOST_ORDERED: usize = 6;

/// Of each number of a target the joint that it moves, from 0.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JointOrder {
    joints: Vec<usize>,
    stated: bool,
}

impl JointOrder {
    /// How a person says it.
    pub const HINT: &str = "`--joint-order` names the joint of the robot file that each number is; `1,2,4,5,6,7,3` where the seventh is the third joint";

    /// Joints from 1 as a person lists them; the robot's own order where nothing is said.
    ///
    /// # Errors
    /// Where a list does not have each joint once, for a person.
    pub fn new(listed: &[usize], count: usize) -> Result<JointOrder, String> {
        let mut sorted = listed.to_vec();
        sorted.sort_unstable();
        if !listed.is_empty() && !sorted.into_iter().eq(1..=count) {
            return Err(format!("--joint-order is to have each of the numbers 1 to {count} once"));
        }
        let joints = if listed.is_empty() { (0..count).collect() } else { listed.iter().map(|j| j - 1).collect() };
        Ok(JointOrder { joints, stated: !listed.is_empty() })
    }

    /// What the language calls the axis whose joint nobody said, where it has one for a robot of so many joints.
    pub fn unknown_axis(&self, language: Language) -> Option<&'static str> {
        language.seventh().filter(|_| !self.stated && self.joints.len() > MOST_ORDERED)
    }

    /// What stands for each joint, in the order of a target's numbers.
    pub fn in_program<T: Copy>(&self, of_joints: &[T]) -> Vec<T> {
        self.joints.iter().map(|&joint| of_joints[joint]).collect()
    }

    /// A target's numbers, in the order of the robot's joints.
    pub fn of_robot(&self, in_program: &[f64]) -> Vec<f64> {
        let mut readings = vec![0.0; in_program.len()];
        self.joints.iter().zip(in_program).for_each(|(&joint, reading)| readings[joint] = *reading);
        readings
    }
}
