//! The tables of `identify.html`.

use maud::{Markup, html};

use crate::diagnostic::{aligned, two_digits};
use crate::identify::data::dataset::{Dataset, Kind};
use crate::identify::judge::errors::{RowError, Spread};
use crate::identify::judge::uncertainty::Expected;
use crate::identify::record::{MethodRecord, ParameterRecord, PointSpread, Record};
use crate::report::page;
use crate::report::table::{number, short, with_sigma};

/// Rows in the table of the worst.
const WORST: usize = 10;

/// Poses that a sentence names.
const FEW: usize = 4;

/// What distances are from.
pub(super) fn distances(set: &Dataset) -> Markup {
    let centers = set.groups.iter().filter(|group| group.center.is_some()).count();
    let fitted = set.fit_rows();
    let nearest =
        (0..set.groups.len()).filter_map(|group| Some(set.poses[set.reference(group, &fitted)?].name.as_str()));
    let from = if (0..set.poses.len()).any(|row| set.touches(row)) {
        "A row's distance is that of the predicted target from the mean of its group's predicted points: all of them touched one point.".to_owned()
    } else if centers == set.groups.len() {
        "A row's distance is that of the target from where it is at its group's centre pose.".to_owned()
    } else if set.kind == Kind::Distances {
        "A row's distance is that of the target from a point that stands still, whose place is found from the rows."
            .to_owned()
    } else {
        let centre = if centers > 0 { "its group's centre pose or, in a group without one, at " } else { "" };
        format!(
            "A row's distance is that of the target from where it is at {centre}the pose nearest to the middle of the group's points (pose {}).",
            nearest.take(FEW).collect::<Vec<_>>().join(", ")
        )
    };
    let point = " A position error is what is left of a point after one rigid fit to the points of each group.";
    html! { p { (from) @if set.kind == Kind::Positions { (point) } } }
}

/// A row's distance error after identification, and all its errors before and after.
type Worst<'a> = (f64, &'a RowError, &'a RowError);

/// The rows that were not fitted with the largest errors after identification.
pub(super) fn worst_table(set: &Dataset, before: &[RowError], after: &[RowError], folded: bool) -> Markup {
    let mut errors: Vec<Worst> = before.iter().zip(after).filter_map(|(b, a)| Some((a.distance_mm?, b, a))).collect();
    errors.sort_by(|x, y| y.0.abs().total_cmp(&x.0.abs()));
    errors.truncate(WORST);
    let column = |of: fn(&Worst) -> Option<f64>| aligned(&errors.iter().map(of).collect::<Vec<_>>());
    let figures = [
        column(|(_, before, _)| before.distance_mm),
        column(|(_, _, after)| after.distance_mm),
        column(|(_, before, _)| before.point_mm.map(|p| p.norm())),
        column(|(_, _, after)| after.point_mm.map(|p| p.norm())),
    ];
    let row = |(k, (_, _, after)): (usize, &Worst)| {
        let pose = &set.poses[after.row];
        let names = [pose.name.clone(), set.groups[pose.group].name.clone()];
        names.into_iter().chain(figures.iter().map(move |column| column[k].clone()))
    };
    let named = if folded { "row" } else { "verify row" };
    let header = [named, "group", "distance before, mm", "after, mm", "point before, mm", "after, mm"];
    html! {
        p { "The worst after identification, predicted minus measured. "
            @if set.groups.len() > 1 { "Where all are of one group, the " (sensor(set.is_of_cameras())) " or its centre moved there. " }
            "Where all are of one region of the workspace, the model lacks something there." }
        (page::table(&header, errors.iter().enumerate().map(row)))
    }
}

/// What reads the points.
fn sensor(by_cameras: bool) -> &'static str {
    if by_cameras { "cameras" } else { "instrument" }
}

pub(super) fn verification_table(record: &Record) -> Markup {
    let before = record.before.judged();
    let named = |m: &MethodRecord| {
        let name = format!("{}/{}", m.name, m.model);
        if name == record.chosen { format!("{name} (kept)") } else { name }
    };
    let methods = record.methods.iter().map(|m| (named(m), m.quality.judged()));
    let robots = std::iter::once(("before".to_owned(), before)).chain(methods);
    let row = |(name, s): (String, &PointSpread)| {
        let better = gain(&before.distance, &s.distance).filter(|_| name != "before").unwrap_or_default();
        let Spread { mean_abs_mm, std_mm, max_abs_mm, min_abs_mm, .. } = s.distance;
        let points = [s.point.and_then(|p| p.mean_abs_mm), s.point.and_then(|p| p.max_abs_mm)];
        let distances = [mean_abs_mm, std_mm, max_abs_mm, min_abs_mm].map(short);
        std::iter::once(name).chain(distances).chain([better]).chain(points.map(short))
    };
    html! {
        p { "Every method and model. Methods that differ by less than their scatter have found the same robot." }
        (page::table(&["distances, mm", "mean", "std", "max", "min", "better by", "point mean", "point max"], robots.map(row)))
    }
}

