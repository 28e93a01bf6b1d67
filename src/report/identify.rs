//! The tables and the page of `identify`.

use maud::{Markup, html};
use nalgebra::Point3;

use super::Result;
use super::drawing::figure::Plot;
use super::drawing::scene::{Ink, Scene};
use super::page::{self, Tone};
use super::table::{Table, number};
use crate::identify::data::dataset::Dataset;
use crate::identify::judge::errors::{RowError, Spread};
use crate::identify::model::uncertainty::Expected;
use crate::identify::record::{MethodRecord, PointSpread, Record};
use crate::identify::solve::swarm::halton;
use crate::measurements::Role;

/// What goes to stdout: before and after, method by method.
pub fn summary(record: &Record) -> String {
    let verify = &record.before.verify;
    let mut table = Table::new(["verification distances, mm", "mean", "std", "max", "min", "better by"]);
    table.row(distance_row("before", &verify.distance, None));
    for method in &record.methods {
        let name = format!("{}/{}", method.name, method.model);
        let mark = if name == record.chosen { " *" } else { "" };
        table.row(distance_row(&format!("{name}{mark}"), &method.verify.distance, Some(&verify.distance)));
    }
    let i = &record.identifiability;
    let mut text = table.to_string();
    text.push_str(&format!(
        "\n* kept: the terms by their error on samples held out, the method by its cost. {}: {} of {} parameters determined, condition {}\n",
        record.terms,
        i.rank,
        i.parameters,
        number(i.condition, 0)
    ));
    if let (Some(before), Some(after)) = (&verify.point, record.chosen_method().and_then(|m| m.verify.point.as_ref())) {
        text.push_str(&format!(
            "position error of the verify rows, mean: {} -> {} mm\n",
            number(before.mean_abs_mm, 4),
            number(after.mean_abs_mm, 4)
        ));
    }
    if record.folded {
        text.push_str(
            "no row is to verify: the robot is from all rows, and each row is judged by fits that it was left out of\n",
        );
    }
    if let Some(sure) = sure(record) {
        text.push_str(&format!("{sure}\n"));
    }
    if let Some(([x, y, z], left)) = record.tool_mm {
        text.push_str(&format!(
            "the nominal chain asks for a tool of {x:.1}, {y:.1}, {z:.1} mm and is off by {left:.3} mm with it; `before` has the tool of the file\n"
        ));
    }
    if let Some(repeats) = &record.repeats {
        text.push_str(&format!("{}\n", repeats.sentence()));
    }
    if let Some(targets) = &record.targets {
        text.push_str(&format!("{}\n", targets.sentence()));
    }
    if let Some(expected) = &record.expected {
        text.push_str(&format!("{}\n", expected.sentence()));
    }
    if let Some(scale) = record.scale.filter(|scale| !scale.is_told()) {
        text.push_str(&format!("{}\n", scale.sentence()));
    }
    text
}

/// How sure the choice of terms is.
fn sure(record: &Record) -> Option<String> {
    let against = |c: &crate::identify::judge::climb::Certainty| {
        format!("less error than {} in {} of {} ways to hold samples out", c.than, c.better, c.of)
    };
    let all: Vec<String> = record.certainty.iter().map(against).collect();
    (!all.is_empty()).then(|| format!("{}: {}", record.terms, all.join(", ")))
}

/// Table 3 for robots from anywhere.
pub fn verified(robots: &[(&str, &PointSpread)]) -> String {
    let mut table = Table::new(["verify rows, mm", "mean", "std", "max", "min", "point mean", "point max"]);
    for (name, spread) in robots {
        let mut row = distance_row(name, &spread.distance, None);
        row.pop();
        let points = spread.point.or(spread.distortion);
        row.push(number(points.and_then(|p| p.mean_abs_mm), 4));
        row.push(number(points.and_then(|p| p.max_abs_mm), 4));
        table.row(row);
    }
    table.to_string()
}

fn distance_row(name: &str, spread: &Spread, before: Option<&Spread>) -> Vec<String> {
    let gain = match (before.and_then(|b| b.mean_abs_mm), spread.mean_abs_mm) {
        (Some(before), Some(after)) if before > 0.0 => format!("{:.1} %", 100.0 * (1.0 - after / before)),
        _ => String::new(),
    };
    let figures = [spread.mean_abs_mm, spread.std_mm, spread.max_abs_mm, spread.min_abs_mm];
    let mut row = vec![name.to_owned()];
    row.extend(figures.map(|f| number(f, 4)));
    row.push(gain);
    row
}

