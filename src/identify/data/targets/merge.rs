//! Several targets at each pose, told apart by the column `target`, made one: a point and an orientation.
//!
//! In: rows with the names of their targets. Out: one row a pose, its mark point the mean of all targets, its
//! orientation that of the body that they make, and what was found wrong at poses where the targets do not stand to
//! each other as elsewhere. Targets on a line, or two, tell no turn about it: then there is the mean alone. A pose that
//! shows fewer than that takes is a point of the body: the mean of what it shows, and where that stands on the body.
//! What a robot does wrong at a pose, all its targets share; as rows of their own they would count it several times.
//! What goes wrong: targets that are no rigid body, or that neither a pose nor the robot joins; both are errors.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

use super::body::{Body, Sighting};
use super::moved::{self, Moved};
use super::sorter::{Judged, Shown, Sorter};
use crate::identify::Error;
use crate::identify::finding::Finding;
use crate::identify::sensor::{Extra, REPEATABILITY_MM};
use crate::measurements::{Measurement, Observed};

/// Variance that a stated covariance has in each direction at the least, as a share of its largest.
const LEAST_VARIANCE: f64 = 1e-6;

/// The targets of a set.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Targets {
    /// Their names, in order of appearance.
    pub names: Vec<String>,
    /// Root mean square of a coordinate's residual against the body, mm; `null` where no pose shows two of them.
    pub scatter_mm: Option<f64>,
    /// Where they stand in a frame of their own, whose origin is the mark point, mm; `null` for one that no pose joins
    /// to the others.
    pub places_mm: Vec<Option<[f64; 3]>>,
    /// Standard deviation of a place's coordinate, mm, where the nominal robot joined the targets.
    #[serde(skip)]
    pub place_sigma_mm: Option<f64>,
    /// Whether they tell an orientation.
    pub oriented: bool,
    /// Poses that show too few of them for a turn: points of the body, by the names of what they show, and where that
    /// stands, mm.
    pub parts: BTreeMap<String, Part>,
    /// Targets that moved by less than a robot repeats to: nothing was done about them.
    #[serde(skip)]
    pub slightly_moved: Option<String>,
    /// What was wrong at single poses.
    #[serde(skip)]
    pub findings: Vec<Finding>,
}

/// What poses show of a body where they show too little of it for a turn.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Part {
    /// From the mark point, in the frame of the targets' places, mm.
    pub place_mm: [f64; 3],
    pub poses: usize,
}

impl Targets {
    /// For the terminal and the page.
    pub fn sentence(&self) -> String {
        let names = self.names.join(", ");
        let Some(scatter_mm) = self.scatter_mm else {
            return format!(
                "each pose shows one target of {names}: how they stand to each other is solved with the robot; the mark point is the one with \
                 most rows"
            );
        };
        format!(
            "the targets of a pose ({names}) agree within {scatter_mm:.4} mm a coordinate; the mark point is their mean{}",
            if self.oriented { "" } else { ", without an orientation, for they stand on a line" }
        ) + &match self.parts.values().map(|part| part.poses).sum() {
            0 => String::new(),
            1 => "; 1 pose shows fewer: what it shows is a point of the body".to_owned(),
            n => format!("; {n} poses show fewer: what they show is a point of the body"),
        } + &self.slightly_moved.as_ref().map_or_else(String::new, |moved| format!("; {moved}"))
    }

    /// The same with the places as they were solved: the unknowns of [`super::Joined::columns`], by the parts in the
    /// order of their names.
    pub fn solved(mut self, unknowns: &[(Extra, f64)]) -> Targets {
        let Some(place_sigma_mm) = self.place_sigma_mm else { return self };
        let names: Vec<String> = self.parts.keys().cloned().collect();
        for (extra, value) in unknowns {
            let Extra::Shared(k) = extra else { continue };
            let Some(part) = names.get(k / 3).and_then(|name| self.parts.get_mut(name)) else { continue };
            part.place_mm[k % 3] += place_sigma_mm * value;
        }
        for (name, place) in self.names.iter().zip(&mut self.places_mm) {
            *place = self.parts.get(name).map(|part| part.place_mm).or(*place);
        }
        self
    }

    /// Where on the body the targets of this name stand, from the mark point, mm; `None` where it is the mark point.
    pub fn part_mm(&self, name: &str) -> Option<Vector3<f64>> {
        self.parts.get(name).map(|part| part.place_mm.into())
    }
}

