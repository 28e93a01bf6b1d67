//! How far apart the lines of a board's corners are.
//!
//! In: the kind of a board. Out: where its lines lie, in sides of a square or a tag. Squares follow one another evenly.
//! Tags have gaps between them, so that the lines of their corners are a tag and a gap apart in turn; a lattice of them
//! begins with a tag.

/// How the lines of corners follow one another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pitch {
    /// Evenly: one side of a square apart.
    Even,
    /// A tag apart and a gap apart in turn, the tag first.
    Tags {
        /// Width of a gap, in sides of a tag.
        gap: f64,
    },
}

impl Pitch {
    /// Where a line lies from line 0; lines before that count on below zero.
    pub fn at(self, line: isize) -> f64 {
        match self {
            Pitch::Even => line as f64,
            Pitch::Tags { gap } => line.div_euclid(2) as f64 * (1.0 + gap) + line.rem_euclid(2) as f64,
        }
    }

    /// How far the line after this one is from it.
    pub fn after(self, line: isize) -> f64 {
        self.at(line + 1) - self.at(line)
    }

    /// The least distance of two lines.
    pub fn least(self) -> f64 {
        self.after(0).min(self.after(1))
    }

    /// True where the distance from a line to the one so many lines on is that from line 0 to the one so many on.
    pub fn is_as_from_first(self, line: usize, lines: usize) -> bool {
        match self {
            Pitch::Even => true,
            Pitch::Tags { .. } => line.is_multiple_of(2) || lines.is_multiple_of(2),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_and_gaps_follow_in_turn() {
        let pitch = Pitch::Tags { gap: 0.25 };
        assert_eq!([-2, -1, 0, 1, 2, 3].map(|k| pitch.at(k)), [-1.25, -0.25, 0.0, 1.0, 1.25, 2.25]);
        assert_eq!([-1, 0, 1].map(|k| pitch.after(k)), [0.25, 1.0, 0.25]);
        assert_eq!(pitch.least(), 0.25);
        for line in 0..5 {
            for lines in 0..5 {
                let distance = pitch.at((line + lines) as isize) - pitch.at(line as isize);
                assert_eq!(pitch.is_as_from_first(line, lines), distance == pitch.at(lines as isize));
            }
        }
        assert_eq!([-1, 0, 3].map(|k| Pitch::Even.at(k)), [-1.0, 0.0, 3.0]);
    }
}
