//! Corners of pictures that were measured before, by what is in the picture, and thumbnails of them.
//!
//! In: the hash of a picture file's bytes, the board, and how the file is read. Out: what a former run found, to the
//! bit, if it is the same algorithm's. The name of an entry is a hash of all that the result depends on, so a changed
//! picture, board or program makes a new entry; its first line is a hash of the rest, so a changed entry is none. An
//! entry that can't be read is as good as none, and one that can't be written costs only time.

use nalgebra::{Matrix2, Point2};
use xxhash_rust::xxh3::{Xxh3Default, xxh3_128};

use crate::files::OutDir;
use crate::imaging::board::{Layout, Print};
use crate::imaging::detect::{Open, Refusal};
use crate::imaging::image::Grey8;
use crate::imaging::image::pyramid::{Level, Small};
use crate::imaging::lattice::{Lattice, Renumbering};
use crate::imaging::{Board, Corner, Mosaic};

/// Names the algorithm by what it finds: a hash of the corners of the golden pictures below. A change that moves a
/// corner fails the test `the_algorithm_is_named_by_what_it_finds`, which says the new name.
const ALGORITHM: &str = "corners 11295a7d0564b1ba";

/// A board in a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Sighting {
    pub corners: Lattice<Corner>,
    /// How its markers are printed, where it has any.
    pub print: Option<Print>,
    /// What else the numbers of its corners could be, where that is open.
    pub open: Option<Open>,
}

/// What was found in a picture, or why nothing.
pub type Look = Result<Sighting, Refusal>;

/// A place for what was found.
#[derive(Debug, Clone, Copy)]
pub struct Cache<'a> {
    pub out: &'a OutDir,
    /// Whether small copies of the pictures are kept as well, for a page.
    pub thumbnails: bool,
}

impl Cache<'_> {
    /// What a former run found.
    pub fn read(&self, entry: &str, board: Board) -> Option<Look> {
        parse(&std::fs::read_to_string(self.out.join(&corners_file(entry))).ok()?, board)
    }

    /// Keeps what was found.
    pub fn write(&self, entry: &str, look: &Look) {
        // Without the entry the next run is slower, nothing else.
        let _ = self.out.write_scratch(&corners_file(entry), text(look).as_bytes());
    }

    /// The thumbnail of a picture that was looked at before.
    pub fn read_thumbnail(&self, entry: &str) -> Option<Small> {
        parse_thumbnail(&std::fs::read(self.out.join(&thumbnail_file(entry))).ok()?)
    }

    /// Keeps a thumbnail.
    pub fn write_thumbnail(&self, entry: &str, thumbnail: &Small) {
        let Small { copy, level } = thumbnail;
        let mut bytes =
            format!("P5\n# reduced by {}\n{} {}\n255\n", level.scale(), copy.width, copy.height).into_bytes();
        bytes.extend_from_slice(&copy.pixels);
        let _ = self.out.write_scratch(&thumbnail_file(entry), &bytes);
    }
}

/// The entry of a picture file with this hash.
pub fn entry(picture_hash: &str, board: Board, mosaic: Option<Mosaic>) -> String {
    let mut hash = Xxh3Default::new();
    for part in [ALGORITHM, &board.key(), mosaic.map_or("grey", Mosaic::name), picture_hash] {
        hash.update(part.as_bytes());
    }
    format!("{:032x}", hash.digest128())
}

fn corners_file(entry: &str) -> String {
    format!("cache/{entry}.txt")
}

/// Among the program's own files, for it is no result.
fn thumbnail_file(entry: &str) -> String {
    format!(".stereocal/thumbnails/{entry}.pgm")
}

