//! What was found along the rows: sessions, drifts, and what is said of them.

use serde::Serialize;

use crate::identify::data::dataset::{Dataset, Group};
use crate::identify::finding::Finding;
use crate::measurements::Role;

/// Rows of a group that have one placement.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Session {
    pub group: String,
    /// First fitted pose.
    pub first: String,
    /// Last fitted pose.
    pub last: String,
    /// Fitted poses.
    pub count: usize,
}

/// What was found along the rows.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Along {
    /// Sessions; empty where none was cut.
    pub sessions: Vec<Session>,
    /// Names of the groups whose placement drifts.
    pub drifting: Vec<String>,
    /// The row from which on the zero of a joint steps.
    pub step: Option<String>,
    /// Rows that are not of one robot; whatever else a fit to all of them finds follows from that.
    pub robots: Option<Finding>,
    /// Said instead of a sensor that moved or drifts, where a tool or a joint that did is as likely.
    pub instead: Option<Finding>,
}

/// The sessions of the groups that were cut.
pub(super) fn list(set: &Dataset) -> Vec<Session> {
    let session = |(g, group): (usize, &Group)| {
        let rows = set.rows(|p| p.group == g && p.role != Role::Verify);
        let name = |row: Option<&usize>| row.map(|&r| set.poses[r].name.clone());
        let (first, last) = (name(rows.first())?, name(rows.last())?);
        Some((rows[0], Session { group: group.name.clone(), first, last, count: rows.len() }))
    };
    let cut = |group: &Group| set.groups.iter().filter(|g| g.name == group.name).count() > 1;
    let groups = set.groups.iter().enumerate().filter(|(_, group)| cut(group));
    let mut sessions: Vec<(usize, Session)> = groups.filter_map(session).collect();
    sessions.sort_by_key(|(row, _)| *row);
    sessions.into_iter().map(|(_, s)| s).collect()
}
