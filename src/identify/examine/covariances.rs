//! Groups whose covariances do not go with their residuals as those of the other groups do.
//!
//! In: a data set whose readings state covariances, and the nominal robot. Out: the same set with the covariances of
//! such groups brought to what their residuals are, and a sentence for each. It comes before gross errors are looked
//! for: the rows of a group that promises too much would be taken for them. A robust fit in which all groups count
//! alike says how large each group's residuals are; they should be what the group states and a scatter that all groups
//! have. What the robot's model lacks is not the same everywhere: a group whose residuals are larger than it states, and
//! smaller than those of the others, may stand where little is lacking. A group is off where the data are clearly more
//! probable without that. What goes wrong: with groups of fifteen poses, factors below three are as probable as some
//! more scatter of the robot; where half of the groups or more are off, the others seem to be.

use std::collections::BTreeMap;

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::identify::Error;
use crate::identify::data::dataset::{Dataset, Reading};
use crate::identify::data::shared;
use crate::identify::finding::Finding;
use crate::identify::settings::Settings;
use crate::identify::solve::robust::Loss;
use crate::identify::solve::task::Task;
use crate::robot::Robot;
use crate::statistics::median;

/// Standard deviations that are off by so many times are worth a sentence.
const OFF: f64 = 1.6;

/// Logarithm of the evidence that it takes, beside what so many looks cost: at each group, in both directions.
const CLEAR: f64 = 4.0;

/// Fewest groups among which one can be told from the others.
const GROUPS: usize = 3;

/// Fewest numbers that tell how large a group's residuals are.
const FEWEST: usize = 15;

/// A group that states too much is brought to this share of it at the least.
const LEAST: f64 = 1e-4;

/// Squares of standard deviations beyond which a row counts as one that is so far off.
const BOUNDED: f64 = 7.0;

/// Scatters that are tried, in shares of the largest variance.
const SCATTERS: i32 = 120;

/// What a group states and what is seen, mean variances of a coordinate or length, mm^2.
#[derive(Debug, Clone, PartialEq)]
struct Seen {
    name: String,
    stated_mm2: f64,
    seen_mm2: f64,
    numbers: f64,
}

/// A group whose covariances are off: its residuals are so many times as large as they should be, and its covariances
/// say so when they are multiplied by the factor.
#[derive(Debug, Clone, PartialEq)]
struct Off {
    name: String,
    times: f64,
    factor: f64,
    evidence: f64,
}

/// The set with covariances that go together, and what was wrong with them.
pub fn examine(set: &Dataset, robot: &Robot, settings: &Settings) -> (Dataset, Vec<Finding>) {
    let mut set = set.clone();
    let Ok(mut groups) = seen(&set, robot, settings) else { return (set, Vec::new()) };
    let mut findings = Vec::new();
    while let Some(off) = worst(&groups) {
        scale(&mut set, &off.name, off.factor);
        groups.retain(|g| g.name != off.name);
        let (times, sizes, way) =
            if off.times > 1.0 { (off.times, "larger", "small") } else { (1.0 / off.times, "smaller", "large") };
        findings.push(Finding::new(format!(
                "the covariances of group {} are too {way} beside those of the other groups: its residuals are {times:.1} times {sizes}",
                off.name
            ), "its rows count for what they are in this run; mend the file (`examine = false` in [identify] takes it as it is)"));
    }
    (set, findings)
}

/// What each group states, and how large its residuals are; nothing where some state nothing.
fn seen(set: &Dataset, robot: &Robot, settings: &Settings) -> Result<Vec<Seen>, Error> {
    let rows = set.fit_rows();
    let name = |row: usize| set.groups[set.poses[row].group].name.as_str();
    let mut of_groups: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    rows.iter().for_each(|&row| of_groups.entry(name(row)).or_default().push(row));
    let variance = |row: &usize| set.poses[*row].reading.variance_mm2().unwrap_or(0.0);
    let mean = |rows: &Vec<usize>| rows.iter().map(variance).sum::<f64>() / rows.len() as f64;
    let stated: BTreeMap<&str, f64> = of_groups.iter().map(|(name, rows)| (*name, mean(rows))).collect();
    if stated.len() < GROUPS || stated.values().any(|s| *s <= 0.0) {
        return Ok(Vec::new());
    }
    // All groups count alike: one that promises too much would draw the fit to itself.
    let mut alike = set.clone();
    let middle_mm2 = median(stated.values().copied()).unwrap_or(1.0);
    for (name, stated_mm2) in &stated {
        scale(&mut alike, name, middle_mm2 / stated_mm2);
    }
    let parameters = robot.mdh_parameters();
    let extras = shared::unknowns(set, settings);
    let task = Task { extras: &extras, ..Task::plain(&alike, robot, &parameters, &rows, settings) };
    let robust = task.robust(Loss::Absolute)?;
    let (deleted, _) = robust.deleted();
    // What the fit took up of the residuals tells nothing of their size.
    let told = deleted.iter().find(|d| d.numbers > 0).map_or(0.0, |d| d.freedom_of_all());
    let told = told / deleted.iter().map(|d| d.numbers as f64).sum::<f64>().max(1.0);
    let unit_mm2 = robust.scatter.stated * middle_mm2 + robust.scatter.point_mm.powi(2);
    let of_group = |(name_of, stated_mm2): (&&str, &f64)| {
        let rows: Vec<_> = of_groups[name_of].iter().map(|&row| deleted[row]).filter(|d| d.numbers > 0).collect();
        let numbers = rows.first()?.numbers;
        if numbers * rows.len() < FEWEST {
            return None;
        }
        let squares: Vec<f64> = rows.iter().map(|d| d.whole_square).collect();
        Some(Seen {
            name: (**name_of).to_owned(),
            stated_mm2: *stated_mm2,
            seen_mm2: unit_mm2 * bounded_square(&squares, numbers)?,
            numbers: told * (numbers * rows.len()) as f64,
        })
    };
    Ok(stated.iter().filter_map(of_group).collect())
}

