//! From folders to pairs of picture files.
//!
//! In: a folder, or one for each side. `left/` and `right/`, two folders of any name, also deeper, or names that say
//! the side. Out: pairs in natural order (`2` before `10`), what was taken, and what was left out and why. `listing`
//! finds the pictures, `names` the words for a side, `readings` what could be meant, `matching` which pictures belong
//! together. Goes wrong: no pictures, one side only, two files that claim the same place, more than one reading; the
//! error shows what was found and the call that would do.

mod explain;
mod folders;
mod halves;
#[cfg(test)]
mod layouts;
mod listing;
mod matched;
mod matching;
mod names;
mod pairing;
mod readings;
#[cfg(test)]
mod rivals;
#[cfg(test)]
mod tests;
mod times;

pub use names::natural_order;
pub use pairing::{Halves, PairBy, PairFiles, Pairing, Source};
