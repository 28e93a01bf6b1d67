//! URDF: a serial chain out of a robot description, and the same description with other joint origins.
//!
//! In: XML text. Out: the joints from the root link to a tip link, lengths in mm. Joints that no serial chain of motors
//! has (mimic, floating, planar) are refused with the longest chain that does without them. Where the links fork,
//! `branches` says which end is taken.

mod branches;

use camino::{Utf8Path, Utf8PathBuf};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};

use crate::diagnostic::count;
use crate::files::{self, Result};
use crate::geometry::Transform;
use crate::programs::edited;
use crate::progress;
use crate::robot::Robot;
use crate::robot::axes::{self, Axis};
use crate::tables::expression;

/// What a joint does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Turns, with or without limits.
    Revolute,
    Prismatic,
    /// Holds.
    Fixed,
    /// Floating, planar, or anything else.
    Other,
}

/// A joint as the file has it; lengths in mm.
#[derive(Debug, Clone, PartialEq)]
pub struct UrdfJoint {
    pub name: String,
    pub kind: Kind,
    pub word: String,
    /// The joint that it follows, where it does.
    pub mimics: Option<String>,
    /// Link before.
    pub parent: String,
    /// Link behind.
    pub child: String,
    /// The joint's frame in the parent link's, at reading zero.
    pub parent_from_joint: Transform,
    /// Its axis in its own frame.
    pub axis: Vector3<f64>,
    /// Range: rad, of a sliding joint mm.
    pub limits_rad: Option<(f64, f64)>,
    pub line: u64,
    /// What is wrong with the numbers of its origin, where they are in other units.
    beyond: Option<String>,
    /// Where its `<joint>` element's `<origin>` stands in the text, or where one would be put.
    origin_at: Result<std::ops::Range<usize>, usize>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Urdf {
    pub name: String,
    pub joints: Vec<UrdfJoint>,
    /// The link that is no joint's child.
    pub root: String,
    text: String,
    path: Utf8PathBuf,
}

/// Joints from the root to a tip.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain<'a> {
    /// All of them, fixed ones too.
    pub joints: Vec<&'a UrdfJoint>,
    /// The link at its end.
    pub tip: String,
}

/// The text with blanks for a declaration that does not stand at its beginning, where alone XML allows it; places stay
/// what they are.
fn without_declaration(text: String) -> String {
    let body = text.trim_start_matches(['\u{feff}', ' ', '\t', '\r', '\n']);
    let start = text.len() - body.len();
    match body.find("?>").filter(|_| start > 0 && body.starts_with("<?xml")) {
        Some(end) => {
            let plain = |c: char| if c == '\n' { "\n".to_owned() } else { " ".repeat(c.len_utf8()) };
            let head: String = text[..start + end + 2].chars().map(plain).collect();
            head + &body[end + 2..]
        }
        None => text,
    }
}

impl Urdf {
    pub fn read(path: &Utf8Path) -> Result<Urdf> {
        let text = files::read_text(path, "robot description", None)?;
        Urdf::parse(text, path)
    }

