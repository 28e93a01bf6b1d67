//! What `identify` and `verify` print: whether to use the robot, what it was before and is now, which method was kept.

use camino::Utf8Path;

use crate::diagnostic::count as counted;
use crate::files::OutDir;
use crate::formats::placements::record::PLACEMENT;
use crate::identify::judge::errors::Spread;
use crate::identify::judge::uncertainty::Expected;
use crate::identify::record::{Advice, PointSpread, Record};
use crate::report::table::{Table, number};
use crate::robot::Robot;
use crate::robot::catalogue::PAPER;
use crate::robot::file::IDENTIFIED_FILE as IDENTIFIED;

/// What goes to stdout: whether to use the result, before, after, what to expect, and what to do with it; how it was
/// found, and what was written. `robot` is the file of the nominal robot, which comes before the identified one.
pub fn summary(
    record: &Record,
    (robot, identified): (Option<&Utf8Path>, &Robot),
    is_placed: bool,
    out: &OutDir,
) -> String {
    let errors = |spread| errors(spread, |mm| number(Some(mm), 4));
    let before = record.before.judged();
    let after = record.chosen_method().map(|m| m.quality.judged());
    let mut lines = vec![advice(record), format!("before: {}", errors(before))];
    lines.extend(of_tool(record));
    if is_corrected(record) {
        lines.push(format!("after: {}; {}", after.map_or_else(|| "n/a".to_owned(), errors), judged_on(record)));
    }
    if let Some(expected) = &record.expected {
        lines.push(expected.sentence());
        lines.push(expected.parts());
        lines.extend(known_near(expected));
    }
    let (file, page) = (out.join(IDENTIFIED), out.join("identify.html"));
    let of_links = identified.corrections.is_empty();
    lines.push(format!("next: {}", next(record, robot, (file.as_str(), of_links))));
    lines.push(String::new());
    lines.push(kept(record));
    lines.extend(others(record));
    lines.extend(record.not_run.clone());
    lines.extend(sure(record));
    lines.extend(record.repeats.as_ref().map(|repeats| repeats.sentence()));
    lines.extend(record.targets.as_ref().map(|targets| targets.sentence()));
    lines.extend(of_scale(record));
    let placement = if is_placed { format!(", {}", out.join(PLACEMENT)) } else { String::new() };
    lines.push(format!("written: {file}{placement}; all methods and warnings: {page}"));
    lines.join("\n") + "\n"
}

/// Whether a robot other than the nominal one was kept.
pub(super) fn is_corrected(record: &Record) -> bool {
    !record.chosen.starts_with("nominal/")
}

/// Whether to use the robot, and why not.
pub(super) fn advice(record: &Record) -> String {
    let file = "the identified robot";
    match record.advice {
        Advice::Use if record.is_near_only() => format!("use {file} near these poses only"),
        Advice::Use => format!("use {file}"),
        Advice::Check => format!("check before you use {file}: {}", record.whole_reason()),
        Advice::KeepNominal => record.whole_reason().to_owned(),
        Advice::DoNotUse => format!("do not use {file}: {}", record.whole_reason()),
    }
}

/// What to do with the robot that was found in `file`, which may be one of links alone. Without a file of the nominal
/// robot it is that of the paper, of which a command writes one.
fn next(record: &Record, robot: Option<&Utf8Path>, (file, of_links): (&str, bool)) -> String {
    if let [(name, _), ..] = record.of_catalogue[..] {
        return format!(
            "the arm of the catalogue that the points are near is {}, its tool and the sensor solved: `stereocal robot new {name}`, and identify again \
             with that file, if it is the arm",
            arms(&record.of_catalogue)
        );
    }
    let Some(robot) = robot else {
        let named = "`--robot FILE` names the robot that was measured (`stereocal robot list` has arms by name)";
        return match record.advice {
            Advice::DoNotUse => format!("{named}: identify again with it"),
            _ => format!(
                "{named}; if it is that of Table 1 of the paper, `stereocal robot new {PAPER} --out .` writes its file"
            ),
        };
    };
    match record.advice {
        Advice::Use => format!(
            "`stereocal compensate TARGETS --robot {robot} --identified {file}`, or {}",
            match of_links {
                true => format!("`stereocal export robot --robot {file} --format urdf`"),
                false => "`identify --extensions none` first for a URDF, which holds links alone".to_owned(),
            }
        ),
        Advice::Check => format!(
            "look at what is named above; ten new poses say whether it holds: `stereocal verify --measurements NEW.csv --robot {robot} --robot {file}`"
        ),
        Advice::KeepNominal if record.is_computed => format!(
            "measure with an instrument where the robot of {robot} is, and identify by these points; where a table has deviations beside the commanded \
             points, a measured point is their sum"
        ),
        Advice::KeepNominal => {
            format!("go on with {robot}; more rows, that bend every joint, may show more (`stereocal guide poses`)")
        }
        Advice::DoNotUse => format!(
            "mend what is named here, and identify again: `stereocal guide warnings`; `stereocal robot show {robot}` to compare it with the \
             pendant, `stereocal robot list` for other arms"
        ),
    }
}

/// Arms of the catalogue with what they leave.
fn arms(list: &[(&str, f64)]) -> String {
    let said: Vec<String> = list.iter().map(|(name, mm)| format!("{name} ({mm:.2} mm off in the middle)")).collect();
    said.join(" or ")
}

/// How large a scale of the readings may hide; of a result that is not to be used there is nothing that it could be
/// hidden in.
pub(super) fn of_scale(record: &Record) -> Option<String> {
    let scale = record.scale.filter(|scale| !scale.is_significant() && record.advice != Advice::DoNotUse)?;
    Some(scale.sentence())
}

/// The tool that the nominal robot asks for, where it is far from the file's.
pub(super) fn of_tool(record: &Record) -> Option<String> {
    let ([x, y, z], left) = record.tool_mm?;
    Some(format!(
        "with a tool of {x:.1}, {y:.1}, {z:.1} mm instead of the file's the nominal robot is off by {left:.3} mm (median); `before` has the tool of the file"
    ))
}

/// Where the robot is known.
fn known_near(expected: &Expected) -> Option<String> {
    (!expected.near_only.is_empty()).then(|| {
        format!(
            "known near these poses only ({}): targets elsewhere need poses there (`stereocal guide poses`)",
            expected.near_only.join(", ")
        )
    })
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
    let before = record.before.judged();
    let count = before.distance.count.max(before.point.map_or(0, |p| p.count));
    let (rows, without) = (counted(count, "row"), record.strays.join(", "));
    match (record.folded, record.strays.is_empty()) {
        (true, _) => format!("{rows}, each in a fit without it"),
        (false, true) => format!("{rows} that took no part in the fit"),
        (false, false) => format!("{rows} that took no part in the fit, without {without}"),
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
        let judged = m.quality.judged();
        let spread = judged.point.as_ref().filter(|p| p.count > 0).unwrap_or(&judged.distance);
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
    let any = |of: fn(&PointSpread) -> bool| robots.iter().any(|(_, spread)| of(spread));
    let columns = match () {
        () if any(|s| s.point.is_some()) => {
            "errors of distances from the centre of each group, or from the row nearest to its middle; point: of points, after one rigid \
             fit to each placement"
        }
        () if any(|s| s.distortion.is_some()) => {
            "distances of touches from the middle of their point; point: errors of known distances"
        }
        () if any(|s| s.consistency.is_some()) => "distances of touches from the middle of their point",
        () => "errors of distances",
    };
    format!("{table}mean to min: {columns}\n")
}
