//! Whether every pose that is wrong was said to be.

use super::super::judge::{Judgement, TOLERANCE_MM};
use super::Expected;
use super::session::{Measured, Session};

/// A point is wrong that is off by so many of its own standard deviations.
const SIGMAS: f64 = 5.0;

/// How many poses fared how.
#[derive(Debug, Clone, Copy, Default)]
pub struct Poses {
    pub measured: usize,
    pub wrong: usize,
    /// Poses that a line of what was said mentions.
    pub named: usize,
}

/// A run, judged.
pub struct Judged {
    pub poses: Poses,
    pub worst_mm: f64,
    pub worst_sigmas: f64,
    pub judgement: Judgement,
}

/// Judges.
pub fn judge(session: &Session, expected: &Expected, said: &Measured) -> Judged {
    let mut poses = Poses::default();
    let (mut worst_mm, mut worst_sigmas) = (0.0f64, 0.0f64);
    let mut silent = false;
    let mut lost = false;
    for (k, pair) in session.pairs.iter().enumerate() {
        let row = said.rows.iter().find(|row| row.pose == pair.name);
        let named = said.words.iter().any(|line| mentions(line, &pair.name));
        poses.named += usize::from(named);
        let meant = matches!(expected, Expected::Named(list) if list.contains(&k));
        let Some((point, covariance)) = row.and_then(|row| row.point) else {
            lost |= !meant;
            continue;
        };
        poses.measured += 1;
        let off = point - session.mark_point(k).coords;
        let squared = covariance.try_inverse().map_or(f64::INFINITY, |inverse| off.dot(&(inverse * off)));
        let sigmas = squared.max(0.0).sqrt();
        worst_mm = worst_mm.max(off.norm());
        worst_sigmas = worst_sigmas.max(sigmas);
        if sigmas > SIGMAS {
            poses.wrong += 1;
            // A word about the rig stands for all poses; a fault of one pose has to name it.
            silent |= if meant { !named } else { said.words.is_empty() };
        }
    }
    // Covariances may have grown with the misfit: a millimetre without a word is none the better for it.
    silent |= worst_mm > TOLERANCE_MM && said.words.is_empty();
    let ended = !matches!(said.status, Some(0 | 1));
    let judgement = match expected {
        _ if silent && !ended => Judgement::Silent,
        Expected::Clean if ended || lost => Judgement::FalseFail,
        Expected::Clean if !said.words.is_empty() => Judgement::FalseAlarm,
        Expected::Named(_) if ended || lost => Judgement::FalseFail,
        _ => Judgement::Right,
    };
    Judged { poses, worst_mm, worst_sigmas, judgement }
}

/// True where a line has the pose's name as a word of its own.
fn mentions(line: &str, name: &str) -> bool {
    line.split(|c: char| !c.is_alphanumeric()).any(|word| word == name)
}
