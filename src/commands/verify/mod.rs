//! `stereocal verify`: Table 3 of the paper for robots from anywhere; nothing of them is fitted, only the sensor's
//! placement.
//!
//! Measurements are examined as `identify` examines them, with the first robot, so that both judge by the same rows:
//! units are mended and sessions get placements of their own. The robots are those of their files, and each takes the
//! rows as it counts its joints.

mod recheck;

use camino::{Utf8Path, Utf8PathBuf};
use serde::Serialize;

use super::{Outcome, Result, beyond};
use crate::cli::Verify;
use crate::config::Config;
use crate::diagnostic::{Status, count};
use crate::files::provenance::Run;
use crate::formats::robots::known;
use crate::identify::data::dataset::Dataset;
use crate::identify::data::{known as distances, still, targets, unused};
use crate::identify::examine::{self, Examined, on_rows};
use crate::identify::judge::errors::{Judge, PLACED_BY_ITSELF};
use crate::identify::judge::{folds, strays};
use crate::identify::record::{self, PointSpread, spread};
use crate::measurements::{Measurement, Observed, Role};
use crate::robot::{self, Robot};
use crate::{files, identify, progress, report};

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Verified {
    robots: Vec<RobotVerified>,
    /// Rows that fit far worse than the rest, by pose.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    strays: Vec<String>,
}

#[derive(Debug, Serialize)]
struct RobotVerified {
    file: String,
    verify: PointSpread,
    /// The tool that the robot's links ask for, where they come several times nearer with it than with that of the
    /// file.
    #[serde(skip_serializing_if = "Option::is_none")]
    asked_tool: Option<AskedTool>,
    /// The same without the strays; absent without any.
    #[serde(skip_serializing_if = "Option::is_none")]
    verify_without_strays: Option<PointSpread>,
}

#[derive(Debug, Serialize)]
struct AskedTool {
    tool_mm: [f64; 3],
    /// Middle position error with it.
    left_mm: f64,
}

impl RobotVerified {
    /// Of these rows, `folded` where they place the sensor too, and without those that are far off.
    fn new(file: &Utf8Path, robot: &Robot, (judge, judged, folded): (&Judge, &[usize], bool), far: &[usize]) -> Self {
        let of = |judge: &Judge, judged: &[usize]| {
            let errors = if folded { folds::judged(judge, robot, judged) } else { judge.errors(robot, judged) };
            spread(judge, robot, &errors, judged)
        };
        let near = |rows: &[usize]| rows.iter().copied().filter(|row| !far.contains(row)).collect::<Vec<usize>>();
        let without = || of(&Judge { fitted: &near(judge.fitted), ..judge.clone() }, &near(judged));
        let asked_tool = record::asked_tool(judge.set, robot);
        RobotVerified {
            file: file.to_string(),
            asked_tool: asked_tool.map(|(tool_mm, left_mm)| AskedTool { tool_mm, left_mm }),
            verify: of(judge, judged),
            verify_without_strays: (!far.is_empty()).then(without),
        }
    }
}

/// Makes verify rows samples where the file has none to place the sensor by, as a file of nothing but fresh poses; says
/// whether it did.
fn place_by_verify_rows(rows: &mut [Measurement]) -> bool {
    let usable =
        |role: Role| move |row: &Measurement| row.at.role == role && !matches!(row.observed, Observed::Missing { .. });
    if rows.iter().any(usable(Role::Sample)) || !rows.iter().any(usable(Role::Verify)) {
        return false;
    }
    for row in rows.iter_mut().filter(|row| row.at.role == Role::Verify) {
        row.at.role = Role::Sample;
    }
    true
}

/// That a robot was fitted to rows by which it is judged.
fn fitted_to(file: &Utf8Path, rows: &[Measurement]) -> Option<String> {
    let is_kept = rows.iter().any(|row| row.at.role == Role::Verify);
    let judged = |row: &&Measurement| !is_kept || row.at.role == Role::Verify;
    let (of, given) = (rows.iter().filter(judged).count(), known::given(file));
    let own = rows.iter().filter(judged).filter(|row| given.fitted(row)).count();
    (own > 0).then(|| {
        format!(
            "{file} was fitted to {own} of these {}: its figures there are those of a fit; `identify` said how far off rows are that it was without, \
             and new poses tell how far off it is now",
            count(of, "row")
        )
    })
}

