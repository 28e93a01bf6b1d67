//! Robots fitted to parts of the rows: one for all of them, or one a part.
//!
//! In: the nominal robot, and points with their joints, cut into parts. Out: what is left, how many numbers the
//! unknowns took, and the scatter that follows. Each placement of each part, and the target's place in each part, are
//! unknowns of their own in either case, so that a sensor or a tool that was moved between parts costs one robot
//! nothing. Gauss and Newton's steps with the placements eliminated; the links are held by a loose prior. Goes wrong:
//! parts whose rows are no more than their unknowns; they leave nothing, and count no degrees of freedom.

use std::collections::BTreeSet;

use nalgebra::{DMatrix, DVector, Point3, Vector3};

use crate::geometry::{fitted_frame, rigid_columns};
use crate::identify::model::kinematics::{Kinematics, Place};
use crate::linear_algebra::{Eliminated, product, pseudo_inverse};
use crate::robot::{Parameter, Robot, Unit};
use crate::statistics::median;

/// How far links are built from their file, mm and mrad, and how far the target may stand from where the file has it,
/// mm: loose.
const LINK: [f64; 2] = [3.0, 10.0];
const TARGET_MM: f64 = 1000.0;

/// Steps, of which the first ones bring the target near; and from a fit to more rows on.
const STEPS: usize = 8;
const STEPS_NEAR: usize = 3;

/// Scatter before anything is known, mm, and its limits: what is below is rounding.
const FIRST_MM: f64 = 0.1;
const LEAST_MM: f64 = 1e-4;
const LARGEST_MM: f64 = 1e3;

/// Medians from which on an error is a gross one, and below which it keeps its whole influence on the way.
const GROSS: f64 = 5.0;
const WHOLE: f64 = 1.5;

/// Unknowns of a placement, and of a target's place.
pub(super) const PLACEMENT: usize = 6;
pub(super) const TARGET: usize = 3;

/// Steps of a joint's zero by which its best value is found, rad and mm, and times that it is looked for anew around
/// the best: far from it the squares are no parabola.
const ZERO_STEP: [f64; 2] = [1e-3, 0.5];
const VERTICES: usize = 3;

/// The typical size of an error.
fn typical_mm(errors_mm: &[Vector3<f64>]) -> f64 {
    median(errors_mm.iter().map(Vector3::norm)).unwrap_or(0.0).max(LEAST_MM)
}

/// Points with the joints that they were measured at.
#[derive(Debug, Clone)]
pub(super) struct Points {
    pub(super) robot: Robot,
    /// Of the links, and behind them the target's place.
    pub(super) parameters: Vec<Parameter>,
    pub(super) joints_rad: Vec<Vec<f64>>,
    pub(super) points_mm: Vec<Point3<f64>>,
    pub(super) groups: Vec<usize>,
    /// Of each row, which of several tools it is of, from 0; empty where all are of one.
    pub(super) tools: Vec<usize>,
    /// Of each row, whether it is under the load whose weight on the joints is among the parameters; empty where there
    /// is none.
    pub(super) loaded: Vec<bool>,
}

/// Changes the weights of all rows by their errors, mm.
type Weigh<'a> = dyn FnMut(&[Vector3<f64>], &mut [f64]) + 'a;

/// What a fit leaves.
#[derive(Debug, Clone)]
pub(super) struct Left {
    /// Sum of the squares, mm^2; numbers measured less those of the placements; numbers that the other unknowns took.
    pub(super) squares: f64,
    numbers: f64,
    pub(super) taken: f64,
    /// Each row's error, base frame, mm, in the order of the parts' rows.
    pub(super) errors_mm: Vec<Vector3<f64>>,
}

impl Left {
    /// Degrees of freedom that are left; none is never quite none.
    pub(super) fn freedom(&self) -> f64 {
        (self.numbers - self.taken).max(f64::EPSILON)
    }

