//! The instructions of a program that move the robot, and what each of them moves by.

/// Characters of an instruction's target that are quoted.
const QUOTED: usize = 60;

/// Why a motion is not corrected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Cause {
    /// Its target is a pose of the tool.
    #[error("is Cartesian")]
    Cartesian,
    /// Its joint values are computed or written at run time, or stand in another file, a register or a parameter.
    #[error("moves by values that are not numbers in this file")]
    Elsewhere,
    /// Its target is a variable that nothing declares.
    #[error("goes to a point that is declared in none of the files read")]
    Undeclared,
    /// Its position has no type.
    #[error("goes to a position of which the file says neither that it is joints nor that it is Cartesian")]
    Untyped,
    /// What ends an instruction is missing behind it.
    #[error("has no `;` at its end: is the file cut off?")]
    Unended,
    /// It adds something to its target.
    #[error("adds an offset to its target")]
    Offset,
    /// Its target has other axes than the robot.
    #[error("does not give the robot's joints, all of them and no others")]
    Incomplete,
    /// A speed, a force or a sensor leads it.
    #[error("follows a speed, a force or a sensor")]
    Led,
    /// It moves other axes than the robot's.
    #[error("moves external axes")]
    External,
    /// It moves another group of axes, as of a second robot.
    #[error("moves another group of axes than the robot's")]
    Group,
    /// Its word says that it moves, and no more is known of it.
    #[error("is an instruction that is not known here")]
    Unknown,
    /// Two groups of the program have as many joints.
    #[error("moves two groups with as many joints")]
    Groups,
    /// The correction of its target was refused, for this reason.
    #[error("is not corrected: {0}")]
    Refused(String),
}

/// An instruction that moves the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Instruction {
    /// Its line, from 1; counted when the program is read.
    pub line: u64,
    /// Where its first word stands.
    pub(super) at: usize,
    /// Its first word.
    pub word: String,
    /// Its target as it is written.
    pub target: String,
    /// The joint targets that it moves by, by their places in the list, or why there are none that can be corrected.
    pub moves_by: Result<Vec<usize>, Cause>,
}

impl Instruction {
    /// One whose word and target stand at these places.
    pub(super) fn new(
        text: &str,
        word: std::ops::Range<usize>,
        target: std::ops::Range<usize>,
        moves_by: Result<Vec<usize>, Cause>,
    ) -> Instruction {
        // Bytes of any encoding stand here.
        let quoted = text[target].split_whitespace().collect::<Vec<_>>().join(" ").replace(char::is_control, "?");
        let short: String = quoted.chars().take(QUOTED).collect();
        let target = if short.len() < quoted.len() { format!("{short}...") } else { quoted };
        Instruction { line: 0, at: word.start, word: text[word].to_owned(), target, moves_by }
    }
}

impl std::fmt::Display for Instruction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "line {}: {}", self.line, self.word)?;
        if !self.target.is_empty() {
            write!(f, " {}", self.target)?;
        }
        match &self.moves_by {
            Ok(_) => Ok(()),
            Err(cause) => write!(f, " {cause}"),
        }
    }
}
