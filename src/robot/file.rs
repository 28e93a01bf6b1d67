//! `robot.toml`: a robot's parameters as a person writes them, degrees and mm, and what the run that found it says of
//! its use.

use camino::Utf8Path;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::check::{Advice, Check};
use super::corrections::{CouplingTerm, GravityTerm, HarmonicTerm, LoadPoint, Wave};
use super::{Corrections, Ends, Error, Joint, Result, Robot};
use crate::diagnostic::{Place, short};
use crate::files;
use crate::geometry::{Transform, rotation_vector, transform};

/// What is `None` does not stand in the file.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RobotRecord {
    name: String,
    convention: String,
    /// Unit vector along gravity in the base frame.
    gravity_direction: Option<[f64; 3]>,
    /// What the run that found it says of its use.
    check: Option<Check>,
    joint: Vec<JointRecord>,
    #[serde(default)]
    tool: ToolRecord,
    gravity: Option<GravityRecord>,
    bending: Option<Terms<GravityTermRecord>>,
    harmonics: Option<Terms<HarmonicTermRecord>>,
    wobble: Option<Terms<HarmonicTermRecord>>,
    couplings: Option<Terms<CouplingTermRecord>>,
    /// `root_from_frame0`
    base: Option<PoseRecord>,
    /// `last_frame_from_flange`
    flange: Option<PoseRecord>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JointRecord {
    /// `revolute` (the default) or `prismatic`.
    #[serde(rename = "type")]
    kind: Option<String>,
    alpha_deg: f64,
    a_mm: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    beta_deg: f64,
    theta_deg: f64,
    d_mm: f64,
    limits_deg: Option<[f64; 2]>,
    limits_mm: Option<[f64; 2]>,
    /// 1 or -1: how the controller counts it.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    sign: f64,
}

#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ToolRecord {
    x_mm: f64,
    y_mm: f64,
    z_mm: f64,
}

/// A transform in a robot file.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct PoseRecord {
    x_mm: f64,
    y_mm: f64,
    z_mm: f64,
    rx_rad: f64,
    ry_rad: f64,
    rz_rad: f64,
}

impl PoseRecord {
    /// The transform; `None` where a number is not finite.
    fn transform(&self) -> Option<Transform> {
        let (t, r) =
            (Vector3::new(self.x_mm, self.y_mm, self.z_mm), Vector3::new(self.rx_rad, self.ry_rad, self.rz_rad));
        (t.iter().chain(r.iter()).all(|v| v.is_finite())).then(|| transform(r, t))
    }

    /// As it stands in the file; nothing for the identity.
    fn of(a_from_b: &Transform) -> Option<PoseRecord> {
        if *a_from_b == Transform::identity() {
            return None;
        }
        let (t, r) = (a_from_b.translation.vector, rotation_vector(a_from_b));
        Some(PoseRecord { x_mm: t.x, y_mm: t.y, z_mm: t.z, rx_rad: r.x, ry_rad: r.y, rz_rad: r.z })
    }
}

/// Sag of the joints: `k_mrad_per_m` times the lever of a unit weight at `point`.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct GravityRecord {
    /// Where older files say `gravity_direction`.
    direction: Option<[f64; 3]>,
    #[serde(default)]
    terms: Vec<GravityTermRecord>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct GravityTermRecord {
    joint: usize,
    point: String,
    k_mrad_per_m: f64,
}

/// A table with terms: what bearings and links yield across the joints' axes (`[bending]`, in the form of `[gravity]`),
/// waves in the commanded angle (periodic errors of the drives, or the tilt of their axes), couplings.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Terms<T> {
    terms: Vec<T>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct HarmonicTermRecord {
    joint: usize,
    wave: String,
    amplitude_mrad: f64,
}

/// What a joint does by itself as another one moves, or as it moves itself (an error of its scale).
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CouplingTermRecord {
    joint: usize,
    of: usize,
    per_mille: f64,
}

