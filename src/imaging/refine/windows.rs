//! What the windows of a board's corners told: which of them nothing reaches into, and how the edges bend.

use nalgebra::{Matrix2, RowVector2, Vector2};

use super::Measured;
use super::acceptance;
use super::cell::Cell;
use super::curvature::{Bend, Point, Rule, SEEN, bends};
use super::saddle_fit::{Fit, Model};
use crate::imaging::lattice::{Lattice, Places};

/// How good measured places are at least, px: what is farther from its line is hidden in part.
const GOOD_PX: f64 = 0.004;

/// What a corner's windows told.
#[derive(Clone)]
pub(super) struct Windows {
    /// The squares round it.
    pub(super) cell: Cell,
    /// What the fits start from, with the edges' bends.
    pub(super) start: Model,
    /// How the board's corners show the edges to bend.
    pub(super) bends: [Option<Bend>; 2],
    /// Whether the full window is hardly larger than the near one.
    pub(super) alone: bool,
    /// Half of the full window at the most, px.
    pub(super) most_half_px: f64,
    /// The fit in the near window.
    pub(super) near: Option<Measured>,
    /// The fit in the full window.
    pub(super) full: Option<Measured>,
}

impl Windows {
    /// The full window, if nothing reaches into it.
    pub(super) fn free(&self, board: &acceptance::Board) -> Option<&Measured> {
        let full = self.full.as_ref()?;
        // Where no smaller window checks it, it must look as the others do.
        let checked = match &self.near {
            Some(near) => board.agrees(near, full),
            None => self.alone || board.holds_in_small_window(full),
        };
        (checked && board.accepts(full)).then_some(full)
    }

    /// The same with other bends of the edges, where these are known.
    pub(super) fn rebent(self, bends: [Option<Bend>; 2]) -> Windows {
        let bends = [0, 1].map(|k| bends[k].or(self.bends[k]));
        let bend = [0, 1].map(|k| bends[k].map_or(self.start.bend[k], |bend| bend.per_px));
        let start = Model { bend, ..self.start };
        Windows { start, bends, full: self.full.map(|full| full.rebent(bend, &self.cell)), ..self }
    }

    /// A corner with what the bends of its edges, as the board's lines show them, make of its covariance. Whole boards
    /// have lines so long that it is hardly anything.
    pub(super) fn with_lines(&self, corner: Measured) -> Measured {
        if !self.cell.has_markers() {
            return corner;
        }
        let Some(back) = corner.normals().try_inverse() else { return corner };
        let normals = corner.normals();
        let known = normals * corner.fit.covariance_px2 * normals.transpose();
        let across = |by: &dyn Fn(Bend, f64, f64) -> f64| {
            let [a, b] = [0, 1].map(|k| {
                let half_px = corner.reach[k] * self.cell.edges[k].norm();
                self.bends[k].map_or(1.0, |bend| by(bend, half_px * half_px / self.cell.straight(), known[(k, k)]))
            });
            back * Matrix2::new(a, 0.0, 0.0, b) * normals
        };
        let scale = across(&|bend, by_bend, known| (bend.variance_px2(by_bend, known) / known).max(0.0).sqrt());
        let covariance_px2 = scale * corner.fit.covariance_px2 * scale.transpose();
        // What the line's other corners do to the place has nothing to do with the light in this one's window.
        let place_by_light = across(&|bend, by_bend, _| bend.own_share(by_bend)) * corner.fit.place_by_light;
        Measured { fit: Fit { covariance_px2, place_by_light, ..corner.fit }, ..corner }
    }
}

impl Measured {
    /// What the fit would be with other bends.
    fn rebent(self, bend: [f64; 2], cell: &Cell) -> Measured {
        let Measured { px, fit, reach } = self;
        let bend = [0, 1].map(|k| if cell.own_bends[k] { fit.model.bend[k] } else { bend[k] });
        let off =
            |k: usize| (bend[k] - fit.model.bend[k]) * (reach[k] * cell.edges[k].norm()).powi(2) / cell.straight();
        let step = self.normals().try_inverse().map_or(Vector2::zeros(), |m| m * Vector2::new(off(0), off(1)));
        let model = Model { corner: fit.model.corner + step, bend, ..fit.model };
        Measured { px: px + step, fit: Fit { model, ..fit }, reach }
    }

    /// The normals of the edges, a row each.
    fn normals(&self) -> Matrix2<f64> {
        Matrix2::from_rows(&self.fit.model.angles_rad.map(|angle| RowVector2::new(-angle.sin(), angle.cos())))
    }
}

/// What is usual on a board.
pub(super) fn usual(seen: &Lattice<Windows>) -> acceptance::Board {
    let full: Vec<Measured> = seen.iter().filter_map(|(_, _, windows)| windows.full).collect();
    let both: Vec<_> = seen.iter().filter_map(|(_, _, windows)| windows.near.zip(windows.full)).collect();
    acceptance::Board::of(&full, &both)
}

/// Bends as these windows show them: corners without one, or with one that something reaches into, bend no line.
pub(super) fn bends_by(
    seen: &Lattice<Windows>,
    places: &Places,
    which: impl Fn(&Windows) -> Option<Measured>,
) -> Vec<[Option<Bend>; 2]> {
    let grid = Lattice::from_fn(seen.columns, seen.rows, |col, row| {
        let measured = seen.get(col, row).and_then(&which).map(|m| Point {
            px: m.px,
            counts: true,
            covariance_px2: m.fit.covariance_px2,
        });
        measured.or_else(|| Some(Point { px: *places.get(col, row)?, counts: false, covariance_px2: SEEN }))
    });
    let in_part = seen.iter().any(|(_, _, windows)| windows.cell.has_markers());
    bends(&grid, Rule { good_px: GOOD_PX, in_part })
}
