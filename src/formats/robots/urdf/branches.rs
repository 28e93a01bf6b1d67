//! Where the links of a description fork: which end is the flange, and what is said of the branches that are left out.

use super::{Kind, Urdf, UrdfJoint};
use crate::diagnostic::count;
use crate::files::Result;

/// Names that descriptions give to the flange, the best first: taken where several links end the same chain.
const FLANGES: [&str; 5] = ["tool0", "flange", "ee_link", "link8", "link_ee"];

/// Words in the names of links and joints of a gripper.
const FINGERS: [&str; 5] = ["finger", "gripper", "jaw", "knuckle", "thumb"];

/// Joints of its own with which a branch is another arm: fingers have fewer.
const OF_AN_ARM: usize = 5;

fn grips(name: &str) -> bool {
    FINGERS.iter().any(|finger| name.to_lowercase().contains(finger))
}

impl Urdf {
    /// Links without a joint behind them.
    pub(super) fn ends(&self) -> Vec<String> {
        let children = self.joints.iter().map(|j| &j.child);
        children.filter(|link| !self.joints.iter().any(|j| j.parent == **link)).cloned().collect()
    }

    /// Names of the moving joints before a link.
    fn moving(&self, tip: &str) -> Vec<&str> {
        let before = |link: &str| self.joints.iter().find(|j| j.child == link);
        let joints = std::iter::successors(before(tip), |joint| before(&joint.parent));
        // Joints that form a circle have no end.
        let joints = joints.take(self.joints.len());
        joints.filter(|joint| joint.kind != Kind::Fixed).map(|joint| joint.name.as_str()).collect()
    }

    /// The end of the longest chain, where all other ends hang on it or a name tells, or the arm's end beside that of a
    /// finger; none where others are arms too.
    pub(super) fn flange(&self) -> Result<String> {
        let ends = self.ends();
        let longest = ends.iter().map(|e| self.moving(e).len()).max().unwrap_or(0);
        let main: Vec<&String> = ends.iter().filter(|e| self.moving(e).len() == longest).collect();
        let one_chain = main.windows(2).all(|w| self.moving(w[0]) == self.moving(w[1]));
        let named = FLANGES.iter().find_map(|name| main.iter().find(|end| end.ends_with(name)));
        let of_main = main.first().map_or_else(Vec::new, |end| self.moving(end));
        let own = |end: &String| self.moving(end).iter().filter(|joint| !of_main.contains(joint)).count();
        match (main.as_slice(), named) {
            ([only], _) if ends.iter().all(|end| own(end) < OF_AN_ARM) => {
                Ok(self.before_finger(only, &ends).unwrap_or(only).clone())
            }
            (_, Some(named)) if one_chain => Ok((*named).clone()),
            _ => {
                let list: Vec<String> = ends.iter().map(|e| format!("{e} ({} joints)", self.moving(e).len())).collect();
                let message = format!("several links end a chain: {}", list.join(", "));
                let example = self.best(&ends).map_or(String::new(), |e| {
                    let joints = count(self.moving(&e).len(), "joint");
                    format!("; `--tip {e}` has the most that move on their own, {joints}")
                });
                let hint = format!("`--tip LINK` names the one that carries the target{example}");
                Err(self.refuse(None, message, Some(hint)))
            }
        }
    }

    /// The link whose chain has the most joints that move on their own: of several the flange by its name. A finger is
    /// not where an arm ends, the link before it is.
    fn best(&self, ends: &[String]) -> Option<String> {
        let before_fingers = |end: &String| {
            let mut link = end.as_str();
            while let Some(joint) = self.joints.iter().find(|j| j.child == link) {
                if joint.kind != Kind::Fixed && !self.is_of_finger(&joint.name) && !grips(&joint.child) {
                    break;
                }
                if joint.kind == Kind::Fixed && !grips(link) {
                    break;
                }
                link = &joint.parent;
            }
            link.to_owned()
        };
        let usable = |link: &String| self.chain_to(link.clone()).is_ok();
        let candidates = ends.iter().filter(|e| !grips(e)).cloned().chain(ends.iter().map(before_fingers));
        let rolls = |link: &String| link.to_lowercase().contains("wheel");
        let rank = |link: &String| {
            let is_named = FLANGES.iter().any(|flange| link.ends_with(flange));
            (self.moving(link).len(), !rolls(link), ends.contains(link), is_named)
        };
        // A hand alone has nothing but fingers.
        let best = candidates.filter(usable).max_by_key(rank);
        best.or_else(|| ends.iter().filter(|end| usable(end)).max_by_key(|end| rank(end)).cloned())
    }

