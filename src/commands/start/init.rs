//! `stereocal init`: the files that a new cell starts from.

use super::super::{Outcome, Result};
use crate::cli::Init;
use crate::diagnostic::Status;
use crate::files::OutDir;
use crate::files::provenance::Run;
use crate::measurements::{RobotPose, Role, poses_csv};
use crate::robot::{self, Robot};

/// Every key with its default and where it comes from.
pub const SETTINGS: &str = include_str!("init.toml");

/// What stands above the parameters of the robot that is there to be replaced.
const ROBOT: &str = "# The nominal robot. What stands here is the arm of the paper (Table 1), as an example: replace it by yours, or have it written by
# `stereocal robot new NAME` (common arms) or `stereocal robot import FILE` (a URDF, a table).
# Modified Denavit-Hartenberg parameters, degrees and mm: alpha and a of the link before a joint, theta and d of the joint. Optional in a
# [[joint]]: limits_deg = [least, most], sign = -1 where the controller counts the other way round. [tool]: the target in the flange's frame.
";

/// What to do with them.
const NEXT: &str = "next: write your boards into stereocal.toml and your arm into robot.toml (it holds the paper's): `stereocal robot list` names the common ones\n";

/// Runs the command: `stereocal.toml`, `robot.toml`, `poses.csv`, none of them over another.
pub fn run(args: &Init, run: Run) -> Result<Outcome> {
    // The settings file would stand in its own way.
    let run = Run { force: args.force, inputs: Vec::new(), ..run };
    let out = OutDir::open(&args.out)?.for_run(&run, &[]);
    let names = ["stereocal.toml", "robot.toml", "poses.csv"];
    out.check_free(&names)?;
    out.write(names[0], SETTINGS.as_bytes())?;
    out.write(names[1], format!("{ROBOT}{}", robot::file::to_toml(&Robot::paper())).as_bytes())?;
    out.write(names[2], poses().as_bytes())?;
    let stdout = names.map(|name| format!("{}\n", out.join(name))).concat() + NEXT;
    Ok(Outcome { stdout, status: Status::Done })
}

/// A list that shows the columns: a centre, a sample and a pose to verify with.
fn poses() -> String {
    let pose = |name: &str, role, joints_deg: [f64; 6]| RobotPose {
        pose: name.to_owned(),
        group: "1".to_owned(),
        role,
        joints_deg: joints_deg.to_vec(),
        slides: Vec::new(),
    };
    let rows = [
        pose("001", Role::Center, [0.0, -90.0, 90.0, -90.0, -90.0, 0.0]),
        pose("002", Role::Sample, [5.0, -85.0, 92.0, -88.0, -85.0, 4.0]),
        pose("003", Role::Verify, [-4.0, -92.0, 88.0, -86.0, -94.0, -6.0]),
    ];
    poses_csv(rows.iter())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;

    /// The settings with the defaults' comment marks taken away.
    fn uncommented() -> String {
        let setting =
            |line: &str| line.starts_with('[') || line.split_once(" = ").is_some_and(|(key, _)| !key.contains(' '));
        SETTINGS
            .lines()
            .map(|line| line.strip_prefix("# ").unwrap_or(line))
            .filter(|line| setting(line))
            .map(|line| format!("{line}\n"))
            .collect()
    }

    #[test]
    fn the_settings_file_says_the_defaults() {
        let config: Config = toml::from_str(&uncommented()).unwrap();
        // A size that the file says is said, though it is the default.
        let shown = |config: &Config| format!("{config:?}").replace("is_assumed: true", "is_assumed: false");
        assert_eq!(shown(&config), shown(&Config::default()));
        assert_eq!(toml::from_str::<Config>(SETTINGS).unwrap(), Config::default());
    }

    /// A key that is missing from the file is a key that nobody finds: those of the structs, as their `Debug` names
    /// them.
    #[test]
    fn the_settings_file_has_every_key() {
        let shown = format!("{:#?}", Config::default());
        let keys = shown.lines().filter_map(|line| line.trim().split_once(": ")).map(|(key, _)| key);
        for key in keys.filter(|key| !["columns", "rows", "stretch", "kind", "is_assumed"].contains(key)) {
            assert!(SETTINGS.contains(&format!(" {key} = ")) || SETTINGS.contains(&format!("{key}]")), "{key}");
        }
    }
}
