//! Is a file whole? Decoders fill in what is missing, and a filled-in picture would be measured.
//!
//! What a format can tell: PNG has a checksum for each chunk and an end chunk; a JPEG an end marker, and codes that
//! damage breaks ([`jpeg_scan`]); TIFF, BMP and PGM say how many bytes there must be (their decoders say so), and
//! cannot tell a changed byte.

use image::ImageFormat;

use super::UNDECODABLE;
use super::jpeg_scan::{self, segment};

/// The reason for a file that ends early or was changed.
pub(super) fn cut_or_damaged(format: &str, detail: &str) -> String {
    format!("{UNDECODABLE}: the {format} is cut off or damaged ({detail})")
}

/// Checks what can be checked without decoding.
pub(super) fn check(bytes: &[u8], format: Option<ImageFormat>) -> Result<(), String> {
    match format {
        Some(ImageFormat::Png) => png(bytes).map_err(|detail| cut_or_damaged("PNG", &detail)),
        Some(ImageFormat::Jpeg) => jpeg(bytes).map_err(|detail| cut_or_damaged("JPEG", &detail)),
        Some(ImageFormat::Bmp) => bmp(bytes).map_err(|detail| cut_or_damaged("BMP", &detail)),
        _ => Ok(()),
    }
}

fn big_endian(bytes: &[u8], at: usize) -> Option<usize> {
    let four: [u8; 4] = bytes.get(at..at.checked_add(4)?)?.try_into().ok()?;
    Some(u32::from_be_bytes(four) as usize)
}

/// Each chunk (length, kind, data, checksum) up to the end chunk.
fn png(bytes: &[u8]) -> Result<(), String> {
    let mut at = 8;
    loop {
        let chunk = || {
            let length = big_endian(bytes, at)?;
            let checked = bytes.get(at + 4..(at + 8).checked_add(length)?)?;
            Some((length, checked, big_endian(bytes, at + 8 + length)?))
        };
        let (length, checked, checksum) = chunk().ok_or_else(|| format!("it ends after {} bytes", bytes.len()))?;
        if crc32fast::hash(checked) as usize != checksum {
            return Err(format!("a checksum differs at byte {at}"));
        }
        if checked.starts_with(b"IEND") {
            return Ok(());
        }
        at += 12 + length;
    }
}

/// Segments up to the first scan, its data block by block, then an end marker.
fn jpeg(bytes: &[u8]) -> Result<(), String> {
    const SCAN: u8 = 0xDA;
    const END: [u8; 2] = [0xFF, 0xD9];
    let mut at = 2;
    loop {
        let (marker, _, next) =
            segment(bytes, at).ok_or_else(|| format!("no marker at byte {at} of {}", bytes.len()))?;
        if marker == SCAN {
            break;
        }
        at = next;
    }
    // In a scan a byte 0xFF is followed by 0, so the end marker cannot be data.
    if !bytes[at..].windows(2).rev().any(|two| two == END) {
        return Err("it has no end marker".to_owned());
    }
    jpeg_scan::check(bytes)
}

/// The length that the header states. Some writers state none.
fn bmp(bytes: &[u8]) -> Result<(), String> {
    let stated: Option<[u8; 4]> = bytes.get(2..6).and_then(|four| four.try_into().ok());
    let stated = stated.map_or(0, u32::from_le_bytes) as usize;
    if stated > bytes.len() {
        return Err(format!("it has {} of {stated} bytes", bytes.len()));
    }
    Ok(())
}
