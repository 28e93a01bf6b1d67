//! What is said of a hypothesis: its name, and what is to be mended, and where.

use super::Hypothesis;

impl Hypothesis {
    /// In words.
    pub fn name(self) -> String {
        match self {
            Hypothesis::JointRadians(i) => {
                format!("the angles of joint {} are in radians, those of the others in degrees", i + 1)
            }
            Hypothesis::Slide(i, _, unit) => {
                format!("the readings of joint {}, which slides, are in {unit}, not in mm", i + 1)
            }
            Hypothesis::Coordinate(axis, _, unit) => {
                format!("{} of the points is in {unit}, the other coordinates are in mm", ["x", "y", "z"][axis])
            }
            Hypothesis::Part(_, unit) => format!("a part of the readings is in {unit}, the others are in mm"),
            Hypothesis::Coupled(i, times) => {
                let (joint, before) = (i + 1, i);
                let (way, as_on) = match times < 0.0 {
                    true => ("+", " (as Fanuc counts joint 3, from the horizontal)"),
                    false => ("-", ""),
                };
                format!(
                    "joint {joint} is counted together with joint {before}{as_on}: the angle between its links is j{joint} {way} j{before}"
                )
            }
            Hypothesis::Angles(read_as, unit) => {
                format!("the joint angles are in {}, not in {}", unit.word(), read_as.word())
            }
            Hypothesis::Lengths(_, read_as, unit) => {
                format!("the readings are in {}, not in {}", unit.word(), read_as.word())
            }
            Hypothesis::KnownLengths(_, unit) => format!("the known distances are in {unit}, not in mm"),
            Hypothesis::Exchanged(i, j) => {
                format!("the columns of joints {} and {} are exchanged (swapped)", i + 1, j + 1)
            }
            Hypothesis::Negated(i) => {
                format!("joint {} is counted the other way round: its sign is flipped (negated)", i + 1)
            }
            Hypothesis::Offset(i, deg) => format!("joint {} is offset by {deg:.0} deg", i + 1),
            Hypothesis::Twisted(i) => format!("`alpha_deg` of joint {} has the wrong sign", i + 1),
            Hypothesis::Lagging(None, by) => format!("the joints lag {by} row against the readings"),
            Hypothesis::Lagging(Some(i), by) => format!("joint {} lags {by} row against the others", i + 1),
            Hypothesis::StandardDh => "the robot file holds standard DH parameters, not modified ones (MDH)".to_owned(),
            Hypothesis::Counted(counting) => {
                let coupled = counting.coupled.map(|(i, times)| Hypothesis::Coupled(i, times).name());
                counting.signs().into_iter().chain(coupled).collect::<Vec<_>>().join(", and ")
            }
            Hypothesis::Mirrored => "the coordinates are mirrored: a left-handed frame".to_owned(),
        }
    }

    /// Whether readings of the joints, in other files too, mean something else than the robot file says.
    pub fn is_of_counting(self) -> bool {
        use Hypothesis::{Counted, Coupled, Exchanged, Negated, Offset, StandardDh, Twisted};
        matches!(self, Counted(_) | Coupled(..) | Exchanged(..) | Negated(_) | Offset(..) | StandardDh | Twisted(_))
    }

    /// What is to be mended, and where. A controller that counts its joints in its own way is a matter of the robot
    /// file; a table that was written otherwise than the controller counts is one of the table.
    pub fn mend(self) -> String {
        match self {
            Hypothesis::Negated(i) => {
                format!(
                    "the `sign` of joint {} in the robot file where the controller counts so, else the table",
                    i + 1
                )
            }
            Hypothesis::Offset(i, deg) => format!(
                "`theta_deg` of joint {} in the robot file, by {deg:+.0}, where the controller counts so, else the table",
                i + 1
            ),
            Hypothesis::Twisted(i) => format!("`alpha_deg` of joint {} in the robot file", i + 1),
            // A robot file has no word for it.
            Hypothesis::Coupled(i, times) => {
                let ([joint, before], [there, back]) = ([i + 1, i], if times < 0.0 { ['+', '-'] } else { ['-', '+'] });
                format!(
                    "the table: joint {joint} as j{joint} {there} j{before}, in targets too, and j{joint} {back} j{before} in what `compensate` writes"
                )
            }
            Hypothesis::Counted(counting) => {
                let signs = counting.signs().map(|_| {
                    format!(
                        "the `sign` of joints {} in the robot file where the controller counts so, else the table",
                        counting.numbers()
                    )
                });
                let coupled = counting.coupled.map(|(i, times)| Hypothesis::Coupled(i, times).mend());
                signs.into_iter().chain(coupled).collect::<Vec<_>>().join("; and ")
            }
            Hypothesis::StandardDh => "the robot file: `robot import TABLE --dh classic` reads such rows".to_owned(),
            Hypothesis::Mirrored => {
                "the table, of which x is negated here and in what is placed: whether x, y or z has the wrong sign, or two \
                 of them are exchanged, the readings do not tell"
                    .to_owned()
            }
            _ => "the table".to_owned(),
        }
    }
}
