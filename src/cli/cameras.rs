//! Commands from pictures to points: `camera-check`, `measure`, `rectify`, `export`.

use camino::{Utf8Path, Utf8PathBuf};
use clap::{Args, Subcommand, ValueEnum};

use super::board::Target;
use super::output::{Files, Output};
use super::placement::ExportPlacement;
use super::robot::ExportRobot;
use super::values::{AskedSquares, between, within};
use crate::formats::boards::files::named;
use crate::formats::lenses::LensFile;
use crate::imaging::board::SQUARES_MM;
use crate::imaging::board::printed::PrintedExtent;
use crate::imaging::input::pairs::{Halves, PairBy, Source};
use crate::imaging::{Board, Mosaic, Squares};
use crate::ranges::TOLERANCES_MM;
use crate::stereo::Lens;
use crate::stereo::judge::moves::StatedMove;
use crate::stereo::volume::Extent;

/// How a folder of pictures is read, and the second one where each camera has its own.
#[derive(Debug, Args)]
pub struct Pairs {
    /// Folder of the right camera's pictures, where the first one holds the left camera's alone
    #[arg(value_name = "RIGHT")]
    pub right: Option<Utf8PathBuf>,
    /// How pictures are paired [default: names, else the numbers in them, else times]
    #[arg(long, value_name = "HOW", conflicts_with_all = ["side_by_side", "top_bottom"])]
    pub pair_by: Option<PairBy>,
    /// Each picture holds both views: its left half is the left camera's
    #[arg(long, conflicts_with_all = ["right", "bayer"])]
    pub side_by_side: bool,
    /// Each picture holds both views: its upper half is the left camera's
    #[arg(long, conflicts_with_all = ["right", "bayer", "side_by_side"])]
    pub top_bottom: bool,
}

impl Pairs {
    /// Where the pictures are; any number of pairs is of use.
    pub fn source<'a>(&'a self, command: &'a str, images: &'a Utf8Path) -> Source<'a> {
        let halves = match (self.side_by_side, self.top_bottom) {
            (true, _) => Some(Halves::SideBySide),
            (_, true) => Some(Halves::TopBottom),
            _ => None,
        };
        Source { right: self.right.as_deref(), by: self.pair_by, halves, ..Source::folder(command, images) }
    }
}

