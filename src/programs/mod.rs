//! Robot programs: joint targets read out of the makers' languages, put back in place, and lists of stops written as
//! programs.
//!
//! In: a program's text, or a list of stops. Out: every instruction that moves the robot with the joint targets that it
//! moves by, their readings in deg (mm where a joint slides), the text with other readings and nothing else changed; or
//! a program that moves, waits, triggers and logs. Only targets written as numbers in joint coordinates can be changed;
//! an instruction that moves by anything else is named with the reason. What goes wrong: pulses (Yaskawa) without their
//! number a degree. Doubt counts as not corrected: a variable that anything may write into at run time holds what the
//! file does not say.

mod dialect;
mod encoding;
mod handed;
mod instruction;
mod joint_order;
mod language;
mod read;
mod scan;
#[cfg(test)]
mod tests;
mod variables;

pub use dialect::program;
pub use encoding::{Encoding, decoded};
pub use instruction::{Cause, Instruction};
pub use joint_order::JointOrder;
pub use language::{Joints, Language, Motion, Stop, Target, unread};
pub use read::{Program, edited, targets, with_readings};
