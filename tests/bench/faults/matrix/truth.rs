//! How far a written rig is from the true one, in figures that a user has: lengths and points of fresh boards.
//!
//! The true rig projects a fresh board's corners, the written rig triangulates them. Everything from `calibration.json`
//! on is code of its own here: nothing is shared with what is being judged.

use nalgebra::{Matrix3, Point2, Point3, Rotation3, Vector2, Vector3};
use serde_json::Value;
use stereocal::geometry::Transform;
use stereocal::imaging::Board;
use stereocal::simulate::check_poses::{self, Holding};
use stereocal::simulate::physical_board::{PhysicalBoard, Workmanship};
use stereocal::stereo::{Camera, Rig};

use super::set::Set;

/// Boards that are measured.
const BOARDS: usize = 40;

/// Lengths of so many squares are measured, besides the longest.
const SQUARES: usize = 7;

/// How the written rig does on fresh boards.
#[derive(Debug, Clone, Copy, Default)]
pub struct Deviation {
    /// Largest error of a length, mm.
    pub length_mm: f64,
    /// Largest error of a length over its own standard deviation by the written covariance.
    pub length_sigmas: Option<f64>,
    /// Largest Mahalanobis distance of a point, by the written covariance.
    pub point_sigmas: Option<f64>,
}

#[derive(Debug, Clone)]
struct Eye {
    focal: Vector2<f64>,
    middle: Vector2<f64>,
    lens: [f64; 14],
}

#[derive(Debug, Clone)]
struct Written {
    eyes: [Eye; 2],
    rotation: Matrix3<f64>,
    translation: Vector3<f64>,
}

impl Eye {
    fn read(json: &Value) -> Option<Eye> {
        let number = |name: &str| json[name].as_f64();
        let mut lens = [0.0; 14];
        for (term, value) in lens.iter_mut().zip(json["distortion"].as_array()?) {
            *term = value.as_f64()?;
        }
        Some(Eye {
            focal: Vector2::new(number("fx")?, number("fy")?),
            middle: Vector2::new(number("cx")?, number("cy")?),
            lens,
        })
    }

    /// OpenCV's lens on x/z, y/z.
    fn bend(&self, p: Vector2<f64>) -> Vector2<f64> {
        let k = &self.lens;
        let r = p.norm_squared();
        let gain = (1.0 + k[0] * r + k[1] * r.powi(2) + k[4] * r.powi(3))
            / (1.0 + k[5] * r + k[6] * r.powi(2) + k[7] * r.powi(3));
        let tangential = Vector2::new(
            2.0 * k[2] * p.x * p.y + k[3] * (r + 2.0 * p.x.powi(2)),
            k[2] * (r + 2.0 * p.y.powi(2)) + 2.0 * k[3] * p.x * p.y,
        );
        let prism = Vector2::new(k[8] * r + k[9] * r * r, k[10] * r + k[11] * r * r);
        let flat = p * gain + tangential + prism;
        // OpenCV turns the sensor about x by tauX, then about y by tauY, and puts it back along the ray of its axis.
        let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), -k[13])
            * Rotation3::from_axis_angle(&Vector3::x_axis(), -k[12]);
        let r = turn.matrix();
        let back = Matrix3::new(r[(2, 2)], 0.0, -r[(0, 2)], 0.0, r[(2, 2)], -r[(1, 2)], 0.0, 0.0, 1.0);
        let q = back * r * flat.push(1.0);
        Vector2::new(q.x / q.z, q.y / q.z)
    }

    /// The ray of a pixel, by Newton's method with differences.
    fn ray(&self, px: Point2<f64>) -> Vector3<f64> {
        let wanted = (px.coords - self.middle).component_div(&self.focal);
        let mut p = wanted;
        for _ in 0..60 {
            let miss = self.bend(p) - wanted;
            let step = 1e-6;
            let slope = |d: Vector2<f64>| (self.bend(p + d * step) - self.bend(p - d * step)) / (2.0 * step);
            let jacobian = nalgebra::Matrix2::from_columns(&[slope(Vector2::x()), slope(Vector2::y())]);
            let Some(change) = jacobian.lu().solve(&miss) else { break };
            p -= change;
            if change.norm() < 1e-13 {
                break;
            }
        }
        p.push(1.0)
    }
}

