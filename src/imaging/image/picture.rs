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
        Picture { clip_level: clipping::level(&image), grey: Grey::Eight(image) }
    }
}

impl From<Image<u16>> for Picture {
    fn from(image: Image<u16>) -> Picture {
        Picture { clip_level: clipping::level(&image), grey: Grey::Sixteen(image) }
    }
}

impl Picture {
    /// The grey value from which on a pixel tells only "too bright".
    pub fn clip_level(&self) -> f64 {
        self.clip_level
    }

    /// Width, px.
    pub fn width(&self) -> usize {
        self.size().0
    }

    /// Height, px.
    pub fn height(&self) -> usize {
        self.size().1
    }

    fn size(&self) -> (usize, usize) {
        match &self.grey {
            Grey::Eight(image) => (image.width, image.height),
            Grey::Sixteen(image) => (image.width, image.height),
        }
    }
}
