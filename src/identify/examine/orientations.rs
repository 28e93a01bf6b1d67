//! What is wrong with the orientations of points: degrees for radians, angles about axes for a rotation vector, the
//! inverse rotation.
//!
//! In: a data set and the nominal robot. Out: the set as the best hypothesis has it, and its name. The turn of the
//! target between two poses of a placement is that of the flange, about an axis that stands in the sensor's frame as
//! the flange's does in the base: one rotation brings all axes together (Wahba, 1965), whatever the sensor's frame and
//! the target's are. Where none does, each hypothesis is tried, and the one with which they agree is taken; each
//! placement by itself where it has enough poses. What goes wrong: where all turns are about one axis, an inverse
//! rotation is not told from the rotation.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::geometry::nearest_rotation;
use crate::identify::data::dataset::{Dataset, Pose, Reading};
use crate::identify::data::still;
use crate::identify::finding::Finding;
use crate::robot::Robot;
use crate::statistics::median;

/// Median difference of turns that no built robot has, rad.
const IMPLAUSIBLE_RAD: f64 = 0.05;

/// A hypothesis explains what is wrong when it brings the difference down by this factor.
const EXPLAINS: f64 = 4.0;

/// Median of the length of a vector whose three components are normal, over that of the size of one of them: what noise
/// alone makes of turns about axes beside the turns' sizes.
const OF_NOISE: f64 = 1.538 / 0.6745;

/// Share of a joint's way that rows must go, or others alone show the joint.
const LEAST_WAY: f64 = 0.1;

/// Pairs of poses that are enough to tell, and poses of a placement that tell by themselves.
const PAIRS: usize = 200;
const FEWEST: usize = 8;

/// A rotation from three numbers.
type Reader = fn(Vector3<f64>) -> UnitQuaternion<f64>;

/// Ways in which three numbers may have been meant, and their names.
const HYPOTHESES: [(&str, Reader); 9] = [
    ("rotation vectors in degrees, not in radians", |v| UnitQuaternion::from_scaled_axis(v * DEG)),
    ("inverse (the sensor as the target sees it)", |v| UnitQuaternion::from_scaled_axis(-v)),
    ("inverse (the sensor as the target sees it), and in degrees", |v| UnitQuaternion::from_scaled_axis(-v * DEG)),
    ("angles about fixed x, y and z, not rotation vectors", of_fixed_axes),
    ("angles about fixed x, y and z in degrees, not rotation vectors in radians", |v| of_fixed_axes(v * DEG)),
    ("angles about z, y and x that turn with it, in this order, not rotation vectors", |v| of_fixed_axes(v.zyx())),
    ("angles about z, y and x that turn with it, in this order and in degrees, not rotation vectors in radians", |v| {
        of_fixed_axes(v.zyx() * DEG)
    }),
    ("angles about x, y and z that turn with it, not rotation vectors", of_turning_axes),
    ("angles about x, y and z that turn with it, in degrees, not rotation vectors in radians", |v| {
        of_turning_axes(v * DEG)
    }),
];

/// A degree, rad.
const DEG: f64 = PI / 180.0;

fn of_fixed_axes(v: Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(v.x, v.y, v.z)
}

fn of_turning_axes(v: Vector3<f64>) -> UnitQuaternion<f64> {
    of_fixed_axes(-v).inverse()
}

