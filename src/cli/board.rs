//! Boards: the target on the robot, and one to print.

use clap::Args;

use super::output::Output;
use super::values::{number, within};
use crate::formats::boards::files::named;
use crate::imaging::board::SQUARES_MM;
use crate::imaging::{Board, Squares};

/// The target on the robot.
#[derive(Debug, Args)]
pub struct Target {
    /// The target by its name: checker:20x20:10, charuco:11x8:15:11:DICT_5X5_100 (columns, rows, square and marker in
    /// mm, dictionary), apriltag:6x6:tag36h11:35.2:10.56 (columns and rows of tags, family, tag and gap in mm), or
    /// aruco:6x4:DICT_6X6_250:30:7.5 (a grid of ArUco markers alike)
    #[arg(long, value_name = "BOARD", value_parser = named, conflicts_with_all = ["squares", "square_mm"])]
    pub board: Option<Board>,
    /// Squares of the target, not inner corners; key `target_board.squares` [default: 7x6]
    #[arg(long, value_name = "CxR")]
    pub squares: Option<Squares>,
    /// Side of a square, mm; key `target_board.square_mm` [default: 10]
    #[arg(long, alias = "square", value_name = "MM", allow_negative_numbers = true, value_parser = within(&SQUARES_MM))]
    pub square_mm: Option<f64>,
}

/// `stereocal board`
#[derive(Debug, Args)]
pub struct PrintBoard {
    /// The board as `--board` names it: checker:20x20:10, charuco:11x8:15:11:DICT_5X5_100 (columns, rows, square and
    /// marker in mm, dictionary), apriltag:6x6:tag36h11:35.2:10.56 (columns and rows of tags, family, tag and gap in
    /// mm), or aruco:6x4:DICT_6X6_250:30:7.5 (a grid of ArUco markers alike)
    #[arg(value_name = "NAME", value_parser = named, required_unless_present = "squares", conflicts_with_all = ["squares", "square_mm"])]
    pub board: Option<Board>,
    /// A plain board of so many squares, as `camera-check` takes it
    #[arg(long, value_name = "CxR", requires = "square_mm")]
    pub squares: Option<Squares>,
    /// Side of its squares, mm
    #[arg(long, value_name = "MM", requires = "squares", allow_negative_numbers = true, value_parser = within(&SQUARES_MM))]
    pub square_mm: Option<f64>,
    /// Only what is named of PDF, SVG and PNG [default: PDF and SVG]
    #[arg(long)]
    pub pdf: bool,
    /// See --pdf
    #[arg(long)]
    pub svg: bool,
    /// A PNG, of --dpi dots per inch and without letters
    #[arg(long)]
    pub png: bool,
    /// Dots per inch of the PNG
    #[arg(long, default_value_t = 300.0, requires = "png", value_name = "DPI", value_parser = number)]
    pub dpi: f64,
    #[command(flatten)]
    pub output: Output,
}