/// One row a pose. `None` where no pose has several targets by name.
pub fn as_one(rows: &[Measurement]) -> Result<Option<(Vec<Measurement>, Targets)>, Error> {
    let mut names: Vec<String> = Vec::new();
    for row in rows {
        if !names.contains(&row.target) {
            names.push(row.target.clone());
        }
    }
    if names.len() < 2 {
        return Ok(None);
    }
    if rows.iter().any(|r| matches!(r.observed, Observed::Distance { .. })) {
        return Err(Error::Targets {
            message: format!("distances of {} targets ({})", names.len(), names.join(", ")),
            hint: "several targets a pose are measured as points; identify with one target's distances at a time",
        });
    }
    let stated = rows.iter().all(|r| !matches!(r.observed, Observed::Position { covariance_mm2: None, .. }));
    let mut poses = shown(rows, &names, stated);
    let (moved, slightly_moved) = told_apart(&mut poses, &mut names);
    let seen = sightings(&poses);
    let body = Body::new(&seen, names.len()).ok_or_else(|| Error::Targets {
        message: format!("the rows are of {} targets ({}), but no pose shows two of them", names.len(), names.join(", ")),
        hint: "the robot joins them where one of them has six rows at each place of the sensor and the others two; else one pose at which all of them \
               were measured does: its rows have the same `pose` and joints",
    })?;
    let sorter = Sorter::new(body, &seen, stated).refined(&seen);
    let scatter_mm = sorter.scatter_mm(&seen);
    sorter.check_rigid(scatter_mm, &names)?;
    let judged: Vec<Judged> = poses.iter().map(|pose| sorter.judge(pose)).collect();
    let findings = findings(&poses, &judged, &moved, &names, &sorter);
    let part_name = |targets: &[usize]| targets.iter().map(|&t| names[t].as_str()).collect::<Vec<_>>().join(" + ");
    let mut parts: BTreeMap<String, Part> = BTreeMap::new();
    let one = |(pose, judged): (&Shown, Judged)| {
        let (observed, target) = match judged {
            Judged::Taken { observed, .. } => (observed, String::new()),
            Judged::Part { observed, targets, place_mm } => {
                let name = part_name(&targets);
                parts.entry(name.clone()).or_insert(Part { place_mm: place_mm.into(), poses: 0 }).poses += 1;
                (observed, name)
            }
            Judged::Refused { reason, .. } => (Observed::Missing { reason }, String::new()),
        };
        Measurement { at: pose.first.at.clone(), target, observed }
    };
    let rows = poses.iter().zip(judged).map(one).collect();
    let targets = Targets {
        scatter_mm: Some(scatter_mm),
        place_sigma_mm: None,
        places_mm: sorter.body.places_mm.iter().map(|p| p.map(Into::into)).collect(),
        oriented: !sorter.body.is_line(),
        names,
        parts,
        slightly_moved,
        findings,
    };
    Ok(Some((rows, targets)))
}

/// The rows by pose, in order of appearance.
fn shown<'a>(rows: &'a [Measurement], names: &[String], stated: bool) -> Vec<Shown<'a>> {
    let mut poses: Vec<Shown> = Vec::new();
    let mut at: BTreeMap<&str, usize> = BTreeMap::new();
    for row in rows {
        let index = *at.entry(&row.at.pose).or_insert(poses.len());
        if index == poses.len() {
            poses.push(Shown { first: row, sightings: Vec::new(), reason: None });
        }
        match &row.observed {
            Observed::Position { point_mm, covariance_mm2, .. } => {
                let precision = covariance_mm2.filter(|_| stated).map_or(Matrix3::identity(), |c| inverse(&c));
                let target = names.iter().position(|name| *name == row.target).unwrap_or(0);
                poses[index].sightings.push(Sighting { target, point_mm: *point_mm, precision });
            }
            Observed::Missing { reason } => poses[index].reason = Some(reason),
            Observed::Distance { .. } => {}
        }
    }
    poses
}

fn sightings(poses: &[Shown]) -> Vec<Vec<Sighting>> {
    poses.iter().map(|pose| pose.sightings.clone()).collect()
}