impl Written {
    fn of(rig: &Rig) -> Written {
        let eye =
            |c: &Camera| Eye { focal: Vector2::new(c.fx, c.fy), middle: Vector2::new(c.cx, c.cy), lens: c.distortion };
        let pose = &rig.right_from_left;
        let rotation = *pose.rotation.to_rotation_matrix().matrix();
        Written { eyes: [eye(&rig.left), eye(&rig.right)], rotation, translation: pose.translation.vector }
    }

    fn read(json: &Value) -> Option<Written> {
        let pose = &json["right_from_left"];
        let at = |v: &Value, k: usize| v[k].as_f64();
        let mut rotation = Matrix3::zeros();
        for i in 0..3 {
            for j in 0..3 {
                rotation[(i, j)] = at(&pose["rotation"][i], j)?;
            }
        }
        let t = &pose["translation_mm"];
        let translation = Vector3::new(at(t, 0)?, at(t, 1)?, at(t, 2)?);
        Some(Written { eyes: [Eye::read(&json["left"])?, Eye::read(&json["right"])?], rotation, translation })
    }

    /// The same with one parameter of the covariance's names changed; the board's own move no ray. `None` for a name
    /// that is neither.
    fn changed(&self, name: &str, by: f64) -> Option<Written> {
        let mut rig = self.clone();
        let (group, parameter) = name.split_once('.')?;
        if group == "board" {
            return Some(rig);
        }
        if group == "right_from_left" {
            let axis = |c: Option<char>| ['x', 'y', 'z'].iter().position(|&a| Some(a) == c);
            let mut letters = parameter.chars();
            let kind = letters.next()?;
            let mut along = Vector3::zeros();
            along[axis(letters.next())?] = by;
            match kind {
                'r' => rig.rotation = Rotation3::from_scaled_axis(along).matrix() * rig.rotation,
                't' => rig.translation += along,
                _ => return None,
            }
            return Some(rig);
        }
        let eye = &mut rig.eyes[["left", "right"].iter().position(|&side| side == group)?];
        const LENS: [&str; 14] =
            ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tauX", "tauY"];
        match parameter {
            "fx" => eye.focal.x += by,
            "fy" => eye.focal.y += by,
            "cx" => eye.middle.x += by,
            "cy" => eye.middle.y += by,
            _ => {
                let plain = parameter.trim_end_matches("_rad").replace("tau_x", "tauX").replace("tau_y", "tauY");
                eye.lens[LENS.iter().position(|&term| term == plain)?] += by;
            }
        }
        Some(rig)
    }

    /// The point half-way between both rays where they come nearest.
    fn point(&self, left: Point2<f64>, right: Point2<f64>) -> Vector3<f64> {
        let a = self.eyes[0].ray(left);
        let b = self.rotation.transpose() * self.eyes[1].ray(right);
        let origin = -(self.rotation.transpose() * self.translation);
        let system = nalgebra::Matrix2::new(a.dot(&a), -a.dot(&b), a.dot(&b), -b.dot(&b));
        let along = system.lu().solve(&Vector2::new(a.dot(&origin), b.dot(&origin))).unwrap_or_default();
        0.5 * (a * along.x + origin + b * along.y)
    }
}

/// Fresh boards, the tilts up to 45 degrees, in the volume in which the set's boards were held.
fn boards(set: &Set, count: usize) -> Vec<(PhysicalBoard, Transform)> {
    let perfect =
        Workmanship { pitch_um: 0.0, bow_um: (0.0, 0.0), scale_ppm: 0.0, ..set.plan.settings.check_workmanship };
    let drawing = Board { square_mm: set.typed.square_mm * set.scale, ..set.typed };
    let board = PhysicalBoard::new(drawing, perfect, 1, 0);
    let usual = set.plan.holding;
    let holding = Holding { tilt_deg: (0.0, 45.0), turn_deg: 180.0, ..usual };
    let field = set.field.unwrap_or_else(|| set.plan.drawing.left_from_field());
    let seen = |at: &_| check_poses::seen_by_both(&set.rig, &board, at);
    let seed = set.plan.settings.seed.wrapping_add(7001);
    let poses: Vec<_> = (0..count).filter_map(|k| check_poses::pose(&field, &holding, k, seed, &seen)).collect();
    assert!(!poses.is_empty(), "no fresh board is seen by both cameras");
    poses.into_iter().map(|at| (board.clone(), at)).collect()
}