/// `stereocal camera-check`
#[derive(Debug, Args)]
pub struct CameraCheck {
    /// Folder with a folder of pictures for each camera, or with names that say left or right; or the left camera's,
    /// before RIGHT
    #[arg(required_unless_present = "corners", conflicts_with = "corners")]
    pub images: Option<Utf8PathBuf>,
    #[command(flatten)]
    pub pairs: Pairs,
    /// Corners from a CSV file instead of pictures
    #[arg(long, value_name = "FILE")]
    pub corners: Option<Utf8PathBuf>,
    /// The check board by its name: checker:20x20:10, charuco:11x8:15:11:DICT_5X5_100 (columns, rows, square and marker
    /// in mm, dictionary), apriltag:6x6:tag36h11:35.2:10.56 (columns and rows of tags, family, tag and gap in mm), or
    /// aruco:6x4:DICT_6X6_250:30:7.5 (a grid of ArUco markers alike); or a file: Kalibr's target.yaml, a project of
    /// calib.io's Calibrator (.json), calib.io_charuco_200x150_8x11_15_11_DICT_5X5.pdf (by its name)
    #[arg(long, value_name = "BOARD", value_parser = named, conflicts_with_all = ["squares", "square_mm"])]
    pub board: Option<Board>,
    /// Squares of the check board, not inner corners, or `auto`: counted where pictures show all of a checkerboard; key
    /// `check_board.squares` [default: 20x20]
    #[arg(long, value_name = "CxR")]
    pub squares: Option<AskedSquares>,
    /// Side of a square, mm; key `check_board.square_mm` [default: 10]
    #[arg(long, alias = "square", value_name = "MM", allow_negative_numbers = true, value_parser = within(&SQUARES_MM))]
    pub square_mm: Option<f64>,
    /// The print by a caliper, mm: its width along the columns and its height, from the outer edge of the first square
    /// to that of the last (149.7x99.8). Both are scales of their own; the caliper's uncertainty counts in the verdict,
    /// where --board-uncertainty-mm says no other
    #[arg(long, value_name = "WxH")]
    pub measured_mm: Option<PrintedExtent>,
    /// A slide of the board by a known length (a gauge block, a micrometer), mm, photographed before and after: checks
    /// the scale by something that is not the board. With its uncertainty (k = 2; 0.002 where none is said) and the
    /// names of both pairs, where not just two pairs in a row show such a move: 5mm+-0.003:03,04. May be given again
    #[arg(long, value_name = "MM[+-U][:FIRST,SECOND]", allow_negative_numbers = true)]
    pub known_move: Vec<StatedMove>,
    /// Largest length error that passes, mm; key `tolerance_mm` [default: 0.05; with --against that of the calibration]
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = within(&TOLERANCES_MM))]
    pub tolerance_mm: Option<f64>,
    /// Expanded uncertainty (k = 2) of the board's lengths, from its certificate, mm: widens the guard band of the
    /// verdict
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = within(&TOLERANCES_MM))]
    pub board_uncertainty_mm: Option<f64>,
    /// Lens model: radial2, brown4, brown5, rational8, thin-prism12 or tilted14 [default: chosen by held-out pairs]
    #[arg(long, value_name = "NAME", value_parser = lens)]
    pub lens: Option<Lens>,
    /// Lenses that are known: a calibration of this program, OpenCV, ROS, Kalibr or mrcal, and `,left` or `,right`
    /// behind it where it is for one camera; only the rig is looked for, and three pairs are enough for that (ten make
    /// the held-out figures reliable)
    #[arg(long, value_name = "FILE[,SIDE]")]
    pub intrinsics: Vec<LensFile>,
    /// Whether this calibration still holds, by two or more new pairs: what changed, by how much a length, and what the
    /// pairs would have shown
    #[arg(long, value_name = "CALIBRATION", conflicts_with_all = ["lens", "intrinsics", "since", "volume", "board_shape", "board_uncertainty_mm", "measured_mm", "known_move", "check_images", "draw"])]
    pub against: Option<Utf8PathBuf>,
    /// Only the pairs from this one on, by name: the rig as it is since then
    #[arg(long, value_name = "PAIR")]
    pub since: Option<String>,
    /// The volume that the verdict is for: `all` of what both cameras see, or a box X0,Y0,Z0,X1,Y1,Z1 in mm in the left
    /// camera's frame [default: where the boards were]
    #[arg(long, value_name = "VOLUME", allow_hyphen_values = true)]
    pub volume: Option<Extent>,
    /// Whether the board may be bowed [default: as held-out pairs say; flat where --lens is given]
    #[arg(long, value_name = "SHAPE")]
    pub board_shape: Option<BoardShape>,
    /// The board's temperature, deg C; with --expansion-ppm-per-k its squares grow from their size at 20 deg C
    #[arg(long, value_name = "C", requires = "expansion_ppm_per_k", allow_negative_numbers = true, value_parser = between(-273.15, 1000.0))]
    pub board_temperature_c: Option<f64>,
    /// The board's coefficient of thermal expansion, 1e-6/K (alumina 7, glass 8, aluminium 23)
    #[arg(long, value_name = "PPM", allow_negative_numbers = true, requires = "board_temperature_c", value_parser = between(-100.0, 1000.0))]
    pub expansion_ppm_per_k: Option<f64>,
    /// Pictures of a second board, which takes no part in the calibration: checks the scale
    #[arg(long, value_name = "DIR")]
    pub check_images: Option<Utf8PathBuf>,
    /// The second board by its name, as for --board [default: as the first]
    #[arg(long, value_name = "BOARD", value_parser = named, requires = "check_images", conflicts_with_all = ["check_squares", "check_square_mm"])]
    pub check_board: Option<Board>,
    /// Squares of the second board [default: as the first]
    #[arg(long, value_name = "CxR", requires = "check_images")]
    pub check_squares: Option<Squares>,
    /// Side of the second board's squares, mm [default: as the first]
    #[arg(long, value_name = "MM", allow_negative_numbers = true, requires = "check_images", value_parser = within(&SQUARES_MM))]
    pub check_square_mm: Option<f64>,
    /// Width and height of the pictures that --corners come from, px, where the file does not hold them
    #[arg(long, value_name = "WxH", requires = "corners", value_parser = picture_size)]
    pub picture_size: Option<(u32, u32)>,
    /// Filters of pictures that are raw colour mosaics: RGGB, BGGR, GRBG or GBRG
    #[arg(long, value_name = "PATTERN")]
    pub bayer: Option<Mosaic>,
    /// Draw the corners found over each pair, into overlays/ in the results folder
    #[arg(long)]
    pub draw: bool,
    #[command(flatten)]
    pub output: Output,
}

/// What is assumed about the check board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BoardShape {
    /// A plane
    Flat,
    /// Paraboloids along both axes, found with the rig
    Bowed,
}

