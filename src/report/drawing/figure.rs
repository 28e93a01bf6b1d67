//! Figures as SVG text: axes with units, a legend, nothing that needs a network or a font file.

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use super::axis::{Ticked, padded, power_of_ten, tick, widened};
use super::label::{Area, LABEL_PX};
use super::marks::Marks;
use crate::diagnostic::aligned;
use crate::report::{Error, Result};

/// Drawn at twice the size it is shown, because the backend rounds to whole units.
const SCALE: u32 = 2;
/// Size on the page, px.
const SIZE: (u32, u32) = (520, 350);

/// Height of a legend's row as a share of the plotting area's.
const LEGEND_ROW: f64 = 0.075;

/// Colours of the series in turn: distinct for the colour-blind (Okabe and Ito), dark enough on white.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 140, 180),
    RGBColor(180, 140, 0),
    RGBColor(90, 90, 90),
];

/// A figure with one pair of axes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plot {
    title: String,
    x_label: String,
    y_label: String,
    series: Vec<(String, Marks)>,
    guides: Vec<(f64, String)>,
    x_range: Option<(f64, f64)>,
    y_range: Option<(f64, f64)>,
    size: (u32, u32),
    log_y: bool,
    equal_axes: bool,
    y_down: bool,
    whole_x: bool,
}

impl Plot {
    /// An empty figure. The labels carry their units: "distance, mm".
    pub fn new(title: &str, x_label: &str, y_label: &str) -> Plot {
        Plot {
            title: title.to_owned(),
            x_label: x_label.to_owned(),
            y_label: y_label.to_owned(),
            size: SIZE,
            ..Plot::default()
        }
    }

    fn with(mut self, label: &str, marks: Marks) -> Plot {
        self.series.push((label.to_owned(), marks));
        self
    }

    /// Adds points. An empty label keeps a series out of the legend.
    pub fn points(self, label: &str, xy: impl IntoIterator<Item = (f64, f64)>) -> Plot {
        self.with(label, Marks::Points(xy.into_iter().collect()))
    }

    /// Adds points by thirds of a length that each carries, none of them below `least_mm`: `(x, y, mm)`.
    pub fn points_by_thirds(mut self, points: &[(f64, f64, f64)], least_mm: f64) -> Plot {
        let mut lengths: Vec<f64> = points.iter().map(|(.., mm)| *mm).collect();
        lengths.sort_by(f64::total_cmp);
        let third = |k: usize| lengths.get(k * lengths.len() / 3).copied().unwrap_or(0.0);
        for (low, high) in [(least_mm, third(1)), (third(1), third(2)), (third(2), f64::INFINITY)] {
            let within = points.iter().filter(|(.., mm)| *mm >= low && *mm < high);
            let label = match aligned(&[Some(low), Some(high).filter(|mm| mm.is_finite())]).as_slice() {
                [low, high] if high != "n/a" => format!("{low} to {high} mm"),
                [low, ..] => format!("{low} mm and more"),
                [] => String::new(),
            };
            self = self.points(&label, within.map(|&(x, y, _)| (x, y)));
        }
        self
    }

    /// Adds a line through points.
    pub fn line(self, label: &str, xy: impl IntoIterator<Item = (f64, f64)>) -> Plot {
        self.with(label, Marks::Line(xy.into_iter().collect()))
    }

    /// Adds points with upright bars of the given half length: `(x, y, half)`.
    pub fn error_bars(self, label: &str, bars: impl IntoIterator<Item = (f64, f64, f64)>) -> Plot {
        self.with(label, Marks::ErrorBars(bars.into_iter().collect()))
    }

    /// Adds arrows `[x, y, dx, dy]`, lengths in the axes' units: the caller magnifies and says so in the caption.
    pub fn vectors(self, label: &str, arrows: impl IntoIterator<Item = [f64; 4]>) -> Plot {
        self.with(label, Marks::Vectors(arrows.into_iter().collect()))
    }

