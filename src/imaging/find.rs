//! The stages of imaging in their order: folder, pairs, pictures, boards, corners, agreement.
//!
//! Pictures are worked on in parallel, each worker holds one. What can't be used is kept with its reason; the run fails
//! when fewer pairs remain than the caller needs.

use std::collections::BTreeMap;

use camino::Utf8Path;
use nalgebra::Matrix2;
use rayon::prelude::*;

use super::board::{Kind, Layout};
use super::coded;
use super::coded::measures::with_seen_spread;
use super::detect::count::{Seen, squares_of};
use super::detect::{self, Detected, Refusal, continuation};
use super::image::pyramid::Small;
use super::image::{self, Claim, Header, Mosaic, Picture};
use super::input::cache::{self, Cache, Look, Sighting};
use super::input::pairs::{PairFiles, Pairing};
use super::lattice::Lattice;
use super::refine::fields;
use super::shown::{missing_tags, printed, unseen_lines};
use super::sort::{Sorted, in_one_layout, number_alike, other_board, shown_instead, sort_out, with_common_sizes};
use super::{Board, Corner, Corners, Error, PairCorners, Result, Side, Skipped, Squares, overlay, refine};
use crate::diagnostic::count;
use crate::files::OutDir;
use crate::files::provenance::picture_hash;
use crate::progress;

/// What is looked for.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    pub board: Board,
    /// The least number of pairs that is of use.
    pub needed: usize,
    /// The pattern of pictures that are raw colour mosaics.
    pub mosaic: Option<Mosaic>,
    /// Where corners of pictures that were measured before are kept.
    pub cache: Option<Cache<'a>>,
    /// Where an overlay picture of each pair goes.
    pub overlays: Option<&'a OutDir>,
}

/// Finds the board's corners in all pairs, numbered alike in left and right.
///
/// An error where fewer than needed show the board.
pub fn find_corners(pairing: &Pairing, wanted: &Wanted<'_>) -> Result<Corners> {
    let mut notes: Vec<String> = pairing.left_out().into_iter().collect();
    let headers: Vec<[Announced; 2]> =
        pairing.pairs.par_iter().map(|files| [&files.left, &files.right].map(|path| image::header(path))).collect();
    of_pages(&pairing.pairs, &headers).iter().for_each(progress::note);
    let sizes = majority_sizes(&headers);
    let folder = Folder { files: &pairing.pairs, headers: &headers, sizes };
    let total = pairing.pairs.len();
    let [first, rest] = first_pairs(total);
    // The others are not looked at where the first show another board.
    let bar = progress::bar("looking for the board", 2 * first.len() as u64);
    let look_at = |indices: &[usize]| with_common_sizes(folder.look_at_pairs(indices, (wanted, &bar)), &wanted.board);
    let too_few = |found: usize, (skipped, searched): (Vec<Skipped>, usize), other: Option<Board>| Error::TooFewPairs {
        found,
        total: searched,
        not_searched: total - searched,
        needed: wanted.needed,
        board: Box::new(wanted.board),
        path: pairing.place.clone(),
        skipped,
        other: other.map(Box::new),
    };
    let mut seen: Vec<(usize, [Look; 2])> = first.iter().copied().zip(look_at(&first)).collect();
    if let Some(other) = shown_instead(seen.iter().map(|(_, looks)| looks)).filter(|_| !rest.is_empty()) {
        bar.finish_and_clear();
        let files: Vec<PairFiles> = first.iter().map(|&i| pairing.pairs[i].clone()).collect();
        let skipped = sort_out(&files, seen.into_iter().map(|(_, looks)| looks).collect(), wanted.board).skipped;
        return Err(too_few(0, (skipped, first.len()), Some(other)));
    }
    bar.lengthen(2 * rest.len() as u64);
    seen.extend(rest.iter().copied().zip(look_at(&rest)));
    seen.sort_by_key(|&(i, _)| i);
    bar.finish_and_clear();
    let seen = seen.into_iter().map(|(_, looks)| looks).collect();
    let seen = with_common_sizes(folder.in_common_layout(seen, wanted), &wanted.board);
    let (board, seen) = in_one_layout(wanted.board, seen);
    let other = other_board(&seen);
    printed(&wanted.board, &seen).iter().for_each(progress::note);
    let Sorted { found, skipped, blind, open } = sort_out(&pairing.pairs, seen, board);
    if found.len() < wanted.needed {
        notes.iter().for_each(progress::note);
        return Err(too_few(found.len(), (skipped, total), other));
    }
    let pairs = number_alike(found, board);
    if let Some(out) = wanted.overlays {
        draw(&pairs, &pairing.pairs, wanted.mosaic, out)?;
    }
    if !skipped.is_empty() {
        notes.push(format!("the board was found in {} of {total} pairs", pairs.len()));
    }
    unseen_lines(&wanted.board, &pairs).iter().for_each(progress::warn);
    missing_tags(&board, &pairs).iter().for_each(progress::warn);
    let [left_size, right_size] = sizes;
    notes.extend(sizes_differ(sizes));
    let board = with_seen_spread(board, &pairs);
    Ok(Corners { board, left_size, right_size, pairs, skipped, blind, open, notes })
}

