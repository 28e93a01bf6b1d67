//! `report.html`: rig, measurements and robot of one day on a page that a quality department can sign.
//!
//! It repeats what the commands wrote and computes nothing. Figures stand beside the terms of VDI/VDE 2634 part 1 and
//! ISO 9283, and it is said what a test by those standards asks for beyond them.

use maud::{Markup, html};
use serde_json::Value;

use super::page::{self, Tone};
use super::table::{number, short};
use crate::diagnostic::{at_most, summed};
use crate::files::OutDir;

/// What the commands wrote, as far as it is there.
#[derive(Debug, Clone, PartialEq)]
pub struct Day {
    /// `camera-check.json`.
    pub check: Option<Value>,
    /// `measure.json`.
    pub measured: Option<Value>,
    /// `identification.json`.
    pub robot: Option<Value>,
    /// Where these were not made of each other.
    pub breaks: Vec<String>,
}

impl Day {
    /// True where nothing stands against the results: the rig's verdict is a pass, each was made of the one before it,
    /// and the robot may be used.
    pub fn is_good(&self) -> bool {
        self.breaks.is_empty()
            && self.check.as_ref().is_none_or(|check| text(check, "/verdict") == "pass")
            && !matches!(self.advice(), "check" | "do-not-use")
    }

    /// What `identify` said of the robot that it found.
    fn advice(&self) -> &str {
        self.robot.as_ref().map_or("", |robot| text(robot, "/advice"))
    }

    /// The robot's advice beside the rig's verdict, where there is a robot.
    fn advised(&self) -> &'static str {
        match self.advice() {
            "use" => "; robot: use it",
            "check" => "; robot: check before use",
            "keep-nominal" => "; robot: keep the nominal one",
            "do-not-use" => "; robot: do not use it",
            _ => "",
        }
    }
}

fn text<'a>(value: &'a Value, pointer: &str) -> &'a str {
    value.pointer(pointer).and_then(Value::as_str).unwrap_or("n/a")
}

/// Figures of verify rows are those without the ones that fit far worse than the rest, where `identify` judges by
/// these.
fn figure<'a>(value: &'a Value, pointer: &str) -> Option<&'a Value> {
    let judged = pointer.replacen("/verify/", "/verify_without_strays/", 1);
    value.pointer(&judged).or_else(|| value.pointer(pointer))
}

/// A number as it stands there.
fn raw(value: &Value, pointer: &str) -> Option<f64> {
    value.pointer(pointer).and_then(Value::as_f64)
}

fn mm(value: &Value, pointer: &str) -> String {
    short(figure(value, pointer).and_then(Value::as_f64))
}

/// A length that is no error, mm.
fn length(value: &Value, pointer: &str) -> String {
    number(raw(value, pointer), 3)
}

fn px(value: &Value, pointer: &str) -> String {
    number(raw(value, pointer), 4)
}

fn count(value: &Value, pointer: &str) -> String {
    figure(value, pointer).and_then(Value::as_u64).map_or_else(|| "n/a".to_owned(), |n| n.to_string())
}

fn warnings(value: &Value) -> Vec<String> {
    let list = value.get("warnings").and_then(Value::as_array);
    list.into_iter().flatten().filter_map(|w| w.as_str().map(str::to_owned)).collect()
}

/// The method of `identification.json` that was kept.
fn chosen(robot: &Value) -> Option<&Value> {
    let wanted = text(robot, "/chosen");
    let methods = robot.get("methods")?.as_array()?;
    methods.iter().find(|m| format!("{}/{}", text(m, "/name"), text(m, "/model")) == wanted)
}

/// The mean error on verify rows that the page of `identify` shows first, and where its numbers have it: of points where
/// there are any, else of distances.
fn mean_error(robot: &Value) -> (&'static str, &'static str) {
    const OF_POINTS: &str = "/verify/point/mean_abs_mm";
    match chosen(robot).and_then(|method| method.pointer(OF_POINTS)).is_some_and(Value::is_number) {
        true => ("mean position error", OF_POINTS),
        false => ("mean distance error", "/verify/mean_abs_mm"),
    }
}

/// This error of the robot that was kept, mm.
fn after(robot: &Value) -> String {
    chosen(robot).map_or_else(|| "n/a".to_owned(), |method| mm(method, mean_error(robot).1))
}

/// The lines on stdout.
pub fn summary(day: &Day, out: &OutDir) -> String {
    let line = |part: &Option<Value>, say: &dyn Fn(&Value) -> String| part.as_ref().map_or("not done".to_owned(), say);
    format!(
        "rig: {}\nmeasurements: {}\nrobot: {}\nreport: {}\n",
        line(&day.check, &rig_words),
        line(&day.measured, &measured_words),
        line(&day.robot, &robot_words),
        out.join("report.html"),
    )
}

