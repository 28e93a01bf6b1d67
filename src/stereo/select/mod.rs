//! Which model: what predicts pairs that it has not seen, and how much the pairs differ about it.

pub mod cross_validation;
pub mod each_alone;
pub mod known_lenses;
pub mod lens_ladder;
pub mod model_comparison;
pub mod options;
pub mod pair_motion;
pub mod pair_scatter;
pub mod stated_uncertainty;
