//! Where the target stands on the flange, and where the sensor: what a nominal chain leaves of measured points once
//! both are solved.
//!
//! In: readings and points of one placement of the sensor. Out: the tool and what is left. Levenberg and Marquardt's
//! method on the placement's six numbers and the tool's three, from the placement that fits best with the tool of the
//! file (Kabsch, 1976). What goes wrong: a tool that the poses do not determine (one orientation) stays where the
//! damping leaves it, which costs nothing.

use nalgebra::{Point3, SMatrix, SVector, Vector3};

use super::Robot;
use crate::geometry::{Transform, fitted_frame, perturb, rigid_columns};
use crate::statistics::median;

/// How far off a tool is that was typed off a drawing, mm: the guide asks for no more than a centimetre, and the search
/// for the tool's tolerance starts there.
pub const TYPED_MM: f64 = 10.0;

/// Poses that are enough.
const POSES: usize = 60;

/// Fewest poses that have more numbers than unknowns.
const FEWEST: usize = 4;

/// Steps at the most.
const STEPS: usize = 40;

/// Times the middle distance beyond which a row does not take part: nine standard deviations of normal errors in three
/// coordinates.
const GROSS: f64 = 6.0;

/// Rounds of choosing the rows.
const ROUNDS: usize = 10;

/// Rows that are enough to leave others out: three numbers each against the nine unknowns.
const ENOUGH: usize = 8;

/// A start from which this share of the points' spread is left needs no other.
const SETTLED: f64 = 0.01;

/// What a nominal chain leaves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolFit {
    /// Where the points were measured, from the robot's base.
    pub sensor_from_base: Transform,
    /// The target in the last frame, mm.
    pub tool_mm: Vector3<f64>,
    /// Middle distance of a predicted point from the measured one, mm.
    pub left_mm: f64,
    /// Middle distance of the measured points from their middle, mm.
    pub spread_mm: f64,
}

impl Robot {
    /// Middle distance of the points that this robot predicts from the measured ones, mm, once the sensor is placed;
    /// rows that miss by several times as much do not help to place it.
    pub fn left_mm(&self, joints_rad: &[Vec<f64>], points_mm: &[Point3<f64>]) -> Option<f64> {
        let rows = self.rows(joints_rad, points_mm, 1);
        let start = (placed(&close(&rows)?, &self.tool_mm), self.tool_mm);
        let (frame, tool) = without_gross(&rows, start, |near, _, tool| (placed(near, &tool), tool));
        Some(middle(&rows, &frame, &tool)).filter(|left| left.is_finite())
    }

    fn rows(&self, joints_rad: &[Vec<f64>], points_mm: &[Point3<f64>], step: usize) -> Vec<Row> {
        let row = |(q, p): (&Vec<f64>, &Point3<f64>)| Row { flange: self.base_from_flange(q), point: p.coords };
        joints_rad.iter().zip(points_mm).step_by(step).map(row).collect()
    }

    /// The tool with which this chain comes nearest to the points; `None` for fewer than four poses. Up to a fifth of
    /// the rows may be gross errors (a reading that failed, a mean below the table).
    pub fn fit_tool(&self, joints_rad: &[Vec<f64>], points_mm: &[Point3<f64>], from: Start) -> Option<ToolFit> {
        let count = joints_rad.len().min(points_mm.len());
        if count < FEWEST {
            return None;
        }
        fit(&self.rows(joints_rad, points_mm, count.div_ceil(POSES)), self.tool_mm, from)
    }

    /// The same of cameras on the flange that see a target that stands still: seen from the flange it is the base that
    /// moves, and the tool that is found is the target's place there.
    pub fn fit_backwards(&self, joints_rad: &[Vec<f64>], points_mm: &[Point3<f64>]) -> Option<ToolFit> {
        let count = joints_rad.len().min(points_mm.len());
        let mut all = self.rows(joints_rad, points_mm, count.div_ceil(POSES).max(1));
        all.iter_mut().for_each(|row| row.flange = row.flange.inverse());
        // A target may stand anywhere: about where the flange has been is as good a place as any.
        let middle = all.iter().map(|row| row.flange.inverse().translation.vector).sum::<Vector3<f64>>()
            / all.len().max(1) as f64;
        fit(&all, middle, Start::Around).filter(|_| count >= FEWEST)
    }
}