fn rig_words(check: &Value) -> String {
    format!("{}, {}", text(check, "/verdict").to_uppercase(), length_words(check))
}

fn length_words(check: &Value) -> String {
    let [error, uncertainty, sum] = judged(check);
    format!(
        "error {error} mm + expanded uncertainty {uncertainty} mm = {sum} mm of the length where that is most, tolerance {} mm",
        limit(check)
    )
}

/// Error and expanded uncertainty of the length that the verdict looks at, and their sum, mm.
fn judged(check: &Value) -> [String; 3] {
    let of = |pointer: &str| raw(check, pointer).unwrap_or(f64::NAN);
    summed(of("/judged_length/error_mm"), of("/judged_length/uncertainty_mm"))
}

/// The tolerance as it was given, mm.
fn limit(check: &Value) -> String {
    check.pointer("/tolerance_mm").map_or_else(|| "n/a".to_owned(), Value::to_string)
}

/// A bound on lengths, mm, which is rounded up.
fn bound(check: &Value, pointer: &str) -> String {
    let of = |pointer: &str| raw(check, pointer).unwrap_or(f64::NAN);
    at_most(of(pointer), of("/tolerance_mm"))
}

/// Which of the checks says to what lengths can be trusted: the largest of those in mm.
fn trusted_by(check: &Value) -> String {
    let trusted = raw(check, "/trusted_mm");
    let lines = check.get("evidence").and_then(Value::as_array);
    let of = |line: &Value| raw(line, "/value").filter(|_| text(line, "/unit") == "mm");
    let line = lines.into_iter().flatten().find(|line| trusted.is_some() && of(line) == trusted);
    line.map_or_else(String::new, |line| format!(" (the largest of all checks in mm: {})", text(line, "/what")))
}

fn measured_words(measured: &Value) -> String {
    format!("{} of {} poses measured", count(measured, "/measured"), count(measured, "/poses"))
}

fn robot_words(robot: &Value) -> String {
    if text(robot, "/advice") == "do-not-use" {
        return format!("do not use the identified robot: {}", text(robot, "/reason"));
    }
    let doubts = || format!("; check before you use the identified robot: {}", text(robot, "/reason"));
    let doubt = if text(robot, "/advice") == "check" { doubts() } else { String::new() };
    let (what, at) = mean_error(robot);
    let before = mm(robot, &format!("/before{at}"));
    format!("{what} {before} mm before, {} mm after{doubt}", after(robot))
}

/// The number that matters most of each part that is there.
fn numbers(day: &Day) -> Vec<(String, String)> {
    let length = |check: &Value| format!("{} mm", bound(check, "/judged_length/at_most_mm"));
    let poses = |measured: &Value| format!("{} of {}", count(measured, "/measured"), count(measured, "/poses"));
    let parts = [
        day.check
            .as_ref()
            .map(|check| (length(check), "largest length error of the rig with its uncertainty".to_owned())),
        day.measured.as_ref().map(|measured| (poses(measured), "poses measured".to_owned())),
        day.robot.as_ref().map(|robot| {
            (format!("{} mm", after(robot)), format!("{} of the robot after identification", mean_error(robot).0))
        }),
    ];
    parts.into_iter().flatten().collect()
}

pub fn page(day: &Day) -> String {
    let tone = match (day.is_good(), &day.check) {
        (true, Some(_)) => Tone::Good,
        _ if day.advice() == "do-not-use" => Tone::Bad,
        _ if day.check.as_ref().is_some_and(|check| text(check, "/verdict") == "fail") => Tone::Bad,
        _ => Tone::Doubtful,
    };
    let headline = match &day.check {
        _ if !day.breaks.is_empty() => "The parts do not belong together".to_owned(),
        _ if day.advice() == "do-not-use" => "Do not use the identified robot".to_owned(),
        Some(check) if day.advice() == "check" && text(check, "/verdict") == "pass" => {
            "Check the identified robot before use".to_owned()
        }
        Some(check) => format!("Rig: {}{}", text(check, "/verdict").to_uppercase(), day.advised()),
        None => format!("Without a camera check{}", day.advised()),
    };
    let words = [day.check.as_ref().map(length_words), day.measured.as_ref().map(measured_words)];
    let words = words.into_iter().chain([day.robot.as_ref().map(robot_words)]);
    let words: Vec<String> = words.flatten().collect();
    let content = html! {
        (page::verdict(tone, &headline, &numbers(day), &format!("{}.", words.join("; "))))
        (page::warnings(&day.breaks))
        h2 { "1. The stereo rig" }
        @match &day.check { Some(check) => (rig(check)), None => p { "Not done: there is no camera-check.json." } }
        h2 { "2. The measurements" }
        @match &day.measured { Some(measured) => (measurements(measured)), None => p { "Not done: there is no measure.json." } }
        h2 { "3. The robot" }
        @match &day.robot { Some(robot) => (arm(robot)), None => p { "Not done: there is no identification.json." } }
        h2 { "Signatures" }
        (page::table(&["", "name", "date", "signature"], ["measured by", "checked by", "released by"].map(|who| {
            [who.to_owned(), "\u{2003}".repeat(10), "\u{2003}".repeat(6), "\u{2003}".repeat(12)]
        })))
    };
    page::page("Calibration report", "Stereo rig, measurements and robot", &content)
}