fn one() -> f64 {
    1.0
}

fn is_one(value: &f64) -> bool {
    *value == 1.0
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

pub fn read(path: &Utf8Path) -> Result<Robot> {
    read_checked(path).map(|(robot, _)| robot)
}

/// Reads `robot.toml` with what the run that found the robot says of its use; nobody says anything of a nominal one.
pub fn read_checked(path: &Utf8Path) -> Result<(Robot, Option<Check>)> {
    let hint = "`stereocal robot new NAME` writes the robot file of a common arm, `robot import` that of a URDF or table, `identify` identified.toml";
    let record: RobotRecord = files::read_toml(path, "robot file", Some(hint))?;
    let refuse = |message| Error::File { message, place: Place { path: path.to_owned(), line: None } };
    let robot = record.robot().map_err(refuse)?;
    match in_metres(&robot) {
        Some(message) => Err(refuse(message)),
        None => Ok((robot, record.check)),
    }
}

/// That the links are no arm's in mm. An arm whose joints all turn reaches as far as its links are long.
fn in_metres(robot: &Robot) -> Option<String> {
    /// Far below what any arm reaches, and far above what it reaches in metres, mm.
    const LEAST_MM: f64 = 10.0;
    let (reach_mm, slides) = (robot.reach_mm(), robot.joints.iter().any(|joint| joint.slides));
    (!slides && (f64::MIN_POSITIVE..LEAST_MM).contains(&reach_mm)).then(|| {
        format!("all links together are {} mm long: lengths are in mm here, and these seem to be in m", short(reach_mm))
    })
}

/// The file of the robot that `identify` found.
pub const IDENTIFIED_FILE: &str = "identified.toml";

/// How the comment of a robot file begins that `identify` wrote.
pub const IDENTIFIED: &str = "Identified";

/// Whether `identify` wrote a robot file and found another robot than the nominal one.
pub fn is_identified(path: &Utf8Path) -> bool {
    if let Ok((_, Some(check))) = read_checked(path) {
        return check.advice != Advice::KeepNominal;
    }
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let comments = text.lines().map_while(|line| line.strip_prefix('#'));
    comments.map(str::trim_start).any(|comment| comment.starts_with(IDENTIFIED))
}

/// The text of `robot.toml`.
pub fn to_toml(robot: &Robot) -> String {
    to_toml_checked(robot, None)
}

/// The same with what is said of the robot's use.
pub fn to_toml_checked(robot: &Robot, check: Option<&Check>) -> String {
    // A struct of numbers and strings, tables last: serialisation has no way to fail.
    toml::to_string(&RobotRecord { check: check.cloned(), ..RobotRecord::from(robot) }).unwrap_or_default()
}

impl JointRecord {
    /// The joint, or what is wrong with it.
    fn joint(&self) -> Result<Joint, String> {
        let slides = match self.kind.as_deref() {
            None | Some("revolute") => false,
            Some("prismatic") => true,
            Some(kind) => {
                return Err(format!("type is \"{kind}\"; it is \"revolute\" or \"prismatic\""));
            }
        };
        if self.sign.abs() != 1.0 {
            return Err(format!("sign is {}; it is 1 or -1", self.sign));
        }
        let (unit, given, other) = match slides {
            true => ("limits_mm", self.limits_mm, self.limits_deg),
            false => ("limits_deg", self.limits_deg, self.limits_mm),
        };
        if other.is_some() {
            return Err(format!("the limits of this joint are {unit}"));
        }
        let limits = given.unwrap_or([-1.0, 1.0]);
        let numbers = [self.alpha_deg, self.a_mm, self.beta_deg, self.theta_deg, self.d_mm, limits[0], limits[1]];
        if numbers.iter().any(|v| !v.is_finite()) {
            return Err("every number must be finite".to_owned());
        }
        if limits[0] >= limits[1] {
            return Err(format!("{unit} runs from {} to {}", limits[0], limits[1]));
        }
        Ok(Joint {
            alpha_rad: self.alpha_deg.to_radians(),
            a_mm: self.a_mm,
            beta_rad: self.beta_deg.to_radians(),
            theta_rad: self.theta_deg.to_radians(),
            d_mm: self.d_mm,
            limits_rad: given
                .map(|[low, high]| if slides { (low, high) } else { (low.to_radians(), high.to_radians()) }),
            slides,
            sign: self.sign,
        })
    }
}

impl RobotRecord {
    fn robot(&self) -> Result<Robot, String> {
        if self.convention != "mdh" {
            return Err(format!(
                "convention is \"{}\"; only \"mdh\" is known (alpha and a of link i-1, theta and d of joint i)",
                self.convention
            ));
        }
        if self.joint.is_empty() {
            return Err("a robot needs at least one [[joint]]".to_owned());
        }
        let tool_mm = Vector3::new(self.tool.x_mm, self.tool.y_mm, self.tool.z_mm);
        let joint = |(j, number): (&JointRecord, usize)| j.joint().map_err(|said| format!("joint {number}: {said}"));
        let joints = self.joint.iter().zip(1..).map(joint).collect::<Result<Vec<Joint>, String>>()?;
        if tool_mm.iter().any(|v| !v.is_finite()) {
            return Err("[tool]: every number must be finite".to_owned());
        }
        let corrections = self.corrections(joints.len())?;
        let end = |table: &str, pose: &Option<PoseRecord>| {
            let finite = || format!("[{table}]: every number must be finite");
            pose.unwrap_or_default().transform().ok_or_else(finite)
        };
        let ends =
            Ends { root_from_frame0: end("base", &self.base)?, last_frame_from_flange: end("flange", &self.flange)? };
        Ok(Robot { name: self.name.clone(), joints, tool_mm, corrections, ends })
    }

    fn corrections(&self, joint_count: usize) -> Result<Corrections, String> {
        let mut corrections = Corrections::default();
        let index = |table: &str, joint: usize| match joint {
            1.. if joint <= joint_count => Ok(joint - 1),
            _ => Err(format!("[{table}]: joint {joint} of a robot with {joint_count}")),
        };
        let direction = self.gravity_direction.or(self.gravity.as_ref().and_then(|g| g.direction));
        if let Some(direction) = direction.map(Vector3::from) {
            if !(direction.norm().is_finite() && direction.norm() > 0.0) {
                return Err("gravity_direction must be a vector that is finite and not zero".to_owned());
            }
            corrections.gravity_direction = direction.normalize();
        }
        let weights = |table: &str, terms: &[GravityTermRecord]| -> Result<Vec<GravityTerm>, String> {
            let term = |t: &GravityTermRecord| {
                let point = LoadPoint::from_name(&t.point, joint_count).ok_or_else(|| {
                    format!("[{table}]: point \"{}\"; it is joint_1 .. joint_{joint_count} or tool", t.point)
                })?;
                Ok(GravityTerm { joint: index(table, t.joint)?, point, k_rad_per_m: t.k_mrad_per_m / 1000.0 })
            };
            terms.iter().map(term).collect()
        };
        let waves = |table: &str, record: &Option<Terms<HarmonicTermRecord>>| -> Result<Vec<HarmonicTerm>, String> {
            let term = |t: &HarmonicTermRecord| {
                let known = Wave::ALL.into_iter().find(|w| w.name() == t.wave);
                let wave =
                    known.ok_or_else(|| format!("[{table}]: wave \"{}\"; it is sin, cos, sin2 or cos2", t.wave))?;
                let (joint, amplitude_rad) = (index(table, t.joint)?, t.amplitude_mrad / 1000.0);
                Ok(HarmonicTerm { joint, wave, amplitude_rad })
            };
            record.iter().flat_map(|r| &r.terms).map(term).collect()
        };
        corrections.gravity = weights("gravity", self.gravity.as_ref().map_or(&[], |g| &g.terms))?;
        corrections.bending = weights("bending", self.bending.as_ref().map_or(&[], |b| &b.terms))?;
        corrections.harmonics = waves("harmonics", &self.harmonics)?;
        corrections.wobble = waves("wobble", &self.wobble)?;
        for term in self.couplings.iter().flat_map(|c| &c.terms) {
            let (joint, of) = (index("couplings", term.joint)?, index("couplings", term.of)?);
            corrections.couplings.push(CouplingTerm { joint, of, ratio: term.per_mille / 1000.0 });
        }
        let coefficients = corrections.gravity.iter().chain(&corrections.bending).map(|t| t.k_rad_per_m);
        let waves = corrections.harmonics.iter().chain(&corrections.wobble).map(|t| t.amplitude_rad);
        let coefficients = coefficients.chain(waves);
        if coefficients.chain(corrections.couplings.iter().map(|t| t.ratio)).any(|v| !v.is_finite()) {
            return Err(
                "[gravity], [bending], [harmonics], [wobble] and [couplings]: every number must be finite".to_owned()
            );
        }
        Ok(corrections)
    }
}

/// Terms as a table has them; `None` where there is none.
fn table<T, R>(terms: &[T], record: impl Fn(&T) -> R) -> Option<Terms<R>> {
    (!terms.is_empty()).then(|| Terms { terms: terms.iter().map(record).collect() })
}

fn weight(t: &GravityTerm) -> GravityTermRecord {
    GravityTermRecord { joint: t.joint + 1, point: t.point.name(), k_mrad_per_m: 1000.0 * t.k_rad_per_m }
}

fn wave(t: &HarmonicTerm) -> HarmonicTermRecord {
    HarmonicTermRecord { joint: t.joint + 1, wave: t.wave.name().to_owned(), amplitude_mrad: 1000.0 * t.amplitude_rad }
}

fn coupling(t: &CouplingTerm) -> CouplingTermRecord {
    CouplingTermRecord { joint: t.joint + 1, of: t.of + 1, per_mille: 1000.0 * t.ratio }
}

impl From<&Robot> for RobotRecord {
    fn from(robot: &Robot) -> RobotRecord {
        let direction = robot.corrections.gravity_direction;
        let joint = |j: &Joint| JointRecord {
            kind: j.slides.then(|| "prismatic".to_owned()),
            alpha_deg: j.alpha_rad.to_degrees(),
            a_mm: j.a_mm,
            beta_deg: j.beta_rad.to_degrees(),
            theta_deg: j.theta_rad.to_degrees(),
            d_mm: j.d_mm,
            limits_deg: j.limits_rad.filter(|_| !j.slides).map(|(low, high)| [low.to_degrees(), high.to_degrees()]),
            limits_mm: j.limits_rad.filter(|_| j.slides).map(<[f64; 2]>::from),
            sign: j.sign,
        };
        RobotRecord {
            name: robot.name.clone(),
            convention: "mdh".to_owned(),
            check: None,
            gravity_direction: (direction != Corrections::default().gravity_direction).then(|| direction.into()),
            joint: robot.joints.iter().map(joint).collect(),
            tool: ToolRecord { x_mm: robot.tool_mm.x, y_mm: robot.tool_mm.y, z_mm: robot.tool_mm.z },
            gravity: table(&robot.corrections.gravity, weight)
                .map(|gravity| GravityRecord { direction: None, terms: gravity.terms }),
            bending: table(&robot.corrections.bending, weight),
            harmonics: table(&robot.corrections.harmonics, wave),
            wobble: table(&robot.corrections.wobble, wave),
            couplings: table(&robot.corrections.couplings, coupling),
            base: PoseRecord::of(&robot.ends.root_from_frame0),
            flange: PoseRecord::of(&robot.ends.last_frame_from_flange),
        }
    }
}

#[cfg(test)]
mod tests;
