//! The list of a robot's poses beside its pictures, as people have it.
//!
//! In: a table in the contract's columns, or one that names joints in another way, or nothing but joints and a name.
//! Out: poses, and a sentence where it is no table of the contract's. What goes wrong: no column names the rows or
//! their pictures, for a pose's number does not say which picture is its; angles that may be degrees or radians; two
//! sets of joints; each is refused with what would settle it.

use std::collections::BTreeSet;

use camino::Utf8Path;

use super::columns::judge::angle_by_size;
use super::columns::part::{At, Kind, Part};
use super::columns::pick::{self, listed};
use super::keys::is_naming;
use super::rows::{RobotPose, read_poses};
use crate::csv_table::Table;
use crate::diagnostic::count;
use crate::files::Result;
use crate::tables::Fields;
use crate::tables::names::{What, words};

/// Joints of most arms: so many numbers in a line of a program are a target.
const JOINTS: usize = 6;

/// Joints that an arm may have; fewer columns without names may be anything.
const MOST_JOINTS: usize = 8;
const FEWEST_JOINTS: usize = 3;
const FEWEST_UNNAMED: usize = 4;

/// Words of a column's name that holds the files of pictures.
const PICTURE: &str = "image images picture pictures photo file filename frame img path";

/// Ends of pictures' names.
const EXTENSIONS: [&str; 8] = ["png", "jpg", "jpeg", "bmp", "tif", "tiff", "pgm", "ppm"];

/// Reads the list; the sentence says what was taken of a table that is not in the contract's columns.
pub fn read_pose_list(path: &Utf8Path) -> Result<(Vec<RobotPose>, Option<String>)> {
    let is_own = |table: Table<'_>| table.column("pose").is_some() && table.header.iter().any(|name| is_joint(name));
    if !path.is_file() || Table::read(path, "list of poses", "").is_ok_and(is_own) {
        return Ok((read_poses(path)?, beside_own(path)));
    }
    let parts = [Part::read(path, JOINTS, false)?];
    let joints = joints(&parts)?;
    let part = &parts[0];
    let picked = pick::Picked { joints, ..pick::Picked::default() }.with_units(&parts);
    let Some(unit) = picked.joint_unit.or_else(|| angle_by_size(&parts, &picked)) else {
        let message = "no column name tells whether the joints are degrees or radians, and the numbers could be either";
        let hint = "name the columns j1_deg, j2_deg, ... or j1_rad, j2_rad, ...";
        return Err(part.refuse(message.to_owned(), Some(hint)));
    };
    let Some(name) = naming(part, &picked.joints) else {
        let message = "no column says which pictures belong to a row";
        let hint = "a column `pose` with the name of each pose's pictures, without `.png`";
        return Err(part.refuse(message.to_owned(), Some(hint)));
    };
    let own =
        |wanted: &str| part.meanings.iter().flatten().position(|n| matches!(n.what, What::Own(own) if own == wanted));
    let (group, role) = (own("group"), own("role"));
    let header = ["pose", "group", "role"].into_iter().map(str::to_owned);
    let header = header.chain((1..=picked.joints.len()).map(|joint| format!("j{joint}_deg"))).collect();
    let row = |row: usize| -> Result<(u64, Fields)> {
        let (line, cells) = &part.rows[row];
        let cell = |column: Option<usize>, otherwise: &str| column.map_or(otherwise, |c| &cells[c]).to_owned();
        let reading = |at: &At| Ok(unit.converted(part.number(row, at.column)?).to_string());
        let readings = picked.joints.iter().map(reading).collect::<Result<Vec<String>>>()?;
        let named = [stem(&cells[name]).to_owned(), cell(group, "1"), cell(role, "sample")];
        Ok((*line, Fields::new(named.into_iter().chain(readings))))
    };
    let rows = (0..part.rows.len()).map(row).collect::<Result<Vec<_>>>()?;
    let taken: Vec<usize> = picked.joints.iter().map(|at| at.column).chain([name]).chain(group).chain(role).collect();
    let said = format!(
        "{}: {}; joints from {} in {}; pose = {}{}",
        part.file_name(),
        count(part.rows.len(), "row"),
        listed(&parts, &picked.joints),
        unit.word(),
        part.column_name(name),
        not_used(part, &taken)
    );
    Ok((Table::new(path, header, rows)?.poses(None)?, Some(said)))
}