fn rig(check: &Value) -> Markup {
    let ranges = check.get("ranges").and_then(Value::as_array);
    let lengths: u64 = ranges.into_iter().flatten().filter_map(|r| r.get("count")?.as_u64()).sum();
    let nominal = ranges.into_iter().flatten().filter_map(|r| r.get("nominal_mm")?.as_f64());
    let (least, most) = nominal.fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
    let [error, uncertainty, sum] = judged(check);
    let up_to = raw(check, "/trusted_length_mm").map_or_else(String::new, |mm| format!(" of up to {mm:.0} mm"));
    let trusted = format!("lengths{up_to} can be trusted to{}", trusted_by(check));
    let rows = [
        ("length measurement error E of the length where E + U is largest", error, "mm"),
        ("its expanded uncertainty U (95 %)", uncertainty, "mm"),
        ("E + U", sum, "mm"),
        ("limit of E + U (tolerance)", limit(check), "mm"),
        ("largest E of any length", mm(check, "/max_abs_error_mm"), "mm"),
        ("95 % of lengths have an E below", mm(check, "/within_95_mm"), "mm"),
        (trusted.as_str(), bound(check, "/trusted_mm"), "mm"),
        ("reprojection residual, RMS", px(check, "/reprojection_rms_px"), "px"),
        ("epipolar error, RMS", px(check, "/epipolar/rms_px"), "px"),
        ("baseline", length(check, "/baseline_mm"), "mm"),
        ("pairs used", count(check, "/pairs_used"), ""),
    ];
    let second = check.get("second_board").is_some_and(|board| !board.is_null());
    html! {
        (quantities(rows))
        p { (format!(
            "E is the absolute deviation of a length on the board, here of {lengths} lengths of {} to {} mm between its corners, on pairs that did not help to calibrate the \
             cameras that measured them. U is that of the calibration and of the board; what the corners at both ends scatter by is part of E. The verdict keeps U as \
             a guard band, as ISO 14253-1 asks: a pass needs E + U of every length within the limit, and the other checks in camera-check.html passed.",
            number(Some(least).filter(|v| v.is_finite()), 1), number(Some(most), 1))) }
        p {
            "A test by VDI/VDE 2634 part 1 takes lengths of an artefact calibrated by others, on at least seven lines through the measuring volume. "
            @if second { "Here a second board was measured that took no part in the calibration; see camera-check.html." }
            @else { "Here the lengths are those of the calibrating board itself: an error of its pitch does not show. A second board (--check-images) shows it." }
        }
        (page::warnings(&warnings(check)))
    }
}

fn measurements(measured: &Value) -> Markup {
    let rows = [
        ("poses measured", count(measured, "/measured"), ""),
        ("poses", count(measured, "/poses"), ""),
        ("board fit, RMS", mm(measured, "/fit_rms_mm"), "mm"),
        ("standard deviation of the mark point, x", mm(measured, "/sigma_mm/0"), "mm"),
        ("y", mm(measured, "/sigma_mm/1"), "mm"),
        ("z", mm(measured, "/sigma_mm/2"), "mm"),
    ];
    html! {
        (quantities(rows))
        p { "Compared with its calibration, the rig " (match text(measured, "/rig/state") { "agrees" => "agrees".to_owned(), other => format!("does not simply agree ({other})") }) "." }
        (page::warnings(&warnings(measured)))
    }
}

