//! Words for a side in the names of files and folders, numbers in them, and their natural order.
//!
//! In: a name. Out: the name with each word for a side left open, and which side each word tells; its numbers. A word
//! counts by what it stands against: two names are a left and a right one where they differ in such words only, each
//! time left against right, so that `right_angle_left_1` is the left one beside `right_angle_right_1`. Goes wrong: two
//! words of one name that tell different sides.

use std::cmp::Ordering;
use std::ops::Range;

use camino::Utf8Path;

use crate::imaging::Side;

/// Words for left and right that are found anywhere in a run of letters.
const LONG: [(&str, &str); 8] = [
    ("left", "right"),
    ("左", "右"),
    ("links", "rechts"),
    ("gauche", "droite"),
    ("izquierda", "derecha"),
    ("esquerda", "direita"),
    ("sinistra", "destra"),
    ("lewy", "prawy"),
];

/// Words for left and right that stand alone: between digits, other signs and a change of case.
const SHORT: [(&str, &str); 4] = [("l", "r"), ("lt", "rt"), ("izq", "der"), ("sx", "dx")];

/// How far words for a side are looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// Long words anywhere, short ones where they stand alone.
    Words,
    /// Also the letters l and r at either end of a run of letters: `caml`, `rcam`.
    Letters,
}

/// A name whose words for a side are left open.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Open {
    /// The name with a mark in place of each word.
    pub key: String,
    /// In their order.
    words: Vec<Found>,
}

/// How much a word says by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Weight {
    /// A long word that stands alone.
    Word,
    Short,
    /// Part of another word, which says something only against another name.
    Part,
}

/// Where a word is, what it tells, and how much by itself.
type Found = (Range<usize>, Side, Weight);

impl Open {
    /// Looks for words in a name.
    pub fn new(name: &str, reach: Reach) -> Open {
        let mut found: Vec<Found> = Vec::new();
        for run in runs(name, char::is_alphabetic) {
            let pieces = pieces(name, run.clone());
            let short =
                |piece: &Range<usize>| Some((piece.clone(), side_of(&name[piece.clone()], &SHORT)?, Weight::Short));
            let mut here: Vec<Found> = long_word(name, run.clone(), &pieces).into_iter().collect();
            if here.is_empty() {
                here.extend(pieces.iter().filter_map(short));
            }
            if here.is_empty() && reach == Reach::Letters {
                here.extend(letters_at_ends(name, run));
            }
            found.append(&mut here);
        }
        let mut key = String::new();
        let mut end = 0;
        for (word, _, _) in &found {
            key.push_str(&name[end..word.start]);
            key.push('\0');
            end = word.end;
        }
        key.push_str(&name[end..]);
        Open { key, words: found }
    }

    /// The side that the name tells by itself: that of its long words, else that of its short ones.
    pub fn side(&self) -> Option<Side> {
        let of = |weight: Weight| -> Vec<Side> {
            self.words.iter().filter(|(_, _, w)| *w == weight).map(|(_, side, _)| *side).collect()
        };
        let told = Some(of(Weight::Word)).filter(|sides| !sides.is_empty()).unwrap_or_else(|| of(Weight::Short));
        let (first, last) = (*told.first()?, *told.last()?);
        match told.iter().all(|side| *side == first) {
            true => Some(first),
            // Of words that disagree the one at the start of the name counts, else the one at its end.
            false if self.key.starts_with('\0') => self.words.first().map(|(_, side, _)| *side),
            false => self.key.ends_with('\0').then_some(last),
        }
    }

    /// The words in which it differs from another of the same key, each with the side that it tells.
    fn differing<'a>(&'a self, other: &'a Open) -> impl Iterator<Item = (&'a Range<usize>, Side)> {
        let both = self.words.iter().zip(&other.words).filter(|((_, mine, _), (_, theirs, _))| mine != theirs);
        both.map(|((word, mine, _), _)| (word, *mine))
    }

    /// The side of this name beside another of the same key: they differ in words for a side only, each time the same
    /// way round.
    pub fn side_beside(&self, other: &Open) -> Option<Side> {
        let mut differing = self.differing(other);
        let (_, first) = differing.next()?;
        let same_key = self.key == other.key && self.words.len() == other.words.len();
        (same_key && differing.all(|(_, mine)| mine == first)).then_some(first)
    }

    /// The name without the words in which it differs from another one of the same key.
    pub fn without_side(&self, name: &str, other: &Open) -> String {
        let mut kept = String::new();
        let mut end = 0;
        for (word, _) in self.differing(other) {
            push_apart(&mut kept, &name[end..word.start]);
            end = word.end;
        }
        push_apart(&mut kept, &name[end..]);
        kept.trim_matches(SEPARATORS).to_owned()
    }
}

