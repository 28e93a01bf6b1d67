//! Names of columns as what they mean: joints, coordinates, distances, with units and with whether they were measured
//! or commanded.
//!
//! In: a name in any case, with blanks, underscores, units in brackets or behind. Out: a [`Name`]. Words that say what
//! a number is not (torques, velocities, errors, uncertainties, orientations) make it [`What::Other`]; words that say
//! that a point was sent to the robot or computed, not measured, make it commanded. What goes wrong: `x y z` alone may
//! be either, and a set of joints is one only where it is complete; who reads the table decides.

use super::vocabulary::{COMMANDED, DISTANCE, ELSE, ENCODER, INSTRUMENT, JOINT, MEASURED, PLAIN, UNREAD, is_in};

/// A unit of a joint or of a length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    Deg,
    Rad,
    Mm,
    M,
    Um,
    Cm,
    Inch,
}

/// Each unit with its word in a sentence, that of `--units`, and the words by which it is known.
const UNITS: [(Unit, &str, &str, &[&str]); 7] = [
    (Unit::Deg, "degrees", "deg", &["deg", "degree", "degrees", "°", "º", "grad"]),
    (Unit::Rad, "radians", "rad", &["rad", "radian", "radians"]),
    (Unit::Mm, "mm", "mm", &["mm", "millimeter", "millimeters", "millimetre", "millimetres"]),
    (Unit::M, "m", "m", &["m", "meter", "meters", "metre", "metres"]),
    (Unit::Um, "um", "um", &["um", "µm", "μm", "micron", "microns"]),
    (Unit::Cm, "cm", "cm", &["cm"]),
    (Unit::Inch, "inches", "inches", &["in", "inch", "inches"]),
];

impl Unit {
    /// From a word such as `mm`, `deg` or `°`.
    pub fn of(word: &str) -> Option<Unit> {
        let word = word.trim().to_lowercase();
        UNITS.iter().find(|(.., known)| known.contains(&word.as_str())).map(|(unit, ..)| *unit)
    }

    /// Whether it is one of angles.
    pub fn is_angle(self) -> bool {
        matches!(self, Unit::Deg | Unit::Rad)
    }

    /// In degrees or mm.
    pub fn converted(self, value: f64) -> f64 {
        match self {
            Unit::Deg | Unit::Mm => value,
            Unit::Rad => value.to_degrees(),
            Unit::M => 1000.0 * value,
            Unit::Um => value / 1000.0,
            Unit::Cm => 10.0 * value,
            Unit::Inch => 25.4 * value,
        }
    }

    /// For a sentence.
    pub fn word(self) -> &'static str {
        UNITS[self as usize].1
    }

    /// As `--units` has it.
    pub fn flag(self) -> &'static str {
        UNITS[self as usize].2
    }
}

/// What a column holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum What {
    /// A joint's reading, by the number in its name.
    Joint(usize),
    /// A coordinate of a point: 0, 1 or 2.
    Coordinate(usize),
    /// An entry of a 4x4 matrix, row and column as they are counted.
    Matrix(usize, usize),
    Distance,
    /// A column of the measurements' own format, by its name.
    Own(&'static str),
    Other,
}

/// A column's name, understood.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Name {
    pub what: What,
    pub unit: Option<Unit>,
    /// What else the name says, to tell one set of columns from another.
    pub key: Vec<String>,
    /// Whether the name says that it was measured (`Some(true)`), or that it was commanded, computed or is something
    /// else.
    pub measured: Option<bool>,
}

/// Columns of the measurements' own format beside joints, points and distances.
const OWN: [&str; 15] = [
    "pose", "group", "role", "target", "status", "sigma_mm", "sxx_mm2", "sxy_mm2", "sxz_mm2", "syy_mm2", "syz_mm2",
    "szz_mm2", "rx_rad", "ry_rad", "rz_rad",
];

impl Name {
    /// The unit of a joint, a point or a distance that is not read, where the name states one.
    pub fn unread_unit(&self) -> Option<&str> {
        let counts = matches!(self.what, What::Joint(_) | What::Coordinate(_) | What::Distance);
        self.key.iter().find(|word| counts && is_in(UNREAD, word)).map(String::as_str)
    }