/// What the examination makes of the rows.
struct Rows {
    set: Dataset,
    /// The same with signs and zeros of joints mended for the first robot, where it counts them otherwise than they are
    /// written.
    counted: Option<Dataset>,
    /// Whether rows and robots are what their files say and something explains the errors.
    is_sound: bool,
}

/// The set as the examination mends it, its findings said. What is wrong with links is mended in the first robot.
fn examined(set: &Dataset, file: &Utf8Path, robot: &mut Robot, settings: &identify::Settings) -> Rows {
    let Examined { set, robot: mended, along, findings, against, unexplained, .. } =
        examine::examine(set, robot, settings, &|_| {});
    let is_sound = unexplained.is_none() && against.is_empty() && mended == *robot;
    let of_rows = along.instead.clone().into_iter().chain(record::findings::along_the_rows(&along, &set));
    for finding in against.into_iter().chain(findings).chain(unexplained).chain(of_rows) {
        progress::warn(finding.sentence());
    }
    if mended == *robot {
        return Rows { set, counted: None, is_sound };
    }
    let counted = on_rows::mended(&set, robot, &mended);
    if counted.is_none() {
        progress::warn(format!(
            "the figures of {file} are those with this correction, those of other robots are without it"
        ));
        *robot = mended;
    }
    Rows { set, counted, is_sound }
}

impl Rows {
    /// As each robot takes them.
    fn taken(&self, robots: &[(&Utf8PathBuf, Robot)], settings: &identify::Settings) -> Vec<&Dataset> {
        let Some(counted) = &self.counted else { return vec![&self.set; robots.len()] };
        let of = |(k, (file, robot)): (usize, &(&Utf8PathBuf, Robot))| {
            let taken = if k == 0 { counted } else { on_rows::taken(&self.set, counted, robot, settings) };
            if !std::ptr::eq(taken, counted) {
                progress::note(format!(
                    "mended for {}; {file} counts its joints as the rows do, which are taken as they are written",
                    robots[0].0
                ));
            }
            taken
        };
        robots.iter().enumerate().map(of).collect()
    }
}

/// What the user must know of the rows.
fn tell(set: &Dataset, folded: bool, only_verify: bool) {
    unused::unused(set).iter().for_each(|finding| progress::warn(finding.sentence()));
    if let Some(targets) = &set.targets {
        progress::note(targets.sentence());
    }
    if let Some(repeats) = &set.repeats {
        progress::note(repeats.sentence());
        repeats.finding().iter().for_each(|finding| progress::warn(finding.sentence()));
    }
    if folded {
        progress::note("no row has the role `verify`: each row is judged with the sensor placed by the others");
    }
    if only_verify {
        progress::warn(
            "no row of role `sample` can be used: the verify rows also place the sensor, so that errors of points and wire lengths come out too small where there are few rows",
        );
    }
}

/// The rows, whose targets stand where the identification of one of the robots found them, or as the first robot joins
/// them.
fn of_rows(args: &Verify, rows: &[Measurement], first: Option<&Robot>) -> Result<Dataset> {
    let of_places = args.robot.iter().find_map(|file| targets::of_places(rows, &known::places_mm(file)));
    let mut set = match (of_places, first) {
        (Some((rows, targets)), _) => Dataset::of_rows(&rows, Some(targets))?,
        (None, Some(robot)) => Dataset::of_robot(rows, robot)?,
        (None, None) => Dataset::new(rows)?,
    };
    still::check_points(&set, first)?;
    if let Some(path) = &args.known_distances {
        set.known = distances::read(path, &set)?;
    }
    Ok(set)
}

