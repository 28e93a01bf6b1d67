//! What was found along the way, each in words with the rows it is about and what was done.

use nalgebra::Vector3;

use crate::diagnostic::count as counted;
use crate::identify::data::dataset::Dataset;
use crate::identify::data::repeats::Repeats;
use crate::identify::data::still::{constant_joints, repeated, stuck};
use crate::identify::examine::conventions;
use crate::identify::examine::sessions::{Along, Session};
use crate::identify::finding::Finding;
use crate::identify::judge::errors::Judge;
use crate::identify::judge::scale::CommonScale;
use crate::identify::judge::uncertainty::stated_mm;
use crate::identify::judge::{lag, pattern};
use crate::identify::record::file::Smooth;
use crate::identify::record::{left_out, misfits, plausible, rounded, untested};
use crate::identify::run::Identification;
use crate::identify::sensor::Extra;

/// Times the scatter that no built robot has after a fit, from which on it speaks against the result whatever seemed to
/// explain it before.
const FAR_BEYOND: f64 = 3.0;

/// How many times smaller than what lies between the points their scatter must be.
const SMALL: f64 = 10.0;

/// What is wrong with the data, by weight.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Findings {
    /// What speaks against the result.
    pub against: Vec<Finding>,
    /// What no maker's tolerance allows and is to be looked at before the result is used.
    pub beyond: Option<Finding>,
    /// What was changed or left out before anything was fitted.
    pub doubts: Vec<Finding>,
    /// What was found along the way.
    pub notes: Vec<Finding>,
}

impl Findings {
    /// Those of the data, and those of the fit: what nothing explains, and a robot that is not the one of the file,
    /// speak against it. Where the rows are not of one robot, one tool or one unit, that is the cause of whatever is
    /// odd about a robot fitted to all of them.
    pub fn new(
        examined: Vec<Finding>,
        (cause, unexplained): (Vec<Finding>, Option<Finding>),
        of_fit: Vec<Finding>,
        along: &Along,
        set: &Dataset,
        found: &Identification,
    ) -> Findings {
        let against: Vec<Finding> = along.robots.clone().into_iter().chain(cause).collect();
        if !against.is_empty() {
            return Findings { against, doubts: examined, ..Findings::default() };
        }
        let left_mm = found.scatter.point_mm;
        let rounded = rounded::of_joints(set, found);
        // What rounded angles leave is not the instrument's.
        let noise = of_noise(set, found).filter(|_| rounded.is_none());
        let (is_far, other) = (is_far(found), plausible::of_another_robot(found));
        let beyond_all = || (is_far && noise.is_none()).then(|| conventions::unexplained(set, "the best fit", left_mm));
        let unexplained = unexplained.filter(|_| !is_plausible(found) && noise.is_none()).or_else(beyond_all);
        let unexplained = unexplained.map(|finding| beside_far_links(finding, other.is_some() && !is_far));
        let is_reached = unexplained.is_none();
        let left_out = left_out_of_a_joint(set, found);
        let (of_rounding, rounded) = if is_reached { (None, rounded) } else { (rounded, None) };
        let many = many_left_out(set, found);
        // Whether readings or robot file are scaled, nobody knows: the robot that was found may be off by as much. Of
        // rows that nothing explains it says nothing.
        let scale = scale(set, found).filter(|_| is_reached);
        // A scale that explains all links is why they are far off, and no other robot.
        let (of_links, scale) = if other.is_some() { (scale.or(other), None) } else { (None, scale) };
        let against: Vec<Finding> =
            left_out.into_iter().chain(of_rounding).chain(unexplained).chain(of_links).collect();
        // What is said against the result of some rows need not be said of them twice.
        let is_told = |finding: &Finding| {
            let mut told = against.iter().chain(&many);
            told.any(|told| told == finding || !told.rows.is_empty() && told.rows == finding.rows)
        };
        let (far_beyond, noise) = if is_far { (noise, None) } else { (None, noise) };
        let (doubted, untested) = untested::joints(set, found);
        let (lag, of_play) = of_lag(set, found);
        let notes = noise.into_iter().chain(of_fit).chain(of_play).chain(untested).filter(|f| !is_told(f)).collect();
        // A scale makes every length another.
        let beyond = plausible::of_links(found)
            .filter(|_| scale.is_none())
            .or_else(|| plausible::of_all_lengths(found))
            .filter(|_| against.is_empty());
        let many = many.filter(|many| against.iter().all(|told| told.rows != many.rows));
        let doubts = examined
            .into_iter()
            .chain(along.instead.clone())
            .chain(rounded)
            .chain(many)
            .chain(lag)
            .chain(misfits::of_verify(set, found))
            .chain(doubted)
            .chain(scale)
            .chain(plausible::of_terms(found))
            .chain(far_beyond)
            .collect();
        Findings { against, beyond, doubts, notes }
    }