/// The name of a file without its ending.
pub fn stem(path: &Utf8Path) -> &str {
    path.file_stem().unwrap_or_default()
}

/// Signs that hold words apart and mean nothing by themselves.
pub const SEPARATORS: [char; 3] = ['_', '-', ' '];

/// Appends what follows a word that was taken out, with one sign between in place of two.
fn push_apart(kept: &mut String, next: &str) {
    let doubled = kept.is_empty() || kept.ends_with(SEPARATORS);
    kept.push_str(if doubled { next.trim_start_matches(SEPARATORS) } else { next });
}

/// Runs of characters of one kind.
fn runs(name: &str, kind: impl Fn(char) -> bool) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for (at, c) in name.char_indices().filter(|(_, c)| kind(*c)) {
        let end = at + c.len_utf8();
        match runs.last_mut() {
            Some(run) if run.end == at => run.end = end,
            _ => runs.push(at..end),
        }
    }
    runs
}

/// A run of letters cut where the case changes: `lData` into `l` and `Data`, `LData` into `L` and `Data`, `imgL` into
/// `img` and `L`.
fn pieces(name: &str, run: Range<usize>) -> Vec<Range<usize>> {
    let letters: Vec<(usize, char)> = name[run.clone()].char_indices().collect();
    let mut cuts = vec![run.start];
    for (k, window) in letters.windows(2).enumerate() {
        let [(_, a), (at, b)] = *window else { continue };
        let next = letters.get(k + 2).map(|(_, c)| *c);
        let falls = a.is_uppercase() && b.is_uppercase() && next.is_some_and(char::is_lowercase);
        if (a.is_lowercase() && b.is_uppercase()) || falls {
            cuts.push(run.start + at);
        }
    }
    cuts.push(run.end);
    cuts.windows(2).map(|w| w[0]..w[1]).collect()
}

/// The first long word of a run. It stands alone where it is a piece of the run, or where the run has no case that
/// could cut it.
fn long_word(name: &str, run: Range<usize>, pieces: &[Range<usize>]) -> Option<Found> {
    // Where small letters are longer than the capitals, places in one are not places in the other.
    let lower = Some(name[run.clone()].to_lowercase()).filter(|lower| lower.len() == run.len())?;
    let words = LONG.iter().flat_map(|(left, right)| [(left, Side::Left), (right, Side::Right)]);
    let first = words.filter_map(|(word, side)| Some((lower.find(word)?, word.len(), side))).min_by_key(|w| w.0);
    let (at, length, side) = first?;
    let word = run.start + at..run.start + at + length;
    let ideogram = !name[word.clone()].is_ascii();
    let alone = pieces.contains(&word) || word == run || ideogram;
    Some((word, side, if alone { Weight::Word } else { Weight::Part }))
}

fn side_of(word: &str, words: &[(&str, &str)]) -> Option<Side> {
    words.iter().find_map(|(left, right)| match word {
        _ if word.eq_ignore_ascii_case(left) => Some(Side::Left),
        _ if word.eq_ignore_ascii_case(right) => Some(Side::Right),
        _ => None,
    })
}

fn letters_at_ends(name: &str, run: Range<usize>) -> Vec<Found> {
    let one = |at: Range<usize>| {
        let side = side_of(name.get(at.clone())?, &SHORT[..1])?;
        Some((at, side, Weight::Part))
    };
    [run.start..run.start + 1, run.end - 1..run.end].into_iter().filter_map(one).collect()
}

/// The numbers of a name as they are written.
pub fn numbers(name: &str) -> Vec<&str> {
    runs(name, |c| c.is_ascii_digit()).into_iter().map(|run| &name[run]).collect()
}