/// From a portable grey map whose comment says by how much it was reduced.
fn parse_thumbnail(bytes: &[u8]) -> Option<Small> {
    let mut lines = bytes.splitn(5, |b| *b == b'\n');
    let mut line = || lines.next();
    let text = |line: Option<&[u8]>| std::str::from_utf8(line?).ok().map(str::to_owned);
    let (magic, factor, size, top) = (text(line())?, text(line())?, text(line())?, text(line())?);
    let pixels = line()?.to_vec();
    let factor: usize = factor.strip_prefix("# reduced by ")?.parse().ok()?;
    let (width, height) = size.split_once(' ')?;
    let (width, height): (usize, usize) = (width.parse().ok()?, height.parse().ok()?);
    let whole = magic == "P5" && top == "255" && factor > 0 && width.checked_mul(height) == Some(pixels.len());
    whole.then_some(Small { copy: Grey8 { width, height, pixels }, level: Level::Reduced(factor) })
}

/// A corner: column, row, place, covariance, blur, reach, and whether it is used.
type Kept = (usize, usize, [f64; 2], Option<[f64; 3]>, Option<f64>, Option<[f64; 2]>, bool);

/// The board that a picture shows instead, and why that is no use.
type Refused = (Option<String>, String);

/// What an entry holds of a sighting: the corners; of the markers their share of a square, whether they are in the old
/// layout, or in OpenCV's of tags, and whether they are inverted; and the numbers that are open.
type Seen = (Vec<Kept>, Option<(f64, bool, bool)>, Option<(Vec<Renumbering>, Refused)>);

/// The entry: a checksum of the rest, the algorithm, and what it found.
fn text(look: &Look) -> String {
    let refused = |Refusal { reason, seen }: &Refusal| (seen.map(|board| board.to_string()), reason.clone());
    let look = look.as_ref().map_err(refused).map(|Sighting { corners, print, open }| {
        let kept = |(_, _, c): (usize, usize, &Corner)| -> Kept {
            let covariance = c.covariance_px2.map(|s| [s[(0, 0)], s[(0, 1)], s[(1, 1)]]);
            (c.col, c.row, [c.px.x, c.px.y], covariance, c.blur_px, c.reach, c.used)
        };
        let print =
            print.map(|print| (print.share, matches!(print.layout, Layout::Old | Layout::Grid), print.inverted));
        let open = open.as_ref().map(|open| (open.others.clone(), refused(&open.refusal)));
        (corners.iter().map(kept).collect::<Vec<Kept>>(), print, open)
    });
    let body = format!("{ALGORITHM}\n{}\n", serde_json::to_string(&look).unwrap_or_default());
    format!("{:032x}\n{body}", xxh3_128(body.as_bytes()))
}

fn parse(text: &str, board: Board) -> Option<Look> {
    let (checksum, body) = text.split_once('\n')?;
    if checksum != format!("{:032x}", xxh3_128(body.as_bytes())) {
        return None;
    }
    let look: Result<Seen, Refused> = serde_json::from_str(body.strip_prefix(ALGORITHM)?).ok()?;
    let refusal = |(seen, reason): Refused| Some(Refusal { reason, seen: parse_seen(seen, board)? });
    let (kept, print, open) = match look {
        Ok(seen) => seen,
        Err(refused) => return Some(Err(refusal(refused)?)),
    };
    let mut corners: Lattice<Corner> = Lattice::from_fn(board.columns(), board.rows(), |_, _| None);
    for (col, row, [x, y], covariance, blur_px, reach, used) in kept {
        if col >= board.columns() || row >= board.rows() {
            return None;
        }
        let covariance_px2 = covariance.map(|[xx, xy, yy]| Matrix2::new(xx, xy, xy, yy));
        let corner = Corner { col, row, px: Point2::new(x, y), covariance_px2, blur_px, reach, used };
        *corners.cells.get_mut(row * board.columns() + col)? = Some(corner);
    }
    let print = print.map(|(share, is_old, inverted)| {
        let layout = match board.layouts()[..] {
            [only] if !is_old => only,
            [only] if only.is_of_tags() => Layout::Grid,
            _ if is_old => Layout::Old,
            _ => Layout::New,
        };
        Print { share, pitch: board.pitch(), layout, inverted }
    });
    let open = match open {
        Some((others, refused)) => Some(Open { others, refusal: refusal(refused)? }),
        None => None,
    };
    Some(Ok(Sighting { corners, print, open }))
}