/// What is told of the orientations of some placements.
enum Told {
    /// They go with the joints, or are too few to say.
    Suit,
    /// They are this instead, by the difference as they were read and as they were meant, rad.
    Meant(&'static str, Reader, [f64; 2]),
    /// They go with no other pose of the file either, by so much, rad.
    Contradict(f64),
}

/// The set with orientations that go with the joints, and what was wrong with them. Those that don't are left out
/// unless they are `asked` for.
pub fn examine(set: &Dataset, robot: &Robot, asked: bool) -> (Dataset, Vec<Finding>) {
    let mut set = set.clone();
    let all: Vec<usize> = (0..set.groups.len()).collect();
    // Sensors may write differently: each placement that has enough poses tells by itself, the others together.
    let has_enough = |&group: &usize| set.rows(|pose| pose.group == group).len() >= FEWEST;
    let (large, small): (Vec<usize>, Vec<usize>) = all.iter().copied().partition(has_enough);
    let parts = large.into_iter().map(|group| vec![group]).chain(Some(small).filter(|small| !small.is_empty()));
    let mut parts: Vec<(Vec<usize>, Told)> = parts
        .map(|groups| {
            let told = told(&set, robot, &groups);
            (groups, told)
        })
        .collect();
    let word = |part: &(Vec<usize>, Told)| part.1.word();
    if parts.iter().all(|part| word(part) == word(&parts[0])) {
        parts = vec![(all.clone(), told(&set, robot, &all))];
    }
    if parts.iter().all(|(_, told)| matches!(told, Told::Suit)) {
        let usual_rad =
            difference_rad(&set, robot, &all, UnitQuaternion::from_scaled_axis).map_or(0.0, |[size, _]| size);
        let (set, finding) = without_turned(set, robot, EXPLAINS * usual_rad);
        return (set, finding.into_iter().collect());
    }
    let findings = parts.into_iter().filter_map(|(groups, told)| mend(&mut set, &groups, told, asked)).collect();
    (set, findings)
}

impl Told {
    /// What is alike where this is.
    fn word(&self) -> &'static str {
        match self {
            Told::Suit => "suit",
            Told::Meant(name, ..) => name,
            Told::Contradict(_) => "contradict",
        }
    }
}

fn told(set: &Dataset, robot: &Robot, groups: &[usize]) -> Told {
    let difference = |reader: Reader| difference_rad(set, robot, groups, reader);
    let Some([size, whole]) = difference(UnitQuaternion::from_scaled_axis) else { return Told::Suit };
    if size < IMPLAUSIBLE_RAD && whole < IMPLAUSIBLE_RAD.max(EXPLAINS * OF_NOISE * size) {
        return Told::Suit;
    }
    let tried = HYPOTHESES.iter().filter_map(|(name, reader)| Some((difference(*reader)?[1], name, reader)));
    match tried.min_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((left, name, reader)) if left * EXPLAINS < whole => Told::Meant(name, *reader, [whole, left]),
        _ => Told::Contradict(whole),
    }
}

/// Takes the orientations of these groups as they are meant, or leaves them out.
fn mend(set: &mut Dataset, groups: &[usize], told: Told, asked: bool) -> Option<Finding> {
    let names: Vec<&str> = groups.iter().map(|&group| set.groups[group].name.as_str()).collect();
    let whose = match groups.len() {
        all if all == set.groups.len() => "the orientations".to_owned(),
        1 => format!("the orientations of group {}", names[0]),
        _ => format!("the orientations of groups {}", names.join(", ")),
    };
    let rotations = set.poses.iter_mut().filter(|pose| groups.contains(&pose.group));
    let rotations = rotations.filter_map(|pose| match &mut pose.reading {
        Reading::Position { rotation_rad, .. } => Some(rotation_rad),
        _ => None,
    });
    match told {
        Told::Suit => None,
        Told::Meant(name, reader, [from, to]) => {
            rotations.flatten().for_each(|rotation| *rotation = reader(*rotation).scaled_axis());
            let said = format!(
                "{whose} are {name} (turns between poses differ from the flange's by {:.2} deg, before by {:.1})",
                to.to_degrees(),
                from.to_degrees()
            );
            let action = "mended for this run; mend the file (`examine = false` in [identify] takes it as it is)";
            Some(Finding::new(said, action))
        }
        Told::Contradict(off) => {
            let said = format!(
                "{whose} contradict the joint angles: between poses the target turns otherwise than the flange, by {:.1} deg",
                off.to_degrees()
            );
            if !asked {
                rotations.for_each(|rotation| *rotation = None);
            }
            let action = "they are left out unless `--model pose` asks for them; look at rx_rad, ry_rad, rz_rad";
            Some(Finding::new(said, action))
        }
    }
}

