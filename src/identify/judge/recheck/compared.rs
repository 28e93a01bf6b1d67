//! The new rows at the old robot: residuals that no placement reaches, what they are known to, and the columns of what
//! may have changed.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Matrix3xX, Point3, Vector3, Vector6};

use super::found::Before;
use super::suspects::Suspect;
use crate::difference::Difference;
use crate::geometry::{Transform, fitted_frame, rotation_matrix, rotation_vector};
use crate::identify::data::dataset::{Dataset, Pose};
use crate::identify::data::shared;
use crate::identify::judge::locate::Trust;
use crate::identify::judge::placement::Uncertain;
use crate::identify::residuals::eliminate::Unknowns;
use crate::identify::residuals::rows::Rows;
use crate::identify::sensor::{Extra, Raw, Scatter};
use crate::identify::settings::{Model, Settings};
use crate::identify::solve::linearised::Linearised;
use crate::identify::solve::task::Task;
use crate::linear_algebra::{product, pseudo_inverse};
use crate::robot::{Parameter, Robot};
use crate::statistics::median;

/// How far a placement is from where it stood: turn, rad, and shift, mm.
pub(super) fn off(frame: &Transform, old: &Uncertain) -> Vector6<f64> {
    let turn = rotation_vector(&(frame * old.transform.inverse()));
    let shift = frame.translation.vector - old.transform.translation.vector;
    Vector6::from_iterator(turn.iter().chain(shift.iter()).copied())
}

/// What no orientation is known better than, rad: a micrometre at 100 mm.
const LEAST_TURN_RAD: f64 = 1e-5;

/// The new rows beside the old robot.
pub(super) struct Compared<'a> {
    pub(super) rows: &'a Rows,
    pub(super) before: &'a Before,
    /// Parameters of the robot, and the scale.
    pub(super) count: usize,
}

/// Rounds in which the target's turn is found: it is nearly linear.
const TURNS: usize = 4;

impl Compared<'_> {
    /// All offsets, the target's turn at its best, where the robot is off by these.
    pub(super) fn offsets(&self, of_robot: &[f64]) -> Vec<f64> {
        let mut offsets = vec![0.0; self.rows.offset_count()];
        offsets[..self.count].copy_from_slice(of_robot);
        let turns = offsets.len() - self.count;
        for _ in 0..if turns > 0 { TURNS } else { 0 } {
            let (residuals, jacobian) = self.rows.evaluate(&offsets, true);
            let jacobian = jacobian.columns(self.count, turns).into_owned();
            let step = pseudo_inverse(product(&jacobian, &jacobian)) * jacobian.tr_mul(&residuals);
            offsets[self.count..].iter_mut().zip(step.iter()).for_each(|(x, s)| *x -= s);
        }
        offsets
    }

    /// The rows linearised there, and what is to be looked at.
    pub(super) fn at(&self, of_robot: &[f64]) -> Option<(Linearised, Look)> {
        let linear = Linearised::new(self.rows, &self.offsets(of_robot));
        let look = self.look(stacked(&linear, self.count))?;
        Some((linear, look))
    }

    /// The same where each placement is held by what is known of where it stood, as readings of it are.
    pub(super) fn held(&self, of_robot: &[f64], stood: &dyn Fn(usize) -> Option<Uncertain>) -> Option<Look> {
        let offsets = self.offsets(of_robot);
        let linear = Linearised::new(self.rows, &offsets);
        let (mut nuisance, mut all) = stacked(&linear, self.count);
        let turns = linear.shared - self.count;
        for (k, unknowns) in self.rows.unknowns(&offsets).iter().enumerate() {
            let Unknowns::Frame(frame) = unknowns else { continue };
            let Some(old) = stood(k) else { continue };
            // A step of the placement adds to how far it is from where it stood.
            let white = old.covariance.cholesky()?.l().try_inverse()?;
            let row = all.nrows();
            nuisance = nuisance.resize_vertically(row + 6, 0.0);
            all = all.resize_vertically(row + 6, 0.0);
            nuisance.view_mut((row, turns + 6 * k), (6, 6)).copy_from(&white);
            all.view_mut((row, 0), (6, 1)).copy_from(&(white * off(frame, &old)));
        }
        self.look((nuisance, all))
    }

    /// At rows with the columns of the offsets, in coordinates that the placements and the target's turn do not reach.
    fn look(&self, (nuisance, mut all): (DMatrix<f64>, DMatrix<f64>)) -> Option<Look> {
        let taken = nuisance.ncols();
        nuisance.qr().q_tr_mul(&mut all);
        let rest = all.rows(taken, all.nrows().saturating_sub(taken));
        let (off, columns) = (rest.column(0).into_owned(), rest.columns(1, all.ncols() - 1).into_owned());
        let known: Vec<usize> = (0..self.before.parameters.len()).collect();
        let of_old = columns.select_columns(&known) * root(&self.before.covariance);
        let difference = Difference::of_white(off, of_old, self.before.freedom)?;
        Some(Look { difference, columns })
    }

    /// By how much the squared residuals of each row, by its index in the set, shrink those of all where the row is
    /// left out: as if its residuals were free. Exact where all is linear.
    pub(super) fn gains(&self) -> Vec<(usize, f64)> {
        let linear = Linearised::new(self.rows, &self.offsets(&vec![0.0; self.count]));
        let (nuisance, all) = stacked(&linear, self.count);
        // What placements and turns take up, and of the rest what the old robot is uncertain by.
        let taken = nuisance.qr().q();
        let rest = &all - &taken * product(&taken, &all);
        let uncertain = rest.columns(1, self.before.parameters.len()) * root(&self.before.covariance);
        let size = uncertain.ncols();
        let inner = (DMatrix::identity(size, size) + product(&uncertain, &uncertain)).try_inverse();
        let Some(weighted) = inner.map(|inner| &uncertain * inner) else { return Vec::new() };
        let off = rest.column(0).into_owned();
        let pull = &off - &weighted * uncertain.tr_mul(&off);
        let gain = |at: Range<usize>| {
            let of = |columns: &DMatrix<f64>| columns.rows(at.start, at.len()).into_owned();
            let (own, pull) = (of(&taken), pull.rows(at.start, at.len()).into_owned());
            let left = DMatrix::identity(at.len(), at.len())
                - &own * own.transpose()
                - of(&weighted) * of(&uncertain).transpose();
            pull.dot(&(pseudo_inverse(left) * &pull))
        };
        let mut start = 0;
        let mut gains = Vec::new();
        for placement in &linear.placements {
            let of_pose = placement.by_pose().map(|(pose, at)| (pose, start + at.start..start + at.end));
            gains.extend(of_pose.map(|(pose, at)| (self.rows.rows[pose], gain(at))));
            start += placement.poses.len();
        }
        gains
    }

    /// The largest residual of a point at the old robot, mm.
    pub(super) fn misfit_mm(&self) -> f64 {
        self.misfits_mm().into_iter().fold(0.0, f64::max)
    }

    /// By how much half of the points and more miss the old robot beyond what their readings are off by, mm.
    pub(super) fn missed_mm(&self, stated_mm: f64) -> f64 {
        /// Median of the squared length of a point's error over the variance of a coordinate.
        const MEDIAN_CHI_SQUARE_3: f64 = 2.366;
        let missed_mm = median(self.misfits_mm()).unwrap_or(0.0);
        (missed_mm.powi(2) - MEDIAN_CHI_SQUARE_3 * stated_mm.powi(2)).max(0.0).sqrt()
    }

    fn misfits_mm(&self) -> Vec<f64> {
        let raw = self.rows.raw(&self.offsets(&vec![0.0; self.count]));
        raw.iter()
            .filter_map(|(_, _, raw)| if let Raw::Point(off, _) = raw { Some(off.norm()) } else { None })
            .collect()
    }
}