/// Corners of a board that are measured, and which of them are the ends of a length.
struct Grid {
    corners: Vec<(usize, usize)>,
    lengths: Vec<(usize, usize)>,
}

impl Grid {
    fn new(columns: usize, rows: usize) -> Grid {
        let steps = |count: usize| -> Vec<usize> {
            let mut list: Vec<usize> = (0..count).step_by((count / 4).max(1)).chain([count - 1]).collect();
            (0..list.len()).for_each(|k| list.push((list[k] + SQUARES).min(count - 1)));
            list.sort_unstable();
            list.dedup();
            list
        };
        let at_rows = steps(rows);
        let corners: Vec<(usize, usize)> =
            steps(columns).into_iter().flat_map(|col| at_rows.iter().map(move |&row| (col, row))).collect();
        // Whole rows and columns, and lengths of so many squares along either.
        let wanted = |along: usize, count: usize| along == count - 1 || along == SQUARES;
        let mut lengths = Vec::new();
        for (i, a) in corners.iter().enumerate() {
            for (j, b) in corners.iter().enumerate().skip(i + 1) {
                let (over, down) = (a.0.abs_diff(b.0), a.1.abs_diff(b.1));
                if (down == 0 && wanted(over, columns)) || (over == 0 && wanted(down, rows)) {
                    lengths.push((i, j));
                }
            }
        }
        Grid { corners, lengths }
    }
}

/// A length or a point of a fresh board: how far it is off, mm, and over its own standard deviation.
#[derive(Debug, Clone, Copy)]
pub struct Off {
    pub mm: f64,
    pub sigmas: f64,
}

/// Lengths and points of fresh boards.
#[derive(Debug, Clone, Default)]
pub struct Comparison {
    pub lengths: Vec<Off>,
    pub points: Vec<Off>,
    /// False where the file has no covariance.
    pub sigmas_known: bool,
}

/// Compares so many fresh boards. `None` where `calibration.json` is no rig.
pub fn compare(set: &Set, calibration: &Value, boards: usize) -> Option<Comparison> {
    let written = Written::read(calibration)?;
    let sides = deviated(calibration, &written);
    let mut found = Comparison { sigmas_known: sides.is_some(), ..Comparison::default() };
    for (board, left_from_board) in self::boards(set, boards) {
        let grid = Grid::new(board.drawing.columns(), board.drawing.rows());
        let truth: Vec<Point3<f64>> =
            grid.corners.iter().map(|&(col, row)| left_from_board * board.corner_mm(col, row)).collect();
        let seen: Vec<[Point2<f64>; 2]> = truth.iter().map(|point| pictures(set, point)).collect();
        let measured =
            |rig: &Written| seen.iter().map(|px| rig.point(px[0], px[1]) * set.scale).collect::<Vec<Vector3<f64>>>();
        let points = measured(&written);
        let changed: Vec<[Vec<Vector3<f64>>; 2]> =
            sides.iter().flatten().map(|(a, b)| [measured(a), measured(b)]).collect();
        for &(i, j) in &grid.lengths {
            let mm = (points[i] - points[j]).norm() - (truth[i] - truth[j]).norm();
            let half = |p: &[Vec<Vector3<f64>>; 2]| 0.5 * ((p[0][i] - p[0][j]).norm() - (p[1][i] - p[1][j]).norm());
            let variance: f64 = changed.iter().map(|p| half(p).powi(2)).sum();
            found.lengths.push(Off { mm: mm.abs(), sigmas: mm.abs() / variance.sqrt().max(1e-9) });
        }
        for (k, point) in truth.iter().enumerate() {
            let halves = changed.iter().map(|p| 0.5 * (p[0][k] - p[1][k]));
            let covariance: Matrix3<f64> = halves.map(|h| h * h.transpose()).sum();
            let off = points[k] - point.coords;
            let squared = covariance.try_inverse().map_or(0.0, |inverse| off.dot(&(inverse * off)));
            found.points.push(Off { mm: off.norm(), sigmas: squared.max(0.0).sqrt() });
        }
    }
    Some(found)
}