/// A name cut into its numbers and what stands between them, letters cut where the case changes.
pub fn tokens(name: &str) -> Vec<&str> {
    let mut cut = runs(name, |c| c.is_ascii_digit());
    cut.extend(runs(name, char::is_alphabetic).into_iter().flat_map(|run| pieces(name, run)));
    cut.extend(runs(name, |c| !c.is_ascii_digit() && !c.is_alphabetic()));
    cut.sort_by_key(|run| run.start);
    cut.into_iter().map(|run| &name[run]).collect()
}

/// Sorts digits by their value: `a2` before `a10`.
pub fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut x, mut y) = (a, b);
    while let (Some(cx), Some(cy)) = (x.chars().next(), y.chars().next()) {
        let digits = |s: &str| s.find(|c: char| !c.is_ascii_digit()).unwrap_or(s.len());
        let order = if cx.is_ascii_digit() && cy.is_ascii_digit() {
            let ((dx, rest_x), (dy, rest_y)) = (x.split_at(digits(x)), y.split_at(digits(y)));
            (x, y) = (rest_x, rest_y);
            let (dx, dy) = (dx.trim_start_matches('0'), dy.trim_start_matches('0'));
            dx.len().cmp(&dy.len()).then_with(|| dx.cmp(dy))
        } else {
            (x, y) = (&x[cx.len_utf8()..], &y[cy.len_utf8()..]);
            cx.cmp(&cy)
        };
        if order != Ordering::Equal {
            return order;
        }
    }
    x.len().cmp(&y.len()).then_with(|| a.cmp(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_sort_by_value() {
        let mut names = ["b1", "a10", "a2", "a02", "a", "é3", "10", "9"];
        names.sort_by(|a, b| natural_order(a, b));
        assert_eq!(names, ["9", "10", "a", "a02", "a2", "a10", "b1", "é3"]);
    }

    #[test]
    fn names_are_cut_where_their_kind_changes() {
        assert_eq!(tokens("IMG_20210304-0012L"), ["IMG", "_", "20210304", "-", "0012", "L"]);
        assert_eq!(tokens("LDataImgR2"), ["L", "Data", "Img", "R", "2"]);
        assert_eq!(numbers("cam0_0012"), ["0", "0012"]);
    }

    /// The side of a name beside its partner, and what is left of it.
    fn against(left: &str, right: &str, reach: Reach) -> Option<(Side, String)> {
        let (a, b) = (Open::new(left, reach), Open::new(right, reach));
        Some((a.side_beside(&b)?, a.without_side(left, &b)))
    }

    #[test]
    fn a_word_counts_by_what_it_stands_against() {
        for (left, right, rest) in [
            ("DJI_STE_left_1073", "DJI_STE_right_1073", "DJI_STE_1073"),
            ("videoLeft_0000", "videoRight_0000", "video_0000"),
            ("imageL0", "imageR0", "image0"),
            ("lData", "rData", "Data"),
            ("LEFTcam-2", "RIGHTcam-2", "cam-2"),
            ("left", "right", ""),
            ("01_左", "01_右", "01"),
            ("左相机3", "右相机3", "相机3"),
            ("right_angle_left_1", "right_angle_right_1", "right_angle_1"),
            ("bright_l1", "bright_r1", "bright_1"),
            ("left_l1", "right_r1", "1"),
            ("Kamera_links_3", "Kamera_rechts_3", "Kamera_3"),
        ] {
            assert_eq!(against(left, right, Reach::Words), Some((Side::Left, rest.to_owned())), "{left}");
            assert_eq!(against(right, left, Reach::Words), Some((Side::Right, rest.to_owned())), "{right}");
        }
        assert_eq!(against("caml_1", "camr_1", Reach::Letters), Some((Side::Left, "cam_1".to_owned())));
    }

    #[test]
    fn words_that_hold_others_do_not_mislead() {
        for (a, b) in [
            ("leftover_1", "right_1"),
            ("colour_1", "grey_1"),
            ("rl_1", "rl_2"),
            ("left_r1", "right_l1"),
            ("signal", "signar2"),
            ("bright_1", "bright_1"),
        ] {
            assert_eq!(against(a, b, Reach::Letters), None, "{a} {b}");
        }
        for name in ["leftover_1", "bright", "upright3", "colour", "label", "rl_1", "a_left_right_1", "a_l_r1"] {
            assert_eq!(Open::new(name, Reach::Words).side(), None, "{name}");
        }
    }
}
