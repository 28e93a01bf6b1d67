//! Pictures as measured: one decoder, one grey.
//!
//! In: a file (PNG, TIFF, BMP, JPEG, PGM; 8 or 16 bit; grey, colour, or a raw mosaic whose pattern is named). Out: grey
//! values as they were measured, 8 or 16 bit, and the level at which they are clipped. Nothing is scaled, turned or
//! corrected: two decoders, or one that "improves", would give two measurements.

mod clipping;
mod decode;
mod drawn;
mod grey;
mod integrity;
mod jpeg_quality;
mod jpeg_scan;
mod limits;
mod mosaic;
pub mod pyramid;
pub mod raster;

pub use clipping::Picture;
pub use decode::{decode, picture};
pub use drawn::DRAWN;
pub use grey::{Grey, Grey8, Image};
pub use jpeg_quality::{ENOUGH_QUALITY, jpeg_quality};
pub use limits::{Claim, Header, UNDECODABLE, header, read};
pub use mosaic::Mosaic;
