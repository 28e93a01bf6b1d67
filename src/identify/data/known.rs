//! `--known-distances`: distances between the points that two groups touched, `group_a,group_b,distance_mm[,sigma_mm]`,
//! or a table in which two columns are names of groups and one is a distance.

use camino::Utf8Path;

use super::dataset::{Dataset, KnownDistance};
use crate::csv_table::Table;
use crate::files;
use crate::tables::names::{Name, Unit, What};
use crate::tables::{Fields, Grid, header};

/// Groups that a message names.
const NAMED: usize = 8;

impl KnownDistance {
    /// Its standard deviation; that of a caliper where none is stated, mm.
    pub fn sigma_mm(&self) -> f64 {
        const CALIPER_MM: f64 = 0.05;
        self.stated_sigma_mm.unwrap_or(CALIPER_MM)
    }
}

const HINT: &str = "a table with the columns group_a,group_b,distance_mm and optionally sigma_mm";

/// The table in columns of these names, whatever they are called in the file.
fn table<'a>(path: &'a Utf8Path, set: &Dataset) -> files::Result<Table<'a>> {
    const WHAT: &str = "file of known distances";
    let grid = Grid::read(path, WHAT, HINT)?;
    let has_own = |(_, row): &(u64, Fields)| row.iter().any(|name| name.trim() == "group_a");
    if grid.rows.first().is_none_or(has_own) {
        return Table::read(path, WHAT, HINT);
    }
    let is_group = |cell: &str| set.groups.iter().any(|group| group.name == cell);
    let is_data = |(_, row): &(u64, Fields)| row.iter().filter(|cell| is_group(cell.trim())).count() > 1;
    let first = grid.rows.iter().position(is_data).unwrap_or(grid.rows.len());
    let (above, rows) = grid.rows.split_at(first);
    let width = rows.first().map_or(0, |(_, row)| row.len());
    if let Some((line, row)) = rows.iter().find(|(_, row)| row.len() != width) {
        return Err(grid.refuse(*line, format!("{} cells, but the first row has {width}", row.len()), None));
    }
    let names: Option<Vec<&str>> =
        above.last().filter(|(_, row)| row.len() == width).map(|(_, row)| row.iter().collect());
    let line = grid.rows[0].0;
    let all = |column: usize, is: &dyn Fn(&str) -> bool| rows.iter().all(|(_, row)| is(row[column].trim()));
    let groups: Vec<usize> = (0..width).filter(|&column| all(column, &is_group)).collect();
    let numbers: Vec<usize> =
        (0..width).filter(|column| !groups.contains(column) && all(*column, &header::is_number)).collect();
    let name = |column: usize| names.as_ref().map(|names| Name::of(names[column]));
    let is_distance = |column: &usize| name(*column).is_some_and(|name| name.what == What::Distance);
    let distance = numbers.iter().copied().find(is_distance).or(match numbers[..] {
        [only] => Some(only),
        _ => None,
    });
    let ([a, b], Some(distance)) = (&groups[..], distance) else {
        let message = "it is not told which two columns name groups of the measurements, and which is their distance";
        return Err(grid.refuse(line, message.to_owned(), Some(HINT)));
    };
    let is_lost = |(_, row): &&(u64, Fields)| row.len() == width && header::is_number(row[distance].trim());
    if let Some((line, _)) = above.iter().find(is_lost) {
        let message = "this row does not name two groups of the measurements".to_owned();
        return Err(grid.refuse(*line, message, Some(HINT)));
    }
    let sigma = names.as_ref().and_then(|names| names.iter().position(|name| name.eq_ignore_ascii_case("sigma_mm")));
    let unit = name(distance).and_then(|name| name.unit).unwrap_or(Unit::Mm);
    let row = |(line, row): &(u64, Fields)| {
        let value =
            row[distance].trim().parse::<f64>().map_or(row[distance].to_owned(), |v| unit.converted(v).to_string());
        let cells = [row[*a].trim().to_owned(), row[*b].trim().to_owned(), value];
        (*line, Fields::new(cells.into_iter().chain(sigma.map(|column| row[column].to_owned()))))
    };
    let header = ["group_a", "group_b", "distance_mm"].into_iter().chain(sigma.map(|_| "sigma_mm"));
    Table::new(path, header.map(str::to_owned).collect(), rows.iter().map(row).collect())
}

/// Reads the distances between groups of `set`.
pub fn read(path: &Utf8Path, set: &Dataset) -> files::Result<Vec<KnownDistance>> {
    let table = table(path, set)?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::synthetic;

    #[test]
    fn distances_are_read_whatever_their_columns_are_called() {
        let set = Dataset::new(&synthetic::touched(0.0, 3).0.rows).unwrap();
        let read = |text: &str| {
            let (_folder, path) = files::temporary("distances.csv", text);
            read(&path, &set).map_err(|e| crate::diagnostic::report(&e))
        };
        let own = "group_a,group_b,distance_mm,sigma_mm\ns1,s5,250.5,0.02\ns2,s3,100,\n";
        let expected = read(own).unwrap();
        assert_eq!(expected.iter().map(|k| (k.a, k.b)).collect::<Vec<_>>(), [(1, 5), (2, 3)]);
        let without_sigma = expected.iter().map(|k| KnownDistance { stated_sigma_mm: None, ..*k }).collect::<Vec<_>>();
        for text in [
            "from;to;distance\ns1;s5;250,5\ns2;s3;100\n",
            "s1 s5 250.5\ns2 s3 100\n",
            "length [m],note,first,second\n0.2505,gauge,s1,s5\n0.1,rule,s2,s3\n",
            "No,socket,other,dist_mm,temperature\n1,s1,s5,250.5,20.1\n2,s2,s3,100,20.4\n",
        ] {
            assert_eq!(read(text).as_ref(), Ok(&without_sigma), "{text}");
        }
        assert_eq!(read("a,b,l,sigma_mm\ns1,s5,250.5,0.02\ns2,s3,100,0.05\n").unwrap()[0], expected[0]);
        for (text, says) in [
            ("group_a,group_b,distance_mm\ns1,s99,3\n", "no group `s99`"),
            ("from,to,distance\ns1,s99,3\n", "not told which two columns"),
            ("from,to,first,second\ns1,s5,3,4\n", "not told which two columns"),
            ("from,to,distance\ns1,s1,3\n", "two different groups"),
            ("s1,s99,3\ns1,s2,5\n", "csv:1"),
            ("from,to,distance\ns1,s99,3\ns1,s2,5\n", "does not name two groups"),
        ] {
            let said = read(text).unwrap_err();
            assert!(said.contains(says), "{text}{said}");
        }
    }
}
