//! What `identify` and `verify` print: whether to use the robot, what it was before and is now, which method was kept.

use crate::files::OutDir;
use crate::identify::judge::errors::Spread;
use crate::identify::record::{Advice, PointSpread, Record};
use crate::report::table::{Table, number};

/// What goes to stdout: whether to use the result, before, after, what to expect; then how it was found.
pub fn summary(record: &Record, out: &OutDir) -> String {
    let errors = |spread| errors(spread, |mm| number(Some(mm), 4));
    let before = &record.before.verify;
    let after = record.chosen_method().map(|m| &m.verify);
    let mut lines = vec![advice(record), format!("before: {}", errors(before))];
    if record.advice != Advice::KeepNominal {
        lines.push(format!("after: {}; {}", after.map_or_else(|| "n/a".to_owned(), errors), judged_on(record)));
    }
    if let Some(expected) = &record.expected {
        lines.push(expected.sentence());
    }
    lines.push(String::new());
    lines.push(kept(record));
    lines.extend(others(record).or(record.not_run.clone()));
    lines.extend(sure(record));
    if let Some(([x, y, z], left)) = record.tool_mm {
        lines.push(format!(
            "with a tool of {x:.1}, {y:.1}, {z:.1} mm instead of the file's the nominal robot is off by {left:.3} mm (median); `before` has the tool of the file"
        ));
    }
    lines.extend(record.repeats.as_ref().map(|repeats| repeats.sentence()));
    lines.extend(record.targets.as_ref().map(|targets| targets.sentence()));
    lines.extend(record.scale.filter(|scale| !scale.is_significant()).map(|scale| scale.sentence()));
    lines.push(format!("all methods and warnings: {}", out.join("identify.html")));
    lines.join("\n") + "\n"
}

/// Whether to use the robot, and why not.
pub(super) fn advice(record: &Record) -> String {
    let file = "the identified robot";
    match record.advice {
        Advice::Use => format!("use {file}"),
        Advice::Check => format!("check before you use {file}: {}", record.whole_reason()),
        Advice::KeepNominal => record.whole_reason().to_owned(),
        Advice::DoNotUse => format!("do not use {file}: {}", record.whole_reason()),
    }
}

/// Errors of a robot in a line; `mm` writes a length.
pub(super) fn errors(spread: &PointSpread, mm: fn(f64) -> String) -> String {
    let mm = |length: Option<f64>| length.map_or_else(|| "n/a".to_owned(), mm);
    let figures = |what: &str, s: &Spread| {
        (s.count > 0)
            .then(|| format!("{what} off by {} mm on average, {} at most", mm(s.mean_abs_mm), mm(s.max_abs_mm)))
    };
    let kinds = [
        figures("distances", &spread.distance),
        spread.point.as_ref().and_then(|s| figures("positions", s)),
        spread.consistency.as_ref().and_then(|s| figures("touches", s)),
        spread.distortion.as_ref().and_then(|s| figures("known distances", s)),
    ];
    let kinds: Vec<String> = kinds.into_iter().flatten().collect();
    if kinds.is_empty() { "n/a".to_owned() } else { kinds.join("; ") }
}

/// The rows that both figures are of.
pub(super) fn judged_on(record: &Record) -> String {
    let count = record.before.verify.distance.count.max(record.before.verify.point.map_or(0, |p| p.count));
    match record.folded {
        true => format!("{count} rows, each in a fit without it"),
        false => format!("{count} rows that took no part in the fit"),
    }
}

/// The method and the terms that were kept.
fn kept(record: &Record) -> String {
    let i = &record.identifiability;
    format!(
        "kept: {}, {}; {} of {} parameters determined, condition {}",
        record.chosen,
        record.terms,
        i.rank,
        i.parameters,
        number(i.condition, 0)
    )
}

/// The best and the worst of the other methods.
fn others(record: &Record) -> Option<String> {
    let of = |m: &crate::identify::record::MethodRecord| {
        let spread = m.verify.point.as_ref().filter(|p| p.count > 0).unwrap_or(&m.verify.distance);
        Some((spread.mean_abs_mm?, format!("{}/{}", m.name, m.model)))
    };
    let mut others: Vec<(f64, String)> =
        record.methods.iter().filter_map(of).filter(|(_, n)| *n != record.chosen).collect();
    others.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (best, worst) = (others.first()?, others.last()?);
    let words = |(mm, name): &(f64, String)| format!("{mm:.4} mm ({name})");
    Some(match others.len() {
        1 => format!("the other method: {} on average", words(best)),
        count => format!("{count} other methods: {} to {} on average", words(best), words(worst)),
    })
}

/// How sure the choice of terms is.
fn sure(record: &Record) -> Option<String> {
    let all: Vec<String> = record.certainty.iter().map(|c| format!("{} in {} of {}", c.than, c.better, c.of)).collect();
    (!all.is_empty()).then(|| {
        format!("splits of the samples in which {} has less held-out error: than {}", record.terms, all.join(", than "))
    })
}

/// Table 3 of the paper for robots from anywhere; `folded` where the file has no verify rows.
pub fn verified(robots: &[(&str, &PointSpread)], folded: bool) -> String {
    let rows = if folded { "rows, mm" } else { "verify rows, mm" };
    let mut table = Table::new([rows, "mean", "std", "max", "min", "point mean", "point max"]);
    for (name, spread) in robots {
        let Spread { mean_abs_mm, std_mm, max_abs_mm, min_abs_mm, .. } = spread.distance;
        let points = spread.point.or(spread.distortion);
        let of_points = [points.and_then(|p| p.mean_abs_mm), points.and_then(|p| p.max_abs_mm)];
        let figures = [mean_abs_mm, std_mm, max_abs_mm, min_abs_mm].into_iter().chain(of_points);
        table.row(std::iter::once((*name).to_owned()).chain(figures.map(|figure| number(figure, 4))));
    }
    table.to_string()
}
