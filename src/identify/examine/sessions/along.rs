//! What was found along the rows: sessions, drifts, and what is said of them.

use serde::Serialize;

use crate::identify::finding::Finding;

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