/// The page. `before` and `after` are the errors of the verify rows under the nominal and the identified robot.
/// `places` are the target's points in the nominal base frame, row by row; `arm` is the arm's line at the first centre pose.
pub fn page(
    set: &Dataset,
    record: &Record,
    places: &[(Role, Point3<f64>)],
    arm: &[Point3<f64>],
    before: &[RowError],
    after: &[RowError],
) -> Result<String> {
    let lead = format!(
        "{} poses in {} {}, {}; {} kept, seed {}",
        set.poses.len(),
        set.groups.len(),
        if set.groups.len() == 1 { "group" } else { "groups" },
        match record.folded {
            true => "all fitted, each judged by fits that it was left out of".to_owned(),
            false => format!("{} to verify", set.verify_rows().len()),
        },
        record.chosen,
        record.seed
    );
    let content = html! {
        (verdict(record))
        (page::warnings(&record.warnings))
        h2 { "Verification" }
        (verification_figure(before, after)?)
        (verification_table(record))
        @if let Some(targets) = &record.targets {
            p { "Several targets: " (targets.sentence()) "." }
        }
        (worst_table(set, before, after))
        @if let Some(expected) = &record.expected {
            h2 { "How far to trust it" }
            (expected_table(expected))
            @if let Some(scale) = record.scale.filter(|scale| !scale.is_told()) {
                p { "Not in these figures: " (scale.sentence()) "." }
            }
            (expected_map(expected, places)?)
        }
        h2 { "Parameters" }
        p { "Table 2 of the paper: the corrected parameters of each link and joint; alpha and a of link j - 1, theta and d of joint j." }
        (joint_table(record))
        (parameter_table(record))
        h2 { "What the poses determine" }
        (rank_table(record))
        h2 { "Convergence" }
        (convergence_figure(record)?)
        h2 { "How it was chosen" }
        (judged_table(record))
        h2 { "Where was measured" }
        (in_space(places, arm))
        (layout_figures(places)?)
        h2 { "How the swarms start" }
        (start_figures(record.seed)?)
    };
    Ok(page::page("Identification", &lead, &content))
}

/// Scatter of a coordinate, mm, that says that robot and measurements don't belong together.
const IMPLAUSIBLE_SCATTER_MM: f64 = 0.8;

fn verdict(record: &Record) -> Markup {
    let before = record.before.verify.distance.mean_abs_mm;
    let after = record.chosen_method().and_then(|m| m.verify.distance.mean_abs_mm);
    let left_mm = record.smooth.map_or(0.0, |s| s.left_mm).hypot(record.scatter_mm);
    let tone = match (before, after) {
        // Not good as long as more is left than a built robot scatters by.
        (Some(before), Some(after)) if after < before && left_mm < IMPLAUSIBLE_SCATTER_MM => Tone::Good,
        (Some(before), Some(after)) if after <= before => Tone::Doubtful,
        (Some(_), Some(_)) => Tone::Bad,
        _ => Tone::Doubtful,
    };
    let headline = format!("mean distance error {} mm before, {} mm after", number(before, 4), number(after, 4));
    let verify = |robot: Option<&PointSpread>| match robot.map(|s| (s.distance.max_abs_mm, s.point)) {
        Some((largest, point)) => (number(largest, 4), number(point.and_then(|p| p.mean_abs_mm), 4)),
        None => (number(None, 4), number(None, 4)),
    };
    let (largest_before, point_before) = verify(Some(&record.before.verify));
    let (largest_after, point_after) = verify(record.chosen_method().map(|m| &m.verify));
    let mut detail = format!("largest {largest_before} mm before, {largest_after} mm after");
    if record.before.verify.point.is_some() {
        detail.push_str(&format!("; position, mean: {point_before} mm before, {point_after} mm after"));
    }
    detail.push_str("; on rows that took no part in the fit or in any choice");
    page::verdict(tone, &headline, &detail)
}

