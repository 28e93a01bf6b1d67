//! A grey picture and the level at which it is clipped.

use super::clipping;
use super::grey::{Grey, Image};

/// A grey picture and the level at which it is clipped.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Its grey values.
    pub grey: Grey,
    clip_level: f64,
}

impl From<Image<u8>> for Picture {
    fn from(image: Image<u8>) -> Picture {
        let clip_level = clipping::level(&image);
        Picture { grey: Grey::Eight(image), clip_level }
    }
}

impl From<Image<u16>> for Picture {
    fn from(image: Image<u16>) -> Picture {
        let clip_level = clipping::level(&image);
        Picture { grey: Grey::Sixteen(image), clip_level }
    }
}

impl Picture {
    /// The grey value from which on a pixel tells only "too bright".
    pub fn clip_level(&self) -> f64 {
        self.clip_level
    }

    /// Width, px.
    pub fn width(&self) -> usize {
        match &self.grey {
            Grey::Eight(image) => image.width,
            Grey::Sixteen(image) => image.width,
        }
    }

    /// Height, px.
    pub fn height(&self) -> usize {
        match &self.grey {
            Grey::Eight(image) => image.height,
            Grey::Sixteen(image) => image.height,
        }
    }
}