/// Several targets count with their turn; a pose whose turn is another one is left out. Their lengths don't tell the
/// names of targets that stand alike, of an even triangle say, but turned by the exchange they are.
fn without_turned(set: Dataset, robot: &Robot, usual_rad: f64) -> (Dataset, Option<Finding>) {
    if set.targets.is_none() {
        return (set, None);
    }
    let turn = |pose: &Pose| {
        let read = UnitQuaternion::from_scaled_axis(pose.reading.rotation_rad()?);
        Some((read, robot.base_from_flange(&pose.joints_rad).rotation))
    };
    let turns: Vec<_> = set.poses.iter().map(turn).collect();
    let is_turned = |&row: &usize| {
        let of_group = set.rows(|p| p.group == set.poses[row].group);
        let step = (of_group.len() / PAIRS).max(1);
        let others = of_group.into_iter().step_by(step).filter(|&other| other != row);
        let difference = |other: usize| {
            let ((a, flange_a), (b, flange_b)) = (turns[row]?, turns[other]?);
            Some((a.angle_to(&b) - flange_a.angle_to(&flange_b)).abs())
        };
        median(others.filter_map(difference)).is_some_and(|off| off > usual_rad.max(IMPLAUSIBLE_RAD))
    };
    let turned: Vec<usize> = (0..set.poses.len()).filter(is_turned).collect();
    // Rows that alone move a joint are turned by how that joint is counted, which the fit has to tell.
    let moves_alone = |joint: usize| {
        let others = set.poses.iter().enumerate().filter(|(row, _)| !turned.contains(row)).map(|(_, pose)| pose);
        let whole = still::way(&set, joint);
        whole > still::STILL && still::way_in(others, joint) < LEAST_WAY * whole
    };
    if turned.is_empty() || (0..set.joint_count()).any(moves_alone) {
        return (set, None);
    }
    let finding = Finding::new(
        "the targets are turned otherwise than the flange, as where the names of two are exchanged",
        "left out; look at their names in `target`",
    )
    .about(set.names(&turned));
    (set.without(&turned, "the targets are turned otherwise than the flange"), Some(finding))
}

/// Median difference between the target's turn from pose to pose and the flange's, rad: of its size alone, and of the
/// whole turn in the frame that brings the axes together; `None` without orientations in two poses of one group.
fn difference_rad(set: &Dataset, robot: &Robot, groups: &[usize], reader: Reader) -> Option<[f64; 2]> {
    let oriented = |row: usize| set.poses[row].reading.rotation_rad().map(reader);
    let flange = |row: usize| robot.base_from_flange(&set.poses[row].joints_rad).rotation;
    let (mut sizes, mut wholes) = (Vec::new(), Vec::new());
    for &group in groups {
        let rows = set.rows(|p| p.group == group);
        let turn = |two: &[usize]| {
            let (a, b) = (oriented(two[0])?, oriented(two[1])?);
            Some((b * a.inverse(), flange(two[1]) * flange(two[0]).inverse()))
        };
        let turns: Vec<_> = rows.windows(2).take(PAIRS).filter_map(turn).collect();
        let products: Matrix3<f64> =
            turns.iter().map(|(read, of_flange)| axial(read) * axial(of_flange).transpose()).sum();
        let frame =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(nearest_rotation(&products)));
        sizes.extend(turns.iter().map(|(read, of_flange)| (read.angle() - of_flange.angle()).abs()));
        wholes.extend(turns.iter().map(|(read, of_flange)| read.angle_to(&(frame * of_flange * frame.inverse()))));
    }
    Some([median(sizes)?, median(wholes)?])
}