    pub fn parse(text: String, path: &Utf8Path) -> Result<Urdf> {
        let refuse = |line, message: String, hint| files::Error::format(path, line, message, hint);
        let text = without_declaration(text);
        let document = Document::parse(&text)
            .map_err(|e| refuse(Some(u64::from(e.pos().row)), format!("not readable as XML: {e}"), None))?;
        let root = document.root_element();
        if root.tag_name().name() != "robot" {
            let name = root.tag_name().name();
            let mujoco = "this is a model of MuJoCo (MJCF): `pip install mjcf-urdf-simple-converter`, then `python3 -c \"from \
                          mjcf_urdf_simple_converter import convert; convert('model.xml', 'robot.urdf')\"` makes a URDF of it; many makers publish one";
            let message = format!("the file's root is <{name}>; a URDF has <robot>");
            return Err(refuse(None, message, (name == "mujoco").then_some(mujoco)));
        }
        if document.descendants().any(|n| n.tag_name().namespace().is_some_and(|space| space.contains("xacro"))) {
            let hint = "expand it first: `xacro FILE > robot.urdf`";
            return Err(refuse(None, "the file is a xacro, a description with macros in it".to_owned(), Some(hint)));
        }
        let read = |node: Node| {
            let line = u64::from(document.text_pos_at(node.range().start).row);
            joint(&node, line).map_err(|message| refuse(Some(line), message, None))
        };
        let elements = root.children().filter(|n| n.has_tag_name("joint"));
        let joints = elements.map(read).collect::<Result<Vec<UrdfJoint>>>()?;
        let links = root.children().filter(|n| n.has_tag_name("link")).filter_map(|n| n.attribute("name"));
        let roots: Vec<&str> = links.filter(|link| !joints.iter().any(|j| j.child == *link)).collect();
        let [root_link] = roots[..] else {
            let message = match roots[..] {
                [] => "no link that nothing moves: a robot has one, its base".to_owned(),
                _ => format!("a robot has one root link; this one has {}: {}", roots.len(), roots.join(", ")),
            };
            return Err(refuse(None, message, None));
        };
        let name = root.attribute("name").unwrap_or("robot").to_owned();
        Ok(Urdf { name, joints, root: root_link.to_owned(), text, path: path.to_owned() })
    }

    fn refuse(&self, line: Option<u64>, message: String, hint: Option<String>) -> files::Error {
        files::Error::format(&self.path, line, message, hint.as_deref())
    }

    /// The joints from the root to the link `tip`, or to the flange where none is named.
    pub fn chain(&self, named: Option<&str>) -> Result<Chain<'_>> {
        let tip = match named {
            Some(tip) => tip.to_owned(),
            None => {
                let tip = self.flange()?;
                self.left_out(&tip).iter().for_each(progress::warn);
                tip
            }
        };
        let chain = self.chain_to(tip)?;
        if named.is_none() {
            let (root, tip, joints) = (&self.root, &chain.tip, count(chain.moving().count(), "joint"));
            progress::note(format!(
                "{}: from link `{root}` to link `{tip}`, {joints}; `--tip LINK` takes another end",
                self.path
            ));
        }
        Ok(chain)
    }

    fn chain_to(&self, tip: String) -> Result<Chain<'_>> {
        let mut joints = Vec::new();
        let mut link = tip.as_str();
        while link != self.root {
            let Some(joint) = self.joints.iter().find(|j| j.child == link) else {
                let hint = format!("the links at the ends are {}", self.ends().join(", "));
                return Err(self.refuse(None, format!("no link `{link}`"), Some(hint)));
            };
            if joints.len() > self.joints.len() {
                return Err(self.refuse(Some(joint.line), format!("the joints before `{tip}` form a circle"), None));
            }
            joints.push(joint);
            link = &joint.parent;
        }
        joints.reverse();
        self.check(&joints, &tip)?;
        Ok(Chain { joints, tip })
    }

    fn check(&self, joints: &[&UrdfJoint], tip: &str) -> Result<()> {
        let bad = |j: &UrdfJoint| j.mimics.is_some() || j.kind == Kind::Other;
        let moves = |j: &UrdfJoint| matches!(j.kind, Kind::Revolute | Kind::Prismatic);
        let instead = |position: usize| match joints[..position].iter().filter(|j| moves(j)).count() {
            0 => None,
            moving => {
                let link = &joints[position - 1].child;
                Some(format!("`--tip {link}` ends the chain before it, with {moving} joints that move"))
            }
        };
        if let Some(position) = joints.iter().position(|j| bad(j)) {
            let joint = joints[position];
            let what = match &joint.mimics {
                Some(other) => format!("follows joint `{other}` (mimic)"),
                None => format!("is {}", joint.word),
            };
            let message = format!("joint `{}` {what}; joints that turn or slide on their own were needed", joint.name);
            return Err(self.refuse(Some(joint.line), message, instead(position)));
        }
        if let Some((joint, beyond)) = joints.iter().find_map(|j| Some((j, j.beyond.as_ref()?))) {
            let message = format!("the origin of joint `{}` {beyond}", joint.name);
            let hint = "a URDF is in m and rad: `xyz` in metres, `rpy` in radians".to_owned();
            return Err(self.refuse(Some(joint.line), message, Some(hint)));
        }
        if !joints.iter().any(|j| moves(j)) {
            let hint = format!("the links at the ends are {}", self.ends().join(", "));
            let message = format!("no joint between `{}` and `{tip}` moves", self.root);
            return Err(self.refuse(None, message, Some(hint)));
        }
        Ok(())
    }

    /// The text with other origins for some joints: everything else stays as it is.
    pub fn with_origins(&self, origins: &[(&UrdfJoint, Transform)]) -> String {
        let edit = |(joint, origin): &(&UrdfJoint, Transform)| match &joint.origin_at {
            Ok(range) => (range.clone(), origin_element(origin)),
            Err(at) => (*at..*at, format!("\n    {}", origin_element(origin))),
        };
        edited(&self.text, origins.iter().map(edit).collect())
    }
}

