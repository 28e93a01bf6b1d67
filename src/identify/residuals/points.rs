//! Points in a placement's own frame, with a free rigid transform; orientations too where the model uses them.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};

use super::normal::Normal;
use super::smooth::Field;
use super::state::State;
use crate::geometry::{
    Transform, fitted_frame, fitted_frame_with_turns, rigid_columns, rotation_matrix, rotation_vector_of_matrix,
};
use crate::identify::model::kinematics::Place;
use crate::identify::sensor::{Raw, Spot};
use crate::robot::jacobian::RAD_PER_MRAD;

/// The points of one placement.
#[derive(Debug, Clone)]
pub struct Points {
    pub spots: Vec<Spot>,
    /// Whether they weigh alike in all directions (see `weigh_alike`).
    pub alike: bool,
    /// The target's orientation on the flange before the extra unknowns turn it.
    pub flange_from_target: Matrix3<f64>,
    pub oriented: bool,
    /// Which of the extra unknowns turn the target: index and axis.
    pub target: Vec<(usize, usize)>,
    /// The smooth error that they share.
    pub field: Option<Box<Field>>,
}

impl Points {
    /// Three residuals a point, three more an orientation; those of an orientation that was not measured are zero.
    pub fn rows_a_spot(&self) -> usize {
        if self.oriented { 6 } else { 3 }
    }

    /// Where the search for the transform starts: at the best for weights that are alike in all directions and for
    /// orientations whose errors are small angles. Of points on a line the turn about it has a second optimum, and
    /// small steps from elsewhere may end in either.
    pub(super) fn start(&self, state: &State) -> Transform {
        let target = self.turned_target(state.extras);
        let at = |s: &Spot| {
            let place = &state.places[s.pose];
            place.point_mm + Points::on_body(place, &target, s).unwrap_or_else(Vector3::zeros)
        };
        let seen = |s: &Spot| s.point_mm - s.gained(state.extras);
        if !self.oriented {
            return fitted_frame(self.spots.iter().map(|s| (at(s), seen(s), s.weight * s.weight)));
        }
        // Half the square of the difference of two rotation matrices is the square of a small angle between them.
        let turns: Matrix3<f64> = self.spots.iter().fold(Matrix3::zeros(), |sum, s| {
            let measured = s.rotation.map(|measured| measured * (state.places[s.pose].rotation * target).transpose());
            sum + 0.5 * (s.weight / state.scatter.rotation_rad).powi(2) * measured.unwrap_or_else(Matrix3::zeros)
        });
        let weight = |s: &Spot| s.whitener.norm_squared() / 3.0;
        fitted_frame_with_turns(self.spots.iter().map(|s| (at(s), seen(s), weight(s))), &turns)
    }

    /// Whether the search for the transform ends where it starts: at the closed form for points that weigh alike in all
    /// directions.
    pub(super) fn start_is_best(&self) -> bool {
        !self.oriented && self.field.is_none() && self.alike
    }

    /// Numbers that were measured with some weight.
    pub fn count(&self) -> usize {
        let of_spot = |s: &Spot| if self.oriented && s.rotation.is_some() { 6 } else { 3 };
        self.spots.iter().filter(|s| s.weight > 0.0).map(of_spot).sum()
    }

    /// `flange_from_target` as the extra unknowns turn it.
    pub fn turned_target(&self, extras: &[f64]) -> Matrix3<f64> {
        let mut turn: Vector3<f64> = Vector3::zeros();
        for &(k, axis) in &self.target {
            turn[axis] += extras.get(k).copied().unwrap_or(0.0) * RAD_PER_MRAD;
        }
        Rotation3::from_scaled_axis(turn).into_inner() * self.flange_from_target
    }

    /// From the mark point to what a spot shows of a body of several targets, base frame, mm; `None` where it shows the
    /// mark point.
    fn on_body(place: &Place, flange_from_target: &Matrix3<f64>, spot: &Spot) -> Option<Vector3<f64>> {
        spot.on_body_mm.map(|part| place.rotation * (flange_from_target * part))
    }

