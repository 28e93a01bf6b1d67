//! The pairs of a source.

use super::halves;
use super::pairing::{Pairing, Source};
use crate::files::OutDir;
use crate::imaging::Result;

impl Source<'_> {
    /// Finds the pairs. At least one, else an error that says what was there. Halves of pictures are written among the program's own
    /// files in `out`.
    pub fn pairs(&self, out: &OutDir) -> Result<Pairing> {
        match self.halves {
            Some(halves) => halves::split(self, halves, out),
            None => self.whole_pictures(),
        }
    }
}