impl Chain<'_> {
    pub fn moving(&self) -> impl Iterator<Item = &UrdfJoint> {
        self.joints.iter().copied().filter(|j| j.kind != Kind::Fixed)
    }

    /// Frame of every joint of the chain in the root frame, all readings zero; the last one is the tip's.
    pub fn frames(&self) -> Vec<Transform> {
        let mut root_from_link = Transform::identity();
        let step = |j: &&UrdfJoint| {
            root_from_link *= j.parent_from_joint;
            root_from_link
        };
        self.joints.iter().map(step).collect()
    }

    /// The same chain as a robot; its readings are the joints' angles.
    pub fn robot(&self, name: &str) -> Robot {
        let frames = self.frames();
        let axis = |(joint, frame): (&&UrdfJoint, &Transform)| Axis {
            point_mm: Point3::from(frame.translation.vector),
            direction: frame.rotation * joint.axis,
            limits_rad: joint.limits_rad,
            slides: joint.kind == Kind::Prismatic,
        };
        let moving = self.joints.iter().zip(&frames).filter(|(j, _)| j.kind != Kind::Fixed);
        let axes: Vec<Axis> = moving.map(axis).collect();
        let flange = frames.last().copied().unwrap_or_else(Transform::identity);
        axes::robot(name, &axes, &flange)
    }
}

/// Roll, pitch and yaw of a rotation, rad: `Rz(yaw) Ry(pitch) Rx(roll)`. Each is taken after the one before was undone,
/// so that a pitch near a right angle, where roll and yaw can't be told apart, costs no digits.
pub fn roll_pitch_yaw(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let m = rotation.to_rotation_matrix().into_inner();
    let yaw = if m[(0, 0)].hypot(m[(1, 0)]) > 1e-9 { m[(1, 0)].atan2(m[(0, 0)]) } else { 0.0 };
    let (sin, cos) = yaw.sin_cos();
    let level = nalgebra::Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0) * m;
    let pitch = (-level[(2, 0)]).atan2(level[(0, 0)]);
    let roll = (-level[(1, 2)]).atan2(level[(1, 1)]);
    [roll + 0.0, pitch + 0.0, yaw + 0.0]
}

/// The longest offset in metres: longer ones are mm.
const MOST_M: f64 = 10.0;

/// The largest angle in radians, two turns: larger ones are degrees.
const MOST_RAD: f64 = 2.0 * std::f64::consts::TAU;

/// What is wrong with an origin whose numbers are not in m and rad.
pub(super) fn beyond(xyz_m: [f64; 3], rpy_rad: [f64; 3]) -> Option<String> {
    let largest = |numbers: [f64; 3]| numbers.iter().fold(0.0f64, |most, v| most.max(v.abs()));
    let (m, rad) = (largest(xyz_m), largest(rpy_rad));
    let (v, unit, other) = match (m > MOST_M, rad > MOST_RAD) {
        (true, _) => (m, "m", "mm"),
        (_, true) => (rad, "rad", "degrees"),
        _ => return None,
    };
    Some(format!("has {v}, which is no {unit} of a robot: these are {other}"))
}