/// The rows with a scale of the sensor as an unknown, the target's turn where orientations are used, and where targets
/// stand that the robot alone joined: that is known no better than the robot is.
pub(super) fn rows(
    set: &Dataset,
    robot: &Robot,
    parameters: &[Parameter],
    used: &[usize],
    oriented: bool,
    trust: Trust,
) -> Rows {
    let mut set = set.clone();
    let places = places(&set, robot);
    let more = places.first().map_or(0, Matrix3xX::ncols);
    // A thousandth of scale.
    let columns = |(pose, places): (&Pose, &Matrix3xX<f64>)| {
        let mut columns = places.clone().insert_column(0, 0.0);
        columns.set_column(0, &(-1e-3 * pose.reading.point_mm().unwrap_or_default().coords));
        columns
    };
    set.shared = set.poses.iter().zip(&places).map(columns).collect();
    let turned = set.target_unknowns(oriented).iter().copied();
    let extras: Vec<Extra> =
        std::iter::once(Extra::Shared(0)).chain(turned).chain((1..=more).map(Extra::Shared)).collect();
    let rotation_rad = trust.rotation_rad.unwrap_or(1e-4).max(LEAST_TURN_RAD);
    let model = if oriented { Model::Pose } else { Model::Position };
    let settings = Settings::default();
    let task = Task { extras: &extras, model, ..Task::plain(&set, robot, parameters, used, &settings) };
    task.rows_at(Scatter { rotation_rad, ..Scatter::of_point(trust.point_mm) }, robot)
}

/// What a millimetre of each coordinate of each place moves the point of each pose by, where the robot alone joined the
/// targets; no columns elsewhere.
fn places(set: &Dataset, robot: &Robot) -> Vec<Matrix3xX<f64>> {
    let mut parts: Vec<Vector3<f64>> = Vec::new();
    for place in set.poses.iter().filter_map(|pose| pose.on_body_mm).filter(|_| set.are_on_flange()) {
        if !parts.contains(&place) {
            parts.push(place);
        }
    }
    let flange = |pose: &Pose| robot.base_from_flange(&pose.joints_rad);
    let pair = |pose: &Pose| {
        let target = robot.tool_mm + pose.on_body_mm.unwrap_or_default();
        Some((flange(pose) * Point3::from(target), pose.reading.point_mm()?, 1.0))
    };
    let frame = |group: usize| fitted_frame(set.poses.iter().filter(|pose| pose.group == group).filter_map(pair));
    let frames: Vec<Transform> = (0..set.groups.len()).map(frame).collect();
    let of_pose = |pose: &Pose| {
        let mut columns = Matrix3xX::zeros(3 * parts.len());
        if let Some(part) = parts.iter().position(|place| Some(*place) == pose.on_body_mm) {
            columns.fixed_columns_mut::<3>(3 * part).copy_from(&rotation_matrix(&(frames[pose.group] * flange(pose))));
        }
        columns
    };
    set.poses.iter().map(of_pose).collect()
}

