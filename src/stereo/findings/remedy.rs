//! What to do about a change of the rig: for a person who photographs again.

use crate::stereo::pairs::Cause;

/// Holds what changed. `causes` are words with `|` between them; `since` are the pairs after the last change of a rig that went on
/// changing, where they are enough for a rig. `None` where no hold helps.
pub(super) fn hold(causes: &str, since: Option<&[String]>) -> Option<String> {
    let is = |of: &[Cause]| causes.split('|').any(|word| of.iter().any(|cause| cause.word() == word));
    let unknown = is(&[Cause::Unknown]);
    let moved = unknown || is(&[Cause::Yaw, Cause::Pitch, Cause::Roll, Cause::Baseline, Cause::CameraMoved]);
    let hold = [
        (unknown || is(&[Cause::Focus])).then_some("lock the focus of both cameras"),
        moved.then_some("clamp both cameras"),
    ];
    let hold: Vec<&str> = hold.into_iter().flatten().collect();
    let again = (!hold.is_empty()).then(|| format!("{}, and take all pairs again", hold.join(" and ")))?;
    Some(match since {
        Some([first, others @ ..]) => {
            format!("{again}; or `--since {first}`: the rig of the last {} pairs", others.len() + 1)
        }
        _ => again,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changed_is_held() {
        let said = |causes| hold(causes, None).unwrap_or_default();
        assert_eq!(said("focus"), "lock the focus of both cameras, and take all pairs again");
        assert_eq!(said("yaw|baseline"), "clamp both cameras, and take all pairs again");
        assert!(said("focus|yaw").starts_with("lock the focus of both cameras and clamp both cameras"));
        assert!(said("unknown") == said("focus|camera-moved") && said("other-board").is_empty());
        let pairs = ["0017".to_owned(), "0018".to_owned()];
        assert!(hold("unknown", Some(&pairs)).unwrap().ends_with("or `--since 0017`: the rig of the last 2 pairs"));
    }
}