/// The worst of all of them.
pub fn deviation(set: &Set, calibration: &Value) -> Option<Deviation> {
    let found = compare(set, calibration, BOARDS)?;
    let most = |list: &[Off], of: fn(&Off) -> f64| list.iter().map(of).fold(0.0, f64::max);
    Some(Deviation {
        length_mm: most(&found.lengths, |off| off.mm),
        length_sigmas: found.sigmas_known.then(|| most(&found.lengths, |off| off.sigmas)),
        point_sigmas: (found.sigmas_known && !set.lengths_only).then(|| most(&found.points, |off| off.sigmas)),
    })
}

/// The largest change of a length of fresh boards where another rig takes the pictures than the set's, mm.
pub fn effect_mm(set: &Set, taking: &Rig, boards: usize) -> f64 {
    let taken = Set { rig: taking.clone(), ..set.clone() };
    let written = Written::of(&set.rig);
    let of_board = |(board, left_from_board): (PhysicalBoard, Transform)| {
        let grid = Grid::new(board.drawing.columns(), board.drawing.rows());
        let at = |&(col, row): &(usize, usize)| left_from_board * board.corner_mm(col, row);
        let truth: Vec<Point3<f64>> = grid.corners.iter().map(at).collect();
        let points: Vec<Vector3<f64>> = truth
            .iter()
            .map(|point| {
                let px = pictures(&taken, point);
                written.point(px[0], px[1])
            })
            .collect();
        let change = |&(i, j): &(usize, usize)| ((points[i] - points[j]).norm() - (truth[i] - truth[j]).norm()).abs();
        grid.lengths.iter().map(change).fold(0.0, f64::max)
    };
    self::boards(set, boards).into_iter().map(of_board).fold(0.0, f64::max)
}

/// Where a point is in the pictures that were written.
fn pictures(set: &Set, point: &Point3<f64>) -> [Point2<f64>; 2] {
    let (left, right) = set.rig.project(point);
    [(left, 0, &set.rig.left), (right, 1, &set.rig.right)]
        .map(|(px, side, camera)| set.maps[side](px, f64::from(camera.width), f64::from(camera.height)))
}

/// Pairs of rigs one standard deviation to either side along the eigenvectors of the written covariance, if there is
/// one.
fn deviated(calibration: &Value, written: &Written) -> Option<Vec<(Written, Written)>> {
    let order: Vec<&str> = calibration["covariance"]["order"].as_array()?.iter().filter_map(Value::as_str).collect();
    let rows = calibration["covariance"]["matrix"].as_array()?;
    let n = order.len();
    let matrix = nalgebra::DMatrix::from_fn(n, n, |i, j| rows[i][j].as_f64().unwrap_or(0.0));
    // Parameters of very different sizes: correlations have eigenvectors that rounding leaves alone.
    let sizes: Vec<f64> = (0..n).map(|k| matrix[(k, k)].max(0.0).sqrt()).collect();
    let correlation = |i: usize, j: usize| match sizes[i] * sizes[j] {
        0.0 => 0.0,
        size => matrix[(i, j)] / size,
    };
    let eigen = nalgebra::DMatrix::from_fn(n, n, correlation).symmetric_eigen();
    let moved = |k: usize, sign: f64| {
        let mut rig = written.clone();
        for (j, name) in order.iter().enumerate() {
            let by = sign * eigen.eigenvalues[k].max(0.0).sqrt() * eigen.eigenvectors[(j, k)] * sizes[j];
            if by != 0.0 {
                rig = rig.changed(name, by)?;
            }
        }
        Some(rig)
    };
    (0..n).map(|k| Some((moved(k, 1.0)?, moved(k, -1.0)?))).collect()
}
