//! Which corner of the board is which, where its markers are too small or too blurred to be read one by one.
//!
//! In: how dark the bits are in the squares of a grid. Out: how the grid lies on the board. Method: a matched filter.
//! Where the grid lies right, what the board has in each square correlates with what is seen there; elsewhere it does
//! by chance only. The sum over all squares is judged by that of all other turns and shifts of the grid: codes are made
//! to be unlike each other, and blur makes neighbouring bits alike, which widens what chance does there as it does
//! everywhere. Goes wrong: fewer than a few squares in view, in which no marker can be read.

use std::collections::BTreeMap;

use super::numbering::{AGREEING, Placement, Said, code_in, turned_square};
use crate::imaging::board::dictionary::turned;
use crate::imaging::board::{Board, Layout};
use crate::statistics::median;

/// What is seen in a square of a grid, the one after corner `square`.
#[derive(Debug, Clone, PartialEq)]
pub struct Faint {
    /// Column and row of the corner before it.
    pub square: (isize, isize),
    /// How dark its bits are, row by row, from their mean.
    pub darkness: Vec<f64>,
}

/// How many times what chance does the right place must show: among 10^5 turns and shifts a normal deviate is as large
/// once in 10^8 times.
const SURE: f64 = 7.5;
/// The share of that which the second best may reach.
const RIVAL: f64 = 0.5;

/// One way for a grid to lie on the board.
#[derive(Clone, Copy)]
struct Way {
    quarters: usize,
    shift: (isize, isize),
    layout: Layout,
    /// The sum of the correlations, in standard deviations of what independent bits would give by chance; negative for
    /// white on black.
    score: f64,
}

/// How a grid of `size` corners lies on the board by all that is seen in it together.
pub fn place(board: &Board, size: (usize, usize), seen: &[Faint]) -> Said {
    let mut ways: Vec<Way> = board.layouts().into_iter().flat_map(|layout| ways(board, layout, size, seen)).collect();
    ways.sort_by(|a, b| b.score.abs().total_cmp(&a.score.abs()));
    // What is usual among ways that are all wrong but for one: a normal deviate's median magnitude is 0.674.
    let chance = median(ways.iter().map(|way| way.score.abs())).map_or(1.0, |usual| (usual / 0.674).max(1.0));
    let Some(best) = ways.first().copied().filter(|way| way.score.abs() > SURE * chance) else { return Said::Nothing };
    let rival = |same: bool| {
        let others = ways[1..].iter().filter(|way| (way.layout == best.layout) == same);
        others.map(|way| way.score.abs()).next().unwrap_or(0.0)
    };
    if rival(true) > RIVAL * best.score.abs() {
        return Said::Nothing;
    }
    if rival(false) > RIVAL * best.score.abs() {
        return Said::ByLayout;
    }
    judged(board, size, seen, best)
}

