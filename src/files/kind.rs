//! What a file is that was named in place of another, for messages: the program's own files by a key or a line that no
//! other of them has.

use serde_json::Value;

/// Keys of the program's JSON files, each in one of them alone, and what the file is called.
const BY_KEY: [(&str, &str); 9] = [
    ("right_from_left", "a calibration"),
    ("flange_from_target", "a placement (placement.json)"),
    ("identifiability", "an identification (identification.json)"),
    ("evidence", "the verdict on a rig (camera-check.json)"),
    ("target_shape", "a summary of measurements (measure.json)"),
    ("noise_mm", "a plan (plan.json)"),
    ("motions", "a compensation (compensate.json)"),
    ("P1", "a rectification (rectified.json)"),
    ("provenance", "another result of stereocal"),
];

/// What a text is, where that is seen.
pub fn kind(text: &str) -> Option<&'static str> {
    let text = text.trim_start_matches('\u{feff}').trim_start();
    if text.starts_with('{') {
        let Ok(Value::Object(object)) = serde_json::from_str(text) else { return None };
        return BY_KEY.iter().find(|(key, _)| object.contains_key(*key)).map(|(_, name)| *name);
    }
    let lines = || text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    if lines().any(|line| line == "[[joint]]") {
        return Some("a robot file");
    }
    let first = lines().next()?;
    let is_table = !first.contains(['=', '{', '<', '"']) && first.matches([',', ';', '\t']).count() >= 2;
    is_table.then_some("a table")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_told_by_what_stands_in_them() {
        for (text, is) in [
            ("{\"groups\": [], \"flange_from_target\": null}", Some("a placement (placement.json)")),
            ("{\"mode\": \"undistort\", \"P1\": []}", Some("a rectification (rectified.json)")),
            ("{\"version\": 1}", None),
            ("{\"flange_from_target\"", None),
            ("\u{feff}pose,group,role,j1_deg\n1,a,sample,0\n", Some("a table")),
            ("1;2;3\n", Some("a table")),
            ("# stereocal\nname = \"r\"\n[[joint]]\nalpha_deg = 0.0\n", Some("a robot file")),
            ("a = [1, 2, 3]\n", None),
            ("", None),
        ] {
            assert_eq!(kind(text), is, "{text}");
        }
    }
}