    pub fn of(name: &str) -> Name {
        let name = name.trim().trim_start_matches(['#', '%']).trim();
        if let Some(own) = OWN.iter().find(|own| name.eq_ignore_ascii_case(own)) {
            return Name { what: What::Own(own), unit: None, key: Vec::new(), measured: None };
        }
        let (mut words, mut unit) = words(name);
        // `x_m` is in metres; a word before the number is no unit.
        if words.len() > 1
            && let Some(found) = words.last().and_then(|word| Unit::of(word))
            && !(found == Unit::M && unit.is_some())
        {
            unit = unit.or(Some(found));
            words.pop();
        }
        let commanded = words.iter().any(|word| is_in(COMMANDED, word)).then_some(false);
        let other = Name { what: What::Other, unit, key: Vec::new(), measured: commanded };
        if words.iter().any(|word| is_in(ELSE, word)) {
            return Name { measured: Some(false), ..other };
        }
        let Some((what, mut rest)) =
            joint(&words).or_else(|| coordinate(&words)).or_else(|| matrix(&words)).or_else(|| distance(&words))
        else {
            return other;
        };
        let says = |list: &str, rest: &[String]| rest.iter().any(|word| is_in(list, word));
        // `target 2` and `N2` are reflectors, `target` and `n` alone where the robot was sent.
        let counts = |two: &[String]| {
            let letter = two[0].chars().count() == 1 && two[1].chars().all(|c| c.is_ascii_digit());
            (two[0] == "target" && is_index(&two[1]) || letter).then(|| two[0].clone())
        };
        let counted = rest.windows(2).find_map(counts);
        rest.retain(|word| !(counted.as_ref() == Some(word) || is_in(PLAIN, word)));
        // `T_x` and `T14` are of a transform, `x_t` of a target.
        let point = matches!(what, What::Coordinate(_) | What::Matrix(..));
        let transform = point && words[0] == "t" && rest.first() == words.first();
        let computed = says(COMMANDED, &rest[usize::from(transform)..]) || point && says(ENCODER, &rest);
        let measured = match (computed, says(MEASURED, &rest) || says(INSTRUMENT, &rest)) {
            (true, _) => Some(false),
            (false, true) => Some(true),
            _ => None,
        };
        Name { what, unit, key: rest, measured }
    }
}

/// Whether a word alone names nothing, but says of the name behind it where that comes from.
pub fn is_said_of_another(word: &str) -> bool {
    let word = word.to_lowercase();
    word.chars().count() > 2 && [COMMANDED, MEASURED, INSTRUMENT, ELSE].iter().any(|list| is_in(list, &word))
}

/// Whether a word counts things: a number or a single letter.
pub fn is_index(word: &str) -> bool {
    word.chars().count() == 1 || word.chars().all(|c| c.is_ascii_digit())
}

/// The words of a name, small, letters and digits apart, and the unit in brackets.
pub fn words(name: &str) -> (Vec<String>, Option<Unit>) {
    let mut unit = None;
    let mut plain = String::new();
    let mut rest = name;
    while let Some(open) = rest.find(['[', '(', '{']) {
        let close = rest[open..].find([']', ')', '}']).map_or(rest.len(), |c| open + c);
        let inside = &rest[open + 1..close];
        plain.push_str(&rest[..open]);
        match Unit::of(inside) {
            Some(found) => unit = unit.or(Some(found)),
            None => plain.push_str(&format!(" {inside}")),
        }
        plain.push(' ');
        rest = rest.get(close..).map_or("", |r| r.get(1..).unwrap_or(""));
    }
    plain.push_str(rest);
    let mut words: Vec<String> = Vec::new();
    let mut before = None;
    for c in plain.chars() {
        let kind = match c {
            _ if c.is_ascii_digit() => 0,
            // Ideographs stand beside letters without a blank.
            _ if c.is_alphabetic() && c >= '\u{2e80}' => 3,
            _ if c.is_alphabetic() || c == '°' || c == 'µ' => 1,
            _ => 2,
        };
        if kind != 2 {
            match words.last_mut().filter(|_| before == Some(kind)) {
                Some(word) => word.extend(c.to_lowercase()),
                None => words.push(c.to_lowercase().collect()),
            }
        }
        before = Some(kind);
    }
    (words, unit)
}

fn without(words: &[String], out: &[usize]) -> Vec<String> {
    words.iter().enumerate().filter(|(i, _)| !out.contains(i)).map(|(_, word)| word.clone()).collect()
}

