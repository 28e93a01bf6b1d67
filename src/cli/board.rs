//! `board`: a board to print.

use clap::Args;

use super::output::Output;
use crate::formats::boards::files::named;
use crate::imaging::Board;

/// `stereocal board`
#[derive(Debug, Args)]
pub struct PrintBoard {
    /// The board as `--board` names it: checker:20x20:10, charuco:11x8:15:11:DICT_5X5_100 (columns, rows, square and
    /// marker in mm, dictionary), or apriltag:6x6:tag36h11:35.2:10.56 (columns and rows of tags, family, tag and gap in mm)
    #[arg(value_name = "NAME", value_parser = named)]
    pub board: Board,
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
    #[arg(long, default_value_t = 300.0, requires = "png", value_name = "DPI")]
    pub dpi: f64,
    /// Results.
    #[command(flatten)]
    pub output: Output,
}
