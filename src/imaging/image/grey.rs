//! Grey values row by row, as a camera gave them.

use nalgebra::Point2;

/// Values row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Image<T> {
    pub width: usize,
    pub height: usize,
    /// Its `width * height` values.
    pub pixels: Vec<T>,
}

/// A small 8-bit picture for looking, not for measuring.
pub type Grey8 = Image<u8>;

/// Grey values as the camera gave them.
#[derive(Debug, Clone, PartialEq)]
pub enum Grey {
    Eight(Image<u8>),
    /// 16 bits a pixel, of which a camera may use fewer.
    Sixteen(Image<u16>),
}

impl<T> Image<T> {
    /// A picture filled by column and row, in order.
    pub fn from_fn(width: usize, height: usize, mut at: impl FnMut(usize, usize) -> T) -> Image<T> {
        Image { width, height, pixels: (0..width * height).map(|k| at(k % width, k / width)).collect() }
    }
}

impl Grey8 {
    /// Each pixel as dark as the darkest of the 3 x 3 around it.
    pub fn darkest_around(&self) -> Grey8 {
        let of_three = |at: &dyn Fn(usize) -> u8, k: usize, end: usize| {
            at(k.saturating_sub(1)).min(at(k)).min(at((k + 1).min(end - 1)))
        };
        let rows = Image::from_fn(self.width, self.height, |x, y| {
            of_three(&|x| self.pixels[y * self.width + x], x, self.width)
        });
        Image::from_fn(self.width, self.height, |x, y| of_three(&|y| rows.pixels[y * self.width + x], y, self.height))
    }
}

impl<T: Copy + Into<f64>> Image<T> {
    /// Mean of the 3 x 3 pixels at a place; `None` at the picture's border.
    pub fn mean_at(&self, at: Point2<f64>) -> Option<f64> {
        let (x, y) = (at.x.round(), at.y.round());
        if !(x >= 1.0 && y >= 1.0 && x + 1.0 < self.width as f64 && y + 1.0 < self.height as f64) {
            return None;
        }
        let (x, y) = (x as usize, y as usize);
        let row = |y: usize| self.pixels[y * self.width + x - 1..][..3].iter().map(|&v| v.into()).sum::<f64>();
        Some((y - 1..=y + 1).map(row).sum::<f64>() / 9.0)
    }
}