    /// All of them, the gravest first.
    pub fn all(&self) -> Vec<Finding> {
        let first = self.against.iter().chain(&self.beyond);
        first.chain(&self.doubts).chain(&self.notes).cloned().collect()
    }
}

/// What no links near the file's explain, where a search that goes farther ends with less.
fn beside_far_links(finding: Finding, is_farther: bool) -> Finding {
    let figures = "the figures of `after` are of links that were taken farther from the file's than robots are built";
    if is_farther { Finding { action: format!("{}; {figures}", finding.action), ..finding } } else { finding }
}

/// Whether the robot that was found explains what no convention did, as where a link is so far off that only the whole
/// search reaches it, or leaves nothing but the readings' scatter.
pub fn is_explained(set: &Dataset, found: &Identification) -> bool {
    is_plausible(found) || of_noise(set, found).is_some()
}

/// Whether a built robot may have what is left.
fn is_plausible(found: &Identification) -> bool {
    few_left_out(found) && found.scatter.point_mm < conventions::IMPLAUSIBLE_MM
}

fn left_out_of_a_joint(set: &Dataset, found: &Identification) -> Option<Finding> {
    let errors = |set: &Dataset| {
        let judge = Judge { extras: &found.extras, ..Judge::plain(set, &found.fitted, false) };
        judge.errors(found.robot(), &found.outliers)
    };
    left_out::of_a_joint(set, found.robot(), &found.fitted, &found.outliers, &errors)
}

/// A scale of the readings that explains all links.
fn scale(set: &Dataset, found: &Identification) -> Option<Finding> {
    let scale = found.scale(set).filter(CommonScale::is_significant)?;
    plausible::is_explained_by(scale.share, found).then(|| {
        let action = "the robot that was found has this scale; check it on a known length, and of cameras `--square-mm` of both boards, the target's and \
                      the one that calibrated them";
        Finding::new(scale.sentence(), action)
    })
}

/// That so many rows were left out that the robot may be the others' only.
fn many_left_out(set: &Dataset, found: &Identification) -> Option<Finding> {
    let is_many = found.formulation().is_some() && !few_left_out(found);
    is_many.then(|| misfits::left_out(set, found))
}

/// Whether more is left than any robot or instrument leaves.
fn is_far(found: &Identification) -> bool {
    found.scatter.point_mm > FAR_BEYOND * conventions::IMPLAUSIBLE_MM
}

fn few_left_out(found: &Identification) -> bool {
    found.formulation().is_some() && found.outliers.len() * 10 <= found.fitted.len()
}

/// Points that scatter by more than a robot could, where nothing of that follows the joints and the links are those of
/// the file's robot. Rows that were exchanged scatter as well, by as much as the points lie apart.
fn of_noise(set: &Dataset, found: &Identification) -> Option<Finding> {
    let scatter_mm = found.scatter.point_mm;
    let may_be = scatter_mm >= conventions::IMPLAUSIBLE_MM && few_left_out(found);
    let formulation = found.formulation().filter(|_| may_be)?;
    let is_explained = SMALL * scatter_mm < spread_mm(set, &found.fitted);
    // A joint that turned while its column stood still scatters the points as well, by more than an instrument does.
    let is_stuck = !constant_joints(set, &[]).is_empty() && is_far(found);
    // Terms that no gear has follow the joints in the place of what is wrong.
    let is_built = || plausible::are_of_the_file(found) && plausible::of_terms(found).is_none();
    (is_explained && !is_stuck && pattern::is_scatter(formulation, set) && is_built()).then(|| {
        Finding::new(
            format!("the readings scatter by {scatter_mm:.2} mm a coordinate, whatever the joints are{}", stuck(set)),
            "if the instrument is better than that, see whether the robot stood still and joints and readings are of one moment",
        )
    })
}

/// How far a coordinate of the points lies from the middle of its group, mm; zero of other readings.
fn spread_mm(set: &Dataset, rows: &[usize]) -> f64 {
    let of_group = |group| {
        let points = set.of_group(rows, group).into_iter().filter_map(|row| set.poses[row].reading.point_mm());
        let points: Vec<_> = points.map(|point| point.coords).collect();
        let middle = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
        points.into_iter().map(move |point| (point - middle).norm_squared())
    };
    let squares: Vec<f64> = (0..set.groups.len()).flat_map(of_group).collect();
    (squares.iter().sum::<f64>() / (3 * squares.len()).max(1) as f64).sqrt()
}