/// `stereocal measure`
#[derive(Debug, Args)]
pub struct Measure {
    /// Folder with the pictures, as for camera-check, and poses.csv; or the left camera's, before RIGHT: poses.csv is
    /// then beside the two folders, or in one of them
    pub poses: Utf8PathBuf,
    #[command(flatten)]
    pub pairs: Pairs,
    /// The rig, or the folder it was exported to [default: calibration.json in the results folder]
    #[arg(long, value_name = "FILE")]
    pub calibration: Option<Utf8PathBuf>,
    #[command(flatten)]
    pub target: Target,
    /// Filters of pictures that are raw colour mosaics: RGGB, BGGR, GRBG or GBRG
    #[arg(long, value_name = "PATTERN")]
    pub bayer: Option<Mosaic>,
    /// Measure pictures as they arrive; ends when all of poses.csv are there, or on Ctrl-C
    #[arg(long, conflicts_with_all = ["side_by_side", "top_bottom"])]
    pub watch: bool,
    /// Draw the corners found over each pair, into overlays/ in the results folder
    #[arg(long)]
    pub draw: bool,
    #[command(flatten)]
    pub output: Output,
}

/// `stereocal rectify`
#[derive(Debug, Args)]
pub struct Rectify {
    /// Folder with a folder of pictures for each camera, or with names that say left or right; or the left camera's,
    /// before RIGHT
    pub images: Utf8PathBuf,
    #[command(flatten)]
    pub pairs: Pairs,
    /// The rig, or the folder it was exported to [default: calibration.json in the results folder]
    #[arg(long, value_name = "FILE")]
    pub calibration: Option<Utf8PathBuf>,
    /// Straighten each picture by itself, in its own camera matrix; do not turn the cameras
    #[arg(long, conflicts_with_all = ["alpha", "zero_disparity"])]
    pub undistort_only: bool,
    /// How much is kept: 0 only what both lenses saw, 1 every raw pixel [default: OpenCV's own choice between]
    #[arg(long, value_name = "A", allow_negative_numbers = true, value_parser = between(0.0, 1.0))]
    pub alpha: Option<f64>,
    /// Give both pictures one principal point: points at infinity then have no disparity, but cameras that are turned
    /// towards each other lose what is near from view
    #[arg(long)]
    pub zero_disparity: bool,
    /// The board by which the rows are compared, by its name: checker:20x20:10, charuco:11x8:15:11:DICT_5X5_100
    /// (columns, rows, square and marker in mm, dictionary), apriltag:6x6:tag36h11:35.2:10.56 (columns and rows of
    /// tags, family, tag and gap in mm), or aruco:6x4:DICT_6X6_250:30:7.5 (a grid of ArUco markers alike) [default: the
    /// board that calibrated, else those of the keys `check_board` and
    /// `target_board`]
    #[arg(long, value_name = "BOARD", value_parser = named, conflicts_with_all = ["squares"])]
    pub board: Option<Board>,
    /// Squares of the board by which the rows are compared
    #[arg(long, value_name = "CxR")]
    pub squares: Option<Squares>,
    /// Filters of pictures that are raw colour mosaics: RGGB, BGGR, GRBG or GBRG
    #[arg(long, value_name = "PATTERN")]
    pub bayer: Option<Mosaic>,
    #[command(flatten)]
    pub output: Output,
}

/// What `stereocal export` can write.
#[derive(Debug, Subcommand)]
pub enum ExportWhat {
    /// The stereo calibration
    Calibration(ExportCalibration),
    /// The robot
    Robot(ExportRobot),
    /// Where the cameras stand, and the target on the flange
    #[command(after_help = "Example: stereocal export placement --format ros-static-tf --camera-frame left_optical")]
    Placement(ExportPlacement),
}

/// `stereocal export calibration`
#[derive(Debug, Args)]
pub struct ExportCalibration {
    /// For which program
    #[arg(long)]
    pub format: CalibrationFormat,
    /// The rig, or the folder it was exported to [default: calibration.json in the results folder]
    #[arg(long, value_name = "FILE")]
    pub calibration: Option<Utf8PathBuf>,
    #[command(flatten)]
    pub files: Files,
}

/// Programs that a calibration can be written for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum CalibrationFormat {
    /// OpenCV's FileStorage (YAML)
    Opencv,
    /// ROS camera_info, one file a camera
    Ros,
    /// Kalibr's camchain
    Kalibr,
    /// mrcal's cameramodel, one file a camera
    Mrcal,
}

fn lens(name: &str) -> Result<Lens, String> {
    Lens::from_name(name).ok_or_else(|| {
        let names = Lens::LADDER.map(Lens::name).join(", ");
        format!("no lens of this name; there are {names}")
    })
}

fn picture_size(text: &str) -> Result<(u32, u32), String> {
    let parse = |side: &str| side.trim().parse::<u32>().ok().filter(|n| (1..=100_000).contains(n));
    text.split_once(['x', 'X'])
        .and_then(|(w, h)| Some((parse(w)?, parse(h)?)))
        .ok_or_else(|| "a picture's size is WIDTHxHEIGHT in px, each from 1 to 100000, as in 2448x2048".to_owned())
}