    /// Scatter of a coordinate, mm.
    pub(super) fn scatter_mm(&self) -> f64 {
        (self.squares / self.freedom()).sqrt()
    }

    /// The logarithm of the likelihood of a cause that took so many numbers of so many rows, but for a constant. The
    /// three coordinates of a row share what the model lacks, and count as one number; what is free costs as Schwarz
    /// has it.
    pub(super) fn likelihood(&self, rows: usize, free: f64) -> f64 {
        let numbers = TARGET as f64 * rows as f64;
        -(numbers * self.squares.max(f64::MIN_POSITIVE).ln() + free * numbers.ln()) / 6.0
    }

    /// Takes the weight of those of its rows that are gross errors.
    pub(super) fn leave_out_gross(&self, rows: &[usize], weights: &mut [f64]) {
        let limit = GROSS * typical_mm(&self.errors_mm);
        rows.iter()
            .zip(&self.errors_mm)
            .filter(|(_, error)| error.norm() > limit)
            .for_each(|(&row, _)| weights[row] = 0.0);
    }

    pub(super) fn and(mut self, other: Left) -> Left {
        self.errors_mm.extend(other.errors_mm);
        Left {
            squares: self.squares + other.squares,
            numbers: self.numbers + other.numbers,
            taken: self.taken + other.taken,
            errors_mm: self.errors_mm,
        }
    }
}

impl Points {
    /// One robot for all parts.
    pub(super) fn together(&self, parts: &[Vec<usize>], weights: &[f64]) -> Left {
        self.solved(parts, weights).0
    }

    /// The same, and where it ends. A part by itself hardly tells its tool from its placement, and from a file that is
    /// far off the steps may end in between: so from the robot of all rows with one tool as well.
    pub(super) fn solved(&self, parts: &[Vec<usize>], weights: &[f64]) -> (Left, DVector<f64>) {
        let from = |parts: &[Vec<usize>], start| self.fitted(parts, start, STEPS, weights.to_vec(), &mut |_, _| ());
        let of_file = from(parts, self.at_file(parts));
        if parts.len() == 1 {
            return of_file;
        }
        let whole = [parts.concat()];
        let (_, one) = from(&whole, self.at_file(&whole));
        let of_links = self.parameters.len() - TARGET;
        let mut start = of_file.1.clone();
        start.rows_mut(0, of_links).copy_from(&one.rows(0, of_links));
        for part in 0..parts.len() {
            start.rows_mut(of_links + TARGET * part, TARGET).copy_from(&one.rows(of_links, TARGET));
        }
        let of_one = from(parts, start);
        if of_one.0.scatter_mm() < of_file.0.scatter_mm() { of_one } else { of_file }
    }

    /// One robot for all parts, from where one without the last parameters before the target's place ended.
    pub(super) fn together_from(&self, parts: &[Vec<usize>], weights: &[f64], near: &DVector<f64>) -> Left {
        let more = self.at_file(parts).len() - near.len();
        let start = near.clone().insert_rows(self.parameters.len() - TARGET - more, more, 0.0);
        self.fitted(parts, start, STEPS, weights.to_vec(), &mut |_, _| ()).0
    }

    /// One robot for these rows with common placements, and where the further tools stand from the first, mm.
    pub(super) fn with_tools(&self, rows: Vec<usize>, weights: &[f64]) -> (Left, Vec<Vector3<f64>>) {
        let parts = [rows];
        let (left, x) = self.fitted(&parts, self.at_file(&parts), STEPS, weights.to_vec(), &mut |_, _| ());
        let tool = |k: usize| Vector3::from_fn(|axis, _| x[self.parameters.len() + TARGET * k + axis]);
        (left, (0..self.further_tools()).map(tool).collect())
    }

    fn further_tools(&self) -> usize {
        self.tools.iter().copied().max().unwrap_or(0)
    }

