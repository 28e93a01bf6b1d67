//! One line of `corners.csv`.
//!
//! In: the fields of a line and where its columns stand. Out: the corner with its pair, side and picture's size. Goes
//! wrong: words where numbers should stand, a place and a number that are not of one corner; the error names the line.

use nalgebra::{Matrix2, Point2};

use crate::csv_table::Table;
use crate::files::{self, Result};
use crate::imaging::{Board, Corner, Side};
use crate::tables::Fields;

/// A corner as a line has it.
pub(super) struct Row {
    pub line: u64,
    pub pair: String,
    pub side: Side,
    pub corner: Corner,
    /// Width and height of the picture, px, where the file holds them.
    pub size: Option<(u32, u32)>,
}

/// Where the columns stand.
pub(super) struct Columns {
    pair: usize,
    side: usize,
    /// Of the corner's place on the board.
    place: Option<(usize, usize)>,
    /// Of its number, on a board whose markers give it one.
    id: Option<usize>,
    px: (usize, usize),
    covariance: [Option<usize>; 3],
    used: Option<usize>,
    blur: Option<usize>,
    size: [Option<usize>; 2],
}

impl Columns {
    pub fn of(table: &Table, board: Board) -> Result<Columns> {
        let id = table.column("id").filter(|_| board.is_coded());
        let place = match (id, table.column("col"), table.column("row")) {
            (Some(_), Some(col), Some(row)) => Some((col, row)),
            (Some(_), ..) => None,
            (None, ..) => Some((table.require("col")?, table.require("row")?)),
        };
        Ok(Columns {
            pair: table.require("pair")?,
            side: table.require("side")?,
            place,
            id,
            px: (table.require("x_px")?, table.require("y_px")?),
            covariance: ["sxx_px2", "sxy_px2", "syy_px2"].map(|name| table.column(name)),
            used: table.column("used"),
            blur: table.column("blur_px"),
            size: ["width_px", "height_px"].map(|name| table.column(name)),
        })
    }
}

/// One line of the file.
pub(super) struct Line<'a> {
    pub table: &'a Table<'a>,
    pub columns: &'a Columns,
    pub number: u64,
    pub fields: &'a Fields,
}

impl Line<'_> {
    pub fn refuse(&self, message: String) -> files::Error {
        self.table.refuse(self.number, message)
    }

    fn count(&self, column: usize) -> Result<usize> {
        let refuse =
            |_| self.refuse(format!("`{}` is not a count: `{}`", self.table.header[column], &self.fields[column]));
        self.fields[column].parse::<usize>().map_err(refuse)
    }

    fn number(&self, column: usize) -> Result<f64> {
        self.table.number(self.number, self.fields, column)
    }

    fn pair(&self) -> Result<String> {
        match &self.fields[self.columns.pair] {
            "" => Err(self.refuse("the pair has no name".to_owned())),
            name => Ok(name.to_owned()),
        }
    }

    fn side(&self) -> Result<Side> {
        match self.fields[self.columns.side].to_ascii_lowercase().as_str() {
            "left" => Ok(Side::Left),
            "right" => Ok(Side::Right),
            other => Err(self.refuse(format!("side is `{other}`; it is left or right"))),
        }
    }

    /// The corner's column and row on the board, by its place or its number.
    fn place(&self, board: Board) -> Result<Option<(usize, usize)>> {
        let by_place = self.columns.place.map(|(col, row)| Ok((self.count(col)?, self.count(row)?))).transpose()?;
        let by_id = self.columns.id.map(|id| Ok(board.by_id(self.count(id)?))).transpose()?;
        match (by_place, by_id) {
            (Some((col, row)), Some((c, r))) if (col, row) != (c, r) => {
                Err(self.refuse(format!("corner {col},{row} has the id of {c},{r} on a board of {}", board.said())))
            }
            _ => Ok(by_place.or(by_id)),
        }
    }

    fn covariance_px2(&self) -> Result<Option<Matrix2<f64>>> {
        let [Some(xx), Some(xy), Some(yy)] = self.columns.covariance else { return Ok(None) };
        if [xx, xy, yy].iter().all(|&c| self.fields[c].is_empty()) {
            return Ok(None);
        }
        let covariance = Matrix2::new(self.number(xx)?, self.number(xy)?, self.number(xy)?, self.number(yy)?);
        match covariance.cholesky() {
            Some(_) => Ok(Some(covariance)),
            None => Err(self.refuse("the covariance sxx, sxy, syy is not positive definite".to_owned())),
        }
    }

    fn used(&self) -> Result<bool> {
        match self.columns.used.map_or("", |c| &self.fields[c]).to_ascii_lowercase().as_str() {
            "" | "1" | "true" | "yes" => Ok(true),
            "0" | "false" | "no" => Ok(false),
            other => Err(self.refuse(format!("used is `{other}`; it is 1 or 0"))),
        }
    }

    fn size(&self) -> Result<Option<(u32, u32)>> {
        match self.columns.size {
            [Some(width), Some(height)] if !self.fields[width].is_empty() || !self.fields[height].is_empty() => {
                let side_px = |column| self.count(column).map(|n| n.clamp(1, 1 << 24) as u32);
                Ok(Some((side_px(width)?, side_px(height)?)))
            }
            _ => Ok(None),
        }
    }

    /// All of it; `None` where nothing says which corner it is.
    pub fn row(&self, board: Board) -> Result<Option<Row>> {
        let (pair, side) = (self.pair()?, self.side()?);
        let Some((col, row)) = self.place(board)? else { return Ok(None) };
        let (x, y) = self.columns.px;
        let blur = self.columns.blur.filter(|&c| !self.fields[c].is_empty());
        let corner = Corner {
            col,
            row,
            covariance_px2: self.covariance_px2()?,
            used: self.used()?,
            px: Point2::new(self.number(x)?, self.number(y)?),
            blur_px: blur.map(|column| self.number(column)).transpose()?,
            reach: None,
        };
        Ok(Some(Row { line: self.number, pair, side, corner, size: self.size()? }))
    }
}