/// `joint 3`, `q3`, `theta_3_actual`, `fr3_joint3`: a word for joints and the only number behind it. The word stays in
/// the key: `q` and `theta` are two sets.
fn joint(words: &[String]) -> Option<(What, Vec<String>)> {
    let counted = |at: usize| {
        let mut numbers = (at + 1..words.len()).filter(|&i| words[i].parse::<usize>().is_ok());
        numbers.next().filter(|_| numbers.next().is_none()).map(|number| (at, number))
    };
    let (at, number) = (0..words.len()).rev().filter(|&i| is_in(JOINT, &words[i])).find_map(counted)?;
    let mut rest = without(words, &[at, number]);
    rest.push(words[at].clone());
    Some((What::Joint(words[number].parse().ok()?), rest))
}

fn axis(c: char) -> Option<usize> {
    "xyz".find(c)
}

/// `x`, `px`, `xm`, `x_1`, `Lx` of a laser, `tracker x`.
fn coordinate(words: &[String]) -> Option<(What, Vec<String>)> {
    let single = |i: &usize| {
        let (first, rest) = words[*i].split_at_checked(1)?;
        let letter = |word: &str| word.chars().next().filter(|_| word.len() == 1).and_then(axis);
        // xm, xist: measured; xc, xn, xt, xsoll: computed, nominal, target.
        let marks = rest.chars().count() == 1 || [MEASURED, INSTRUMENT, COMMANDED].iter().any(|list| is_in(list, rest));
        match (letter(first), letter(rest)) {
            (Some(a), None) if rest.is_empty() || marks => Some((a, Some(rest).filter(|rest| !rest.is_empty()))),
            (None, Some(a)) if "pmtcl".contains(first) => Some((a, Some(first).filter(|f| "ml".contains(*f)))),
            _ => None,
        }
    };
    // `3x3` is a size.
    let number = |i: usize| words.get(i).is_some_and(|word| word.chars().all(|c| c.is_ascii_digit()));
    let size = |i: usize| i > 0 && words[i] == "x" && number(i - 1) && number(i + 1);
    let found: Vec<(usize, (usize, Option<&str>))> =
        (0..words.len()).filter(|&i| !size(i)).filter_map(|i| Some((i, single(&i)?))).collect();
    let [(at, (axis, mark))] = found[..] else { return None };
    // Parts of a quaternion, of a matrix, of a speed: `q_x`, `o_x`, `w_x`.
    if words.iter().any(|word| matches!(word.as_str(), "q" | "o" | "w")) {
        return None;
    }
    let mut rest = without(words, &[at]);
    rest.extend(mark.map(String::from));
    Some((What::Coordinate(axis), rest))
}

/// `m_03`, `T14`, `m_0_3`.
fn matrix(words: &[String]) -> Option<(What, Vec<String>)> {
    let digits: String = words.iter().skip(1).map(String::as_str).collect();
    let [row, column] = digits.as_bytes() else { return None };
    let entry = |b: &u8| b.is_ascii_digit().then(|| usize::from(b - b'0')).filter(|&d| d < 5);
    let named = words.len() > 1 && words[0].chars().all(char::is_alphabetic);
    named.then_some((What::Matrix(entry(row)?, entry(column)?), vec![words[0].clone()]))
}

