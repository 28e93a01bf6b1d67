//! What was seen and is no part of the calibration, with its causes.

use serde::Serialize;

use crate::imaging::{Side, Skipped};
use crate::stereo::Error;
use crate::stereo::data::View;

/// What happened to a pair, or to the rig over the pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Cause {
    /// No board was found in one of its pictures, or too little of it.
    NoBoard,
    /// It is another pair once more.
    Duplicate,
    /// A picture's corners form no board: misread, blurred, or taken in motion or line by line.
    Misread,
    /// Its corners are numbered from another end of the board in one picture than in the other.
    Numbering,
    /// Left and right picture are exchanged.
    Exchanged,
    /// A picture is mirrored.
    Mirrored,
    /// A picture is turned.
    Turned,
    /// Its pictures belong to different pairs.
    OtherPair,
    /// The board or a camera moved between its two pictures.
    NotSimultaneous,
    /// The board is another one, of another pitch.
    OtherBoard,
    /// The right camera turned about the vertical axis of its picture.
    Yaw,
    /// About the horizontal axis.
    Pitch,
    /// About its line of sight.
    Roll,
    /// The distance of the cameras changed.
    Baseline,
    /// A focal length changed.
    Focus,
    /// A camera is not the one whose lens was given.
    OtherCamera,
    /// The right camera stands and looks otherwise, in more than one way.
    CameraMoved,
    /// It belongs to what was photographed before the pair that was asked for.
    Before,
    /// A slide of the board was not as long as was said.
    KnownMove,
    /// It contradicts the others, and nothing that is known here explains it better than the rest.
    Unknown,
}

impl Cause {
    /// The word that files have for it.
    pub fn word(self) -> &'static str {
        match self {
            Cause::NoBoard => "no-board",
            Cause::Duplicate => "duplicate",
            Cause::Misread => "misread",
            Cause::Numbering => "numbering",
            Cause::Exchanged => "exchanged",
            Cause::Mirrored => "mirrored",
            Cause::Turned => "turned",
            Cause::OtherPair => "other-pair",
            Cause::NotSimultaneous => "not-simultaneous",
            Cause::OtherBoard => "other-board",
            Cause::Yaw => "yaw",
            Cause::Pitch => "pitch",
            Cause::Roll => "roll",
            Cause::Baseline => "baseline",
            Cause::Focus => "focus",
            Cause::OtherCamera => "other-camera",
            Cause::CameraMoved => "camera-moved",
            Cause::Before => "before",
            Cause::KnownMove => "known-move",
            Cause::Unknown => "unknown",
        }
    }

    /// The words of causes that are not told apart, each once, with `|` between them.
    pub fn words(causes: impl Iterator<Item = Cause>) -> String {
        let mut words: Vec<&str> = Vec::new();
        causes.map(Cause::word).for_each(|word| {
            if !words.contains(&word) {
                words.push(word)
            }
        });
        words.join("|")
    }

    /// True where the rig may have changed instead: what happened is unknown, or a rig that changed looks the same.
    pub fn may_be_the_rig(self) -> bool {
        matches!(self, Cause::Unknown | Cause::NotSimultaneous | Cause::OtherBoard)
    }

    /// True where the pair is one of the series and contradicts the others: not one without a board, shown twice, or of
    /// a rig that stood before.
    pub fn contradicts(self) -> bool {
        use Cause::{Before, CameraMoved, Duplicate, Focus, NoBoard};
        !matches!(self, NoBoard | Duplicate | Before | CameraMoved | Focus)
    }
}

/// A pair that is not used.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DiscardedPair {
    pub pair: String,
    pub cause: Cause,
    /// Causes that explain it as well and are less common.
    #[serde(skip)]
    pub or: &'static [Cause],
    /// The same for a person, with figures.
    pub reason: String,
}

impl DiscardedPair {
    pub fn new(pair: &str, cause: Cause, reason: String) -> DiscardedPair {
        DiscardedPair { pair: pair.to_owned(), cause, or: &[], reason }
    }

    /// Its cause, or the causes that are not told apart, with `|` between them.
    pub fn causes(&self) -> String {
        Cause::words(std::iter::once(self.cause).chain(self.or.iter().copied()))
    }

    /// Without the cause.
    pub fn skipped(&self) -> Skipped {
        Skipped { pair: self.pair.clone(), reason: self.reason.clone() }
    }
}

/// Corners of one picture of a pair that is used.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PictureCorners {
    pub pair: String,
    /// Corners that imaging relies on.
    pub seen: usize,
    /// How many of them lie too far from the rig's prediction for their own scatter.
    pub rejected: usize,
}

/// All that was seen and is not used.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Discarded {
    /// Pairs in all, used or not.
    pub pairs_in_all: usize,
    /// Pairs that are not used, by name.
    pub pairs: Vec<DiscardedPair>,
    /// The pictures of the pairs that are used.
    pub pictures: Vec<PictureCorners>,
}

impl Discarded {
    /// What is not used beside the views that are.
    pub fn new(used: &[View], pairs: Vec<DiscardedPair>) -> Discarded {
        let pictures = used.iter().flat_map(|view| {
            Side::BOTH.map(|side| {
                let seen = view.observations.iter().filter(|o| o.side == side).count();
                PictureCorners { pair: view.pair.clone(), seen, rejected: seen - view.active(side).count() }
            })
        });
        Discarded { pairs_in_all: used.len() + pairs.len(), pictures: pictures.collect(), pairs }
    }
}

/// Which pairs the rig is that of. A rig that changed while it was photographed is two rigs; the one that stands now is
/// the last.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Standing {
    /// The first pair of the rig that stands now, where there was another before it.
    pub since: Option<String>,
    /// Pairs of rigs that stood before.
    pub pairs_before: usize,
    /// The last pairs, where they contradict the rig: it may no longer stand.
    pub unconfirmed: Vec<String>,
}

/// Too few pairs, with what happened to the others.
pub fn too_few_pairs(found: usize, needed: usize, discarded: &[DiscardedPair]) -> Error {
    let skipped: Vec<Skipped> = discarded.iter().map(DiscardedPair::skipped).collect();
    Error::TooFewPairs { found, needed, total: found + skipped.len(), skipped }
}
