//! The pictures of two sides paired, and the names of the pairs.

use std::collections::BTreeSet;

use camino::Utf8PathBuf;

use super::names::{natural_order, stem};
use super::{PairBy, PairFiles};

/// Two sides paired.
#[derive(Debug, Clone)]
pub struct Matched {
    pub by: PairBy,
    /// How those were paired that are named in another way than most.
    pub also: Option<PairBy>,
    /// In natural order of their names.
    pub pairs: Vec<PairFiles>,
    /// Pictures without a partner.
    pub single: Vec<Utf8PathBuf>,
}

/// Name of a pair whose files are called by nothing but their side.
const NAMELESS: &str = "left-right";

/// Names that are their own, and the order of them.
pub fn finished(mut matched: Matched) -> Matched {
    for pair in &mut matched.pairs {
        if pair.pair.is_empty() {
            pair.pair = NAMELESS.to_owned();
        }
    }
    let names: BTreeSet<&str> = matched.pairs.iter().map(|p| p.pair.as_str()).collect();
    if names.len() < matched.pairs.len() {
        for pair in &mut matched.pairs {
            pair.pair = stem(&pair.left).to_owned();
        }
    }
    matched.pairs.sort_by(|a, b| natural_order(&a.pair, &b.pair));
    matched
}
