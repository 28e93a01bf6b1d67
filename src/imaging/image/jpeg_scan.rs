//! Walks through the entropy-coded data of a JPEG without making a picture of it: are there as many blocks as the
//! header announces?
//!
//! A decoder fills in what is missing and goes on after damage. But codes are of unequal length, so that a changed or
//! lost byte shifts all that follows: there is then no code, too little data, or some left over. In: a file whose first
//! segments are in order. Out: nothing, or what is wrong. Method: ITU-T T.81, annex F. Baseline and extended sequential
//! pictures with Huffman codes; a progressive one is left to its decoder.

/// Symbol and length of the code that a word of 16 bits begins with; length 0 where there is none.
type Codes = Vec<(u8, u8)>;

/// A component of the picture.
#[derive(Debug, Clone, Copy)]
struct Component {
    id: u8,
    across: usize,
    down: usize,
}

/// What segments before a scan say.
#[derive(Default)]
struct Tables {
    dc: [Option<Codes>; 4],
    ac: [Option<Codes>; 4],
    size: (usize, usize),
    components: Vec<Component>,
    restart: usize,
}

const BROKEN: &str = "a segment is broken";

/// Checks all scans; what is wrong where a scan does not hold what it must.
pub(super) fn check(bytes: &[u8]) -> Result<(), String> {
    let mut tables = Tables::default();
    let mut at = 2;
    let mut scans = 0;
    while let Some((marker, body, next)) = segment(bytes, at) {
        at = next;
        match marker {
            // Sequential pictures with Huffman codes; every other frame but tables is left to its decoder.
            0xC0 | 0xC1 => tables.frame(body).ok_or(BROKEN)?,
            0xC4 => tables.codes(body).ok_or(BROKEN)?,
            0xC2 | 0xC3 | 0xC5..=0xC7 | 0xC9..=0xCF => return Ok(()),
            0xDD => tables.restart = number(body, 0).ok_or(BROKEN)?,
            0xDA => {
                at = tables.scan(body, bytes, next)?;
                scans += 1;
            }
            0xD9 => break,
            _ => {}
        }
    }
    if scans == 0 { Err("it holds no scan".to_owned()) } else { Ok(()) }
}

impl Tables {
    fn frame(&mut self, body: &[u8]) -> Option<()> {
        self.size = (number(body, 3)?, number(body, 1)?);
        let of = |three: &[u8]| Component {
            id: three[0],
            across: usize::from(three[1] >> 4),
            down: usize::from(three[1] & 15),
        };
        self.components = body.get(6..)?.chunks_exact(3).take(usize::from(*body.get(5)?)).map(of).collect();
        self.components.iter().all(|c| (1..=4).contains(&c.across) && (1..=4).contains(&c.down)).then_some(())
    }

    fn codes(&mut self, mut body: &[u8]) -> Option<()> {
        while let Some((&kind, rest)) = body.split_first() {
            let counts = rest.get(..16)?;
            let total = counts.iter().map(|&n| usize::from(n)).sum::<usize>();
            let symbols = rest.get(16..16 + total)?;
            let table = if kind >> 4 == 0 { &mut self.dc } else { &mut self.ac };
            *table.get_mut(usize::from(kind & 15))? = Some(codes(counts, symbols)?);
            body = rest.get(16 + total..)?;
        }
        Some(())
    }