/// The bits that a board has in a square as a grid shows them that must be turned by so many quarter turns: one for
/// black, from their mean.
fn expected(board: &Board, layout: Layout, square: (isize, isize), quarters: usize, count: usize) -> Option<Vec<f64>> {
    let side = count.isqrt();
    let code = turned(code_in(board, layout, square)?, side, (4 - quarters % 4) % 4);
    let black = f64::from(code.count_ones()) / count as f64;
    Some((0..count).map(|k| (code >> k & 1) as f64 - black).collect())
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// All ways in which a grid may lie on the board with at least a square on it.
fn ways(board: &Board, layout: Layout, size: (usize, usize), seen: &[Faint]) -> Vec<Way> {
    let Some(count) = seen.first().map(|faint| faint.darkness.len()) else { return Vec::new() };
    let freedom = (count - 1) as f64;
    let mut ways = Vec::new();
    for quarters in 0..4 {
        // By shift: the sum of the products, and of what their variance is by chance.
        let mut sums: BTreeMap<(isize, isize), (f64, f64)> = BTreeMap::new();
        let squares: Vec<((isize, isize), &Faint, f64)> = seen
            .iter()
            .map(|faint| (turned_square(faint.square, size, quarters), faint, dot(&faint.darkness, &faint.darkness)))
            .collect();
        let of_board =
            (0..board.squares.rows).flat_map(|y| (0..board.squares.columns).map(move |x| (x as isize, y as isize)));
        for (x, y) in of_board {
            let Some(bits) = expected(board, layout, (x, y), quarters, count) else { continue };
            let own = dot(&bits, &bits);
            for ((col, row), faint, square) in &squares {
                let sum = sums.entry((x - 1 - col, y - 1 - row)).or_default();
                sum.0 += dot(&bits, &faint.darkness);
                sum.1 += own * square / freedom;
            }
        }
        let known = sums.into_iter().filter(|(_, (_, variance))| *variance > 0.0);
        ways.extend(known.map(|(shift, (product, variance))| Way {
            quarters,
            shift,
            layout,
            score: product / variance.sqrt(),
        }));
    }
    ways
}

/// The best way, where the squares agree with it one by one: not some of them well, and the others not at all.
fn judged(board: &Board, size: (usize, usize), seen: &[Faint], best: Way) -> Said {
    let Way { quarters, shift, layout, score } = best;
    let one = |faint: &Faint| {
        let (col, row) = turned_square(faint.square, size, quarters);
        let bits = expected(board, layout, (col + 1 + shift.0, row + 1 + shift.1), quarters, faint.darkness.len())?;
        let size = (dot(&bits, &bits) * dot(&faint.darkness, &faint.darkness)).sqrt();
        (size > 0.0).then(|| score.signum() * dot(&bits, &faint.darkness) / size)
    };
    let mut correlations: Vec<f64> = seen.iter().filter_map(one).collect();
    correlations.sort_by(f64::total_cmp);
    let well = correlations.get(3 * correlations.len() / 4).copied().unwrap_or(0.0);
    let agreeing = correlations.iter().filter(|correlation| **correlation > well / 2.0).count();
    if agreeing <= AGREEING * (correlations.len() - agreeing) {
        return Said::Nothing;
    }
    let (col, row) = shift;
    Said::Place(Placement { quarters, col, row, layout, agreeing, inverted: score < 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::{Rng, SeedableRng};

    /// A part of a board as a grid that is turned shows it, its bits with noise of so many times their own spread.
    fn part(board: &Board, quarters: usize, noise: f64, seed: u64) -> Vec<Faint> {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut normal = || (0..12).map(|_| random.next_u32() as f64 / f64::from(u32::MAX)).sum::<f64>() - 6.0;
        let mut seen = Vec::new();
        for (x, y) in (1..6).flat_map(|y| (2..8).map(move |x| (x, y))) {
            let bits = expected(board, Layout::New, (x, y), (4 - quarters) % 4, 25).unwrap_or(vec![0.0; 25]);
            let darkness = bits.iter().map(|bit| 10.0 * (bit + 0.5 * noise * normal())).collect();
            // The part's first corner is corner (1, 0); a grid of 7x6 corners holds it.
            seen.push(Faint { square: turned_square((x - 2, y - 1), (7, 6), quarters), darkness });
        }
        seen
    }

    fn size(quarters: usize) -> (usize, usize) {
        if quarters % 2 == 1 { (6, 7) } else { (7, 6) }
    }

    #[test]
    fn parts_are_known_through_noise_that_hides_every_single_marker() {
        let board: Board = "charuco:10x7:20:14:DICT_5X5_100:new".parse().unwrap();
        let mut known = 0;
        for (noise, least) in [(0.5, 40), (1.5, 36), (4.0, 0)] {
            for seed in 0..40 {
                let quarters = seed as usize % 4;
                match place(&board, size(quarters), &part(&board, quarters, noise, seed)) {
                    Said::Place(found) => {
                        let told = (found.quarters, found.col, found.row, found.inverted);
                        assert_eq!(told, ((4 - quarters) % 4, 1, 0, false), "{noise} {seed}");
                        known += 1;
                    }
                    other => assert_eq!(other, Said::Nothing, "{noise} {seed}"),
                }
            }
            assert!(known >= least, "{noise}: {known} of 40");
            known = 0;
        }
    }

    #[test]
    fn noise_and_boards_of_other_counts_have_no_place() {
        let board: Board = "charuco:10x7:20:14:DICT_5X5_100:new".parse().unwrap();
        for seed in 0..200 {
            let mut noise = part(&board, 0, 1.0, seed);
            let mut random = Pcg64::seed_from_u64(seed);
            for value in noise.iter_mut().flat_map(|faint| &mut faint.darkness) {
                *value = random.next_u32() as f64 / f64::from(u32::MAX) - 0.5;
            }
            assert_eq!(place(&board, size(0), &noise), Said::Nothing, "{seed}");
        }
        for columns in [8, 9, 11, 12, 13] {
            let other: Board = format!("charuco:{columns}x7:20:14:DICT_5X5_100:new").parse().unwrap();
            for noise in [0.0, 0.5, 1.5] {
                assert_eq!(place(&other, size(0), &part(&board, 0, noise, 5)), Said::Nothing, "{columns} {noise}");
            }
        }
    }
}