fn distance(words: &[String]) -> Option<(What, Vec<String>)> {
    // `dist_coeffs`: `dist` is a lens's distortion there.
    let of_lens = |w: &String| {
        matches!(w.as_str(), "coef" | "coefs" | "coeff" | "coeffs" | "coefficient" | "coefficients" | "distortion")
    };
    let is_lens = words.iter().any(of_lens);
    let at = words.iter().position(|word| is_in(DISTANCE, word)).filter(|_| !is_lens)?;
    Some((What::Distance, without(words, &[at])))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn what(name: &str) -> (What, Option<Unit>, Option<bool>) {
        let name = Name::of(name);
        (name.what, name.unit, name.measured)
    }

    #[test]
    fn names_of_joints() {
        for name in [
            "j1",
            "J1",
            "Joint 1",
            "joint_1",
            "q1",
            "Theta1",
            "θ1",
            "axis 1",
            "A1",
            "joint1_pos",
            "JointAngle1",
            "joint[1]",
            "fr3_joint1",
            "j2n6s300_joint_1",
            "joint_a1",
            "Gelenk 1",
            "关节1",
            "关节角1(°)",
        ] {
            assert_eq!(what(name).0, What::Joint(1), "{name}");
        }
        assert_eq!(what("J1 [deg]"), (What::Joint(1), Some(Unit::Deg), None));
        assert_eq!(what("q_1(rad)"), (What::Joint(1), Some(Unit::Rad), None));
        assert_eq!(what("j2_deg"), (What::Joint(2), Some(Unit::Deg), None));
        for name in ["tau_1", "dq1", "joint_1_velocity", "j1_error", "number", "temperature 1"] {
            assert_eq!(what(name).0, What::Other, "{name}");
        }
    }

    #[test]
    fn names_of_points() {
        assert_eq!(what("X  [mm]"), (What::Coordinate(0), Some(Unit::Mm), None));
        assert_eq!(what("y_m"), (What::Coordinate(1), Some(Unit::M), None));
        assert_eq!(what("zm"), (What::Coordinate(2), None, Some(true)));
        assert_eq!(what("Xist"), (What::Coordinate(0), None, Some(true)));
        assert_eq!(what("camera_matrix_3x3").0, What::Other);
        assert_eq!(what("X_meas"), (What::Coordinate(0), None, Some(true)));
        assert_eq!(what("pz"), (What::Coordinate(2), None, None));
        assert_eq!(what("MX Coord."), (What::Coordinate(0), None, Some(true)));
        assert_eq!(what("实测X(mm)"), (What::Coordinate(0), Some(Unit::Mm), Some(true)));
        assert_eq!(what("x [cm]"), (What::Coordinate(0), Some(Unit::Cm), None));
        assert_eq!(Name::of("J1[gon]").unread_unit(), Some("gon"));
        assert_eq!(Name::of("joint 2 (mrad)").unread_unit(), Some("mrad"));
        assert_eq!(Name::of("x_km").unread_unit(), Some("km"));
        for name in ["J1[deg]", "x [mm]", "q_1(rad)", "tracker x", "joint[1]"] {
            assert_eq!(Name::of(name).unread_unit(), None, "{name}");
        }
        for name in [
            "x_program",
            "x_pred",
            "controller x",
            "x_t",
            "x_cmd",
            "Nominal X",
            "xc",
            "x_nominal [mm]",
            "target x",
            "x_n",
            "理论X",
            "x soll",
            "Xsoll",
        ] {
            assert_eq!((what(name).0, what(name).2), (What::Coordinate(0), Some(false)), "{name}");
        }
        assert_eq!((what("Lx"), Name::of("Lx").key), ((What::Coordinate(0), None, None), vec!["l".to_owned()]));
        for name in ["q_x", "Q.z", "quat_x", "qx", "tcp q_y", "w_x"] {
            assert_eq!(what(name).0, What::Other, "{name}");
        }
        for name in ["U(95) X  [mm]", "x_dif", "Rx", "rx", "dx", "vx", "x error", "fx"] {
            assert_eq!(what(name).0, What::Other, "{name}");
        }
        assert_eq!(Name::of("x2").key, ["2"]);
        for name in ["target 2 x", "x_N2", "N2x", "T2.x"] {
            assert_eq!((Name::of(name).key, what(name).2), (vec!["2".to_owned()], None), "{name}");
        }
        assert_eq!(what("m_03").0, What::Matrix(0, 3));
        assert_eq!(what("T14"), (What::Matrix(1, 4), None, None));
        assert_eq!(what("T_x"), (What::Coordinate(0), None, None));
        for name in ["T_cmd_x", "n_x", "d_x", "x_t", "xt"] {
            assert_eq!(what(name).2, Some(false), "{name}");
        }
        assert_eq!(what("L").0, What::Distance);
        assert_eq!(what("dist_coeffs_1").0, What::Other);
        assert_eq!(what("distance_mm"), (What::Distance, Some(Unit::Mm), None));
        for name in ["Länge mm", "Abstand [mm]", "距离(mm)"] {
            assert_eq!(what(name), (What::Distance, Some(Unit::Mm), None), "{name}");
        }
        assert_eq!(what("pose").0, What::Own("pose"));
    }
}
