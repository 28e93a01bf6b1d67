//! Rows that are far from what the others predict, left out or named.

use super::session::Session;
use crate::identify::Error;
use crate::identify::model::ladder::Terms;
use crate::identify::settings::Model;
use crate::identify::solve::robust::Loss;

/// Rows that are far from what the others predict.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Gross {
    /// Left out of the fit.
    pub outliers: Vec<usize>,
    /// Fitted.
    pub doubtful: Vec<usize>,
    /// Verify rows.
    pub of_verify: Vec<usize>,
}

impl Session<'_> {
    /// Leaves out the rows that a robust fit gives no weight, and names them; and others that are far off.
    pub(super) fn drop_outliers(&mut self, model: Model, terms: &Terms) -> Result<Gross, Error> {
        let sigmas = self.settings.outlier_sigmas;
        if sigmas <= 0.0 {
            return Ok(Gross::default());
        }
        let parameters = terms.parameters(self.robot);
        let mut robust = self.task(&parameters, model).robust(Loss::Biweight)?;
        let outliers = robust.gross_errors(sigmas);
        let doubtful = robust.doubtful(&outliers);
        let of_verify = robust.far_off(&self.set.verify_rows(), sigmas);
        self.rows.retain(|r| !outliers.contains(r));
        Ok(Gross { outliers, doubtful, of_verify })
    }
}