    /// One robot for all these rows with the influence of gross errors bounded: where it ends, and what it leaves.
    pub(super) fn bounded(&self, rows: &[usize], near: Option<&DVector<f64>>) -> (Left, DVector<f64>) {
        let parts = [rows.to_vec()];
        let (start, steps) = near.map_or_else(|| (self.at_file(&parts), STEPS), |x| (x.clone(), STEPS_NEAR));
        self.fitted(&parts, start, steps, vec![1.0; self.points_mm.len()], &mut |errors, weights| {
            let typical = typical_mm(errors);
            for (&row, error) in rows.iter().zip(errors) {
                weights[row] = (WHOLE * typical / error.norm().max(LEAST_MM)).min(1.0);
            }
        })
    }

    /// A step of a joint's zero, rad (mm).
    pub(super) fn zero_step(&self, joint: usize) -> f64 {
        ZERO_STEP[usize::from(self.robot.joints[joint].slides)]
    }

    /// An amount of a joint's zero, rad (mm), for a person.
    pub(super) fn zero_said(&self, joint: usize, off: f64) -> String {
        if self.robot.joints[joint].slides { format!("{off:.3} mm") } else { format!("{:.3} deg", off.to_degrees()) }
    }

    /// What one robot for these rows leaves where a joint stands elsewhere in some, by as much as leaves least, and how
    /// far that is, rad (mm); `never` is what it leaves where the joint does not. Squares of errors are a parabola of
    /// that.
    pub(super) fn elsewhere(
        &self,
        joint: usize,
        there: &[usize],
        (rows, weights): (&[usize], &[f64]),
        never: &Left,
    ) -> Option<(Left, f64)> {
        let all = [rows.to_vec()];
        let at = |off: f64| {
            let mut points = self.clone();
            there.iter().for_each(|&row| points.joints_rad[row][joint] += off);
            points.together(&all, weights)
        };
        let step = self.zero_step(joint);
        let (mut off, mut left) = (0.0, never.clone());
        for _ in 0..VERTICES {
            let [less, more] = [off - step, off + step].map(|off| at(off).squares - left.squares);
            off += (less + more > 0.0).then(|| step * (less - more) / (2.0 * (less + more)))?;
            left = at(off);
        }
        Some((left, off))
    }

    /// The same with these parameters beside those of the links.
    pub(super) fn with_terms(&self, more: impl IntoIterator<Item = Parameter>) -> Points {
        let mut parameters = self.parameters.clone();
        let before_target = parameters.len() - TARGET;
        parameters.splice(before_target..before_target, more);
        Points { parameters, ..self.clone() }
    }

    /// Weights without the rows that are gross errors for the robot of their own part.
    pub(super) fn without_gross(&self, parts: &[Vec<usize>]) -> Vec<f64> {
        let mut kept = vec![1.0; self.points_mm.len()];
        for part in parts {
            self.bounded(part, None).0.leave_out_gross(part, &mut kept);
        }
        kept
    }

    /// The unknowns of some parts where the file has them.
    fn at_file(&self, parts: &[Vec<usize>]) -> DVector<f64> {
        DVector::zeros(self.parameters.len() + TARGET * (parts.len() - 1 + self.further_tools()))
    }

    /// What one robot leaves after so many steps, and where it ends; `weigh` hears the errors after each step and
    /// changes the weights of all rows.
    fn fitted(
        &self,
        parts: &[Vec<usize>],
        mut x: DVector<f64>,
        steps: usize,
        mut weights: Vec<f64>,
        weigh: &mut Weigh,
    ) -> (Left, DVector<f64>) {
        let kinematics: Vec<Kinematics> = parts.iter().map(|part| self.kinematics(part)).collect();
        let (mut left, mut step) = self.at(parts, &kinematics, &x, &weights, FIRST_MM);
        for _ in 0..steps {
            x += &step;
            weigh(&left.errors_mm, &mut weights);
            let scatter_mm = left.scatter_mm().clamp(LEAST_MM, LARGEST_MM);
            (left, step) = self.at(parts, &kinematics, &x, &weights, scatter_mm);
        }
        (left, x)
    }

