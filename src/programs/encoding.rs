//! A program's bytes as text, and back.
//!
//! Controllers and editors write comments in the code page of their country. Where the bytes are no UTF-8 each is read
//! as the character of its number (Latin-1), so that any file comes back to the byte, whatever its code page:
//! instructions and numbers are ASCII in all of them.

/// What a program's text was read from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// UTF-8.
    Utf8,
    /// A character a byte.
    Bytes,
}

/// The text of these bytes. `None` for UTF-16, in which instructions are no ASCII.
pub fn decoded(bytes: Vec<u8>) -> Option<(String, Encoding)> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return None;
    }
    let latin = |e: std::string::FromUtf8Error| {
        (e.into_bytes().into_iter().map(char::from).collect::<String>(), Encoding::Bytes)
    };
    Some(String::from_utf8(bytes).map_or_else(latin, |text| (text, Encoding::Utf8)))
}

impl Encoding {
    /// The bytes of a text that was read so, with other ASCII characters in it.
    pub fn encoded(self, text: &str) -> Vec<u8> {
        match self {
            Encoding::Utf8 => text.as_bytes().to_vec(),
            Encoding::Bytes => text.chars().map(|c| u8::try_from(c).unwrap_or(b'?')).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_come_back_as_they_were() {
        let all: Vec<u8> = (0..=255).collect();
        for bytes in [all.clone(), b"plain".to_vec(), "\u{feff}\u{e9} \u{4e2d}".into(), vec![0x83, 0x7b, 0x5d, 0xe9]] {
            let (text, encoding) = decoded(bytes.clone()).unwrap();
            assert_eq!(encoding.encoded(&text), bytes);
        }
        assert_eq!(decoded(all).unwrap().1, Encoding::Bytes);
        assert_eq!(decoded(b"\xff\xfea\0".to_vec()), None);
    }
}
