//! `--known-distances`: distances between the points that two groups touched, `group_a,group_b,distance_mm[,sigma_mm]`.

use camino::Utf8Path;

use super::dataset::{Dataset, KnownDistance};
use crate::csv_table::Table;
use crate::files;

/// Groups that a message names.
const NAMED: usize = 8;

impl KnownDistance {
    /// Its standard deviation; that of a caliper where none is stated, mm.
    pub fn sigma_mm(&self) -> f64 {
        const CALIPER_MM: f64 = 0.05;
        self.stated_sigma_mm.unwrap_or(CALIPER_MM)
    }
}

/// Reads the distances between groups of `set`.
pub fn read(path: &Utf8Path, set: &Dataset) -> files::Result<Vec<KnownDistance>> {
    let hint = "a CSV with the columns group_a,group_b,distance_mm and optionally sigma_mm";
    let table = Table::read(path, "file of known distances", hint)?;
    let (a, b) = (table.require("group_a")?, table.require("group_b")?);
    let distance = table.require("distance_mm")?;
    let sigma = table.column("sigma_mm");
    let names: Vec<&str> = set.groups.iter().take(NAMED).map(|g| g.name.as_str()).collect();
    let groups = format!("the groups are {}{}", names.join(", "), if set.groups.len() > NAMED { ", ..." } else { "" });
    let mut list = Vec::new();
    for (line, row) in &table.rows {
        let group = |column: usize| {
            let place = set.groups.iter().position(|g| g.name == row[column]);
            let message = || format!("no group `{}` among the measurements", &row[column]);
            place.ok_or_else(|| table.refuse_with(*line, message(), Some(&groups)))
        };
        let distance_mm = table.number(*line, row, distance)?;
        let given = sigma.filter(|column| !row[*column].is_empty());
        let stated_sigma_mm = given.map(|column| table.number(*line, row, column)).transpose()?;
        let (a, b) = (group(a)?, group(b)?);
        if distance_mm <= 0.0 || stated_sigma_mm.is_some_and(|mm| mm <= 0.0) || a == b {
            let message = "a known distance lies between two different groups, and it and its sigma_mm are above zero";
            return Err(table.refuse(*line, message.to_owned()));
        }
        list.push(KnownDistance { a, b, distance_mm, stated_sigma_mm });
    }
    Ok(list)
}