    /// What is left at these values of the unknowns, and the step from there.
    fn at(
        &self,
        parts: &[Vec<usize>],
        kinematics: &[Kinematics],
        x: &DVector<f64>,
        weights: &[f64],
        scatter_mm: f64,
    ) -> (Left, DVector<f64>) {
        let (count, of_links) = (x.len(), self.parameters.len() - TARGET);
        let mut normal = DMatrix::zeros(count + 1, count + 1);
        let mut left = Left { squares: 0.0, numbers: 0.0, taken: 0.0, errors_mm: Vec::new() };
        for (p, (part, kinematics)) in parts.iter().zip(kinematics).enumerate() {
            let target = of_links + TARGET * p;
            let further = count - TARGET * self.further_tools();
            let at: Vec<usize> = (0..of_links).chain(target..target + TARGET).chain(further..count).collect();
            let offsets: Vec<f64> = at.iter().map(|&i| x[i]).collect();
            let (of_part, numbers, errors_mm) = self.normal(part, kinematics, &offsets, weights);
            let whole: Vec<usize> = at.into_iter().chain([count]).collect();
            for (r, &row) in whole.iter().enumerate() {
                whole.iter().enumerate().for_each(|(c, &column)| normal[(row, column)] += of_part[(r, c)]);
            }
            left.numbers += numbers;
            left.errors_mm.extend(errors_mm);
        }
        left.squares = normal[(count, count)];
        let measured = normal.view((0, 0), (count, count)).into_owned();
        let prior = self.prior(parts.len() + self.further_tools(), scatter_mm);
        let inverse = pseudo_inverse(&measured + DMatrix::from_diagonal(&prior));
        left.taken = product(&inverse, &measured).trace();
        let step = &inverse * (normal.view((0, count), (count, 1)) - prior.component_mul(x));
        (left, step.column(0).into_owned())
    }

    /// One robot for these rows with common placements, where each row's target is taken by the load if it is under it,
    /// and how far that is, mm.
    pub(super) fn under_load(&self, rows: &[usize], weights: &[f64]) -> (Left, Vec<Vector3<f64>>) {
        let parts = [rows.to_vec()];
        let (left, x) = self.fitted(&parts, self.at_file(&parts), STEPS, weights.to_vec(), &mut |_, _| ());
        let of_load: Vec<usize> = self.of_load().collect();
        let offsets = &x.as_slice()[..self.parameters.len()];
        let moved = |place: &Place| of_load.iter().map(|&i| place.point_columns.column(i) * offsets[i]).sum();
        (left, self.kinematics(rows).places(offsets, true).iter().map(moved).collect())
    }

