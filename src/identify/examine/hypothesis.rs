//! What may be wrong with the units and conventions of a data set or of a robot's file, one fault at a time, and how
//! both are without it.

mod words;

use nalgebra::{Rotation3, Vector3};

use crate::identify::data::dataset::{Dataset, Kind, Pose, Reading};
use crate::identify::data::still::{STILL, way};
use crate::robot::Robot;
use crate::tables::names::Unit;

/// One thing that may be wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hypothesis {
    /// Joint angles, read in the first unit, are in the second.
    Angles(Unit, Unit),
    /// Those of one joint are.
    JointRadians(usize),
    /// The way of a joint that slides is in a unit of so many mm.
    Slide(usize, f64, &'static str),
    /// One coordinate of the points is in a unit of so many mm.
    Coordinate(usize, f64, &'static str),
    /// A part of the readings is in a unit of so many mm.
    Part(f64, &'static str),
    /// A joint's reading holds so many times that of the joint before it.
    Coupled(usize, f64),
    /// Readings, multiplied by so much, are in the second unit and not in the first.
    Lengths(f64, Unit, Unit),
    /// Known distances are in a unit of so many mm.
    KnownLengths(f64, &'static str),
    /// Two columns are exchanged.
    Exchanged(usize, usize),
    /// A joint is counted the other way round.
    Negated(usize),
    /// A joint is off by so many degrees.
    Offset(usize, f64),
    /// The twist of a joint's link has the wrong sign in the robot's file.
    Twisted(usize),
    /// Joints, or one, stand so many rows off.
    Lagging(Option<usize>, isize),
    /// The robot's parameters are standard DH ones.
    StandardDh,
    /// Several joints are counted otherwise.
    Counted(Counting),
    /// Points are in a left-handed frame.
    Mirrored,
}

/// How joints are counted, of several at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Counting {
    /// A bit for each joint that is counted the other way round, the first joint's the lowest.
    pub negated: u32,
    /// A joint, before it is turned round: its reading holds so many times that of the one before it.
    pub coupled: Option<(usize, f64)>,
}

impl Counting {
    /// Whether it is about more than one fault.
    pub fn is_of_several(&self) -> bool {
        self.negated.count_ones() + u32::from(self.coupled.is_some()) > 1
    }

    /// Whether the other changes all of this, and more.
    pub fn is_part_of(&self, other: &Counting) -> bool {
        let is_coupled_alike = self.coupled.is_none() || self.coupled == other.coupled;
        self != other && self.negated & !other.negated == 0 && is_coupled_alike
    }

    /// The joints that are counted the other way round.
    fn negated(&self) -> Vec<usize> {
        (0..u32::BITS as usize).filter(|joint| self.negated >> joint & 1 == 1).collect()
    }

    /// Readings, rad, and the robot as they are if it holds.
    pub fn applied(&self, joints_rad: &[Vec<f64>], robot: &Robot) -> (Vec<Vec<f64>>, Robot) {
        let (mut rows, mut robot) = (joints_rad.to_vec(), robot.clone());
        if let Some((joint, times)) = self.coupled {
            rows.iter_mut().for_each(|row| row[joint] -= times * row[joint - 1]);
        }
        for joint in self.negated() {
            robot.joints[joint].sign = -robot.joints[joint].sign;
        }
        (rows, robot)
    }

    /// The joints that are negated, by their numbers.
    fn numbers(&self) -> String {
        self.negated().iter().map(|joint| (joint + 1).to_string()).collect::<Vec<_>>().join(", ")
    }

    /// Those negated in words; `None` where there are none.
    fn signs(&self) -> Option<String> {
        match self.negated.count_ones() {
            0 => None,
            1 => Some(format!("joint {} is counted the other way round (its sign is flipped)", self.numbers())),
            _ => Some(format!("joints {} are counted the other way round (their signs are flipped)", self.numbers())),
        }
    }
}

/// Units in which lengths are written where they are not in mm.
const OTHER_UNITS: [(f64, &str); 3] = [(1000.0, "m"), (25.4, "inches"), (10.0, "cm")];

/// How far no joint turns from its least to its largest reading, rad: two turns.
const FARTHEST_WAY: f64 = 4.0 * std::f64::consts::PI;

/// Sine of a twist whose sign matters: a smaller one is an error of manufacture.
const LEAST_TWIST: f64 = 0.1;

/// Joints that hardly move: what is said of their columns the tool's place undoes.
pub fn still(set: &Dataset) -> Vec<usize> {
    (0..set.joint_count()).filter(|&j| way(set, j) < STILL).collect()
}

/// All that may be wrong with a set of this kind.
pub fn hypotheses(set: &Dataset, robot: &Robot) -> Vec<Hypothesis> {
    let joints = set.joint_count();
    let mut list = vec![Hypothesis::StandardDh];
    list.push(Hypothesis::Angles(Unit::Deg, Unit::Rad));
    // Of a robot that hardly moves touches agree and distances are alike, whoever's they are: angles that no joint reaches
    // are a proof that they were read as radians and are degrees, and nothing else is.
    if (0..joints).any(|joint| !set.is_sliding(joint) && way(set, joint) > FARTHEST_WAY) {
        list.push(Hypothesis::Angles(Unit::Rad, Unit::Deg));
    }
    // A touch reads no length.
    let touches = (0..set.poses.len()).any(|row| set.touches(row));
    if !touches && small_part(set).is_some() {
        list.extend(OTHER_UNITS.map(|(mm, unit)| Hypothesis::Part(mm, unit)));
    }
    let read_as = set.typed_unit.unwrap_or(Unit::Mm);
    for unit in [Unit::M, Unit::Inch, Unit::Cm, Unit::Um, Unit::Mm].into_iter().filter(|unit| *unit != read_as) {
        match touches {
            false => list.push(Hypothesis::Lengths(unit.converted(1.0) / read_as.converted(1.0), read_as, unit)),
            true if set.known.is_empty() || unit == Unit::Mm => {}
            true => list.push(Hypothesis::KnownLengths(unit.converted(1.0), unit.word())),
        }
    }
    if set.kind == Kind::Positions {
        list.push(Hypothesis::Mirrored);
        let of_axis = |axis| OTHER_UNITS.map(|(mm, unit)| Hypothesis::Coordinate(axis, mm, unit));
        list.extend((0..3).flat_map(of_axis));
    }
    let still = still(set);
    let turns = |i: usize| !still.contains(&i) && !set.is_sliding(i);
    for i in 0..joints {
        list.push(Hypothesis::Negated(i));
        if set.is_sliding(i) && way(set, i) > 0.0 {
            list.extend(OTHER_UNITS.map(|(mm, unit)| Hypothesis::Slide(i, mm, unit)));
        }
        list.extend((i + 1..joints).map(|j| Hypothesis::Exchanged(i, j)));
        // Radians that were taken for degrees move the joint by a fraction of its way.
        if !set.is_sliding(i) && way(set, i).to_degrees() > STILL {
            list.push(Hypothesis::JointRadians(i));
        }
        if i > 0 && turns(i) && turns(i - 1) {
            list.extend([1.0, -1.0].map(|times| Hypothesis::Coupled(i, times)));
        }
        list.extend([90.0, -90.0, 180.0].map(|deg| Hypothesis::Offset(i, deg)));
        list.extend([1, -1].map(|by| Hypothesis::Lagging(Some(i), by)));
    }
    list.extend([1, -1].map(|by| Hypothesis::Lagging(None, by)));
    list.extend((0..joints).filter(|&i| robot.joints[i].alpha_rad.sin().abs() > LEAST_TWIST).map(Hypothesis::Twisted));
    list
}

impl Hypothesis {
    /// What lengths are multiplied by, so that errors can be compared.
    pub fn factor(self) -> f64 {
        if let Hypothesis::Lengths(factor, ..) = self { factor } else { 1.0 }
    }

    /// Whether all that it is about stands still in the set: the tool's place then undoes what it says as well as it
    /// can say it.
    pub fn is_of_still(self, still: &[usize]) -> bool {
        match self {
            Hypothesis::Exchanged(i, j) => still.contains(&i) && still.contains(&j),
            Hypothesis::Negated(i) | Hypothesis::Offset(i, _) => still.contains(&i),
            _ => false,
        }
    }

    /// The joint that it is about, where it is about what one reads but for a zero, which of a joint that moves the
    /// target little is the target's.
    pub fn of_one_joint(self) -> Option<usize> {
        match self {
            Hypothesis::JointRadians(i)
            | Hypothesis::Slide(i, ..)
            | Hypothesis::Negated(i)
            | Hypothesis::Lagging(Some(i), _) => Some(i),
            _ => None,
        }
    }

    /// The rows that it is about, where it is not about all.
    pub fn rows(self, set: &Dataset) -> Vec<usize> {
        if let Hypothesis::Part(..) = self { small_part(set).unwrap_or_default() } else { Vec::new() }
    }

    /// The set and the robot as they are if it holds.
    pub fn applied(self, set: &Dataset, robot: &Robot) -> (Dataset, Robot) {
        let slides = |joint: usize| set.is_sliding(joint);
        let (mut set, mut robot) = (set.clone(), robot.clone());
        match self {
            // Of joints that slide the numbers are no angles.
            Hypothesis::Angles(read_as, unit) => {
                let times = unit.converted(1.0) / read_as.converted(1.0);
                (0..set.joint_count()).filter(|&j| !slides(j)).for_each(|j| turn(&mut set, j, times));
            }
            Hypothesis::Lengths(factor, ..) => set.poses.iter_mut().for_each(|pose| scale(pose, factor)),
            Hypothesis::KnownLengths(factor, _) => {
                for known in &mut set.known {
                    known.distance_mm *= factor;
                    known.stated_sigma_mm = known.stated_sigma_mm.map(|mm| mm * factor);
                }
            }
            Hypothesis::JointRadians(i) => turn(&mut set, i, Unit::Rad.converted(1.0)),
            Hypothesis::Slide(i, factor, _) => turn(&mut set, i, factor),
            Hypothesis::Coordinate(axis, factor, _) => {
                set.poses.iter_mut().for_each(|pose| stretch(pose, axis, factor));
            }
            Hypothesis::Part(factor, _) => {
                for row in small_part(&set).unwrap_or_default() {
                    scale(&mut set.poses[row], factor);
                }
            }
            Hypothesis::Coupled(i, times) => {
                set.poses.iter_mut().for_each(|p| p.joints_rad[i] -= times * p.joints_rad[i - 1]);
            }
            Hypothesis::Exchanged(i, j) => set.poses.iter_mut().for_each(|p| p.joints_rad.swap(i, j)),
            Hypothesis::Negated(i) => robot.joints[i].sign = -robot.joints[i].sign,
            Hypothesis::Offset(i, deg) => robot.joints[i].theta_rad += deg.to_radians(),
            Hypothesis::Twisted(i) => robot.joints[i].alpha_rad = -robot.joints[i].alpha_rad,
            Hypothesis::Lagging(joint, by) => set = lagging(set, joint, by),
            Hypothesis::Counted(counting) => {
                let joints: Vec<Vec<f64>> = set.poses.iter().map(|pose| pose.joints_rad.clone()).collect();
                let (rows, counted) = counting.applied(&joints, &robot);
                set.poses.iter_mut().zip(rows).for_each(|(pose, row)| pose.joints_rad = row);
                robot = counted;
            }
            Hypothesis::StandardDh => robot = from_standard(&robot),
            Hypothesis::Mirrored => {
                set.mirrored = !set.mirrored;
                set.poses.iter_mut().for_each(mirror);
            }
        }
        (set, robot)
    }
}

/// How far apart the sizes of readings in two units are at the least, and how many rows a part has.
const UNITS_APART: f64 = 2.5;
const FEWEST_OF_PART: usize = 2;

/// Rows that are in a unit of their own: those below the widest gap between the sizes of readings.
fn small_part(set: &Dataset) -> Option<Vec<usize>> {
    let size = |pose: &Pose| match &pose.reading {
        Reading::Position { point_mm, .. } => Some(point_mm.coords.norm()),
        Reading::Distance { distance_mm, .. } => Some(*distance_mm),
        Reading::Reference => None,
    };
    let mut sizes: Vec<(f64, usize)> =
        set.poses.iter().enumerate().filter_map(|(row, pose)| Some((size(pose)?, row))).collect();
    sizes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let last = sizes.len().checked_sub(FEWEST_OF_PART)?;
    let gap = |&k: &usize| sizes[k].0 / sizes[k - 1].0.max(f64::MIN_POSITIVE);
    let widest = (FEWEST_OF_PART..=last).max_by(|a, b| gap(a).total_cmp(&gap(b))).filter(|k| gap(k) > UNITS_APART)?;
    let mut rows: Vec<usize> = sizes[..widest].iter().map(|(_, row)| *row).collect();
    rows.sort_unstable();
    Some(rows)
}

/// A joint that turns so many times as far.
fn turn(set: &mut Dataset, joint: usize, times: f64) {
    set.poses.iter_mut().for_each(|pose| pose.joints_rad[joint] *= times);
}

/// One coordinate of a point, with its variance and covariances, so many times as large.
fn stretch(pose: &mut Pose, axis: usize, factor: f64) {
    if let Reading::Position { point_mm, covariance_mm2, .. } = &mut pose.reading {
        point_mm[axis] *= factor;
        if let Some(c) = covariance_mm2 {
            (0..3).for_each(|k| c[(axis, k)] *= factor);
            (0..3).for_each(|k| c[(k, axis)] *= factor);
        }
    }
}

fn scale(pose: &mut Pose, factor: f64) {
    pose.on_body_mm = pose.on_body_mm.map(|part| part * factor);
    match &mut pose.reading {
        Reading::Position { point_mm, covariance_mm2, .. } => {
            point_mm.coords *= factor;
            *covariance_mm2 = covariance_mm2.map(|c| c * (factor * factor));
        }
        Reading::Distance { distance_mm, sigma_mm } => {
            *distance_mm *= factor;
            *sigma_mm = sigma_mm.map(|s| s * factor);
        }
        Reading::Reference => {}
    }
}

/// All joints, or one, from so many rows on.
fn lagging(mut set: Dataset, joint: Option<usize>, by: isize) -> Dataset {
    let before: Vec<Vec<f64>> = set.poses.iter().map(|p| p.joints_rad.clone()).collect();
    let mut alone = Vec::new();
    for (i, pose) in set.poses.iter_mut().enumerate() {
        match (i.checked_add_signed(by).and_then(|from| before.get(from)), joint) {
            (Some(from), Some(j)) => pose.joints_rad[j] = from[j],
            (Some(from), None) => pose.joints_rad.clone_from(from),
            (None, _) => alone.push(i),
        }
    }
    set.without(&alone, "its joints would stand in a row that the file does not have, for they lag")
}

fn mirror(pose: &mut Pose) {
    pose.on_body_mm = pose.on_body_mm.map(|part| Vector3::new(-part.x, part.y, part.z));
    if let Reading::Position { point_mm, covariance_mm2, .. } = &mut pose.reading {
        point_mm.x = -point_mm.x;
        if let Some(c) = covariance_mm2 {
            for k in [1, 2] {
                c[(0, k)] = -c[(0, k)];
                c[(k, 0)] = -c[(k, 0)];
            }
        }
    }
}

/// A robot whose rows were read as modified but meant as standard DH: alpha and a belong behind their joint.
fn from_standard(robot: &Robot) -> Robot {
    let mut modified = robot.clone();
    for i in 0..modified.joints.len() {
        let before = if i == 0 { (0.0, 0.0) } else { (robot.joints[i - 1].alpha_rad, robot.joints[i - 1].a_mm) };
        (modified.joints[i].alpha_rad, modified.joints[i].a_mm) = before;
    }
    if let Some(last) = robot.joints.last() {
        let turn = Rotation3::from_axis_angle(&Vector3::x_axis(), last.alpha_rad);
        modified.tool_mm = turn * robot.tool_mm + Vector3::new(last.a_mm, 0.0, 0.0);
    }
    modified
}
