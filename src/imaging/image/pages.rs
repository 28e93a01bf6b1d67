//! How many pictures a TIFF holds: the first is read, and whoever saved a series in one file has to know that.

use std::fs::File;
use std::io::BufReader;

use camino::Utf8Path;
use tiff::decoder::Decoder;
use tiff::tags::Tag;

/// More pictures than any series: a chain that leads back into itself ends here.
const MOST: usize = 10_000;

/// In the tag of what a picture is to the others, the bit of a smaller copy (TIFF 6.0, NewSubfileType).
const SMALLER: u32 = 1;

/// The pictures of a file, as far as they can be followed, but for smaller copies; at least one.
pub(super) fn pages(path: &Utf8Path) -> usize {
    let decoder = File::open(path).ok().and_then(|file| Decoder::new(BufReader::new(file)).ok());
    let Some(mut decoder) = decoder else { return 1 };
    let mut pages = 0;
    for _ in 0..MOST {
        let kind: Option<u32> = decoder.find_tag_unsigned(Tag::NewSubfileType).ok().flatten();
        pages += usize::from(kind.unwrap_or(0) & SMALLER == 0);
        if !decoder.more_images() || decoder.next_image().is_err() {
            break;
        }
    }
    pages.max(1)
}

#[cfg(test)]
mod tests {
    use tiff::encoder::{TiffEncoder, colortype::Gray8};

    use super::*;

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