    /// Walks through a scan; where its data end.
    fn scan(&self, header: &[u8], bytes: &[u8], from: usize) -> Result<usize, String> {
        let parts = self.parts(header).ok_or(BROKEN)?;
        let most = |of: fn(&Component) -> usize| self.components.iter().map(of).max().unwrap_or(1);
        let (across, down) = (most(|c| c.across), most(|c| c.down));
        let (w, h) = self.size;
        // A scan of one component goes block by block, one of several by groups of blocks that lie together.
        let (units, blocks) = match parts.as_slice() {
            [(c, ..)] => {
                let side = |size: usize, own: usize, most: usize| (size * own).div_ceil(most).div_ceil(8);
                (side(w, c.across, across) * side(h, c.down, down), vec![1])
            }
            _ => (
                w.div_ceil(8 * across) * h.div_ceil(8 * down),
                parts.iter().map(|(c, ..)| c.across * c.down).collect::<Vec<_>>(),
            ),
        };
        let mut bits = Bits::new(bytes, from);
        for unit in 0..units {
            if self.restart > 0 && unit > 0 && unit % self.restart == 0 {
                bits.restart().ok_or_else(|| format!("a restart marker is missing after {unit} of {units} blocks"))?;
            }
            for ((_, dc, ac), &count) in parts.iter().zip(&blocks) {
                for _ in 0..count {
                    bits.block(dc, ac).ok_or_else(|| format!("its data break off at block {unit} of {units}"))?;
                }
            }
        }
        bits.end().ok_or_else(|| "there are more data than blocks".to_owned())
    }

    /// The components of a scan with their codes.
    fn parts(&self, header: &[u8]) -> Option<Vec<(Component, &Codes, &Codes)>> {
        let (&count, rest) = header.split_first()?;
        rest.chunks_exact(2)
            .take(usize::from(count))
            .map(|two| {
                let component = *self.components.iter().find(|c| c.id == two[0])?;
                let dc = self.dc.get(usize::from(two[1] >> 4))?.as_ref()?;
                Some((component, dc, self.ac.get(usize::from(two[1] & 15))?.as_ref()?))
            })
            .collect()
    }
}

/// The canonical codes with so many of each length.
fn codes(counts: &[u8], symbols: &[u8]) -> Option<Codes> {
    let mut table = vec![(0, 0); 1 << 16];
    let (mut next, mut symbols) = (0usize, symbols.iter());
    for (length, &count) in (1u8..).zip(counts) {
        let span = 1usize << (16 - length);
        for _ in 0..count {
            table.get_mut(next..next + span)?.fill((*symbols.next()?, length));
            next += span;
        }
    }
    Some(table)
}

/// The bits of a scan. A byte 0xFF stands for itself only with a zero behind it; with anything else it is a marker.
struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
    word: u64,
    held: u32,
    /// Zero bits that were put in behind the last byte.
    made_up: u32,
}