fn verification_figure(before: &[RowError], after: &[RowError]) -> Result<Markup> {
    let series = |errors: &[RowError]| -> Vec<(f64, f64)> {
        let numbered = errors.iter().enumerate().filter_map(|(i, e)| Some(((i + 1) as f64, e.distance_mm?.abs())));
        numbered.filter(|(_, error)| *error > 0.0).collect()
    };
    let svg =
        Plot::new("Distance errors of the verify rows", "verify row, in the order of the file", "absolute error, mm")
            .points("before", &series(before))
            .points("after", &series(after))
            .log_y()
            .svg()?;
    Ok(page::figure(
        &svg,
        "Fig. 9 of the paper: each verification distance before and after; a division of the scale is a factor of ten. A pose that is \
         as far off after as before is one that the model cannot explain: see the table of the worst.",
    ))
}

/// Verify rows in the table of the worst.
const WORST: usize = 10;

/// The verify rows with the largest errors after identification.
fn worst_table(set: &Dataset, before: &[RowError], after: &[RowError]) -> Markup {
    let mut errors: Vec<(f64, &RowError, &RowError)> =
        before.iter().zip(after).filter_map(|(b, a)| Some((a.distance_mm?, b, a))).collect();
    errors.sort_by(|x, y| y.0.abs().total_cmp(&x.0.abs()));
    let row = |(_, b, a): &(f64, &RowError, &RowError)| {
        let pose = &set.poses[a.row];
        let point = |e: &RowError| number(e.point_mm.map(|p| p.norm()), 4);
        let distance = |e: &RowError| number(e.distance_mm, 4);
        vec![pose.name.clone(), set.groups[pose.group].name.clone(), distance(b), distance(a), point(b), point(a)]
    };
    let rows: Vec<Vec<String>> = errors.iter().take(WORST).map(row).collect();
    let header = ["verify row", "group", "distance before, mm", "after, mm", "point before, mm", "after, mm"];
    html! {
        p { "The worst after identification, predicted minus measured. One group among them: its cameras or its centre moved; one \
             region of the workspace: the model is not enough there." }
        (page::table(&header, &rows))
    }
}

fn verification_table(record: &Record) -> Markup {
    let row = |name: &str, s: &PointSpread, before: Option<&Spread>| {
        let mut row = distance_row(name, &s.distance, before);
        row.push(number(s.point.and_then(|p| p.mean_abs_mm), 4));
        row.push(number(s.point.and_then(|p| p.max_abs_mm), 4));
        row
    };
    let before = &record.before.verify;
    let mut rows = vec![row("before", before, None)];
    rows.extend(record.methods.iter().map(|m| {
        let name = format!("{}/{}", m.name, m.model);
        let mark = if name == record.chosen { " (kept)" } else { "" };
        row(&format!("{name}{mark}"), &m.verify, Some(&before.distance))
    }));
    html! {
        p { "Table 3 of the paper, for every method and model. Methods that differ by less than their scatter have found the same robot." }
        (page::table(&["distances, mm", "mean", "std", "max", "min", "better by", "point mean", "point max"], &rows))
    }
}

fn expected_table(expected: &Expected) -> Markup {
    let row = |what: &str, mm: f64| vec![what.to_owned(), number(Some(mm), 4)];
    html! {
        p { "The position error to expect of the identified robot at poses like these, after one rigid fit to each placement, from the \
             covariance of the parameters and what is left of the residuals. It holds within " (expected.poses)
            "; beyond, the corrections hold only as far as the model is right." }
        (page::table(&["error to expect", "mm"], &[
            row("mean", expected.mean_mm),
            row("95 of 100 errors are below", expected.p95_mm),
            row("mean at the worst pose", expected.max_mm),
            row("of the mean: parameters and placement", expected.of_robot_mm),
            row("of the mean: scatter of the rows", expected.scatter_mm),
        ]))
    }
}

