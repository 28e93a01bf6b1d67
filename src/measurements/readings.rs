//! Readings that were repeated under the name of one pose: their names are told apart.
//!
//! In: a table of measurements. Out: the same; rows of one name, and of one target where a column tells it, are called
//! `1.1`, `1.2` where they have the same joints, group and role and are of one point, or one distance. What goes wrong:
//! rows of one name that are not, such as several targets that no column tells apart, keep it and are refused where
//! they are read.

use std::collections::BTreeMap;

use super::columns::layout::ONE_POINT;
use crate::csv_table::{Fields, Table};
use crate::files::Result;
use crate::statistics::median;

/// What to do where rows of one name are no readings of one point.
pub(super) const ONE_NAME: &str = "give each row a name of its own; only readings of one point at the same joints, in one group and not of a \
                                   centre, share one, and several targets of a pose have a column `target`";

/// Tells the names of repeated readings apart.
pub(super) fn named_apart(table: &mut Table) -> Result<()> {
    let Some(pose) = table.column("pose") else { return Ok(()) };
    let (joints, _) = table.joint_columns()?;
    let point = ["x_mm", "y_mm", "z_mm"].into_iter().filter_map(|name| table.column(name)).collect::<Vec<_>>();
    let measured = if point.len() == 3 { point } else { table.column("distance_mm").into_iter().collect() };
    let [target, group, role] = ["target", "group", "role"].map(|name| table.column(name));
    let rows = &table.rows;
    let mut of_name: BTreeMap<&str, BTreeMap<&str, Vec<usize>>> = BTreeMap::new();
    for (i, (_, row)) in rows.iter().enumerate() {
        let of_target = target.map_or("", |c| &row[c]);
        of_name.entry(&row[pose]).or_default().entry(of_target).or_default().push(i);
    }
    let numbers = |row: usize, columns: &[usize]| -> Option<Vec<f64>> {
        columns.iter().map(|&c| rows[row].1[c].parse().ok().filter(|v: &f64| v.is_finite())).collect()
    };
    // How far all others are from the first.
    let apart = |of: &Vec<usize>| -> Vec<f64> {
        let mut read = of.iter().filter_map(|&row| numbers(row, &measured));
        read.next().map_or_else(Vec::new, |first| read.map(|other| distance(&first, &other)).collect())
    };
    let place = |row: usize| {
        let cell = |column: Option<usize>| column.map_or("", |c| &rows[row].1[c]).to_lowercase();
        (numbers(row, &joints), group.map(|c| &rows[row].1[c]), cell(role))
    };
    let firsts: Vec<Vec<f64>> =
        of_name.values().filter_map(|of| of.values().flatten().find_map(|&row| numbers(row, &measured))).collect();
    let Some(between) = median(firsts.windows(2).map(|two| distance(&two[0], &two[1]))) else { return Ok(()) };
    let near = |mm: f64| mm < ONE_POINT * between;
    if !median(of_name.values().flat_map(BTreeMap::values).flat_map(apart)).is_none_or(near) {
        return Ok(());
    }
    let mut names: Vec<(usize, String)> = Vec::new();
    for (name, targets) in of_name.iter().filter(|(_, targets)| targets.values().any(|of| of.len() > 1)) {
        let mut all = targets.values().flatten().map(|&row| place(row));
        let first = all.next();
        let one_place = all.all(|other| first.as_ref() == Some(&other));
        let is_center = first.is_some_and(|(.., role)| ["center", "centre"].contains(&role.as_str()));
        // Of two nobody knows which was misread; of more it is the one that is far from the others.
        let two_apart = targets.values().map(apart).any(|far| matches!(far[..], [mm] if !near(mm)));
        if one_place && !is_center && !two_apart {
            let numbered = |of: &Vec<usize>| -> Vec<(usize, String)> {
                of.iter().zip(1..).map(|(&row, k)| (row, format!("{name}.{k}"))).collect()
            };
            names.extend(targets.values().flat_map(numbered));
        }
    }
    if names.iter().any(|(_, name)| of_name.contains_key(name.as_str())) {
        return Ok(());
    }
    for (row, name) in names {
        let fields = &mut table.rows[row].1;
        let cells = fields.iter().enumerate().map(|(c, cell)| if c == pose { name.as_str() } else { cell });
        *fields = Fields::new(cells.collect::<Vec<_>>());
    }
    Ok(())
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use crate::diagnostic::report;
    use crate::files;
    use crate::measurements::read;

    /// The names of the poses, or what is said instead.
    fn names(text: &str) -> Result<String, String> {
        let (_folder, path) = files::temporary("m.csv", text);
        let rows = read(&path).map_err(|e| report(&e))?;
        Ok(rows.into_iter().map(|row| row.at.pose + &row.target).collect::<Vec<_>>().join(" "))
    }

    #[test]
    fn readings_of_several_targets_and_of_distances_are_numbered() {
        let of_targets = |role: &str| {
            let rows = format!("a,1,{role},l,0,1,2,3\na,1,{role},l,0,1.01,2,3\na,1,{role},r,0,90,2,3\n");
            format!("pose,group,role,target,j1_deg,x_mm,y_mm,z_mm\n{rows}b,1,sample,l,5,701,2,3\n")
        };
        assert_eq!(names(&of_targets("sample")).unwrap(), "a.1l a.2l a.1r bl");
        assert!(
            names(&of_targets("center")).unwrap_err().contains("pose `a` with target `l` stands in line 2 already")
        );
        let distances = |a: f64, again: f64, b: f64| {
            let header = "pose,group,role,j1_deg,distance_mm";
            names(&format!("{header}\na,1,sample,0,{a}\na,1,sample,0,{again}\nb,1,sample,9,{b}\n"))
        };
        assert_eq!(distances(500.0, 500.01, 900.0).unwrap(), "a.1 a.2 b");
        // Of distances that are nearly one none tells which are of one pose.
        assert!(distances(500.0, 500.2, 500.5).unwrap_err().contains("a name of its own"));
        // A name that another pose has already.
        let taken = "pose,j1_deg,x_mm,y_mm,z_mm\na,0,1,2,3\na,0,1.01,2,3\na.2,5,701,2,3\n";
        assert!(names(taken).unwrap_err().contains("pose `a` stands in line 2 already"));
    }
}
