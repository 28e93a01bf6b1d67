//! In which unit the angles and the lengths of a table are: what a flag or the names say, else what the numbers look
//! like, else what words around it say.
//!
//! What the numbers leave open, and no word says, is asked. What goes wrong: names that say degrees or mm over radians
//! or metres, and a quarter turn in radians beside angles in degrees, or in the place of a length; refused with the
//! line.

use super::names::NAMES;
use super::table::Table;
use crate::files::Result;
use crate::robot::catalogue::Row;
use crate::tables::names::Unit;

/// Longest link that is taken for metres, mm: a toy's.
const METRES: f64 = 3.0;

/// The shortest arm that is taken for mm, along its links in all.
const SHORTEST_MM: f64 = 200.0;

/// The longest link that words may say to be in m, cm or inches, in numbers.
const MOST: [(Unit, f64); 3] = [(Unit::M, 10.0), (Unit::Cm, 300.0), (Unit::Inch, 150.0)];

/// The largest angle that may be radians: two turns.
pub(super) const TWO_TURNS: f64 = 2.0 * std::f64::consts::TAU;

/// How near an angle must be to a multiple of a quarter turn in radians to be taken for one.
const QUARTER: f64 = 2e-3;

/// The same where it stands among numbers that are none, as `1.5707` does.
const EXACT: f64 = 1.0e-4;

/// Units of two columns, and a question where nothing says it.
pub(super) type Units = ([Unit; 2], Option<Open>);

/// What a table leaves open, and which flag says it.
#[derive(Debug, Clone)]
pub struct Open {
    pub message: String,
    pub hint: &'static str,
}

/// How far a number is from the next quarter turn in radians but zero, in quarter turns.
fn from_quarter(v: f64) -> f64 {
    let turns = v / std::f64::consts::FRAC_PI_2;
    if turns.round() == 0.0 { 1.0 } else { (turns - turns.round()).abs() }
}

/// The units of columns `at`: of alpha and theta, or of a and d.
pub(super) fn units(table: &Table, numbers: &[Row], at: [usize; 2], stated: [Option<Unit>; 2]) -> Result<Units> {
    let angles = at[0] == 0;
    let largest = largest(numbers, at);
    if let Some(unit) = table.units[usize::from(!angles)] {
        return Ok(([unit; 2], None));
    }
    if !angles
        && stated == [None; 2]
        && table.names.is_some()
        && table.given.is_none()
        && let Some((row, v)) = odd_length(numbers)
    {
        let message = format!("{v} stands in a column of lengths, and is a quarter turn in radians");
        let hint = "names stand over other columns; `--columns NAME,NAME,...` says what they are, in their order";
        return Err(table.grid.refuse(table.rows[row].0, message, Some(hint)));
    }
    match stated {
        [Some(one), Some(other)] if one != other => {
            stated_unit(table, numbers, [at[0]; 2], one)?;
            stated_unit(table, numbers, [at[1]; 2], other)?;
            Ok(([one, other], None))
        }
        [Some(unit), _] | [None, Some(unit)] => {
            stated_unit(table, numbers, at, unit)?;
            Ok(([unit; 2], None))
        }
        _ if angles => angle(table, numbers, at, largest),
        _ => Ok(length(table, numbers, largest)),
    }
}

fn largest(numbers: &[Row], at: [usize; 2]) -> f64 {
    numbers.iter().flat_map(|row| at.map(|k| row[k].abs())).fold(0.0, f64::max)
}

/// Whether a length is a quarter or a half turn in radians to six digits.
pub(super) fn is_turn(v: f64) -> bool {
    v.abs() < 4.0 && from_quarter(v) * std::f64::consts::FRAC_PI_2 < 1e-5
}

/// A length that is a turn, with its row.
fn odd_length(numbers: &[Row]) -> Option<(usize, f64)> {
    numbers.iter().enumerate().find_map(|(i, row)| Some((i, [row[1], row[3]].into_iter().find(|v| is_turn(*v))?)))
}