/// The poses by thirds of the error to expect, from above and from the side.
fn expected_map(expected: &Expected, places: &[(Role, Point3<f64>)]) -> Result<Markup> {
    let mut errors: Vec<f64> = expected.map.iter().map(|(_, mm)| *mm).collect();
    errors.sort_by(f64::total_cmp);
    let third = |k: usize| errors.get(k * errors.len() / 3).copied().unwrap_or(0.0);
    let limits = [(third(0), third(1)), (third(1), third(2)), (third(2), f64::INFINITY)];
    let view = |title: &str, vertical: &str, axes: (usize, usize)| {
        let mut plot = Plot::new(title, "x, mm", vertical).equal_axes();
        for (low, high) in limits {
            let within = expected.map.iter().zip(places).filter(|((_, mm), _)| *mm >= low && *mm < high);
            let points: Vec<(f64, f64)> = within.map(|(_, (_, p))| (p[axes.0], p[axes.1])).collect();
            let label =
                if high.is_finite() { format!("{low:.4} to {high:.4} mm") } else { format!("{low:.4} mm and more") };
            plot = plot.points(&label, &points);
        }
        plot.svg()
    };
    let caption = "The error to expect at the poses of the file, base frame, a third of them each. Where it is largest more poses tell most.";
    Ok(html! { div.side {
        (page::figure(&view("Error to expect, from above", "y, mm", (0, 1))?, caption))
        (page::figure(&view("Error to expect, from the side", "z, mm", (0, 2))?, "The same from the side."))
    } })
}

fn parameter_table(record: &Record) -> Markup {
    let Some(method) = record.chosen_method() else { return html! {} };
    let seen = &record.identifiability;
    let in_sum = |name: &str| seen.dependent.iter().any(|sum| sum.split_whitespace().any(|word| word == name));
    let row = |p: &crate::identify::record::ParameterRecord| {
        let state = match (p.identifiable, p.at_bound) {
            (true, true) => "at the wall",
            (true, false) if seen.weak.contains(&p.name) => "from the tolerance alone",
            _ if p.delta != 0.0 && in_sum(&p.name) => "its share of a sum",
            (false, _) => "stays nominal",
            (true, false) => "",
        };
        vec![
            p.name.clone(),
            p.unit.to_owned(),
            number(Some(p.nominal), 4),
            number(Some(p.delta), 4),
            number(p.sigma, 4),
            state.to_owned(),
        ]
    };
    let rows: Vec<Vec<String>> = method.parameters.iter().map(row).collect();
    page::table(&["parameter", "unit", "nominal", "correction", "sigma", ""], &rows)
}

fn rank_table(record: &Record) -> Markup {
    let i = &record.identifiability;
    let list = |names: &[String]| if names.is_empty() { "none".to_owned() } else { names.join("; ") };
    let mut rows = vec![
        vec!["rank".to_owned(), format!("{} of {}", i.rank, i.parameters)],
        vec!["not seen at all".to_owned(), list(&i.zero)],
        vec!["seen only together".to_owned(), list(&i.dependent)],
        vec!["hardly seen".to_owned(), list(&i.weak)],
        vec!["condition".to_owned(), number(i.condition, 1)],
    ];
    if let Some(o) = &i.observability {
        for (name, value) in [("O1", o.o1), ("O2", o.o2), ("O3", o.o3), ("O4", o.o4), ("O5", o.o5)] {
            rows.push(vec![name.to_owned(), format!("{value:.3e}")]);
        }
    }
    html! {
        p { "Observability indices O1 to O5 of the base parameters (Sun and Hollerbach, 2008), mm a mm or mrad: the larger, the better the \
             poses; a condition in the thousands asks for poses with more varied orientation." }
        (page::table(&["", ""], &rows))
    }
}

fn convergence_figure(record: &Record) -> Result<Markup> {
    let model = record.chosen_method().map_or("", |m| m.model);
    let series = |m: &MethodRecord| -> Vec<(f64, f64)> {
        m.history.iter().enumerate().filter(|(_, c)| **c > 0.0).map(|(i, &c)| (i as f64, c)).collect()
    };
    let mut plot = Plot::new("Best cost by iteration", "iteration", "cost, mm²").log_y();
    for method in record.methods.iter().filter(|m| m.model == model) {
        plot = plot.line(method.name, &series(method));
    }
    Ok(page::figure(
        &plot.svg()?,
        "Fig. 8 of the paper: lines that end above the lowest one have stopped short of the minimum.",
    ))
}

