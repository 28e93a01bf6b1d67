//! Cells that are empty where a row of measurements needs them.

use crate::csv_table::Table;
use crate::diagnostic::count;
use crate::files::Result;

/// Lines that a message names.
const NAMED: usize = 12;

impl Table<'_> {
    /// Takes away rows at the end that hold no joint, and says so: means and remarks stand below a table.
    pub(super) fn without_rows_below(&mut self) -> Result<Option<String>> {
        let (joints, _) = self.joint_columns()?;
        let is_pose = |(_, row): &(u64, crate::csv_table::Fields)| joints.iter().any(|&c| !row[c].is_empty());
        let end = self.rows.iter().rposition(is_pose).map_or(0, |last| last + 1);
        if end == 0 || end == self.rows.len() {
            return Ok(None);
        }
        let lines: Vec<u64> = self.rows.drain(end..).map(|(line, _)| line).collect();
        Ok(Some(format!("{} without joints below the table left out: {}", count(lines.len(), "row"), listed(&lines))))
    }

    /// The column of groups, where there is one with a name in it; rows without one then stand nowhere.
    pub(super) fn group_column(&self) -> Result<Option<usize>> {
        let Some(column) = self.column("group") else { return Ok(None) };
        let lines: Vec<u64> =
            self.rows.iter().filter(|(_, row)| row[column].trim().is_empty()).map(|(line, _)| *line).collect();
        if lines.is_empty() {
            return Ok(Some(column));
        }
        if lines.len() == self.rows.len() {
            return Ok(None);
        }
        let message = format!("{} of {} rows have no group: {}", lines.len(), self.rows.len(), listed(&lines));
        let hint =
            "write the group of each, which is one placement of the sensor; without the column all rows are of one";
        Err(self.refuse_with(lines[0], message, Some(hint)))
    }
}

pub(super) fn listed(lines: &[u64]) -> String {
    let named: Vec<String> = lines.iter().take(NAMED).map(u64::to_string).collect();
    let more = lines.len().saturating_sub(NAMED);
    let (word, rest) = (
        if lines.len() == 1 { "line" } else { "lines" },
        if more > 0 { format!(" and {more} more") } else { String::new() },
    );
    format!("{word} {}{rest}", named.join(", "))
}

#[cfg(test)]
mod tests {
    use crate::diagnostic::report;
    use crate::files;
    use crate::measurements::rows::read_whole;

    /// Six rows whose groups are these, and what stands below.
    fn text(groups: [&str; 6], below: &str) -> String {
        let row = |(k, group): (usize, &str)| format!("p{k},{group},sample,{k},5,100,{k},7\n");
        let rows: String = groups.into_iter().enumerate().map(row).collect();
        format!("pose,group,role,j1_deg,j2_deg,x_mm,y_mm,z_mm\n{rows}{below}")
    }

    #[test]
    fn rows_without_a_group_are_refused_where_others_have_one() {
        let read = |groups| {
            let (_folder, path) = files::temporary("m.csv", text(groups, ""));
            read_whole(&path).map(|(rows, _)| rows.into_iter().map(|row| row.at.group).collect::<Vec<_>>())
        };
        for (groups, message) in [
            (["1", "", "1", "2", "2", "2"], "1 of 6 rows have no group: line 3"),
            (["1", " ", "1", "2", "", ""], "3 of 6 rows have no group: lines 3, 6, 7"),
        ] {
            let said = report(&read(groups).unwrap_err());
            assert!(said.contains(message) && said.contains("write the group of each"), "{said}");
        }
        assert_eq!(read(["1", "1 ", "1", " 2", "2", "2"]).unwrap(), ["1", "1", "1", "2", "2", "2"]);
        assert_eq!(read([""; 6]).unwrap(), ["1"; 6]);
    }

    #[test]
    fn rows_below_the_table_are_left_out() {
        for (below, said) in [
            ("", None),
            ("mean,,,,,100,2.5,7\n", Some("1 row without joints below the table left out: line 8")),
            (",,,,,,,\nmean,,,,,100,2.5,7\nsd,,,,,0,1,0\n", Some("joints below the table left out: lines")),
        ] {
            let (_folder, path) = files::temporary("m.csv", text(["1"; 6], below));
            let (rows, sentence) = read_whole(&path).unwrap();
            assert_eq!((rows.len(), sentence.len()), (6, usize::from(said.is_some())), "{below}");
            assert!(said.is_none_or(|said| sentence[0].contains(said)), "{sentence:?}");
        }
    }
}
