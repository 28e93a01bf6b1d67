//! How good the rig is: lengths that were held out, a second board, what the residuals show, what the views lack, and
//! the verdict.

pub mod assessment;
pub mod doubtful_corners;
pub mod evidence;
pub mod ledger;
pub mod lengths;
pub mod moved_tags;
pub mod moves;
pub mod residual_correlation;
#[cfg(test)]
mod tests;
pub mod verdict;
pub mod view_coverage;
