//! Which columns are the joints and which the points where no name says it, or names that are not known: every way that
//! the counts allow, for the nominal robot to decide.
//!
//! Columns of zeros, of words and of the row's number are none of them, nor columns whose names say that they are
//! something else. Joints stand side by side, as many as the robot has; so do the three numbers of a point. Where
//! columns remain that are as many points side by side, and these keep their distances from row to row or are one
//! point, they are several targets, or several readings.

use nalgebra::Point3;

use super::part::{At, Part};
use super::pick::Picked;
use crate::geometry::fitted_frame;
use crate::statistics::median;

/// Columns of a file without names in which joints and points are looked for.
const MOST_FREE: usize = 60;

/// Two points that a body carries keep their distance within this share of it, in the middle of all rows: targets 10 mm
/// apart that are read to half a millimetre do. Points that differ by errors of three normal numbers, one commanded and
/// one measured, are apart by 1.54 standard deviations in the middle of all rows, and half of them differ from that by
/// more than 0.46: three tenths of it.
pub(super) const RIGID: f64 = 0.05;

/// Numbers of a transform but for its last row, which says nothing.
const TRANSFORM: usize = 12;

/// What rounding leaves of a rotation's rows that are at right angles and of length one.
const ROUNDED: f64 = 2e-3;

/// Rows that tell whether a distance is kept.
const ROWS: usize = 200;

/// Readings within this share of what the rows are apart are of one point: an instrument repeats to hundredths of a
/// millimetre, rows are a hundred and more apart, and what was commanded differs from what was measured by tenths at
/// the least.
pub(in crate::measurements) const ONE_POINT: f64 = 1e-3;

/// All ways to complete what the names say; columns of zeros are joints only where there is none without them.
pub(in crate::measurements) fn candidates(parts: &[Part], picked: &Picked, count: usize) -> Vec<Picked> {
    let moving = of_columns(parts, picked, count, Part::free);
    let all = if moving.is_empty() { of_columns(parts, picked, count, Part::free_and_still) } else { moving };
    all.into_iter().map(|picked| picked.with_units(parts)).collect()
}

/// The same of these columns without names, and of those whose names are not known.
fn of_columns(parts: &[Part], picked: &Picked, count: usize, free: fn(&Part) -> Vec<usize>) -> Vec<Picked> {
    let of_file = |(part, file): (usize, &Part)| -> Vec<At> {
        let columns = free(file).into_iter().chain(file.spare());
        columns.take(MOST_FREE).map(|column| At { part, column }).collect()
    };
    let free: Vec<Vec<At>> = parts.iter().enumerate().map(of_file).collect();
    let mut list = Vec::new();
    for joints in blocks(parts, &free, count, !picked.joints.is_empty()) {
        let joints = if picked.joints.is_empty() { joints } else { picked.joints.clone() };
        if joints.is_empty() {
            continue;
        }
        if picked.is_measured() {
            list.push(Picked { joints, ..picked.clone() });
            continue;
        }
        let rest: Vec<Vec<At>> =
            free.iter().map(|of| of.iter().copied().filter(|at| !joints.contains(at)).collect()).collect();
        let total: usize = rest.iter().map(Vec::len).sum();
        let of_points = |points: Vec<(String, [At; 3])>| Picked { joints: joints.clone(), points, ..picked.clone() };
        if total > 3 && total.is_multiple_of(3) {
            let all: Vec<[At; 3]> = rest.iter().flat_map(|of| of.chunks_exact(3)).map(|c| [c[0], c[1], c[2]]).collect();
            let kept = all.windows(2).all(|two| are_carried(&pairs(parts, &two[0], &two[1])));
            let whole = 3 * all.len() == total;
            let several = of_points(all.into_iter().enumerate().map(|(i, at)| ((i + 1).to_string(), at)).collect());
            // Two that are nearly one may be what was commanded and what was measured: without names only three or more
            // are readings of one point.
            let readings = several.points.len() > 2 && are_readings(parts, &several);
            if whole && (kept || readings) {
                list.push(several);
                continue;
            }
        }
        for of in &rest {
            // Three columns side by side: what stands between two of them is no part of a point.
            list.extend(
                of.windows(3).filter(|w| beside(w)).map(|w| of_points(vec![(String::new(), [w[0], w[1], w[2]])])),
            );
            let matrices = of.iter().filter_map(|first| translation(parts, *first));
            list.extend(matrices.map(|point| of_points(vec![(String::new(), point)])));
        }
    }
    list
}