/// Table 2: what every joint's row of Table 1 has become. Empty cells stay nominal.
fn joint_table(record: &Record) -> Markup {
    let Some(method) = record.chosen_method() else { return html! {} };
    let find = |name: String| method.parameters.iter().find(|p| p.name == name);
    let cell = |name: String| match find(name) {
        Some(p) if p.delta != 0.0 => format!("{:.4} {:+.4}", p.nominal, p.delta),
        Some(p) => format!("{:.4}", p.nominal),
        None => String::new(),
    };
    let rows: Vec<Vec<String>> = (1..)
        .map_while(|j| {
            find(format!("theta_{j}"))?;
            let link = j - 1;
            let cells =
                [format!("alpha_{link}"), format!("a_{link}"), format!("theta_{j}"), format!("d_{j}")].map(&cell);
            Some(std::iter::once(j.to_string()).chain(cells).collect())
        })
        .collect();
    page::table(&["j", "alpha, deg", "a, mm", "theta, deg", "d, mm"], &rows)
}

fn judged_table(record: &Record) -> Markup {
    let row = |j: &crate::identify::judge::climb::Judged| {
        let mark = if j.terms == record.terms { " (kept)" } else { "" };
        vec![j.model.to_owned(), format!("{}{mark}", j.terms), number(j.held_out_mm, 4)]
    };
    let rows: Vec<Vec<String>> = record.judged.iter().map(row).collect();
    if rows.is_empty() {
        return html! { p { "Model, terms and method were given." } };
    }
    html! {
        p { "Root mean square error on samples that were held out of the fit, mm. More terms are taken only where this falls and the data make them much more probable than what they are added to. The methods all solve the same problem: the cheapest of those that end at the least cost is kept." }
        (page::table(&["model", "terms", "held-out error, mm"], &rows))
    }
}

/// The arm and the points at which it was measured.
fn in_space(places: &[(Role, Point3<f64>)], arm: &[Point3<f64>]) -> Markup {
    let mut scene = Scene::default();
    scene.line(Ink::Frame, arm.to_vec());
    for &(role, at) in places {
        let ink = match role {
            Role::Sample => Ink::Plain,
            Role::Verify => Ink::Bad,
            Role::Center => Ink::Good,
        };
        scene.line(ink, vec![at]);
    }
    scene.word(Point3::origin(), "base");
    let caption = "The arm at the first centre pose and the points of the target in the base frame: samples in blue, verify rows in red, centres in green.";
    scene.upright().figure("the arm and where it was measured", caption)
}

/// Fig. 7: the poses from above and from the side.
fn layout_figures(places: &[(Role, Point3<f64>)]) -> Result<Markup> {
    let view = |title: &str, vertical: &str, axes: (usize, usize)| {
        let series = |role: Role| -> Vec<(f64, f64)> {
            places.iter().filter(|(r, _)| *r == role).map(|(_, p)| (p[axes.0], p[axes.1])).collect()
        };
        Plot::new(title, "x, mm", vertical)
            .points("sample", &series(Role::Sample))
            .points("verify", &series(Role::Verify))
            .points("center", &series(Role::Center))
            .equal_axes()
            .svg()
    };
    let caption = "Fig. 7 of the paper: where the nominal robot puts the target, base frame. What lies outside of these points was not \
                   identified, and the corrections hold there only as far as the model is right.";
    Ok(html! { div.side {
        (page::figure(&view("Poses from above", "y, mm", (0, 1))?, caption))
        (page::figure(&view("Poses from the side", "z, mm", (0, 2))?, "The same poses from the side: the heights and reaches over which the identification holds."))
    } })
}

/// Points of each start in Fig. 3.
const START_POINTS: usize = 200;

/// Fig. 3: Halton's sequence beside pseudo-random numbers.
fn start_figures(seed: u64) -> Result<Markup> {
    let pairs = |numbers: &[f64]| -> Vec<(f64, f64)> { numbers.chunks_exact(2).map(|p| (p[0], p[1])).collect() };
    let plot = |title: &str, numbers: &[f64]| {
        Plot::new(title, "first coordinate", "second coordinate").points("", &pairs(numbers)).equal_axes().svg()
    };
    let halton = plot("Halton sequence", &halton::points(START_POINTS, 2, seed))?;
    let random = plot("Pseudo-random numbers", &crate::identify::solve::swarm::uniform(2 * START_POINTS, seed))?;
    Ok(html! { div.side {
        (page::figure(&halton, "Fig. 3 of the paper: Halton's points, where STAPSO starts, leave neither clusters nor holes."))
        (page::figure(&random, "Pseudo-random points, where the other swarms start, have both."))
    } })
}