    /// Where the load's weights stand among the parameters.
    fn of_load(&self) -> impl Iterator<Item = usize> + '_ {
        let is_of_load = |(_, parameter): &(usize, &Parameter)| matches!(parameter, Parameter::Gravity(..));
        self.parameters.iter().enumerate().filter(is_of_load).map(|(i, _)| i)
    }

    /// Where the rows' targets are: those that are not under the load know nothing of it.
    fn places(&self, part: &[usize], kinematics: &Kinematics, offsets: &[f64]) -> Vec<Place> {
        let mut places = kinematics.places(offsets, true);
        if !self.loaded.is_empty() {
            let mut without = offsets.to_vec();
            self.of_load().for_each(|i| without[i] = 0.0);
            let free = kinematics.places(&without, true);
            for (k, mut place) in free.into_iter().enumerate().filter(|(k, _)| !self.loaded[part[*k]]) {
                self.of_load().for_each(|i| place.point_columns.column_mut(i).fill(0.0));
                places[k] = place;
            }
        }
        places
    }

    fn kinematics(&self, part: &[usize]) -> Kinematics {
        let joints: Vec<&[f64]> = part.iter().map(|&row| self.joints_rad[row].as_slice()).collect();
        Kinematics::new(&self.robot, &self.robot, &self.parameters, &joints)
    }

    /// Inverse variances of the links and of the parts' targets, in units of the scatter.
    fn prior(&self, parts: usize, scatter_mm: f64) -> DVector<f64> {
        let links = self.parameters.iter().take(self.parameters.len() - TARGET);
        let sigmas = links.map(|p| if p.unit() == Unit::Mm { LINK[0] } else { LINK[1] });
        let all: Vec<f64> = sigmas.chain(std::iter::repeat_n(TARGET_MM, TARGET * parts)).collect();
        DVector::from_iterator(all.len(), all.iter().map(|sigma| (scatter_mm / sigma).powi(2)))
    }

    /// Where the offsets of a row's tool stand, if it is a further one.
    fn further_tool(&self, row: usize) -> Option<usize> {
        let k = self.tools.get(row)?.checked_sub(1)?;
        Some(self.parameters.len() + TARGET * k)
    }

    /// How far a further tool takes the point of a row, mm.
    fn of_tool(&self, row: usize, place: &Place, offsets: &[f64]) -> Vector3<f64> {
        let Some(at) = self.further_tool(row) else { return Vector3::zeros() };
        let columns = place.point_columns.columns(self.parameters.len() - TARGET, TARGET);
        (0..TARGET).map(|axis| columns.column(axis) * offsets[at + axis]).sum()
    }

    /// The normal equations of a part, its placements eliminated: of all parameters, and behind them of the residual;
    /// how many numbers were measured beyond those of the placements, and each row's error, mm.
    fn normal(
        &self,
        part: &[usize],
        kinematics: &Kinematics,
        offsets: &[f64],
        weights: &[f64],
    ) -> (DMatrix<f64>, f64, Vec<Vector3<f64>>) {
        let places = self.places(part, kinematics, &offsets[..self.parameters.len()]);
        let kept = offsets.len() + 1;
        let moved: Vec<Point3<f64>> =
            part.iter().zip(&places).map(|(&row, place)| place.point_mm + self.of_tool(row, place, offsets)).collect();
        let (mut normal, mut numbers, mut errors_mm) =
            (DMatrix::zeros(kept, kept), 0.0, vec![Vector3::zeros(); part.len()]);
        for group in part.iter().map(|&row| self.groups[row]).collect::<BTreeSet<usize>>() {
            let of_group: Vec<usize> = (0..part.len()).filter(|&i| self.groups[part[i]] == group).collect();
            let pair = |&i: &usize| (self.points_mm[part[i]], moved[i], weights[part[i]]);
            let weight: f64 = of_group.iter().map(|&i| weights[part[i]]).sum();
            // So few rows place nothing.
            if TARGET as f64 * weight <= PLACEMENT as f64 {
                continue;
            }
            let frame = fitted_frame(of_group.iter().map(pair));
            let mut columns = DMatrix::zeros(TARGET * of_group.len(), kept + PLACEMENT);
            for (k, &i) in of_group.iter().enumerate() {
                let root = weights[part[i]].sqrt();
                let error: Vector3<f64> = frame * self.points_mm[part[i]] - moved[i];
                errors_mm[i] = error;
                let mut rows = columns.rows_mut(TARGET * k, TARGET);
                rows.columns_mut(0, self.parameters.len()).copy_from(&(root * &places[i].point_columns));
                if let Some(at) = self.further_tool(part[i]) {
                    let columns = root * places[i].point_columns.columns(self.parameters.len() - TARGET, TARGET);
                    rows.columns_mut(at, TARGET).copy_from(&columns);
                }
                rows.column_mut(kept - 1).copy_from(&(root * error));
                rows.columns_mut(kept, PLACEMENT).copy_from(&(root * rigid_columns(&moved[i].coords)));
            }
            numbers += TARGET as f64 * weight - PLACEMENT as f64;
            normal += Eliminated::new(&product(&columns, &columns), kept).normal;
        }
        (normal, numbers, errors_mm)
    }
}