/// Mean square of a number of which each of these is a sum of so many, large ones bounded (an M-estimate of scale:
/// Huber, "Robust statistics", 1981, section 5.2).
fn bounded_square(squares: &[f64], numbers: usize) -> Option<f64> {
    let n = numbers as f64;
    let (of_squares, of_larger) = (ChiSquared::new(n).ok()?, ChiSquared::new(n + 2.0).ok()?);
    let bound = BOUNDED + n - 1.0;
    let expected = n * of_larger.cdf(bound) + bound * (1.0 - of_squares.cdf(bound));
    let mut square = median(squares.iter().copied())? / n;
    for _ in 0..50 {
        if square <= 0.0 {
            return None;
        }
        let mean = squares.iter().map(|s| (s / square).min(bound)).sum::<f64>() / squares.len() as f64;
        square *= mean / expected;
    }
    Some(square)
}

/// The group without which what the others state is most probable, where that is clear.
fn worst(groups: &[Seen]) -> Option<Off> {
    if groups.len() < GROUPS {
        return None;
    }
    // Covariances that are all too large are another finding.
    let common = median(groups.iter().map(|g| g.seen_mm2 / g.stated_mm2))?.min(1.0);
    let most = groups.iter().map(|g| g.seen_mm2.max(g.stated_mm2)).fold(0.0, f64::max);
    let cost = |g: &Seen, variance: f64| 0.5 * g.numbers * (variance.ln() + g.seen_mm2 / variance);
    let of_all = |g: &Seen, scatter_mm2: f64| cost(g, common * g.stated_mm2 + scatter_mm2);
    // With as much of the scatter as suits it.
    let usual = |g: &Seen, scatter_mm2: f64| {
        let stated_mm2 = common * g.stated_mm2;
        g.seen_mm2.clamp(stated_mm2, stated_mm2 + scatter_mm2)
    };
    let scatters: Vec<f64> =
        std::iter::once(0.0).chain((0..SCATTERS).map(|k| most * 10f64.powf(-0.05 * f64::from(k)))).collect();
    let least = |of: &dyn Fn(f64) -> f64| scatters.iter().map(|&s| (of(s), s)).min_by(|a, b| a.0.total_cmp(&b.0));
    let off = |(k, g): (usize, &Seen)| {
        let others = |s: f64| -> f64 {
            groups.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, other)| of_all(other, s)).sum()
        };
        let (together, _) = least(&|s| others(s) + cost(g, usual(g, s)))?;
        let (others, scatter_mm2) = least(&others)?;
        let alone = cost(g, g.seen_mm2);
        let usual_mm2 = usual(g, scatter_mm2);
        let times = (g.seen_mm2 / usual_mm2).sqrt();
        let own_scatter_mm2 = usual_mm2 - common * g.stated_mm2;
        let factor = ((g.seen_mm2 - own_scatter_mm2) / (common * g.stated_mm2)).max(LEAST);
        let evidence = together - others - alone;
        let looks = 2.0 * groups.len() as f64;
        (times.max(1.0 / times) > OFF && evidence > CLEAR + looks.ln()).then(|| Off {
            name: g.name.clone(),
            times,
            factor,
            evidence,
        })
    };
    groups.iter().enumerate().filter_map(off).max_by(|a, b| a.evidence.total_cmp(&b.evidence))
}

