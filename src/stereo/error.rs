//! What can go wrong between corners and points.

use crate::diagnostic::{Explain, Status};
use crate::imaging::corners::{named, reasons, too_few};
use crate::imaging::{Side, Skipped};
use crate::stereo::Lens;

/// How the reason begins where both sides of a pair hold one picture.
pub const ONE_PICTURE: &str = "left and right picture are one picture";

/// How the reason ends of pairs that `--since` leaves out.
pub const BY_SINCE: &str = "which --since names";

/// What was done to all pictures of one side; which side it was only the place of the cameras tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OneSide {
    /// Left and right, or top and bottom, are exchanged.
    Mirrored,
    /// Black and white are exchanged, by which corners are numbered from another end of the board.
    Inverted,
}

impl OneSide {
    fn words(self) -> &'static str {
        match self {
            OneSide::Mirrored => "mirrored",
            OneSide::Inverted => {
                "inverted, black and white exchanged, so that the board's corners are counted from another end than on the other"
            }
        }
    }
}

/// From where on the pictures of one side are shifted against the other's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ShiftedFrom {
    /// The first pair whose pictures do not belong together, or belong together again.
    pub pair: String,
    /// By how many pictures.
    pub by: usize,
    /// The first left picture from there on that has a partner, and its partner.
    pub partners: [String; 2],
    /// The camera that lost pictures there, and how many.
    pub lost: (Side, usize),
    /// The other side's pictures between the last pair before and the first one after: so many of them have no partner.
    pub alone: Vec<String>,
}

impl ShiftedFrom {
    fn words(&self) -> String {
        let Self { pair, by, partners: [left, right], lost: (side, count), alone } = self;
        let shift = match by {
            0 => "the pictures of equal names belong together again".to_owned(),
            1 => format!("by 1 picture: left picture {left} and right picture {right} are one pair"),
            _ => format!("by {by} pictures: left picture {left} and right picture {right} are one pair"),
        };
        let (other, side) = (side.other().name(), side.name());
        let alone_are = named(alone);
        let without = match (count, alone.len()) {
            (1, 1) => format!("{other} picture {alone_are} has no partner, the {side} one seems lost"),
            (n, of) if *n == of => format!("{other} pictures {alone_are} have no partner, the {side} ones seem lost"),
            (1, _) => format!("one of the {other} pictures {alone_are} has no partner, the {side} one seems lost"),
            (n, _) => {
                format!("{n} of the {other} pictures {alone_are} have no partner, the {side} ones seem lost")
            }
        };
        format!("\n  from pair {pair} on, {shift}; {without}")
    }
}

