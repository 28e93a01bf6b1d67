//! All poses of a run: measured together, each with its answer or the reason why there is none.

use crate::stereo::board_pose::answer::Series;
use crate::stereo::board_pose::rig_change::judge::{ALLOWED, judge};
use crate::stereo::board_pose::rig_change::judgement::Judgement;
use crate::stereo::board_pose::run::{Knowledge, Run, Seen};

/// Measures all poses; `seen` is in the order of the run.
pub fn measure(known: &Knowledge, seen: Vec<Seen>) -> Series {
    let mut run = Run::new(known, seen);
    if run.present().count() == 0 {
        return run.nothing(Judgement::Agrees);
    }
    if let Some(gross) = run.gross() {
        return run.nothing(gross);
    }
    let Some(found) = run.consistent() else {
        let misfit_px = run.misfit_px();
        return run.nothing(Judgement::Unexplained { misfit_px });
    };
    let moved = run.moved.clone();
    let (found, changed) = judge(found, known.usual());
    let judgement = match (moved, changed) {
        (Some(moved), _) => moved,
        (None, Some(changed)) if changed.moves_mm > known.tolerance_mm && changed.beyond > ALLOWED => {
            Judgement::Contradicts(changed)
        }
        _ if let Some(loose) = run.loose(&found) => loose,
        (None, Some(changed)) => Judgement::Allowed(changed),
        (None, None) => Judgement::Agrees,
    };
    run.finish(&found, judgement)
}
