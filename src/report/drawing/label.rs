//! Where the label of a level line stands: above or below it, where it hides nothing.

use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Size of a label's letters, px.
pub(super) const LABEL_PX: u32 = 12;

/// Width of a letter as a share of its height, generously.
const LETTER: f64 = 0.62;

/// Around a label, px: marks have a size, too.
const AROUND_PX: f64 = 4.0;

/// Places that are tried along the line, from the left.
const STEPS: u32 = 12;

/// What axes, title and margins take of a figure along x and y, px.
const FRAME_PX: [f64; 2] = [94.0, 90.0];

/// The axes of a figure, and how large a px is in their units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Area {
    x: (f64, f64),
    px: [f64; 2],
    /// 1 where y grows upwards.
    up: f64,
}

impl Area {
    /// Of axes with these ranges in a figure of this size, px.
    pub(super) fn new(x: (f64, f64), y: (f64, f64), (width, height): (u32, u32)) -> Area {
        let px = [
            (x.1 - x.0).abs() / (f64::from(width) - FRAME_PX[0]).max(1.0),
            (y.1 - y.0).abs() / (f64::from(height) - FRAME_PX[1]).max(1.0),
        ];
        Area { x, px, up: (y.1 - y.0).signum() }
    }

    /// Where the label of the line at `y` hides nothing that is drawn, or the least: its x, and how it hangs there.
    /// Places at the left come first, the legend is at the right.
    pub(super) fn free_place(&self, label: &str, y: f64, drawn: &[(f64, f64)]) -> (f64, Pos) {
        let wide = (label.chars().count() as f64 * LETTER * f64::from(LABEL_PX) + AROUND_PX) * self.px[0];
        let high = (1.3 * f64::from(LABEL_PX) + AROUND_PX) * self.px[1];
        let (first, last) = (self.x.0 + AROUND_PX * self.px[0], self.x.1 - AROUND_PX * self.px[0]);
        let room = (last - wide - first).max(0.0);
        let starts = (0..=STEPS).map(|k| first + room * f64::from(k) / f64::from(STEPS));
        let places = starts.flat_map(|start| [(start, VPos::Bottom, self.up), (start, VPos::Top, -self.up)]);
        let hidden = |(from, _, above): &(f64, VPos, f64)| {
            let in_label = |p: &&(f64, f64)| {
                let over = (p.1 - y) * above;
                (*from - AROUND_PX * self.px[0]..=from + wide).contains(&p.0)
                    && (-AROUND_PX * self.px[1]..=high).contains(&over)
            };
            drawn.iter().filter(in_label).count()
        };
        let (start, along, _) = places.min_by_key(hidden).unwrap_or((first, VPos::Bottom, self.up));
        (start, Pos::new(HPos::Left, along))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_stands_where_nothing_is_hidden() {
        let area = Area::new((0.0, 100.0), (0.0, 1.0), (520, 350));
        let place = |drawn: &[(f64, f64)]| area.free_place("tolerance", 0.9, drawn);
        let above = |drawn: &[(f64, f64)]| place(drawn).1.v_pos as u8 == VPos::Bottom as u8;
        assert!(above(&[]) && place(&[]).0 < 2.0);
        assert!(above(&[(50.0, 0.5)]) && place(&[(50.0, 0.5)]).0 < 2.0);
        // A point above the line at its left end, then one below it, too.
        assert!(!above(&[(5.0, 0.93)]) && place(&[(5.0, 0.93)]).0 < 2.0);
        let both = [(5.0, 0.93), (8.0, 0.88)];
        assert!(above(&both) && (6.0..40.0).contains(&place(&both).0), "{}", place(&both).0);
        // Where something is hidden everywhere, the least.
        let everywhere: Vec<(f64, f64)> =
            (0..200).map(|k| (f64::from(k) * 0.5, if k % 2 == 0 { 0.93 } else { 0.87 })).collect();
        assert!(area.free_place("tolerance", 0.9, &everywhere).0.is_finite());
    }
}