/// What can go wrong between corners and points.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Not enough pairs to calibrate and to hold one out.
    #[error("{} pairs can be used; calibration needs {needed}{}", too_few(*.found, *.total), reasons(.skipped))]
    TooFewPairs {
        /// Usable pairs.
        found: usize,
        /// Fewest pairs for a calibration.
        needed: usize,
        total: usize,
        /// The others.
        skipped: Vec<Skipped>,
    },
    /// No board was seen by both cameras at once.
    #[error(
        "the cameras have nothing in common: none of {pairs} pairs shows the same corner of the board in both pictures"
    )]
    NothingInCommon {
        /// Pairs with a board in one picture at least.
        pairs: usize,
    },
    /// One of the cameras shows the board in hardly any pair; the other one does.
    #[error("{} {} pictures show the board, which the {} ones show{}", too_few(*.found, *.total), side.name(), side.other().name(), reasons(.without))]
    OneSideBlind {
        side: Side,
        /// Pairs that this side shows the board in, of how many.
        found: usize,
        total: usize,
        /// The others, and why.
        without: Vec<Skipped>,
    },
    /// Pairs that are compared with a rig fit it with their pictures exchanged, or turned or mirrored back.
    #[error("{how}: each pair fits the calibration the other way round")]
    OtherWayRound {
        how: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// The box that a verdict is asked for lies where the cameras do not both look.
    #[error("no place of the box of `--volume` is seen by both cameras")]
    OutOfView {
        /// The box in the left camera's frame that the boards' part of its picture and their depths span, mm: lowest
        /// and highest corner.
        boards_mm: [[f64; 3]; 2],
    },
    /// The distance of the cameras is not told from none: nothing can be measured by them.
    #[error(
        "the cameras cannot be told from one camera: their distance is {baseline_mm:.2} mm with a standard deviation of {sigma_mm:.2} mm; \
         nothing is measured by rays that hardly cross"
    )]
    NoBaseline { baseline_mm: f64, sigma_mm: f64 },
    #[error("{corners} corners give {} numbers for {unknowns} unknowns", 2 * .corners)]
    TooFewCorners {
        /// Corners that are no outliers.
        corners: usize,
        unknowns: usize,
    },
    #[error("the corners in the {} pictures fit no camera", side.name())]
    NoCamera { side: Side },
    /// Most pairs do not belong to one rig.
    #[error(
        "the pairs contradict each other: {} fit one rig; half of all miss it by {usual_px:.1} px and more, \
         each camera alone by {alone_px:.2} px{}",
        too_few(*.agreeing, *.total),
        reasons(.bad)
    )]
    Contradiction {
        /// Pairs that fit one rig.
        agreeing: usize,
        /// Pairs that were compared.
        total: usize,
        /// Median over the pairs of what they miss the rig by, px.
        usual_px: f64,
        /// Median over the pictures of what each camera alone leaves, px.
        alone_px: f64,
        /// The others.
        bad: Vec<Skipped>,
    },
    /// The pictures of one side belong to those of the other side that come some pairs before or after.
    #[error(
        "the pictures of one side are shifted against the other's: with left picture {left} and right picture {right} as one pair, and so \
         on, {fit} of {of} pairs fit one rig, and as they are named they do not{}",
        from.iter().map(ShiftedFrom::words).collect::<String>()
    )]
    Shifted {
        /// Pairs that fit one rig then.
        fit: usize,
        /// Pairs there are then.
        of: usize,
        /// The first left picture that has a partner of another name.
        left: String,
        /// Its partner.
        right: String,
        /// Where pictures were lost; none where the shift is the same over all pairs.
        from: Vec<ShiftedFrom>,
    },
    /// All pictures of one side were changed on their way from the camera.
    #[error(
        "the pictures of one side are {}: with that undone in the {} ones {fit} of {of} pairs fit one rig{}, and as they are they do not",
        what.words(),
        side.unwrap_or(Side::Right).name(),
        if side.is_some() { " with its left camera to the left" } else { "" }
    )]
    ChangedSide {
        what: OneSide,
        /// With that undone in the pictures of this side the left camera stands to the left; `None` where neither does.
        side: Option<Side>,
        /// Pairs that fit one rig then.
        fit: usize,
        /// Pairs there are.
        of: usize,
    },
    /// A pair that was asked for and is not there.
    #[error("there is no pair {pair} with a board in both pictures; there are {}", named(.pairs))]
    NoSuchPair { pair: String, pairs: Vec<String> },
    /// A known move whose pairs were not named, and that no or several pairs could be.
    #[error(
        "between which pairs the board moved by {length_mm} mm is not settled: {}{}",
        match .fits { 0 => "no two pairs in a row show such a move without a turn; the nearest are".to_owned(), n => format!("{n} do") },
        moved(.candidates)
    )]
    MoveUnsettled {
        /// As stated, mm.
        length_mm: f64,
        /// Moves that fit.
        fits: usize,
        /// Those, or the nearest: the pairs as `--known-move` takes them, and how the board moved.
        candidates: Vec<(String, String)>,
    },
    #[error("the move between pairs {} and {} is stated twice", pairs[0], pairs[1])]
    MoveTwice { pairs: [String; 2] },
    /// The views do not tell the cameras.
    #[error(
        "the views are too similar to tell the cameras{}{}{}",
        shown(.one_pose),
        focal(.focal_sigma),
        reasons(.skipped)
    )]
    Undetermined {
        /// How many pairs there are and by how much a corner moves from one to another at most, px, where all show the
        /// board in one pose.
        one_pose: Option<(usize, f64)>,
        /// Worst relative standard deviation of a focal length, where there is one.
        focal_sigma: Option<f64>,
        /// Pairs that were left out before: what they show may be missing now.
        skipped: Vec<Skipped>,
    },
    /// A lens that was asked for has numbers that the views do not tell apart.
    #[error(
        "the pairs do not determine a {lens} lens: several of its numbers can be exchanged for each other without moving any corner"
    )]
    LensUndetermined { lens: &'static str },
    #[error("the calibration did not converge within {steps} steps")]
    NotConverged { steps: usize },
    #[error("the target was measured at none of {poses} poses")]
    NothingMeasured { poses: usize },
    /// A calibration without a covariance, which says nothing of how far its rig is known.
    #[error("the calibration has no covariance of its rig: a change is not told from what was not known before")]
    NoCovariance,
    /// The rig is not the one that was calibrated, or the target not the one described.
    #[error("{statement}")]
    RigChanged {
        /// What changed, and by how much.
        statement: String,
        hint: &'static str,
    },
    /// A lens that another program has no words for.
    #[error("{format}'s format has no {lens} lens; its richest is {most}")]
    LensNotExportable {
        format: &'static str,
        lens: &'static str,
        /// The richest lens of the format.
        most: &'static str,
    },
    /// Cameras whose pictures cannot be brought onto common rows.
    #[error("the cameras' pictures have no common rows: {reason}")]
    NoCommonRows { reason: String },
    #[error(transparent)]
    OpenCv(#[from] crate::opencv::Failure),
    /// Pictures of another size than the calibration's.
    #[error("the {} pictures are {found_width}x{found_height} px, the calibration is for {width}x{height}", side.name())]
    PictureSize { side: Side, found_width: u32, found_height: u32, width: u32, height: u32 },
}

fn moved(list: &[(String, String)]) -> String {
    list.iter().map(|(pairs, moved)| format!("\n  {pairs}: {moved}")).collect()
}

fn shown(one_pose: &Option<(usize, f64)>) -> String {
    one_pose.map_or(String::new(), |(pairs, px)| {
        format!(": all {pairs} pairs show the board in one pose, no corner moves by more than {px:.1} px from one to another")
    })
}

fn focal(sigma: &Option<f64>) -> String {
    sigma.map_or(String::new(), |s| format!(": a focal length is known to {:.0} % only", 100.0 * s))
}

impl Error {
    /// The views do not tell the cameras, and no focal length can be named.
    pub fn undetermined() -> Error {
        Error::Undetermined { one_pose: None, focal_sigma: None, skipped: Vec::new() }
    }

    /// The same error, naming the pairs that were left out before where too little was left after.
    pub fn without(self, left_out: &[Skipped]) -> Error {
        match self {
            Error::Undetermined { one_pose, focal_sigma, .. } => {
                Error::Undetermined { one_pose, focal_sigma, skipped: left_out.to_vec() }
            }
            other => other,
        }
    }

    /// The same error, saying that all pairs show one pose where they do.
    pub fn of_one_pose(self, shown: Option<(usize, f64)>) -> Error {
        match self {
            Error::Undetermined { focal_sigma, skipped, .. } => {
                Error::Undetermined { one_pose: shown, focal_sigma: focal_sigma.filter(|_| shown.is_none()), skipped }
            }
            other => other,
        }
    }

    /// The same error, of a rich lens that was asked for: it is the lens then, not the views.
    pub fn of_lens(self, asked: Option<Lens>) -> Error {
        match (self, asked) {
            (
                Error::Undetermined { one_pose: None, focal_sigma: None, .. } | Error::NotConverged { .. },
                Some(lens),
            ) if lens > Lens::Brown5 => Error::LensUndetermined { lens: lens.name() },
            (other, _) => other,
        }
    }
}

impl Explain for Error {
    fn status(&self) -> Status {
        match self {
            Error::TooFewPairs { .. }
            | Error::OneSideBlind { .. }
            | Error::OutOfView { .. }
            | Error::OtherWayRound { .. }
            | Error::NoSuchPair { .. }
            | Error::MoveUnsettled { .. }
            | Error::MoveTwice { .. }
            | Error::PictureSize { .. }
            | Error::NoCovariance
            | Error::LensNotExportable { .. } => Status::BadInput,
            _ => Status::Undetermined,
        }
    }

    fn hint(&self) -> Option<String> {
        Some(
            match self {
                Error::TooFewPairs { skipped, .. } => of_too_few(skipped),
                Error::NothingInCommon { .. } => {
                    "photograph the board where both cameras see it at once, and check that equal names belong together"
                }
                Error::OneSideBlind { .. } => "both cameras must show one board at once, in pictures as they took them",
                Error::OtherWayRound { remedy, .. } => remedy,
                Error::OutOfView { boards_mm: [[x0, y0, z0], [x1, y1, z1]] } => {
                    return Some(format!(
                        "`--volume X0,Y0,Z0,X1,Y1,Z1` is in mm in the left camera's frame, z along its line of sight; the boards were within \
                         {x0:.0},{y0:.0},{z0:.0},{x1:.0},{y1:.0},{z1:.0}"
                    ));
                }
                Error::NoBaseline { .. } => {
                    "are these pictures all of one camera? Each side needs its own; of two cameras that stand apart add pairs nearer to them and tilted"
                }
                Error::TooFewCorners { .. } => "photograph more pairs, or `--lens radial2` for fewer unknowns",
                Error::NoCamera { .. } => "`--squares CxR` must be the board's squares, not its inner corners",
                Error::Contradiction { .. } => {
                    "trigger both cameras at once, clamp them and the board, and check that equal names belong together"
                }
                Error::Shifted { .. } => "give pictures of one moment the same name, and leave those without a partner out",
                Error::ChangedSide { .. } => "use the pictures of both cameras as these wrote them: something changes those of one",
                Error::NoSuchPair { .. } => "`--since` and `--known-move` take the names of pairs as the report lists them",
                Error::MoveUnsettled { length_mm, candidates, fits } => {
                    let pairs = candidates.first().filter(|_| *fits > 0).map_or("BEFORE,AFTER", |(pairs, _)| pairs);
                    return Some(format!("name the pairs before and after it: `--known-move {length_mm}mm:{pairs}`"));
                }
                Error::MoveTwice { .. } => "give each move once",
                Error::Undetermined { .. } => {
                    "photograph the board tilted by 20 to 45 degrees about both of its axes, at several distances"
                }
                Error::LensUndetermined { .. } => {
                    "without `--lens` the simplest lens that the corners support is taken; a richer one needs corners out to the pictures' corners"
                }
                Error::NotConverged { .. } => "`--lens radial2` has fewer unknowns; add pairs with the board tilted",
                Error::RigChanged { hint, .. } => hint,
                Error::NoCovariance => "`stereocal camera-check IMAGES` writes a calibration.json with it",
                Error::NothingMeasured { .. } => "`--squares CxR` and `--square-mm MM` are of the target on the robot",
                Error::LensNotExportable { most, .. } => {
                    return Some(format!("calibrate with `--lens {most}`, or `--format opencv`"));
                }
                Error::NoCommonRows { .. } => "`--undistort-only` straightens each picture by itself",
                Error::OpenCv(_) => return None,
                Error::PictureSize { .. } => {
                    "calibrate with pictures of the same size and cut: `stereocal camera-check IMAGES`"
                }
            }
            .to_owned(),
        )
    }
}

/// What to do where too few pairs can be used, by why the others cannot.
fn of_too_few(skipped: &[Skipped]) -> &'static str {
    if skipped.iter().any(|skipped| skipped.reason.starts_with(ONE_PICTURE)) {
        return "name the folders of both cameras, each with its own pictures: `stereocal camera-check LEFT RIGHT`";
    }
    if skipped.iter().any(|skipped| skipped.reason.ends_with(BY_SINCE)) {
        return "`--since` an earlier pair, or photograph more pairs of the rig as it is since then";
    }
    "photograph more pairs; `--squares CxR` must be the board's squares, not its inner corners"
}