pub fn run(args: &Verify, config: &Config, run: Run) -> Result<Outcome> {
    if let Some(against) = &args.against {
        return recheck::run(args, against, config, run);
    }
    let settings = &config.identify;
    let mut robots = Vec::new();
    for file in &args.robot {
        robots.push((file, robot::file::read(file)?));
    }
    let source = super::identify::source(args.measurements.clone(), &args.table, config);
    let mut rows = match robots.first() {
        Some((_, robot)) => super::identify::read(&source, robot)?,
        None => Vec::new(),
    };
    for (_, robot) in &robots {
        super::identify::check_joints(robot, &rows, &args.measurements[0])?;
    }
    args.robot.iter().filter_map(|file| fitted_to(file, &rows)).for_each(progress::warn);
    let only_verify = place_by_verify_rows(&mut rows);
    let set = of_rows(args, &rows, robots.first().map(|(_, robot)| robot))?;
    let rows = match robots.first_mut() {
        Some((file, robot)) => examined(&set, file, robot, settings),
        None => Rows { set, counted: None, is_sound: true },
    };
    let (set, taken) = (&rows.set, rows.taken(&robots, settings));
    let folded = !only_verify && set.verify_rows().is_empty();
    let (fitted, judged) = match only_verify || folded {
        true => (set.rows(|_| true), set.rows(|pose| pose.role != Role::Center)),
        false => (set.fit_rows(), set.verify_rows()),
    };
    tell(set, folded, only_verify);
    let as_taken = || robots.iter().zip(&taken).map(|((file, robot), set)| (file, robot, *set));
    as_taken().filter_map(|(file, robot, set)| beyond::ranges(file, robot, set, &judged)).for_each(progress::warn);
    let judge = Judge::plain(set, &fitted, settings.wire_offset);
    let each: Vec<&Robot> = robots.iter().map(|(_, robot)| robot).collect();
    let strays = strays::find(&judge, (&each, &taken), &judged);
    strays.iter().for_each(|strays| progress::warn(strays.statement(set)));
    let far = strays.as_ref().map_or(&[][..], |strays| &strays.rows);
    let verified = |(file, robot, set): (&&Utf8PathBuf, &Robot, &Dataset)| {
        RobotVerified::new(file, robot, (&Judge { set, ..judge.clone() }, &judged, folded), far)
    };
    let verified: Vec<RobotVerified> = as_taken().map(verified).collect();
    if verified.iter().all(|robot| robot.verify.is_empty()) {
        return Err(identify::Error::NothingJudged { rows: judged.len(), needed: PLACED_BY_ITSELF }.into());
    }
    let names = strays.as_ref().map_or_else(Vec::new, |strays| set.names(&strays.rows));
    let status = if rows.is_sound && strays.is_none() { Status::Done } else { Status::OutOfTolerance };
    let stdout = match args.json {
        true => files::to_json(&Verified { robots: verified, strays: names }),
        false => table(&verified, folded, &names),
    };
    Ok(Outcome { stdout, status })
}

/// The figures, and below them those without the strays.
fn table(robots: &[RobotVerified], folded: bool, strays: &[String]) -> String {
    let of = |figures: fn(&RobotVerified) -> Option<&PointSpread>| {
        let rows: Vec<(&str, &PointSpread)> =
            robots.iter().filter_map(|robot| Some((robot.file.as_str(), figures(robot)?))).collect();
        report::identify::verified(&rows, folded)
    };
    let mut all = of(|robot| Some(&robot.verify));
    for RobotVerified { file, asked_tool, .. } in robots {
        let Some(AskedTool { tool_mm: [x, y, z], left_mm }) = asked_tool else { continue };
        all += &format!(
            "{file}: with a tool of {x:.1}, {y:.1}, {z:.1} mm instead of the file's it is off by {left_mm:.3} mm (median); the figures above have \
             the tool of the file\n"
        );
    }
    match strays {
        [] => all,
        rows => {
            let without = of(|robot| robot.verify_without_strays.as_ref());
            format!("{all}\nwithout {}:\n{without}", rows.join(", "))
        }
    }
}