/// Refuses a unit that names state and numbers rule out.
fn stated_unit(table: &Table, numbers: &[Row], at: [usize; 2], unit: Unit) -> Result<()> {
    let angles = unit.is_angle();
    let largest = largest(numbers, at);
    let all = || numbers.iter().enumerate().flat_map(|(i, r)| at.map(|k| (i, r[k])));
    let odd = match unit {
        Unit::Deg => all().find(|(_, v)| from_quarter(*v) < QUARTER).filter(|_| largest < TWO_TURNS),
        Unit::Mm => all().find(|(_, v)| v.abs() == largest).filter(|_| largest > 0.0 && largest < METRES),
        _ => None,
    };
    if let Some((row, v)) = odd {
        let (what, factor) = if angles { ("radians", "180/pi") } else { ("metres", "1000") };
        let message = format!(
            "the names say {}, but {v} is none and no number of these columns is above {largest:.2}: these are {what}",
            unit.word()
        );
        let other = if angles { Unit::Rad } else { Unit::M };
        let [first, second] = at.map(|k| NAMES[k]);
        let hint =
            format!("multiply the columns by {factor}, or call them {first} and {second} with `[{}]`", other.word());
        return Err(table.grid.refuse(table.rows[row].0, message, Some(&hint)));
    }
    if unit == Unit::Rad && largest > TWO_TURNS {
        let message =
            format!("angles in radians stand beside one of {largest:.2}, which is no angle of a robot in radians");
        let hint = Some("write all angles of the table in one unit");
        return Err(table.grid.refuse(table.rows[0].0, message, hint));
    }
    Ok(())
}

/// The unit of angles that no name states: numbers beyond two turns are degrees, and among others a quarter turn tells
/// radians.
fn angle(table: &Table, numbers: &[Row], at: [usize; 2], largest: f64) -> Result<Units> {
    let all = || numbers.iter().enumerate().flat_map(|(i, r)| at.map(|k| (i, r[k])));
    if largest == 0.0 {
        return Ok(([Unit::Deg; 2], None));
    }
    if largest > TWO_TURNS {
        let Some((row, v)) = all().find(|(_, v)| from_quarter(*v) < EXACT && v.abs() < TWO_TURNS) else {
            return Ok(([Unit::Deg; 2], None));
        };
        let message = format!("{v} is a quarter turn in radians, and {largest} beside it is degrees");
        let hint = Some("write all angles of the table in one unit, or name the columns with theirs: `alpha [rad]`");
        return Err(table.grid.refuse(table.rows[row].0, message, hint));
    }
    if all().any(|(_, v)| from_quarter(v) < QUARTER) {
        return Ok(([Unit::Rad; 2], None));
    }
    let open = Open {
        message: format!("the largest angle is {largest}, which could be degrees or radians, and nothing says which"),
        hint: "`--units deg` or `--units rad` says it",
    };
    Ok(table.words.angle.map_or(([Unit::Deg; 2], Some(open)), |unit| ([unit; 2], None)))
}

/// The unit of lengths that no name states.
fn length(table: &Table, numbers: &[Row], largest: f64) -> Units {
    let total: f64 = numbers.iter().map(|row| row[1].abs() + row[3].abs()).sum();
    let said = table.words.length;
    let fits = said.filter(|said| {
        largest >= METRES && (*said == Unit::Mm || MOST.iter().any(|(unit, most)| unit == said && largest <= *most))
    });
    let usual = if largest > 0.0 && largest < METRES { Unit::M } else { Unit::Mm };
    let open = |message: String| {
        Some(Open { message, hint: "`--units mm`, `--units cm`, `--units m` or `--units in` says it" })
    };
    match (fits, said) {
        (Some(unit), _) => ([unit; 2], None),
        (None, Some(said)) if usual == Unit::M && matches!(said, Unit::Cm | Unit::Inch) => {
            let message = format!("words say that lengths are in {}, but the longest is {largest}", said.word());
            ([usual; 2], open(message))
        }
        _ if usual == Unit::Mm && largest > 0.0 && total < SHORTEST_MM => {
            let message = format!(
                "the lengths are {total:.1} in all, which is a short arm in mm and a long one in m, and nothing says the unit"
            );
            ([usual; 2], open(message))
        }
        _ => ([usual; 2], None),
    }
}
