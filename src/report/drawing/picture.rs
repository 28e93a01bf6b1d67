//! Pictures inside a page.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use nalgebra::Point2;

use crate::imaging::Side;
use crate::imaging::overlay::SideBySide;

/// Both pictures of a pair side by side as a JPEG for a page.
#[derive(Debug, Clone, PartialEq)]
pub struct PairJpeg {
    /// Its bytes in base64.
    pub base64: String,
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    scale: f64,
    /// What was made smaller, without its pixels.
    places: SideBySide,
}

impl PairJpeg {
    /// A pair, `width` px wide, both pictures together; `None` where it cannot be encoded.
    pub fn new(mut both: SideBySide, width: u32) -> Option<PairJpeg> {
        let image = std::mem::take(&mut both.image);
        let scale = f64::from(width) / f64::from(image.width().max(1));
        let height = ((f64::from(image.height()) * scale) as u32).max(1);
        let drawn_so = image.dimensions() == (width, height);
        let reduced = if drawn_so { image } else { image::imageops::thumbnail(&image, width, height) };
        let mut bytes = std::io::Cursor::new(Vec::new());
        reduced.write_to(&mut bytes, image::ImageFormat::Jpeg).ok()?;
        Some(PairJpeg { base64: BASE64_STANDARD.encode(bytes.into_inner()), width, height, scale, places: both })
    }

    /// The pair with what is `drawn` over it, as SVG; `label` says what it shows.
    pub fn svg(&self, label: &str, drawn: &str) -> String {
        let PairJpeg { base64, width: w, height: h, .. } = self;
        format!(
            "<svg class=\"photo\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" height=\"{h}\" role=\"img\" aria-label=\"{label}\">\
             <image width=\"{w}\" height=\"{h}\" href=\"data:image/jpeg;base64,{base64}\"/>{drawn}</svg>"
        )
    }

    /// Where a place in a raw picture lies, px.
    pub fn place(&self, side: Side, px: &Point2<f64>) -> Point2<f64> {
        self.places.place(side, px).map(|v| (v + 0.5) * self.scale - 0.5)
    }
}