/// The axis times the sine of the turn: of half a turn, whose axis may point either way, there is none.
fn axial(turn: &UnitQuaternion<f64>) -> Vector3<f64> {
    2.0 * turn.w * turn.imag()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::synthetic;
    use crate::measurements::Observed;

    /// What is said of orientations that are written in this way.
    fn said(written: Writer) -> (Dataset, Dataset, Option<String>) {
        let world = synthetic::world(40, 0.0, 2);
        let sensor = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.7, 1.1));
        let target = UnitQuaternion::from_scaled_axis(Vector3::new(2.0, 0.5, -0.4));
        let rows = |written: Writer| {
            let mut rows = world.rows.clone();
            for row in &mut rows {
                let turn = sensor * world.truth.base_from_flange(&row.at.joints_rad()).rotation * target;
                if let Observed::Position { rotation_rad, .. } = &mut row.observed {
                    *rotation_rad = Some(written(turn));
                }
            }
            Dataset::new(&rows).unwrap()
        };
        let (right, read) = (rows(&|r| r.scaled_axis()), rows(written));
        let (mended, finding) = examine(&read, &world.nominal, false);
        (right, mended, finding.into_iter().next().map(|f| f.finding))
    }

    /// How orientations are written.
    type Writer<'a> = &'a dyn Fn(UnitQuaternion<f64>) -> Vector3<f64>;

    fn fixed_axes(r: UnitQuaternion<f64>) -> Vector3<f64> {
        let (x, y, z) = r.euler_angles();
        Vector3::new(x, y, z)
    }

    #[test]
    fn rotation_vectors_in_radians_are_taken_as_they_are() {
        let (right, mended, said) = said(&|r| r.scaled_axis());
        assert_eq!((mended, said), (right, None));
    }

    #[test]
    fn other_ways_of_writing_them_are_named_and_mended() {
        let degrees = |v: Vector3<f64>| v * 180.0 / PI;
        let ways: [(Writer, &str); 7] = [
            (&|r| degrees(r.scaled_axis()), "rotation vectors in degrees"),
            (&|r| -r.scaled_axis(), "inverse (the sensor as the target sees it) ("),
            (&|r| degrees(-r.scaled_axis()), "inverse (the sensor as the target sees it), and in degrees"),
            (&fixed_axes, "angles about fixed x, y and z, not"),
            (&|r| degrees(fixed_axes(r)), "angles about fixed x, y and z in degrees"),
            (
                &|r| degrees(fixed_axes(r).zyx()),
                "angles about z, y and x that turn with it, in this order and in degrees",
            ),
            (&|r| -fixed_axes(r.inverse()), "angles about x, y and z that turn with it, not"),
        ];
        for (written, name) in ways {
            let (right, mended, said) = said(written);
            assert!(said.as_ref().is_some_and(|s| s.contains(name)), "{name}: {said:?}");
            assert!(are_alike(&right, &mended), "{name}");
        }
    }

    fn are_alike(a: &Dataset, b: &Dataset) -> bool {
        let turn = |p: &Pose| UnitQuaternion::from_scaled_axis(p.reading.rotation_rad().unwrap());
        a.poses.iter().zip(&b.poses).all(|(a, b)| turn(a).angle_to(&turn(b)) < 1e-6)
    }

    #[test]
    fn a_sensor_that_writes_differently_is_mended_alone() {
        let world = synthetic::world(80, 0.0, 2);
        for odd in [["g1"].as_slice(), &["g0", "g1", "g2"]] {
            let rows = |is_odd: &dyn Fn(&str) -> bool| {
                let mut rows = world.rows.clone();
                for row in &mut rows {
                    let turn = world.truth.base_from_flange(&row.at.joints_rad()).rotation.scaled_axis();
                    let turn = if is_odd(&row.at.group) { -turn } else { turn };
                    if let Observed::Position { rotation_rad, .. } = &mut row.observed {
                        *rotation_rad = Some(turn);
                    }
                }
                Dataset::new(&rows).unwrap()
            };
            let (mended, findings) = examine(&rows(&|group| odd.contains(&group)), &world.nominal, false);
            let said: Vec<String> = findings.iter().map(Finding::sentence).collect();
            assert!(
                odd.iter().all(|g| said.iter().any(|s| s.contains(&format!("of group {g} are inverse")))),
                "{said:?}"
            );
            assert_eq!(said.len(), odd.len());
            assert!(are_alike(&mended, &rows(&|_| false)), "{said:?}");
        }
    }

    #[test]
    fn orientations_of_other_poses_are_said_to_be_so() {
        let counter = std::cell::Cell::new(0.0);
        let (.., said) = said(&|_| {
            counter.set(counter.get() + 1.3);
            Vector3::new(counter.get() % 3.0, 0.7, 0.1)
        });
        assert!(said.is_some_and(|s| s.contains("contradict the joint angles")));
    }
}