/// What was found along the way: gross errors, sessions, drifts, covariances that are off.
pub fn findings(set: &Dataset, found: &Identification, along: &Along) -> Vec<Finding> {
    misfits::of_rows(set, found)
        .into_iter()
        .chain(of_sensor(found))
        .chain(along_the_rows(along, set))
        .chain(of_data(set, found))
        .collect()
}

/// A lag, or play, that speaks against the result, or one that does not.
fn of_lag(set: &Dataset, found: &Identification) -> (Option<Finding>, Option<Finding>) {
    match found.formulation().and_then(|formulation| lag::find(set, formulation)) {
        Some(lag) if lag.is_doubt => (Some(lag.finding), None),
        lag => (None, lag.map(|lag| lag.finding)),
    }
}

/// Errors that the readings share.
fn of_sensor(found: &Identification) -> Vec<Finding> {
    let mut list = Vec::new();
    let mut add = |finding: String, action: &str| list.push(Finding::new(finding, action));
    if let Some((zero_mm, sigma_mm)) = zero(found) {
        let (size, way) = (zero_mm.abs(), if zero_mm > 0.0 { "long" } else { "short" });
        add(
            format!(
                "the distances are {size:.3} mm too {way} (known to {sigma_mm:.3} mm): the zero of the readings is off"
            ),
            "it was found with the robot and taken off there; the figures below, as those of `verify`, hold the distances as they were read",
        );
    }
    if found.smooth.is_some_and(|told| told.evidence > SMOOTH)
        && let Some(smooth) = Smooth::new(found)
    {
        add(
            format!(
                "the points of each placement share a smooth error of about {:.3} mm a coordinate, which changes over some {} mm: sensor distortion, or errors of the robot that the model does not describe",
                smooth.left_mm,
                rounded(smooth.error.length_mm)
            ),
            "it is treated as one error of each placement, and the expected accuracy allows for it; more placements reduce it",
        );
    }
    list
}

/// What the rows hold, and what their covariances state.
fn of_data(set: &Dataset, found: &Identification) -> Vec<Finding> {
    let mut list: Vec<Finding> =
        set.repeats.iter().filter_map(Repeats::finding).chain(of_few_to_verify(set, found)).collect();
    let mut add = |finding: String, rows, action: &str| list.push(Finding::new(finding, action).about(rows));
    if !set.floored.is_empty() {
        add(
            "singular covariances (no variance in one direction)".to_owned(),
            set.floored.clone(),
            "a micrometre was added to each coordinate",
        );
    }
    let oriented = set.poses.iter().filter(|pose| pose.reading.rotation_rad().is_some()).count();
    if oriented > 0 && !set.has_rotations() {
        let count = set.poses.len();
        add(
            format!(
                "{oriented} of {count} poses have an orientation: orientations are used only where all poses have one"
            ),
            Vec::new(),
            "the points alone are used; measure the orientation of all poses, or of none",
        );
    }
    let names = repeated(set);
    if !names.is_empty() {
        let finding = "poses that the robot came back to: they say how well it repeats, and nothing about its links";
        add(finding.to_owned(), names, "all of them are used");
    }
    let rows = if found.outliers.is_empty() { "all rows" } else { "all rows that were fitted" };
    let constant = match &constant_joints(set, &found.outliers)[..] {
        [] => None,
        [one] => Some(format!("joint {one} is the same in {rows}: its parameters cannot be told from its neighbours'")),
        all => Some(format!(
            "joints {} are the same in {rows}: their parameters cannot be told from their neighbours'",
            all.join(", ")
        )),
    };
    if let Some(finding) = constant {
        add(finding, Vec::new(), "move every joint between poses");
    }
    if let Some(finding) = stated_covariances(set, found) {
        add(finding, Vec::new(), "the fit uses the scatter that it found");
    }
    if set.groups.iter().any(|g| g.center.is_none())
        && (0..set.poses.len()).any(|r| set.touches(r))
        && set.known.is_empty()
    {
        add(
            "touches alone do not determine the scale of the robot (a robot of length zero would fit)".to_owned(),
            Vec::new(),
            "the scale stays nominal; `--known-distances` gives it",
        );
    }
    list
}

