//! What a formulation is made of: which rows of which measurements, what may move, and what the poses can determine.
//!
//! In: rows, model, parameters. Out: residual rows at some scatter and weights, base parameters, rows of the prior.
//! What goes wrong: fewer numbers than needed, or poses that determine nothing; both are errors with the counts.

use nalgebra::DMatrix;

use crate::identify::Error;
use crate::identify::data::dataset::{Dataset, Kind};
use crate::identify::model::base::Base;
use crate::identify::model::prior::Tolerance;
use crate::identify::residuals::rows::Rows;
pub use crate::identify::residuals::rows::Task;
use crate::identify::sensor::{Extra, Scatter};
use crate::identify::settings::{Model, Prior, Redundancy, Settings};
use crate::robot::{Parameter, Robot, Unit};

/// Scatter before anything is known, mm: about a good robot's after calibration.
pub const FIRST_SCATTER_MM: f64 = 0.1;

/// How far the target must lie from where the file has it that what turns about it is worth a look: a mrad at such a
/// lever is a micrometre.
const FAR_MM: f64 = 1.0;

impl<'a> Task<'a> {
    /// These parameters on all fitted rows, as they are read: how measurements are looked at before it is known what is
    /// in them.
    pub fn plain(
        set: &'a Dataset,
        robot: &'a Robot,
        parameters: &'a [Parameter],
        rows: &'a [usize],
        settings: &'a Settings,
    ) -> Task<'a> {
        let model = if set.kind == Kind::Positions { Model::Position } else { Model::CenterDistance };
        Task { set, robot, parameters, extras: set.target_unknowns(false), rows, model, smooth: None, settings }
    }

    /// Whether anything that was measured sees the robot's size.
    pub(super) fn scale_is_seen(&self) -> bool {
        let set = self.set;
        let touched = |group: usize| self.rows.iter().any(|&r| set.poses[r].group == group);
        !self.rows.iter().all(|&r| set.touches(r)) || set.known.iter().any(|k| touched(k.a) && touched(k.b))
    }

    /// The rows with a scatter that is known.
    pub fn rows_at(&self, scatter: Scatter, load_chain: &Robot) -> Rows {
        Rows::new(self, scatter, &[], load_chain)
    }

    /// What the poses determine, seen from the nominal robot.
    pub(super) fn base(&self, rows: &Rows) -> Result<Base, Error> {
        self.base_at(rows, &vec![0.0; rows.offset_count()])
    }

    /// Takes in what they determine where a fit has come to.
    pub(super) fn look_again(&self, rows: &Rows, offsets: &[f64], base: &mut Base, x: &mut Vec<f64>) {
        if let Some(richer) = self.richer(rows, offsets, base) {
            *x = [richer.coordinates(offsets), x.split_off(base.rank())].concat();
            *base = richer;
        }
    }

    /// What they determine where the target really is, if that is more than where the file has it: a target on the last
    /// axes hides what turns about it. `None` where these offsets do not move it far enough to matter.
    fn richer(&self, rows: &Rows, offsets: &[f64], base: &Base) -> Option<Base> {
        // The rest of the robot stays nominal: what one orientation of the flange hides is not seen because the links
        // are a little off.
        let mut of_target = vec![0.0; rows.offset_count()];
        for ((at, &offset), parameter) in of_target.iter_mut().zip(offsets).zip(self.parameters) {
            if matches!(parameter, Parameter::V(_)) {
                *at = offset;
            }
        }
        if !of_target.iter().any(|offset| offset.abs() > FAR_MM) {
            return None;
        }
        let there = self.base_at(rows, &of_target).ok()?;
        (there.rank() > base.rank() && self.check_count(rows, &there).is_ok()).then_some(there)
    }

    fn base_at(&self, rows: &Rows, offsets: &[f64]) -> Result<Base, Error> {
        if self.parameters.is_empty() {
            return Ok(Base::new(&DMatrix::zeros(1, 0), self.settings.rank_tolerance));
        }
        let (_, jacobian) = rows.evaluate(offsets, true);
        let jacobian = jacobian.columns(0, self.parameters.len()).into_owned();
        let base = match self.settings.redundancy {
            Redundancy::Qr => Base::new(&jacobian, self.settings.rank_tolerance),
            Redundancy::Correlation => Base::by_correlation(&jacobian, self.settings.rank_tolerance),
        };
        // Identical poses leave columns of rounding errors, whose rank means nothing: judge their size in mm a mm or
        // mrad.
        let largest = jacobian.column_iter().map(|c| c.norm()).fold(0.0, f64::max);
        let strength = largest * rows.unit_variance_mm2().sqrt() / (jacobian.nrows().max(1) as f64).sqrt();
        if base.rank() == 0 || strength <= self.settings.rank_tolerance {
            return Err(Error::NothingDetermined { poses: self.rows.len() });
        }
        Ok(base)
    }

    /// Too few numbers to calibrate anything: not more than offsets of all joints, a tool and three more to judge by;
    /// without a prior, not more than base parameters.
    pub(super) fn check_count(&self, rows: &Rows, base: &Base) -> Result<(), Error> {
        let numbers = rows.count();
        let least = match self.settings.prior {
            Prior::Off => base.rank(),
            Prior::Evidence => base.rank().min(self.robot.joints.len() + 6),
        };
        if numbers <= least {
            let of_pose = if self.set.kind == Kind::Positions || self.set.touches(self.rows[0]) { 3 } else { 1 };
            let more = (least + 1 - numbers).div_ceil(of_pose);
            return Err(Error::TooFew { numbers, parameters: base.rank(), poses: self.rows.len(), more });
        }
        Ok(())
    }

    /// Rows of the prior of all unknowns; none where it is not `held`, but for a scale that nothing sees.
    pub(super) fn prior_rows(&self, tolerance: &Tolerance, base: &Base, held: bool) -> DMatrix<f64> {
        let unscaled = (!self.scale_is_seen()).then_some(self.robot);
        prior_rows(tolerance, base, self.parameters, self.extras, held, unscaled)
    }
}

/// Standard deviation of the mean relative change of all lengths where nothing measured sees it.
const HELD_SCALE: f64 = 1e-7;

/// Rows of the prior of these unknowns, none where it is not `held`; and of a robot whose scale nothing sees one more
/// below: as a whole it neither grows nor shrinks. Touches of unknown points fit the better the smaller all lengths
/// are, and a weak prior would let them collapse.
pub(super) fn prior_rows(
    tolerance: &Tolerance,
    base: &Base,
    parameters: &[Parameter],
    extras: &[Extra],
    held: bool,
    unscaled: Option<&Robot>,
) -> DMatrix<f64> {
    let rows = match held {
        true => tolerance.rows(base, parameters, extras),
        false => DMatrix::zeros(0, base.rank() + extras.len()),
    };
    let Some(robot) = unscaled else { return rows };
    let spread = tolerance.spread(base, parameters);
    let length = |p: &Parameter| if p.unit() == Unit::Mm { robot.value(*p) } else { 0.0 };
    let lengths = nalgebra::RowDVector::from_iterator(parameters.len(), parameters.iter().map(length));
    let square = lengths.norm_squared().max(f64::MIN_POSITIVE);
    let of_base = &lengths * spread / (square * HELD_SCALE);
    let (count, columns) = rows.shape();
    let mut held = rows.resize_vertically(count + 1, 0.0);
    held.view_mut((count, 0), (1, of_base.ncols().min(columns))).copy_from(&of_base);
    held
}
