//! How far a JPEG was compressed: its blocks move corners by what they leave out.

use std::io::Read;

use camino::Utf8Path;

use super::jpeg_scan::segment;

/// The quality from which on corners are measured as in a picture without loss.
pub const ENOUGH_QUALITY: u32 = 90;

/// Sum of the steps of brightness at quality 50, as nearly all programs scale them (ITU-T T.81, table K.1).
const AT_FIFTY: f64 = 3688.0;

/// More stands before the tables of a picture only where it holds others.
const MOST_BYTES: u64 = 1 << 20;

/// The quality from 1 to 100 that the picture seems to have been saved with; `None` where it is no JPEG.
pub fn jpeg_quality(path: &Utf8Path) -> Option<u32> {
    // A pipe would be waited for.
    std::fs::metadata(path).ok().filter(std::fs::Metadata::is_file)?;
    let mut bytes = Vec::new();
    std::fs::File::open(path).ok()?.take(MOST_BYTES).read_to_end(&mut bytes).ok()?;
    of_bytes(&bytes)
}

fn of_bytes(bytes: &[u8]) -> Option<u32> {
    if bytes.get(..2)? != [0xFF, 0xD8] {
        return None;
    }
    let mut at = 2;
    loop {
        let (marker, body, next) = segment(bytes, at)?;
        match marker {
            0xDB => return of_table(body),
            0xD9 | 0xDA => return None,
            _ => at = next,
        }
    }
}

/// Of the first table, which is that of brightness.
fn of_table(body: &[u8]) -> Option<u32> {
    let (&kind, steps) = body.split_first()?;
    let sum: u32 = match kind >> 4 {
        0 => steps.get(..64)?.iter().map(|step| u32::from(*step)).sum(),
        _ => steps.get(..128)?.chunks_exact(2).map(|two| u32::from(u16::from_be_bytes([two[0], two[1]]))).sum(),
    };
    let percent = 100.0 * f64::from(sum) / AT_FIFTY;
    let quality = if percent <= 100.0 { 100.0 - 0.5 * percent } else { 5000.0 / percent };
    Some((quality.round() as u32).clamp(1, 100))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of a table, in any order, whose sum is so many per cent of that at quality 50.
    fn jpeg(percent: f64, sixteen_bits: bool) -> Vec<u8> {
        let step = percent / 100.0 * AT_FIFTY / 64.0;
        let steps = (0..64).map(|k| (step * (k + 1) as f64).round() as u16 - (step * k as f64).round() as u16);
        let table: Vec<u8> = if sixteen_bits {
            steps.flat_map(u16::to_be_bytes).collect()
        } else {
            steps.map(|step| step as u8).collect()
        };
        let kind = if sixteen_bits { 0x10 } else { 0 };
        let before = [0xFF, 0xD8, 0xFF, 0xE0, 0, 4, 1, 2, 0xFF, 0xDB, 0, (table.len() + 3) as u8, kind];
        [&before[..], &table].concat()
    }

    #[test]
    fn the_quality_of_a_jpeg_is_read_from_its_table() {
        for (percent, quality) in [(20.0, 90), (50.0, 75), (100.0, 50), (5000.0 / 30.0, 30)] {
            assert_eq!(of_bytes(&jpeg(percent, false)), Some(quality), "{percent} %");
        }
        assert_eq!(of_bytes(&jpeg(1000.0, true)), Some(5));
        assert_eq!(of_bytes(b"\x89PNG\r\n\x1a\n"), None);
        assert_eq!(of_bytes(&jpeg(100.0, false)[..40]), None);
    }
}
