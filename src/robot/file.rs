//! `robot.toml`: a robot's parameters as a person writes them, degrees and mm.

use camino::Utf8Path;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::corrections::{GravityTerm, HarmonicTerm, LoadPoint, Wave};
use super::{Corrections, Error, Joint, Robot};
use crate::error::{Place, Result};
use crate::files;

#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RobotRecord {
    name: String,
    convention: String,
    joint: Vec<JointRecord>,
    #[serde(default)]
    tool: ToolRecord,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    gravity: Option<GravityRecord>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    harmonics: Option<HarmonicsRecord>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JointRecord {
    /// `revolute`, the only kind there is; other programs write it.
    #[serde(default, rename = "type", skip_serializing)]
    kind: Option<String>,
    alpha_deg: f64,
    a_mm: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    beta_deg: f64,
    theta_deg: f64,
    d_mm: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    limits_deg: Option<[f64; 2]>,
}

#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ToolRecord {
    x_mm: f64,
    y_mm: f64,
    z_mm: f64,
}

/// Sag of the joints: `k_mrad_per_m` times the lever of a unit weight at `point`.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct GravityRecord {
    #[serde(default = "downwards")]
    direction: [f64; 3],
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

/// Periodic errors of the drives, in the commanded angle.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct HarmonicsRecord {
    terms: Vec<HarmonicTermRecord>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct HarmonicTermRecord {
    joint: usize,
    wave: String,
    amplitude_mrad: f64,
}

