//! Joints whose names stand in cells, as recorders of ROS write a message: so many names, and as many positions,
//! velocities and efforts.
//!
//! In: rows of cells. Out: the same without the names; the columns of numbers are called by them, and stand in one
//! order where that of the names changes from row to row. Of columns with names, `field.name0`, `field.position0`, each
//! numbered set of as many belongs to the joints; of columns without, the numbers right behind the names do, as a
//! message has its positions first. What goes wrong: names that are not of the same joints in all rows name nothing.

use std::ops::Range;

use super::fields::Fields;
use super::names::{Name, What, words};

/// Calls columns by the names of joints in the rows, where there are any.
pub(super) fn named(rows: &mut Vec<(u64, Fields)>) {
    let Some(middle) = rows.get(rows.len() / 2).map(|(_, row)| row.clone()) else { return };
    let alike =
        |row: &Fields| row.len() == middle.len() && (0..row.len()).any(|c| is_number(&row[c]) && is_number(&middle[c]));
    let Some(first) = rows.iter().position(|(_, row)| alike(row)) else { return };
    let names = rows[..first].last().map(|(_, row)| row).filter(|row| row.len() == middle.len());
    let Some((called, sets)) = (match names {
        Some(names) => by_names(names, &middle),
        None => behind(&middle),
    }) else {
        return;
    };
    let joints: Vec<&str> = called.clone().map(|column| &middle[column]).collect();
    // Where each joint stands among the names of a row.
    let order = |row: &Fields| -> Option<Vec<usize>> {
        let place = |joint: &&str| called.clone().position(|column| row[column] == **joint);
        joints.iter().map(place).collect::<Option<Vec<usize>>>().filter(|_| row.len() == middle.len())
    };
    let Some(orders) = rows[first..].iter().map(|(_, row)| order(row)).collect::<Option<Vec<_>>>() else { return };
    let kept = |column: &usize| !called.contains(column);
    let within =
        |column: usize| sets.iter().find(|set| set.contains(&column)).map(|set| (set.start, column - set.start));
    let name = |column: usize| {
        let own = names.map_or("", |names| &names[column]);
        match within(column) {
            Some((_, k)) => {
                let (before, behind) = numbered(own).map_or(("", ""), |(before, _, behind)| (before, behind));
                let (before, behind) =
                    (before.trim_end_matches(['_', '.', '[', '(', ' ']), behind.trim_start_matches([']', ')']));
                format!("{before} {}{behind}", joints[k]).trim().to_owned()
            }
            None => own.to_owned(),
        }
    };
    let head = Fields::new((0..middle.len()).filter(kept).map(name));
    let line = rows[first.saturating_sub(usize::from(names.is_some()))].0;
    let is_named = names.is_some();
    for ((_, row), order) in rows[first..].iter_mut().zip(&orders) {
        let cell = |column: usize| &row[within(column).map_or(column, |(start, k)| start + order[k])];
        *row = Fields::new((0..row.len()).filter(kept).map(cell));
    }
    match is_named {
        true => rows[first - 1].1 = head,
        false => rows.insert(first, (line, head)),
    }
}

/// The columns of the joints' names, and each set of columns of their numbers, by the columns' own names.
fn by_names(names: &Fields, row: &Fields) -> Option<(Range<usize>, Vec<Range<usize>>)> {
    let mut sets: Vec<Range<usize>> = Vec::new();
    for column in 0..names.len() {
        let before = column.checked_sub(1).and_then(|before| numbered(&names[before]));
        let follows =
            before.zip(numbered(&names[column])).is_some_and(|((a, i, b), (c, k, d))| (a, i + 1, b) == (c, k, d));
        match sets.last_mut().filter(|_| follows) {
            Some(set) => set.end += 1,
            None => sets.push(column..column + 1),
        }
    }
    let says = |set: &Range<usize>| {
        let of = words(&names[set.start]).0;
        of.iter().any(|word| matches!(word.as_str(), "name" | "names" | "joint" | "joints"))
    };
    let called = sets.iter().find(|set| set.len() > 1 && says(set) && are_names(row, set))?.clone();
    sets.retain(|set| set.len() == called.len() && set.clone().all(|column| is_number(&row[column])));
    (!sets.is_empty()).then_some((called, sets))
}

