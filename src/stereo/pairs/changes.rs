//! What changed between the pairs of two rigs, or between a pair and the rig of the others.
//!
//! In: linearised pairs and their grouping. Out: for each group and each pair without one the simplest change that explains it. Method: one
//! number each for another pitch of the board (the relative pose of a pair scales with it) and for another focal length of either
//! camera; where one of them lowers chi-squared nearly as much as a relative pose of its own does, it is what happened.

use nalgebra::{DVector, Vector6};

use crate::stereo::model::parameters::Layout;
use crate::stereo::pairs::consistency::{Extra, FALSE_ALARM, Fit, Grouping, Linearised, POSE, groups, solve, tail};
use crate::stereo::{Rig, Side};

/// A single number that leaves less than this share of a contradiction explains it: what is left is not linear.
const LEFT_SHARE: f64 = 1e-3;

/// A difference from the rig of the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Change {
    /// The board's squares are larger by this share.
    Pitch(f64),
    /// The camera's focal length is larger by this share.
    Zoom(Side, f64),
    /// The right camera stands elsewhere: small turn (rad) and shift (mm) of `right_from_left`.
    Moved(Vector6<f64>),
}

impl Change {
    /// The same by another amount.
    fn by(self, share: f64) -> Change {
        match self {
            Change::Pitch(_) => Change::Pitch(share),
            Change::Zoom(side, _) => Change::Zoom(side, share),
            moved => moved,
        }
    }
}

/// The rig that stands, and what is different in the other groups and pairs.
pub struct Changes {
    /// The group of the rig that stands now: the last one, pairs of another board left aside.
    pub standing: Option<usize>,
    of_groups: Vec<Option<Change>>,
    of_pairs: Vec<Option<Change>>,
}

impl Changes {
    /// What is different in a pair.
    pub fn of_pair(&self, grouping: &Grouping, i: usize) -> Option<Change> {
        grouping[i].map_or(self.of_pairs[i], |group| self.of_groups[group])
    }

    /// True for a group that is another rig, and not another board on the same one.
    pub fn is_other_rig(&self, group: usize) -> bool {
        self.standing != Some(group) && !matches!(self.of_groups[group], Some(Change::Pitch(_)))
    }
}

/// Compares groups and pairs with the rig that stands.
pub fn of(pairs: &[Option<Linearised>], layout: &Layout, rig: &Rig, grouping: &Grouping) -> Changes {
    let comparison = Comparison { pairs, layout, rig, grouping, separate: solve(pairs, grouping, None) };
    let count = groups(grouping);
    let members = |group: usize| (0..grouping.len()).filter(|&i| grouping[i] == Some(group)).collect::<Vec<usize>>();
    // Of groups of the same size the later one.
    let largest = (0..count).max_by_key(|&group| members(group).len());
    let other_board = |group: usize| {
        largest.is_some_and(|into| {
            into != group && matches!(comparison.change(&members(group), into), Some(Change::Pitch(_)))
        })
    };
    let standing = grouping.iter().rev().flatten().copied().find(|&group| !other_board(group));
    let against = |set: &[usize]| standing.and_then(|into| comparison.change(set, into));
    Changes {
        standing,
        of_groups: (0..count).map(|g| if Some(g) == standing { None } else { against(&members(g)) }).collect(),
        of_pairs: (0..grouping.len()).map(|i| if grouping[i].is_none() { against(&[i]) } else { None }).collect(),
    }
}

struct Comparison<'a> {
    pairs: &'a [Option<Linearised>],
    layout: &'a Layout,
    rig: &'a Rig,
    grouping: &'a Grouping,
    separate: Option<Fit>,
}

impl Comparison<'_> {
    /// The simplest change that makes a group or a single pair part of another group.
    fn change(&self, set: &[usize], into: usize) -> Option<Change> {
        let separate = self.separate.as_ref()?;
        let first = *set.first()?;
        let own = match self.grouping[first] {
            Some(group) => separate.poses[group],
            None => self.pairs[first].as_ref()?.own,
        };
        // Without the group that was joined, the others keep their numbers: an empty group takes no part.
        let mut joined = self.grouping.clone();
        set.iter().for_each(|&i| joined[i] = Some(into));
        let all = solve(self.pairs, &joined, None)?.chi_squared - separate.chi_squared;
        let translation = self.rig.right_from_left.translation.vector;
        let cameras = self.layout.count() - POSE;
        let zoom = |side: Side| {
            let camera = self.rig.camera(side);
            let mut columns = DVector::zeros(cameras);
            let at = self.layout.camera_start(side);
            (columns[at], columns[at + 1]) = (camera.fx, camera.fy);
            columns
        };
        let scale = Vector6::new(0.0, 0.0, 0.0, translation.x, translation.y, translation.z);
        // A board whose squares are larger than assumed makes everything seem nearer, and the baseline shorter.
        let ideas = [
            (DVector::zeros(cameras), -scale, Change::Pitch(0.0)),
            (zoom(Side::Left), Vector6::zeros(), Change::Zoom(Side::Left, 0.0)),
            (zoom(Side::Right), Vector6::zeros(), Change::Zoom(Side::Right, 0.0)),
        ];
        let explained = ideas.into_iter().filter_map(|(cameras, pose, idea)| {
            let fit = solve(self.pairs, &joined, Some(&Extra { pairs: set, cameras, pose }))?;
            let left = fit.chi_squared - separate.chi_squared;
            let chance =
                tail(left / POSE as f64 / separate.scatter(self.grouping), POSE, separate.freedom(self.grouping));
            (left < LEFT_SHARE * all || chance > FALSE_ALARM).then_some((left, idea.by(fit.extra?)))
        });
        let simplest = explained.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, change)| change);
        Some(simplest.unwrap_or(Change::Moved(own - separate.poses[into])))
    }
}
