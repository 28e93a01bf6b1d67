//! Tables whose rows are not all measurements: failed readings, rows to verify that were fitted, rows without a group,
//! and a mean below.

use std::path::Path;

use crate::run::{stderr, stdout, stereocal, workplace};

/// Joints, and the point's first column.
const J1: usize = 3;
const X: usize = 9;

/// A world's rows, cell by cell, below their header.
fn world(at: &Path) -> Vec<Vec<String>> {
    let made = ["simulate", "--points-only", "--samples", "40", "--verify", "12", "--seed", "4", "--out", "."];
    assert_eq!(stereocal(at, &made).status.code(), Some(0));
    let text = std::fs::read_to_string(at.join("truth/measurements.csv")).unwrap();
    text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

/// Status and words of `identify` on these rows.
fn identified(at: &Path, rows: &[Vec<String>]) -> (Option<i32>, String) {
    let text: Vec<String> = rows.iter().map(|row| row.join(",")).collect();
    std::fs::write(at.join("m.csv"), text.join("\n")).unwrap();
    let flags = ["--method", "trust-region", "--extensions", "none", "--out", "out", "--no-provenance", "--force"];
    let found =
        stereocal(at, &[&["identify", "--measurements", "m.csv", "--robot", "robot.toml"][..], &flags].concat());
    (found.status.code(), stdout(&found) + &stderr(&found))
}

fn of_role(rows: &[Vec<String>], role: &str) -> Vec<usize> {
    (0..rows.len()).filter(|&row| rows[row][2] == role).collect()
}

#[test]
fn readings_of_nothing_are_named_and_left_out() {
    let folder = workplace();
    let rows = world(folder.path());
    let (status, said) = identified(folder.path(), &rows);
    assert!(status == Some(0) && !said.contains("no usable reading"), "{said}");
    for (role, count) in [("sample", 4), ("sample", 12), ("verify", 3)] {
        let mut spoilt = rows.clone();
        let zeros: Vec<usize> = of_role(&rows, role).into_iter().take(count).collect();
        zeros.iter().for_each(|&row| spoilt[row][X..X + 3].fill("0".to_owned()));
        let (status, said) = identified(folder.path(), &spoilt);
        let named: Vec<&str> = zeros.iter().map(|&row| rows[row][0].as_str()).collect();
        let words = format!(
            "{count} rows have no usable reading (0, 0, 0 mm in {count} rows between which the robot moved: nothing was measured): {}; left out",
            named.join(", ")
        );
        assert!(status == Some(0) && said.contains(&words), "{said}");
        assert!(said.starts_with("use the identified robot") || count == 12, "{said}");
    }
}

#[test]
fn rows_that_were_fitted_do_not_verify() {
    let folder = workplace();
    let rows = world(folder.path());
    let (samples, verify) = (of_role(&rows, "sample"), of_role(&rows, "verify"));
    for count in [2, verify.len()] {
        let mut spoilt = rows.clone();
        for (&to, &from) in verify.iter().zip(&samples).take(count) {
            let name = spoilt[to][0].clone();
            spoilt[to] = rows[from].clone();
            (spoilt[to][0], spoilt[to][2]) = (name, "verify".to_owned());
        }
        let (status, said) = identified(folder.path(), &spoilt);
        let words = format!("{count} rows have no usable reading (copies of fitted rows to the last digit, ");
        assert!(status == Some(0) && said.contains(&words), "{said}");
        let judged = match count < verify.len() {
            true => format!("; {} rows that took no part in the fit", verify.len() - count),
            false => "rows, each in a fit without it".to_owned(),
        };
        assert!(said.contains(&judged) && !said.contains("came back to"), "{said}");
    }
    // The robot came back to a pose and read another point there.
    let mut again = rows.clone();
    again[verify[0]][J1..X].clone_from_slice(&rows[samples[0]][J1..X]);
    again[verify[0]][X..].clone_from_slice(&rows[samples[0]][X..]);
    let x: f64 = rows[samples[0]][X].parse().unwrap();
    again[verify[0]][X] = format!("{}", x + 0.01);
    again[verify[0]][1] = rows[samples[0]][1].clone();
    let (_, said) = identified(folder.path(), &again);
    assert!(!said.contains("copies of fitted rows"), "{said}");
}

/// A row that a program left at zero tells nothing of where the robot is known.
#[test]
fn a_row_of_zeros_changes_no_promise() {
    let folder = workplace();
    let rows = world(folder.path());
    let promise = |rows: &[Vec<String>]| {
        let (_, said) = identified(folder.path(), rows);
        let line = said.lines().find(|line| line.starts_with("expected position error")).unwrap_or_default();
        (line.to_owned(), said)
    };
    let mut with_zeros = rows.clone();
    let mut zeros = rows[of_role(&rows, "sample")[0]].clone();
    zeros[0] = "zeros".to_owned();
    zeros[J1..X + 3].fill("0".to_owned());
    with_zeros.push(zeros);
    let ((clean, _), (told, said)) = (promise(&rows), promise(&with_zeros));
    assert!(said.contains("1 row has no usable reading (0 in all joints and coordinates"), "{said}");
    assert_eq!(told, clean, "{said}");
}

#[test]
fn points_of_something_that_stands_still_are_refused() {
    let folder = workplace();
    let mut rows = world(folder.path());
    for (i, row) in rows.iter_mut().enumerate().skip(1) {
        for (k, cell) in row[X..X + 3].iter_mut().enumerate() {
            *cell = (700.0 + 0.004 * ((7 * i + k) as f64).sin()).to_string();
        }
    }
    let (status, said) = identified(folder.path(), &rows);
    assert!(status == Some(2) && said.contains("what was measured stands still"), "{said}");
}

#[test]
fn rows_without_a_group_are_refused_and_a_mean_below_is_left_out() {
    let folder = workplace();
    let rows = world(folder.path());
    let mut spoilt = rows.clone();
    (10..rows.len()).step_by(10).for_each(|row| spoilt[row][1] = String::new());
    let (status, said) = identified(folder.path(), &spoilt);
    assert!(status == Some(2) && said.contains("rows have no group: lines 11, 21, "), "{said}");
    let mut below = rows.clone();
    let mut mean = vec![String::new(); rows[0].len()];
    mean[0] = "mean".to_owned();
    mean[X] = "12.5".to_owned();
    below.push(mean);
    let (status, said) = identified(folder.path(), &below);
    let words = format!("1 row without joints below the table left out: line {}", rows.len() + 1);
    assert!(status == Some(0) && said.contains(&words), "{said}");
}