/// The columns beside those of the contract, in a list that has these.
fn beside_own(path: &Utf8Path) -> Option<String> {
    let part = Part::read(path, JOINTS, false).ok()?;
    let own = |name: &str| ["pose", "group", "role", "target"].contains(&name) || is_joint(name);
    let names = part.names.iter().flatten().enumerate();
    let taken: Vec<usize> = names.filter(|(_, name)| own(name)).map(|(column, _)| column).collect();
    let left = not_used(&part, &taken);
    (!left.is_empty()).then(|| format!("{}: {}{left}", part.file_name(), count(part.rows.len(), "row")))
}

/// Whether a column is a joint's by the contract.
fn is_joint(name: &str) -> bool {
    name.starts_with('j') && (name.ends_with("_deg") || name.ends_with("_mm"))
}

/// The columns that are not taken, and what one that parts the rows may be for.
fn not_used(part: &Part, taken: &[usize]) -> String {
    let left: Vec<usize> = (0..part.width()).filter(|column| !taken.contains(column)).collect();
    let name = |column: &usize| part.column_name(*column);
    let group = left.iter().find(|column| part.parts_rows(**column)).map_or(String::new(), |column| {
        format!(" (call {} `group` if it says where the robot or the sensor stood)", name(column))
    });
    if left.is_empty() {
        return String::new();
    }
    format!("; not used: {}{group}", left.iter().map(name).collect::<Vec<_>>().join(", "))
}

/// The joints by their names; where no column has one that is understood, the columns of numbers.
fn joints(parts: &[Part; 1]) -> Result<Vec<At>> {
    let part = &parts[0];
    let named = (FEWEST_JOINTS..=MOST_JOINTS).rev().find(|joints| pick::names_joints(part, *joints));
    if let Some(count) = named {
        let named = pick::joints_alone(parts, count)?.joints;
        let unit = |at: &At| part.meanings.as_ref()?[at.column].unit;
        if let Some(at) = named.iter().find(|at| unit(at).is_some_and(|unit| !unit.is_angle())) {
            let message = format!("`{}` is a length", part.column_name(at.column));
            let hint = "joints of which some slide are called `j1_deg`, `j2_mm`, ..., beside a column `pose`";
            return Err(part.refuse(message, Some(hint)));
        }
        return Ok(named);
    }
    let free: Vec<At> = part.free_and_still().into_iter().map(|column| At { part: 0, column }).collect();
    if (FEWEST_UNNAMED..=MOST_JOINTS).contains(&free.len()) {
        return Ok(free);
    }
    let message = format!("which columns are the joints is not said: {} are numbers", count(free.len(), "column"));
    let hint = "columns `pose,group,role,j1_deg,j2_deg,...`; `stereocal init` writes a list to start from";
    Err(part.refuse(message, Some(hint)))
}

/// The column that names the rows, or the pictures of each.
fn naming(part: &Part, joints: &[At]) -> Option<usize> {
    let others = || (0..part.width()).filter(|column| joints.iter().all(|at| at.column != *column));
    let own = part.meanings.iter().flatten().position(|name| name.what == What::Own("pose"));
    let called = |is: &dyn Fn(&str) -> bool| part.names.iter().flatten().position(|name| is(name));
    let is_picture = |name: &str| words(name).0.iter().any(|word| PICTURE.split(' ').any(|known| known == word));
    let distinct = |column: &usize| {
        let names: BTreeSet<&str> = part.rows.iter().map(|(_, row)| stem(&row[*column])).collect();
        names.len() == part.rows.len() && !names.contains("")
    };
    let of_files = |column: &usize| part.rows.iter().all(|(_, row)| stem(&row[*column]) != row[*column].trim());
    own.or_else(|| called(&is_naming).filter(distinct))
        .or_else(|| called(&is_picture).filter(distinct))
        .or_else(|| others().filter(distinct).find(of_files))
        .or_else(|| others().filter(distinct).find(|column| matches!(part.kinds[*column], Kind::Words | Kind::Counts)))
}