/// The other board that a picture shows. An entry is for boards of all lengths of one ratio: they are those of the
/// board that is looked for.
fn parse_seen(seen: Option<String>, board: Board) -> Option<Option<Board>> {
    let Some(seen) = seen else { return Some(None) };
    let seen: Board = seen.parse().ok()?;
    let same = Board { squares: seen.squares, kind: seen.kind, ..board };
    let Some(mm) = seen.marked_mm() else { return Some(Some(same)) };
    let scaled_mm = mm * board.square_mm / seen.square_mm;
    // To the bit, where it is not another size that was seen.
    let is_own = |own_mm: &f64| (own_mm - scaled_mm).abs() < 1e-9 * scaled_mm;
    Some(Some(same.with_marked_mm(board.marked_mm().filter(is_own).unwrap_or(scaled_mm))?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::board::Pitch;
    use crate::imaging::image::{Image, Picture};
    use crate::imaging::shot::Shot;
    use crate::imaging::{detect, refine};

    fn board() -> Board {
        Board::checker("4x3".parse().unwrap(), 10.0)
    }

    #[test]
    fn entries_read_back_exactly_and_broken_ones_not_at_all() {
        let corners = Lattice::from_fn(3, 2, |col, row| {
            let covariance_px2 = (col > 0).then(|| Matrix2::new(1.0 / 3e5, 1e-8, 1e-8, 2e-6));
            let px = Point2::new(1.0 / 3.0 + col as f64, row as f64);
            let blur_px = (col > 0).then_some(1.0 / 3.0);
            let reach = (col > 0).then_some([0.1, 2.0 / 3.0]);
            (row + col < 3).then_some(Corner { col, row, px, covariance_px2, blur_px, reach, used: col > 0 })
        });
        let print = Some(Print { share: 0.7, pitch: Pitch::Even, layout: Layout::Old, inverted: true });
        let coded: Look = Ok(Sighting { corners: corners.clone(), print, open: None });
        assert_eq!(parse(&text(&coded), board()), Some(coded));
        for (others, seen) in
            [(vec![(0, 1, 0), (3, -2, 4)], None), (Vec::new(), Some("checker:4x4:10".parse().unwrap()))]
        {
            let renumbering = |(quarters, columns, rows)| Renumbering { quarters, columns, rows };
            let refusal = Refusal { reason: "shows 5 corners; which they are".to_owned(), seen };
            let open = Some(Open { others: others.into_iter().map(renumbering).collect(), refusal });
            let look: Look = Ok(Sighting { corners: corners.clone(), print: None, open });
            assert_eq!(parse(&text(&look), board()), Some(look));
        }
        let look: Look = Ok(Sighting { corners, print: None, open: None });
        let written = text(&look);
        assert_eq!(parse(&written, board()), Some(look));
        for cut in 0..written.len() {
            assert_eq!(parse(&written[..cut], board()), None);
        }
        assert_eq!(parse(&written.replace("[1,0,[1.3", "[1,0,[1.4"), board()), None);
        for seen in [None, Some("checker:10x7:10".parse().unwrap())] {
            let none: Look = Err(Refusal { reason: "no board found".to_owned(), seen });
            assert_eq!(parse(&text(&none), board()), Some(none));
        }
        let boards = |names: [&str; 2]| names.map(|name| name.parse::<Board>().unwrap());
        let refusal = |board| Err(Refusal { reason: "another".to_owned(), seen: Some(board) });
        let [seen, asked] = boards(["charuco:5x4:54:40.5:DICT_5X5_50:old", "charuco:4x5:54:40.5:DICT_4X4_100"]);
        let entry = text(&refusal(seen));
        assert_eq!(parse(&entry, asked), Some(refusal(seen)));
        let [seen, asked] = boards(["charuco:5x4:60:45:DICT_5X5_50:old", "charuco:4x5:60:45:DICT_4X4_100"]);
        assert_eq!(parse(&entry, asked), Some(refusal(seen)));
        // Markers of another size than was asked for are those that were seen.
        let [seen, asked] = boards(["charuco:4x5:54:27:DICT_4X4_100", "charuco:4x5:60:45:DICT_4X4_100"]);
        let scaled = boards(["charuco:4x5:60:30:DICT_4X4_100"; 2])[0];
        assert_eq!(parse(&text(&refusal(seen)), asked), Some(refusal(scaled)));
    }

    #[test]
    fn thumbnails_read_back_and_broken_ones_not_at_all() {
        let (_keep, path) = crate::files::temporary_folder();
        let out = OutDir::open(&path).unwrap();
        let cache = Cache { out: &out, thumbnails: true };
        let copy = Grey8 { width: 4, height: 3, pixels: b"\n\n12 4\nP5\xff\0\n".to_vec() };
        let small = Small { copy, level: Level::Reduced(15) };
        assert_eq!(cache.read_thumbnail("a"), None);
        cache.write_thumbnail("a", &small);
        assert_eq!(cache.read_thumbnail("a"), Some(small));
        let bytes = std::fs::read(out.join(".stereocal/thumbnails/a.pgm")).unwrap();
        assert!((0..bytes.len()).all(|cut| parse_thumbnail(&bytes[..cut]).is_none()));
    }

    #[test]
    fn the_entry_follows_picture_and_board() {
        let other = Board::checker("5x3".parse().unwrap(), 10.0);
        let first = entry("a", board(), None);
        assert_eq!(first, entry("a", board(), None));
        for other in [entry("b", board(), None), entry("a", other, None), entry("a", board(), Some(Mosaic::Rggb))] {
            assert_ne!(first, other);
        }
    }

    /// A board of 9x7 squares of `side` px in perspective, a part of it hidden, with a little noise; `top` is white.
    fn golden_picture(size: usize, side: f64, top: f64, zigzag: f64) -> Vec<f64> {
        const FINE: usize = 3;
        let light = |x: f64, y: f64| {
            let (x, y) = (x - 0.12 * size as f64, y - 0.1 * size as f64);
            let depth = 1.0 + (0.1 * x - 0.07 * y) / size as f64;
            let (u, v) = ((0.97 * x + 0.21 * y) / (depth * side), (0.98 * y - 0.17 * x) / (depth * side) - 0.1);
            // Lines that bend at every crossing, as a board's do whose crossings are off their places.
            let u = u + zigzag * (v.rem_euclid(2.0) - 1.0).abs();
            if (4.4..5.2).contains(&u) && (2.3..3.4).contains(&v) {
                return 0.4;
            }
            let inside = (0.0..9.0).contains(&u) && (0.0..7.0).contains(&v);
            if inside && (u.floor() + v.floor()) as i64 % 2 == 0 { 0.12 } else { 0.8 }
        };
        let mut state = 7u64;
        (0..size * size)
            .map(|k| {
                let (x, y) = ((k % size) as f64, (k / size) as f64);
                let at = |i: usize| (i as f64 + 0.5) / FINE as f64 - 0.5;
                let sum: f64 = (0..FINE * FINE).map(|i| light(x + at(i % FINE), y + at(i / FINE))).sum();
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let noise = (state >> 40) as f64 / f64::from(1u32 << 24) - 0.5;
                (top * (sum / (FINE * FINE) as f64 + 0.02 * noise)).round()
            })
            .collect()
    }

    /// A picture in red light that clips one of its colours, with lines of some colours drawn into it.
    fn coloured(drawn: &[[u8; 3]]) -> Result<Picture, String> {
        let grey = golden_picture(640, 52.0, 255.0, 0.0);
        let colours = grey.into_iter().flat_map(|v| [1.4, 1.0, 0.8].map(|share| (share * v).min(255.0) as u8));
        let mut rgb = image::RgbImage::from_raw(640, 640, colours.collect()).unwrap();
        for (row, colour) in drawn.iter().enumerate() {
            (100..500).for_each(|x| rgb.put_pixel(x, 100 + 50 * row as u32, image::Rgb(*colour)));
        }
        let mut bytes = std::io::Cursor::new(Vec::new());
        rgb.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        crate::imaging::image::decode(bytes.get_ref(), "coloured.png".into(), None)
    }

    #[test]
    fn the_algorithm_is_named_by_what_it_finds() {
        let board = Board::checker("9x7".parse().unwrap(), 10.0);
        let eight = |size: usize, side: f64, zigzag: f64| {
            let pixels = golden_picture(size, side, 255.0, zigzag);
            Picture::from(Image::from_fn(size, size, |x, y| pixels[y * size + x] as u8))
        };
        let sixteen = golden_picture(600, 50.0, 4000.0, 0.0);
        let sixteen = Picture::from(Image::from_fn(600, 600, |x, y| sixteen[y * 600 + x] as u16));
        let mut hash = Xxh3Default::new();
        let eights = [(640, 52.0, 0.0), (2048, 170.0, 0.0), (2048, 170.0, 0.01), (2600, 12.0, 0.0)];
        let eights = eights.map(|(size, side, zigzag)| eight(size, side, zigzag));
        // What is clipped, and what glares on one side, as damaged pictures do.
        let pixels = golden_picture(640, 52.0, 255.0, 0.0);
        let damaged = |change: &dyn Fn(usize, f64) -> f64| {
            Picture::from(Image::from_fn(640, 640, |x, y| change(x, pixels[y * 640 + x]).min(255.0) as u8))
        };
        let clipped = damaged(&|_, v| v.min(170.0));
        let glary = damaged(&|x, v| v + 60.0 * (x as f64 / 400.0).powi(2));
        // And what the border cuts, on one side and on two.
        let cut = |left: usize, top: usize| {
            let pixel = |x: usize, y: usize| pixels[(y + top) * 640 + x + left] as u8;
            Picture::from(Image::from_fn(640 - left, 640 - top, pixel))
        };
        // Boards with markers: whole, foreshortened, and seen in part.
        let (squares, tags) = ("charuco:9x7:20:15:DICT_4X4_100", "apriltag:5x4:tag36h11:30:9");
        let coded = [
            (squares, [0.3, -0.25, 0.2], 0.0, 560.0),
            (squares, [1.2, 0.07, 0.1], 0.0, 300.0),
            (squares, [0.3, -0.25, 0.2], 60.0, 300.0),
            (tags, [0.9, 0.07, 0.1], 0.0, 420.0),
        ];
        let coded = coded.map(|(name, turn, aside, away)| {
            (Shot::of(name, turn, [aside, 0.0, away]).taken().0, name.parse().unwrap())
        });
        // Full size, reduced by two, the same with bent edges, squares that are seen on a finer copy only, 16 bits, and
        // what is above, in colours of which one is clipped.
        let plain =
            eights.into_iter().chain([sixteen, clipped, glary, cut(160, 0), cut(160, 140), coloured(&[]).unwrap()]);
        for (picture, board) in plain.map(|picture| (picture, board)).chain(coded) {
            let detected = detect::detect(&picture, board).unwrap();
            hash.update(&detected.open.as_ref().map_or(0, |open| open.others.len() + 1).to_le_bytes());
            for (col, row, c) in refine::refine(&picture, &detected).iter() {
                let s =
                    c.covariance_px2.map_or([0.0; 3], |s| [s[(0, 0)], s[(0, 1)], s[(1, 1)]].map(|v| v.abs().sqrt()));
                // Coarser than what another computer's sine may change, finer than what matters.
                for value in [col as f64, row as f64, c.px.x, c.px.y, s[0], s[1], s[2], f64::from(u8::from(c.used))] {
                    hash.update(&((value * 1e8).round() as i64).to_le_bytes());
                }
            }
        }
        // And what is not looked at.
        let drawn = coloured(&[[255, 0, 0], [255, 128, 0], [200, 200, 0]]).unwrap_err();
        hash.update(drawn.as_bytes());
        let name = format!("corners {:016x}", hash.digest());
        assert_eq!(
            ALGORITHM, name,
            "corners have changed: name the algorithm so, and former entries of the cache are not used"
        );
    }
}