/// The same of a row alone: the first words that are joints' names and have as many numbers right behind them.
fn behind(row: &Fields) -> Option<(Range<usize>, Vec<Range<usize>>)> {
    let is_joint = |cell: &str| {
        let is_word = words(cell).0.iter().any(|word| word == "joint");
        !is_number(cell) && (is_word || matches!(Name::of(cell).what, What::Joint(_)))
    };
    let start = (0..row.len()).find(|&column| is_joint(&row[column]))?;
    let end = (start..row.len()).find(|&column| !is_joint(&row[column]))?;
    let numbers = end..2 * end - start;
    let fits = numbers.end <= row.len() && numbers.clone().all(|column| is_number(&row[column]));
    (fits && end - start > 1 && are_names(row, &(start..end))).then(|| (start..end, vec![numbers]))
}

/// Whether the cells of these columns are words, each another one.
fn are_names(row: &Fields, columns: &Range<usize>) -> bool {
    let is_word = |column: usize| row[column].starts_with(char::is_alphabetic) && !is_number(&row[column]);
    columns.clone().all(|column| is_word(column) && (columns.start..column).all(|before| row[before] != row[column]))
}

/// A numbered name: what stands before its last number, the number, and what behind.
fn numbered(name: &str) -> Option<(&str, usize, &str)> {
    let end = name.trim_end_matches(|c: char| !c.is_ascii_digit()).len();
    let start = name[..end].trim_end_matches(|c: char| c.is_ascii_digit()).len();
    Some((&name[..start], name[start..end].parse().ok()?, &name[end..]))
}

fn is_number(cell: &str) -> bool {
    cell.parse::<f64>().is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Vec<String> {
        let mut rows = text.lines().zip(1..).map(|(line, number)| (number, Fields::new(line.split(',')))).collect();
        named(&mut rows);
        rows.iter().map(|(_, row)| row.iter().collect::<Vec<_>>().join(",")).collect()
    }

    #[test]
    fn columns_are_called_by_the_names_in_cells() {
        let recorded = "t,field.name0,field.name1,field.position0,field.position1,field.effort0,field.effort1,x\n\
                        1.5,elbow,base,10,20,1,2,7\n2.5,base,elbow,30,40,3,4,8\n3.5,elbow,base,50,60,5,6,9\n";
        // The row in the middle says the order.
        let expected = [
            "t,field.position base,field.position elbow,field.effort base,field.effort elbow,x",
            "1.5,20,10,2,1,7",
            "2.5,30,40,3,4,8",
            "3.5,60,50,6,5,9",
        ];
        assert_eq!(read(recorded), expected);
        let bare = "5,1,world,joint_2,joint_1,10,20,1,2\n6,2,world,joint_2,joint_1,30,40,3,4\n";
        assert_eq!(read(bare), [",,,joint_2,joint_1,,", "5,1,world,10,20,1,2", "6,2,world,30,40,3,4"]);
        let units = "name_1,name_2,q_1 [rad],q_2 [rad]\nb,a,1.5,2.5\nb,a,3.5,4.5\n";
        assert_eq!(read(units), ["q b [rad],q a [rad]", "1.5,2.5", "3.5,4.5"]);
    }

    #[test]
    fn other_words_name_nothing() {
        for text in [
            "pose,j1,j2,x\na,1,2,3\nb,4,5,6\n",
            "name0,name1,q0,q1\na,b,1,2\na,c,3,4\n",
            "note1,note2,q1,q2\na,b,1,2\na,b,3,4\n",
            "left,right,1,2\nleft,right,3,4\n",
            "",
        ] {
            assert_eq!(read(text), text.lines().collect::<Vec<_>>(), "{text}");
        }
    }
}
