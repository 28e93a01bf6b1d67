//! What is looked at before a file is decoded: what kind of file it is, how large, and what its header announces.
//!
//! A header of a few bytes can announce any number of pixels, and a name can lead to a pipe that never ends. Nothing is
//! read or allocated before it is known to be bounded; all workers together hold no more than a fixed number of bytes.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek};
use std::sync::{Condvar, Mutex, PoisonError};

use camino::Utf8Path;
use image::error::ImageFormatHint;
use image::{ImageDecoder, ImageFormat, ImageReader, Limits};
use tiff::decoder::Decoder;
use tiff::tags::Tag;

/// What every reason for a file that is no picture says.
pub const UNDECODABLE: &str = "cannot be decoded";

/// Longest side, px: what a JPEG can say, and three times the longest side of any area sensor.
const MOST_SIDE_PX: u32 = 65_535;
/// Most pixels: the largest area sensors have 250 million.
const MOST_PIXELS: u64 = 300_000_000;
/// Most bytes of decoded samples (colour and depth as in the file).
const MOST_DECODED_BYTES: u64 = 1 << 30;
/// Most bytes of a file: samples that do not compress, and what cameras write beside them.
const MOST_FILE_BYTES: u64 = MOST_DECODED_BYTES + (64 << 20);
/// Bytes that all workers together may hold for pictures. One picture is always let in.
const MOST_HELD_BYTES: u64 = 3 << 30;
/// More pictures than any series: a chain that leads back into itself ends here.
const MOST_PAGES: usize = 10_000;
/// How the text begins that Git LFS leaves in the place of a file which was not fetched.
const LFS_POINTER: &[u8] = b"version https://git-lfs.github.com/spec/";
/// In the tag of what a picture is to the others, the bit of a smaller copy (TIFF 6.0, NewSubfileType).
const SMALLER: u32 = 1;

/// What a file announces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    pub width: u32,
    pub height: u32,
    /// Pictures in the file, of which the first is read.
    pub pages: usize,
    /// Length of the file, bytes.
    file_bytes: u64,
    /// Bytes of its samples once decoded.
    decoded_bytes: u64,
}

/// Reads a picture's header; the reason where it is none that may be decoded. Pipes and devices are not opened.
pub fn header(path: &Utf8Path) -> Result<Header, String> {
    let metadata = std::fs::metadata(path).map_err(unreadable)?;
    if !metadata.is_file() {
        return Err("is not a regular file".to_owned());
    }
    let file_bytes = metadata.len();
    if file_bytes > MOST_FILE_BYTES {
        return Err(format!(
            "has {} MiB, more than any picture that can be read ({} MiB)",
            mib(file_bytes),
            mib(MOST_FILE_BYTES)
        ));
    }
    let mut file = BufReader::new(File::open(path).map_err(unreadable)?);
    if file.fill_buf().map_err(unreadable)?.starts_with(LFS_POINTER) {
        return Err(format!(
            "is a Git LFS pointer of {file_bytes} bytes, no picture: `git lfs pull` fetches the picture"
        ));
    }
    let mut reader = ImageReader::new(file).with_guessed_format().map_err(unreadable)?;
    if reader.format().is_none()
        && let Ok(format) = ImageFormat::from_path(path)
    {
        reader.set_format(format);
    }
    let pages = if reader.format() == Some(ImageFormat::Tiff) { pages(path) } else { 1 };
    let decoder = decoder(reader)?;
    let (width, height) = decoder.dimensions();
    Ok(Header { pages, width, height, file_bytes, decoded_bytes: decoder.total_bytes() })
}

/// The pictures of a TIFF, as far as they can be followed, but for smaller copies; at least one. The first is read, and
/// whoever saved a series in one file has to know that.
fn pages(path: &Utf8Path) -> usize {
    let decoder = File::open(path).ok().and_then(|file| Decoder::new(BufReader::new(file)).ok());
    let Some(mut decoder) = decoder else { return 1 };
    let mut pages = 0;
    for _ in 0..MOST_PAGES {
        let kind: Option<u32> = decoder.find_tag_unsigned(Tag::NewSubfileType).ok().flatten();
        pages += usize::from(kind.unwrap_or(0) & SMALLER == 0);
        if !decoder.more_images() || decoder.next_image().is_err() {
            break;
        }
    }
    pages.max(1)
}

/// The decoder of a picture, nothing of which is allocated before what its header announces was checked.
pub(super) fn decoder<'a, R: BufRead + Seek + 'a>(
    mut reader: ImageReader<R>,
) -> Result<impl ImageDecoder + 'a, String> {
    // Sizes are checked by `check`, with a reason that says what was found.
    reader.limits(Limits::no_limits());
    let decoder = reader.into_decoder().map_err(given_up)?;
    check(decoder.dimensions(), decoder.total_bytes())?;
    Ok(decoder)
}