    /// Adds a level line across the figure, for a tolerance.
    pub fn hline(mut self, y: f64, label: &str) -> Plot {
        self.guides.push((y, label.to_owned()));
        self
    }

    /// Fixes the ranges of x and y.
    pub fn ranges(mut self, x: (f64, f64), y: (f64, f64)) -> Plot {
        (self.x_range, self.y_range) = (Some(x), Some(y));
        self
    }

    /// Size on the page, px, instead of 520x350.
    pub fn size(mut self, width: u32, height: u32) -> Plot {
        self.size = (width, height);
        self
    }

    /// Powers of ten along y; values that are not positive are left out.
    pub fn log_y(mut self) -> Plot {
        self.log_y = true;
        self
    }

    /// The same length a unit along x and y, for places.
    pub fn equal_axes(mut self) -> Plot {
        self.equal_axes = true;
        self
    }

    /// y grows downward, as in a picture.
    pub fn y_down(mut self) -> Plot {
        self.y_down = true;
        self
    }

    /// Ticks of x at whole numbers alone, where it counts.
    pub fn whole_x(mut self) -> Plot {
        self.whole_x = true;
        self
    }

    /// The figure as SVG text, ready to stand in a page.
    pub fn svg(&self) -> Result<String> {
        let mut text = String::new();
        let size = (self.size.0 * SCALE, self.size.1 * SCALE);
        let drawn = {
            let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
            self.draw(&root).and_then(|()| root.present().map_err(|e| e.to_string()))
        };
        drawn.map_err(|message| Error::Figure { figure: self.title.clone(), message })?;
        // The page decides the shown size; the drawing keeps its own units in the view box.
        let (shown_width, shown_height) = self.size;
        Ok(text.replacen(
            &format!("<svg width=\"{}\" height=\"{}\"", size.0, size.1),
            &format!(
                "<svg width=\"{shown_width}\" height=\"{shown_height}\" class=\"plot\" font-family=\"sans-serif\""
            ),
            1,
        ))
    }

    /// y as it is plotted; `None` where it can't be.
    fn plotted(&self, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        let y = if self.log_y { y.log10() } else { y };
        (x.is_finite() && y.is_finite()).then_some((x, y))
    }

    fn shown(&self) -> ((f64, f64), (f64, f64)) {
        let places: Vec<(f64, f64)> =
            self.series.iter().flat_map(|(_, m)| m.extent()).filter_map(|p| self.plotted(p)).collect();
        let guides = self.guides.iter().filter_map(|g| self.plotted((0.0, g.0))).map(|p| p.1);
        let mut x = padded(places.iter().map(|p| p.0));
        let mut y = padded(places.iter().map(|p| p.1).chain(guides));
        // Room above for the legend, so that it covers no point.
        let labels = self.series.iter().filter(|series| self.is_in_legend(series)).count();
        if labels > 0 {
            y.1 += (y.1 - y.0) * LEGEND_ROW * (labels as f64 + 0.5);
        }
        x = self.x_range.unwrap_or(x);
        if let Some((low, high)) = self.y_range {
            y = if self.log_y { (low.log10(), high.log10()) } else { (low, high) };
        }
        if self.equal_axes {
            let area = (f64::from(self.size.0) - 90.0, f64::from(self.size.1) - 90.0);
            let per_px = ((x.1 - x.0) / area.0).max((y.1 - y.0) / area.1);
            x = widened(x, per_px * area.0);
            y = widened(y, per_px * area.1);
        }
        (x, y)
    }