    /// Of each spot: its place as the transform turns it, and what it is off by, sensor frame, mm.
    fn turned(&self, state: &State, frame: &Transform) -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>)> {
        let (rotation, flange_from_target) = (rotation_matrix(frame), self.turned_target(state.extras));
        self.spots.iter().map(move |spot| {
            let place = &state.places[spot.pose];
            let part = Points::on_body(place, &flange_from_target, spot).unwrap_or_else(Vector3::zeros);
            let turned = rotation * (place.point_mm.coords + part);
            (turned, turned + frame.translation.vector - spot.point_mm.coords + spot.gained(state.extras))
        })
    }

    fn residuals(&self, state: &State, frame: &Transform) -> Vec<Vector3<f64>> {
        self.turned(state, frame).map(|(_, residual)| residual).collect()
    }

    /// Of each spot what its orientation is off by, a rotation vector in the sensor's frame, rad, and its weight,
    /// 1/rad; `None` where it has none.
    fn turns(&self, state: &State, frame: &Transform) -> impl Iterator<Item = Option<(Vector3<f64>, f64)>> {
        let (rotation, flange_from_target) = (rotation_matrix(frame), self.turned_target(state.extras));
        self.spots.iter().map(move |spot| {
            let measured = spot.rotation.as_ref().filter(|_| self.oriented)?;
            let turn = turn(&(rotation * state.places[spot.pose].rotation), &flange_from_target, measured);
            Some((turn, spot.weight / state.scatter.rotation_rad))
        })
    }

    /// White residuals, before a smooth error is taken off.
    fn white(&self, state: &State, frame: &Transform) -> DVector<f64> {
        let rows = self.rows_a_spot();
        let mut white = DVector::zeros(rows * self.spots.len());
        let rows_of_spots = white.as_mut_slice().chunks_exact_mut(rows);
        for ((white, spot), (_, residual)) in rows_of_spots.zip(&self.spots).zip(self.turned(state, frame)) {
            white[..3].copy_from_slice((spot.whitener * residual).as_slice());
        }
        if self.oriented {
            for (white, turn) in white.as_mut_slice().chunks_exact_mut(rows).zip(self.turns(state, frame)) {
                if let Some((turn, weight)) = turn {
                    white[3..].copy_from_slice((weight * turn).as_slice());
                }
            }
        }
        white
    }

    /// Squares and products of the residuals and of their derivatives with respect to a small motion of the transform,
    /// spot by spot.
    pub(super) fn normal(&self, state: &State, frame: &Transform) -> Normal {
        if self.field.is_some() {
            return Normal::new(self.inner(state, frame));
        }
        let (mut cost, mut by_turn, mut by_shift) = (0.0, Vector3::zeros(), Vector3::zeros());
        let (mut turn_turn, mut shift_turn, mut shift_shift) = (Matrix3::zeros(), Matrix3::zeros(), Matrix3::zeros());
        let of_spots = self.turned(state, frame).zip(self.turns(state, frame));
        for (spot, ((turned, residual), turn)) in self.spots.iter().zip(of_spots) {
            let precision = spot.whitener.tr_mul(&spot.whitener);
            let (pull, swing) = (precision * residual, -turned.cross_matrix());
            let pull_of_swing = precision * swing;
            cost += residual.dot(&pull);
            by_turn += swing.tr_mul(&pull);
            by_shift += pull;
            turn_turn += swing.tr_mul(&pull_of_swing);
            shift_turn += pull_of_swing;
            shift_shift += precision;
            if let Some((turn, weight)) = turn {
                let precision = weight * weight;
                cost += precision * turn.norm_squared();
                by_turn += precision * turn;
                turn_turn += Matrix3::from_diagonal_element(precision);
            }
        }
        let gradient = DVector::from_iterator(6, by_turn.iter().chain(&by_shift).copied());
        let mut matrix = DMatrix::zeros(6, 6);
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn_turn);
        matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&shift_turn);
        matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&shift_turn.transpose());
        matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&shift_shift);
        Normal { cost, gradient, matrix }
    }

    /// White residuals and their derivatives with respect to a small motion of the transform.
    pub(super) fn inner(&self, state: &State, frame: &Transform) -> (DVector<f64>, DMatrix<f64>) {
        let rows = self.rows_a_spot();
        let residuals = self.white(state, frame);
        let mut design = DMatrix::zeros(residuals.len(), 6);
        let of_spots = self.turned(state, frame).zip(self.turns(state, frame));
        for (i, (spot, ((turned, _), turn))) in self.spots.iter().zip(of_spots).enumerate() {
            design.fixed_view_mut::<3, 6>(rows * i, 0).copy_from(&(spot.whitener * rigid_columns(&turned)));
            if let Some((_, weight)) = turn {
                let of_turn = Matrix3::from_diagonal_element(weight);
                design.fixed_view_mut::<3, 3>(rows * i + 3, 0).copy_from(&of_turn);
            }
        }
        let Some(field) = &self.field else { return (residuals, design) };
        let mut all = design.insert_column(6, 0.0);
        all.set_column(6, &residuals);
        field.whiten(&mut all);
        (all.column(6).into_owned(), all.remove_column(6))
    }

    /// White residuals.
    pub(super) fn left(&self, state: &State, frame: &Transform) -> DVector<f64> {
        if self.field.is_some() { self.inner(state, frame).0 } else { self.white(state, frame) }
    }

    pub(super) fn outer(&self, state: &State, frame: &Transform) -> DMatrix<f64> {
        let (rows, robot) = (self.rows_a_spot(), state.of_robot());
        let (rotation, flange_from_target) = (rotation_matrix(frame), self.turned_target(state.extras));
        let mut jacobian = DMatrix::zeros(rows * self.spots.len(), state.columns());
        for (i, spot) in self.spots.iter().enumerate() {
            let (place, row) = (&state.places[spot.pose], rows * i);
            let whiten = spot.whitener;
            jacobian.view_mut((row, 0), (3, robot)).copy_from(&(whiten * rotation * &place.point_columns));
            for (k, column) in spot.extra.column_iter().enumerate() {
                jacobian.fixed_view_mut::<3, 1>(row, robot + k).copy_from(&(whiten * column));
            }
            if let Some(part) = Points::on_body(place, &flange_from_target, spot) {
                let swing = -(whiten * rotation * part.cross_matrix());
                let mut of_robot = jacobian.view_mut((row, 0), (3, robot));
                of_robot += swing * &place.rotation_columns;
                for &(k, axis) in &self.target {
                    let mut of_turn = jacobian.fixed_view_mut::<3, 1>(row, robot + k);
                    of_turn += swing * place.rotation.column(axis) * RAD_PER_MRAD;
                }
            }
            if self.oriented && spot.rotation.is_some() {
                let weight = spot.weight / state.scatter.rotation_rad;
                let turn = rotation * weight;
                jacobian.view_mut((row + 3, 0), (3, robot)).copy_from(&(turn * &place.rotation_columns));
                let sensor_from_flange = turn * place.rotation * RAD_PER_MRAD;
                for &(k, axis) in &self.target {
                    jacobian.fixed_view_mut::<3, 1>(row + 3, robot + k).copy_from(&sensor_from_flange.column(axis));
                }
            }
        }
        if let Some(field) = &self.field {
            field.whiten(&mut jacobian);
        }
        jacobian
    }

    /// The smooth error at the spots, mm, as far as it is known.
    pub(super) fn smooth_mm(&self, state: &State, frame: &Transform) -> Vec<Vector3<f64>> {
        match &self.field {
            Some(field) => field.most_probable(&self.residuals(state, frame)),
            None => vec![Vector3::zeros(); self.spots.len()],
        }
    }

    pub(super) fn raw(&self, state: &State, frame: &Transform) -> Vec<(usize, f64, Raw)> {
        let mut list = Vec::new();
        let left = self.residuals(state, frame).into_iter().zip(self.smooth_mm(state, frame));
        for ((spot, (residual, smooth)), turn) in self.spots.iter().zip(left).zip(self.turns(state, frame)) {
            list.push((spot.pose, spot.weight, Raw::Point(residual - smooth, spot.covariance_mm2)));
            list.extend(turn.map(|(turn, _)| (spot.pose, spot.weight, Raw::Turn(turn))));
        }
        list
    }
}

