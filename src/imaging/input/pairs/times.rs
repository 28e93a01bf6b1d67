//! Pictures that are called by the times at which they were taken, those of two cameras not quite at once: those that
//! are nearest to each other belong together.
//!
//! In: the pictures of two sides. Out: pairs that are several times nearer to each other than to any other picture, and
//! the rest. A time is seconds, or a finer unit, since some moment, with a fraction behind a sign or without, or a date
//! and the time of day. Goes wrong: clocks that are apart by more than a part of what passes between two pictures.

use camino::Utf8PathBuf;

use super::matched::{Matched, finished};
use super::names::{numbers, stem};
use super::{PairBy, PairFiles};

/// By how many times the next picture must be farther than the partner.
const CLEAR: f64 = 4.0;

/// Digits of seconds since 1970: no picture's number has as many.
const OF_SECONDS: usize = 10;

/// Pairs of two sides by the times in their names; none where a name has none, or one of another form.
pub fn pair(sides: [&[Utf8PathBuf]; 2]) -> Option<Matched> {
    let times = sides.map(|side| side.iter().map(|path| time(stem(path))).collect::<Option<Vec<Time>>>());
    let [Some(left), Some(right)] = times else { return None };
    let form = left.first()?.digits;
    if left.iter().chain(&right).any(|time| time.digits != form) {
        return None;
    }
    // How far the nearest of some times is, and which it is.
    let nearest = |of: &Time, among: &[Time], but: Option<usize>| {
        let others = among.iter().enumerate().filter(|(at, _)| Some(*at) != but);
        others.map(|(at, time)| ((time.at - of.at).abs(), at)).min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let mut matched = Matched { by: PairBy::Time, also: None, pairs: Vec::new(), single: Vec::new() };
    let mut is_paired = vec![false; right.len()];
    for (i, time) in left.iter().enumerate() {
        let partner = nearest(time, &right, None).filter(|&(apart, k)| {
            let mut others = [
                nearest(time, &left, Some(i)),
                nearest(time, &right, Some(k)),
                nearest(&right[k], &left, Some(i)),
                nearest(&right[k], &right, Some(k)),
            ]
            .into_iter()
            .flatten()
            .peekable();
            others.peek().is_some() && others.all(|(other, _)| CLEAR * apart <= other && apart < other)
        });
        let path = &sides[0][i];
        match partner {
            Some((_, k)) => {
                is_paired[k] = true;
                let pair = stem(path).to_owned();
                matched.pairs.push(PairFiles { pair, left: path.clone(), right: sides[1][k].clone() });
            }
            None => matched.single.push(path.clone()),
        }
    }
    let rest = sides[1].iter().zip(is_paired).filter(|(_, is_paired)| !is_paired);
    matched.single.extend(rest.map(|(path, _)| path.clone()));
    Some(finished(matched))
}

/// When a picture was taken.
struct Time {
    /// In its unit, since some moment.
    at: f64,
    /// Digits before the fraction: pictures of one series have as many.
    digits: usize,
}

/// The time that a name holds.
fn time(name: &str) -> Option<Time> {
    let all = numbers(name);
    let value = |text: &str| text.parse::<f64>().ok();
    let fraction = |text: Option<&&str>| text.and_then(|text| value(&format!("0.{text}"))).unwrap_or(0.0);
    if let Some((day, clock)) = (0..all.len()).find_map(|at| date(&all[at..])) {
        let part = |at: usize| value(clock.get(2 * at..2 * at + 2)?);
        let seconds = 60.0 * (60.0 * part(0)? + part(1)?) + part(2)?;
        let behind = Some(&clock[6..]).filter(|digits| !digits.is_empty());
        return Some(Time { at: 86_400.0 * day + seconds + fraction(behind.as_ref()), digits: 8 });
    }
    let long = all.iter().position(|text| text.len() >= OF_SECONDS)?;
    let behind = all.get(long + 1).filter(|_| all[long].len() == OF_SECONDS);
    Some(Time { at: value(all[long])? + fraction(behind), digits: all[long].len() })
}

/// The day that numbers begin with, and the digits of the time of day behind it: `20230401_123015`,
/// `20230401_12_30_15`, `2023-04-01_123015.5`, `20230401123015`.
fn date(numbers: &[&str]) -> Option<(f64, String)> {
    let whole: &[&str] = match numbers.first()?.len() {
        4 if numbers.get(1..3)?.iter().all(|part| part.len() == 2) => &numbers[..3],
        8 | 14 | 17 | 20 => &numbers[..1],
        _ => return None,
    };
    let digits = whole.concat();
    let part = |range: std::ops::Range<usize>| digits.get(range).and_then(|part| part.parse::<u32>().ok());
    let (year, month, day) = (part(0..4)?, part(4..6)?, part(6..8)?);
    let is_date = (1990..=2100).contains(&year) && (1..=12).contains(&month) && (1..=31).contains(&day);
    let clock = digits[8..].to_owned() + &numbers[whole.len()..].concat();
    is_date.then_some((f64::from(31 * month + day), clock))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(left: &[&str], right: &[&str]) -> Option<(Vec<[String; 2]>, usize)> {
        let [left, right] = [left, right]
            .map(|side| side.iter().map(|name| format!("{name}.png").into()).collect::<Vec<Utf8PathBuf>>());
        let matched = pair([&left, &right])?;
        let names = |pair: &PairFiles| [&pair.left, &pair.right].map(|path| stem(path).to_owned());
        Some((matched.pairs.iter().map(names).collect(), matched.single.len()))
    }

    #[test]
    fn pictures_that_were_taken_together_are_pairs() {
        for (left, right) in [
            (["1617181723.123456", "1617181726.1", "1617181729"], ["1617181723.5", "1617181726.13", "1617181729.2"]),
            (
                ["a_1617181723123", "a_1617181726123", "a_1617181729123"],
                ["b_1617181723150", "b_1617181726100", "b_1617181729123"],
            ),
            (
                ["WIN_20230401_12_30_15_Pro", "WIN_20230401_12_30_35_Pro", "WIN_20230401_12_31_02_Pro"],
                ["WIN_20230401_12_30_16_Pro", "WIN_20230401_12_30_38_Pro", "WIN_20230401_12_31_05_Pro"],
            ),
            (
                ["2023-04-01_123015.931152", "2023-04-01_123015.993401", "2023-04-01_123016.063160"],
                ["2023-04-01_123015.940113", "2023-04-01_123016.001270", "2023-04-01_123016.070007"],
            ),
            (
                ["20230401_235958_120", "20230402_000005_120", "20230402_000015_120"],
                ["20230401_235958_900", "20230402_000005_800", "20230402_000015_100"],
            ),
        ] {
            let (pairs, single) = said(&left, &right).unwrap();
            let expected: Vec<[String; 2]> =
                left.iter().zip(right).map(|(l, r)| [(*l).to_owned(), r.to_owned()]).collect();
            assert_eq!((pairs, single), (expected, 0));
        }
        // One that was lost leaves its partner alone.
        let (pairs, single) =
            said(&["1617181723.1", "1617181729.1"], &["1617181723.2", "1617181726.2", "1617181729.2"]).unwrap();
        assert_eq!((pairs.len(), single), (2, 1));
    }

    #[test]
    fn what_is_not_clear_is_not_paired() {
        // Half-way between two, clocks that have nothing to do with each other, numbers of pictures.
        assert_eq!(said(&["1617181720", "1617181730"], &["1617181725", "1617181735"]).unwrap().0.len(), 0);
        assert_eq!(
            said(&["83342982396100", "83343911497400"], &["83218230747000", "83224084311800"]).unwrap().0.len(),
            0
        );
        assert_eq!(said(&["a_1617181720", "b_1617181720"], &["1617181720", "1617181799"]).unwrap().0.len(), 0);
        // Of one picture a side nothing says how near is near.
        assert_eq!(said(&["WIN_20230401_12_30_15_Pro"], &["WIN_20230401_12_30_16_Pro"]).unwrap().0.len(), 0);
        assert!(said(&["img_1", "img_3"], &["img_2", "img_4"]).is_none());
        assert!(said(&["1617181723123", "1617181726123"], &["1617181723", "1617181726"]).is_none());
    }
}
