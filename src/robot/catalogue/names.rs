//! Which of the catalogue's arms a person means.

use super::arms::{ARMS, PAPER};

/// Names of the arms that may be meant: the one of exactly this name, or all whose name or title holds what was
/// written, in any case, with any signs between letters and digits. A number is a whole one: 120 is not in 1200.
pub fn meant(written: &str) -> Vec<&'static str> {
    let known = || ARMS.iter().map(|arm| (arm.name, arm.title)).chain([(PAPER, "")]);
    let plain: String = written.to_ascii_lowercase().chars().filter(char::is_ascii_alphanumeric).collect();
    let same = |name: &str| name.to_ascii_lowercase().chars().filter(char::is_ascii_alphanumeric).eq(plain.chars());
    match known().find(|(name, title)| same(name) || same(title)) {
        _ if plain.is_empty() => Vec::new(),
        Some((name, _)) => vec![name],
        None => {
            known().filter(|(name, title)| holds(name, &plain) || holds(title, &plain)).map(|(name, _)| name).collect()
        }
    }
}

/// Whether a name holds letters and digits in this order, signs left out, without cutting a number of it in two.
fn holds(name: &str, plain: &str) -> bool {
    // Letters and digits of the name, each with whether a sign stands before it.
    let mut letters: Vec<(char, bool)> = Vec::new();
    let mut sign = true;
    for c in name.to_ascii_lowercase().chars() {
        if c.is_ascii_alphanumeric() {
            letters.push((c, std::mem::replace(&mut sign, false)));
        } else {
            sign = true;
        }
    }
    let whole = |at: usize| match (at.checked_sub(1).and_then(|before| letters.get(before)), letters.get(at)) {
        (Some((a, _)), Some((b, sign))) => *sign || !(a.is_ascii_digit() && b.is_ascii_digit()),
        _ => true,
    };
    let length = plain.len();
    (0..letters.len().saturating_sub(length.saturating_sub(1)))
        .any(|at| letters[at..at + length].iter().map(|(c, _)| *c).eq(plain.chars()) && whole(at) && whole(at + length))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_the_one_arm_that_it_can_be() {
        for (written, names) in [
            ("irb120", &["abb-irb120"][..]),
            ("IRB 120", &["abb-irb120"]),
            ("abb irb-120", &["abb-irb120"]),
            ("IRB 1200", &["abb-irb1200-5-0.9", "abb-irb1200-7-0.7"]),
            ("irb1200-5", &["abb-irb1200-5-0.9"]),
            ("IRB 1200-5/0.9", &["abb-irb1200-5-0.9"]),
            ("LR Mate 200iD", &["fanuc-lrmate200id"]),
            ("UR5", &["ur5"]),
            ("ur5e", &["ur5e"]),
            ("Panda", &["franka-panda"]),
            ("iiwa", &["kuka-iiwa14"]),
            ("kuka", &["kuka-iiwa14", "kuka-kr6-r900"]),
            ("Table 1", &[]),
            ("PAPER", &["paper"]),
            ("irb12", &[]),
            ("20", &[]),
            ("", &[]),
            ("-/ ", &[]),
        ] {
            assert_eq!(meant(written), names, "{written}");
        }
        for arm in ARMS {
            assert_eq!((meant(arm.name), meant(arm.title)), (vec![arm.name], vec![arm.name]));
        }
    }
}