/// Makes targets that moved others from there on; each with the index that it has from there on. One that moved by less
/// than a robot repeats to stays what it is, and what is said of it is the other: as another target it would cost
/// orientations, and as the same one hardly anything.
fn told_apart(poses: &mut [Shown], names: &mut Vec<String>) -> (Vec<(Moved, usize)>, Option<String>) {
    let (mut list, mut slight) = (Vec::new(), Vec::new());
    let most = names.len();
    // While it is searched on, one that hardly moved is another as well, so that it hides no other step: which target
    // each is, and from which pose on.
    let mut seen = sightings(poses);
    let mut parts: Vec<(usize, usize)> = (0..most).map(|target| (target, 0)).collect();
    while list.len() + slight.len() < most {
        let Some(moved) = moved::next(&seen, parts.len()) else { break };
        let (size_mm, from) = (moved::size_mm(&seen, parts.len(), moved), moved.from);
        let later = seen[from..].iter_mut().flatten();
        later.filter(|s| s.target == moved.target).for_each(|s| s.target = parts.len());
        let (target, pose) = (parts[moved.target].0, &poses[from].first.at.pose);
        if size_mm < REPEATABILITY_MM {
            slight.push(format!(
                "target {} stands {size_mm:.4} mm elsewhere from {pose} on, less than a robot repeats to, and is used all the same",
                names[target]
            ));
            parts.push((target, from));
            continue;
        }
        let new = names.len();
        names.push(format!("{} from {pose} on", names[target]));
        let later = poses[from..].iter_mut().flat_map(|pose| &mut pose.sightings);
        later.filter(|s| s.target == target).for_each(|s| s.target = new);
        list.push((Moved { target, or: moved.or.map(|or| parts[or].0), from }, new));
        parts.iter_mut().filter(|part| part.0 == target && part.1 >= from).for_each(|part| part.0 = new);
        parts.push((new, from));
    }
    (list, (!slight.is_empty()).then(|| slight.join("; ")))
}

/// Of a covariance that may be singular.
fn inverse(covariance: &Matrix3<f64>) -> Matrix3<f64> {
    let eigen = covariance.symmetric_eigen();
    let least = (LEAST_VARIANCE * eigen.eigenvalues.max()).max(crate::identify::sensor::FLOOR_MM2);
    let inverse = eigen.eigenvalues.map(|v| 1.0 / v.max(least));
    eigen.eigenvectors * Matrix3::from_diagonal(&inverse) * eigen.eigenvectors.transpose()
}

fn moved_targets(poses: &[Shown], moved: &[(Moved, usize)], names: &[String], sorter: &Sorter) -> Vec<Finding> {
    let mut list = Vec::new();
    for (Moved { target, or, from }, new) in moved {
        let either = or.map_or_else(String::new, |or| format!(" or {}", names[or]));
        let joined = [target, new].iter().all(|&&t| sorter.body.places_mm[t].is_some());
        let (at, how) = match or {
            Some(_) => ("about pose", "they stand at another distance"),
            None => ("before", "its distances to the others are other ones"),
        };
        let pose = &poses[*from].first.at.pose;
        let name = &names[*target];
        let action = match joined {
            true if or.is_some() => {
                format!("which of them is not told: target {name} counts as another one from there on")
            }
            true => "it counts as another target from there on".to_owned(),
            false => "the poses on the shorter side show too few other targets and are left out; measure them again"
                .to_owned(),
        };
        list.push(Finding::new(format!("target {name}{either} was moved {at} {pose}: {how} from there on"), action));
    }
    list
}

/// What was wrong at which poses.
fn findings(
    poses: &[Shown],
    judged: &[Judged],
    moved: &[(Moved, usize)],
    names: &[String],
    sorter: &Sorter,
) -> Vec<Finding> {
    let mut list = moved_targets(poses, moved, names, sorter);
    let mut add = |finding: String, rows: Vec<String>, action: &str| {
        if !rows.is_empty() {
            list.push(Finding::new(finding, action).about(rows));
        }
    };
    let rows = |holds: &dyn Fn(&Judged) -> bool| -> Vec<String> {
        let held = poses.iter().zip(judged).filter(|(_, judged)| holds(judged));
        held.map(|(pose, _)| pose.first.at.pose.clone()).collect()
    };
    for (target, name) in names.iter().enumerate() {
        if sorter.body.places_mm[target].is_none() && !moved.iter().any(|(m, new)| [m.target, *new].contains(&target)) {
            let shows = |pose: &&Shown| pose.sightings.iter().any(|s| s.target == target);
            let shown = poses.iter().filter(shows).map(|pose| pose.first.at.pose.clone()).collect();
            add(format!("no pose joins target {name} to the others"), shown, "its readings are left out");
        }
        add(
            format!("target {name} does not stand to the others as at the other poses"),
            rows(&|j| matches!(j, Judged::Taken { left_out: Some(out), .. } if *out == target)),
            "its readings there are left out, the other targets are used",
        );
        for (other, other_name) in names.iter().enumerate().skip(target + 1) {
            let both = [(target, other), (other, target)];
            let exchanged = rows(&|j| matches!(j, Judged::Taken { exchanged: Some(pair), .. } if both.contains(pair)));
            add(
                format!("the names of targets {name} and {other_name} are exchanged"),
                exchanged,
                "mended for this run; mend the file",
            );
        }
    }
    add(
        "the targets do not stand to each other as at the other poses".to_owned(),
        rows(&|j| matches!(j, Judged::Refused { misfit: true, .. })),
        if sorter.body.count() > 3 { "left out" } else { "left out; a fourth target would tell which of them is off" },
    );
    list
}
