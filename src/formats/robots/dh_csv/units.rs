//! In which unit the angles and the lengths of a table are: what the names say, else what the numbers look like.

use crate::files::Result;
use crate::robot::catalogue::Row;
use crate::tables::names::Unit;
use crate::tables::{Fields, Grid};

/// Longest link that is taken for metres, mm: a toy's.
const METRES: f64 = 3.0;

/// How near an angle must be to a multiple of a quarter turn in radians to be taken for one.
const QUARTER: f64 = 2e-3;

/// The unit of two columns: what their names say, else what the numbers look like.
pub(super) fn units(
    grid: &Grid,
    rows: &[(u64, Fields)],
    table: &[Row],
    at: [usize; 2],
    stated: [Option<Unit>; 2],
) -> Result<Unit> {
    let angles = at[0] == 0;
    let names = if angles { ["alpha", "theta"] } else { ["a", "d"] };
    let all = || table.iter().enumerate().flat_map(|(i, r)| at.map(|k| (i, r[k])));
    let largest = all().map(|(_, v)| v.abs()).fold(0.0, f64::max);
    let quarter = |v: f64| {
        let turns = v / std::f64::consts::FRAC_PI_2;
        turns.round() != 0.0 && (turns - turns.round()).abs() < QUARTER
    };
    let odd = match angles {
        true => all().find(|(_, v)| quarter(*v)).filter(|_| largest < 2.0 * std::f64::consts::TAU),
        false => all().find(|(_, v)| v.abs() == largest).filter(|_| largest > 0.0 && largest < METRES),
    };
    let (usual, other) = if angles { (Unit::Deg, Unit::Rad) } else { (Unit::Mm, Unit::M) };
    match (stated[0].or(stated[1]), odd) {
        (Some(unit), Some((row, v))) if unit == usual => {
            let (what, factor) = if angles { ("radians", "180/pi") } else { ("metres", "1000") };
            let message = format!(
                "the names say {}, but {v} is none and no number of these columns is above {largest:.2}: these are {what}",
                unit.word()
            );
            let hint = format!(
                "multiply the columns by {factor}, or call them {} and {} with `[{}]`",
                names[0],
                names[1],
                other.word()
            );
            Err(grid.refuse(rows[row].0, message, Some(&hint)))
        }
        (Some(Unit::Rad), _) if largest > 2.0 * std::f64::consts::TAU => {
            let message =
                format!("angles in radians stand beside one of {largest:.2}, which is no angle of a robot in radians");
            Err(grid.refuse(rows[0].0, message, Some("write all angles of the table in one unit")))
        }
        (Some(unit), _) => Ok(unit),
        (None, Some(_)) => Ok(other),
        (None, None) => Ok(usual),
    }
}
