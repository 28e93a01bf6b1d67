//! What a figure draws: points, lines, bars, arrows.

/// How a series is drawn.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Marks {
    Points(Vec<(f64, f64)>),
    Line(Vec<(f64, f64)>),
    /// x, y, half length of the bar.
    ErrorBars(Vec<(f64, f64, f64)>),
    /// x, y, dx, dy; the arrows' lengths are in the axes' units.
    Vectors(Vec<[f64; 4]>),
}

impl Marks {
    /// Every place that must lie inside the axes.
    pub(super) fn extent(&self) -> Vec<(f64, f64)> {
        match self {
            Marks::Points(xy) | Marks::Line(xy) => xy.clone(),
            Marks::ErrorBars(bars) => bars.iter().flat_map(|&(x, y, h)| [(x, y - h), (x, y + h)]).collect(),
            Marks::Vectors(v) => v.iter().flat_map(|&[x, y, dx, dy]| [(x, y), (x + dx, y + dy)]).collect(),
        }
    }

    /// Places that they cover once each is `plotted`, of lines and bars so many that no label fits between two.
    pub(super) fn covered(&self, plotted: impl Fn((f64, f64)) -> Option<(f64, f64)>) -> Vec<(f64, f64)> {
        const STEPS: u32 = 24;
        let along = |a: (f64, f64), b: (f64, f64)| {
            (0..=STEPS).map(move |k| {
                let share = f64::from(k) / f64::from(STEPS);
                (a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1))
            })
        };
        let strokes: Vec<[(f64, f64); 2]> = match self {
            Marks::Points(xy) => return xy.iter().filter_map(|&p| plotted(p)).collect(),
            Marks::Line(xy) => xy.windows(2).map(|ends| [ends[0], ends[1]]).collect(),
            Marks::ErrorBars(bars) => bars.iter().map(|&(x, y, h)| [(x, y - h), (x, y + h)]).collect(),
            Marks::Vectors(arrows) => arrows.iter().map(|&[x, y, dx, dy]| [(x, y), (x + dx, y + dy)]).collect(),
        };
        strokes.into_iter().filter_map(|[a, b]| Some(along(plotted(a)?, plotted(b)?))).flatten().collect()
    }
}