fn arm(robot: &Value) -> Markup {
    let none = Value::Null;
    let (before, after) = (robot.pointer("/before").unwrap_or(&none), chosen(robot).unwrap_or(&none));
    let row = |term: &str, pointer: &str| [term.to_owned(), mm(before, pointer), mm(after, pointer)];
    let rows = [
        row("distance accuracy (AD): mean |error|, mm", "/verify/mean_abs_mm"),
        row("distance accuracy: largest |error|, mm", "/verify/max_abs_mm"),
        row("distance accuracy: standard deviation, mm", "/verify/std_mm"),
        row("positioning accuracy (AP): mean error, mm", "/verify/point/mean_abs_mm"),
        row("positioning accuracy: largest error, mm", "/verify/point/max_abs_mm"),
    ];
    let (on, poses) = match robot.get("folded").and_then(Value::as_bool) {
        Some(true) => ("on poses that were left out of a fit", "poses, each judged by fits without it"),
        _ => ("on verify poses, which took no part in the fit", "verify poses"),
    };
    html! {
        (page::table(&[on, "before", "after"], rows))
        p { (format!(
            "{} {poses}; {} kept; {} of {} parameters determined. To expect at other poses of the same range: {} mm on average, {} mm at 95 %.",
            count(after, "/verify/count"), text(robot, "/chosen"), count(robot, "/identifiability/rank"),
            count(robot, "/identifiability/parameters"), mm(robot, "/expected/mean_mm"), mm(robot, "/expected/p95_mm"))) }
        p {
            "The terms are those of ISO 9283; a test by it visits each of five poses thirty times at rated load and speed and reports pose repeatability (RP) as well. Here each \
             pose was visited once: repeatability is part of the errors above and was not separated. Positions are compared after a rigid fit of each placement."
        }
        (page::warnings(&warnings(robot)))
    }
}

fn quantities<const N: usize>(rows: [(&str, String, &str); N]) -> Markup {
    let cells = rows.map(|(what, value, unit)| [what.to_owned(), value, unit.to_owned()]);
    page::table(&["quantity", "value", "unit"], cells)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn day(verdict: &str) -> Day {
        let check = json!({"verdict": verdict, "max_abs_error_mm": 0.0123, "tolerance_mm": 0.05, "second_board": null,
            "judged_length": {"error_mm": 0.0118, "uncertainty_mm": 0.00213, "at_most_mm": 0.01393},
            "trusted_mm": 0.0214, "trusted_length_mm": 70.0, "evidence": [
                {"what": "held-out lengths", "value": 0.01393, "unit": "mm"}, {"what": "spread", "value": 0.0214, "unit": "px"},
                {"what": "any length", "value": 0.0214, "unit": "mm"}],
            "ranges": [{"nominal_mm": 10.0, "count": 7}, {"nominal_mm": 70.0, "count": 5}]});
        let verify = |mm: f64| json!({"verify": {"count": 16, "mean_abs_mm": mm}});
        let mut kept = verify(0.0456);
        kept["name"] = "stapso".into();
        kept["model"] = "position".into();
        let robot = json!({"chosen": "stapso/position", "before": verify(1.5), "methods": [verify(9.0), kept]});
        Day { check: Some(check), measured: None, robot: Some(robot), breaks: Vec::new() }
    }

    #[test]
    fn figures_of_the_method_kept_and_parts_not_done() {
        let page = page(&day("pass"));
        for part in ["PASS", "12 lengths of 10.0 to 70.0 mm", "1.5", "0.046", "there is no measure.json", "n/a"] {
            assert!(page.contains(part), "{part}");
        }
        assert!(!page.contains(">9.0<"));
    }

    #[test]
    fn the_error_and_its_uncertainty_add_up_to_what_is_judged() {
        let page = page(&day("pass"));
        let shown = |what: &str, value: &str| {
            assert!(page.contains(&format!("<td>{what}</td><td>{value}</td>")), "{what}: {value}: {page}");
        };
        shown("length measurement error E of the length where E + U is largest", "0.0118");
        shown("its expanded uncertainty U (95 %)", "0.0022");
        shown("E + U", "0.0140");
        shown("limit of E + U (tolerance)", "0.05");
        shown("largest E of any length", "0.012");
        shown("lengths of up to 70 mm can be trusted to (the largest of all checks in mm: any length)", "0.0214");
        assert!(summary_line(&day("pass")).contains("error 0.0118 mm + expanded uncertainty 0.0022 mm = 0.0140 mm"));
    }

    fn summary_line(day: &Day) -> String {
        rig_words(day.check.as_ref().unwrap())
    }

    #[test]
    fn nothing_is_good_without_a_pass_or_with_parts_of_another_day() {
        assert!(day("pass").is_good());
        let mut advised = day("pass");
        advised.robot.as_mut().unwrap()["advice"] = "use".into();
        assert!(page(&advised).contains("Rig: PASS; robot: use it"));
        assert!(page(&Day { robot: None, ..day("pass") }).contains("Rig: PASS<"));
        assert!(!day("undecided").is_good());
        let broken = Day { breaks: vec!["measure.json was made with another rig".to_owned()], ..day("pass") };
        assert!(!broken.is_good());
        assert!(page(&broken).contains("do not belong together"));
    }
}
