//! Codes of markers: OpenCV's dictionaries by OpenCV's names. No other file names the crate that holds them.
//!
//! In: the bits of a marker as they are seen, row by row. Out: which marker of which dictionary has them, and how it is
//! turned.

use std::fmt;

use calib_targets_aruco::builtins::{BUILTIN_DICTIONARY_NAMES, builtin_dictionary};
use calib_targets_aruco::rotate_code_u64;

/// What OpenCV's names of families of AprilTags begin with.
const TAGS: &str = "DICT_APRILTAG_";

/// A set of markers, all of equally many bits.
#[derive(Clone, Copy)]
pub struct Dictionary(calib_targets_aruco::Dictionary);

impl PartialEq for Dictionary {
    fn eq(&self, other: &Dictionary) -> bool {
        self.name() == other.name()
    }
}

impl fmt::Debug for Dictionary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Dictionary {
    /// The dictionary of this name, in any case and with or without `DICT_`; or why there is none.
    pub fn named(text: &str) -> Result<Dictionary, String> {
        let same = |known: &Dictionary| {
            let short = known.name().strip_prefix("DICT_").unwrap_or(known.name());
            text.eq_ignore_ascii_case(known.name()) || text.eq_ignore_ascii_case(short)
        };
        Dictionary::all().find(same).ok_or_else(|| {
            format!("there is no dictionary `{text}`; there are {}", BUILTIN_DICTIONARY_NAMES.join(", "))
        })
    }

    /// The family of AprilTags of this name: `tag36h11`, as its makers write it, `t36h11` as Kalibr does, or OpenCV's
    /// name.
    pub fn of_tags(text: &str) -> Result<Dictionary, String> {
        let lower = text.to_ascii_lowercase();
        let size = lower.strip_prefix("tag").or_else(|| lower.strip_prefix('t')).unwrap_or(&lower);
        let families = || Dictionary::all().filter(|known| known.is_of_tags());
        let same = |known: &Dictionary| {
            text.eq_ignore_ascii_case(known.name()) || known.name()[TAGS.len()..].eq_ignore_ascii_case(size)
        };
        families().find(same).ok_or_else(|| {
            if let Ok(markers) = Dictionary::named(text) {
                let name = markers.name();
                return format!(
                    "{name} are ArUco markers; a grid of them is `aruco:COLSxROWS:{name}:MARKER_MM:GAP_MM`"
                );
            }
            let names: Vec<String> = families().map(Dictionary::said).collect();
            format!("there is no family of tags `{text}`; there are {}", names.join(", "))
        })
    }

    /// Whether it is a family of AprilTags.
    pub fn is_of_tags(self) -> bool {
        self.name().starts_with(TAGS)
    }

    /// Its name for a person: a family of AprilTags as its makers write it.
    pub fn said(self) -> String {
        match self.name().strip_prefix(TAGS) {
            Some(family) => format!("tag{}", family.to_ascii_lowercase()),
            None => self.name().to_owned(),
        }
    }

    /// All that there are, the smallest first: where two begin alike, it comes before the one that goes on.
    pub fn all() -> impl Iterator<Item = Dictionary> {
        let known = BUILTIN_DICTIONARY_NAMES.iter().filter_map(|name| builtin_dictionary(name)).map(Dictionary);
        let mut all: Vec<Dictionary> = known.collect();
        all.sort_by_key(|dictionary| dictionary.count());
        all.into_iter()
    }

    /// OpenCV's name.
    pub fn name(self) -> &'static str {
        self.0.name()
    }

    /// Bits along a marker's side, without its border.
    pub fn bits(self) -> usize {
        self.0.marker_size()
    }

    /// How many markers there are.
    pub fn count(self) -> usize {
        self.0.codes().len()
    }

    /// Whether its first markers are those of another.
    pub fn begins_with(self, other: Dictionary) -> bool {
        self.bits() == other.bits() && self.0.codes().starts_with(other.0.codes())
    }

    /// The bits of a marker, row by row from the lowest, one for black; `None` where the dictionary has no such marker.
    pub fn code(self, id: usize) -> Option<u64> {
        self.0.codes().get(id).copied()
    }
}

/// The bits of a marker that is turned by so many quarter turns.
pub fn turned(code: u64, bits: usize, quarters: usize) -> u64 {
    rotate_code_u64(code, bits, (quarters % 4) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn families_of_tags_have_the_names_of_their_makers() {
        for name in ["tag36h11", "t36h11", "36h11", "TAG36H11", "DICT_APRILTAG_36h11"] {
            assert_eq!(Dictionary::of_tags(name).map(Dictionary::said), Ok("tag36h11".to_owned()), "{name}");
        }
        let why = Dictionary::of_tags("tag36h12").unwrap_err();
        assert!(["tag16h5", "tag25h9", "tag36h11"].iter().all(|name| why.contains(name)), "{why}");
    }
}
