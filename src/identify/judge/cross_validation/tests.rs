use super::*;
use crate::linear_algebra::product;

fn held_out(squares: &[f64]) -> HeldOut {
    squares.iter().map(|&s| (s, 3.0)).collect()
}

#[test]
fn a_gain_in_every_region_counts_however_unlike_the_regions_are() {
    let old = held_out(&[0.1, 0.2, 9.0, 0.3, 30.0, 0.2, 0.1, 4.0]);
    let new = held_out(&[1e-4, 2e-4, 1e-4, 3e-4, 2e-4, 1e-4, 2e-4, 1e-4]);
    assert!(clearly_less(&new, &old) && !clearly_less(&old, &new));
}

/// CrossValidation of a model with two parameters seen directly, 20 rows a fold, each fold's rows off by its own
/// amount.
fn direct(common: &[f64]) -> CrossValidation {
    let mut random = 1u32;
    let mut noise = || {
        // Twelve uniform numbers make a normal one.
        let uniform = |r: &mut u32| {
            *r = r.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(*r >> 8) / f64::from(1 << 24)
        };
        (0..12).map(|_| uniform(&mut random)).sum::<f64>() - 6.0
    };
    let cells: Vec<Cell> = common
        .iter()
        .enumerate()
        .map(|(fold, off)| {
            let all = DMatrix::from_fn(20, 3, |r, c| match c {
                2 => noise() + off,
                c => f64::from(u8::from(r % 2 == c)),
            });
            Cell { block: 0, fold, numbers: 20.0, normal: product(&all, &all) }
        })
        .collect();
    let make = |held| Fold::new(&cells, 1, 2, held);
    CrossValidation {
        parameters: vec![Parameter::A(0), Parameter::A(1)],
        extras: Vec::new(),
        folds: (0..common.len()).map(|f| make(Some(f))).collect(),
        whole: make(None),
        cells,
        whole_placements: true,
        unit_mm: 1.0,
    }
}

#[test]
fn errors_that_a_fold_shares_widen_the_variances_and_others_do_not() {
    let parameters = [Parameter::A(0), Parameter::A(1)];
    assert_eq!(direct(&[0.0; 8]).common_factor(&parameters), 1.0);
    // Ten rows see a parameter, and share an error of one standard deviation: 1 + 10 of variance for 1.
    let factor = direct(&[1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0]).common_factor(&parameters);
    assert!((6.0..18.0).contains(&factor), "{factor}");
}

#[test]
fn a_gain_here_and_a_loss_there_is_chance() {
    let old = held_out(&[1.0, 1.1, 0.9, 1.0, 1.2, 0.8]);
    let new = held_out(&[0.9, 1.2, 0.8, 1.05, 1.0, 0.85]);
    assert!(root_mean(&new) < root_mean(&old) && !clearly_less(&new, &old));
}
