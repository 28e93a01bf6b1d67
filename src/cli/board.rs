//! `board`: a board to print.

use clap::Args;

use super::output::Output;
use crate::imaging::Board;

/// `stereocal board`
#[derive(Debug, Args)]
pub struct PrintBoard {
    /// The board as `--board` names it: checker:20x20:10, or charuco:11x8:15:11:DICT_5X5_100 (columns, rows, square and marker in mm, dictionary)
    #[arg(value_name = "NAME")]
    pub board: Board,
    /// The PDF only [default: PDF and SVG]
    #[arg(long)]
    pub pdf: bool,
    /// The SVG only
    #[arg(long, conflicts_with = "pdf")]
    pub svg: bool,
    /// Results.
    #[command(flatten)]
    pub output: Output,
}