/// Multiplies the covariances of a group.
fn scale(set: &mut Dataset, name: &str, factor: f64) {
    let of_group: Vec<bool> = set.groups.iter().map(|g| g.name == name).collect();
    for pose in set.poses.iter_mut().filter(|p| of_group[p.group]) {
        match &mut pose.reading {
            Reading::Position { covariance_mm2: Some(c), .. } => *c *= factor,
            Reading::Distance { sigma_mm: Some(s), .. } => *s *= factor.sqrt(),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Matrix3xX, Vector3};

    use super::*;
    use crate::identify::synthetic;
    use crate::measurements::Measurement;

    const NOISE_MM: f64 = 0.02;

    /// What is said of points whose covariances are off by this factor of a standard deviation in group g1 and by that
    /// in all groups, and the ratio of the first group's variance to the second's as they are used.
    fn examined(of_group: f64, of_all: f64) -> (Vec<String>, f64) {
        let world = synthetic::world(120, NOISE_MM, 4);
        let mut rows = world.rows.clone();
        synthetic::state(&mut rows, |at| {
            let sd_mm = NOISE_MM * of_all * if at.group == "g1" { of_group } else { 1.0 };
            Some(Matrix3::identity() * sd_mm * sd_mm)
        });
        let set = Dataset::new(&rows).unwrap();
        let (set, findings) = examine(&set, &world.nominal, &Settings::default());
        let first = |name: &str| {
            let pose = set.poses.iter().find(|p| set.groups[p.group].name == name).unwrap();
            pose.reading.variance_mm2().unwrap()
        };
        (findings.into_iter().map(|f| f.finding).collect(), first("g1") / first("g0"))
    }

    #[test]
    fn a_group_whose_covariances_are_off_is_named_and_mended() {
        for factor in [0.1, 1.0 / 3.0, 3.0, 10.0] {
            let (said, ratio) = examined(factor, 1.0);
            let way = if factor < 1.0 { "g1 are too small" } else { "g1 are too large" };
            assert!(said.len() == 1 && said[0].contains(way), "{factor}: {said:?}");
            assert!((0.5..2.0).contains(&ratio), "{factor}: {ratio}");
        }
    }

    #[test]
    fn groups_that_are_all_right_or_all_off_are_left_alone() {
        for of_all in [0.1, 1.0, 10.0] {
            assert_eq!(examined(1.0, of_all), (Vec::new(), 1.0), "{of_all}");
        }
    }

    #[test]
    fn a_group_that_scatters_by_what_it_states_is_right_however_far_others_miss_the_model() {
        let seen = |name: &str, times: f64| Seen {
            name: name.to_owned(),
            stated_mm2: 1e-4,
            seen_mm2: 1e-4 * times * times,
            numbers: 40.0,
        };
        let others = ["g2", "g3", "g4"].map(|name| seen(name, 2.5));
        let said = |of_first: f64| worst(&[&[seen("g1", of_first)], &others[..]].concat()).map(|off| off.times);
        assert_eq!([1.0, 1.3, 2.5, 3.5].map(said), [None; 4]);
        assert!((said(0.3).unwrap() - 0.3).abs() < 1e-9 && said(6.0).unwrap() > 2.0);
    }

    #[test]
    fn an_error_that_all_rows_share_is_not_a_groups_own() {
        let world = synthetic::world(120, NOISE_MM, 4);
        let mut rows = world.rows.clone();
        // The first group stands where the calibration's error is large.
        let column = |i: usize, row: &Measurement| {
            Vector3::z() * if row.at.group == "g1" { 0.2 * (1.7 * i as f64).sin() } else { 0.0 }
        };
        for (i, row) in rows.iter_mut().enumerate() {
            let moved = column(i, row);
            *synthetic::point(row) += moved;
        }
        synthetic::state(&mut rows, |_| Some(Matrix3::identity() * NOISE_MM * NOISE_MM));
        let mut set = Dataset::new(&rows).unwrap();
        let said = |set: &Dataset| examine(set, &world.nominal, &Settings::default()).1.len();
        assert_eq!(said(&set), 1);
        set.shared = rows.iter().enumerate().map(|(i, row)| Matrix3xX::from_columns(&[column(i, row)])).collect();
        assert_eq!((set.shared.len(), said(&set)), (set.poses.len(), 0));
    }

    #[test]
    fn the_scale_of_squares_is_hardly_moved_by_a_gross_error() {
        // Quantiles of chi-square of three degrees of freedom.
        let of_three = ChiSquared::new(3.0).unwrap();
        let mut squares: Vec<f64> =
            (0..200).map(|k| 4.0 * of_three.inverse_cdf((f64::from(k) + 0.5) / 200.0)).collect();
        let clean = bounded_square(&squares, 3).unwrap();
        assert!((clean - 4.0).abs() < 0.02, "{clean}");
        squares.extend([1e6; 10]);
        let spoilt = bounded_square(&squares, 3).unwrap();
        assert!((4.0..5.0).contains(&spoilt), "{spoilt}");
    }
}
