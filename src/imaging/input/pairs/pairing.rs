//! What is asked of folders of pictures, and what they are understood as.

use camino::{Utf8Path, Utf8PathBuf};

use super::listing::Aside;

/// How pictures were paired, or are to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum PairBy {
    /// By their names, a word for the side left away
    Name,
    /// By the number in their names
    Number,
    /// In the order of their names; as many left pictures as right ones
    Order,
    /// By the times in their names, the nearest ones
    Time,
}

impl PairBy {
    /// The word in messages.
    pub fn word(self) -> &'static str {
        ["name", "number", "order", "time"][self as usize]
    }
}

/// The two picture files of a pair.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PairFiles {
    /// Name of the pair: the pictures' common stem, what is left of both without the word for the side, or their
    /// number.
    pub pair: String,
    pub left: Utf8PathBuf,
    pub right: Utf8PathBuf,
}

/// Where pictures are, and how they are to be read.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a> {
    /// The command that asks, for the calls in messages.
    pub command: &'a str,
    /// The folder of all pictures, or of the left ones.
    pub images: &'a Utf8Path,
    /// The folder of the right ones.
    pub right: Option<&'a Utf8Path>,
    /// How they are paired; `None` is by name, else by number, else by time.
    pub by: Option<PairBy>,
    /// How each picture holds both views, if it does.
    pub halves: Option<Halves>,
    /// How many pairs are of use: fewer give way to as many that lie elsewhere.
    pub needed: usize,
}

/// How a picture holds both views.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Halves {
    /// The left camera's on the left.
    SideBySide,
    /// The left camera's on top.
    TopBottom,
}

impl Halves {
    /// The flag that says so.
    pub fn flag(self) -> &'static str {
        ["--side-by-side", "--top-bottom"][self as usize]
    }

    /// The two halves, the left camera's first.
    pub fn words(self) -> [&'static str; 2] {
        [["left", "right"], ["upper", "lower"]][self as usize]
    }

    /// The extent that is cut.
    pub fn extent(self) -> &'static str {
        ["wide", "high"][self as usize]
    }
}

/// A folder understood.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Pairing {
    /// The folder, as messages name it.
    pub place: Utf8PathBuf,
    /// Pairs in natural order of their names.
    pub pairs: Vec<PairFiles>,
    /// What was taken, in a line.
    pub taken: String,
    /// Pictures of one side without the other.
    pub single: Vec<Utf8PathBuf>,
    /// Whether both sides have as many pictures, some of them without a partner.
    pub could_be_in_order: bool,
    /// Pictures whose names tell no side.
    pub sideless: usize,
    /// Files of these folders that are passed over.
    pub aside: Aside,
}

impl<'a> Source<'a> {
    /// One folder, read as it is.
    pub fn folder(command: &'a str, images: &'a Utf8Path) -> Source<'a> {
        Source { command, images, right: None, by: None, halves: None, needed: 1 }
    }

    /// The folders that were named.
    pub fn places(&self) -> Vec<&'a Utf8Path> {
        std::iter::once(self.images).chain(self.right).collect()
    }
}
