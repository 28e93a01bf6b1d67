//! Known distances between touched points, each held against what the touches and the other ones say.
//!
//! They give the robot its scale, so that one that is wrong spoils everything. In: a data set with known distances, and
//! the nominal robot. Out: the set without those that do not go with the rest, and a sentence for each. One of another
//! size than the nominal robot has there, a digit too few or another unit, is left out before that. What goes wrong:
//! one distance alone has nothing to be held against, and of two that disagree nothing tells which is wrong.

use nalgebra::{Point3, Vector3};

use crate::identify::Error;
use crate::identify::data::dataset::{Dataset, KnownDistance};
use crate::identify::finding::Finding;
use crate::identify::settings::Settings;
use crate::identify::solve::robust::Loss;
use crate::identify::solve::task::Task;
use crate::robot::Robot;
use crate::statistics::median;

/// Standard deviations, its own and the prediction's, from which on a known distance does not go with the rest.
const OFF: f64 = 6.0;

/// Times by which a known distance and what the nominal robot has between the touched points may differ: robots are
/// built to far less, but the file's tool may be another one. Beyond the second it is another number.
const ALIKE: f64 = 1.7;
const ANOTHER: f64 = 2.5;

/// The set without the known distances that do not go with the touches and the others, and a sentence for each.
pub fn examine(set: &Dataset, robot: &Robot, settings: &Settings) -> (Dataset, Vec<Finding>) {
    let (mut set, mut findings) = mistyped(set, robot);
    let all = set.known.len();
    let rows = match all {
        0 | 1 => return (set, findings),
        _ => trusted(&set, robot, settings).unwrap_or_else(|_| set.fit_rows()),
    };
    while let Ok(sizes) = sizes(&set, robot, &rows, settings) {
        let off: Vec<usize> = (0..sizes.len()).filter(|&k| sizes[k] > OFF).collect();
        // What a wrong distance leaves behind spreads over the others: the one without which they agree best is wrong.
        let without = |k: usize| {
            let mut others = set.clone();
            others.known.remove(k);
            let left = self::sizes(&others, robot, &rows, settings)
                .map_or(f64::INFINITY, |s| s.into_iter().fold(0.0, f64::max));
            (left, k, others)
        };
        let best = off.iter().map(|&k| without(k)).min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, k, others)) = best else { break };
        let left = all - others.known.len();
        if set.known.len() < 3 || 2 * left >= all {
            findings.push(
                Finding::new(
                    "the known distances contradict the touches",
                    "which of them is wrong cannot be decided: all are used; measure them again, or more of them",
                )
                .about(off.iter().map(|&k| name(&set, &set.known[k])).collect()),
            );
            break;
        }
        findings.push(Finding::new(format!(
                "the known distance of {:.3} mm is {:.0} standard deviations off what the touches and the other known distances say",
                set.known[k].distance_mm, sizes[k]
            ), "left out in this run; measure it again (`examine = false` in [identify] takes it as it is)").about(vec![name(&set, &set.known[k])]));
        set = others;
    }
    (set, findings)
}

/// Whether known distances in a unit of so many mm are all what the nominal robot has between the touched points.
pub fn are_of_unit(set: &Dataset, robot: &Robot, unit_mm: f64) -> bool {
    ratios(set, robot).into_iter().all(|ratio| is_within(unit_mm * ratio, ALIKE))
}

/// The set without known distances of another size than what the nominal robot has there, where it agrees with others.
fn mistyped(set: &Dataset, robot: &Robot) -> (Dataset, Vec<Finding>) {
    let ratios = ratios(set, robot);
    if !ratios.iter().any(|ratio| ratio.is_finite() && is_within(*ratio, ALIKE)) {
        return (set.clone(), Vec::new());
    }
    let finding = |(k, ratio): (&KnownDistance, &f64)| {
        let said = format!(
            "the known distance of {} mm is about {:.0} mm by the nominal robot",
            k.distance_mm,
            k.distance_mm / ratio
        );
        let action = "left out in this run: another number was meant; mend it (`examine = false` in [identify] takes it as it is)";
        (!is_within(*ratio, ANOTHER)).then(|| Finding::new(said, action).about(vec![name(set, k)]))
    };
    let findings = set.known.iter().zip(&ratios).filter_map(finding).collect();
    let mut kept = ratios.iter().map(|ratio| is_within(*ratio, ANOTHER));
    let mut set = set.clone();
    set.known.retain(|_| kept.next().unwrap_or(true));
    (set, findings)
}

/// Of points without a row nothing is known.
fn is_within(ratio: f64, times: f64) -> bool {
    !ratio.is_finite() || (1.0 / times..=times).contains(&ratio)
}

/// Each known distance as a share of what the nominal robot has between the middles of the touches, those to verify
/// among them.
fn ratios(set: &Dataset, robot: &Robot) -> Vec<f64> {
    let rows = set.rows(|_| true);
    let middle = |group: usize| {
        let points: Vec<_> =
            set.of_group(&rows, group).into_iter().map(|row| robot.target_mm(&set.poses[row].joints_rad)).collect();
        Point3::from(Vector3::from_fn(|axis, _| median(points.iter().map(|p| p[axis])).unwrap_or(f64::NAN)))
    };
    set.known.iter().map(|k| k.distance_mm / (middle(k.a) - middle(k.b)).norm()).collect()
}

fn name(set: &Dataset, k: &KnownDistance) -> String {
    format!("{} to {}", set.groups[k.a].name, set.groups[k.b].name)
}

