//! A view of things in space that is turned with the mouse, a finger or the arrow keys; without script it is a still
//! picture.
//!
//! Everything is drawn as lines of an SVG in parallel projection. Each line carries its points, so that
//! [`SCRIPT`](super::script::SCRIPT) can draw it again from another side. The view's own frame is a camera's: x right,
//! y down, z away.

use std::fmt::Write as _;

use nalgebra::{Point3, Vector3};

use crate::report::page;
use maud::{Markup, html};

/// Size of the drawing, px.
const SIZE: (f64, f64) = (760.0, 480.0);

/// From where it is seen first: turned about the vertical, tilted from above, rad.
const START: (f64, f64) = (0.65, 0.45);

/// Share of half the height that the farthest point is from the middle.
const FILLED: f64 = 0.94;

/// Colours of lines, told apart on light and on dark ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ink {
    /// What stands still: cameras, frames.
    Frame,
    /// The rest.
    Plain,
    /// What is to be looked at.
    Good,
    /// What is to be looked at first.
    Bad,
}

impl Ink {
    fn class(self) -> &'static str {
        match self {
            Ink::Frame => "i-frame",
            Ink::Plain => "i-plain",
            Ink::Good => "i-good",
            Ink::Bad => "i-bad",
        }
    }
}

/// What is drawn alike: the ink, and whether it is dots.
type Class = (Ink, bool);

/// Lines and words in space, mm.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scene {
    lines: Vec<(Class, Vec<Vec<Point3<f64>>>)>,
    words: Vec<(Point3<f64>, String)>,
}

impl Scene {
    /// Adds a line through points; of one point, a dot.
    pub fn line(&mut self, ink: Ink, points: Vec<Point3<f64>>) {
        if points.is_empty() || points.iter().any(|p| !p.iter().all(|v| v.is_finite())) {
            return;
        }
        let class = (ink, points.len() == 1);
        match self.lines.iter_mut().find(|(of, _)| *of == class) {
            Some((_, lines)) => lines.push(points),
            None => self.lines.push((class, vec![points])),
        }
    }

    /// Adds a word beside a point.
    pub fn word(&mut self, at: Point3<f64>, text: &str) {
        if at.iter().all(|v| v.is_finite()) {
            self.words.push((at, text.to_owned()));
        }
    }

    /// The same in a frame whose z points up, as robots' do.
    pub fn upright(self) -> Scene {
        let turn = |p: &Point3<f64>| Point3::new(p.x, -p.z, p.y);
        let turned = |lines: &Vec<Vec<Point3<f64>>>| lines.iter().map(|l| l.iter().map(turn).collect()).collect();
        Scene {
            lines: self.lines.iter().map(|(class, lines)| (*class, turned(lines))).collect(),
            words: self.words.iter().map(|(at, text)| (turn(at), text.clone())).collect(),
        }
    }

    /// The drawing with what to see in it; nothing where there is nothing.
    pub fn figure(&self, name: &str, caption: &str) -> Markup {
        match self.svg(name) {
            Some(svg) => page::figure(&svg, &format!("{caption} Turn it with the mouse, a finger or the arrow keys.")),
            None => html! {},
        }
    }

    fn svg(&self, name: &str) -> Option<String> {
        let points = || self.lines.iter().flat_map(|(_, lines)| lines.iter().flatten());
        let first = points().next()?;
        let bounds =
            points().fold((first.coords, first.coords), |(low, high), p| (low.inf(&p.coords), high.sup(&p.coords)));
        let middle: Vector3<f64> = (bounds.0 + bounds.1) / 2.0;
        let reach = points().map(|p| (p.coords - middle).norm()).fold(1e-9, f64::max);
        let (width, height) = SIZE;
        let scale = FILLED * height / 2.0 / reach;
        let data = |p: &Point3<f64>| {
            let q = p.coords - middle;
            format!("{},{},{}", rounded(q.x), rounded(q.y), rounded(q.z))
        };
        let mut svg = format!(
            "<svg class=\"scene\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" data-scale=\"{scale:.5}\" \
             data-yaw=\"{}\" data-pitch=\"{}\" tabindex=\"0\" role=\"img\" aria-label=\"{name}\">",
            START.0, START.1
        );
        for ((ink, dots), lines) in &self.lines {
            let all: Vec<String> =
                lines.iter().map(|line| line.iter().map(data).collect::<Vec<_>>().join(" ")).collect();
            let mut path = String::new();
            for line in lines {
                for (i, p) in line.iter().enumerate() {
                    let (x, y) = seen(&(p.coords - middle), scale);
                    let _ = write!(path, "{}{x:.1} {y:.1}", if i == 0 { 'M' } else { 'L' });
                }
                if line.len() == 1 {
                    path.push_str("h0");
                }
            }
            let dots = if *dots { " dots" } else { "" };
            let _ = write!(svg, "<path class=\"{}{dots}\" data-p=\"{}\" d=\"{path}\"/>", ink.class(), all.join("|"));
        }
        for (at, text) in &self.words {
            let (x, y) = seen(&(at.coords - middle), scale);
            let text = html! { (text) }.into_string();
            let _ =
                write!(svg, "<text data-p=\"{}\" x=\"{x:.1}\" y=\"{y:.1}\" dx=\"4\" dy=\"16\">{text}</text>", data(at));
        }
        svg.push_str("</svg>");
        Some(svg)
    }
}

/// Tenths of a millimetre, as short as may be.
fn rounded(v: f64) -> f64 {
    (v * 10.0).round() / 10.0 + 0.0
}

/// A point as it is seen first, px.
fn seen(p: &Vector3<f64>, scale: f64) -> (f64, f64) {
    let ((sin_y, cos_y), (sin_p, cos_p)) = (START.0.sin_cos(), START.1.sin_cos());
    let (x, z) = (p.x * cos_y + p.z * sin_y, p.z * cos_y - p.x * sin_y);
    (SIZE.0 / 2.0 + scale * x, SIZE.1 / 2.0 + scale * (p.y * cos_p - z * sin_p))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_is_drawn_within_its_frame() {
        let mut scene = Scene::default();
        scene.line(Ink::Frame, vec![Point3::origin(), Point3::new(100.0, 0.0, 0.0), Point3::new(0.0, 50.0, 900.0)]);
        scene.line(Ink::Bad, vec![Point3::new(-20.0, 3.0, 4.0)]);
        scene.line(Ink::Bad, vec![Point3::new(f64::NAN, 3.0, 4.0)]);
        scene.word(Point3::origin(), "a < b");
        let svg = scene.svg("cameras").unwrap();
        assert!(svg.contains("a &lt; b") && svg.contains("h0") && !svg.contains("NaN"), "{svg}");
        let path = svg.split(" d=\"").nth(1).unwrap().split('"').next().unwrap();
        let numbers: Vec<f64> = path.split(['M', 'L', ' ']).filter_map(|word| word.parse().ok()).collect();
        assert_eq!(numbers.len(), 6);
        for xy in numbers.chunks(2) {
            assert!((0.0..=SIZE.0).contains(&xy[0]) && (0.0..=SIZE.1).contains(&xy[1]), "{xy:?}");
        }
    }

    #[test]
    fn up_is_up() {
        let mut scene = Scene::default();
        scene.line(Ink::Plain, vec![Point3::origin(), Point3::new(0.0, 0.0, 10.0)]);
        let svg = scene.upright().svg("robot").unwrap();
        // The view's y points down: the end of the line along z lies above its start.
        assert!(svg.contains("data-p=\"0,5,0 0,-5,0\""), "{svg}");
        assert_eq!(Scene::default().svg("nothing"), None);
    }
}
