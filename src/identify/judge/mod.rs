//! Errors on rows that were not fitted, and how far to trust what was.

pub mod cross_validation;
pub mod errors;
pub mod folds;
pub mod lag;
pub mod lengths;
pub mod locate;
pub mod pattern;
pub mod placement;
pub mod recheck;
pub mod scale;
pub mod smooth;
pub mod strays;
pub mod uncertainty;
