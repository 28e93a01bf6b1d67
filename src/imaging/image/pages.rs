//! How many pictures a TIFF holds: the first is read, and whoever saved a series in one file has to know that.
//!
//! In: the file. Out: its directories (TIFF 6.0, section 2), without those of smaller copies (NewSubfileType, bit 0). Goes wrong: a BigTIFF, which
//! counts as one picture.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};

use camino::Utf8Path;

/// More directories than any series: a chain that leads back into itself ends here.
const MOST: usize = 10_000;

/// Tag of what a directory's picture is to the others, and the bit that says a smaller copy.
const NEW_SUBFILE_TYPE: u16 = 254;
const SMALLER: u32 = 1;

/// Numbers of a file in its order of bytes.
struct Numbers<R> {
    file: R,
    big_endian: bool,
}

impl<R: Read + Seek> Numbers<R> {
    fn short(&mut self) -> std::io::Result<u16> {
        let mut bytes = [0; 2];
        self.file.read_exact(&mut bytes)?;
        Ok(if self.big_endian { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) })
    }

    fn long(&mut self) -> std::io::Result<u32> {
        let mut bytes = [0; 4];
        self.file.read_exact(&mut bytes)?;
        Ok(if self.big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }

    /// Where the next directory is, 0 after the last, and whether this one is of a picture of its own.
    fn directory(&mut self, at: u32) -> std::io::Result<(u32, bool)> {
        self.file.seek(SeekFrom::Start(u64::from(at)))?;
        let mut is_own = true;
        for _ in 0..self.short()? {
            let tag = self.short()?;
            self.file.seek_relative(6)?;
            let value = self.long()?;
            is_own &= tag != NEW_SUBFILE_TYPE || value & SMALLER == 0;
        }
        Ok((self.long()?, is_own))
    }
}

/// The pictures of a file; one of any that is no TIFF, or cut.
pub(super) fn pages(path: &Utf8Path) -> usize {
    let all = || -> std::io::Result<usize> {
        let mut file = BufReader::new(File::open(path)?);
        let mut kind = [0; 4];
        file.read_exact(&mut kind)?;
        let big_endian = match &kind {
            b"II*\0" => false,
            b"MM\0*" => true,
            _ => return Ok(1),
        };
        let mut numbers = Numbers { file, big_endian };
        let (mut next, mut pages) = (numbers.long()?, 0);
        for _ in 0..MOST {
            if next == 0 {
                break;
            }
            let is_own;
            (next, is_own) = numbers.directory(next)?;
            pages += usize::from(is_own);
        }
        Ok(pages)
    };
    all().map_or(1, |pages| pages.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of directories with one entry each: its tag and its value.
    fn file(entries: &[(u16, u32)]) -> Vec<u8> {
        const LENGTH: usize = 2 + 12 + 4;
        let mut bytes = b"II*\0\x08\0\0\0".to_vec();
        for (k, (tag, value)) in entries.iter().enumerate() {
            let next = if k + 1 < entries.len() { 8 + LENGTH * (k + 1) } else { 0 };
            bytes.extend([1, 0]);
            bytes.extend(tag.to_le_bytes());
            bytes.extend([4, 0, 1, 0, 0, 0]);
            bytes.extend(value.to_le_bytes());
            bytes.extend((next as u32).to_le_bytes());
        }
        bytes
    }

    #[test]
    fn pictures_of_a_series_count_and_smaller_copies_do_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = Utf8Path::from_path(folder.path()).unwrap().join("a.tif");
        let of = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            pages(&path)
        };
        assert_eq!(of(&file(&[(256, 640); 12])), 12);
        assert_eq!(of(&file(&[(254, 0), (254, 1)])), 1);
        assert_eq!(of(&file(&[(256, 640)])), 1);
        let whole = file(&[(256, 640); 3]);
        assert_eq!(of(&whole[..30]), 1);
        assert_eq!(of(b"P5 1 1 255\n\0"), 1);
    }
}