/// The transform of an origin, metres and roll, pitch, yaw in radians.
pub fn of_origin(xyz_m: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Transform {
    let turn = |axis: Vector3<f64>, angle: f64| UnitQuaternion::from_scaled_axis(axis * angle);
    let rotation = turn(Vector3::z(), yaw) * turn(Vector3::y(), pitch) * turn(Vector3::x(), roll);
    Transform::from_parts((Vector3::from(xyz_m) * 1000.0).into(), rotation)
}

/// An `<origin>` of a transform, metres and radians with all their digits.
pub fn origin_element(parent_from_child: &Transform) -> String {
    let t = parent_from_child.translation.vector / 1000.0;
    let [roll, pitch, yaw] = roll_pitch_yaw(&parent_from_child.rotation);
    format!("<origin xyz=\"{} {} {}\" rpy=\"{roll} {pitch} {yaw}\"/>", t.x + 0.0, t.y + 0.0, t.z + 0.0)
}

fn joint(node: &Node, line: u64) -> std::result::Result<UrdfJoint, String> {
    let name = node.attribute("name").ok_or("a joint has no name")?.to_owned();
    let word = node.attribute("type").ok_or_else(|| format!("joint `{name}` has no type"))?.to_owned();
    let child_named = |tag: &str| node.children().find(|n| n.has_tag_name(tag));
    let link = |tag: &str| {
        let link = child_named(tag).and_then(|n| n.attribute("link"));
        link.map(str::to_owned).ok_or_else(|| format!("joint `{name}` has no <{tag}>"))
    };
    let kind = match word.as_str() {
        "revolute" | "continuous" => Kind::Revolute,
        "prismatic" => Kind::Prismatic,
        "fixed" => Kind::Fixed,
        _ => Kind::Other,
    };
    let numbers = |tag: &str, attribute: &str, default: [f64; 3]| -> std::result::Result<[f64; 3], String> {
        let Some(text) = child_named(tag).and_then(|n| n.attribute(attribute)) else { return Ok(default) };
        let parsed: Vec<f64> = text.split_whitespace().filter_map(|t| t.parse().ok()).collect();
        <[f64; 3]>::try_from(parsed)
            .ok()
            .filter(|v| v.iter().all(|v| v.is_finite()))
            .ok_or_else(|| format!("joint `{name}`: {attribute}=\"{text}\" is not three numbers"))
    };
    let (xyz, rpy) = (numbers("origin", "xyz", [0.0; 3])?, numbers("origin", "rpy", [0.0; 3])?);
    let parent_from_joint = of_origin(xyz, rpy);
    let axis = Vector3::from(numbers("axis", "xyz", [1.0, 0.0, 0.0])?);
    if kind != Kind::Fixed && axis.norm() == 0.0 {
        return Err(format!("joint `{name}` has an axis of length zero"));
    }
    let limit = child_named("limit");
    let bound = |bound: &str| {
        let text = limit.and_then(|n| n.attribute(bound))?.trim();
        let formula = text.strip_prefix("${").and_then(|rest| rest.strip_suffix('}')).unwrap_or(text);
        let number = expression::evaluate(formula, &|_| None).filter(|v| !v.variable).map(|v| v.number);
        if number.is_none() {
            progress::warn(format!("joint `{name}`: {bound}=\"{text}\" is no number; this limit is left out"));
        }
        number
    };
    let limits_rad = match (word.as_str(), bound("lower"), bound("upper")) {
        ("revolute", Some(low), Some(high)) if low < high => Some((low, high)),
        ("prismatic", Some(low), Some(high)) if low < high => Some((1000.0 * low, 1000.0 * high)),
        _ => None,
    };
    let start_tag_end = node.children().next().map_or(node.range().end, |first| first.range().start);
    Ok(UrdfJoint {
        kind,
        word,
        mimics: child_named("mimic").map(|n| n.attribute("joint").unwrap_or("another").to_owned()),
        parent: link("parent")?,
        child: link("child")?,
        parent_from_joint,
        axis: if axis.norm() > 0.0 { axis.normalize() } else { Vector3::x() },
        limits_rad,
        line,
        beyond: beyond(xyz, rpy),
        origin_at: child_named("origin").map(|n| n.range()).ok_or(start_tag_end),
        name,
    })
}