    /// Whether a joint moves a finger, by its name or by that of what it moves, which may be a whole gripper.
    fn is_of_finger(&self, joint: &str) -> bool {
        let moves = |j: &&UrdfJoint| grips(&j.child) && !j.child.to_lowercase().contains("gripper");
        grips(joint) || self.joints.iter().filter(|j| j.name == joint).any(|j| moves(&j))
    }

    /// The end of the arm where the longest chain goes on from there with a finger alone; none where more than one
    /// could be it.
    fn before_finger<'a>(&self, longest: &str, ends: &'a [String]) -> Option<&'a String> {
        let all = self.moving(longest);
        let is_before = |end: &&String| {
            let own = self.moving(end);
            let fingers = &all[..all.len() - own.len()];
            !own.is_empty()
                && all.ends_with(&own)
                && !fingers.is_empty()
                && fingers.iter().all(|j| self.is_of_finger(j))
        };
        let mut before = ends.iter().filter(is_before);
        before.next().filter(|_| before.next().is_none())
    }

    /// What the user must know of a tip that nobody named: joints of branches that fork off behind a joint of its
    /// chain, and a last one that is a finger's.
    pub(super) fn left_out(&self, tip: &str) -> Vec<String> {
        let taken = self.moving(tip);
        let mut said = Vec::new();
        for end in self.ends() {
            let (left, shared): (Vec<&str>, Vec<&str>) =
                self.moving(&end).into_iter().partition(|j| !taken.contains(j));
            if let (Some(fork), false) = (shared.first(), left.is_empty()) {
                said.push(format!(
                    "the links fork behind joint `{fork}`: the chain to `{tip}` is taken, with {}, and `{}` is left out; `--tip {end}` takes the other branch",
                    count(taken.len(), "joint"),
                    left.into_iter().rev().collect::<Vec<_>>().join("`, `")
                ));
            }
        }
        let last = self.joints.iter().find(|j| taken.first() == Some(&j.name.as_str()));
        if let Some(joint) = last.filter(|joint| taken.len() > 1 && self.is_of_finger(&joint.name)) {
            said.push(format!(
                "the last joint of the chain, `{}`, is one of a gripper by its name: `--tip {}` ends the chain before it",
                joint.name, joint.parent
            ));
        }
        said
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use camino::Utf8Path;

    /// A URDF of joints: name, link before, link behind; names with `=` hold.
    fn urdf(joints: &[(&str, &str, &str)]) -> Urdf {
        let mut text = "<robot name=\"r\"><link name=\"base\"/>".to_owned();
        for (name, parent, child) in joints {
            let kind = if name.starts_with('=') { "fixed" } else { "revolute" };
            text += &format!(
                "<link name=\"{child}\"/><joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/>\
                 <origin xyz=\"0.1 0 0.2\"/><axis xyz=\"0 1 0\"/></joint>\n"
            );
        }
        Urdf::parse(text + "</robot>", Utf8Path::new("r.urdf")).unwrap()
    }

    #[test]
    fn a_finger_beside_the_end_of_an_arm_is_left_out_and_named() {
        let arm = [("pan", "base", "shoulder"), ("lift", "shoulder", "arm"), ("roll", "arm", "gripper_link")];
        let jaw = [("gripper", "gripper_link", "moving_jaw")];
        let frame = [("=tool", "gripper_link", "tool_frame")];
        let of = |parts: &[&[(&str, &str, &str)]]| {
            let urdf = urdf(&parts.concat());
            let tip = urdf.flange().unwrap();
            (urdf.left_out(&tip), tip)
        };
        // Nothing forks, or what does holds still: no word.
        for (parts, tip) in [
            (vec![&arm[..]], "gripper_link"),
            (vec![&arm[..], &frame], "tool_frame"),
            (vec![&arm[..], &frame, &[("=cable", "arm", "cable")], &[("=foot", "base", "foot")]], "tool_frame"),
        ] {
            assert_eq!(of(&parts), (vec![], tip.to_owned()));
        }
        let (said, tip) = of(&[&arm, &jaw, &frame]);
        assert!(tip == "tool_frame" && said.len() == 1, "{tip} {said:?}");
        let words = ["fork behind joint `roll`", "3 joints", "`gripper` is left out", "`--tip moving_jaw`"];
        assert!(words.iter().all(|word| said[0].contains(word)), "{said:?}");
        // The only end is the jaw.
        let (said, tip) = of(&[&arm, &jaw]);
        assert!(tip == "moving_jaw" && said.len() == 1 && said[0].contains("`--tip gripper_link`"), "{tip} {said:?}");
        // A branch with a joint of its own that is no finger.
        let (said, tip) = of(&[&arm, &frame, &[("balance", "shoulder", "spring")]]);
        assert!(tip == "tool_frame" && said.len() == 1 && said[0].contains("`balance` is left out"), "{tip} {said:?}");
    }

    #[test]
    fn the_hint_offers_the_end_with_the_most_joints_and_no_finger() {
        let said = |joints: &[(&str, &str, &str)]| crate::diagnostic::report(&urdf(joints).flange().unwrap_err());
        let arm = |n: usize| -> Vec<(String, String, String)> {
            let link = |k: usize| if k == 0 { "base".to_owned() } else { format!("link{k}") };
            (0..n).map(|k| (format!("j{k}"), link(k), link(k + 1))).collect()
        };
        for n in [1, 3, 6] {
            let (arm, hand) = (arm(n), format!("link{n}"));
            let mut joints: Vec<(&str, &str, &str)> = arm.iter().map(|(a, b, c)| (&**a, &**b, &**c)).collect();
            joints.extend([("finger_1", &*hand, "left_finger"), ("finger_2", &*hand, "right_finger")]);
            joints.extend([("wheel_1", "base", "wheel_1"), ("wheel_2", "base", "wheel_2")]);
            let joint = if n == 1 { "joint" } else { "joints" };
            let said = said(&joints);
            assert!(
                said.contains(&format!("`--tip {hand}` has the most that move on their own, {n} {joint}")),
                "{said}"
            );
        }
        // A hand alone.
        let hand = said(&[
            ("thumb", "base", "thumb_tip"),
            ("a", "base", "finger_1"),
            ("b", "finger_1", "finger_2"),
            ("c", "base", "finger_3"),
            ("d", "finger_3", "finger_4"),
        ]);
        assert!(hand.contains("the most that move on their own, 2 joints"), "{hand}");
    }

    #[test]
    fn origins_in_mm_or_degrees_are_refused_with_their_joint() {
        let of = |origin: &str, tip: Option<&str>| {
            let text = format!(
                "<robot name=\"r\"><link name=\"b\"/><link name=\"l1\"/><link name=\"l2\"/><link name=\"l3\"/>\n\
                 <joint name=\"j1\" type=\"revolute\"><parent link=\"b\"/><child link=\"l1\"/><origin xyz=\"0 0 0.3\"/></joint>\n\
                 <joint name=\"j2\" type=\"revolute\"><parent link=\"l1\"/><child link=\"l2\"/><origin {origin}/></joint>\n\
                 <joint name=\"j3\" type=\"revolute\"><parent link=\"l1\"/><child link=\"l3\"/></joint>\n</robot>"
            );
            Urdf::parse(text, Utf8Path::new("r.urdf")).unwrap().chain(tip).map(|chain| chain.joints.len())
        };
        for fine in ["xyz=\"0 -9.9 0.4\"", "xyz=\"0 0 0\" rpy=\"0 12.5 -6.3\"", "rpy=\"1.57 0 0\""] {
            assert_eq!(of(fine, Some("l2")).unwrap(), 2, "{fine}");
        }
        for (wrong, words) in [
            ("xyz=\"0 0 400\"", "`j2` has 400, which is no m of a robot: these are mm"),
            ("xyz=\"0 -10.5 0\"", "has 10.5, which is no m"),
            ("xyz=\"0 0 0.4\" rpy=\"90 0 45\"", "`j2` has 90, which is no rad of a robot: these are degrees"),
            ("rpy=\"0 0 -13\"", "has 13, which is no rad"),
        ] {
            let said = crate::diagnostic::report(&of(wrong, Some("l2")).unwrap_err());
            assert!(said.contains(words) && said.contains("r.urdf:3") && said.contains("m and rad"), "{said}");
            // The other branch has none of it.
            assert_eq!(of(wrong, Some("l3")).unwrap(), 2, "{wrong}");
        }
    }

    #[test]
    fn a_model_of_mujoco_is_told_how_to_become_a_urdf() {
        let said =
            |text: &str| crate::diagnostic::report(&Urdf::parse(text.to_owned(), Utf8Path::new("r.xml")).unwrap_err());
        assert!(said("<mujoco model=\"r\"/>").contains("convert('model.xml', 'robot.urdf')"));
        assert!(!said("<sdf/>").contains("convert"));
    }
}