/// The name of a picture without its folders and its extension.
fn stem(cell: &str) -> &str {
    let name = cell.trim().rsplit(['/', '\\']).next().unwrap_or_default();
    match name.rsplit_once('.') {
        Some((stem, end)) if EXTENSIONS.iter().any(|known| end.eq_ignore_ascii_case(known)) => stem,
        _ => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files;

    fn read(name: &str, text: &str) -> Result<(Vec<RobotPose>, Option<String>), String> {
        let (_folder, path) = files::temporary(name, text);
        read_pose_list(&path).map_err(|e| crate::diagnostic::report(&e))
    }

    const OWN: &str = "pose,j1_deg,j2_deg,j3_deg,j4_deg\na1,10,-20.5,180,3\na2,12,-40.5,90,4\nb7,11,5,0,-45\n";

    #[test]
    fn a_list_is_read_as_people_have_it() {
        let (expected, said) = read("poses.csv", OWN).unwrap();
        assert_eq!((expected.len(), said), (3, None));
        let radians = |degrees: f64| degrees.to_radians();
        let of = |head: &str, row: &dyn Fn(&RobotPose) -> String| {
            head.to_owned() + "\n" + &expected.iter().map(|pose| row(pose) + "\n").collect::<String>()
        };
        let cells = |numbers: &[f64], by: &str| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(by);
        let plain = |pose: &RobotPose| format!("{},{}", pose.pose, cells(&pose.joints_deg, ","));
        let noted = |pose: &RobotPose| format!("{},seen", plain(pose));
        let files = |pose: &RobotPose| format!("{},left\\\\{}.PNG", cells(&pose.joints_deg, ","), pose.pose);
        let semicolons = |pose: &RobotPose| format!("{};{}", pose.pose, cells(&pose.joints_deg, ";")).replace('.', ",");
        let in_radians = |pose: &RobotPose| {
            let radians: Vec<f64> = pose.joints_deg.iter().copied().map(radians).collect();
            format!("{},{}.jpg", cells(&radians, ","), pose.pose)
        };
        for (text, says) in [
            (of("name,J1,J2,J3,J4", &plain), "3 rows; joints from J1 to J4 in degrees; pose = name"),
            (of("name,J1,J2,J3,J4,Note", &noted), "; pose = name; not used: Note"),
            (of("J1,J2,J3,J4,image", &files), "pose = image"),
            (of("Pose;A1;A2;A3;A4", &semicolons), "joints from A1 to A4"),
            (of("q1 [rad],q2 [rad],q3 [rad],q4 [rad],left picture", &in_radians), "in radians; pose = left picture"),
            (plain(&expected[0]) + "\n" + &plain(&expected[1]) + "\n" + &plain(&expected[2]) + "\n", "pose = column 1"),
        ] {
            let (poses, said) = read("poses.csv", &text).unwrap();
            assert!(said.as_ref().is_some_and(|said| said.contains(says)), "{text}{said:?}");
            let near = |(a, b): (&RobotPose, &RobotPose)| {
                let mut angles = a.joints_deg.iter().zip(&b.joints_deg);
                (&a.pose, &a.group, a.role) == (&b.pose, &b.group, b.role) && angles.all(|(a, b)| (a - b).abs() < 1e-9)
            };
            assert!(poses.len() == 3 && poses.iter().zip(&expected).all(near), "{text}{poses:?}");
        }
    }

    #[test]
    fn a_column_that_parts_the_rows_is_named() {
        let row = |k: usize| format!("p{k};{};{};{};{};-{k}\n", k / 4, 10 * k, 90 - 7 * k, k * k);
        let rows: String = (0..8).map(row).collect();
        let told = "not used: Gruppe (call Gruppe `group` if it says where the robot or the sensor stood)";
        for (heads, own) in [("A1;A2;A3;A4", "pose = Name"), ("j1_deg;j2_deg;j3_deg;j4_deg", "8 rows")] {
            let text = format!("{};Gruppe;{heads}\n{rows}", if own == "8 rows" { "pose" } else { "Name" });
            let text = if own == "8 rows" { text.replace(';', ",") } else { text };
            let (_, said) = read("poses.csv", &text).unwrap();
            assert!(said.as_ref().is_some_and(|said| said.ends_with(&format!("{own}; {told}"))), "{said:?}");
            let (poses, said) = read("poses.csv", &text.replace("Gruppe", "group")).unwrap();
            assert!(poses[7].group == "1" && said.is_none_or(|said| said.ends_with(own)), "{poses:?}");
        }
    }

    #[test]
    fn what_is_open_is_refused() {
        for (text, says) in [
            ("J1,J2,J3,J4\n10,20,30,40\n11,21,31,41.5\n", "no column says which pictures"),
            ("name,J1,J2,J3,J4\na,1,2,3,0.5\nb,0,2,1,1\n", "degrees or radians"),
            ("name,J1,J2,J3\na,10,20,30\na,11,21,31\n", "no column says which pictures"),
            ("pose,J1,J2,J3\na,10,20,30\na,11,21,31\n", "stands in line 2 already"),
            ("pose,J1,J2,J3,cmd_J1,cmd_J2,cmd_J3\na,10,20,30,10,20,30\nb,11,21,31,11,21,31\n", "two sets of joints"),
            ("name,x,y\na,10,20\nb,11,21\n", "which columns are the joints"),
            ("pose,group,role,j1_deg,j3_deg\na,1,sample,0,0\n", "no column `j2_deg`"),
        ] {
            let said = read("poses.csv", text).unwrap_err();
            assert!(said.contains(says), "{text}{said}");
        }
    }
}
