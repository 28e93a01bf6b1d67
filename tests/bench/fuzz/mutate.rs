//! Mutations of a file: a few at a time, of bytes, of lines, and of what a format gives a meaning to.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// What readers have stumbled over, or could.
const TOKENS: &[&[u8]] = &[
    b"nan",
    b"inf",
    b"-inf",
    b"1e308",
    b"-1e308",
    b"1e-320",
    b"1e999",
    b"-0",
    b"0",
    b"-1",
    b"0.5",
    b"1e6",
    b"4294967296",
    b"18446744073709551615",
    b"18446744073709551616",
    b"-9223372036854775808",
    b"1_000",
    b"0x10",
    b"1,5",
    b",",
    b";",
    b"\t",
    b"\n",
    b"\r",
    b"\r\n",
    b"\"",
    b"'",
    b"\"\"",
    b"=1+1",
    b"\0",
    b"\xff",
    b"\xef\xbb\xbf",
    "\u{202e}".as_bytes(),
    b"[",
    b"]",
    b"{",
    b"}",
    b"[[[[[[[[",
    b":",
    b"#",
    b"center",
    b"ok",
    b"left",
    b"null",
];

/// Bytes at which lengths and signs turn over.
const EDGES: [u8; 6] = [0x00, 0x01, 0x7f, 0x80, 0xfe, 0xff];

/// No input grows beyond this; time and memory are measured on what a file of a usual size can do.
const MOST_BYTES: usize = 1 << 18;

/// A stream of mutated files.
pub struct Mutator {
    random: Pcg64Mcg,
}

impl Mutator {
    /// The stream that belongs to a seed.
    pub fn new(seed: u64) -> Mutator {
        Mutator { random: Pcg64Mcg::seed_from_u64(seed) }
    }

    fn below(&mut self, end: usize) -> usize {
        if end == 0 { 0 } else { self.random.random_range(0..end) }
    }

    /// A part of the bytes, of a length that is mostly short.
    fn part(&mut self, length: usize) -> std::ops::Range<usize> {
        let start = self.below(length);
        let most = match self.below(4) {
            0 => length,
            1 => 256,
            _ => 8,
        };
        let end = (start + 1 + self.below(most)).min(length);
        start..end.max(start)
    }

    /// One of the corpus, changed by one to eight mutations.
    pub fn next(&mut self, corpus: &[Vec<u8>]) -> Vec<u8> {
        let first = self.below(corpus.len());
        let mut bytes = corpus[first].clone();
        for _ in 0..=self.below(8) {
            self.mutate(&mut bytes, corpus);
            bytes.truncate(MOST_BYTES);
        }
        bytes
    }

    fn mutate(&mut self, bytes: &mut Vec<u8>, corpus: &[Vec<u8>]) {
        let at = self.below(bytes.len() + 1);
        match self.below(11) {
            0 if at < bytes.len() => bytes[at] ^= 1 << self.below(8),
            1 if at < bytes.len() => bytes[at] = EDGES[self.below(EDGES.len())],
            2 => bytes.truncate(at),
            3 => {
                let part = self.part(bytes.len());
                bytes.drain(part);
            }
            4 => {
                let part = self.part(bytes.len());
                let copy = bytes[part].to_vec();
                bytes.splice(at..at, copy);
            }
            5 | 6 => {
                let token = TOKENS[self.below(TOKENS.len())];
                let end = if self.below(2) == 0 { at } else { (at + token.len()).min(bytes.len()) };
                bytes.splice(at..end, token.iter().copied());
            }
            7 => {
                let other = self.below(corpus.len());
                let part = self.part(corpus[other].len());
                let copy = corpus[other][part].to_vec();
                bytes.splice(at..at, copy);
            }
            8 => self.change_number(bytes),
            9 => self.change_lines(bytes),
            _ => {
                // Four bytes in a row: the lengths in pictures' headers.
                let value = [0u32, 1, 0x7fff_ffff, 0x8000_0000, u32::MAX, 100_000][self.below(6)];
                let four = if self.below(2) == 0 { value.to_be_bytes() } else { value.to_le_bytes() };
                if let Some(place) = bytes.get_mut(at..at + 4) {
                    place.copy_from_slice(&four);
                }
            }
        }
    }

    /// Puts another number in the place of one.
    fn change_number(&mut self, bytes: &mut Vec<u8>) {
        let numeric = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+' | b'e');
        let from = self.below(bytes.len());
        let Some(start) = bytes[from..].iter().position(u8::is_ascii_digit).map(|i| from + i) else { return };
        let end = bytes[start..].iter().position(|b| !numeric(b)).map_or(bytes.len(), |i| start + i);
        let number = TOKENS[self.below(18)];
        bytes.splice(start..end, number.iter().copied());
    }

    /// Repeats, removes or exchanges lines.
    fn change_lines(&mut self, bytes: &mut Vec<u8>) {
        let mut lines: Vec<&[u8]> = bytes.split_inclusive(|b| *b == b'\n').collect();
        let (a, b) = (self.below(lines.len()), self.below(lines.len()));
        if lines.is_empty() {
            return;
        }
        match self.below(3) {
            0 => lines.swap(a, b),
            1 => {
                lines.remove(a);
            }
            _ => {
                let times = [1, 2, 50][self.below(3)];
                let line = lines[a];
                lines.splice(b..b, std::iter::repeat_n(line, times));
            }
        }
        *bytes = lines.concat();
    }
}