    fn draw(&self, root: &DrawingArea<SVGBackend<'_>, Shift>) -> std::result::Result<(), String> {
        let say = |e: DrawingAreaErrorKind<_>| e.to_string();
        root.fill(&WHITE).map_err(say)?;
        let (x, mut y) = self.shown();
        if self.y_down {
            y = (y.1, y.0);
        }
        let font = |px: u32| ("sans-serif", px * SCALE).into_font();
        let mut chart = ChartBuilder::on(root)
            .caption(&self.title, font(16))
            .margin(10 * SCALE)
            .x_label_area_size(44 * SCALE)
            .y_label_area_size(74 * SCALE)
            .build_cartesian_2d(x.0..x.1, Ticked::new(y, self.log_y))
            .map_err(say)?;
        let y_text = |v: &f64| if self.log_y { power_of_ten(*v, y) } else { tick(*v, y) };
        let x_text = |v: &f64| if self.whole_x { format!("{v:.0}") } else { tick(*v, x) };
        // So few that a step is one at least.
        let x_labels = if self.whole_x { (1.0 + (x.1 - x.0).floor()).clamp(1.0, 7.0) as usize } else { 7 };
        chart
            .configure_mesh()
            .x_desc(&self.x_label)
            .y_desc(&self.y_label)
            .x_label_formatter(&x_text)
            .y_label_formatter(&y_text)
            .x_labels(x_labels)
            .label_style(font(13))
            .axis_desc_style(font(14))
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.1))
            .draw()
            .map_err(say)?;
        for (k, series) in self.series.iter().enumerate() {
            self.draw_series(&mut chart, series, COLOURS[k % COLOURS.len()])?;
        }
        self.draw_guides(&mut chart, x, y)?;
        if self.series.iter().any(|series| self.is_in_legend(series)) {
            chart
                .configure_series_labels()
                .position(SeriesLabelPosition::UpperRight)
                .background_style(WHITE.mix(0.85))
                .border_style(BLACK.mix(0.2))
                .label_font(font(13))
                .margin(6 * SCALE)
                .legend_area_size(22 * SCALE)
                .draw()
                .map_err(say)?;
        }
        Ok(())
    }

    fn draw_series(
        &self,
        chart: &mut Chart<'_, '_>,
        series: &(String, Marks),
        colour: RGBColor,
    ) -> std::result::Result<(), String> {
        let say = |e: DrawingAreaErrorKind<_>| e.to_string();
        let (label, marks) = series;
        let keep = |xy: &[(f64, f64)]| -> Vec<(f64, f64)> { xy.iter().filter_map(|&p| self.plotted(p)).collect() };
        let width = SCALE + SCALE / 2;
        let anno = match marks {
            Marks::Points(xy) => {
                let radius = match xy.len() {
                    0..=200 => 3,
                    201..=2000 => 2,
                    _ => 1,
                } * SCALE as i32;
                chart.draw_series(keep(xy).into_iter().map(|p| Circle::new(p, radius, colour.mix(0.6).filled())))
            }
            Marks::Line(xy) => chart.draw_series(LineSeries::new(keep(xy), colour.stroke_width(width))),
            Marks::ErrorBars(bars) => {
                let bars: Vec<_> =
                    bars.iter().filter(|(x, y, h)| x.is_finite() && y.is_finite() && h.is_finite()).copied().collect();
                chart
                    .draw_series(bars.iter().map(|&(x, y, h)| {
                        PathElement::new(vec![(x, y - h), (x, y + h)], colour.mix(0.6).stroke_width(width))
                    }))
                    .map_err(say)?;
                chart.draw_series(bars.iter().map(|&(x, y, _)| Circle::new((x, y), 3 * SCALE as i32, colour.filled())))
            }
            Marks::Vectors(arrows) => {
                let arrows: Vec<_> = arrows.iter().filter(|a| a.iter().all(|v| v.is_finite())).copied().collect();
                chart
                    .draw_series(arrows.iter().map(|&[x, y, _, _]| Circle::new((x, y), SCALE as i32, colour.filled())))
                    .map_err(say)?;
                chart.draw_series(arrows.iter().map(|&[x, y, dx, dy]| {
                    PathElement::new(vec![(x, y), (x + dx, y + dy)], colour.stroke_width(SCALE))
                }))
            }
        }
        .map_err(say)?;
        if self.is_in_legend(series) {
            let s = SCALE as i32;
            anno.label(label).legend(move |(x, y)| {
                Rectangle::new([(x, y - 4 * s), (x + 16 * s, y + 4 * s)], colour.mix(0.8).filled())
            });
        }
        Ok(())
    }

    /// Whether a series has a name and anything that is drawn.
    fn is_in_legend(&self, (label, marks): &(String, Marks)) -> bool {
        !label.is_empty() && marks.extent().into_iter().any(|p| self.plotted(p).is_some())
    }

    fn draw_guides(&self, chart: &mut Chart<'_, '_>, x: (f64, f64), y: (f64, f64)) -> std::result::Result<(), String> {
        let say = |e: DrawingAreaErrorKind<_>| e.to_string();
        let colour = RGBColor(170, 30, 30);
        let area = Area::new(x, y, self.size);
        let drawn: Vec<(f64, f64)> =
            self.series.iter().flat_map(|(_, marks)| marks.covered(|p| self.plotted(p))).collect();
        for (level, label) in &self.guides {
            let Some((_, at_y)) = self.plotted((0.0, *level)) else { continue };
            let dashes =
                DashedLineSeries::new([(x.0, at_y), (x.1, at_y)], 8 * SCALE, 5 * SCALE, colour.stroke_width(SCALE));
            chart.draw_series(dashes).map_err(say)?;
            if label.is_empty() {
                continue;
            }
            let (at_x, pos) = area.free_place(label, at_y, &drawn);
            let style = TextStyle::from(("sans-serif", LABEL_PX * SCALE).into_font()).color(&colour).pos(pos);
            chart.draw_series([Text::new(label.clone(), (at_x, at_y), style)]).map_err(say)?;
        }
        Ok(())
    }
}

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, Ticked>>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_mark_is_drawn() {
        let svg = Plot::new("a & b", "x, mm", "y, <px>")
            .points("p", [(0.0, 1.0), (1.0, f64::NAN)])
            .line("l", [(0.0, 0.0), (1.0, 1.0)])
            .error_bars("e", [(0.5, 0.5, 0.1)])
            .vectors("v", [[0.0, 0.0, 0.1, 0.1]])
            .hline(0.9, "limit")
            .svg()
            .unwrap();
        for part in ["a &amp; b", "x, mm", "y, &lt;px&gt;", "limit", "<circle", "<polyline", "viewBox"] {
            assert!(svg.contains(part), "{part} is missing");
        }
        assert!(!svg.contains("NaN"));
    }

    #[test]
    fn what_is_not_drawn_has_no_place_in_the_legend() {
        let plot = Plot::new("t", "x", "y").points("seen", [(0.0, 1.0)]).points("absent", []);
        let svg = plot.log_y().points("zero", [(0.0, 0.0)]).svg().unwrap();
        assert!(svg.contains("seen") && !svg.contains("absent") && !svg.contains("zero"), "{svg}");
    }

    #[test]
    fn counts_have_whole_ticks() {
        for pairs in [1, 2, 4, 6, 13, 60] {
            let dots = (1..=pairs).map(|k| (f64::from(k), 0.1));
            let plot = Plot { y_range: Some((0.0, 1.0)), ..Plot::new("t", "pair", "y") };
            let svg = plot.whole_x().points("", dots).svg().unwrap();
            let labels: Vec<&str> =
                svg.split('>').filter_map(|part| part.strip_suffix("</text")).map(str::trim).collect();
            let whole: Vec<i64> = labels.iter().filter_map(|label| label.parse().ok()).collect();
            assert!(!whole.is_empty() && whole.len() <= 9, "{pairs}: {labels:?}");
            let distinct: std::collections::BTreeSet<&i64> = whole.iter().collect();
            assert_eq!(distinct.len(), whole.len(), "{pairs}: {labels:?}");
        }
    }

    #[test]
    fn nothing_to_draw_is_an_empty_frame() {
        for plot in [Plot::new("t", "x", "y"), Plot::new("t", "x", "y").log_y().line("l", [(0.0, 0.0), (1.0, -1.0)])] {
            assert!(plot.equal_axes().svg().unwrap().starts_with("<svg"));
        }
    }
}