/// By how much smaller the mean error is.
fn gain(before: &Spread, after: &Spread) -> Option<String> {
    let (before, after) = (before.mean_abs_mm.filter(|mm| *mm > 0.0)?, after.mean_abs_mm?);
    Some(format!("{:.1} %", 100.0 * (1.0 - after / before)))
}

pub(super) fn expected_table(expected: &Expected) -> Markup {
    let row = |what: &str, mm: f64| [what.to_owned(), two_digits(mm)];
    html! {
        p { "The position error to expect of the identified robot at poses like these, after one rigid fit to each placement, from the \
             covariance of the parameters and what is left of the residuals. It holds within " (expected.poses)
            "; beyond, the corrections hold only as far as the model is right." }
        (page::table(&["error to expect", "mm"], [
            row("mean", expected.mean_mm),
            row("95 of 100 errors are below", expected.p95_mm),
            row("mean at the worst pose", expected.max_mm),
            row("of the mean: parameters and placement", expected.of_robot_mm),
            row("of the mean: scatter of the rows", expected.scatter_mm),
        ]))
    }
}

/// State of a parameter that acts like others.
const PART: &str = "part of a sum";

pub(super) fn parameter_table(record: &Record) -> Markup {
    let Some(method) = record.chosen_method() else { return html! {} };
    let seen = &record.identifiability;
    let in_sum = |name: &str| seen.dependent.iter().any(|sum| sum.split_whitespace().any(|word| word == name));
    let row = |p: &ParameterRecord| {
        let state = match (p.identifiable, p.at_bound) {
            (true, true) => "at the search limit",
            (true, false) if seen.weak.contains(&p.name) => "from the tolerance alone",
            _ if p.delta != 0.0 && in_sum(&p.name) => PART,
            (false, _) => "stays nominal",
            (true, false) => "",
        };
        // How sure the sum is says nothing of its parts, which the tolerance splits.
        let [delta, sigma] = match p.sigma.filter(|_| state != PART) {
            Some(sigma) => with_sigma(p.delta, sigma),
            None => [number(Some(p.delta), 4), "n/a".to_owned()],
        };
        [p.name.clone(), p.unit.to_owned(), number(Some(p.nominal), 4), delta, sigma, state.to_owned()]
    };
    page::table(&["parameter", "unit", "nominal", "correction", "sigma", ""], method.parameters.iter().map(row))
}

pub(super) fn rank_table(record: &Record) -> Markup {
    let i = &record.identifiability;
    let list = |names: &[String]| if names.is_empty() { "none".to_owned() } else { names.join("; ") };
    let mut rows = vec![
        ("rank", format!("{} of {}", i.rank, i.parameters)),
        ("not determined", list(&i.zero)),
        ("determined as sums", list(&i.dependent)),
        ("hardly determined", list(&i.weak)),
        ("condition", number(i.condition, 1)),
    ];
    if let Some(o) = &i.observability {
        let indices = [("O1", o.o1), ("O2", o.o2), ("O3", o.o3), ("O4", o.o4), ("O5", o.o5)];
        rows.extend(indices.map(|(name, value)| (name, format!("{value:.3e}"))));
    }
    html! {
        p { "Observability indices O1 to O5 of the base parameters (Sun and Hollerbach, 2008), mm a mm or mrad: larger is better; a condition in the thousands asks for poses with more varied orientation." }
        (page::table(&["", ""], rows.into_iter().map(|(name, value)| [name.to_owned(), value])))
    }
}

/// Table 2: what every joint's row of Table 1 has become. Empty cells stay nominal.
pub(super) fn joint_table(record: &Record) -> Markup {
    let Some(method) = record.chosen_method() else { return html! {} };
    let find = |name: String| method.parameters.iter().find(|p| p.name == name);
    let cell = |name: String| match find(name) {
        Some(p) if p.delta.abs() >= 0.00005 => format!("{:.4} {:+.4}", p.nominal, p.delta),
        Some(p) => format!("{:.4}", p.nominal),
        None => String::new(),
    };
    let rows = (1..).map_while(|j| {
        find(format!("theta_{j}"))?;
        let link = j - 1;
        let cells = [format!("alpha_{link}"), format!("a_{link}"), format!("theta_{j}"), format!("d_{j}")].map(&cell);
        Some(std::iter::once(j.to_string()).chain(cells))
    });
    page::table(&["j", "alpha, deg", "a, mm", "theta, deg", "d, mm"], rows)
}

pub(super) fn judged_table(record: &Record) -> Markup {
    let row = |j: &crate::identify::run::Judged| {
        let mark = if j.terms == record.terms { " (kept)" } else { "" };
        [j.model.to_owned(), format!("{}{mark}", j.terms), short(j.held_out_mm)]
    };
    if record.judged.is_empty() {
        return html! { p { "Model, terms and method were given." } };
    }
    html! {
        p { "Root mean square error on samples that were held out of the fit, mm. More terms are taken only where this falls and the data make them much more probable than what they are added to. The methods all solve the same problem: the cheapest of those that end at the least cost is kept." }
        (page::table(&["model", "terms", "held-out error, mm"], record.judged.iter().map(row)))
    }
}