/// See [`Robot::fit_tool`].
fn fit(all: &[Row], tool_mm: Vector3<f64>, from: Start) -> Option<ToolFit> {
    let spread_mm = middle_spread(&all.iter().map(|row| row.point).collect::<Vec<_>>())?;
    let close = close(all)?;
    let of_start = |tool| without_gross(all, descended(&close, placed(&close, &tool), tool), descended);
    let left = |(frame, tool): &(Transform, Vector3<f64>)| middle(all, frame, tool);
    let mut best = of_start(tool_mm);
    if from == Start::Around && left(&best) > SETTLED * spread_mm {
        let off = |k: usize| Vector3::ith(k % 3, if k < 3 { spread_mm } else { -spread_mm });
        let others = (0..6).map(|k| of_start(tool_mm + off(k)));
        best = others.fold(best, |best, other| if left(&other) < left(&best) { other } else { best });
    }
    let left_mm = left(&best);
    left_mm.is_finite().then_some(ToolFit { sensor_from_base: best.0, tool_mm: best.1, left_mm, spread_mm })
}

/// Where the search for a tool begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// At the tool of the file.
    File,
    /// There, and where that comes not near, around it, as far off as the points are apart: where the wrist alone
    /// turned, the place of the file's tool says nothing of the sensor's.
    Around,
}

/// The rows to begin with: without points that lie many times as far from the middle as half of the points do. A
/// reading that failed at zero, far from a wrist that turned a little, would decide the placement of all others.
fn close(rows: &[Row]) -> Option<Vec<Row>> {
    /// Points that are spread like a line, a disc or a ball lie within two to four times.
    const FAR: f64 = 10.0;
    let points: Vec<Vector3<f64>> = rows.iter().map(|row| row.point).collect();
    let (centre, spread_mm) = (middle_of(&points)?, middle_spread(&points)?);
    let is_close = |row: &&Row| (row.point - centre).norm() <= FAR * spread_mm;
    let close: Vec<Row> = rows.iter().filter(is_close).copied().collect();
    Some(if close.len() < ENOUGH { rows.to_vec() } else { close })
}

fn middle_of(points: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let [x, y, z] = [0, 1, 2].map(|axis| median(points.iter().map(|p| p[axis])));
    Some(Vector3::new(x?, y?, z?))
}

/// Middle distance of points from their middle, mm: angles that jump by a turn spread no farther than the others.
pub fn middle_spread(points: &[Vector3<f64>]) -> Option<f64> {
    let centre = middle_of(points)?;
    median(points.iter().map(|p| (p - centre).norm()))
}

/// A pose: where the flange is, and the point that was measured.
#[derive(Clone, Copy)]
struct Row {
    flange: Transform,
    point: Vector3<f64>,
}

impl Row {
    fn off(&self, frame: &Transform, tool: &Vector3<f64>) -> Vector3<f64> {
        (frame * (self.flange * Point3::from(*tool))).coords - self.point
    }
}

/// Middle distance of these from the measured ones, mm.
fn middle(rows: &[Row], frame: &Transform, tool: &Vector3<f64>) -> f64 {
    median(rows.iter().map(|row| row.off(frame, tool).norm())).unwrap_or(f64::INFINITY)
}

/// A placement and a tool fitted again to the four fifths of the rows that they come nearest to, until these are the
/// same (the concentration steps of Rousseeuw and Van Driessen, Technometrics 41, 1999), and then to all but those that
/// miss by many times what the middle one does.
fn without_gross(
    all: &[Row],
    (mut frame, mut tool): (Transform, Vector3<f64>),
    fit: impl Fn(&[Row], Transform, Vector3<f64>) -> (Transform, Vector3<f64>),
) -> (Transform, Vector3<f64>) {
    let fifth = all.len() / 5;
    if fifth == 0 || all.len() - fifth < ENOUGH {
        return (frame, tool);
    }
    let nearest = |count: usize, frame: &Transform, tool: &Vector3<f64>| -> Vec<usize> {
        let mut order: Vec<usize> = (0..all.len()).collect();
        order.sort_by(|a, b| all[*a].off(frame, tool).norm().total_cmp(&all[*b].off(frame, tool).norm()));
        order.truncate(count);
        order.sort_unstable();
        order
    };
    let of = |rows: &[usize]| rows.iter().map(|&i| all[i]).collect::<Vec<Row>>();
    let mut taken = Vec::new();
    for _ in 0..ROUNDS {
        let near = nearest(all.len() - fifth, &frame, &tool);
        if near == taken {
            break;
        }
        (frame, tool) = fit(&of(&near), frame, tool);
        taken = near;
    }
    let limit = GROSS * middle(all, &frame, &tool);
    let near: Vec<Row> = all.iter().filter(|row| row.off(&frame, &tool).norm() <= limit).copied().collect();
    fit(&near, frame, tool)
}

/// The placement that takes this tool's points nearest to the measured ones.
fn placed(rows: &[Row], tool: &Vector3<f64>) -> Transform {
    fitted_frame(rows.iter().map(|row| (row.flange * Point3::from(*tool), Point3::from(row.point), 1.0)))
}