/// The fitted touches without those that are gross errors among the touches themselves, which would speak against the
/// known distances of their sockets.
fn trusted(set: &Dataset, robot: &Robot, settings: &Settings) -> Result<Vec<usize>, Error> {
    let alone = Dataset { known: Vec::new(), ..set.clone() };
    let (mut rows, parameters) = (set.fit_rows(), robot.mdh_parameters());
    if settings.outlier_sigmas > 0.0 {
        let mut robust = Task::plain(&alone, robot, &parameters, &rows, settings).robust(Loss::Biweight)?;
        let gross = robust.gross_errors(settings.outlier_sigmas);
        rows.retain(|row| !gross.contains(row));
    }
    Ok(rows)
}

/// How far each known distance is from what the rest says, in standard deviations.
fn sizes(set: &Dataset, robot: &Robot, rows: &[usize], settings: &Settings) -> Result<Vec<f64>, Error> {
    if set.known.len() < 2 {
        return Ok(Vec::new());
    }
    let parameters = robot.mdh_parameters();
    Ok(Task::plain(set, robot, &parameters, rows, settings).robust(Loss::Absolute)?.deleted().1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::synthetic;
    use crate::measurements::Role;

    fn known(a: usize, b: usize, distance_mm: f64) -> KnownDistance {
        KnownDistance { a, b, distance_mm, stated_sigma_mm: Some(0.01) }
    }

    /// What is left of so many known distances, of which the second is off, and what is said.
    fn examined(count: usize, off_mm: f64) -> (usize, Vec<Finding>) {
        let (world, sockets) = synthetic::touched(0.0, 3);
        let mut set = Dataset::new(&world.rows).unwrap();
        set.known = (0..count).map(|k| known(k, k + 4, (sockets[k] - sockets[k + 4]).norm())).collect();
        set.known[1].distance_mm += off_mm;
        let (left, findings) = examine(&set, &world.nominal, &Settings::default());
        (left.known.len(), findings)
    }

    #[test]
    fn a_known_distance_that_is_wrong_is_named_and_left_out() {
        for off_mm in [0.5, 2.0, 20.0] {
            let (left, findings) = examined(4, off_mm);
            assert_eq!((left, findings.len()), (3, 1), "{off_mm}: {findings:?}");
            assert!(
                findings[0].finding.contains("known distance of") && findings[0].rows == ["s1 to s5"],
                "{findings:?}"
            );
        }
    }

    #[test]
    fn of_two_that_disagree_neither_is_left_out() {
        let (left, findings) = examined(2, 5.0);
        assert!(left == 2 && findings[0].finding.contains("contradict the touches"), "{findings:?}");
    }

    #[test]
    fn a_touch_that_is_a_gross_error_does_not_speak_against_known_distances() {
        for by_deg in [1.0, 10.0, 60.0] {
            // Few sockets, as a person touches them: nothing outweighs a touch that is half a metre off.
            let (mut world, sockets) = synthetic::touched(0.0, 3);
            world.rows.retain(|row| ["s0", "s1", "s4", "s5"].contains(&row.at.group.as_str()));
            world.rows[3].at.joints_deg[1] += by_deg;
            let mut set = Dataset::new(&world.rows).unwrap();
            let length = |a: usize, b: usize| (sockets[a] - sockets[b]).norm();
            set.known = vec![known(0, 2, length(0, 4)), known(1, 3, length(1, 5))];
            let (left, findings) = examine(&set, &world.nominal, &Settings::default());
            assert_eq!((left.known.len(), findings), (2, Vec::new()), "{by_deg}");
            set.known[1].distance_mm += 2.0;
            let (_, findings) = examine(&set, &world.nominal, &Settings::default());
            assert!(
                findings.len() == 1 && findings[0].finding.contains("contradict the touches"),
                "{by_deg}: {findings:?}"
            );
        }
    }

    #[test]
    fn known_distances_that_are_right_stay() {
        for count in [2, 3, 4] {
            assert_eq!(examined(count, 0.0), (count, Vec::new()));
        }
    }

    #[test]
    fn a_known_distance_of_another_size_is_named_and_no_unit_is_blamed() {
        let (world, sockets) = synthetic::touched(0.0, 3);
        let length = |k: usize| (sockets[k] - sockets[k + 4]).norm();
        let of = |factors: &[f64]| {
            let mut set = Dataset::new(&world.rows).unwrap();
            set.known = factors.iter().enumerate().map(|(k, f)| known(k, k + 4, f * length(k))).collect();
            set
        };
        for factor in [0.01, 0.1, 0.3, 10.0] {
            for others in [1, 3] {
                let set = of(&[vec![1.0; others], vec![factor]].concat());
                let (left, findings) = examine(&set, &world.nominal, &Settings::default());
                assert_eq!((left.known.len(), findings.len()), (others, 1), "{factor}: {findings:?}");
                assert!(findings[0].finding.ends_with("mm by the nominal robot"), "{findings:?}");
                assert!(!are_of_unit(&set, &world.nominal, 1.0 / factor), "{factor}");
            }
            assert!(are_of_unit(&of(&[factor, factor]), &world.nominal, 1.0 / factor), "{factor}");
            // Sockets that are to verify, and others that nobody touched.
            let mut held_out = of(&[1.0, 1.0]);
            let (a, b) = (held_out.known[1].a, held_out.known[1].b);
            held_out.poses.iter_mut().filter(|p| [a, b].contains(&p.group)).for_each(|p| p.role = Role::Verify);
            assert_eq!(mistyped(&held_out, &world.nominal).1, Vec::new());
            held_out.poses.retain(|p| ![a, b].contains(&p.group));
            assert_eq!(mistyped(&held_out, &world.nominal).1, Vec::new());
        }
    }
}