/// Rows to verify of which there are too few to judge by.
fn of_few_to_verify(set: &Dataset, found: &Identification) -> Option<Finding> {
    let rows = set.verify_rows();
    (!rows.is_empty() && !found.deletions.is_empty()).then(|| {
        let said = format!("{} to verify: too few to judge a robot by", counted(rows.len(), "row"));
        let action = "each fitted row is judged by a fit that it was left out of instead";
        Finding::new(said, action).about(set.names(&rows))
    })
}

/// Sessions and drifts.
pub fn along_the_rows(along: &Along, set: &Dataset) -> Vec<Finding> {
    let mut list: Vec<Finding> = along.robots.iter().cloned().collect();
    let mut add = |finding: String, rows, action: &str| list.push(Finding::new(finding, action).about(rows));
    let drifts = |s: &Session| along.drifting.contains(&s.group);
    let ranges = |of: &dyn Fn(&&Session) -> bool| -> Vec<String> {
        along.sessions.iter().filter(of).map(|s| format!("{}..{}", s.first, s.last)).collect()
    };
    let stepping = ranges(&|s| !drifts(s));
    if along.instead.is_none() && !stepping.is_empty() {
        add(
            format!(
                "the rows fall into {} sessions, between which {}, the robot's base or the zero of joint 1 moved",
                stepping.len(),
                set.stands()
            ),
            stepping,
            "each session got a placement of its own",
        );
    }
    if along.instead.is_none() && !along.drifting.is_empty() {
        add(
            format!(
                "the sensor or the robot's base moves evenly along the rows of group {}: a drift",
                along.drifting.join(", ")
            ),
            Vec::new(),
            match ranges(&|s| drifts(s)).len() {
                0 => "nothing was done: the errors of these groups are in the result".to_owned(),
                parts => format!("the rows were cut into {parts} placements; what moves within each is in the result"),
            }
            .as_str(),
        );
    }
    list
}

/// Logarithm of the evidence from which on a smooth error is told of: of clean sets of four placements one in seventy
/// has as much.
const SMOOTH: f64 = 2.5;

/// To one digit.
fn rounded(length_mm: f64) -> f64 {
    let unit = 10f64.powf(length_mm.log10().floor());
    (length_mm / unit).round() * unit
}

/// Standard deviations from which on a zero that was found is said to be off.
const ZERO_SIGMAS: f64 = 4.0;

/// The zero of distances to a centre and its standard deviation, mm, where it is off.
pub fn zero(found: &Identification) -> Option<(f64, f64)> {
    let k = found.extras.iter().position(|(extra, _)| *extra == Extra::Zero)?;
    let formulation = found.formulation()?;
    let at = formulation.base.rank() + k;
    let (value, sigma) = (found.extras[k].1, formulation.covariance()[(at, at)].max(0.0).sqrt());
    (value.abs() > ZERO_SIGMAS * sigma).then_some((value, sigma))
}

/// Scatter over stated standard deviation beyond which it is worth a sentence.
const FAR_ABOVE: f64 = 2.5;

/// Scatter over stated standard deviation below which the stated one is worth a sentence.
const FAR_BELOW: f64 = 0.8;

/// Whether the covariances of the file are far from what was seen.
fn stated_covariances(set: &Dataset, found: &Identification) -> Option<String> {
    let stated_mm = stated_mm(set)?;
    let scatter = &found.scatter;
    let whole_mm = (stated_mm.powi(2) * scatter.stated + scatter.point_mm.powi(2)).sqrt();
    if whole_mm < FAR_BELOW * stated_mm {
        return Some(format!(
            "the covariances are too large: the residuals are those of {:.1} times smaller standard deviations",
            stated_mm / whole_mm
        ));
    }
    if scatter.stated > 1.0 {
        return Some(format!(
            "the covariances are too small: the residuals are those of {:.1} times larger standard deviations",
            scatter.stated.sqrt()
        ));
    }
    // In a distance to a centre both ends scatter.
    let ends = if set.to_centers() { 2.0 } else { 1.0 };
    let ratio = f64::sqrt(ends) * scatter.point_mm / stated_mm.max(1e-9);
    (ratio > FAR_ABOVE).then(|| {
        format!(
            "the rows scatter by {0:.4} mm a coordinate, {ratio:.1$} times what the rows' own covariances say ({stated_mm:.4} mm, without \
             what all rows share): the robot's repeatability and what the model lacks, or covariances that are too small",
            scatter.point_mm,
            if ratio < 10.0 { 1 } else { 0 },
        )
    })
}