/// That the two cameras' pictures are not of one size.
fn sizes_differ([left, right]: [(u32, u32); 2]) -> Option<String> {
    (left != right && left.0 > 0 && right.0 > 0).then(|| {
        format!(
            "the left pictures are {}x{} px, the right ones {}x{} px: of two cameras of one kind those of one side were resized or cut",
            left.0, left.1, right.0, right.1
        )
    })
}

/// That files hold pictures beside the first, which are not read.
fn of_pages(files: &[PairFiles], headers: &[[Announced; 2]]) -> Option<String> {
    let all = files.iter().zip(headers).flat_map(|(files, of)| [(&files.left, &of[0]), (&files.right, &of[1])]);
    let of_several = all.filter_map(|(path, header)| Some((path, header.as_ref().ok()?.pages)));
    let several: Vec<_> = of_several.filter(|(_, pages)| *pages > 1).collect();
    let (path, pages) = several.first()?;
    Some(format!(
        "{} {} more than one picture, {path} {pages}: only the first of each is read; save a file a picture",
        count(several.len(), "file"),
        if several.len() == 1 { "holds" } else { "hold" }
    ))
}

/// The pairs that are looked at before all others, spread over them all, and the others.
fn first_pairs(total: usize) -> [Vec<usize>; 2] {
    /// So many that agree on another board leave no doubt of the rest.
    const FIRST: usize = 6;
    let first: Vec<usize> = (0..FIRST.min(total)).map(|i| i * total / FIRST.min(total)).collect();
    let rest = (0..total).filter(|i| !first.contains(i)).collect();
    [first, rest]
}

/// What a file's header says, or why it says nothing.
type Announced = Result<Header, String>;

/// The pairs of a folder with what their files announce, and the sizes of most left and most right pictures.
struct Folder<'a> {
    files: &'a [PairFiles],
    headers: &'a [[Announced; 2]],
    sizes: [(u32, u32); 2],
}