/// The last column of a transform that is written row by row from this column on: rows of a rotation, each with a
/// coordinate behind it.
fn translation(parts: &[Part], first: At) -> Option<[At; 3]> {
    let at = |entry: usize| At { column: first.column + entry, ..first };
    let file = &parts[first.part];
    if first.column + TRANSFORM > file.width() {
        return None;
    }
    let turn = |row: usize| point(parts, row, &[at(0), at(1), at(2)]).zip(point(parts, row, &[at(4), at(5), at(6)]));
    let rotates = |row: usize| {
        let third = point(parts, row, &[at(8), at(9), at(10)])?;
        let (first, second) = turn(row)?;
        Some(
            (first.coords.cross(&second.coords) - third.coords).norm() < ROUNDED
                && (first.coords.norm() - 1.0).abs() < ROUNDED,
        )
    };
    let told: Vec<bool> = (0..file.rows.len()).take(ROWS).filter_map(rotates).collect();
    (!told.is_empty() && told.iter().all(|is| *is)).then(|| [at(3), at(7), at(11)])
}

fn beside(columns: &[At]) -> bool {
    columns.windows(2).all(|two| two[0].part == two[1].part && two[0].column + 1 == two[1].column)
}

/// Columns side by side that may be the joints; an empty one where they are known.
fn blocks(parts: &[Part], free: &[Vec<At>], count: usize, known: bool) -> Vec<Vec<At>> {
    if known {
        return vec![Vec::new()];
    }
    // What stands between columns that have names is no joint.
    let apart = |window: &&[At]| !parts[window[0].part].is_named() || beside(window);
    // Nor are entries of a rotation.
    let turns = |at: &At| {
        let starts = (0..=at.column).rev().take(TRANSFORM).map(|column| At { column, ..*at });
        starts.filter(|first| free[at.part].contains(first)).any(|first| translation(parts, first).is_some())
    };
    let of_file = |of: &Vec<At>| {
        let of: Vec<At> = of.iter().copied().filter(|at| !turns(at)).collect();
        of.windows(count).filter(apart).map(<[At]>::to_vec).collect::<Vec<_>>()
    };
    free.iter().flat_map(of_file).collect()
}

/// Whether no body carries both of two points.
pub(in crate::measurements) fn differ(parts: &[Part], a: &[At; 3], b: &[At; 3]) -> bool {
    let pairs = pairs(parts, a, b);
    pairs.len() > 1 && !are_carried(&pairs)
}

/// Two points in the rows that have both.
fn pairs(parts: &[Part], a: &[At; 3], b: &[At; 3]) -> Vec<[Point3<f64>; 2]> {
    let rows = parts[a[0].part].rows.len().min(parts[b[0].part].rows.len());
    (0..rows).take(ROWS).filter_map(|row| Some([point(parts, row, a)?, point(parts, row, b)?])).collect()
}

/// Whether a body may carry both points: they keep their distance beside what they move by, and are not one point in
/// two frames, where the robot was sent and what a sensor saw, which are far apart and keep about theirs.
fn are_carried(pairs: &[[Point3<f64>; 2]]) -> bool {
    let apart: Vec<f64> = pairs.iter().map(|[a, b]| (b - a).norm()).collect();
    let scatter = scatter(&apart);
    let moves = |of: usize| {
        let points = pairs.iter().map(|pair| pair[of]).collect::<Vec<_>>();
        let middle = Point3::from([0, 1, 2].map(|axis| median(points.iter().map(|p| p[axis])).unwrap_or_default()));
        median(points.iter().map(|p| (p - middle).norm())).unwrap_or_default()
    };
    is_kept(apart) && scatter <= RIGID * moves(0).min(moves(1)) && !are_of_two_frames(pairs, scatter)
}

/// Whether a rigid transform takes the one point to the other several times as surely as they keep their distance. It
/// does not where a body that turns carries them, and where it does not turn, what is left is what their distance
/// scatters by, too.
fn are_of_two_frames(pairs: &[[Point3<f64>; 2]], scatter: f64) -> bool {
    const CLEAR: f64 = 4.0;
    /// Of 18 numbers the transform takes six.
    const FEWEST: usize = 6;
    let frame = fitted_frame(pairs.iter().map(|[a, b]| (*a, *b, 1.0)));
    let left = median(pairs.iter().map(|[a, b]| (frame * a - b).norm()));
    pairs.len() >= FEWEST && left.is_some_and(|left| CLEAR * left < scatter)
}

/// How far numbers are from their middle, in the middle.
fn scatter(numbers: &[f64]) -> f64 {
    let middle = median(numbers.iter().copied()).unwrap_or_default();
    median(numbers.iter().map(|number| (number - middle).abs())).unwrap_or(f64::INFINITY)
}

/// Whether these distances are one that is not zero, but for gross errors at less than half of the rows.
pub(in crate::measurements) fn is_kept(apart: Vec<f64>) -> bool {
    let Some(middle) = median(apart.iter().copied()) else { return false };
    apart.len() > 1 && middle > 0.0 && scatter(&apart) < RIGID * middle
}

pub(in crate::measurements) fn point(parts: &[Part], row: usize, at: &[At; 3]) -> Option<Point3<f64>> {
    let number = |at: &At| parts[at.part].optional(row, at.column).ok().flatten();
    Some(Point3::new(number(&at[0])?, number(&at[1])?, number(&at[2])?))
}

