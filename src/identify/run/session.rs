//! What the steps of an identification share, and how much the rows tell.

use crate::identify::Error;
use crate::identify::data::dataset::{Dataset, Kind};
use crate::identify::judge::smooth;
use crate::identify::model::ladder::{Chain, Terms};
use crate::identify::sensor::Extra;
use crate::identify::settings::{Model, Settings};
use crate::identify::solve::robust::{Loss, Robust};
use crate::identify::solve::task::Task;
use crate::robot::{Parameter, Robot};

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

/// What all steps share.
pub(super) struct Session<'a> {
    pub(super) set: &'a Dataset,
    pub(super) robot: &'a Robot,
    pub(super) settings: &'a Settings,
    pub(super) seed: u64,
    pub(super) rows: Vec<usize>,
    pub(super) extras: Vec<Extra>,
    pub(super) smooth: Option<smooth::Detected>,
    pub(super) step: &'a (dyn Fn(&str) + Sync),
}

impl Session<'_> {
    pub(super) fn task<'b>(&'b self, parameters: &'b [Parameter], model: Model) -> Task<'b> {
        let extras = if model == Model::PairwiseDistance { &[] } else { self.extras.as_slice() };
        let plain = Task::plain(self.set, self.robot, parameters, &self.rows, self.settings);
        Task { extras, model, smooth: self.smooth.map(|told| told.error), ..plain }
    }

    /// Leaves out the rows that a robust fit gives no weight, and names them; and others that are far off.
    pub(super) fn drop_outliers(&mut self, model: Model, terms: &Terms) -> Result<Gross, Error> {
        let sigmas = self.settings.outlier_sigmas;
        if sigmas <= 0.0 {
            return Ok(Gross::default());
        }
        self.name_outliers(model, terms, &|robust| robust.gross_errors(sigmas))
    }

    /// Takes back the rows that only a model that is too poor for the robot found far off.
    pub(super) fn take_back(&mut self, gross: Gross, model: Model, terms: &Terms) -> Result<Gross, Error> {
        if gross.outliers.is_empty() {
            return Ok(gross);
        }
        let sigmas = self.settings.outlier_sigmas;
        self.rows = self.set.fit_rows();
        self.name_outliers(model, terms, &|robust| robust.still_gross(gross.outliers.clone(), sigmas))
    }

    /// Takes back the rows that a fit without them finds as near as the others. Where distances are alike, or a robot of
    /// another size does as well, a robust fit may end at one that follows most rows, and the whole fit follows all.
    pub(super) fn take_back_near(&mut self, gross: Gross, model: Model, terms: &Terms) -> Result<Gross, Error> {
        if gross.outliers.is_empty() {
            return Ok(gross);
        }
        let parameters = terms.parameters(self.robot);
        let robust = self.task(&parameters, model).robust(Loss::Biweight)?;
        let outliers = robust.not_near(&gross.outliers, self.settings.outlier_sigmas);
        self.rows = self.set.fit_rows();
        self.rows.retain(|row| !outliers.contains(row));
        Ok(Gross { outliers, ..gross })
    }

    /// Leaves out the rows that are `gross` errors of a robust fit, and names them; and others that are far off.
    fn name_outliers(
        &mut self,
        model: Model,
        terms: &Terms,
        gross: &dyn Fn(&mut Robust) -> Vec<usize>,
    ) -> Result<Gross, Error> {
        let parameters = terms.parameters(self.robot);
        let mut robust = self.task(&parameters, model).robust(Loss::Biweight)?;
        let outliers = gross(&mut robust);
        let doubtful = robust.doubtful(&outliers);
        let of_verify = robust.far_off(&self.set.verify_rows(), self.settings.outlier_sigmas);
        self.rows.retain(|r| !outliers.contains(r));
        Ok(Gross { outliers, doubtful, of_verify })
    }

    /// Numbers that were measured, less the unknowns of the placements.
    fn numbers(&self) -> f64 {
        let (a_row, a_group) = match self.set.kind {
            Kind::Positions => (3, 6),
            Kind::Distances if self.rows.iter().any(|&r| self.set.touches(r)) => (3, 3),
            Kind::Distances => (1, 4),
        };
        let groups = (0..self.set.groups.len()).filter(|&g| self.rows.iter().any(|&r| self.set.poses[r].group == g));
        (a_row * self.rows.len()) as f64 - (a_group * groups.count()) as f64
    }

    /// Whether there are so many times more numbers to tell by than parameters.
    pub(super) fn tells(&self, terms: &Terms, times: f64) -> bool {
        terms.parameters(self.robot).len() as f64 * times <= self.numbers()
    }

    /// The richest model that has so many times more numbers to tell by than parameters.
    pub(super) fn reference(&self, times: f64) -> Terms {
        let poorer = |chain: Chain| Terms { chain, ..Terms::NOMINAL };
        let rich = [Terms::REFERENCE, Terms::default(), poorer(Chain::Offsets)];
        rich.into_iter().find(|t| self.tells(t, times)).unwrap_or(poorer(Chain::Tool))
    }
}
