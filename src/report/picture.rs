//! Pictures inside a page.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;

use crate::imaging::image::Mosaic;
use crate::imaging::input::pairs::PairFiles;
use crate::imaging::{PairCorners, overlay};

/// A JPEG for a page: its bytes in base64 and its size, px.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Jpeg {
    /// The bytes.
    pub base64: String,
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
}

/// Both pictures of a pair side by side with the corners drawn over them, `width` px together; `None` where a picture can't be read.
pub fn pair(files: &PairFiles, corners: &PairCorners, mosaic: Option<Mosaic>, width: u32) -> Option<Jpeg> {
    let drawn = image::load_from_memory(&overlay::png(files, corners, mosaic)?).ok()?;
    let height = (drawn.height() * width / drawn.width().max(1)).max(1);
    let reduced = drawn.resize_exact(width, height, image::imageops::FilterType::Triangle);
    let mut bytes = std::io::Cursor::new(Vec::new());
    reduced.to_rgb8().write_to(&mut bytes, image::ImageFormat::Jpeg).ok()?;
    Some(Jpeg { base64: BASE64_STANDARD.encode(bytes.into_inner()), width, height })
}