fn unreadable(e: std::io::Error) -> String {
    format!("cannot be read: {e}")
}

/// The reason for a file that is no picture.
pub(super) fn undecodable(why: impl std::fmt::Display) -> String {
    format!("{UNDECODABLE}: {why}")
}

/// Why a decoder gave up, not in its own words, which are about its code.
pub(super) fn given_up(error: image::ImageError) -> String {
    undecodable(match error {
        image::ImageError::IoError(_) => "the file ends early",
        image::ImageError::Unsupported(unsupported) => match unsupported.format_hint() {
            ImageFormatHint::Exact(format) if !format.reading_enabled() => {
                let name = format.extensions_str().first().copied().unwrap_or("other").to_uppercase();
                return undecodable(format!("a {name} file, whatever its name says, and no such is read"));
            }
            _ => "its format has kinds that are not read, and this is one",
        },
        _ => "damaged, or of another format than its name says",
    })
}

/// Checks what is about to be decoded.
pub(super) fn check((width, height): (u32, u32), decoded_bytes: u64) -> Result<(), String> {
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 {
        return Err("has no pixels".to_owned());
    }
    if width.max(height) > MOST_SIDE_PX {
        return Err(format!("announces {width}x{height} px; at most {MOST_SIDE_PX} px a side are decoded"));
    }
    if pixels > MOST_PIXELS || decoded_bytes > MOST_DECODED_BYTES {
        return Err(format!(
            "announces {width}x{height} px, {} MiB when decoded; at most {} million px and {} MiB are decoded",
            mib(decoded_bytes),
            MOST_PIXELS / 1_000_000,
            mib(MOST_DECODED_BYTES)
        ));
    }
    Ok(())
}

fn mib(bytes: u64) -> u64 {
    bytes.div_ceil(1 << 20)
}

/// Reads a file whose header was looked at, no more of it than it had then.
pub fn read(path: &Utf8Path, header: &Header) -> Result<Vec<u8>, String> {
    let file = File::open(path).map_err(unreadable)?;
    let mut bytes = Vec::with_capacity(header.file_bytes as usize);
    file.take(header.file_bytes).read_to_end(&mut bytes).map_err(unreadable)?;
    Ok(bytes)
}

/// The right to hold a picture in memory, given back when dropped.
#[derive(Debug)]
pub struct Claim(u64);

static HELD: Mutex<u64> = Mutex::new(0);
static RELEASED: Condvar = Condvar::new();

impl Claim {
    /// Waits until the picture's bytes fit beside what other workers hold. A worker must hold one claim at a time.
    pub fn wait(header: &Header) -> Claim {
        // The file, its samples, and the grey made of them with the copies that are looked at.
        let bytes = header.file_bytes + 2 * header.decoded_bytes;
        let mut held = HELD.lock().unwrap_or_else(PoisonError::into_inner);
        while *held > 0 && *held + bytes > MOST_HELD_BYTES {
            held = RELEASED.wait(held).unwrap_or_else(PoisonError::into_inner);
        }
        *held += bytes;
        Claim(bytes)
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        *HELD.lock().unwrap_or_else(PoisonError::into_inner) -= self.0;
        RELEASED.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use tiff::encoder::{TiffEncoder, colortype::Gray8};

    use super::*;

    #[test]
    fn a_picture_that_git_did_not_fetch_is_named() {
        let pointer =
            format!("version https://git-lfs.github.com/spec/v1\noid sha256:{}\nsize 12345\n", "4d7a".repeat(16));
        let (_keep, path) = crate::files::temporary("a.png", &pointer);
        let said = header(&path).unwrap_err();
        assert!(said.contains("Git LFS pointer") && !said.contains(UNDECODABLE), "{said}");
    }

    #[test]
    fn pictures_of_a_series_count_and_smaller_copies_do_not() {
        let (_keep, path) = crate::files::temporary("a.tif", "");
        let of = |kinds: &[u32]| {
            let mut file = TiffEncoder::new(File::create(&path).unwrap()).unwrap();
            for kind in kinds {
                let mut image = file.new_image::<Gray8>(8, 6).unwrap();
                image.encoder().write_tag(Tag::NewSubfileType, *kind).unwrap();
                image.write_data(&[7; 48]).unwrap();
            }
            pages(&path)
        };
        assert_eq!(of(&[0; 12]), 12);
        assert_eq!(of(&[0, SMALLER]), 1);
        assert_eq!(of(&[0]), 1);
        let whole = std::fs::read(&path).unwrap();
        for cut in [&whole[..whole.len() / 2], b"P5 1 1 255\n\0"] {
            std::fs::write(&path, cut).unwrap();
            assert_eq!(pages(&path), 1);
        }
    }
}
