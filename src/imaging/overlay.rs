//! What was found, drawn over the pictures: left and right of a pair side by side, reduced to about a megapixel each,
//! or to thumbnails.
//!
//! A ring at each corner, coloured by how well it is known; a line from corner (0, 0) along the columns and a shorter
//! one along the rows shows the order both pictures were read in.

use camino::Utf8Path;
use image::{GrayImage, Rgb, RgbImage, imageops};
use nalgebra::Point2;

use super::image::pyramid::Small;
use super::image::{Grey8, Mosaic};
use super::input::pairs::PairFiles;
use super::{Corner, PairCorners, Side};

/// Standard deviations up to which a corner gets a colour, px, from the best.
const COLOURS: [(f64, [u8; 3]); 4] =
    [(0.005, [0, 200, 0]), (0.02, [150, 220, 0]), (0.05, [255, 160, 0]), (f64::INFINITY, [255, 0, 0])];
/// Found, but not used.
const UNUSED: [u8; 3] = [60, 90, 255];
/// The lines from corner (0, 0).
const ORDER: [u8; 3] = [255, 0, 255];

/// Radius of a ring round a corner, px: on a megapixel, and on a thumbnail.
const RING_PX: f64 = 4.0;
const SMALL_RING_PX: f64 = 2.0;

/// Both pictures of a pair, reduced, and where their pixels lie.
#[derive(Debug, Clone, PartialEq)]
pub struct SideBySide {
    /// Left, then right.
    pub image: RgbImage,
    /// Pixels of each picture along one pixel here.
    scales: [f64; 2],
    left_width: u32,
    ring_px: f64,
}

impl SideBySide {
    /// Reads both; `None` where a picture can't be read.
    pub fn read(files: &PairFiles, mosaic: Option<Mosaic>) -> Option<SideBySide> {
        let small = |path: &Utf8Path| Some(Small::coarse(&super::image::picture(path, mosaic).ok()?));
        let (left, right) = rayon::join(|| small(&files.left), || small(&files.right));
        let (left, right) = (left?, right?);
        Some(SideBySide::new([&left, &right].map(|s| (grey(&s.copy), s.level.scale())), RING_PX))
    }

    fn new([(left, left_scale), (right, right_scale)]: [(GrayImage, f64); 2], ring_px: f64) -> SideBySide {
        let (width, height) = (left.width() + right.width(), left.height().max(right.height()));
        let left_width = left.width();
        let mut both = GrayImage::new(width, height);
        imageops::replace(&mut both, &left, 0, 0);
        imageops::replace(&mut both, &right, i64::from(left_width), 0);
        let image = RgbImage::from_fn(width, height, |x, y| Rgb([both.get_pixel(x, y)[0]; 3]));
        SideBySide { image, scales: [left_scale, right_scale], left_width, ring_px }
    }

    /// Where a place in a raw picture lies, px.
    pub fn place(&self, side: Side, px: &Point2<f64>) -> Point2<f64> {
        let at = px.map(|v| (v + 0.5) / self.scales[side as usize] - 0.5);
        if side == Side::Right { Point2::new(at.x + f64::from(self.left_width), at.y) } else { at }
    }

    fn with_corners(mut self, corners: &PairCorners) -> SideBySide {
        self.draw(Side::Left, &corners.left);
        self.draw(Side::Right, &corners.right);
        self
    }

    fn draw(&mut self, side: Side, corners: &[Corner]) {
        let first = corners.iter().find(|c| c.col == 0 && c.row == 0);
        for (col, row) in [(2, 0), (0, 1)] {
            if let (Some(a), Some(b)) = (first, corners.iter().find(|c| c.col == col && c.row == row)) {
                let (from, to) = (self.place(side, &a.px), self.place(side, &b.px));
                line(&mut self.image, from, to);
            }
        }
        for corner in corners {
            let at = self.place(side, &corner.px);
            ring(&mut self.image, at, self.ring_px, colour(corner));
        }
    }
}

/// The pair with its corners; `None` where a picture can't be read any more.
pub fn drawn(files: &PairFiles, corners: &PairCorners, mosaic: Option<Mosaic>) -> Option<SideBySide> {
    Some(SideBySide::read(files, mosaic)?.with_corners(corners))
}

/// Thumbnails of a pair with its corners, together not wider than this, px.
pub fn drawn_small(thumbnails: [&Small; 2], corners: &PairCorners, width: u32) -> SideBySide {
    SideBySide::new(thumbnails.map(|small| narrowed(small, width / 2)), SMALL_RING_PX).with_corners(corners)
}

/// A thumbnail not wider than this, px, and how many pixels of the picture one of it is.
fn narrowed(small: &Small, width: u32) -> (GrayImage, f64) {
    let (all, scale) = (grey(&small.copy), small.level.scale());
    if all.width() <= width {
        return (all, scale);
    }
    let by = f64::from(all.width()) / f64::from(width.max(1));
    let height = (f64::from(all.height()) / by).round().max(1.0) as u32;
    (imageops::thumbnail(&all, width.max(1), height), scale * by)
}

/// The same as PNG.
pub fn png(files: &PairFiles, corners: &PairCorners, mosaic: Option<Mosaic>) -> Option<Vec<u8>> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    drawn(files, corners, mosaic)?.image.write_to(&mut bytes, image::ImageFormat::Png).ok()?;
    Some(bytes.into_inner())
}

fn grey(copy: &Grey8) -> GrayImage {
    GrayImage::from_raw(copy.width as u32, copy.height as u32, copy.pixels.clone()).unwrap_or_default()
}

fn colour(corner: &Corner) -> [u8; 3] {
    let Some(s) = corner.covariance_px2.filter(|_| corner.used) else { return UNUSED };
    let sigma = (s.trace() / 2.0).sqrt();
    COLOURS.iter().find(|(most, _)| sigma <= *most).map_or(UNUSED, |(_, colour)| *colour)
}

fn set(image: &mut RgbImage, x: f64, y: f64, colour: [u8; 3]) {
    let (x, y) = (x.round(), y.round());
    if x >= 0.0 && y >= 0.0 && x < f64::from(image.width()) && y < f64::from(image.height()) {
        image.put_pixel(x as u32, y as u32, Rgb(colour));
    }
}

fn ring(image: &mut RgbImage, at: Point2<f64>, radius: f64, colour: [u8; 3]) {
    for step in 0..32 {
        let (sin, cos) = (f64::from(step) * std::f64::consts::TAU / 32.0).sin_cos();
        set(image, at.x + radius * cos, at.y + radius * sin, colour);
    }
}

fn line(image: &mut RgbImage, from: Point2<f64>, to: Point2<f64>) {
    let steps = (to - from).norm().ceil().clamp(1.0, 10_000.0);
    for step in 0..=steps as usize {
        let p = from + (to - from) * (step as f64 / steps);
        set(image, p.x, p.y, ORDER);
    }
}
