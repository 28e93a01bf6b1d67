//! Folds over pairs: each pair is held out once.

/// Folds over the pairs; with fewer pairs each is a fold of its own.
pub const FOLDS: usize = 10;

/// The fold of every pair, round robin: pairs taken one after another are alike, and should not all be missing at once.
pub fn assign(pairs: usize, folds: usize) -> Vec<usize> {
    let folds = folds.clamp(1, pairs.max(1));
    (0..pairs).map(|i| i % folds).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fold_has_a_pair_and_no_pair_is_left_over() {
        assert_eq!(assign(5, 3), [0, 1, 2, 0, 1]);
        assert_eq!(assign(2, 10), [0, 1]);
        assert!(assign(0, 3).is_empty());
    }
}
