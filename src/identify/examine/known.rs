//! Known distances between touched points, each held against what the touches and the other ones say.
//!
//! They give the robot its scale, so that one that is wrong spoils everything. In: a data set with known distances, and the nominal robot. Out: the
//! set without those that do not go with the rest, and a sentence for each.
//! What goes wrong: one distance alone has nothing to be held against, and of two that disagree nothing tells which is wrong.

use crate::identify::Error;
use crate::identify::data::dataset::{Dataset, KnownDistance};
use crate::identify::finding::Finding;
use crate::identify::settings::Settings;
use crate::identify::solve::robust::Loss;
use crate::identify::solve::task::Task;
use crate::robot::Robot;

/// Standard deviations, its own and the prediction's, from which on a known distance does not go with the rest.
const OFF: f64 = 6.0;

/// The set without the known distances that do not go with the touches and the others, and a sentence for each.
pub fn examine(set: &Dataset, robot: &Robot, settings: &Settings) -> (Dataset, Vec<Finding>) {
    let (mut set, mut findings) = (set.clone(), Vec::new());
    let all = set.known.len();
    let rows = match all {
        0 | 1 => return (set, findings),
        _ => trusted(&set, robot, settings).unwrap_or_else(|_| set.fit_rows()),
    };
    let name = |set: &Dataset, k: &KnownDistance| format!("{} to {}", set.groups[k.a].name, set.groups[k.b].name);
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

/// The fitted touches without those that are gross errors among the touches themselves, which would speak against the known distances of
/// their sockets.
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
    Ok(Task::plain(set, robot, &parameters, rows, settings).robust(Loss::Absolute)?.deleted_known())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::synthetic;

    /// What is left of so many known distances, of which the second is off, and what is said.
    fn examined(count: usize, off_mm: f64) -> (usize, Vec<Finding>) {
        let (world, sockets) = synthetic::touched(0.0, 3);
        let mut set = Dataset::new(&world.rows).unwrap();
        set.known = (0..count)
            .map(|k| KnownDistance {
                a: k,
                b: k + 4,
                distance_mm: (sockets[k] - sockets[k + 4]).norm(),
                sigma_mm: 0.01,
            })
            .collect();
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
            set.known = [(0, 2, length(0, 4)), (1, 3, length(1, 5))]
                .map(|(a, b, distance_mm)| KnownDistance { a, b, distance_mm, sigma_mm: 0.01 })
                .to_vec();
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
}
