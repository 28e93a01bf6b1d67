//! Errors on rows that were not fitted, and the choice of model, terms and method by them.

pub mod cells;
pub mod choose;
pub mod climb;
pub mod errors;
pub mod folds;
pub mod held_out;
pub mod scale;
pub mod smooth;
pub mod uncertainty;
