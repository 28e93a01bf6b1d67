//! The two robots of `compensate`: whether they are one arm, and which tool counts.

use camino::Utf8Path;
use nalgebra::{Point3, Vector3};

use super::super::Result;
use super::doubts::is_made_of;
use crate::cli::Compensate;
use crate::formats::robots::known;
use crate::identify::record;
use crate::robot::refit::Residual;
use crate::robot::tool_fit::{Start, TYPED_MM};
use crate::robot::{Advice, Check, Error, Joint, Robot, file, inverse, tool_text};
use crate::{config, progress};

/// Robots and tools that differ by less are the same, mm.
const SAME_MM: f64 = 1e-6;

/// How far the flanges of one arm are apart on average, mm: a nominal robot is off by a few.
const ONE_ARM_MM: f64 = 10.0;

/// How far off a nominal robot is at most once its tool and its base are right, mm, and at how many postures that is
/// looked at.
const NEAR_MM: f64 = 5.0;
const POSTURES: usize = 200;

/// Both robots.
pub(super) struct Pair {
    pub(super) nominal: Robot,
    pub(super) identified: Robot,
    /// What the identified one's file says of its use.
    pub(super) check: Option<Check>,
    /// The tool that is used for both, mm in the last frame; `None` where each file has its own.
    pub(super) tool_mm: Option<Vector3<f64>>,
    /// What is to be said of the tools.
    pub(super) of_tools: Option<String>,
    /// Whether the tools of the two files are farther apart than one that was typed off a drawing is off.
    pub(super) tools_differ: bool,
    /// That nothing is left to correct.
    pub(super) same: Option<String>,
}

impl Pair {
    /// Reads both. Refuses robots that are exchanged, of different joints or of two arms.
    pub(super) fn read(args: &Compensate) -> Result<Pair> {
        if !matches!(args.tool.len(), 0 | 3) {
            let problem = format!("--tool has {} numbers; X,Y,Z in mm are needed", args.tool.len());
            return Err(config::Error::Invalid { problems: vec![problem] }.into());
        }
        let nominal = file::read(&args.robot)?;
        let (identified, check) = file::read_checked(&args.identified)?;
        let [robot, found] = [args.robot.to_string(), args.identified.to_string()];
        if file::is_identified(&args.robot) && !file::is_identified(&args.identified) {
            return Err(Error::Exchanged { robot, identified: found }.into());
        }
        if let Some(mended) = check.as_ref().map(|check| &check.mended).filter(|mended| !mended.is_empty()) {
            return Err(Error::OtherCounting { robot, identified: found, mended: mended.clone() }.into());
        }
        let same = |(a, b): (&Joint, &Joint)| a.slides == b.slides;
        if nominal.joints.len() != identified.joints.len() || !nominal.joints.iter().zip(&identified.joints).all(same) {
            return Err(Error::Different { identified: kinds(&identified), nominal: kinds(&nominal) }.into());
        }
        let identified = of_one_tool(&nominal, identified, &args.identified);
        let off = Residual::between(&nominal, &identified);
        let apart = record::links_apart(&nominal, &identified);
        // Terms that were found over a part of the joints' ranges, and links that were split between them, mean nothing
        // beyond it.
        let over = known::identified_over(&args.identified, &identified);
        let is_near = || over.is_some_and(|ranges| nearest_mm(&nominal.within(&ranges), &identified) < NEAR_MM);
        // Of what was identified from the very file its own `check` says what is wrong.
        let is_other = || off.mean_mm > ONE_ARM_MM && !is_near() && !is_made_of(&args.identified, &args.robot);
        if let Some(apart) = apart.filter(|_| is_other()) {
            return Err(Error::OtherArm { robot, identified: found, apart }.into());
        }
        let mut pair =
            Pair { nominal, identified, check, tool_mm: None, of_tools: None, tools_differ: false, same: None };
        let tools_apart_mm = pair.choose_tool(args);
        let kept = pair.check.as_ref().filter(|check| check.advice == Advice::KeepNominal);
        pair.same = (off.max_mm < SAME_MM && tools_apart_mm < SAME_MM).then(|| {
            let why = kept.map_or("`--identified` names what `identify` wrote, identified.toml", |c| c.reason.as_str());
            format!("nothing to correct: {robot} and {found} describe the same robot; {why}")
        });
        Ok(pair)
    }

