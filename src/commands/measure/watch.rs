//! `measure --watch`: pictures are looked at as they arrive, and a pose that must be taken again is named at once.
//!
//! A picture counts as arrived when its size and its time have stayed the same from one look into the folder to the
//! next and it can be decoded; one that cannot is waited for. What is found is kept in the cache, so that the run that
//! follows, an ordinary one with the same bytes, costs no second look. It begins when every pose of the list was seen,
//! or on Ctrl-C.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, SystemTime};

use camino::Utf8Path;
use rayon::prelude::*;

use super::super::Result;
use crate::files::OutDir;
use crate::imaging::input::pairs::{PairFiles, Source};
use crate::imaging::{PairCorners, Wanted, find};
use crate::measurements::RobotPose;
use crate::progress;
use crate::stereo::board_pose::{Knowledge, Refusal, Seen, series};

/// Time between two looks into the folder.
const BETWEEN_LOOKS: Duration = Duration::from_millis(300);

/// Looks at an unchanged picture that cannot be decoded before that is said.
const PATIENCE: usize = 10;

/// What is said of a file that may still be on its way.
const UNREAD: [&str; 2] = [crate::imaging::image::UNDECODABLE, "cannot be read"];

/// Sizes and times of a pair's files.
type Stamp = [(u64, Option<SystemTime>); 2];

/// What is known of a pose so far.
#[derive(Default)]
struct Arrival {
    stamp: Option<Stamp>,
    /// Looks since the stamp changed.
    unchanged: usize,
    /// The corners of these files, or why there are none.
    found: Option<std::result::Result<PairCorners, String>>,
    said: bool,
}

/// Waits for the pictures of all poses, or for Ctrl-C.
pub(super) fn wait(
    source: &Source<'_>,
    out: &OutDir,
    poses: &[RobotPose],
    known: &Knowledge,
    wanted: &Wanted<'_>,
) -> Result<()> {
    // Whoever stands at the robot must know at once.
    progress::say_held();
    let stop = Arc::new(AtomicBool::new(false));
    if signal_hook::flag::register(signal_hook::consts::SIGINT, Arc::clone(&stop)).is_err() {
        progress::warn("Ctrl-C ends the program without results here: it could not be caught");
    }
    progress::note(format!("waiting for the pictures of {} poses in {}; Ctrl-C ends", poses.len(), source.images));
    let mut arrivals: BTreeMap<&str, Arrival> =
        poses.iter().map(|pose| (pose.pose.as_str(), Arrival::default())).collect();
    let mut refused = BTreeSet::new();
    while !stop.load(Ordering::SeqCst) {
        if look(source, out, &mut arrivals, wanted) > 0 {
            judge(poses, &arrivals, known, &mut refused);
        }
        if arrivals.values().all(|a| a.found.is_some()) {
            progress::note(format!("all {} poses are there", poses.len()));
            return Ok(());
        }
        std::thread::sleep(BETWEEN_LOOKS);
    }
    let missing: Vec<&str> = arrivals.iter().filter(|(_, a)| a.found.is_none()).map(|(pose, _)| *pose).collect();
    progress::note(format!("ended before {} poses were there: {}", missing.len(), missing.join(", ")));
    Ok(())
}

/// Looks at all pairs that have arrived since the last time; how many were found anew.
fn look(source: &Source<'_>, out: &OutDir, arrivals: &mut BTreeMap<&str, Arrival>, wanted: &Wanted<'_>) -> usize {
    // A folder that is still empty, or in which only one side has arrived, is no fault here.
    let Ok(pairing) = source.pairs(out) else { return 0 };
    let mut ready: Vec<(PairFiles, &mut Arrival)> = Vec::new();
    let mut files: BTreeMap<String, PairFiles> = pairing.pairs.into_iter().map(|f| (f.pair.clone(), f)).collect();
    for (pose, arrival) in arrivals.iter_mut() {
        let Some(files) = files.remove(*pose) else {
            // Taken away or renamed: what was found belongs to it no more.
            *arrival = Arrival::default();
            continue;
        };
        let stamp = stamp(&files);
        if stamp.is_none() || stamp != arrival.stamp {
            *arrival = Arrival { stamp, ..Arrival::default() };
            continue;
        }
        arrival.unchanged += 1;
        if arrival.found.is_none() {
            ready.push((files, arrival));
        }
    }
    let look = |(files, arrival): (PairFiles, &mut Arrival)| match find::find_pair(&files, wanted)
        .map_err(|refusal| refusal.reason)
    {
        Err(reason) if UNREAD.iter().any(|words| reason.contains(words)) => {
            if arrival.unchanged >= PATIENCE && !arrival.said {
                arrival.said = true;
                progress::warn(format!("pose {} cannot be read, waiting for another file: {reason}", files.pair));
            }
            0
        }
        found => {
            arrival.found = Some(found);
            1
        }
    };
    ready.into_par_iter().map(look).sum()
}

fn stamp(files: &PairFiles) -> Option<Stamp> {
    let of = |path: &Utf8Path| {
        let data = std::fs::metadata(path).ok()?;
        Some((data.len(), data.modified().ok()))
    };
    Some([of(&files.left)?, of(&files.right)?])
}

/// Measures what is there and says which poses must be taken again.
fn judge(poses: &[RobotPose], arrivals: &BTreeMap<&str, Arrival>, known: &Knowledge, refused: &mut BTreeSet<String>) {
    let of = |at: &RobotPose| {
        let found = arrivals.get(at.pose.as_str())?.found.clone()?;
        let corners = found.map_err(|reason| Refusal { status: "not seen", reason });
        Some(Seen { at: at.clone(), corners })
    };
    let seen: Vec<Seen> = poses.iter().filter_map(of).collect();
    let count = seen.len();
    let series = series::measure(known, seen);
    for m in &series.poses {
        match &m.target {
            Err(refusal) if refused.insert(m.at.pose.clone()) => {
                progress::warn(format!("pose {} must be taken again: {}", m.at.pose, refusal.reason));
            }
            Ok(_) if refused.remove(&m.at.pose) => progress::note(format!("pose {} is measured now", m.at.pose)),
            _ => {}
        }
    }
    if let Some(statement) = series.judgement.describe(&known.rig, &known.board) {
        progress::warn(statement);
    }
    progress::note(format!("{count} of {} poses are there", poses.len()));
}