/// A matrix whose product with itself transposed is this covariance, which its file may hold with rounded digits.
fn root(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    shared::root(0.5 * (covariance + covariance.transpose()))
}

/// White residuals with the columns of the first so many offsets, behind the columns of the target's turn and the
/// placements.
fn stacked(linear: &Linearised, count: usize) -> (DMatrix<f64>, DMatrix<f64>) {
    let total: usize = linear.placements.iter().map(|p| p.linear.residuals.len()).sum();
    let turns = linear.shared - count;
    let mut nuisance = DMatrix::zeros(total, turns + 6 * linear.placements.len());
    let mut all = DMatrix::zeros(total, 1 + count);
    let mut row = 0;
    for (k, placement) in linear.placements.iter().enumerate() {
        let part = &placement.linear;
        let rows = part.residuals.len();
        nuisance.view_mut((row, turns + 6 * k), (rows, 6)).copy_from(&part.design);
        nuisance.view_mut((row, 0), (rows, turns)).copy_from(&part.jacobian.columns(count, turns));
        all.view_mut((row, 0), (rows, 1)).copy_from(&part.residuals);
        all.view_mut((row, 1), (rows, count)).copy_from(&part.jacobian.columns(0, count));
        row += rows;
    }
    (nuisance, all)
}

/// Residuals somewhere, with what they are known to, and the columns of all offsets there, white.
pub(super) struct Look {
    pub(super) difference: Difference,
    pub(super) columns: DMatrix<f64>,
}

impl Look {
    /// What a unit of each of a suspect's numbers does. Residuals are predicted less measured: a joint that stands
    /// further makes them smaller.
    pub(super) fn directions(&self, suspect: &Suspect) -> Vec<DVector<f64>> {
        suspect.columns.iter().map(|&(at, unit)| -unit * self.columns.column(at)).collect()
    }

    /// The numbers of a suspect at their best.
    pub(super) fn amounts(&self, directions: &[DVector<f64>]) -> DVector<f64> {
        let (normal, pull) = self.products(directions);
        pseudo_inverse(normal) * pull
    }

    /// Products of directions with each other, and with the residuals, in what these are known to.
    pub(super) fn products(&self, directions: &[DVector<f64>]) -> (DMatrix<f64>, DVector<f64>) {
        let (n, difference) = (directions.len(), &self.difference);
        let normal = DMatrix::from_fn(n, n, |r, c| difference.product(&directions[r], &directions[c]));
        (normal, DVector::from_fn(n, |r, _| difference.product(&directions[r], &difference.off)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::data::dataset::Reading;
    use crate::identify::data::targets::Targets;
    use crate::identify::synthetic;

    /// A place that is a millimetre off moves the points of its own target by a millimetre, as the flange is turned
    /// there.
    #[test]
    fn places_of_targets_that_the_robot_joined_move_their_own_points() {
        let world = synthetic::planned(40, 0, 25.0, 0.0, 3, &|_| {});
        let mut set = Dataset::new(&world.rows).unwrap();
        let parts = [Vector3::new(60.0, 0.0, 20.0), Vector3::new(-20.0, -55.0, 40.0)];
        // A third of the poses shows the mark point.
        let part = |row: usize| parts.get(row % 3).copied();
        for (row, pose) in set.poses.iter_mut().enumerate() {
            let shown = Point3::from(world.truth.tool_mm + part(row).unwrap_or_default());
            let at = synthetic::sensor(pose.group) * world.truth.base_from_flange(&pose.joints_rad) * shown;
            pose.on_body_mm = part(row);
            pose.reading = Reading::Position { point_mm: at, covariance_mm2: None, rotation_rad: None };
        }
        assert!(places(&set, &world.truth).iter().all(|columns| columns.ncols() == 0));
        set.targets = Some(Targets { place_sigma_mm: Some(0.0), ..Targets::default() });
        for (row, (columns, pose)) in places(&set, &world.truth).iter().zip(&set.poses).enumerate() {
            let flange = synthetic::sensor(pose.group) * world.truth.base_from_flange(&pose.joints_rad);
            let mut expected = Matrix3xX::zeros(3 * parts.len());
            if let Some(own) = part(row).and_then(|place| parts.iter().position(|p| *p == place)) {
                expected.fixed_columns_mut::<3>(3 * own).copy_from(&rotation_matrix(&flange));
            }
            assert_eq!(columns.shape(), expected.shape());
            assert!((columns - expected).norm() < 1e-6, "{columns}");
        }
    }
}