    /// The tool for both where one is named, or where one file alone has one; by how much those of the files are apart
    /// otherwise, mm. A file without a tool, or with one in the last frame's origin, says nothing of it: its targets
    /// are moved by the arm's errors alone.
    fn choose_tool(&mut self, args: &Compensate) -> f64 {
        let (drawn, found) = (self.nominal.tool_mm, self.identified.tool_mm);
        self.tool_mm = <[f64; 3]>::try_from(args.tool.as_slice()).ok().map(Vector3::from);
        if let Some(typed) = self.tool_mm {
            self.of_tools = self.stays(typed, &args.robot);
            return 0.0;
        }
        if drawn == found {
            return 0.0;
        }
        if drawn == Vector3::zeros() || found == Vector3::zeros() {
            let (without, with, tool_mm) = match drawn == Vector3::zeros() {
                true => (&args.robot, &args.identified, found),
                false => (&args.identified, &args.robot, drawn),
            };
            let tool = tool_text(&tool_mm.into());
            self.tool_mm = Some(tool_mm);
            self.of_tools = Some(format!(
                "{without} states no tool: that of {with}, {tool} mm, is taken for both; `--tool X,Y,Z` names another"
            ));
            return 0.0;
        }
        let apart_mm = (drawn - found).norm();
        if apart_mm > TYPED_MM {
            self.tools_differ = true;
            let [drawn, tool] = [drawn, found].map(|tool| tool_text(&tool.into()));
            self.of_tools = Some(format!(
                "the tools of the two files are {apart_mm:.1} mm apart, {drawn} mm in {} and {tool} mm in {}, and the arm is moved by that too: \
                 `--tool X,Y,Z` names the one that works, for both",
                args.robot, args.identified
            ));
            return apart_mm;
        }
        self.of_tools = (apart_mm >= SAME_MM).then(|| {
            format!("the tools of the two files are {apart_mm:.3} mm apart, and this is corrected too, which is right for the measured target alone: `--tool X,Y,Z` names the tool that works")
        });
        apart_mm
    }

    /// What no measurement of a point told from the target's own place, and what therefore stays in another tool: the
    /// last link's length and zero.
    fn stays(&self, typed: Vector3<f64>, robot: &Utf8Path) -> Option<String> {
        let (drawn, found) = (self.nominal.tool_mm, self.identified.tool_mm);
        if found == Vector3::zeros() || (found - typed).norm() < SAME_MM {
            return None;
        }
        let last = self.nominal.joints.len();
        // Of a tool far from the target nothing says where that was meant to be.
        let (meant, whose) = if drawn == Vector3::zeros() { (typed, "this tool") } else { (drawn, robot.as_str()) };
        let apart_mm = Some((found - meant).norm()).filter(|apart| *apart <= TYPED_MM);
        let place = apart_mm.map_or_else(String::new, |apart| format!(", {apart:.1} mm from that of {whose},"));
        Some(format!(
            "the target was found at {} mm{place} and a point does not tell it from what the last link is off by (d_{last}, theta_{last}): \
             that stays in this tool",
            tool_text(&found.into())
        ))
    }
}

/// The identified robot with the nominal one's last link, where its own is longer or turned by more than links are
/// built: that is a tool of which the nominal file knows nothing, and no measurement of a point tells the two apart.
fn of_one_tool(nominal: &Robot, identified: Robot, file: &Utf8Path) -> Robot {
    let taken = identified.with_last_link_of(nominal);
    let is_tool = record::links_apart(nominal, &identified) != record::links_apart(nominal, &taken);
    if !is_tool {
        return identified;
    }
    let tool = tool_text(&taken.tool_mm.into());
    progress::warn(format!(
        "the last link of {file} is not that of the nominal robot: what it has more is the tool's, which then stands at {tool} mm; a point cannot \
         tell the two apart"
    ));
    taken
}

/// How far the target of another robot is from that of this one over its joints' ranges, in the middle, with a tool and
/// a base of its own, mm.
fn nearest_mm(nominal: &Robot, other: &Robot) -> f64 {
    let joints: Vec<Vec<f64>> = (0..POSTURES).map(|k| inverse::spread_start(nominal, k)).collect();
    let points: Vec<Point3<f64>> = joints.iter().map(|q| other.target_mm(q)).collect();
    nominal.fit_tool(&joints, &points, Start::File).map_or(f64::INFINITY, |fit| fit.left_mm)
}

/// How many joints a robot has, and how many of them slide.
fn kinds(robot: &Robot) -> String {
    let sliding = robot.joints.iter().filter(|j| j.slides).count();
    format!("{}{}", robot.joints.len(), if sliding > 0 { format!(" ({sliding} sliding)") } else { String::new() })
}