/// Whether each of these weighs as much as its weight in all directions, in one unit for all.
pub(super) fn weigh_alike(spots: &[Spot]) -> bool {
    /// Of the whitener: far above its rounding, far below any difference of weights.
    const ALIKE: f64 = 1e-12;
    let Some(first) = spots.iter().find(|s| s.weight > 0.0) else { return false };
    let unit = first.whitener[(0, 0)] / first.weight;
    let is_alike = |s: &Spot| {
        let alike = Matrix3::from_diagonal_element(unit * s.weight);
        (s.whitener - alike).amax() <= ALIKE * unit
    };
    spots.iter().all(is_alike)
}

/// Predicted orientation after the measured one, as a rotation vector in the sensor's frame.
fn turn(sensor_from_flange: &Matrix3<f64>, flange_from_target: &Matrix3<f64>, measured: &Matrix3<f64>) -> Vector3<f64> {
    rotation_vector_of_matrix(&(sensor_from_flange * flange_from_target * measured.transpose()))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3xX, Point3};

    use super::*;
    use crate::geometry::transform;
    use crate::identify::sensor::Scatter;
    use crate::linear_algebra::solution;

    /// Forty points of a robot along 300 mm, off the line by up to `off_mm`, and as a sensor reads them that stands
    /// turned about it.
    fn along(off_mm: f64, sensor_from_base: Transform) -> (Points, Vec<Place>) {
        let at = |k: usize| {
            let k = k as f64;
            Point3::new(500.0 + k * 300.0 / 39.0, off_mm * (1.3 * k).sin(), 200.0 + off_mm * (2.1 * k).cos())
        };
        let place = |k| Place {
            point_mm: at(k),
            rotation: Matrix3::identity(),
            point_columns: Matrix3xX::zeros(0),
            rotation_columns: Matrix3xX::zeros(0),
        };
        let spot = |k| Spot {
            pose: k,
            point_mm: sensor_from_base * at(k),
            covariance_mm2: Matrix3::identity(),
            whitener: Matrix3::identity(),
            on_body_mm: None,
            rotation: None,
            weight: 1.0,
            extra: Matrix3xX::zeros(0),
        };
        let spots: Vec<Spot> = (0..40).map(spot).collect();
        let (flange_from_target, target) = (Matrix3::identity(), Vec::new());
        let points = Points { spots, alike: true, flange_from_target, oriented: false, target, field: None };
        (points, (0..40).map(place).collect())
    }

    #[test]
    fn points_start_at_the_best_turn_and_orientations_near_it() {
        let scatter = Scatter { rotation_rad: 1e-3, ..Scatter::of_point(1.0) };
        let state = |places: &[Place]| State { places: places.to_vec(), extras: &[], scatter: &scatter };
        for turn_rad in [0.3, 1.7, 3.1] {
            let sensor_from_base = transform(Vector3::new(turn_rad, 0.0, 0.0), Vector3::new(10.0, -70.0, 900.0));
            for off_mm in [0.01, 0.3, 0.6] {
                let (points, places) = along(off_mm, sensor_from_base);
                let start = points.start(&state(&places));
                let misses = points.spots.iter().map(|s| (start * places[s.pose].point_mm - s.point_mm).norm());
                let miss = misses.fold(0.0, f64::max);
                assert!(miss < 1e-6, "{turn_rad} rad {off_mm} mm: {miss}");
            }
            // Orientations of some mrad: one small step from the start is what is left.
            let (mut points, mut places) = along(30.0, sensor_from_base);
            points.oriented = true;
            for (k, (spot, place)) in points.spots.iter_mut().zip(&mut places).enumerate() {
                let wave = Vector3::new((0.7 * k as f64).sin(), (1.9 * k as f64).cos(), (2.3 * k as f64).sin());
                place.rotation = Rotation3::from_scaled_axis(2.0 * wave).into_inner();
                let off = Rotation3::from_scaled_axis(3e-3 * wave.yzx()).into_inner();
                spot.rotation = Some(off * rotation_matrix(&sensor_from_base) * place.rotation);
                place.point_mm += wave;
            }
            let state = state(&places);
            // The turn by which a step of the search goes on from a start, rad.
            let step_from = |start: &Transform| {
                let normal = points.normal(&state, start);
                solution(&normal.matrix, &normal.gradient).rows(0, 3).norm()
            };
            let mut by_points = points.clone();
            by_points.oriented = false;
            let (with, without) = (step_from(&points.start(&state)), step_from(&by_points.start(&state)));
            assert!(with < 1e-7 && without > 1e-5, "{turn_rad} rad: {with} {without}");
        }
    }

    #[test]
    fn the_closed_form_is_the_best_only_where_points_weigh_alike() {
        let sensor_from_base = transform(Vector3::new(0.4, 0.2, -0.3), Vector3::new(10.0, -70.0, 900.0));
        let (mut points, mut places) = along(30.0, sensor_from_base);
        for (k, (spot, place)) in points.spots.iter_mut().zip(&mut places).enumerate() {
            spot.weight = 0.2 + (0.9 * k as f64).sin().abs();
            spot.whitener = Matrix3::identity() * (7.0 * spot.weight);
            place.point_mm.x += 0.1 * (1.7 * k as f64).sin();
        }
        let scatter = Scatter::of_point(1.0);
        points.alike = weigh_alike(&points.spots);
        // The share of the residuals that a small rigid motion could still take away.
        let left = |points: &Points| {
            let state = State { places: places.clone(), extras: &[], scatter: &scatter };
            let (residuals, design) = points.inner(&state, &points.start(&state));
            let share = (design.clone().qr().q().tr_mul(&residuals)).norm() / residuals.norm();
            let normal = points.normal(&state, &points.start(&state));
            let expected = Normal::new((residuals.clone(), design.clone()));
            assert!((&normal.matrix - &expected.matrix).amax() < 1e-9 * expected.matrix.amax());
            assert!((normal.cost / expected.cost - 1.0).abs() < 1e-9);
            share
        };
        assert!(points.start_is_best() && left(&points) < 1e-9, "{}", left(&points));
        let changed = |change: &dyn Fn(&mut Spot)| {
            let mut changed = points.clone();
            change(&mut changed.spots[3]);
            changed.alike = weigh_alike(&changed.spots);
            changed
        };
        let unlike = changed(&|spot| spot.whitener[(2, 2)] *= 1.5);
        assert!(!unlike.start_is_best() && left(&unlike) > 1e-6);
        let mut oriented = points.clone();
        oriented.oriented = true;
        let outlier = changed(&|spot| spot.weight *= 2.0);
        assert!([oriented, outlier].iter().all(|p| !p.start_is_best()));
    }
}