/// Whether what looks like several targets is one that was read several times.
pub(in crate::measurements) fn are_readings(parts: &[Part], picked: &Picked) -> bool {
    let [(_, first), (_, second), ..] = &picked.points[..] else { return false };
    let rows = parts[first[0].part].rows.len().min(parts[second[0].part].rows.len());
    let at = |row: usize, columns: &[At; 3]| point(parts, row, columns);
    let apart = |a: Option<Point3<f64>>, b: Option<Point3<f64>>| Some((a? - b?).norm());
    let mean = |v: Vec<f64>| v.iter().sum::<f64>() / v.len().max(1) as f64;
    let within = mean((0..rows).filter_map(|row| apart(at(row, first), at(row, second))).collect());
    within < ONE_POINT * mean((1..rows).filter_map(|row| apart(at(row - 1, first), at(row, first))).collect())
}

#[cfg(test)]
mod tests {
    use camino::Utf8Path;
    use nalgebra::{Rotation3, Vector3};

    use super::*;
    use crate::measurements::columns::pick;

    #[test]
    fn one_point_in_two_frames_is_not_two_of_a_body() {
        let turn = |k: f64| Rotation3::from_euler_angles((0.9 * k).sin(), 0.8 * (1.7 * k).cos(), (0.4 * k).sin());
        let noise = |k: f64| Vector3::new((71.0 * k).sin(), (37.0 * k).sin(), (53.0 * k).cos()) * 0.1;
        let at = |k: f64| Point3::new(800.0 + 90.0 * (2.1 * k).sin(), 60.0 * k.cos(), 500.0 + 80.0 * (1.3 * k).sin());
        let frame = Rotation3::from_euler_angles(0.1, -0.05, 0.3);
        let rows = |second: &dyn Fn(f64) -> Point3<f64>| -> Vec<[Point3<f64>; 2]> {
            (0..30).map(f64::from).map(|k| [at(k), second(k) + noise(k)]).collect()
        };
        let two_frames = rows(&|k| frame * at(k) + Vector3::new(2500.0, -900.0, 40.0));
        assert!(is_kept(two_frames.iter().map(|[a, b]| (b - a).norm()).collect()) && !are_carried(&two_frames));
        for offset in [Vector3::new(60.0, 0.0, 0.0), Vector3::new(0.0, -30.0, 200.0)] {
            assert!(are_carried(&rows(&|k| at(k) + turn(k) * offset)), "{offset}");
            assert!(are_carried(&rows(&|k| at(k) + offset)), "a body that does not turn, {offset}");
        }
        // Other numbers may be far apart by about as much in all rows.
        assert!(!are_carried(&rows(&|k| Point3::new(21.0 + (3.0 * k).sin(), 3000.0 + (5.0 * k).cos(), 2.0))));
    }

    /// A file of transforms, in which the rotations' entries are as many numbers side by side as a robot has joints.
    #[test]
    fn entries_of_a_rotation_are_no_joints() {
        for (joints, whole) in [(6, true), (7, true), (7, false), (3, false)] {
            let rows: String = (0..20)
                .map(|i| {
                    let k = f64::from(i);
                    let m = Rotation3::from_euler_angles(0.3 * k, (0.7 * k).sin(), 0.2 - 0.1 * k);
                    let row = |r: usize| {
                        format!("{} {} {} {}", m[(r, 0)], m[(r, 1)], m[(r, 2)], 100.0 * (k + r as f64).sin())
                    };
                    format!("{} {} {}{}\n", row(0), row(1), row(2), if whole { " 0 0 0 1" } else { "" })
                })
                .collect();
            let encoders: String = (0..20)
                .map(|i| (0..joints).map(|j| format!("{} ", f64::from(i * j + 3).sin())).collect::<String>() + "\n")
                .collect();
            let folder = tempfile::tempdir().unwrap();
            let path = |name: &str| Utf8Path::from_path(folder.path()).unwrap().join(name);
            std::fs::write(path("encoders.txt"), encoders).unwrap();
            std::fs::write(path("transforms.txt"), rows).unwrap();
            let read = |name: &str| Part::read(&path(name), joints as usize, false).unwrap();
            let parts = [read("encoders.txt"), read("transforms.txt")];
            let picked = pick::by_names(&parts, joints as usize).unwrap();
            let found = candidates(&parts, &picked, joints as usize);
            assert!(found.iter().all(|way| way.joints.iter().all(|at| at.part == 0)), "{joints}: {found:?}");
            let of_transforms =
                |way: &Picked| way.points.len() == 1 && way.points[0].1.map(|at| at.column) == [3, 7, 11];
            assert!(found.iter().any(of_transforms), "{joints}: {found:?}");
        }
    }
}