impl Folder<'_> {
    /// The pictures of some pairs from file to corners.
    fn look_at_pairs(&self, pairs: &[usize], how: (&Wanted<'_>, &progress::Step)) -> Vec<[Look; 2]> {
        let look = |side: Side, pair: usize| self.look(pair, side, how);
        let both = |&pair| <[Look; 2]>::from(rayon::join(|| look(Side::Left, pair), || look(Side::Right, pair)));
        pairs.par_iter().map(both).collect()
    }

    /// Of a board whose layout the pictures tell, those that did not tell it are looked at once more.
    fn in_common_layout(&self, seen: Vec<[Look; 2]>, wanted: &Wanted<'_>) -> Vec<[Look; 2]> {
        let Some(layout) = common_layout(&seen) else { return seen };
        let is_open = |look: &Look| look.as_ref().is_err_and(|refusal| refusal.reason == coded::BY_LAYOUT);
        let bar = progress::bar("looking once more", seen.iter().flatten().filter(|look| is_open(look)).count() as u64);
        let wanted = Wanted { board: wanted.board.with_layout(layout), ..*wanted };
        let again = |(pair, mut sides): (usize, [Look; 2])| {
            for (side, look) in Side::BOTH.into_iter().zip(&mut sides).filter(|(_, look)| is_open(look)) {
                *look = self.look(pair, side, (&wanted, &bar));
            }
            sides
        };
        seen.into_par_iter().enumerate().map(again).collect()
    }

    /// One picture from file to corners; the reason where that fails.
    fn look(&self, pair: usize, side: Side, (wanted, bar): (&Wanted<'_>, &progress::Step)) -> Look {
        bar.inc(1);
        let [size, other] = [side, side.other()].map(|side| self.sizes[side as usize]);
        let header = self.headers[pair][side as usize].as_ref().map_err(String::clone)?;
        // Depends on the other pictures, so it is not a matter for the cache.
        let found = (header.width, header.height);
        if found != size {
            let why = match found {
                _ if found == other => ", and those of the other side have its size: are left and right exchanged?",
                _ if found == (size.1, size.0) => ": is it turned by 90 degrees?",
                _ => "",
            };
            return Err(format!("{}x{} px, most others are {}x{}{why}", found.0, found.1, size.0, size.1).into());
        }
        let PairFiles { left, right, .. } = &self.files[pair];
        read_and_look(if side == Side::Left { left } else { right }, header, wanted)
    }
}

/// The board's corners in one pair, numbered alike in left and right as far as its colours tell; the reason where there
/// are none, and the board that both pictures show instead.
pub fn find_pair(files: &PairFiles, wanted: &Wanted<'_>) -> Result<PairCorners, Refusal> {
    let alone = |path: &Utf8Path| read_and_look(path, &image::header(path)?, wanted);
    let looks = <[Look; 2]>::from(rayon::join(|| alone(&files.left), || alone(&files.right)));
    let seen = other_board(std::slice::from_ref(&looks));
    let Sorted { found, skipped, .. } = sort_out(std::slice::from_ref(files), vec![looks], wanted.board);
    let refusal = || {
        let reason = skipped.into_iter().next().map_or_else(|| "no board".to_owned(), |s| s.reason);
        Refusal { reason, seen }
    };
    number_alike(found, wanted.board).into_iter().next().ok_or_else(refusal)
}

/// What is in a picture file, from the cache where it was looked at before.
fn read_and_look(path: &Utf8Path, header: &Header, wanted: &Wanted<'_>) -> Look {
    let _claim = Claim::wait(header);
    let bytes = image::read(path, header)?;
    let Some(cache) = wanted.cache else { return look_at(bytes, path, wanted).0 };
    let hash = picture_hash(&bytes);
    cache.out.picture_read(path, &hash);
    let entry = cache::entry(&hash, wanted.board, wanted.mosaic);
    cache.read(&entry, wanted.board).unwrap_or_else(|| {
        let (look, thumbnail) = look_at(bytes, path, wanted);
        if let Some(thumbnail) = thumbnail {
            cache.write_thumbnail(&entry, &thumbnail);
        }
        cache.write(&entry, &look);
        look
    })
}

/// The thumbnail of a picture that was looked at in this run: from the cache, or from the file where it is not there.
pub fn thumbnail(path: &Utf8Path, wanted: &Wanted<'_>) -> Option<Small> {
    let known = wanted.cache.and_then(|cache| {
        let hash = cache.out.hash_of_picture(path)?;
        cache.read_thumbnail(&cache::entry(&hash, wanted.board, wanted.mosaic))
    });
    known.or_else(|| Some(thumbnail_of(&image::picture(path, wanted.mosaic).ok()?, None)))
}

/// What is in a picture file, and its thumbnail where the cache keeps it and the board was found.
fn look_at(bytes: Vec<u8>, path: &Utf8Path, wanted: &Wanted<'_>) -> (Look, Option<Small>) {
    let picture = match image::decode(&bytes, path, wanted.mosaic) {
        Ok(picture) => picture,
        Err(reason) => return (Err(reason.into()), None),
    };
    drop(bytes);
    match detected(&picture, wanted.board) {
        Ok(detected) => {
            let is_kept = wanted.cache.is_some_and(|cache| cache.thumbnails);
            let thumbnail = is_kept.then(|| thumbnail_of(&picture, Some(&detected)));
            (corners_of(&picture, &detected, wanted.board), thumbnail)
        }
        Err(refusal) => (Err(refusal), None),
    }
}

/// The thumbnail of a picture, whether or not the board was found on the copy that it is made of.
fn thumbnail_of(picture: &Picture, detected: Option<&Detected>) -> Small {
    let level = detect::glance_level(picture);
    match detected.filter(|detected| detected.level == level) {
        Some(detected) => Small::thumbnail(&detected.copy, level),
        None => Small::thumbnail(&level.copy(picture), level),
    }
}

/// The board's corners in a picture; the reason where there are none.
pub fn corners_in(picture: &Picture, board: Board) -> Result<Lattice<Corner>, Refusal> {
    let seen = seen_in(picture, board)?;
    seen.open.map_or(Ok(seen.corners), |open| Err(open.refusal))
}

/// The board's corners in a picture, whose numbers may be open; the reason where there are none.
pub fn seen_in(picture: &Picture, board: Board) -> Look {
    corners_of(picture, &detected(picture, board)?, board)
}

/// The board in a picture; where markers were looked for and none was read, the plain board that it shows, if it shows
/// a whole one.
fn detected(picture: &Picture, board: Board) -> Result<Detected, Refusal> {
    let counted = |refusal: Refusal| {
        let is_unread = board.is_coded() && coded::is_unread(&refusal);
        let Some(Seen { squares, ends: true }) = is_unread.then(|| squares_of(picture)).flatten() else {
            return refusal;
        };
        let reason = format!("shows a board of {squares} squares, and no marker in it that can be read");
        // Of as many squares as the board has it may be the board, in a poor picture.
        let counts = |squares: Squares| [squares.columns.min(squares.rows), squares.columns.max(squares.rows)];
        let is_other = counts(squares) != counts(board.squares);
        Refusal { reason, seen: is_other.then_some(Board { squares, kind: Kind::Checker, ..board }) }
    };
    detect::detect(picture, board).map_err(counted)
}

/// The corners of a board that was found.
fn corners_of(picture: &Picture, detected: &Detected, board: Board) -> Look {
    let places = detected.corners.map(|p| detected.level.to_picture(p));
    let shift_px = fields::shift_between_fields(picture, &places).unwrap_or(0.0);
    if shift_px > fields::ONE_PICTURE_PX {
        return Err(format!(
            "is interlaced: its even and odd rows were taken at two moments, the board moved by {shift_px:.1} px or more between them"
        )
        .into());
    }
    // Markers say which corners are the board's.
    let (columns, rows) = if board.is_coded() { (0, 0) } else { continuation::lines_beyond(detected) };
    if columns + rows > 0 {
        let squares = board.squares;
        return Err(Refusal {
            reason: format!(
                "shows a board larger than {squares} squares: its corners go on beyond those (at least {}x{} squares)",
                squares.columns + columns,
                squares.rows + rows
            ),
            seen: detect::size_seen(detected)
                .filter(|seen| *seen != squares)
                .map(|seen| Board { squares: seen, ..board }),
        });
    }
    let is_grid = detected.print.is_some_and(|print| print.layout == Layout::Grid);
    let board = if is_grid { board.with_layout(Layout::Grid) } else { board };
    let mut corners = refine::refine(picture, detected);
    let measured = corners.filter_map(|_, _, corner| corner.used.then_some(corner.px));
    if let Some(refusal) = coded::measures::other_gaps(&board, &measured) {
        return Err(refusal);
    }
    if let Some(open) = detected.open.as_ref().filter(|_| !is_measured(&corners)) {
        return Err(open.refusal.clone());
    }
    if shift_px > 0.0 {
        for covariance_px2 in corners.cells.iter_mut().flatten().filter_map(|corner| corner.covariance_px2.as_mut()) {
            *covariance_px2 += Matrix2::identity() * (shift_px / 2.0).powi(2);
        }
    }
    Ok(Sighting { corners, print: detected.print, open: detected.open.clone() })
}

/// True where a grid is more than noise makes of nothing: most of its corners are measured, and far better than a
/// square is long.
fn is_measured(corners: &Lattice<Corner>) -> bool {
    /// Largest standard deviation, as a share of a square's side.
    const WELL: f64 = 0.05;
    let step_px = corners.map(|corner| corner.px).step_px().unwrap_or(0.0);
    let is_well = |corner: &Corner| {
        let variance_px2 = corner.covariance_px2.map_or(f64::INFINITY, |covariance| covariance.trace());
        corner.used && variance_px2 < (WELL * step_px).powi(2)
    };
    let measured = corners.iter().filter(|(_, _, corner)| is_well(corner)).count();
    measured >= detect::LEAST_SEEN && 2 * measured > corners.count()
}

/// Which squares hold the markers in all pictures that tell it; `None` where they contradict each other, or none tells.
fn common_layout(seen: &[[Look; 2]]) -> Option<Layout> {
    let mut layouts = seen.iter().flatten().filter_map(|look| Some(look.as_ref().ok()?.print?.layout));
    let first = layouts.next()?;
    layouts.all(|layout| layout == first).then_some(first)
}

fn draw(pairs: &[PairCorners], files: &[PairFiles], mosaic: Option<Mosaic>, out: &OutDir) -> Result<()> {
    let bar = progress::bar("drawing overlays", pairs.len() as u64);
    pairs.par_iter().try_for_each(|pair| {
        bar.inc(1);
        let drawn = files.iter().find(|f| f.pair == pair.pair).and_then(|f| overlay::png(f, pair, mosaic));
        drawn.map_or(Ok(()), |bytes| out.write(&format!("overlays/{}.png", pair.pair), &bytes))
    })?;
    bar.finish_and_clear();
    Ok(())
}

/// The size that most left and most right pictures have; the larger one where two are equally frequent.
fn majority_sizes(headers: &[[Announced; 2]]) -> [(u32, u32); 2] {
    Side::BOTH.map(|side| {
        let mut counts: BTreeMap<(u32, u32), usize> = BTreeMap::new();
        // A file that can't be read is named when its turn comes.
        for header in headers.iter().filter_map(|sides| sides[side as usize].as_ref().ok()) {
            *counts.entry((header.width, header.height)).or_default() += 1;
        }
        counts.into_iter().max_by_key(|&(size, count)| (count, size)).map_or((0, 0), |(size, _)| size)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_of_two_sizes_are_said() {
        let said = sizes_differ([(640, 480), (1280, 960)]).unwrap();
        assert!(said.starts_with("the left pictures are 640x480 px, the right ones 1280x960 px"), "{said}");
        for sizes in [[(640, 480); 2], [(640, 480), (0, 0)]] {
            assert_eq!(sizes_differ(sizes), None);
        }
    }

    #[test]
    fn the_first_pairs_are_spread_over_all_and_none_is_left_out_or_twice() {
        for total in 0..40 {
            let [first, rest] = first_pairs(total);
            let mut all = [first.clone(), rest].concat();
            all.sort_unstable();
            assert_eq!(all, (0..total).collect::<Vec<_>>());
            assert!(first.len() <= 6 && first.windows(2).all(|two| two[1] - two[0] <= total.div_ceil(6)));
        }
    }
}