/// The least squares of placement and tool from these on.
fn descended(rows: &[Row], mut frame: Transform, mut tool: Vector3<f64>) -> (Transform, Vector3<f64>) {
    let residuals = |frame: &Transform, tool: &Vector3<f64>| -> Vec<Vector3<f64>> {
        rows.iter().map(|r| r.off(frame, tool)).collect()
    };
    let cost = |r: &[Vector3<f64>]| r.iter().map(Vector3::norm_squared).sum::<f64>();
    let (mut now, mut damping) = (residuals(&frame, &tool), 1e-6);
    for _ in 0..STEPS {
        let (mut normal, mut gradient) = (SMatrix::<f64, 9, 9>::zeros(), SVector::<f64, 9>::zeros());
        for (row, residual) in rows.iter().zip(&now) {
            let turned = frame.rotation * (row.flange * Point3::from(tool)).coords;
            let mut jacobian = SMatrix::<f64, 3, 9>::zeros();
            jacobian.fixed_view_mut::<3, 6>(0, 0).copy_from(&rigid_columns(&turned));
            let of_tool = (frame.rotation * row.flange.rotation).to_rotation_matrix().into_inner();
            jacobian.fixed_view_mut::<3, 3>(0, 6).copy_from(&of_tool);
            normal += jacobian.transpose() * jacobian;
            gradient += jacobian.transpose() * residual;
        }
        for i in 0..9 {
            normal[(i, i)] *= 1.0 + damping;
            normal[(i, i)] += f64::MIN_POSITIVE;
        }
        let Some(step) = normal.cholesky().map(|c| c.solve(&-gradient)) else {
            damping *= 10.0;
            continue;
        };
        let next = perturb(&frame, step.as_slice());
        let moved = tool + step.fixed_rows::<3>(6);
        let then = residuals(&next, &moved);
        let (before, after) = (cost(&now), cost(&then));
        if after < before {
            (frame, tool, now, damping) = (next, moved, then, (damping / 10.0).max(1e-12));
            if after > before * (1.0 - 1e-6) {
                break;
            }
        } else {
            damping *= 10.0;
        }
    }
    (frame, tool)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::transform;

    /// What a sensor somewhere sees of the paper's robot with this tool.
    fn seen(tool_mm: Vector3<f64>, joints: &[Vec<f64>]) -> Vec<Point3<f64>> {
        let truth = Robot { tool_mm, ..Robot::paper() };
        let sensor = transform(Vector3::new(0.4, 2.0, -0.7), Vector3::new(900.0, -2000.0, 300.0));
        joints.iter().map(|q| sensor * truth.target_mm(q)).collect()
    }

    #[test]
    fn a_tool_that_the_file_lacks_is_found() {
        for size in [0.0, 50.0, 400.0] {
            let tool_mm = Vector3::new(0.4, -0.3, 0.86) * size;
            let joints: Vec<Vec<f64>> =
                (0..20).map(|i| (0..6).map(|j| ((7 * i + 3 * j * j) as f64).sin() * 1.4).collect()).collect();
            let points = seen(tool_mm, &joints);
            let found = Robot::paper().fit_tool(&joints, &points, Start::File).unwrap();
            assert!((found.tool_mm - tool_mm).norm() < 1e-3 && found.left_mm < 1e-3, "{size}: {found:?}");
            // Metres taken for mm leave about as much as the points are apart.
            let small: Vec<Point3<f64>> = points.iter().map(|p| p / 1000.0).collect();
            assert!(Robot::paper().fit_tool(&joints, &small, Start::Around).unwrap().left_mm > 10.0);
            // Readings that failed, at zero.
            let mut failed = points.clone();
            for bad in [3, 11, 12, 17] {
                failed[bad] = Point3::origin();
                let found = Robot::paper().fit_tool(&joints, &failed, Start::File).unwrap();
                assert!(found.left_mm < 1e-3 && (found.tool_mm - tool_mm).norm() < 1e-3, "{size}: {found:?}");
            }
        }
    }

    #[test]
    fn a_tool_about_which_the_wrist_turns_is_found() {
        let turns = |i: usize| vec![0.3, -0.2, 0.4, 0.1, (0.7 * i as f64).sin() * 0.8, 0.4 * i as f64 - 2.0];
        let joints: Vec<Vec<f64>> = (0..12).map(turns).collect();
        let mut points = seen(Vector3::new(24.0, -10.0, 55.0), &joints);
        assert!(Robot::paper().fit_tool(&joints, &points, Start::Around).unwrap().left_mm < 1e-2);
        // A row that was left at zero, metres away.
        points[0] = Point3::origin();
        assert!(Robot::paper().fit_tool(&joints, &points, Start::Around).unwrap().left_mm < 1e-2);
    }
}