fn downwards() -> [f64; 3] {
    [0.0, 0.0, -1.0]
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// Reads `robot.toml`.
pub fn read(path: &Utf8Path) -> Result<Robot> {
    let hint = "`--robot FILE` names the robot's nominal parameters; `stereocal simulate` writes an example";
    let record: RobotRecord = files::read_toml(path, "the robot", Some(hint))?;
    record.robot().map_err(|message| Error::File { message, place: Place { path: path.to_owned(), line: None } }.into())
}

/// The text of `robot.toml`.
pub fn to_toml(robot: &Robot) -> String {
    // A struct of numbers and strings, tables last: serialisation has no way to fail.
    toml::to_string(&RobotRecord::from(robot)).unwrap_or_default()
}

impl RobotRecord {
    fn robot(&self) -> std::result::Result<Robot, String> {
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
        let mut joints = Vec::with_capacity(self.joint.len());
        for (i, j) in self.joint.iter().enumerate() {
            if let Some(kind) = j.kind.as_deref().filter(|kind| *kind != "revolute") {
                return Err(format!("joint {}: type is \"{kind}\"; only revolute joints are known", i + 1));
            }
            let limits = j.limits_deg.unwrap_or([-1.0, 1.0]);
            let numbers = [j.alpha_deg, j.a_mm, j.beta_deg, j.theta_deg, j.d_mm, limits[0], limits[1]];
            if numbers.iter().any(|v| !v.is_finite()) {
                return Err(format!("joint {}: every number must be finite", i + 1));
            }
            if limits[0] >= limits[1] {
                return Err(format!("joint {}: limits_deg runs from {} to {}", i + 1, limits[0], limits[1]));
            }
            joints.push(Joint {
                alpha_rad: j.alpha_deg.to_radians(),
                a_mm: j.a_mm,
                beta_rad: j.beta_deg.to_radians(),
                theta_rad: j.theta_deg.to_radians(),
                d_mm: j.d_mm,
                limits_rad: j.limits_deg.map(|[low, high]| (low.to_radians(), high.to_radians())),
            });
        }
        if tool_mm.iter().any(|v| !v.is_finite()) {
            return Err("[tool]: every number must be finite".to_owned());
        }
        let corrections = self.corrections(joints.len())?;
        Ok(Robot { name: self.name.clone(), joints, tool_mm, corrections })
    }

    fn corrections(&self, joint_count: usize) -> std::result::Result<Corrections, String> {
        let mut corrections = Corrections::default();
        let index = |table: &str, joint: usize| match joint {
            1.. if joint <= joint_count => Ok(joint - 1),
            _ => Err(format!("[{table}]: joint {joint} of a robot with {joint_count}")),
        };
        if let Some(gravity) = &self.gravity {
            let direction = Vector3::from(gravity.direction);
            if !(direction.norm().is_finite() && direction.norm() > 0.0) {
                return Err("[gravity]: direction must be a vector that is finite and not zero".to_owned());
            }
            corrections.gravity_direction = direction.normalize();
            for term in &gravity.terms {
                let point = LoadPoint::from_name(&term.point)
                    .ok_or_else(|| format!("[gravity]: point \"{}\"; it is elbow, wrist or tool", term.point))?;
                let joint = index("gravity", term.joint)?;
                corrections.gravity.push(GravityTerm { joint, point, k_rad_per_m: term.k_mrad_per_m / 1000.0 });
            }
        }
        for term in self.harmonics.iter().flat_map(|h| &h.terms) {
            let wave = Wave::ALL
                .into_iter()
                .find(|w| w.name() == term.wave)
                .ok_or_else(|| format!("[harmonics]: wave \"{}\"; it is sin, cos, sin2 or cos2", term.wave))?;
            let joint = index("harmonics", term.joint)?;
            corrections.harmonics.push(HarmonicTerm { joint, wave, amplitude_rad: term.amplitude_mrad / 1000.0 });
        }
        let coefficients = corrections.gravity.iter().map(|t| t.k_rad_per_m);
        if coefficients.chain(corrections.harmonics.iter().map(|t| t.amplitude_rad)).any(|v| !v.is_finite()) {
            return Err("[gravity] and [harmonics]: every number must be finite".to_owned());
        }
        Ok(corrections)
    }
}

fn gravity_record(corrections: &Corrections) -> Option<GravityRecord> {
    let default = Corrections::default();
    if corrections.gravity.is_empty() && corrections.gravity_direction == default.gravity_direction {
        return None;
    }
    let term = |t: &GravityTerm| GravityTermRecord {
        joint: t.joint + 1,
        point: t.point.name().to_owned(),
        k_mrad_per_m: 1000.0 * t.k_rad_per_m,
    };
    Some(GravityRecord {
        direction: corrections.gravity_direction.into(),
        terms: corrections.gravity.iter().map(term).collect(),
    })
}

fn harmonics_record(corrections: &Corrections) -> Option<HarmonicsRecord> {
    let term = |t: &HarmonicTerm| HarmonicTermRecord {
        joint: t.joint + 1,
        wave: t.wave.name().to_owned(),
        amplitude_mrad: 1000.0 * t.amplitude_rad,
    };
    let terms: Vec<_> = corrections.harmonics.iter().map(term).collect();
    if terms.is_empty() { None } else { Some(HarmonicsRecord { terms }) }
}

impl From<&Robot> for RobotRecord {
    fn from(robot: &Robot) -> RobotRecord {
        RobotRecord {
            name: robot.name.clone(),
            convention: "mdh".to_owned(),
            joint: robot
                .joints
                .iter()
                .map(|j| JointRecord {
                    kind: None,
                    alpha_deg: j.alpha_rad.to_degrees(),
                    a_mm: j.a_mm,
                    beta_deg: j.beta_rad.to_degrees(),
                    theta_deg: j.theta_rad.to_degrees(),
                    d_mm: j.d_mm,
                    limits_deg: j.limits_rad.map(|(low, high)| [low.to_degrees(), high.to_degrees()]),
                })
                .collect(),
            tool: ToolRecord { x_mm: robot.tool_mm.x, y_mm: robot.tool_mm.y, z_mm: robot.tool_mm.z },
            gravity: gravity_record(&robot.corrections),
            harmonics: harmonics_record(&robot.corrections),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_survives_the_file() {
        let mut robot = Robot::paper();
        robot.joints[2].beta_rad = 0.001;
        robot.joints[0].limits_rad = Some((-3.0, 3.0));
        robot.tool_mm = Vector3::new(1.5, -2.0, 30.0);
        robot.corrections.gravity = vec![GravityTerm { joint: 1, point: LoadPoint::Wrist, k_rad_per_m: 0.25 }];
        robot.corrections.harmonics = vec![HarmonicTerm { joint: 5, wave: Wave::Sin2, amplitude_rad: 0.5 }];
        let back = toml::from_str::<RobotRecord>(&to_toml(&robot)).unwrap().robot().unwrap();
        for (a, b) in back.joints.iter().zip(&robot.joints) {
            assert!((a.alpha_rad - b.alpha_rad).abs() < 1e-15 && (a.beta_rad - b.beta_rad).abs() < 1e-15);
        }
        assert_eq!(back.tool_mm, robot.tool_mm);
        assert_eq!(back.corrections, robot.corrections);
    }

    #[test]
    fn a_joint_that_slides_is_refused() {
        let sliding = to_toml(&Robot::paper()).replacen("[[joint]]", "[[joint]]\ntype = \"prismatic\"", 1);
        let message = toml::from_str::<RobotRecord>(&sliding).unwrap().robot().unwrap_err();
        assert!(message.contains("joint 1: type is \"prismatic\""), "{message}");
        let turning = to_toml(&Robot::paper()).replacen("[[joint]]", "[[joint]]\ntype = \"revolute\"", 1);
        assert!(toml::from_str::<RobotRecord>(&turning).unwrap().robot().is_ok());
    }

    #[test]
    fn a_joint_that_the_robot_lacks_is_refused() {
        let text =
            to_toml(&Robot::paper()) + "\n[harmonics]\nterms = [{ joint = 7, wave = \"sin\", amplitude_mrad = 1.0 }]\n";
        let message = toml::from_str::<RobotRecord>(&text).unwrap().robot().unwrap_err();
        assert!(message.contains("joint 7 of a robot with 6"), "{message}");
    }
}
