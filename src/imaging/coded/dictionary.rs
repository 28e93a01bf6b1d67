//! Codes of markers: OpenCV's dictionaries by OpenCV's names. No other file names the crate that holds them.
//!
//! In: the bits of a marker as they are seen, row by row. Out: which marker of which dictionary has them, and how it is turned.

use std::fmt;

use calib_targets_aruco::builtins::{BUILTIN_DICTIONARY_NAMES, builtin_dictionary};
use calib_targets_aruco::{resolve_dictionary, rotate_code_u64};

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
        let same = |name: &&&str| {
            let short = name.strip_prefix("DICT_").unwrap_or(name);
            text.eq_ignore_ascii_case(name) || text.eq_ignore_ascii_case(short)
        };
        let known = BUILTIN_DICTIONARY_NAMES.iter().find(same);
        let found = known.and_then(|name| builtin_dictionary(name)).or_else(|| resolve_dictionary(text));
        found.map(Dictionary).ok_or_else(|| {
            format!("there is no dictionary `{text}`; there are {}", BUILTIN_DICTIONARY_NAMES.join(", "))
        })
    }

    /// All that there are.
    pub fn all() -> impl Iterator<Item = Dictionary> {
        BUILTIN_DICTIONARY_NAMES.iter().filter_map(|name| builtin_dictionary(name)).map(Dictionary)
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

    /// The bits of a marker, row by row from the lowest, one for black; `None` where the dictionary has no such marker.
    pub fn code(self, id: usize) -> Option<u64> {
        self.0.codes().get(id).copied()
    }
}

/// The bits of a marker that is turned by so many quarter turns.
pub fn turned(code: u64, bits: usize, quarters: usize) -> u64 {
    rotate_code_u64(code, bits, (quarters % 4) as u8)
}
