//! A pair of pictures with what the model leaves of its corners, as arrows.

use std::fmt::Write as _;

use maud::{Markup, html};
use nalgebra::Vector2;

use super::picture::PairJpeg;
use crate::report::page;
use crate::stereo::data::observation::Observation;

/// Length of the longest arrow as a share of the drawing's width.
const LONGEST: f64 = 0.03;

/// Both pictures of a pair and the residuals of its corners.
#[derive(Debug, Clone, PartialEq)]
pub struct PairPicture {
    /// Name of the pair.
    pub pair: String,
    /// What it is an example of.
    pub role: &'static str,
    pub jpeg: PairJpeg,
    /// Corners with their residuals, predicted minus seen, px.
    pub residuals: Vec<(Observation, Vector2<f64>)>,
}

/// The section; nothing without pictures.
pub fn section(pairs: &[PairPicture]) -> Markup {
    html! { @if !pairs.is_empty() {
        h2 { "The worst and the best pair" }
        @for pair in pairs { (figure(pair)) }
    } }
}

fn figure(pair: &PairPicture) -> Markup {
    let longest_px = pair.residuals.iter().map(|(_, r)| r.norm()).fold(1e-9, f64::max);
    let (mut dots, mut arrows) = (String::new(), String::new());
    for (o, r) in &pair.residuals {
        let at = pair.jpeg.place(o.side, &o.px);
        let along = r * (LONGEST * f64::from(pair.jpeg.width) / longest_px);
        let _ = write!(dots, "M{:.1} {:.1}h0", at.x, at.y);
        let _ = write!(arrows, "M{:.1} {:.1}l{:.1} {:.1}", at.x, at.y, along.x, along.y);
    }
    let drawn = format!(
        "<path d=\"{dots}\" stroke=\"#00e5ff\" stroke-width=\"2.4\" stroke-linecap=\"round\"/>\
         <path d=\"{arrows}\" stroke=\"#ff3b30\" stroke-width=\"1.2\" fill=\"none\"/>"
    );
    let caption = format!(
        "Pair {}, the {}: its {} corners, and where the model puts them. The longest arrow is {longest_px:.3} px. Arrows that turn \
         or point one way together are no noise: the pair moved, or the model lacks something there.",
        pair.pair,
        pair.role,
        pair.residuals.len()
    );
    page::figure(&pair.jpeg.svg("the pair with its corners", &drawn), &caption)
}
