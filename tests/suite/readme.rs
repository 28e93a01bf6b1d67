//! The READMEs: both show the run that the program prints, with the same figures, and stay short.
//!
//! A block of the run holds, behind each command, the first lines of what it prints, and `...` where more follows. With
//! `STEREOCAL_REFRESH=1` the test writes as many lines anew as stand there; to show more or fewer, add or delete some
//! first.

use std::path::{Path, PathBuf};

use crate::run::refreshes;

const FILES: [&str; 2] = ["README.md", "README.zh.md"];
/// All words of README.md, as `wc -w` counts.
const MOST_WORDS: usize = 1200;
/// Sums are rounded otherwise with and without fused multiply-add: the last digit shown may be another one, units of
/// it.
const LAST_DIGIT: f64 = 1.0;

/// What a command printed on stdout.
pub struct Printed {
    /// The command line.
    pub command: String,
    /// All of it.
    pub stdout: String,
}

fn path(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(file)
}

fn text(file: &str) -> String {
    std::fs::read_to_string(path(file)).unwrap_or_else(|e| panic!("{file}: {e}"))
}

/// The block that begins with the first command, without its fences.
fn block(text: &str) -> &str {
    let start = text.find("```\n$ stereocal").expect("a block with the run") + 4;
    &text[start..start + text[start..].find("```").expect("its end")]
}

/// Commands of a block, and how many lines are shown of each.
fn shown(block: &str) -> Vec<(&str, Vec<&str>)> {
    let mut found: Vec<(&str, Vec<&str>)> = Vec::new();
    for line in block.lines() {
        match (line.strip_prefix("$ "), found.last_mut()) {
            (Some(command), _) => found.push((command, Vec::new())),
            (None, Some((_, lines))) => lines.push(line),
            (None, None) => panic!("{line} stands before any command"),
        }
    }
    for (_, lines) in &mut found {
        while lines.last().is_some_and(|line| line.is_empty() || *line == "...") {
            lines.pop();
        }
    }
    found
}

/// A block that shows so many lines of each command.
fn written(run: &[Printed], counts: &[usize]) -> String {
    let of = |(printed, count): (&Printed, &usize)| {
        let lines: Vec<&str> = printed.stdout.trim_end().lines().collect();
        let more = if lines.len() > *count { "...\n" } else { "" };
        let first: String = lines.iter().take(*count).map(|line| format!("{line}\n")).collect();
        format!("$ {}\n{first}{more}", printed.command)
    };
    run.iter().zip(counts).map(of).collect::<Vec<String>>().join("\n")
}

/// A line's words with its numbers taken out, and the numbers with the unit of their last digit.
fn parts(line: &str) -> (String, Vec<(f64, f64)>) {
    let (mut words, mut numbers) = (String::new(), Vec::new());
    let mut rest = line;
    while let Some(at) = rest.find(|c: char| c.is_ascii_digit()) {
        let start = if rest[..at].ends_with('-') { at - 1 } else { at };
        words.push_str(rest[..start].trim_end());
        let length = rest[at..].find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.len() - at);
        let number = rest[start..at + length].trim_end_matches('.');
        let decimals = number.split_once('.').map_or(0, |(_, digits)| digits.len());
        numbers.push((number.parse().unwrap_or(f64::NAN), 10_f64.powi(-(decimals as i32))));
        words.push('#');
        rest = &rest[start + number.len()..];
    }
    (words + rest, numbers)
}

/// Whether a line says the same but for the last digits of numbers with decimals; whole numbers are counts.
fn same(shown: &str, printed: &str) -> bool {
    let ((words, numbers), (now, new)) = (parts(shown), parts(printed));
    let close = |((a, unit), (b, other)): (&(f64, f64), &(f64, f64))| {
        let allowed = if *unit < 1.0 { (LAST_DIGIT + 1e-6) * unit } else { 0.0 };
        unit == other && (a - b).abs() <= allowed
    };
    words == now && numbers.len() == new.len() && numbers.iter().zip(&new).all(close)
}

