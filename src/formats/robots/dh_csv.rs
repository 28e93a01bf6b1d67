//! A Denavit-Hartenberg table: a row a joint from the base, columns alpha, a, theta and d in any order, optionally
//! `beta_deg` and limits, `min_deg,max_deg`.
//!
//! In: a table in any form, with names of its columns or without, or the text of a program or of settings
//! ([`super::dh_text`]). Cells may be formulas (`pi/2`, `q2 - 90`). Out: every way to read it, each with what was taken
//! and what is open; with names of columns there is one. Where some rows have their joint's variable for theta, rows at
//! the end without one are the flange. What goes wrong: rows that hold still between others, sliding joints, and what
//! numbers rule out; refused with the line.

mod beside;
mod document;
mod front;
mod latex;
mod names;
mod offsets;
mod prepared;
mod reading;
mod table;
mod units;

use std::fmt::Write as _;

pub use self::front::{Asked, readings};
pub use self::reading::Reading;
pub use self::units::Open;
use crate::robot::{Joint, Robot};

/// The modified table of a robot: what a table can carry.
pub fn to_csv(robot: &Robot) -> String {
    // Where its ends look like those of a classic table, the column says which it is.
    let twists = |joint: Option<&Joint>| joint.is_some_and(|j| j.alpha_rad != 0.0);
    let as_classic = twists(robot.joints.first()) && !twists(robot.joints.last());
    let beta = as_classic || robot.joints.iter().any(|j| j.beta_rad != 0.0);
    let limits = robot.joints.iter().any(|j| j.limits_rad.is_some());
    let mut text = "alpha_deg,a_mm,theta_deg,d_mm".to_owned();
    text.push_str(if beta { ",beta_deg" } else { "" });
    text.push_str(if limits { ",min_deg,max_deg\n" } else { "\n" });
    for j in &robot.joints {
        let _ = write!(text, "{},{},{},{}", j.alpha_rad.to_degrees(), j.a_mm, j.theta_rad.to_degrees(), j.d_mm);
        if beta {
            let _ = write!(text, ",{}", j.beta_rad.to_degrees());
        }
        match j.limits_rad {
            Some((low, high)) => {
                let _ = write!(text, ",{},{}", low.to_degrees(), high.to_degrees());
            }
            None if limits => text.push_str(",,"),
            None => {}
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests;
