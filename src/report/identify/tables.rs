//! The tables of `identify.html`.

use maud::{Markup, html};

use super::screen::distance_row;
use crate::identify::data::dataset::Dataset;
use crate::identify::judge::errors::{RowError, Spread};
use crate::identify::judge::uncertainty::Expected;
use crate::identify::record::{ParameterRecord, PointSpread, Record};
use crate::report::page;
use crate::report::table::number;

/// Verify rows in the table of the worst.
const WORST: usize = 10;

/// The verify rows with the largest errors after identification.
pub(super) fn worst_table(set: &Dataset, before: &[RowError], after: &[RowError]) -> Markup {
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

pub(super) fn verification_table(record: &Record) -> Markup {
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

pub(super) fn expected_table(expected: &Expected) -> Markup {
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

pub(super) fn parameter_table(record: &Record) -> Markup {
    let Some(method) = record.chosen_method() else { return html! {} };
    let seen = &record.identifiability;
    let in_sum = |name: &str| seen.dependent.iter().any(|sum| sum.split_whitespace().any(|word| word == name));
    let row = |p: &ParameterRecord| {
        let state = match (p.identifiable, p.at_bound) {
            (true, true) => "at the search limit",
            (true, false) if seen.weak.contains(&p.name) => "from the tolerance alone",
            _ if p.delta != 0.0 && in_sum(&p.name) => "part of a sum",
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

pub(super) fn rank_table(record: &Record) -> Markup {
    let i = &record.identifiability;
    let list = |names: &[String]| if names.is_empty() { "none".to_owned() } else { names.join("; ") };
    let mut rows = vec![
        vec!["rank".to_owned(), format!("{} of {}", i.rank, i.parameters)],
        vec!["not determined".to_owned(), list(&i.zero)],
        vec!["determined as sums".to_owned(), list(&i.dependent)],
        vec!["hardly determined".to_owned(), list(&i.weak)],
        vec!["condition".to_owned(), number(i.condition, 1)],
    ];
    if let Some(o) = &i.observability {
        for (name, value) in [("O1", o.o1), ("O2", o.o2), ("O3", o.o3), ("O4", o.o4), ("O5", o.o5)] {
            rows.push(vec![name.to_owned(), format!("{value:.3e}")]);
        }
    }
    html! {
        p { "Observability indices O1 to O5 of the base parameters (Sun and Hollerbach, 2008), mm a mm or mrad: larger is better; a condition in the thousands asks for poses with more varied orientation." }
        (page::table(&["", ""], &rows))
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

pub(super) fn judged_table(record: &Record) -> Markup {
    let row = |j: &crate::identify::run::Judged| {
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