impl<'a> Bits<'a> {
    fn new(bytes: &'a [u8], at: usize) -> Bits<'a> {
        Bits { bytes, at, word: 0, held: 0, made_up: 0 }
    }

    /// Holds at least 32 bits.
    #[inline]
    fn fill(&mut self) {
        while self.held <= 32 {
            let byte = match (self.bytes.get(self.at), self.bytes.get(self.at + 1)) {
                (Some(0xFF), Some(0)) => {
                    self.at += 2;
                    0xFF
                }
                (Some(0xFF), _) | (None, _) => {
                    self.made_up += 8;
                    0
                }
                (Some(&byte), _) => {
                    self.at += 1;
                    byte
                }
            };
            self.word = self.word << 8 | u64::from(byte);
            self.held += 8;
        }
    }

    /// The next symbol.
    #[inline]
    fn symbol(&mut self, codes: &Codes) -> Option<u8> {
        self.fill();
        let (symbol, length) = codes[(self.word >> (self.held - 16)) as usize & 0xFFFF];
        self.held -= u32::from(length);
        (length > 0).then_some(symbol)
    }

    #[inline]
    fn skip(&mut self, count: u32) {
        self.fill();
        self.held -= count;
    }

    /// One block: `None` where it has no code, too many values, or too few bits.
    #[inline]
    fn block(&mut self, dc: &Codes, ac: &Codes) -> Option<()> {
        let size = self.symbol(dc)?;
        self.skip(u32::from(size & 15));
        let mut value = 1;
        while value < 64 {
            let symbol = self.symbol(ac)?;
            match (symbol >> 4, symbol & 15) {
                (15, 0) => value += 16,
                (_, 0) => break,
                (zeros, size) => {
                    value += usize::from(zeros) + 1;
                    self.skip(u32::from(size));
                }
            }
        }
        (value <= 64 && self.held >= self.made_up).then_some(())
    }

    /// Goes behind a restart marker, which must be next.
    fn restart(&mut self) -> Option<()> {
        let at = self.end()?;
        let is_restart = self.bytes.get(at) == Some(&0xFF) && matches!(self.bytes.get(at + 1), Some(0xD0..=0xD7));
        *self = Bits::new(self.bytes, at + 2);
        is_restart.then_some(())
    }

    /// Where the data end, if all but the rest of a byte was used.
    fn end(&mut self) -> Option<usize> {
        self.fill();
        // Some writers put fill bytes before a marker.
        (self.held < self.made_up + 8 && self.made_up > 0).then_some(self.at)
    }
}

/// The segment at a place: its marker, its body, and where the next one begins.
pub(super) fn segment(bytes: &[u8], mut at: usize) -> Option<(u8, &[u8], usize)> {
    // Fill bytes may stand before a marker.
    while bytes.get(at..at + 2)? == [0xFF, 0xFF] {
        at += 1;
    }
    let [0xFF, marker] = *bytes.get(at..at + 2)? else { return None };
    if marker == 0xD9 {
        return Some((marker, &[], at + 2));
    }
    let next = at + 2 + number(bytes, at + 2)?.max(2);
    Some((marker, bytes.get(at + 4..next)?, next))
}

fn number(bytes: &[u8], at: usize) -> Option<usize> {
    Some(usize::from(u16::from_be_bytes([*bytes.get(at)?, *bytes.get(at + 1)?])))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jpeg(colour: bool) -> Vec<u8> {
        let value = |x: u32, y: u32| (120.0 + 90.0 * (f64::from(x) * 0.3).sin() * (f64::from(y) * 0.17).cos()) as u8;
        let rgb = image::RgbImage::from_fn(203, 150, |x, y| image::Rgb([value(x, y), value(y, x), value(x + y, x)]));
        let mut bytes = Vec::new();
        let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 92);
        if colour {
            encoder.encode_image(&rgb).unwrap();
        } else {
            encoder.encode_image(&image::DynamicImage::ImageRgb8(rgb).to_luma8()).unwrap();
        }
        bytes
    }

    #[test]
    fn whole_files_pass() {
        assert_eq!(check(&jpeg(false)), Ok(()));
        assert_eq!(check(&jpeg(true)), Ok(()));
    }

    #[test]
    fn a_file_that_was_cut_and_given_an_end_is_noticed() {
        for bytes in [jpeg(false), jpeg(true)] {
            for percent in [40, 60, 70, 80, 90, 97] {
                let mut cut = bytes[..bytes.len() * percent / 100].to_vec();
                cut.extend([0xFF, 0xD9]);
                assert!(check(&cut).is_err(), "{percent}");
            }
        }
    }

    #[test]
    fn damage_is_noticed_nearly_always() {
        let (mut noticed, mut all) = (0, 0);
        for bytes in [jpeg(false), jpeg(true)] {
            for at in (700..bytes.len() - 80).step_by(53) {
                let mut damaged = bytes.clone();
                damaged[at..at + 24].iter_mut().enumerate().for_each(|(k, byte)| *byte = (k * 37 % 251) as u8);
                all += 1;
                noticed += usize::from(check(&damaged).is_err());
            }
        }
        // Codes fall back into step by themselves; by chance the count of blocks is then the same.
        assert!(all > 100 && 10 * noticed > 9 * all, "{noticed} of {all}");
    }

    #[test]
    fn any_bytes_come_to_an_end() {
        let bytes = jpeg(true);
        for at in (2..bytes.len()).step_by(11) {
            let mut damaged = bytes.clone();
            damaged[at] = !damaged[at];
            let _ = check(&damaged);
            let _ = check(&bytes[..at]);
        }
    }
}