/// Compares the run with what both files show of it.
pub fn show_this_run(run: &[Printed]) {
    for file in FILES {
        let mut now = text(file);
        let counts: Vec<usize> = shown(block(&now)).iter().map(|(_, lines)| lines.len()).collect();
        if refreshes() {
            now = now.replace(block(&now), &written(run, &counts));
            std::fs::write(path(file), &now).unwrap();
        }
        let found = shown(block(&now));
        let expected = written(run, &counts);
        let refresh = format!("{file} does not show this run; STEREOCAL_REFRESH=1 writes it anew:\n{expected}");
        assert_eq!(found.len(), run.len(), "{refresh}");
        for ((command, lines), (printed, all)) in found.iter().zip(shown(&expected)) {
            assert_eq!(*command, printed, "{refresh}");
            assert!(!lines.is_empty() && lines.len() == all.len(), "{refresh}");
            for (line, is) in lines.iter().zip(all) {
                assert!(same(line, is), "{refresh}\nshown:   {line}\nprinted: {is}");
            }
        }
    }
}

#[test]
fn a_line_may_differ_in_its_last_digit_alone() {
    assert!(same("within 0.0024 mm, 16 of 16", "within 0.0025 mm, 16 of 16"));
    assert!(same("tilted by -27 deg, 99.8 %", "tilted by -27 deg, 99.7 %"));
    for printed in [
        "within 0.0026 mm, 16 of 16",
        "within 0.0024 mm, 15 of 16",
        "within 0.002 mm, 16 of 16",
        "within 0.0024 px, 16 of 16",
    ] {
        assert!(!same("within 0.0024 mm, 16 of 16", printed), "{printed}");
    }
    assert!(!same("largest 0.0060.", "largest 0.0060. And more"));
    assert!(!same("-0.1 to 3", "0.1 to 3"));
}

#[test]
fn a_block_shows_the_first_lines_and_says_where_more_follow() {
    let run = [
        Printed { command: "stereocal a".into(), stdout: "1\n2\n3\n".into() },
        Printed { command: "stereocal b".into(), stdout: "4\n".into() },
    ];
    let block = written(&run, &[2, 1]);
    assert_eq!(block, "$ stereocal a\n1\n2\n...\n\n$ stereocal b\n4\n");
    assert_eq!(shown(&block), [("stereocal a", vec!["1", "2"]), ("stereocal b", vec!["4"])]);
}

/// The commands of scripts/demo, which its function `run` is called with.
#[test]
fn the_demo_runs_what_the_readmes_show() {
    let script = text("scripts/demo");
    let runs: Vec<String> =
        script.lines().filter_map(|line| line.strip_prefix("run ")).map(|line| format!("stereocal {line}")).collect();
    for file in FILES {
        let text = text(file);
        let commands: Vec<&str> = shown(block(&text)).into_iter().map(|(command, _)| command).collect();
        assert_eq!(commands, runs, "{file}");
    }
}

/// Numbers of the sections behind the run. The languages order some sentences otherwise, so that the numbers are
/// compared as a set.
#[test]
fn both_languages_state_the_same_figures() {
    let figures = |file: &str| {
        let text = text(file);
        let behind = &text[text.find(block(&text)).unwrap()..];
        let mut numbers: Vec<String> = behind
            .split(|c: char| !c.is_ascii_digit() && c != '.')
            .map(|number| number.trim_matches('.').to_owned())
            .filter(|number| !number.is_empty())
            .collect();
        numbers.sort();
        (numbers, behind.matches("\n## ").count(), behind.matches("\n| ").count(), behind.matches("\n- ").count())
    };
    assert_eq!(figures("README.md"), figures("README.zh.md"));
}

#[test]
fn the_readme_is_short_and_its_links_lead_somewhere() {
    let words = text("README.md").split_whitespace().count();
    assert!(words <= MOST_WORDS, "README.md has {words} words");
    for file in FILES.into_iter().chain(["CONTRIBUTING.md", "CHANGELOG.md"]) {
        let text = text(file);
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            assert!(link.starts_with("https://") || path(link).exists(), "{file} links to {link}");
        }
    }
}
